"""What a page holds: numbers, words, and nothing that a name could do harm with."""

from __future__ import annotations

import base64
import hashlib
import itertools
import json
import re

import numpy as np
import pytest
from scipy.spatial import cKDTree

import cornersmooth
from cornersmooth.feedrate import Limits, direct
from cornersmooth.page import document, read_written
from cornersmooth.report.paths import original_path, thinned, written_path
from oracle.command import run
from oracle.share import share
from page.making import HOSTILE, PATH, page_of, smoothed, values_of

#: what a page says in words
STORY = {"title": "part", "verdict": "", "badge": "PASSED", "notes": []}


@pytest.fixture(scope="module")
def result():
    return smoothed()


@pytest.fixture(scope="module")
def page(result):
    return page_of(result)


def test_a_page_is_one_file_that_fetches_nothing(page, result):
    assert page.startswith("<!doctype html>\n<!-- cornersmooth page -->\n")
    assert page == page_of(result)  # same input, same bytes
    own = page.split("<script>")[2]  # behind the libraries
    places = re.findall(r'(?:src|href)="([^"]*)"', re.sub(r"<(script|style).*?</", "", page, flags=re.S))
    assert places == ["data:,"]
    assert "http" not in own
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)[1]
    assert "default-src 'none'" in policy
    for script in re.findall(r"<script>(.*?)</script>", page, re.S):
        digest = hashlib.sha256(script.encode()).digest()
        assert f"'sha256-{base64.b64encode(digest).decode()}'" in policy


def test_the_verdict_names_the_sharp_corner(page, result):
    meta, arrays = values_of(page)
    assert meta["verdict"].startswith(
        "PASSED, 2 to check: within 0.02 mm everywhere; 1 corner stays sharp, first :12 reversal 17"
    )
    assert " time on " not in meta["verdict"]  # no limits of axes are known
    assert meta["badge"] == "PASSED"
    facts = dict(meta["facts"])
    assert (
        facts["SHA-256 of the CL file"] == hashlib.sha256(PATH.format(name="PART", comment="none").encode()).hexdigest()
    )
    assert cornersmooth.__version__ in facts["made by"]
    kinds = [meta["corners"]["kinds"][kind] for kind in arrays["c_kind"]]
    assert kinds[0] == "sharp"
    assert meta["corners"]["reasons"][arrays["c_reason"][0]] == "reversal"
    assert arrays["c_line"][0] == 12
    assert 170 < arrays["c_turn"][0] < 180
    assert sum(meta["corners"]["counts"].values()) == len(result.smoothed.corners)


def test_deviations_are_those_of_the_verification(page, result):
    meta, arrays = values_of(page)
    found = result.verification
    for key, largest in (("w_off", found.tip.value), ("w_axis_off", found.axis_point.value)):
        values = arrays[key][np.isfinite(arrays[key])]
        assert values.max() == pytest.approx(largest, abs=1e-6)
    corner = arrays["c_kind"] > 1
    assert np.all(arrays["c_off"][corner] <= meta["tolerance"])
    assert np.nanmax(arrays["way_off"]) == pytest.approx(np.nanmax(arrays["w_off"]), abs=1e-6)


def test_deviation_of_each_point_is_its_distance_from_the_path(result):
    program = result.program
    original = original_path(program)
    written = written_path(program, read_written(result), original, cornersmooth.Settings(tolerance=0.02))
    cutting = np.flatnonzero(np.isfinite(written.tip_off))
    assert len(cutting) > 20
    feeding = np.flatnonzero(program.kind == cornersmooth.model.Move.LINEAR)
    share = np.linspace(0.0, 1.0, 4001)[:, None]
    for values, height in ((written.tip_off, 0.0), (written.axis_off, 10.0)):
        samples = []
        for pose in feeding:
            axis = program.axis[pose - 1] + share * (program.axis[pose] - program.axis[pose - 1])
            axis /= np.linalg.norm(axis, axis=1, keepdims=True)
            samples.append(program.tip[pose - 1] + share * (program.tip[pose] - program.tip[pose - 1]) + height * axis)
        least, _ = cKDTree(np.concatenate(samples)).query(written.tip[cutting] + height * written.axis[cutting])
        np.testing.assert_allclose(values[cutting], least, rtol=1e-6, atol=5e-3 * 0.5)


