"""Writes docs/two_tools.md: the text of samples/two_tools.cls for every control, each line with its reason.

python docs/make_two_tools.py

Reasons stand below, and where there is nothing more to be said in the lists of words, `nc_reader/word_lists`.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from cornersmooth.cl import read
from cornersmooth.errors import InputError
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Form, choose_form, fit_settings, write
from cornersmooth.nc_reader.block_texts import said
from cornersmooth.nc_reader.reading_options import ReadingOptions
from cornersmooth.nc_reader.word_list import WordRule, word_list
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth

HERE = Path(__file__).resolve().parent
PAGE = HERE / "two_tools.md"
SAMPLE = HERE.parent / "samples" / "two_tools.cls"

#: control, machine, tool tip control
RUNS = (
    ("fanuc", "", True),
    ("fanuc", "table-ac", True),
    ("fanuc", "table-ac", False),
    ("mitsubishi", "", True),
    ("mitsubishi", "table-ac", True),
    ("mitsubishi", "table-ac", False),
    ("haas", "table-bc", True),
    ("haas", "table-bc", False),
    ("siemens", "", True),
    ("siemens", "table-ac", True),
    ("siemens", "table-ac", False),
    ("heidenhain", "", True),
    ("heidenhain", "table-ac", True),
    ("linuxcnc", "xyzac-trt", True),
    ("linuxcnc", "xyzac-trt", False),
    ("generic", "", True),
    ("generic", "table-ac", True),
    ("generic", "table-ac", False),
)

#: the same where a control has its own reason: control, line, why
_OWN_REASONS = (
    ("siemens", r"G54", "work offset; behind TRAORI, which deselects it"),
    (
        "siemens",
        r"TRAFOOF",
        "no transformation: none of the program before, none in the retract, which is in coordinates of the machine",
    ),
    (
        "fanuc|mitsubishi",
        r"G0 A0\.0+ C0\.0+",
        "rotary axes to zero, high up: tool tip control counts from where the table stands (WKP); at the end, too",
    ),
)

#: the same where a text has no tool tip control
_WITHOUT_TIP_CONTROL = [
    *((pattern, why) for _, pattern, why in _OWN_REASONS if pattern == "TRAFOOF"),
    (
        r"(G0|L) [AB]\+?0\.0+ C\+?0\.0+( FMAX)?",
        "rotary axes to the angles of a tool that stays upright, and to zero at the end, high up",
    ),
    (r"G49", "length of the tool off, behind the retract: alone it may move by that length"),
]

#: why a line stands where it stands; the first that fits
_REASONS = (
    (r"%", "begin and end of the tape"),
    (r"O\d+|BEGIN PGM .*|END PGM .*|[;(] ?TWO_TOOLS\)?|; CORNERSMOOTH|\(CORNERSMOOTH\)", "the program and its units"),
    (
        r"G21 G90 .*|G90 G94 .*",
        "safe start: nothing of the program before holds (units, absolute, feed per minute, "
        "plane, compensation, tool length and cycles off)",
    ),
    (r"G64 P.*", "the control's own blending, within its share of the tolerance"),
    (r"PLANE RESET STAY", "no tilted plane from the program before"),
    (
        r"G91 G28 Z0\.|G53 G0 Z0\.?|SUPA G0 Z0 D0|L Z-1 R0 FMAX M91",
        "retract: up to where no rotary axis and no tool change meets the part",
    ),
    (r"G90", "absolute again behind the retract"),
    (r"\(.*|;.*", "what the CL file says, or how the text was made"),
    (r"T\d+ M6|T\d+|M6|TOOL CALL \d+ Z", "tool change, high up"),
    (r"S\d+ M[34]|TOOL CALL Z S.*|M[34]", "spindle on, before the tool comes down"),
    (r"M[78]", "coolant as the CL file asks for it"),
    (r"M9", "coolant off, before the tool goes up"),
    (r"M5", "spindle off, behind the retract, or where the CL file says so"),
    (r"M1", "optional stop: the operator may look at the part and at the next tool"),
    (r"G54|CYCL DEF 247 .*", "work offset"),
    (r"D1", "length of the tool"),
    (r"M126", "rotary axes go the shorter way"),
    (r"(G0|L) [AB]\+?0\.0+ C\+?0\.0+( FMAX)?", "rotary axes to zero, high up"),
    (r"(G0|L) [AB]\S+ C\S+( FMAX)?", "rotary axes to the next angles, high up, where nothing meets the part"),
    (r"G43\.[45] H\d+|G234 H\d+|TRAORI|FUNCTION TCPM .*", "tool tip control on"),
    (r"G43 H\d+", "length of the tool"),
    (r"G43 H\d+ .*", "down to it, with the length of the tool: alone it may move the axis (parameter TOS)"),
    (r"ORI.*", "what the words of the tool axis mean, and how it turns between blocks"),
    (r"G49", "tool tip control and length of the tool off, behind the retract: alone it may move by that length"),
    (r"TRAFOOF|FUNCTION RESET TCPM", "tool tip control off: the retract is in coordinates of the machine"),
    (r"G9[345]|M13[67]", "feed mode of the blocks that follow"),
    (r"G4 .*|CYCL DEF 9\..*", "dwell"),
    (r"M30|M2", "end"),
)

_HEAD = """# Two tools on every control, line by line

