"""Rapids along the tool that posts add before and behind a retract: no part of the motion that the CL file asks for."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from cornersmooth.model import Bools, Floats, Ints, Move
from cornersmooth.verify.task import Task

#: printed digits that ends may be off
_STEPS = 2.0


@dataclass(frozen=True)
class OwnRapids:
    """Knows where the CL file goes in rapid.

    Attributes
    ----------
    rapids, holes : (k,) int64
        Moves that are.
    """

    task: Task
    rapids: Ints = field(init=False)
    holes: Ints = field(init=False)

    def __post_init__(self) -> None:
        original = self.task.original
        kind = original.program.kind[original.pose]
        object.__setattr__(self, "rapids", np.flatnonzero(kind == Move.RAPID))
        object.__setattr__(self, "holes", np.flatnonzero(kind == Move.HOLE))

    @cached_property
    def _ranks(self) -> tuple[Floats, Floats]:
        """(m,) number of each move among those that lead somewhere: of all, and of those that are no holes."""
        kind = self.task.original.program.kind[self.task.original.pose]
        return self._rank(kind >= 0), self._rank(kind != Move.HOLE)

    def added(self, start: Floats, end: Floats, step: float, near: Floats) -> bool:
        """Whether the CL file has a pose at the end of a rapid nearer to the part, and does not ask for the rapid.

        Out of holes the tool comes without a pose at its bottom, and over them it goes without one above.

        Parameters
        ----------
        start, end : (3,) float64, mm
        step : float, mm
            Last printed digit.
        near : (3,) float64, mm
            That of both which is nearer to the part.
        """
        leaves = np.array_equal(near, start)
        at_near, at_far = self._moves_to(near, step), self._moves_to(end if leaves else start, step)
        beside = at_far + (-1 if leaves else 1)
        at_far = at_far[np.isin(at_far, self.rapids) | np.isin(at_far, self.holes)]
        one, other = (at_near, at_far) if leaves else (at_far, at_near)
        # at holes that are left out nothing moves
        asked = any(_follow(rank[one], rank[other]) for rank in self._ranks)
        asked = asked or self._over_hole(near, beside, step)
        asked = asked or (leaves and self._over_hole(near, self.holes, step, below=True))
        return not (asked or np.isin(at_near, self.holes).all())

    def _over_hole(self, tip: Floats, moves: Ints, step: float, *, below: bool = False) -> bool:
        """Whether one of some moves is a hole, and a tip (3,) in its line, up to digits; `below`: under its pose."""
        original = self.task.original
        pose = original.pose[moves[np.isin(moves, self.holes)]]
        away, axis = tip - original.program.tip[pose], original.program.axis[pose]
        height = np.einsum("ij,ij->i", away, axis)
        inside = height < (-_STEPS * step if below else np.inf)
        return bool(((np.linalg.norm(away - height[:, None] * axis, axis=1) <= _STEPS * step) & inside).any())

    def goes_to(self, tip: Floats, step: float) -> bool:
        """Whether the CL file goes to a tip in rapid, up to printed digits; so it does in and over all of its holes."""
        return bool(np.isin(self._moves_to(tip, step), self.rapids).any()) or self._over_hole(tip, self.holes, step)

    def _moves_to(self, tip: Floats, step: float) -> Ints:
        """Moves of the CL file that end at a tip (3,), up to printed digits."""
        original = self.task.original
        poses = np.flatnonzero(np.abs(original.program.tip[:, 0] - tip[0]) <= _STEPS * step)
        close = np.abs(original.program.tip[poses] - tip) <= _STEPS * step
        poses = poses[close.all(axis=1)]
        moves = np.searchsorted(original.pose, poses)
        return moves[np.isin(poses, original.pose[moves[moves < len(original.pose)]])]

    def _rank(self, chosen: Bools) -> Floats:
        """(m,) number of each move among the chosen ones that lead somewhere; NaN for the others."""
        original = self.task.original
        moves = np.flatnonzero(chosen)
        pose = original.pose[moves]
        moved = np.zeros(len(chosen), np.bool_)
        for values in (original.program.tip[pose], original.program.axis[pose]):
            moved[moves[1:]] |= (values[1:] != values[:-1]).any(axis=1)
        return np.where(chosen, np.cumsum(moved), np.nan)


def _follow(ranks: Floats, others: Floats) -> bool:
    """Whether one of the others is the next behind one of the first."""
    return bool(np.isin(ranks + 1.0, others).any())
