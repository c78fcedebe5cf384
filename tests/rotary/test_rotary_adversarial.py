"""Random machines with random limits and signs on random paths made to break them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cornersmooth.errors import InputError
from cornersmooth.kinematics import (
    Machine,
    load_machine,
    machine_names,
    machine_position,
    solutions,
    tip_position,
    tool_axis,
)
from cornersmooth.kinematics.poses import angle_between
from cornersmooth.rotary import FilledPath, filled_path, rotary_angles
from oracle.share import how_many, share

TOLERANCE = 0.02  # degrees
CASES = how_many(45, 200)


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def tilted(tilt: np.ndarray | float, azimuth: np.ndarray | float) -> np.ndarray:
    tilt, azimuth = np.broadcast_arrays(np.radians(tilt), np.radians(azimuth))
    return np.stack((np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)), axis=-1)


def random_limits(rng: np.random.Generator) -> tuple[float, float] | None:
    wide = float(rng.uniform(20, 400))
    return [None, (-360.0, 360.0), (-200.0, 200.0), (-100.0, 50.0), (-wide, float(rng.uniform(20, 400)))][
        rng.integers(5)
    ]


def altered_machine(rng: np.random.Generator) -> Machine:
    base = load_machine(machine_names()[rng.integers(len(machine_names()))])
    axes = tuple(
        replace(
            axis,
            limits=random_limits(rng),
            positive="table" if axis.carrier == "table" and rng.random() < 0.5 else "tool",
            point=tuple(rng.normal(size=3) * 60),
        )
        for axis in base.axes
    )
    preferred = None if rng.random() < 0.5 else (axes[rng.integers(2)].name, float(rng.choice([-1, 1])))
    zero = tuple(rng.normal(size=3) * 30)
    return replace(base, axes=axes, preferred=preferred, tool_length=float(rng.uniform(0, 150)), part_zero=zero)


def random_axes(rng: np.random.Generator, n: int) -> np.ndarray:
    kind = rng.integers(6)
    if kind == 0:  # the first axis winds many turns
        azimuth = np.cumsum(rng.normal(size=n) * rng.choice([3, 30, 100]) + rng.choice([0, 20]))
        return tilted(rng.uniform(0.5, 70) + 10 * np.sin(np.arange(n) * rng.uniform(0, 1)), azimuth)
    if kind == 1:  # over the pole, or past it
        tilt, way = np.linspace(-40, 40, n) + rng.choice([0, 0, 0.1]), rng.uniform(0, 360)
        aside = rng.choice([0, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3])
        return unit(tilted(tilt, way) + aside * tilted(90.0, way + 90))
    if kind == 2:  # anywhere, below the horizontal too
        return unit(rng.normal(size=(n, 3)))
    if kind == 3:  # noise of all sizes about the pole
        noise = np.cumsum(rng.normal(size=(n, 3)) * 10.0 ** rng.uniform(-5, -1), axis=0)
        return unit(noise + np.array([0, 0, 1]))
    if kind == 4:  # it turns over
        return tilted(rng.uniform(1, 80), rng.uniform(0, 360)) * rng.choice([-1.0, 1.0], (n, 1), p=[0.1, 0.9])
    return unit(np.round(np.cumsum(rng.normal(size=(n, 3)) * 0.3, axis=0) * 2) / 2 + [0, 0, 1e-3])


def random_case(seed: int) -> tuple[Machine, np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    machine, n = altered_machine(rng), int(rng.integers(2, 60))
    axis = random_axes(rng, n)
    tip = np.cumsum(rng.uniform(0, 1, (n, 3)) * rng.choice([0, 1, 1]), axis=0)
    rapid = rng.random(n) < rng.choice([0, 0.05, 0.3])
    rapid[0] = True
    return machine, tip, axis, rapid


def walk_error(machine: Machine, path: FilledPath, cut: np.ndarray) -> float:
    """Largest angle between the tool and the great circle from block end to block end, anywhere on cuts."""
    share = np.linspace(0, 1, 12)[:, None, None]
    start, end = path.angles[:-1][cut], path.angles[1:][cut]
    got = tool_axis(machine, (start * (1 - share) + end * share).reshape(-1, 2)).reshape(12, -1, 3)
    one, two = path.axis[:-1][cut], path.axis[1:][cut]
    normal = np.cross(one, two)
    length = np.linalg.norm(normal, axis=1)
    plane = normal / np.where(length > 0, length, 1)[:, None]
    height = np.abs(np.einsum("sij,ij->si", got, plane))
    within = np.einsum("sij,ij->si", np.cross(one, got), plane) >= 0
    within &= np.einsum("sij,ij->si", np.cross(got, two), plane) >= 0
    ends = np.minimum(angle_between(got, one[None]), angle_between(got, two[None]))
    off = np.where(within & (length > 0), np.degrees(np.arcsin(np.minimum(height, 1))), ends)
    return float(off.max(initial=0.0))


@pytest.mark.parametrize("part", share(range(5), 2))
def test_words_are_right_or_refused(part: int):
    """Right: within limits and tolerance, and on cuts continuous, as the points that make them so can be found."""
    outcomes: dict[str, int] = {}
    for seed in range(part * CASES, (part + 1) * CASES):
        machine, tip, axis, rapid = random_case(seed)
        line = np.arange(len(axis)) + 1
        try:
            path = rotary_angles(machine, tip, axis, tolerance=TOLERANCE, rapid=rapid, line=line)
            filled, jumps = filled_path(machine, tip, axis, path.angles, tolerance=TOLERANCE, rapid=rapid, line=line)
        except InputError as error:
            outcome = error.code if error.line is not None else "no line"
            outcomes[outcome] = outcomes.get(outcome, 0) + 1
            continue
        limits = machine.limits
        assert (path.angles >= limits[:, 0] - 1e-8).all(), seed
        assert (path.angles <= limits[:, 1] + 1e-8).all(), seed
        assert angle_between(tool_axis(machine, path.angles), axis).max() <= TOLERANCE * (1 + 1e-9), seed
        turned = np.degrees(np.arccos(np.clip(np.einsum("ij,ij->i", axis[1:], axis[:-1]), -1, 1)))
        assert (turned[jumps] > 179.99).all(), seed
        assert (filled.angles >= limits[:, 0] - 1e-8).all(), seed
        assert (filled.angles <= limits[:, 1] + 1e-8).all(), seed
        cut = ~(rapid[filled.pose[1:]] | np.isin(filled.pose[1:] - 1, jumps))
        assert walk_error(machine, filled, cut) <= TOLERANCE * (1 + 1e-6), seed
        joints = machine_position(machine, filled.tip, filled.angles)
        np.testing.assert_allclose(tip_position(machine, joints, filled.angles), filled.tip, atol=1e-9)
        outcomes["right"] = outcomes.get("right", 0) + 1
    assert set(outcomes) == {"right", "CS361", "CS362"}
    assert outcomes["right"] > CASES / 3


@pytest.mark.parametrize("name", ["xyzbc-trt", "table-ac", "nutated-bc", "head-ac"])
def test_second_axis_goes_on_through_the_pole(name: str):
    """From far down on one side to far down on the other: the second axis turns by more than half a turn in all."""
    machine = load_machine(name)
    machine = replace(machine, axes=tuple(replace(axis, limits=None) for axis in machine.axes))
    far = 89.0 if name == "nutated-bc" else 130.0
    for azimuth in (0.0, 37.0, 180.0):
        for tilt in ([-far, 0.0, far], [-far, 1e-4, far], [-far, -1e-3, 1e-3, far], [-far, 0, 0, far - 5]):
            axis = tilted(np.array(tilt), azimuth)
            tip = np.arange(3.0 * len(tilt)).reshape(-1, 3)
            angles = rotary_angles(machine, tip, axis, tolerance=TOLERANCE).angles
            filled, jumps = filled_path(machine, tip, axis, angles, tolerance=TOLERANCE)
            assert len(jumps) == 0
            assert walk_error(machine, filled, np.ones(len(filled.pose) - 1, bool)) <= TOLERANCE


def fewest_rewinds(machine: Machine, axis: np.ndarray, rapid: np.ndarray) -> float:
    """By trying every solution and every turn at every pose; infinite where no choice stays inside the limits."""
    found, limits = solutions(machine, axis).angles, machine.limits
    turns = np.arange(-4, 5)
    cost: dict[tuple[int, int, int], float] = {}
    for pose in range(len(axis)):
        inside = [
            (branch, int(k0), int(k1))
            for branch in (0, 1)
            for k0 in turns
            for k1 in turns
            if (found[pose, branch] + 360 * np.array([k0, k1]) >= limits[:, 0] - 1e-9).all()
            and (found[pose, branch] + 360 * np.array([k0, k1]) <= limits[:, 1] + 1e-9).all()
        ]
        if pose == 0:
            cost = dict.fromkeys(inside, 0.0)
            continue
        after: dict[tuple[int, int, int], float] = {}
        for state in inside:
            words = found[pose, state[0]] + 360 * np.array(state[1:])
            for old, sofar in cost.items():
                step = np.abs(words - found[pose - 1, old[0]] - 360 * np.array(old[1:]))
                if not rapid[pose] and (old[0] != state[0] or (step > 90).any()):
                    continue
                after[state] = min(after.get(state, np.inf), sofar + float((step > 180 + 1e-9).sum()))
        cost = after
    return min(cost.values(), default=np.inf)


def winding(seed: int) -> tuple[Machine, np.ndarray, np.ndarray]:
    """Machine, axes and rapids of a chain that winds a first axis of limited travel."""
    rng = np.random.default_rng(seed)
    machine = load_machine(["table-ac", "xyzac-trt", "head-ac", "table-bc"][seed % 4])
    travel = float(rng.choice([200, 270, 360, 540]))
    second = [(-100.0, 100.0), (0.0, 100.0), (-100.0, 50.0)][rng.integers(3)]
    limits = ((-travel, travel * float(rng.uniform(0.5, 1))), second)
    axes = tuple(replace(axis, limits=limit) for axis, limit in zip(machine.axes, limits, strict=True))
    n = 24
    rapid = rng.random(n) < 0.2
    rapid[0] = True
    azimuth = np.cumsum(rng.normal(size=n) * 10 + rng.choice([-25, 0, 25]))
    azimuth += np.cumsum(np.where(rapid, rng.uniform(-200, 200, n), 0))
    tilt = np.clip(30 + np.cumsum(rng.normal(size=n) * 5), 12, 85)
    return replace(machine, axes=axes, preferred=None), tilted(tilt, azimuth), rapid


def test_no_choice_rewinds_less():
    """Chains are refused only if nothing fits, and an axis is rewound only where nothing else helps."""
    outcomes = []
    for seed in range(how_many(20, 60)):
        machine, axis, rapid = winding(seed)
        n = len(axis)
        tip, line = np.arange(3.0 * n).reshape(n, 3), np.arange(n) + 1
        want = fewest_rewinds(machine, axis, rapid)
        outcomes.append(want)
        if np.isinf(want):
            with pytest.raises(InputError) as caught:
                rotary_angles(machine, tip, axis, tolerance=TOLERANCE, rapid=rapid, line=line)
            assert caught.value.code == "CS362"
            continue
        path = rotary_angles(machine, tip, axis, tolerance=TOLERANCE, rapid=rapid, line=line)
        step = np.abs(np.diff(path.angles, axis=0))
        assert step[~rapid[1:]].max(initial=0.0) < 90
        assert (step > 180 + 1e-9).sum() == want, seed
        assert sum(finding.count for finding in path.findings if finding.code == "CS364") == want, seed
    # the chains are of use only if they do all of it
    assert np.inf in outcomes
    assert 0 in outcomes
    assert any(0 < want < np.inf for want in outcomes)
