"""The scene: ground, robots, curve, footholds, forces, trail, drawn with viser at any time of the tracks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.ground.base import Ground
from bodyplan.show.live import meshes
from bodyplan.show.live.body import Body
from bodyplan.show.live.parameters import nice
from bodyplan.show.live.tracks import Snapshot, Tracks
from bodyplan.show.shapes import scenery

PLANNED, EXECUTED, CURVE = (214, 131, 16), (0, 114, 178), (0, 121, 90)
FLOOR, WALL, CEILING, LINES = (226, 230, 233), (176, 186, 194), (150, 170, 190), (176, 184, 191)
FOOTHOLD, CARRIES, FORCE = (120, 130, 140), (0, 158, 115), (204, 60, 60)
#: how much shows through walls, ceilings, and the plan beside what became of it
WALL_OPACITY, CEILING_OPACITY, GHOST = 0.35, 0.18, 0.4
#: strength of the light from all around
SKY = 0.3
#: where the camera stands (of the distance), how far it looks past the middle, to the side of the panel
FROM, ASIDE = np.array([0.38, -0.74, 0.46]), 0.16
#: farthest that the camera looks at, of the robot's size
FAR = 3.5
#: an arrow of the robot's weight, and marks on the ground, of the robot's size
WEIGHT_ARROW, MARK = 0.35, 0.012
#: height of a body curve over the middle of the body, of its radius
OVER = 1.15
#: how much more of the ground is drawn than the robot needs, of its size: re-plans seldom leave it
ROOM = 0.5


@dataclass
class Shown:
    """What the user wants to see."""

    curve: bool = True
    footholds: bool = True
    forces: bool = True
    trail: bool = True
    ceiling: bool = True
    follow: bool = False
    plan: bool = True
    beside: bool = False


class Stage:
    """Draws :class:`Tracks` into a viser server's scene."""

    def __init__(self, server: Any) -> None:
        self.server, self.scene = server, server.scene
        self.tracks: Tracks | None = None
        self._ground: tuple[Ground, Array, Array] | None = None
        self._robots: dict[str, _Robot] = {}
        self._handles: dict[str, Any] = {}
        self._roles: dict[str, list[Any]] = {}
        self._aimed = False
        # a bright surrounding would wash out the colours
        self.scene.configure_environment_map("warehouse", environment_intensity=SKY)
        self.world = self.scene.add_frame("/world", show_axes=False)
        for side in ("plan", "trial"):
            self._handles[side] = self.scene.add_frame(f"/world/{side}", show_axes=False)

    def set(self, tracks: Tracks) -> None:
        """Show other tracks."""
        low, high = tracks.box
        self.size = float(np.linalg.norm(np.ptp(tracks.planned(0.0).poses[:, :3], axis=0))) or 0.1
        self._beside = float(high[1] - low[1]) + 0.25 * self.size
        self._origin = tracks.planned(0.0).centre
        new_robot = self.tracks is None or tracks.robot != self.tracks.robot
        self.tracks = tracks
        with self.server.atomic():
            self._lay_ground(tracks.motion.ground, low, high)
            first = tracks.planned(0.0)
            if new_robot:
                self._robots = {
                    "plan": _Robot(self.scene, "/world/plan/robot", Body(tracks.robot, first.poses), PLANNED)
                }
                self._robots["plan"].draw(first)
            if tracks.trial is not None and ("trial" not in self._robots or new_robot):
                body = Body(tracks.robot, first.poses)
                self._robots["trial"] = _Robot(self.scene, "/world/trial/robot", body, EXECUTED)
            self._lay_marks(tracks)
            self._trails = {"plan": tracks.way()}
            if tracks.trial is not None:
                self._trails["trial"] = tracks.way(executed=True)
        motion = tracks.motion
        weight = tracks.robot.mass * 9.81
        if motion.forces is not None and not weight > 0.0:
            weight = float(np.linalg.norm(motion.forces, axis=-1).max(initial=0.0))
        self._newton = WEIGHT_ARROW * self.size / weight if weight > 0.0 else 0.0
        if not self._aimed:
            self._aim(0.5 * (low + high), float(np.linalg.norm(high - low)), first.centre)

    def _aim(self, middle: Array, extent: float, begin: Array) -> None:
        """Look from behind on the right, from above: at all of the motion, or where it is long at its beginning."""
        self._aimed = True
        camera = self.server.initial_camera
        reach = min(max(extent, 1.5 * self.size), FAR * self.size)
        away = float(np.linalg.norm(middle - begin))
        middle = begin + (middle - begin) * min(1.0, 0.35 * reach / away if away > 0.0 else 1.0)
        aside = np.array([-FROM[1], FROM[0], 0.0]) / np.hypot(*FROM[:2])
        middle = middle + ASIDE * reach * aside
        camera.look_at = tuple(float(v) for v in middle)
        camera.position = tuple(float(v) for v in middle + reach * FROM)

    def _lay_ground(self, ground: Ground, low: Array, high: Array) -> None:
        if self._ground is not None:
            old, a, b = self._ground
            if old == ground and np.all(low >= a) and np.all(high <= b):
                return
        room = ROOM * self.size * np.array([1.0, 1.0, 0.2])
        a, b = low - room, high + room
        self._ground = (ground, a, b)
        for handle in [h for handles in self._roles.values() for h in handles]:
            handle.remove()
        self._roles = {}
        found = scenery(ground, low - room * [1, 1, 0], high + room * [1, 1, 0])
        spacing = nice(self.size / 3.0)
        lift = 0.002 * self.size
        parts: dict[str, list[meshes.Mesh]] = {"floor": [], "wall": [], "ceiling": []}
        grid = [np.zeros((0, 2, 3))]
        for corners in found.planes:
            parts["floor"].append(meshes.polygon(corners))
            grid.append(meshes.plane_lines(corners, spacing, lift))
        for x, y, z in found.fields:
            parts["floor"].append(meshes.field(x, y, z))
            grid.append(meshes.field_lines(x, y, z, spacing, lift))
        for face in found.faces:
            parts.setdefault(face.role, []).append(meshes.polygon(face.corners))
        looks = {"floor": (FLOOR, None), "wall": (WALL, WALL_OPACITY), "ceiling": (CEILING, CEILING_OPACITY)}
        for side in ("plan", "trial"):
            for role, pieces in parts.items():
                if not pieces:
                    continue
                points, faces = meshes.joined(pieces)
                colour, opacity = looks.get(role, looks["floor"])
                handle = self.scene.add_mesh_simple(
                    f"/world/{side}/ground/{role}",
                    points,
                    faces,
                    color=colour,
                    opacity=opacity,
                    side="double",
                    flat_shading=role != "floor" or not found.fields,
                    cast_shadow=False,
                    receive_shadow=role == "floor",
                    visible=side == "plan",
                )
                self._roles.setdefault(f"{side} {role}", []).append(handle)
            segments = np.concatenate(grid)
            if len(segments):
                handle = self.scene.add_line_segments(
                    f"/world/{side}/ground/lines",
                    segments,
                    LINES,
                    thickness=1.0,
                    thickness_units="screen",
                    visible=side == "plan",
                )
                self._roles.setdefault(f"{side} floor", []).append(handle)

    def _lay_marks(self, tracks: Tracks) -> None:
        """Footholds of the whole motion."""
        for name in ("footholds", "arrows", "carrying", "curve", "trail plan", "trail trial"):
            old = self._handles.pop(name, None)
            if old is not None:
                old.remove()
        mark = MARK * self.size
        feet = tracks.footholds
        if len(feet):
            points, faces = meshes.cylinder()
            self._handles["footholds"] = self.scene.add_batched_meshes_simple(
                "/world/plan/footholds",
                points,
                faces,
                np.tile([1.0, 0.0, 0.0, 0.0], (len(feet), 1)),
                feet,
                batched_scales=np.tile([2.0 * mark, 2.0 * mark, 0.5 * mark], (len(feet), 1)),
                batched_colors=FOOTHOLD,
                lod="off",
                cast_shadow=False,
            )

    # --- at a time

    def draw(self, time: float, shown: Shown) -> None:
        """Draw everything as it is at a time."""
        tracks = self.tracks
        if tracks is None:
            return
        now, then = tracks.planned(time), tracks.executed(time)
        with self.server.atomic():
            plan = self._robots["plan"]
            plan.show(shown.plan or then is None, GHOST if then is not None and not shown.beside else None)
            plan.draw(now)
            trial = self._robots.get("trial")
            if trial is not None:
                trial.show(then is not None, None)
                if then is not None:
                    trial.draw(then)
            apart = self._beside if shown.beside and then is not None else 0.0
            self._handles["trial"].position = (0.0, apart, 0.0)
            for name, handles in self._roles.items():
                side, role = name.split(" ")
                for handle in handles:
                    handle.visible = (side == "plan" or apart > 0.0) and (role != "ceiling" or shown.ceiling)
            self._draw_contacts(time, now, shown)
            self._draw_curve(time, shown)
            self._draw_trails(time, shown, then is not None)
            if "footholds" in self._handles:
                self._handles["footholds"].visible = shown.footholds
            away = (then if then is not None and not shown.beside else now).centre - self._origin
            self.world.position = (-away[0], -away[1], 0.0) if shown.follow else (0.0, 0.0, 0.0)

    def _draw_contacts(self, time: float, now: Snapshot, shown: Shown) -> None:
        tracks = self.tracks
        assert tracks is not None
        if tracks.motion.contacts is None:
            return
        points, forces = tracks.touching(time, now)
        count, mark = len(tracks.robot.contacts), MARK * self.size
        places, scales = np.zeros((count, 3)), np.zeros((count, 3))
        places[: len(points)], scales[: len(points)] = points, mark
        if "carrying" not in self._handles:
            corners, faces = meshes.sphere()
            self._handles["carrying"] = self.scene.add_batched_meshes_simple(
                "/world/plan/contacts",
                corners,
                faces,
                np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
                places,
                batched_scales=scales,
                batched_colors=CARRIES,
                lod="off",
                cast_shadow=False,
            )
        dots = self._handles["carrying"]
        dots.batched_positions, dots.batched_scales, dots.visible = places, scales, shown.footholds
        if tracks.motion.forces is None or not self._newton:
            return
        arrows = np.stack([points, points + self._newton * forces], axis=1)
        arrows = arrows[np.linalg.norm(forces, axis=-1) * self._newton > 0.5 * mark]
        if not len(arrows):
            arrows = np.zeros((1, 2, 3))
        if "arrows" not in self._handles:
            self._handles["arrows"] = self.scene.add_arrows(
                "/world/plan/forces",
                arrows,
                FORCE,
                shaft_radius=0.35 * mark,
                head_radius=0.9 * mark,
                head_length=2.2 * mark,
            )
        handle = self._handles["arrows"]
        handle.points, handle.visible = arrows, shown.forces and bool(np.any(arrows))

    def _draw_curve(self, time: float, shown: Shown) -> None:
        tracks = self.tracks
        assert tracks is not None
        points = tracks.curve(time) if shown.curve else None
        if points is not None and len(points) > 1:
            over = max((c.radius for c in tracks.robot.contacts if c.shape == "capsule"), default=0.0)
            raised = points + np.array([0.0, 0.0, OVER * over])  # inside the body nobody would see it
            self._line("curve", "/world/plan/curve", raised, CURVE, 4.0)
        elif "curve" in self._handles:
            self._handles["curve"].visible = False

    def _draw_trails(self, time: float, shown: Shown, executed: bool) -> None:
        for side, colour in (("plan", PLANNED), ("trial", EXECUTED)):
            name = f"trail {side}"
            if shown.trail and side in self._trails and (side == "plan" or executed):
                times, places = self._trails[side]
                done = int(np.searchsorted(times, time, side="right"))
                if done > 1:
                    self._line(name, f"/world/{side}/trail", places[:done], colour, 2.0)
                    continue
            if name in self._handles:
                self._handles[name].visible = False

    def _line(self, name: str, path: str, points: Array, colour: tuple[int, int, int], thick: float) -> None:
        segments = meshes.lines(points)
        if name not in self._handles:
            self._handles[name] = self.scene.add_line_segments(
                path, segments, colour, thickness=thick, thickness_units="screen"
            )
        handle = self._handles[name]
        handle.points, handle.visible = segments, True


