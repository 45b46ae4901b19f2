"""MJCF, read through MuJoCo's own compiler: defaults, includes, units of angles, inertia from geoms are as it says."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import InputError, MissingExtraError, UnknownNameError
from bodyplan.robot.drive_text import located
from bodyplan.robot.elements import Body, Contact, Joint
from bodyplan.robot.files import read_text
from bodyplan.robot.reading.couplings import Couplings
from bodyplan.robot.reading.pruning import pruned
from bodyplan.robot.reading.rows import Screw, along, axis_frame
from bodyplan.robot.reading.shapes import Shape
from bodyplan.robot.reading.tree import Link, Parts, Tree, parts_of, unique
from bodyplan.spatial.rotations import matrix_from_quaternion

#: per joint: a constant, and the joints that add to it
Drives = Sequence[tuple[float, tuple[Joint, ...]]]
#: mass (kg, kg m^2) that bodies get whose meshes are missing; MuJoCo needs more than 1e-15
SPECK = 1e-14


def read_mjcf(
    path: str | os.PathLike[str],
    root: str | None = None,
    ends: Sequence[str] | None = None,
    contacts: Sequence[Contact] | None = None,
) -> Parts:
    """Arguments of Robot from an MJCF file (:meth:`bodyplan.robot.model.Robot.from_mjcf`). InputError names the file
    and the body, joint or constraint; MissingExtraError without MuJoCo."""
    try:
        import mujoco
    except ImportError as error:
        raise MissingExtraError("mujoco", "physics", "reading MJCF") from error
    read_text(path)
    with located(str(path)):
        try:
            model = _quietly(mujoco, lambda: _compiled(mujoco, lambda: mujoco.MjSpec.from_file(os.fspath(path))))
        except ValueError as error:
            raise InputError(f"MuJoCo cannot read it: {' '.join(str(error).split())}") from error
        tree = _Reader(mujoco, model).tree(root, Path(path).stem)
        return parts_of(tree if ends is None else pruned(tree, ends), contacts)


def _quietly(mj: Any, work: Any) -> Any:
    """What ``work()`` returns; MuJoCo's warnings of the initial pose go into no log file in the working directory."""
    before = mj.get_mju_user_warning()
    mj.set_mju_user_warning(lambda text: None)
    try:
        return work()
    finally:
        mj.set_mju_user_warning(before)


def _compiled(mj: Any, read: Any) -> Any:
    """The model; without its meshes, textures and height fields where their files are missing."""
    try:
        return read().compile()
    except ValueError as error:
        spec = read()
        if not (spec.meshes or spec.textures or spec.hfields or spec.skins):
            raise
        kinds = mj.mjtGeom
        unread = {int(kind) for kind in (kinds.mjGEOM_MESH, kinds.mjGEOM_SDF, kinds.mjGEOM_HFIELD)}
        for geom in list(spec.geoms):
            geom.material = ""
            if geom.meshname or int(geom.type) in unread:
                spec.delete(geom)
        for asset in [*spec.pairs, *spec.skins, *spec.meshes, *spec.hfields, *spec.materials, *spec.textures]:
            spec.delete(asset)
        spec.compiler.boundmass = spec.compiler.boundinertia = SPECK
        try:
            return spec.compile()
        except ValueError:
            raise error from None


