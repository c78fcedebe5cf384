"""Finished programs as a filter: what is smoothed, what stays, and what is put back."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import cornersmooth as cs
from cornersmooth.errors import SettingsError, Verdict
from cornersmooth.filter import Filtered, filter_program, verify_programs
from cornersmooth.filter.runs import FILTERED, ProgramReader
from filter.programs import ISO, PROGRAMS, WORDS, X, Y, Z, cuts
from oracle.command import BAD_INPUT, DONE, run

EPS = 0.02


def form_of(control: str, machine: str, form: str = "g1") -> cs.nc.Form:
    return cs.choose_form(control, form, machine=cs.load_machine(machine) if machine else None)


def filtered(control: str, machine: str, text: str, *, form: str = "g1", lines: str | None = "dense") -> Filtered:
    settings = cs.Settings(tolerance=EPS, lines=lines)
    return filter_program(text.encode("latin-1"), form_of(control, machine, form), settings)


def fanuc(body: str, on: str = "G43.4 H1") -> Filtered:
    return filtered("fanuc", "table-ac", ISO.format(on=on, start="A20. C30.", cuts=body))


@pytest.mark.parametrize("lines", ["dense", "long"])
@pytest.mark.parametrize("name", list(PROGRAMS))
def test_smooths_programs_of_each_control(name: str, lines: str) -> None:
    control, machine, text = PROGRAMS[name]
    found = filtered(control, machine, text, lines=lines)
    assert found.verdict is Verdict.PASSED, found.checked
    arcs = text.count("G2 X")
    assert found.smoothed == found.cuts - arcs >= 20
    assert [(one.reason, one.count) for one in found.left] == [("an arc", 1)] * arcs
    old, new = text.encode().splitlines(keepends=True), found.data.splitlines(keepends=True)
    first = next(k for k, line in enumerate(old) if old[k] != new[k])
    assert re.match(rb"(?i)(N?\d+ )?(N\d+ )?(G0?1|LN?|X)", old[first]) or b"G93" in old[first - 1]
    assert old[-3:] == new[-3:]
    assert old[:first] == new[:first]
    # what is looked for by the block numbers is found once
    numbers = re.findall(rb"(?m)^N\d+", found.data)
    assert len(numbers) == len(set(numbers))
    assert set(numbers) <= set(re.findall(rb"(?m)^N\d+", text.encode()))
    assert (b"\r\n" in found.data) == ("\r\n" in text)


GOLDEN = sorted((Path(__file__).parents[1] / "nc" / "golden").glob("*-g1*.nc"))


@pytest.mark.parametrize("path", GOLDEN, ids=[path.stem for path in GOLDEN])
def test_smooths_what_smooth_has_written(path: Path) -> None:
    """Lines of every control and machine, with positions of the machine's axes, too."""
    parts = re.fullmatch(r"\w+\.(\w+)-g1-?(.*?)(-axes)?", path.stem)
    assert parts is not None
    control, machine, axes = parts.groups()
    if control not in FILTERED:
        return
    form = cs.choose_form(control, "g1", machine=cs.load_machine(machine) if machine else None, tcp=not axes)
    found = filter_program(path.read_bytes(), form, cs.Settings(tolerance=EPS, lines="dense"))
    assert found.verdict is Verdict.PASSED, found.checked
    assert found.smoothed > found.cuts / 2
    stays = ("a single cut", "an arc", "the tip stays")
    assert all(one.reason.startswith(stays) for one in found.left), found.left


@pytest.mark.parametrize(
    ("name", "form"), [("siemens words", "bspline"), ("heidenhain words", "spl"), ("fanuc words", "g6.2")]
)
def test_curves_of_the_control_are_refused(name: str, form: str) -> None:
    control, _, text = PROGRAMS[name]
    with pytest.raises(SettingsError, match="use -f g1") as refused:
        filtered(control, "", text, form=form)
    assert refused.value.code == "CS241"


def test_modes_are_put_back() -> None:
    control, machine, text = PROGRAMS["haas, inch, G93"]
    lines = filtered(control, machine, text).data.decode().splitlines()
    assert lines[lines.index("G93") + 1] == "G94"
    assert lines[-6:-3] == ["G93", "G94", "G0 Z50."]
    control, machine, text = PROGRAMS["linuxcnc, G64, an arc inside"]
    lines = filtered(control, machine, text, lines="long").data.decode().splitlines()
    assert lines[lines.index("G2 X60 Y5 I5 J0") - 1] == "G64 P0.02 Q0.01"
    control, machine, text = PROGRAMS["linuxcnc, G91"]
    lines = filtered(control, machine, text, lines="long").data.decode().splitlines()
    assert lines[lines.index("G91 G1 F1000") + 1] == "G90"
    assert lines[-5:-3] == ["G91", "G90"]


