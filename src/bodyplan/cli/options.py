"""Arguments and options that several commands share, and the motion that a user names."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from bodyplan.missions import Mission
    from bodyplan.motion import Motion


def missions_like(incomplete: str) -> list[str]:
    """Names of ready missions that begin so, for the shell, which waits: no library is loaded for them. Files it
    completes by itself."""
    folder = Path(__file__).parents[1] / "missions" / "ready"
    return sorted(path.stem for path in folder.glob("*.toml") if path.stem.startswith(incomplete))


MissionArgument = Annotated[
    str,
    typer.Argument(
        help="A ready mission's name (see: bodyplan missions) or a .toml file.", autocompletion=missions_like
    ),
]
MotionArgument = Annotated[
    str,
    typer.Argument(
        help="A mission, a motion saved as .npz, or the folder of a run, for example runs/concertina.",
        autocompletion=missions_like,
    ),
]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a field, for example gait.omega=1.1. May be repeated."),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Replace what is there.")]


def motion_of(mission: str, overrides: list[str] | None) -> Motion:
    """The motion in an .npz file or in the folder of a run, or the plan of a mission."""
    from bodyplan.missions.files import saved_motion

    saved = saved_motion(mission, overrides or ())
    if saved is not None:
        from bodyplan.export import load

        return load(saved)
    from bodyplan.job import plan_mission
    from bodyplan.missions import load_mission

    loaded: Mission = load_mission(mission, overrides or ())
    return plan_mission(loaded)
