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
from cornersmooth.text.eight_digits import DIGITS, LAST_DIGITS, join_digits, words_of

#: line ends that must stand before a chunk, so that words beyond its begin can be fetched
MARGIN: Final = 24

#: digits of a number that is read here: integers of so many are exact in float64
_MOST_DIGITS: Final = 15
#: digits of a line that stand for themselves, at most: so many fit an integer
_MOST_PLACES: Final = 18
#: bytes by which lines are compared with the ones before
_WIDEST: Final = 160
_NUMBER: Final = re.compile(rb"(?P<sign>[-+]?)(?P<whole>\d*)(?P<point>\.?)(?P<part>\d*)(?P<power>E[-+]?\d+)?")

#: the bytes after the point, for so many decimals; all where there is no point
_BEHIND = np.array([((1 << (8 * k)) - 1) << (64 - 8 * k) for k in range(9)] + [(1 << 64) - 1], np.uint64)
_TENS = np.array([float(f"1e{k}") for k in range(DIGITS + 1)])
_EIGHT, _REST = np.uint64(8), np.uint64(56)


@dataclass(frozen=True)
class LinePattern:
    """What the lines of one pattern have in common."""

    #: columns, those of `constants` at the end; None for lines that are read on their own
    names: tuple[str, ...] | None
    constants: bytes  #: float64 of the columns that are the same in all lines
    #: for each other column six int64: where in the line the number begins and ends, its digits, its decimals (-1
    #: without a point), 1 with a minus sign, 1 where it is left to `float`
    fields: bytes


class _Numbering(dict[bytes, int]):
    """Numbers what it meets."""

    def __missing__(self, key: bytes) -> int:
        self[key] = number = len(self)
        return number