def test_planned_times_and_speeds_agree_with_the_laws(page, result):
    meta, arrays = values_of(page)
    law = direct(result.program, Limits(), "velocity_jump", settings=result.smoothed.settings)
    assert meta["totals"]["direct"] == pytest.approx(law.total, rel=1e-9)
    assert meta["seconds"] == pytest.approx(meta["totals"]["written"], rel=1e-6)
    assert set(meta["charts"]["speeds"]) == {"direct", "written"}
    for name in meta["charts"]["speeds"]:
        for scale in ("way", "time"):
            speed = arrays[f"{scale}_speed_{name}"]
            assert 1400.0 < np.nanmax(speed) <= 1500.0 * (1 + 1e-6)  # the feed; rapids are left out
    assert np.all(np.diff(arrays["w_time"]) >= 0.0)
    assert np.all(np.diff(arrays["w_way"]) >= 0.0)
    # the reversal is a stop of the written path
    at = np.searchsorted(arrays["way_x"], arrays["c_way"][0])
    assert np.nanmin(arrays["way_speed_written"][at - 4 : at + 4]) < 100.0


@pytest.mark.parametrize(("control", "form"), share([("fanuc", "g1"), ("fanuc", "g6.2"), ("siemens", "bspline")], 2))
def test_the_written_law_is_that_of_the_text(control, form):
    from cornersmooth.feedrate import plan_text
    from cornersmooth.nc import choose_form

    made = smoothed(form=choose_form(control, form))
    meta, arrays = values_of(page_of(made))
    settings = made.smoothed.settings
    law = plan_text(read_written(made), Limits(), settings=settings)
    assert meta["totals"]["written"] == pytest.approx(law.total, rel=1e-9)
    time = arrays["w_time"]
    assert np.all(np.diff(time) >= 0.0)
    assert time[-1] == pytest.approx(law.total, rel=1e-6)
    # points are passed when the law is there
    off = np.linalg.norm(law.at(time.astype(float)).tip - np.asarray(meta["centre"]) - arrays["w_tip"], axis=1)
    assert off[arrays["w_rapid"] == 0].max() < 0.02


def test_axes_of_a_machine_have_charts(result):
    from dataclasses import replace

    from cornersmooth.kinematics import load_machine
    from cornersmooth.page.scene import Subject, page_values

    subject = Subject(
        result.program,
        read_written(result),
        result.smoothed.settings,
        result.verification,
        result.smoothed,
        machine=load_machine("table-ac"),
    )
    meta, pack = page_values(subject, STORY)
    assert set(meta["charts"]["axes"]) == set("XYZA")  # C turns by less than can be drawn
    named = replace(subject, limited_by=("the programmed feed", "jerk of A"))
    assert page_values(named, STORY)[0]["charts"]["axes"][0] == "A"  # the axis of the verdict comes first
    bare = replace(subject, machine=None)
    assert page_values(bare, STORY)[0]["charts"]["axes"] == []
    meta, arrays = values_of(document(meta, pack))
    # what is saved so far ends with what is saved at all, and the axis that changes most comes first
    saved = meta["totals"]["direct"] - meta["totals"]["written"]
    for scale in ("way", "time"):
        known = arrays[f"{scale}_saved"][np.isfinite(arrays[f"{scale}_saved"])]
        assert known[-1] == pytest.approx(saved, abs=0.02)
    change = [
        np.abs(np.nan_to_num(arrays[f"way_{axis}_written"]) - np.nan_to_num(arrays[f"way_{axis}_direct"])).mean()
        for axis in meta["charts"]["axes"]
    ]
    assert change == sorted(change, reverse=True)
    for axis in "XYZA":
        most = [np.nanmax(arrays[f"way_{axis}_{law}"]) for law in ("direct", "written")]
        assert 0.0 < max(most) <= 100.1  # an axis keeps its limit


def test_a_file_without_feeds_says_that_no_speed_is_planned():
    made = smoothed(PATH.replace("FEDRAT/MMPM,1500.0\n", ""))
    meta, arrays = values_of(page_of(made))
    assert any("No speed is planned" in note for note in meta["notes"])
    assert meta["timed"] is False
    assert meta["seconds"] > 0.0
    assert np.all(np.diff(arrays["w_time"]) >= 0.0)


def test_a_page_of_curves_for_whole_runs():
    made = smoothed(method="global")
    meta, arrays = values_of(page_of(made))
    assert meta["verdict"].startswith("PASSED, 2 to check: within 0.02 mm everywhere; ")
    assert dict(meta["facts"])["method"] == "global"
    assert meta["totals"]["written"] < meta["totals"]["direct"]
    assert 0.01 < np.nanmax(arrays["w_off"]) <= 0.02
    assert sum(meta["corners"]["counts"].values()) == len(made.smoothed.corners)
    kinds = [meta["corners"]["kinds"][kind] for kind in arrays["c_kind"]]
    assert kinds[0] == "sharp"  # the reversal
    assert set(kinds[1:]) == {"rounded"}
    assert len(kinds) == 7