class _Reader:
    def __init__(self, mj: Any, model: Any) -> None:
        self.mj, self.model = mj, model
        self.bodies = unique(model.body(i).name or f"body{i}" for i in range(model.nbody))
        owners = [self.bodies[b] for b in model.jnt_bodyid]
        self.joints = unique(
            (model.joint(i).name or f"{owner}.joint").replace("/", ".") for i, owner in enumerate(owners)
        )

    def tree(self, root: str | None, stem: str) -> Tree:
        model = self.model
        top = self._top(root)
        free = top is not None and self._free(top)
        inside = [
            i
            for i in range(1, model.nbody)
            if (model.body_rootid[i] == top if top is not None else model.body_mocapid[model.body_rootid[i]] < 0)
        ]
        if not inside:
            raise InputError("has no bodies.")
        for j in range(model.njnt):
            if model.jnt_bodyid[j] in inside and model.jnt_type[j] == self.mj.mjtJoint.mjJNT_BALL:
                raise InputError(
                    f"joint {self.joints[j]!r}: is a ball joint, which has no joint coordinates; write it as three "
                    "hinges."
                )
        drives = Couplings(self.mj, model, self.joints, set(inside)).drives()
        shapes = self._shapes(inside)
        links = tuple(
            Link(
                self.bodies[i],
                self.bodies[p] if (p := int(model.body_parentid[i])) else None,
                *self._moves(i, drives),
                body=self._body(i),
                shapes=shapes[i],
            )
            for i in inside
            if not (free and i == top)
        )
        name = str(model.names[: model.names.index(b"\0")], "utf-8").strip()
        name = stem if name in ("", "MuJoCo Model") else name
        if not free or top is None:
            return Tree(name, links)
        return Tree(name, links, self.bodies[top], self._body(top), shapes[top])

    def _top(self, root: str | None) -> int | None:
        """The body that stands for the robot; None: all bodies do, on the world."""
        model = self.model
        tops = [i for i in range(1, model.nbody) if model.body_parentid[i] == 0]
        if root is not None:
            names = {self.bodies[i]: i for i in tops}
            if root not in names:
                raise UnknownNameError("body on the world", root, names, where="root")
            return names[root]
        moving = {int(model.body_rootid[b]) for b in model.jnt_bodyid}
        free = [i for i in tops if self._free(i)]
        if not free:
            return None
        if len(moving) > 1:
            names = {self.bodies[i]: i for i in sorted(moving)}
            raise InputError(
                f"has several bodies that move by themselves, {', '.join(map(repr, names))}; say with root which of "
                "them is the robot."
            )
        return free[0]

    def _free(self, body: int) -> bool:
        first = self.model.body_jntadr[body]
        return bool(first >= 0 and self.model.jnt_type[first] == self.mj.mjtJoint.mjJNT_FREE)

    def _moves(self, body: int, drives: Drives) -> tuple[tuple[Screw, ...], Array]:
        """Screws from the parent body to this one. A joint turns the body about a point of its own by the difference
        between its coordinate and that of the model's initial pose."""
        model = self.model
        pending = _place(model.body_pos[body], model.body_quat[body])
        screws = []
        first = int(model.body_jntadr[body])
        for j in range(first, first + int(model.body_jntnum[body])):
            turns = model.jnt_type[j] == self.mj.mjtJoint.mjJNT_HINGE
            turned, sign = axis_frame(model.jnt_axis[j])
            there = np.eye(4)
            there[:3, :3] = turned
            if turns:
                there[:3, 3] = model.jnt_pos[j]
            back = np.eye(4)
            back[:3, :3], back[:3, 3] = turned.T, -turned.T @ there[:3, 3]
            constant, leaders = drives[j]
            amount = sign * (constant - float(model.qpos0[model.jnt_qposadr[j]]))
            pending = pending @ there
            for leader in leaders:
                screws.append(Screw(pending, replace(leader, offset=amount, scale=sign * leader.scale), turns))
                pending, amount = np.eye(4), 0.0
            pending = pending @ along(amount, turns) @ back
        return tuple(screws), pending

    def _body(self, i: int) -> Body | None:
        model = self.model
        mass = float(model.body_mass[i])
        if mass <= SPECK * 1.01:
            return None
        moments = model.body_inertia[i]
        x, y, z = model.body_ipos[i].tolist()
        if not moments.any():
            return Body(mass=mass, com=(x, y, z))
        R = matrix_from_quaternion(model.body_iquat[i])
        moment = (R * moments) @ R.T
        inertia = (*np.diag(moment).tolist(), float(moment[0, 1]), float(moment[0, 2]), float(moment[1, 2]))
        return Body(mass=mass, com=(x, y, z), inertia=inertia)

    def _shapes(self, inside: Sequence[int]) -> dict[int, tuple[Shape, ...]]:
        """Primitive shapes of every body that can touch something."""
        found = list(self._geoms(set(inside)))
        names = unique(name for _, name, _, _ in found)
        out: dict[int, tuple[Shape, ...]] = dict.fromkeys(inside, ())
        for (g, _, kind, sizes), name in zip(found, names, strict=True):
            body, friction = int(self.model.geom_bodyid[g]), float(self.model.geom_friction[g, 0])
            place = _place(self.model.geom_pos[g], self.model.geom_quat[g])
            out[body] += (Shape(name, kind, sizes, place, friction),)
        return out

    def _geoms(self, inside: set[int]) -> Iterator[tuple[int, str, str, tuple[float, ...]]]:
        model, kinds = self.model, self.mj.mjtGeom
        paired = {int(g) for pair in (model.pair_geom1, model.pair_geom2) for g in pair}
        for g in range(model.ngeom):
            body = int(model.geom_bodyid[g])
            touches = model.geom_contype[g] or model.geom_conaffinity[g] or g in paired
            if body not in inside or not touches:
                continue
            name = model.geom(g).name.replace("/", ".") or self.bodies[body].replace("/", ".")
            x, y, z = model.geom_size[g].tolist()
            kind = model.geom_type[g]
            if kind == kinds.mjGEOM_SPHERE:
                yield g, name, "sphere", (x,)
            elif kind == kinds.mjGEOM_BOX:
                yield g, name, "box", (x, y, z)
            elif kind == kinds.mjGEOM_CAPSULE:
                yield g, name, "capsule", (x, 2.0 * y)
            elif kind == kinds.mjGEOM_CYLINDER:
                yield g, name, "cylinder", (x, 2.0 * y)


def _place(position: Array, quaternion: Array) -> Array:
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = matrix_from_quaternion(quaternion), position
    return out
