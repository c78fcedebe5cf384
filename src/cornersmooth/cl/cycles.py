"""CYCLE in the words that all of the program reads: spellings of one CAM system that mean one thing only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from cornersmooth.cl.grammar import Argument
from cornersmooth.errors import SettingsError

#: what numbers without a word may be
ORDER: Final = ("DEPTH", "FEED", "PITCH", "CLEAR", "RAPTO", "RETURN", "STEP", "DWELL", "SKIP")

#: millimetres per inch: threads per inch as a pitch
_INCH: Final = 25.4

#: words of a cycle that have no number
_KINDS: Final = frozenset("DRILL FACE SPOT CSINK REAM BORE DEEP DEEP2 BRKCHP TAP".split())
_UNITS: Final = frozenset("MMPM IPM PERMIN MMPR IPR PERREV".split())
_STEPS: Final = frozenset("STEP INCR 1STPECK SUBPECK".split())
#: words of which a later one takes the place of all the others
_FAMILIES: Final = ({"FEDTO", "DEPTH"}, {"RTRCTO", "RETURN"}, _STEPS, {"RAPTO", "CLEAR"}, _UNITS, {"DWELL"})
#: Dialects in which RAPTO beside CLEAR is a height, too: CAMplete APT, PostWorks; NX has one of them
_HEIGHTS: Final = ("nx", "ncl", "hsm")


def order_of(text: str | None) -> tuple[str, ...]:
    """Words of `ORDER` from a text (SettingsError CS230)."""
    order = tuple(word.strip().upper() for word in text.split(",")) if text else ()
    wrong = [word for word in order if word not in ORDER]
    if wrong or len({*order} - {"SKIP"}) < len([word for word in order if word != "SKIP"]):
        raise SettingsError("CS230", f"numbers of CYCLE cannot be {text!r}", f"name each once: {', '.join(ORDER)}")
    return order


def plain_cycle(args: Sequence[Argument], dialect: str, order: tuple[str, ...] = ()) -> tuple[Argument, ...]:
    """Arguments of a cycle without spellings that mean one thing only; all others stay as they are.

    ``RIGID`` with ``PITCH`` is a tap (Autodesk's CAMplete post), ``TPI`` its pitch in threads per inch (PTC Creo);
    ``FLOAT`` says what holds the tap (NX). ``CSKDIA`` beside a depth is the diameter that comes of it (PTC Creo).
    ``ORIENT,0`` of the CAMplete post has no meaning: "unknown orientation". ``OPTION,CAM,n`` is a remark (NX).
    ``CYCLE/DRILL,ON,...`` is how ISO 4343 (10.8.7) begins one.
    """
    own = [value for value in args if value != ""]
    kind = own[0] if own else ""
    if own[1:2] == ["ON"] and kind in _KINDS:
        del own[1]
    own = _named(own, order) if order else own
    if kind == "RIGID" and _number_behind(own, "PITCH") is not None:
        own[0] = "TAP"
        own[own.index("PITCH")] = "PERREV"
    if kind == "TAP":
        threads = _number_behind(own, "TPI")
        if threads is not None and threads > 0.0:
            at = own.index("TPI")
            own[at : at + 2] = ["MMPR", _INCH / threads]
        _drop(own, "FLOAT", 1)
    if kind == "CSINK" and "DEPTH" in own and _number_behind(own, "CSKDIA") is not None:
        _drop(own, "CSKDIA", 2)
    if kind == "BORE" and dialect == "hsm" and _number_behind(own, "ORIENT") == 0.0:
        _drop(own, "ORIENT", 2)
    if "OPTION" in own and own[own.index("OPTION") + 1 :][:1] == ["CAM"] and _number_behind(own, "CAM") is not None:
        _drop(own, "OPTION", 3)
    return tuple(own)


def in_fixed_order(args: Sequence[Argument]) -> tuple[Argument, ...] | None:
    """Arguments of ISO 4343:1978 with words: kind, depth, pecks, unit, feed, clearance; None for others.

    Autodesk's post of ISO 4343 has this order, too, but its positions are the bottoms of holes.
    """
    unit = 4 if args[2:3] and args[2] in _STEPS else 2
    numbers = [value for value in (*args[1:2], *args[unit + 1 : unit + 3]) if isinstance(value, float)]
    if len(numbers) < 3 or args[0] not in _KINDS or args[unit] not in _UNITS or not numbers[0] > 0.0:
        return None
    return (args[0], "DEPTH", *args[1 : unit + 2], "CLEAR", *args[unit + 2 :])


def feeding_from(args: Sequence[Argument], dialect: str) -> tuple[Argument, ...] | None:
    """Arguments whose RAPTO is the height at which feeding begins; None where that is not above the hole.

    Beside CLEAR it counts from there down (PTC Creo, CL output for holemaking cycles; Autodesk's posts Mori APT and
    Common APT ISO 4343).
    """
    clear, down = _number_behind(args, "CLEAR"), _number_behind(args, "RAPTO")
    if dialect in _HEIGHTS or clear is None or down is None:
        return tuple(args)
    at, rest = args.index("RAPTO"), [*args]
    rest[at + 1] = clear - down
    _drop(rest, "CLEAR", 2)
    return tuple(rest) if down < clear else None


def going_on(before: Sequence[Argument], args: Sequence[Argument]) -> tuple[Argument, ...]:
    """Arguments of a cycle that goes on with those before by ``CYCLE/ON``, but for what the words behind it replace."""
    gone = set[Argument]().union(*(family for family in _FAMILIES if family & {*args}))
    kept, word = list[Argument](), ""
    for value in before:
        word = value if isinstance(value, str) and value not in ("AUTO", "REV") else word
        kept += [] if word in gone else [value]
    return (*kept, *args[1:])


def _named(args: Sequence[Argument], order: tuple[str, ...]) -> list[Argument]:
    """Arguments whose numbers get the words of an order, where none of them has one; else as they are."""
    words = [value for value in args if isinstance(value, str) and value]
    numbers = [value for value in args if isinstance(value, float)]
    units = [word for word in words if word in _UNITS]
    if not {*words} <= _KINDS | _UNITS or len(numbers) > len(order) or len(units) > 1:
        return list(args)
    spelled = {"FEED": (units or ["PERMIN"])[0], "PITCH": "PERREV"}
    named: list[Argument] = [word for word in words if word in _KINDS]
    for word, value in zip(order, numbers, strict=False):
        named += [] if word == "SKIP" else [spelled.get(word, word), value]
    return named


def _number_behind(args: Sequence[Argument], word: str) -> float | None:
    """Return the number right behind a word."""
    after = args[args.index(word) + 1 :][:1] if word in args else ()
    return next((value for value in after if isinstance(value, float)), None)


def _drop(args: list[Argument], word: str, count: int) -> None:
    if word in args:
        at = args.index(word)
        del args[at : at + count]
