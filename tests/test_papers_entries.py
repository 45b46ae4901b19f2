"""How verdicts follow from numbers: digits, relations, formulas, errors; what places cover; what is refused."""

from __future__ import annotations

import json
import math
from decimal import Decimal

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.papers import PAPERS, Drawing, Entry, Off, Paper, Printed, Results, Verdict, paper, recompute
from bodyplan.papers.drawn import draw
from bodyplan.papers.entries import covered
from bodyplan.papers.page import page, results_json
from bodyplan.papers.results import row_of


def one(entry: Entry, **more: object) -> Paper:
    return Paper("made", "A title", "Nobody (2000)", "About.", 0, 0, 0, (entry,), **more)  # type: ignore[arg-type]


# --- printed numbers ---


@given(st.integers(-(10**9), 10**9), st.integers(0, 9), st.floats(-0.4999, 0.4999))
def test_a_number_holds_to_half_of_its_last_digit(digits: int, decimals: int, part: float) -> None:
    text = f"{Decimal(digits).scaleb(-decimals):f}"
    printed = Printed.of(text)
    assert printed is not None and printed.value == pytest.approx(digits / 10**decimals, rel=1e-15)
    unit = 10.0**-decimals
    room = 1e-12 * abs(printed.value) + 1e-12 * unit
    assert printed.holds(printed.value + part * unit)
    for way in (-1.0, 1.0):
        assert not printed.holds(printed.value + way * (0.5 * unit * (1 + 1e-6) + 2 * room))


@given(st.integers(-(10**6), 10**6), st.integers(0, 6), st.integers(1, 9))
def test_another_last_digit_does_not_hold(digits: int, decimals: int, change: int) -> None:
    value = digits / 10**decimals
    tampered = Printed.of(f"{Decimal(digits + change).scaleb(-decimals):f}")
    assert tampered is not None and not tampered.holds(value)


def test_zeros_after_the_point_are_digits() -> None:
    assert Printed.of("2.0").holds(2.04) and not Printed.of("2.0").holds(2.06)  # type: ignore[union-attr]
    assert Printed.of("2").holds(2.4) and Printed.of("480.").holds(480.4)  # type: ignore[union-attr]
    assert Printed.of("0.").holds(1e-16) and not Printed.of("0.000").holds(6e-4)  # type: ignore[union-attr]


def test_relations_and_fractions() -> None:
    below, above, quarter = (Printed.of(text) for text in ("< 1", "> 0", "1/4"))
    assert below and above and quarter
    assert below.holds(0.999) and not below.holds(1.0)
    assert above.holds(1e-9) and not above.holds(0.0)
    assert quarter.holds(0.24) and quarter.holds(0.28) and not quarter.holds(0.2) and not quarter.holds(0.0)
    assert not quarter.holds(0.0777)
    for printed in (below, above, quarter):
        assert not any(printed.holds(value) for value in (math.nan, math.inf, -math.inf))


@pytest.mark.parametrize("text", ["", "-sin(w x)", "two", "1.6 ~ 1.8", "6 x 6 matrix", "1e5", "> x"])
def test_what_is_no_number(text: str) -> None:
    assert Printed.of(text) is None


# --- verdicts ---


def test_numbers_decide() -> None:
    for more in ({}, {"why": "wrong"}, {"reason": "none"}):
        assert row_of(Entry("p", "w", "1.36", lambda: 1.362, **more)).verdict == "reproduced"
    assert row_of(Entry("p", "w", "1.36", lambda: 1.37, why="wrong")).verdict == "corrected"
    assert row_of(Entry("p", "w", "1.36", lambda: 1.37, reason="none")).verdict == "not reproducible"
    assert row_of(Entry("p", "w", "1.36", lambda: 1.37)).verdict == "differs"
    assert row_of(Entry("p", "w", "1.36", lambda: math.nan, why="wrong")).verdict == "differs"
    assert row_of(Entry("p", "w", "1.36", lambda: math.nan, reason="none")).verdict == "not reproducible"


def test_formulas_need_ours_to_be_right() -> None:
    def verdict(printed: float, ours: float, **more: str) -> str:
        return row_of(Entry("p", "w", "a + b", lambda: Off(printed, ours), **more)).verdict.value

    assert verdict(0.0, 1e-12) == "reproduced" and verdict(1e-12, 0.0, why="wrong") == "reproduced"
    assert verdict(0.1, 1e-12, why="wrong") == "corrected" and verdict(0.1, 1e-12) == "differs"
    assert verdict(math.nan, 0.0, why="0/0") == "corrected" and verdict(math.inf, 0.0, why="0/0") == "corrected"
    for ours in (0.1, math.nan, math.inf):
        assert verdict(0.1, ours, why="wrong") == "differs" and verdict(0.0, ours) == "differs"