def test_hostile_names_and_comments_are_text():
    made = smoothed(
        name=HOSTILE.replace("{", "{{").replace("}", "}}"),
        comment=HOSTILE,
        source=HOSTILE.replace("/", "|") + "\n.cls",
    )
    page = page_of(made)
    assert page.count("<script") == 4
    assert page.count("</script>") == 4
    assert "<img" not in page
    assert "xxx" * 500 not in page
    meta, _ = values_of(page)
    assert meta["title"].startswith("<|script><script>")


def test_thinning_keeps_what_matters():
    random = np.random.default_rng(5)
    n = 100_000
    points = np.cumsum(random.normal(size=(n, 3)), axis=0)
    points[50_123] += 1e5  # a spike in the path
    weight = random.random(n)
    weight[77_777] = 2.0
    weight[10] = np.nan
    must = np.zeros(n, bool)
    must[[5, 31_234, 99_998]] = True
    rows = thinned(points, weight, must, 4000)
    assert np.all(np.diff(rows) > 0)
    assert 1000 < len(rows) < 5000
    assert {0, 5, 31_234, 50_123, 77_777, 99_998, n - 1} <= set(rows.tolist())
    assert np.array_equal(thinned(points[:100], weight[:100], must[:100], 4000), np.arange(100))


def test_thinning_of_a_long_path_hides_no_corner_out_of_tolerance(monkeypatch):
    from cornersmooth.nc_reader import read_nc
    from cornersmooth.page import scene as module
    from cornersmooth.verify import verify

    monkeypatch.setattr(module, "MOST_POINTS", 500)
    monkeypatch.setattr("cornersmooth.page.planned_speeds.MOST_MOVES", 0)  # its speed is not looked at
    x = np.linspace(0.0, 600.0, 1201)
    tips = np.stack((x, np.where(np.arange(1201) % 2, 1.0, 0.0), np.zeros(1201)), axis=1)
    up = np.broadcast_to([0.0, 0.0, 1.0], tips.shape)
    program = cornersmooth.Program.from_poses(tips, up, feed=1000.0)
    off = np.random.default_rng(3).choice(np.arange(1, 1200), 19, replace=False)
    written = tips.copy()
    written[off, 2] += 0.05
    lines = ["%", "G90 G21 G94", "G43.5 H1"]
    lines += [f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} I0 J0 K1 F1000" for x, y, z in written.tolist()]
    nc = read_nc("\n".join([*lines, "M30", "%"]).encode())
    found = verify(program, nc, tolerance=0.02)
    subject = module.Subject(program, nc, cornersmooth.Settings(tolerance=0.02), found)
    meta, pack = module.page_values(subject, STORY)
    meta, arrays = values_of(document(meta, pack))
    assert len(arrays["w_off"]) < 1600 < 2400
    assert meta["corners"]["counts"]["out of tolerance"] >= 19
    listed = set(arrays["c_line"][arrays["c_kind"] == 0].tolist())
    assert {int(pose) + 1 for pose in off} <= listed
    # about each of them both paths are drawn as they are
    for pose, path in itertools.product(off.tolist(), ("o_tip", "w_tip")):
        at = arrays[path][:, 0] + meta["centre"][0]
        for x_near in x[pose - 1 : pose + 2]:
            assert np.abs(at - x_near).min() < 1e-4
    drawn = set(arrays["w_line"][arrays["w_off"] > 0.02].tolist())
    assert {int(pose) + 1 for pose in off} <= drawn
    assert any("are drawn" in note for note in meta["notes"])


@pytest.mark.parametrize(("height", "looked_at"), [([0.05], True), ([0.05, 0.0], False)])
def test_behind_the_last_place_that_is_known_deviations_are_true_or_none(height, looked_at):
    """From x = 100 on the tool is off for good, or so often that verification ends."""
    from cornersmooth.nc_reader import read_nc

    x = np.concatenate((np.linspace(0.0, 120.0, 61), np.linspace(120.0, 400.0, 15)[1:]))
    tips = np.stack((x, np.arange(len(x)) % 2 * 1.0, np.zeros(len(x))), axis=1)
    program = cornersmooth.Program.from_poses(tips, np.broadcast_to([0.0, 0.0, 1.0], tips.shape), feed=1000.0)
    tips[20:, 2] += np.resize(height, len(tips) - 20)
    lines = [f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} I0 J0 K1 F1000" for x, y, z in tips.tolist()]
    nc = read_nc("\n".join(["%", "G90 G21 G94", "G43.5 H1", *lines, "M30", "%"]).encode())
    written = written_path(program, nc, original_path(program), cornersmooth.Settings(tolerance=0.02))
    off = written.tip_off[written.share == 1.0][-len(tips) + 1 :]
    seen = np.isfinite(off)
    assert seen.all() if looked_at else np.array_equal(np.flatnonzero(seen), np.arange(58))  # the 20th place
    np.testing.assert_allclose(off[seen], tips[1:, 2][seen], atol=1e-6)


