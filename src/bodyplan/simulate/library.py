"""MuJoCo, loaded when it is first needed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from bodyplan.errors import MissingExtraError


def mujoco() -> Any:
    """The ``mujoco`` module, or MissingExtraError saying how to install it."""
    try:
        import mujoco
    except ImportError as error:
        raise MissingExtraError("mujoco", "physics", "simulation") from error
    if not hasattr(mujoco, "MjSpec"):  # an empty folder is left where a part of it was uninstalled
        raise MissingExtraError("mujoco", "physics", "simulation")
    return mujoco


@contextmanager
def warnings_kept() -> Iterator[list[str]]:
    """Collect MuJoCo's warnings in a list, instead of in a log file in the working directory."""
    library, kept = mujoco(), list[str]()
    before = library.get_mju_user_warning()
    library.set_mju_user_warning(lambda text: kept.append(str(text)))
    try:
        yield kept
    finally:
        library.set_mju_user_warning(before)
