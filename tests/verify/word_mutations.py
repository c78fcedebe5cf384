"""Texts with wrong words beside right motion, for every control, form and machine; run this for all of them.

``python -m verify.word_mutations`` in the folder of the tests judges every mutant and prints the score by class.
"""

from __future__ import annotations

import io
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from typing import TypeVar

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.nc import fit_settings, write
from cornersmooth.nc_reader.dialects import ReadingOptions
from cornersmooth.nc_reader.reader import Reader
from cornersmooth.nc_words.check import WordCheck
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from nc.cases import RUNNABLE, Case

from .form_mutations import EPS, PLACE, H, program_of

T = TypeVar("T")

ISO = ("fanuc", "mitsubishi", "haas", "linuxcnc", "generic")

#: words that change what a control does, and that no text of ours says where a tool moves
INSERTED = {
    "iso": {
        "work offset": ["G55", "G59", "G54.1 P3"],
        "machine positions": ["G53", "G53 X5. Y5.", "G28 X0."],
        "plane": ["G18", "G19"],
        "other units": ["G20"],
        "incremental": ["G91"],
        "shift of the zero": ["G92 X0.", "G52 X5.", "G10 L2 P1 X5."],
        "rotation, scale, mirror": ["G68 X0. Y0. R30.", "G51 X0. P2.", "G51.1 X0."],
        "exact stop": ["G9", "G61"],
        "other smoothing": ["G64 P5.", "G5.1 Q1", "G5 P10000", "G8 P0", "G187 P1"],
        "tool length": ["G43 H2", "G49", "G43.4 H9"],
        "cycle": ["G81 Z-5. R2. F100."],
        "call": ["M98 P1000", "G65 P9000", "M99"],
        "tool change without a tool": ["M6"],
        "number of a program": ["O0002", "O5"],
        "tape mark": ["%"],
        "end": ["M30", "M2"],
        "feed of words": ["G95", "G93"],
    },
    "siemens": {
        "work offset": ["G55", "G500", "G505", "G57"],
        "machine positions": ["G53", "G153", "SUPA"],
        "plane": ["G18", "G19"],
        "other units": ["G700", "G70"],
        "incremental": ["G91"],
        "shift of the zero": ["TRANS X5", "ATRANS X5", "ROT Z30", "SCALE X2", "MIRROR X0"],
        "exact stop": ["G60", "G9", "G601"],
        "other smoothing": ["G64", "G641", "G642", "CYCLE832(5,_FINISH,1)", "CYCLE832(0.0001,_ROUGH,3)"],
        "cutting edge": ["D0", "D2"],
        "transformation": ["TRAORI(2)", "TRAFOOF", "ORIMKS", "ORIAXES"],
        "call": ["L100", "STOPRE", "MCALL CYCLE81(5,0,1,-5)", "REPEAT A B"],
        "tool change without a tool": ["M6"],
        "number of a program": ["%_N_TWO_MPF", "%"],
        "end": ["M30", "M2", "M17"],
        "feed of words": ["G95"],
    },
    "heidenhain": {
        "work offset": ["CYCL DEF 247 DATUM SETTING Q339=+7", "CYCL DEF 7.0 DATUM SHIFT"],
        "machine positions": ["L X+5 R0 FMAX M91", "L Z+5 R0 FMAX M92"],
        "tilted plane": ["PLANE SPATIAL SPA+0 SPB+30 SPC+0 STAY"],
        "rotation, scale, mirror": ["CYCL DEF 10.0 ROTATION", "CYCL DEF 8.0 MIRROR IMAGE", "CYCL DEF 11.0 SCALING"],
        "other smoothing": ["CYCL DEF 32.1 T5", "CYCL DEF 32.0 TOLERANCE", "M120 LA5"],
        "tool length": ["TOOL CALL DL+5", "TOOL CALL X", "TOOL CALL 9 X"],
        "transformation": [
            "FUNCTION RESET TCPM",
            "M129",
            "M128",
            "FUNCTION TCPM F TCP AXIS SPAT PATHCTRL AXIS",
            "FUNCTION TCPM F CONT AXIS POS PATHCTRL AXIS",
        ],
        "call": ["LBL 1", "CALL LBL 1 REP5", "CALL PGM TWO"],
        "number of a program": ["BEGIN PGM TWO MM", "END PGM CORNERSMOOTH MM", "%"],
        "end": ["M30", "M2"],
        "feed of words": ["M136", "M103 F50"],
    },
}
RETRACT = re.compile(r"G28|G53|M91|SUPA")
DWELL = {
    "iso": "G91,G55,M5,M30,G0,G49,G20,X5.,G92 X0.,T5 M6,F5.,Q5".split(","),
    "siemens": "G91,G55,M5,M30,G0,L100,TRAFOOF,G700,D0,SUPA,X5,T5".split(","),
    "heidenhain": ["M5", "X+5", "FMAX"],
}
BEHIND = {
    "iso": ["G55", "P5", "Q5", "O5", "G18", "H5", "M98 P1"],
    "siemens": ["G55", "D2", "SUPA", "G9", "L100", "G60"],
    "heidenhain": ["M91", "M92", "M128", "M120"],
}
ORDERS = ["(PY,x=1)", ";py,x=1", "(ABORT,no)", "(LOGOPEN,a.txt)", "(PROBEOPEN a.txt)", "(MSG,hello)", "(DEBUG,#1)"]
HARMLESS = {"iso": ["G90", "G17", "G40"], "siemens": ["G90", "G17", "G40"], "heidenhain": ["M137"]}


