"""Points inserted into blocks, judged by walking along every block ourselves."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from cornersmooth.errors import InputError
from cornersmooth.kinematics import (
    Machine,
    RotaryAxis,
    load_machine,
    machine_names,
    machine_position,
    tip_position,
    tool_axis,
)
from cornersmooth.kinematics.poses import angle_between
from cornersmooth.model import Move, rapid_moves
from cornersmooth.rotary import FilledPath, filled_path, rotary_angles
from oracle.share import covering_share, how_many

STEPS = 24


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def random_path(seed: int, n: int = 60) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-4, -0.3)
    walk = np.cumsum(rng.normal(size=(n, 2)) * size, axis=0)
    if seed % 2:
        walk = np.round(walk, 4)
    axis = unit(np.column_stack((np.sin(walk), np.ones(n))))
    tip = np.cumsum(rng.uniform(0, 2, (n, 3)), axis=0)
    if seed % 3 == 0:
        tip = np.repeat(tip[::4], 4, axis=0)[:n]  # the tip stands still while the tool turns
    return tip, axis


def walked(path: FilledPath) -> np.ndarray:
    """Words along every block: (blocks, steps, 2)."""
    share = np.linspace(0, 1, STEPS)[:, None]
    return path.angles[:-1, None] * (1 - share) + path.angles[1:, None] * share


def axis_error(machine: Machine, path: FilledPath, words: np.ndarray) -> np.ndarray:
    """Smallest angle, at each step, to the ruled motion of the block: degrees, (blocks, steps)."""
    got = tool_axis(machine, words.reshape(-1, 2)).reshape(*words.shape[:2], 3)
    share = np.linspace(0, 1, 401)[:, None]
    ruled = unit(path.axis[:-1, None] * (1 - share) + path.axis[1:, None] * share)
    cosine = np.einsum("bsk,brk->bsr", got, ruled)
    nearest = np.take_along_axis(ruled, cosine.argmax(axis=2)[:, :, None], axis=1)
    return angle_between(got, nearest)


def tip_error(machine: Machine, path: FilledPath, words: np.ndarray) -> np.ndarray:
    """Distance of the tip from its line when all five axes run linearly: mm, (blocks, steps)."""
    joints = machine_position(machine, path.tip, path.angles)
    share = np.linspace(0, 1, STEPS)[:, None]
    joints = joints[:-1, None] * (1 - share) + joints[1:, None] * share
    tip = tip_position(machine, joints.reshape(-1, 3), words.reshape(-1, 2)).reshape(joints.shape)
    way = np.diff(path.tip, axis=0)[:, None]
    square = (way**2).sum(axis=2, keepdims=True)
    along = ((tip - path.tip[:-1, None]) * way).sum(axis=2, keepdims=True) / np.where(square > 0, square, 1)
    return np.linalg.norm(tip - path.tip[:-1, None] - np.clip(along, 0, 1) * way, axis=2)


@pytest.mark.parametrize("name", machine_names())
@pytest.mark.parametrize("seed", range(how_many(1, 6)))
def test_axis_stays_on_the_ruled_motion(name: str, seed: int):
    machine = load_machine(name)
    tip, axis = random_path(seed)
    tolerance = 0.05
    angles = rotary_angles(machine, tip, axis, tolerance=tolerance).angles
    path, jumps = filled_path(machine, tip, axis, angles, tolerance=tolerance, max_step=10.0)
    assert len(jumps) == 0
    assert axis_error(machine, path, walked(path)).max() <= tolerance * 1.001
    assert np.abs(np.diff(path.angles, axis=0)).max() <= 10.0 + 1e-9
    np.testing.assert_array_equal(path.angles[~path.inserted], angles)
    np.testing.assert_array_equal(path.tip[~path.inserted], tip)
    assert path.pose[~path.inserted].tolist() == list(range(60))
    assert (np.diff(path.pose)[path.inserted[:-1]] == 0).all()


@pytest.mark.parametrize("name", machine_names())
@pytest.mark.parametrize("seed", range(how_many(1, 6)))
def test_tip_stays_on_its_line_without_control_of_it(name: str, seed: int):
    machine = load_machine(name)
    tip, axis = random_path(seed)
    angles = rotary_angles(machine, tip, axis, tolerance=0.05).angles
    path, jumps = filled_path(machine, tip, axis, angles, tolerance=0.05, tip_tolerance=0.01)
    assert len(jumps) == 0
    words = walked(path)
    assert tip_error(machine, path, words).max() <= 0.01 * 1.001
    assert axis_error(machine, path, words).max() <= 0.05 * 1.001
    # The points are needed: without them the tip leaves its line.
    bare, _ = filled_path(machine, tip, axis, angles, tolerance=180.0)
    assert not bare.inserted.any()
    assert not path.inserted.any() or tip_error(machine, bare, walked(bare)).max() > 0.009


def large_turns(seed: int, count: int = 40) -> tuple[np.ndarray, np.ndarray]:
    """Tip and axis of segments whose axis turns by 60 to 179 degrees, some by way of the pole or close to it."""
    rng = np.random.default_rng(seed)
    axis = [unit(rng.normal(size=3) * [1, 1, 0.3] + [0, 0, 0.5])]
    for number in range(count):
        side = unit(np.cross(axis[-1], rng.normal(size=3)))
        if number % 3 == 0:  # straight over the pole but for a little
            side = unit(
                np.array([0, 0, 1.0]) - axis[-1][2] * axis[-1] + rng.normal(size=3) * 10.0 ** rng.uniform(-9, 0)
            )
            side = unit(side - (side @ axis[-1]) * axis[-1])
        turn = np.radians(rng.uniform(60, 179))
        axis.append(unit(np.cos(turn) * axis[-1] + np.sin(turn) * side))
    size = np.where(rng.random((count + 1, 1)) < 0.2, 1e-4, 10.0)
    return np.cumsum(rng.uniform(0, 1, (count + 1, 3)) * size, axis=0), np.array(axis)


def walk(path: FilledPath, segment: int, steps: int):
    """Words, tips at their ends and fractions of the blocks of one segment, densely: (blocks, steps + 1, ...)."""
    end = int(np.flatnonzero(~path.inserted)[segment + 1])
    own = slice(int(np.flatnonzero(~path.inserted)[segment]), end + 1)
    words, gone = path.angles[own], np.linalg.norm(path.tip[own] - path.tip[own][0], axis=1)
    fraction = gone / gone[-1]
    share = np.linspace(0, 1, steps + 1)[:, None]
    dense = words[:-1, None] * (1 - share) + words[1:, None] * share
    place = fraction[:-1, None] * (1 - share[:, 0]) + fraction[1:, None] * share[:, 0]
    return fraction, words, dense, place


@pytest.mark.parametrize("name", [name for name in machine_names() if name != "nutated-bc"])
@pytest.mark.parametrize("seed", range(how_many(1, 4)))
@pytest.mark.parametrize("tolerance", [0.5, 0.01])
def test_large_turns_keep_the_tolerance_everywhere(name: str, seed: int, tolerance: float):
    """Every step between the places that were looked at counts: the division is proved, not sampled."""
    plain = load_machine(name)
    machine = replace(plain, axes=tuple(replace(item, limits=None) for item in plain.axes))
    tip, axis = large_turns(seed)
    angles = rotary_angles(machine, tip, axis, tolerance=tolerance).angles
    path, jumps = filled_path(machine, tip, axis, angles, tolerance=tolerance)
    assert len(jumps) == 0
    worst = 0.0
    for segment in range(len(tip) - 1):
        _, _, words, place = walk(path, segment, 40)
        wanted = unit(axis[segment] * (1 - place[:, :, None]) + axis[segment + 1] * place[:, :, None])
        got = tool_axis(machine, words.reshape(-1, 2)).reshape(wanted.shape)
        worst = max(worst, angle_between(got, wanted).max())
    assert worst <= tolerance * (1 + 1e-9)
    assert worst > 0.5 * tolerance  # and no finer than need be


@pytest.mark.parametrize(
    ("seed", "name"), covering_share(product(range(3), ["table-ac", "head-ac", "head-table-bc"]), 4)
)
def test_large_turns_keep_the_tip_too(name: str, seed: int):
    plain = load_machine(name)
    axes = tuple(replace(item, limits=None, point=(13.0, -7.0, 160.0)) for item in plain.axes)
    machine = replace(plain, axes=axes, tool_length=90.0, part_zero=(40.0, 25.0, 10.0))
    tip, axis = large_turns(seed, 12)
    angles = rotary_angles(machine, tip, axis, tolerance=0.05).angles
    path, jumps = filled_path(machine, tip, axis, angles, tolerance=0.05, tip_tolerance=0.01)
    assert len(jumps) == 0
    share = np.linspace(0, 1, 41)[:, None]
    for segment in range(len(tip) - 1):
        fraction, ends, words, place = walk(path, segment, 40)
        stops = tip[segment] + fraction[:, None] * (tip[segment + 1] - tip[segment])
        joints = machine_position(machine, stops, ends)
        joints = joints[:-1, None] * (1 - share) + joints[1:, None] * share
        real = tip_position(machine, joints.reshape(-1, 3), words.reshape(-1, 2)).reshape(joints.shape)
        way = np.diff(stops, axis=0)[:, None]
        square = np.maximum((way**2).sum(axis=2), 1e-300)
        along = np.clip(((real - stops[:-1, None]) * way).sum(axis=2) / square, 0, 1)
        off = np.linalg.norm(real - stops[:-1, None] - along[:, :, None] * way, axis=2)
        assert off.max() <= 0.01 * (1 + 1e-6)
        # the axis is that of the ruled motion where the tip is, or where the words are
        errors = []
        got = tool_axis(machine, words.reshape(-1, 2)).reshape(*words.shape[:2], 3)
        for at in (place, fraction[:-1, None] + along * np.diff(fraction)[:, None]):
            wanted = unit(axis[segment] * (1 - at[:, :, None]) + axis[segment + 1] * at[:, :, None])
            errors.append(angle_between(got, wanted).max(axis=1))
        assert np.minimum(*errors).max() <= 0.05 * (1 + 1e-6)


def test_an_exact_reversal_of_the_axis_is_told():
    """No rotary axes follow a ruled motion that jumps: the segment is unsolved, without a warning of numpy's."""
    machine = load_machine("table-ac")
    axis = unit(np.array([[0.3, 0.2, 1.0], [-0.3, -0.2, -1.0]]))
    tip = np.array([[0.0, 0, 0], [10, 0, 0]])
    machine = replace(machine, axes=tuple(replace(item, limits=None) for item in machine.axes))
    angles = rotary_angles(machine, tip, axis, tolerance=0.05).angles
    assert filled_path(machine, tip, axis, angles, tolerance=0.05)[1].tolist() == [0]


