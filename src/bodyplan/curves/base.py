"""What a body curve is: the shape functions of a dorsal reference curve (paper *acm*, eq. (1)).

A curve is given by how its frame turns per unit of arc length: ``tau`` about e_r (forward), ``kappa_p`` about e_p
(left), ``kappa_y`` about e_y (up). Everything else follows: integrals become joint angles, frames become poses.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, frozen, number
from bodyplan.curves.quadrature import shape_integral
from bodyplan.errors import InputError
from bodyplan.spatial import compose, inverse, matrix_from_quaternion, quaternion_from_matrix
from bodyplan.spatial.frames import curve_frames
from bodyplan.spatial.poses import IDENTITY

#: periods from s = 0 beyond which whole ones are not integrated again
FAR = 64.0


class Shape(NamedTuple):
    """Turns about e_r, e_p, e_y: rad per m (shape functions), rad (their integrals) or rad per m^2 (their slopes)."""

    tau: Array
    kappa_p: Array
    kappa_y: Array


def unit_pose(pose: ArrayLike, field: str) -> Array:
    """``pose`` (7,) with its quaternion at length 1; InputError where it is not so to 1e-9."""
    out = np.array(finite(pose, field, (7,)))
    norm = float(np.linalg.norm(out[3:]))
    if abs(norm - 1.0) > 1e-9:
        raise InputError(f"{field}: the quaternion (w, x, y, z) must have length 1 to 1e-9, got {norm}.")
    out[3:] /= norm
    return out


class BodyCurve(ABC):
    """A curve of ``length`` m with shape functions of the arc length s (m). Immutable, equal by value.

    Curves with a formula (waves, spirals) go on for all s, also before 0 and beyond ``length``; curves made of pieces
    or points go on straight there.
    """

    #: name in mission files and claims
    kind: ClassVar[str] = ""
    #: dimension (of ``bodyplan.units``) of every option that has one
    UNITS: ClassVar[Mapping[str, str]] = {}

    #: length of the body that the curve describes, m
    length: float

    @abstractmethod
    def shape(self, s: ArrayLike) -> Shape:
        """(tau, kappa_p, kappa_y) at s (...,) m, each (...,) rad/m; at a jump the value behind it (larger s), at the
        end of a curve that ends the value in it."""

    @abstractmethod
    def slope(self, s: ArrayLike) -> Shape:
        """Derivatives of the shape functions with respect to s, each (...,) rad/m^2; jumps count as 0."""

    @abstractmethod
    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``; :func:`bodyplan.curves.from_dict` gives an equal curve back."""

    @property
    def start(self) -> Array:
        """Pose (7,) of the frame at s = 0: the identity, unless the curve lies somewhere by itself."""
        return frozen(IDENTITY)

    @property
    def breaks(self) -> Array:
        """Places (k,) m, ascending, where the shape functions or their slopes jump."""
        return frozen([])

    @property
    def period(self) -> float | None:
        """Length m after which the shape functions repeat; 0 where they are constant, None where they never do."""
        return None

    @property
    def extent(self) -> tuple[float, float]:
        """(first, last) arc length m that the curve describes; infinite for a formula, else straight beyond."""
        return -np.inf, np.inf

    @property
    def twisted(self) -> bool:
        """True where tau is not 0 everywhere."""
        return False

    def integral(self, a: ArrayLike, b: ArrayLike) -> Shape:
        """Integrals of the shape functions from a to b m (broadcast), rad; exact, or by quadrature to 1e-13."""
        return shape_integral(self, a, b)

    def frames(self, s: ArrayLike, start: ArrayLike | None = None, *, tolerance: float = 1e-10) -> tuple[Array, Array]:
        """Positions (S, 3) m and rotations (S, 3, 3), columns e_r, e_p, e_y of eq. (1), at s (S,) m in any order.

        ``start``: pose (7,) of the frame at s = 0, default ``self.start``. The Lie-group integrator and its step rule
        are those of :func:`bodyplan.spatial.frames.curve_frames`: error <= ``tolerance`` in position and rotation
        (between s = 0 and the farthest s), rotations orthonormal to rounding. Curves made of screws (lines, arcs,
        helices) are exact and ask no integrator. Raises InputError for a bad argument.
        """
        at = finite(s, "s", (None,))
        begin = self.start if start is None else unit_pose(start, "start")
        if not len(at):
            raise InputError("s: needs at least one value.")
        number(tolerance, "tolerance", at_least=1e-13)
        exact = self._poses(at)
        if exact is None and self.period and np.abs(at).max() > FAR * self.period:
            exact = self._far_poses(at, self.period, tolerance)
        if exact is not None:
            poses = compose(begin, exact)
            return poses[:, :3], matrix_from_quaternion(poses[:, 3:])
        low, high = min(at.min(), 0.0), max(at.max(), 0.0)
        breaks = self.breaks
        # steps that end at the jumps: nothing is left to search there
        stops = np.concatenate([breaks[(low < breaks) & (breaks < high)], at, [0.0]])
        places, which = np.unique(stops, return_inverse=True)
        which = which[-len(at) - 1 :]
        points, rotations = curve_frames(lambda x: np.stack(self.shape(x), axis=-1), places, tolerance=tolerance)
        zero = which[-1]
        if zero == 0 and np.array_equal(begin, IDENTITY):
            return points[which[:-1]], rotations[which[:-1]]
        here = np.concatenate([points[zero], quaternion_from_matrix(rotations[zero])])
        back = compose(begin, inverse(here))
        turn = matrix_from_quaternion(back[3:])
        return points[which[:-1]] @ turn.T + back[:3], turn @ rotations[which[:-1]]

    def _poses(self, s: Array) -> Array | None:
        """Poses (S, 7) at s (S,) seen from the frame at s = 0, for a curve that knows them exactly."""
        return None

    def _far_poses(self, s: Array, period: float, tolerance: float) -> Array:
        """Poses (S, 7) at s (S,) of a periodic curve: whole periods are powers of the screw of one, the rest is
        integrated."""
        turns = np.floor(s / period)
        most = float(np.abs(turns).max())
        # the error of the screw grows with its power
        points, rotations = self.frames([period], IDENTITY, tolerance=max(1e-13, tolerance / most))
        screw = np.concatenate([points[0], quaternion_from_matrix(rotations[0])])
        counts, which = np.unique(turns, return_inverse=True)
        whole = np.tile(np.asarray(IDENTITY), (len(counts), 1))
        left = np.abs(counts).astype(np.int64)
        while left.any():
            odd = left % 2 == 1
            whole[odd] = compose(screw, whole[odd])
            screw, left = compose(screw, screw), left // 2
        whole[counts < 0] = inverse(whole[counts < 0])
        points, rotations = self.frames(s - turns * period, IDENTITY, tolerance=tolerance)
        within = np.concatenate([points, quaternion_from_matrix(rotations)], axis=-1)
        return compose(whole[which], within)

    def untwisted(self) -> BodyCurve:
        """The same points with a frame that does not roll (tau = 0): what joints that only bend can follow."""
        if not self.twisted:
            return self
        from bodyplan.curves.untwisted import Untwisted  # it is made of a curve itself

        return Untwisted(self)

    def __setattr__(self, name: str, value: Any) -> None:
        # what is kept of a curve (integrals, frames) would not notice a change
        if not name.startswith("_") and name in self.__dict__:
            raise AttributeError(f"{type(self).__name__}.{name}: a curve cannot be changed; make a new one.")
        super().__setattr__(name, value)

    def __add__(self, other: BodyCurve) -> BodyCurve:
        if not isinstance(other, BodyCurve):
            return NotImplemented
        from bodyplan.curves.sums import Sum  # it is made of curves itself

        return Sum((self, other))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, BodyCurve) and self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        return hash(repr(self.to_dict()))

    def __repr__(self) -> str:
        options = ", ".join(f"{k}={v!r}" for k, v in self.to_dict().items() if k != "kind")
        return f"{type(self).__name__}({options})"