def test_units_scale_numbers_and_tolerances() -> None:
    row = row_of(Entry("p", "w", "720.", lambda: 0.7203, "mm"))
    assert (row.verdict, row.ours, row.ours_text, row.printed_value) == (
        "reproduced",
        pytest.approx(720.3),
        "720.3",
        720.0,
    )
    row = row_of(Entry("p", "w", "sin", lambda: Off(math.radians(2.0), 0.0), "deg", why="wrong", tolerance=1e-9))
    assert row.printed_off == pytest.approx(2.0) and row.ours_off == 0.0
    assert row.tolerance == pytest.approx(math.degrees(1e-9))
    row = row_of(Entry("p", "w", "71", lambda: 0.713, "%"))
    assert row.verdict == "reproduced" and row.ours == pytest.approx(71.3)


def test_what_raises_is_a_row() -> None:
    def broken() -> float:
        raise bp.SolveError("out_of_reach", "too far")

    for entry in (Entry("p", "w", "1", broken), Entry("p", "w", "1", lambda: 1.0, "no unit at all")):
        results = recompute([one(entry)])
        assert not results.ok and results.counts["error"] == 1
        assert results.papers[0].rows[0].why and results.papers[0].rows[0].ours is None
    assert "out_of_reach" in row_of(Entry("p", "w", "1", broken)).why
    assert not recompute([one(Entry("p", "w", "1", lambda: 3.0))]).ok


def test_physics_waits_until_asked_for() -> None:
    entry = Entry("p", "w", "1", lambda: 1.0, reason="measured", physics=True)
    assert row_of(entry).verdict == "not reproducible" and "--physics" in row_of(entry).why
    assert row_of(entry, physics=True).verdict == "reproduced"


def test_entries_that_say_nothing_are_refused() -> None:
    with pytest.raises(ValueError, match="no reason"):
        Entry("p", "w", "1")
    with pytest.raises(ValueError, match="wrong"):
        Entry("p", "w", "1", lambda: 1.0, why="a", reason="b")


# --- places ---


@pytest.mark.parametrize(
    ("place", "items"),
    [
        ("Fig. 8", {("figure", 8)}),
        ("Figs. 3-5, 9, section 2", {("figure", n) for n in (3, 4, 5, 9)}),
        ("Figs. 6(a), 7(a)", {("figure", 6), ("figure", 7)}),
        ("(11)-(13), (21), Fig. 7(b)", {("equation", n) for n in (11, 12, 13, 21)} | {("figure", 7)}),
        ("Table I", {("table", 1)}),
        ("Fig. 14, Table 2", {("figure", 14), ("table", 2)}),
        ("Table 2, (35)", {("table", 2), ("equation", 35)}),
        ("section IV.A", set()),
    ],
)
def test_what_a_place_covers(place: str, items: set[tuple[str, int]]) -> None:
    assert covered(place) == items


def test_gaps_are_seen() -> None:
    made = Paper("m", "t", "a", "x", 1, 2, 2, (Entry("Fig. 1, (2)", "w", reason="none"),))
    assert made.missing() == {("table", 1), ("figure", 2), ("equation", 1)}


def test_names() -> None:
    assert [paper(name).name for name in PAPERS] == list(PAPERS)
    with pytest.raises(bp.UnknownNameError, match="rectilinear"):
        paper("rectilinaer")


# --- what is written ---


def test_hostile_texts_stay_texts() -> None:
    evil = "<script>alert(1)</script>&\"'"
    entry = Entry(f"Fig. 1 {evil}", evil, evil, lambda: Off(1.0, 0.0), correct=evil, why=evil)
    made = one(entry)
    results = recompute([made])
    text = page(results, [made], {"made": draw(made)})
    assert "<script>alert" not in text and "&lt;script&gt;" in text
    assert json.loads(results_json(results)) == results.model_dump(mode="json")


def test_numbers_that_json_lacks() -> None:
    entries = (
        Entry("p", "w", "a", lambda: Off(math.nan, 0.0), why="0/0"),
        Entry("p", "w", "1", lambda: math.inf, reason="none"),
    )
    made = Paper("made", "t", "a", "x", 0, 0, 0, entries)
    results = recompute([made])
    data = json.loads(results_json(results))
    jsonschema.validate(data, Results.model_json_schema())
    first, second = data["papers"][0]["rows"]
    assert first["printed_off"] is None and first["verdict"] == "corrected"
    assert second["ours"] is None and second["ours_text"] == "undefined"
    assert "undefined" in page(results, [made], {})


def test_a_figure_that_fails_leaves_the_others() -> None:
    def broken(figure: object) -> None:
        raise RuntimeError("no such curve")

    made = one(
        Entry("Fig. 1", "w", reason="none"),
        drawings=(Drawing("Fig. 1", "bad", broken), Drawing("Fig. 2", "good", lambda figure: figure.subplots())),
    )
    bad, good = draw(made)
    assert "no such curve" in bad.problem and not bad.svg
    assert good.svg.startswith("<?xml") and not good.problem and good.file == "made-fig-2.svg"
    assert "no such curve" in page(recompute([made]), [made], {"made": (bad, good)})


def test_every_verdict_has_a_meaning() -> None:
    assert {verdict.value for verdict in Verdict if verdict.fine} == {"reproduced", "corrected", "not reproducible"}
