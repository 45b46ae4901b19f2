"""What ``bodyplan fit`` finds: a curve, a mechanism of n joints fitted to it, and how other mechanisms would do."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bodyplan.arrays import Array, number, whole
from bodyplan.curves.base import BodyCurve
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.fitting import Fit, fit
from bodyplan.fitting.fits import AT_LIMIT
from bodyplan.fitting.mechanism import AXIS_NAMES, mechanism
from bodyplan.robot import Robot, snake
from bodyplan.show.fitted import Drawn
from bodyplan.show.text import counted, settled

KINDS = ("straight", "arc", "double")
RULES = ("paper", "optimal")
#: share of its largest curvature up to which a curve does not bend about an axis
FLAT = 1e-9
MOST_JOINTS = 200
#: joints up to which the others are fitted optimally too: the work grows as the square of the joints
MOST_OPTIMAL = 40


@dataclass(frozen=True)
class FitRow:
    """One mechanism by one rule: degrees of freedom, E_nm, its quadrature error, the largest distance m, status. A
    mechanism that cannot be made is "refused", with the ``reason`` and no figures."""

    mechanism: str
    rule: str
    joints: int | None
    error: float | None
    quadrature_error: float | None
    max_distance: float | None
    status: str
    mine: bool
    reason: str = ""


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
        number(end_link, "end_link", above=0.0, below=0.5)
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
            except InputError as error:  # one straight link has no joint
                rows.append(FitRow(kind, rule, None, None, None, None, "refused", False, str(error)))
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

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What to know of the fit: the axes that the curve bends about and the robot cannot."""
        bends = _bends(self.curve, float(self.fit.start), float(self.fit.start) + self.fit.length)
        least = FLAT * float(bends.max())
        return tuple(
            f"the curve bends about {name} (by up to {bends[axis]:.3g} rad/m), but the robot has no joints that do"
            for axis, name in enumerate(AXIS_NAMES)
            if axis not in mechanism(self.fit.robot).axes and bends[axis] > least
        )

    @property
    def beyond(self) -> bool:
        """True where the paper's rule goes beyond the joint limits, which the optimal angles may not."""
        return bool(np.any(self.fit.paper.excess > AT_LIMIT))

    @property
    def title(self) -> str:
        """ "serpenoid by 10 arc-shaped joints"."""
        return f"{self.name} by {self.mechanism}"

    @property
    def mechanism(self) -> str:
        """ "10 arc-shaped joints", "10 straight links with 9 joints"."""
        if self.joint == "straight":
            links = len(self.fit.robot.contacts)
            return f"{counted(links, 'straight link')} with {counted(links - 1, 'joint')}"
        return counted(self.joints, {"arc": "arc-shaped joint", "double": "double joint"}[self.joint])

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
            "warnings": list(self.warnings),
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
    pitch, yaw = _bends(curve, 0.0, curve.length)
    least = FLAT * max(pitch, yaw)
    if pitch <= least:
        return "yaw"
    return "pitch" if yaw <= least else "universal"


def _bends(curve: BodyCurve, start: float, end: float) -> Array:
    """Largest curvatures (pitch, yaw) rad/m between two places, in the frame that does not roll."""
    inside = curve.breaks[(curve.breaks > start) & (curve.breaks < end)]
    bends = curve.untwisted().shape(np.unique(np.concatenate([np.linspace(start, end, 1001), inside])))
    return np.array([np.abs(bends.kappa_p).max(), np.abs(bends.kappa_y).max()])


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


def in_degrees(angles: Any) -> list[float]:
    """Angles rad in degrees, without the rounding of zeros."""
    return [settled(float(x)) for x in np.degrees(np.asarray(angles, dtype=float))]


def saturated(fitted: Fit) -> list[str]:
    """Joints at or beyond their limits, in words."""
    return [f"{name} (by {np.degrees(by):.3g}°)" if by > 0.0 else name for name, by in fitted.limits.items()]


def refused(outcome: FitOutcome) -> dict[str, list[str]]:
    """Why mechanisms could not be made -> their names."""
    out: dict[str, list[str]] = {}
    for row in outcome.rows:
        if row.reason and row.mechanism not in out.setdefault(row.reason, []):
            out[row.reason].append(row.mechanism)
    return out