RUN = cuts(WORDS, feed="F1000.")


@pytest.mark.parametrize(
    ("before", "reason"),
    [
        ("G49\n", "tool tip control is off"),
        ("M6\n", "since 'M6': whether tool tip control is on"),
        ("G68.2 X0 Y0 Z0 I0 J30. K0\n", "places of the part are turned"),
        ("G68 X0 Y0 R30.\n", "places of the part are turned"),
        ("G51 X0 Y0 Z0 P2.\n", "places of the part are turned"),
        ("G66 P9000\n", "places of the part are turned"),
        ("G41 D1\n", "the radius of the cutter"),
        ("G95\n", "feed per revolution"),
        ("M98 P1000\n", "since 'M98 P1000': whether tool tip control is on"),
        ("G65 P1000 A1\n", "since 'G65 P1000 A1': "),
        ("IF [#1 EQ 1] GOTO 5\n", "since 'IF [#1 EQ 1] GOTO 5': "),
        ("G777\n", "since 'G777': "),
        ("/G49\n", "since '/G49': whether tool tip control is on"),
        ("G54.4 P1\n", "places of the part are turned"),
    ],
)
def test_leaves_what_is_not_surely_known(before: str, reason: str) -> None:
    found = fanuc(before + RUN)
    assert found.smoothed == 0
    assert found.verdict is Verdict.NOT_SMOOTHED
    assert found.data == ISO.format(on="G43.4 H1", start="A20. C30.", cuts=before + RUN).encode()
    assert reason in found.left[0].reason
    assert found.left[0].count == 24


@pytest.mark.parametrize(
    "before",
    [
        "M200\n",
        "#100=5\n",
        "G28 Z0\n",
        "G91 G28 Z0\nG90\n",
        "G55\n",
        "G53 G0 Z0\n",
        "G0 X5\n",
        "G92 X0\n",
        "G1 X#5 F100.\n",
        "/G0 X5.\n",
    ],
)
def test_the_cut_after_a_lost_place_stays_and_those_after_it_do_not(before: str) -> None:
    found = fanuc(before + RUN)
    assert found.verdict is Verdict.PASSED
    assert found.smoothed == 23
    assert RUN.splitlines()[0].encode() in found.data.splitlines()


@pytest.mark.parametrize("before", ["M8\n", "(A COMMENT)\n", "\n", "G17\n", "G54\n", "G61\n", "T5\n", "G90 G21\n"])
def test_words_that_change_nothing_lose_nothing(before: str) -> None:
    assert fanuc(before + RUN).smoothed == 24


def test_vectors_with_missing_words_are_left() -> None:
    control, machine, text = PROGRAMS["fanuc vectors"]
    lines = text.splitlines(keepends=True)
    lines[20] = re.sub(r"J[-\d.]+", "", lines[20])
    found = filtered(control, machine, "".join(lines))
    assert found.verdict is Verdict.PASSED
    assert "".join(lines[20:22]).encode() in found.data
    assert found.smoothed == 22


def test_paths_of_klartext_that_are_not_known_lose_the_place() -> None:
    control, machine, text = PROGRAMS["heidenhain words"]
    lines = text.splitlines(keepends=True)
    lines.insert(12, "50 L IX+1 IY-2\n")
    lines.insert(20, "51 L M140 MB MAX\n")
    found = filtered(control, machine, "".join(lines))
    assert found.verdict is Verdict.PASSED
    # after each the feed is not known until the program says it again
    assert found.smoothed == 8
    assert "".join(lines[12:]).encode() in found.data


@pytest.mark.parametrize(
    "jump", ["IF [#1 EQ 1] GOTO 12", "M99 P12", "M 099 P12", "N900 if[#1 eq 1]goto12", "P12 M99", "M98 H12"]
)
def test_what_is_jumped_to_is_left(jump: str) -> None:
    lines = [f"N{k} {line}\n" for k, line in enumerate(RUN.splitlines(), start=1)]
    text = ISO.format(on="G43.4 H1", start="A20. C30.", cuts="".join(lines)).replace("M30", f"{jump}\nM30")
    found = filtered("fanuc", "table-ac", text)
    assert found.smoothed == 11
    assert "".join(lines[11:]).encode() in found.data