def test_few_points_where_the_motion_is_smooth():
    """The tip of a table at radius r leaves the line by r·θ²/8: equal parts, as many as that asks for."""
    machine = load_machine("table-bc")
    angle = np.radians(np.array([0.0, 10.0]))
    axis = np.stack((np.sin(angle), np.zeros(2), np.cos(angle)), axis=1)
    tip = np.array([[0.0, 0, 100], [0.001, 0, 100]])
    angles = rotary_angles(machine, tip, axis, tolerance=5.0).angles
    path, _ = filled_path(machine, tip, axis, angles, tolerance=5.0, tip_tolerance=0.01)
    needed = np.sqrt(100 * np.radians(10) ** 2 / 8 / 0.01)
    assert needed <= len(path.pose) - 1 <= np.ceil(needed * 1.1)
    np.testing.assert_allclose(np.diff(path.tip[:, 0]), 0.001 / (len(path.pose) - 1))


def test_rapids_need_no_points():
    machine = load_machine("table-ac")
    tip, axis = random_path(4)
    rapid = np.arange(60) % 2 == 0
    angles = rotary_angles(machine, tip, axis, tolerance=0.01, rapid=rapid).angles
    path, _ = filled_path(machine, tip, axis, angles, tolerance=0.01, rapid=rapid)
    assert not rapid[path.pose[path.inserted]].any()
    whole, _ = filled_path(machine, tip, axis, angles, tolerance=0.01)
    assert whole.inserted.sum() > path.inserted.sum() > 0


