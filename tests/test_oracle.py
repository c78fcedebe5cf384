"""The oracle must be right before it may judge: its parser, motion and distances on cases with known answers."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from oracle import motion
from oracle.distance import deviation
from oracle.frechet import frechet_distance, leash_is_enough
from oracle.motion import Original, Path, arc_points, curve_point, unit, written_path
from oracle.nc_text import Arc, BadTextError, Curve, parse

H = 10.0


def _six(values: np.ndarray) -> tuple[float, float, float, float, float, float]:
    x, y, z, i, j, k = values.tolist()
    return (x, y, z, i, j, k)


UP = ["G91 G28 Z0.", "G90"]
HEAD = ["%", "O0001", "(test)", "G21 G90 G94 G17 G40 G49 G80", *UP, "T1 M6", "S12000 M3"]
TAIL = ["M5", "M30", "%"]
G1 = [
    "G43.5 H1\nG0 X0.0000 Y0.0000 I0.0000000 J0.0000000 K1.0000000",
    "G0 X0.0000 Y0.0000 Z0.0000 I0.0000000 J0.0000000 K1.0000000",
    "G1 X10.0000 Y0.0000 Z0.0000 I0.0000000 J0.0000000 K1.0000000 F250.",
    "G1 X20.0000 Y0.0000 Z0.0000 I0.0000000 J0.6000000 K0.8000000",
    "\n".join([*UP, "G49"]),
]
G62 = [
    "G43 H1",
    "G0 X0.0000 Y0.0000 Z0.0000 U0.0000 V0.0000 W10.0000",
    "G1 X9.0000 Y0.0000 Z0.0000 U9.0000 V0.0000 W10.0000 F250.",
    "G6.2 P4 K0. X9.0000 Y0.0000 Z0.0000 U9.0000 V0.0000 W10.0000 R1.",
    "K0. X9.3333 Y0.0000 Z0.0000 U9.3333 V0.0000 W10.0000 R1.",
    "K0. X10.0000 Y0.0000 Z0.0000 U10.0000 V0.0000 W10.0000 R1.",
    "K0. X10.0000 Y0.6667 Z0.0000 U10.0000 V0.6667 W10.0000 R1.",
    "K0.5 X10.0000 Y1.0000 Z0.0000 U10.0000 V1.0000 W10.0000 R1.",
    "K1.",
    "K1.",
    "K1.",
    "K1.",
    "G1 X10.0000 Y10.0000 Z0.0000 U10.0000 V10.0000 W10.0000",
    "\n".join([*UP, "G49"]),
]


def text(body: list[str]) -> bytes:
    return "\n".join(HEAD + body + TAIL + [""]).encode()


def changed(body: list[str], index: int, old: str, new: str) -> bytes:
    assert old in body[index]
    return text([*body[:index], *body[index].replace(old, new, 1).split("\n"), *body[index + 1 :]])


def test_reads_both_forms() -> None:
    g1 = parse(text(G1), "g1")
    assert [type(block).__name__ for block in g1.blocks].count("Line") == 3
    g62 = parse(text(G62), "g6.2")
    (curve,) = [block for block in g62.blocks if isinstance(block, Curve)]
    assert curve.feed == 250.0
    assert curve.weights == (1.0,) * 5


@pytest.mark.parametrize(
    ("index", "old", "new"),
    [
        (1, "X0.0000", "X-0.0000"),
        (1, "X0.0000", "X0.000"),
        (1, "X0.0000", "X00.0000"),
        (1, "X0.0000", "X1e-5"),
        (1, "X0.0000", "Xnan"),
        (2, " J0.0000000", ""),
        (2, "X10.0000", "X0.0000"),  # no length
        (2, "F250.", "F250"),
        (2, "F250.", "F250.0"),
        (3, "K0.8000000", "K0.8000000 F250."),  # modal already
        (0, "G43.5 H1", "M8"),
        (4, "G49", "M9"),
        (3, "G1", "G2"),
    ],
)
def test_refuses_bad_g1(index: int, old: str, new: str) -> None:
    with pytest.raises(BadTextError, match=r"^\d+:"):
        parse(changed(G1, index, old, new), "g1")


@pytest.mark.parametrize(
    ("index", "old", "new"),
    [
        (3, "X9.0000", "X9.0001"),  # not at the current position
        (3, "P4 ", ""),
        (4, "K0. ", ""),
        (4, " R1.", ""),
        (4, " R1.", " R1.0005"),
        (7, "K0.5", "K0."),
        (8, "K1.", "K1. R1."),
        (8, "K1.", "M8\nK1."),
        (11, "K1.", "G1 X10.0000 Y2.0000 Z0.0000 U10.0000 V2.0000 W10.0000"),
        (11, "K1.", "K1.\nK1."),
        (11, "K1.", "K1.\nM8"),
        (3, "G6.2", "G43.5 H1\nG6.2"),
        (3, "G6.2", "G95\nG6.2"),
        (3, "G6.2", "G41 D1\nG6.2"),
        (11, "K1.", "(note)\nK1."),
    ],
)
def test_refuses_bad_g62(index: int, old: str, new: str) -> None:
    with pytest.raises(BadTextError, match=r"^\d+:"):
        parse(changed(G62, index, old, new), "g6.2")


def test_refuses_broken_frames() -> None:
    for bad in (text(G1)[:-1], text(G1).replace(b"\n", b"\r\n"), text(G1).replace(b"M30\n", b""), b"%\n%\n"):
        with pytest.raises(BadTextError):
            parse(bad, "g1")


def test_curve_is_the_rational_spline_of_its_control_points() -> None:
    points = tuple(map(tuple, np.random.default_rng(1).normal(size=(5, 6)).tolist()))
    weights = (1.0, 0.5, 2.0, 0.25, 1.0)
    curve = Curve(1, points, weights, None, False)
    middle = curve_point(curve, np.array([0.5]))[0]
    basis = np.array([0, 0.25, 0.5, 0.25, 0]) * weights
    np.testing.assert_allclose(middle, basis @ np.array(points) / basis.sum(), atol=1e-14)
    quarter = 0.25  # de Boor by hand: span [0, 1/2] as a Bezier curve
    h = [np.append(np.array(p) * w, w) for p, w in zip(points, weights, strict=True)]
    bezier = [h[0], h[1], (h[1] + h[2]) / 2, (h[1] + 2 * h[2] + h[3]) / 4]
    t = quarter / 0.5
    value = sum(math.comb(3, k) * t**k * (1 - t) ** (3 - k) * bezier[k] for k in range(4))
    np.testing.assert_allclose(curve_point(curve, np.array([quarter]))[0], value[:6] / value[6], atol=1e-14)


@pytest.mark.parametrize("plane", [17, 18, 19])
@pytest.mark.parametrize("clockwise", [True, False])
def test_arc_turns_the_way_the_plane_says(plane: int, clockwise: bool) -> None:
    first, second, third = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}[plane]
    start, end = np.zeros(6), np.zeros(6)
    start[first], end[second], end[third] = 5.0, 5.0, 1.0  # 90 degrees counterclockwise about the origin, rising
    if clockwise:
        start[[first, second]], end[[first, second]] = start[[second, first]], end[[second, first]]
    points = arc_points(Arc(1, plane, clockwise, _six(start), _six(end), 5.0, None, False), 0.01)
    np.testing.assert_allclose(np.hypot(points[:, first], points[:, second]), 5.0, atol=1e-12)
    np.testing.assert_allclose(points[-1], end[:3])
    np.testing.assert_allclose(points[:, third], np.arange(1, len(points) + 1) / len(points), atol=1e-12)


def test_turning_on_a_great_circle_and_as_a_vector_meet_halfway() -> None:
    program = parse(text(G1), "g1")
    vector, circle = (written_path(program, H, 0.01, turn)[0] for turn in ("vector", "great circle"))
    assert len(vector) == len(circle)
    gap = np.linalg.norm(vector.point - circle.point, axis=1)
    turned = math.acos(0.8)
    assert 0 < gap.max() < H * turned**3 / 54 * 1.05
    np.testing.assert_allclose(vector.point[-1], [20, 6, 8], atol=1e-9)


def test_frechet_distance_of_known_cases() -> None:
    line = np.array([[0.0, 0, 0], [10, 0, 0]])
    assert frechet_distance(line, line + np.array([0, 2, 0])) == pytest.approx(2, abs=1e-8)
    detour = np.array([[0.0, 0, 0], [5, 0, 0], [5, 3, 0], [5, 0, 0], [10, 0, 0]])
    assert frechet_distance(line, detour) == pytest.approx(3, abs=1e-8)
    back = np.array([[0.0, 0, 0], [7, 0, 0], [3, 0, 0], [10, 0, 0]])  # every point is on the line, but not in order
    assert frechet_distance(line, back) == pytest.approx(2, abs=1e-8)
    assert frechet_distance(line[:1], detour) == pytest.approx(10, abs=1e-8)


def test_frechet_decision_agrees_with_the_discrete_distance() -> None:
    """Against the textbook recursion on samples so dense that they differ by less than their spacing."""
    rng = np.random.default_rng(5)
    for _ in range(30):
        p = np.cumsum(rng.integers(-2, 3, (rng.integers(2, 7), 3)), axis=0).astype(float)
        q = p[rng.random(len(p)) < 0.8] + rng.normal(scale=0.3, size=3) if len(p) > 3 else p + 0.1
        if len(q) == 0:
            continue
        dense = [
            np.concatenate(
                [
                    a + (b - a) * np.linspace(0, 1, 25)[:, None]
                    for a, b in zip(c, c[1:] if len(c) > 1 else c, strict=False)
                ]
            )
            for c in (p, q)
        ]
        d = np.linalg.norm(dense[0][:, None] - dense[1][None], axis=2)
        best = np.empty_like(d)
        for i in range(len(d)):
            for j in range(d.shape[1]):
                before = [best[a, b] for a, b in ((i - 1, j), (i, j - 1), (i - 1, j - 1)) if a >= 0 and b >= 0]
                best[i, j] = max(d[i, j], min(before)) if before else d[i, j]
        spacing = max(np.linalg.norm(np.diff(c, axis=0), axis=1).max() for c in dense)
        exact = frechet_distance(p, q)
        assert exact <= best[-1, -1] + 1e-7
        assert best[-1, -1] <= exact + spacing


def zigzag(seed: int = 3, poses: int = 26) -> Original:
    rng = np.random.default_rng(seed)
    tip = np.cumsum(rng.normal(size=(poses, 3)) + np.array([2, 0, 0]), axis=0)
    axis = unit(np.cumsum(rng.normal(scale=0.08, size=(poses, 3)), axis=0) + np.array([0.3, 0.2, 1]))
    return Original(tip, axis)


def walk(original: Original, parameter: np.ndarray) -> Path:
    tip, point = original.at(parameter, H)
    return Path(tip, point, np.zeros(len(tip), np.int64))


FINE = 16  # parts of a segment


def fine(original: Original) -> np.ndarray:
    return np.linspace(0, len(original) - 1, FINE * (len(original) - 1) + 1)


EPS = 0.05  # mm, the limit asked for


def test_finds_nothing_where_nothing_is() -> None:
    original = zigzag()
    found = deviation(walk(original, fine(original)), original, H, EPS)
    assert found.worst < 1e-10
    assert not found.exact


def test_finds_a_skipped_loop() -> None:
    """The loop returns to the path: every written point lies on the original, but not the other way round."""
    tip = np.array([[0.0, 0, 0], [10, 0, 0], [10, 4, 0], [10, 0, 0], [20, 0, 0]])
    original = Original(tip, np.tile([0.0, 0, 1], (5, 1)))
    short = Original(tip[[0, 1, 4]], original.axis[[0, 1, 4]])
    found = deviation(walk(short, fine(short)), original, H, EPS)
    assert found.tip == pytest.approx(4, rel=1e-3)
    assert found.point == pytest.approx(4, rel=1e-3)


def test_finds_a_doubled_piece() -> None:
    """Every point of either path lies on the other; only the order tells."""
    original = zigzag()
    parameter = fine(original)
    end, begin = 12 * FINE + FINE // 2, 10 * FINE + FINE // 2
    doubled = np.concatenate((parameter[:end], parameter[begin:]))  # two segments run forward, back and again
    path = walk(original, doubled)
    back = np.concatenate((parameter[:end], parameter[end:begin:-1], parameter[begin:]))
    assert deviation(path, original, H, EPS).worst > 0.5
    assert deviation(walk(original, back), original, H, EPS).worst > 0.5


@pytest.mark.parametrize(("size", "broken"), [(0.95, False), (1.05, True)])
@pytest.mark.parametrize("what", ["tip", "point"])
def test_finds_a_bump_a_little_too_high(size: float, broken: bool, what: str) -> None:
    original = zigzag()
    path = walk(original, fine(original))
    before, behind = original.at(np.array([12.5 - 1e-6, 12.5 + 1e-6]), H)[0 if what == "tip" else 1]
    middle = behind - before
    across = unit(np.cross(middle, [0.0, 0, 1]))
    bump = size * EPS * np.exp(-(((fine(original) - 12.5) / 0.08) ** 2))[:, None] * across
    moved = Path(path.tip + bump * (what == "tip"), path.point + bump * (what == "point"), path.block)
    found = deviation(moved, original, H, EPS)
    assert (found.worst > EPS) is broken
    assert getattr(found, what) == pytest.approx(size * EPS, rel=0.01)


def test_finds_axes_that_are_swapped() -> None:
    original = zigzag()
    axis = original.axis.copy()
    axis[[20, 21]] = axis[[21, 20]]
    swapped = Original(original.tip, axis)
    found = deviation(walk(swapped, fine(original)), original, H, EPS)
    assert found.tip <= EPS
    assert found.point > EPS


def test_finds_a_lost_pose_a_missing_end_and_a_wrong_start() -> None:
    original = zigzag()
    kept = np.delete(np.arange(len(original)), 17)
    lost = Original(original.tip[kept], original.axis[kept])
    assert deviation(walk(lost, fine(lost)), original, H, EPS).worst > EPS
    path = walk(original, fine(original))
    assert deviation(path.slice(0, len(path) - 24), original, H, EPS).worst > EPS
    assert deviation(path.slice(24, len(path)), original, H, EPS).worst > EPS


def test_reversals_and_standing_poses_are_matched_in_order() -> None:
    tip = np.array([[0.0, 0, 0], [5, 0, 0], [0, 0, 0], [5, 0, 0], [5, 0, 0], [5, 0, 0], [0, 0, 0]])
    axis = unit(np.array([[0.0, 0, 1], [0, 0, 1], [0, 0.1, 1], [0, 0, 1], [0, 0.5, 1], [0, 0, 1], [0, 0, 1]]))
    original = Original(tip, axis)
    assert deviation(walk(original, fine(original)), original, H, EPS).worst < 1e-10
    one_less = Original(tip[[0, 1, 3, 4, 5, 6]], axis[[0, 1, 3, 4, 5, 6]])
    assert deviation(walk(one_less, fine(one_less)), original, H, EPS).worst > 1


def test_rounded_corner_has_its_closed_form_error() -> None:
    """A right angle with L = 1: the corner lies L·sin(45°)/3... from u = 1/2: (X0 + X1)/4 + X/2 with ratio 2/3."""
    program = parse(text(G62), "g6.2")
    original = Original(np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0]]), np.tile([0.0, 0, 1], (3, 1)))
    (path,) = written_path(program, H, 1.0)
    found = deviation(path, original, H, 1.0)
    curve_to_corner = math.hypot(0.25 * 0.6667, 0.25 * 0.6667)
    assert found.tip == pytest.approx(curve_to_corner, abs=1e-4)
    assert found.point == pytest.approx(curve_to_corner, abs=1e-4)
    assert not deviation(path, original, H, curve_to_corner + 2e-4).exact
    assert deviation(path, original, H, 0.9 * curve_to_corner).tip == pytest.approx(curve_to_corner, rel=1e-3)


def test_the_error_line_is_the_line() -> None:
    with pytest.raises(BadTextError) as caught:
        parse(changed(G1, 2, "X10.0000", "X10.00"), "g1")
    assert re.match(rf"{len(HEAD) + 4}: not a block", str(caught.value))
    assert leash_is_enough(np.zeros((2, 3)), np.zeros((3, 3)), 0.0)


@pytest.mark.parametrize("limit", [0.001, 0.1])
def test_sampling_is_fine_enough(limit: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two lines with vectors stand for one ruled motion of 80 degrees: measured again 30 times finer."""
    angle = math.radians(80)
    ends = np.array([[0, 0, 1.0], [math.sin(angle), 0, math.cos(angle)]])
    original = Original(np.array([[0.0, 0, 0], [20, 0, 0]]), ends)
    body = G1[:2]
    for x, axis in ((10, unit(ends.sum(axis=0))), (20, ends[1])):
        words = " ".join(f"{letter}{value:.7f}" for letter, value in zip("IJK", axis, strict=True))
        body = [*body, f"G1 X{x}.0000 Y0.0000 Z0.0000 {words}"]
    found = []
    for share in (motion.SAGITTA_SHARE, motion.SAGITTA_SHARE / 1000):
        monkeypatch.setattr(motion, "SAGITTA_SHARE", share)
        (path,) = written_path(parse(text([*body, *UP, "G49"]), "g1"), H, limit)
        found.append(deviation(path, original, H, 1.0).worst)
    assert found[0] == pytest.approx(found[1], rel=1e-3)
    assert found[1] > 0.05
