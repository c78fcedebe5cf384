"""Pieces of the path as they are read, gathered in whole arrays: nothing is held twice."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import DTypeLike, NDArray

from cornersmooth.verify.motion import Piece
from cornersmooth.verify.ncprogram import Curves, NcArcs

#: a large array that is full grows by this part, a small one to twice its size
_GROWTH: Final = 0.125

#: arrays of so many bytes are asked for anew, smaller ones may be moved: numpy asks for large pages then
_LARGE: Final = 1 << 22


#: fields of path elements
_ELEMENTS: Final = ("kind", "tip", "second", "line", "feed", "per_revolution", "feed_room")


class _Column:
    """Array that rows are added to."""

    def __init__(self, dtype: DTypeLike, *width: int) -> None:
        self._rows: NDArray[Any] = np.empty((0, *width), dtype)
        self.size = 0

    def add(self, rows: NDArray[Any]) -> None:
        """Add rows at the end."""
        end = self.size + len(rows)
        if end > len(self._rows):
            self._grow(end + int(end * (_GROWTH if self._rows.nbytes >= _LARGE else 1)))
        self._rows[self.size : end] = rows
        self.size = end

    def _grow(self, count: int) -> None:
        shape = (count, *self._rows.shape[1:])
        if self._rows.nbytes >= _LARGE:
            self._rows.resize(shape, refcheck=False)  # where the system can it only gets more pages
            return
        grown = np.empty(shape, self._rows.dtype)
        grown[: self.size] = self._rows[: self.size]
        self._rows = grown

    @property
    def rows(self) -> NDArray[Any]:
        """The rows so far."""
        return self._rows[: self.size]

    def whole(self) -> NDArray[Any]:
        """All rows; nothing can be added any more."""
        rows = self._rows
        rows.resize((self.size, *rows.shape[1:]), refcheck=False)
        return rows


class Pile:
    """Path elements, curves and arcs of all pieces; in millimetres."""

    def __init__(self) -> None:
        self.kind, self.line = _Column(np.uint8), _Column(np.int64)
        self.tip, self.second = _Column(np.float64, 3), _Column(np.float64, 3)
        self.feed, self.per_revolution = _Column(np.float64), _Column(np.bool_)
        self.feed_room = _Column(np.float64)
        self.curve_element, self.curve_order, self.curve_points = (_Column(np.int64) for _ in range(3))
        self.control, self.weight, self.knot = _Column(np.float64, 6), _Column(np.float64), _Column(np.float64)
        self.arc_element, self.arc_sweep = _Column(np.int64), _Column(np.float64)
        self.arc_centre, self.arc_normal = _Column(np.float64, 3), _Column(np.float64, 3)

    def __len__(self) -> int:
        return self.kind.size

    @property
    def curves(self) -> int:
        """Curves so far."""
        return self.curve_element.size

    def add(self, piece: Piece) -> None:
        """Add a piece, in millimetres."""
        first = self.kind.size
        for name in (*_ELEMENTS, "arc_centre", "arc_normal", "arc_sweep"):
            values = getattr(piece, name)
            if len(values):
                getattr(self, name).add(values)
        curves = piece.curves
        if len(curves):
            self.curve_element.add(piece.curve_element + first)
            self.curve_order.add(curves.order)
            self.curve_points.add(curves.points)
            self.control.add(curves.control)
            self.weight.add(curves.weight)
            self.knot.add(curves.knot)
        self.arc_element.add(piece.arc_element + first)

    def whole(self) -> tuple[dict[str, Any], Curves, NcArcs]:
        """Put together path elements (as fields of `NcProgram`), curves and arcs."""
        elements = {name: getattr(self, name).whole() for name in _ELEMENTS}
        control, centre = self.control.whole(), self.arc_centre.whole()
        order, count = self.curve_order.whole(), self.curve_points.whole()
        curves = Curves(
            element=self.curve_element.whole(),
            order=order,
            points=count,
            first_point=np.cumsum(count) - count,
            first_knot=np.cumsum(count + order) - count - order,
            point=control,
            weight=self.weight.whole(),
            knot=self.knot.whole(),
        )
        arcs = NcArcs(self.arc_element.whole(), centre, self.arc_normal.whole(), self.arc_sweep.whole())
        return elements, curves, arcs
