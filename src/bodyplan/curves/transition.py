"""From one curve to another along s, so that a body that follows it changes from the head on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, frozen, number
from bodyplan.curves.base import BodyCurve, Shape
from bodyplan.curves.quadrature import interval, shape_integral
from bodyplan.errors import InputError


def blend(u: Array) -> Array:
    """The quintic smoothstep: 0 up to u = 0, 1 from u = 1 on, first and second derivative continuous."""
    x = np.clip(u, 0.0, 1.0)
    # from the nearer end: terms of the polynomial cancel near the other
    y = np.minimum(x, 1.0 - x)
    near = y * y * y * (10.0 + y * (6.0 * y - 15.0))
    return np.asarray(np.where(x <= 0.5, near, 1.0 - near))


def blend_slope(u: Array) -> Array:
    """Derivative of :func:`blend`."""
    x = np.clip(u, 0.0, 1.0)
    return np.asarray(30.0 * (x * (1.0 - x)) ** 2)


def blend_integral(a: Array, b: Array) -> Array:
    """Integral of :func:`blend` from a to b; what lies beyond u = 1 is a difference of its own and loses nothing."""
    x, y = np.clip(a, 0.0, 1.0), np.clip(b, 0.0, 1.0)
    ramp = y**4 * (2.5 + y * (y - 3.0)) - x**4 * (2.5 + x * (x - 3.0))
    return np.asarray(ramp + (np.maximum(b, 1.0) - np.maximum(a, 1.0)))


class Transition(BodyCurve):
    """``before`` up to ``at`` m, ``after`` from ``at + width`` m on; between them (1 - b) before + b after.

    b is the quintic smoothstep, so that neither the shape functions nor their first and second slopes jump. Both
    curves are taken at the same s; ``length`` and ``start`` are those of ``before``. Raises InputError where one is
    no curve, or for a width <= 0.
    """

    kind: ClassVar[str] = "transition"
    UNITS: ClassVar[Mapping[str, str]] = {"at": "length", "width": "length"}

    def __init__(self, before: BodyCurve, after: BodyCurve, at: float, width: float) -> None:
        for field, curve in (("before", before), ("after", after)):
            if not isinstance(curve, BodyCurve):
                raise InputError(f"{field}: expected a curve, got {curve!r}.")
        self.before, self.after = before, after
        self.at, self.width = number(at, "at"), number(width, "width", above=0.0)
        self.end = self.at + self.width
        if self.end == self.at:
            raise InputError(f"width: too small to be told apart at {self.at} m, got {width!r}.")
        self.length = before.length
        first, last = before.breaks, after.breaks
        inner = np.concatenate([first[first < self.end], last[last > self.at]])
        self._breaks = frozen(np.unique(np.append(inner, (self.at, self.end))))

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        curves = {"before": self.before.to_dict(), "after": self.after.to_dict()}
        return {"kind": self.kind, **curves, "at": self.at, "width": self.width}

    @property
    def start(self) -> Array:
        """See :attr:`BodyCurve.start`."""
        return self.before.start

    @property
    def extent(self) -> tuple[float, float]:
        """See :attr:`BodyCurve.extent`."""
        return self.before.extent[0], self.after.extent[1]

    @property
    def breaks(self) -> Array:
        """See :attr:`BodyCurve.breaks`; both ends of the transition, where the third slope jumps."""
        return self._breaks

    @property
    def twisted(self) -> bool:
        """See :attr:`BodyCurve.twisted`."""
        return self.before.twisted or self.after.twisted

    def shape(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.shape`."""
        at = finite(s, "s")
        b = blend((at - self.at) / self.width)
        pairs = zip(self.before.shape(at), self.after.shape(at), strict=True)
        return Shape(*((1.0 - b) * x + b * y for x, y in pairs))

    def slope(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.slope`."""
        at = finite(s, "s")
        u = (at - self.at) / self.width
        b, c = blend(u), blend_slope(u) / self.width
        values = zip(self.before.shape(at), self.after.shape(at), strict=True)
        slopes = zip(self.before.slope(at), self.after.slope(at), strict=True)
        return Shape(
            *((1.0 - b) * p + b * q + c * (y - x) for (x, y), (p, q) in zip(values, slopes, strict=True)),
        )

    def integral(self, a: ArrayLike, b: ArrayLike) -> Shape:
        """As exact as those of the two curves outside the transition, by quadrature to 1e-13 inside."""
        first, last = interval(a, b)
        parts = (
            self.before.integral(np.minimum(first, self.at), np.minimum(last, self.at)),
            shape_integral(self, np.clip(first, self.at, self.end), np.clip(last, self.at, self.end)),
            self.after.integral(np.maximum(first, self.end), np.maximum(last, self.end)),
        )
        return Shape(*(np.asarray(x + y + z) for x, y, z in zip(*parts, strict=True)))
