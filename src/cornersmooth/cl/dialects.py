"""What CAM systems mean by the same words: dialects as data, and how they are recognised.

Facts and their sources stand in the format notes of the project; the fingerprints are the words that only one system
writes.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from cornersmooth.model import Units

#: how much of a file is looked at
HEAD: Final = 1 << 16


@dataclass(frozen=True)
class Dialect:
    """The rules that differ between CAM systems."""

    name: str
    fingerprint: bytes  #: regular expression, searched in the head of a file, line by line
    short_axis_up: bool = False  #: whether the axis of a GOTO of three numbers is +Z, and not the last one
    #: Whether the axis after MULTAX/OFF is known: locked where it is (CATIA V5, Syntax of Generated APT Instructions;
    #: PostWorks 7.2), or +Z (ISO 4343:2000, 5.32) with `short_axis_up`.
    multax_off_known: bool = False
    units: Units = "mm"  #: where the file does not say
    decimals: int = 4  #: digits after the point of coordinates
    #: whether zeros at their end are left out, so that a statement alone does not tell the digits
    strips_zeros: bool = False


#: in the order in which they are tried: the more telling fingerprint first. Each is written by one system alone:
#: CSI_SET_ is not, SolidWorks CAM and Autodesk's CAMplete APT have it; Autodesk's posts are all of `hsm`
DIALECTS: Final[tuple[Dialect, ...]] = (
    Dialect("makino", rb"^PPRINT/APTCL-SPEC, *MAKINO", decimals=7),
    Dialect(
        "creo",
        # with words of GPOST, the comments are REMARK
        rb"^(\$\$|REMARK *)(\* *Pro/CLfile|-> *(FEATNO|MFGNO|CSYS|CUTTER|END) */)|^[ \t]*(PPWORD|CAMERA)[ \t]*/",
        short_axis_up=True,
        multax_off_known=True,
        decimals=10,
    ),
    Dialect("catia", rb"^\$\$ +CATIA APT VERSION|^\$\$\*CATIA0", multax_off_known=True, decimals=5),
    Dialect("nx", rb"^[ \t]*(TOOL PATH/|TLDATA/|MSYS/|END-OF-PATH|PAINT/)"),
    Dialect(
        "hsm",
        rb"^[ \t]*(MODE[ \t]*/[ \t]*(MILL|TURN)\b|MOVARC[ \t]*/|CSI_TOOL_PATH[ \t]*/|MCSYS[ \t]*/[ \t]*NUM\b)",
        short_axis_up=True,
        multax_off_known=True,
        decimals=6,
        strips_zeros=True,
    ),
    Dialect(
        "solidworks",
        rb"^[ \t]*(TRNTYP[ \t]*/|UNIT[ \t]*/|CSYS[ \t]*/[ \t]*[-+.0-9]|RAPID/[ \t]*$|CYCLE/INIT)",
        decimals=6,
        strips_zeros=True,
    ),
    Dialect("ncl", rb"^REMARK .*NCLCAM", multax_off_known=True, units="inch"),
    Dialect("plain", rb""),
)

NAMES: Final = tuple(dialect.name for dialect in DIALECTS)


def recognise(data: bytes) -> Dialect:
    """Return the dialect of a CL text by its fingerprint; the last one fits any."""
    head, flags = data[:HEAD], re.MULTILINE | re.IGNORECASE
    return next(dialect for dialect in DIALECTS if re.search(dialect.fingerprint, head, flags))
