"""Lines of one digit pattern: the same letters, with numbers of the same shape after them, in the same places.

What posts write is regular: few patterns make up a text, and a line's pattern is known from the line with zeros for
its digits, and from those digits that always stand for themselves, as that of G1 does. Each pattern is taken apart
once. Its numbers are read where they must stand, eight digits at a time: without the point they fit one machine word,
or two, and the value is that integer over a power of ten: exactly what `float` gives. Longer ones are left to `float`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.errors import InputError
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.lexer import Lexer
from cornersmooth.nc_reader.words import Word
from cornersmooth.text.eight_digits import DIGITS, LAST_DIGITS, Bytes, Words, join_digits, words_of

#: line ends that must stand before a chunk, so that words beyond its begin can be fetched
MARGIN: Final = 24

#: digits of a number that is read here: integers of so many are exact in float64
_MOST_DIGITS: Final = 15
#: digits of a line that stand for themselves, at most: so many fit an integer
_MOST_PLACES: Final = 18
#: bytes of a line, its end included, that is read in runs; bytes that are compared at a time
_LONGEST: Final = 512
_PART: Final = 128
#: bits of a key that lead to a shape
_KEY_BITS: Final = 16
_NUMBER: Final = re.compile(rb"(?P<sign>[-+]?)(?P<whole>\d*)(?P<point>\.?)(?P<part>\d*)(?P<power>E[-+]?\d+)?")

#: the bytes after the point, for so many decimals; all where there is no point
_BEHIND = np.array([((1 << (8 * k)) - 1) << (64 - 8 * k) for k in range(9)] + [(1 << 64) - 1], np.uint64)
_TENS = np.array([float(f"1e{k}") for k in range(DIGITS + 1)])
_EIGHT, _HALF, _REST = np.uint64(8), np.uint64(32), np.uint64(56)

#: keeps the first bytes of a part of a line, for every number of them
_FIRST = (255 * np.tri(_PART + 1, _PART, -1, np.uint8)).view(np.uint64)
#: of the words of a line in its key: odd, with bits at random
_FACTORS = np.multiply.accumulate(np.full(_LONGEST // DIGITS, 0x9E3779B97F4A7C15, np.uint64))


@dataclass(frozen=True)
class LinePattern:
    """What the lines of one pattern have in common."""

    #: columns, those of `constants` at the end; None for lines that are read on their own
    names: tuple[str, ...] | None
    constants: bytes  #: float64 of the columns that are the same in all lines
    #: for each other column six int64: where in the line the number begins and ends, its digits, its decimals (-1
    #: without a point), 1 with a minus sign, 1 where it is left to `float`
    fields: bytes


#: stands for lines that are read on their own
_ALONE: Final = LinePattern(None, b"", b"")


class LinePatterns:
    """The patterns of a text met so far.

    The shape of a line is the line without its digits. A key, made of all its bytes, says which shape it may be, and
    then their bytes are compared.
    """

    def __init__(self, lexer: Lexer) -> None:
        self._lexer = lexer
        #: of each shape its key and its bytes; the first is that of lines that are too long
        self._keys, self._bytes = np.zeros(1, np.uint64), np.zeros((1, _LONGEST // DIGITS), np.uint64)
        #: shapes by their keys, and the one met last of those whose keys begin alike
        self._rows, self._guess = {0: 0}, np.zeros(1 << _KEY_BITS, np.int64)
        #: of each shape: where digits stand for themselves, -1 behind those; the digits met first, and their pattern
        self._places, self._usual = np.full((1, _MOST_PLACES), -1), np.zeros((1, 2), np.int64)
        self._others: dict[tuple[int, int], int] = {}  # patterns of a shape with other digits
        self.known = [_ALONE]
        #: a line of each pattern that is new
        self.fresh: list[bytes] = []

    def label(self, text: bytes, start: Ints, size: Ints) -> Ints:
        """(l,) rows of `known`: the pattern of each line of a text; its first byte, and its size with its end."""
        raw = np.frombuffer(text, np.uint8)
        shape = self._shape(text, raw, start, size)
        self.fresh += [_line(text, start[row]) for row in np.flatnonzero(shape == 0).tolist()]
        digits = np.zeros(len(shape), np.int64)
        rows: Any = slice(None)
        for column in self._places.T:
            at = column[shape[rows]]
            rows, at = np.flatnonzero(at >= 0) if isinstance(rows, slice) else rows[at >= 0], at[at >= 0]
            if not len(rows):
                break
            digits[rows] = 10 * digits[rows] + (raw[start[rows] + at] & 15)
        label = self._usual[:, 1][shape]
        others = np.flatnonzero(self._usual[:, 0][shape] != digits)
        for row, key in zip(
            others.tolist(), zip(shape[others].tolist(), digits[others].tolist(), strict=True), strict=True
        ):
            if key not in self._others:
                self._others[key] = self._add(_line(text, start[row]))[-1]
            label[row] = self._others[key]
        return label

    def _shape(self, text: bytes, raw: Bytes, start: Ints, size: Ints) -> Ints:
        """(l,) shape of each line."""
        marks = raw - np.uint8(ord("0"))
        marks *= marks > 9  # zero for digits
        key, parts = np.zeros(len(start), np.uint64), list(_parts(marks, start, size))
        for rows, columns, words in parts:
            key[rows] += (words ^ (words >> _HALF)) @ _FACTORS[columns]
        key[size > _LONGEST] = 0
        shape = self._guess[key >> np.uint64(64 - _KEY_BITS)]
        unknown = np.flatnonzero(self._keys[shape] != key)
        if len(unknown):
            found, first, inverse = np.unique(key[unknown], return_index=True, return_inverse=True)
            new = np.sort(unknown[first[[one not in self._rows for one in found.tolist()]]])
            if len(new):
                self._learn(key[new], marks, start[new], size[new], [_line(text, begin) for begin in start[new]])
            shape[unknown] = np.array([self._rows[one] for one in found.tolist()])[inverse]
        for rows, columns, words in parts:
            other = words != self._bytes[:, columns].take(shape[rows], axis=0)
            if other.any():  # too long, or two shapes have one key
                shape[np.arange(len(shape))[rows][other.any(axis=1)]] = 0
        return shape

    def _learn(self, key: Words, marks: Bytes, start: Ints, size: Ints, lines: list[bytes]) -> None:
        """Take down new shapes, from a line of each."""
        number = len(self._rows) + np.arange(len(key))
        self._rows.update(zip(key.tolist(), number.tolist(), strict=True))
        self._guess[key >> np.uint64(64 - _KEY_BITS)] = number
        own = np.zeros((len(key), self._bytes.shape[1]), np.uint64)
        for rows, columns, words in _parts(marks, start, size):
            own[rows, columns] = words
        self._keys, self._bytes = np.append(self._keys, key), np.concatenate((self._bytes, own))
        added = np.array([self._add(line) for line in lines])
        self._places = np.concatenate((self._places, added[:, :-2]))
        self._usual = np.concatenate((self._usual, added[:, -2:]))

    def _add(self, line: bytes) -> list[int]:
        """Take a line of a new pattern apart: places of digits that stand for themselves, these, and its number."""
        places, pattern = self._take(line)
        self.known.append(pattern)
        self.fresh.append(line)
        digits = int(bytes(line[place] for place in places) or b"0")
        return [*places, *[-1] * (_MOST_PLACES - len(places)), digits, len(self.known) - 1]

    def _take(self, line: bytes) -> tuple[list[int], LinePattern]:
        """Places of the digits of a line that stand for themselves, and its pattern."""
        try:
            found = self._lexer.line(line, 0, None)
        except InputError:
            return [], _ALONE
        spans = [(word.start, word.stop) for word in (*found.words, found.block_number) if word is not None]
        spans += [match.span() for match in self._lexer.comment.finditer(line.decode("latin-1"))]
        fixed = bytearray(line)
        for start, stop in spans:
            fixed[start:stop] = b" " * (stop - start)
        places = [match.start() for match in re.finditer(rb"\d", fixed)]
        columns = None if found.comments or found.skipped else self._lexer.motion(found)
        if columns is None or len(places) > _MOST_PLACES:
            return places if len(places) <= _MOST_PLACES else [], _ALONE
        own = {name: word for name, word in columns.items() if isinstance(word, Word) and not word.fixed}
        constants = {
            name: word.value if isinstance(word, Word) else word for name, word in columns.items() if name not in own
        }
        fields = []
        for word in own.values():
            match = _NUMBER.fullmatch(line, word.start, word.stop)
            if match is None:
                return places, _ALONE
            decimals = len(match["part"]) if match["point"] else -1
            digits = len(match["whole"]) + len(match["part"])
            left = match["power"] is not None or digits > _MOST_DIGITS or decimals > DIGITS
            number = (0, -1) if left else (digits, decimals)
            fields.append((*match.span(), *number, match["sign"] == b"-", left))
        values = np.array([*constants.values()]).tobytes(), np.array(fields, np.int64).tobytes()
        return places, LinePattern((*own, *constants), *values)


def _parts(marks: Bytes, start: Ints, size: Ints) -> Iterator[tuple[Any, slice, Words]]:
    """Bytes of lines, some at a time: rows that have so many, columns of all words of a line, and the words."""
    longest = int(size.max())
    wide = -(-min(longest, _PART) // DIGITS)
    windows = np.ndarray((len(marks) - _PART,), f"V{DIGITS * wide}", buffer=marks.data, strides=(1,))
    for first in range(0, min(longest, _LONGEST), _PART):
        rows = np.flatnonzero(size > first) if first else slice(None)
        words = windows[start[rows] + first].view(np.uint64).reshape(-1, wide)
        words &= _FIRST[:, :wide].take(np.minimum(size[rows] - first, _PART), axis=0)
        yield rows, slice(first // DIGITS, first // DIGITS + wide), words


def _line(text: bytes, start: int) -> bytes:
    return text[start : text.index(b"\n", start)]


@dataclass(frozen=True)
class Lines:
    """Lines of a chunk, each with its pattern."""

    text: bytes  #: between line ends, so that words beyond its own can be fetched
    words: NDArray[np.void]  #: what stands from every place of it on
    start: Ints  #: (l,): first byte of every line
    label: Ints  #: (l,): row of `patterns`
    patterns: list[LinePattern]

    @classmethod
    def of(cls, text: bytes, patterns: LinePatterns) -> Lines:
        """Lines of a chunk, which ends with a line end."""
        text = b"".join((b"\n" * MARGIN, text, b"\n" * (_PART)))
        raw = np.frombuffer(text, np.uint8)
        ends = np.flatnonzero(raw == ord("\n"))[MARGIN - 1 : -_PART]
        start, size = ends[:-1] + 1, np.diff(ends)
        return cls(text, words_of(raw), start, patterns.label(text, start, size), patterns.known)

    def line(self, row: int) -> bytes:
        """One of them, without its end."""
        return _line(self.text, self.start[row])

    def bulk(self) -> Bools:
        """(l,) whether each line can be read in a run."""
        return np.array([pattern.names is not None for pattern in self.patterns])[self.label]

    def columns(self, chosen: Ints) -> dict[str, Floats]:
        """Numbers of lines that stand in a run, NaN where a line has none."""
        count, first, last = len(chosen), int(chosen[0]), int(chosen[-1]) + 1
        columns: dict[str, Floats] = {}
        for rows, names, numbers in self._groups(slice(first, last) if last - first == count else chosen):
            for name, values in zip(names, numbers, strict=True):
                if len(values) == count:
                    columns[name] = values
                    continue
                if name not in columns:
                    columns[name] = np.full(count, np.nan)
                columns[name][rows] = values
        return columns

    def _groups(self, chosen: slice | Ints) -> Iterator[tuple[Any, tuple[str, ...], Sequence[Floats]]]:
        """Lines of a run by the letters that they have: rows, names of columns, and the numbers for each."""
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
            numbers = self._numbers(start, own, fields.reshape(len(mine), -1, 6))
            yield rows, names, [*numbers, *(column.take(own) for column in constants.T)]

    def _numbers(self, start: Ints, label: Ints, table: Ints) -> list[Floats]:
        """Numbers of lines with the same letters, one array for each of them; `table` as in `LinePattern.fields`."""

        def each(values: Any) -> Any:
            """Value for every line, or the one of all."""
            return values.take(label) if isinstance(values, np.ndarray) else values

        found: list[Floats] = []
        at = np.empty(len(start), np.int64)
        for first, end, begin, keep, keep_before, divisor, lead_begin, lead_keep, point, long, lead, left in _columns(
            table
        ):
            if left:
                spans = zip((start + each(first)).tolist(), (start + each(end)).tolist(), strict=True)
                found.append(np.array([float(self.text[one:other]) for one, other in spans]))
                continue
            np.add(start, each(begin), out=at)
            word = self.words[at].view(np.uint64)
            if point:  # close the gap that it leaves
                closed = word << _EIGHT
                if long:
                    at -= DIGITS
                    before = self.words[at].view(np.uint64)
                    before >>= _REST
                    closed |= before
                closed &= each(keep_before)
                word &= each(keep)
                word |= closed
            else:
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

    Of each number, one value for every pattern or the one of all: where it begins and ends; eight bytes before its end;
    those of its last eight digits that are after the point, and before it; what to divide by; where digits before those
    eight are, and which. Then of any pattern: whether there is a point, more bytes than a word has, digits before the
    last eight, or one is left to `float`.
    """
    first, end, digits, decimals, minus, left = np.ascontiguousarray(table.transpose(2, 0, 1))
    size = digits + (decimals >= 0)
    divisor = np.where(minus > 0, -1.0, 1.0) * _TENS[np.maximum(decimals, 0)]
    lead = np.maximum(digits - DIGITS, 0)
    lead_begin = end - 2 * DIGITS - (decimals >= 0)
    last, behind = LAST_DIGITS[digits - lead], _BEHIND[decimals]
    values = (first, end, end - DIGITS, last & behind, last & ~behind, divisor, lead_begin, LAST_DIGITS[lead])
    flags = (decimals >= 0, size > DIGITS, lead > 0, left > 0)
    return zip(*map(_alike, values), *(flag.any(axis=0).tolist() for flag in flags), strict=True)


def _alike(values: NDArray[Any]) -> list[Any]:
    """Columns of a table, those that are all the same as one value."""
    same = (values == values[0]).all(axis=0).tolist()
    return [values[0, k] if one else values[:, k] for k, one in enumerate(same)]
