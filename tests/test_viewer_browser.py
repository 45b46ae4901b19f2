"""The live viewer in a headless browser: it loads, plays, obeys, plans anew. Skipped where there is no browser."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bodyplan.show.live import Viewer
from bodyplan.viewing import view
from devtools import BROWSER, Page

pytest.importorskip("viser", reason="viser (extra view) is not installed")
pytestmark = pytest.mark.skipif(BROWSER is None, reason="no chromium, chromium-browser or google-chrome here")

LONG = 60.0
#: the button with some words, and the part of a slider that a hand takes, by the slider's label
BUTTON = "[...document.querySelectorAll('button')].find(b => b.innerText.trim() === {0})"
LABEL = "[...document.querySelectorAll('label')].find(l => l.innerText.trim() === {0})"
THUMB = """(() => {{
  for (let e = {0}; e; e = e.parentElement) {{
    const found = e.querySelector('[role=slider]');
    if (found) return found;
  }}
}})()"""


@pytest.fixture(scope="module")
def viewer() -> Iterator[Viewer]:
    made = view("crawl-flat", port=0)
    try:
        assert made.session.idle(LONG)
        yield made
    finally:
        made.stop()


@pytest.fixture(scope="module")
def page(viewer: Viewer, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    made = Page(tmp_path_factory.mktemp("profile"))
    try:
        made.open(viewer.url)
        made.wait("document.querySelector('[data-bp=moment]') !== null", LONG)
        yield made
    finally:
        made.close()


def said(page: Page, part: str) -> str:
    """What a part of the panel says."""
    return str(page.ask(f"document.querySelector('[data-bp={part}]')?.innerText || ''"))


def press(page: Page, words: str) -> None:
    """Press the button with these words."""
    found = BUTTON.format(json.dumps(words))
    page.wait(found + " !== undefined")
    page.ask(found + ".click()")


def thumb(page: Page, label: str) -> str:
    """JavaScript for the part of a slider that a hand takes."""
    return THUMB.format(LABEL.format(json.dumps(label)))


def until(condition: str, page: Page, viewer: Viewer) -> None:
    """Wait until something is true of the viewer, while the page's messages are read."""
    end = time.monotonic() + LONG
    while not eval(condition, {"viewer": viewer}):
        assert time.monotonic() < end, condition
        page.ask("1")
        time.sleep(0.05)


def test_it_loads_and_draws(page: Page, viewer: Viewer, tmp_path: Path) -> None:
    page.wait("document.body.innerText.includes('checks passed')", LONG)
    text = page.text()
    assert "A static crawl of SILO4 on the flat" in text and "velocity ahead (mm/s)" in text and "Run physics" in text
    until("len(viewer.server.get_clients()) == 1", page, viewer)
    # the robot's colour is in the picture
    image = pytest.importorskip("matplotlib.image").imread(page.picture(tmp_path / "page.png"))
    end = time.monotonic() + LONG
    while True:
        red, green, blue = (image[..., i] for i in range(3))
        if int(np.sum((red > 0.4) & (green > 0.2) & (blue < 0.5 * red))) > 200:
            break
        assert time.monotonic() < end
        image = pytest.importorskip("matplotlib.image").imread(page.picture(tmp_path / "page.png"))


def test_it_plays_pauses_and_scrubs(page: Page, viewer: Viewer) -> None:
    first = said(page, "moment")
    page.wait(f"document.querySelector('[data-bp=moment]').innerText !== {json.dumps(first)}", LONG)
    place = thumb(page, "time (s)") + ".getAttribute('aria-valuenow')"
    before = page.ask(place)
    page.wait(f"{place} !== {json.dumps(before)}", LONG)  # the slider of the time goes along
    press(page, "Pause")
    page.wait(BUTTON.format('"Play"') + " !== undefined", LONG)
    still = viewer.time
    page.ask(thumb(page, "time (s)") + ".focus()")
    for _ in range(3):
        page.call("Input.dispatchKeyEvent", type="keyDown", key="ArrowLeft", code="ArrowLeft", windowsVirtualKeyCode=37)
        page.call("Input.dispatchKeyEvent", type="keyUp", key="ArrowLeft", code="ArrowLeft", windowsVirtualKeyCode=37)
    until(f"viewer.time < {still}", page, viewer)
    press(page, "Play")
    until(f"viewer.time > {viewer.time} + 0.5", page, viewer)


def test_dragging_a_slider_plans_anew(page: Page, viewer: Viewer) -> None:
    number, advance = viewer.session.state.number, viewer.session.state.motion.facts["advance_per_cycle"]
    handle = thumb(page, "velocity ahead (mm/s)")
    page.ask(handle + ".scrollIntoView({block: 'center'})")
    box = page.ask(f"(() => {{ const r = {handle}.getBoundingClientRect(); return [r.x, r.y, r.width, r.height] }})()")
    x, y = box[0] + 0.5 * box[2], box[1] + 0.5 * box[3]
    page.mouse("mousePressed", x, y)
    for step in range(1, 6):
        page.mouse("mouseMoved", x - 5.0 * step, y)
        time.sleep(0.05)
    page.mouse("mouseReleased", x - 25.0, y)
    until(f"viewer.session.state.number > {number} and not viewer.session.state.planning", page, viewer)
    assert viewer.session.idle(LONG)
    state = viewer.session.state
    speed = float(page.ask(handle + ".getAttribute('aria-valuenow')"))
    assert speed < 9.5 and viewer.session.gait.to_dict()["velocity"][0] == pytest.approx(1e-3 * speed)  # type: ignore[union-attr]
    assert state.motion.facts["advance_per_cycle"] < advance and not state.problem and state.report is not None
    page.wait("document.querySelector('[data-bp=verdict]').innerText.includes('checks passed')", LONG)
    press(page, "As it was")
    until("viewer.session.gait == viewer.session.source.gait", page, viewer)
    page.wait(handle + ".getAttribute('aria-valuenow') === '10'", LONG)
    assert viewer.session.idle(LONG)


def test_physics_at_the_press_of_a_button(page: Page, viewer: Viewer) -> None:
    press(page, "Run physics")
    until("viewer.session.state.physics is not None or viewer.session.state.trial is not None", page, viewer)
    until("viewer.session.state.trial is not None", page, viewer)
    page.wait("document.querySelector('[data-bp=physics]').innerText.includes('executed')", LONG)
    assert viewer.session.state.trial is not None and viewer.session.state.trial.ok


def test_a_download_arrives(page: Page, viewer: Viewer, tmp_path: Path) -> None:
    page.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    page.ask("[...document.querySelectorAll('*')].find(e => !e.children.length && e.innerText === 'Download').click()")
    found = "[...document.querySelectorAll('button')].filter(b => b.innerText.trim() === 'Download').pop()"
    page.wait(f"{found} !== undefined", LONG)
    page.ask(found + ".click()")
    file = tmp_path / "crawl-flat.csv"
    end = time.monotonic() + LONG
    while not file.is_file():
        assert time.monotonic() < end, list(tmp_path.iterdir())
        page.ask("1")
        time.sleep(0.1)
    assert file.read_bytes() == viewer.session.state.motion.save(tmp_path / "mine.csv").read_bytes()


def test_nothing_went_wrong_and_nothing_was_asked_elsewhere(page: Page, viewer: Viewer) -> None:
    page.ask("1")
    assert page.errors == []
    own = viewer.url.removeprefix("http://")
    elsewhere = [u for u in page.asked if not u.startswith((f"http://{own}", f"ws://{own}", "data:", "blob:"))]
    assert page.asked and elsewhere == []
