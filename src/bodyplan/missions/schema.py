"""The schema of a mission file: pydantic models made from the signatures of robots, gaits and grounds.

A new kind is one line in its registry; its options, their defaults and their units follow from its signature and
from its ``UNITS`` (option -> dimension of :mod:`bodyplan.units`), so that nothing is declared twice.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema, create_model

from bodyplan import gaits
from bodyplan.ground import Corridor, HeightMap, Plane, Profile, Surface
from bodyplan.robot.library import acm_l2, snake
from bodyplan.robot.model import Robot
from bodyplan.robot.rovers import rover, tri_wheel
from bodyplan.robot.walkers import hexapod, silo4, walker
from bodyplan.units import SI_UNITS, to_si

STRICT = ConfigDict(extra="forbid", arbitrary_types_allowed=True)

Builder = Callable[..., Any]

_SNAKE_UNITS = {
    "link_length": "length",
    "radius": "length",
    "foot_radius": "length",
    "foot_spread": "length",
    "mass": "mass",
    "limits": "angle",
    "rate": "angular_rate",
    "effort": "torque",
}
_LEG_UNITS = {
    "links": "length",
    "body": "length",
    "waist": "length",
    "splay": "angle",
    "sole": "length",
    "mass": "mass",
    "foot_radius": "length",
    "limits": "angle",
    "rate": "angular_rate",
    "effort": "torque",
}
_WHEEL_UNITS = {
    "link": "length",
    "half_length": "length",
    "half_width": "length",
    "rubber": "length",
    "radius": "length",
    "body": "length",
    "thickness": "length",
    "mass": "mass",
    "com": "length",
    "wheel_mass": "mass",
    "limits": "angle",
    "rate": "angular_rate",
    "effort": "torque",
    "spin_rate": "angular_rate",
    "spin_effort": "torque",
}


def _robot_file(path: str) -> Robot:
    """A robot from its TOML file."""
    return Robot.from_toml(path)


def _robot_table(path: str) -> Robot:
    """A robot from a CSV table of extended D-H parameters."""
    return Robot.from_table(path)


def _robot_urdf(file: str, mimic: bool = True, ends: Sequence[str] | None = None) -> Robot:
    """A robot from a URDF file."""
    return Robot.from_urdf(file, mimic=mimic, ends=ends)


def _robot_mjcf(file: str, root: str | None = None, ends: Sequence[str] | None = None) -> Robot:
    """A robot from an MJCF file, read by MuJoCo."""
    return Robot.from_mjcf(file, root=root, ends=ends)


#: kind -> (builder, units of its options)
ROBOTS: dict[str, tuple[Builder, Mapping[str, str]]] = {
    "snake": (snake, _SNAKE_UNITS),
    "acm_l2": (acm_l2, _SNAKE_UNITS),
    "silo4": (silo4, _LEG_UNITS),
    "hexapod": (hexapod, _LEG_UNITS),
    "walker": (walker, _LEG_UNITS),
    "tri_wheel": (tri_wheel, _WHEEL_UNITS),
    "rover": (rover, _WHEEL_UNITS),
    "file": (_robot_file, {}),
    "table": (_robot_table, {}),
    "urdf": (_robot_urdf, {}),
    "mjcf": (_robot_mjcf, {}),
}
GAITS: dict[str, tuple[Builder, Mapping[str, str]]] = {kind: (cls, cls.UNITS) for kind, cls in gaits.KINDS.items()}
GROUNDS: dict[str, tuple[Builder, Mapping[str, str]]] = {
    "plane": (Plane, {"height": "length"}),
    "surface": (Surface, {"bounds": "length"}),
    "height_map": (HeightMap.from_file, {"cell": "length", "origin": "length"}),
    "jacksboro": (HeightMap.jacksboro, {"size": "length"}),
    "corridor": (Corridor, {"width": "length", "height": "length", "floor": "length"}),
    "profile": (Profile, {"floor": "length", "ceiling": "length"}),
}
SECTIONS = {"robot": ROBOTS, "gait": GAITS, "ground": GROUNDS}


def _convert(value: Any, dimension: str) -> Any:
    """Texts become SI numbers, also inside lists; everything else is left to the type's own check."""
    if isinstance(value, str):
        return to_si(value, dimension)
    if isinstance(value, list):
        return [_convert(v, dimension) for v in value]
    return value


_PLAIN = (int, float, str, bool, type(None))


def _plain(annotation: Any) -> Any:
    """The annotation where pydantic can check it as it stands, else Any (the builder checks it then)."""
    if annotation in _PLAIN:
        return annotation
    parts = get_args(annotation)
    if parts and get_origin(annotation) in (Union, UnionType, Sequence) and all(_plain(p) is not Any for p in parts):
        return annotation
    return Any


