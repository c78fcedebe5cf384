"""What is surely known of a control between two blocks of a program: NaN and None stand for what is not.

What words do is in ``words.toml``, for each control. A word that is not there is let through. What it may have changed
counts as unknown until the program says it again.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from importlib import resources
from typing import Any, Final

from cornersmooth.errors import InputError
from cornersmooth.nc_reader.lexer import Lexer
from cornersmooth.nc_reader.word_tables import means_of
from cornersmooth.nc_reader.words import Line, Word


class Does(StrEnum):
    """What a word does; of several the first counts."""

    ALL = "all"  #: it may have changed anything
    LEVEL = "level"  #: ends a `FRAME`
    NOTHING = "nothing"  #: nothing that bears on the motion
    DWELL = "dwell"  #: the other words of the block are its own: a time, not a place or a feed
    PLACE = "place"  #: the machine may be anywhere after it; places in its block are not those of the part
    MACHINE = "machine"  #: the axes of its block go to places of the machine, all axes where it names none
    MOVE = "move"  #: moves by a law that is not known here, and does so again in the blocks after it
    LENGTH = "length"  #: X Y Z count anew, those of its block already
    OFFSET = "offset"  #: the same for all axes
    CHANGE = "change"  #: another tool
    FRAME = "frame"  #: turns, scales or mirrors the places of the part


#: kinds of tool tip control: which words the tool axis may have under it
ANGLES, VECTOR, BOTH, NONE = "rotary words", "tool vectors", "rotary words and tool vectors", ""
#: what a tool that never turns asks for
ANY: Final = "any"

#: feed modes by their G word
PER_MINUTE, INVERSE_TIME, PER_REVOLUTION = 94, 93, 95

#: G words of units, with millimetres per unit
_UNITS: Final = {"G20": 25.4, "G21": 1.0, "G70": 25.4, "G71": 1.0, "G700": 25.4, "G710": 1.0}

#: words that set one thing, and do nothing else
_SETS: Final[Mapping[str, tuple[str, Any]]] = {
    **{f"G{code}": ("motion", float(code)) for code in range(4)},
    "G90": ("absolute", True),
    "G91": ("absolute", False),
    "G40": ("compensated", False),
}

#: feed modes by the M words of Klartext
_KLARTEXT_FEEDS: Final = {"M136": PER_REVOLUTION, "M137": PER_MINUTE}

#: words of Siemens under which the tool axis runs as its words say
_EVEN: Final = {VECTOR: ("ORIVECT", "ORIPLANE", "ORIWKS"), ANGLES: ("ORIAXES", "ORIMKS")}

#: what stands for what is not known
_UNKNOWN: Final[Mapping[str, Any]] = {
    **dict.fromkeys(("motion", "unit", "feed"), math.nan),
    **dict.fromkeys(("absolute", "feed_mode", "tip", "compensated")),
    **dict.fromkeys(("offset", "rounding"), ""),
}

#: a value for a variable, which is no axis and no word of its own
_ASSIGNMENT: Final = re.compile(r"(#|Q[LRS]?\d+\s*=|(R\d*|[A-Z_]{2,}\w*)(\[[^]]*\])?\s*=(?!=)|DEF\s|FN ?[0-8] ?:)")
#: what a value is made of, and a word that stands beside it
_IN_VALUE: Final = re.compile(r"\[[^][]*\]|\([^()]*\)|\"[^\"]*\"|<[^>]*>|[RQ][LRS]?\d+|[A-Z_]{2,}\w*")
_WORD_BESIDE: Final = re.compile(r"[A-Z]\s*[-+.\d#\[=]")
#: words of a path of Klartext that change what holds for the blocks after it
_TELLING: Final = re.compile(r"\bR[LR]\b|\bM(2|30|8\d|9\d|1[0-3]\d|14[45])\b")
#: a word whose number is worked out by the control
_WORKED_OUT: Final = re.compile(
    r"([A-Z]+\d*)\s*=?\s*[-+]?(?:#(?:<[^>]*>|\d+|\[[^]]*\])|\[[^]]*\]|Q[LRS]?\d+|"
    r"(?<==)(?:AC|IC|DC|ACP|ACN)\([^()]*\)|(?<==)[A-Z_$][^\s]*)"
)
#: parts of a motion block of Klartext that have several letters
_SPELT: Final = re.compile(r"RAPID|LN|side|turn|circle|centre( .*)?|DC .*")


#: what words mean beside the motion that move nothing
_QUIET: Final = ("spindle", "coolant", "stop")


@dataclass(frozen=True)
class Vocabulary:
    """What a control's words do; its fields are explained in ``words.toml``."""

    control: str
    patterns: Mapping[Does, str]
    tip: Mapping[str, str]
    ends: Mapping[str, str]
    offsets: str
    change_keeps_tip: bool
    rounding: str
    compensation: str

    @property
    def klartext(self) -> bool:
        """Whether blocks say in words what they are."""
        return "M128" in self.tip

    @property
    def siemens(self) -> bool:
        """Whether words are those of SINUMERIK."""
        return "TRAORI" in self.tip

    def does(self, word: str) -> Does:
        """Say what a word such as ``G43.4`` does; words of group 01, of units, distances and feeds are not here."""
        if means_of(self.control).get(word, ("",))[0] in _QUIET:
            return Does.NOTHING
        found = (does for does, pattern in self.patterns.items() if re.fullmatch(pattern, word))
        return next(found, Does.PLACE if word.startswith("M") else Does.ALL)


