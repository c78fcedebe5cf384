"""G6.2 text and the rules of FANUC for it, on text that exercises them: B-63324EN/03 chapter 4.17.

The rules themselves are in `oracle.nc_text`, which refuses every other word: first control point at the current
position digit for digit, P4 there only, K on every block, K 0 0 0 0 0.5 1 1 1 1, four blocks with K alone, R of three
decimals, nothing between, no G95 and no cutter compensation, and a motion code to end the mode.
"""

from __future__ import annotations

import re
from itertools import pairwise

import numpy as np
import pytest

from oracle.chains import Chain, cl_text, random_chains
from oracle.command import run
from oracle.nc_text import Curve, Line, Written, parse

STEP = 1e-4


def smooth(data: bytes, *options: str) -> tuple[str, Written]:
    result = run("smooth", "-", "-f", "g6.2", "--method", "proportional", "-q", *options, data=data)
    assert result.returncode == 0, result.stderr.decode()
    return result.stdout.decode("ascii"), parse(result.stdout, "g6.2")


def curves(written: Written) -> list[Curve]:
    return [block for block in written.blocks if isinstance(block, Curve)]


def corner_file(*statements: str, feeds: tuple[int, int, int] = (300, 300, 300)) -> bytes:
    """Four poses with two corners; a statement may stand at each."""
    at = {index: f"{text}\n" for index, text in enumerate(statements)}
    return (
        "UNITS/MM\nLOADTL/1\nRAPID\nGOTO/0,0,0,0,0,1\n"
        f"FEDRAT/{feeds[0]},MMPM\nGOTO/20,0,0,0,0,1\n"
        f"{at.get(0, '')}FEDRAT/{feeds[1]},MMPM\nGOTO/20,20,0,0,0.1,1\n"
        f"{at.get(1, '')}FEDRAT/{feeds[2]},MMPM\nGOTO/0,20,0,0,0.1,1\nFINI\n"
    ).encode()


def test_random_chains_follow_the_rules() -> None:
    text, written = smooth(cl_text(random_chains(21, 300))[0], "-e", "0.02", "--no-verify")
    assert len(curves(written)) > 300
    assert len(re.findall(r"^K1\.$", text, re.MULTILINE)) == 4 * len(curves(written))


def test_curves_that_follow_one_another_directly() -> None:
    """Segment-limited corners meet in the middle: no straight remainder, and still digit for digit."""
    angle = np.arange(200) * 0.01
    tip = np.round(np.stack((20 * np.cos(angle), 20 * np.sin(angle), 0 * angle), axis=1), 6)
    chain = Chain(tip, np.tile([0.1, 0.2, 0.97], (200, 1)), np.full(200, 900.0))
    _, written = smooth(cl_text([chain])[0], "-e", "0.1")
    motion = [block for block in written.blocks if isinstance(block, Curve | Line)]
    following = sum(isinstance(a, Curve) and isinstance(b, Curve) for a, b in pairwise(motion))
    assert following > 150


def test_first_three_points_lie_on_the_way_in_and_the_last_three_on_the_way_out() -> None:
    """Tangent and curvature at the joints follow from this; the middle point is the corner."""
    _, written = smooth(corner_file(), "-e", "0.05")
    first, second = curves(written)
    for curve, corner, axis in ((first, (20, 0, 0), (0, 0, 1)), (second, (20, 20, 0), (0, 0.1, 1))):
        points = np.array(curve.points)
        np.testing.assert_allclose(points[2, :3], corner, atol=STEP)
        direction = np.array(axis) / np.linalg.norm(axis)
        np.testing.assert_allclose(points[2, 3:], corner + 100 * direction, atol=STEP)
        for start, inner, end, share in ((0, 1, 2, 1 / 3), (2, 3, 4, 2 / 3)):
            way = points[end] - points[start]
            np.testing.assert_allclose(points[inner] - points[start], share * way, atol=2 * STEP)


@pytest.mark.parametrize(
    "statement",
    ["COOLNT/ON", "SPINDL/5000,RPM,CLW", "STOP", "OPSTOP", "DELAY/1", "COOLNT/ON\nPPRINT TEXT\nSPINDL/OFF"],
)
def test_statements_never_stand_inside_a_curve(statement: str) -> None:
    """The parser refuses them there; a corner with such a statement is passed exactly instead."""
    _, written = smooth(corner_file(statement, statement), "-e", "0.05")
    assert not curves(written)
    places = [block.end[:3] for block in written.blocks if isinstance(block, Line)]
    assert (20, 0, 0) in places
    assert (20, 20, 0) in places


@pytest.mark.parametrize("statement", ["PPRINT TEXT", "$$ TEXT", "PAINT/COLOR,31", "PPRINT ONE\nPPRINT TWO"])
def test_comments_never_stand_inside_a_curve(statement: str) -> None:
    _, written = smooth(corner_file(statement, statement), "-e", "0.05")
    assert len(curves(written)) == 2


def test_feed_changes_stay_between_curves() -> None:
    """G6.2 takes one feed; a corner where it changes is passed exactly."""
    _, written = smooth(corner_file(feeds=(300, 500, 500)), "-e", "0.05")
    (only,) = curves(written)
    np.testing.assert_allclose(only.points[2][:3], (20, 20, 0), atol=STEP)
    assert only.feed == 500


def test_feed_per_revolution_has_no_curves() -> None:
    """PS1006: G6.2 is refused in G95."""
    _, written = smooth(corner_file().replace(b"MMPM", b"MMPR").replace(b"300", b"0.3"), "-e", "0.05")
    assert not curves(written)


def test_cutter_compensation_has_no_curves() -> None:
    """PS1006: G6.2 is refused in G41 and G42; after CUTCOM/OFF it is back."""
    _, written = smooth(corner_file("CUTCOM/LEFT", "CUTCOM/OFF"), "-e", "0.05")
    assert not curves(written)


def test_inch_program_has_five_decimals() -> None:
    data = corner_file().replace(b"UNITS/MM", b"UNITS/INCHES").replace(b"MMPM", b"IPM")
    text, written = smooth(data, "-e", "0.01", "-H", "1in")
    assert written.units == "inch"
    assert len(curves(written)) == 2
    assert re.search(r"^G6\.2 P4 K0\. X\d+\.\d{5} ", text, re.MULTILINE)
    np.testing.assert_allclose(curves(written)[0].points[2][:3], (508, 0, 0), atol=25.4e-5)
    np.testing.assert_allclose(curves(written)[0].points[2][3:], (508, 0, 100), atol=25.4e-5)
