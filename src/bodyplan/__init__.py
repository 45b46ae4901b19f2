"""bodyplan: say how the body should move over real ground; get what every joint must do, and see it in physics.

    import bodyplan as bp
    snake = bp.snake(links=26, link_length=0.05)
    motion = bp.plan(snake, bp.Concertina(body_modules=4), bp.Plane(), bp.times(0, 20, dt=0.02))
    print(bp.check(motion))
    trial = bp.simulate(motion)

SI units and radians; world x forward, y left, z up; a pose is position then quaternion **wxyz**, world_from_body;
a twist is (v, omega), body-fixed unless its name says otherwise. Names are loaded when first used.
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from bodyplan.stale import forget_stale_of_checkout

if TYPE_CHECKING:
    from bodyplan import curves, export, fitting, gaits, ground, rates, solve, spatial
    from bodyplan.check import Report, check
    from bodyplan.curves import BodyCurve, ConcertinaCurve, Sampled, Segments, Serpenoid, SinusLift, Spiral
    from bodyplan.errors import (
        BodyplanError,
        InputError,
        MissingExtraError,
        SolveError,
        Status,
        UnknownNameError,
    )
    from bodyplan.export import load, save
    from bodyplan.fitting import Fit, exact_link_length, fit, links_on_curve
    from bodyplan.gaits import Carry, Concertina, Crawl, Rectilinear, Rolling, Serpentine, Sidewinding, SinusLifting
    from bodyplan.ground import Corridor, HeightMap, Plane, Profile, Surface
    from bodyplan.job import run
    from bodyplan.missions import load_mission
    from bodyplan.motion import Claim, Motion, times
    from bodyplan.plan import plan
    from bodyplan.robot import (
        Arc,
        Body,
        Chain,
        Contact,
        Joint,
        Robot,
        Row,
        WheelRadius,
        acm_l2,
        hexapod,
        rover,
        silo4,
        snake,
        tri_wheel,
        walker,
    )
    from bodyplan.search import optimise, sweep
    from bodyplan.show import show
    from bodyplan.show.inline import inline
    from bodyplan.simulate import Friction, Trial, simulate
    from bodyplan.solve import stability

__version__ = "0.1.0"

#: name -> module it comes from; loading them all would cost a second, most users need few
_FACE = {
    "BodyplanError": "errors",
    "InputError": "errors",
    "MissingExtraError": "errors",
    "SolveError": "errors",
    "Status": "errors",
    "UnknownNameError": "errors",
    "Arc": "robot",
    "Body": "robot",
    "Chain": "robot",
    "Contact": "robot",
    "Joint": "robot",
    "Robot": "robot",
    "Row": "robot",
    "WheelRadius": "robot",
    "acm_l2": "robot",
    "hexapod": "robot",
    "rover": "robot",
    "silo4": "robot",
    "snake": "robot",
    "tri_wheel": "robot",
    "walker": "robot",
    "Corridor": "ground",
    "HeightMap": "ground",
    "Plane": "ground",
    "Profile": "ground",
    "Surface": "ground",
    "BodyCurve": "curves",
    "ConcertinaCurve": "curves",
    "Sampled": "curves",
    "Segments": "curves",
    "Serpenoid": "curves",
    "SinusLift": "curves",
    "Spiral": "curves",
    "Fit": "fitting",
    "exact_link_length": "fitting",
    "fit": "fitting",
    "links_on_curve": "fitting",
    "Carry": "gaits",
    "Concertina": "gaits",
    "Crawl": "gaits",
    "Rectilinear": "gaits",
    "Rolling": "gaits",
    "Serpentine": "gaits",
    "Sidewinding": "gaits",
    "SinusLifting": "gaits",
    "Claim": "motion",
    "Motion": "motion",
    "times": "motion",
    "plan": "plan",
    "Report": "check",
    "check": "check",
    "Friction": "simulate",
    "Trial": "simulate",
    "simulate": "simulate",
    "stability": "solve",
    "show": "show",
    "inline": "show.inline",
    "load": "export",
    "save": "export",
    "load_mission": "missions",
    "run": "job",
    "sweep": "search",
    "optimise": "search",
}
_MODULES = ("curves", "errors", "export", "fitting", "gaits", "ground", "rates", "robot", "solve", "spatial", "units")

__all__ = [*sorted(_FACE), "curves", "export", "fitting", "gaits", "ground", "rates", "solve", "spatial"]


class _Face(ModuleType):
    """Keeps ``bodyplan.check`` the verb: importing the subpackage of that name must not shadow the function."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _FACE and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Face

forget_stale_of_checkout(Path(__file__).parent)


def __getattr__(name: str) -> Any:
    if name in _FACE:
        value = getattr(importlib.import_module(f"bodyplan.{_FACE[name]}"), name)
        globals()[name] = value
        return value
    if name in _MODULES:
        return importlib.import_module(f"bodyplan.{name}")
    raise AttributeError(f"module 'bodyplan' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *_FACE, *_MODULES})
