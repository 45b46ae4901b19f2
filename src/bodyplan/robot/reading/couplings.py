"""Which joint drives which in an MJCF model: equality constraints, actuators, and what they say of limits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bodyplan.errors import InputError
from bodyplan.robot.elements import Joint


class Couplings:
    """The joints of the bodies ``inside`` a robot, of a compiled model; ``names``: of all joints."""

    def __init__(self, mj: Any, model: Any, names: Sequence[str], inside: set[int]) -> None:
        self.mj, self.model, self.names, self.inside = mj, model, names, inside
        #: joint -> its coordinate as offset + sum of factor times the coordinates of others
        self.follows: dict[int, tuple[float, dict[int, float]]] = {}
        for e in range(model.neq):
            if model.eq_active0[e]:
                self._equality(e)
        self.actuators = self._actuators()
        self.forms = [self._form(j, ()) for j in range(model.njnt)]
        driven = [j for j in range(model.njnt) if not self.actuators or j in self.actuators]
        self.actuated = {leader for j in driven for leader in self.forms[j][1]}

    def drives(self) -> list[tuple[float, tuple[Joint, ...]]]:
        """The coordinate of every joint of the model as a constant and the joints of the robot that add to it."""
        return [(offset, tuple(map(self._joint, factors, factors.values()))) for offset, factors in self.forms]

    def _form(self, j: int, seen: tuple[int, ...]) -> tuple[float, dict[int, float]]:
        """A coordinate by those that follow no others."""
        if j not in self.follows:
            return 0.0, {j: 1.0}
        if j in seen:
            chain = ", ".join(repr(self.names[k]) for k in seen)
            raise InputError(f"joints {chain}: equality constraints make them follow each other.")
        offset, factors = self.follows[j]
        out: dict[int, float] = {}
        for leader, factor in factors.items():
            if self.model.jnt_type[leader] != self.model.jnt_type[j]:
                one, two = self.names[j], self.names[leader]
                raise InputError(f"joint {one!r}: follows {two!r}, but one of both turns and the other one slides.")
            added, terms = self._form(leader, (*seen, j))
            offset += factor * added
            for k, term in terms.items():
                out[k] = out.get(k, 0.0) + factor * term
        return offset, {k: factor for k, factor in out.items() if factor != 0.0}

    def _joint(self, j: int, factor: float) -> Joint:
        low, high = self.model.jnt_range[j].tolist()
        limits = (low, high) if self.model.jnt_limited[j] and low < high else None
        return Joint(self.names[j], 0.0, factor, limits, None, self._effort(j), j in self.actuated)

    # --- constraints ----------------------------------------------------------------------------------------

    def _equality(self, e: int) -> None:
        model, kinds = self.model, self.mj.mjtEq
        kind, one, two = model.eq_type[e], int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        where = f"equality {model.equality(e).name or f'number {e + 1}'!r}"
        if kind == kinds.mjEQ_CONNECT or kind == kinds.mjEQ_WELD:
            bodies = self._bodies(e, one, two)
            floats = any(self._floats(body) for body in bodies) and 0 in bodies
            if bodies <= self.inside | {0} and not floats and bodies != {0}:
                word = "connects" if kind == kinds.mjEQ_CONNECT else "welds"
                raise InputError(f"{where}: {word} bodies to a closed loop; only trees are supported.")
        elif kind == kinds.mjEQ_JOINT:
            if int(model.jnt_bodyid[one]) in self.inside:
                self._polynomial(e, one, two if two >= 0 else None, where)
        elif kind == kinds.mjEQ_TENDON:
            self._tendon(e, one, two, where)

    def _bodies(self, e: int, one: int, two: int) -> set[int]:
        site = self.model.eq_objtype[e] == self.mj.mjtObj.mjOBJ_SITE
        return {int(self.model.site_bodyid[i]) if site else i for i in (one, two)}

    def _floats(self, body: int) -> bool:
        first = self.model.body_jntadr[body]
        return bool(first >= 0 and self.model.jnt_type[first] == self.mj.mjtJoint.mjJNT_FREE)

    def _polynomial(self, e: int, one: int, two: int | None, where: str) -> None:
        """q1 - its initial value = a0 + a1 (q2 - its initial value) + ...; without q2 a0 alone."""
        a0, a1, *higher = self.model.eq_data[e, :5].tolist()
        if two is not None and any(higher):
            raise InputError(f"{where}: joint {self.names[one]!r} must follow by a straight line, not a polynomial.")
        start = self.model.qpos0[self.model.jnt_qposadr]
        if two is None:
            self._follow(one, start[one] + a0, {}, where)
        else:
            self._follow(one, start[one] + a0 - a1 * start[two], {two: a1}, where)

    def _tendon(self, e: int, one: int, two: int, where: str) -> None:
        """A fixed tendon that must keep its length: its last joint follows the others."""
        model = self.model
        first, count = int(model.tendon_adr[one]), int(model.tendon_num[one])
        wraps = range(first, first + count)
        joints = [int(model.wrap_objid[w]) for w in wraps if model.wrap_type[w] == self.mj.mjtWrap.mjWRAP_JOINT]
        if not any(int(model.jnt_bodyid[j]) in self.inside for j in joints):
            return
        if two >= 0 or len(joints) != count:
            raise InputError(f"{where}: only one fixed tendon, over joints, that keeps its length is supported.")
        *others, last = (float(model.wrap_prm[w]) for w in wraps)
        if last == 0.0:
            raise InputError(f"{where}: the tendon does not depend on its last joint, {self.names[joints[-1]]!r}.")
        held = float(model.tendon_length0[one] + model.eq_data[e, 0])
        factors = {j: -coefficient / last for j, coefficient in zip(joints, others, strict=False)}
        self._follow(joints[-1], held / last, factors, where)

    def _follow(self, one: int, offset: float, factors: dict[int, float], where: str) -> None:
        if one in self.follows:
            raise InputError(f"{where}: joint {self.names[one]!r} follows others in two ways at once.")
        self.follows[one] = (float(offset), factors)

    # --- actuators ------------------------------------------------------------------------------------------

    def _actuators(self) -> dict[int, list[tuple[int, float]]]:
        """Joint -> its actuators, with their gear; those that pull on a tendon count for all of its joints."""
        model, kinds = self.model, self.mj.mjtTrn
        out: dict[int, list[tuple[int, float]]] = {}
        for a in range(model.nu):
            target, gear = int(model.actuator_trnid[a, 0]), float(model.actuator_gear[a, 0])
            kind = model.actuator_trntype[a]
            # numbers of NumPy equal these names, but are not found among them
            if kind == kinds.mjTRN_JOINT or kind == kinds.mjTRN_JOINTINPARENT:
                out.setdefault(target, []).append((a, gear))
            elif kind == kinds.mjTRN_TENDON:
                first = int(model.tendon_adr[target])
                for w in range(first, first + int(model.tendon_num[target])):
                    if model.wrap_type[w] == self.mj.mjtWrap.mjWRAP_JOINT:
                        coefficient = float(model.wrap_prm[w])
                        out.setdefault(int(model.wrap_objid[w]), []).append((a, gear * coefficient))
        return out

    def _effort(self, j: int) -> float | None:
        """The largest force or torque of a joint's actuators together, where all of them have one."""
        model = self.model
        if model.jnt_actfrclimited[j]:
            return float(np.abs(model.jnt_actfrcrange[j]).max()) or None
        total = 0.0
        for a, gear in self.actuators.get(j, []):
            if model.actuator_forcelimited[a]:
                largest = float(np.abs(model.actuator_forcerange[a]).max())
            elif self._plain(a) and model.actuator_ctrllimited[a]:
                largest = float(np.abs(model.actuator_ctrlrange[a]).max() * abs(model.actuator_gainprm[a, 0]))
            else:
                return None
            total += largest * abs(gear)
        return total or None

    def _plain(self, a: int) -> bool:
        """A motor: its force is its control times a constant."""
        mj, model = self.mj, self.model
        kinds = (mj.mjtDyn.mjDYN_NONE, mj.mjtGain.mjGAIN_FIXED, mj.mjtBias.mjBIAS_NONE)
        own = (model.actuator_dyntype[a], model.actuator_gaintype[a], model.actuator_biastype[a])
        return all(int(x) == int(y) for x, y in zip(own, kinds, strict=True))
