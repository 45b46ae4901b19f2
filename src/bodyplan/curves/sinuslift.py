"""Sinus-lifting: a serpenoid whose most bent parts are lifted off the ground (paper *acm*, eqs. (35)-(37))."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, number
from bodyplan.curves.base import BodyCurve, Shape
from bodyplan.curves.level import level_pitch
from bodyplan.curves.quadrature import interval
from bodyplan.errors import InputError


class SinusLift(BodyCurve):
    """``kappa_y = k alpha sin x``, ``kappa_p = k (c1 - lift cos 2x)``, eqs. (35), (36).

    ``k = 2 pi / wavelength``, ``x = k s + phase``. ``alpha`` rad as for :class:`Serpenoid`; ``lift``: c0 of the
    paper, > 0 lifts the bends; ``wavelength`` m (default: ``length``); ``length`` m of the body; ``phase`` rad.
    ``c1``:

    * None (default): the value that keeps the curve level: over half a wavelength from where kappa_y = 0, e_y comes
      back to itself, and over a wavelength the whole frame. Of several such values the one that grows from 0 with
      the lift (-lift J2(alpha) / J0(alpha) to first order, Bessel functions).
    * ``"paper"``: eq. (37), -(0.043 alpha^4 + 0.105 alpha^2) lift, whose curve slowly climbs or dives.
    * a number.

    ``.c1`` is its value. Raises InputError where no value keeps the curve level (alpha near a zero of J0, 2.405 rad,
    or a lift that is too large), for lengths that are not > 0, or another text.
    """

    kind: ClassVar[str] = "sinus-lift"
    UNITS: ClassVar[Mapping[str, str]] = {
        "alpha": "angle",
        "lift": "none",
        "wavelength": "length",
        "length": "length",
        "phase": "angle",
    }

    def __init__(
        self,
        alpha: float,
        lift: float,
        wavelength: float | None = None,
        c1: float | str | None = None,
        length: float = 1.0,
        *,
        phase: float = 0.0,
    ) -> None:
        self.alpha, self.lift = number(alpha, "alpha"), number(lift, "lift")
        self.length = number(length, "length", above=0.0)
        self.wavelength = self.length if wavelength is None else number(wavelength, "wavelength", above=0.0)
        self.phase = number(phase, "phase")
        if c1 is None:
            self.c1 = level_pitch(self.alpha, self.lift)
        elif isinstance(c1, str):
            if c1 != "paper":
                raise InputError(f'c1: must be None (level), "paper" (eq. (37)) or a number, got {c1!r}.')
            self.c1 = -(0.043 * self.alpha**4 + 0.105 * self.alpha**2) * self.lift
        else:
            self.c1 = c1 = number(c1, "c1")
        self._asked = c1

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``; ``c1`` as it was asked for."""
        return {"kind": self.kind, **{name: getattr(self, name) for name in self.UNITS}, "c1": self._asked}

    @property
    def period(self) -> float:
        """The wavelength, m."""
        return self.wavelength

    def shape(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.shape`."""
        k, x = self._angles(finite(s, "s"))
        return _bends(k * (self.c1 - self.lift * np.cos(2.0 * x)), k * self.alpha * np.sin(x))

    def slope(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.slope`."""
        k, x = self._angles(finite(s, "s"))
        return _bends(2.0 * k * k * self.lift * np.sin(2.0 * x), k * k * self.alpha * np.cos(x))

    def integral(self, a: ArrayLike, b: ArrayLike) -> Shape:
        """Exact, with differences of angles written as products."""
        first, last = interval(a, b)
        (k, x), (_, y) = self._angles(first), self._angles(last)
        turn = k * (last - first)
        pitch = self.c1 * turn - self.lift * np.cos(x + y) * np.sin(turn)
        return _bends(pitch, 2.0 * self.alpha * np.sin(0.5 * (x + y)) * np.sin(0.5 * turn))

    def _angles(self, s: Array) -> tuple[float, Array]:
        k = 2.0 * np.pi / self.wavelength
        return k, np.asarray(k * s + self.phase)


def _bends(kappa_p: Array, kappa_y: Array) -> Shape:
    return Shape(np.zeros(np.shape(kappa_y)), np.asarray(kappa_p), np.asarray(kappa_y))
