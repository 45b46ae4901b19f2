"""The page of ``bodyplan papers``: what the papers print beside ours, and their figures redrawn."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path

from bodyplan.files import replacing, replacing_folder
from bodyplan.papers.drawn import Drawn
from bodyplan.papers.entries import Paper, Verdict
from bodyplan.papers.results import Recomputed, Results, Row
from bodyplan.show.document import document
from bodyplan.show.text import counted, esc, figure, folded, listed, picture, section, table

#: what is written into a folder
WRITTEN = ("papers.html", "papers.json", "papers.schema.json", "figures")
#: rows from which a part is folded
MANY = 24
_GREEK = {"alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "theta": "θ", "kappa": "κ", "mu": "μ",
          "pi": "π", "rho": "ρ", "phi": "φ", "psi": "ψ", "omega": "ω", "Gamma": "Γ", "Omega": "Ω"}  # fmt: skip
_GREEK_WORD = re.compile(rf"(?<![A-Za-z])({'|'.join(_GREEK)})(?![A-Za-z])")
TITLES = {
    Verdict.ERROR: "Raised an error",
    Verdict.DIFFERS: "Differs, and nobody has said why",
    Verdict.CORRECTED: "Corrected",
    Verdict.REPRODUCED: "Reproduced",
    Verdict.NOT_REPRODUCIBLE: "Not reproducible",
}


def pretty(text: str) -> str:
    """A plain formula or a sentence with one as HTML: Greek letters, indices, powers, roots."""
    out = _GREEK_WORD.sub(lambda m: _GREEK[m[1]], esc(text))
    out = re.sub(r"_\(([^)]*)\)", r"<sub>\1</sub>", out)
    out = re.sub(r"(?<=[A-Za-zα-ωΑ-Ω)])_([A-Za-z0-9]+(?:,[a-z0-9]+)?)", r"<sub>\1</sub>", out)
    out = re.sub(r"\^\(([^)]*)\)", r"<sup>\1</sup>", out)
    out = re.sub(r"\^(-?[A-Za-z0-9]+)", r"<sup>\1</sup>", out)
    out = re.sub(r"\bsqrt ?(?=[\d(])", "√", out)
    # signs: a hyphen that nothing stands before, but in an option's name
    return re.sub(r"(?:(?<=^)|(?<=[ (\[]))-(?=[^-])", "−", out)


def unit_text(unit: str) -> str:
    """A unit as it is shown."""
    return {"deg": "°", "N*m": "N m"}.get(unit, unit)


def with_unit(text: str, unit: str) -> str:
    """A printed or computed number and its unit as HTML; "°" without a space."""
    shown = re.sub(r"(?<=\d)e([+-]\d+)$", lambda m: f"×10<sup>{int(m[1])}</sup>", text).replace("-", "−")
    if not unit:
        return shown
    return f"{shown}°" if unit == "deg" else f"{shown}\u00a0{unit_text(unit)}"


def off_text(row: Row, value: float | None) -> str:
    """How far a formula is off."""
    if value is None:
        return "undefined"
    if value == 0.0:
        return "exact"
    unit = "" if not row.unit else f"\u00a0{row.unit if row.unit == 'deg' else unit_text(row.unit)}"
    return f"off by {figure(value, digits=2 if value < 99.5 else 4)}{unit}"


def cells(row: Row) -> tuple[str, str, str, str]:
    """Place, what, the paper, here: HTML."""
    what = pretty(row.what)
    if row.why:
        kind = ' class="why"' if row.verdict is Verdict.CORRECTED else ""
        what += f"<small{kind}>{pretty(row.why)}</small>"
    here = f"<small>{pretty(row.correct)}</small>" if row.correct and row.verdict is Verdict.CORRECTED else ""
    if row.tolerance is not None:
        printed = f"{pretty(row.printed)}<small>{off_text(row, row.printed_off)}</small>"
        shown = pretty(row.correct) if row.correct and row.verdict is Verdict.CORRECTED else "the same"
        return esc(row.place), what, printed, f"{shown}<small>{off_text(row, row.ours_off)}</small>"
    printed = with_unit(esc(row.printed), row.unit) if row.printed_value is not None else pretty(row.printed)
    ours = with_unit(row.ours_text, row.unit) if row.ours_text else "–" if printed else ""
    return esc(row.place), what, printed, ours + here


def rows_table(rows: Sequence[Row]) -> str:
    """A table of rows; of two columns where none has anything printed."""
    if not any(row.printed for row in rows):
        made = [cells(row)[:2] for row in rows]
        return table(("place", "what"), made, kind="papers two")
    return table(("place", "what", "the paper", "here"), [cells(row) for row in rows], kind="papers four")


def _paper(paper: Paper, done: Recomputed, drawn: Sequence[Drawn]) -> str:
    out = f'<p class="authors">{esc(paper.authors)}</p><p>{esc(paper.about)}</p>'
    kinds = [counted(n, name) for n, name in
             ((paper.tables, "table"), (paper.figures, "figure"), (paper.equations, "equation")) if n]  # fmt: skip
    counts = [f"{done.counts[verdict.value]} {verdict.value}" for verdict in Verdict if done.counts[verdict.value]]
    out += f"<p>{esc(listed(kinds))}, all of them covered by {len(done.rows)} entries: {esc(listed(counts))}.</p>"
    for verdict, title in TITLES.items():
        rows = [row for row in done.rows if row.verdict is verdict]
        if not rows:
            continue
        bad = "" if verdict.fine else ' class="bad"'
        if verdict.fine and len(rows) > MANY:
            out += folded(f"<b>{title}: {len(rows)}</b>", rows_table(rows))
        else:
            out += f"<h3{bad}>{title}: {len(rows)}</h3>" + rows_table(rows)
    if drawn:
        out += "<h3>Figures redrawn</h3>"
    for made in drawn:
        caption = f"<figcaption><b>{esc(made.place)}</b> {pretty(made.caption)}</figcaption>"
        inside = (
            picture(made.svg, f"{made.place}: {made.caption}")
            if made.svg
            else f'<p class="bad">{esc(made.problem)}</p>'
        )
        out += f'<figure class="redrawn">{caption}{inside}</figure>'
    return section(done.name, f"{esc(done.name)}: {esc(done.title)}", out)


def _head(results: Results) -> str:
    many = len(results.papers) > 1
    title = "What the papers print, recomputed" if many else f"What paper {results.papers[0].name} prints, recomputed"
    about = (
        "Every number, table, figure and equation that can be computed is computed by bodyplan and set beside what is "
        "printed. Numbers decide: <b>reproduced</b> means equal to the last printed digit, or an equation that agrees "
        "with a third way of computing; <b>corrected</b> means that what is printed misses and ours does not, and says "
        "what is right; <b>not reproducible</b> means that hardware, missing data or a contradiction stands in the "
        "way. A &lt; or &gt; stands for a claim in words."
    )
    notes = {
        Verdict.REPRODUCED: "to the digits printed",
        Verdict.CORRECTED: "with what is right",
        Verdict.NOT_REPRODUCIBLE: "with the reason",
        Verdict.DIFFERS: "without a reason",
        Verdict.ERROR: "while computing",
    }
    shown = [v for v in Verdict if results.counts[v.value] or v.fine]
    tiles = "".join(
        f'<div class="tile"><dt>{v.value}</dt><dd>{results.counts[v.value]}<small>{notes[v]}</small></dd></div>'
        for v in shown
    )
    physics = (
        ""
        if results.physics
        else '<p class="physics">Entries that need the physics were left out; <code>--physics</code> runs them.</p>'
    )
    out = (
        f'<header><p class="kicker">bodyplan papers</p><h1>{esc(title)}</h1><p>{about}</p></header>'
        f'<dl class="tiles">{tiles}</dl>{physics}'
    )
    if many:
        out += '<nav aria-label="Contents">' + "".join(
            f'<a href="#{p.name}">{esc(p.name)}</a>' for p in results.papers
        ) + "</nav>"  # fmt: skip
    return out


def page(results: Results, papers: Sequence[Paper], drawn: Mapping[str, Sequence[Drawn]]) -> str:
    """The whole HTML file; ``drawn``: figures by the name of their paper."""
    style = resources.files("bodyplan.papers").joinpath("page.css").read_text(encoding="utf-8")
    parts = [_paper(paper, done, drawn.get(done.name, ())) for paper, done in zip(papers, results.papers, strict=True)]
    foot = f'<p class="versions">Made with bodyplan {esc(results.version)}.</p>'
    return document("Papers", [f"<style>{style}</style>", _head(results), *parts, foot], {}, ())


def results_json(results: Results) -> str:
    """The results as JSON text, every key there."""
    return json.dumps(results.model_dump(mode="json"), indent=2, allow_nan=False) + "\n"


def write_json(results: Results, path: Path) -> Path:
    """The results as a JSON file. Raises InputError where it cannot be written."""
    with replacing(path) as file:
        file.write(results_json(results))
    return path


def write_folder(
    results: Results, papers: Sequence[Paper], drawn: Mapping[str, Sequence[Drawn]], folder: Path, force: bool
) -> Path:
    """papers.html, papers.json, its schema and figures/*.svg; returns the page. Raises InputError."""
    with replacing_folder(folder, force, WRITTEN) as scratch:
        (scratch / "figures").mkdir()
        for made in (each for several in drawn.values() for each in several if each.svg):
            (scratch / "figures" / made.file).write_text(made.svg, encoding="utf-8")
        write_json(results, scratch / "papers.json")
        schema = json.dumps(Results.model_json_schema(), indent=2) + "\n"
        (scratch / "papers.schema.json").write_text(schema, encoding="utf-8")
        (scratch / "papers.html").write_text(page(results, papers, drawn), encoding="utf-8")
    return folder / "papers.html"
