"""The public API: the example in the package's own words, the one call, refusals at the door."""

from __future__ import annotations

import contextlib
import gc
import hashlib
import inspect
import io
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import cornersmooth
from careless import look_away
from cornersmooth import CornersmoothError, Settings, VerdictError, pipeline
from cornersmooth.cli import run
from cornersmooth.system.output import open_output
from oracle.files import beginning

SAMPLE = Path(__file__).resolve().parent.parent / "samples" / "impeller.cls"

#: where zhang2016 strays, and leaves the corner sharp if it looks: the axis turns fast at a nearly straight tip
BREAKING = b"""UNITS/MM
RAPID
GOTO/0.,0.,50.,0.,0.,1.
FEDRAT/1000.,MMPM
GOTO/0.,0.,0.,0.,0.,1.
GOTO/10.,0.,0.,0.,0.5,0.8660254
GOTO/20.,0.1,0.,0.5,0.,0.8660254
GOTO/30.,0.,0.,0.,0.,1.
FINI
"""


def examples() -> str:
    """The code of the package's docstring."""
    text = inspect.getdoc(cornersmooth)
    assert text
    blocks = re.findall(r"::\n\n((?:    .*\n)+)", text + "\n")
    assert len(blocks) == 2
    return "".join(inspect.cleandoc(block) + "\n" for block in blocks)


def run_examples(folder: Path, monkeypatch: pytest.MonkeyPatch, tolerance: float) -> dict[str, object]:
    """Names that are left by the examples, run with this tolerance in a folder with a ``part.cls``."""
    monkeypatch.chdir(folder)
    code = examples()
    assert code.count("tolerance=0.04") == 3
    names: dict[str, object] = {"cornersmooth": cornersmooth}
    exec(code.replace("tolerance=0.04", f"tolerance={tolerance}"), names)
    return names


@pytest.mark.parametrize("tolerance", [0.005, 0.04])
def test_the_documented_examples_keep_the_tolerance(tmp_path, monkeypatch, tolerance):
    (tmp_path / "part.cls").write_bytes(SAMPLE.read_bytes())
    names = run_examples(tmp_path, monkeypatch, tolerance)
    assert names["found"].passed
    assert 0.9 * tolerance < names["found"].max_tip_deviation_mm <= tolerance
    assert names["result"].verification.passed
    one, steps = io.BytesIO(), (tmp_path / "part.nc").read_bytes()
    cornersmooth.postprocess(SAMPLE, one, Settings(tolerance=tolerance))
    lines = one.getvalue().splitlines()
    assert [
        line for line in lines if not line.startswith((b"(CORNERSMOOTH ", b"(SHA256", b"(PARTS="))
    ] == steps.splitlines()


@pytest.mark.corpus
@pytest.mark.parametrize("tolerance", [0.005, 0.04])
def test_the_documented_examples_keep_the_tolerance_on_a_real_file(tmp_path, monkeypatch, corpus, tolerance):
    (source,) = corpus.rglob("nx_clsf_varcontour5x_ust_a.cls")
    (tmp_path / "part.cls").write_bytes(source.read_bytes())
    found = run_examples(tmp_path, monkeypatch, tolerance)["found"]
    assert found.passed
    assert found.max_axis_point_deviation_mm <= tolerance


def test_every_public_name_is_there_and_help_lists_the_functions():
    import cornersmooth.verify  # the package of the same name does not hide the function

    for name in cornersmooth.__all__:
        assert callable(getattr(cornersmooth, name))
    text = subprocess.run(
        [sys.executable, "-c", "import cornersmooth; help(cornersmooth)"], capture_output=True, text=True, check=True
    ).stdout
    for name in cornersmooth.__all__:
        assert re.search(rf"^    (class )?{name}\(", text, re.MULTILINE), name


