"""Figures with matplotlib, which only the extra ``cornersmooth[plot]`` installs."""

from __future__ import annotations

from io import BytesIO
from typing import Any

from cornersmooth.errors import SettingsError
from cornersmooth.extras import install_hint


def new_figure(width: float, height: float) -> Any:
    """Make a figure; sizes in inches.

    Raises
    ------
    SettingsError
        CS262: matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError as missing:
        raise SettingsError("CS262", "pictures need matplotlib", install_hint("plot")) from missing
    return Figure(figsize=(width, height), layout="constrained")


def saved(figure: Any, form: str) -> bytes:
    """Figure as ``png``, ``svg`` or ``pdf``: same input, same bytes, so no date, and names of parts that stay."""
    import matplotlib as mpl

    stream = BytesIO()
    metadata: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(form, {})
    with mpl.rc_context({"svg.hashsalt": "cornersmooth"}):
        figure.savefig(stream, format=form, dpi=120, metadata=metadata)
    return stream.getvalue()
