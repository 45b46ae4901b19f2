"""The one model under every robot: a floating base and chains of D-H rows and arcs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from bodyplan.arrays import Array, frozen
from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot import batch, describe, files
from bodyplan.robot.assemble import assemble, declare
from bodyplan.robot.drive_text import located
from bodyplan.robot.elements import (
    Arc,
    Body,
    Chain,
    Contact,
    Element,
    Joint,
    Row,
    joint_kinds,
    joint_properties,
)
from bodyplan.robot.forward_kernel import forward_kernel
from bodyplan.robot.poses import Poses
from bodyplan.robot.reach import Reach, reach
from bodyplan.robot.rows import arc_matrices, row_matrices
from bodyplan.robot.tables import Paths, Tables, build_paths, build_tables

if TYPE_CHECKING:
    from bodyplan.robot.symbolic import SymbolicRobot


@dataclass(frozen=True, repr=False)
class Robot:
    """A robot: a floating base and chains of elements; immutable, equal by value, its arrays read-only.

    ``chains``: tuple of :class:`Chain`. ``contacts``: shapes on frames that may touch the ground.
    ``base_body``: mass carried by the base. Joint coordinates are ordered chain by chain, element by element,
    variable by variable (theta, d, a, epsilon; pitch, yaw), each joint where it first appears. Frames are
    ``"base"`` and then the end of every element in chain order.

    Raises InputError or UnknownNameError: names used twice, reserved names, a parent that is not a frame of
    an earlier chain, a contact on a frame that does not exist, a joint described in contradictory ways.
    """

    name: str
    chains: tuple[Chain, ...]
    contacts: tuple[Contact, ...] = ()
    base_body: Body | None = None

    def __post_init__(self) -> None:
        chains, contacts = assemble(self.name, self.chains, self.contacts, self.base_body)
        object.__setattr__(self, "chains", chains)
        object.__setattr__(self, "contacts", contacts)

    @classmethod
    def from_rows(
        cls,
        rows: Mapping[str, Sequence[Row | Arc]],
        *,
        parents: Mapping[str, str] | None = None,
        contacts: Sequence[Contact] = (),
        base_body: Body | None = None,
        name: str = "robot",
        joints: Sequence[Joint | str] | None = None,
    ) -> Robot:
        """A robot from lists of elements by chain name.

        ``parents``: the frame a chain starts from, ``"base"`` where not given. ``joints`` declares the joints
        (names, or :class:`Joint` with limits, rate, effort, actuated): every joint used must then be
        declared, and a declared joint must drive something.
        """
        if not isinstance(rows, Mapping):
            raise InputError(f"rows: expected a mapping from chain name to rows, got {type(rows).__name__}.")
        parents = dict(parents or {})
        for chain in parents:
            if chain not in rows:
                raise UnknownNameError("chain", chain, rows, where="parents")
        chains = tuple(
            Chain(chain, items, parents.get(chain, "base"))  # type: ignore[arg-type]  # Chain makes the tuple
            for chain, items in rows.items()
        )
        if joints is not None:
            chains = declare(chains, joints)
        return cls(name, chains, tuple(contacts), base_body)

    # --- names and properties -------------------------------------------------------------------------------

    @cached_property
    def _joints(self) -> dict[str, Joint]:
        return dict(joint_properties(self.chains))

    @cached_property
    def joints(self) -> tuple[str, ...]:
        """Names of the n joint coordinates, in the order of the columns of q."""
        return tuple(self._joints)

    @property
    def n(self) -> int:
        """Number of joint coordinates."""
        return len(self.joints)

    @cached_property
    def joint_info(self) -> tuple[Joint, ...]:
        """Properties of every joint (offset 0, scale 1)."""
        return tuple(self._joints.values())

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """ "angle" (rad) or "length" (m) for every joint."""
        return tuple(joint_kinds(self.chains).values())

    @cached_property
    def frames(self) -> tuple[str, ...]:
        """Names of the F frames: "base", then the end of every element in chain order."""
        return ("base", *(chain.frame_name(i) for chain in self.chains for i in range(len(chain.elements))))

    @cached_property
    def ends(self) -> tuple[int, ...]:
        """Index in ``frames`` of the last frame of every chain."""
        return tuple(int(i) for i in np.cumsum([len(chain.elements) for chain in self.chains]))

    @cached_property
    def elements(self) -> tuple[Element, ...]:
        """All elements; the one at index i ends in frame i + 1."""
        return tuple(element for chain in self.chains for element in chain.elements)

    @cached_property
    def limits(self) -> Array:
        """(n, 2) lowest and highest q, rad or m; -inf and inf where there is none."""
        return frozen(np.reshape([j.limits or (-np.inf, np.inf) for j in self.joint_info], (-1, 2)))

    @cached_property
    def rates(self) -> Array:
        """(n,) largest |dq/dt|, rad/s or m/s; inf where there is none."""
        return frozen([np.inf if j.rate is None else j.rate for j in self.joint_info])

    @cached_property
    def efforts(self) -> Array:
        """(n,) largest actuator torque N m or force N; inf where there is none."""
        return frozen([np.inf if j.effort is None else j.effort for j in self.joint_info])

    @cached_property
    def actuated(self) -> Any:
        """(n,) True where the joint has an actuator."""
        out = np.array([j.actuated for j in self.joint_info], dtype=bool)
        out.flags.writeable = False
        return out

    @cached_property
    def mass(self) -> float:
        """Total mass of all bodies, kg."""
        bodies = [self.base_body, *(element.body for element in self.elements)]
        return float(sum(body.mass for body in bodies if body is not None))

    @cached_property
    def _frame_of(self) -> dict[str, int]:
        index = {name: i for i, name in enumerate(self.frames)}
        return index | {chain.name: end for chain, end in zip(self.chains, self.ends, strict=True)}

    def frame_index(self, name: str) -> int:
        """Index in ``frames`` of a frame, or of the end frame of a chain; UnknownNameError otherwise."""
        if name not in self._frame_of:
            raise UnknownNameError("frame", name, self._frame_of)
        return self._frame_of[name]

    def joint_index(self, name: str) -> int:
        """Column of a joint in q; UnknownNameError otherwise."""
        if name not in self._column:
            raise UnknownNameError("joint", name, self.joints)
        return self._column[name]

    # --- kinematics -----------------------------------------------------------------------------------------

    def vector(self, q: ArrayLike | Mapping[str, ArrayLike]) -> Array:
        """Joint coordinates as an array (..., n): from such an array, or from a mapping of every joint name
        to values that broadcast. InputError where the shape is wrong, a joint is missing or a value is not
        finite, UnknownNameError for a name that is no joint."""
        return batch.joint_array(q, self.joints)

    def forward(self, q: ArrayLike | Mapping[str, ArrayLike], base: ArrayLike | None = None) -> Poses:
        """Poses (..., F, 7) of every frame, "base" first.

        ``q`` (..., n) rad or m; ``base`` (..., 7) pose of the base in the world (position m, unit quaternion
        wxyz), broadcast against ``q``; the identity when None.
        """
        q = batch.joint_array(q, self.joints, kernel_checks=True)
        shape, flat, pose = batch.flatten(q, base)
        size, F = int(np.prod(shape, dtype=np.int64)), len(self.frames)
        pose = pose if len(pose) else batch.IDENTITY_POSE
        out = np.empty((size, F, 7))

        def kernel(first: int, last: int) -> int:
            base_part = pose if len(pose) == 1 else pose[first:last]
            part = flat[first * self.n : last * self.n]
            return int(forward_kernel(last - first, part, base_part, *self._tables, out[first:last]))

        batch.run(q, size, kernel)
        return Poses(out.reshape(*shape, F, 7), self.frames, self._frame_of)

    def velocity_model(self, q: ArrayLike | Mapping[str, ArrayLike]) -> tuple[Array, Array]:
        """(P (..., 6m, 6), Q (..., 6m, n)) of paper *legs* eq. (9) for the m chain ends.

        Body-fixed twists (v, omega): ``V_ends = P V_base + Q dq/dt``, six rows a chain in chain order, each
        in the axes of that end frame, V_base in those of the base. P = D_n ... D_1 per chain (the paper
        prints the opposite order). A chain that hangs on another has the columns of its parent's joints too.
        """
        return self.ends_and_jacobians(q).velocity_model()

    def jacobian(self, q: ArrayLike | Mapping[str, ArrayLike], frame: str, *, reference: str = "body") -> Array:
        """(..., 6, n) twist (v, omega) of ``frame`` per unit joint rate, for a base at rest.

        ``reference``: "body", in the axes of the frame (the rows of Q); "world", the same twist in the axes
        of the base (v is still the velocity of the frame's origin). A chain name stands for its end frame.
        """
        if reference not in ("body", "world"):
            raise InputError(f"reference: must be 'body' or 'world', got {reference!r}.")
        at = self.ends_and_jacobians(q, frames=(frame,))
        J = at.stacked()
        if reference == "world":
            R = at.rotations[..., 0, :, :]
            J = np.concatenate([R @ J[..., :3, :], R @ J[..., 3:, :]], axis=-2)
        return J

    def ends_and_jacobians(
        self,
        q: ArrayLike | Mapping[str, ArrayLike],
        base: ArrayLike | None = None,
        *,
        frames: Sequence[str] | None = None,
        out: Reach | None = None,
    ) -> Reach:
        """Poses and compact body-fixed Jacobians of the chain ends (or ``frames``) in one pass: the fast way.

        See :class:`Reach` for the layout; ``base`` as in :meth:`forward`. ``out``: an earlier result for the
        same frames and batch shape, to be overwritten and returned: no memory is claimed.
        """
        paths = self._end_paths if frames is None else self._paths(tuple(frames))
        return reach(paths, q, base, out)

    def element_matrices(self, q: ArrayLike | Mapping[str, ArrayLike], frame: str) -> tuple[Array, Array]:
        """(D (..., 6, 6), E (..., 6, 4 or 2)) of the element that ends in ``frame``: paper *legs* eqs.
        (2)-(4), columns of E for theta, d, a, epsilon of a row; pitch, yaw of an arc."""
        index = self.frame_index(frame)
        if index == 0:
            raise InputError("frame: no element ends in 'base'.")
        element, q = self.elements[index - 1], self.vector(q)
        values = [batch.variable(getattr(element, field), q, self._column) for field in element.VARIABLES]
        return arc_matrices(element.length, *values) if isinstance(element, Arc) else row_matrices(*values)

    def symbolic(self) -> SymbolicRobot:
        """The same model in SymPy symbols named like the joints: ``.P``, ``.Q``, ``.D(frame)``, ``.E(frame)``,
        ``.forward(frame)``, ``.jacobian(frame)``, and as text ``.latex()``, ``.python()``, ``.c_source()`` (C99).
        MissingExtraError without the extra "symbolic"."""
        from bodyplan.robot.symbolic import SymbolicRobot

        return SymbolicRobot(self)

    @cached_property
    def _column(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.joints)}

    @cached_property
    def _tables(self) -> Tables:
        return build_tables(self.chains, self.frames, self._column)

    @cached_property
    def _end_paths(self) -> Paths:
        return build_paths(self._tables, self.ends, self.joints)

    @cached_property
    def _path_cache(self) -> dict[tuple[str, ...], Paths]:
        return {}

    def _paths(self, frames: tuple[str, ...]) -> Paths:
        if frames not in self._path_cache:
            self._path_cache[frames] = build_paths(
                self._tables, tuple(self.frame_index(f) for f in frames), self.joints
            )
        return self._path_cache[frames]

    # --- as data --------------------------------------------------------------------------------------------

    def to_dict(self) -> dict[str, Any]:
        """JSON-able description; :meth:`from_dict` gives an equal robot back."""
        return describe.robot_to_dict(self.name, self.chains, self.joint_info, self.contacts, self.base_body)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Robot:
        """The robot that :meth:`to_dict` described; InputError naming the field that is wrong."""
        return cls(*describe.robot_from_dict(data))

    @classmethod
    def from_toml(cls, path: str | os.PathLike[str]) -> Robot:
        """The robot in a TOML file: fields as in :meth:`to_dict`; numbers may carry units ("240 mm") and
        variables may be drives as text ("knee + 90 deg"). InputError names the file and the entry."""
        parts = files.read_toml(path)
        with located(str(path)):
            return cls(*parts)

    def to_toml(self, path: str | os.PathLike[str]) -> None:
        """Write the robot as TOML; :meth:`from_toml` gives an equal robot back."""
        files.write_toml(self.to_dict(), path)

    @classmethod
    def from_table(cls, path: str | os.PathLike[str], *, contacts: Sequence[Contact] = ()) -> Robot:
        """The robot in a CSV table of D-H rows (see :func:`bodyplan.robot.files.read_table` for the columns),
        named like the file. InputError names file, line and column."""
        name, chains = files.read_table(path)
        with located(str(path)):
            return cls(name, chains, tuple(contacts))

    from_csv = from_table

    @classmethod
    def from_urdf(
        cls,
        path: str | os.PathLike[str],
        *,
        mimic: bool = True,
        ends: Sequence[str] | None = None,
        contacts: Sequence[Contact] | None = None,
    ) -> Robot:
        """The robot in a URDF file: fixed, revolute, continuous and prismatic joints, mimics, limits, masses.

        Every link is a frame of the same name, in the same place; the root link is the base (a link that is called
        "base" or "world" without being the root, "base.link", and slashes in names are dots). A fixed transform
        becomes constant rows. Collision shapes (spheres, boxes, capsules, cylinders) become contacts, unless
        ``contacts`` are given; meshes are ignored. An effort or a velocity of 0 and a range of no width count as
        unknown. ``mimic`` False: joints that mimic others are joints of their own. ``ends``: links in which chains
        end; links that are fixed elsewhere become part of what carries them. InputError names the file and the link or
        joint."""
        from bodyplan.robot.reading.urdf import read_urdf

        return cls(*read_urdf(path, mimic, ends, contacts))

    @classmethod
    def from_mjcf(
        cls,
        path: str | os.PathLike[str],
        *,
        root: str | None = None,
        ends: Sequence[str] | None = None,
        contacts: Sequence[Contact] | None = None,
    ) -> Robot:
        """The robot in an MJCF file, as MuJoCo (extra "physics") compiles it: hinges, slides, masses, limits, and
        joints and fixed tendons that equality constraints couple by a straight line.

        Every body is a frame of the same name, in the same place, and joint coordinates are MuJoCo's. A body with a
        free joint is the base; without one the base is the world. ``root`` names the body on the world that is the
        robot where there are several. Joints without an actuator are passive if any has one. ``ends`` and ``contacts``
        as in :meth:`from_urdf`; contacts are else the primitive geoms that can touch. InputError for ball joints and
        closed loops."""
        from bodyplan.robot.reading.mjcf import read_mjcf

        return cls(*read_mjcf(path, root, ends, contacts))

    def to_urdf(self, path: str | os.PathLike[str]) -> None:
        """Write the robot as URDF (:func:`bodyplan.export.urdf.write`)."""
        import_module("bodyplan.export.urdf").write(self, path)

    def __reduce__(self) -> Any:
        return type(self), (self.name, self.chains, self.contacts, self.base_body)

    def __repr__(self) -> str:
        passive = self.n - int(self.actuated.sum())
        return (
            f"Robot({self.name!r}: {len(self.chains)} chain{'s' * (len(self.chains) != 1)}, "
            f"{len(self.frames)} frames, {self.n} joints{f' ({passive} passive)' if passive else ''}, "
            f"{len(self.contacts)} contacts, {self.mass:.3g} kg)"
        )
