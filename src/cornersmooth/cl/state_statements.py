"""Statements that change state: rapid, feed, units, axis, coordinates, cycles, cutter compensation, end."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from cornersmooth.cl.bulk import FARTHEST
from cornersmooth.cl.cycles import feeding_from, going_on, in_fixed_order, plain_cycle
from cornersmooth.cl.grammar import Argument, Record, joined, number
from cornersmooth.cl.poses import IDENTITY, UNIT_TOLERANCE, UP, System, Vector, system_of
from cornersmooth.cl.reader_state import ReaderState
from cornersmooth.cl.words import MOTION_WORDS, REFUSED_WORDS, TURNS
from cornersmooth.model import FeedMode, Keep, Statement, Units
from cornersmooth.statements import number_of

#: unit words of FEDRAT: millimetres per unit of the value (None: the unit of the file) and what it is per
FEED_UNITS: Final[dict[str, tuple[float | None, FeedMode]]] = {
    "MMPM": (1.0, FeedMode.PER_MINUTE),
    "MMPF": (1.0, FeedMode.PER_MINUTE),  # FwxPostProcessing
    "IPM": (25.4, FeedMode.PER_MINUTE),
    "FPM": (12 * 25.4, FeedMode.PER_MINUTE),
    "PERMIN": (None, FeedMode.PER_MINUTE),
    "MMPR": (1.0, FeedMode.PER_REVOLUTION),
    "IPR": (25.4, FeedMode.PER_REVOLUTION),
    "FPR": (12 * 25.4, FeedMode.PER_REVOLUTION),
    "PERREV": (None, FeedMode.PER_REVOLUTION),
}

#: feeds per tooth; no CL file says how many teeth a tool has
_PER_TOOTH: Final = frozenset({"MMPT", "IPT", "FPT", "PERTOOTH"})

UNIT_NAMES: Final[dict[str, Units]] = {
    **dict.fromkeys(("MM", "MILLIMETER", "MILLIMETERS", "MILLIMETRE", "MILLIMETRES", "METRIC"), "mm"),
    **dict.fromkeys(("IN", "INCH", "INCHES"), "inch"),
}

#: MCS of a section that is not turned
_MCS_OF_THE_OFFSET: Final = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]

#: by how much axes of a coordinate system may be off those of the part
_TURNED: Final = 1e-6

#: first words of CYCLE and CUTCOM that end them
_ENDS: Final = frozenset({"OFF", "NOMORE"})


#: normals of the planes of CLEARP
_PLANES: Final[dict[str, Vector]] = {"XYPLAN": UP, "YZPLAN": (1.0, 0.0, 0.0), "ZXPLAN": (0.0, 1.0, 0.0)}

#: the matrix [R|t] that changes nothing
_NO_TURN: Final = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]


def _rapid(state: ReaderState, record: Record) -> None:
    option = record.option
    if isinstance(option, float):
        raise state.fail("CS115", record, want="write RAPID, and GOTO with the position")
    if option in ("ON", "OFF"):
        state.rapid_on = option == "ON"
        state.rapid = False
        state.set_kind(state.n)
    elif record.args in ((), ("",), ("MODIFY",)):
        state.rapid = True
        if state.hole:
            state.note("CS144", record.line, what="RAPID inside CYCLE")
    else:  # FEDTO,LENGTH,n: the last part is at feed; all of it at feed is slow but safe
        state.rapid = option == "MODIFY"
        how = "made axis by axis or not, as the control has it" if state.rapid else "made at feed"
        state.note("CS140", record.line, text=joined(record.args), how=how)
        state.keep(record)


def _feed(state: ReaderState, record: Record) -> None:
    values = record.values
    words = record.words
    units = [word for word in words if word in FEED_UNITS]
    if len(values) != 1 or len(units) != len(words) or len(units) > 1:
        why = "the teeth of the tool are not known" if _PER_TOOTH & set(words) else "it is no single feed with its unit"
        raise state.fail("CS136", record, why=why)
    if not (math.isfinite(values[0]) and values[0] > 0):
        if not state.lenient:
            raise state.fail("CS119", record, value=values[0])
        state.note("CS144", record.line, what=f"feed of {values[0]:g}")
        state.keep(record)
        return
    if state.rapid:
        state.note("CS135", record.line)
    if not units:
        state.note("CS148", record.line)
    scale, mode = FEED_UNITS[units[0]] if units else (None, FeedMode(int(state.feed_mode.now)))
    if scale is None:
        state.unitless_feeds.add(len(state.feed.at))
    else:
        state.feed_units.append("mm" if units[0].startswith("MM") else "inch")
    state.feed_mode.set(state.n, mode)
    state.feed.append(state.n, values[0] * (scale or 1.0))


def _units(state: ReaderState, record: Record) -> None:
    name = record.args[0] if len(record.args) == 1 else None
    units = UNIT_NAMES.get(name) if isinstance(name, str) else None
    if units is None:
        raise state.fail("CS115", record, want="use UNITS/MM or UNITS/INCHES")
    state.stated_units.append((record.line, units, state.n))


def _multax(state: ReaderState, record: Record) -> None:
    if record.args not in ((), ("ON",), ("OFF",), ("NOMORE",)):
        raise state.fail("CS115", record, want="use MULTAX/ON or MULTAX/OFF")
    state.lock_axis(record.args[:1] in (("OFF",), ("NOMORE",)))


def _set_axis(state: ReaderState, record: Record, axis: Vector) -> None:
    length = math.hypot(*axis)
    if length == 0:
        raise state.fail("CS111", record)
    if not abs(length - 1) <= UNIT_TOLERANCE:
        if not (state.lenient and math.isfinite(length)):
            raise state.fail("CS112", record, length=length)
        state.note("CS139", record.line, length=length)
    state.set_axis((axis[0] / length, axis[1] / length, axis[2] / length))


def _csys(state: ReaderState, record: Record) -> None:
    if len(record.args) == 12:  # SolidWorks CAM: rows of [R|t]; positions stay in the world, R's z is the axis
        values = state.numbers(record)
        _set_axis(state, record, (values[2], values[6], values[10]))


def _msys(state: ReaderState, record: Record) -> None:
    """MSYS/origin,x,y of NX, also misspelt SYS: positions are in this system; those of all go into the first one."""
    args, values = record.args, record.values
    plain = len(values) == len(args) == 9 and max(map(abs, values)) <= FARTHEST
    system = system_of(values) if plain else None
    if state.n and state.first_system is None:  # positions before it are in no system that is known
        state.first_system = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0), None
    if state.first_system is None:
        state.first_system = args, system
    elif args == state.first_system[0]:
        _enter(state, IDENTITY)
    elif system is None or state.first_system[1] is None:
        _frame(state, record)
    else:
        _enter(state, system.seen_from(state.first_system[1]))
        state.note("CS146", record.line, word=record.word, into=f"the first {record.word}")


def _enter(state: ReaderState, system: System) -> None:
    if system is state.system:
        return
    if state.clearance is not None:  # the plane stays where it is
        change = state.system.seen_from(system)
        normal, point = state.clearance
        state.clearance = normal and change.vector(normal), change.point(point)
    state.enter_system(system)


def _clearance(state: ReaderState, record: Record) -> None:
    """CLEARP/d, /a,b,c,d or /XYPLAN,d, CLRSRF/x,y,z or /a,b,c,d: where RETRCT ends (ICAM, CLEARP and CLRSRF)."""
    values = record.values
    words = record.words
    normal: Vector | None = None
    if len(values) == 1 and len(words) < 2:
        normal = _PLANES.get(words[0]) if words else UP
    elif len(values) == 4 and not words:
        normal = values[0], values[1], values[2]
    if normal is not None and (length := math.hypot(*normal)) > 0:
        distance = values[-1] / length
        x, y, z = (part / length for part in normal)
        state.clearance = (x, y, z), (x * distance, y * distance, z * distance)
    elif record.word == "CLRSRF" and len(values) == 3 and not words:
        state.clearance = None, (values[0], values[1], values[2])  # the plane through this point, square to the tool
    else:
        state.clearance = None


def _offset(state: ReaderState, record: Record) -> None:
    """FIXTURE/n, FIXTUR/n, WCS/n: another work offset of the machine, which the text does not select."""
    if _changes(state, record.word, record.args, None):
        _frame(state, record)


def _mcs(state: ReaderState, record: Record) -> None:
    """MCS/X,Y and Z axes, origin of CAMplete: a section is in this system, seen from that of the work offset."""
    values = record.values
    if state.dialect.name != "hsm":
        _mcsys(state, record)
        return
    plain = len(values) == len(record.args) == 12 and max(map(abs, values)) <= FARTHEST
    system = system_of([*values[9:], *values[:6]]) if plain else None
    if system is None or np.abs(system.axes[:, 2] - values[6:9]).max() > UNIT_TOLERANCE:
        _frame(state, record)
        return
    state.set_axis(UP)  # GOTO of three numbers means Z of the section
    if values == _MCS_OF_THE_OFFSET:
        _enter(state, IDENTITY)
    else:
        _enter(state, system)
        state.note("CS146", record.line, word="MCS", into="the work offset")


def _prefun(state: ReaderState, record: Record) -> None:
    """PREFUN/n: a G code (ISO 4343), which may be any motion."""
    if record.option not in _ENDS:
        want = "a G code may move the tool: leave it out, and put it into the program with --header"
        raise state.fail("CS115", record, want=want)
    state.keep(record)


def _origin(state: ReaderState, record: Record) -> None:
    """ORIGIN/x,y,z,number,group of CATIA: without a shift it is a work offset, which is not compared."""
    values = record.values
    if state.dialect.name == "catia" and len(values) == len(record.args) == 5 and not any(values[:3]):
        state.keep(record)
    else:
        _turn(state, record)


def _zero(state: ReaderState, record: Record) -> None:
    """ZERO/n of CAMplete: the work offset, one for the whole program, where that of no ZERO is the first."""
    number = number_of(Statement(state.n, record.line, record.word, record.args))
    if state.dialect.name != "hsm" or number is None:
        _turn(state, record)
        return
    if _changes(state, "ZERO", record.args, (1.0,)):
        _other_system(state, record, f"ZERO/{number}")
    state.keep(record)


def _mcsys(state: ReaderState, record: Record) -> None:
    """MCSYS/NUM,n,POINT,...,VECTOR,...,VECTOR,... of MfgSuite: positions are in this system."""
    axes = record.values[:6] if record.word == "MCS" else record.values[4:10]
    turned = len(axes) == 6 and max(abs(a - b) for a, b in zip(axes, (1, 0, 0, 0, 1, 0), strict=True)) > _TURNED
    moved = state.n and (state.first_system is None or state.first_system[0] != record.args)
    if turned or moved:
        _frame(state, record)
    else:
        state.first_system = record.args, None


def _comment(state: ReaderState, record: Record) -> None:
    """Comments that say which system positions are in: Creo's $$-> CSYS, and the 3 rows after CATIA's $$*CATIA0."""
    text = str(record.args[0])
    if text.startswith("*CATIA0"):
        state.matrix = []
    elif text.startswith("->") and text[2:].lstrip().upper().startswith("CSYS"):
        _same_system(state, record, "CSYS", text.partition("/")[2].replace(",", " ").split())
    elif state.matrix is not None and len(row := text.split()) == 4:
        state.matrix += row
        if len(state.matrix) == 12:
            _same_system(state, record, "$$*CATIA0", state.matrix)
            state.matrix = None


def _same_system(state: ReaderState, record: Record, word: str, given: list[str]) -> None:
    matrix = tuple(value for value in map(number, given) if value is not None)
    if _changes(state, word, matrix, matrix):
        _other_system(state, record, word)


def _changes(state: ReaderState, word: str, value: tuple[Argument, ...], unstated: tuple[Argument, ...] | None) -> bool:
    """Whether a coordinate system is another one than that of the positions before it, where they stated one or not."""
    before = state.offsets.get(word, unstated)
    state.offsets[word] = value
    return state.n > 0 and value != before


def _cutcom(state: ReaderState, record: Record) -> None:
    option = record.option
    if option in ("LEFT", "RIGHT", "ON") and "LENGTH" not in record.args:
        if not state.exact.now:
            state.note("CS138", record.line)
        state.exact.set(state.n, Keep.CUTTER_COMPENSATION)
    elif option in _ENDS:
        state.exact.set(state.n, Keep.NO)


def _cycle(state: ReaderState, record: Record) -> None:
    state.hole = record.option not in _ENDS
    state.set_kind(state.n)
    args = plain_cycle(record.args, state.dialect.name, state.cycle_order)
    if state.dialect.name == "plain" and (ordered := in_fixed_order(args)) is not None:
        state.note("CS385", record.line)
        args = ordered
    if (fed := feeding_from(args, state.dialect.name)) is None:
        raise state.fail("CS115", record, want="RAPTO counts from CLEAR down: give the height over the hole as CLEAR")
    args = fed
    if state.cycle and args[:1] == ("ON",):
        args = going_on(state.cycle, args)
    if state.hole and record.option != "INIT":  # by which SolidWorks announces one
        state.cycle = args
    state.keep(replace(record, args=args))


def _frame(state: ReaderState, record: Record) -> None:
    if record.word == "TRNTYP" or not _changes_nothing(record):
        _other_system(state, record, record.word)


def _changes_nothing(record: Record) -> bool:
    """Whether a change of coordinates is off, or by nothing: its numbers are zero, or the matrix of no turn."""
    values = record.values
    return record.option in _ENDS or (bool(values) and not any(values)) or values == _NO_TURN


def _turn(state: ReaderState, record: Record) -> None:
    """TRANS, ORIGIN, ROTABL and the like: what changes nothing is a remark."""
    _frame(state, record)
    state.keep(replace(record, word="$$", args=(record.text,)) if _changes_nothing(record) else record)


def _other_system(state: ReaderState, record: Record, word: str) -> None:
    """Refuse a change of the coordinates of what follows."""
    if not state.lenient:
        raise state.fail("CS117", record, word=word)
    state.note("CS143", record.line, word=word)
    state.keep(replace(record, word="?"))  # the verdict names it


def _set(state: ReaderState, record: Record) -> None:
    if "INCR" in record.args or "INCREM" in record.args:
        raise state.fail("CS115", record, want="write absolute positions")


def _syn(state: ReaderState, record: Record) -> None:
    words = [value.strip("'").upper() for value in record.words]
    if words[:1] and words[0] in MOTION_WORDS:
        raise state.fail("CS115", record, want="motion statements keep their names")
    if len(words) == 2:  # ICAM: the first word now means the second, also a comment
        state.renamed[words[0]] = "$$" if words[1].startswith("$$") else words[1]


Handler = Callable[[ReaderState, Record], None]

#: of statements that become a part of the motion, or are kept by what they do
FED: Final[dict[str, Handler]] = {
    "RAPID": _rapid,
    "FEDRAT": _feed,
    **{word: _turn for word, code in REFUSED_WORDS.items() if code == TURNS},
    "ZERO": _zero,
    "ORIGIN": _origin,
    "PREFUN": _prefun,
    "CYCLE": _cycle,
}

#: of statements that the program keeps, too
KEPT: Final[dict[str, Handler]] = {
    "UNITS": _units,
    "UNIT": _units,
    "MULTAX": _multax,
    "TLAXIS": lambda state, record: _set_axis(state, record, state.vector(record)),
    "TOOL PATH": lambda state, _: state.set_axis(UP),  # NX repeats i,j,k on the first point of a path that is tilted
    "CSYS": _csys,
    "MSYS": _msys,
    "MCS": _mcs,
    "MCSYS": _mcsys,
    "CUTCOM": _cutcom,
    "SET": _set,
    "TRNTYP": lambda state, record: None if record.option == "WORLD" else _frame(state, record),
    "SYN": _syn,
    "FINI": lambda state, _: setattr(state, "finished", True),
    "SYS": _msys,
    "$$": _comment,
    "REMARK": _comment,
    # and 12 numbers: what $$-> CSYS is where Creo writes words of GPOST
    "CAMERA": lambda state, record: _same_system(state, record, "CSYS", [*map(str, state.numbers(record))]),
    "CLEARP": _clearance,
    "CLRSRF": _clearance,
    **dict.fromkeys(("FIXTUR", "FIXTURE", "WCS"), _offset),
}
