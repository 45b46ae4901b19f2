"""Each paper's tables, figures and equations, printed beside ours: one file a paper, one line in :data:`PAPERS`.

:func:`paper` loads one, :func:`recompute` computes its entries; ``page.py`` makes the page, ``drawings/`` the figures.
"""

from __future__ import annotations

import importlib

from bodyplan.errors import UnknownNameError
from bodyplan.papers.entries import Drawing, Entry, Off, Paper, Printed, Verdict
from bodyplan.papers.results import Recomputed, Results, Row, recompute

__all__ = [
    "PAPERS",
    "Drawing",
    "Entry",
    "Off",
    "Paper",
    "Printed",
    "Recomputed",
    "Results",
    "Row",
    "Verdict",
    "paper",
    "recompute",
]

#: short names of the papers, as everywhere in bodyplan
PAPERS = ("concertina", "acm", "rectilinear", "legs", "wheels")


def paper(name: str) -> Paper:
    """The paper of that short name; UnknownNameError for another."""
    if name not in PAPERS:
        raise UnknownNameError("paper", name, PAPERS)
    made: Paper = importlib.import_module(f"bodyplan.papers.{name}").PAPER
    return made
