"""Ground from a formula in x and y."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, frozen
from bodyplan.errors import InputError
from bodyplan.expressions import Expression
from bodyplan.ground.base import coulomb, planar
from bodyplan.ground.field import Field
from bodyplan.ground.nearest import Bounds, JetFunction

if TYPE_CHECKING:
    from bodyplan.ground.field_kernel import FieldArrays


class Surface(Field):
    """The ground ``z = formula`` of x and y in m, such as ``Surface("sin(0.5*(x+y))/15")``.

    What a formula may contain: :class:`bodyplan.expressions.Expression`. ``bounds``: None, or
    ((x low, x high), (y low, y high)) beyond which there is no ground. ``friction``: Coulomb coefficient or
    None. Derivatives are exact.

    Raises InputError for a formula that is not allowed, and later for points beyond ``bounds`` or where the
    formula is undefined.
    """

    kind = "surface"

    def __init__(
        self, formula: str | Expression, *, bounds: ArrayLike | None = None, friction: float | None = None
    ) -> None:
        self._expression = formula if isinstance(formula, Expression) else Expression(formula, ("x", "y"))
        if self._expression.variables != ("x", "y"):
            raise InputError(f"Surface: the variables of the formula must be x, y, got {self._expression.variables}.")
        box = np.array([[-np.inf, -np.inf], [np.inf, np.inf]])
        if bounds is not None:
            box = finite(bounds, "Surface.bounds", (2, 2)).T
            if np.any(box[0] >= box[1]):
                raise InputError(f"Surface.bounds: must be ((x low, x high), (y low, y high)), got {bounds!r}.")
        self._box = frozen(box)
        self.friction = coulomb(friction, "Surface.friction")

    @property
    def expression(self) -> Expression:
        """The formula."""
        return self._expression

    @property
    def field_box(self) -> Array:
        return self._box

    def height(self, x: ArrayLike, y: ArrayLike | None = None) -> Array:
        """Floor height z (...,) in m, also where the formula has no derivative (the tip of a cone)."""
        bx, by = planar(x, y)
        self._check_inside(bx, by)
        return self._expression.value(x=bx, y=by)

    def _jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        self._check_inside(x, y)
        return self._expression.jet(x=x, y=y)

    def field_jet(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        return self._expression.jet_or_nan(x=x, y=y)

    def field_bounds(self, low: Array, high: Array) -> Bounds:
        z, gradient, hessian = self._expression.enclosure(x=(low[:, 0], high[:, 0]), y=(low[:, 1], high[:, 1]))
        return Bounds(z, hessian, np.full(len(low), np.inf), gradient)

    def field_hessian_rate(self, x: Array, y: Array, dx: Array, dy: Array) -> Array:
        return self._expression.jet_rates(x=(x, dx), y=(y, dy))[2]

    @cached_property
    def field_arrays(self) -> FieldArrays:
        from bodyplan.ground.field_kernel import formula_field

        return formula_field(self._box, self._expression)

    def field_creases(self) -> Sequence[JetFunction]:
        return [partial(_jet_of, kink) for kink in self._expression.kinks]

    def to_dict(self) -> dict[str, Any]:
        bounds = None if np.isinf(self._box).any() else self._box.T.tolist()
        return {
            "kind": self.kind,
            "formula": self._expression.text,
            "bounds": bounds,
            "friction": self.friction,
        }


def _jet_of(expression: Expression, x: Array, y: Array) -> tuple[Array, Array, Array]:
    return expression.jet_or_nan(x=x, y=y)
