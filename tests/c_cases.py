"""C sources compiled and called: the kinematics of a robot as a C compiler understands them."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bodyplan.robot import Robot
from bodyplan.robot.symbolic import CSource

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O2")


def compiler() -> str:
    """The C compiler; the test is skipped where there is none."""
    found = shutil.which("gcc") or shutil.which("clang") or shutil.which("cc")
    if found is None:
        pytest.skip("no C compiler (gcc, clang, cc) on this machine")
    return found


class Compiled:
    """The functions of a compiled source, taking and giving arrays."""

    def __init__(self, source: CSource, folder: Path) -> None:
        _, path = source.write(folder)
        library = folder / f"{source.name}.so"
        command = [compiler(), *STRICT, "-shared", "-fPIC", str(path), "-o", str(library), "-lm"]
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        self.library, self.name = ctypes.CDLL(str(library)), source.name

    def call(self, function: str, *arrays: np.ndarray) -> None:
        assert all(a.dtype == np.float64 and a.flags.c_contiguous for a in arrays)
        pointers = [a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in arrays]
        getattr(self.library, f"{self.name}_{function}")(*pointers)

    def numbers(self, array: str, size: int) -> list[int]:
        return list((ctypes.c_int * size).in_dll(self.library, f"{self.name}_{array}"))

    def names(self, array: str, size: int) -> list[str]:
        return [text.decode() for text in (ctypes.c_char_p * size).in_dll(self.library, f"{self.name}_{array}")]

    def ends(self, robot: Robot, q: np.ndarray, frames: int, columns: int) -> tuple[np.ndarray, ...]:
        """positions (frames, 3), rotations (frames, 3, 3), twists (columns, 6); NaN where nothing was written."""
        out = tuple(np.full(shape, np.nan) for shape in ((frames, 3), (frames, 3, 3), (columns, 6)))
        self.call("ends", q, *out)
        return out

    def velocity_model(self, q: np.ndarray, frames: int) -> tuple[np.ndarray, np.ndarray]:
        P, Q = np.full((6 * frames, 6), np.nan), np.full((6 * frames, len(q)), np.nan)
        self.call("velocity_model", q, P, Q)
        return P, Q
