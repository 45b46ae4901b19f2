"""Poses of named frames, as forward kinematics hands them out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from bodyplan.arrays import Array
from bodyplan.errors import UnknownNameError
from bodyplan.spatial.rotations import matrix_from_quaternion


class Poses:
    """Poses of F frames, read-only: ``array`` (..., F, 7) is position (m) and quaternion wxyz, w >= 0.

    Index it with a frame or chain name (a chain stands for its end frame) to get (..., 7), or with anything
    that indexes an array. ``np.asarray(poses)`` is ``poses.array``.
    """

    __slots__ = ("_array", "_index", "_names")

    def __init__(self, array: Array, names: tuple[str, ...], index: Mapping[str, int]) -> None:
        array.flags.writeable = False
        self._array, self._names, self._index = array, names, index

    @property
    def array(self) -> Array:
        """(..., F, 7): x, y, z in m, then quaternion w, x, y, z."""
        return self._array

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the F frames, "base" first."""
        return self._names

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of ``array``."""
        return self._array.shape

    @property
    def positions(self) -> Array:
        """Origins of the frames, (..., F, 3) m."""
        return self._array[..., :3]

    @property
    def quaternions(self) -> Array:
        """Orientations of the frames, (..., F, 4) wxyz."""
        return self._array[..., 3:]

    @property
    def rotations(self) -> Array:
        """Orientations of the frames as matrices, (..., F, 3, 3)."""
        return matrix_from_quaternion(self._array[..., 3:])

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, str):
            if key not in self._index:
                raise UnknownNameError("frame", key, self._index)
            return self._array[..., self._index[key], :]
        return self._array[key]

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Any:
        if copy or (dtype is not None and np.dtype(dtype) != self._array.dtype):
            return np.array(self._array, dtype=dtype)
        return self._array

    def __len__(self) -> int:
        return len(self._array)

    def __repr__(self) -> str:
        more = " ..." if len(self._names) > 6 else ""
        return f"Poses(shape={self.shape}, frames={', '.join(self._names[:6])}{more})"
