"""The report as a page: what it says, that it is one file, that texts stay texts, that a browser runs it."""

from __future__ import annotations

import html
import re
import shutil
import subprocess
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.check import Line, Report
from bodyplan.errors import InputError, MissingExtraError
from bodyplan.show.outcome import Outcome
from bodyplan.show.playback import Playback
from bodyplan.show.report import page, write_report
from report_cases import (
    LOST,
    cart,
    caterpillar,
    diverged_trial,
    full_outcome,
    outcome,
    snake_motion,
    snake_trial,
    stick,
)

VOID = {"meta", "input", "img", "br", "link", "hr"}
EVIL = "<script>document.documentElement.dataset.problems='hacked'</script><img src=x onerror=alert(1)>"


class Reader(HTMLParser):
    """Checks that elements nest; keeps the text that a person sees, the attributes and the scripts."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.text: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.scripts = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += [(tag, name, value or "") for name, value in attrs]
        self.scripts += tag == "script"
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-3:]}"
        self.open.pop()

    def handle_data(self, data: str) -> None:
        if not {"script", "style"} & set(self.open):
            self.text.append(data)


def read(content: str) -> Reader:
    reader = Reader()
    reader.feed(content)
    assert reader.open == []
    return reader


def words_of(made: Outcome) -> str:
    """The visible text of the page of an outcome, without figures; spaces are plain."""
    content = page(made, Playback.of(made.motion, made.trial), {})
    return re.sub(r"\s+", " ", " ".join(read(content).text).replace("\u00a0", " "))


@pytest.fixture(scope="session")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_report(full_outcome(title=f"Mine {EVIL}"), tmp_path_factory.mktemp("report"))


@pytest.fixture(scope="session")
def content(report: Path) -> str:
    return report.read_text(encoding="utf-8")


# --- what it says


def test_the_page_says_the_numbers_of_the_run() -> None:
    text = words_of(full_outcome())
    advance = snake_motion().facts["advance_per_cycle"]
    ratio = 1.0 - LOST / advance
    assert f"Physics executed {100 * ratio:#.3g} % of the planned advance" in text
    assert f"{1e3 * advance:.4g} mm {1e3 * (advance - LOST):.4g} mm {100 * ratio:#.3g} %" in text
    assert f"{1e3 * LOST:.3g} mm of the planned {1e3 * advance:.4g} mm a cycle" in text
    for wanted in (
        "torque, peak 0.7331 N m",
        "0.81",
        "43.2 %",
        "12.3 mm/s",
        "4.56 rad/s",
        "lost (diverged)",
        "the <floor> is wet",
        "gait.omega=1.2",
        'title = "x"',
        "mujoco 4.0.0",
        "width 160 mm",
        "advance in cycle 2",
        "Eq. (2) is taken with its sign corrected",
        "by five points",
    ):
        assert wanted in text, wanted
    for name, _, _ in snake_motion().stages:
        assert name in text


def test_failed_checks_come_first_and_are_counted() -> None:
    lines = (
        Line("all is well", 1e-12, 1e-9, "m", True),
        Line("too <far>", 0.0321, 0.01, "m", False, "at 3 s"),
        Line("unknown", None, None, "", None, "no samples"),
    )
    text = words_of(outcome(None, report=Report(lines)))
    assert "1 of 3 checks failed" in text and "32.1 mm ≤ 10 mm at 3 s" in text
    assert text.index("too <far>") < text.index("unknown") < text.index("all is well")
    assert "All 2 checks passed" in words_of(outcome(None, report=Report(lines[:1] * 2)))
    assert "1 checks passed, 1 could not be made" in words_of(outcome(None, report=Report(lines[::2])))


@pytest.mark.parametrize(
    "made",
    [
        lambda: outcome(None),
        lambda: outcome(diverged_trial()),
        lambda: outcome(None, cart()),
        lambda: outcome(None, caterpillar()),
        lambda: outcome(None, stick(), mission_text="", about=""),
        full_outcome,
    ],
    ids=["plan", "diverged", "cart", "caterpillar", "stick", "trial"],
)
def test_every_kind_of_run_has_a_page_without_empty_values(made) -> None:  # type: ignore[no-untyped-def]
    text = words_of(made())
    assert not re.search(r"\b(nan|inf|None|null|undefined)\b", text)


def test_what_was_not_measured_is_a_dash_and_said() -> None:
    text = words_of(outcome(None))
    assert "Not executed in physics" in text and "Executed / planned – not simulated" in text
    text = words_of(outcome(diverged_trial()))
    assert "Physics diverged: the velocity of joint 'yaw3' is 1e+07" in text
    assert "Executed / planned – physics diverged" in text


def test_a_motion_that_goes_nowhere_is_not_called_a_failure() -> None:
    still = bp.Trial(**{**vars(snake_trial()), "advance_ratios": None, "planned_advance": np.zeros((2, 3))})
    assert "no advance is planned" in words_of(outcome(still))


# --- that it is one file, and safe


def test_the_page_nests_and_loads_nothing(content: str) -> None:
    reader = read(content)
    for tag, name, value in reader.attributes:
        assert name not in ("onclick", "onerror", "onload"), (tag, name)
        if name in ("src", "href", "srcset", "action", "data", "poster"):
            assert value.startswith(("#", "data:image/svg+xml;base64,")), (tag, name, value[:80])
    assert "@import" not in content.split("</style>")[0] and "url(" not in content.split("</style>")[0]
    policy = next(v for _, n, v in reader.attributes if n == "content" and "default-src" in v)
    assert (
        policy.startswith("default-src 'none'; script-src 'sha256-")
        and "unsafe-inline" not in policy.split("style-src")[0]
    )


def test_texts_of_a_mission_stay_texts() -> None:
    stages = ((EVIL, 0.0, 1.0),)
    motion = snake_motion().replace(stages=stages, notes=(EVIL,), claims=(), gait={"kind": EVIL, "x": EVIL})
    report = Report((Line(EVIL, 1.0, 2.0, EVIL, False, EVIL),))
    made = outcome(
        None, motion, title=EVIL, about=EVIL, mission_text=EVIL, overrides=(EVIL,), name=EVIL, report=report
    )
    whole = page(made, Playback.of(motion, None), {})
    clean = page(outcome(None), Playback.of(snake_motion(), None), {})
    assert read(whole).scripts == read(clean).scripts
    assert EVIL not in whole and whole.count("<img") == clean.count("<img")
    assert " ".join(read(whole).text).count(EVIL) >= 8


def test_files_lie_where_they_should(report: Path) -> None:
    assert sorted(p.name for p in report.parent.iterdir()) == ["figures", "report.html"]
    assert {p.suffix for p in (report.parent / "figures").iterdir()} == {".png", ".svg"}
    assert report.stat().st_size < 9e6
    with pytest.raises(InputError, match="no such folder"):
        write_report(full_outcome(), report.parent / "nowhere")


# --- bp.show


def test_show_writes_and_opens_a_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    made = bp.show(stick(), path=tmp_path / "mine.html")
    assert made == tmp_path / "mine.html" and opened == [made.resolve().as_uri()]
    assert "By hand of stick" in made.read_text(encoding="utf-8")
    elsewhere = bp.show(stick(), open_browser=False)
    assert elsewhere.is_file() and len(opened) == 1
    shutil.rmtree(elsewhere.parent)


def test_show_refuses_what_it_cannot_show(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="motion: expected a Motion"):
        bp.show("motion.npz")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="trial: expected a Trial or None"):
        bp.show(stick(), 3)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="trial: its 7 joints are not those of the motion"):
        bp.show(stick(), snake_trial())
    with pytest.raises(InputError, match="does not exist"):
        bp.show(stick(), path=tmp_path / "no" / "mine.html", open_browser=False)


@pytest.mark.parametrize("library", ["matplotlib", "plotly"])
def test_a_missing_library_is_named(library: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("matplotlib.figure", "plotly.offline"):
        if module.startswith(library):
            monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(
        MissingExtraError, match=rf"needs {library}; install it with: pip install 'bodyplan\[report\]'"
    ):
        bp.show(stick(), path=tmp_path / "mine.html", open_browser=False)


# --- in a browser


BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
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
#: nothing of the browser's own may reach out or ask
QUIET = (
    "--headless",
    "--no-sandbox",
    "--no-first-run",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-gpu",
)


@pytest.fixture(scope="session")
def browse(tmp_path_factory: pytest.TempPathFactory) -> Iterator[object]:
    if BROWSER is None:
        pytest.skip("no chromium, chromium-browser or google-chrome on this machine")

    def dump(path: Path, width: int, fragment: str = "") -> str:
        profile = tmp_path_factory.mktemp("browser")
        size = (f"--user-data-dir={profile}", f"--window-size={width},900", "--virtual-time-budget=4000")
        command = [BROWSER, *QUIET, *size, "--dump-dom", path.as_uri() + fragment]
        return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout

    yield dump


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
    assert attributes(dom, "body") | {"data-ready": "replay", "data-plots": "ready"} == attributes(
        dom, "body"
    )
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


def test_other_robots_play_too(tmp_path: Path, browse) -> None:  # type: ignore[no-untyped-def]
    for number, motion in enumerate((cart(), caterpillar(), stick())):
        path = tmp_path / f"{number}.html"
        path.write_text(page(outcome(None, motion), Playback.of(motion, None), {}), encoding="utf-8")
        dom = browse(path, 1000, "#t=1")
        assert attributes(dom, "body")["data-ready"] == "replay" and "data-problems" not in attributes(
            dom, "html"
        )
        assert "time 1.00 s" in readout(dom)
