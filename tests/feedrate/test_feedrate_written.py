"""Time laws of NC texts: what is read back is planned as the same motion given as a program."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.feedrate import BlockLimits, Limits, TimeLaw, direct, limiting, plan, plan_text
from cornersmooth.feedrate.path import Kind
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program, SmoothProgram
from cornersmooth.nc import choose_form, fit_settings, load_control, write
from cornersmooth.nc_reader import NcProgram, read_nc
from cornersmooth.pipeline import read_back
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from oracle.command import run
from oracle.files import beginning
from oracle.share import share

SAMPLE = Path(__file__).parents[2] / "samples" / "impeller.cls"
LIMITS = Limits()


def text_of(program: Program, form: str = "g1", control: str = "fanuc", **settings: object) -> bytes:
    chosen = choose_form(control, form)
    stream = io.BytesIO()
    fitted = fit_settings(Settings(**{"method": "proportional", **settings}), chosen, program.units)
    write(smooth(program, fitted), stream, form=chosen)
    return stream.getvalue()


def kept(program: Program) -> Program:
    """Program none of whose corners is rounded."""
    return replace(program, keep=np.ones(len(program), np.uint8))


def zigzag(count: int = 40, step: float = 2.0) -> Program:
    tip = np.zeros((count, 3))
    tip[:, 0] = step * np.arange(count)
    tip[1::2, 1] = 0.1
    return Program.from_poses(tip, np.tile([0.0, 0.0, 1.0], (count, 1)), feed=3000.0)


def planned(text: bytes, blocks: BlockLimits | None = None, limits: Limits = LIMITS) -> TimeLaw:
    return plan_text(read_nc(text), limits, blocks=blocks)


def test_text_of_the_poses_takes_as_long_as_the_direct_path() -> None:
    program = read(SAMPLE.read_bytes(), name="impeller.cls")
    law = planned(text_of(kept(program), tolerance=0.01))
    expected = direct(program, LIMITS, "velocity_jump")
    assert law.total == pytest.approx(expected.total, rel=2e-3)
    assert law.length == pytest.approx(expected.length, rel=1e-4)


def test_text_of_the_poses_keeps_the_limits_of_a_machine() -> None:
    program, machine = read(beginning(SAMPLE, 45), name="impeller.cls"), load_machine("table-ac")
    law = plan_text(read_nc(text_of(kept(program), tolerance=0.01)), LIMITS, machine=machine)
    expected = direct(program, LIMITS, "velocity_jump", machine=machine)
    assert law.total == pytest.approx(expected.total, rel=0.01)


def test_no_block_is_passed_sooner_than_its_time() -> None:
    program = zigzag()
    text = text_of(kept(program), tolerance=0.01)
    law = planned(text, BlockLimits(block_time=0.1))
    took = np.diff(law.times_at(law.edge))
    assert took.min() >= 0.1 * (1 - 1e-6)
    assert law.total > planned(text).total
    assert law.total >= 0.1 * (len(program) - 1) * (1 - 1e-6)


@pytest.mark.parametrize("known", [1, 3, 10])
def test_the_motion_can_stop_within_the_blocks_that_are_known(known: int) -> None:
    program = zigzag(step=0.5)
    law = planned(text_of(kept(program), tolerance=0.01), BlockLimits(look_ahead=known), Limits(period=0.1))
    edges = law.edge[1 : -1 - known]  # ends of blocks behind which more follow than are known
    speed = law.kinematics(law.times_at(edges))[1]
    accel, jerk = LIMITS.accel, LIMITS.jerk
    time = np.where(speed * jerk >= accel**2, speed / accel + accel / jerk, 2.0 * np.sqrt(speed / jerk))
    stopping = 0.5 * speed * time
    ahead = law.edge[1 + known : -1] - edges
    assert (stopping <= ahead * (1 + 1e-6)).all()
    assert (stopping > 0.5 * ahead).any(), "the limit is reached somewhere"


def test_knowing_all_blocks_is_no_limit() -> None:
    text = text_of(kept(zigzag()), tolerance=0.01)
    assert planned(text, BlockLimits(look_ahead=1000)).total == planned(text).total


def test_motion_stops_at_words_that_stop_it() -> None:
    text = b"G21 G90\nG0 X0 Y0 Z0\nG1 X10 F1000\nX20\nM8\nX30\nG4 P500\nX40\nM30\n"
    law = planned(text)
    assert (law.path.junction_speed[1:-1] == 0.0).tolist() == [False, True, True]


def test_arcs_and_inches_are_read() -> None:
    text = b"G20 G90 G17\nG0 X0 Y0 Z0\nG1 X1 F40\nG2 X2 Y-1 I0 J-1\nM30\n"
    law = planned(text)
    assert law.length == pytest.approx(25.4 * (1 + np.pi / 2), rel=1e-6)


#: every form with curves, and what has so many digits that they do not show
CURVES = (
    ("generic", "g6.2", "9"),
    ("siemens", "bspline", "6"),
    ("siemens", "poly", "6"),
)


def blade(count: int = 30) -> Program:
    """A few corners with a turning tool, transitions from one to the next."""
    u = np.arange(count) / 3.0
    tip = np.stack((2.0 * u, np.sin(u), 0.2 * np.cos(2.0 * u)), axis=1)
    axis = np.stack((0.3 * np.sin(u), 0.2 * np.cos(1.3 * u), np.ones(count)), axis=1)
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    return Program.from_poses(tip, axis, feed=3000.0)


def curves_of(program: Program, control: str, form: str, digits: str) -> tuple[SmoothProgram, NcProgram, bytes]:
    chosen = choose_form(control, form, digits=digits)
    stream = io.BytesIO()
    smoothed = smooth(program, fit_settings(Settings(tolerance=0.02, method="proportional"), chosen, program.units))
    write(smoothed, stream, form=chosen)
    return smoothed, read_nc(stream.getvalue(), control=control), stream.getvalue()


@pytest.mark.parametrize(("control", "form", "digits"), share(CURVES, 2))
def test_curves_of_a_text_with_many_digits_take_as_long_as_those_they_are_of(
    control: str, form: str, digits: str
) -> None:
    smoothed, nc, _ = curves_of(blade(12), control, form, digits)
    assert len(nc.curves) == (20 if form == "poly" else 10)
    for machine in (None, load_machine("table-ac")):
        law = plan_text(nc, LIMITS, machine=machine)
        expected = plan(smoothed, LIMITS, machine=machine)
        assert law.total == pytest.approx(expected.total, rel=2e-3)
        assert law.length == pytest.approx(expected.length, rel=1e-5)
        times = np.linspace(0.0, 1.0, 101)
        here, there = law.at(times * law.total), expected.at(times * expected.total)
        np.testing.assert_allclose(here.tip, there.tip, atol=0.05)  # not at the same moment to the last digit
        np.testing.assert_allclose(here.axis, there.axis, atol=0.01)


def test_what_rotary_words_make_of_a_block_is_one_motion() -> None:
    """Only where blocks meet may the axes have to slow down."""
    machine = load_machine("table-ac")
    text = b"G21 G90\nG43.4 H1\nG0 X0 Y0 Z0 A20. C0.\nG1 X10 A50. C40. F1000\nX20 A20. C0.\nG49\nM30\n"
    law = plan_text(read_nc(text, control="fanuc", machine=machine), LIMITS, machine=machine)
    same = np.diff(law.path.program.line[law.path.move]) == 0
    assert same.sum() > 30
    assert np.isinf(law.path.junction_speed[1:-1][same]).all()


def test_a_tiny_block_with_the_fastest_inverse_time_does_not_stand_still() -> None:
    """Its digits do not show how far the tip goes, so what is read is only that its feed is more than nothing."""
    head, far = (
        ["G21 G90 G17", "G93", "G0 X0 Y0 Z0 A20. C0", "G1 X10. A21. F10.", "G1 X20. A20. F10."],
        "G1 X30. A21. F10.",
    )
    law = [
        plan_text(
            read_nc(
                "\n".join([*head, *tiny, far]).encode(), control="fanuc", machine=load_machine("table-ac"), tcp=False
            ),
            Limits(),
        ).total
        for tiny in ([], ["G1 X20.0001 A20.001 F9999.999"])
    ]
    assert law[1] == pytest.approx(law[0], abs=0.05)


def test_polynomials_of_an_upright_tool_are_planned() -> None:
    program = blade()
    program = replace(program, axis=np.tile([0.0, 0.0, 1.0], (len(program), 1)))
    smoothed, nc, _ = curves_of(program, "heidenhain", "spl", "")
    assert plan_text(nc, LIMITS).total == pytest.approx(plan(smoothed, LIMITS).total, rel=2e-3)


def test_rounded_digits_cost_time_on_a_machine_and_a_far_second_point_saves_it() -> None:
    dense = blade(8)
    dense = replace(dense, tip=0.1 * dense.tip)
    machine = load_machine("table-ac")
    taken = []
    for digits, lever in (("6", 100), ("4", 100), ("4", 10)):
        control = load_control("generic").with_digits(digits)
        control = replace(control, digits=replace(control.digits, lever=lever))
        form = choose_form(control, "g6.2")
        stream = io.BytesIO()
        write(
            smooth(dense, fit_settings(Settings(tolerance=0.02, method="proportional"), form, "mm")), stream, form=form
        )
        taken.append(plan_text(read_nc(stream.getvalue(), control="generic"), LIMITS, machine=machine).total)
    fine, coarse, near = taken
    assert fine < coarse < near


def test_axes_of_a_machine_do_not_jump_where_rounded_curves_meet() -> None:
    _, nc, _ = curves_of(blade(), "fanuc", "g6.2", "IS-B")
    machine = load_machine("table-ac")
    law = plan_text(nc, LIMITS, machine=machine)
    edges = law.times_at(law.edge[1:-1])
    before, after = law.axes_at(edges - 1e-9), law.axes_at(edges + 1e-9)
    assert law.machine_axes is not None
    _, accel, jerk = law.machine_axes.limits
    period = LIMITS.period
    assert (np.abs(after[1] - before[1]) <= 1.01 * accel * period + 1e-4).all()
    bent = np.abs(after[2] - before[2]) / (jerk * period)
    # the bound leaves out what the change of the tangent makes of the acceleration along the path
    assert bent.max() < 1.3


def test_blocks_of_a_curve_are_counted() -> None:
    """Five control points and four knots of a G6.2 are nine blocks, so many times the shortest time."""
    _, nc, text = curves_of(blade(), "fanuc", "g6.2", "")
    law = plan_text(nc, LIMITS, blocks=BlockLimits(block_time=0.01))
    motion = [line for line in text.splitlines() if line[:2] in (b"G1", b"G6", b"K0", b"K1")]
    assert law.total >= 0.01 * (len(motion) - 1)
    assert law.total < 0.01 * (len(motion) + 60)


def test_blocks_that_limit_the_motion_are_named() -> None:
    """Lines of 10 mm at 100 mm/s that take a block time of 1 s each."""
    text = b"G21 G90 G94\nG1 X0. Y0. Z0. I0. J0. K1. F6000.\nX10.\nX20.\nX30.\nM30\n"
    shares = dict(limiting(planned(text, BlockLimits(block_time=1.0))))
    assert shares["block time or look-ahead"] > 0.9
    assert "the programmed feed" not in shares
    assert "block time or look-ahead" not in dict(limiting(planned(text)))


def test_command_shows_the_text_beside_the_paths(tmp_path: Path) -> None:
    part = tmp_path / "part.cls"
    part.write_bytes(beginning(SAMPLE, 205))
    (tmp_path / "part.nc").write_bytes(text_of(read(part), tolerance=0.01))
    done = run("time", part, "--text", tmp_path / "part.nc", "--look-ahead", "50", "--block-time", "1ms")
    assert done.returncode == 0, done.stderr
    assert "as written" in done.stdout.decode()
    assert "curves" not in done.stdout.decode()


@pytest.mark.parametrize(("control", "share"), [("fanuc", 1.0), ("linuxcnc", np.sqrt(2.0))])
def test_an_arc_that_rises_is_as_fast_as_its_control_counts(control: str, share: float) -> None:
    """F in the plane of the arc alone, or along the helix: at 45 degrees one takes √2 of the time of the other."""
    rise = 10.0 * np.pi
    text = f"G21 G90 G94 G17\nG0 X20. Y0. Z0.\nG1 X20. Y0. Z0.001 F100.\nG3 X0. Y20. Z{rise:.3f} R20. F100.\nM30\n"
    law = plan_text(read_nc(text.encode(), control=control), Limits(accel=1e5, jerk=1e8))
    seconds = np.diff(law.times_at(law.edge))[law.path.kind == Kind.ARC].sum()
    assert seconds == pytest.approx(share * 60.0 * rise / 100.0, rel=2e-3)


def in_rotary_words(program: Program, machine: str, *, tcp: bool, tolerance: float) -> tuple[list[str], TimeLaw]:
    """Lines of a Siemens program in words of a machine, and its plan under the limits of that machine."""
    form = choose_form("siemens", "g1", machine=load_machine(machine), tcp=tcp)
    settings = fit_settings(Settings(tolerance=tolerance), form, program.units)
    stream = io.BytesIO()
    write(smooth(program, settings), stream, form=form)
    nc = read_back(stream.getvalue(), form, settings)
    law = plan_text(nc, LIMITS, settings=settings, machine=load_machine(machine))
    return stream.getvalue().decode().splitlines(), law


def test_no_rotary_axis_jumps_from_block_to_block_by_the_written_digits() -> None:
    """Words run evenly in each block: planned by tool vectors between its ends, jumps were 1.4 times too large."""
    lines, law = in_rotary_words(read(beginning(SAMPLE, 60), name="impeller.cls"), "table-ac", tcp=True, tolerance=0.01)
    speed = dict(
        zip(law.path.program.line[law.path.move].tolist(), law.kinematics(law.times_at(law.edge[1:]))[1], strict=True)
    )
    now, blocks = dict.fromkeys("XYZAC", np.nan), []
    for number, line in enumerate(lines, 1):
        words = {name: float(value) for name, value in re.findall(r"\b([XYZAC])=?(-?[\d.]+)", line)}
        if (words and line[:2] in ("G0", "G1")) or line[:1] in now:
            now |= words
            blocks.append((number, line.startswith("G0"), *now.values()))
    step = np.diff(np.array([block[2:] for block in blocks]), axis=0)
    way = np.linalg.norm(step[:, :3], axis=1)
    accel = {item.name: item.per_second[1] for item in load_machine("table-ac").dynamics}
    worst = []
    for k in range(1, len(step)):
        if not (blocks[k][1] or blocks[k + 1][1]) and min(way[k - 1], way[k]) > 1e-3 and blocks[k][0] in speed:
            jump = np.abs(step[k, 3:] / way[k] - step[k - 1, 3:] / way[k - 1]) * speed[blocks[k][0]]
            worst.append(max(jump / (LIMITS.period * np.array([accel["A"], accel["C"]]))))
    assert len(worst) > 200
    assert 0.9 < max(worst) < 1.01


def test_a_tip_that_stands_but_for_its_digits_is_a_turn_on_the_spot() -> None:
    """Without tip control the linear axes carry the tip round, and their digits were a way of the tip."""
    angle = np.radians([0.0, 0.0, 12.0, 24.0, 36.0, 36.0])
    tip = np.array([[0.0, 0, 0], [30, 0, 0], [30, 0, 0], [30, 0, 0], [30, 0, 0], [60, 0, 0]])
    axis = np.stack((np.sin(angle) * 0.6, np.sin(angle) * 0.8, np.cos(angle)), axis=1)
    _, law = in_rotary_words(Program.from_poses(tip, axis, feed=2000.0), "head-table-bc", tcp=False, tolerance=0.01)
    turning = law.path.turning
    assert turning.sum() > 100
    assert np.diff(turning.astype(int)).clip(0).sum() == 1, "in one go"
    assert law.length == pytest.approx(60.0, abs=0.05)
    assert len(law.time) < 4 * len(law.path)


def test_cells_are_as_many_as_blocks_at_the_pole() -> None:
    """The first axis turns fast there: at the feed its rate would vary much, at the speed that it allows not."""
    way = np.linspace(-1.0, 1.0, 41)
    axis = np.stack((0.2 * way, np.full(41, 0.004), np.ones(41)), axis=1)
    tip = np.stack((20.0 * way, 0.0 * way, 0.0 * way), axis=1)
    lines, law = in_rotary_words(Program.from_poses(tip, axis, feed=3000.0), "table-ac", tcp=True, tolerance=0.02)
    assert len(law.time) < 8 * len(lines)
