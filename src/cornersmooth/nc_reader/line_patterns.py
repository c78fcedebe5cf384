"""Lines of one digit pattern: the same letters, with numbers of the same shape behind them, in the same places.

What posts write is regular: few patterns make up a text, and a line's pattern is known from where its digits are and
from what stands between them. Once a pattern is understood, its numbers are read where they must stand, eight digits
at a time: without the point they fit one machine word, or two, and the value is that integer over a power of ten:
exactly what `float` gives. Every byte that is no digit is compared with the pattern's; a chunk in which anything is not
regular is left to the careful reading in `block_tables`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.errors import InputError
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.lexer import Lexer
from cornersmooth.nc_reader.words import Word
from cornersmooth.text.eight_digits import DIGITS, LAST_DIGITS, Bytes, Words, join_digits, words_of

#: line ends that must stand before and behind a chunk, so that words beyond its ends can be fetched
MARGIN: Final = 24

#: bits of a word that can be had from any bit on, and words that tell the digits of a line
_BITS: Final = 57
_MOST_WORDS: Final = 9

#: lines up to so many bytes are compared with their patterns apart from longer ones
_SHORT: Final = 16

#: longest line, its end included, that is read in runs
LONGEST: Final = 512

#: a chunk with fewer lines for each pattern than this is read otherwise, unless it has few patterns at all
_FEWEST_LINES: Final = 8
_FEW_PATTERNS: Final = 256

_LINE_END: Final = 10
_TO_ZERO: Final = bytes(ord("0") if code in b"0123456789" else code for code in range(256))
_CARE: Final = bytes(0 if code in b"0123456789" else 255 for code in range(256))
#: digits of a number that is read here: integers of so many are exact in float64
_MOST_DIGITS: Final = 15
_NUMBER: Final = re.compile(rb"(?P<sign>[-+]?)(?P<whole>\d*)(?P<point>\.?)(?P<part>\d*)(?:E(?P<power>[-+]?\d+))?")

#: the bytes behind the point, for so many decimals; all where there is no point
_BEHIND = np.array([((1 << (8 * k)) - 1) << (64 - 8 * k) for k in range(9)] + [(1 << 64) - 1], np.uint64)
#: the first bits of a word
_LOW_BITS = np.array([(1 << k) - 1 for k in range(_BITS + 1)], np.uint64)


#: rows of a run, the names of their columns, and an array of numbers for each name
Group = tuple[Any, tuple[str, ...], Sequence[Floats]]


def merged(groups: Iterable[Group], count: int) -> dict[str, Floats]:
    """Columns of a run of `count` lines from those of groups with the same letters; NaN where a line has none."""
    columns: dict[str, Floats] = {}
    for rows, names, numbers in groups:
        for name, values in zip(names, numbers, strict=True):
            if len(values) == count:
                columns[name] = values
                continue
            if name not in columns:
                columns[name] = np.full(count, np.nan)
            columns[name][rows] = values
    return columns


@dataclass(frozen=True)
class LinePattern:
    """What the lines of one pattern have in common."""

    #: Columns, those of `constants` at the end; None for lines that are read on their own.
    names: tuple[str, ...] | None
    constants: bytes  #: float64 of the columns that are the same in all lines
    #: The bytes of the line with its end, and 255 for those that are always the same; `LONGEST` of either.
    literal: bytes
    care: bytes
    #: for each other column five int64: where in the line the number ends, its digits, its decimals (-1 without a
    #: point), the power of ten to divide by and 1 with a minus sign
    fields: bytes


class LinePatterns:
    """The patterns of a text met so far."""

    def __init__(self, lexer: Lexer) -> None:
        self._lexer = lexer
        self._known: dict[bytes, list[tuple[LinePattern | None, int, int]]] = {}
        #: a line of each pattern that is new
        self.fresh: list[bytes] = []

    def of(self, line: bytes) -> LinePattern | None:
        """Pattern of a line without its end; None where its numbers are not of a kind that is read here."""
        shape = line.translate(_TO_ZERO)
        value = int.from_bytes(line)
        for pattern, literal, care in self._known.get(shape, ()):
            if not (value ^ literal) & care:
                return pattern
        self.fresh.append(line)
        pattern, alike = self._make(line)
        self._known.setdefault(shape, []).append((pattern, value, int.from_bytes(alike)))
        return pattern

    def _make(self, line: bytes) -> tuple[LinePattern | None, bytes]:
        """Pattern of a line, and 255 for its bytes that make it one."""
        names: tuple[str, ...] | None = None
        numbers: list[Word] = []
        constants: dict[str, float] = {}
        try:
            found = self._lexer.line(line, 0, None)
        except InputError:
            spans = [(0, len(line))]
        else:
            spans = [(word.start, word.stop) for word in (*found.words, found.block_number) if word is not None]
            spans += [match.span() for match in self._lexer.comment.finditer(line.decode("latin-1"))]
            columns = None if found.comments or found.skipped else self._lexer.motion(found)
            if columns is not None:
                own = {name: word for name, word in columns.items() if isinstance(word, Word) and not word.fixed}
                constants = {
                    name: word if isinstance(word, float) else word.value
                    for name, word in columns.items()
                    if name not in own
                }
                names, numbers = (*own, *constants), list(own.values())
        care = bytearray(b"\xff" * len(line))
        for start, stop in spans:
            care[start:stop] = line[start:stop].translate(_CARE)
        fields = []
        for word in numbers:
            match = _NUMBER.fullmatch(line, word.start, word.stop)
            if match is None:
                return None, bytes(care)
            decimals = len(match["part"]) if match["point"] else -1
            digits = len(match["whole"]) + len(match["part"])
            power = max(decimals, 0) - int(match["power"] or 0)
            if match["power"]:
                care[match.start("power") : match.end("power")] = b"\xff" * len(match["power"])
            if not 1 <= digits <= _MOST_DIGITS or decimals > DIGITS or not 0 <= power < len(_TENS):
                return None, bytes(care)
            fields.append((match.end("part"), digits, decimals, power, match["sign"] == b"-"))
        pattern = LinePattern(
            names,
            np.array([*constants.values()]).tobytes(),
            (line + b"\n").ljust(LONGEST, b"\0"),
            (bytes(care) + b"\xff").ljust(LONGEST, b"\0"),
            np.array(fields, np.int64).tobytes(),
        )
        return pattern, bytes(care)


@dataclass(frozen=True)
class Lines:
    """Lines of a chunk, each with its pattern."""

    words: NDArray[np.void]  #: what stands from every place of the text on, between line ends, `MARGIN` before it
    start: Ints  #: (l,): first byte of every line
    label: Ints  #: (l,): row of `line_patterns`
    patterns: list[LinePattern]

    def bulk(self) -> NDArray[np.bool_]:
        """(l,) whether each line can be read in a run."""
        return np.array([pattern.names is not None for pattern in self.patterns])[self.label]

    def columns(self, chosen: Ints) -> dict[str, Floats]:
        """Numbers of lines that stand in a run, NaN where a line has none."""
        first, last = int(chosen[0]), int(chosen[-1]) + 1
        return merged(self._groups(slice(first, last) if last - first == len(chosen) else chosen), len(chosen))

    def _groups(self, chosen: slice | Ints) -> Iterator[Group]:
        """Lines of a run by the letters that they have."""
        label, starts = self.label[chosen], self.start[chosen]
        used = np.flatnonzero(np.bincount(label, minlength=len(self.patterns))).tolist()
        of_names: dict[tuple[str, ...], list[int]] = {}
        for k in used:
            of_names.setdefault(self.patterns[k].names or (), []).append(k)
        kind, place = np.zeros((2, len(self.patterns)), np.int64)
        for number, mine in enumerate(of_names.values()):
            kind[mine], place[mine] = number, np.arange(len(mine))
        kinds = kind[label] if len(of_names) > 1 else None
        for number, (names, mine) in enumerate(of_names.items()):
            rows = slice(None) if kinds is None else np.flatnonzero(kinds == number)
            start, own = starts[rows], place[label[rows]]
            fields = np.frombuffer(b"".join([self.patterns[k].fields for k in mine]), np.int64)
            constants = np.frombuffer(b"".join([self.patterns[k].constants for k in mine])).reshape(len(mine), -1)
            numbers = self._numbers(start, own, fields.reshape(len(mine), -1, 5))
            yield rows, names, [*numbers, *(column.take(own) for column in constants.T)]

    def _numbers(self, start: Ints, label: Ints, table: Ints) -> list[Floats]:
        """Numbers of lines with the same letters, one array for each of them; `table` as in `LinePattern.fields`."""

        def each(values: Any) -> Any:
            """Value for every line, or the one of all."""
            return values.take(label) if isinstance(values, np.ndarray) else values

        found: list[Floats] = []
        at = np.empty(len(start), np.int64)
        for begin, behind, keep, divisor, lead_begin, lead_keep, point, long, lead in _columns(table):
            np.add(start, each(begin), out=at)
            word = self.words[at].view(np.uint64)
            if point:  # close the gap that it leaves
                closed = word << _EIGHT
                if long:
                    at -= DIGITS
                    before = self.words[at].view(np.uint64)
                    before >>= _REST
                    closed |= before
                word ^= closed
                word &= each(behind)
                word ^= closed
            word &= each(keep)
            value = join_digits(word).view(np.int64)
            if lead:  # digits before those eight
                np.add(start, each(lead_begin), out=at)
                word = self.words[at].view(np.uint64)
                word &= each(lead_keep)
                value += 10**DIGITS * join_digits(word).view(np.int64)
            found.append(np.divide(value, each(divisor)))
        return found


def _columns(table: Ints) -> Iterator[tuple[Any, ...]]:
    """How to read the numbers of lines with the same letters, of which `table` is as in `LinePattern.fields`.

    Of each number, one value for every pattern or the one of all: from the start of the line to eight bytes before its
    end; the bytes behind the point; its last eight digits; what to divide by; the same of the digits before those
    eight. Then of any pattern: whether there is a point, more bytes than a word has, digits before the last eight.
    """
    end, digits, decimals, power, minus = np.ascontiguousarray(table.transpose(2, 0, 1))
    size = digits + (decimals >= 0)
    divisor = np.where(minus > 0, -1.0, 1.0) * _TENS[power]
    lead = np.maximum(digits - DIGITS, 0)
    lead_begin = end - 2 * DIGITS - (decimals >= 0)
    values = (end - DIGITS, _BEHIND[decimals], LAST_DIGITS[digits - lead], divisor, lead_begin, LAST_DIGITS[lead])
    return zip(
        *map(_alike, values),
        (decimals >= 0).any(axis=0).tolist(),
        (size > DIGITS).any(axis=0).tolist(),
        (lead > 0).any(axis=0).tolist(),
        strict=True,
    )


def _alike(values: NDArray[Any]) -> list[Any]:
    """Columns of a table, those that are all the same as one value."""
    same = (values == values[0]).all(axis=0).tolist()
    return [values[0, k] if one else values[:, k] for k, one in enumerate(same)]


_TENS = np.array([float(f"1e{k}") for k in range(23)])
_EIGHT, _REST = np.uint64(8), np.uint64(56)


def lines_of(text: bytes, patterns: LinePatterns) -> Lines | None:
    """Lines of a chunk, which ends with a line end; None where anything in it is not regular."""
    raw = np.frombuffer(b"".join((b"\n" * MARGIN, text, b"\n" * LONGEST)), np.uint8)
    ends = np.flatnonzero(raw[: MARGIN + len(text)] == _LINE_END)[MARGIN - 1 :]
    start, stop = ends[:-1] + 1, ends[1:]
    size = stop - start + 1
    width = int(size.max())
    if width > LONGEST:
        return None
    keys = _digit_keys(raw, start, size, -(-width // _BITS))
    mixed = keys[0]
    for key in keys[1:]:
        mixed = mixed * np.uint64(0x9E3779B97F4A7C15) ^ key
    head = np.flatnonzero(np.append(True, mixed[1:] != mixed[:-1]))
    _, first, inverse = np.unique(mixed[head], return_index=True, return_inverse=True)
    if len(first) > max(_FEW_PATTERNS, len(start) // _FEWEST_LINES):
        return None
    label = np.repeat(inverse, np.diff(np.append(head, len(start))))
    return _labelled(raw, start, stop, label, head[first], keys, patterns)


def _digit_keys(raw: Bytes, start: Ints, size: Ints, count: int) -> list[Words]:
    """Bits of every line that say which of its bytes are no digits, `_BITS` in a word."""
    other = raw - np.uint8(ord("0")) > np.uint8(9)
    packed = np.append(np.packbits(other, bitorder="little"), np.zeros(8 * _MOST_WORDS, np.uint8))
    words = words_of(packed)
    keys = []
    for k in range(count):
        bit = start + k * _BITS if k else start
        key = words[bit >> 3].view(np.uint64)
        key >>= (bit & 7).view(np.uint64)
        key &= _LOW_BITS[np.clip(size - k * _BITS, 0, _BITS)]
        keys.append(key)
    return keys


def _labelled(
    raw: Bytes,
    start: Ints,
    stop: Ints,
    label: Ints,
    sample: Ints,
    keys: list[Words],
    patterns: LinePatterns,
) -> Lines | None:
    """Give every line the pattern of the line that stands for its label, or a new label where it differs."""
    size = stop - start + 1
    known: list[LinePattern] = []
    rows = np.arange(len(start))
    stands = sample[:0]
    while len(sample):
        stands = np.append(stands, sample)
        for row in sample.tolist():
            pattern = patterns.of(raw[int(start[row]) : int(stop[row])].tobytes())
            if pattern is None:
                return None
            known.append(pattern)
        if len(known) > max(_FEW_PATTERNS, len(start) // _FEWEST_LINES):
            return None
        differs = np.zeros(len(rows), np.bool_)
        short = size[rows] <= _SHORT
        for part in (np.flatnonzero(short), np.flatnonzero(~short)) if short.any() else (slice(None),):
            own = rows[part]
            differs[part] = _unlike(raw, start[own], size[own], label[own], known)
        for key in keys:
            differs |= key[rows] != key[stands][label[rows]]
        rows = rows[differs]
        _, first, inverse = np.unique(label[rows], return_index=True, return_inverse=True)
        label[rows] = len(known) + inverse
        sample = rows[first]
    return Lines(words_of(raw), start, label, known)


def _unlike(raw: Bytes, start: Ints, size: Ints, label: Ints, known: list[LinePattern]) -> Bools | bool:
    """Whether lines have other bytes that are no digits than their patterns."""
    if not len(start):
        return False
    wide = -(-int(size.max()) // 8)
    windows = np.ndarray((len(raw) - 8 * wide,), f"V{8 * wide}", buffer=raw.data, strides=(1,))
    literal, care = (
        np.frombuffer(b"".join([text[: 8 * wide] for text in texts]), f"V{8 * wide}")
        for texts in ([pattern.literal for pattern in known], [pattern.care for pattern in known])
    )
    found = windows[start].view(np.uint64)
    found ^= literal[label].view(np.uint64)
    found &= care[label].view(np.uint64)
    if not found.any():
        return False
    differs: Bools = np.logical_or.reduce(found.reshape(-1, wide) != 0, axis=1)
    return differs
