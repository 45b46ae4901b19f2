"""One file a format. :data:`FORMATS` is the registry: a new format is one module and one line."""

from __future__ import annotations

import importlib
import os
from pathlib import Path

from bodyplan.errors import UnknownNameError
from bodyplan.motion import Motion

#: suffix -> (module with a ``write(motion, path)``, what it is)
FORMATS = {
    ".csv": ("bodyplan.export.csv_file", "table of the trajectory, names and units in the header"),
    ".npz": ("bodyplan.export.npz_file", "everything; load gives an equal Motion"),
    ".xml": ("bodyplan.export.mjcf", "MJCF model of robot and ground for MuJoCo"),
}


def save(motion: Motion, path: str | os.PathLike[str]) -> Path:
    """Write ``motion`` in the format of the path's suffix; the old file is replaced only when all is written.

    Raises UnknownNameError for a suffix without a format, InputError for a missing folder.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in FORMATS:
        raise UnknownNameError("format", suffix or target.name, FORMATS)
    importlib.import_module(FORMATS[suffix][0]).write(motion, target)
    return target


def load(path: str | os.PathLike[str]) -> Motion:
    """The motion in an .npz file written by :func:`save`."""
    from bodyplan.export import npz_file

    return npz_file.read(path)
