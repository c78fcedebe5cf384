"""Time laws of NC texts: what is read back is planned as the same motion given as a program."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import SettingsError
from cornersmooth.feedrate import BlockLimits, Limits, TimeLaw, direct, plan_text
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.nc_reader import NcProgram, read_nc
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from oracle.command import run

SAMPLE = Path(__file__).parents[2] / "samples" / "impeller.cls"
LIMITS = Limits()


def text_of(program: Program, form: str = "g1", control: str = "fanuc", **settings: object) -> bytes:
    chosen = choose_form(control, form)
    stream = io.BytesIO()
    fitted = fit_settings(Settings(**settings), chosen, program.units)
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
    program, machine = read(SAMPLE.read_bytes(), name="impeller.cls"), load_machine("table-ac")
    law = plan_text(read_nc(text_of(kept(program), tolerance=0.01)), LIMITS, machine=machine)
    expected = direct(program, LIMITS, "velocity_jump", machine=machine)
    assert law.total == pytest.approx(expected.total, rel=0.01)


def test_no_block_is_passed_sooner_than_its_time() -> None:
    program = zigzag()
    text = text_of(kept(program), tolerance=0.01)
    law = planned(text, BlockLimits(block_time=0.08))
    took = np.diff(law.times_at(law.edge))
    assert took.min() >= 0.08 * (1 - 1e-6)
    assert law.total > planned(text).total
    assert law.total >= 0.08 * (len(program) - 1) * (1 - 1e-6)


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


def test_text_with_curves_is_refused() -> None:
    nc: NcProgram = read_nc(text_of(read(SAMPLE.read_bytes(), name="impeller.cls"), "g6.2", tolerance=0.01))
    with pytest.raises(SettingsError) as caught:
        plan_text(nc, LIMITS)
    assert caught.value.code == "CS264"


def test_command_shows_the_text_beside_the_paths(tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_bytes(text_of(read(SAMPLE.read_bytes(), name="impeller.cls"), tolerance=0.01))
    done = run("time", SAMPLE, "--text", tmp_path / "part.nc", "--look-ahead", "50", "--block-time", "1ms")
    assert done.returncode == 0, done.stderr
    assert "as written" in done.stdout.decode()
    wrong = run("time", SAMPLE, "--law", "as_written", "--csv", tmp_path / "a.csv")
    assert wrong.returncode == 2
