"""What the replay in the browser needs, as JSON: shapes, poses by frame and time, ground, stages."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.robot.model import Robot
from bodyplan.show.path import planned_path
from bodyplan.show.playback import Playback
from bodyplan.show.shapes import arc_bones, bones, extent, scenery, thickness
from bodyplan.show.stages import few, lanes, shades, stages_of

#: radius of a bar that holds a ball, of the ball's
AXLE = 0.3


def scene(playback: Playback) -> dict[str, Any]:
    """The replay's data; arrays are base64 of little-endian float32."""
    robot = playback.motion.robot
    joined = bones(robot)
    frames = sorted({robot.frame_index(c.frame) for c in robot.contacts} | {i for pair in joined for i in pair} | {0})
    place = {frame: i for i, frame in enumerate(frames)}
    tracks = [p for p in (playback.planned, playback.executed) if p is not None]
    low, high = extent(tracks, robot)
    stages = stages_of(playback)
    arcs = arc_bones(robot)
    path = planned_path(playback)
    return {
        "t": packed(playback.t),
        "bodies": len(frames),
        "planned": _track(playback, playback.planned[:, frames], playback.planned_centre),
        "executed": None
        if playback.executed is None or playback.executed_centre is None
        else _track(playback, playback.executed[:, frames], playback.executed_centre),
        "shapes": _shapes(robot, place),
        # a third and fourth number make it an arc: length and radius
        "bones": [[place[a], place[b], *arcs.get((a, b), ())] for a, b in joined],
        "path": None if path is None else packed(path),
        "boneRadius": thickness(robot, playback.planned),
        "ground": _ground(playback, low, high),
        "low": low.tolist(),
        "high": high.tolist(),
        "reach": float(np.linalg.norm(np.ptp(playback.planned[0, frames, :3], axis=0))) or 0.1,
        "stages": [
            {"name": name, "start": start, "end": end, "lane": lane, "shade": shade}
            for (name, start, end), lane, shade in zip(stages, lanes(stages), shades(stages), strict=True)
        ],
        "showStages": few(stages, playback.cycles),
        "period": playback.period,
        "cycles": playback.cycles,
        "begin": float(playback.t[0]),
    }


def packed(values: Array) -> str:
    """Numbers as base64 of little-endian float32."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")


def _track(playback: Playback, poses: Array, centre: Array) -> dict[str, Any]:
    return {
        "count": len(poses),
        "poses": packed(poses),
        "centre": packed(centre),
        "advance": packed(playback.advance(centre)),
    }


def _shapes(robot: Robot, place: dict[int, int]) -> list[dict[str, Any]]:
    shapes: list[dict[str, Any]] = [
        {
            "body": place[robot.frame_index(c.frame)],
            "kind": c.shape,
            "radius": c.radius,
            "start": list(c.start),
            "end": list(c.end if c.shape == "capsule" else c.start),
            "half": list(c.half),
        }
        for c in robot.contacts
    ]
    # balls beside their frame, as feet are, would hang in the air: a bar joins them to it
    bars = [
        {**shape, "kind": "capsule", "radius": AXLE * shape["radius"], "end": [0.0, 0.0, 0.0]}
        for shape in shapes
        if shape["kind"] == "sphere" and float(np.linalg.norm(shape["start"])) > 2.0 * shape["radius"]
    ]
    return [*shapes, *bars]


def _ground(playback: Playback, low: Array, high: Array) -> dict[str, Any]:
    found = scenery(playback.motion.ground, low, high)
    return {
        "planes": [np.round(corners, 6).tolist() for corners in found.planes],
        "faces": [
            {
                "corners": np.round(f.corners, 6).tolist(),
                "normal": np.round(f.normal, 6).tolist(),
                "box": f.box,
                "role": f.role,
            }
            for f in found.faces
        ],
        "fields": [
            {"x": packed(x), "y": packed(y), "z": packed(z), "nx": len(x), "ny": len(y)} for x, y, z in found.fields
        ],
    }
