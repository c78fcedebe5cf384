"""What the numbers of a block are: tip and tool axis in the words of a form, and back.

There is one `Coordinates` for tools under tip control, one for tools along Z, one for each tilted plane, and one for
each tool whose length goes into positions of the machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import unit
from cornersmooth.kinematics import machine_position, tool_axis
from cornersmooth.model import MM_PER_UNIT, Bools, Floats, Ints, Program, Units
from cornersmooth.nc.control import INVERSE_TIME, Motion
from cornersmooth.nc.form import Form
from cornersmooth.nc.planes import Plane
from cornersmooth.text import RowFormat, to_ticks


@dataclass(frozen=True)
class Coordinates:
    """Words of a motion block, and their numbers."""

    form: Form
    units: Units
    stretch: float = 1.0  #: `Form.stretch`
    plane: Plane | None = None  #: in whose coordinates positions are written; None for tools under tool tip control
    modal: bool = False  #: whether words that repeat are left out, where the control keeps them

    @property
    def motion(self) -> Motion:
        """How motion blocks look."""
        return self.form.mode

    @property
    def gap(self) -> str:
        """What stands between words."""
        return " " if self.motion.spaces else ""

    @property
    def leaves_out(self) -> bool:
        """Whether words that repeat are left out."""
        return self.modal and bool(self.motion.modal) and not self.form.curves

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Addresses."""
        return (*self.motion.coordinates, *self.form.other_words)

    @cached_property
    def decimals(self) -> tuple[int, ...]:
        """Decimals of each number."""
        return self.form.decimals(self.units)

    @cached_property
    def modulo(self) -> list[int]:
        """Columns of modulo axes."""
        axes = self.form.machine.modulo if self.form.machine is not None and self.form.rotary else ()
        return [k for k, word in enumerate(self.words) if k > 2 and word in axes]

    @cached_property
    def format(self) -> RowFormat:
        """Format of whole rows; what is left out takes the blank before it with it."""
        return self._format(range(len(self.words)), self.gap if self.leaves_out else "")

    @property
    def closing(self) -> str:
        """What follows the last number."""
        return self.motion.shortest[1] if self.modulo[-1:] == [len(self.words) - 1] else ""

    def _format(self, columns: Sequence[int], before: str = "") -> RowFormat:
        motion, words, end = self.motion, [], before
        for place, column in enumerate(columns):
            opening, closing = motion.shortest if column in self.modulo else ("", "")
            words.append(f"{end}{self.gap if place else ''}{self.words[column]}{opening}".encode())
            end = closing
        return RowFormat(
            tuple(words),
            tuple(self.decimals[column] for column in columns),
            plus=motion.signs,
            trim=not motion.trailing_zeros,
            leading_zero=motion.leading_zeros,
        )

    def rapid(self, ticks: Ints, words: str = "", chosen: slice | Bools = slice(None)) -> str:
        """Rapid block of some words of a row of ticks, all by default, after words of other kinds."""
        columns = np.arange(len(self.words))[chosen].tolist()
        closing = self.motion.shortest[1] if columns[-1] in self.modulo else ""
        head, tail = f"{self.motion.rapid}{self.gap}".encode(), f"{closing}{self.motion.rapid_end}".encode()
        none = np.zeros(1, np.int64)
        text = self._format(columns).rows(self.shown(ticks)[chosen][None], [head], none, [tail], none)
        return f"{words}{self.gap if words else ''}{text.decode()}"

    def shown(self, ticks: Ints) -> Ints:
        """Ticks of rows with those of modulo axes from 0 to 360 degrees."""
        if not self.modulo:
            return ticks
        shown = ticks.copy()
        shown[..., self.modulo] %= 360 * 10**self.form.table.digits.angle
        return shown

    def ticks(self, tip: Floats, other: Floats) -> Ints:
        """Numbers of rows in steps of their last digit, (r, c), from `Rows.tip` and `Rows.other`."""
        return to_ticks(self.numbers(tip, other), self.decimals)

    def numbers(self, tip: Floats, other: Floats) -> Floats:
        """Numbers of rows in units of the text, (r, c)."""
        form = self.form
        if form.orientation == "machine" and form.machine is not None:
            # for the angles as they are written: far from the axes their rounding would move the tip
            decimals = form.table.digits.angle
            other = to_ticks(other, (decimals,) * 2) / 10.0**decimals
            tip = machine_position(form.machine, tip, other)
        if self.plane is not None:
            tip = tip @ self.plane.frame
        if form.orientation == "point":
            other = tip + self.stretch * (other - tip)
        elif form.orientation == "vector" and form.table.digits.vector_length != 1:
            other = form.table.digits.vector_length * other
        if form.rotary and form.machine is not None and form.machine.names != form.other_words:
            other = other[:, ::-1]
        numbers = np.concatenate((tip, other[:, : len(form.other_words)]), axis=1)
        if self.units != "mm":
            numbers[:, : 6 if form.orientation == "point" else 3] /= MM_PER_UNIT[self.units]
        return numbers

    def rotary_blocks(self, ticks: Ints, *, unwind: bool = True) -> dict[str, tuple[str, ...]]:
        """Blocks that bring the rotary axes to zero, and to where a row of ticks has them; none without such.

        Without `unwind`, endless axes go to the nearest full turn instead of zero.
        """
        if not self.form.rotary or self.form.machine is None:
            return {}
        ticks = np.append(ticks, np.zeros(len(self.words) - len(ticks), np.int64))
        degree = 10**self.form.table.digits.angle
        low, high = self.form.machine.limits.T * degree
        order = [self.form.machine.names.index(word) for word in self.form.other_words]
        zero = np.clip(0.0, np.ceil(low), np.floor(high))[order].astype(np.int64)
        if not unwind:
            endless = np.isinf(low)[order]
            zero[endless] = 360 * degree * np.round(ticks[3:][endless] / (360 * degree))
        goals = {"rotary_zero": np.append(np.zeros(3, np.int64), zero), "rotary_start": ticks}
        return {name: (self.rapid(goal, chosen=slice(3, None)),) for name, goal in goals.items()}

    def angles(self, ticks: Ints) -> Floats:
        """(r, 2) degrees of rows of ticks, in the order of the machine's axes."""
        machine = self.form.machine
        assert machine is not None
        order = [3 + self.form.other_words.index(name) for name in machine.names]
        found = np.zeros((len(ticks), 2))
        found[:, : len(order)] = ticks[:, order] / 10.0**self.form.table.digits.angle
        return found

    def tool_axis(self, ticks: Ints) -> Floats:
        """(3,) tool axis of a row of ticks, in the coordinates in which X and Y are given while the tool is high."""
        machine, orientation = self.form.machine, self.form.orientation
        axis: Floats = np.array([0.0, 0.0, 1.0])  # axes of the machine, or a tool that stays along Z
        if self.plane is not None:
            axis = self.plane.frame[:, 2]
        elif orientation == "vector":
            axis = unit(ticks[None, 3:].astype(np.float64))[0]
        elif orientation == "angles" and machine is not None:
            axis = tool_axis(machine, self.angles(ticks[None]))[0]
        return axis

    def lifted(self, ticks: Ints, distance: float) -> Ints:
        """Row of ticks so many mm back along the tool axis; a point on the axis moves as the tip does."""
        step = distance / MM_PER_UNIT[self.units] * self._back(ticks)
        shift = np.round(step * 10.0 ** self.decimals[0]).astype(np.int64)
        row = ticks.copy()
        row[:3] += shift
        if self.form.orientation == "point":
            row[3:] += shift
        return row

    def _back(self, ticks: Ints) -> Floats:
        """(3,) way of X Y Z for a step of one along the tool axis."""
        machine = self.form.machine
        if self.plane is not None:
            return np.array([0.0, 0.0, 1.0])
        if self.form.orientation == "point":
            return unit((ticks[3:] - ticks[:3]).astype(np.float64))
        if self.form.orientation == "machine" and machine is not None:
            angles = self.angles(ticks[None])
            ends = [machine_position(machine, tip, angles)[0] for tip in (tool_axis(machine, angles), np.zeros((1, 3)))]
            return unit(ends[0] - ends[1])
        return self.tool_axis(ticks)