class _Robot:
    """One robot in the scene: a batch of instances a unit shape."""

    def __init__(self, scene: Any, path: str, body: Body, colour: tuple[int, int, int]) -> None:
        self._scene, self._path, self._body, self._colour = scene, path, body, colour
        self._handles: dict[str, Any] = {}
        self._visible = True
        self._opacity: float | None = None

    def draw(self, now: Snapshot) -> None:
        for shape, found in self._body.at(now).items():
            if shape not in self._handles:
                points, faces = getattr(meshes, shape)()
                self._handles[shape] = self._scene.add_batched_meshes_simple(
                    f"{self._path}/{shape}",
                    points,
                    faces,
                    found.turns,
                    found.positions,
                    batched_scales=found.scales,
                    batched_colors=self._colour,
                    opacity=self._opacity,
                    lod="off",
                    visible=self._visible,
                )
                continue
            handle = self._handles[shape]
            handle.batched_positions, handle.batched_wxyzs = found.positions, found.turns
            handle.batched_scales = found.scales

    def show(self, visible: bool, opacity: float | None) -> None:
        if (visible, opacity) == (self._visible, self._opacity):
            return
        self._visible, self._opacity = visible, opacity
        for handle in self._handles.values():
            handle.visible, handle.opacity = visible, opacity
