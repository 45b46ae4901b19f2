"""Figures, the self-contained report of a run, and the live viewer; :func:`show` opens a motion."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, overload

from bodyplan.motion import Motion
from bodyplan.show.outcome import Comparison, Outcome, Variant

if TYPE_CHECKING:
    from bodyplan.show.live import Viewer
    from bodyplan.simulate import Trial

__all__ = ["Comparison", "Outcome", "Variant", "show"]


@overload
def show(
    motion: Motion, trial: Trial | None = None, *, path: str | os.PathLike[str], open_browser: bool = True
) -> Path: ...


@overload
def show(
    motion: Motion,
    trial: Trial | None = None,
    *,
    path: None = None,
    port: int | None = None,
    open_browser: bool = True,
    block: bool | None = None,
) -> Viewer: ...


def show(
    motion: Motion,
    trial: Trial | None = None,
    *,
    path: str | os.PathLike[str] | None = None,
    port: int | None = None,
    open_browser: bool = True,
    block: bool | None = None,
) -> Path | Viewer:
    """Watch a motion live in the browser and change its gait by hand; or, with ``path``, write its report there.

    ``trial``: what :func:`bodyplan.simulate` made of it, shown beside the plan. The live viewer listens on this machine
    only, at ``port`` (None: 8080, or any free one where that is busy; 0: any free one), and is returned: ``.url``,
    ``.stop()``. ``block``: wait for ctrl-C; by default in a script, which would else end at once, and neither at a
    prompt nor in a notebook. With ``path`` the motion is checked, its report written as one HTML file and opened, and
    the path returned.

    Raises InputError for arguments of the wrong kind, a trial of another robot, a busy port or a folder that does not
    exist; MissingExtraError where viser, or for a report matplotlib or plotly, are not installed.
    """
    from bodyplan.show.live.of_motion import checked, source_of

    checked(motion, trial)
    if path is not None:
        made = _written(motion, trial, Path(path))
        if open_browser:
            webbrowser.open(made.resolve().as_uri())
        return made
    from bodyplan.show.live import Viewer

    viewer = Viewer(source_of(motion, trial), port=port)
    waits = not _at_a_prompt() if block is None else block
    if open_browser:
        viewer.open()
    if waits:
        print(f"{viewer.session.source.title}: {viewer.url} (ctrl-C ends it)")
        viewer.wait()
    return viewer


def _written(motion: Motion, trial: Trial | None, path: Path) -> Path:
    """The report of a motion, checked, as one HTML file."""
    from bodyplan.check import check
    from bodyplan.show.live.of_motion import source_of
    from bodyplan.show.report import write_page

    make = source_of(motion, trial).outcome
    assert make is not None
    return write_page(make(None, motion, check(motion), trial), path)


def _at_a_prompt() -> bool:
    """Whether Python goes on after this call by itself: an interactive session or a notebook."""
    return hasattr(sys, "ps1") or bool(sys.flags.interactive) or "ipykernel" in sys.modules