def test_jump_is_not_hidden():
    """Angles that jump to the other solution far from the pole cannot be joined by points."""
    machine = load_machine("table-ac")
    axis = unit(np.array([[0.5, 0, 1.0], [0.5, 0.01, 1]]))
    angles = rotary_angles(machine, np.zeros((2, 3)), axis, tolerance=0.01).angles
    angles[1] = angles[1] * [1, -1] + [180, 0]
    np.testing.assert_allclose(tool_axis(machine, angles), axis, atol=1e-12)
    assert filled_path(machine, np.zeros((2, 3)), axis, angles, tolerance=0.01)[1].tolist() == [0]


def test_limit_on_the_way_between_two_poses():
    """Both ends tilt by 100 deg, the shortest turn between them by more."""
    plain = load_machine("table-ac")
    tilting = RotaryAxis("A", (1, 0, 0), "table", limits=(-105, 105))
    machine = Machine("tight", (plain.axes[0], tilting))
    plain = replace(plain, axes=(plain.axes[0], replace(tilting, limits=None)))
    tilt, azimuth = np.radians(100), np.radians(np.array([0, 120]))
    axis = np.stack((np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.full(2, np.cos(tilt))), axis=1)
    tip = np.array([[0.0, 0, 0], [10, 0, 0]])
    where = {"line": np.array([8, 9]), "file": "p.cls"}
    said = r"p\.cls:9: error\[\w+\]: A would have to go to .* its limit is -?105 deg"
    with pytest.raises(InputError, match=said):
        rotary_angles(machine, tip, axis, tolerance=0.01, **where)
    angles = rotary_angles(plain, tip, axis, tolerance=0.01).angles
    assert np.abs(angles[:, 1]).max() < 101
    with pytest.raises(InputError, match=said):
        filled_path(machine, tip, axis, angles, tolerance=0.01, **where)


def test_nothing_to_do():
    machine = load_machine("table-ac")
    for n in (0, 1):
        axis = np.tile([[0, 0, 1.0]], (n, 1))
        path, jumps = filled_path(machine, np.zeros((n, 3)), axis, np.zeros((n, 2)), tolerance=0.01)
        assert [len(path.pose), int(path.inserted.sum()), len(jumps)] == [n, 0, 0]


def test_moves_that_do_not_cut():
    kind = np.array(
        [Move.FROM, Move.LINEAR, Move.LINEAR, Move.RAPID, Move.ARC, Move.HOLE, Move.HOLE, Move.LINEAR], np.uint8
    )
    assert rapid_moves(kind).tolist() == [True, True, False, True, False, True, True, False]
    assert rapid_moves(kind[2:]).tolist() == [True, True, False, True, True, False]
    assert rapid_moves(kind[:0]).tolist() == []
