"""A motion inside a notebook: its report, replay first, in a frame of its own."""

from __future__ import annotations

import html
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from bodyplan.arrays import number
from bodyplan.motion import Motion

if TYPE_CHECKING:
    from bodyplan.simulate import Trial


@dataclass(frozen=True, repr=False)
class Inline:
    """What :func:`inline` returns: Jupyter shows it. ``page`` is the HTML text of the report, ``height`` px."""

    page: str
    height: int

    def _repr_html_(self) -> str:
        return (
            f'<iframe srcdoc="{html.escape(self.page, quote=True)}" title="bodyplan" loading="lazy" '
            f'style="width:100%;height:{self.height}px;border:1px solid #8884;border-radius:6px"></iframe>'
        )

    def __repr__(self) -> str:
        return f"Inline(page of {len(self.page)} characters, height={self.height})"


def inline(motion: Motion, trial: Trial | None = None, *, height: int = 640) -> Inline:
    """The report of a motion, with its replay, as the result of a notebook's cell.

    ``trial``: what :func:`bodyplan.simulate` made of it. ``height`` px of the frame. The page is part of the notebook
    and needs no network. Raises as :func:`bodyplan.show.show` with a path.
    """
    from bodyplan.show import show

    tall = int(number(height, "height", at_least=200.0, at_most=5000.0))
    with tempfile.TemporaryDirectory() as folder:
        path = show(motion, trial, path=Path(folder) / "report.html", open_browser=False)
        return Inline(path.read_text(encoding="utf-8"), tall)
