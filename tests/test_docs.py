"""What README, docs and helps show is run: examples, commands, tables."""

from __future__ import annotations

import ast
import importlib.util
import os
import re
import shlex
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import cornersmooth as cs
from cornersmooth import read
from cornersmooth.cli import times
from cornersmooth.cli.commands import COMMANDS
from cornersmooth.kinematics import parse_machine
from cornersmooth.nc import parse_control
from oracle.command import DONE, SCRIPT, SMALL, run
from oracle.files import beginning
from oracle.share import THOROUGH, share

ROOT = Path(__file__).resolve().parent.parent
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
#: pages whose examples belong together
STORIES = ("library.md", "gallery.md")


def load(name: str) -> ModuleType:
    """A script of the folder tools."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("name", STORIES)
def test_examples_run_and_print_what_the_page_says(name: str, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib").use("agg")
    text = (ROOT / "docs" / name).read_text()
    figures = r"\d+"
    if name == "gallery.md":  # pictures of less
        (tmp_path / "part.cls").write_bytes(beginning(ROOT / "samples" / "impeller.cls", 105))
    else:  # all but seconds, which are those of a solver
        figures = r"\d+\.\d s"
    assert re.sub(figures, "#", load("run_examples").run_page(text, tmp_path)) == re.sub(figures, "#", text)
    for picture in re.findall(r"!\[[^]]+\]\((gallery/[^)]+)\)", text):
        assert (tmp_path / picture).stat().st_size > 1000
        assert (ROOT / "docs" / picture).exists()


def test_comments_name_documents_that_are_here() -> None:
    for path in (*(ROOT / "src").rglob("*.py"), *(ROOT / "tests").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        named = {
            *re.findall(r"\bdocs/[a-z_]+\.md\b", text),
            *re.findall(r"\b(?:reference|shared)/[a-z_-]+\.md\b", text),
        }
        assert [name for name in named if not (ROOT / name).is_file()] == [], path
        assert not re.search(r"\b[Dd]esign (?:section )?\d", text), path


def commands(text: str) -> Iterator[str]:
    """Commands of cornersmooth in indented lines, without their remarks, and those between the words of a page."""
    for line in text.splitlines():
        words = line.strip().removeprefix("$ ")
        if line.startswith("    ") and re.match(r"(cat \S+ \| |eval \"\$\()?cornersmooth ", words):
            yield re.sub(r"^eval \"\$\((.*)\)\"", r"\1", re.sub(r"\s+#.*$", "", words))
    for inline in re.findall(r"`cornersmooth ([^`]+)`", text):
        if "[" in inline:  # what may be given, not a command
            continue
        bare = inline in COMMANDS and inline not in ("controls", "machines")
        yield f"cornersmooth {inline}{' --help' if bare else ''}"


def help_text(name: str) -> str:
    return "\n".join(f"  {line}" for line in run(name, "--help").stdout.decode().splitlines())


#: what test_docs_tools.py and test_cli_cluster.py run: lines of a script, batches on other machines
ELSEWHERE = ("$file", "{}", "SCHEDULER", "Out-String")
SHOWN = {page.name: list(commands(page.read_text())) for page in PAGES if page.name not in STORIES}
HELPS = {name: list(commands(help_text(name))) for name in COMMANDS}


#: commands that write and plan many programs
SLOW = ("compare", "setup")


def _once(shown: dict[str, list[str]], *earlier: dict[str, list[str]]) -> dict[str, list[str]]:
    """Without commands that were met before with another tolerance, or nothing else; all of them in a thorough run."""
    met = {part for one in earlier for lines in one.values() for line in lines for part in _parts(line)}
    left: dict[str, list[str]] = {}
    for name, lines in shown.items():
        left[name] = []
        for line in lines:
            if THOROUGH or not _parts(line) <= met:
                left[name].append(line)
            met |= _parts(line)
    return left


def _parts(line: str) -> set[str]:
    """What has to be met: each word of commands that plan many programs, else the whole line but its tolerance."""
    command, line = line.split()[1], re.sub(r" -e [\d.]+", "", line)
    return {f"{command} {word}" for word in re.sub(r"\d+", "#", line).split()} if command in SLOW else {line}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with all the files that the commands name."""
    folder = tmp_path_factory.mktemp("shop")
    for name in ("part.cls", "part.ncl", "jobs/part.cls", "cl/one.cls", "cl/deep/two.cls", "cl/d07/three.cls"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(SMALL.replace(b"UNITS/MM\n", b"UNITS/MM\nCUTTER/6,3\n"))
    (folder / "mine.toml").write_text('like = "siemens"\n')
    for name, options in {"nc": [], "mpf": ["--control", "siemens"]}.items():
        assert run("smooth", "part.cls", "-e", "0.005", "-o", f"part.{name}", *options, cwd=folder).returncode == DONE
    program = cs.read(folder / "part.cls")
    sharp = replace(program, keep=np.ones(len(program), np.uint8))  # as CAM systems write it, for `filter`
    form = cs.choose_form("linuxcnc", "g1", machine=cs.load_machine("xyzac-trt"))
    cs.postprocess(sharp, folder / "part.ngc", form=form)
    again = (*"filter part.ngc --control linuxcnc --machine xyzac-trt -o smooth.ngc".split(),)
    assert run(*again, cwd=folder).returncode == DONE
    return folder


@pytest.fixture
def shop(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A copy of the folder; there a comparison tries a fifth of all ways."""
    all_of = times.candidates
    monkeypatch.setattr(times, "candidates", lambda *given: share(all_of(*given), 5))
    return Path(shutil.copytree(made, tmp_path, dirs_exist_ok=True))


def execute(line: str, folder: Path) -> None:
    """Run a command in the folder; whatever stands at the place of an output may go."""
    if any(word in line for word in ELSEWHERE):
        return
    line = line.removesuffix(" | source")  # what fish does with it
    if set("|>;*$~") & set(line):
        around = {"PATH": f"{SCRIPT.parent}{os.pathsep}{os.environ['PATH']}", "HOME": str(folder)}
        subprocess.run(["bash", "-c", line], cwd=folder, env=os.environ | around, check=True, capture_output=True)
        return
    _, command, *words = shlex.split(line)
    with_force = (
        command in ("smooth", "filter", "verify", "time", "surface") and "--help" not in words and "-h" not in words
    )
    mill = 'like = "table-ac"\n'
    (folder / "mill.toml").write_text(mill)
    (folder / "mine.toml").write_text(mill if command == "machines" else 'like = "siemens"\n')
    fewer = {"setup": ["--plans", "1"], "surface": ["--stations", "100"]}
    if "--help" not in words and "-h" not in words and not THOROUGH:
        words += fewer.get(command, [])
    result = run(command, *words, *(["--force"] if with_force and "--force" not in words else []), cwd=folder)
    assert result.returncode == DONE, f"{line}: {result.stderr.decode()}"


RUN_OF_HELPS = _once(HELPS)
RUN_OF_PAGES = _once(SHOWN, HELPS)


@pytest.mark.parametrize("name", [name for name, lines in RUN_OF_PAGES.items() if lines])
def test_commands_of_pages_work(name: str, shop: Path) -> None:
    for line in RUN_OF_PAGES[name]:
        execute(line, shop)


@pytest.mark.parametrize("name", list(COMMANDS))
def test_examples_of_helps_work(name: str, shop: Path) -> None:
    assert HELPS[name]
    for line in RUN_OF_HELPS[name]:
        execute(line, shop)


def test_tables_of_pages_are_valid(tmp_path: Path) -> None:
    tables = [
        (page.name, text) for page in PAGES for text in re.findall(r"```toml\n(.*?)```", page.read_text(), re.DOTALL)
    ]
    assert len(tables) >= 3
    for name, text in tables:
        table = tomllib.loads(text)
        if name == "settings.md":
            (tmp_path / "cornersmooth.toml").write_text(text)
            assert run("config", tmp_path).returncode == DONE
        elif "dynamics" in table:
            parse_machine(f'like = "table-ac"\n{text}')
        else:
            parse_control(text)


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_the_job_of_an_array_does_its_share(shop: Path) -> None:
    (script,) = re.findall(r"    #!/bin/bash\n(?:    .*\n)+", (ROOT / "docs" / "batch.md").read_text())
    there = script.replace("/shared/job", str(shop))
    path = f"{SCRIPT.parent}{os.pathsep}{os.environ['PATH']}"
    environment = os.environ | {"PATH": path, "SLURM_ARRAY_TASK_ID": "2"}
    subprocess.run(["bash", "-e", "-c", there], env=environment, check=True, capture_output=True)
    assert [str(path.relative_to(shop)) for path in (shop / "nc").rglob("*.nc")] == ["nc/deep/two.nc"]


def test_the_figures_of_the_readme_are_those_that_come_out() -> None:
    """The sample alone, and a twentieth for what changes: `python tools/make_numbers.py FOLDER` makes all of it."""
    numbers, text = load("make_numbers"), (ROOT / "README.md").read_text()
    shown = {name: numbers.place(name).search(text)[0] for name in ("output", "lines", "numbers", "wrong")}
    output, lines, program = numbers.first_program()
    assert figures_left_out(shown["output"]) == figures_left_out(output)
    assert figures(output) == pytest.approx(figures(shown["output"]), rel=0.05)
    assert shown["lines"] == lines
    assert figures_left_out(shown["wrong"].partition("|---|---|\n")[2]) == figures_left_out(
        numbers.wrong_programs(program)
    )
    if THOROUGH:
        part = "impeller.cls"
        made = numbers.line_of(numbers.PARTS[part], *numbers.compared(ROOT / "samples" / part))
        (row,) = (line for line in shown["numbers"].split("\n") if numbers.PARTS[part] in line)
        assert figures(made) == pytest.approx(figures(row), rel=0.05)
        told = numbers.by_the_paper(ROOT / "samples" / part)
        assert figures(told) == pytest.approx(figures(numbers.PAPER.search(text)[0]), rel=0.05)
        told = numbers.on_linuxcnc(ROOT / "samples" / part)
        assert figures(told) == pytest.approx(figures(numbers.place("linuxcnc").search(text)[0]), rel=0.05)


def figures(text: str) -> list[float]:
    return [float(figure) for figure in re.findall(r"[\d.]*\d", text.replace(",", ""))]


def figures_left_out(text: str) -> str:
    return re.sub(r"\d+", "#", text)


def test_the_readme_is_short_and_its_pictures_are_light() -> None:
    text = (ROOT / "README.md").read_text()
    assert len(text.split("\n")) <= 131
    pictures = re.findall(r"!\[[^]]+\]\(([^)]+)\)", text)
    assert len(pictures) == 2
    assert sum((ROOT / name).stat().st_size for name in pictures) < 300_000


def test_the_picture_of_speeds_is_drawn_from_a_part() -> None:
    numbers = load("make_numbers")
    program = numbers.some_poses(read(ROOT / "samples" / "impeller.cls").with_feed(numbers.FEED), 4, 30)
    before, after = numbers.speeds(program)
    assert after[0][-1] < before[0][-1]
    assert numbers.draw(before, after).count("<polyline") == 2


def parts_of(source: Path) -> set[str]:
    """Packages and modules at the top."""
    found = {path.stem for path in source.iterdir() if path.is_dir() or path.suffix == ".py"}
    return {name for name in found if not name.startswith("_")}


def test_the_page_of_the_architecture_names_what_is_there() -> None:
    source, text = ROOT / "src" / "cornersmooth", (ROOT / "docs" / "architecture.md").read_text()
    layers, _, places = text[text.index("## Layers") :].partition("## Where would I add")
    told = set(re.findall(r"^\| \d+ \| `(\w+)`", layers, re.MULTILINE))
    assert told == parts_of(source)
    walk = text[text.index("## One corner") : text.index("## Layers")]
    named = set(re.findall(r"`([\w/.]*(?:/|\.py|\.md|\.toml|\.cls))`", walk + places.replace("NAME", "fanuc")))
    assert len(named) > 40
    trees = (source, ROOT / "tests")
    folders = (ROOT, ROOT / "docs", *trees, *(path for tree in trees for path in tree.rglob("*") if path.is_dir()))
    unknown = {name for name in named if not any((folder / name).exists() for folder in folders)}
    # `fanuc` stands for any name: it has tables of a control, and none of a machine
    assert unknown == {"kinematics/machines/fanuc.toml"}


def test_dependencies_point_the_way_that_the_page_says() -> None:
    source, text = ROOT / "src" / "cornersmooth", (ROOT / "docs" / "architecture.md").read_text()
    level = {name: int(layer) for layer, name in re.findall(r"^\| (\d+) \| `(\w+)`", text, re.MULTILINE)}
    assert len(set(level.values())) == len(level)
    assert len(text.split()) <= 1500
    assert parts_of(source) == set(level)
    back = set()
    for path in source.rglob("*.py"):
        package = path.relative_to(source).with_suffix("").parts[0]
        if package in level:
            back |= {(path.name, one) for one in imported(path) if one != package and level[one] >= level[package]}
    assert back == set()


def imported(path: Path) -> Iterator[str]:
    """Packages and modules of cornersmooth that a file imports, but for what only types need."""
    tree = ast.parse(path.read_text())
    for_types = [node for node in tree.body if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)]
    left_out = {id(inside) for node in for_types for inside in ast.walk(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and id(node) not in left_out:
            first, *below = node.module.split(".")
            names = below[:1] or [alias.name for alias in node.names]
            yield from (name for name in names if first == "cornersmooth" and not name.startswith("_"))


def test_what_the_declarations_of_options_make_is_here() -> None:
    maker = load("make_options")
    assert maker.PAGE.read_text(encoding="utf-8") == maker.page(), "run: python tools/make_options.py"
    assert maker.SCHEMA.read_text(encoding="utf-8") == maker.schema(), "run: python tools/make_options.py"


def test_every_flag_that_a_help_or_a_page_names_exists() -> None:
    known = {flag for command in COMMANDS.values() for param in command.params for flag in param.opts}
    known |= {"--help", "--help-all", "--version"}
    texts = {name: run(name, "--help-all").stdout.decode() for name in COMMANDS}
    texts |= {page.name: page.read_text() for page in (ROOT / "docs").glob("*.md")}
    #: of other programs
    others = {"--cpus-per-task", "--array", "--time", "--joblog", "--resume-failed", "--sshlogin", "--workdir"}
    others |= {"--scheduler-file", "--nthreads", "--nworkers", "--cuts"}
    named = {(name, flag) for name, text in texts.items() for flag in re.findall(r"(?<![\w-])--[a-z][a-z-]+\b", text)}
    settings = {param.opts[-1] for param in COMMANDS["smooth"].params if type(param).__name__ == "_Setting"}
    smooth_alone = settings - {"--centripetal"}
    assert len(named) > 300
    assert {one for one in named if one[1] not in known | others or one[1] in smooth_alone - others} == set()


def test_links_lead_somewhere() -> None:
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", page.read_text()):
            assert (page.parent / target).exists(), f"{page.name}: {target}"
