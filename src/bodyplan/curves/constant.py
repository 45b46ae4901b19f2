"""Constant shape functions: a line, an arc or a helix; what one adds to another curve to turn or twist it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, number
from bodyplan.curves.base import BodyCurve, Shape
from bodyplan.curves.quadrature import interval
from bodyplan.curves.screws import turning_bend_poses


class Constant(BodyCurve):
    """``tau``, ``kappa_p``, ``kappa_y`` rad/m everywhere; ``length`` m. Raises InputError for a length <= 0."""

    kind: ClassVar[str] = "constant"
    UNITS: ClassVar[Mapping[str, str]] = {
        "tau": "curvature",
        "kappa_p": "curvature",
        "kappa_y": "curvature",
        "length": "length",
    }

    def __init__(self, tau: float = 0.0, kappa_p: float = 0.0, kappa_y: float = 0.0, length: float = 1.0) -> None:
        self.tau = number(tau, "tau")
        self.kappa_p, self.kappa_y = number(kappa_p, "kappa_p"), number(kappa_y, "kappa_y")
        self.length = number(length, "length", above=0.0)

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        return {"kind": self.kind, **{name: getattr(self, name) for name in self.UNITS}}

    @property
    def period(self) -> float:
        """0: constant."""
        return 0.0

    @property
    def twisted(self) -> bool:
        """See :attr:`BodyCurve.twisted`."""
        return self.tau != 0.0

    def shape(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.shape`."""
        at = finite(s, "s").shape
        return Shape(np.full(at, self.tau), np.full(at, self.kappa_p), np.full(at, self.kappa_y))

    def slope(self, s: ArrayLike) -> Shape:
        """0, see :meth:`BodyCurve.slope`."""
        at = finite(s, "s").shape
        return Shape(np.zeros(at), np.zeros(at), np.zeros(at))

    def integral(self, a: ArrayLike, b: ArrayLike) -> Shape:
        """Exact."""
        first, last = interval(a, b)
        length = np.asarray(last - first)
        return Shape(self.tau * length, self.kappa_p * length, self.kappa_y * length)

    def _poses(self, s: Array) -> Array:
        return turning_bend_poses(self.tau, self.kappa_p, self.kappa_y, 0.0, s)
