"""The serpenoid curve: curvature is a sine of arc length (paper *acm*, eq. (4))."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import finite, number
from bodyplan.curves.base import BodyCurve, Shape
from bodyplan.curves.quadrature import interval
from bodyplan.errors import UnknownNameError

PLANES = ("yaw", "pitch")


class Serpenoid(BodyCurve):
    """``kappa = (2 pi alpha / wavelength) sin(2 pi s / wavelength + phase)``: the shape of serpentine movement.

    ``alpha`` rad: the heading swings by 2 alpha, from 0 to 2 alpha where ``phase`` is 0. ``wavelength`` m (default:
    ``length``); ``length`` m of the body; ``phase`` rad; ``plane`` "yaw" (kappa_y, eq. (4)) or "pitch" (kappa_p).

    Raises InputError for lengths that are not > 0, UnknownNameError for another plane.
    """

    kind: ClassVar[str] = "serpenoid"
    UNITS: ClassVar[Mapping[str, str]] = {
        "alpha": "angle",
        "wavelength": "length",
        "length": "length",
        "phase": "angle",
    }

    def __init__(
        self,
        alpha: float,
        wavelength: float | None = None,
        length: float = 1.0,
        *,
        phase: float = 0.0,
        plane: str = "yaw",
    ) -> None:
        self.alpha = number(alpha, "alpha")
        self.length = number(length, "length", above=0.0)
        self.wavelength = self.length if wavelength is None else number(wavelength, "wavelength", above=0.0)
        self.phase = number(phase, "phase")
        if plane not in PLANES:
            raise UnknownNameError("plane", plane, PLANES)
        self.plane = plane

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        names = ("alpha", "wavelength", "length", "phase", "plane")
        return {"kind": self.kind, **{name: getattr(self, name) for name in names}}

    @property
    def period(self) -> float:
        """The wavelength, m."""
        return self.wavelength

    def shape(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.shape`."""
        k = 2.0 * np.pi / self.wavelength
        return self._bends(self.alpha * k * np.sin(k * finite(s, "s") + self.phase))

    def slope(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.slope`."""
        k = 2.0 * np.pi / self.wavelength
        return self._bends(self.alpha * k * k * np.cos(k * finite(s, "s") + self.phase))

    def integral(self, a: ArrayLike, b: ArrayLike) -> Shape:
        """Exact: ``alpha (cos(k a + phase) - cos(k b + phase))``, written as a product so that nothing cancels."""
        k = 2.0 * np.pi / self.wavelength
        first, last = interval(a, b)
        middle, half = 0.5 * k * (first + last) + self.phase, 0.5 * k * (last - first)
        return self._bends(2.0 * self.alpha * np.sin(middle) * np.sin(half))

    def _bends(self, values: Any) -> Shape:
        bends, none = np.asarray(values), np.zeros_like(np.asarray(values))
        return Shape(none, none, bends) if self.plane == "yaw" else Shape(none, bends, none)
