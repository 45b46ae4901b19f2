"""The kinematics of a motion's robot as C99 source: NAME.c and NAME.h beside it."""

from __future__ import annotations

import os
from pathlib import Path

from bodyplan.errors import InputError
from bodyplan.files import replacing
from bodyplan.motion import Motion

#: how the headers of such sources begin
_BEGINS = "/* Kinematics of the robot "


def write(motion: Motion, path: str | os.PathLike[str]) -> None:
    """Write poses, Jacobians and the velocity model of the chain ends (``robot.symbolic().c_source()``) to ``path``,
    NAME.c, and NAME.h beside it; NAME begins every name in them.

    Raises InputError where NAME.h exists and is something else, MissingExtraError without the extra "symbolic".
    """
    target = Path(path)
    header = target.with_suffix(".h")
    if header.exists() and not is_model_header(header):
        raise InputError(f"{target}: its header {header.name} would replace another file; choose another name.")
    if any(c in target.stem for c in '"\\\n'):
        raise InputError(f"{target}: a C source cannot include a header of that name.")
    made = motion.robot.symbolic().c_source(target.stem)
    source = made.source.replace(f'#include "{made.name}.h"', f'#include "{header.name}"', 1)
    for place, text in ((header, made.header), (target, source)):
        with replacing(place) as file:
            file.write(text)


def is_model_header(path: Path) -> bool:
    """Whether a file is the header of a kinematics source that bodyplan wrote."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(len(_BEGINS)) == _BEGINS.encode()
