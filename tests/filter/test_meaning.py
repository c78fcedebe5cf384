"""Two programs are compared by what they say: spelling is no difference, and whatever a control does is one."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache

import pytest

from cornersmooth.errors import CornersmoothError
from cornersmooth.filter.program import verify_programs
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import choose_form
from cornersmooth.settings import Settings
from filter.programs import PROGRAMS

Lines = list[str]


def passes(name: str, lines: Lines) -> bool:
    """Whether a program passes beside the one of a name."""
    control, machine, text = PROGRAMS[name][:3]
    form = choose_form(control, machine=load_machine(machine) if machine else None)
    try:
        found = verify_programs(text.encode(), ("\n".join(lines) + "\n").encode(), form, Settings(tolerance=0.02))
    except CornersmoothError:
        return False
    assert found.checked is not None
    return not found.checked.wrong


@cache
def lines_of(name: str) -> tuple[str, ...]:
    """The lines of a program."""
    return tuple(PROGRAMS[name][2].splitlines())


def each(pattern: str, new: str | Callable[[re.Match[str]], str]) -> Callable[[Lines], Lines]:
    """Rewrite all lines."""

    def rewritten(lines: Lines) -> Lines:
        changed = [re.sub(pattern, new, line) for line in lines]
        assert changed != lines, pattern
        return changed

    return rewritten


def numbered(lines: Lines) -> Lines:
    return [f"N{10 * k} {line}" if line[:1] in "GXSTM" else line for k, line in enumerate(lines)]


def between(*new: str) -> Callable[[Lines], Lines]:
    """Lines more between all others, but for what comes before the first block."""

    def rewritten(lines: Lines) -> Lines:
        first = next(k for k, line in enumerate(lines) if re.match(r"[GSTM]\d", line))
        return [*lines[:first], *(one for line in lines[first:-2] for one in (line, *new)), *lines[-2:]]

    return rewritten


def apart(line: str) -> list[str]:
    """The words of a block of tools and spindles in blocks of their own."""
    return line.split() if re.fullmatch(r"[ST]\d+ M\d", line) else [line]


def turned(lines: Lines) -> Lines:
    """The words of each block in the order of the alphabet."""
    blocks = [re.fullmatch(r"[A-Z][-+.\d]+( [A-Z][-+.\d]+)+", line) for line in lines]
    return [
        " ".join(sorted(line.split(), reverse=True)) if block else line
        for line, block in zip(lines, blocks, strict=True)
    ]


ISO: dict[str, Callable[[Lines], Lines]] = {
    "block numbers": numbered,
    "M03 for M3": each(r"\bM(\d)\b", r"M0\1"),
    "G01 for G1": each(r"\bG(\d)\b", r"G0\1"),
    "G001 for G1": each(r"\bG(\d)\b", r"G00\1"),
    "no blanks": each(r"(?<=\d|\.) (?=[A-Z])", ""),
    "more blanks": each(" ", "   "),
    "blanks at the end": each("$", "  "),
    "lower case": each(r"^([GXSTM].*)$", lambda match: match[1].lower()),
    "order of words": turned,
    "empty lines": between(""),
    "zeros behind": each(r"(\.\d+)\b", r"\g<1>00"),
    "zeros before": each(r"\bS(\d+)\b", r"S0\1"),
}
HARMLESS = {
    "fanuc words": ISO
    | {
        "words that act alone": lambda lines: [new for line in lines for new in apart(line)],
        "states said twice": lambda lines: [new for line in lines for new in [line] * (1 + (line in ("M8", "G54")))],
        "marks of the transfer": lambda lines: [line for line in lines if line != "%"],
        "a mark of the coding": lambda lines: ["\ufeff" + lines[0], *lines[1:]],
        "M2 for M30": each("^M30$", "M2"),
    }
    | {"comments": between("(A COMMENT)"), "comments behind": each(r"^(G.*)$", r"\1 (CUT)")},
    "siemens words": {
        **{name: ISO[name] for name in ("block numbers", "G01 for G1", "more blanks", "empty lines", "lower case")},
        "comments": between("; a comment"),
        "comments behind": each(r"^(G.*)$", r"\1 ; cut"),
    },
    "linuxcnc, G64, an arc inside": {
        **{name: ISO[name] for name in ("block numbers", "G01 for G1", "no blanks", "more blanks")},
        "comments": between("(a comment)"),
        "other comments": between("; a comment"),
    },
    "heidenhain words": {
        "other block numbers": lambda lines: [re.sub(r"^\d+", str(5 * k), line) for k, line in enumerate(lines)],
        "more blanks": each(r"(?<=\d) (?=[A-Z])", "  "),
        "comments": lambda lines: [*lines[:6], "99 ; a comment", *lines[6:]],
        "M03 for M3": each(r"\bM(\d)\b", r"M0\1"),
    },
}


@pytest.mark.parametrize(("name", "rewrite"), [(name, one) for name, some in HARMLESS.items() for one in some])
def test_another_spelling_is_no_difference(name: str, rewrite: str) -> None:
    lines = list(lines_of(name))
    changed = HARMLESS[name][rewrite](lines)
    assert changed != lines
    assert passes(name, changed)


def once(pattern: str, new: str | None, number: int = 0) -> Callable[[Lines], Lines]:
    """Another line in place of one; none for None."""

    def rewritten(lines: Lines) -> Lines:
        k = [k for k, line in enumerate(lines) if re.search(pattern, line)][number]
        return [*lines[:k], *([] if new is None else [re.sub(pattern, new, lines[k])]), *lines[k + 1 :]]

    return rewritten


def behind(pattern: str, new: str, number: int = 0) -> Callable[[Lines], Lines]:
    """A line more behind one."""

    def rewritten(lines: Lines) -> Lines:
        k = [k for k, line in enumerate(lines) if re.search(pattern, line)][number]
        return [*lines[: k + 1], new, *lines[k + 1 :]]

    return rewritten


HARMFUL = {
    "another tool": once("T1 M6", "T2 M6"),
    "no tool": once("T1 M6", None),
    "another speed": once("S9000", "S900"),
    "no start": once(" M3", ""),
    "the other way round": once("M3", "M4"),
    "no spindle": once("S9000 M3", None),
    "another work offset": once("G54", "G55"),
    "no work offset": once("G54", None),
    "another length": once("H1", "H2"),
    "no tip control": once("G43.4 H1", None),
    "another tip control": once("G43.4", "G43.5"),
    "inch": once("G21", "G20"),
    "distances": once("G90", "G91"),
    "another rapid": once("G0 Z50", "G0 Z49"),
    "a rapid lost": once("G0 Z50", None),
    "a rapid cuts": once("G0 Z50", "G1 Z50"),
    "the first rapid lost": once("G0 X0", None),
    "G49 lost": once("G49", None),
    "the end lost": once("M30", None),
    "coolant": behind("S9000", "M8"),
    "coolant in a run": behind("^G1", "M8", 4),
    "coolant in a block": once("^(G1.*)$", r"\1 M8", 4),
    "a stop in a run": behind("^G1", "M0", 4),
    "speed in a run": behind("^G1", "S100", 4),
    "speed in a block": once("^(G1.*)$", r"\1 S100", 4),
    "a dwell in a run": behind("^G1", "G4 P100", 4),
    "a length in a run": behind("^G1", "G43.4 H2", 4),
    "a register in a run": behind("^G1", "D2", 4),
    "a tool in a run": behind("^G1", "T2", 4),
    "a call in a run": behind("^G1", "M98 P10", 4),
    "a cut lost": once("^G1", None, 5),
    "the last cut lost": once("^G1", None, -1),
    "a pose beyond the tolerance": once(r"Y1\.500", "Y1.600", 2),
    "another axis": once(r"A2(\d)\.", r"A3\1.", 5),
    "another feed": once(r"F1000\.", "F2000."),
    "a feed without its point": once(r"F1000\.", "F10"),
    "a block that may be skipped": once("G49", "/G49"),
    "two lines the other way round": lambda lines: [*lines[:4], lines[5], lines[4], *lines[6:]],
    "a tool behind its change": lambda lines: [new for line in lines for new in reversed(apart(line))],
    "more at the end": behind("^M30", "G0 Z-50."),
    "a rapid more": behind("^G0 Z50", "G0 X0. Y0."),
    "other units of a place": once(r"Z50\.", "Z50"),
}


@pytest.mark.parametrize("name", HARMFUL)
def test_what_a_control_does_otherwise_is_a_difference(name: str) -> None:
    lines = list(lines_of("fanuc words"))
    changed = HARMFUL[name](lines)
    assert changed != lines
    assert not passes("fanuc words", changed)


def test_block_numbers_count_where_the_program_jumps() -> None:
    lines = list(lines_of("fanuc words"))
    end = next(k for k, line in enumerate(lines) if line == "M30")
    jumps = [*lines[:end], "N7 G0 Z60.", "N8 G0 Z70.", "GOTO 8", *lines[end:]]
    form = choose_form("fanuc", machine=load_machine("table-ac"))

    def wrong(new: Lines) -> bool:
        old = ("\n".join(jumps) + "\n").encode()
        found = verify_programs(old, ("\n".join(new) + "\n").encode(), form, Settings(tolerance=0.02))
        return bool(found.checked is None or found.checked.wrong)

    assert not wrong([line.replace("G0 Z60", "G00 Z60") for line in jumps])
    assert wrong([re.sub("^N([78])", lambda match: f"N{15 - int(match[1])}", line) for line in jumps])