@dataclass(frozen=True)
class Mutant:
    """A wrong text: its class, its lines, and the lines (from 1) of which a problem must name one; None if harmless."""

    kind: str
    lines: list[str]
    where: tuple[int, int] | None
    text: str = ""
    end: str = "\n"

    def found(self, named: list[tuple[int, str]]) -> bool:
        """Whether what is named is what should be."""
        if self.where is None:
            return not named
        lines = [int(line) for place, text in named for line in (place, *re.findall(r"of line (\d+)", text))]
        return any(self.where[0] <= line <= self.where[1] for line in lines)


@dataclass
class Score:
    """How mutants were judged."""

    judged: Counter[str] = field(default_factory=Counter)
    right: Counter[str] = field(default_factory=Counter)
    wrong: list[tuple[str, Mutant, list[tuple[int, str]]]] = field(default_factory=list)

    def take(self, case: Case, mutant: Mutant) -> None:
        """Judge one; what is found while the text is read needs no measuring."""
        self.judged[mutant.kind] += 1
        named: list[tuple[int, str]] = []
        good = mutant.where is not None and mutant.found(named_by_words(case, mutant.lines, mutant.end))
        if not good:
            named = named_in(case, mutant.lines, mutant.end)
            good = mutant.found(named)
        self.right[mutant.kind] += good
        if not good:
            self.wrong.append((str(case), mutant, named[:3]))


@cache
def text_of(case: Case) -> list[str]:
    """Lines of the right text."""
    form = case.choose()
    settings = fit_settings(Settings(tolerance=EPS, axis_length=H, method="proportional"), form, "mm")
    stream = io.BytesIO()
    write(smooth(program_of(case), settings), stream, form=form)
    return stream.getvalue().decode("ascii").splitlines()


def named_in(case: Case, lines: list[str], end: str = "\n") -> list[tuple[int, str]]:
    """What is wrong, and where."""
    try:
        found = verify(
            program_of(case),
            (end.join(lines) + end).encode("latin-1"),
            tolerance=EPS,
            axis_length=H,
            control=case.control,
            machine=case.choose().machine,
            tcp=case.tcp,
            weights=(1.0,),
        )
    except InputError as error:
        return [(error.line, f"{error.code} {error.what}")]
    return [(problem.nc_line, f"{problem.code} {problem.text}") for problem in found.problems]


def named_by_words(case: Case, lines: list[str], end: str = "\n") -> list[tuple[int, str]]:
    """What is wrong, as far as it is seen while the text is read; `verify` names that and what it measures."""
    data = (end.join(lines) + end).encode("latin-1")
    options = options_of(case)
    reader = Reader(None, options)
    check = WordCheck(options.control, options.dialect.lexer, EPS, weights=(1.0,))
    try:
        for _ in reader.chunks(check.watch(reader.lines(io.BytesIO(data)))):
            pass
    except InputError as error:
        return [(error.line, error.what)]
    return [(problem.nc_line, problem.text) for problem in (*check.problems, *reader.problems)]


