"""Shared fixtures."""

from __future__ import annotations

from pathlib import Path

import pytest

from oracle.command import large, medium, small
from oracle.files import NO_CORPUS, corpus_folder

__all__ = ["corpus", "large", "medium", "small"]

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def corpus() -> Path:
    """Folder of real CL files; the test is skipped where CORNERSMOOTH_CORPUS does not name one."""
    folder = corpus_folder()
    if folder is None:
        pytest.skip(NO_CORPUS)
    return folder
