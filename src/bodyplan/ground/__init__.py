"""Ground under, around and above a robot: heights, normals, curvatures and clearances; solids for physics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.ground.base import Ground, Solid
from bodyplan.ground.corridor import Corridor
from bodyplan.ground.heightmap import HeightMap
from bodyplan.ground.plane import Plane
from bodyplan.ground.profile import Profile
from bodyplan.ground.surface import Surface

#: every ground by its name in mission files: a new ground is one class and one line here
KINDS: dict[str, type[Ground]] = {ground.kind: ground for ground in (Plane, Surface, HeightMap, Corridor, Profile)}

__all__ = ["KINDS", "Corridor", "Ground", "HeightMap", "Plane", "Profile", "Solid", "Surface", "from_dict"]


def from_dict(data: Mapping[str, Any]) -> Ground:
    """The ground that ``data`` describes: ``kind`` (a key of :data:`KINDS`) and the arguments of its class.

    The inverse of ``ground.to_dict()``. Raises UnknownNameError for an unknown kind, InputError for
    arguments that its class refuses.
    """
    if not isinstance(data, Mapping) or "kind" not in data:
        raise InputError(f"ground: expected a table with the entry kind, got {data!r}.")
    kind = data["kind"]
    if kind not in KINDS:
        raise UnknownNameError("ground", kind, KINDS)
    arguments = {str(name): value for name, value in data.items() if name != "kind"}
    return KINDS[kind].from_arguments(arguments)
