"""What the five papers print: every table, figure and equation covered, known facts with their verdicts and numbers,
and nothing that a tampered print would not undo."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import jsonschema
import pytest

from bodyplan.papers import PAPERS, Entry, Off, Printed, Results, Row, paper, recompute

PAPER = {name: paper(name) for name in PAPERS}


@pytest.fixture(scope="module")
def results() -> Results:
    return recompute(PAPER.values())


def rows(results: Results, name: str, *words: str) -> list[Row]:
    """Rows of a paper in whose place and text all the words stand."""
    done = next(done for done in results.papers if done.name == name)
    found = [row for row in done.rows if all(word in f"{row.place} | {row.what}" for word in words)]
    assert found, (name, words)
    return found


def pairs(results: Results) -> list[tuple[Entry, Row]]:
    return [
        (entry, row)
        for done in results.papers
        for entry, row in zip(PAPER[done.name].entries, done.rows, strict=True)
    ]  # fmt: skip


def test_all_that_the_papers_number_is_covered() -> None:
    numbers = {"concertina": (0, 15, 7), "acm": (1, 14, 37), "rectilinear": (0, 11, 67), "legs": (1, 1, 22),
               "wheels": (2, 16, 35)}  # fmt: skip
    assert {name: (p.tables, p.figures, p.equations) for name, p in PAPER.items()} == numbers
    assert {name: p.missing() for name, p in PAPER.items()} == {name: set() for name in PAPERS}


def test_nothing_raises_and_nothing_differs_without_a_reason(results: Results) -> None:
    bad = [(row.place, row.what, row.verdict, row.why) for _, row in pairs(results) if not row.verdict.fine]
    assert not bad and results.ok
    assert results.counts["reproduced"] > 100 and results.counts["corrected"] > 50


def test_verdicts_keep_their_word(results: Results) -> None:
    for entry, row in pairs(results):
        if row.verdict == "corrected":
            assert row.why == entry.why
        if row.verdict == "not reproducible":
            assert entry.reason and row.why.startswith(entry.reason)
        if row.tolerance is not None:
            assert row.ours_off is not None and row.ours_off <= row.tolerance
            missed = row.printed_off is None or row.printed_off > row.tolerance
            assert missed == (row.verdict == "corrected")


def test_tampered_prints_are_not_reproduced(results: Results) -> None:
    """One unit in the last digit of every number, the other way round of every relation, every formula a little off."""
    tampered = 0
    for entry, row in pairs(results):
        if row.verdict != "reproduced":
            continue
        printed = Printed.of(entry.printed)
        if row.tolerance is not None:
            found: float | Off = Off(entry.tolerance * 1.01 + 1e-6, 0.0)
            other = entry
        else:
            assert printed is not None and row.ours is not None
            found = row.ours
            if printed.relation:
                text = entry.printed.translate(str.maketrans("<>", "><"))
            elif printed.under is not None:
                text = f"1/{printed.under + 1}"
            else:
                step = Decimal(str(printed.resolution))
                text = f"{Decimal(entry.printed.rstrip('.')) + step:f}"
            other = replace(entry, printed=text)
        assert other.verdict(found) != "reproduced", (entry.place, entry.what)
        tampered += 1
    assert tampered == results.counts["reproduced"]


@pytest.mark.parametrize(
    ("name", "words", "verdict", "ours"),
    [
        # the tables of Figs. 8 and 11 to their last digit, and what is wrong in them
        ("rectilinear", ("Fig. 8", "drive of the tail"), "reproduced", 720.0),
        ("rectilinear", ("Fig. 8", "angle3", "tail moved"), "reproduced", 128.68089),
        ("rectilinear", ("Fig. 11", "where the tail goes"), "corrected", 3400.0),
        ("rectilinear", ("section 4", "entering", "tenth"), "corrected", 1680.0),
        ("rectilinear", ("section 4", "third time"), "corrected", 4080.0),
        ("rectilinear", ("section 5", "higher"), "corrected", 1833.03 - 1985.55),
        # the facts of paper acm
        ("acm", ("5 arcs", "10 straight"), "reproduced", 0.240),
        ("acm", ("10 arcs", "20 straight", "1", "(10 yaw)"), "corrected", 0.078),
        ("acm", ("Gauss node",), "reproduced", 0.788675),
        ("acm", ("p of least", "serpenoid"), "corrected", 0.7876),
        ("acm", ("p of least", "spiral"), "corrected", 0.7807),
        ("acm", ("tips, R_s = 0.16",), "reproduced", 0.60),
        ("acm", ("tips, R_s = 0.18",), "reproduced", 0.58),
        ("acm", ("without the virtual", "serpenoid"), "reproduced", 81.0),
        ("acm", ("(37)", "c1 at alpha"), "reproduced", -0.09185),
        ("acm", ("(37)", "keeps the curve level"), "corrected", -0.08951),
        # paper wheels
        ("wheels", ("smallest adjusting angle, mission 1", "section 7"), "not reproducible", 84.5),
        ("wheels", ("largest adjusting angle, mission 1",), "not reproducible", 149.8),
        ("wheels", ("smallest adjusting angle, by (3) as printed",), "reproduced", 40.5),
        ("wheels", ("largest adjusting angle, by (3) as printed",), "not reproducible", 149.2),
        ("wheels", ("depth of a rim",), "corrected", 66.0),
        ("wheels", ("smallest torque, mission 1",), "not reproducible", 2.86),
        ("wheels", ("largest torque, mission 1", "(35)"), "reproduced", 4.10),
        ("wheels", ("largest torque, mission 1", "(34)"), "corrected", 6.03),
        ("wheels", ("headings", "slope 0.2"), "corrected", 77.0),
        ("wheels", ("sideways slip",), "corrected", 0.607),
        # paper legs
        ("legs", ("(11)", "entries"), "corrected", 18.0),
        ("legs", ("(12)", "entries"), "corrected", 14.0),
        ("legs", ("(13)", "entries"), "corrected", 2.0),
        ("legs", ("(14)", "rank (Q : I : -P)"), "corrected", 24.0),
        ("legs", ("(22)", "positive product"), "corrected", 21.6),
    ],
)  # fmt: skip
def test_known_numbers(name: str, words: tuple[str, ...], verdict: str, ours: float, results: Results) -> None:
    (row,) = rows(results, name, *words)
    assert row.verdict == verdict
    assert row.ours == pytest.approx(ours, rel=0.011)


@pytest.mark.parametrize(
    ("name", "words", "verdict", "off"),
    [
        ("concertina", ("(2)", "tail meets"), "corrected", 2.0),
        ("concertina", ("section IV.A", "straight line"), "corrected", 0.0777),
        ("concertina", ("section IV.B",), "corrected", 80.0),
        ("concertina", ("section IV.A", "height left"), "corrected", 0.2),
        ("concertina", ("(1), Fig. 4", "up to 0.99"), "reproduced", None),
        ("rectilinear", ("(32)",), "corrected", None),
        ("rectilinear", ("(39)-(42), (58)",), "corrected", None),
        ("rectilinear", ("(43)-(46)",), "reproduced", None),
        ("rectilinear", ("(47)-(50)",), "corrected", None),
        ("legs", ("(1)-(5)",), "reproduced", None),
        ("legs", ("(10)", "body to shoulder"), "reproduced", None),
        ("legs", ("(15)-(17)",), "corrected", None),
        ("wheels", ("(2), (3)", "normal"), "corrected", 43.0),
        ("wheels", ("(20)-(22)",), "corrected", 14.6),
        ("wheels", ("(18), (19)",), "corrected", 90.0),
        ("wheels", ("(25)",), "corrected", 2 * 98.1),
        ("wheels", ("(34)", "front left"), "corrected", None),
        ("wheels", ("(34)", "rear motor"), "reproduced", None),
        ("wheels", ("(35)", "load of the rear"), "corrected", 98.1 / 2 - 98.1 / 3),
    ],
)  # fmt: skip
def test_known_equations(name: str, words: tuple[str, ...], verdict: str, off: float | None, results: Results) -> None:
    (row,) = [row for row in rows(results, name, *words) if row.tolerance is not None]
    assert row.verdict == verdict
    if off is not None:
        assert row.printed_off == pytest.approx(off, rel=0.02)


def test_division_by_zero_is_said(results: Results) -> None:
    (row,) = rows(results, "rectilinear", "(4)-(6)", "90 deg")
    assert row.verdict == "corrected" and row.printed_off is None and row.ours_off is not None
    (row,) = rows(results, "concertina", "gamma = 1")
    assert row.verdict == "corrected" and row.printed_off is None


def test_hardware_waits_for_the_physics(results: Results) -> None:
    for row in rows(results, "acm", "section V.B"):
        assert row.verdict == "not reproducible" and "--physics" in row.why and row.ours is None


def test_the_schema_fits(results: Results) -> None:
    data = results.model_dump(mode="json")
    jsonschema.validate(data, Results.model_json_schema())
    assert Results.model_validate(data) == results
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data | {"more": 1}, Results.model_json_schema())


def test_the_page_of_the_documentation_counts_right(results: Results) -> None:
    text = (Path(__file__).parents[1] / "docs" / "papers.md").read_text(encoding="utf-8")
    for done in results.papers:
        shown = [done.counts[verdict] for verdict in ("reproduced", "corrected", "not reproducible")]
        assert f"| {done.name} | {' | '.join(map(str, shown))} |" in text
