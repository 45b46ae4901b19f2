"""MJCF: robot and ground as one XML file that MuJoCo loads by itself.

The file has the bodies, joints, sites (one a frame), contact shapes, servos and contact pairs that
``bodyplan.simulate`` runs, height fields written out in it, and a keyframe "start" with the first planned
pose. Friction that depends on the direction of sliding cannot be said in MJCF: of scales it has the grip
backwards.
"""

from __future__ import annotations

import os
import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

from bodyplan.errors import InputError
from bodyplan.files import replacing
from bodyplan.ground import Plane
from bodyplan.ground.base import Ground
from bodyplan.motion import Motion
from bodyplan.robot.model import Robot
from bodyplan.simulate.model import Physics, build
from bodyplan.simulate.reference import Reference, region
from bodyplan.simulate.start import on_the_floor

#: tag -> how a spec finds the element of that name
_FINDERS = {
    "body": "body",
    "geom": "geom",
    "joint": "joint",
    "freejoint": "joint",
    "site": "site",
    "pair": "pair",
    "hfield": "hfield",
    "general": "actuator",
    "position": "actuator",
    "key": "key",
}


def write(
    motion_or_robot: Motion | Robot,
    path: str | os.PathLike[str],
    ground: Ground | None = None,
    **options: Any,
) -> None:
    """Write the model of a motion's robot and ground, or of a robot on ``ground`` (default: a level plane),
    to ``path``; the old file stays until all is written.

    ``options``: ``friction``, ``servo``, ``dt``, ``armature``, ``arc_joints``, ``self_collision`` of
    :func:`bodyplan.simulate.build`. Numbers are written so that they read back equal (heights of a field:
    in single precision, as MuJoCo keeps them). Raises InputError for what cannot be simulated and for a
    missing folder.
    """
    with replacing(path) as file:
        file.write(text(motion_or_robot, ground, **options))


def text(motion_or_robot: Motion | Robot, ground: Ground | None = None, **options: Any) -> str:
    """The XML that :func:`write` writes."""
    if isinstance(motion_or_robot, Motion):
        if ground is not None:
            raise InputError("ground: a motion has its own; give a ground with a robot only.")
        motion = motion_or_robot
        ground, reference = motion.ground, Reference.of(motion)
        physics = build(motion.robot, ground, *region(reference, cycles=3), **options)
        q, base = motion.q[0], motion.base[0]
    elif isinstance(motion_or_robot, Robot):
        ground, robot = ground or Plane(), motion_or_robot
        q, base = np.clip(np.zeros(robot.n), *robot.limits.T), np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
        size = 2.0 * float(np.abs(robot.forward(q).positions).max(initial=0.5))
        physics = build(robot, ground, [-size] * 3, [size] * 3, **options)
    else:
        raise InputError(f"expected a Motion or a Robot to write, got {motion_or_robot!r}.")
    if physics.robot.contacts:
        base = on_the_floor(physics.robot, q, base, ground)
    physics.spec.add_key(name="start", qpos=physics.qpos(q, base), ctrl=q[physics.servos])
    physics.spec.compile()
    root = ET.fromstring(physics.spec.to_xml())
    _sharpen(root, physics)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"


def _sharpen(root: ET.Element, physics: Physics) -> None:
    """Write numbers in full: MuJoCo prints six digits. The structure of its output stays."""
    spec = physics.spec
    for element in root.iter():
        if element.tag in _FINDERS and "name" in element.attrib:
            found = getattr(spec, _FINDERS[element.tag])(element.attrib["name"])
            _restate(element, found, element.attrib)
            inertial = element.find("inertial")
            if inertial is not None:
                for field in ("quat", "diaginertia", "fullinertia"):
                    inertial.attrib.pop(field, None)
                inertial.set("pos", _numbers(found.ipos))
                inertial.set("mass", repr(float(found.mass)))
                inertial.set("fullinertia", _numbers(found.fullinertia))
            if element.tag == "hfield":
                # the file has the rows from far to near, the spec from near to far
                heights = np.array(found.userdata, dtype=np.float32).reshape(found.nrow, found.ncol)[::-1]
                element.set("elevation", "\n".join(" ".join(map(str, row)) for row in heights))
        elif element.tag == "option":
            _restate(element, spec.option, element.attrib)
    for equality in root.iterfind("./equality/joint"):
        found = spec.equality(equality.attrib["name"])
        _restate(equality, found, ("solref", "solimp"))
        equality.set("polycoef", _numbers(found.data[:5]))
    for tendon in root.iterfind("./tendon/fixed"):
        for wrap, found in zip(tendon, spec.tendon(tendon.attrib["name"]).path, strict=True):
            wrap.set("coef", repr(float(found.coef)))


def _restate(element: ET.Element, found: Any, names: Any) -> None:
    """Set those of the named attributes that are numbers to the values of the spec's element."""
    for name in [n for n in names if n in element.attrib]:
        try:
            printed = np.array(element.attrib[name].split(), dtype=np.float64)
            exact = np.ravel(getattr(found, name))[: len(printed)]
        except (AttributeError, TypeError, ValueError):
            continue  # a name, a keyword, or something that the spec calls otherwise
        if (
            exact.dtype == np.float64
            and exact.shape == printed.shape
            and np.allclose(exact, printed, rtol=1e-5, atol=1e-12)
        ):
            element.set(name, _numbers(exact))


def _numbers(values: Any) -> str:
    return " ".join(repr(float(v)) for v in np.ravel(values))
