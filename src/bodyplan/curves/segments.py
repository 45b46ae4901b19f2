"""Body curves made of lines, arcs and helices, one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, IntArray, finite, frozen
from bodyplan.curves.base import BodyCurve, Shape
from bodyplan.curves.quadrature import interval
from bodyplan.curves.screws import turning_bend_integrals, turning_bend_poses, turning_bends
from bodyplan.curves.segment_kinds import SEGMENTS, Segment, segment_from
from bodyplan.errors import InputError
from bodyplan.spatial import compose
from bodyplan.spatial.poses import IDENTITY


class Segments(BodyCurve):
    """Pieces end to end from s = 0 on; straight before and behind. The curvature jumps where pieces meet.

    A piece is a :class:`Line`, :class:`Bend` or :class:`Helix`, a table of one of them (``{"kind": "line" | "arc" |
    "helix", "length": ..., ...}``, quantities may be texts such as "90 deg"), or a tuple (length m, tau, kappa_p,
    kappa_y rad/m) of constants. ``twist`` rad/m of a piece is its tau: how fast the frame rolls about e_r.

    The bend of a helix turns within the frame at its own rate ("torsion"): the torsion of its points is
    torsion + twist. A helix is therefore either a bend that turns in a frame without roll (torsion, twist 0: what
    joints that only bend follow, eq. (5)) or a bend fixed in a frame that rolls (an arc with twist).

    Integrals and frames are exact. Raises InputError, UnknownNameError for a wrong piece, naming it by its index.
    """

    kind: ClassVar[str] = "segments"

    def __init__(self, pieces: Iterable[Any]) -> None:
        if isinstance(pieces, str | Mapping | Segment) or not isinstance(pieces, Iterable):
            raise InputError(f"pieces: expected a list of {', '.join(SEGMENTS)}, got {pieces!r:.200}.")
        self.pieces: tuple[Segment, ...] = tuple(segment_from(piece, f"pieces[{i}]") for i, piece in enumerate(pieces))
        if not self.pieces:
            raise InputError("pieces: needs at least one.")
        # one row more on either side: straight
        rows = np.zeros((len(self.pieces) + 2, 4))
        rows[1:-1] = [piece.constants for piece in self.pieces]
        self._tau, self._kappa_p, self._kappa_y, self._turn = (frozen(column) for column in rows.T)
        lengths = np.array([piece.size for piece in self.pieces])
        ends = np.cumsum(lengths)
        if np.any(np.diff(ends, prepend=0.0) <= 0.0) or not np.isfinite(ends[-1]):
            raise InputError(f"pieces: lengths {lengths.tolist()} m are too different in size to be laid end to end.")
        self.length = float(ends[-1])
        self._breaks = frozen(np.concatenate([[0.0], ends]))
        self._origins = frozen(np.concatenate([[0.0], self._breaks]))
        self._turned = self._turns()
        self._junctions = self._joined()

    def to_dict(self) -> dict[str, Any]:
        """The pieces as tables (or lists of constants), with ``kind``."""
        return {"kind": self.kind, "pieces": [piece.to_dict() for piece in self.pieces]}

    @property
    def extent(self) -> tuple[float, float]:
        """See :attr:`BodyCurve.extent`."""
        return 0.0, self.length

    @property
    def breaks(self) -> Array:
        """Where pieces meet, and both ends, m."""
        return self._breaks

    @property
    def twisted(self) -> bool:
        """See :attr:`BodyCurve.twisted`."""
        return bool(np.any(self._tau))

    def shape(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.shape`."""
        i, x = self._piece(finite(s, "s"))
        return Shape(self._tau[i], *turning_bends(self._kappa_p[i], self._kappa_y[i], self._turn[i], x))

    def slope(self, s: ArrayLike) -> Shape:
        """See :meth:`BodyCurve.slope`."""
        i, x = self._piece(finite(s, "s"))
        turn = self._turn[i]
        kappa_p, kappa_y = turning_bends(self._kappa_p[i], self._kappa_y[i], turn, x)
        return Shape(np.zeros(np.shape(x)), np.asarray(-turn * kappa_y), np.asarray(turn * kappa_p))

    def integral(self, a: ArrayLike, b: ArrayLike) -> Shape:
        """Exact."""
        first, last = interval(a, b)
        (i, x), (j, y) = self._piece(first), self._piece(last)
        # within one piece directly, so that short intervals lose nothing
        same = i == j
        direct = self._within(i, x, y)
        apart = (
            self._turned[j] - self._turned[i] + np.stack(self._within(j, np.zeros_like(y), y), axis=-1)
        ) - np.stack(self._within(i, np.zeros_like(x), x), axis=-1)
        return Shape(*(np.where(same, value, apart[..., k]) for k, value in enumerate(direct)))

    def _poses(self, s: Array) -> Array:
        i, x = self._piece(s)
        shape = (self._tau[i], self._kappa_p[i], self._kappa_y[i], self._turn[i])
        return compose(self._junctions[i], turning_bend_poses(*shape, x))

    def _piece(self, s: Array) -> tuple[IntArray, Array]:
        """Rows of places s, and the places from the start of their piece."""
        # the end belongs to the last piece
        row = np.searchsorted(self._breaks, s, side="right") - (s == self._breaks[-1])
        return np.asarray(row), np.asarray(s - self._origins[row])

    def _within(self, i: IntArray, x: Array, y: Array) -> Shape:
        """Integrals from x to y of piece i."""
        bends = turning_bend_integrals(self._kappa_p[i], self._kappa_y[i], self._turn[i], x, y)
        return Shape(np.asarray(self._tau[i] * (y - x)), *map(np.asarray, bends))

    def _turns(self) -> Array:
        """Integrals (n + 2, 3) from s = 0 to the start of every row."""
        rows = np.arange(1, len(self.pieces) + 1)
        lengths = np.diff(self._breaks)
        each = np.stack(self._within(rows, np.zeros_like(lengths), lengths), axis=-1)
        return frozen(np.concatenate([np.zeros((2, 3)), np.cumsum(each, axis=0)]))

    def _joined(self) -> Array:
        """Poses (n + 2, 7) at the start of every row."""
        poses = [np.array(IDENTITY), np.array(IDENTITY)]
        lengths = np.diff(self._breaks)
        steps = turning_bend_poses(self._tau[1:-1], self._kappa_p[1:-1], self._kappa_y[1:-1], self._turn[1:-1], lengths)
        for step in steps:
            pose = compose(poses[-1], step)
            pose[3:] /= np.linalg.norm(pose[3:])
            poses.append(pose)
        return frozen(np.stack(poses))