def test_text_is_not_written_with_digits_that_were_not_reckoned_with():
    program = cornersmooth.read(SAMPLE)
    plain = cornersmooth.smooth(program, Settings(tolerance=0.04))
    with pytest.raises(CornersmoothError, match=r"fanuc form g1 can hold\nhint: smooth it for the form"):
        cornersmooth.write(plain, io.BytesIO())
    lines = cornersmooth.smooth(program, Settings(tolerance=0.04), form=cornersmooth.choose_form("fanuc", "g1"))
    cornersmooth.write(lines, io.BytesIO())
    with pytest.raises(CornersmoothError, match="siemens form bspline can hold"):  # three decimals, no F in curves
        cornersmooth.write(lines, io.BytesIO(), control="siemens", form="bspline")


@pytest.mark.parametrize(
    ("tip", "axis", "feed", "message"),
    [
        ([[0, 0, 0], [1, np.nan, 0]], [[0, 0, 1]] * 2, 100, "the tip of pose 1 is 1, nan, 0"),
        ([[np.inf, 0, 0]], [[0, 0, 1]], 100, "the tip of pose 0 is inf, 0, 0"),
        ([[0, 0, 0]], [[0, 0, 0]], 100, "the axis of pose 0 is 0, 0, 0"),
        ([[0, 0, 0]], [[0, np.nan, 1]], 100, "the axis of pose 0 is 0, nan, 1"),
        ([[0, 0, 0]], [[0, np.inf, 1]], 100, "the axis of pose 0 is 0, inf, 1"),
        ([[0, 0, 0]], [[0, 0, 1]], 0, "the feed of pose 0 is 0"),
        ([[0, 0, 0]], [[0, 0, 1]], np.inf, "the feed of pose 0 is inf"),
    ],
)
def test_poses_that_are_none_are_refused(tip, axis, feed, message):
    with pytest.raises(CornersmoothError, match=rf"^error\[\w+\]: {message}\nhint: give "):
        cornersmooth.from_poses(tip, axis, feed=feed)


def test_poses_may_have_axes_of_any_length_and_no_feed():
    program = cornersmooth.from_poses(np.zeros((3, 3)), [[0, 0, 1e300], [0, 3e-200, 4e-200], [2, 0, 0]])
    np.testing.assert_allclose(program.axis, [[0, 0, 1], [0, 0.6, 0.8], [1, 0, 0]], rtol=1e-15)
    assert np.isnan(program.feed).all()


def test_points_on_the_smoothed_path():
    program = cornersmooth.read(SAMPLE)
    smoothed = cornersmooth.smooth(program, Settings(tolerance=0.04))
    points, finer = cornersmooth.sample(smoothed), cornersmooth.sample(smoothed, chord=1e-4)
    assert len(program) < len(points) < len(finer)
    np.testing.assert_allclose(np.linalg.norm(points.axis, axis=1), 1.0)
    np.testing.assert_array_equal(points.kind, program.kind[points.pose])
    assert (np.diff(points.pose) >= 0).all()
    np.testing.assert_allclose(points.tip[-1], program.tip[-1])


def test_one_call_does_what_the_command_does(tmp_path, capsys):
    out, ours, source = tmp_path / "command.nc", tmp_path / "call.nc", tmp_path / SAMPLE.name
    source.write_bytes(beginning(SAMPLE, 105))
    assert run(["smooth", str(source), "-e", "0.02", "-f", "g6.2", "-o", str(out), "-q"]) == 0
    stages = set()
    form = cornersmooth.choose_form("fanuc", "g6.2")
    result = cornersmooth.postprocess(
        source, ours, Settings(tolerance=0.02), form=form, progress=lambda stage, done, total: stages.add(stage)
    )
    assert ours.read_bytes() == out.read_bytes()
    assert stages == {"reading", "smoothing", "writing", "verifying"}
    assert set(result.seconds) == {"read", "smooth", "write", "verify"}
    assert (result.path, result.unverified) == (str(ours), "")
    assert result.report()["verification"]["passed"]
    assert {finding.code for finding in result.findings} >= {"CS132", "CS317"}
    with pytest.raises(CornersmoothError, match="exists already"):
        cornersmooth.postprocess(source, ours)
    with pytest.raises(CornersmoothError, match="is the input"):
        cornersmooth.postprocess(ours, ours, force=True)