@cache
def options_of(case: Case) -> ReadingOptions:
    """How the text of a case is read."""
    return ReadingOptions.of(case.control, case.choose().machine, tcp=case.tcp, tolerance=EPS, axis_length=H)


class Text:
    """Lines of a text and what they are."""

    def __init__(self, case: Case, lines: list[str]) -> None:
        self.case, self.lines = case, lines
        self.family = "iso" if case.control in ISO else case.control
        self.motion = [k for k, line in enumerate(lines) if self._is_motion(line)]
        self.straight = [k for k in self.motion if self._is_straight(k) and self._is_straight(k + 1)]
        self.curved = [k for k in self.motion if not self._is_straight(k)]
        self.statements = [
            k
            for k, line in enumerate(lines)
            if k not in self.motion and not line.startswith(("(", ";", "%", "K")) and " ; " not in line
        ]

    def _is_motion(self, line: str) -> bool:
        moves = bool(PLACE.search(line) or "PO[" in line) and "(" not in line.replace("=(", "") and "FROM" not in line
        return moves and not RETRACT.search(line)

    def _is_straight(self, k: int) -> bool:
        line = self.lines[k] if k < len(self.lines) else ""
        if self.family == "heidenhain":
            return re.match(r"\d+ LN? ", line) is not None
        return line.startswith("G1 ")

    def with_word(self, k: int, word: str) -> list[str]:
        """Text with a word behind those of a line."""
        return self.replaced(k, f"{self.lines[k]} {word}")

    def replaced(self, k: int, *new: str) -> list[str]:
        """Text with other lines for one."""
        return [*self.lines[:k], *new, *self.lines[k + 1 :]]

    def inserted(self, k: int, new: str) -> list[str]:
        """Text with a further line in front of one."""
        if self.family == "heidenhain" and new != "%":
            new = f"{self.lines[k].split()[0]} {new}"
        return [*self.lines[:k], new, *self.lines[k:]]


