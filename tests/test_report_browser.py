"""The report in a headless browser: it runs, fits the window, and obeys the hand. Skipped where there is none."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import bodyplan as bp
from bodyplan.show import inching
from bodyplan.show.beside import Beside
from bodyplan.show.figures import write_figures
from bodyplan.show.fit_outcome import FitOutcome
from bodyplan.show.fit_page import fit_page
from bodyplan.show.outcome import Grid, GridPoint
from bodyplan.show.playback import Playback
from bodyplan.show.report import page
from devtools import BROWSER, dump
from inching_report_cases import five, five_trial
from report_cases import cart, caterpillar, evil_report, follower, outcome, roller, stick


@pytest.fixture(scope="session")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return evil_report(tmp_path_factory.getbasetemp())


@pytest.fixture(scope="session")
def content(report: Path) -> str:
    return report.read_text(encoding="utf-8")


#: measures the page when it is drawn, and tells the page around it
PROBE = """<script>addEventListener("load", () => setTimeout(() => {
  const root = document.documentElement;
  root.dataset.inner = innerWidth;
  root.dataset.scroll = root.scrollWidth;
  const beyond = (e) => !e.closest(".scroll, pre, svg") && e.getBoundingClientRect().right > innerWidth + 1;
  const wide = [...document.querySelectorAll("main *")].filter(beyond);
  root.dataset.wide = wide.map((e) => e.tagName + "." + e.className).join(" ");
  const canvas = document.querySelector("[data-part=canvas]"), context = canvas.getContext("2d");
  const pixels = context.getImageData(0, 0, canvas.width, canvas.height).data;
  root.dataset.blue = pixels.reduce((n, x, i) => n + (i % 4 === 2 && x > 120 && pixels[i - 2] < 70), 0);
  parent.postMessage({ ...root.dataset }, "*");
}, 1500))</script>"""
#: uses every control as a hand would, and tells what became of the replay
HAND = """<script>addEventListener("load", () => setTimeout(() => {
  const { state } = bodyplanReplay, root = document.documentElement.dataset;
  const part = (name) => document.querySelector("[data-part=" + name + "]"), canvas = part("canvas");
  canvas.setPointerCapture = () => {};
  const pointer = (type, pointerId, x, y, more) => {
    const box = canvas.getBoundingClientRect();
    const at = { pointerId, clientX: box.left + x, clientY: box.top + y, bubbles: true, ...more };
    canvas.dispatchEvent(new PointerEvent(type, at));
  };
  const press = (key) => canvas.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true }));
  const moved = (what, act) => {
    const before = JSON.stringify(what());
    act();
    root[act.name] = String(JSON.stringify(what()) !== before);
  };
  const drag = (more) => () => {
    pointer("pointerdown", 1, 100, 100, more);
    pointer("pointermove", 1, 150, 120, more);
    pointer("pointerup", 1, 150, 120, more);
  };
  const view = () => [state.azimuth, state.elevation], frame = () => [state.scale, state.target];
  moved(view, function turns() { drag({})(); });
  moved(frame, function pans() { drag({ shiftKey: true })(); });
  moved(frame, function pinches() {
    pointer("pointerdown", 1, 100, 100);
    pointer("pointerdown", 2, 200, 100);
    pointer("pointermove", 2, 260, 100);
    pointer("pointerup", 1, 100, 100);
    pointer("pointerup", 2, 260, 100);
  });
  const wheel = () => canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: -200, cancelable: true }));
  moved(frame, function scrolls() { wheel(); });
  canvas.focus();
  moved(frame, function wheels() { wheel(); });
  moved(frame, function zooms() { document.querySelector("[data-zoom]").click(); });
  moved(view, function tops() { document.querySelector("[data-view=top]").click(); });
  moved(() => state.t, function steps() { press("ArrowRight"); });
  moved(() => state.t, function scrubs() {
    part("scrub").value = "2.5";
    part("scrub").dispatchEvent(new Event("input"));
  });
  root.scrubbed = state.t;
  moved(() => state.speed, function speeds() {
    part("speed").value = "4";
    part("speed").dispatchEvent(new Event("change"));
  });
  moved(() => state.playing, function plays() { press(" "); });
  moved(() => state.playing, function pauses() { part("play").click(); });
  moved(() => state.follow, function follows() { document.querySelector("[data-toggle=follow]").click(); });
  moved(() => state.t, function seeks() {
    part("timeline").dispatchEvent(new MouseEvent("click", { clientX: 300, bubbles: true }));
  });
}, 800))</script>"""
#: a window cannot be narrower than 500 pixels, a frame in it can
AROUND = """<!doctype html><html><body style="margin:0"><script>
addEventListener("message", (event) => Object.assign(document.documentElement.dataset, event.data));
</script><iframe src="probed.html" style="border:0;width:{width}px;height:800px"></iframe></body></html>"""


@pytest.fixture(scope="session")
def browse(tmp_path_factory: pytest.TempPathFactory) -> Iterator[object]:
    if BROWSER is None:
        pytest.skip("no chromium, chromium-browser or google-chrome on this machine")

    def opened(path: Path, width: int, fragment: str = "") -> str:
        return dump(path.as_uri() + fragment, tmp_path_factory.mktemp("browser"), width)

    yield opened


def attributes(dom: str, tag: str) -> dict[str, str]:
    found = re.search(rf"<{tag}\b([^>]*)>", dom)
    assert found
    return {k: html.unescape(v) for k, v in re.findall(r'([\w-]+)="([^"]*)"', found[1])}


def readout(dom: str) -> str:
    found = re.search(r'data-part="readout">(.*?)</p>', dom, re.S)
    assert found
    return re.sub(r"<[^>]+>", "", found[1])


def test_a_browser_runs_the_page_as_it_is(report: Path, browse) -> None:  # type: ignore[no-untyped-def]
    dom = browse(report, 1280, "#t=1.25")
    assert attributes(dom, "body") | {"data-ready": "replay", "data-plots": "ready"} == attributes(dom, "body")
    assert "data-problems" not in attributes(dom, "html")
    assert "time 1.25 s" in readout(dom) and "cycle 1 of 2" in readout(dom)
    # every plot was drawn
    assert dom.count('data-plot="') == dom.count('class="js-plotly-plot"') >= 8


def with_script(content: str, script: str) -> str:
    """A copy of the page that may run one more script."""
    free = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", content)
    return free.replace("</body></html>", f"{script}</body></html>")


@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_fits_the_window(width: int, report: Path, content: str, tmp_path: Path, browse) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "probed.html").write_text(with_script(content, PROBE), encoding="utf-8")
    around = tmp_path / "around.html"
    around.write_text(AROUND.replace("{width}", str(width)), encoding="utf-8")
    found = attributes(browse(around, 1300), "html")
    assert "data-problems" not in found
    assert int(found["data-inner"]) == width and int(found["data-scroll"]) <= width
    assert found["data-wide"] == ""
    assert int(found["data-blue"]) > 200  # the executed robot is in the picture


def test_hands_move_the_replay(content: str, tmp_path: Path, browse) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "handled.html"
    path.write_text(with_script(content, HAND), encoding="utf-8")
    found = attributes(browse(path, 1000), "html")
    assert "data-problems" not in found
    assert found.pop("data-scrolls") == "false"  # the wheel belongs to the page until the picture is clicked
    assert float(found.pop("data-scrubbed")) == 2.5
    did = {name.removeprefix("data-"): value for name, value in found.items() if name.startswith("data-")}
    names = "turns pans pinches wheels zooms tops steps scrubs speeds plays pauses follows seeks"
    assert did == dict.fromkeys(names.split(), "true")


def test_playing_moves_on(report: Path, browse) -> None:  # type: ignore[no-untyped-def]
    found = re.search(r"time ([\d.]+) s", readout(browse(report, 800, "#t=0.5&view=top&play")))
    assert found and float(found[1]) > 0.5


def test_a_follower_has_its_curve_grid_and_plots(tmp_path: Path, browse) -> None:  # type: ignore[no-untyped-def]
    points = tuple(GridPoint(m, v, "ok", "", v) for m in ("run", "<b>other</b>") for v in (0.2, 0.4))
    grid = Grid("simulate.friction", "friction <i>", (0.2, 0.4), ("run", "<b>other</b>"), points)
    paper = (
        Beside("speed", 55.0, "mm/s", "trial.speed_m_s", "page 7", 54.0),
        Beside("x", 1.0, "", "y", "", None, "no"),
    )
    made = outcome(None, follower(), name="run", grid=grid, paper=paper)
    path = tmp_path / "follower.html"
    path.write_text(page(made, Playback.of(made.motion, None), {}), encoding="utf-8")
    dom = browse(path, 1000, "#t=1&view=top")
    assert attributes(dom, "body")["data-ready"] == "replay" and "data-problems" not in attributes(dom, "html")
    assert 'data-toggle="curve"' in dom
    places = set(re.findall(r'data-plot="(\w+)"', dom))
    assert {"overlay", "turning", "fit_error", "contacts", "grid"} <= places
    assert dom.count('data-plot="') == dom.count('class="js-plotly-plot"')


@pytest.mark.parametrize("width", [1280, 390])
def test_a_snake_on_its_anchors_fits_the_window(  # type: ignore[no-untyped-def]
    width: int, tmp_path: Path, browse, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inching, "HEIGHTS", 3)
    made = outcome(five_trial(), five(), name="run")
    playback = Playback.of(five(), five_trial())
    content = page(made, playback, write_figures(made, playback, tmp_path / "figures"))
    (tmp_path / "probed.html").write_text(with_script(content, PROBE), encoding="utf-8")
    around = tmp_path / "around.html"
    around.write_text(AROUND.replace("{width}", str(width)), encoding="utf-8")
    found = attributes(browse(around, 1300), "html")
    assert "data-problems" not in found and found["data-wide"] == "" and int(found["data-scroll"]) <= width
    assert int(found["data-blue"]) > 200
    path = tmp_path / "plain.html"
    path.write_text(content, encoding="utf-8")
    dom = browse(path, width, "#t=0.5&view=side")
    assert attributes(dom, "body")["data-ready"] == "replay" and "odd anchors move" in readout(dom)
    places = set(re.findall(r'data-plot="(\w+)"', dom))
    assert {"support", "tilt", "holding", "holding_joints", "under_ceiling", "ceilings"} <= places
    assert dom.count('data-plot="') == dom.count('class="js-plotly-plot"')
    assert 'alt="The body on its anchors' in dom


def test_the_page_of_a_fit_runs(tmp_path: Path, browse) -> None:  # type: ignore[no-untyped-def]
    path = tmp_path / "fit.html"
    path.write_text(fit_page(FitOutcome.of("spiral", bp.Spiral(), joints=5, convergence=True)), encoding="utf-8")
    dom = browse(path, 1000)
    assert attributes(dom, "body")["data-plots"] == "ready" and "data-problems" not in attributes(dom, "html")
    assert dom.count('data-plot="') == dom.count('class="js-plotly-plot"') == 5


def test_other_robots_play_too(tmp_path: Path, browse) -> None:  # type: ignore[no-untyped-def]
    for number, motion in enumerate((cart(), caterpillar(), stick(), roller())):
        path = tmp_path / f"{number}.html"
        path.write_text(page(outcome(None, motion), Playback.of(motion, None), {}), encoding="utf-8")
        dom = browse(path, 1000, "#t=1")
        assert attributes(dom, "body")["data-ready"] == "replay" and "data-problems" not in attributes(dom, "html")
        assert "time 1.00 s" in readout(dom)
