"""What ``bodyplan fit`` finds: a curve, a mechanism of n joints fitted to it, and how other mechanisms would do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bodyplan.arrays import number, whole
from bodyplan.curves.base import BodyCurve
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.fitting import Fit, fit
from bodyplan.robot import Robot, snake
from bodyplan.show.fitted import Drawn

KINDS = ("straight", "arc", "double")
RULES = ("paper", "optimal")
MOST_JOINTS = 200
#: joints up to which the others are fitted optimally too: the work grows as the square of the joints
MOST_OPTIMAL = 40


@dataclass(frozen=True)
class FitRow:
    """One mechanism by one rule: E_nm, its quadrature error, the largest distance m, degrees of freedom, status."""

    mechanism: str
    rule: str
    joints: int
    error: float
    quadrature_error: float
    max_distance: float
    status: str
    mine: bool


@dataclass(frozen=True, eq=False)
class FitOutcome:
    """A fit with its pictures' data. ``joint`` kind and number of ``joints`` of the mechanism, ``axes`` it bends about;
    ``rows`` all mechanisms and rules for that number; ``convergence`` the table over numbers of joints, or None."""

    name: str
    curve: BodyCurve
    joints: int
    joint: str
    axes: str
    fit: Fit
    rows: tuple[FitRow, ...]
    convergence: Any = None

    @classmethod
    def of(
        cls,
        name: str,
        curve: BodyCurve,
        *,
        joints: int = 10,
        joint: str = "arc",
        axes: str | None = None,
        end_link: float = 0.18,
        limit: float | None = None,
        method: str = "paper",
        p: float | None = None,
        start: float = 0.0,
        convergence: bool = False,
        progress: Callable[[str, float], None] = lambda step, part: None,
    ) -> FitOutcome:
        """Fit a snake of ``joints`` joints as long as the curve, and the other mechanisms beside it.

        ``joints``: units that bend ("arc", "double"), or links ("straight"); of a straight snake with axes
        "alternating" twice as many links, which have as many degrees of freedom. ``axes``: as for
        :func:`bodyplan.snake`; default: "yaw" or "pitch" where the curve bends about one axis, else "universal"
        ("alternating" for straight links). ``end_link``: R_s of double joints. ``limit`` rad: largest angle of every
        joint. ``method``, ``p``, ``start``: see :func:`bodyplan.fit`. InputError for values out of range.
        """
        count = whole(joints, "joints", at_least=1, at_most=MOST_JOINTS)
        if joint not in KINDS:
            raise UnknownNameError("joint", joint, KINDS)
        if method not in RULES:
            raise UnknownNameError("method", method, RULES)
        if limit is not None and number(limit, "limit", above=0.0) > np.pi:
            said = f"limit: must be at most half a turn, 3.14159 rad, got {limit:.6g} rad"
            raise InputError(f'{said}; degrees need "deg", as in "75 deg".')
        flat = axes_of(curve) if axes is None else axes

        def fitted(kind: str, rule: str) -> Fit:
            robot = mechanism_of(kind, count, curve.length, flat, end_link, limit, default=axes is None)
            return fit(curve, robot, method=rule, p=p, start=start)

        progress("fitting", 0.0)
        mine = fitted(joint, method)
        rows = []
        asked = (joint, method)
        pairs = [(k, r) for k in KINDS for r in RULES if r == "paper" or count <= MOST_OPTIMAL or (k, r) == asked]
        for i, (kind, rule) in enumerate(pairs):
            progress("comparing", i / len(pairs))
            try:
                one = mine if (kind, rule) == asked else fitted(kind, rule)
            except InputError:  # one straight link has no joint
                continue
            rows.append(
                FitRow(kind, rule, one.robot.n, float(one.error), float(one.quadrature_error), float(one.max_distance),
                       one.status, one is mine)
            )  # fmt: skip
        table = None
        if convergence:
            from bodyplan.fitting.convergence import convergence as over_joints

            progress("convergence", 0.0)
            table = over_joints(curve, end_link=end_link, p=p)
        used = mechanism_axes(joint, flat, axes is None)
        return cls(name, curve, count, joint, used, mine, tuple(rows), table)

    @property
    def ok(self) -> bool:
        """True where no joint is beyond its limits and the body does not stick out beyond the curve."""
        return bool(self.fit.ok)

    @cached_property
    def drawn(self) -> Drawn:
        """The fit along the body, for pictures."""
        return Drawn.of(self.fit)

    @property
    def title(self) -> str:
        """ "serpenoid by 10 arc-shaped joints"."""
        what = {"straight": "straight links", "arc": "arc-shaped joints", "double": "double joints"}[self.joint]
        links = self.joints if self.joint != "straight" else len(self.fit.robot.contacts)
        return f"{self.name} by {links} {what}"

    def to_dict(self) -> dict[str, Any]:
        """JSON types: everything that was found."""
        fitted = self.fit
        return {
            "format": "bodyplan fit 1",
            "curve": self.curve.to_dict(),
            "joint": self.joint,
            "joints": self.joints,
            "axes": self.axes,
            "method": fitted.method,
            "p": fitted.p,
            "status": fitted.status,
            "error": float(fitted.error),
            "quadrature_error": float(fitted.quadrature_error),
            "max_distance_m": float(fitted.max_distance),
            "angles_rad": dict(zip(fitted.robot.joints, np.asarray(fitted.q).tolist(), strict=True)),
            "limits_rad": dict(fitted.limits),
            "virtual_joint_rad": dict(zip(("pitch", "yaw"), np.asarray(fitted.kink).tolist(), strict=True)),
            "base": np.asarray(fitted.base).tolist(),
            "mechanisms": [vars(row) for row in self.rows],
            "convergence": None if self.convergence is None else self.convergence.to_dict(),
        }


#: what the tables mean by straight links: two robots, each the one that its readers know
STRAIGHT = (
    "Straight links beside the other mechanisms are those of bp.snake: as many links where the curve bends about one "
    "axis, else twice as many with joints in turns, yaw first. Over the number of joints they are the paper's: twice "
    "as many with joints in turns, where the virtual joint at the tail yaws."
)


def axes_of(curve: BodyCurve) -> str:
    """ "yaw" or "pitch" for a curve that bends about that axis alone, else "universal"."""
    s = np.unique(np.concatenate([np.linspace(0.0, curve.length, 1001), curve.breaks]))
    bends = curve.untwisted().shape(s)
    size = max(float(np.abs(bends.kappa_p).max()), float(np.abs(bends.kappa_y).max()))
    if float(np.abs(bends.kappa_p).max()) <= 1e-9 * size:
        return "yaw"
    return "pitch" if float(np.abs(bends.kappa_y).max()) <= 1e-9 * size else "universal"


def mechanism_axes(kind: str, axes: str, default: bool) -> str:
    """Axes of a mechanism where the user named none: a straight snake that bends about both has them in turns."""
    return "alternating" if default and kind == "straight" and axes == "universal" else axes


def mechanism_of(
    kind: str, joints: int, length: float, axes: str, end_link: float, limit: float | None, *, default: bool
) -> Robot:
    """A snake of ``joints`` joints that is ``length`` m long; see :meth:`FitOutcome.of`."""
    axes = mechanism_axes(kind, axes, default)
    links = 2 * joints if kind == "straight" and axes == "alternating" else joints
    limits = None if limit is None else (-limit, limit)
    more: dict[str, Any] = {"end_link": end_link} if kind == "double" else {}
    return snake(links, length / links, kind, axes=axes, limits=limits, **more)


def saturated(fitted: Fit) -> list[str]:
    """Joints at or beyond their limits, in words."""
    return [f"{name} (by {np.degrees(by):.3g}°)" if by > 0.0 else name for name, by in fitted.limits.items()]