def mutants(case: Case, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    """Mutants of the text of a case, `each` of a kind."""
    text = Text(case, text_of(case))
    for kind in (
        _dwells,
        _skips,
        _points,
        _siemens_curves,
        _heads,
        _frames,
        _offsets,
        _tables,
        _insertions,
        _behind,
        _hidden,
        _harmless,
    ):
        yield from kind(text, rng, each)


def _some(rng: np.random.Generator, items: list[T], count: int) -> list[T]:
    return [items[k] for k in rng.permutation(len(items))[:count].tolist()]


def _dwells(text: Text, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    pattern = r"G4 |\d+ CYCL DEF 9\.1"
    for k in [k for k in text.statements if re.match(pattern, text.lines[k])][:1]:
        for word in _some(rng, DWELL[text.family], 3 * each):
            yield Mutant("words beside a dwell", text.with_word(k, word), (k + 1, k + 2), word)


def _skips(text: Text, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    for kind, places in (("motion", text.straight), ("statement", text.statements), ("curve", text.curved)):
        usable = [k for k in places if text.lines[k][:1] not in "%O"]
        for k in _some(rng, usable, each):
            mark = ["/", "/ ", "/2 "][int(rng.integers(3))]
            yield Mutant(f"block skip: {kind}", text.replaced(k, mark + text.lines[k]), (k + 1, k + 1), mark)


def _points(text: Text, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    if text.case.control not in ("fanuc", "mitsubishi", "haas"):
        return
    for k in _some(rng, text.motion, 2 * each):
        words = list(re.finditer(r"(?<![A-Z0-9])[XYZABCIJKUVW]-?(0*[1-9]\d*)\.\d*", text.lines[k]))
        if not words:  # zero is zero in any increment
            continue
        match = words[int(rng.integers(len(words)))]
        cut = match.start() + match[0].index(".")
        new = text.lines[k][:cut] + text.lines[k][match.end() :]
        yield Mutant("number without its point", text.replaced(k, new), (k - 8, k + 10), match[0])


def _siemens_curves(text: Text, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    rows = [k for k in text.curved if "BSPLINE" in text.lines[k]]
    for k in _some(rng, rows, each):
        yield Mutant("degree lost", text.replaced(k, text.lines[k].replace("SD=3 ", "")), (k + 1, k + 2))
        yield Mutant("degree changed", text.replaced(k, text.lines[k].replace("SD=3", "SD=2")), (k + 1, k + 2))
    for k in _some(rng, [k for k in text.curved if "PW=1" in text.lines[k]], each):
        yield Mutant("weight changed", text.replaced(k, text.lines[k].replace("PW=1", "PW=2")), (k - 8, k + 8))


def _heads(text: Text, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    first = text.motion[0]
    for k, line in enumerate(text.lines[:first]):
        if line.startswith(("G21 ", "G90 ", "G20 ", "G71")):
            for word in line.split():
                left = " ".join(other for other in line.split() if other != word)
                if word in text.lines[:first]:  # it is said again behind the retract
                    continue
                yield Mutant(f"head word lost: {_name(word)}", text.replaced(k, left), (1, first + 2), word)
            yield Mutant("safe line lost", text.replaced(k), (1, first + 2))
        if re.match(r"G64 ", line):
            yield Mutant("path control lost", text.replaced(k), (1, first + 2))
            yield Mutant("tolerance word beyond its share", text.replaced(k, "G64 P5. Q0"), (k + 1, k + 1))
            yield Mutant("tolerance word beyond its share", text.replaced(k, "G64"), (k + 1, k + 1))
    for k, line in enumerate(text.lines):
        if RETRACT.search(line):
            yield Mutant("retract lost", text.replaced(k), (k - 1, len(text.lines)), line)
    offsets = [k for k, line in enumerate(text.lines) if re.search(r"\bG54\b|DATUM SETTING", line)]
    for k in offsets[:1]:
        yield Mutant("work offset lost", text.replaced(k), (k, first + 3), text.lines[k])
    off = [k for k in text.statements if re.search(r"^G49$|TRAFOOF|RESET TCPM", text.lines[k]) and k > text.motion[-1]]
    for k in off:
        yield Mutant("tip control on at the end", text.replaced(k), (k - 1, len(text.lines)), text.lines[k])


def _offsets(text: Text, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    lines = text.lines
    for k in [k for k in text.statements if re.search(r"\bG(43(\.[45])?|234) H\d+", lines[k])]:
        other = re.sub(r" H(\d+)", lambda found: f" H{int(found[1]) + 1}", lines[k])
        yield Mutant("length offset of another tool", text.replaced(k, other), (k + 1, k + 3))
        yield Mutant(
            "length offset lost", text.replaced(k, re.sub(r" H\d+", "", lines[k])), (k - 1, text.motion[0] + 3)
        )
        # what is missing has no line of its own: named is the word before it that the CL file asks for
        before = max(j for j in text.statements if j < k and re.search(r"\b[TMS]\d", lines[j]))
        yield Mutant("length switched on lost", text.replaced(k), (before + 1, text.motion[0] + 3))
    if text.family == "heidenhain":
        for k in [k for k in text.statements if re.search(r"TOOL CALL \d+ Z", lines[k])]:
            other = re.sub(r"CALL (\d+)", lambda found: f"CALL {int(found[1]) + 1}", lines[k])
            yield Mutant("another tool", text.replaced(k, other), (k + 1, k + 3))
            yield Mutant("tool change lost", text.replaced(k), (0, text.motion[0] + 3))


def _tables(text: Text, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    """The table stands turned where tool tip control is switched on, or nobody says how it stands."""
    if not text.case.machine or not text.case.tcp or text.case.control not in ("fanuc", "mitsubishi"):
        return
    on = next(k for k, line in enumerate(text.lines) if line.startswith("G43.4"))
    names = re.findall(r"([ABC])[-0-9]", text.lines[on - 1])
    if len(names) == 2 and text.lines[on - 1].startswith("G0 "):
        turned = f"G0 {names[0]}0.0000 {names[1]}30.0000"
        yield Mutant("tip control on at a turned table", text.replaced(on - 1, turned), (on, on + 2))
        yield Mutant("table not sent to zero", text.replaced(on - 1), (on - 1, on + 2))
        later = [*text.lines[: on - 1], text.lines[on], text.lines[on - 1], *text.lines[on + 1 :]]
        yield Mutant("tip control on before the table is at zero", later, (on - 1, on + 2))


def _name(word: str) -> str:
    names = {
        "G90": "absolute",
        "G94": "feed mode",
        "G17": "plane",
        "G40": "compensation",
        "G49": "length",
        "G80": "cycle",
    }
    return names.get(word, "units")


def _frames(text: Text, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    lines, end = text.lines, len(text.lines)
    if lines[0] == "%":
        yield Mutant("first % lost", lines[1:], None)  # many controls show a program without its marks of the transfer
        yield Mutant("first % moved", [lines[1], lines[0], *lines[2:]], (1, 2))
        yield Mutant("last % lost", lines[:-1], None)
        yield Mutant("number of the program lost", [lines[0], *lines[2:]], (2, 2))
    if text.family == "heidenhain":
        yield Mutant("BEGIN PGM lost", lines[1:], (1, 1))
        yield Mutant("END PGM lost", lines[:-1], (end - 2, end))
    tail = next(k for k in range(end - 1, 0, -1) if re.search(r"\bM(30|2)$", lines[k]))
    yield Mutant("end of the program lost", text.replaced(tail), (tail - 1, end))
    for k in _some(rng, text.straight, each):
        moved = [*lines[:k], lines[tail], *lines[k:tail], *lines[tail + 1 :]]
        yield Mutant("end of the program moved", moved, (k + 1, k + 2))
    yield Mutant(
        "a block behind the end", [*lines, "M5" if text.family != "heidenhain" else "99 M5"], (end - 2, end + 1)
    )


def _insertions(text: Text, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    for kind, words in INSERTED[text.family].items():
        if kind == "feed of words" and text.case.machine and not text.case.tcp:
            continue
        for word in _some(rng, words, 2 * each):
            if word in ("G9", "G61") and text.case.control == "generic":
                continue
            if _standing(text, word):
                continue
            k = text.straight[int(rng.integers(len(text.straight)))] + 1
            last = k + 20 if kind == "feed of words" else k + 2  # the feed says it, where it is compared next
            yield Mutant(f"inserted: {kind}", text.inserted(k, word), (k + 1, last), word)


def _standing(text: Text, word: str) -> bool:
    """Whether a word holds anyway."""
    said = " ".join(text.lines[: text.motion[-1]])
    if word in ("G49", "TRAFOOF", "FUNCTION RESET TCPM", "M129"):
        on = {"iso": "G43|G234", "siemens": "TRAORI", "heidenhain": "TCPM F"}[text.family]
        return not re.search(on, said)
    return word in ("ORIMKS", "ORIAXES", "G64", "G93", "G5 P10000") and re.search(rf"\b{word}\b", said) is not None


def _behind(text: Text, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    for word in _some(rng, BEHIND[text.family], 3 * each):
        k = text.straight[int(rng.integers(len(text.straight)))]
        yield Mutant("a word behind a block", text.with_word(k, word), (k + 1, k + 2), word)
    for k in _some(rng, text.straight, each):
        word = text.lines[k].split()[2]
        yield Mutant("a word twice", text.with_word(k, word), (k + 1, k + 2), word)


def _hidden(text: Text, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    if text.case.control == "linuxcnc":
        for order in _some(rng, ORDERS, 4 * each):
            k = text.straight[int(rng.integers(len(text.straight)))] + 1
            yield Mutant("a comment that is obeyed", text.inserted(k, order), (k + 1, k + 1), order)
    elif text.family == "iso":
        for k in _some(rng, text.straight, each):
            yield Mutant("a block behind a semicolon", text.replaced(k, f"{text.lines[k]};G91"), (k + 1, k + 1))
    joined = [k for k in text.straight if k + 1 in text.motion]
    for k in _some(rng, joined, each):
        second = text.lines[k + 1].split(" ", 1)[1] if text.family == "heidenhain" else text.lines[k + 1]
        new = [*text.lines[:k], f"{text.lines[k]} {second}", *text.lines[k + 2 :]]
        yield Mutant("two blocks on one line", new, (k + 1, k + 2))
    for name, mark in (("CR", "\r"), ("VT", "\v"), ("FF", "\f")):
        for k in _some(rng, text.straight, each):
            at = text.lines[k].rindex(" ")
            new = text.lines[k][:at] + mark + text.lines[k][at + 1 :]
            yield Mutant(f"{name} inside a block", text.replaced(k, new), (k + 1, k + 2))
        comments = [k for k, line in enumerate(text.lines) if "TOOL" in line and re.search(r"[(;]", line)]
        for k in comments[:1]:
            new = text.lines[k].replace("TOOL", f"TO{mark}OL", 1)
            yield Mutant(f"{name} inside a comment", text.replaced(k, new), (k + 1, k + 2))
    marks = {"iso": "({})", "siemens": "; {}", "heidenhain": "{}"}[text.family]
    heads = [
        k for k in text.statements if k < text.motion[0] and re.search(r"G90|TCPM F|TRAORI|G43|G234", text.lines[k])
    ]
    for k in heads:
        if text.family == "heidenhain":
            number, rest = text.lines[k].split(" ", 1)
            hidden = f"{number} ; {rest}"
        else:
            hidden = marks.format(text.lines[k])
        need = text.case.control not in ("linuxcnc",) or "G90" in text.lines[k]
        if need and not re.match(r"G43 H", text.lines[k]):
            yield Mutant("a block hidden in a comment", text.replaced(k, hidden), (1, text.motion[2] + 3), hidden)


def _harmless(text: Text, rng: np.random.Generator, each: int) -> Iterator[Mutant]:
    k = text.straight[int(rng.integers(len(text.straight)))] + 1
    comment = {"iso": "(G91 G0 Z-50.)", "siemens": "; G91 G0 Z-50.", "heidenhain": "; L Z-50 FMAX"}[text.family]
    yield Mutant("harmless: a comment", text.inserted(k, comment), None)
    yield Mutant("harmless: lines end with CR LF", text.lines, None, end="\r\n")
    yield Mutant("harmless: blanks at the end", [f"{line} " if line != "%" else line for line in text.lines], None)
    if text.family != "heidenhain":
        yield Mutant("harmless: small letters", [line.lower() for line in text.lines], None)
        numbered = [line if line[:1] in "%(O;" else f"N{n} {line}" for n, line in enumerate(text.lines, 1)]
        yield Mutant("harmless: block numbers", numbered, None)
    for word in HARMLESS[text.family][: 2 * each]:
        before = text.motion[0]
        yield Mutant("harmless: what holds anyway", text.inserted(before, word), None, word)


def judged(cases: list[Case], each: int, most: int | None = None, told: Callable[[str], None] | None = None) -> Score:
    """Judge mutants of some cases: all, or so many of them, chosen at random."""
    score, rng = Score(), np.random.default_rng(len(cases))
    chosen = [(case, mutant) for case in cases for mutant in mutants(case, rng, each)]
    chosen = [chosen[k] for k in sorted(rng.permutation(len(chosen))[:most].tolist())]
    for place, (case, mutant) in enumerate(chosen):
        if place == 0 or case != chosen[place - 1][0]:
            assert named_in(case, text_of(case)) == []
            if told is not None:
                told(f"{place} of {len(chosen)} mutants judged, {len(score.wrong)} wrongly; next: {case}")
        score.take(case, mutant)
    return score


def main() -> None:
    """Judge all, and print the score."""
    each = int(sys.argv[1]) if len(sys.argv) > 1 else 2
    score = judged(RUNNABLE, each, told=lambda text: print(text, file=sys.stderr, flush=True))
    for case, mutant, named in score.wrong:
        print(f"MISSED {case}: {mutant.kind}: {mutant.text!r} in {mutant.where}: {named}")
    print(f"{'class':45} right of")
    for kind in sorted(score.judged):
        print(f"{kind:45} {score.right[kind]:5} {score.judged[kind]:5}")
    print(f"{len(score.judged)} classes, {sum(score.right.values())} of {sum(score.judged.values())} mutants right")


if __name__ == "__main__":
    main()
