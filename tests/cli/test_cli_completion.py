"""Completion in a real bash, and the manual page."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from oracle.command import DONE, SCRIPT, run

#: asks the function that bash calls, and prints what it answers
ASK = """
eval "$(cornersmooth completion bash)"
COMP_WORDS=({words}) COMP_CWORD={last}
eval "$(complete -p cornersmooth | sed 's/.*-F \\([^ ]*\\) .*/ask() {{ \\1 cornersmooth; }}/')"
compopt() {{ echo compopt "$@"; }}
ask
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


def complete(*words: str, folder: Path) -> list[str]:
    """What bash offers for the last of the words."""
    script = ASK.format(words=" ".join(f"'{word}'" for word in ("cornersmooth", *words)), last=len(words))
    path = f"{SCRIPT.parent}{os.pathsep}{os.environ['PATH']}"
    asked = subprocess.run(
        ["bash", "--norc", "-c", script],
        capture_output=True,
        cwd=folder,
        env=os.environ | {"PATH": path},
        text=True,
        check=True,
    )
    assert asked.stderr == ""
    return asked.stdout.split("\n")[:-1]


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes(tmp_path: Path) -> None:
    (tmp_path / "cornersmooth.toml").write_text(
        "[controls.shop]\nlike = 'heidenhain'\n[machines.mill]\nlike = 'table-ac'\n"
    )
    part = tmp_path / "part.cls"
    part.write_text("")
    answers = {
        ("smooth", "--work"): ["--work-offset"],
        ("smooth", "part.cls", "--control", "s"): ["shop", "siemens", "sinumerik", "sinumerik-one"],
        ("smooth", "part.cls", "--machine", "m"): ["mill"],
        ("smooth", "part.cls", "--control", "shop", "-f", "s"): ["spl"],
    }
    assert {words: complete(*words, folder=tmp_path) for words in answers} == answers


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_is_left_to_complete_files(tmp_path: Path) -> None:
    for words in (("smooth", "pa"), ("smooth", "part.cls", "--control", "./my")):
        assert complete(*words, folder=tmp_path) == ["compopt -o default", ""]


def answers(folder: Path, line: str, word: str) -> list[str]:
    """What the script of PowerShell gets for a line whose last word is completed; an empty word is no variable."""
    asked = {"_CORNERSMOOTH_COMPLETE": "powershell_complete", "COMP_WORDS": line} | (
        {"COMP_CWORD": word} if word else {}
    )
    done = subprocess.run([SCRIPT], capture_output=True, cwd=folder, env=os.environ | asked, text=True, check=False)
    assert done.stderr == ""
    return [row.split("\t")[0] for row in done.stdout.split("\n") if row]


def test_powershell_completes(tmp_path: Path) -> None:
    assert answers(tmp_path, "cornersmooth smooth --work", "--work") == ["--work-offset"]
    line = "cornersmooth smooth 'C:\\my parts\\part.cls' --control siemens -f "
    assert answers(tmp_path, line, "") == ["bspline", "g1", "poly"]
    assert answers(tmp_path, 'cornersmooth smooth "C:\\a b.cls" --control si', "si")[0] == "siemens"
    assert answers(tmp_path, "cornersmooth smooth pa", "pa") == []  # PowerShell completes files then
    script = run("completion", "powershell").stdout.decode()
    assert script.startswith("Register-ArgumentCompleter -Native -CommandName cornersmooth")
    assert script.count("{") == script.count("}") == 4
    assert "%" not in script


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_every_shell_has_a_script(shell: str) -> None:
    result = run("completion", shell)
    assert result.returncode == DONE
    assert f"_CORNERSMOOTH_COMPLETE={shell}_complete" in result.stdout.decode()
