"""Runs of rows as text: the words of every block, many rows at a time.

Ticks are the one rounding; words come from tables. Python runs per change of state and per run of circular blocks,
never per row.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cornersmooth.errors import InputError
from cornersmooth.kinematics import machine_position, tool_axis
from cornersmooth.model import Bools, FeedMode, Floats, Ints, Program
from cornersmooth.nc.circles import FIRST_PLANE, ArcBlocks, Circles
from cornersmooth.nc.control import INVERSE_TIME
from cornersmooth.nc.curve_blocks import Curves, Run, bezier_points, curves_for
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.nc.planes import Plane
from cornersmooth.nc.program_frame import BLEND_STEP, blend_word
from cornersmooth.nc.statement_writer import StatementWriter
from cornersmooth.text import RowFormat, format_number, interleave, to_ticks
from cornersmooth.vectors import unit

#: steps of the last digit that a number may be below a whole one and still is it
_ROUNDING = 1e-6


@dataclass
class BlockWriter:
    """Writes runs and remembers what a control remembers: feed, feed mode, plane."""

    form: Form
    program: Program
    statements: StatementWriter  #: knows the plane, which statements change too, and the words of the control
    findings: Findings
    circles: Circles  #: how arcs are written
    stretch: float = 1.0  #: `Form.stretch`
    blend: str = ""  #: how far the head lets the control round the corners of lines; empty for no other
    plane: Plane | None = None  #: tilted plane in whose coordinates positions are written
    modal: bool = False  #: whether words that repeat are left out, where the control keeps them
    blocks: int = 0
    _feed: int = -1  # ticks and feed mode of the last F, as one number
    _mode: int = FeedMode.PER_MINUTE
    _format: RowFormat = field(init=False)
    _curves: Curves = field(init=False)
    _blank: str = field(init=False)
    _leaves_out: bool = field(init=False)
    _modulo: list[int] = field(init=False)  #: columns of modulo axes
    _closing: bytes = field(init=False)
    _blend_in_force: int = field(init=False)  # in steps of its last digit

    def __post_init__(self) -> None:
        motion = self.form.mode.motion
        self._blank = " " if motion.spaces else ""
        self._leaves_out = self.modal and bool(motion.modal) and not self.form.curves
        words = (*motion.coordinates, *self.form.other_words)
        decimals = self.form.decimals(self.program.units)
        modulo = self.form.machine.modulo if self.form.machine is not None and self.form.rotary else ()
        self._modulo = [k for k, word in enumerate(words) if k > 2 and word in modulo]
        spaced, self._closing = self._addresses(range(len(words)))
        if self._leaves_out:  # what is left out takes the blank before it with it
            spaced = (self._blank.encode() + spaced[0], *spaced[1:])
        self._format = self._row_format(spaced, decimals)
        if self.form.curve:
            self._curves = curves_for(self.form, self.program, self.findings)
        else:
            self._curves = ArcBlocks(self.circles, motion, self._format)
        self._blend_in_force = self._usual_blend

    def _addresses(self, columns: Sequence[int]) -> tuple[tuple[bytes, ...], bytes]:
        """Addresses of columns, as they precede the numbers, and what follows the last number."""
        motion = self.form.mode.motion
        words, end = [], ""
        for place, column in enumerate(columns):
            word = (*motion.coordinates, *self.form.other_words)[column]
            before, behind = motion.shortest if column in self._modulo else ("", "")
            words.append(f"{end}{self._blank if place else ''}{word}{before}".encode())
            end = behind
        return tuple(words), end.encode()

    def _modulo_ticks(self, ticks: Ints) -> Ints:
        """Ticks of rows with those of modulo axes from 0 to 360 degrees."""
        if not self._modulo:
            return ticks
        said = ticks.copy()
        said[..., self._modulo] %= 360 * 10**self.form.table.digits.angle
        return said

    def _row_format(self, words: tuple[bytes, ...], decimals: tuple[int, ...]) -> RowFormat:
        motion = self.form.mode.motion
        return RowFormat(
            words, decimals, plus=motion.signs, trim=not motion.trailing_zeros, leading_zero=motion.leading_zeros
        )

    def rotary_blocks(self, ticks: Ints, *, unwind: bool = True) -> dict[str, tuple[str, ...]]:
        """Blocks that bring the rotary axes to zero, and to where a row of ticks has them; none without such.

        Without `unwind`, endless axes go to the nearest full turn instead of zero.
        """
        if not self.form.rotary or self.form.machine is None:
            return {"rotary_zero": (), "rotary_start": ()}
        if len(ticks) < self.columns:
            ticks = np.append(ticks, np.zeros(self.columns - len(ticks), np.int64))
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

    def tip(self, ticks: Ints) -> Floats:
        """(3,) tip in the part, mm, of a row of ticks under tool tip control or in a tilted plane."""
        tip: Floats = ticks[:3].astype(np.float64) * self.form.rounding(self.program.units)
        if self.plane is not None:
            tip = self.plane.frame @ tip
        return tip

    def lifted(self, ticks: Ints, distance: float) -> Ints:
        """Row of ticks so many mm back along the tool axis; a point on the axis moves as the tip does."""
        step = distance / self.program.mm_per_unit * self._back(ticks)
        shift = np.round(step * 10.0 ** self._format.decimals[0]).astype(np.int64)
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

    def rapid(self, ticks: Ints, words: str = "", chosen: slice | Bools = slice(None)) -> str:
        """Rapid block of some words of a row of ticks, all by default, after words of other kinds."""
        motion, before = self.form.mode.motion, f"{words}{self._blank}" * bool(words)
        columns = np.arange(self.columns)[chosen].tolist()
        decimals = np.array(self.form.decimals(self.program.units))[chosen].tolist()
        spelt, closing = self._addresses(columns)
        prefix, suffix = f"{motion.rapid}{self._blank}".encode(), closing + motion.rapid_end.encode()
        row = self._row_format(spelt, tuple(decimals))
        none = np.zeros(1, np.int64)
        return before + row.rows(self._modulo_ticks(ticks)[chosen][None], [prefix], none, [suffix], none)[0].decode()

    @property
    def columns(self) -> int:
        """Numbers of a row."""
        return len(self._format.decimals)

    def take_over(self, other: BlockWriter) -> None:
        """Go on where another writer has stopped."""
        self._feed, self._mode = other._feed, other._mode

    def forget_feed(self) -> None:
        """Say the feed again with the next block: others may have changed it, or the program is started there."""
        self._feed = -1

    def feed_mode(self, mode: int) -> list[str]:
        """Block that selects a feed mode, where it is another than in force."""
        blocks = [self.statements.words.feed_mode[mode]] if mode != self._mode else []
        self._take_mode(mode)
        return blocks

    def _take_mode(self, mode: int) -> None:
        self._mode = mode
        self.statements.per_revolution = mode == FeedMode.PER_REVOLUTION

    def feed_word(self, feed: float, mode: int) -> str:
        """Number of a feed in mm/min or mm/rev, as it is written."""
        motion = self.form.mode.motion
        scale = motion.inch_feed if self.program.units == "inch" and mode == FeedMode.PER_MINUTE else 1
        return self._feed_digits(int(to_ticks(feed / self.program.mm_per_unit * scale, self.form.table.digits.feed)))

    def end(self) -> list[str]:
        """Blocks that bring feed mode and plane back to where they were at the start."""
        words, blocks = self.statements.words, []
        self._curves.finish()
        if self._mode != FeedMode.PER_MINUTE:
            blocks += [words.feed_mode[key] for key in (int(FeedMode.PER_MINUTE),) if key in words.feed_mode]
            self._take_mode(FeedMode.PER_MINUTE)
        if self.statements.plane != FIRST_PLANE:
            blocks += [words.plane[key] for key in (FIRST_PLANE,) if key in words.plane]
            self.statements.plane = FIRST_PLANE
        return blocks

    def ticks(self, tip: Floats, other: Floats) -> Ints:
        """Numbers of rows in steps of their last digit, (r, c), from `Rows.tip` and `Rows.other`."""
        return to_ticks(self._numbers(tip, other), self._format.decimals)

    def bezier(self, tip: Floats, other: Floats, curve: NDArray[np.int8], spline: Floats | None) -> Floats | None:
        """`Run.bezier` where the form writes polynomials."""
        if self._curves.format is None or spline is None or not (curve > 0).any():
            return None
        return bezier_points(self._numbers(tip, other), curve, spline)

    def _numbers(self, tip: Floats, other: Floats) -> Floats:
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
        elif form.vectors and form.table.digits.vector_length != 1:
            other = form.table.digits.vector_length * other
        if form.rotary and form.machine is not None and form.machine.names != form.other_words:
            other = other[:, ::-1]
        numbers = np.concatenate((tip, other[:, : len(form.other_words)]), axis=1)
        unit = self.program.mm_per_unit
        if unit != 1.0:
            numbers[:, : 6 if form.orientation == "point" else 3] /= unit
        return numbers

    def text(self, run: Run, dwell: int = 0, words: str = "") -> bytes:
        """Text of a run that is not empty; `dwell` in milliseconds, `words` stand in its first block."""
        run = self._curves.prepare(run)
        prefix, prefix_id, extra = self._prefixes(run, words)
        left_out = self._left_out(run, prefix, prefix_id) if self._leaves_out else None
        suffix, suffix_id = self._suffixes(run, dwell)
        self.blocks += len(run) + extra
        own = self._curves.rows(run)  # rows with words of their own, where these have such
        if self._curves.format is None or not own.any():
            suffix = [self._closing + end for end in suffix]
            return self._format.rows(self._modulo_ticks(run.ticks), prefix, prefix_id, suffix, suffix_id, left_out)[0]
        plain, numbers = ~own, self._curves.numbers(run, own)
        out = None if left_out is None else left_out[plain]
        texts = [
            self._format.rows(run.ticks[plain], prefix, prefix_id[plain], suffix, suffix_id[plain], out),
            self._curves.format.rows(numbers, prefix, prefix_id[own], suffix, suffix_id[own]),
        ]
        return interleave(own.astype(np.int64), texts)

    def _prefixes(self, run: Run, words: str) -> tuple[list[bytes], Ints, int]:
        """Table of what stands before the numbers, an entry for each row, and the blocks hidden in the prefixes."""
        motion = self.form.mode.motion
        table = [f"{word}{self._blank}".encode() for word in (motion.line, motion.rapid)]
        chosen = run.rapid.astype(np.int64)
        before: dict[int, bytes] = {}  # blocks before some rows
        feeding = np.flatnonzero(~run.rapid)
        modes = run.mode[feeding]
        for place in np.flatnonzero(np.diff(modes, prepend=self._mode)).tolist():
            self._take_mode(int(modes[place]))
            if self._mode == FeedMode.PER_REVOLUTION and not self.statements.speed:
                text = "feed per revolution while no spindle speed is given: controls stop there or stand still"
                self._refuse(int(run.move[feeding[place]]), text, "give the spindle its speed in the CL file")
                self.findings.add("CS324", "warning", int(self.program.line[run.move[feeding[place]]]), text)
            before[int(feeding[place])] = self._block(self.statements.words.feed_mode, self._mode)
        if run.arc is not None:
            rows = np.flatnonzero(run.arc >= 0)
            planes = self.circles.plane[run.arc[rows]]
            for place in np.flatnonzero(np.diff(planes, prepend=self.statements.plane)).tolist():
                block = self._block(self.statements.words.plane, int(planes[place]))
                before[int(rows[place])] = before.get(int(rows[place]), b"") + block
            if len(planes):
                self.statements.plane = int(planes[-1])
        if words:
            before[0] = before.get(0, b"") + f"{words}{self._blank}".encode()
        extra = sum(blocks.count(b"\n") for blocks in before.values())
        if self._curves.rows(run).any():
            extra += self._curves.add_prefixes(run, table, chosen)
        entries: dict[bytes, int] = {}
        for row, blocks in before.items():
            text = blocks + table[chosen[row]]
            entry = entries.setdefault(text, len(table))
            if entry == len(table):
                table.append(text)
            chosen[row] = entry
        return table, chosen, extra + self._say_blends(run, table, chosen)

    def _left_out(self, run: Run, table: list[bytes], chosen: Ints) -> Bools:
        """(r, c) words that repeat from the row before, nothing else between; drops the code where it does, too."""
        keeps, plain = self.form.mode.motion.modal, chosen <= 1
        free = plain.copy()
        free[:1] = False
        free[1:] &= run.arc[:-1] < 0 if run.arc is not None else True
        free[1:] &= ~run.dwell[:-1] if run.dwell is not None else True
        same = np.zeros(run.ticks.shape, np.bool_)
        same[1:] = run.ticks[1:] == run.ticks[:-1]
        if self.form.orientation == "vector":
            same[:, 3:] = np.logical_and.reduce(same[:, 3:], axis=1, keepdims=True)
        if "tip" not in keeps:
            same[:, :3] = False
        if "axis" not in keeps or self._modulo:
            same[:, 3:] = False
        free &= ~np.logical_and.reduce(same, axis=1)
        same &= free[:, None]
        if "code" in keeps:
            free[1:] &= run.rapid[1:] == run.rapid[:-1]
            chosen[free] = len(table)
            table.append(b"")
        blank = self._blank.encode()
        table[:] = [start.removesuffix(blank) for start in table]
        return same

    @property
    def _usual_blend(self) -> int:
        return round(float(self.blend or 0.0) / BLEND_STEP)

    def _say_blends(self, run: Run, table: list[bytes], chosen: Ints) -> int:
        """Put blocks before rows from which on the control may round otherwise than before; returns how many."""
        block, usual = self.form.table.lines.rounding, self._usual_blend
        if not block or not usual or (run.blend is None and self._blend_in_force == usual):
            return 0
        if self.statements.compensated:  # LinuxCNC refuses the block then; what held before was for the usual blend
            return 0
        blend = np.full(len(run), usual)
        if run.blend is not None:
            steps = np.floor(run.blend / (self.program.mm_per_unit * BLEND_STEP) + _ROUNDING)
            blend = np.maximum(steps, 1.0).astype(np.int64)
        rows = np.flatnonzero(np.diff(blend, prepend=self._blend_in_force))
        self._blend_in_force = int(blend[-1])
        pairs, which = np.unique(np.column_stack((blend[rows], chosen[rows])), axis=0, return_inverse=True)
        chosen[rows] = len(table) + which.reshape(-1)
        table += [
            block.format(blend=blend_word(value * BLEND_STEP)).encode() + b"\n" + table[prefix]
            for value, prefix in pairs.tolist()
        ]
        return len(rows)

    def _block(self, table: Mapping[int, str], key: int) -> bytes:
        return table[key].encode() + b"\n" if key in table else b""

    def _suffixes(self, run: Run, dwell: int) -> tuple[list[bytes], Ints]:
        """Table of what stands after the numbers, feed or weight, and an entry for each row."""
        motion, digits = self.form.mode.motion, self.form.table.digits
        table = [b"\n", f"{motion.rapid_end}\n".encode()]
        chosen = run.rapid.astype(np.int64)
        curved = run.curve > 0
        within = curved.copy()
        within[:1] = False
        within[1:] &= curved[:-1] & (run.move[1:] == run.move[:-1])
        feeding = np.flatnonzero(~run.rapid & ~within)
        on_curves: list[tuple[int, bytes]] = []
        if len(feeding):
            feed = run.feed[feeding]
            missing = np.isnan(feed)
            uncounted = missing & ~curved[feeding]
            if uncounted.any():
                self._count_missing(run.move[feeding[uncounted]])
            inverse = run.mode[feeding] == INVERSE_TIME
            unit = np.where(missing, 0.0, feed) / np.where(inverse, 1.0, self.program.mm_per_unit)
            if motion.inch_feed != 1 and self.program.units == "inch":
                unit[run.mode[feeding] == FeedMode.PER_MINUTE] *= motion.inch_feed
            ticks = to_ticks(unit, digits.feed)[~missing]
            given = feeding[~missing]
            # F is given again with its unit: the same number per minute and per revolution is not the same feed
            keys = 4 * ticks + run.mode[given]
            fresh = np.diff(keys, prepend=self._feed) != 0
            fresh |= run.mode[given] == INVERSE_TIME  # which every block wants
            changed = np.flatnonzero(fresh)
            if len(changed):
                values, which = np.unique(ticks[changed], return_inverse=True)
                chosen[given[changed]] = len(table) + which.reshape(-1)
                word = f"{self._blank}{motion.feed}"
                table += [f"{word}{self._feed_digits(value)}\n".encode() for value in values.tolist()]
                self._feed = int(keys[-1])
                rows = given[changed]
                on_curves = [(row, table[chosen[row]]) for row in rows[curved[rows]].tolist()]
        if self._curves.rows(run).any():
            self._curves.add_suffixes(run, table, chosen)
        # the line before a curve brings the feed; where it is nothing in the written digits the curve must
        for row, given_feed in on_curves:
            end, others = table[chosen[row]].split(b"\n", 1)
            chosen[row] = len(table)
            table.append(end + given_feed + others)
        if run.dwell is not None and run.dwell.any():
            blocks = self.statements.dwell(dwell, self.statements.cycles.line)
            chosen[run.dwell] += len(table)
            table += [end + "".join(block + "\n" for block in blocks).encode() for end in table]
            self.blocks += int(np.count_nonzero(run.dwell)) * len(blocks)
        return table, chosen

    def _feed_digits(self, ticks: int) -> str:
        decimals = self.form.table.digits.feed
        text = format_number(ticks / 10.0**decimals, decimals, trim=True)
        return text if self.form.mode.motion.feed_point else text.rstrip(".")

    def _refuse(self, move: int, what: str, hint: str) -> None:
        """Refuse what the control would refuse before it runs a line."""
        if self.form.mode.motion.feed_needed:
            raise InputError("CS343", what, hint, file=self.program.source.name, line=int(self.program.line[move]))

    def _count_missing(self, moves: Ints) -> None:
        text = "feed move without a feed in the CL file: most controls stop with an alarm; give one with --feed"
        if self._feed < 0:
            self._refuse(
                int(moves[0]), "a feed move before any feed, which the control refuses", "give one with --feed"
            )
        self.findings.add_each("CS311", "warning", self.program.line[moves], text)