@dataclass(frozen=True)
class BlockRows:
    """Rows that nothing interrupts, r of them."""

    ticks: Ints  #: (r, c) numbers in steps of their last digit
    move: Ints  #: (r,) pose, for messages
    rapid: Bools  #: (r,)
    feed: Floats  #: (r,) mm/min, mm/rev or 1/min, NaN where there is none
    mode: Ints  #: (r,) `FeedMode` or `INVERSE_TIME`
    curve: NDArray[np.int8]  #: (r,) as in `Rows`
    arc: Ints | None = None  #: (r,) circle that the tool gets here on, -1 for none; None where there is none
    dwell: Bools | None = None  #: (r,) where the tool waits after the block
    #: (r, 4, c) Bézier points of the knot intervals of curves, in units of the text, for polynomials
    bezier: Floats | None = None
    spline: Floats | None = None  #: (r, 3) as in `Rows`
    blend: Floats | None = None  #: (r,), mm; as in `Rows`
    left: Bools | None = None  #: (r,) as in `Rows`

    @classmethod
    def straight(cls, program: Program, ticks: Ints, move: Ints, *, rapid: bool = False) -> BlockRows:
        """Straight moves in rapid, or at the feeds of moves of the program."""
        count, mode = len(ticks), program.feed_mode[move].astype(np.int64)
        return cls(ticks, move, np.full(count, rapid), program.feed[move], mode, np.zeros(count, np.int8))

    def __len__(self) -> int:
        return len(self.ticks)

    def with_programmed_feed(self, program: Program) -> BlockRows:
        """Give the first move the program's feed where it has a time, which counts the way from the pose before."""
        if self.mode[0] != INVERSE_TIME:
            return self
        feed, mode = self.feed.copy(), self.mode.copy()
        feed[0], mode[0] = program.feed[self.move[0]], program.feed_mode[self.move[0]]
        return replace(self, feed=feed, mode=mode)
