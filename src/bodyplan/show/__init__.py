"""Figures, the self-contained report of a run, and its replay; :func:`show` opens the report of a motion."""

from __future__ import annotations

import os
import tempfile
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING

from bodyplan.check import check
from bodyplan.errors import InputError
from bodyplan.motion import Motion
from bodyplan.show.outcome import Comparison, Outcome, Variant
from bodyplan.show.text import words

if TYPE_CHECKING:
    from bodyplan.simulate import Trial

__all__ = ["Comparison", "Outcome", "Variant", "show"]


def show(
    motion: Motion,
    trial: Trial | None = None,
    *,
    path: str | os.PathLike[str] | None = None,
    open_browser: bool = True,
) -> Path:
    """Check a motion, write its report as one HTML file and open it in the browser; returns the file's path.

    ``trial``: what :func:`bodyplan.simulate` made of it, to be shown beside the plan. ``path``: where to
    write (default: a temporary file). Raises InputError for arguments of the wrong kind, a trial of another
    robot or a folder that does not exist; MissingExtraError where matplotlib or plotly are not installed.
    """
    from bodyplan.show.report import write_page
    from bodyplan.simulate.trial import Trial

    if not isinstance(motion, Motion):
        raise InputError(f"motion: expected a Motion, got {motion!r}.")
    if trial is not None and not isinstance(trial, Trial):
        raise InputError(f"trial: expected a Trial or None, got {trial!r}.")
    if trial is not None and trial.joints != motion.joints:
        raise InputError(f"trial: its {len(trial.joints)} joints are not those of the motion ({len(motion.joints)}).")
    if path is None:
        path = Path(tempfile.mkdtemp(prefix="bodyplan.")) / "report.html"
    gait = str(motion.gait.get("kind", "motion"))
    title = f"{words(gait).capitalize()} of {motion.robot.name}"
    made = write_page(Outcome(gait, title, "", "", (), motion, check(motion), trial), Path(path))
    if open_browser:
        webbrowser.open(made.resolve().as_uri())
    return made
