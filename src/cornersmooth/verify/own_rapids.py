"""Rapids along the tool that posts add before and behind a retract: no part of the motion that the CL file asks for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints, Move
from cornersmooth.verify.cl_motion import Original

#: printed digits that ends may be off
_STEPS = 2.0


@dataclass(frozen=True)
class OwnRapids:
    """Knows where the CL file goes in rapid."""

    original: Original

    @cached_property
    def kind(self) -> NDArray[np.uint8]:
        """(m,) `Move` of each move."""
        return self.original.program.kind[self.original.pose]

    @cached_property
    def _ranks(self) -> tuple[Floats, Floats]:
        """(m,) number of each move among those that lead somewhere: of all, and of those that are no holes."""
        return self._rank(self.kind >= 0), self._rank(self.kind != Move.HOLE)

    def added(self, start: Floats, end: Floats, step: float, near: Floats) -> bool:
        """Whether the CL file has a pose at the end of a rapid nearer to the part, and does not ask for the rapid.

        Out of holes the tool comes without a pose at its bottom, and over them it goes without one above. `step` is the
        last printed digit, `near` the one of both ends (3,) that is nearer to the part; all in mm.
        """
        leaves = np.array_equal(near, start)
        at_near, at_far = self._moves_to(near, step), self._moves_to(end if leaves else start, step)
        beside = at_far + (-1 if leaves else 1)
        at_far = at_far[np.isin(self.kind[at_far], (Move.RAPID, Move.HOLE))]
        one, other = (at_near, at_far) if leaves else (at_far, at_near)
        # at holes that are left out nothing moves
        asked = any(_follow(rank[one], rank[other]) for rank in self._ranks)
        asked = asked or self._over_hole(near, beside, step)
        asked = asked or (leaves and self._over_hole(near, None, step, below=True))
        return not (asked or (self.kind[at_near] == Move.HOLE).all())

    def _over_hole(self, tip: Floats, moves: Ints | None, step: float, *, below: bool = False) -> bool:
        """Whether one of some moves, or of all, is a hole, and a tip (3,) in its line, up to digits; `below`: in it."""
        holes, original = np.flatnonzero(self.kind == Move.HOLE), self.original
        pose = original.pose[holes if moves is None else moves[np.isin(moves, holes)]]
        away, axis = tip - original.program.tip[pose], original.program.axis[pose]
        height = np.einsum("ij,ij->i", away, axis)
        inside = height < (-_STEPS * step if below else np.inf)
        return bool(((np.linalg.norm(away - height[:, None] * axis, axis=1) <= _STEPS * step) & inside).any())

    def goes_to(self, tip: Floats, step: float) -> bool:
        """Whether the CL file goes to a tip in rapid, up to printed digits; so it does in and over all of its holes."""
        there = self._moves_to(tip, step)
        return bool((self.kind[there] == Move.RAPID).any()) or self._over_hole(tip, None, step)

    def _moves_to(self, tip: Floats, step: float) -> Ints:
        """Moves of the CL file that end at a tip (3,), up to printed digits."""
        original = self.original
        poses = np.flatnonzero(np.abs(original.program.tip[:, 0] - tip[0]) <= _STEPS * step)
        close = np.abs(original.program.tip[poses] - tip) <= _STEPS * step
        poses = poses[close.all(axis=1)]
        moves = np.searchsorted(original.pose, poses)
        return moves[np.isin(poses, original.pose[moves[moves < len(original.pose)]])]

    def _rank(self, chosen: Bools) -> Floats:
        """(m,) number of each move among the chosen ones that lead somewhere; NaN for the others."""
        original = self.original
        moves = np.flatnonzero(chosen)
        pose = original.pose[moves]
        moved = np.zeros(len(chosen), np.bool_)
        for values in (original.program.tip[pose], original.program.axis[pose]):
            moved[moves[1:]] |= (values[1:] != values[:-1]).any(axis=1)
        return np.where(chosen, np.cumsum(moved), np.nan)


def _follow(ranks: Floats, others: Floats) -> bool:
    """Whether one of the others is the next behind one of the first."""
    return bool(np.isin(ranks + 1.0, others).any())