def test_a_program_that_was_read_knows_its_file():
    whole, step = io.BytesIO(), io.BytesIO()
    cornersmooth.postprocess(SAMPLE, whole, Settings(tolerance=0.02))
    program = cornersmooth.read(SAMPLE)
    result = cornersmooth.postprocess(program, step, Settings(tolerance=0.02))
    digest = hashlib.sha256(SAMPLE.read_bytes()).hexdigest()
    assert program.source.sha256 == result.report()["input"]["sha256"] == digest
    assert step.getvalue() == whole.getvalue()
    assert f"SHA256={digest}".encode() in whole.getvalue()
    assert cornersmooth.from_poses([[0, 0, 0]], [[0, 0, 1]]).source.sha256 == ""


def test_a_failed_program_is_an_error_and_the_old_file_stays(tmp_path, monkeypatch):
    look_away(monkeypatch)
    out = tmp_path / "o.nc"
    out.write_text("old")
    settings = Settings(tolerance=0.01, method="zhang2016")
    with pytest.raises(VerdictError, match=r"the verdict is FAILED\nhint: the program is in .*o\.nc\.failed") as caught:
        cornersmooth.postprocess(BREAKING, out, settings, force=True)
    assert out.read_text() == "old"
    result = caught.value.result
    assert result.verification.problems
    assert Path(result.path).read_text().endswith("M30\n%\n")
    stream = io.BytesIO()
    with pytest.raises(VerdictError, match="nothing was written"):
        cornersmooth.postprocess(BREAKING, stream, settings)
    assert stream.getvalue() == b""
    result = cornersmooth.postprocess(BREAKING, stream, settings, verify=False)
    assert (result.verification, result.unverified) == (None, "nothing was measured, as asked for")
    assert stream.getvalue()


def test_a_file_that_appears_meanwhile_is_not_replaced(tmp_path):
    out = tmp_path / "o.nc"

    def appear(stage: str, done: int, total: int) -> None:
        out.write_text("theirs")

    with pytest.raises(CornersmoothError, match=r"o\.nc: error\[\w+\]: exists already\nhint: use --force"):
        cornersmooth.postprocess(SAMPLE, out, progress=appear)
    assert out.read_text() == "theirs"
    assert [path.name for path in tmp_path.iterdir()] == ["o.nc"]
    cornersmooth.postprocess(SAMPLE, out, progress=appear, force=True)
    assert out.read_text().endswith("M30\n%\n")


def test_a_file_that_appears_meanwhile_is_not_replaced_where_there_are_no_links(tmp_path, monkeypatch):
    def no_links(source: str, target: str) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr("os.link", no_links)
    out = tmp_path / "o.nc"
    cornersmooth.postprocess(SAMPLE, out)
    assert out.read_text().endswith("M30\n%\n")
    out.unlink()
    with pytest.raises(CornersmoothError, match="exists already"):
        cornersmooth.postprocess(SAMPLE, out, progress=lambda stage, done, total: out.write_text("theirs"))
    assert out.read_text() == "theirs"


@pytest.mark.parametrize("stream", [True, False])
def test_a_text_that_is_changed_behind_its_verification_is_not_used(tmp_path, monkeypatch, stream):
    class Spoilt(pipeline.Verifier):
        def result(self) -> cornersmooth.Verification:
            found = super().result()
            with open(self._name, "r+b") as text:
                text.write(b"#")
            return found

    monkeypatch.setattr(pipeline, "Verifier", Spoilt)
    out = io.BytesIO() if stream else tmp_path / "o.nc"
    with pytest.raises(CornersmoothError, match="the program was changed before it took its place"):
        cornersmooth.postprocess(SAMPLE, out)
    assert not list(tmp_path.iterdir())
    assert not stream or out.getvalue() == b""


@pytest.mark.parametrize("args", [["--help"], ["smooth", "--help"], ["time", "--help"]])
def test_help_loads_no_arrays(args):
    loaded = "{'numpy', 'scipy', 'rich'} & set(sys.modules)"
    code = f"import sys; from cornersmooth.cli import run; run({args}); print({loaded})"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert said.endswith("set()\n")