def test_commands_write_pages(tmp_path):
    source = tmp_path / "part.cls"
    source.write_text(PATH.format(name="PART", comment="none"))
    nc, page = tmp_path / "part.nc", tmp_path / "part.html"
    done = run("smooth", source, "-e", "0.02", "-o", nc, "--report", page)
    assert done.returncode == 0, done.stderr
    said = done.stderr.decode()
    assert said.startswith("PASSED, 2 to check  ")
    assert "\n        within 0.02 mm everywhere\n" in said
    assert " corners rounded, 1 corner stays sharp, first :12 reversal 17" in said
    assert "part.cls:12 reversal 17" in said
    # the page says the same words
    verdict = values_of(page.read_text())[0]["verdict"]
    assert verdict.startswith(
        "PASSED, 2 to check: within 0.02 mm everywhere; 1 corner stays sharp, first :12 reversal 17"
    )
    first = page.read_bytes()
    # a page of ours is replaced without being asked; anything else is not
    assert run("smooth", source, "-e", "0.02", "-o", nc, "--report", page, "--force").returncode == 0
    assert page.read_bytes() == first
    found = tmp_path / "found.html"
    done = run("verify", source, nc, "-e", "0.02", "--report", found)
    assert done.returncode == 0
    assert done.stdout.decode().startswith("PASSED: within 0.02 mm everywhere\n")
    meta, _ = values_of(found.read_text())
    assert meta["verdict"].startswith("PASSED: within 0.02 mm everywhere")


@pytest.mark.parametrize("command", ["smooth", "verify"])
def test_a_page_and_its_report_give_one_verdict(command, tmp_path, monkeypatch):
    """Also what made it looser, which is known to the command alone."""
    source, nc, found = tmp_path / "part.cls", tmp_path / "part.nc", tmp_path / "found"
    source.write_text(PATH.format(name="PART", comment="none"))
    monkeypatch.setenv("CORNERSMOOTH_TOLERANCE", "0.2")
    reports = ("--report", f"{found}.html", "--report", f"{found}.json")
    assert run("smooth", source, "-o", nc, *(reports if command == "smooth" else ())).returncode == 0
    if command == "verify":
        assert run("verify", source, nc, *reports).returncode == 0
    report = json.loads((tmp_path / "found.json").read_text())
    meta, _ = values_of((tmp_path / "found.html").read_text())
    assert "the tolerance 0.2 mm is larger" in report["verdict_text"]
    assert meta["verdict"].startswith(report["verdict_text"])
    assert meta["badge"] == report["verdict"]
    listed = [one["text"].partition(" (")[0] for one in meta["problems"]]
    assert listed == [one["text"].partition(" (")[0] for one in report["findings"] if one["severity"] != "note"]


def test_the_time_is_that_of_the_whole_program_or_none(tmp_path, monkeypatch):
    source, nc = tmp_path / "long.cls", tmp_path / "long.nc"
    rows = "".join(f"GOTO/{x}.0,{x % 2}.0,0.0\n" for x in range(11))
    source.write_text(f"TOOL PATH/LONG,TOOL,T\nFEDRAT/MMPM,1500.0\n{rows}END-OF-PATH\n")
    verdicts = []
    monkeypatch.setattr("cornersmooth.cli.job.TIMED_POSES", 10)
    for more in ((), ("CORNERSMOOTH_TIME=1",), ("-q",), ("CORNERSMOOTH_TIME=1", "--report", tmp_path / "long.html")):
        done = run("smooth", source, "-e", "0.02", "-o", nc, "--force", "--machine", "table-ac", *more)
        assert done.returncode == 0, done.stderr
        verdicts.append(done.stderr.decode())
    assert verdicts[0].startswith("PASSED, ")
    assert " time on " not in verdicts[0]  # too long to be planned unasked
    planned = re.search(r" time on table-ac (\d+\.\d) s instead of (\d+\.\d) s \(.*\)\n +limited by ", verdicts[1])
    assert planned
    assert verdicts[2] == ""
    # the page has planned all of it, and says it in the same words
    assert verdicts[3] == verdicts[1]
    assert planned[0].strip().split("\n")[0] in values_of((tmp_path / "long.html").read_text())[0]["verdict"]


