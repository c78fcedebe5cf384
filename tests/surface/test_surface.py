"""The machined surface: cases with known answers, and real paths against brute force."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

import cornersmooth
from cornersmooth.errors import SettingsError
from cornersmooth.geometry.tool import Tool, parse_tool, tools_of
from cornersmooth.nc import choose_form, fit_settings
from cornersmooth.surface import measure_surface
from cornersmooth.surface.motion import distance_to_motion, envelope_points, original_cuts
from oracle.share import how_many, share

UP = np.array([0.0, 0.0, 1.0])


def through(tips, axes):
    """Motion through poses one after another."""
    return original_cuts(cornersmooth.Program.from_poses(tips, axes, feed=100.0))


def straight(tips, axes=UP):
    tips = np.asarray(tips, float)
    return through(tips, np.broadcast_to(axes, tips.shape))


def off(original, written, tool, edge, **asked):
    points = envelope_points(original, tool, edge, **asked)
    distances = [distance_to_motion(points.point, motion, tool, edge, reach=1.0) for motion in (original, written)]
    return points, *distances


@pytest.mark.parametrize("tool", [Tool.of(10), Tool.of(10, 2), Tool.of(10, 5), Tool.of(10, 1, 8), Tool.of(10, 0, 5)])
def test_a_plane_cut_by_a_straight_move_is_met_exactly(tool):
    path = [[0, 0, 0], [20, 0, 0], [50, 0, 0]]
    shift = np.array([0.0, 0.03, 0.0])
    points, own, written = off(straight(path), straight(path + shift), tool, 12.0, stations=4)
    assert len(points.line) > 20
    # the points lie on the swept volume, and their normals across the motion
    np.testing.assert_allclose(own, 0.0, atol=1e-9)
    assert abs(points.normal @ [1.0, 0.0, 0.0]).max() < 1e-12
    # moved sideways, flanks cut on one side and leave on the other the part of the shift along their normal
    across = points.normal @ shift
    flank = points.point[:, 2] > tool.side_from + 0.1
    assert flank.sum() == 42
    np.testing.assert_allclose(written[flank], -across[flank], atol=1e-6)
    # on the corner arc a circle of radius r has moved
    r = tool.corner_radius
    arc = (points.point[:, 2] < tool.side_from - 0.1) & (np.abs(points.normal[:, 2]) < 0.99)
    circle = np.sqrt(r * r - 2.0 * r * across + shift @ shift) - r
    np.testing.assert_allclose(written[arc], circle[arc], atol=1e-6)


def test_a_ball_that_is_lifted_leaves_what_a_circle_leaves():
    ball, lift = Tool.of(8, 4), 0.02
    path = np.array([[0.0, 0, 0], [30, 0, 0]])
    points, own, written = off(straight(path), straight(path + np.array([0.0, 0.0, lift])), ball, 10.0, stations=200)
    np.testing.assert_allclose(own, 0.0, atol=1e-9)
    x, z = points.point[:, 1], points.point[:, 2]
    low = z < 4.0
    expected = np.hypot(x, z - 4.0 - lift) - 4.0
    np.testing.assert_allclose(written[low], expected[low], atol=1e-6)
    np.testing.assert_allclose(written[~low & (z >= 4.0 + lift)], 0.0, atol=1e-6)


@pytest.mark.parametrize("turn", [20.0, 60.0, 110.0])
def test_a_corner_of_a_cylinder_cut_off_by_a_line_is_known_in_closed_form(turn):
    radius, leg, cut = 3.0, 20.0, 4.0
    alpha = np.radians(turn)
    ahead = np.array([np.cos(alpha), np.sin(alpha), 0.0])
    a, b = np.array([-leg, 0.0, 0.0]), leg * ahead
    original = straight([a, [0, 0, 0], b])
    start, end = np.array([-cut, 0.0, 0.0]), cut * ahead
    written = straight([a, start, end, b])
    tool = Tool.of(2 * radius)
    # the outermost point of the corner: the line passes the corner at cut·sin(α/2)
    points, own, _ = off(original, written, tool, 10.0, stations=4)
    outer = np.flatnonzero((points.station == 1) & (points.side == 1))
    assert len(outer) == 7
    undercut = distance_to_motion(points.point[outer], written, tool, 10.0, reach=5.0)
    np.testing.assert_allclose(own[outer], 0.0, atol=1e-9)
    np.testing.assert_allclose(undercut, cut * np.sin(alpha / 2), atol=1e-6)
    # inside, beside a point of the leg at distance s from the corner: the tool comes nearer than its radius
    for s in np.linspace(radius * np.tan(alpha / 2) + 0.01, cut + 0.5, 5):
        point = np.array([[-s, radius, 5.0]])
        assert distance_to_motion(point, original, tool, 10.0, reach=5.0) == pytest.approx(0.0, abs=1e-9)
        way = (end - start) / np.linalg.norm(end - start)
        aside = abs(np.cross(way, point[0] - start)[2])
        foot = (point[0] - start) @ way
        line = aside if 0.0 <= foot <= np.linalg.norm(end - start) else np.inf
        expected = min(line, radius if s >= cut else np.inf, np.linalg.norm((point[0] - start)[:2])) - radius
        assert distance_to_motion(point, written, tool, 10.0, reach=5.0) == pytest.approx(expected, abs=1e-6)


def test_the_largest_overcut_is_found_within_an_inner_corner():
    """It is where the two sides meet, at R / cos(α/2) from the corner, between the poses of long segments."""
    radius, leg, cut, alpha = 3.0, 20.0, 2.0, np.radians(60.0)
    ahead = np.array([np.cos(alpha), np.sin(alpha), 0.0])
    legs = np.array([-leg, 0.0, 0.0]), leg * ahead
    original = straight([legs[0], [0, 0, 0], legs[1]])
    written = straight([legs[0], [-cut, 0.0, 0.0], cut * ahead, legs[1]])
    _, own, over = off(original, written, Tool.of(2 * radius), 10.0)
    deepest = radius + cut * np.sin(alpha / 2) - radius / np.cos(alpha / 2)
    apart = leg / 500  # of 2,000 stations, half are in two segments
    assert deepest - apart < -over[own > -1e-9].min() <= deepest + 1e-9


def test_an_axis_that_turns_about_the_tip_leaves_a_plane_on_both_sides():
    angles = np.radians(np.linspace(0.0, 40.0, 9))
    axes = np.stack((np.sin(angles), np.zeros(9), np.cos(angles)), axis=1)
    turning = through(np.zeros((9, 3)), axes)
    tool = Tool.of(6)
    points, own, _ = off(turning, turning, tool, 12.0, stations=200)
    # the sides of the swept volume are the planes y = ±R
    flank = points.point[:, 2] > 0.5
    np.testing.assert_allclose(np.abs(points.point[flank, 1]), 3.0, atol=1e-12)
    np.testing.assert_allclose(own, 0.0, atol=1e-9)
    # leaning over by τ about the x axis moves the flank by the sine of it
    lean = np.radians(0.05)
    over = np.array([[1, 0, 0], [0, np.cos(lean), -np.sin(lean)], [0, np.sin(lean), np.cos(lean)]])
    leaning = through(np.zeros((9, 3)), axes @ over.T)
    got = distance_to_motion(points.point, leaning, tool, 12.0, reach=1.0)
    # in the turned frame the sides are planes at ±R again: what is left is the point's place across them
    across = points.point @ over[:, 1]
    inner = flank & (points.station > 1) & (points.station < points.station.max() - 1)
    assert inner.sum() > 50
    np.testing.assert_allclose(got[inner], np.abs(across[inner]) - 3.0, atol=1e-6)


def test_cones_are_met_where_their_normal_is_across_the_motion():
    tool = Tool.of(6, 0, 10)
    climbing = straight([[0, 0, 0], [30, 0, 6]])
    points, own, _ = off(climbing, climbing, tool, 10.0)
    np.testing.assert_allclose(own, 0.0, atol=1e-9)
    assert abs(points.normal @ [30.0, 0.0, 6.0]).max() < 1e-9


def test_shapes_of_tools():
    out = np.array([0.0, 3.0, 5.0, 5.5, 6.0, 5.0])
    up = np.array([-1.0, -1.0, 5.0, 5.0, 8.0, 0.0])
    flat, ball, bull = Tool.of(10), Tool.of(10, 5), Tool.of(10, 2)
    np.testing.assert_allclose(flat.distance(out, up), [1, 1, 0, 0.5, 1, 0], atol=1e-12)
    np.testing.assert_allclose(ball.distance(out, up), [1, np.hypot(3, 6) - 5, 0, 0.5, 1, np.hypot(5, 5) - 5])
    np.testing.assert_allclose(bull.distance(out, up), [1, 1, 0, 0.5, 1, np.hypot(2, 2) - 2], atol=1e-12)
    drill = Tool(10, 0, 5, 5, 45, 0, 50)
    below = drill.distance(np.array([0.0, 5.0, 0.0]), np.array([0.0, 0.0, -2.0]))
    np.testing.assert_allclose(below, [0, 12.5**0.5, 2], atol=1e-12)
    cone = Tool.of(10, 0, 30)
    assert cone.distance(np.array([5 + 3 * np.tan(np.pi / 6)]), np.array([3.0])) == pytest.approx(0.0)
    for tool in (flat, ball, bull, cone, Tool.of(10, 2, 15)):
        rho, height, _ = tool.profile(np.linspace(1, np.sin(np.radians(tool.taper)), 5), np.linspace(6, 12, 4))
        rho, height = (rho, height) if tool.corner_radius else (rho[5:], height[5:])
        np.testing.assert_allclose(tool.distance(rho, height), 0.0, atol=1e-12)


@pytest.mark.parametrize("text", ["", "x", "-4", "4,3", "4,1,2,3,4", "4,0,89", "nan"])
def test_what_is_no_tool_is_refused(text):
    with pytest.raises(SettingsError) as refused:
        parse_tool(text)
    assert refused.value.code == "CS270"


@pytest.mark.parametrize(
    ("statement", "expected"),
    [
        ("CUTTER/8", Tool.of(8)),
        ("CUTTER/8,2", Tool.of(8, 2)),
        ("CUTTER/4,2,0,2,0,0,50", Tool(4, 2, 0, 2, 0, 0, 50)),
        ("TLDATA/MILL,32.0,5.0,75.0,0.0,0.0", Tool.of(32, 5, 0, 75)),
        ("$$-> CUTTER / 6.000000", Tool.of(6)),
    ],
)
def test_the_tool_comes_from_the_file(statement, expected):
    text = f"{statement}\nFEDRAT/100,MMPM\nGOTO/0,0,0,0,0,1\nGOTO/9,0,0,0,0,1\nFINI\n"
    program = cornersmooth.read(text.encode(), name="part.cls")
    assert [tool for _, tool, _ in tools_of(program)] == [expected]


def case(path, tolerance, height):
    program = cornersmooth.read(path)
    settings = cornersmooth.Settings(tolerance=tolerance, axis_length=height)
    stream = io.BytesIO()
    fitted = fit_settings(settings, choose_form("fanuc", None), program.units)
    cornersmooth.write(cornersmooth.smooth(program, fitted), stream)
    return program, stream.getvalue()


def brute_force(point, motion, tool, edge):
    """Least distance by a walk over all segments and ever finer walks along the best of them."""

    def distances(segments, shares):
        tip = motion.tip[segments, :1] + shares[..., None] * np.diff(motion.tip[segments], axis=1)
        axis = motion.axis[segments, :1] + shares[..., None] * np.diff(motion.axis[segments], axis=1)
        axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
        arm = point - tip
        up = (arm * axis).sum(axis=-1)
        out = np.linalg.norm(np.cross(arm, axis), axis=-1)
        # a ball of radius 2 with its flank up to the end of the edge
        return np.maximum(np.hypot(out, np.minimum(up - 2.0, 0.0)) - 2.0, up - edge)

    everywhere = distances(slice(None), np.linspace(0.0, 1.0, 5)[None])
    best = np.argsort(everywhere.min(axis=1))[:12]
    low, high = np.zeros(len(best)), np.ones(len(best))
    for _ in range(8):
        shares = np.linspace(low, high, 41, axis=1)
        found = distances(best, shares)
        middle, step = shares[np.arange(len(best)), found.argmin(axis=1)], (high - low) / 40
        low, high = np.maximum(middle - step, 0.0), np.minimum(middle + step, 1.0)
    return found.min()


@pytest.mark.parametrize(
    ("name", "tolerance"),
    [
        *share((("impeller", 0.01), ("impeller", 0.04)), 2),
        *(
            pytest.param("hecc_flank_nx", tolerance, marks=pytest.mark.corpus)
            for tolerance in share((0.01, 0.04), 2, 1)
        ),
    ],
)
def test_distribution_of_real_paths_agrees_with_brute_force(name, tolerance, request):
    from cornersmooth.nc_reader import read_nc
    from cornersmooth.surface.motion import written_cuts

    if name == "impeller":
        path, height = Path(__file__).parents[2] / "samples" / "impeller.cls", 12.0
    else:
        path, height = request.getfixturevalue("corpus") / "hecc_flank_nx.cls", 10.0
    program, text = case(path, tolerance, height)
    [(_, tool, _)] = tools_of(program)
    stations = how_many(40, 150)
    found = measure_surface(
        program,
        read_nc(text, tolerance=tolerance, axis_length=height),
        tool,
        tolerance=tolerance,
        edge=height,
        stations=stations,
    )
    assert len(found) > 2.6 * stations
    assert found.known.all()
    # ε and H bound the motion of every point of the edge, and so of the surface
    assert np.abs(found.off).max() <= tolerance
    told = found.as_dict()
    assert told["overcut"]["points"] + told["undercut"]["points"] <= told["points"] == len(found)
    assert sum(told["histogram"]["counts"]) == len(found)
    original, written = original_cuts(program), written_cuts(read_nc(text))
    chosen = np.random.default_rng(17).choice(len(found), how_many(40, 100), replace=False)
    for row in chosen:
        point = found.points.point[row]
        expected = brute_force(point, written, tool, height) - brute_force(point, original, tool, height)
        assert found.off[row] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("gap", [False, True])
def test_a_line_in_short_steps_is_as_far_as_in_one(gap):
    tips = np.linspace([0.0, 0.0, 0.0], [20.0, 0.0, 0.0], 4001)
    whole = straight(tips[[0, -1]])
    # a line far away and the way back may come before it
    chopped = straight(np.concatenate((tips + [0.0, 0.0, 500.0], tips))) if gap else straight(tips)
    points = np.random.default_rng(3).uniform([-6.0, -6.0, -1.0], [26.0, 6.0, 6.0], (how_many(50, 500), 3))
    tool = Tool.of(10, 2)
    expected = distance_to_motion(points, whole, tool, 8.0, reach=20.0)
    assert distance_to_motion(points, chopped, tool, 8.0, reach=20.0) == pytest.approx(expected, abs=1e-9)
    deep = distance_to_motion(points, chopped, tool, 8.0, reach=20.0, deepest=0.5)
    assert ((deep > -0.5) == (expected > -0.5)).all()
    assert deep[deep > -0.5] == pytest.approx(expected[expected > -0.5], abs=1e-9)
