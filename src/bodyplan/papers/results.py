"""Papers recomputed: one row an entry, as data for a terminal, a page and a program."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Literal

from pydantic import BaseModel, ConfigDict

from bodyplan.papers.entries import Entry, Off, Paper, Printed, Verdict
from bodyplan.units import unit_in_base

STRICT = ConfigDict(extra="forbid")
NEEDS_PHYSICS = "needs the physics: run with --physics"


class Row(BaseModel):
    """One entry. ``printed`` and ``correct`` are texts; ``printed_value`` and ``ours`` numbers in ``unit``; of formulas
    ``printed_off`` and ``ours_off`` say how far each misses the truth, in ``unit``, with ``tolerance``. Numbers are
    None where there is none, or none that is finite. ``ours_text``: ours as it is shown."""

    model_config = STRICT
    place: str
    what: str
    verdict: Verdict
    printed: str = ""
    unit: str = ""
    printed_value: float | None = None
    ours: float | None = None
    ours_text: str = ""
    correct: str = ""
    printed_off: float | None = None
    ours_off: float | None = None
    tolerance: float | None = None
    why: str = ""


class Recomputed(BaseModel):
    """One paper: its rows, and how many have which verdict."""

    model_config = STRICT
    name: str
    title: str
    authors: str
    rows: list[Row]
    counts: dict[str, int]


class Results(BaseModel):
    """All papers asked for."""

    model_config = STRICT
    format: Literal["bodyplan papers 1"] = "bodyplan papers 1"
    version: str
    physics: bool
    papers: list[Recomputed]
    counts: dict[str, int]

    @property
    def ok(self) -> bool:
        """True where nothing raised and nothing differs without a reason."""
        return all(row.verdict.fine for paper in self.papers for row in paper.rows)


def recompute(
    papers: Iterable[Paper], physics: bool = False, progress: Callable[[str, float], None] | None = None
) -> Results:
    """Compute every entry of ``papers``; what raises is a row with the verdict "error". ``physics``: those that need
    MuJoCo, too. ``progress`` hears (paper, part done)."""
    from bodyplan import __version__

    chosen = list(papers)
    done: list[Recomputed] = []
    total, count = sum(len(paper.entries) for paper in chosen), 0
    for paper in chosen:
        rows = []
        for entry in paper.entries:
            if progress is not None:
                progress(paper.name, count / total)
            rows.append(row_of(entry, physics))
            count += 1
        done.append(
            Recomputed(name=paper.name, title=paper.title, authors=paper.authors, rows=rows, counts=_counts(rows))
        )
    every = [row for paper in done for row in paper.rows]
    return Results(version=__version__, physics=physics, papers=done, counts=_counts(every))


def _counts(rows: Iterable[Row]) -> dict[str, int]:
    out = {verdict.value: 0 for verdict in Verdict}
    for row in rows:
        out[row.verdict.value] += 1
    return out


def row_of(entry: Entry, physics: bool = False) -> Row:
    """The row of one entry, whatever happens while it is computed."""
    printed = Printed.of(entry.printed)
    row = Row(
        place=entry.place,
        what=entry.what,
        verdict=Verdict.NOT_REPRODUCIBLE,
        printed=entry.printed,
        unit=entry.unit,
        printed_value=None if printed is None else printed.value,
        correct=entry.correct,
    )
    if entry.compute is None:
        return row.model_copy(update={"why": entry.reason})
    if entry.physics and not physics:
        return row.model_copy(update={"why": f"{entry.reason}; {NEEDS_PHYSICS}" if entry.reason else NEEDS_PHYSICS})
    try:
        scale = unit_in_base(entry.unit)[0]
        found = entry.compute()
        if not isinstance(found, Off):
            found = float(found) / scale
        verdict = entry.verdict(found)
    except Exception as error:  # whatever it is, the other rows are still wanted
        text = f"{type(error).__name__}: {error}".rstrip(": ")
        return row.model_copy(update={"verdict": Verdict.ERROR, "why": text})
    why = {
        Verdict.CORRECTED: entry.why,
        Verdict.NOT_REPRODUCIBLE: entry.reason,
        Verdict.DIFFERS: "no explanation is known",
    }
    update: dict[str, object] = {"verdict": verdict, "why": why.get(verdict, "")}
    if isinstance(found, Off):
        update |= {
            "printed_off": _finite(found.printed / scale),
            "ours_off": _finite(found.ours / scale),
            "tolerance": entry.tolerance / scale,
        }
    else:
        digits = 4 if printed is None else printed.digits()
        update |= {"ours": _finite(found), "ours_text": f"{found:.{digits}g}" if math.isfinite(found) else "undefined"}
    return row.model_copy(update=update)


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
