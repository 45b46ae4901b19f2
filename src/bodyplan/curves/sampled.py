"""Body curves through sampled points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, finite, frozen
from bodyplan.curves.base import BodyCurve, Shape
from bodyplan.curves.pointfiles import read_points
from bodyplan.curves.spline import ArcLengthSpline, Jet
from bodyplan.errors import InputError
from bodyplan.spatial import quaternion_from_matrix, rotate
from bodyplan.spatial.poses import IDENTITY
from bodyplan.spatial.rotations import conjugate

#: points of one curve
MOST_POINTS = 100_000
#: nearest neighbours, as a part of the length of the polygon
NEAREST = 1e-12
#: m: places beyond it, whose squares overflow or lose everything, are refused
FARTHEST = 1e100
#: places of one evaluation: keeps the working memory small
CHUNK = 32768


class Sampled(BodyCurve):
    """The C2 cubic spline through ``points`` (M, 3) or (M, 2) m, M >= 4, from tail to head; straight beyond its ends.

    The spline (not-a-knot) is parametrised by its own arc length as nearly as refits can, then s is the true arc
    length, to rounding. The frame does not roll (tau = 0); e_y at the first point is as near to world z as can be
    (where the curve starts straight up or down, e_p points along world y). ``start`` is the pose at the first
    point, so that ``frames`` passes through the points. ``stations`` (M,): their arc lengths m.

    Raises InputError for points that are too few, not finite or the same as the one before, and for hairpins: pieces
    in which the spline turns by pi rad or more, or has a cusp.
    """

    kind: ClassVar[str] = "sampled"
    UNITS: ClassVar[Mapping[str, str]] = {"points": "length"}

    def __init__(self, points: ArrayLike) -> None:
        given = finite(points, "points")
        if given.ndim != 2 or given.shape[1] not in (2, 3) or not 4 <= len(given) <= MOST_POINTS:
            raise InputError(
                f"points: expected shape (M, 3) or (M, 2) with 4 <= M <= {MOST_POINTS}, got {given.shape}."
            )
        self.points = frozen(given)
        places = np.zeros((len(given), 3))
        places[:, : given.shape[1]] = given
        far = float(np.abs(places).max())
        if far > FARTHEST:
            raise InputError(f"points: must be within {FARTHEST:g} m of the origin, got {far:g} m.")
        chords = np.linalg.norm(np.diff(places, axis=0), axis=1)
        near = np.flatnonzero(chords <= NEAREST * chords.sum())
        if len(near):
            raise InputError(f"points: {near[0]} and {near[0] + 1} are the same, {given[near[0]].tolist()}.")
        # from the first point: far from the origin nothing is lost
        self._spline = ArcLengthSpline(places - places[0])
        self.length = self._spline.length
        self.stations = self._spline.stations
        first = self._spline.at(np.zeros(1)).rotations[0]
        self._start = frozen(np.concatenate([places[0], quaternion_from_matrix(first)]))

    @classmethod
    def from_file(cls, path: str | Path) -> Sampled:
        """The curve through the points of a .csv (columns x, y and z or none, a header or none) or .npy file, m.

        Raises InputError where the file cannot be read as such, UnknownNameError for another kind of file.
        """
        return cls(read_points(path, MOST_POINTS))

    def to_dict(self) -> dict[str, Any]:
        """The points, with ``kind``."""
        return {"kind": self.kind, "points": self.points.tolist()}

    @property
    def start(self) -> Array:
        """Pose (7,) at the first point."""
        return self._start

    @property
    def extent(self) -> tuple[float, float]:
        """See :attr:`BodyCurve.extent`."""
        return 0.0, self.length

    @property
    def breaks(self) -> Array:
        """The stations: the slopes jump there."""
        return self.stations

    def shape(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.shape`."""
        return self._across(s, lambda jet: jet.bend)

    def slope(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.slope`."""
        return self._across(s, lambda jet: jet.bend_slope)

    def _across(self, s: ArrayLike, vector: Callable[[Jet], Array]) -> Shape:
        """Turns (0, -v . e_y, v . e_p) of a vector of the jet; 0 beyond the ends."""
        at = finite(s, "s")
        flat = at.ravel()
        out = np.zeros((2, len(flat)))
        inside = np.flatnonzero((flat >= 0.0) & (flat <= self.length))
        for i in range(0, len(inside), CHUNK):
            some = inside[i : i + CHUNK]
            jet = self._spline.at(flat[some])
            turns = np.einsum("nj,njk->kn", vector(jet), jet.rotations)
            out[0, some], out[1, some] = -turns[2], turns[1]
        return Shape(np.zeros(at.shape), out[0].reshape(at.shape), out[1].reshape(at.shape))

    def _poses(self, s: Array) -> Array:
        jet = self._spline.at(np.clip(s, 0.0, self.length))
        beyond = s - np.clip(s, 0.0, self.length)
        points = jet.points + beyond[:, None] * jet.rotations[:, :, 0]
        back = conjugate(self._start[3:])
        poses = np.empty((len(s), 7))
        poses[:, :3] = rotate(back, points)
        # the frame at s = 0 is that of the start, so the pose there is the identity
        turn = self._spline.at(np.zeros(1)).rotations[0].T
        poses[:, 3:] = quaternion_from_matrix(turn @ jet.rotations)
        poses[s == 0.0] = IDENTITY
        return poses

    def __repr__(self) -> str:
        return f"Sampled({len(self.points)} points, length {self.length:.6g} m)"