def test_a_jump_back_is_seen_before_its_line() -> None:
    lines = [f"N{k} {line}\n" for k, line in enumerate(RUN.splitlines(), start=1)]
    text = ISO.format(on="G43.4 H1", start="A20. C30.", cuts="".join(lines)).replace("M30", "IF [#1 EQ 1] GOTO 5\nM30")
    reading = ProgramReader("fanuc", cs.load_machine("table-ac")).read(text.encode())
    assert 0 < max(run.stop for run in reading.runs) <= text[: text.index("N5 ")].count("\n")


def test_corners_that_the_program_rounds_itself_stay() -> None:
    lines = RUN.splitlines(keepends=True)
    lines[10] = lines[10].replace("\n", " ,R0.5\n")
    found = fanuc("".join(lines))
    assert found.verdict is Verdict.PASSED
    assert "".join(lines[9:12]).encode() in found.data
    assert 0 < found.smoothed < 24


@pytest.mark.parametrize(
    ("control", "machine", "text"),
    [
        ("haas", "table-bc", "%\nO1\nG21 G90 G94\nG54\nG0 B30. C0.\nG254\nG43 H1\nG0 X0. Y0. Z5.\n{}G255\nM30\n%\n"),
        ("fanuc", "table-ac", "G21 G90\nG68.2 X0 Y0 Z0 I0 J30. K0\nG53.1\nG43 H1\nG0 X0. Y0. Z5.\n{}G49\nG69\nM30\n"),
        ("siemens", "", 'TRAORI\nCYCLE800(0,"",0,57,0,0,0,30,0,0,0,0,0,-1)\nG0 X0 Y0 Z5\n{}CYCLE800()\nM30\n'),
        ("siemens", "", "G90 G71\nTRAORI\nG54\nAROT Y90\nG0 X0 Y0 Z5 A3=0 B3=0 C3=1\n{}TRANS\nM30\n"),
        (
            "heidenhain",
            "table-ac",
            "0 BEGIN PGM X MM\nPLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN FMAX\nL X+0 Y+0 Z+5 FMAX\n{}PLANE RESET STAY\n",
        ),
    ],
)
def test_tilted_planes_come_out_byte_for_byte(control: str, machine: str, text: str) -> None:
    cut = "L X{x:+.3f} Y{y:+.3f} Z{z:+.3f}" if control == "heidenhain" else "G1 X{x:.3f} Y{y:.3f} Z{z:.3f}"
    whole = text.format(cuts(cut, feed="F500"))
    found = filtered(control, machine, whole)
    assert found.data == whole.encode()
    assert found.verdict is Verdict.NOT_SMOOTHED
    assert found.left


@pytest.mark.parametrize(
    ("name", "block"),
    [
        *(("siemens words", block) for block in ("ROT X30", "ROT RPL=30", "AROT Z5", "SCALE X2", "MIRROR X0")),
        ("siemens words", "TRANS X5\nROT X30"),
        *(("heidenhain words", block) for block in ("TRANS ROTATION ROT+30", "TRANS MIRROR AXIS X")),
        ("heidenhain words", "CYCL DEF 10.0 ROTATION\nCYCL DEF 10.1 ROT+30"),
        ("linuxcnc, G91", "G10 L2 P1 R30"),
        ("fanuc words", "G68 X0 Y0 R30."),
        ("haas, inch, G93", "G268 X0 Y0 Z0 I0 J30. K0"),
    ],
)
def test_turned_places_come_out_byte_for_byte(name: str, block: str) -> None:
    control, machine, text = PROGRAMS[name]
    rapid = next(line for line in text.splitlines() if re.search(r"G0 X|FMAX M3", line))
    whole = text.replace(rapid, f"{block}\n{rapid}")
    found = filtered(control, machine, whole)
    assert found.data == whole.encode()
    assert found.cuts


@pytest.mark.parametrize("block", ["ROT", "TRANS", "ROT X30\nROT", "N5 SCALE"])
def test_frames_of_siemens_end_with_their_word_alone(block: str) -> None:
    control, machine, text = PROGRAMS["siemens words"]
    assert filtered(control, machine, text.replace("G0 X0", f"{block}\nG0 X0", 1)).smoothed == 24


