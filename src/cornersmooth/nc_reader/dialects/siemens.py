"""SINUMERIK 840D sl and ONE: TRAORI with A3= B3= C3=, XH= YH= ZH= or rotary words; BSPLINE and POLY."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cornersmooth.nc_reader.acts import (
    Acts,
    Beside,
    HoleCycle,
    ModalState,
    Move,
    Tilt,
    ToMachine,
    drill,
    numbers,
    wrong,
)
from cornersmooth.nc_reader.dialects.base import SILENT, Dialect
from cornersmooth.nc_reader.lexer import NUMBER, Lexer, fixed, number_of
from cornersmooth.nc_reader.planes import TiltedPlane, room_of, rotated_frame
from cornersmooth.nc_reader.words import BSPLINE, BY_WORD, POLY, Columns, Line, Word, refused, tools_first

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

_AXIS_FRAMES = ("ORIWKS", "ORIMKS")
_ORIENTATIONS = ("ORIVECT", "ORIPLANE", "ORICURVE", "ORIAXES")
_CODES = (0.0, 1.0, 2.0, 3.0)
#: units of lengths, not of feeds
_LENGTHS_ALONE = (70.0, 71.0)

#: hole cycles, and how many arguments they may have
_CYCLES: Final = {"CYCLE81": (4,), "CYCLE82": (6,), "CYCLE83": (12,), "CYCLE84": (12,), "CYCLE85": (8,)}

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
    """Words of letters, words with ``=``, and keywords.

    Parameters are those of `Dialect`.
    """

    digits = re.compile(rb"(?:([XYZ])|([ABC]3=|[XYZ]H=))[-+]?\d*\.(\d*)")

    def __init__(self, control: str, rotary: str = "") -> None:
        super().__init__(control, rotary)
        self.lexer = _SiemensLexer(rotary)

    def acts(self, line: Line, state: ModalState) -> Acts:
        """As `Dialect.acts`."""
        if any(name == "G" and value == 4.0 for name, value, *_ in line.words):
            given = {name: value for name, value, *_ in line.words}
            if "F" not in given:
                raise refused(line, "a dwell in revolutions", "give it in seconds")
            yield Beside("G", 4.0, f"{1000.0 * given['F']:.10g}")
            return
        if any(word[0] == "SUPA" for word in line.words):
            yield from self._to_machine(line, state)
            return
        if any(word[0] in _CYCLES for word in line.words):
            yield from self._cycle(line, state)
            return
        if any(word[0] == "CYCLE800" for word in line.words):
            yield from self._plane(line, state)
            return
        motion: dict[str, float] = {}
        for name, value, text, *_ in tools_first(line.words):
            if name == "G" and value in _CODES:
                motion["G"] = value
            elif name == "G":
                yield from self.mode(value, line, state)
            elif name in ("M", "T", "S"):
                yield Beside(name, value, text)
            elif name == "SPOS":
                yield Beside("M", 19.0, text)
            elif name in ("F", *self.lexer.places) or name.removeprefix(f"{BY_WORD} ") in self.rotary:
                motion[name] = value
            elif name in ("TRAORI", "TRAFOOF", *_AXIS_FRAMES, *_ORIENTATIONS):
                self._transform(name, state)
            elif name not in ("D", "N", "%") and self.effect(name) not in SILENT:
                raise self.not_understood(line, name, text)
        yield Move(motion)

    def _cycle(self, line: Line, state: ModalState) -> Acts:
        """CYCLE81 to CYCLE85, called where the tool stands."""
        words = [word for word in line.words if word.name != "N"]
        name, (_, _, inside) = words[0].name, words[0].text.partition("(")
        try:
            args = numbers(inside.rstrip(") "))
        except ValueError:
            args = []
        if len(words) > 1 or len(args) not in _CYCLES[name] or None in args[:4]:
            raise refused(
                line, f"{words[0].text} is not understood", "give RTP, RFP, SDIS and DP first, in its own block"
            )
        if state.tip_control:
            yield wrong("CS506", line, f"a hole cycle under {state.tip_control}")
        whole = [value if value is not None else 0.0 for value in args] + [0.0] * 12
        travel, top, setup, bottom, _, fifth = whole[:6]
        known = HoleCycle(travel, top + setup, bottom, top=top, from_clearance=False)
        wanted = "DP without DPR, and SDIS and DTB that are not negative"
        right = args[4:5] in ([], [None]) and setup >= 0.0 and (name == "CYCLE83" or fifth >= 0.0)
        if name == "CYCLE82":
            known = replace(known, dwell=1000.0 * fifth)
        elif name == "CYCLE83":
            right &= (
                args[5] is None and args[7:11] == [0.0, 0.0, 0.0, 1.0] and args[11] in (0.0, 1.0) and whole[6] > 0.0
            )
            wanted = "pecks of one depth (FDPR) alone"
            known = replace(known, step=whole[6], chip=args[11] == 0.0)
        elif name == "CYCLE84":
            right &= fifth == 0.0 and args[6:8] == [3.0, None] and whole[8] > 0.0
            right &= args[9] in (None, 0.0) and whole[10] == whole[11]
            wanted = "a pitch, SDAC 3, POSS 0, no DTB and one speed"
            known = replace(known, pitch=whole[8], feed=whole[8])
            if state.speed != whole[10]:
                yield wrong("CS506", line, f"CYCLE84 at {whole[10]:g} revolutions, where S says otherwise")
        elif name == "CYCLE85":
            right &= whole[6] == whole[7] and whole[6] > 0.0
            wanted = "one feed for both ways"
            known = replace(known, feed=whole[6], feed_out=True, dwell=1000.0 * fifth)
        if not right:
            raise refused(line, f"{words[0].text} is not understood", f"give {wanted}")
        yield from drill(known, state.modal.tip[0], state.modal.tip[1], line, state)

    def _plane(self, line: Line, state: ModalState) -> Acts:
        """CYCLE800: a plane by turns about its own axes, one after another; without arguments none."""
        words = [word for word in line.words if word.name != "N"]
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
            frame = rotated_frame(turns)
            before, behind = (list(map(float, match[name].split(","))) for name in ("before", "behind"))
            x, y, z = (np.array(before) + frame @ behind).tolist()
            yield Tilt(TiltedPlane(frame, room_of(angles), origin=(x, y, z)))

    def _to_machine(self, line: Line, state: ModalState) -> Acts:
        """SUPA: a rapid in machine coordinates, without frames."""
        axes = self.machine_axes(line, {("SUPA", 0.0), ("G", 0.0), ("D", 0.0)})
        if not any(word[:2] == ("G", 0.0) for word in line.words):
            raise refused(line, "SUPA without G0", "positions of the machine are read in rapids only")
        yield Move({"G": 0.0})
        yield ToMachine(axes)

    def _transform(self, name: str, state: ModalState) -> None:
        on = state.tip_control.startswith("TRAORI")
        if name in _ORIENTATIONS:
            state.orientation = name
        elif name in _AXIS_FRAMES:
            state.axis_frame = name
        else:
            on = name == "TRAORI"
        words = ("TRAORI", state.axis_frame, state.orientation) if on else ()
        state.tip_control = " ".join(filter(None, words))

    def mode(self, code: float, line: Line, state: ModalState) -> Acts:
        """Take a G word outside group 01 that changes what holds from block to block."""
        if code in _LENGTHS_ALONE:
            what = f"feeds under G{code:g}, whose units the machine's basic system says: G{code:g}0 says them"
            yield wrong("", line, what)
        yield from super().mode(code, line, state)


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

    def words(self, rest: str, place: int, number: int, name: str | None) -> list[Word]:
        """Words of a line from a place on; raises CS501."""
        if rest.startswith("%", place):  # a mark of the transfer
            return [Word("%", 0.0, rest[place:])]
        return super().words(rest, place, number, name)

    def named(self, match: re.Match[str]) -> Iterable[Word] | None:
        """Words of one match: an axis of a polynomial has several; a letter without a number is none."""
        if match["axis"]:
            flag = f"{BY_WORD} {match['axis']}"
            return [number_of(match, "angle", match["axis"]), fixed(match, flag, 1.0)]
        if match["po"]:
            return _factors(match)
        if word := match["name"]:
            name = _NAMES.get(word, word if len(word) == 1 else "=")
            return [fixed(match, name, float(match["given"])) if name == "SD" else number_of(match, "given", name)]
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
