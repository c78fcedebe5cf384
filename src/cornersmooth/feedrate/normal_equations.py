"""The normal equations of an interior-point step: five diagonals for many speed profiles at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.feedrate.speed_problem import Batch, ahead, behind, weight_of_z
from cornersmooth.lapack import dpbtrf, dpbtrs
from cornersmooth.model import Floats

#: what is added to the main diagonal of the normal equations, relative to it, where they cannot be solved without
_RIDGES = (0.0, 1e-12, 1e-9, 1e-6, 1e-3)

#: stiffness of what ties coefficients, over that of the limits
_STIFF = 1e8


@dataclass(frozen=True)
class Equations:
    """The normal equations of the barrier problem for the change of the coefficients."""

    batch: Batch
    by_z: tuple[Floats, ...]  #: of each row the derivative of left minus right side by z
    downhill: Floats  #: (n,): derivative of the time by the coefficients
    factors: Floats | None  #: (3, n): Of the matrix; None where it has no positive pivots, even stiffened.

    @classmethod
    def of(cls, batch: Batch, c: Floats, stiffness: Floats, bites: list[Floats]) -> Equations:
        """Gather the stiffness (rows, n) of all limits."""
        n = len(c)
        # stiffness of z and z′ at the nodes and coefficients by `Row.at`, and of z″/2
        zz, zs, ss, bb = np.zeros((4, n)), np.zeros((2, n)), np.zeros((2, n)), np.zeros(n)
        zb, sb = np.zeros((4, n)), np.zeros((2, n))
        weights = tuple(weight_of_z(row, bites) for row in batch.rows)
        for row, by_z, w in zip(batch.rows, weights, stiffness, strict=True):
            wz = w * by_z
            zz[row.at] += wz * by_z
            if row.slope is not None:
                ws = w * row.slope
                ss[row.at] += ws * row.slope
                if row.level is not None or row.right is None:
                    zs[row.at] += wz * row.slope
                if row.bend is not None:
                    sb[row.at] += ws * row.bend
            if row.bend is not None:
                bb += w * row.bend**2
                zb[row.at] += wz * row.bend
        near, far, s = batch.near, batch.far, batch.slope
        r0, r1, r2 = batch.bend
        w_z, w_zs, w_s = (at[0] + behind(at[1]) for at in (zz, zs, ss))
        w_zs, w_s = s * w_zs, s * s * w_s
        # z″/2 times z and z′ at both nodes and times the middle coefficient, over the cell's three coefficients
        k0 = zb[0] * near - sb[0] * s
        k1 = zb[0] * far + sb[0] * s + zb[1] * ahead(near) - sb[1] * ahead(s) + zb[3]
        k2 = zb[1] * ahead(far) + sb[1] * ahead(s)
        bands = np.zeros((3, n))
        diagonal, beside, beyond = bands[2], bands[1], bands[0]
        diagonal += 0.75 * batch.weight * c**-2.5 + zz[2]
        diagonal += w_z * near**2 - 2.0 * w_zs * near + w_s + r0 * (bb * r0 + 2.0 * k0)
        diagonal += behind(w_z * far**2 + 2.0 * w_zs * far + w_s + r1 * (bb * r1 + 2.0 * k1) + zz[3])
        diagonal += behind(behind(r2 * (bb * r2 + 2.0 * k2)))
        beside += behind(w_z * near * far + w_zs * (near - far) - w_s + bb * r0 * r1 + r0 * k1 + r1 * k0)
        beside += behind(behind(bb * r1 * r2 + r1 * k2 + r2 * k1))
        beyond += behind(behind(bb * r0 * r2 + r0 * k2 + r2 * k0))
        _tie(batch, bands)
        return cls(batch, weights, -0.5 * batch.weight * c**-1.5, _factors(bands))

    def step(self, pressure: Floats) -> Floats:
        """Change of the coefficients (n,) under the forces (rows, n) of the limits."""
        batch, n = self.batch, len(self.downhill)
        on_z, on_slope, on_bend = np.zeros((4, n)), np.zeros((2, n)), np.zeros(n)
        for row, by_z, force in zip(batch.rows, self.by_z, pressure, strict=True):
            on_z[row.at] += force * by_z
            if row.slope is not None:
                on_slope[row.at] += force * row.slope
            if row.bend is not None:
                on_bend += force * row.bend
        near, far, s = batch.near, batch.far, batch.slope
        r0, r1, r2 = batch.bend
        node_z, node_s = on_z[0] + behind(on_z[1]), s * (on_slope[0] + behind(on_slope[1]))
        gradient = on_z[2] + self.downhill + near * node_z - node_s + r0 * on_bend
        gradient += behind(far * node_z + node_s + r1 * on_bend + on_z[3]) + behind(behind(r2 * on_bend))
        step = np.zeros(n) if self.factors is None else np.asarray(dpbtrs(self.factors, -gradient)[0], np.float64)
        if not np.isfinite(step).all():
            step = np.zeros(n)
        step[batch.frozen] = 0.0
        batch.follow(step)
        return step


def _factors(bands: Floats) -> Floats | None:
    """Factors of the matrix; where rounding leaves no positive pivot it is stiffened.

    A stiffened step is shorter or points a little aside: it costs rounds, never a limit.
    """
    for ridge in _RIDGES:
        matrix = np.array(bands, order="F")
        matrix[-1] *= 1.0 + ridge
        factors, info = dpbtrf(matrix, overwrite_ab=1)
        if info == 0 and np.isfinite(factors).all():
            return np.asarray(factors)
    return None


def _tie(batch: Batch, bands: Floats) -> None:
    """Tie coefficients next to a rest to their neighbours, and those that stay to their values, by stiff springs."""
    _, beside, diagonal = bands
    for end, ratio, inward in ((batch.first, batch.first_ratio, 1), (batch.last, batch.last_ratio, -1)):
        at, part = end[~np.isnan(ratio)], ratio[~np.isnan(ratio)]
        to = at + inward
        spring = _STIFF * (diagonal[at] + diagonal[to])
        diagonal[at] += spring
        diagonal[to] += part**2 * spring
        beside[np.maximum(at, to)] -= part * spring
    diagonal[batch.frozen] *= _STIFF
