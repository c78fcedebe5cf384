"""CL files to try everything on: the project's own, and real ones where CORNERSMOOTH_CORPUS names a folder of them.

The own files, in ``tests/cl/own``, were written for these tests in the manner of each CAM system.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import pytest

from oracle.share import THOROUGH

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
OWN = Path(__file__).resolve().parents[1] / "cl" / "own"
NO_CORPUS = "CORNERSMOOTH_CORPUS does not name a folder of CL files"


def corpus_folder() -> Path | None:
    """Folder of real CL files, if there is one."""
    folder = os.environ.get("CORNERSMOOTH_CORPUS", "")
    return Path(folder) if folder and Path(folder).is_dir() else None


def of_corpus(rows: Iterable[tuple[object, ...]]) -> list[object]:
    """Parameters of tests on real files; one that is skipped stands for all where there is no corpus."""
    rows = list(rows)
    marks = [pytest.mark.corpus]
    if corpus_folder() is None:
        return [pytest.param(*rows[0], marks=[*marks, pytest.mark.skip(reason=NO_CORPUS)], id="corpus")]
    return [pytest.param(*row, marks=marks) for row in rows]


def beginning(path: Path, poses: int) -> bytes:
    """A CL file up to so many of its poses: whole lines."""
    lines = path.read_bytes().splitlines(keepends=True)
    goto = [number for number, line in enumerate(lines) if line.startswith(b"GOTO")]
    return b"".join([*lines[: goto[poses - 1] + 1], lines[-1]])


def sample(name: str) -> bytes:
    """A sample; of the blade, passes of one kind one beside the other, the first third unless all is asked for."""
    path = SAMPLES / name
    return beginning(path, 205) if name == "impeller.cls" and not THOROUGH else path.read_bytes()


def cl_file(name: str) -> Path:
    """Path of an own file or of a real one."""
    own = OWN / name
    folder = corpus_folder()
    if own.exists() or folder is None:
        return own
    return folder / name