Made by `python docs/make_two_tools.py` from `samples/two_tools.cls` (two tools, rapids with a tilted tool, five-axis
corners, feed per revolution, an arc, a dwell) at `-e 0.01 -H 10`; a test says when it is out of date. The reason of a
line is why it stands where it stands; feed moves one behind another are one row.
No text of this page but that of linuxcnc has run on a control.
"""


_REWINDS = """## An axis turns back within a cut

`--rewind 25`, where C of the machine goes from -280 to 280 degrees and the cut, 1.7 turns round a cone, farther: from
the last block before the pause to the first behind it.
"""

#: control, machine, tool tip control: where cuts are left
_REWIND_RUNS = (
    ("fanuc", "table-ac", True),
    ("fanuc", "table-ac", False),
    ("mitsubishi", "table-ac", True),
    ("haas", "table-bc", True),
    ("siemens", "table-ac", True),
    ("heidenhain", "table-ac", True),
    ("linuxcnc", "xyzac-trt", True),
)

#: why the blocks of the tool stand there, in order
_PAUSE = (
    "the cut is left here",
    "out along the tool axis in rapid, 25 mm",
    "over the place, high up: both rotary axes have turned",
    "down to 25 mm above the place, along the tool axis",
    "back into the cut along the tool axis, at its feed",
)


def cone() -> bytes:
    """CL text of 1.7 turns with a tool that leans outwards by 30 degrees."""
    turn = np.radians(np.arange(0.0, 621.0, 20.0))
    sine, cosine = math.sin(math.radians(30.0)), math.cos(math.radians(30.0))
    rows = [
        f"GOTO/{40 * math.cos(a):.4f},{40 * math.sin(a):.4f},{-a:.4f},"
        f"{sine * math.cos(a):.7f},{sine * math.sin(a):.7f},{cosine:.7f}"
        for a in turn.tolist()
    ]
    head = ["UNITS/MM", "LOADTL/3", "SPINDL/8000,RPM,CLW", "RAPID", f"GOTO/60,0,60,{sine},0,{cosine:.7f}"]
    return "\n".join([*head, "FEDRAT/500,MMPM", *rows, "RAPID", "GOTO/0,0,90,0,0,1", "FINI", ""]).encode()


def rewind_rows(control: str, name: str, *, tcp: bool) -> Iterator[str]:
    """Rows of the table of a pause in a cut."""
    machine = load_machine(name)
    axes = tuple(replace(axis, limits=(-280.0, 280.0)) if axis.name == "C" else axis for axis in machine.axes)
    form = choose_form(control, machine=replace(machine, axes=axes), tcp=tcp, rewind=25.0)
    stream = io.BytesIO()
    write(smooth(read(cone()), fit_settings(Settings(), form, "mm")), stream, form=form)
    lines = stream.getvalue().decode("ascii").splitlines()
    motion = [bool(re.search(r"\bX[-+\d].*Y[-+\d]", line)) for line in lines]
    feeds = [k for k, line in enumerate(lines) if motion[k] and not re.search(r"\bG0\b|FMAX", line)]
    out = next(before for before, behind in pairwise(feeds) if behind - before > 3)
    told = iter(_PAUSE)
    for k in range(out, feeds[feeds.index(out) + 1] + 1):
        yield f"| `{lines[k]}` | {next(told) if motion[k] else reason(lines[k], form)} |"


def text_of(control: str, machine: str, *, tcp: bool) -> tuple[Form, list[str]]:
    """Lines of the text of the sample."""
    form = choose_form(control, machine=load_machine(machine) if machine else None, tcp=tcp)
    program = read(SAMPLE.read_bytes(), name=SAMPLE.name)
    stream = io.BytesIO()
    write(smooth(program, fit_settings(Settings(), form, "mm")), stream, form=form)
    return form, stream.getvalue().decode("ascii").splitlines()


def reason(line: str, form: Form) -> str:
    """Why a line is there; what the list of words says of it where nothing more is to be said."""
    bare = re.sub(r"^\d+ ", "", line) if form.control == "heidenhain" else line
    reasons = [(pattern, why) for control, pattern, why in _OWN_REASONS if re.fullmatch(control, form.control)]
    reasons = _WITHOUT_TIP_CONTROL if form.orientation == "machine" else reasons
    for pattern, why in (*reasons, *_REASONS):
        if re.fullmatch(pattern, bare):
            return why
    options = ReadingOptions.of(
        form.control, form.machine, tcp=form.orientation != "machine", tolerance=0.01, axis_length=10.0
    )
    try:
        found = options.dialect.lexer.line(line.encode(), 1, None)
    except InputError:
        return ""
    words = [said(word) for word in found.words] or (["%"] if found.tape else [])
    if not words:
        return "comment"
    rules = word_list(form.control)
    text = " ".join(words)
    for block in rules.blocks:
        if block.pattern.fullmatch(text):
            return block.says
    if any(pattern.fullmatch(text) for pattern in (*rules.begin, *rules.end)):
        return "begins or ends the program"
    told = [_says(rules.words, word, words) for word in words]
    return "; ".join(dict.fromkeys(filter(None, told)))


def _says(rules: tuple[WordRule, ...], word: str, beside: list[str]) -> str:
    fitting = [rule for rule in rules if rule.pattern.fullmatch(word) and not rule.never]
    with_others = [rule for rule in fitting if rule.needs and any(rule.needs.fullmatch(other) for other in beside)]
    plain = [rule for rule in fitting if rule.needs is None]
    return next((rule.says for rule in (*with_others, *plain)), "")


def rows(form: Form, lines: list[str]) -> Iterator[str]:
    """Rows of the table of a text; feed moves one behind another are one row."""
    feeding = high = False
    for line in lines:
        why = reason(line, form)
        if re.match(r"G43 H\d+ G0", line):
            high = False
        motion = why.startswith(("motion", "radius"))
        if motion and not re.search(r"\bG0\b|FMAX", line):
            if not feeding:
                word = re.match(r"\d* ?(\S+)", line)
                yield f"| `{word[1] if word else line} ...` | feed moves, measured against the CL file |"
            feeding = True
            continue
        feeding = False
        if motion:
            over = re.search(r"\bZ[-+\d]", line) is None
            why = (
                "over the first position, high up"
                if over
                else "straight down to it"
                if high
                else "rapid of the CL file"
            )
            high = over
        yield f"| `{line}` | {why} |"


def page() -> str:
    """The whole page."""
    parts = [_HEAD]
    for control, machine, tcp in RUNS:
        form, lines = text_of(control, machine, tcp=tcp)
        options = f"--control {control}" + (f" --machine {machine}" if machine else "") + ("" if tcp else " --no-tcp")
        parts.append(f"## {control}{', ' + machine if machine else ''}{'' if tcp else ', without tip control'}\n")
        parts.append(f"Options: `{options}`.\n")
        parts.append("\n".join(["| line | reason |", "|---|---|", *rows(form, lines)]) + "\n")
    parts.append(_REWINDS)
    for control, machine, tcp in _REWIND_RUNS:
        parts.append(f"### {control}, {machine}{'' if tcp else ', without tip control'}\n")
        parts.append("\n".join(["| line | reason |", "|---|---|", *rewind_rows(control, machine, tcp=tcp)]) + "\n")
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
