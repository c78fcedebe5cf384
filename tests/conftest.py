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

settings.register_profile("share", max_examples=how_many(30, 100))
settings.load_profile("share")


@pytest.fixture(scope="session")
def corpus() -> Path:
    """Folder of real CL files; the test is skipped where CORNERSMOOTH_CORPUS does not name one."""
    folder = corpus_folder()
    if folder is None:
        pytest.skip(NO_CORPUS)
    return folder


#: files whose tests wait for processes, or are long. They come first, so that one worker waits while others work, and
#: none is left with a long one at the end
FIRST = (
    "test_browser.py",
    "test_nc_controller.py",
    "test_cli_cluster.py",
    "test_interruptions.py",
    "test_cli_files.py",
    "test_cli_batch.py",
    "test_docs_tools.py",
    "test_docs.py",
    "test_form_mutations.py",
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put some files first."""
    items.sort(key=lambda item: FIRST.index(item.path.name) if item.path.name in FIRST else len(FIRST))


def pytest_collection_finish() -> None:
    """Keep what was collected out of the garbage collection, and collect less often: a few per cent of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 20)
