"""What wrote a file: dialects as data, and how they are recognised; formats that are no CL files.

Facts and their sources stand in the format notes of the project; the fingerprints are the words that only one system
writes.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from cornersmooth.cl.messages import error
from cornersmooth.model import Units
from cornersmooth.nc_reader.recognition import HTML

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
    #: Whether posts of Autodesk write it: each position under MULTAX/ON has its axis, three numbers after a tilted one
    #: are of another system; COOLNT/ON beside a kind of coolant is no coolant of its own.
    autodesk: bool = False
    units: Units = "mm"  #: where the file does not say
    decimals: int = 4  #: digits after the point of coordinates
    #: whether zeros at their end are left out, so that a statement alone does not tell the digits
    strips_zeros: bool = False


#: in the order in which they are tried: the more telling fingerprint first. Each is written by one system alone:
#: CSI_SET_ is not, SolidWorks CAM and Autodesk's CAMplete APT have it; of Autodesk's posts Mori APT is `mfgsuite`
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
    *(
        Dialect(name, mark, short_axis_up=True, multax_off_known=True, autodesk=True, decimals=6, strips_zeros=True)
        for name, mark in (
            ("mfgsuite", rb"^[ \t]*MCSYS[ \t]*/[ \t]*NUM\b"),
            ("hsm", rb"^[ \t]*(MODE[ \t]*/[ \t]*(MILL|TURN)\b|MOVARC[ \t]*/|CSI_TOOL_PATH[ \t]*/)"),
        )
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


#: how much of a file tells a format that is no CL file
_FOREIGN_HEAD: Final = 1 << 12

_APT: Final = "a CL file in APT form"

#: name of a format, what its head is like, and what to export instead
_FORMATS: Final = tuple(
    (name, re.compile(pattern, re.MULTILINE), hint)
    for name, pattern, hint in (
        ("Mastercam NCI file", rb"\A\s*1050\r?\n", "write the NC program with the post, and smooth it with 'filter'"),
        (
            "dump of an Autodesk post",
            rb"^(!DEBUG:|(\d+: *|\s*)on(Open|Section|Parameter|Rapid|Linear|Circular)\w*\()",
            "use the post 'CAMplete APT' or 'Simulation CLD'",
        ),
        ("robot program (KRL)", rb"^(&ACCESS |DEF +\w+ *\(|DEFDAT )", f"export {_APT}, or a table x,y,z,i,j,k"),
        ("robot program (RAPID)", rb"^\s*(MODULE +\w+|MoveL +\[)", f"export {_APT}, or a table x,y,z,i,j,k"),
        ("robot program (FANUC TP)", rb"\A\s*/PROG +\w", f"export {_APT}, or a table x,y,z,i,j,k"),
        ("robot program (URScript)", rb"^\s*move[ljpc]\(", f"export {_APT}, or a table x,y,z,i,j,k"),
        ("Klartext program", rb"^\d+ +BEGIN PGM ", "smooth the program itself with 'cornersmooth filter'"),
        ("STEP file (ISO 10303-21)", rb"\A\s*ISO-10303-21;", f"export {_APT} of the tool path"),
        ("JSON file", rb'\A\s*[\[{]\s*["\[{\]}\d-]', "write its poses as a table x,y,z,i,j,k"),
        ("YAML file", rb"\A(---\s|\w+:[ \t]*\n[ \t]*(- |\w+:))", "write its poses as a table x,y,z,i,j,k"),
        ("MATLAB script", rb"\A\s*\w+ *= *\[", "write the matrix as a table x,y,z,i,j,k, with writematrix"),
        ("XML file", rb"\A\s*<\?xml", f"export {_APT}"),
        ("web page (HTML)", HTML.pattern, f"export {_APT}"),
        ("CLData listing of SprutCAM", rb"^(MULTI)?GOTO +[XYZ] *-?[\d.]", f"export {_APT} with its APT post"),
        ("spreadsheet or archive (zip)", rb"\APK\x03\x04", "save it as CSV"),
        ("NumPy file", rb"\A\x93NUMPY", "write it with numpy.savetxt, with a header x,y,z,i,j,k"),
    )
)

_CLD: Final = re.compile(rb"\A(#[^\n]*\n|\s*\n)*UNIT +(MM|IN)\b", re.IGNORECASE)
_CLD_MOVE: Final = re.compile(r"(?:MOVE|RAPID|CUT)((?:\s+(?:T?[XYZ]|F)[-+]?[\d.]+)*)\s*")
_CLD_WORD: Final = re.compile(r"(T?[XYZ]|F)([-+]?[\d.]+)")
_CLD_AXES: Final = ("X", "Y", "Z", "TX", "TY", "TZ")


def refuse_foreign(data: bytes, file: str) -> None:
    """Refuse a tool path in another format (InputError CS206)."""
    head = data[:_FOREIGN_HEAD].removeprefix(b"\xef\xbb\xbf")
    for name, pattern, hint in _FORMATS:
        if pattern.search(head):
            raise error("CS206", file, 1, what=f"it is a {name}", hint=hint)


def is_simulation_cld(data: bytes) -> bool:
    """Whether a text is the Simulation CLD of Autodesk (post 43779)."""
    return _CLD.match(data[:_FOREIGN_HEAD]) is not None


def apt_of_simulation_cld(text: bytes, file: str) -> bytes:
    """Statements of APT for the lines of a Simulation CLD, line for line (InputError CS206).

    ``TOOL number diameter radius length``, then ``MOVE`` to where an operation begins and ``RAPID`` and ``CUT`` with
    the words of X Y Z, of the tool axis TX TY TZ and of the feed F that change; ``#`` begins a comment.
    """
    words: dict[str, str] = {}
    lines: list[str] = []
    for number, line in enumerate(text.decode("utf-8", "replace").split("\n"), 1):
        line = line.strip()
        kind, _, rest = line.partition(" ")
        cells = rest.split()
        if not line or line.startswith("#"):
            lines.append(f"$$ {line[1:].strip()}" if line else "")
        elif kind == "UNIT" and rest.strip().upper() in ("MM", "IN"):
            lines.append(f"UNITS/{'MM' if rest.strip().upper() == 'MM' else 'INCHES'}")
        elif kind == "STOCK":
            lines.append(f"STOCK/{','.join(cells)}")
        elif kind == "TOOL" and len(cells) == 4:
            lines.append(f"LOADTL/{cells[0]};CUTTER/{cells[1]},{cells[2]}")
        elif _CLD_MOVE.fullmatch(line):
            given = dict(_CLD_WORD.findall(line))
            words |= given
            if any(axis not in words for axis in _CLD_AXES):
                raise error(
                    "CS206", file, number, what="a move before all of X Y Z TX TY TZ are known", hint="begin with MOVE"
                )
            before = "" if kind == "CUT" else "RAPID;"
            feed = f"FEDRAT/{given['F']},PERMIN;" if "F" in given else ""
            lines.append(f"{feed}{before}GOTO/{','.join(words[axis] for axis in _CLD_AXES)}")
        else:
            what, hint = f"a line that Simulation CLD has not, {line[:40]!r}", "export it again, or as CAMplete APT"
            raise error("CS206", file, number, what=what, hint=hint)
    return "\n".join(lines).encode()
