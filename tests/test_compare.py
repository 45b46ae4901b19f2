"""bodyplan report A B: what differs between two runs, all of it and nothing else."""

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

import bodyplan as bp
from bodyplan.cli import app

pytest.importorskip("plotly")


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    home = tmp_path_factory.mktemp("runs")
    made = [
        bp.run("inching", home / name, overrides=changes, simulate=False, compare=False).folder
        for name, changes in (("high", ()), ("low", ("gait.lift=0.02",)))
    ]
    return made[0], made[1]


def report(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["report", *map(str, arguments)])
    return result.exit_code, result.output


def test_what_differs_is_shown(folders, tmp_path):
    high, low = folders
    page = tmp_path / "both.html"
    code, said = report(high, low / "metrics.json", "--out", page)
    assert code == 0 and "high" in said and "low" in said
    text = page.read_text(encoding="utf-8")
    asked = text[text.index('id="asked"') : text.index('id="checks"')]
    assert re.findall(r"<code>([^<]+)</code>", asked) == ["gait.lift"]
    for folder in folders:
        plan = json.loads((folder / "metrics.json").read_text())["plan"]
        assert f"{1e3 * plan['advance_per_cycle']:.4g}" in said
    assert "plots-data" in text and '"track"' in text and '"joints"' in text


def test_a_run_beside_itself_is_the_same(folders, tmp_path):
    high, _ = folders
    page = tmp_path / "same.html"
    assert report(high, high, "--out", page)[0] == 0
    text = page.read_text(encoding="utf-8")
    numbers = text[text.index('id="numbers"') : text.index('id="track"')]
    rows = numbers.count("<tr>") - 1
    assert rows > 10 and numbers.count(">same<") == rows
    assert "<p>Nothing.</p>" in text and "high-1" in text and "high-2" in text


def test_refusals(folders, tmp_path):
    high, low = folders
    page = tmp_path / "x.html"
    code, said = report(high, "--out", page)
    assert code == 2 and "2 to 6" in said
    code, said = report(high, tmp_path / "nowhere", "--out", page)
    assert code == 2 and "no run there" in said
    (tmp_path / "metrics.json").write_text('{"format": "bodyplan metrics 1"}')
    code, said = report(high, tmp_path, "--out", page)
    assert code == 2 and "not the metrics of a run" in said
    code, said = report(high, low, "--out", tmp_path / "x.pdf")
    assert code == 2 and ".html" in said
    page.write_text("mine")
    assert report(high, low, "--out", page)[0] == 2 and page.read_text() == "mine"
    assert report(high, low, "--out", page, "--force")[0] == 0
