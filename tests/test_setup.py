"""How to clamp a part: what a setup is, what it saves, and what is out of reach."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import cornersmooth as cs
from cornersmooth.errors import InputError
from cornersmooth.feedrate import Limits, plan_text
from cornersmooth.kinematics import Machine, load_machine, parse_machine
from cornersmooth.times.setup import Setup, find_setups
from oracle.command import BAD_INPUT, DONE, USAGE, run
from oracle.files import beginning

IMPELLER = Path(__file__).parents[1] / "samples" / "impeller.cls"


def cone(degrees: float, count: int = 60) -> cs.Program:
    """A small circle on which the tool leans outward by an angle: C turns all round."""
    turn, lean = np.linspace(0.0, 2.0 * np.pi, count), math.radians(degrees)
    out = np.column_stack((np.cos(turn), np.sin(turn), np.zeros(count)))
    axis = out * math.sin(lean) + np.array((0.0, 0.0, math.cos(lean)))
    return cs.Program.from_poses(2.0 * out + np.array((50.0, 0.0, 0.0)), axis, feed=np.full(count, 3000.0))


def form_for(machine: Machine) -> cs.nc.Form:
    return cs.choose_form("fanuc", "g1", machine=machine)


def test_a_part_is_turned_then_tilted_about_x_then_about_y() -> None:
    half = math.sqrt(0.5)
    assert Setup(90.0).matrix @ [1, 0, 0] == pytest.approx([0, 1, 0])
    assert Setup(90.0, 45.0).matrix @ [1, 0, 0] == pytest.approx([0, half, half])
    assert Setup(90.0, 45.0, 90.0).matrix @ [1, 0, 0] == pytest.approx([half, half, 0])
    for angles in ((30, 20, -40), (270, -5, 10)):
        assert Setup(*angles).matrix == pytest.approx(Rotation.from_euler("zxy", angles, degrees=True).as_matrix())


def test_a_cone_beside_the_pole_is_faster_when_it_leans_away_from_it() -> None:
    machine, limits, settings = load_machine("table-ac"), Limits(), cs.Settings(tolerance=0.01)
    program = cone(3.0)
    found = find_setups(program, form_for(machine), settings, limits, tilt=30.0, plans=3)
    best = found.best[0]
    # C goes round once today, 2 s at its 180 deg/s; leaning by 15 degrees and more it goes to and fro by 12 at most
    assert found.saving(best) > 50.0
    assert max(abs(best.setup.tilt_x), abs(best.setup.tilt_y)) >= 15.0
    assert best.setup.turn == 0.0  # the table turns the part itself
    assert [round(one.seconds, 2) for one in found.best] == sorted(round(one.seconds, 2) for one in found.best)
    # the same by hand: the middle of the circle stays, and the poses are turned by another library
    assert found.pivot == pytest.approx([50.0, 0.0, 0.0], abs=0.1)
    by = Rotation.from_euler("xy", (best.setup.tilt_x, best.setup.tilt_y), degrees=True)
    tip = by.apply(program.tip - found.pivot) + found.pivot
    assert by.apply(-found.pivot) + found.pivot == pytest.approx(found.zero(best.setup))
    other = cs.Program.from_poses(tip, by.apply(program.axis), feed=program.feed)
    stream = io.BytesIO()
    cs.postprocess(other, stream, settings, form=form_for(machine), verify=False)
    nc = cs.nc_reader.read_nc(stream.getvalue(), control="fanuc", machine=machine, tolerance=0.01)
    law = plan_text(nc, limits, settings=settings, machine=machine)
    assert law.total == pytest.approx(best.seconds, rel=1e-3)


def test_heads_may_be_helped_by_a_turn_and_no_tilt_is_beyond_what_is_asked_for() -> None:
    found = find_setups(cone(20.0), form_for(load_machine("head-ac")), tilt=0.0, plans=2)
    assert all((one.setup.tilt_x, one.setup.tilt_y) == (0.0, 0.0) and one.setup.turn for one in found.best)


@pytest.mark.parametrize(("tilt", "tried"), [(0.0, 1), (10.0, 15)])
def test_small_tilts_are_tried_too(tilt: float, tried: int) -> None:
    found = find_setups(cone(3.0), form_for(load_machine("table-ac")), tilt=tilt, plans=2)
    assert found.tried >= tried
    assert len(found.best) == (2 if tilt else 0)
    assert all(0.0 < max(abs(one.setup.tilt_x), abs(one.setup.tilt_y)) <= tilt for one in found.best)


def test_setups_beyond_the_travel_are_left_out() -> None:
    """C turns the part by half today, to X-50. Leaning to Y it stays at X50, leaning to X it is turned to Y."""
    table = 'like = "table-ac"\n[travel]\nX = [{0}, {1}]\n'
    found = find_setups(cone(3.0), form_for(parse_machine(table.format(42, 60))), tilt=30.0, plans=2)
    assert "its travel ends at 42 mm" in found.today.why
    assert found.best
    assert all(abs(one.setup.tilt_x) > abs(one.setup.tilt_y) for one in found.best)
    assert found.tried > found.out_of_reach >= 5
    with pytest.raises(InputError, match="its travel ends at"):
        find_setups(cone(3.0), form_for(parse_machine(table.format(90, 95))), tilt=30.0, plans=2)


def test_command_saves_a_tenth_and_says_what_is_the_users(tmp_path: Path) -> None:
    source = tmp_path / "impeller.cls"
    source.write_bytes(beginning(IMPELLER, 105))
    told = run("setup", source, "--limits", "table-ac", "--plans", "1", "--tilt", "30", "--json", cwd=tmp_path)
    assert told.returncode == DONE
    found = json.loads(told.stdout)
    best = found["best"][0]
    assert best["saving_percent"] >= 10.0
    assert best["seconds"] < found["today"]["seconds"]
    assert np.array(best["matrix"]) == pytest.approx(
        Setup(best["turn_deg"], best["tilt_x_deg"], best["tilt_y_deg"]).matrix
    )
    part = tmp_path / "part.csv"
    part.write_text("x,y,z,i,j,k\n" + "".join(f"{x},0,0,{0.01 * x},0,1\n" for x in range(9)))
    text = run("setup", part, "--limits", "table-ac", "--feed", "1000", "--plans", "1", cwd=tmp_path).stdout.decode()
    assert "Fixture, reach of the tool and collisions are not looked at: they are yours." in text
    assert text.count("today") >= 1
    assert run("setup", part, cwd=tmp_path).returncode == USAGE
    (tmp_path / "idle.toml").write_text('like = "table-ac"\ndynamics = false\n')
    lost = run("setup", part, "--limits", "idle.toml", "--feed", "1000", cwd=tmp_path)
    assert lost.returncode == USAGE
    assert b"how fast its axes may go" in lost.stderr
    (tmp_path / "four.toml").write_text('like = "table-ac"\n[[axis]]\nname = "A"\nlimits = [200, 210]\n')
    lost = run("setup", part, "--limits", "four.toml", "--feed", "1000", cwd=tmp_path)
    assert lost.returncode == BAD_INPUT
    assert b"part.csv:" in lost.stderr


def test_feed_is_that_of_moves_without_one(tmp_path: Path) -> None:
    """--feed and FEDRAT of the same number are the same program, as for smooth and time."""
    program = cone(20.0, 20)
    numbers = np.hstack((program.tip * [1.0, 10.0, 1.0], program.axis))
    lines = "".join(f"GOTO/{','.join(f'{value:.9f}' for value in row)}\n" for row in numbers.tolist())
    (tmp_path / "bare.cls").write_text(lines)
    (tmp_path / "fed.cls").write_text(f"FEDRAT/MMPM,3000\n{lines}")
    how = ("--limits", "table-ac", "--tilt", "0", "--json")
    one = json.loads(run("setup", "bare.cls", "--feed", "3000", *how, cwd=tmp_path).stdout)
    other = json.loads(run("setup", "fed.cls", *how, cwd=tmp_path).stdout)
    assert one["today"]["seconds"] == pytest.approx(other["today"]["seconds"], rel=1e-9)


def test_curves_have_no_rotary_words_and_are_planned_all_the_same(tmp_path: Path) -> None:
    source = tmp_path / "impeller.cls"
    source.write_bytes(beginning(IMPELLER, 40))
    how = (source, "-f", "g6.2", "--limits", "table-ac", "--json")
    found = json.loads(run("setup", *how, "--tilt", "0", cwd=tmp_path).stdout)
    made = json.loads(run("smooth", *how, "-o", "part.nc", cwd=tmp_path).stdout)
    assert found["today"]["seconds"] == pytest.approx(made["times"]["written_s"], rel=1e-3)
