"""A reader of animated .glb files after the specification of glTF 2.0, in a few lines: what tests measure with."""

from __future__ import annotations

import json
import struct
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

TYPES = {5126: np.dtype("<f4"), 5125: np.dtype("<u4")}
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}
REST = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}


class Read:
    """A .glb file: nodes by name, meshes, and where everything is at a time."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        magic, number, size, length, kind = struct.unpack("<4sIII4s", data[:20])
        assert (magic, number, size, kind, length % 4) == (b"glTF", 2, len(data), b"JSON", 0)
        self.json: dict[str, Any] = json.loads(data[20 : 20 + length])
        rest, kind = struct.unpack("<I4s", data[20 + length : 28 + length])
        assert kind == b"BIN\0" and 28 + length + rest == len(data) and rest % 4 == 0
        self.blob = data[28 + length :]
        assert rest - 3 <= self.json["buffers"][0]["byteLength"] <= rest
        self.nodes: list[dict[str, Any]] = self.json["nodes"]
        self.names = [node["name"] for node in self.nodes]
        assert len(set(self.names)) == len(self.names)
        (self.animation,) = self.json["animations"]

    def numbers(self, accessor: int) -> np.ndarray:
        a = self.json["accessors"][accessor]
        view = self.json["bufferViews"][a["bufferView"]]
        kind, wide = TYPES[a["componentType"]], WIDTHS[a["type"]]
        assert view["byteLength"] == a["count"] * wide * kind.itemsize and view["byteOffset"] % 4 == 0
        out = np.frombuffer(self.blob, kind, a["count"] * wide, view["byteOffset"]).reshape(-1, wide)
        if "min" in a:
            np.testing.assert_array_equal(a["min"], out.min(axis=0))
            np.testing.assert_array_equal(a["max"], out.max(axis=0))
        return out[:, 0] if wide == 1 else out

    @cached_property
    def tracks(self) -> dict[tuple[int, str], tuple[np.ndarray, np.ndarray]]:
        """(times, values) by node and path."""
        out = {}
        for channel in self.animation["channels"]:
            sampler = self.animation["samplers"][channel["sampler"]]
            assert sampler["interpolation"] == "LINEAR" and "min" in self.json["accessors"][sampler["input"]]
            key = (channel["target"]["node"], channel["target"]["path"])
            assert key not in out
            out[key] = (self.numbers(sampler["input"]), self.numbers(sampler["output"]))
        return out

    @cached_property
    def parents(self) -> dict[int, int]:
        return {child: i for i, node in enumerate(self.nodes) for child in node.get("children", ())}

    def value(self, node: int, path: str, t: float | None) -> np.ndarray:
        """A part of a node's placement; of the file at rest where ``t`` is None."""
        if t is None or (node, path) not in self.tracks:
            return np.array(self.nodes[node].get(path, REST[path]), dtype=np.float64)
        times, values = (v.astype(np.float64) for v in self.tracks[node, path])
        if path == "rotation":
            return Slerp(times, Rotation.from_quat(values))(np.clip(t, times[0], times[-1])).as_quat()
        return np.array([np.interp(t, times, column) for column in values.T])

    def world(self, name: str, t: float | None) -> np.ndarray:
        """(4, 4) of a node in glTF's world."""
        out, node = np.eye(4), self.names.index(name)
        while True:
            local = np.eye(4)
            local[:3, :3] = Rotation.from_quat(self.value(node, "rotation", t)).as_matrix() * self.value(
                node, "scale", t
            )
            local[:3, 3] = self.value(node, "translation", t)
            out = local @ out
            if node not in self.parents:
                assert node in self.json["scenes"][0]["nodes"]
                return out
            node = self.parents[node]

    def mesh(self, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Vertices, normals and faces of a node's mesh, in the node."""
        (part,) = self.json["meshes"][self.nodes[self.names.index(name)]["mesh"]]["primitives"]
        places, normals = (self.numbers(part["attributes"][key]) for key in ("POSITION", "NORMAL"))
        faces = self.numbers(part["indices"]).reshape(-1, 3)
        assert places.shape == normals.shape and faces.max() < len(places)
        return places.astype(np.float64), normals.astype(np.float64), faces.astype(np.int64)

    def points(self, name: str, t: float | None) -> np.ndarray:
        """Vertices of a node's mesh in the house's world, z up."""
        T = self.world(name, t)
        return z_up(self.mesh(name)[0] @ T[:3, :3].T + T[:3, 3])


def z_up(points: np.ndarray) -> np.ndarray:
    """Points of glTF's world (y up) in the house's (z up)."""
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1)
