"""Figures of the papers as SVG."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import dataclass

from bodyplan.papers.entries import Drawing, Paper
from bodyplan.show.figures import STYLE, new_figure


@dataclass(frozen=True)
class Drawn:
    """A figure: ``svg``, or ``problem``: why there is none. ``file``: its name in a folder."""

    place: str
    caption: str
    file: str
    svg: str = ""
    problem: str = ""


def draw(paper: Paper, progress: Callable[[str, float], None] | None = None) -> tuple[Drawn, ...]:
    """Every figure of a paper; one that raises has a ``problem``. MissingExtraError without matplotlib."""
    new_figure(1.0)  # says what is missing before anything else fails
    out = []
    for k, drawing in enumerate(paper.drawings):
        if progress is not None:
            progress(f"drawing {paper.name}", k / len(paper.drawings))
        out.append(_drawn(paper.name, drawing))
    return tuple(out)


def _drawn(name: str, drawing: Drawing) -> Drawn:
    from matplotlib import rc_context

    short = re.sub(r"[^a-z0-9]+", "-", drawing.place.lower()).strip("-")
    file = f"{name}-{short}.svg"
    text = io.StringIO()
    try:
        with rc_context(STYLE):  # type: ignore[arg-type]  # the stubs list every key
            figure = new_figure(drawing.height)
            drawing.draw(figure)
            figure.savefig(text, format="svg", metadata={"Date": None})
    except Exception as error:  # the other figures are still wanted
        return Drawn(drawing.place, drawing.caption, file, problem=f"{type(error).__name__}: {error}")
    return Drawn(drawing.place, drawing.caption, file, text.getvalue())
