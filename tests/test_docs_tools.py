"""What README and docs tell to run besides cornersmooth itself is run, too: make, scripts, batches on other machines.

What takes minutes as it stands runs with little to do; what it is, says the table `RUN_BY`.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import importlib.util
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

import pytest

from interruptions import cl_text
from oracle.command import SCRIPT, SMALL, environment
from oracle.share import share

ROOT = Path(__file__).resolve().parent.parent
PAGES = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md")))
PROGRAM = r"(?:make|python3?|pip|dask|cd|find|npm) "

#: every command of the pages, and what runs it: a test of this file, or the file that does
RUN_BY = {
    "make run": "tests/test_samples.py",
    "make test": "test_make_runs_the_tests",
    "make thorough": "test_make_runs_the_tests",
    "make docs": "test_make_docs_writes_the_reference",
    "make check": ".ci/run",
    "make packages": ".ci/run",
    # an hour, so it runs with few poses
    "make bench": "test_make_bench_times_the_command",
    "make bench BEFORE=FOLDER": "test_make_bench_compares_checkouts",
    # minutes of LinuxCNC's whole controller in real time: here it gives a made-up answer
    "make controller": "test_make_controller_prints_its_table",
    "python tests/nc/controller_filter.py impeller-7bl-xyzac.ngc --cuts 300 --lines long": (
        "tests/filter/test_filter_on_a_controller.py"
    ),
    "pip install .": ".ci/packages",
    "python tools/make_options.py": "tests/test_docs.py",
    "python tools/make_codes.py": "tests/test_codes.py",
    "python tools/make_words.py": "tests/verify/test_word_mutations.py",
    "python tools/run_examples.py docs/gallery.md docs": "tests/test_docs.py",
    "python tools/make_savings.py FOLDER": "test_savings_are_printed_as_a_table",
    "python tests/nc/planned_column.py FOLDER": "tests/nc/test_nc_planned_column.py",
    "python tests/batch_runs.py": "test_batch_runs_times_a_batch",
    "python -m nc.test_nc_golden": "tests/nc/test_nc_golden.py",
    "python -m nc.sweep": "test_sweeps_find_nothing",
    "python -m nc.all_texts FILE": "test_texts_are_as_before",
    "python -m nc.run_chains": "test_sweeps_find_nothing",
    "python -m nc.run_chains 3000 3252": "test_sweeps_find_nothing",
    "python -m verify.sweep": "test_sweeps_find_nothing",
    "python -m verify.hole_programs 1400000 1402000": "test_sweeps_find_nothing",
    "python -m smoothing.mutants": "tests/smoothing/test_paper_equations.py",
    "python -m verify.slices": "tests/verify/test_slices.py",
    "python -m verify.word_mutations 2": "tests/verify/test_word_mutations.py",
    "python -m verify.hole_mutations": "test_hole_mutations_are_scored",
    # needs the network
    "cd web && npm ci && npm run bundle && npm run check": "test_scripts_of_the_page_are_there",
    "dask scheduler --scheduler-file /shared/scheduler.json &": "tests/cli/test_cli_cluster.py",
    "dask worker --scheduler-file /shared/scheduler.json --nthreads 1 --nworkers 16 &": "tests/cli/test_cli_cluster.py",
    "cd /shared/job": "test_parallel_does_all_files",
    "find cl -name '*.cls' | parallel --joblog made.log --resume-failed -j 4 --sshlogin host1,host2 --workdir . \\": (
        "test_parallel_does_all_files"
    ),
    "find cl -name '*.cls' | sort | awk \"NR % 100 == $SLURM_ARRAY_TASK_ID\" > list.$SLURM_ARRAY_TASK_ID": (
        "tests/test_docs.py"
    ),
}

without_make = pytest.mark.skipif(shutil.which("make") is None, reason="there is no make")


def test_every_command_is_run_by_something() -> None:
    shown = set()
    for page in PAGES:
        text = page.read_text()
        shown.update(re.findall(rf"^    ({PROGRAM}.*?)(?:  +#.*)?$", text, re.MULTILINE))
        shown.update(re.findall(rf"`({PROGRAM}[^`]+)`", text))
    assert {command.strip() for command in shown} == set(RUN_BY)
    for command, runs in RUN_BY.items():
        assert runs in globals() or (ROOT / runs).exists(), command


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """A copy of what `make` needs; the environment is that of the tests."""
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    for name in ("tools", "benchmarks"):
        (tmp_path / name).mkdir()
        for script in (ROOT / name).glob("*.py"):
            shutil.copy(script, tmp_path / name)
    (tmp_path / ".venv").symlink_to(SCRIPT.parent.parent)
    return tmp_path


def make(folder: Path, *words: str, works: bool = True, **changes: str) -> str:
    """What `make` says; the environment is there already."""
    told = [name for name in os.environ if name.startswith("MAKE") or name == "MFLAGS"]
    around = {name: value for name, value in environment(**changes).items() if name not in told}
    done = subprocess.run(
        ["make", "-o", ".venv/.installed", *words], cwd=folder, env=around, capture_output=True, text=True, check=False
    )
    assert (done.returncode == 0) == works, done.stdout + done.stderr
    return done.stdout


@without_make
def test_make_runs_the_tests(checkout: Path) -> None:
    """One small test in place of all; `make thorough` differs in a word that it hands over. What fails says why."""
    (checkout / "tests").mkdir()
    (checkout / "tests" / "test_one.py").write_text(
        "import os\n\n\ndef test_one():\n    assert os.environ['CORNERSMOOTH_THOROUGH'] == '1'\n"
    )
    plain = {"CORNERSMOOTH_THOROUGH": "", "PYTEST_ADDOPTS": "-p no:hypothesispytest -p no:warnings"}
    assert "1 passed" in make(checkout, "thorough", "WORKERS=1", **plain)
    assert "E       AssertionError: assert '' == '1'" in make(checkout, "test", "WORKERS=0", works=False, **plain)
    assert make(checkout, "-n", "thorough") == make(checkout, "-n", "test")


@without_make
def test_make_docs_writes_the_reference(checkout: Path) -> None:
    pytest.importorskip("pdoc")
    make(checkout, "docs")
    page = (checkout / "build" / "docs" / "cornersmooth.html").read_text()
    for name in ("postprocess", "Settings", "corner_table", "SmoothProgram"):
        assert f'id="{name}"' in page


@without_make
def test_make_bench_times_the_command(checkout: Path) -> None:
    words = shlex.split(make(checkout, "-n", "bench"))
    few = [*words, "--points", "100", "--runs", "1", "--case", "fanuc g1"]
    done = subprocess.run(few, cwd=checkout, env=environment(), capture_output=True, text=True, check=True)
    assert re.search(r"^fanuc g1( +-?[\d.,]+){9}$", done.stdout, re.MULTILINE)


@without_make
def test_make_bench_compares_checkouts(checkout: Path) -> None:
    words = shlex.split(make(checkout, "-n", "bench", f"BEFORE={ROOT}"))
    few = [*words, ROOT, "--points", "100", "--case", "fanuc g1"]
    done = subprocess.run(few, cwd=checkout, env=environment(), capture_output=True, text=True, check=True)
    assert re.search(r"^\| fanuc g1( \| [\d.,]+){10} \|$", done.stdout, re.MULTILINE)


@without_make
def test_make_controller_prints_its_table(
    checkout: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, script, folder = shlex.split(make(checkout, "-n", "controller", CORNERSMOOTH_CORPUS="FOLDER"))
    assert folder == "FOLDER"
    monkeypatch.syspath_prepend(ROOT / "tests" / "nc")
    table = load(ROOT / script)
    monkeypatch.setattr(table, "FIRST", 70)
    monkeypatch.setattr(table, "run_controller", lambda *_: ("done", table.np.zeros((0, 5)), None))
    monkeypatch.setattr(table, "execute", lambda *_: table.Executed("done", 1.0, 0.001, 0.001, 1.0))
    assert table.main([]) == 0
    assert "| impeller.cls | 0.04 | long lines: 1.00 of the fastest unsmoothed text |" in capsys.readouterr().out


def load(path: Path) -> ModuleType:
    """A script, without its `main`."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def test_extras_that_are_named_exist() -> None:
    pages = (*PAGES, *(ROOT / "src").rglob("*.py"))
    named = {extra for page in pages for extra in re.findall(r"'?cornersmooth\[(\w+)\]", page.read_text())}
    assert named
    assert named <= set(importlib.metadata.metadata("cornersmooth").get_all("Provides-Extra") or ())