def test_a_module_can_be_run():
    done = subprocess.run(
        [sys.executable, "-m", "cornersmooth", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("cornersmooth")


#: calls that are wrong, of names in `Things`, and their codes
WRONG = """
CS167 from_poses(TIPS, [[0, 0, 1]])
CS167 from_poses([[0, 0]], [[0, 0, 1]])
CS167 from_poses([["a", 0, 0]], [[0, 0, 1]])
CS167 from_poses([], [])
CS167 from_poses(None, AXES)
CS167 from_poses(TIPS, AXES, feed="fast")
CS167 from_poses(TIPS, AXES, feed=[1.0, 2.0])
CS167 from_poses(TIPS, AXES, kind=[99] * 3)
CS167 from_poses(TIPS, AXES, kind=[258] * 3)
CS167 from_poses(TIPS, AXES, kind=[2.7] * 3)
CS167 from_poses(TIPS, AXES, kind=[2])
CS167 from_poses(TIPS, AXES, line=["a"] * 3)
CS230 direct(program, Limits(feed=100), "foo")
CS167 corner_table(smoothed, rows=[99999])
CS167 corner_table(smoothed, rows=[0.5])
CS230 read(b"", units="cm")
CS202 Settings(tolerance="0.01")
CS202 Settings(tolerance=None)
CS202 Settings(axis_length=None)
CS202 Limits(feed="1")
CS202 Limits(accel=None)
CS202 Frame(header="abc")
"""


@pytest.fixture(scope="module")
def things() -> dict[str, object]:
    """What the wrong calls are of."""
    tips, axes = [[0, 0, 0], [9, 0, 0], [9, 9, 0]], [[0, 0, 1]] * 3
    program, form = cornersmooth.from_poses(tips, axes, feed=100), cornersmooth.choose_form("fanuc", "g1")
    smoothed = cornersmooth.smooth(program, form=form)
    own = {"TIPS": tips, "AXES": axes, "program": program, "form": form, "smoothed": smoothed}
    return {**{name: getattr(cornersmooth, name) for name in cornersmooth.__all__}, **own}


@pytest.mark.parametrize("line", WRONG.strip().splitlines())
def test_wrong_arguments_are_errors_of_the_library(things: dict[str, object], line: str) -> None:
    code, call = line.split(" ", 1)
    with pytest.raises(CornersmoothError) as caught:
        eval(call, things)
    assert (caught.value.code, bool(caught.value.hint), len(str(caught.value)) < 300) == (code, True, True)


def test_arguments_of_many_kinds_are_right(things: dict[str, object]) -> None:
    table = cornersmooth.corner_table(things["smoothed"], rows=[0])
    assert len(table["line"]) == 1
    assert cornersmooth.from_poses([[0, 0, 0]], [[0, 0, 1]], kind=np.array([1.0])).kind.dtype == np.uint8
    assert Settings(tolerance=np.float64(0.02)).tolerance == 0.02


class TakesAPart(io.RawIOBase):
    """A raw stream that takes a part of what is written, as a pipe does when a signal comes."""

    def __init__(self) -> None:
        self.taken = b""

    def writable(self) -> bool:
        return True

    def write(self, data: bytes, /) -> int:  # type: ignore[override]
        self.taken += bytes(data[:1000])
        return min(len(data), 1000)


@pytest.mark.parametrize("verify", [True, False])
def test_a_raw_stream_gets_all_of_the_program(verify: bool) -> None:
    raw, whole = TakesAPart(), io.BytesIO()
    cornersmooth.postprocess(BREAKING, raw, verify=verify)
    cornersmooth.postprocess(BREAKING, whole, verify=verify)
    assert len(raw.taken) > 1000
    assert raw.taken == whole.getvalue()
    assert not raw.closed


def test_a_raw_stream_stays_open_where_writing_ends_with_an_error() -> None:
    raw = TakesAPart()
    with contextlib.suppress(ZeroDivisionError), open_output(raw) as output:
        output.stream.write(b"M30\n")
        raise ZeroDivisionError
    del output
    gc.collect()
    assert not raw.closed
