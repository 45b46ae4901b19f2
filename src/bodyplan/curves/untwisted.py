"""The same points with a frame that does not roll: what joints that only bend can follow."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite
from bodyplan.curves.base import BodyCurve, Shape
from bodyplan.errors import InputError

#: rad: how far the roll over a period may be from whole turns
WHOLE_TURNS = 1e-12


class Untwisted(BodyCurve):
    """The points of ``curve`` with tau = 0; the frames agree at s = 0.

    With psi(s) = integral of tau from 0 to s: kappa_y cos psi + kappa_p sin psi becomes kappa_y, and
    kappa_p cos psi - kappa_y sin psi becomes kappa_p. A constant shape (T, 0, k) becomes eq. (5).
    Raises InputError where ``curve`` is no curve.
    """

    kind: ClassVar[str] = "untwisted"

    def __init__(self, curve: BodyCurve) -> None:
        if not isinstance(curve, BodyCurve):
            raise InputError(f"curve: expected a curve, got {curve!r}.")
        self.curve = curve
        self.length = curve.length

    def to_dict(self) -> dict[str, Any]:
        """The curve as a table, with ``kind``."""
        return {"kind": self.kind, "curve": self.curve.to_dict()}

    @property
    def start(self) -> Array:
        """See :attr:`BodyCurve.start`."""
        return self.curve.start

    @property
    def extent(self) -> tuple[float, float]:
        """See :attr:`BodyCurve.extent`."""
        return self.curve.extent

    @property
    def breaks(self) -> Array:
        """See :attr:`BodyCurve.breaks`."""
        return self.curve.breaks

    @property
    def period(self) -> float | None:
        """That of ``curve`` where the roll over it is a number of whole turns; else None.

        A constant shape with tau repeats after 2 pi / tau.
        """
        period = self.curve.period
        if period is None or not self.curve.twisted:
            return period
        if period == 0.0:
            tau, kappa_p, kappa_y = self.curve.shape(0.0)
            return 2.0 * np.pi / abs(float(tau)) if kappa_p or kappa_y else 0.0
        turns = self._roll(np.asarray(period)) / (2.0 * np.pi)
        return period if abs(turns - np.round(turns)) <= WHOLE_TURNS * max(1.0, abs(float(turns))) else None

    def shape(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.shape`."""
        at = finite(s, "s")
        _, kappa_p, kappa_y = self.curve.shape(at)
        return self._turned(self._roll(at), kappa_p, kappa_y)

    def slope(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.slope`."""
        at = finite(s, "s")
        tau, kappa_p, kappa_y = self.curve.shape(at)
        _, slope_p, slope_y = self.curve.slope(at)
        return self._turned(self._roll(at), slope_p - tau * kappa_y, slope_y + tau * kappa_p)

    def frames(self, s: ArrayLike, start: ArrayLike | None = None, *, tolerance: float = 1e-10) -> tuple[Array, Array]:
        """Those of ``curve``, rolled back by psi."""
        at = finite(s, "s", (None,))
        points, rotations = self.curve.frames(at, start, tolerance=tolerance)
        roll = self._roll(at)
        c, n = np.cos(roll)[:, None], np.sin(roll)[:, None]
        e_p, e_y = rotations[:, :, 1], rotations[:, :, 2]
        return points, np.stack([rotations[:, :, 0], c * e_p - n * e_y, c * e_y + n * e_p], axis=-1)

    def untwisted(self) -> BodyCurve:
        """Itself."""
        return self

    def _roll(self, s: Array) -> Array:
        return self.curve.integral(0.0, s).tau

    def _turned(self, roll: Array, kappa_p: Array, kappa_y: Array) -> Shape:
        c, n = np.cos(roll), np.sin(roll)
        bends = (np.asarray(kappa_p * c - kappa_y * n), np.asarray(kappa_y * c + kappa_p * n))
        return Shape(np.zeros(np.shape(roll)), *bends)
