"""Point files: CSV and columns, one pose a line, with axis vectors, second points on the axis, or tips alone."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import islice
from pathlib import PurePath
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.cl import points_header
from cornersmooth.cl import points_table as table
from cornersmooth.cl.bulk import FARTHEST
from cornersmooth.cl.messages import error, finding
from cornersmooth.cl.points_header import Columns
from cornersmooth.cl.poses import UNIT_TOLERANCE
from cornersmooth.cl.words import TEXT_WORDS
from cornersmooth.errors import Finding
from cornersmooth.kinematics import Machine, tool_axis
from cornersmooth.model import MM_PER_UNIT, Bools, Floats, Ints, Move, Program, Source, Units

#: largest spread of |B−A| over its mean in a file of second points
DISTANCE_SPREAD: Final = 1e-2

#: mm: a path that is shorter in every direction may be in metres
SMALLEST: Final = 1.0

#: without a header, second points stand farther from the tip than this, in units of the file, or from the origin
LEAST_DISTANCE: Final = 1.5


@dataclass(frozen=True)
class TableRules:
    """How a table is meant, where it does not say so itself."""

    scale: float = 1.0  #: of all lengths
    flip_axis: bool = False  #: the tool axes point into the part
    machine: Machine | None = None  #: whose rotary angles stand for the tool axes
    between_passes: float | None = None  #: mm: way back along the tool axis between passes; None feeds straight on


@dataclass(frozen=True)
class _Rows:
    """The numbers of a file and where they come from."""

    file: str
    values: Floats
    line: Ints
    columns: Columns

    def take(self, group: tuple[int, ...]) -> Floats:
        """Columns of the table."""
        return self.values[:, list(group)]

    def at(self, wrong: Bools) -> int:
        """Line of the first row that is wrong."""
        return int(self.line[wrong.argmax()])


def begins_with_names(data: bytes) -> bool:
    """Whether the first line of a file names at least the columns of the tip: in a CL file only a text does."""
    first = next(table.leading_lines(data), "")
    words = re.split(r"[\s/]+", first.strip().upper(), maxsplit=1)
    return words[0] not in TEXT_WORDS and "$$" not in first and points_header.is_header(first)


def looks_like_points(data: bytes) -> bool:
    """Whether a file, or its head, starts like a point file: a row of numbers, or one line of names and then a row."""
    first = list(islice(table.leading_lines(data), 2))
    if not first or any("/" in line and not points_header.is_header(line) for line in first):  # a CL statement
        return False
    return points_header.is_header(first[0]) or any(table.is_row(line) for line in first)


def read_points(
    data: bytes, *, name: str, units: Units | None = None, lenient: bool = False, rules: TableRules = TableRules()
) -> Program:
    """Read a CSV or column file: every row is a linear move to its pose, at feed or rapid (InputError CS150-CS191).

    A column says which moves are rapid; where there is none, the first is, and all others are at feed. Columns are
    named by a header line (also one in a comment) or known from their number: 3 are tips with axis +Z, 6 are tip and
    axis vector or tip and second point of the axis, whichever the numbers say, a seventh is the feed.

    The text is UTF-8, UTF-16 or Windows-1252; cells are between commas, semicolons, tabs or blanks, with decimal commas
    where semicolons or tabs separate; comments come after ``#``, ``%`` or ``//``. Without units the header says them,
    or they are mm, and feeds are per minute in the same unit. With `lenient` axis vectors of any length are normalised,
    and feeds that are not positive are left out, with findings.
    """
    text = table.clean(data, name)
    columns = _find_columns(text, name, rules.machine)
    values, line = table.numbers(text, columns, name)
    if not len(values):
        raise error("CS150", name, 1)
    rows = _Rows(name, values, line, columns)
    for column in columns.orders:
        step = np.diff(values[:, column])
        if step.any() and not (step > 0).all():  # what rises in every row is a time, a length or a counter
            raise error("CS191", name, int(line[1:][step != 0][0]), column=columns.names[column])
    written = columns.units if units in (None, columns.units) else None  # else the header does not count
    factor = rules.scale * (columns.factor if written else 1.0)
    far = np.flatnonzero(np.abs(rows.take(columns.wanted)).max(axis=1) * max(factor, 1.0) > FARTHEST)
    if len(far):
        raise error("CS163", name, int(line[far[0]]), limit=FARTHEST)
    findings = [] if units or columns.units else [finding("CS176", 0)]
    units = units or columns.units or "mm"
    scale = MM_PER_UNIT[units] * factor
    if rules.machine is not None and columns.angles:
        axis = tool_axis(rules.machine, rows.take(columns.angles) * np.array(columns.degrees))
    else:
        axis = _axis(rows, scale, lenient, findings)
    axis = -axis if rules.flip_axis else axis
    kind = np.full(len(values), Move.LINEAR, np.uint8)
    kind[[0] if columns.rapid is None else values[:, columns.rapid] == table.RAPID] = Move.RAPID
    feed = _feed(rows, kind, lenient, findings)
    if columns.rapid is None:
        findings.append(finding("CS177", 0))
    parted = _parted(rows, kind)
    size = float(np.ptp(rows.take(columns.tip), axis=0).max())
    if 0.0 < size * scale < SMALLEST and not columns.units and factor == 1.0:
        findings.append(finding("CS209", 0, size=size, units=units))
    if columns.unused:
        findings.append(finding("CS173", text.header_line, len(columns.unused), names=", ".join(columns.unused)))
    tip = rows.take(columns.tip) * scale
    known = columns.feed_factor if written else None
    feed *= scale if known is None else MM_PER_UNIT[units] * known
    if rules.between_passes is None:
        findings += [
            finding("CS200", int(line[row[0]]), len(row), what=what) for what, row in parted.items() if len(row)
        ]
    else:
        starts = np.unique(np.concatenate([*parted.values()]))
        tip, axis, kind, feed, line = _over(tip, axis, kind, feed, line, starts, rules.between_passes)
    return Program.from_poses(
        tip,
        axis,
        kind=kind,
        feed=feed,
        line=line,
        units=units,
        source=Source(PurePath(name).name, format="points", dialect="csv"),
        findings=tuple(findings),
    )


def _find_columns(text: table.PointText, name: str, machine: Machine | None) -> Columns:
    rotary = machine.names if machine is not None and len(machine.names) == 2 else ()
    if text.header is not None:
        columns = points_header.from_header(text.header, name, text.header_line, rotary)
        if text.header_certain or columns.width == text.width:
            return columns
    if not text.width:
        raise error("CS150", name, 1)
    return points_header.from_width(text.width, name, text.row_line)


def _axis(rows: _Rows, scale: float, lenient: bool, findings: list[Finding]) -> Floats:
    """Axis vectors of any length; adds findings about them."""
    if rows.columns.second is None:
        findings.append(finding("CS170", 0))
        return np.tile((0.0, 0.0, 1.0), (len(rows.values), 1))
    tip, second = rows.take(rows.columns.tip), rows.take(rows.columns.second)
    meaning = rows.columns.meaning
    if meaning == "values":
        meaning = "points" if _second_points(rows, tip, second) else "vectors"
    vector = second - tip if meaning == "points" else second
    length = np.linalg.norm(vector, axis=1)
    zero = length == 0
    if zero.any():
        raise error("CS154", rows.file, rows.at(zero))
    off = np.abs(length - 1) > UNIT_TOLERANCE
    if meaning == "points":
        distance = length * scale
        mean, low, high = float(distance.mean()), float(distance.min()), float(distance.max())
        findings.append(finding("CS171", 0, mean=mean))
        if high - low > DISTANCE_SPREAD * mean:
            farthest = np.abs(distance - mean)
            findings.append(finding("CS172", rows.at(farthest == farthest.max()), low=low, high=high))
    elif off.any():
        values = {"length": float(length[off.argmax()])}
        if not lenient:
            raise error("CS155", rows.file, rows.at(off), **values)
        findings.append(finding("CS174", rows.at(off), int(off.sum()), **values))
    return vector


def _second_points(rows: _Rows, tip: Floats, second: Floats) -> bool:
    """Whether the second three columns are points, by their numbers alone.

    Most rows of a file of vectors have length 1; those that have not are for the check of the lengths. A file of
    second points keeps its distance from the tips. What is neither must be named by a header.
    """
    length = np.linalg.norm(second, axis=1)
    if rows.columns.feed is not None:
        four = np.hypot(length, rows.values[:, rows.columns.feed])
        if (np.abs(four - 1) <= UNIT_TOLERANCE).all():
            raise error("CS165", rows.file, int(rows.line[0]), names="4 to 7")
    if 2 * np.count_nonzero(np.abs(length - 1) <= UNIT_TOLERANCE) >= len(length):
        return False
    distance = np.linalg.norm(second - tip, axis=1)
    steady = len(distance) > 1 and np.ptp(distance) <= DISTANCE_SPREAD * distance.mean()
    if steady and (distance.mean() > LEAST_DISTANCE or np.median(length) > LEAST_DISTANCE):
        return True
    raise error("CS157", rows.file, int(rows.line[0]))


def _parted(rows: _Rows, kind: NDArray[np.uint8]) -> dict[str, Ints]:
    """Rows that are fed to over a blank line, a comment or from one pass to the next, by what parts them.

    Such a move may lead across the part. A gap after every row is how the file is spelt.
    """
    fed = kind[1:] != Move.RAPID
    gap = np.diff(rows.line)
    found = {"a blank line or a comment is": gap > gap.min(initial=rows.line[-1])}
    if rows.columns.passes is not None:
        number = rows.values[:, rows.columns.passes]
        found["the number of the pass changes"] = (number[1:] != number[:-1]) & ~np.isnan(number[1:])
    return {what: 1 + np.flatnonzero(parted & fed) for what, parted in found.items()}


def _over(
    tip: Floats, axis: Floats, kind: NDArray[np.uint8], feed: Floats, line: Ints, starts: Ints, back: float
) -> tuple[Floats, Floats, NDArray[np.uint8], Floats, Ints]:
    """Poses with two rapids before each start of a pass: back along the axis of the one before, and over the start."""
    unit = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    at, of = np.repeat(starts, 2), np.stack((starts - 1, starts), axis=1).ravel()
    rapid = np.full(len(at), Move.RAPID, np.uint8)
    return (
        np.insert(tip, at, (tip + back * unit)[of], axis=0),
        np.insert(axis, at, axis[of], axis=0),
        np.insert(kind, at, rapid),
        np.insert(feed, at, feed[np.maximum(at - 1, 0)]),
        np.insert(line, at, line[of]),
    )


def _feed(rows: _Rows, kind: NDArray[np.uint8], lenient: bool, findings: list[Finding]) -> Floats:
    """Feed of every move in units of the file; an empty cell and a rapid keep the feed before it, as in CL files."""
    if rows.columns.feed is None:
        return np.full(len(rows.values), np.nan)
    feed = rows.values[:, rows.columns.feed].copy()
    if rows.columns.rapid is not None:
        feed[kind == Move.RAPID] = np.nan
    wrong = feed <= 0
    if wrong.any():
        value = float(feed[wrong.argmax()])
        if not lenient:
            raise error("CS158", rows.file, rows.at(wrong), feed=value)
        findings.append(finding("CS175", rows.at(wrong), int(wrong.sum()), feed=value))
    given = np.where(np.isnan(feed) | wrong, -1, np.arange(len(feed)))
    last = np.maximum.accumulate(given)
    return np.where(last >= 0, feed[last], np.nan)
