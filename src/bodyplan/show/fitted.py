"""A fit sampled for pictures: curve and mechanism on one body length, their turning, the distance between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array
from bodyplan.fitting.mechanism import AXIS_NAMES, mechanism
from bodyplan.spatial.rotations import rotate

if TYPE_CHECKING:
    from bodyplan.fitting import Fit

#: samples along the body
SAMPLES = 361
#: colours of the curve and of the mechanism that follows it
CURVE, MECHANISM = "#009e73", "#d98200"
#: picture axes of the three views
VIEWS = {"above": (0, 1), "the side": (0, 2), "the front": (1, 2)}


@dataclass(frozen=True, eq=False)
class Turning:
    """The turning functions of one ``axis`` along the body (S,) rad: integral of the curvature, eq. (7) of paper
    *acm*, and sum of the joint angles, eqs. (8), (9): a staircase for hinges, a polyline for arcs."""

    axis: str
    curve: Array
    mechanism: Array


@dataclass(frozen=True, eq=False)
class Drawn:
    """One fit along the body: ``s`` (S,) m from the tail; ``curve`` and ``body`` (S, 3) m points of the curve and of
    the mechanism; ``joints`` (J, 3) m of its hinges, or of the ends of its arcs, and of both ends; ``distance`` (S,) m;
    ``turnings`` of the axes that turn at all; ``error`` E_nm, its ``quadrature_error``, ``max_distance`` m."""

    s: Array
    curve: Array
    body: Array
    joints: Array
    distance: Array
    turnings: tuple[Turning, ...]
    error: float
    quadrature_error: float
    max_distance: float

    @classmethod
    def of(cls, fit: Fit, pose: Array | None = None) -> Drawn:
        """The samples of a single fit (not a batch); ``pose`` (7,) places the curve's coordinates in the world."""
        made = mechanism(fit.robot)
        hinges = {"straight": made.places, "arc": made.units, "double": made.hinges}[made.kind].ravel()
        ends = np.unique(np.concatenate([[0.0, made.length], hinges]))
        # a staircase needs both sides of every step
        before = np.clip(hinges * (1.0 - 1e-9), 0.0, made.length)
        s = np.unique(np.concatenate([np.linspace(0.0, made.length, SAMPLES), ends, before]))
        curve, body, joints = fit.curve_points(s), fit.points(s), fit.points(ends)
        turns = fit.turning(s)
        turnings = tuple(
            Turning(AXIS_NAMES[k], turns.curve[..., k], turns.mechanism[..., k])
            for k in (1, 0)
            if np.abs(turns.curve[..., k]).max() > 1e-12 or np.abs(turns.mechanism[..., k]).max() > 1e-12
        )
        if pose is not None:
            curve, body, joints = (pose[:3] + rotate(pose[3:], points) for points in (curve, body, joints))
        return cls(
            s,
            curve,
            body,
            joints,
            fit.distance(s),
            turnings,
            float(fit.error),
            float(fit.quadrature_error),
            float(fit.max_distance),
        )

    @property
    def views(self) -> tuple[str, ...]:
        """From above alone where the curve lies flat, from the side alone where it stands upright, else all three."""
        spread = np.ptp(np.concatenate([self.curve, self.body]), axis=0)
        flat = 1e-9 * max(float(spread.max()), 1e-300)
        if spread[2] <= flat:
            return ("above",)
        return ("the side",) if spread[1] <= flat else tuple(VIEWS)