def _vocabularies() -> dict[str, Vocabulary]:
    tables = tomllib.loads((resources.files("cornersmooth.filter") / "words.toml").read_text(encoding="utf-8"))
    found = {}
    for name, own in tables.items():  # what one is like comes before it
        table = tables[name] = tables.get(own.get("like", ""), {}) | own
        if "tip" in table:
            patterns = {does: table[does] for does in Does if does in table}
            patterns = {does: one if isinstance(one, str) else "|".join(one) for does, one in patterns.items()}
            found[name] = Vocabulary(
                name,
                patterns,
                table["tip"],
                table.get("ends", {}),
                table["offsets"],
                table.get("change_keeps_tip", False),
                table.get("rounding", ""),
                table["compensation"],
            )
    return found


VOCABULARIES: Final[Mapping[str, Vocabulary]] = _vocabularies()


@dataclass
class State:
    """What holds between two blocks."""

    vocabulary: Vocabulary
    axes: tuple[str, ...]  #: letters of X Y Z and of the words of the tool axis, as the lexer names them
    #: last word of each, in units of the program; where the machine is, if that is known
    place: dict[str, float] = field(default_factory=dict)
    motion: float = math.nan  #: 0 to 3
    absolute: bool | None = True
    unit: float = 1.0  #: mm
    feed: float = math.nan  #: as written
    feed_mode: int | None = PER_MINUTE
    tip: str | None = NONE  #: kind of tool tip control
    #: whether words of the tool axis run as they are by themselves: angles evenly, vectors on a circle
    even: bool = True
    compensated: bool | None = False  #: whether the radius of the cutter is taken account of
    frames: frozenset[str] = frozenset()  #: words that turn or scale the places of the part
    offset: str = ""  #: work offset in force
    rounding: str = ""  #: words that say how exactly corners are passed

    def __post_init__(self) -> None:
        self.place = self.place or dict.fromkeys(self.axes, math.nan)

    def copy(self) -> State:
        """Return the same state, to be changed on its own."""
        return replace(self, place=dict(self.place))

    def after(self, place: Iterable[float], motion: float, feed: float) -> State:
        """Return the state after motion blocks that change nothing else."""
        places = dict(zip(self.axes, map(float, place), strict=True))
        return replace(self, place=places, motion=float(motion), feed=float(feed))

    def lose_place(self, letters: Iterable[str] | None = None) -> None:
        """Take the places of some axes, or of all, as unknown."""
        self.place |= dict.fromkeys(set(self.axes if letters is None else letters) & self.place.keys(), math.nan)

    def lose_all(self) -> None:
        """Take all as unknown."""
        self.lose_place()
        vars(self).update(_UNKNOWN)

    def or_not(self, other: State) -> None:
        """Take as unknown what another state, which may hold instead, has not the same."""
        self.lose_place(letter for letter, value in self.place.items() if value != other.place[letter])
        vars(self).update({name: none for name, none in _UNKNOWN.items() if vars(self)[name] != vars(other)[name]})
        self.frames, self.even = self.frames | other.frames, self.even and other.even

    def why_not(self, wanted: str) -> str:
        """Say why cuts in this state are left as they are; empty where they need not be.

        `wanted` is the kind of tool tip control that must be on; `NONE` where it must be off, `ANY` for either.
        """
        if self.frames:
            return f"places of the part are turned, scaled or called by a macro ({', '.join(sorted(self.frames))})"
        if self.tip is None:
            return "it is not known whether tool tip control is on"
        if wanted == NONE and self.tip != NONE:
            return "tool tip control is on, and --no-tcp says that it is not"
        if wanted in (ANGLES, VECTOR) and self.tip not in (wanted, BOTH):
            off = self.tip == NONE
            return "tool tip control is off" if off else f"tool tip control is for {self.tip}, not for {wanted}"
        if not self.even and wanted in (ANGLES, VECTOR):
            return f"the control turns the tool by a law of its own between {wanted}"
        if self.compensated is not False:
            return "the radius of the cutter is taken account of, or that is not known"
        if self.absolute is None or math.isnan(self.unit) or self.feed_mode is None:
            return "units, distances (G90, G91) or the kind of feed are not known"
        return "feed per revolution (G95)" if self.feed_mode == PER_REVOLUTION else ""

    def take(self, text: bytes, lexer: Lexer) -> str:
        """Take a line that is no plain motion block; say why it is left where it cuts, else nothing."""
        try:
            line = lexer.line(text, 0, None)
        except InputError:
            return self._take_unread(text, lexer)
        before = self.copy()
        why = self._take_line(line)
        self.lose_place(word.name for word in line.words if lexer.without_point(word))  # in which unit, nobody says
        if not line.skipped:
            return why
        self.or_not(before)
        return "the operator may skip the block" if why else ""

    def _take_line(self, line: Line) -> str:
        if line.tape or not line.words:
            if line.tape:
                self.lose_all()
            return ""
        first = line.words[0]
        if first.name == "block":
            self._take_block(first.text.upper())
        elif first.name == "O" or (self.vocabulary.siemens and any(word.name == "L" for word in line.words)):  # calls
            self.lose_all()
        else:
            return self._take_words(line.words)
        return ""

    def _take_words(self, words: Iterable[Word]) -> str:
        done: set[Does] = set()
        given: dict[str, float] = {}
        names = {word.name for word in words}
        for word in words:
            if word.name in ("G", "M"):
                done |= self._code(word, names)
            elif len(word.name) > 1 and not _SPELT.fullmatch(word.name):
                done |= self._do(word.name + ("()" if re.search(r"\(\s*\)", word.text) else ""), alone=len(names) == 1)
            elif word.name in ("D", "T", "H", "="):
                does = self.vocabulary.does(word.name)
                done |= {does} if does is not Does.ALL else {Does.LENGTH} if word.name in "DH" else set()
            else:
                given[word.name] = word.value
        if self.vocabulary.rounding and any(re.fullmatch(self.vocabulary.rounding, _code(word)) for word in words):
            own = (word for word in words if word.name in "PQ" or re.fullmatch(self.vocabulary.rounding, _code(word)))
            self.rounding = " ".join(word.text.replace(" ", "") for word in own)
        if self.vocabulary.klartext and {"L", "LN"} & names:  # it says anew in each block what it is
            self.motion = 0.0 if "RAPID" in names else 1.0
        return self._move(given, done, names)

    def _move(self, given: Mapping[str, float], done: set[Does], names: set[str]) -> str:
        """Take the places and the feed of a block, after what its other words do."""
        axes = [letter for letter in self.axes if letter in given]
        if Does.DWELL in done:
            return ""
        self.feed = given.get("F", self.feed)
        if Does.ALL in done:
            self.lose_all()
        if Does.MACHINE in done:
            self.lose_place(axes or None)
        elif done & {Does.PLACE, Does.CHANGE, Does.FRAME, Does.LEVEL, Does.MOVE} or "=" in names:
            self.lose_place()
        elif "centre" not in names:
            if done & {Does.LENGTH, Does.OFFSET}:
                self.lose_place(None if Does.OFFSET in done else "XYZ")
            on_arc = self.motion in (2.0, 3.0)
            for letter in axes:
                if not (on_arc and letter in "IJK"):
                    before = 0.0 if self.absolute else self.place[letter]
                    self.place[letter] = math.nan if self.absolute is None else given[letter] + before
            if not on_arc and 0 < len({"I", "J", "K"} & set(axes)) < 3:  # what the others are then is not known
                self.lose_place("IJK")
        if names & {"U", "V", "W", "circle"} or any(name.startswith("DC ") for name in names):
            self.lose_place()
        if "I" not in self.axes:
            foreign = sorted((set("ABC") & given.keys()) - set(self.axes))
            self.frames |= {f"axis {letter}, which the machine has not" for letter in foreign}
        if "side" in names:
            self.compensated = given.get("side", 40.0) != 40.0
        cuts = bool(axes) and self.motion in (1.0, 2.0, 3.0) and Does.MACHINE not in done
        return "other words in the block" if cuts else ""

    def _code(self, word: Word, names: set[str]) -> set[Does]:
        """Take a G or M word; return what it does beside changing the state."""
        name, words = _code(word), self.vocabulary
        if word.name == "G" and words.klartext:  # a block of DIN/ISO among those of Klartext
            return {Does.ALL}
        if name in _SETS:
            setattr(self, *_SETS[name])
        elif name in _UNITS and (name not in ("G70", "G71") or words.siemens):
            if self.unit != _UNITS[name]:
                self.feed = math.nan
                self.lose_place("XYZ")
            self.unit = _UNITS[name]
        elif name in ("G93", "G94", "G95"):
            self.feed = self.feed if self.feed_mode == int(word.value) else math.nan
            self.feed_mode = int(word.value)
        elif word.name == "G" and re.fullmatch(words.offsets, name):
            same, self.offset = name == self.offset and name != "G154" and "." not in name, name
            return set() if same else {Does.OFFSET}
        elif re.fullmatch(words.compensation, name):
            self.compensated = True
        elif name in _KLARTEXT_FEEDS and words.klartext:
            self.feed_mode = _KLARTEXT_FEEDS[name]
        else:
            return self._do(f"{name} R" if name == "G10" and "R" in names else name)
        return set()

    def _do(self, name: str, *, alone: bool = False) -> set[Does]:
        """Do what a word says, by the vocabulary; `alone` where the block has no other."""
        words = self.vocabulary
        if alone and name in ("ROT", "SCALE", "MIRROR", "TRANS") and words.siemens:
            name = "ROT0"
        if name.startswith("ORI"):
            self.even = name in _EVEN[VECTOR if "I" in self.axes else ANGLES]
        does = words.does(name)
        if name in words.tip:
            self.tip = words.tip[name]
            does = does if does is Does.LENGTH else Does.PLACE
        elif does is Does.CHANGE and not words.change_keeps_tip and self.tip:
            self.tip = None
        if does is Does.FRAME:
            self.frames |= {name}
        elif does is Does.LEVEL:
            ended = words.ends.get(name, ".*")
            self.frames = frozenset(one for one in self.frames if not re.fullmatch(ended, one))
        elif does is Does.MOVE:
            self.motion = math.nan
        return set() if does is Does.NOTHING else {does}

    def _take_block(self, text: str) -> None:
        done = {Does.PLACE}
        if text.startswith("BEGIN PGM"):
            self.unit, self.absolute = 25.4 if text.endswith("INCH") else 1.0, True
            return
        if text.startswith("FUNCTION RESET TCPM"):
            self.tip = NONE
        elif text.startswith("FUNCTION TCPM"):
            law = VECTOR if "PATHCTRL VECTOR" in text else ANGLES if "PATHCTRL AXIS" in text else None
            plain = "F TCP" in text and "AXIS POS" in text and "REFPNT" not in text.replace("REFPNT TIP-TIP", "")
            self.tip = law if plain else None
        else:
            done = self._do(text)
        if Does.ALL in done:
            self.lose_all()
        elif done - {Does.DWELL}:
            self.lose_place()

    def _take_unread(self, text: bytes, lexer: Lexer) -> str:
        """Take a line that is not made of words alone: variables, jumps, what nobody knows."""
        plain = lexer.comment.sub(" ", text.upper().decode("latin-1")).strip()
        plain = re.sub(r"^/?\d?\s*(N?\d+\s+|N\d+)?\s*", "", plain)
        if _ASSIGNMENT.match(plain) and "FRAME" not in plain and not _word_beside(plain):
            self.lose_place()
            return ""
        lost = [match[1] for match in _WORKED_OUT.finditer(plain)]
        rest = _WORKED_OUT.sub(" ", plain)
        try:
            line = lexer.line(rest.encode("latin-1"), 0, None) if lost else None
        except InputError:
            line = None
        if line is None and self.vocabulary.klartext and re.match(r"LN? ", plain) and not _TELLING.search(plain):
            self.lose_place()
            self.feed = math.nan
            return "words that are not known"
        if line is None or {"G", "M"} & set(lost) or (line.words and line.words[0].name == "block"):
            self.lose_all()
            return ""
        before = self.copy()
        self._take_line(line)
        if line.skipped or re.match(r"\s*/", text.decode("latin-1")):
            self.or_not(before)
        elif not line.words:
            self.motion = before.motion
        self.lose_place(self.axes if set(lost) - {*"XYZABCFSQRP"} - set(self.axes) else lost)
        if "F" in lost:
            self.feed = math.nan
        return "words that the control works out" if self.motion in (1.0, 2.0, 3.0) else ""


def _code(word: Word) -> str:
    """Give a word as vocabularies have it."""
    return f"{word.name}{word.value:g}"


def _word_beside(plain: str) -> bool:
    """Whether beside a value for a variable there are words of a block."""
    before, count = plain.partition("=")[2], 1
    while count:
        before, count = _IN_VALUE.subn("", before)
    return _WORD_BESIDE.search(before) is not None
