"""What CYCLE statements say of holes: depth, feed, dwell, threads."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from cornersmooth.model import Program
from cornersmooth.statements.asked import Asking

#: words of CYCLE: plain drilling, depths, feeds, and those that say nothing of either
_PLAIN = {"DRILL", "FACE", "SPOT", "CSINK", "REAM", "BORE", "DEEP", "DEEP2", "BRKCHP", "TAP"}
_AT_FEED = {"REAM", "BORE"}
_PECKING = {"DEEP", "DEEP2", "BRKCHP"}
_DEPTH = ("FEDTO", "DEPTH")
#: feed words with the number of millimetres in their unit (0: that of the file) and whether they are per revolution
_FEEDS = {
    "MMPM": (1.0, False),
    "IPM": (25.4, False),
    "PERMIN": (0.0, False),
    "MMPR": (1.0, True),
    "IPR": (25.4, True),
    "PERREV": (0.0, True),
}
_RETURNS = ("RTRCTO", "RETURN")
_STEPS = ("STEP", "INCR", "1STPECK", "SUBPECK")
_OTHER = {"RAPTO", "CLEAR", *_RETURNS, *_STEPS, "DWELL"}


#: statements that say how fast the spindle turns
_TURNING = ("SPINDL", "CUTTER", "TLDATA")


@dataclass(frozen=True)
class Drilling:
    """What a hole should be."""

    depth: float = math.nan  #: mm: Below the pose, along the tool axis; NaN where the statement leaves it open.
    feed: float = math.nan  #: mm/min or mm/rev; NaN for the feed in force.
    per_revolution: bool = False
    dwell: float = 0.0  #: at the bottom; 0 for none
    tap: bool = False  #: whether the spindle turns with the feed, and back on the way out
    feed_out: bool = False  #: whether the tool comes out at feed
    #: mm: Above the pose, where rapids into the hole end, and where the tool leaves its line; NaN where the statement
    #: leaves it open.
    clearance: float = math.nan
    retract: float = math.nan
    #: mm: pecks, the last one again and again; none where one feed leads to the bottom, or the statement leaves it open
    steps: tuple[float, ...] = ()
    pecking: bool = False  #: whether there are pecks, though it may not come of what depth
    breaks_chips: bool = False  #: whether they stay in the hole

    @property
    def says(self) -> bool:
        """Whether words are written in the hole: a dwell or a tap."""
        return bool(self.dwell or self.tap)

    @property
    def level(self) -> float:
        """Height above the pose, mm, below which no rapid leads from hole to hole."""
        known = [height for height in (self.retract, self.clearance) if not math.isnan(height)]
        return known[0] if known else 0.0


def drilling(args: tuple[float | str, ...], program: Program, speed: float = 0.0) -> Drilling:
    """Interpret the arguments of a CYCLE statement.

    Only pairs of a known word and one number, and words for plain drilling, are interpreted; with anything else in it
    the whole statement is left open. NX counts depths upwards, all others downwards. The feed of a tap is its pitch,
    which needs the speed of the spindle, and so does a dwell in revolutions.
    """
    values: dict[str, float] = {}
    kinds, word, in_turns = set(), "", False
    pecks: dict[str, list[float]] = {name: [] for name in _STEPS}
    for value in args:
        if value == "REV" and word == "DWELL":
            in_turns = True
        elif value == "AUTO" and word in _RETURNS and word not in values:  # NX: to the control's own height
            word = ""
        elif isinstance(value, str):
            if word and word not in values:
                return Drilling()
            if value in _PLAIN:
                kinds.add(value)
                word = ""
            elif value in _FEEDS or value in _DEPTH or value in _OTHER:
                word = value
            elif value:
                return Drilling()
        elif not word or (word in values and word != "STEP"):
            return Drilling()
        else:
            values[word] = value
            if word in pecks:
                pecks[word].append(value)
    depths = [values[name] for name in _DEPTH if name in values]
    if not kinds or len(depths) != 1:
        return Drilling()
    depth = depths[0]
    if program.source.dialect == "nx":
        depth = -depth
    elif "DEPTH" not in values:
        depth = abs(depth)
    unit = program.mm_per_unit
    steps = tuple(unit * step for name in _STEPS for step in pecks[name])
    if depth < 0 or any(step <= 0.0 for step in steps) or (steps and not kinds & _PECKING):
        return Drilling()
    feeds = [(values[name] * (scale or unit), turn) for name, (scale, turn) in _FEEDS.items() if name in values]
    feed, per_revolution = feeds[0] if len(feeds) == 1 else (math.nan, False)
    dwell = values.get("DWELL", 0.0)
    if in_turns and (not speed or not dwell):
        return Drilling()
    dwell = float(round(1000.0 * (dwell * 60.0 / speed if in_turns else dwell)))
    above = _height(values, ("RAPTO",) if program.source.dialect == "hsm" else ("RAPTO", "CLEAR"), unit)
    retract = _height(values, _RETURNS, unit)
    found = Drilling(depth * unit, feed, per_revolution, dwell, clearance=above, retract=retract)
    if "TAP" not in kinds:
        pecking, breaks = bool(kinds & _PECKING), "BRKCHP" in kinds
        return replace(found, feed_out=bool(kinds & _AT_FEED), steps=steps, pecking=pecking, breaks_chips=breaks)
    if len(kinds) > 1 or steps or math.isnan(feed) or not (per_revolution or speed):
        return Drilling(clearance=above, retract=retract)
    return replace(found, feed=feed if per_revolution else feed / speed, per_revolution=True, tap=True, feed_out=True)


def _height(values: dict[str, float], words: tuple[str, ...], unit: float) -> float:
    """Height above the pose that the first of some words says, mm; NaN for none. HSM's CLEAR is an absolute height."""
    return next((values[word] * unit for word in words if word in values), math.nan)


def drillings(program: Program, poses: list[int]) -> list[Drilling]:
    """Cycle in force at each of the hole poses, ascending."""
    found: list[Drilling] = []
    on = False
    args: tuple[float | str, ...] = ()
    last = Drilling()
    asking = Asking(program)
    cycles = [statement for statement in program.statements if statement.word in ("CYCLE", *_TURNING)]
    k = 0
    for pose in poses:
        while k < len(cycles) and cycles[k].pose <= pose:
            words = [value for value in cycles[k].args if isinstance(value, str) and value]
            if cycles[k].word != "CYCLE":
                asking.take(cycles[k], 0)
            elif words != ["INIT"]:
                on = words[:1] not in (["OFF"], ["NOMORE"])
                args = cycles[k].args if on else args
            # a pitch, and a dwell in revolutions, hang on the speed of now
            last = drilling(args, program, asking.speed) if args else Drilling()
            k += 1
        found.append(last if on else Drilling())
    return found
