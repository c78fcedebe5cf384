"""Retracts, and the ways back from them.

A *way back* begins with a retract, or with the program. On it rapids do not say in full where they end; the first that
does is the *arrival*. Those after a retract are left out of the motion, so they must not lead the tool anywhere else:
over the arrival first, with the axis that it has there, and then down. One block may do all of this at once.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import Bools, Floats
from cornersmooth.nc_reader.elements import Element, Elements, Problem

#: a full turn, degrees
_TURN: Final = 360.0


class Retracts:
    """Follows the retracts of a program.

    Parameters
    ----------
    name : str or None
        Of the program, for messages.
    problems : list of Problem
        Takes ways back that lead elsewhere, or down too early.
    zero : (2,) float64
        Degrees at which each rotary axis is at zero, or as near as its limits let it.
    """

    def __init__(self, name: str | None, problems: list[Problem], zero: Floats) -> None:
        self._name, self._problems = name, problems
        self._zero = np.concatenate((np.full(3, np.nan), zero, [0.0]))
        #: whether an axis is at a position of the machine
        self.open = False
        #: whether the program is on a way back
        self.coming = True
        #: elements before which the tool is retracted, ascending
        self.places: list[int] = []
        #: rapids of the way back: (6,) words before and behind, NaN where not known, in the plane that is on; the line;
        #: whether rotary axes turn in it without the tip
        self._way: list[tuple[Floats, Floats, int, bool]] = []
        self._left = np.full(6, np.nan)  # where the way back began

    def leave(self, elements: int, words: Floats) -> None:
        """Take note of a retract after so many elements, and where the words (6,) have the tool then."""
        if not self.coming:
            self._left = words
        self.open = self.coming = True
        if self.places[-1:] != [elements]:
            self.places.append(elements)

    def end(self, *, turned: bool) -> None:
        """Look at rapids that lead to no arrival: the program ends, or a plane begins or ends.

        Where the axis has `turned` to is not looked at before a plane, which hangs on it.
        """
        unknown = np.full(6, np.nan)
        unknown[3:] = unknown[3:] if turned else self._left[3:]
        self._check(unknown, arrived=False)

    def arrive(self, run: Elements, before: Floats, *, free: bool) -> Elements:
        """Leave out the rapids of the way back from a retract, and look at where they lead.

        The words (6,) are those before the run; `free`: whether rotary axes turn without the tip.

        Raises
        ------
        InputError
            CS503 for a feed move before all of the tip is known.
        """
        unknown: Bools = np.logical_or.reduce(np.isnan(run.tip), axis=1)
        gone = unknown & (run.kind == Element.RAPID)
        if (fed := unknown & ~gone).any() and self.open:
            hint = "say X Y Z in rapid after a position of the machine, before the first feed"
            what = "a feed move where not all of the position is known"
            raise InputError("CS503", what, hint, file=self._name, line=int(run.line[np.argmax(fed)]))
        arrived = bool(not unknown.all())
        count = int(np.argmin(unknown)) + 1 if arrived else len(unknown)
        words = np.vstack((before, np.hstack((run.tip[:count], run.second[:count]))))
        rapid = run.kind[:count] == Element.RAPID
        self._way += [(words[k], words[k + 1], int(run.line[k]), free) for k in np.flatnonzero(rapid).tolist()]
        dropped = gone & self.open
        if arrived:
            self._check(words[-1], arrived=bool(rapid[-1]))
            self.open = self.coming = False
        return run.only(~dropped) if dropped.any() else run

    def _check(self, arrival: Floats, *, arrived: bool) -> None:
        """Complain of the rapids of a way back to an arrival (6,), NaN where it is open; the last of them `arrived`."""
        aside, nowhere = False, bool(np.isnan(arrival[:2]).any())  # over nothing that is known
        for k, (before, behind, line, free) in enumerate(self._way, 1 - len(self._way)):
            moved = ~np.isnan(behind) & (behind != before)
            sideways, down = bool(moved[:2].any()), bool(moved[2])
            # without the tip axes may also turn to zero, or back, by themselves
            there = (behind == arrival) | np.isnan(arrival)
            if free and not sideways and not down:
                there |= (behind == self._left) | (behind % _TURN == 0.0) | (behind == self._zero)
            early = down and (aside or not arrived or k < 0)
            for wrong, problem in (
                (
                    sideways and _elsewhere(behind[:2], arrival[:2]),
                    ("CS531", "a rapid of the way back from a retract is not over the position that it leads to"),
                ),
                ((moved & ~there)[3:].any(), ("CS531", "the tool axis turns elsewhere on the way back from a retract")),
                (
                    early and (nowhere or _elsewhere(before[:2], arrival[:2]) or _elsewhere(before[3:], arrival[3:])),
                    ("CS531", "the tool comes down from a retract before it is over its position, with its axis there"),
                ),
            ):
                if wrong:
                    self._problems.append(Problem(problem[0], 0, line, problem[1]))
            aside |= sideways
        self._way = []


def _elsewhere(words: Floats, wanted: Floats) -> bool:
    """Whether words are not those that are wanted; what is known of neither is alike."""
    return not np.array_equal(words, wanted, equal_nan=True)
