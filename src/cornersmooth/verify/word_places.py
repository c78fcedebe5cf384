"""Where the words beside the motion stand, and whether they say there what the CL file asks for.

Between two acts that both files have, a rapid, a hole or the way out of it, they belong together. Within a run of feed
moves a word stands at a pose that is passed exactly.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import replace

import numpy as np

from cornersmooth.arrays import distinct
from cornersmooth.control.table import Means
from cornersmooth.model import Bools, Ints, Move
from cornersmooth.nc_reader.elements import Event, Problem
from cornersmooth.statements.asked import asked
from cornersmooth.statements.comparison import Comparison, changed_unseen, without_word
from cornersmooth.statements.tokens import Token, said
from cornersmooth.verify.batches import Batches
from cornersmooth.verify.result import Findings


class WordPlaces:
    """Compares the words of a text with the statements of the CL file when all of it has been read."""

    def __init__(self, batches: Batches, events: Sequence[Event]) -> None:
        self._batches, self._task, self._events = batches, batches.task, events

    def problems(
        self,
        found: Findings,
        means: Means,
        own: frozenset[str],
        clamps: Set[float],
        *,
        retracts: bool,
    ) -> tuple[list[Problem], set[int], str]:
        """What words say wrongly, the NC lines of those where the CL file has GOHOME, and what no word can say.

        Of all batches it is known what was `found`, of the control what its words mean (see `NcProgram`). The user says
        some kinds of statements in words of his `own`. M words that clamp a rotary axis or let it turn stand where the
        machine wants them, not where AUXFUN has them. GOHOME asks for a retract, where the program can have `retracts`.
        """
        batches, original = self._batches, self._task.original
        program = original.program
        # statements by the first move behind them that leads anywhere, words and retracts by the first such element
        places = np.searchsorted(original.pose, [one.pose for one in program.statements]).tolist()
        unique = distinct(np.array(places, np.int64))
        leading, beyond = self._leading(unique, ()), self._leading(unique, batches.acts.left_out)
        requested = [
            one
            for one in asked(self._task.asking, original.pose, means)
            if (one.kind != "auxiliary" or one.value not in clamps) and (one.kind != "home" or retracts)
        ]
        cl_tokens = [replace(one, place=leading.get(one.place, one.place)) for one in requested]
        events = [replace(one, element=self._moving(one.element)) for one in self._events]
        nc_tokens = sorted(said(events, means), key=lambda one: one.place)
        homes = {leading[place] for place, one in zip(places, program.statements, strict=True) if one.word == "GOHOME"}
        # that of those no element names is written
        missed = [int(original.trail.owner[int(one.place)]) for one in found.violations if one.code == "CS524"]
        holes = {self._moving(one.first): one for one in batches.acts.holes}
        within = {first: _within(nc_tokens, first, one.leaves) for first, one in holes.items()}
        inside = {id(one) for some in within.values() for one in some if one.kind in ("dwell", "tap")}
        for first, one in holes.items():  # a dwell elsewhere in a hole is neither the hole's nor DELAY
            bottom = self._moving(one.bottom)
            within[first] = [token for token in within[first] if token.kind != "dwell" or token.place == bottom]
        comparison = Comparison(cl_tokens, [one for one in nc_tokens if id(one) not in inside], means, own)
        acts = self._acts(leading)
        cl_places = np.array(sorted({one.place for one in cl_tokens} | homes), np.int64)
        nc_places = np.array(sorted({one.place for one in nc_tokens}), np.int64)
        # both are compared at acts that words are in front of, and where one of them has words within a run alone
        in_cycles = [first for first, one in holes.items() if within[first] or one.cycle.says]
        numbers = np.searchsorted(acts[:, 1], np.array(in_cycles, np.int64)).tolist()
        rows = {(act, 2, *acts[act].tolist()) for act in numbers}
        uncertain = set(np.searchsorted(acts[:, 0], missed, side="right").tolist())
        runs = np.frombuffer(batches.acts.runs, np.int64).reshape(-1, 4)
        for k, places_of in enumerate((cl_places, nc_places)):
            act_of = np.searchsorted(acts[:, k], places_of)
            alone = _within_runs(places_of, runs[:, k], runs[:, 2 + k]) & ~np.isin(act_of, list(uncertain))
            for act, place, in_run in zip(act_of.tolist(), places_of.tolist(), alone.tolist(), strict=True):
                if act == len(acts):
                    continue
                rows.add((act, 2, *acts[act].tolist()))
                if in_run and place < acts[act, k]:
                    rows.add((act, k, -1 if k else place, place if k else -1))
        met = sorted(rows)
        meetings = np.maximum.accumulate(np.array([row[2:] for row in met], np.int64).reshape(-1, 2)).tolist()
        at_home: set[int] = set()
        before = -1, -1
        for (act, kind, *_), (move, element) in zip(met, meetings, strict=True):
            comparison.meet(move, element, moves=act + 1 < len(acts) or kind != 2)
            if not homes.isdisjoint(range(before[0] + 1, move + 1)):
                at_home |= {one.line for one in events if before[1] < one.element <= element}
            before = move, element
            if kind == 2 and element in holes and act + 1 < len(acts):
                cycle = holes[element].cycle
                line = int(program.line[original.pose[holes[element].move]])
                comparison.in_hole(line, within[element], cycle.dwell, tap=cycle.tap)
        found.unlooked += comparison.unlooked
        hidden = changed_unseen(requested, leading, beyond) if batches.acts.left_out else ""
        unsaid = "; ".join(filter(None, (without_word(cl_tokens, nc_tokens, means, own), hidden)))
        return comparison.problems, at_home, unsaid

    def _acts(self, leading: Mapping[int, int]) -> Ints:
        """(a, 2) moves and elements that lead anywhere and begin acts, or where both files have words; and the end."""
        program, pose, found = self._task.original.program, self._task.original.pose, self._batches.acts
        acts = np.frombuffer(found.begins, np.int64).reshape(-1, 2)
        # what leads nowhere in the program is no act: a rapid to where the tool is, or the same element again
        rapid = program.kind[pose[acts[:, 0]]] == Move.RAPID
        first = np.array([self._moving(one) for one in acts[:, 1].tolist()], np.int64)
        kept = (~rapid | (first == acts[:, 1])) & (np.diff(first, prepend=-1) > 0)
        pairs = zip(found.cuts[::2], found.cuts[1::2], strict=True)
        cuts = [(leading[move], self._moving(one)) for move, one in pairs]
        begun = {*first.tolist(), self._batches.elements}
        rows = [
            *np.column_stack((acts[:, 0], first))[kept].tolist(),
            *(one for one in cuts if one[1] not in begun),
            (len(pose), self._batches.elements),
        ]
        return np.maximum.accumulate(np.array(sorted(rows, key=lambda row: row[1]), np.int64))

    def _leading(self, places: Ints, left_out: Iterable[int]) -> dict[int, int]:
        """The first moves from some on that lead anywhere, and are none that are left out."""
        original, acts = self._task.original, self._batches.acts
        pose, program = original.pose, original.program
        pairs = zip(acts.cuts[::2], acts.cuts[1::2], strict=True)
        cuts = [move for move, element in pairs if element not in acts.still]  # the text leads somewhere behind these
        first, moves = pose[np.maximum(places - 1, 0)], places.copy()
        rows = np.flatnonzero(places < len(pose))
        while len(rows):
            here, before = pose[moves[rows]], pose[np.maximum(moves[rows] - 1, 0)]
            ways = (values[here] - values[first[rows]] for values in (program.tip, program.axis))
            way, turn = (np.linalg.norm(one, axis=1) for one in ways)
            long = np.maximum(way, self._task.axis_length * turn)
            leads = (long > self._batches.room) | (moves[rows] == 0) | ((long > 0.0) & np.isin(moves[rows], cuts))
            leads |= (program.kind[[here, before]] == Move.HOLE).any(axis=0)
            rows = rows[~leads | np.isin(moves[rows], list(left_out))]
            moves[rows] += 1
            rows = rows[moves[rows] < len(pose)]
        return dict(zip(places.tolist(), moves.tolist(), strict=True))

    def _moving(self, element: int) -> int:
        """The first element from one on that leads anywhere."""
        while element in self._batches.acts.still:
            element += 1
        return element


def _within_runs(places: Ints, first: Ints, end: Ints) -> Bools:
    """(k,) whether places are within runs, which begin and end with some, ascending."""
    run = np.searchsorted(first, places) - 1
    inside: Bools = (run >= 0) & (places < end[run]) if len(first) else np.zeros(len(places), np.bool_)
    return inside


def _within(tokens: Sequence[Token], begins: int, leaves: int) -> list[Token]:
    """Tokens that are written within a hole; a tap is written before it begins."""
    first, stop = (
        side(tokens, place, key=lambda one: one.place)
        for side, place in ((bisect_left, begins), (bisect_right, leaves))
    )
    return [one for one in tokens[first:stop] if one.place > begins or one.kind == "tap"]