def test_a_text_off_the_path_is_broken_in_words(tmp_path):
    source = tmp_path / "part.cls"
    source.write_text(PATH.format(name="PART", comment="none"))
    nc, page = tmp_path / "part.nc", tmp_path / "found.html"
    assert run("smooth", source, "-e", "0.02", "-o", nc, "-q").returncode == 0
    text = nc.read_text()
    line = next(line for line in text.splitlines() if "Y15." in line and line.startswith("G1"))
    nc.write_text(text.replace(line, line.replace("Y15.", "Y15.3"), 1))
    done = run("verify", source, nc, "-e", "0.02", "--report", page)
    assert done.returncode == 1
    assert done.stdout.decode().startswith("FAILED: ")
    meta, arrays = values_of(page.read_text())
    assert meta["badge"] == "FAILED"
    assert meta["verdict"].startswith("FAILED: ")
    assert (arrays["w_off"] > 0.02).any()


def test_surface_command(tmp_path):
    source, nc = tmp_path / "part.cls", tmp_path / "part.nc"
    source.write_text(PATH.format(name="PART", comment="none"))
    assert run("smooth", source, "-e", "0.02", "-o", nc, "-q").returncode == 0
    names = ["map.json", "map.csv", "map.html"]
    reports = [word for name in names for word in ("--report", tmp_path / name)]
    measured = ("surface", source, nc, "-e", "0.02", "--stations", "200")
    done = run(*measured, *reports)
    assert done.returncode == 0, done.stderr
    said = done.stdout.decode()
    assert "ball 8 mm" in said
    assert "overcut" in said
    assert "undercut" in said
    told = json.loads((tmp_path / "map.json").read_text())
    rows = (tmp_path / "map.csv").read_text().splitlines()
    assert len(rows) == told["points"] + 1
    assert 0.0 < told["undercut"]["max_mm"] <= 0.02
    meta, arrays = values_of((tmp_path / "map.html").read_text())
    assert len(arrays["s_off"]) == told["points"] - told["points_beyond_reach"]
    assert "overcut by up to" in meta["verdict"]
    assert arrays["h_counts"].sum() == len(arrays["s_off"])
    picture = run(*measured, "--report", tmp_path / "map.png")
    assert picture.returncode == 2
    assert b"let the name end in .json, .csv or .html" in picture.stderr
    # another tool; and a file that describes none
    assert b"cutter 6 mm" in run(*measured, "--tool", "6,1").stdout
    source.write_text(PATH.format(name="PART", comment="none").replace("TLDATA", "$$ TLDATA"))
    done = run(*measured)
    assert done.returncode == 2
    assert b"--tool 10,5" in done.stderr
    assert run("surface", source, nc, "--tool", "x").returncode == 2


def test_a_path_without_any_feed_move_has_a_page():
    path = "TOOL PATH/{name},TOOL,T\n$$ {comment}\nRAPID\nGOTO/0,0,20,0,0,1\nRAPID\nGOTO/9,0,20\nEND-OF-PATH\n"
    meta, arrays = values_of(page_of(smoothed(path)))
    assert meta["badge"] == "PASSED"
    assert not np.isfinite(arrays["w_off"]).any()
    assert len(arrays["c_line"]) == 0


@pytest.mark.parametrize(
    ("blocks", "there"), [("", False), ("G1 X0 Y0 Z10 F100\n", True), ("G0 X0 Y0 Z20\nG1 Z10 F100\n", True)]
)
def test_a_program_that_hardly_moves_has_a_page_and_one_that_does_not_has_none(blocks, there, tmp_path):
    cl, nc, page = tmp_path / "p.cls", tmp_path / "p.nc", tmp_path / "p.html"
    cl.write_text("LOADTL/1\nFEDRAT/MMPM,100\nGOTO/0,0,10,0,0,1\nFINI\n")
    nc.write_text(f"%\nO1\nG90 G21 G94\n{blocks}M30\n%\n")
    found = run("verify", str(cl), str(nc), "--report", str(page))
    assert found.returncode == 1
    assert page.exists() is bool(blocks)
    assert (b"no page is written: the program does not move" in found.stderr) is not page.exists()
    if not blocks:
        cl.write_text("FROM/0,0,10,0,0,1\nFINI\n")
        assert run("smooth", str(cl), "-o", str(tmp_path / "from.nc"), "--report", str(page)).returncode == 0
        assert not page.exists()
