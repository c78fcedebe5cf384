"""SINUMERIK 840D sl and ONE: TRAORI with A3= B3= C3=, XH= YH= ZH= or rotary words; BSPLINE and POLY."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from cornersmooth.control.words import (
    BSPLINE,
    BY_WORD,
    NOT_NEGATIVE,
    NUMBER,
    POLY,
    POSITIVE,
    ZERO,
    Columns,
    Lexer,
    Line,
    Word,
    fixed,
    number_of,
    refused,
)
from cornersmooth.nc_reader.acts import (
    Acts,
    Beside,
    HoleCycle,
    Move,
    Running,
    Tilt,
    TiltedPlane,
    ToMachine,
    drill,
    wrong,
)
from cornersmooth.nc_reader.dialects import Dialect

#: names of words of several letters: vectors are I J K, second points U V W, as in `motion`
_NAMES: Final = {
    "A3": "I",
    "B3": "J",
    "C3": "K",
    "XH": "U",
    "YH": "V",
    "ZH": "W",
    "PL": "PL",
    "PW": "PW",
    "CR": "R",
    "SD": "SD",
    "SPOS": "SPOS",
}
_POLYNOMIALS: Final = {"X": "X", "Y": "Y", "Z": "Z", "XH": "U", "YH": "V", "ZH": "W"}
_NUMBER_ONLY: Final = re.compile(NUMBER)

#: G words of group 01 that are read
_CODES = (0.0, 1.0, 2.0, 3.0)
#: units of lengths, not of feeds
_LENGTHS_ALONE = ("G70", "G71")

#: heights of hole cycles; what follows them, and how the manual calls that
_ONE: Final = r"0*1(?:\.0*)?"
_HEIGHTS: Final = rf"(?P<travel>{NUMBER}),(?P<top>{NUMBER}),(?P<setup>{NOT_NEGATIVE}),(?P<bottom>{NUMBER})"
_DWELL: Final = rf"(?P<dwell>{NOT_NEGATIVE}|)"
_CYCLES: Final = {
    "CYCLE81": ("", ""),
    "CYCLE82": (f",,{_DWELL}", ",,DTB"),
    "CYCLE83": (
        rf",,,(?P<step>{POSITIVE}),{ZERO},{ZERO},{ZERO},{_ONE},(?P<out>{ZERO}|{_ONE})",
        ",,,FDPR,0,0,0,1,VARI",
    ),
    "CYCLE84": (
        rf",,(?:{ZERO})?,3,,(?P<pitch>{POSITIVE}),(?:{ZERO})?,(?P<speed>{NOT_NEGATIVE}),(?P=speed)",
        ",,0,3,,PIT,0,SST,SST1",
    ),
    "CYCLE85": (rf",,{_DWELL},(?P<feed>{POSITIVE}),(?P<back>(?P=feed))", ",,DTB,FFR,RFF"),
}

#: a new plane (_ST ends in 00, or is 0) with its shifts before and behind the turns, to which the rotary axes turn
_THREE: Final = rf"{NUMBER},{NUMBER},{NUMBER}"
_SWIVEL: Final = re.compile(
    rf"CYCLE800[ \t]*\((?:[0124],\"(?!0\")\w*\",(?:\d*00|0),(?P<mode>\d+),(?P<before>{_THREE}),(?P<angles>{_THREE}),"
    rf"(?P<behind>{_THREE}),[-+]?1(?:,[^()]*)?)?\)"
)

#: a BSPLINE says its degree, which is 3
_DEGREES: Final = ((None, False), (3.0, True))

#: words that say what kind a block is, with the code that stands for it
_KINDS: Final = {"POLY": POLY, "BSPLINE": BSPLINE, "SD": None}


class Siemens(Dialect):
    """Words of letters, words with ``=``, and keywords."""

    beside = frozenset(("M", "T", "S", "SPOS"))
    others = ("D", "N", "%")

    def __init__(self, control: str, rotary: str = "") -> None:
        super().__init__(control, rotary)
        self.lexer = _SiemensLexer(rotary)

    def alone(self, line: Line, state: Running) -> Acts | None:
        """As `Dialect.alone`: dwells, positions of the machine, hole cycles and planes."""
        words = [word for word in line.words if word.name != "N"]
        names, given = {word.name for word in words}, {word.name: word.value for word in words}
        if any(word[:2] == ("G", 4.0) for word in words):
            if "F" not in given:
                raise refused(line, "a dwell in revolutions", "give it in seconds")
            return iter((Beside("G", 4.0, f"{1000.0 * given['F']:.10g}"),))
        if "SUPA" in names:
            return self._to_machine(line)
        if names & _CYCLES.keys():
            return self._cycle(words, line, state)
        return self._plane(words, line) if "CYCLE800" in names else None

    def moves(self, word: Word) -> bool:
        """As `Dialect.moves`."""
        if word.name == "G":
            return word.value in _CODES
        return word.name in ("F", *self.lexer.places) or word.name.removeprefix(f"{BY_WORD} ") in self.rotary

    @staticmethod
    def event(word: Word) -> Beside:
        """As `Dialect.event`."""
        return Beside("M", 19.0, word.text) if word.name == "SPOS" else Dialect.event(word)

    def _cycle(self, words: Sequence[Word], line: Line, state: Running) -> Acts:
        """CYCLE81 to CYCLE85, called where the tool stands."""
        name, text = next(word.name for word in words if word.name in _CYCLES), words[0].text
        pattern, arguments = _CYCLES[name]
        match = re.fullmatch(rf"{name}\({_HEIGHTS}{pattern}\)", re.sub(r"[ \t]", "", text))
        if len(words) > 1 or match is None:
            hint = f"write {name}(RTP,RFP,SDIS,DP{arguments}) in its own block"
            raise refused(line, f"{text} is not understood", hint)
        if state.tip_control:
            yield wrong("CS506", line, f"a hole cycle under {state.tip_control}")
        if (speed := match.groupdict().get("speed")) and float(speed) != state.speed:
            yield wrong("CS506", line, f"CYCLE84 at {float(speed):g} revolutions, where S says otherwise")
        yield from drill(HoleCycle.written(match), state.modal.tip[0], state.modal.tip[1], line, state)

    def _plane(self, words: Sequence[Word], line: Line) -> Acts:
        """CYCLE800: a plane by turns about its own axes, one after another; without arguments none."""
        match = _SWIVEL.fullmatch(words[0].text)
        if len(words) > 1 or match is None:
            hint = 'write CYCLE800(0,"",0,57,0,0,0,A,B,C,0,0,0,-1), or CYCLE800()'
            raise refused(line, f"{words[0].text} is not understood", hint)
        elif match["mode"] is None:
            yield Tilt(None)
        else:
            mode, angles = int(match["mode"]), match["angles"].split(",")
            axes = [(mode >> shift) & 3 for shift in (0, 2, 4)]
            if mode > 0b111111 or 0 in axes or axes[0] == axes[1] or axes[1] == axes[2]:
                raise refused(line, f"CYCLE800 in the mode {mode}", "use 57: axis by axis about X, Y, Z")
            turns = [("XYZ"[axis - 1], float(angle)) for axis, angle in zip(axes, angles, strict=True)]
            plane = TiltedPlane.by(turns, angles)
            before, behind = (list(map(float, match[name].split(","))) for name in ("before", "behind"))
            x, y, z = (np.array(before) + plane.frame @ behind).tolist()
            yield Tilt(replace(plane, origin=(x, y, z)))

    def _to_machine(self, line: Line) -> Acts:
        """SUPA: a rapid in machine coordinates, without frames."""
        axes = self.machine_axes(line, {("SUPA", 0.0), ("G", 0.0), ("D", 0.0)})
        if not any(word[:2] == ("G", 0.0) for word in line.words):
            raise refused(line, "SUPA without G0", "positions of the machine are read in rapids only")
        yield Move({"G": 0.0})
        yield ToMachine(axes)

    def _mode(self, word: Word, line: Line, state: Running) -> Acts:
        """As `Dialect._mode`."""
        if (name := word.spelling) in _LENGTHS_ALONE:
            text = f"feeds under {name}, whose units the machine's basic system says: {name}0 says them"
            yield wrong("", line, text)
        yield from super()._mode(word, line, state)


class _SiemensLexer(Lexer):
    """Words of letters, words with ``=``, polynomials, keywords and calls."""

    word = re.compile(
        rf"(?P<axis>[ABC])[ \t]*=[ \t]*{BY_WORD}\([ \t]*(?P<angle>{NUMBER})[ \t]*\)"
        r"|PO\[(?P<po>\w+)\]=\((?P<factors>[-+.\d, \t]+)\)"
        rf"|(?P<name>[A-Z][A-Z]?\d?|SPOS)[ \t]*=[ \t]*(?P<given>{NUMBER})"
        rf"|(?P<letter>[A-Z])[ \t]*(?P<value>{NUMBER})(?!=)"
        r"|(?P<call>[A-Z_][A-Z_0-9]*)[ \t]*(?:\([^()]*\))?"
    )
    comment = re.compile(r";(.*)$")
    begins = re.compile(rb"\n[ /]*(?:N\d+ *)?(?:G|BSPLINE|POLY)")

    def __init__(self, rotary: str) -> None:
        self._names = {
            "G",
            "X",
            "Y",
            "Z",
            "F",
            "PL",
            "PW",
            "SD",
            "POLY",
            "BSPLINE",
            *rotary,
            *(f"{BY_WORD} {axis}" for axis in rotary),
        }
        self._names |= {f"{axis}{power}" for axis in "XYZUVW" for power in "23"}
        self._second = frozenset() if rotary else frozenset("IJKUVW")
        self.places = frozenset("XYZ" + (rotary or "IJKUVW"))

    def words(self, rest: str, place: int) -> list[Word]:
        """Words of a line from a place on; raises CS501."""
        if rest.startswith("%", place):  # a mark of the transfer
            return [Word("%", 0.0, rest[place:])]
        return super().words(rest, place)

    def named(self, match: re.Match[str]) -> Iterable[Word] | None:
        """Words of one match: an axis of a polynomial has several; a letter without a number is none."""
        if match["axis"]:
            flag = f"{BY_WORD} {match['axis']}"
            return [number_of(match, "angle", match["axis"]), fixed(match, flag, 1.0)]
        if match["po"]:
            return _factors(match)
        if word := match["name"]:
            name = _NAMES.get(word, word if len(word) == 1 else "=")
            if name == "SD":
                return [fixed(match, name, float(match["given"]))]
            found = number_of(match, "given", name)
            return [found if len(word) > 1 or word in "GM" else found._replace(text=f"{word}{match['given']}")]
        if letter := match["letter"]:
            if letter == "G":
                return [fixed(match, "G", float(match["value"]))]
            return [number_of(match, "value", f"centre {letter}" if letter in "IJK" else letter)]
        return [fixed(match, match["call"], 0.0)] if len(match["call"]) > 1 else None

    def block(self, given: Mapping[str, Word]) -> Columns | None:
        """Columns of a block with such words; None where they are no motion block."""
        code = given["G"].value if "G" in given else None
        second = {"R", "centre I", "centre J", "centre K"} if code in (2.0, 3.0) else self._second
        if not given.keys() <= self._names | second or not given.keys() & self.places:
            return None
        kinds = given.keys() & {"G", "POLY", "BSPLINE"}
        degree = given["SD"].value if "SD" in given else None
        if code not in (None, *_CODES) or len(kinds) > 1 or (degree, "BSPLINE" in given) not in _DEGREES:
            return None
        if "POLY" not in given and any(name[-1] in "23" for name in given):
            return None
        columns: Columns = {name.removeprefix("centre "): word for name, word in given.items() if name not in _KINDS}
        for name, kind in _KINDS.items():
            if kind is not None and name in given:
                columns["G"] = kind
        return columns


def _factors(match: re.Match[str]) -> list[Word] | None:
    """Words of a polynomial: the end, and the coefficients of the square and the cube."""
    axis, begin = _POLYNOMIALS.get(match["po"]), match.start("factors")
    words = []
    for k, part in enumerate(match["factors"].split(",")):
        if axis is None or k > 2 or not _NUMBER_ONLY.fullmatch(part.strip()):
            return None
        start = begin + len(part) - len(part.lstrip())
        words.append(Word(axis + ("", "2", "3")[k], float(part), match[0].strip(), start, start + len(part.strip())))
        begin += len(part) + 1
    return words
