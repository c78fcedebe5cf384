"""Completion in a real bash."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from oracle.command import SCRIPT

#: asks the function that bash calls, and prints what it answers
ASK = """
eval "$(_CORNERSMOOTH_COMPLETE=bash_source cornersmooth)"
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
    part = tmp_path / "part.cls"
    part.write_text("")
    answers = {
        ("smooth", "--work"): ["--work-offset"],
        ("smooth", "part.cls", "--control", "s"): ["siemens"],
        ("smooth", "part.cls", "--machine", "table-a"): ["table-ac"],
    }
    assert {words: complete(*words, folder=tmp_path) for words in answers} == answers


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_is_left_to_complete_files(tmp_path: Path) -> None:
    for words in (("smooth", "pa"), ("smooth", "part.cls", "--control", "./my")):
        assert complete(*words, folder=tmp_path) == ["compopt -o default", ""]
