"""The report of a run: one HTML file that opens anywhere, and its figures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from bodyplan.errors import InputError
from bodyplan.files import replacing
from bodyplan.show import sections
from bodyplan.show.carrying_page import carrying_section
from bodyplan.show.crawling import crawling_section
from bodyplan.show.document import document
from bodyplan.show.execution import execution
from bodyplan.show.figures import write_figures
from bodyplan.show.following_page import following_section
from bodyplan.show.grids import grid_section
from bodyplan.show.inching_page import inching_section
from bodyplan.show.outcome import Outcome
from bodyplan.show.overview import head
from bodyplan.show.playback import Playback
from bodyplan.show.plots import plots
from bodyplan.show.scene import scene
from bodyplan.show.schedule import schedule_part
from bodyplan.show.text import picture, plot, section

#: the page's own scripts, in the order in which they run
SCRIPTS = ("pointer", "timeline", "replay", "plots")
VIEWS = {"3d": "3D", "top": "Top", "side": "Side", "front": "Front"}
SPEEDS = (0.1, 0.25, 0.5, 1, 2, 4, 8)


def write_report(outcome: Outcome, folder: Path) -> Path:
    """Write ``folder/report.html``, which needs nothing but a browser, and ``folder/figures/*.png`` and
    ``*.svg``.

    Returns the path of the HTML file. Raises InputError for a folder that does not exist, MissingExtraError
    where matplotlib or plotly are not installed.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: no such folder to write the report to.")
    playback = Playback.of(outcome.motion, outcome.trial)
    drawn = write_figures(outcome, playback, folder / "figures")
    return _write(outcome, playback, drawn, folder / "report.html")


def write_page(outcome: Outcome, path: Path) -> Path:
    """Write the HTML file alone, to ``path``. Raises as :func:`write_report`."""
    playback = Playback.of(outcome.motion, outcome.trial)
    with TemporaryDirectory() as scratch:
        drawn = write_figures(outcome, playback, Path(scratch))
    return _write(outcome, playback, drawn, path)


def _write(outcome: Outcome, playback: Playback, drawn: Mapping[str, str], path: Path) -> Path:
    with replacing(path) as file:
        file.write(page(outcome, playback, drawn))
    return path


def page(outcome: Outcome, playback: Playback, drawn: Mapping[str, str]) -> str:
    """The whole HTML file; ``drawn`` are the figures as SVG by name."""
    replayed = scene(playback)
    parts = {
        "Replay": _replay(playback, curve=replayed["path"] is not None),
        "Checks": sections.checks(outcome),
        "Planned and executed": execution(outcome, playback),
        "On its anchors": inching_section(outcome, playback, drawn),
        "On its feet": crawling_section(outcome.motion, drawn),
        "On its wheels": carrying_section(playback.carrying, drawn, paper=bool(outcome.paper)),
        "Comparison": sections.comparison(outcome),
        "Beside the paper": sections.beside_the_paper(outcome),
        "Grid": grid_section(outcome.grid, outcome.name),
        "Curve and mechanism": following_section(playback.following, drawn),
        "Plots": _curves(outcome, playback, drawn),
        "Rates": sections.rates(outcome),
        "Notes and data": sections.notes(outcome),
    }
    data = {"replay-data": replayed, "plots-data": plots(outcome, playback)}
    return document(outcome.title, [head(outcome, playback), _contents(parts), *parts.values()], data, SCRIPTS)


def _contents(parts: Mapping[str, str]) -> str:
    """Links to the parts that there are."""
    places = {title: part.split('"')[1] for title, part in parts.items() if part}
    links = "".join(f'<a href="#{place}">{title}</a>' for title, place in places.items())
    return f'<nav aria-label="Contents">{links}</nav>'


def _replay(playback: Playback, *, curve: bool) -> str:
    executed = playback.executed is not None
    toggles = [("planned", "planned", "planned")]
    if executed:
        toggles.append(("executed", "executed", "executed"))
    if curve:
        toggles.append(("curve", "curve", "curve"))
    toggles += [("trail", "trail", ""), ("follow", "follow", "")]
    boxes = "".join(
        f'<label class="{kind}"><input type="checkbox" data-toggle="{name}"> {text}</label>'
        for name, text, kind in toggles
    )
    views = "".join(f'<button type="button" data-view="{v}">{t}</button>' for v, t in VIEWS.items())
    speeds = "".join(f'<option value="{s}"{" selected" if s == 1 else ""}>{s}×</option>' for s in SPEEDS)
    what = "planned (orange) and executed (blue)" if executed else "planned"
    return section(
        "motion",
        "The motion",
        f"""<div id="replay">
<canvas data-part="canvas" tabindex="0" role="img" aria-label="Replay of the {what} motion"></canvas>
<div class="controls"><button type="button" data-part="play" class="play">▶ Play</button>
<input type="range" data-part="scrub" aria-label="Time" value="0">
<label>speed <select data-part="speed">{speeds}</select></label></div>
<canvas data-part="timeline" aria-hidden="true"></canvas>
<p class="readout" data-part="readout"></p>
<div class="controls"><span class="group">{views}</span><span class="group">
<button type="button" data-zoom="1.25" aria-label="Zoom in">+</button>
<button type="button" data-zoom="0.8" aria-label="Zoom out">−</button></span>{boxes}</div>
<p class="hint">Drag to turn, shift-drag or two fingers to move, pinch or click and wheel to zoom; space
plays, arrow keys step. Add <code>#t=3.2</code> to the address to open the report at a time.</p></div>""",
    )


def _curves(outcome: Outcome, playback: Playback, drawn: Mapping[str, str]) -> str:
    out = ""
    if "body_keyframes" in drawn:
        what = "planned and executed body" if outcome.trial is not None and outcome.trial.ok else "planned body"
        alt = f"The {what} at even times of one cycle"
        out += "<h3>The body at key frames</h3>" + picture(drawn["body_keyframes"], alt)
    for kind in ("angle", "length"):
        if kind in outcome.motion.robot.kinds:
            name = "angles" if kind == "angle" else "lengths"
            out += f"<h3>Joint {name} over one cycle, planned</h3>" + plot(f"angles_{kind}")
            out += plot(f"rates_{kind}") + plot(f"fastest_{kind}")
    return section("curves", "Plots", out + schedule_part(playback))