def test_the_turn_of_the_program_is_kept() -> None:
    body = cuts(WORDS, feed="F1000.")
    turned = re.sub(r"C([\d.]+)", lambda match: f"C{float(match[1]) - 720:.3f}", body)
    text = ISO.format(on="G43.4 H1", start="A20. C-690.", cuts=turned)
    found = filtered("fanuc", "table-ac", text)
    assert found.verdict is Verdict.PASSED
    assert found.smoothed == 24
    angles = [float(one) for one in re.findall(rb"C(-?[\d.]+)", found.data)]
    assert all(-691 < angle < -648 for angle in angles)


def test_a_listing_and_a_mark_before_the_program_are_let_through() -> None:
    listing = "\xef\xbb\xbfInformation listing\nG1 is not a block here, says the list\n\n"
    text = listing + PROGRAMS["fanuc words"][2]
    found = filtered("fanuc", "table-ac", text)
    assert found.smoothed == 24
    assert found.data.startswith(listing.encode("latin-1"))


def test_commands_know_programs(tmp_path: Path) -> None:
    control, machine, text = PROGRAMS["linuxcnc, G64, an arc inside"]
    (tmp_path / "part.ngc").write_text(text)
    on = ("--control", control, "--machine", machine)
    dense = ("--lines", "dense")
    made = run("filter", "part.ngc", *on, *dense, "-o", "new.ngc", cwd=tmp_path)
    assert made.returncode == DONE
    assert made.stderr.decode().startswith("PASSED  new.ngc  linuxcnc g1, xyzac-trt, ")
    assert "\n        24 of 25 cuts smoothed in 2 runs within 0.01 mm" in made.stderr.decode()
    assert re.search(r"1 +\d+  an arc\n", made.stderr.decode())
    assert (
        run("filter", "-", *on, *dense, data=text.encode(), cwd=tmp_path).stdout == (tmp_path / "new.ngc").read_bytes()
    )
    found = run("verify", "part.ngc", "new.ngc", *on, cwd=tmp_path)
    assert found.returncode == DONE
    assert found.stdout.startswith(b"PASSED: within 0.01 mm")
    wrong = (tmp_path / "new.ngc").read_text().replace("G2 X60 Y5", "G2 X61 Y5")
    (tmp_path / "new.ngc").write_text(wrong)
    found = run("verify", "part.ngc", "new.ngc", *on, cwd=tmp_path)
    assert found.returncode == 1
    assert b"the lines after line 15 of the old program are not there" in found.stderr
    assert b"an NC program, looks like linuxcnc" in run("info", "part.ngc", cwd=tmp_path).stdout
    (tmp_path / "part.h").write_text(PROGRAMS["heidenhain words"][2])
    for name in ("part.ngc", "part.h"):
        refused = run("smooth", name, cwd=tmp_path)
        assert refused.returncode == BAD_INPUT
        assert b"cornersmooth filter" in refused.stderr


def test_without_words_for_tip_control_it_has_to_be_said() -> None:
    text = PROGRAMS["linuxcnc, G91"][2].replace("M428\n", "").replace("M429\n", "").encode()
    form, settings = form_of("linuxcnc", "xyzac-trt"), cs.Settings(tolerance=EPS, lines="dense")
    assert filter_program(text, form, settings).data == text
    assert filter_program(text, form, settings, tip_from_start=True).smoothed == 20


@pytest.mark.parametrize(
    "title", ["", "PROC BLADE SAVE DISPLOF\n", "%_N_BLADE_SPF\nPROC BLADE(REAL _DEEP)\nDEF INT N\n"]
)
def test_a_subprogram_of_siemens_begins_where_the_option_says(title: str) -> None:
    words = cuts("G1 X{x:.3f} Y{y:.3f} Z{z:.3f} A={a:.3f} C={c:.3f}", feed="F1000")
    text = f"{title}G90 G94 G71 G40\nORIAXES\nG1 X0 Y-1.5 Z20 A20 C30 F900\n{words}RET\n".encode()
    form, settings = form_of("siemens", "table-ac"), cs.Settings(tolerance=EPS, lines="dense")
    assert filter_program(text, form, settings).smoothed == 0
    made = filter_program(text, form, settings, tip_from_start=True)
    assert (made.verdict, made.smoothed) == (Verdict.PASSED, 24)