def test_savings_are_printed_as_a_table(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    savings = load(ROOT / "tools" / "make_savings.py")
    (tmp_path / "small.cls").write_bytes(SMALL)
    monkeypatch.setattr(savings, "FILES", ("small.cls",))
    monkeypatch.setattr(savings, "SAMPLE", tmp_path / "small.cls")
    monkeypatch.setattr(savings, "TEXTS", tuple(share(savings.TEXTS, 4)))
    assert savings.main([str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2 + 3 + len(savings.TEXTS)
    assert lines[0] == "| | small.cls |"


def test_batch_runs_times_a_batch(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its first way alone; the cluster is that of test_cli_cluster.py, kills those of test_cli_batch.py."""
    runs = importlib.import_module("batch_runs")
    (tmp_path / "cl").mkdir()
    (tmp_path / "cl" / "one.cls").write_text(cl_text(20, 1))
    found = runs.run_whole(runs.Way("-j 1", ("-j", "1")), tmp_path, tmp_path / "out")
    assert list(found) == ["one.nc"]
    assert "1 file: 1 PASSED (1 to check)" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("nc.sweep", ("--only", "mitsubishi-g1-nutated", "--seeds", "1", "--chains", "1")),
        ("verify.sweep", ("--only", "fanuc-g1", "--seeds", "0", "1")),
        ("verify.hole_programs", ("0", "2")),
        ("nc.run_chains", ("0", "1", "--chains", "1")),
    ],
)
def test_sweeps_find_nothing(
    name: str, words: Sequence[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["sweep", *words])
    assert not importlib.import_module(name).main()
    assert re.search(r"'(judged|chains)': \d|(: |^)passed \d", capsys.readouterr().out)


def test_texts_are_as_before(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Another hash is found; of the golden texts of one control, as all take a minute."""
    texts, file = importlib.import_module("nc.all_texts"), tmp_path / "texts.json"
    monkeypatch.setattr(sys, "argv", ["all_texts", str(file), "--only", "haas"])
    few = list(texts.jobs())[:60]
    monkeypatch.setattr(texts, "jobs", lambda: few)
    assert [texts.main(), texts.main()] == [0, 0]
    before = json.loads(file.read_text())
    before[next(iter(before))][0] = "another"
    file.write_text(json.dumps(before))
    assert texts.main() == 1
    assert f"{len(before) - 1} of {len(before)} as before" in capsys.readouterr().out


def test_hole_mutations_are_scored(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    holes = importlib.import_module("verify.hole_mutations")
    found = list(holes.mutants(holes.RUNNABLE[0]))
    monkeypatch.setattr(holes, "RUNNABLE", holes.RUNNABLE[:1])
    monkeypatch.setattr(holes, "mutants", lambda case: found[:2])
    holes.main()
    assert "2 of 2 mutants right" in capsys.readouterr().out


@pytest.mark.skipif(shutil.which("npm") is None, reason="there is no npm")
def test_scripts_of_the_page_are_there() -> None:
    """Bundles come from the network, so they are not made here; that the page runs is shown by tests/page."""
    (line,) = (command for command in RUN_BY if command.startswith("cd web"))
    scripts = json.loads((ROOT / "web" / "package.json").read_text())["scripts"]
    assert set(re.findall(r"npm run (\w+)", line)) == set(scripts)
    listed = subprocess.run(["npm", "run"], cwd=ROOT / "web", capture_output=True, text=True, check=True).stdout
    assert all(script in listed for script in scripts)


@pytest.mark.skipif(shutil.which("parallel") is None, reason="GNU parallel is not installed: apt-get install parallel")
def test_parallel_does_all_files(tmp_path: Path) -> None:
    for name in ("cl/one.cls", "cl/deep/two.cls"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(SMALL)
    (block,) = re.findall(r"    cd /shared/job\n    find .*parallel.*\n.*\n", (ROOT / "docs" / "batch.md").read_text())
    # ":" is the machine itself, without ssh
    there = block.replace("/shared/job", shlex.quote(str(tmp_path))).replace("host1,host2", ":")
    around = environment(PATH=f"{SCRIPT.parent}{os.pathsep}{os.environ['PATH']}", HOME=str(tmp_path))
    subprocess.run(["bash", "-e", "-c", there], env=around, check=True, capture_output=True)
    made = sorted(str(path.relative_to(tmp_path)) for path in tmp_path.glob("nc/**/*.nc"))
    assert made == ["nc/cl/deep/two.nc", "nc/cl/one.nc"]
    assert len((tmp_path / "made.log").read_text().splitlines()) == 3
