"""E_nm against the number of joints for the three mechanisms, as in Figs. 6, 7 and 12 of paper *acm*."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from bodyplan.arrays import number, whole
from bodyplan.curves.base import BodyCurve
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.fitting.fits import METHODS, fit
from bodyplan.fitting.rules import GAUSS_P
from bodyplan.robot.elements import Joint, Row
from bodyplan.robot.library import snake
from bodyplan.robot.model import Robot

MECHANISMS = ("straight", "arc", "double")
#: most joints of a table, and of an optimal fit in it
MOST, MOST_OPTIMAL = 1000, 80


@dataclass(frozen=True)
class ConvergenceRow:
    """One fit: ``error`` is E_nm of eq. (6), ``order`` the slope -dlog(E)/dlog(n) from the row with fewer joints on,
    None where there is none."""

    mechanism: str
    rule: str
    joints: int
    error: float
    quadrature_error: float
    order: float | None


@dataclass(frozen=True)
class Convergence:
    """The table: ``rows``, the ``curve``, and the options ``end_link`` (R_s) and ``p``."""

    curve: BodyCurve
    end_link: float
    p: float
    rows: tuple[ConvergenceRow, ...]

    def to_dict(self) -> dict[str, Any]:
        """As JSON types."""
        return {
            "curve": self.curve.to_dict(),
            "end_link": self.end_link,
            "p": self.p,
            "rows": [asdict(row) for row in self.rows],
        }

    def of(self, mechanism: str, rule: str = "paper") -> tuple[ConvergenceRow, ...]:
        """The rows of one mechanism and rule, by number of joints."""
        return tuple(row for row in self.rows if (row.mechanism, row.rule) == (mechanism, rule))

    def __str__(self) -> str:
        lines = [f"{'mechanism':10} {'rule':8} {'joints':>6} {'E_nm':>12} {'+-':>8} {'order':>6}"]
        for row in self.rows:
            order = "" if row.order is None else f"{row.order:.2f}"
            lines.append(
                f"{row.mechanism:10} {row.rule:8} {row.joints:6d} {row.error:12.5e} "
                f"{row.quadrature_error:8.1e} {order:>6}"
            )
        return "\n".join(lines)


def convergence(
    curve: BodyCurve,
    joints: Sequence[int] = (5, 10, 20, 40),
    mechanisms: Sequence[str] = MECHANISMS,
    rules: Sequence[str] = METHODS,
    *,
    end_link: float = 0.18,
    p: float | None = None,
) -> Convergence:
    """E_nm of robots as long as ``curve``, with n ``joints`` of two axes: one row a mechanism, rule and n.

    "arc" and "double" have n units that bend about both axes. "straight" has as many degrees of freedom as the paper's
    comparison gives it: 2 n links whose joints alternate, yaw where an even number of links lies behind (the virtual
    joint at the tail included), pitch elsewhere. ``end_link``, ``p``: see :func:`bodyplan.snake`, :func:`bodyplan.fit`.
    Fits by "optimal" go up to 80 joints; larger ones are left out of the table.

    Raises InputError for numbers of joints outside 1 .. 1000, UnknownNameError for a mechanism or rule.
    """
    if not isinstance(curve, BodyCurve):
        raise InputError(f"curve: expected a body curve, got {type(curve).__name__}.")
    counts = sorted({whole(n, "joints", at_least=1, at_most=MOST) for n in _listed(joints, "joints")})
    for field, names, known in (("mechanism", mechanisms, MECHANISMS), ("rule", rules, METHODS)):
        for name in _listed(names, field + "s"):
            if name not in known:
                raise UnknownNameError(field, name, known, where="convergence")
    rows: list[ConvergenceRow] = []
    for mechanism in mechanisms:
        for rule in rules:
            last: ConvergenceRow | None = None
            for n in counts:
                if rule == "optimal" and n > MOST_OPTIMAL:
                    continue
                found = fit(curve, robot_of(mechanism, n, curve.length, end_link), rule, p)
                order = None
                if last is not None and last.error > 0.0 and found.error > 0.0:
                    order = float(np.log(last.error / found.error) / np.log(n / last.joints))
                last = ConvergenceRow(mechanism, rule, n, found.error, found.quadrature_error, order)
                rows.append(last)
    return Convergence(curve, number(end_link, "end_link"), GAUSS_P if p is None else p, tuple(rows))


def robot_of(mechanism: str, n: int, length: float, end_link: float = 0.18) -> Robot:
    """The robot of ``length`` m that a table has for a mechanism with n joints; see :func:`convergence`."""
    if mechanism == "arc":
        return snake(n, length / n, "arc", axes="universal")
    if mechanism == "double":
        return snake(n, length / n, "double", axes="universal", end_link=end_link)
    link, quarter = 0.5 * length / n, 0.5 * np.pi
    rows = [Row(a=link)]
    for i in range(1, 2 * n):
        if i % 2 == 0:
            rows.append(Row(theta=Joint(f"yaw{i}"), a=link))
        else:
            rows += [Row(epsilon=-quarter), Row(theta=Joint(f"pitch{i}"), a=link, epsilon=quarter)]
    return Robot.from_rows({"body": rows}, name=f"{2 * n} straight links")


def _listed(values: Any, field: str) -> list[Any]:
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise InputError(f"{field}: expected a list, got {values!r}.")
    out = list(values)
    if not out:
        raise InputError(f"{field}: needs at least one entry.")
    return out