def test_verify_finds_what_is_wrong_with_a_program_of_anybody() -> None:
    control, machine, text = PROGRAMS["fanuc words"]
    form, settings, old = form_of(control, machine), cs.Settings(tolerance=EPS, lines="dense"), text.encode()
    good = filter_program(old, form, settings).data
    assert verify_programs(old, good, form, settings).verdict is Verdict.PASSED
    assert verify_programs(old, old, form, settings).verdict is Verdict.PASSED
    lines = good.splitlines(keepends=True)
    middle = len(lines) // 2
    x = float(re.search(rb"X([\d.]+)", lines[middle])[1])  # type: ignore[index]
    moved = lines[middle].replace(b"X%.3f" % x, b"X%.3f" % (x + 3 * EPS))
    assert moved != lines[middle]
    for wrong, line in [
        ([*lines[:middle], moved, *lines[middle + 1 :]], middle + 1),
        ([*lines[:5], b"S8000 M3\n", *lines[6:]], 6),
        ([*lines[:-4], b"G0 Z49.\n", *lines[-3:]], None),
        ([one.replace(b"F1000.", b"F900.") for one in lines], 10),
    ]:
        found = verify_programs(old, b"".join(wrong), form, settings).checked.wrong
        assert found
        assert line is None or any(one.nc_line == line for one in found), (line, found)


def test_says_the_time_of_what_has_changed(tmp_path: Path) -> None:
    control, machine, count = "fanuc", "table-ac", 8
    text = ISO.format(on="G43.4 H1", start="A20. C30.", cuts=cuts(WORDS, feed="F1000.", last=count))
    form, settings, axes = (
        form_of(control, machine),
        cs.Settings(tolerance=EPS, lines="dense"),
        cs.load_machine(machine),
    )
    # so slow that no axis has to brake: the length over the feed, and 19 mm down to the first place
    length = np.linalg.norm(np.diff(np.column_stack((X, Y, Z))[:count], axis=0), axis=1).sum()
    slow = filter_program(text.replace("F1000.", "F6.").encode(), form, settings, axes=axes)
    assert slow.seconds is not None
    # plans are at most 0.3 % slower than the fastest where the tool stops at every corner
    assert slow.seconds[0] == pytest.approx((length + 19.0) / 0.1, rel=3e-3)
    # each corner is cut by less than ε
    assert slow.seconds[0] - 2 * count * EPS / 0.1 < slow.seconds[1] < slow.seconds[0]
    (tmp_path / "part.nc").write_text(text)
    on = ("--control", control, "--machine", machine, "--limits", machine, "-e", EPS)
    told = run("filter", "part.nc", *on, "--lines", "dense", "-o", "new.nc", cwd=tmp_path).stderr.decode()
    fast = re.match(r"PASSED.* lines from [\d,]+ lines, (\d+\.\d) s instead of (\d+\.\d) s \(", told)
    assert fast
    assert float(fast[1]) < float(fast[2]) < 0.1 * slow.seconds[0]


def test_a_run_that_is_not_decided_stays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cornersmooth.nc_reader.reader.MOST_LINES", 1)
    found = filtered(*PROGRAMS["fanuc words"])
    assert found.smoothed == 0
    assert found.data == PROGRAMS["fanuc words"][2].encode()
    assert any("the run was not verified" in one.reason for one in found.left)


@pytest.mark.parametrize("eps", [0.02, 0.05, 0.1, 0.2])
@pytest.mark.parametrize(
    ("control", "name"), [("fanuc", ""), *((c, f"{c} vectors") for c in ("siemens", "heidenhain"))]
)
def test_tool_vectors_are_judged_with_the_whole_tolerance(control: str, name: str, eps: float) -> None:
    """Runs that are fitted with all of ε; the first is a small program of few corners."""
    axes = "I{i:.6f} J{j:.6f} K{k:.6f}"
    angles = np.radians([11, 12, 13, 12, 11, 10, 11])
    body = "".join(
        f"G1 X{10 * n + 10}. Y{(0, 4, 5, 0, 4, 0, 6)[n]}. Z10. {axes.format(i=np.sin(a), j=0, k=np.cos(a))}\n"
        for n, a in enumerate(angles)
    )
    text = ISO.format(on="G43.5 H1", start="I0.173648 J0. K0.984808", cuts=f"G1 Z10. F800.\n{body}")
    data = PROGRAMS[name][2] if name else text
    found = filter_program(data.encode("latin-1"), form_of(control, ""), cs.Settings(tolerance=eps, lines="dense"))
    assert found.verdict is Verdict.PASSED, found.left
    assert found.smoothed == found.cuts
