"""The closed list of words of each control: what they are, what must hold before the tool moves, where they may stand.

They are data of TOML tables (`nc_reader.word_tables`), with the manual that they are from. Keys:

``begin``, ``end``
    Blocks, as regular expressions, that a program begins and ends with.
``header``
    What may stand before that: a mark of the transfer.
``orders``
    What a comment begins with that the control would obey.
``[words]``
    A row a word: ``"WORDS" = "EFFECTS: LETTERS; RULES; WHAT IT IS"``. WORDS and EFFECTS are as in `control.table`;
    ``/.../`` is a pattern of the text of the word, blanks left out, and ``T\\d+`` one that begins with its letter.
    LETTERS are those of words that may be beside it, with a pattern of what comes behind the letter: ``H\\d+``. Behind
    it, ``!`` says that one such word must be there, ``=`` that it is compared with the CL file, ``~`` that it may
    change from block to block. Small letters only belong to it: they are not on the list. RULES are fields of
    `WordRule`: ``alone``, ``plane=17``, with ``_`` for blanks. Those of a group are the same for all controls:
    `_OF_GROUPS`; ``-first`` takes one back.
``[blocks]``
    Blocks that count as a whole: ``"PATTERN" = "RULES; WHAT IT IS"``; no other words stand beside one.

Words of spindle and coolant follow from ``[means]``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from cornersmooth.nc_reader.word_tables import word_table
from cornersmooth.nc_reader.words import Word

#: values that end a state, or do not begin one
_ENDS: Final = frozenset(("OFF", "ORIENT"))

#: rules that are the same for all words of a group, whatever the control
_OF_GROUPS: Final[Mapping[str, str]] = {
    "units": "state=units first",
    "distance": "state=positions first",
    "feed": "state=feed_mode first follows",
    "plane": "state=plane first follows before=arc",
    "compensation": "state=cutter_compensation follows",
    "offset": "state=work_offset first",
    "path": "state=path_control first",
    "way": "state=ways_of_rotary_axes",
    "orientation": "state=interpolation_of_the_tool_axis",
    "coordinates": "state=coordinates_of_the_tool_axis",
    "frame": "follows outside",
}

#: states of frames that verification accepts
_FRAMES: Final = {"rotation": "tilted plane", "dynamic": "dynamic work offset"}

#: a number, where a row has a letter alone
_NUMBER: Final = r"[-+]?[\d.]+"

#: rules that are no text
_KINDS: Final[Mapping[str, Callable[[str], Any]]] = {
    **dict.fromkeys(("needs", "must", "after", "next", "previous", "extra"), re.compile),
    "share": float,
    "plane": int,
}


@dataclass(frozen=True)
class WordRule:
    """What the list says of a word or a block."""

    pattern: re.Pattern[str]
    says: str = ""  #: what it means, for the documentation

    # the block: words that must stand beside it (`needs` finds the rule, and may say more of the state of that word)
    needs: re.Pattern[str] | None = None
    must: re.Pattern[str] | None = None
    alone: bool = False  #: no other words may stand beside it
    #: what the numbers in its groups may be of the tolerance: ``length`` of ε, ``angle`` of that of the tool axis
    share: float | None = None
    extra: re.Pattern[str] | None = None  #: words of its block that switch on what somebody must have asked for
    never: bool = False  #: the control has no such word

    # blocks before and after
    after: re.Pattern[str] | None = None  #: a word that must have been said since the last time
    previous: re.Pattern[str] | None = None  #: the block before
    next: re.Pattern[str] | None = None  #: the next block
    plane: int = 0  #: the G word of planes that must be in force where it is taken
    before: str = ""  #: ``"arc"``: the next motion must be one, but for the word that held at first

    # its state: where the tool moves, that must be what it was at the first motion
    state: str = ""
    follows: bool = False  #: but not this one: it follows the CL file, and others compare it
    tool: bool = False  #: it may differ from tool to tool in a program with a `cycle`
    cycle: bool = False  #: a hole cycle of the control, a tilted plane, cutter compensation
    late: bool = False  #: after a retract it may come as late as in the block that first moves Z
    compared: bool = False  #: others compare the word with the CL file
    first: bool = False  #: one of its state must come before the first motion
    preset: str = ""  #: the usual one of these
    drops: str = ""  #: a state that the control forgets with it, and that must be said after it

    # until when it may hold
    off: bool = False  #: it switches the state off, which must hold at the end
    ends: bool = False  #: tool tip control: it must be switched off before the tool is changed
    outside: bool = False  #: it may not be said while a word that `ends` holds
    runs: bool = False  #: spindle or coolant is on with it

    # where the tool is
    #: the tool goes away, and none but an approach may follow, in which work offset or tool length are said again
    retract: bool = False
    high: bool = False  #: only after a retract; a control with such a word wants the tool high at the end, too
    moves: bool = False  #: the tool moves, though the block names no axis
    turns: bool = False  #: the control turns the rotary axes, and nobody says where to
    #: they must have been sent to zero before: where a parameter says so, the part program turns with the angles of
    #: that moment
    zero: bool = False

    @property
    def changes_tool(self) -> bool:
        """Whether another tool is taken."""
        return self.compared and (self.high or self.after is not None)


#: the rule of words that are not on the list, or not beside these
UNLISTED: Final = WordRule(re.compile("(?!)"))


@dataclass(frozen=True)
class WordList:
    """The words of a control."""

    begin: tuple[re.Pattern[str], ...]
    end: tuple[re.Pattern[str], ...]
    header: re.Pattern[str] | None
    orders: re.Pattern[str] | None
    #: what is the control's own comes first
    words: tuple[WordRule, ...]
    blocks: tuple[WordRule, ...]


@cache
def word_list(control: str) -> WordList:
    """Words of a control."""
    table = word_table(control)
    means = {word: text.split() for word, text in table["means"].items() if text}
    words: dict[tuple[str, re.Pattern[str] | None], WordRule] = {}
    rows = (rule for word, row in table["words"].items() for rule in _rules(word, row))
    for rule in (*_functions(means), *rows):
        words.setdefault((rule.pattern.pattern, rule.needs), rule)
    return WordList(
        begin=tuple(map(re.compile, table["begin"])),
        end=tuple(map(re.compile, table["end"])),
        header=re.compile(table["header"]) if "header" in table else None,
        orders=re.compile(table["orders"], re.IGNORECASE) if "orders" in table else None,
        words=tuple(words.values()),
        blocks=tuple(_block(pattern, row) for pattern, row in table["blocks"].items() if row),
    )


def _functions(means: Mapping[str, Sequence[str]]) -> Iterator[WordRule]:
    """Rules of words of spindle and coolant: what has an end of its own is a state of its own, beside no other."""
    apart = {f"{parts[0]} {parts[2]}" for parts in means.values() if len(parts) > 2}
    for word, parts in means.items():
        kind, last = parts[0], parts[-1]
        if kind in ("spindle", "coolant"):
            state = name if (name := f"{kind} {last}") in apart else kind
            yield WordRule(
                re.compile(re.escape(word)),
                f"{' '.join(parts)}: compared with the statements",
                state=state,
                follows=True,
                compared=True,
                runs=parts[1] not in _ENDS,
            )


def _rules(word: str, row: str) -> Iterator[WordRule]:
    """Rules of a row: of its word, and of those that may be beside it."""
    if not row:
        return
    head, rules, says = (part.strip() for part in row.split(";", 2))
    effects, _, letters = head.partition(":")
    fields: dict[str, Any] = {"share": None}
    for group, _, value in (effect.partition("=") for effect in effects.split()):
        fields |= _of_group(group, value)
    fields |= _fields(rules)
    share = fields["share"]
    is_own = re.fullmatch(r"[GM][\d.]+|[A-Z_]{2,}\d*", word)
    pattern = word[1:-1] if word[0] == "/" else re.escape(word) if is_own else word
    needed = []
    for letter in letters.split():
        plain, marks = letter.rstrip("!=~"), letter[len(letter.rstrip("!=~")) :]
        if plain[0].islower():
            continue
        text = f"{plain}{_NUMBER}" if len(plain) == 1 else plain
        needed += [text] * ("!" in marks)
        yield WordRule(
            re.compile(text),
            says,
            needs=re.compile(pattern),
            share=share if "(?P<" in text else None,
            compared="=" in marks,
            follows="~" in marks,
        )
    if needed:
        fields["must"] = re.compile("|".join(needed))
    yield WordRule(re.compile(pattern), says, **fields | {"share": share if "(?P<" in pattern else None})


def _block(pattern: str, row: str) -> WordRule:
    rules, _, says = row.partition(";")
    return WordRule(re.compile(pattern), says.strip(), **{"alone": True} | _fields(rules))


def _of_group(group: str, value: str) -> dict[str, Any]:
    """What holds for each word that sets a group to a value."""
    frame = group.partition(".")
    fields = _fields(_OF_GROUPS.get("frame" if frame[1] else group, ""))
    if frame[1]:
        fields |= {"state": _FRAMES[frame[2]], **_fields("off" if value == "off" else "cycle")}
    return fields


def _fields(rules: str) -> dict[str, Any]:
    """Fields of `WordRule`, written as words."""
    fields: dict[str, Any] = {}
    for name, given, text in (rule.partition("=") for rule in rules.split()):
        value = text.replace("_", " ")
        if not given:
            fields[name.removeprefix("-")] = not name.startswith("-")
        else:
            kind = _KINDS.get(name)
            fields[name] = value if kind is None else kind(value)
    return fields


def word_text(word: Word) -> str:
    """Text of a word as the lists have it: blanks left out, codes without leading zeros."""
    if word.name in ("G", "M") and word.text[:1] == word.name and not _SIGN.search(word.text):
        return f"{word.name}{word.value:g}"
    return word.text if word.name == "block" else word.text.replace(" ", "").replace("\t", "")


def any_of(pattern: re.Pattern[str], words: Iterable[str]) -> bool:
    """Whether any of the words is of a pattern."""
    return any(map(pattern.fullmatch, words))


def shown(pattern: re.Pattern[str]) -> str:
    """Regular expression in the user's words."""
    text = pattern.pattern
    for old, new in _PLAIN:
        text = text.replace(old, new)
    return text


#: no code has one
_SIGN: Final = re.compile("[-+]")

_PLAIN: Final = (
    (r"(?=\d*[1-9])", ""),
    *((old, "…") for old in (r"\d+", r"\d{1,8}", r"\d{1,5}", r"[\d.]+", r"\w+", ".*", "(\\.\\d*)?")),
    (r"\.", "."),
    ("(?:", "("),
    ("|", " or "),
)
