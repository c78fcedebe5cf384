"""FANUC and what is like it: Haas, LinuxCNC, Mitsubishi, and the neutral form."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Set
from dataclasses import replace

from cornersmooth.control.table import word_table
from cornersmooth.control.words import (
    MOTION_CODES,
    NUMBER,
    NURBS,
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
    turned_frame,
    wrong,
)
from cornersmooth.nc_reader.dialects import Dialect

#: G words that send axes to positions of the machine
_TO_REFERENCE = (28.0, 30.0)
_IN_MACHINE = 53.0
#: hole cycles with what they take besides X Y Z R F, and the codes that stand beside them
_CYCLES = {73.0: "Q", 81.0: "", 82.0: "P", 83.0: "Q", 84.0: "P", 85.0: "", 89.0: "P"}
_BACK_TO_START = 98.0
#: G words of tilted planes, by what switches them on
_TILTED = 68.2
_PLANE_WORDS: Mapping[str, frozenset[float]] = {
    "G68.2": frozenset((_TILTED, 53.1, 69.0)),
    "G254": frozenset((254.0, 255.0)),
}
#: ends hole cycles
_NO_CYCLE = 80.0


class Iso(Dialect):
    """Words of one letter and a number; what differs between these controls is in `[grammar]` of their tables."""

    lexer: _IsoLexer
    #: milliseconds that ``G4 P`` counts in
    dwell: float = 1.0
    beside = frozenset("TSMHD")
    others = "NOQ"
    #: whether a comment may begin with a semicolon
    semicolon: bool = False

    def __init__(self, control: str, rotary: str = "") -> None:
        super().__init__(control, rotary)
        self.lexer = (_LinuxLexer if self.semicolon else _IsoLexer)(rotary, frozenset(word_table(control)["points"]))
        known = [codes for on, codes in _PLANE_WORDS.items() if self.retracts and on in self.table.named]
        self._planes = frozenset[float]().union(*known)
        #: whether ``M29 S`` asks for taps that turn the spindle with the feed
        self._rigid = "M29" in self.table.named

    def alone(self, line: Line, state: Running) -> Acts | None:
        """As `Dialect.alone`: switched kinematics, positions of the machine, hole cycles, planes and dwells."""
        codes = {word.value for word in line.words if word.name == "G"}
        given = {word.name: word.value for word in line.words}
        if codes & {*_TO_REFERENCE, _IN_MACHINE}:
            return self._to_machine(line, codes, state)
        if codes & _CYCLES.keys():
            return self._cycle(line, codes, state)
        if codes & self._planes:
            return self._plane(line, codes, state)
        if 4.0 in codes:
            time = self.dwell * given["P"] if "P" in given else 1000.0 * given.get("X", given.get("U", 0.0))
            return iter((Beside("G", 4.0, f"{time:.10g}"),))
        if _NO_CYCLE in codes:
            state.height, state.rigid = None, False
        state.rigid |= self._rigid and any(word.spelling == "M29" for word in line.words)
        return None

    def moves(self, word: Word) -> bool:
        """As `Dialect.moves`."""
        return word.value in MOTION_CODES if word.name == "G" else word.name in self.lexer.letters

    def motion(self, given: dict[str, float], line: Line, state: Running) -> Acts:
        """As `Dialect.motion`."""
        if self.lexer.odd_vector(given.keys(), given.get("G")):
            raise refused(line, "I J K beside rotary words", "leave out --machine for a text with tool vectors")
        of_length = any(word.name == "G" and self._effect(word, state).startswith("tool_length") for word in line.words)
        yield Move(given, later=of_length and not any(self.after_motion(*word[:2]) for word in line.words))

    def _cycle(self, line: Line, codes: set[float], state: Running) -> Acts:
        """A hole cycle, with G98: all that it takes stands in its block."""
        code, modal = next(iter(codes & _CYCLES.keys())), state.modal
        words = [word for word in line.words if word.name != "N"]
        given, tap = {word.name: word.value for word in words}, code == 84.0
        needed = {*"GXYZR", *("" if tap else _CYCLES[code])}
        if codes != {code, _BACK_TO_START} or len(given) + 1 != len(words):
            raise refused(line, f"G{code:g} beside other words", "give it G98 and nothing else")
        if not needed <= given.keys() <= needed | {"F", *_CYCLES[code]} or not self.retracts:
            what, hint = f"G{code:g} with words that are missing or not understood", "give X Y Z R and F in its block"
            raise refused(line, what, hint)
        if state.tip_control != "G43":
            yield wrong("CS506", line, f"a hole cycle under {state.tip_control or 'no length of the tool'}")
        if (mode := state.machine.groups["feed"]) == "inverse":
            yield wrong("CS506", line, "a hole cycle at inverse time feed (G93)")
        if tap and self._rigid and not state.rigid:
            yield wrong("CS506", line, "a tap without M29, which turns the spindle with the feed")
        if state.height is None or not math.isnan(modal.code):  # G0 or G1 ends a run of cycles, too
            state.height = modal.tip[2]
        feed = given.get("F", modal.feed)
        pitch = (feed if mode == "revolution" else feed / state.speed) if tap else None
        cycle = HoleCycle(
            state.height,
            given["R"],
            given["Z"],
            given.get("F") if pitch is None else pitch,
            step=given.get("Q", 0.0),
            chip=code == 73.0,
            dwell=self.dwell * given.get("P", 0.0),
            feed_out=code in (85.0, 89.0),
            pitch=pitch,
        )
        state.modal = replace(modal, feed=feed)  # that of the blocks after it, too
        yield from drill(cycle, given["X"], given["Y"], line, state)

    def _plane(self, line: Line, codes: set[float], state: Running) -> Acts:
        """G68.2, G53.1 and G69, or G254 and G255."""
        given = {word.name: word for word in line.words if word.name not in "GN"}
        count = sum(word.name != "N" for word in line.words)
        if len(codes) > 1 or count != 1 + len(given) or (given and _TILTED not in codes):
            raise refused(line, "words beside those of a tilted plane", "give it a block of its own")
        if codes & {69.0, 255.0}:
            yield Tilt(None)
        elif 53.1 in codes:
            yield Tilt(None, turn=True)
        elif _TILTED in codes:
            if given.keys() != set("XYZIJK"):
                raise refused(line, "G68.2 in another form", "give its zero X Y Z and the Euler angles I J K")
            turns = [(axis, given[name].value) for axis, name in zip("ZXZ", "IJK", strict=True)]
            numbers, origin = [given[name].text for name in "IJK"], tuple(given[name].value for name in "XYZ")
            yield Tilt(TiltedPlane.by(turns, numbers, needs="G43", turned=False, origin=origin))
        else:
            angles = state.modal.second[:2]
            frame = turned_frame(state.rotary, angles) if state.rotary is not None else None
            if frame is None or state.rotary is None or math.isnan(sum(angles)):
                raise refused(line, "G254 where the angles of the tables are not known", "name the machine")
            yield Tilt(TiltedPlane(frame, math.radians(state.rotary.angle_step), "G43"))

    def _to_machine(self, line: Line, codes: set[float], state: Running) -> Acts:
        """G91 G28 Z0. and the like: to the reference position without a detour; G53: in machine coordinates."""
        # no manual says whether a hole cycle drills there; G0 ends it
        if state.height is not None and math.isnan(state.modal.code) and 0.0 not in codes:
            raise refused(line, "a position of the machine within hole cycles", "write G80 before it")
        incremental = state.machine.groups["distance"] == "incremental"
        axes = self.machine_axes(line, {("G", code) for code in (*_TO_REFERENCE, _IN_MACHINE, 0.0, 90.0, 91.0)})
        for word in line.words:
            if word.name in axes and _IN_MACHINE not in codes and not (incremental and word.value == 0.0):
                raise refused(line, f"{word.text} on the way to the reference position", "write G91 and zero")
        if _IN_MACHINE in codes and (incremental or 0.0 not in codes):
            raise refused(line, "G53 without G90 and G0", "write G90 before it, and G0")
        if 0.0 in codes:
            yield Move({"G": 0.0})
        yield ToMachine(axes)


class _IsoLexer(Lexer):
    """Words of one letter and a number; a program name in brackets."""

    word = re.compile(rf"([A-Z])[ \t]*({NUMBER})|(<[^>]*>)")
    #: a semicolon at the end of a line is how listings show the end of a block
    comment = re.compile(r"\(([^)]*)\)|;[ \t]*$")
    begins = re.compile(rb"\n[ /]*(?:N\d+ *)?G")

    def __init__(self, rotary: str, points: frozenset[str]) -> None:
        self._rotary, self.points = rotary, points
        # beside rotary words K is a knot, and I J stand on arcs only
        self.letters = frozenset("GXYZFRPIJK" + (rotary or "UVW"))
        self.places = frozenset("XYZK" + (rotary or "IJUVW"))

    def named(self, match: re.Match[str]) -> list[Word]:
        """Word of one letter."""
        if match[3]:
            return [fixed(match, "O", 0.0)]
        return [fixed(match, "G", float(match[2])) if match[1] == "G" else number_of(match, 2, match[1])]

    def block(self, given: Mapping[str, Word]) -> Columns | None:
        """Columns of a block with such words; None where they are no motion block."""
        code = given["G"].value if "G" in given else None
        if not given.keys() <= self.letters or not given.keys() & self.places or self.odd_vector(given.keys(), code):
            return None
        if code not in (None, *MOTION_CODES) or ("P" in given and code != NURBS):
            return None
        return dict(given)

    def odd_vector(self, names: Set[str], code: float | None) -> bool:
        """Whether a block has words of a vector that rotary words have no use for."""
        if not self._rotary:
            return False
        return bool(names & {"I", "J", "K"}) and (code in (0.0, 1.0) or (code is None and "I" in names))


class _LinuxLexer(_IsoLexer):
    """The same, where a comment may begin with a semicolon."""

    comment = re.compile(r"\(([^)]*)\)|;(.*)$")
    aside = re.compile(rb"[ \t\r]*|(?:N\d+ )?G64 P[\d.]+ Q0")
