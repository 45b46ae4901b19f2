"""Functions of an arc's angle x that are regular at x = 0, as SymPy functions of z = x^2.

A = sin(x)/x, B = (1 - cos x)/x^2, C = (x - sin x)/x^3, as in :mod:`bodyplan.spatial.coefficients`, which evaluates
them here, too. ``lambdify``, ``evalf``, ``diff`` and ``rewrite(sin)`` know them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp
from numpy.typing import ArrayLike

from bodyplan.arrays import Array
from bodyplan.spatial.coefficients import coefficients


class _OfSquare(sp.Function):  # type: ignore[misc]
    """A function of z = x^2 with a limit at 0."""

    nargs = 1
    AT_ZERO: sp.Rational
    TEX: str

    @classmethod
    def eval(cls, z: Any) -> Any:
        if z.is_zero:
            return cls.AT_ZERO
        return sp.Float(float(cls._imp_(float(z)))) if z.is_Float else None

    @staticmethod
    def _imp_(z: ArrayLike) -> Array:
        raise NotImplementedError

    def _latex(self, printer: Any, exp: str | None = None) -> str:
        power = "" if exp is None else f"^{{{exp}}}"
        return rf"{self.TEX}{power}\left({printer._print(self.args[0])}\right)"


class ArcA(_OfSquare):
    """sin(x)/x."""

    AT_ZERO, TEX = sp.Integer(1), "A"

    @staticmethod
    def _imp_(z: ArrayLike) -> Array:
        return coefficients(_root(z))[0]

    def fdiff(self, argindex: int = 1) -> Any:
        return (ArcC(self.args[0]) - ArcB(self.args[0])) / 2

    def _eval_rewrite_as_sin(self, z: Any, **_: Any) -> Any:
        return sp.sin(sp.sqrt(z)) / sp.sqrt(z)


class ArcB(_OfSquare):
    """(1 - cos x)/x^2."""

    AT_ZERO, TEX = sp.Rational(1, 2), "B"

    @staticmethod
    def _imp_(z: ArrayLike) -> Array:
        return coefficients(_root(z))[1]

    def fdiff(self, argindex: int = 1) -> Any:
        z = self.args[0]
        return (ArcA(z) - 2 * self) / (2 * z)

    def _eval_rewrite_as_sin(self, z: Any, **_: Any) -> Any:
        return 2 * sp.sin(sp.sqrt(z) / 2) ** 2 / z


class ArcC(_OfSquare):
    """(x - sin x)/x^3."""

    AT_ZERO, TEX = sp.Rational(1, 6), "C"

    @staticmethod
    def _imp_(z: ArrayLike) -> Array:
        return coefficients(_root(z))[2]

    def fdiff(self, argindex: int = 1) -> Any:
        z = self.args[0]
        return (ArcB(z) - 3 * self) / (2 * z)

    def _eval_rewrite_as_sin(self, z: Any, **_: Any) -> Any:
        return (sp.sqrt(z) - sp.sin(sp.sqrt(z))) / sp.sqrt(z) ** 3


def _root(z: ArrayLike) -> Array:
    return np.sqrt(np.asarray(z, dtype=np.float64))
