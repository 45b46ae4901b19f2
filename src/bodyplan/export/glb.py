"""The binary glTF 2.0 container: nodes, meshes and one animation as JSON, their numbers as one block of bytes."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array

FLOAT, UINT = 5126, 5125
VERTICES, INDICES = 34962, 34963
SHAPES = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}


class Glb:
    """A scene that is filled piece by piece. Numbers are stored in single precision, as glTF keeps them.

    Rotations come in as quaternions wxyz, the house's order; glTF's is xyzw. Indices that come back name what was
    added: a node, a mesh, a material.
    """

    def __init__(self, generator: str, extras: dict[str, Any]) -> None:
        self.data: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": generator, "extras": extras},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "materials": [],
            "accessors": [],
            "bufferViews": [],
        }
        self._blob = bytearray()
        self._samplers: list[dict[str, Any]] = []
        self._channels: list[dict[str, Any]] = []

    def material(self, name: str, color: Sequence[float]) -> int:
        """A matt material; ``color`` red, green, blue, opacity, each 0 to 1 (linear)."""
        surface: dict[str, Any] = {
            "name": name,
            "pbrMetallicRoughness": {"baseColorFactor": list(color), "metallicFactor": 0.0, "roughnessFactor": 0.8},
        }
        if color[3] < 1.0:
            surface |= {"alphaMode": "BLEND", "doubleSided": True}
        return self._add("materials", surface)

    def mesh(self, name: str, vertices: ArrayLike, normals: ArrayLike, faces: ArrayLike, material: int) -> int:
        """Triangles ``faces`` (f, 3) between ``vertices`` (v, 3) m with unit ``normals`` (v, 3), seen counterclockwise
        from outside."""
        primitive = {
            "attributes": {
                "POSITION": self.numbers(vertices, VERTICES, bounds=True),
                "NORMAL": self.numbers(normals, VERTICES),
            },
            "indices": self._accessor(np.ravel(faces).astype("<u4"), 1, INDICES),
            "material": material,
        }
        return self._add("meshes", {"name": name, "primitives": [primitive]})

    def node(
        self,
        name: str,
        parent: int | None = None,
        *,
        mesh: int | None = None,
        translation: ArrayLike | None = None,
        rotation: ArrayLike | None = None,
        scale: ArrayLike | None = None,
    ) -> int:
        """A node under ``parent`` (None: a root), placed by ``translation`` (3,) m, ``rotation`` (4,) and ``scale``
        (3,)."""
        node: dict[str, Any] = {"name": name}
        if mesh is not None:
            node["mesh"] = mesh
        for key, value in (("translation", translation), ("rotation", rotation), ("scale", scale)):
            if value is not None:
                at = np.asarray(value, dtype=np.float64)
                node[key] = (np.roll(at, -1) if key == "rotation" else at).tolist()
        index = self._add("nodes", node)
        above = self.data["scenes"][0]["nodes"] if parent is None else self._children(parent)
        above.append(index)
        return index

    def times(self, t: ArrayLike) -> int:
        """Times (T,) s >= 0 of an animation's samples, to be used by any number of channels."""
        return self.numbers(t, None, bounds=True)

    def move(
        self,
        node: int,
        times: int,
        *,
        translation: Array | None = None,
        rotation: Array | None = None,
        scale: Array | None = None,
    ) -> None:
        """Move a node: values (T, 3) or (T, 4) at ``times``, linear in between (rotations along great circles)."""
        for path, values in (("translation", translation), ("rotation", rotation), ("scale", scale)):
            if values is None:
                continue
            output = self.numbers(np.roll(continuous(values), -1, axis=-1) if path == "rotation" else values, None)
            self._samplers.append({"input": times, "interpolation": "LINEAR", "output": output})
            self._channels.append({"sampler": len(self._samplers) - 1, "target": {"node": node, "path": path}})

    def pack(self) -> bytes:
        """The file."""
        data = {key: value for key, value in self.data.items() if value != []}
        data["buffers"] = [{"byteLength": len(self._blob)}]
        if self._channels:
            data["animations"] = [{"name": "motion", "samplers": self._samplers, "channels": self._channels}]
        text = json.dumps(data, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        blob = bytes(self._blob) + b"\0" * (-len(self._blob) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(blob), b"BIN\0") + blob
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def numbers(self, values: ArrayLike, target: int | None, *, bounds: bool = False) -> int:
        """Store floats (N,), (N, 3) or (N, 4); ``bounds`` tells readers the least and greatest of each column."""
        array = np.ascontiguousarray(values, dtype="<f4")
        wide = 1 if array.ndim == 1 else array.shape[1]
        index = self._accessor(array, wide, target)
        if bounds:
            columns = array.reshape(-1, wide)
            self.data["accessors"][index] |= {"min": columns.min(axis=0).tolist(), "max": columns.max(axis=0).tolist()}
        return index

    def _accessor(self, array: Any, wide: int, target: int | None) -> int:
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self._blob), "byteLength": array.nbytes}
        if target is not None:
            view["target"] = target
        self._blob += array.tobytes()
        accessor = {
            "bufferView": self._add("bufferViews", view),
            "componentType": FLOAT if array.dtype.kind == "f" else UINT,
            "count": array.size // wide,
            "type": SHAPES[wide],
        }
        return self._add("accessors", accessor)

    def _children(self, parent: int) -> list[int]:
        children: list[int] = self.data["nodes"][parent].setdefault("children", [])
        return children

    def _add(self, kind: str, item: dict[str, Any]) -> int:
        self.data[kind].append(item)
        return len(self.data[kind]) - 1


def continuous(quaternions: Array) -> Array:
    """The same rotations (T, 4), each with the sign that is nearer to the one before it."""
    turns = np.sum(quaternions[1:] * quaternions[:-1], axis=-1) < 0.0
    signs = np.concatenate([[1.0], np.cumprod(np.where(turns, -1.0, 1.0))])
    return np.asarray(quaternions * signs[:, None])
