"""Joint angles that know their names."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError, UnknownNameError


class JointAngles(np.ndarray[Any, np.dtype[np.float64]]):
    """An array (..., n), read-only, whose columns have names: ``q["yaw3"]`` (...), ``q.names``, ``q.items()``.

    Otherwise the array it is; what is computed from it is an ordinary array.
    """

    names: tuple[str, ...]

    def __new__(cls, values: Array, names: tuple[str, ...]) -> JointAngles:
        if np.shape(values)[-1:] != (len(names),):
            raise InputError(f"values: expected shape (..., {len(names)}), got {np.shape(values)}.")
        out = np.array(values, dtype=np.float64).view(cls)
        out.names = tuple(names)
        out.flags.writeable = False
        return out

    def __array_finalize__(self, source: Any) -> None:
        self.names = getattr(source, "names", ())

    def __array_wrap__(self, array: Any, context: Any = None, return_scalar: bool = False) -> Any:
        return array[()] if return_scalar else np.asarray(array)

    def __getitem__(self, key: Any) -> Any:
        if isinstance(key, str):
            if key not in self.names:
                raise UnknownNameError("joint", key, self.names)
            return np.asarray(self)[..., self.names.index(key)]
        out = super().__getitem__(key)
        # rows of the batch keep the names; columns do not
        named = isinstance(out, JointAngles) and out.shape[-1:] == (len(self.names),) and out.ndim > 0
        return out if named and self.ndim > 1 else (np.asarray(out) if isinstance(out, np.ndarray) else out)

    def items(self) -> Iterator[tuple[str, Array]]:
        """(name, values (...)) of every joint."""
        return ((name, self[name]) for name in self.names)

    def __reduce__(self) -> Any:
        return type(self), (np.asarray(self), self.names)
