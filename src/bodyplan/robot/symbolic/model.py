"""The kinematic model of a robot as SymPy expressions, and as text: LaTeX, Python, C99."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any

import sympy as sp

from bodyplan.arrays import whole
from bodyplan.errors import InputError
from bodyplan.robot.elements import Arc, Element, Row
from bodyplan.robot.formulas import cross
from bodyplan.robot.model import Robot
from bodyplan.robot.symbolic.c_source import CSource, c_source
from bodyplan.robot.symbolic.formulas import Formulas
from bodyplan.robot.symbolic.latex import latex
from bodyplan.robot.symbolic.python_source import python_source
from bodyplan.robot.symbolic.recursion import Walk, base_from, element_formulas, frame_from

Matrix = Any  # sympy.ImmutableDenseMatrix; SymPy has no types


class SymbolicRobot:
    """The formulas of a robot's kinematics, what :class:`bodyplan.Robot` computes in numbers.

    Joint coordinates are SymPy symbols without assumptions, named like the joints: ``symbols["fl.knee"]``, or ``q`` in
    the order of ``robot.joints``. Angles such as pi/2 are exact. Conventions are those of the numeric model: poses as
    seen from the base, twists (v, omega) body-fixed. An arc's functions A, B, C of its angle (regular when straight)
    are functions of the square of that angle: ``rewrite(sin)`` writes them out.

    Matrices are not expanded; for robots with long chains (more than ten turns about axes that are not parallel)
    formulas in one piece grow quickly, code does not: :meth:`python` and :meth:`c_source`.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.q: tuple[Any, ...] = tuple(sp.Symbol(name) for name in robot.joints)
        self.symbols: Mapping[str, Any] = MappingProxyType(dict(zip(robot.joints, self.q, strict=True)))
        self._how = Formulas()
        self._walks: dict[int, Walk] = {}

    @cached_property
    def P(self) -> Matrix:
        """(6m, 6) of paper *legs* eq. (9): ``V_ends = P V_base + Q dq/dt`` for the m chain ends, six rows a chain;
        P = D_n ... D_1 per chain (the paper prints the opposite order)."""
        return sp.ImmutableMatrix.vstack(*(self._carried(frame) for frame in self.robot.ends))

    @cached_property
    def Q(self) -> Matrix:
        """(6m, n) of paper *legs* eq. (9), columns in the order of ``q``, passive joints included."""
        return sp.ImmutableMatrix.vstack(*(self._columns(frame) for frame in self.robot.ends))

    def D(self, at: str | int | Row | Arc) -> Matrix:
        """(6, 6) of paper *legs* eq. (2): twist of the end of one element per twist of its start. ``at``: the frame
        that the element ends in (a chain's name: its last one), the element's number in ``robot.elements`` (from 0), or
        an element of any robot. UnknownNameError, InputError."""
        return sp.ImmutableMatrix(element_formulas(self._element(at), self._how)[0]).applyfunc(self._how.keep)

    def E(self, at: str | int | Row | Arc) -> Matrix:
        """(6, 4) of paper *legs* eq. (3), columns theta, d, a, epsilon of a row; (6, 2), pitch and yaw, of an arc:
        twist of its end per unit rate of each variable. ``at`` as in :meth:`D`."""
        return sp.ImmutableMatrix(element_formulas(self._element(at), self._how)[1]).applyfunc(self._how.keep)

    def forward(self, frame: str) -> Matrix:
        """(4, 4) pose of a frame (or of a chain's end) seen from the base."""
        walk = frame_from(self.robot, self.robot.frame_index(frame), self._how)
        columns = [[*axis, 0] for axis in (walk.x, walk.y, walk.z)] + [[*walk.r, 1]]
        return sp.ImmutableMatrix(columns).T

    def jacobian(self, frame: str, *, reference: str = "body") -> Matrix:
        """(6, n) twist (v, omega) of a frame per unit joint rate for a base at rest: as
        :meth:`bodyplan.Robot.jacobian`, "body" in the axes of the frame, "world" in those of the base."""
        if reference not in ("body", "world"):
            raise InputError(f"reference: must be 'body' or 'world', got {reference!r}.")
        J = self._columns(self.robot.frame_index(frame))
        if reference == "body":
            return J
        R = self.forward(frame)[:3, :3]
        return sp.ImmutableMatrix.vstack(R * J[:3, :], R * J[3:, :])

    def latex(self, parts: str | Sequence[str] | None = None, *, document: bool = False) -> str:
        """LaTeX (amsmath) of the ``parts`` asked for: "table" (the extended D-H table), "rows" (for every element
        V_i = D_i V_i-1 + E_i dq_i/dt, as eqs. (10)-(13) of paper *legs*), "poses" (of the chain ends), "model" (P and Q
        as products of the D_i and E_i), "P", "Q" (written out, six rows a chain). Long matrices are preceded by lines
        that give what recurs in them a name. Default: the first four.

        ``document``: with a preamble, ready for pdflatex. c and s are cosine and sine; numbers are rounded to ten
        digits. UnknownNameError for another part.
        """
        return latex(self, parts, document)

    def python(self, *, frames: Sequence[str] | None = None) -> str:
        """Source text of a Python module that needs NumPy only: ``ends(q)`` gives positions, rotations and Jacobian
        columns of the chain ends (or ``frames``), ``velocity_model(q)`` gives P and Q; any leading batch shape.
        InputError for a robot without joints."""
        return python_source(self.robot, self._targets(frames))

    def c_source(self, name: str | None = None, *, frames: Sequence[str] | None = None) -> CSource:
        """C99 header and source without dependencies: poses and Jacobian columns of the chain ends (or ``frames``), P
        and Q; common subexpressions are shared over all results. ``name`` (default: the robot's) begins every name
        in them, made a valid one. InputError for a robot without joints."""
        return c_source(self.robot, self._targets(frames), name)

    def __repr__(self) -> str:
        return f"SymbolicRobot({self.robot!r})"

    # --- parts ----------------------------------------------------------------------------------------------

    def _targets(self, frames: Sequence[str] | None) -> tuple[int, ...]:
        if not self.robot.n:
            raise InputError(f"robot {self.robot.name!r}: has no joints to compute anything from.")
        if frames is None:
            return self.robot.ends
        if isinstance(frames, str) or not frames:
            raise InputError(f"frames: expected names of frames, got {frames!r}.")
        return tuple(self.robot.frame_index(frame) for frame in frames)

    def _element(self, at: str | int | Row | Arc) -> Element:
        if isinstance(at, (Row, Arc)):
            return at
        if not isinstance(at, str):
            return self.robot.elements[whole(at, "row", at_most=len(self.robot.elements) - 1)]
        index = self.robot.frame_index(at)
        if index == 0:
            raise InputError("frame: no element ends in 'base'.")
        return self.robot.elements[index - 1]

    def _walk(self, frame: int) -> Walk:
        if frame not in self._walks:
            self._walks[frame] = base_from(self.robot, frame, self._how)
        return self._walks[frame]

    def _carried(self, frame: int) -> Matrix:
        """(6, 6) twist of a frame rigidly attached to the base per twist of the base."""
        walk = self._walk(frame)
        axes = (walk.x, walk.y, walk.z)
        columns = [[*axis, 0, 0, 0] for axis in axes] + [[*cross(walk.r, axis), *axis] for axis in axes]
        return sp.ImmutableMatrix(columns).T

    def _columns(self, frame: int) -> Matrix:
        columns = self._walk(frame).columns
        twists = [columns.get(name, [0] * 6) for name in self.robot.joints]
        return sp.ImmutableMatrix(twists).T if twists else sp.ImmutableMatrix.zeros(6, 0)
