"""One file a format. :data:`FORMATS` is the registry: a new format is one module and one line.

Loads nothing heavy: the command line's help lists the formats.
"""

from __future__ import annotations

import importlib
import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bodyplan.errors import UnknownNameError

if TYPE_CHECKING:
    from bodyplan.motion import Motion


@dataclass(frozen=True)
class Format:
    """A file format. ``name``: what a user asks for; ``suffix``: how its files end; ``module``: the one in
    ``bodyplan.export`` with ``write(motion, path, **options)``; ``about``: what it is, in a line; ``extra``: the
    extra that its libraries come with; ``aliases``: other suffixes of the same; ``infix``: put before the suffix where
    the file's name is not given, so that two files of one motion do not clash."""

    name: str
    suffix: str
    module: str
    about: str
    extra: str | None = None
    aliases: tuple[str, ...] = ()
    infix: str = ""

    @property
    def ending(self) -> str:
        """How a file is called whose name is not given, after the name of its motion."""
        return self.infix + self.suffix

    @property
    def writer(self) -> Callable[..., Any]:
        """``write(motion, path, **options)``."""
        write: Callable[..., Any] = importlib.import_module(f"bodyplan.export.{self.module}").write
        return write

    @property
    def options(self) -> dict[str, inspect.Parameter]:
        """Options of the writer that a file of this format takes, by name."""
        parameters = inspect.signature(self.writer).parameters.values()
        return {p.name: p for p in parameters if p.kind is p.KEYWORD_ONLY}


#: every format by its name
FORMATS: dict[str, Format] = {
    form.name: form
    for form in (
        Format("csv", ".csv", "csv_file", "table of the trajectory, names and units in the header"),
        Format("npz", ".npz", "npz_file", "everything; load gives an equal Motion"),
        Format("mjcf", ".xml", "mjcf", "model of robot and ground for MuJoCo", "physics"),
        Format("mcap", ".mcap", "mcap_file", "log of ROS 2 joint states and frames, for Foxglove and RViz", "ros"),
        Format("yaml", ".yaml", "joint_trajectory", "ROS 2 JointTrajectory, for a controller", aliases=(".yml",)),
        Format("glb", ".glb", "gltf", "animated glTF of robot and ground, for Blender and browsers", "gltf"),
        Format(
            "header",
            ".h",
            "c_header",
            "C99 header of the sampled trajectory, for a microcontroller",
            infix="_trajectory",
        ),
        Format("urdf", ".urdf", "urdf", "robot alone, for ROS, Pinocchio, simulators"),
        Format("c", ".c", "c_model", "C99 source and header of the robot's kinematics", "symbolic"),
    )
}


def format_named(name: str) -> Format:
    """The format called ``name``, or whose files end in it ("mjcf", "xml", ".xml"). Raises UnknownNameError."""
    word = name.lower().removeprefix(".")
    if word in FORMATS:
        return FORMATS[word]
    for form in FORMATS.values():
        if f".{word}" in (form.suffix, *form.aliases):
            return form
    endings = (s.removeprefix(".") for form in FORMATS.values() for s in (form.suffix, *form.aliases))
    raise UnknownNameError("format", name, {*FORMATS, *endings})


def format_of(path: str | os.PathLike[str]) -> Format:
    """The format whose files end like ``path``. Raises UnknownNameError."""
    target = Path(path)
    suffixes = {s: form for form in FORMATS.values() for s in (form.suffix, *form.aliases)}
    suffix = target.suffix.lower()
    if suffix not in suffixes:
        raise UnknownNameError("format", suffix or target.name, suffixes)
    return suffixes[suffix]


def save(motion: Motion, path: str | os.PathLike[str], **options: Any) -> Path:
    """Write ``motion`` in the format of the path's suffix; the old file is replaced only when all is written.

    ``options`` are those of the format's writer, for example ``dtype="double"`` of a C header. Raises
    UnknownNameError for a suffix without a format or an option that the format has not, InputError for a missing
    folder, MissingExtraError where a library of the format is not installed.
    """
    target = Path(path)
    form = format_of(target)
    write = form.writer
    for name in options:
        if name not in form.options:
            raise UnknownNameError(f"option of {form.name}", name, form.options)
    write(motion, target, **options)
    return target


def load(path: str | os.PathLike[str]) -> Motion:
    """The motion in an .npz file written by :func:`save`."""
    from bodyplan.export import npz_file

    return npz_file.read(path)
