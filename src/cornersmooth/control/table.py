"""Tables of controls: how words are spelt and read, what each does, and what verification asks of it: a row a word.

A control has one TOML file in ``word_lists``. Keys:

``like``
    A control whose table holds where this one says nothing; its words come after those of this one.
``begin``, ``end``
    Blocks, as regular expressions, that a program begins and ends with.
``header``
    What may stand before that: a mark of the transfer.
``orders``
    What a comment begins with that the control would obey.
``points``
    Addresses whose numbers need their decimal point.
``whole``
    Those of them that count in full without it, in millimetres per minute.
``feed_in_plane``
    Whether F of a circular block that rises counts in the plane of the circle alone, and not along the helix.
``switches``
    Whether tip control is switched by blocks that the machine's file names.
``spelling``
    How the words are spelt: a class of `dialects`; ``"iso"`` unless it says otherwise.
``[grammar]``
    How the words are read: attributes of the control's class in `dialects`.
``[words]``
    What words do, a row a word.

The rows of `[words]`::

    "G44" = "tip=off axis: H"
    "G43" = "tool_length=. tip=off axis: H\\\\d+!=; plane=17 tool; length; H is compared with the statements"

WORDS
    Words with `` | `` between them, as the control's lexer names them: ``G1``, ``M6``, ``TRAORI``, a whole block of
    Klartext. ``PLANE *`` stands for all that begin so, ``/.../`` for all that a regular expression matches. Words that
    are named themselves come first, then rows in order. ``ROT alone`` is a word that has no other beside it, ``G10 R``
    one that has that letter, ``G54.2 P0`` that word.
EFFECTS
    ``GROUP=VALUE`` sets a modal group. The value ``.`` is the word itself, ``?`` is not known. All others: `LOSES`.
    What is compared with the CL file names its word: ``coolant=FLOOD``; ``coolant=-THRU`` alone ends that value.
LETTERS
    What belongs to the word in its block, and so is no place and no feed.
RULES; WHAT IT IS
    The row of a word that verification accepts: fields of `Row`, ``alone``, ``plane=17``, with ``_`` for blanks. Those
    of a group are the same for all controls: `_OF_GROUPS`; ``-first`` takes one back. ``T\\d+`` is a word of its first
    letter, ``/.../`` a pattern of its text, blanks left out; of a whole block with the rule ``block``. Letters have a
    pattern of what comes behind them: ``H\\d+``. Behind it, ``!`` says that one such word must be there, ``=`` that it
    is compared with the CL file, ``~`` that it may change from block to block. Small letters only belong to the word:
    they are not accepted.

A control that is ``like`` another has its rows, too, behind its own; ``""`` takes one back. A word without a row may do
anything. What a change of a group does beside is the same for all controls, and is in `state`.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property, lru_cache
from itertools import chain
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

#: words, and kind and value of what each says beside the motion
Means = Mapping[str, tuple[str, str]]

_LISTS: Final = Path(__file__).with_name("word_lists")

#: controls whose texts are read
CONTROLS: Final = tuple(sorted(file.stem for file in _LISTS.glob("*.toml")))


@cache
def word_table(control: str) -> Mapping[str, Any]:
    """Table of a control, with what it takes over of the control that it is like."""
    table = tomllib.loads(_LISTS.joinpath(f"{control}.toml").read_text(encoding="utf-8"))
    rows = table.get("words", {}).items()
    words = {word: row for key, row in rows for word in (key.split(" | ") if key[0] != "/" else [key])}
    base = word_table(table.pop("like")) if "like" in table else {"words": {}}
    words |= {word: row for word, row in base["words"].items() if word not in words}
    return {**base, **table, "words": words}


#: groups of words that turn, scale or mirror the places of the part begin so
FRAME: Final = "frame."


#: value of a group that no word has set yet
PRESET: Final = "preset"


class Group(NamedTuple):
    """A modal group, whatever the control."""

    values: str = ""  #: those that somebody reads; none where it is any word
    rules: str = ""  #: of all its words
    title: str = ""  #: how messages call it; by its name where there is none
    start: str | None = PRESET  #: what holds where a program begins
    changes: str = ""  #: what a change of it does beside, of `LOSES`
    lettered: bool = False  #: whether its value has the letters that belong to its word


GROUPS: Final[Mapping[str, Group]] = {
    "motion": Group("rapid line arc", start=None),
    "distance": Group("absolute incremental", "first", "positions", "absolute"),
    "units": Group("mm inch", "first", "", "mm", "length feed"),
    "feed": Group("minute inverse revolution", "first follows", "feed mode", "minute", "feed"),
    "plane": Group("", "first follows"),
    "path": Group("", "first", "path control", lettered=True),
    "offset": Group("", "first", "work offset", changes="shift", lettered=True),
    "tool_length": Group("", "", "tool length"),
    "edge": Group("", "", "cutting edge"),
    "compensation": Group("OFF LEFT RIGHT", "follows", "cutter compensation", "OFF"),
    "cycles": Group("", "follows"),
    "spindle": Group("", "compared follows"),
    "coolant": Group("", "compared follows"),
    "smoothing": Group("", "", "smoothing of the control", lettered=True),
    "tip": Group("off angles vectors both", "", "tool tip control", "off", "length"),
    "way": Group("shorter written", "", "ways of rotary axes"),
    "orientation": Group("vectors points angles planes", "", "interpolation of the tool axis"),
    "coordinates": Group("part machine", "", "coordinates of the tool axis"),
    f"{FRAME}dynamic": Group("", "follows outside", "dynamic work offset", "off"),
}
_FRAME: Final = Group("", "follows outside", "tilted plane", "off")


def group_of(name: str) -> Group | None:
    """The group of a name; None where there is none."""
    return GROUPS.get(name, _FRAME if name.startswith(FRAME) else None)


def title_of(name: str) -> str:
    """How messages call a group."""
    group = group_of(name)
    return group.title if group and group.title else name


#: what each effect leaves unknown
LOSES: Final[Mapping[str, str]] = {
    "nothing": "",
    "dwell": "",  # and the other words of the block are no motion
    "stop": "whether spindle and coolant are on: most machines stop them with the program",
    "axis": "as `length`, along the axis of the tool alone where the plane says which that is",
    "length": "XYZ count anew, those of the block already",
    "shift": "all axes count anew, those of the block already",
    "place": "the machine may be anywhere; places of the block are not those of the part",
    "turn": "as `place`: the control turns the rotary axes, and nobody says where to",
    "machine": "the axes of the block go to places of the machine, all axes where it names none",
    "tool": "as `place`, and whether tip control is still on",
    "anything": "all, but for frames that the program does not name: jumps and calls leave these as they are",
    "unknown": "all",
}

#: groups and effects that the CL file has words for, and what effects are that have another name there
_IN_CL: Final = frozenset(("spindle", "coolant", "stop", "end", "compensation", "register", "offset"))
_ALIKE: Final = {"end": "anything", "register": "length", "offset": "length"}

#: a number, where a row has a letter alone
_NUMBER: Final = r"[-+]?[\d.]+"

#: words without a name of their own whose rows are remembered
_REMEMBERED: Final = 4096

#: rules that are no text
_KINDS: Final[Mapping[str, Callable[[str], Any]]] = {
    **dict.fromkeys(("needs", "must", "after", "next", "previous", "extra"), re.compile),
    "share": float,
    "plane": int,
}

#: words of a list that are what they are, and no pattern
_LITERAL: Final = re.compile(r"[GM][\d.]+|R0|[A-Z_]{2}.*")


@dataclass(frozen=True)
class Row:
    """What a word does, and what verification asks of it; of a letter beside another word that alone."""

    effects: tuple[str, ...] = ()  #: as the row has them
    sets: tuple[tuple[str, str | None], ...] = ()  #: groups and their values; None where it is not known which
    does: frozenset[str] = frozenset()  #: of `LOSES`
    beside: frozenset[str] = frozenset()  #: letters of words of its own
    more: frozenset[str] = frozenset()  #: those of them without which it is another word

    pattern: re.Pattern[str] = re.compile("(?!)")  #: of its text, where verification accepts it
    says: str = field(default="", compare=False)  #: what it means, for the documentation

    # the block: words that must be beside it (`needs` finds the row, and may say more of that word)
    needs: re.Pattern[str] | None = None
    must: re.Pattern[str] | None = None
    block: bool = False  #: it is a whole block
    positions: bool = False  #: accepted only where the machine's file has positions, which are compared
    alone: bool = False  #: no other words may be beside it
    #: what the numbers in its groups may be of the tolerance: ``length`` of ε, ``angle`` of that of the tool axis
    share: float | None = None
    extra: re.Pattern[str] | None = None  #: words of its block that switch on what somebody must have wanted

    # blocks before and after
    after: re.Pattern[str] | None = None  #: a word that must have come since the last time
    previous: re.Pattern[str] | None = None  #: the block before
    next: re.Pattern[str] | None = None  #: the next block
    plane: int = 0  #: the G word of planes that must be in force where it is taken

    # its group: where the tool moves, that must be what it was at the first motion
    follows: bool = False  #: but not this one: it follows the CL file, and others compare it
    tool: bool = False  #: it may differ from tool to tool in a program with a `cycle`
    cycle: bool = False  #: a hole cycle of the control, a tilted plane, cutter compensation
    compared: bool = False  #: others compare the word with the CL file
    first: bool = False  #: one of its group must come before the first motion
    preset: str = ""  #: the usual one of these
    drops: str = ""  #: a group that the control forgets with it, and that must come after it
    off: bool = False  #: it switches the group off, which must hold at the end
    outside: bool = False  #: it may not be under tool tip control

    # where the tool is
    #: the tool goes away, and none but an approach may follow, in which work offset or tool length come again
    retract: bool = False
    high: bool = False  #: only after a retract; a control with such a word wants the tool high at the end, too
    #: the rotary axes must have been sent to zero before: where a parameter says so, the part program turns with the
    #: angles of that moment
    zero: bool = False

    @classmethod
    def all_of(cls, word: str, text: str) -> list[Self]:
        """Take a row of the table apart: that of its word, and those of letters that may be beside it.

        ValueError where it is none.
        """
        head, listed, rest = text.partition(";")
        rules, _, says = rest.partition(";")
        effects, _, beside = head.partition(":")
        letters, sets, does = beside.split(), list[tuple[str, str | None]](), set[str]()
        for effect in effects.split():
            name, given, value = effect.partition("=")
            group, plain = group_of(name), _ALIKE.get(effect, "stop" if name == "stop" else effect)
            if given and group and (not group.values or value in (*group.values.split(), "?")):
                sets.append((name, None if value == "?" else value))
            elif plain in LOSES:
                does |= {plain, *(("place",) if plain == "turn" else ())}
            else:
                raise ValueError(
                    f"{word!r} does {effect!r}: not one of {', '.join(LOSES)}, and no group with its value"
                )
        # a pattern of what comes behind the letter, which is a small one where it is not accepted
        names = [re.match("[A-Za-z]*", letter)[0].upper() if listed else letter for letter in letters]  # type: ignore[index]
        more = {
            name for name, letter in zip(names, letters, strict=True) if letter[0].isupper() and not {*letter} & {*"=~"}
        }
        row = cls(tuple(effects.split()), tuple(sets), frozenset(does), frozenset(names), frozenset(more))
        if row.group:
            is_off, of_group = dict(sets)[row.group] == "off", (group_of(row.group) or _FRAME).rules
            cycle = row.group.startswith(FRAME) and not is_off
            row = replace(row, off=is_off, cycle=cycle, follows="follows" in of_group)
            rules = f"{of_group} {rules}"
        return row._listed(word, letters, rules.split(), says.strip()) if listed else [row]

    def _listed(self, word: str, letters: Sequence[str], rules: Sequence[str], says: str) -> list[Self]:
        """The rows of a word that verification accepts, with what it wants of it, and of letters beside it."""
        values: dict[str, Any] = {}
        for name, given, text in (rule.removeprefix("-").partition("=") for rule in rules):
            if name not in _RULES:
                raise ValueError(f"{word!r} has the rule {name!r}: not one of {', '.join(sorted(_RULES))}")
            values[name] = _KINDS.get(name, str)(text.replace("_", " ")) if given else f"-{name}" not in rules
        values["alone"] = "alone" in values or "block" in values
        share = values.pop("share", None)
        pattern = word[1:-1] if word[0] == "/" else re.escape(word) if _LITERAL.fullmatch(word) else word
        rows, needed = [], []
        for letter in letters:
            plain = letter.rstrip("!=~")
            text, marks = f"{plain}{_NUMBER}" if len(plain) == 1 else plain, letter[len(plain) :]
            if plain[0].islower():
                continue
            needed += [text] * ("!" in marks)
            row = type(self)(pattern=re.compile(text), says=says, needs=re.compile(pattern))
            own = share if "(?P<" in text else None
            rows.append(replace(row, share=own, compared="=" in marks, follows="~" in marks))
        if needed:
            values["must"] = re.compile("|".join(needed))
        values["share"] = share if "(?P<" in pattern else None
        return [replace(self, pattern=re.compile(pattern), says=says, **values), *rows]

    @property
    def listed(self) -> bool:
        """Whether verification accepts the word."""
        return self.pattern is not UNLISTED.pattern

    @cached_property
    def group(self) -> str:
        """The group that verification follows; empty for none."""
        first = self.sets[0][0] if self.sets else ""
        return "" if first == "motion" or self.changes_tool else first

    @cached_property
    def tip_on(self) -> bool:
        """Whether tool tip control is on with it."""
        return dict(self.sets).get("tip", "off") != "off"

    @property
    def changes_tool(self) -> bool:
        """Whether another tool is taken."""
        return self.compared and (self.high or self.after is not None)


#: names of rules: the fields behind those of effects
_RULES: Final = frozenset(one.name for one in fields(Row)[5:]) - {"pattern", "says"}


#: what a word without a row does
UNKNOWN: Final = Row(does=frozenset(("unknown",)))

#: the row of words that verification does not accept, or not beside these
UNLISTED: Final = Row()


@dataclass(frozen=True, eq=False)
class Table:
    """The rows of a control."""

    named: Mapping[str, Row]  #: of words by their names
    patterns: tuple[tuple[re.Pattern[str], Row], ...]  #: of words by a pattern, in order
    listed: tuple[Row, ...]  #: of words that verification accepts; what is the control's own comes first
    blocks: tuple[Row, ...]  #: of whole blocks that it accepts
    positions: tuple[Row, ...]  #: of those that it accepts where the machine's file has positions
    groups: tuple[str, ...]  #: all that are set by a word
    #: letters that belong to a motion while it holds
    arguments: Mapping[str, frozenset[str]]

    def row(self, name: str, text: str = "", beside: Mapping[str, float] | None = None, *, alone: bool = False) -> Row:
        """What a word does in a block with some letters and their numbers; `alone` where it has no other word."""
        numbers = (beside or {}).items()
        others = (
            (f"{name} {letter}{value:g}" for letter, value in numbers),
            (f"{name} {letter}" for letter, _ in numbers),
        )
        for key in chain((f"{name} alone",) * alone, *others) if name in self._with_others else ():
            if key in self.named:
                return self.named[key]
        return self.named[name] if name in self.named else self._by_pattern(name, text)

    @cached_property
    def _by_pattern(self) -> Callable[[str, str], Row]:
        def row(name: str, text: str) -> Row:
            found = (row for pattern, row in self.patterns if pattern.fullmatch(name) or row.pattern.fullmatch(text))
            return next(found, UNKNOWN)

        return lru_cache(_REMEMBERED)(row)

    @cached_property
    def accepting(self) -> Callable[[str], list[Row]]:
        """Rows of those that verification accepts which a word fits."""
        return lru_cache(_REMEMBERED)(lambda word: [row for row in self.listed if row.pattern.fullmatch(word)])

    def switched(self, blocks: Sequence[str]) -> Table:
        """Table of a machine where such blocks, if any, switch tip control of the kinematics on and off."""
        table = self
        for block, tip in zip(blocks, ("both", "off"), strict=False):
            word, *others = block.split()
            beside = " ".join(f"{other}!" for other in others)
            rows = Row.all_of(word, f"tip={tip} place: {beside}; alone follows; tip control of the kinematics")
            key = " ".join((word, *(f"{other[0]}{float(other[1:]):g}" for other in others[-1:])))
            table = replace(table, named={**table.named, key: rows[0]}, listed=(*rows, *table.listed))
        return table

    def words(self, group: str, *values: str) -> list[str]:
        """Words that verification accepts and that set a group to one of some values."""
        return [word for word, row in self.named.items() if row.listed and dict(row.sets).get(group) in values]

    @cached_property
    def means(self) -> Means:
        """What words of the control do beside the motion, as the CL file has it."""
        effects = ((word, effect.partition("=")) for word, row in self.named.items() for effect in row.effects)
        return {word: (kind, value) for word, (kind, _, value) in effects if kind in _IN_CL and value not in (".", "?")}

    @cached_property
    def _with_others(self) -> frozenset[str]:
        """Words that rows name beside others."""
        return frozenset(name.split(" ")[0] for name in self.named if " " in name)

    @cached_property
    def frame_words(self) -> Mapping[str, re.Pattern[str]]:
        """What stands in each line that names a frame, in capitals, by its group."""
        parts: dict[str, list[str]] = {}
        rows = [(_sign(name.split(" ")[0].removesuffix("()")), row) for name, row in self.named.items()]
        for sign, row in (*rows, *((pattern.pattern, row) for pattern, row in self.patterns)):
            for group, _ in row.sets:
                if group.startswith(FRAME):
                    parts.setdefault(group, []).append(sign)
        return {group: re.compile("|".join(signs)) for group, signs in parts.items()}


def _sign(name: str) -> str:
    """Pattern of a word in a line, however it is spelt."""
    number = re.fullmatch(r"([GM])([\d.]+)", name)
    return rf"{number[1]}[ \t]*0*{re.escape(number[2])}(?![\d.]*[1-9])" if number else re.escape(name)


@cache
def table_of(control: str) -> Table:
    """The table of a control, one of `CONTROLS`."""
    named, patterns = dict[str, Row](), list[tuple[re.Pattern[str], Row]]()
    listed, blocks, positions = list[Row](), list[Row](), list[Row]()
    for word, text in word_table(control)["words"].items():
        if not text:
            continue
        row, *letters = Row.all_of(word, text)
        if row.block:
            (positions if row.positions else blocks).append(row)
            continue
        listed += [row, *letters] if row.listed else []
        if not row.sets and not row.does:
            continue
        if word[0] == "/":
            patterns.append((re.compile(word[1:-1]), row))
        elif word.endswith("*"):
            patterns.append((re.compile(re.escape(word[:-1]) + ".*"), row))
        else:
            named.setdefault(word[0] if row.listed and not _LITERAL.fullmatch(word) else word, row)
    rows = [*named.values(), *(row for _, row in patterns)]
    arguments: dict[str, frozenset[str]] = {}
    for row in rows:
        for group, value in row.sets:
            if group == "motion" and value is not None:
                arguments[value] = arguments.get(value, frozenset()) | row.beside
    groups = sorted({group for row in rows for group, _ in row.sets})
    lists = tuple(listed), tuple(blocks), tuple(positions), tuple(groups)
    return Table(named, tuple(patterns), *lists, arguments)


def any_of(pattern: re.Pattern[str], words: Iterable[str]) -> bool:
    """Whether any of the words is of a pattern."""
    return any(map(pattern.fullmatch, words))


def shown(pattern: re.Pattern[str]) -> str:
    """Regular expression in the user's words."""
    text = pattern.pattern
    for old, new in _PLAIN:
        text = text.replace(old, new)
    return text


_PLAIN: Final = (
    (r"(?=\d*[1-9])", ""),
    *((old, "…") for old in (r"\d+", r"\d{1,8}", r"\d{1,5}", r"[\d.]+", r"\w+", ".*", "(\\.\\d*)?")),
    (r"\.", "."),
    ("(?:", "("),
    ("|", " or "),
)