class LinePatterns:
    """The patterns of a text met so far."""

    def __init__(self, lexer: Lexer) -> None:
        self._lexer = lexer
        self._shapes = _Numbering()  # lines with zeros for their digits
        #: of each shape: where digits stand for themselves, -1 behind those; the digits met first, and their pattern
        self._places = np.zeros((0, _MOST_PLACES), np.int64)
        self._usual = np.zeros((0, 2), np.int64)
        self._others: dict[tuple[int, int], int] = {}  # patterns of a shape with other digits
        self.known: list[LinePattern] = []
        #: a line of each pattern that is new
        self.fresh: list[bytes] = []

    def label(self, text: bytes, start: Ints, size: Ints) -> Ints:
        """(l,) rows of `known`: the pattern of each line of a text; its first byte, and its size with its end."""
        raw = np.frombuffer(text, np.uint8)
        shape = self._shape(raw, start, size)
        new = np.flatnonzero(shape >= len(self._places))
        new = new[np.unique(shape[new], return_index=True)[1]]
        added = [self._add(_line(text, start[row])) for row in new.tolist()]
        if added:
            self._places = np.concatenate((self._places, [places for places, _ in added]))
        digits = np.zeros(len(shape), np.int64)
        rows: Any = slice(None)
        for column in self._places.T:
            at = column[shape[rows]]
            rows, at = np.flatnonzero(at >= 0) if isinstance(rows, slice) else rows[at >= 0], at[at >= 0]
            if not len(rows):
                break
            digits[rows] = 10 * digits[rows] + (raw[start[rows] + at] & 15)
        if added:
            own = np.stack((digits[new], [number for _, number in added]), axis=1)
            self._usual = np.concatenate((self._usual, own))
        label = self._usual[:, 1][shape]
        others = np.flatnonzero(self._usual[:, 0][shape] != digits)
        for row, key in zip(
            others.tolist(), zip(shape[others].tolist(), digits[others].tolist(), strict=True), strict=True
        ):
            if key not in self._others:
                self._others[key] = self._add(_line(text, start[row]))[1]
            label[row] = self._others[key]
        return label

    def _shape(self, raw: NDArray[np.uint8], start: Ints, size: Ints) -> Ints:
        """(l,) shape of each line; most have the same as the one before, and are compared with it as words."""
        digits = raw - np.uint8(ord("0"))
        digits *= digits <= 9
        zeroed = np.subtract(raw, digits, out=digits).tobytes()
        del digits
        wide = min(int(size.max()), _WIDEST) // DIGITS + 1
        windows = np.ndarray((len(raw) - _WIDEST - DIGITS + 1,), f"V{DIGITS * wide}", buffer=zeroed, strides=(1,))
        lines = windows[start].view(np.uint64).reshape(-1, wide)
        other = size[1:] > _WIDEST
        for column in lines.T:
            other |= column[1:] != column[:-1]
        head = np.flatnonzero(np.append(True, other))
        spans = zip(start[head].tolist(), (start + size)[head].tolist(), strict=True)
        found = np.array([self._shapes[zeroed[begin:end]] for begin, end in spans])
        return np.repeat(found, np.diff(head, append=len(size)))

    def _add(self, line: bytes) -> tuple[list[int], int]:
        """Take a line of a new pattern apart; return places of digits that stand for themselves, and its number."""
        places, pattern = self._take(line)
        self.known.append(pattern)
        self.fresh.append(line)
        return places + [-1] * (_MOST_PLACES - len(places)), len(self.known) - 1

    def _take(self, line: bytes) -> tuple[list[int], LinePattern]:
        """Places of the digits of a line that stand for themselves, and its pattern."""
        alone = LinePattern(None, b"", b"")
        try:
            found = self._lexer.line(line, 0, None)
        except InputError:
            return [], alone
        spans = [(word.start, word.stop) for word in (*found.words, found.block_number) if word is not None]
        spans += [match.span() for match in self._lexer.comment.finditer(line.decode("latin-1"))]
        fixed = bytearray(line)
        for start, stop in spans:
            fixed[start:stop] = b" " * (stop - start)
        places = [match.start() for match in re.finditer(rb"\d", fixed)]
        columns = None if found.comments or found.skipped else self._lexer.motion(found)
        if columns is None or len(places) > _MOST_PLACES:
            return places if len(places) <= _MOST_PLACES else [], alone
        own = {name: word for name, word in columns.items() if isinstance(word, Word) and not word.fixed}
        constants = {
            name: word.value if isinstance(word, Word) else word for name, word in columns.items() if name not in own
        }
        fields = []
        for word in own.values():
            match = _NUMBER.fullmatch(line, word.start, word.stop)
            if match is None:
                return places, alone
            decimals = len(match["part"]) if match["point"] else -1
            digits = len(match["whole"]) + len(match["part"])
            left = match["power"] is not None or digits > _MOST_DIGITS or decimals > DIGITS
            number = (0, -1) if left else (digits, decimals)
            fields.append((*match.span(), *number, match["sign"] == b"-", left))
        values = np.array([*constants.values()]).tobytes(), np.array(fields, np.int64).tobytes()
        return places, LinePattern((*own, *constants), *values)


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
        text = b"".join((b"\n" * MARGIN, text, b"\n" * (_WIDEST + 8)))
        raw = np.frombuffer(text, np.uint8)
        ends = np.flatnonzero(raw == ord("\n"))[MARGIN - 1 : -_WIDEST - 8]
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
        for first, end, begin, behind, keep, divisor, lead_begin, lead_keep, point, long, lead, left in _columns(table):
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

    Of each number, one value for every pattern or the one of all: where it begins and ends; eight bytes before its end;
    the bytes after the point; its last eight digits; what to divide by; the same of the digits before those eight. Then
    of any pattern: whether there is a point, more bytes than a word has, digits before the last eight, or one is left
    to `float`.
    """
    first, end, digits, decimals, minus, left = np.ascontiguousarray(table.transpose(2, 0, 1))
    size = digits + (decimals >= 0)
    divisor = np.where(minus > 0, -1.0, 1.0) * _TENS[np.maximum(decimals, 0)]
    lead = np.maximum(digits - DIGITS, 0)
    lead_begin = end - 2 * DIGITS - (decimals >= 0)
    last = LAST_DIGITS[digits - lead]
    values = (first, end, end - DIGITS, _BEHIND[decimals], last, divisor, lead_begin, LAST_DIGITS[lead])
    flags = (decimals >= 0, size > DIGITS, lead > 0, left > 0)
    return zip(*map(_alike, values), *(flag.any(axis=0).tolist() for flag in flags), strict=True)


def _alike(values: NDArray[Any]) -> list[Any]:
    """Columns of a table, those that are all the same as one value."""
    same = (values == values[0]).all(axis=0).tolist()
    return [values[0, k] if one else values[:, k] for k, one in enumerate(same)]
