"""The report as a page: what it says, that it is one file, that texts stay texts, that a browser runs it."""

from __future__ import annotations

import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.check import Line, Report
from bodyplan.errors import InputError, MissingExtraError
from bodyplan.show.live import telling
from bodyplan.show.live.session import State
from bodyplan.show.outcome import Outcome
from bodyplan.show.playback import Playback
from bodyplan.show.report import page, write_report
from report_cases import (
    CYCLES,
    EVIL,
    LOST,
    cart,
    caterpillar,
    diverged_trial,
    evil_report,
    full_outcome,
    outcome,
    snake_motion,
    snake_trial,
    stick,
)

VOID = {"meta", "input", "img", "br", "link", "hr"}


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
    return evil_report(tmp_path_factory.getbasetemp())


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


def test_a_body_that_goes_the_other_way_is_said_to() -> None:
    whole = snake_trial()
    planned = snake_motion().facts["advance_per_cycle"]
    back = replace(
        whole,
        advance=-1.5 * whole.planned_advance,
        advance_ratios=np.full(CYCLES, -1.5),
        speed=-1.5 * planned / whole.period,
    )
    said = f"{1500 * planned:.3g} mm a cycle the other way than the planned {1e3 * planned:.3g} mm"
    text = words_of(outcome(back))
    assert f"✗ Physics went {said}" in text and f"The body went {said}" in text
    assert "Executed / planned −150 % it went the other way" in text and "are lost" not in text
    assert f"The body went {said}" in telling.physics(State(snake_motion(), trial=back)).replace("\u00a0", " ")
    # whole ones are told as shares
    assert "the other way" not in words_of(outcome(whole)) + telling.physics(State(snake_motion(), trial=whole))


def test_the_plot_of_the_lag_is_said_to_rise_where_physics_gains() -> None:
    ahead = replace(snake_trial(), advance_ratios=np.full(CYCLES, 1.2))
    text = words_of(outcome(ahead))
    assert "rising where it gains on it" in text and "no shorter than the planned one (120 %)" in text


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
    made = outcome(None, motion, title=EVIL, about=EVIL, mission_text=EVIL, overrides=(EVIL,), name=EVIL, report=report)
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
    bp.show(stick(), path=tmp_path / "mine.html", open_browser=False)
    assert len(opened) == 1


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
    with pytest.raises(MissingExtraError, match=rf"needs {library}; install it with: pip install 'bodyplan\[report\]'"):
        bp.show(stick(), path=tmp_path / "mine.html", open_browser=False)
