"""Motion as NPZ: everything, so that reading it back gives an equal Motion. No pickles."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from bodyplan import ground as grounds
from bodyplan.errors import InputError
from bodyplan.files import replacing
from bodyplan.motion import Claim, Motion
from bodyplan.robot.model import Robot

FORMAT = "bodyplan motion 1"
_ARRAYS = ("t", "base", "q", "qd", "qdd", "residual", "status")
_OPTIONAL = ("contacts", "forces", "torques")
_ARRAY_KEY = "array:"


def write(motion: Motion, path: str | os.PathLike[str]) -> None:
    """Write ``motion`` to ``path``."""
    arrays = {name: getattr(motion, name) for name in _ARRAYS}
    arrays |= {name: getattr(motion, name) for name in _OPTIONAL if getattr(motion, name) is not None}
    about = {
        "format": FORMAT,
        "robot": motion.robot.to_dict(),
        "ground": motion.ground.to_dict(),
        "gait": dict(motion.gait),
        "claims": [
            {"kind": c.kind, "label": c.label, "data": _pack(c.data, f"claim{i}", arrays)}
            for i, c in enumerate(motion.claims)
        ],
        "facts": dict(motion.facts),
        "stages": motion.stages,
        "notes": motion.notes,
    }
    arrays["about"] = np.array(json.dumps(about))
    with replacing(path, "wb") as file:
        np.savez_compressed(file, **arrays)


def read(path: str | os.PathLike[str]) -> Motion:
    """Read a motion back. Raises InputError for a file that is not one."""
    if not Path(path).is_file():
        raise InputError(f"{path}: no such file.")
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
        about = json.loads(str(arrays["about"]))
        if about["format"] != FORMAT:
            raise KeyError("format")
    except (OSError, ValueError, KeyError, BadZipFile) as error:
        raise InputError(f"{path}: is not a bodyplan motion ({FORMAT}).") from error
    return Motion(
        robot=Robot.from_dict(about["robot"]),
        ground=grounds.from_dict(about["ground"]),
        gait=about["gait"],
        claims=tuple(Claim(c["kind"], c["label"], _unpack(c["data"], arrays)) for c in about["claims"]),
        facts=about["facts"],
        stages=tuple((a, b, c) for a, b, c in about["stages"]),
        notes=tuple(about["notes"]),
        **{name: arrays[name] for name in _ARRAYS},
        **{name: arrays[name] for name in _OPTIONAL if name in arrays},
    )


def _pack(value: Any, place: str, arrays: dict[str, Any]) -> Any:
    if isinstance(value, np.ndarray):
        arrays[place] = value
        return _ARRAY_KEY + place
    if isinstance(value, Mapping):
        return {k: _pack(v, f"{place}.{k}", arrays) for k, v in value.items()}
    if isinstance(value, list):
        return [_pack(v, f"{place}.{i}", arrays) for i, v in enumerate(value)]
    return value


def _unpack(value: Any, arrays: Mapping[str, Any]) -> Any:
    if isinstance(value, str) and value.startswith(_ARRAY_KEY):
        return arrays[value.removeprefix(_ARRAY_KEY)]
    if isinstance(value, dict):
        return {k: _unpack(v, arrays) for k, v in value.items()}
    if isinstance(value, list):
        return [_unpack(v, arrays) for v in value]
    return value
