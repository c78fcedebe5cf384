"""Shared fixtures."""

from __future__ import annotations

import gc
from pathlib import Path

import pytest
from hypothesis import settings

from oracle.command import large, medium, small
from oracle.files import NO_CORPUS, corpus_folder
from oracle.share import how_many

__all__ = ["corpus", "large", "medium", "small"]

ROOT = Path(__file__).resolve().parent.parent

settings.register_profile("share", max_examples=how_many(50, 100))
settings.load_profile("share")


@pytest.fixture(scope="session")
def corpus() -> Path:
    """Folder of real CL files; the test is skipped where CORNERSMOOTH_CORPUS does not name one."""
    folder = corpus_folder()
    if folder is None:
        pytest.skip(NO_CORPUS)
    return folder


def pytest_collection_finish() -> None:
    """Keep what was collected out of the garbage collection, and collect less often: a few per cent of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)