def options_model(kind: str, builder: Builder, units: Mapping[str, str]) -> type[BaseModel]:
    """The pydantic model of one kind's options, from the builder's signature."""
    hints = get_type_hints(builder.__init__ if inspect.isclass(builder) else builder, include_extras=True)
    fields: dict[str, Any] = {}
    for name, parameter in inspect.signature(builder).parameters.items():
        annotation = _plain(hints.get(name, Any))
        if name in units:
            annotation = Annotated[annotation, *_quantity(units[name])]
        default = ... if parameter.default is inspect.Parameter.empty else parameter.default
        fields[name] = (annotation, default)
    return create_model(f"{kind} options", __config__=STRICT, **fields)


def _quantity(dimension: str) -> tuple[Any, Any]:
    """Validator of a quantity, and its place in the JSON schema: a number in SI, or a text with a unit."""
    about = f"{dimension} in {SI_UNITS[dimension]}, or a text with a unit"
    texts = {"type": ["number", "string", "array", "null"], "description": about}
    return BeforeValidator(partial(_convert, dimension=dimension)), WithJsonSchema(texts)


Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Time(BaseModel):
    """``cycles`` of the gait or ``stop`` s, sampled at most ``dt`` s apart (and 100 times a cycle at least)."""

    model_config = STRICT
    cycles: Annotated[float, Field(gt=0, le=1000)] | None = None
    stop: Annotated[float, *_quantity("time"), Field(gt=0)] | None = None
    dt: Annotated[float, *_quantity("time"), Field(gt=0)] = 0.02


class FrictionTriple(BaseModel):
    """Coulomb coefficients of a scaly skin on the floor."""

    model_config = STRICT
    forward: NotNegative
    backward: NotNegative
    sideways: NotNegative


class Simulate(BaseModel):
    """Settings of the physics; see ``bodyplan.simulate``."""

    model_config = STRICT
    cycles: Annotated[int, Field(ge=1, le=1000)] = 3
    friction: NotNegative | FrictionTriple | None = None
    servo: tuple[Positive, NotNegative] | None = None
    dt: Annotated[float, *_quantity("time"), Field(gt=0, le=0.02)] = 1e-3
    settle: Annotated[float, *_quantity("time"), Field(ge=0, le=1000)] = 1.0
    ramp: Annotated[float, *_quantity("time"), Field(ge=0, le=1000)] | None = None


class Grid(BaseModel):
    """The mission once more at each of ``values`` (SI) of the field ``key``, such as simulate.friction.sideways, and
    the ready ``missions`` beside it; ``label`` names the field in the report."""

    model_config = STRICT
    key: Annotated[str, Field(max_length=200)]
    values: Annotated[list[Annotated[float, Field(allow_inf_nan=False)]], Field(min_length=1, max_length=20)]
    missions: Annotated[list[str], Field(max_length=4)] = []
    label: Annotated[str, Field(max_length=100)] = ""


class PaperRow(BaseModel):
    """A figure of the paper to set beside ours: ``printed`` in ``unit``; ``ours`` is the metric that stands beside it.

    A metric is ``plan.NAME`` or ``trial.NAME`` as in metrics.json, after ``MISSION:`` that of a mission in ``compare``;
    ``ours`` is one of them, or the ratio of two: ``trial.speed_m_s / serpentine:trial.speed_m_s``. ``source``: where
    the paper says it, and what was different there.
    """

    model_config = STRICT
    what: Annotated[str, Field(max_length=200)]
    printed: Annotated[float, Field(allow_inf_nan=False)]
    unit: Annotated[str, Field(max_length=20)] = ""
    ours: Annotated[str, Field(max_length=200)]
    source: Annotated[str, Field(max_length=1000)] = ""


class MissionModel(BaseModel):
    """A mission file. ``robot``, ``gait`` and ``ground`` are tables with a ``kind`` and that kind's options."""

    model_config = STRICT
    title: Annotated[str, Field(max_length=200)]
    about: Annotated[str, Field(max_length=5000)] = ""
    robot: dict[str, Any]
    gait: dict[str, Any]
    ground: dict[str, Any]
    time: Time = Time()
    simulate: Simulate | None = Simulate()
    compare: Annotated[list[str], Field(max_length=20)] = []
    grid: Grid | None = None
    paper: Annotated[list[PaperRow], Field(max_length=40)] = []


def json_schema() -> dict[str, Any]:
    """JSON Schema of a mission file, with the options of every kind of robot, gait and ground under ``kinds``."""
    return {
        "mission": MissionModel.model_json_schema(),
        "kinds": {
            section: {kind: options_model(kind, *entry).model_json_schema() for kind, entry in registry.items()}
            for section, registry in SECTIONS.items()
        },
    }
