"""The spiral of paper *acm*, eq. (5): a helix in a frame that does not roll."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, number
from bodyplan.curves.base import BodyCurve, Shape
from bodyplan.curves.quadrature import interval
from bodyplan.curves.screws import turning_bend_integrals, turning_bend_poses, turning_bends


class Spiral(BodyCurve):
    """``kappa_p = -k sin(t s + phase)``, ``kappa_y = k cos(t s + phase)``, eq. (5): a helix of curvature k, torsion t.

    ``curvature`` k rad/m (default: the paper's 12 / length), ``twist`` t rad/m (default: 3.6 / length), right-handed
    where positive; ``length`` m of the body; ``phase`` rad: direction of the bend at s = 0, 0 to the left (yaw).
    Raises InputError for a length <= 0.
    """

    kind: ClassVar[str] = "spiral"
    UNITS: ClassVar[Mapping[str, str]] = {
        "curvature": "curvature",
        "twist": "curvature",
        "length": "length",
        "phase": "angle",
    }

    def __init__(
        self,
        curvature: float | None = None,
        twist: float | None = None,
        length: float = 1.0,
        *,
        phase: float = 0.0,
    ) -> None:
        self.length = number(length, "length", above=0.0)
        self.curvature = 12.0 / self.length if curvature is None else number(curvature, "curvature")
        self.twist = 3.6 / self.length if twist is None else number(twist, "twist")
        self.phase = number(phase, "phase")
        self._kappa_p, self._kappa_y = -self.curvature * np.sin(self.phase), self.curvature * np.cos(self.phase)

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        return {"kind": self.kind, **{name: getattr(self, name) for name in self.UNITS}}

    @property
    def period(self) -> float:
        """Length m over which the bend turns once: 2 pi / twist; 0 for an arc or a line."""
        return 2.0 * np.pi / abs(self.twist) if self.twist and self.curvature else 0.0

    def shape(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.shape`."""
        at = finite(s, "s")
        return Shape(np.zeros(at.shape), *turning_bends(self._kappa_p, self._kappa_y, self.twist, at))

    def slope(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.slope`."""
        none, kappa_p, kappa_y = self.shape(s)
        return Shape(none, -self.twist * kappa_y, self.twist * kappa_p)

    def integral(self, a: ArrayLike, b: ArrayLike) -> Shape:
        """Exact, also where twist is 0."""
        bends = turning_bend_integrals(self._kappa_p, self._kappa_y, self.twist, *interval(a, b))
        return Shape(np.zeros(np.shape(bends[0])), *map(np.asarray, bends))

    def _poses(self, s: Array) -> Array:
        return turning_bend_poses(0.0, self._kappa_p, self._kappa_y, self.twist, s)
