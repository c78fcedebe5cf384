"""Rows as text: each part of a block is a few texts and which of them each row has; parts are joined once.

Ticks are the one rounding. Python runs per change of state and per run of circular blocks, never per row.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Bools, FeedMode, Floats, Ints, Program
from cornersmooth.nc.circles import Circles
from cornersmooth.nc.control import INVERSE_TIME
from cornersmooth.nc.coordinates import BlockRows, Coordinates
from cornersmooth.nc.curves import Part, joined, prepared, shapes_of, spelt
from cornersmooth.nc.messages import Findings, refused
from cornersmooth.nc.modals import Modals
from cornersmooth.nc.program_frame import BLEND_STEP
from cornersmooth.text import format_number, interleave, to_ticks

MODAL_CURVES = ("g6.2", "bspline")  #: curve styles whose word holds until another kind of motion
_ROUNDING = 1e-6  #: steps of the last digit that a number may be below a whole one and still is it


@dataclass
class Blocks:
    """Writes rows, in what the control remembers."""

    program: Program
    circles: Circles  #: how arcs are written
    modals: Modals
    findings: Findings
    written: int = 0  #: blocks
    usual_blend: int = 0  #: how far the head lets the control round the corners of lines, in steps; 0 for no other

    def text(self, rows: BlockRows, at: Coordinates, words: str = "", dwell: Sequence[str] = ()) -> bytes:
        """Text of rows, one at least; `words` stand in their first block, `dwell` are blocks behind some rows."""
        modals = self.modals
        if at.form.curve == "bspline":
            modals.now["spline"] &= bool((rows.curve > 0).any())
        rows = prepared(rows, at)
        count, rapid = len(rows), rows.rapid.astype(np.int64)
        shapes = shapes_of(rows, at, self.circles, open_spline=modals["spline"])
        none = np.zeros(count, np.int64)
        before = [part for part in self._changes(rows, at) if len(part[0]) > 1]  # mostly nothing changes
        if at.form.curve in MODAL_CURVES:
            if before and at.form.curve == "g6.2":
                # G1 where blocks stand right behind a curve: G06.2 is modal, and takes nothing but control points
                behind_curve = np.concatenate(([modals["spline"]], rows.curve[:-1] > 0))
                behind_curve &= np.logical_or.reduce([ids > 0 for _, ids in before])
                before.insert(0, ([b"", f"{at.motion.line}\n".encode()], behind_curve.astype(np.int64)))
            modals.now["spline"] = bool(rows.curve[-1])
        if words:
            before.append(([b"", f"{words}{at.gap}".encode()], (np.arange(count) == 0).astype(np.int64)))
        codes: Part = [f"{word}{at.gap}".encode() for word in (at.motion.line, at.motion.rapid)], rapid
        ends: list[Part] = [([b"", at.motion.rapid_end.encode()], rapid)] if at.motion.rapid_end else []
        ends = [self._feeds(rows, at, rows.curve > 0), *ends, ([b"\n"], none)]
        behind: list[Part] = []
        for shape in shapes:
            texts, ids = codes
            ids = ids.copy()
            ids[shape.rows] = len(texts) + shape.code[1]
            codes = [*texts, *shape.code[0]], ids
            behind += [_of_rows(part, shape.rows) for part in shape.behind]
            ends += [_of_rows(shape.after, shape.rows)] if shape.after is not None else []
        ends = behind + ends
        if rows.dwell is not None and dwell:
            ends.append(([b"", "".join(f"{block}\n" for block in dwell).encode()], rows.dwell.astype(np.int64)))
        left_out = None
        if at.leaves_out:
            codes, left_out = _left_out(rows, at, before, codes)
        (head, head_id), (tail, tail_id) = joined(*before, codes), joined(*ends)
        for texts, ids in ((head, head_id), (tail, tail_id)):
            lines = [text.count(b"\n") for text in texts]
            several = len(set(lines)) > 1
            self.written += int(np.bincount(ids, minlength=len(lines)) @ lines) if several else lines[0] * count
        apart = [(shape.rows, *shape.numbers) for shape in shapes if shape.numbers is not None]
        closed = [at.closing.encode() + text for text in tail] if at.closing else tail
        if not apart:
            return at.format.rows(at.shown(rows.ticks), head, head_id, closed, tail_id, left_out)
        which = np.zeros(count, np.int64)
        for number, (own, _, _) in enumerate(apart, 1):
            which[own] = number
        plain = which == 0
        out = None if left_out is None else left_out[plain]
        made = [at.format.each(at.shown(rows.ticks[plain]), head, head_id[plain], closed, tail_id[plain], out)]
        made += [form.each(numbers, head, head_id[own], tail, tail_id[own]) for own, form, numbers in apart]
        return interleave(which, made)

    def _changes(self, rows: BlockRows, at: Coordinates) -> list[Part]:
        """Blocks that rows ask for: how far corners are rounded, what feeds count, the plane of arcs."""
        modals, changes = self.modals, []
        usual = self.usual_blend if at.plane is None else 0
        if usual and not modals["compensation"]:  # under which LinuxCNC refuses the block
            blend = np.full(len(rows), usual)
            if rows.blend is not None:
                steps = np.floor(rows.blend / (self.program.mm_per_unit * BLEND_STEP) + _ROUNDING)
                blend = np.maximum(steps, 1.0).astype(np.int64)
            changes.append(self._change("blend", np.arange(len(rows)), blend, len(rows)))
        feeding = np.flatnonzero(~rows.rapid)
        modes = rows.mode[feeding]
        if not modals.speed:
            per_turn = (np.diff(modes, prepend=modals["feed_mode"]) != 0) & (modes == FeedMode.PER_REVOLUTION)
            for move in rows.move[feeding[per_turn]].tolist():
                self._refuse(at, move, "CS343b")
                self.findings.note("CS324", int(self.program.line[move]))
        changes.append(self._change("feed_mode", feeding, modes, len(rows)))
        if rows.arc is not None:
            on_arc = np.flatnonzero(rows.arc >= 0)
            changes.append(self._change("plane", on_arc, self.circles.plane[rows.arc[on_arc]], len(rows)))
        return changes

    def _change(self, group: str, rows: Ints, values: Ints, count: int) -> Part:
        """Blocks before those of `count` rows, in ascending order, from which on a group has another value."""
        ids = np.zeros(count, np.int64)
        changed = np.flatnonzero(np.diff(values, prepend=self.modals[group]))
        if not len(changed):
            return [b""], ids
        distinct, which = np.unique(values[changed], return_inverse=True)
        ids[rows[changed]] = 1 + which.reshape(-1)
        self.modals.now[group] = int(values[-1])
        blocks = (self.modals.say(group, value) for value in distinct.tolist())
        return [b"", *("".join(f"{block}\n" for block in some).encode() for some in blocks)], ids

    def _feeds(self, rows: BlockRows, at: Coordinates, curved: Bools) -> Part:
        """F where it is another, at the first row of a curve; in every block where it counts moves per minute."""
        none = np.zeros(len(rows), np.int64)
        within = curved.copy()
        within[:1] = False
        within[1:] &= curved[:-1] & (rows.move[1:] == rows.move[:-1])
        feeding = np.flatnonzero(~rows.rapid & ~within)
        missing = np.isnan(rows.feed[feeding])
        without = rows.move[feeding[missing & ~curved[feeding]]]
        if len(without) and self.modals["feed"] < 0:
            self._refuse(at, int(without[0]), "CS343")
        self.findings.note_each("CS311", self.program.line[without])
        given = feeding[~missing]
        mode = rows.mode[given]
        ticks = feed_ticks(rows.feed[given], mode, self.program, at)
        # F is given again with its unit: the same number per minute and per revolution is not the same feed
        keys = 4 * ticks + mode
        changed = np.flatnonzero((np.diff(keys, prepend=self.modals["feed"]) != 0) | (mode == INVERSE_TIME))
        if not len(changed):
            return [b""], none
        texts, which = spelt(ticks[changed], lambda value: f"{at.gap}{at.motion.feed}{feed_digits(int(value), at)}")
        none[given[changed]] = 1 + which
        self.modals.now["feed"] = int(keys[-1])
        return [b"", *texts], none

    def _refuse(self, at: Coordinates, move: int, code: str) -> None:
        """Refuse what the control would refuse before it runs a line."""
        if at.motion.feed_needed:
            raise refused(code, self.program, int(self.program.line[move]))


def feed_ticks(feed: Floats, mode: Ints, program: Program, at: Coordinates) -> Ints:
    """Numbers of feeds, mm/min, mm/rev or 1/min, in steps of their last digit."""
    number = feed / np.where(mode == INVERSE_TIME, 1.0, program.mm_per_unit)
    if at.motion.inch_feed != 1 and program.units == "inch":
        number[mode == FeedMode.PER_MINUTE] *= at.motion.inch_feed
    return to_ticks(number, at.form.table.digits.feed)


def feed_digits(ticks: int, at: Coordinates) -> str:
    """Number of a feed, as it is written."""
    decimals = at.form.table.digits.feed
    text = format_number(ticks / 10.0**decimals, decimals, trim=True)
    return text if at.motion.feed_point else text.rstrip(".")


def _of_rows(part: Part, rows: Bools) -> Part:
    """Texts of some rows as those of all: nothing for the others."""
    ids = rows.astype(np.int64)
    if len(part[0]) > 1:
        ids[rows] += part[1]
    return [b"", *part[0]], ids


def _left_out(rows: BlockRows, at: Coordinates, before: Sequence[Part], codes: Part) -> tuple[Part, Bools]:
    """(r, c) words that repeat from the row before, nothing else between; codes without those that do so, too."""
    keeps, (texts, code) = at.motion.modal, codes
    free = code <= 1
    for _, ids in before:
        free &= ids == 0
    free[:1] = False
    free[1:] &= rows.arc[:-1] < 0 if rows.arc is not None else True
    free[1:] &= ~rows.dwell[:-1] if rows.dwell is not None else True
    same = np.zeros(rows.ticks.shape, np.bool_)
    same[1:] = rows.ticks[1:] == rows.ticks[:-1]
    if at.form.orientation == "vector":
        same[:, 3:] = np.logical_and.reduce(same[:, 3:], axis=1, keepdims=True)
    if "tip" not in keeps:
        same[:, :3] = False
    if "axis" not in keeps or at.modulo:
        same[:, 3:] = False
    free &= ~np.logical_and.reduce(same, axis=1)
    same &= free[:, None]
    if "code" in keeps:
        free[1:] &= rows.rapid[1:] == rows.rapid[:-1]
        code = np.where(free, len(texts), code)
    blank = at.gap.encode()
    return ([*(text.removesuffix(blank) for text in texts), b""], code), same
