"""Which control a text looks as if it were for."""

from __future__ import annotations

import re
from typing import Final

#: what no other control says, for each control; the first that is found in a block of the head decides
_SIGNS: Final = (
    ("heidenhain", r"^\s*(\d+\s+)?(BEGIN PGM|TOOL CALL|CYCL DEF|FUNCTION TCPM|PLANE |LN X|L [XYZ][+-])"),
    ("siemens", r"^\s*(N\d+\s+)?(TRAORI|TRAFOOF|SUPA|MSG\(|ORI(WKS|MKS|VECT|CURVE|AXES)|BSPLINE|CYCLE\d+\(|PROC )"),
    ("siemens", r"\b(G710|G700|[ABC]3=|X\w*=AC\()"),
    ("haas", r"\bG234\b"),
    ("linuxcnc", r"(^\s*o<|\bM428\b|\bG5\.2\b|\bG64 P)"),
    ("fanuc", r"\bG43\.[45]\b|\bG6\.2 P|\bG5\.1 Q|\bG0?5 P10000\b"),
)
_COMMENT: Final = re.compile(r"\([^)]*\)|;.*")


#: what begins a line of a CL file or of a table, and a block of an NC program
_OTHER: Final = re.compile(
    rb"(?im)^\s*(GOTO\s*/|(FEDRAT|LOADTL|PARTNO|TOOL PATH|MULTAX|FINI)\b)"
    rb"|\A(\s*[#\"X][^\n]*\n)*\s*[-+]?\d*\.?\d+(\s*[,;\t ]\s*[-+]?\d*\.?\d+(E[-+]?\d+)?){2,}\s*$"
)
_BLOCK: Final = re.compile(rb"(?im)^[ \t/]*(N\d+[ \t]*)?(G\d{1,3}(\.\d)?(?![\d/,=])|L [XYZ][+-]|\d+ BEGIN PGM).*")


def first_block(head: bytes) -> re.Match[bytes] | None:
    """Motion in the beginning of an NC program; None where that is of a CL file or a table of points."""
    return None if is_cl_file(head) else _BLOCK.search(head)


def is_cl_file(head: bytes) -> bool:
    """Whether a file begins as a CL file, or as a table of points."""
    return _OTHER.search(head) is not None


#: how a page for a browser begins
HTML: Final = re.compile(rb"(?i)\A(\xef\xbb\xbf)?\s*(<!--[^>]*-->\s*)*<(!DOCTYPE\s+html|html\b)")

#: how files begin that are neither programs nor CL files
_FOREIGN: Final = {
    "an HTML page": HTML,
    "an SVG drawing or other XML": re.compile(rb"(?i)\A(\xef\xbb\xbf)?\s*<(\?xml|svg)\b"),
    "an STL model": re.compile(rb"(?i)\A\s*solid\b[^\n]*\n\s*(facet|endsolid)\b"),
}


def foreign_kind(head: bytes) -> str:
    """What a file that is neither a program nor a CL file looks like by its beginning; empty where nothing tells."""
    return next((kind for kind, sign in _FOREIGN.items() if sign.search(head)), "")


#: tool vectors and tip control: what a machine of three axes does not explain
_TIP: Final = re.compile(
    rb"(?i)(?<![A-Z_,#<])[ABC]3[ \t]*=|(?<![A-Z])T[XYZ][-+]?[\d.]"
    rb"|\b(?:TRAORI|FUNCTION TCPM|M128|M428|G43\.[45]|G234)"
)
_ASIDE: Final = re.compile(rb"\([^()\n]*\)|;.*|\"[^\"\n]*\"|\b(BEGIN|END) PGM.*")
#: numbers of axes without a point, and comments of those who need none; what no FANUC would run as it is meant
_NO_POINT: Final = re.compile(rb"(?i)(?<![A-Z])[XYZ][ \t]*[-+]?\d*[1-9]\d*(?![\d.])")
_BRACKETS: Final = re.compile(rb"\([^()\n]*\)")
_SEMICOLON: Final = re.compile(rb";[ \t]*[^\s]")


def names_tip_control(data: bytes) -> int | None:
    """Line, from 1, in which an NC program has tool vectors or words of tool tip control; None for nowhere."""
    for match in _TIP.finditer(data):
        start = data.rfind(b"\n", 0, match.start()) + 1
        end = data.find(b"\n", start)
        if _TIP.search(_ASIDE.sub(b"", data[start : len(data) if end < 0 else end])):
            return data.count(b"\n", 0, start) + 1
    return None


def needs_its_control(head: bytes) -> bool:
    """Whether a program of which nothing else tells has numbers or comments that FANUC takes for something else."""
    return bool(_SEMICOLON.search(_BRACKETS.sub(b"", head)) or _NO_POINT.search(_ASIDE.sub(b"", head)))


def recognise_control(head: bytes) -> str:
    """Control that the beginning of a text is written for; empty where nothing tells.

    FANUC and Mitsubishi say the same words: such a text counts as FANUC's.
    """
    for line in head.decode("latin-1").splitlines():
        block = line if line.lstrip().startswith("MSG(") else _COMMENT.sub("", line)
        for control, sign in _SIGNS:
            if re.search(sign, block):
                return control
    return ""
