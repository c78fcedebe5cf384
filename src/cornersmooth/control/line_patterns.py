"""Lines of one digit pattern: the same letters, with numbers of the same shape after them, in the same places.

What posts write is regular: few patterns make up most texts. A line's pattern is known from its shape, which is the
line with zeros for its digits, and from those digits that always stand for themselves, as that of G1 does. In lines
of new patterns all numbers with a point are found at once. What stands between these is the kind of a line, and one
line of each kind is taken apart by the control's grammar. Numbers are read where they must stand, eight digits at a
time: without the point they fit one machine word, or two, and the value is that integer over a power of ten: exactly
what `float` gives. Longer ones are left to `float`.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from dataclasses import dataclass
from itertools import chain
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import distinct
from cornersmooth.control.words import Lexer, Word
from cornersmooth.errors import InputError
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.text.parse import DIGITS, LAST_DIGITS, Bytes, Words, join_digits, words_of

#: line ends that must stand before a chunk, so that words beyond its begin can be fetched
MARGIN: Final = 24

#: digits of a number that is read here: integers of so many are exact in float64; and digits before its point
_MOST_DIGITS: Final = 15
_MOST_WHOLE: Final = 12
#: digits of a line that stand for themselves, at most: so many fit an integer
_MOST_PLACES: Final = 18
#: bytes of a line, its end included, that is read in runs
_LONGEST: Final = 512
#: lines that are compared at a time: so many fit the cache
_LINES: Final = 1 << 13
#: bits of a key that lead to a shape
_KEY_BITS: Final = 16
#: stands for a number with a point
_MARK: Final = b"\x01"
_NUMBER: Final = re.compile(rb"(?P<sign>[-+]?)(?P<whole>\d*)(?P<point>\.?)(?P<part>\d*)(?P<power>E[-+]?\d+)?")

#: the bytes after the point, for so many decimals; all where there is no point
_AFTER = np.array([((1 << (8 * k)) - 1) << (64 - 8 * k) for k in range(9)] + [(1 << 64) - 1], np.uint64)
_TENS = np.array([float(f"1e{k}") for k in range(DIGITS + 1)])
_EIGHT, _HALF, _REST = np.uint64(8), np.uint64(32), np.uint64(56)

#: keeps the first bytes of a line, for every number of them
_FIRST = (255 * np.tri(_LONGEST + 1, _LONGEST, -1, np.uint8)).view(np.uint64)
#: of the words of a line in its key: odd, with bits at random
_FACTORS = np.multiply.accumulate(np.full(_LONGEST // DIGITS, 0x9E3779B97F4A7C15, np.uint64))


@dataclass(frozen=True)
class _Kind:
    """What lines have in common that differ in their numbers with a point alone.

    Places are counted from the begin of the next of these numbers, or from the end of the line.
    """

    names: tuple[str, ...] | None = None  #: columns; None for lines that are read on their own
    #: for each column: the next number with a point, what is taken of its row in `_pointed`, what is added to that, and
    #: to the number
    columns: tuple[tuple[int, tuple[int, ...], tuple[int, ...], float], ...] = ()
    places: tuple[tuple[int, int], ...] = ()  #: of digits that stand for themselves: the next such number, and where


@dataclass(frozen=True)
class Patterns:
    """Some patterns; what is learnt or forgotten later does not change them."""

    kinds: list[_Kind]  #: those met later stand behind
    #: (p, 2): of each pattern its kind, and where its rows of `fields` begin; the first is that of lines that are
    #: read on their own
    known: Ints
    #: (f, 5): where in the line a number begins, its bytes, its digits (more than are read here if it has an
    #: exponent), its decimals (-1 without a point), 1 with a minus sign; and (f,) what is added to it
    fields: Ints
    added: Floats


class LinePatterns:
    """The patterns of a text met so far.

    A key, made of all bytes of a line but its digits, says which shape it may be. Then their bytes are compared.
    """

    def __init__(self, lexer: Lexer) -> None:
        self._lexer = lexer
        #: lines in which the digits of all stand that are new
        self.fresh: list[bytes] = []
        self._forget()

    def _forget(self) -> None:
        """Know no patterns."""
        #: of each shape its key and its bytes; the first is that of lines that are too long
        self._keys, self._bytes = np.zeros(1, np.uint64), np.zeros((1, _LONGEST // DIGITS), np.uint64)
        #: shapes by their keys, and the one met last of those whose keys begin alike
        self._rows, self._guess = {0: 0}, np.zeros(1 << _KEY_BITS, np.int64)
        #: of each shape: where digits stand for themselves, -1 behind those; the digits met first, and their pattern
        self._places, self._usual = np.full((1, _MOST_PLACES), -1), np.zeros((1, 2), np.int64)
        self._others: dict[tuple[int, int], int] = {}  # patterns of a shape with other digits
        self._kinds: dict[bytes, int] = {}  # by their lines
        self._most: dict[bytes, Ints] = {}  # decimals of their numbers so far
        self.patterns = Patterns([_Kind()], np.zeros((1, 2), np.int64), np.zeros((0, 5), np.int64), np.zeros(0))

    def label(self, text: bytes, start: Ints, size: Ints) -> Ints:
        """(l,) rows of `Patterns.known` for lines of a text; `start`: first byte of each, `size`: with its end."""
        if len(self.patterns.known) > len(start):  # few of them are met again
            self._forget()
        raw = np.frombuffer(text, np.uint8)
        marks = raw - np.uint8(ord("0"))
        marks *= marks > 9  # zero for digits
        some = [slice(first, first + _LINES) for first in range(0, len(start), _LINES)]
        shape = np.concatenate([self._shape(text, marks, start[rows], size[rows]) for rows in some])
        self.fresh += [_line(text, start[row]) for row in np.flatnonzero(shape == 0).tolist()]
        digits = _digits(raw, start, self._places, shape)
        label = self._usual[:, 1][shape]
        others = np.flatnonzero(self._usual[:, 0][shape] != digits)
        keys = list(zip(shape[others].tolist(), digits[others].tolist(), strict=True))
        new = {key: row for key, row in zip(keys, others.tolist(), strict=True) if key not in self._others}
        if new:
            _, _, patterns = self._add([_line(text, start[row]) for row in new.values()])
            self._others.update(zip(new, patterns.tolist(), strict=True))
        label[others] = [self._others[key] for key in keys]
        return label

    def _shape(self, text: bytes, marks: Bytes, start: Ints, size: Ints) -> Ints:
        """(l,) shape of each line."""
        wide = -(-min(int(size.max()), _LONGEST) // DIGITS)
        windows = np.ndarray((len(marks) - _LONGEST,), f"V{DIGITS * wide}", buffer=marks.data, strides=(1,))
        words = windows[start].view(np.uint64).reshape(-1, wide)
        words &= _FIRST[:, :wide].take(np.minimum(size, _LONGEST), axis=0)
        key = (words ^ (words >> _HALF)) @ _FACTORS[:wide]
        key[size > _LONGEST] = 0
        shape = self._guess[key >> np.uint64(64 - _KEY_BITS)]
        unknown = np.flatnonzero(self._keys[shape] != key)
        if len(unknown):
            found, first, inverse = np.unique(key[unknown], return_index=True, return_inverse=True)
            new = np.sort(unknown[first[[one not in self._rows for one in found.tolist()]]])
            if len(new):
                ends = start + size - 1
                lines = [text[a:b] for a, b in zip(start[new].tolist(), ends[new].tolist(), strict=True)]
                self._learn(key[new], words[new], lines)
            shape[unknown] = np.array([self._rows[one] for one in found.tolist()])[inverse]
        other = words != self._bytes[:, :wide].take(shape, axis=0)
        if other.any():  # too long, or two shapes have one key
            shape[other.any(axis=1)] = 0
        return shape

    def _learn(self, key: Words, words: Words, lines: list[bytes]) -> None:
        """Take down new shapes, from a line of each."""
        number = len(self._rows) + np.arange(len(key))
        self._rows.update(zip(key.tolist(), number.tolist(), strict=True))
        self._guess[key >> np.uint64(64 - _KEY_BITS)] = number
        own = np.pad(words, ((0, 0), (0, _LONGEST // DIGITS - words.shape[1])))
        self._keys, self._bytes = np.append(self._keys, key), np.concatenate((self._bytes, own))
        places, digits, patterns = self._add(lines)
        self._places = np.concatenate((self._places, places))
        self._usual = np.concatenate((self._usual, np.stack((digits, patterns), axis=1)))

    def _add(self, lines: list[bytes]) -> tuple[Ints, Ints, Ints]:
        """Take lines of new patterns apart: places of digits that stand for themselves, these, and rows of `kind`."""
        text = b"\n".join((*lines, b""))
        raw = np.frombuffer(text, np.uint8)
        ends = np.flatnonzero(raw == ord("\n"))
        start = np.append(0, ends[:-1] + 1)
        numbers, kinds = _pointed(raw)
        first = np.searchsorted(numbers[:, 0], start)
        numbers[:, 0] -= np.repeat(start, np.diff(first, append=len(numbers)))
        rows_of: dict[bytes, list[int]] = {}
        for row, name in zip(range(len(lines)), kinds.split(b"\n")[:-1], strict=True):
            rows_of.setdefault(name, []).append(row)
        places, known = np.full((len(lines), _MOST_PLACES), -1), np.zeros((len(lines), 2), np.int64)
        before = self.patterns
        kinds_of, fields, added, count = before.kinds, [before.fields], [before.added], len(before.fields)
        for name, mine in rows_of.items():
            rows = np.array(mine)
            own = numbers[first[rows][:, None] + np.arange(name.count(_MARK))]
            decimals = own[:, :, 3]
            own = np.append(own, np.zeros((len(rows), 1, 5), np.int64), axis=1)
            own[:, -1, 0] = ends[rows] - start[rows]
            if name not in self._kinds:
                self._kinds[name] = len(kinds_of)
                kinds_of.append(self._take(lines[mine[0]], own[0]))
                self._most[name] = np.full(decimals.shape[1], -1)
                self.fresh.append(lines[mine[0]])
            if (decimals > self._most[name]).any():
                self.fresh += [lines[mine[row]] for row in set(decimals.argmax(axis=0).tolist())]
                self._most[name] = np.maximum(self._most[name], decimals.max(axis=0))
            one = kinds_of[self._kinds[name]]
            known[rows, 0], known[rows, 1] = self._kinds[name], count + len(one.columns) * np.arange(len(rows))
            for column, (number, offset) in enumerate(one.places):
                places[rows, column] = own[:, number, 0] + offset
            if one.columns:
                found = [own[:, number] * taken + more for number, taken, more, _ in one.columns]
                fields.append(np.stack(found, axis=1).reshape(-1, 5))
                added.append(np.tile([value for *_, value in one.columns], len(rows)))
                count += len(added[-1])
        patterns = len(before.known) + np.arange(len(lines))
        known = np.concatenate((before.known, known))
        self.patterns = Patterns(kinds_of, known, np.concatenate(fields), np.concatenate(added))
        return places, _digits(raw, start, places, np.arange(len(lines))), patterns

    def _take(self, line: bytes, numbers: Ints) -> _Kind:
        """Kind of a line; `numbers` are those of it with a point, and its end."""
        try:
            found = self._lexer.line(line, 0, None)
        except InputError:
            return _Kind()
        words = [word for word in (*found.words, found.block_number) if word is not None]
        # zero may be written without a point, where other numbers may not
        spans = [(w.start, w.stop) for w in words if w.name not in self._lexer.points or "." in w.text]
        spans += [match.span() for match in self._lexer.comment.finditer(line.decode("latin-1"))]
        fixed = bytearray(line)
        for start, stop in spans:
            fixed[start:stop] = b" " * (stop - start)
        begins = numbers[:, 0].tolist()
        at = [match.start() for match in re.finditer(rb"\d", fixed)]
        if len(at) > _MOST_PLACES:
            return _Kind()
        after = [bisect_left(begins, place) for place in at]
        places = tuple((k, place - begins[k]) for k, place in zip(after, at, strict=True))
        alone = _Kind(places=places)
        columns = None if found.comments or found.skipped else self._lexer.motion(found)
        if columns is None:
            return alone
        read: list[tuple[int, tuple[int, ...], tuple[int, ...], float]] = []
        for word in columns.values():
            if not isinstance(word, Word) or word.fixed:
                read.append((0, (0,) * 5, (0, 0, 0, -1, 0), word.value if isinstance(word, Word) else word))
                continue
            match = _NUMBER.fullmatch(line, word.start, word.stop)
            if match is None or len(match["whole"]) > _MOST_WHOLE:
                return alone
            k, size, power = bisect_left(begins, word.start), word.stop - word.start, match["power"] is not None
            odd = (_MOST_DIGITS + 1) * power
            if begins[k] == word.start and (size > numbers[k, 1]) == power:
                read.append((k, (1,) * 5, (0, size - int(numbers[k, 1]), odd, 0, 0), 0.0))
            elif match["point"]:
                return alone
            else:
                number = (word.start - begins[k], size, len(match["whole"]) + odd, -1, int(match["sign"] == b"-"))
                read.append((k, (1, 0, 0, 0, 0), number, 0.0))
        if {k for k, taken, *_ in read if all(taken)} != set(range(len(begins) - 1)):
            return alone
        return _Kind(tuple(columns), tuple(read), places)


def _digits(raw: Bytes, start: Ints, places: Ints, shape: Ints) -> Ints:
    """(l,) digits at the places of the shape of each line, as one number."""
    digits = np.zeros(len(shape), np.int64)
    rows: Any = slice(None)
    for column in places.T:
        at = column[shape[rows]]
        rows, at = np.flatnonzero(at >= 0) if isinstance(rows, slice) else rows[at >= 0], at[at >= 0]
        if not len(rows):
            break
        digits[rows] = 10 * digits[rows] + (raw[start[rows] + at] & 15)
    return digits


def _pointed(raw: Bytes) -> tuple[Ints, bytes]:
    """Numbers of a text with a point, but for G words: rows of `Patterns.fields`; and the text with their marks."""
    is_point = raw == ord(".")
    edges = np.flatnonzero(np.diff(is_point | (raw - np.uint8(ord("0")) <= 9), prepend=False, append=False))
    begin, end, point = edges[::2], edges[1::2], np.append(np.flatnonzero(is_point), [len(raw)] * 2)
    first = np.searchsorted(point, begin)
    point, second, before = point[first], point[first + 1], raw[begin - 1]
    fits = (point < end) & (second >= end) & (end - begin > 1) & (point - begin <= _MOST_WHOLE)
    fits &= before & 0xDF != ord("G")
    heads = (before == ord("\n")) | ((before == ord("N")) & (raw[begin - 2] == ord("\n")))
    heads &= point >= end  # block numbers
    begin = begin - (fits & ((before == ord("+")) | (before == ord("-"))))
    cut, inside = fits | heads, np.zeros(len(raw) + 1, np.int8)
    marked = np.where(raw == _MARK[0], np.uint8(ord("?")), raw)
    marked[begin[cut]] = np.where(fits[cut], _MARK[0], ord("0"))
    inside[begin[cut] + 1] += 1
    inside[end[cut]] -= 1
    kept = np.cumsum(inside[:-1], dtype=np.int8) == 0
    begin, end, point, minus = begin[fits], end[fits], point[fits], before[fits] == ord("-")
    signed = raw[begin] < ord(".")
    digits, decimals = end - begin - signed - 1, end - point - 1
    return np.stack((begin, end - begin, digits, decimals, minus), axis=1), marked[kept].tobytes()


def _line(text: bytes, start: int) -> bytes:
    return text[start : text.index(b"\n", start)]


@dataclass(frozen=True)
class Lines:
    """Lines of a chunk, each with its pattern."""

    text: bytes  #: between line ends, so that words beyond its own can be fetched
    words: NDArray[np.void]  #: what stands from every place of it on
    start: Ints  #: (l,): first byte of every line
    label: Ints  #: (l,): row of `Patterns.known`
    patterns: Patterns

    @classmethod
    def of(cls, text: bytes, patterns: LinePatterns) -> Lines:
        """Lines of a chunk, which ends with a line end."""
        text = b"".join((b"\n" * MARGIN, text, b"\n" * _LONGEST))
        raw = np.frombuffer(text, np.uint8)
        ends = np.flatnonzero(raw == ord("\n"))[MARGIN - 1 : -_LONGEST]
        start, size = ends[:-1] + 1, np.diff(ends)
        label = patterns.label(text, start, size)
        return cls(text, words_of(raw), start, label, patterns.patterns)

    def line(self, row: int) -> bytes:
        """One of them, without its end."""
        return _line(self.text, self.start[row])

    def bulk(self) -> Bools:
        """(l,) whether each line can be read in a run."""
        alone = [kind.names is None for kind in self.patterns.kinds]
        return ~np.array(alone)[self.patterns.known[:, 0]][self.label]

    def columns(self, chosen: Ints) -> dict[str, Floats]:
        """Numbers of lines that stand in a run, NaN where a line has none."""
        count, low, high = len(chosen), int(chosen[0]), int(chosen[-1]) + 1
        part = slice(low, high) if high - low == count else chosen
        label, start, own = self.label[part], self.start[part], self.patterns
        used = np.flatnonzero(np.bincount(label, minlength=len(own.known)))
        kind, first = own.known[used].T
        names = {k: own.kinds[k].names or () for k in distinct(kind).tolist()}
        columns: dict[str, Floats] = {}
        lines: dict[bytes, tuple[Any, Ints, Ints]] = {}  # with any of some patterns, and which of these
        for name in dict.fromkeys(chain.from_iterable(names.values())):
            column = np.full(len(own.kinds), -1)
            for k, given in names.items():
                column[k] = given.index(name) if name in given else -1
            has = column[kind] >= 0
            if has.tobytes() not in lines:
                place = np.full(len(own.known), -1)
                place[used[has]] = np.arange(np.count_nonzero(has))
                which = place[label]
                rows: Any = slice(None) if has.all() else np.flatnonzero(which >= 0)
                lines[has.tobytes()] = rows, start[rows], which[rows]
            rows, begin, which = lines[has.tobytes()]
            field = (first + column[kind])[has]
            values = self._read(begin, which, own.fields[field], own.added[field])
            if len(values) < count:
                columns[name] = np.full(count, np.nan)
                columns[name][rows] = values
            else:
                columns[name] = values
        return columns

    def _read(self, start: Ints, label: Ints, fields: Ints, added: Floats) -> Floats:
        """Numbers of lines, one of each; `label` says which of the rows of `Patterns.fields` it has."""

        def each(values: NDArray[Any]) -> Any:
            """Value for every line, or the one of all."""
            return values[0] if (values == values[0]).all() else values.take(label)

        first, count, digits, decimals, minus = fields.T
        pointed, end = decimals >= 0, first + count
        if (digits > _MOST_DIGITS).any() or (decimals > DIGITS).any():
            spans = zip((start + each(first)).tolist(), (start + each(end)).tolist(), strict=True)
            return np.array([float(self.text[one:other] or 0) for one, other in spans]) + each(added)
        found = np.zeros(len(start))
        if digits.any():
            lead = np.maximum(digits - DIGITS, 0)
            keep, after = LAST_DIGITS[digits - lead], _AFTER[decimals]
            at = start + each(end - DIGITS)
            word = self.words[at].view(np.uint64)
            if pointed.any():  # close the gap that it leaves
                closed = word << _EIGHT
                if (digits + pointed > DIGITS).any():
                    at -= DIGITS
                    before = self.words[at].view(np.uint64)
                    before >>= _REST
                    closed |= before
                closed &= each(keep & ~after)
                word &= each(keep & after)
                word |= closed
            else:
                word &= each(keep)
            if lead.any():  # digits before those eight
                np.add(start, each(end - 2 * DIGITS - pointed), out=at)
                high = self.words[at].view(np.uint64)
                high &= each(LAST_DIGITS[lead])
                value = 10**DIGITS * join_digits(high).view(np.int64) + join_digits(word).view(np.int64)
            else:
                same = word[0] == word[-1] and (word == word[0]).all()  # as weights and last knots are
                value = join_digits(word[:1] if same else word).view(np.int64)
            np.divide(value, each(np.where(minus > 0, -1.0, 1.0) * _TENS[np.maximum(decimals, 0)]), out=found)
        return found + each(added) if added.any() else found
