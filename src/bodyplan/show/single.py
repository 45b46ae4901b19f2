"""The report of one motion, without a mission around it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from bodyplan.check import check
from bodyplan.errors import InputError
from bodyplan.motion import Motion
from bodyplan.show.outcome import Outcome
from bodyplan.show.text import words

if TYPE_CHECKING:
    from bodyplan.simulate import Trial


def write_motion_page(motion: Motion, trial: Trial | None, path: Path) -> Path:
    """Check a motion and write its report as one HTML file to ``path``, which is returned.

    ``trial``: what :func:`bodyplan.simulate` made of it, to be shown beside the plan. Raises InputError for arguments
    of the wrong kind, a trial of another robot or a folder that does not exist; MissingExtraError where matplotlib or
    plotly are not installed.
    """
    from bodyplan.show.report import write_page
    from bodyplan.simulate.trial import Trial

    if not isinstance(motion, Motion):
        raise InputError(f"motion: expected a Motion, got {motion!r}.")
    if trial is not None and not isinstance(trial, Trial):
        raise InputError(f"trial: expected a Trial or None, got {trial!r}.")
    if trial is not None and trial.joints != motion.joints:
        raise InputError(f"trial: its {len(trial.joints)} joints are not those of the motion ({len(motion.joints)}).")
    gait = str(motion.gait.get("kind", "motion"))
    title = f"{words(gait).capitalize()} of {motion.robot.name}"
    return write_page(Outcome(gait, title, "", "", (), motion, check(motion), trial), path)
