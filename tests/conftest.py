"""Shared fixtures."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from oracle.command import large, small

__all__ = ["corpus", "large", "small"]

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def corpus() -> Path:
    """Folder of real CL files; the test is skipped where CORNERSMOOTH_CORPUS does not name one."""
    folder = os.environ.get("CORNERSMOOTH_CORPUS", "")
    if not folder or not Path(folder).is_dir():
        pytest.skip("CORNERSMOOTH_CORPUS does not name a folder of CL files")
    return Path(folder)
