"""Integrals of shape functions that have no formula."""

from __future__ import annotations

from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

if TYPE_CHECKING:
    from bodyplan.curves.base import BodyCurve, Shape


def shape_integral(curve: BodyCurve, a: ArrayLike, b: ArrayLike) -> Shape:
    """Integrals of the shape functions from a to b (broadcast), rad, to 1e-13 (composite Gauss-Legendre)."""
    raise NotImplementedError
