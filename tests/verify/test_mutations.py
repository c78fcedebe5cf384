"""The mutation test: wrong texts made from correct ones are found at the right line, harmless changes are not."""

from __future__ import annotations

import pytest

from cornersmooth.errors import InputError
from cornersmooth.verify import verify
from oracle.share import how_many, share_of_kinds

from .judging import CALM_FEED, RUNS, Runs, Shared, calm_cut, edit, judge, repeated
from .mutations import EPS, H, Mutant, mutants
from .writing import HEAD, RETRACT, TAIL, chain_lines, encode, job, rapid


def named_in(program, lines):
    found = verify(program, encode(lines), tolerance=EPS, axis_length=H)
    return [(problem.nc_line, problem.text) for problem in found.problems]


def several(form, program, lines, runs):
    """Text of the repeated program."""
    tip, axis, _ = calm_cut(program)
    calm = [rapid(tip[0], axis[0], H, form), *chain_lines(tip[:3], axis[:3], EPS, H, form, CALM_FEED)]
    calm += [rapid(tip[i], axis[i], H, form) for i in range(3, len(tip))]
    body = lines[len(HEAD) : -len(TAIL)]
    return [*HEAD, *body, *(runs - 1) * [*calm, *RETRACT, "G49", *body], *TAIL]


@pytest.mark.parametrize(("form", "seed"), [("g1", 0), ("g6.2", 0)])
def test_every_mutant_that_matters_is_found(form, seed):
    program, lines, changed = mutants(form, seed)
    assert named_in(program, lines) == []
    changed = share_of_kinds(changed, lambda mutant: mutant.kind, 12)
    score = judge(program, lines, changed, lambda _: several(form, program, lines, RUNS), named_in)
    judged = score.judged
    print(f"\n{form}: " + ", ".join(f"{kind} {judged[kind, True]}" for kind in sorted({kind for kind, _ in judged})))
    print(f"{form}: {score}")
    assert score.missed == []
    assert sum(judged.values()) >= how_many(30, 100)


# ---------------------------------------------------------------- how they share texts


@pytest.fixture(scope="module")
def shelf():
    """Program, its text, the text of four runs, and where they stand in it."""
    program, lines = job("g1", EPS, H, 0)
    text = several("g1", program, lines, 4)
    return program, lines, Runs.of(lines, text)


def spoilt(lines, at, where, *, lost=1, new=("wrong",)):
    return Mutant("digit", [*lines[:at], *new, *lines[at + lost :]], where)


def test_runs_stand_where_the_job_is_repeated(shelf):
    _, lines, runs = shelf
    assert len(runs.starts) == 4
    assert (runs.first, lines[runs.last]) == (len(HEAD), "M5")
    for start in runs.starts:
        assert runs.several[start : start + runs.last - runs.first] == lines[runs.first : runs.last]


def test_each_mutant_has_a_run_of_its_own(shelf):
    _, lines, runs = shelf
    some = [
        spoilt(lines, 20, (20, 22), new=()),
        spoilt(lines, 20, (0, len(lines)), lost=0, new=("more", "words")),
        spoilt(lines, 50, None, new=("harmless",)),
    ]
    shared = Shared.of(runs, [edit(lines, one) for one in some])
    assert len(shared.lines) == len(runs.several) + 1
    assert shared.windows[0] == (20, 22)
    low, high = shared.windows[1]
    assert shared.lines.index("more") == runs.starts[1] + 20 - runs.first - 1
    assert shared.runs[1][0] == low < high <= shared.runs[1][1]
    assert shared.windows[2] is None
    low, high = shared.runs[2]
    assert "harmless" in shared.lines[low - 1 : high]
    assert shared.judged_rightly([(21, "")]) == [True, False, True]
    assert shared.judged_rightly([(30, ""), (shared.runs[1][0], ""), (low, "")]) == [False, True, False]


def test_what_a_mutant_changes_is_found_again(shelf):
    _, lines, _ = shelf
    for mutant in (
        spoilt(lines, 20, None, lost=3),
        spoilt(lines, 20, None, lost=0, new=(lines[19],)),
        spoilt(lines, 0, None, lost=len(lines)),
    ):
        one = edit(lines, mutant)
        assert [*lines[: one.first], *one.new, *lines[one.last :]] == mutant.lines


@pytest.mark.parametrize("blind", ["no run", "third run", "last run", "beside", "error"])
def test_what_is_in_doubt_is_judged_alone(shelf, blind):
    """A finding that sharing alone made, or lost, changes no verdict."""
    program, lines, _ = shelf
    some = [spoilt(lines, at, (at, at + 2)) for at in (30, 40, 50, 60, 70)] + [spoilt(lines, 45, None, new=("fine",))]
    some.append(spoilt(lines, 33, (33, 35), new=("missed",)))

    def found(_, text):
        wrong = [k + 1 for k, line in enumerate(text) if line == "wrong"]
        if len(wrong) > 1 and blind == "third run":
            wrong = wrong[:2] + wrong[3:]
        elif len(wrong) > 1 and blind == "last run":
            wrong = wrong[:-1]
        elif len(wrong) > 1 and blind == "beside":
            wrong.append(next(k + 1 for k, line in enumerate(text) if line.endswith(f"F{CALM_FEED:g}.")))
        elif len(wrong) > 2 and blind == "error":
            raise InputError("CS500", "what", "what to do", line=wrong[1])
        return [(line, "") for line in wrong]

    score = judge(program, lines, some, lambda _: several("g1", program, lines, RUNS), found)
    assert [missed[3] for missed in score.missed] == [["missed"]]
    assert sum(score.judged.values()) == len(some)


def test_a_false_alarm_is_one_in_any_company(shelf):
    program, lines, _ = shelf
    some = [spoilt(lines, at, None, new=("fine",)) for at in (30, 40)] + [spoilt(lines, 50, None, new=("alarm",))]

    def found(_, text):
        return [(k + 1, "") for k, line in enumerate(text) if line == "alarm"]

    score = judge(program, lines, some, lambda _: several("g1", program, lines, RUNS), found)
    assert [missed[3] for missed in score.missed] == [["alarm"]]


def test_repeated_programs_are_programs(shelf):
    program, _, _ = shelf
    many = repeated(program, 3)
    assert len(many) == 3 * len(program) + 2 * len(calm_cut(program)[0])
    assert (many.line[1:] > many.line[:-1]).all()
    assert sum(one.word == "FINI" for one in many.statements) == 1
