"""Arguments and options that several commands share, and the motion that a user names."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from bodyplan.missions import Mission
    from bodyplan.motion import Motion

MissionArgument = Annotated[
    str, typer.Argument(help="A ready mission's name (see: bodyplan missions) or a .toml file.")
]
MotionArgument = Annotated[str, typer.Argument(help="A mission, or a motion saved as .npz.")]
SetOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a field, for example gait.omega=1.1. May be repeated."),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Replace what is there.")]


def motion_of(mission: str, overrides: list[str] | None) -> Motion:
    """The motion in an .npz file, or the plan of a mission."""
    from bodyplan.errors import InputError

    if mission.endswith(".npz"):
        from bodyplan.export import load

        if overrides:
            raise InputError("--set: a saved motion cannot be changed; give its mission instead.")
        return load(mission)
    from bodyplan.job import plan_mission
    from bodyplan.missions import load_mission

    loaded: Mission = load_mission(mission, overrides or ())
    return plan_mission(loaded)
