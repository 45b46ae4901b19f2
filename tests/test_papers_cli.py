"""bodyplan papers as a user meets it: table, page, JSON with the same numbers, figures, refusals, a narrow screen."""

from __future__ import annotations

import html
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import jsonschema
import pytest
from typer.testing import CliRunner

from bodyplan.cli import app
from bodyplan.papers import Entry, Paper
from bodyplan.papers import rectilinear as module
from bodyplan.papers.page import off_text, pretty, with_unit
from bodyplan.papers.results import Row
from devtools import BROWSER, dump

ORDER = ("error", "differs", "corrected", "reproduced", "not reproducible")


def bodyplan(*arguments: str) -> Any:
    return CliRunner().invoke(app, list(arguments))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Path, Path]:
    """The paper that is quickest to recompute, and one that has formulas only."""
    out = tmp_path_factory.mktemp("papers")
    file = out / "results.json"
    return bodyplan("papers", "rectilinear", "--out", str(out / "folder"), "--json", str(file)), out / "folder", file


class Tables(HTMLParser):
    """The cells of every row of the page's tables of results, tags taken out."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.inside = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "table":
            self.inside = "papers" in str(dict(attrs).get("class"))
        elif self.inside and tag == "tr":
            self.rows.append([])
        elif self.inside and tag == "td":
            self.rows[-1].append("")

    def handle_data(self, data: str) -> None:
        if self.inside and self.rows and self.rows[-1]:
            self.rows[-1][-1] += data


def plain(fragment: str) -> str:
    return html.unescape(re.sub(r"<[^>]+>", "", fragment))


def test_it_prints_a_table_and_writes_a_folder(run: tuple[Any, Path, Path]) -> None:
    result, folder, file = run
    assert result.exit_code == 0, result.output
    assert "83.10789742 deg" in re.sub(r"\s+", " ", result.output) and "reproduced" in result.output
    assert {path.name for path in folder.iterdir()} == {"papers.html", "papers.json", "papers.schema.json", "figures"}
    assert file.read_text(encoding="utf-8") == (folder / "papers.json").read_text(encoding="utf-8")
    pictures = sorted((folder / "figures").iterdir())
    assert [path.name for path in pictures] == [f"rectilinear-fig-{n}.svg" for n in (10, 7, 9)]
    for path in pictures:
        assert ElementTree.parse(path).getroot().tag.endswith("svg")
    schema = json.loads((folder / "papers.schema.json").read_text(encoding="utf-8"))
    jsonschema.validate(json.loads(file.read_text(encoding="utf-8")), schema)


def test_page_and_json_say_the_same(run: tuple[Any, Path, Path]) -> None:
    _, folder, file = run
    (done,) = json.loads(file.read_text(encoding="utf-8"))["papers"]
    rows = [Row.model_validate(row) for row in done["rows"]]
    parser = Tables()
    parser.feed((folder / "papers.html").read_text(encoding="utf-8"))
    shown = [[cell.strip() for cell in row] for row in parser.rows if row]
    wanted = [row for verdict in ORDER for row in rows if row.verdict == verdict]
    assert len(shown) == len(wanted) == len(rows) == sum(done["counts"].values())
    numbers = 0
    for row, cells in zip(wanted, shown, strict=True):
        assert cells[0] == row.place and cells[1].startswith(plain(pretty(row.what)))
        if row.tolerance is not None:
            assert cells[2].endswith(off_text(row, row.printed_off)) and cells[3].endswith(off_text(row, row.ours_off))
        elif row.ours is not None:
            assert cells[2] == plain(with_unit(row.printed, row.unit))
            assert cells[3].startswith(plain(with_unit(row.ours_text, row.unit)))
            assert float(row.ours_text) == pytest.approx(row.ours, rel=1e-3)
            numbers += 1
    assert numbers > 50


def test_the_page_needs_nothing_else(run: tuple[Any, Path, Path]) -> None:
    text = (run[1] / "papers.html").read_text(encoding="utf-8")
    assert text.count("data:image/svg+xml;base64,") == 3 and "default-src 'none'" in text
    assert not re.search(r'(?:src|href)="(?!data:|#)', text) and len(text) < 1_000_000


def test_formulas_are_set() -> None:
    assert pretty("sqrt(L_1L^2 + P_z^2)") == "√(L<sub>1L</sub><sup>2</sup> + P<sub>z</sub><sup>2</sup>)"
    assert pretty("-(psi_L + alpha_L)") == "−(ψ<sub>L</sub> + α<sub>L</sub>)"
    assert pretty("V_(k+1), x^(i+1)") == "V<sub>k+1</sub>, x<sup>i+1</sup>"
    assert pretty("run with --physics") == "run with --physics" and pretty("rank (Q : I : -P)") == "rank (Q : I : −P)"
    assert pretty("pi/w, pitch, spin") == "π/w, pitch, spin" and pretty("a < b & c") == "a &lt; b &amp; c"
    assert with_unit("3.06e-14", "") == "3.06×10<sup>-14</sup>".replace("-", "−")
    assert with_unit("-1.5", "deg") == "−1.5°" and with_unit("undefined", "N*m") == "undefined\u00a0N m"


def test_refusals(tmp_path: Path) -> None:
    wrong = bodyplan("papers", "rectilinaer", "--out", str(tmp_path / "a"))
    assert wrong.exit_code == 2 and "Did you mean 'rectilinear'?" in wrong.output and "wheels" in wrong.output
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "papers.html").write_text("old", encoding="utf-8")
    again = bodyplan("papers", "rectilinear", "--out", str(tmp_path / "there"))
    assert again.exit_code == 2 and "--force" in again.output
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").write_text("text", encoding="utf-8")
    foreign = bodyplan("papers", "rectilinear", "--out", str(tmp_path / "mine"), "--force")
    assert foreign.exit_code == 2 and "thesis.txt" in foreign.output
    (tmp_path / "r.json").write_text("{}", encoding="utf-8")
    file = bodyplan("papers", "rectilinear", "--out", str(tmp_path / "b"), "--json", str(tmp_path / "r.json"))
    assert file.exit_code == 2 and "r.json" in file.output and not (tmp_path / "b").exists()


def test_what_raises_ends_with_exit_code_1(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> float:
        raise RuntimeError("out of order")

    entries = (Entry("Fig. 1", "w", "1", broken), Entry("Fig. 2", "w", "2", lambda: 2.0))
    monkeypatch.setattr(module, "PAPER", Paper("rectilinear", "t", "a", "x", 0, 2, 0, entries))
    result = bodyplan("papers", "rectilinear", "--out", str(tmp_path / "out"))
    assert result.exit_code == 1 and "RuntimeError: out of order" in result.output
    counts = json.loads((tmp_path / "out" / "papers.json").read_text(encoding="utf-8"))["counts"]
    assert counts["error"] == 1 and counts["reproduced"] == 1
    # the old folder may be replaced
    monkeypatch.setattr(module, "PAPER", Paper("rectilinear", "t", "a", "x", 0, 2, 0, entries[1:]))
    assert bodyplan("papers", "rectilinear", "--out", str(tmp_path / "out"), "--force").exit_code == 0


def test_physics_without_mujoco_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    result = bodyplan("papers", "acm", "--physics", "--out", str(tmp_path / "out"))
    assert result.exit_code == 2 and "bodyplan[physics]" in result.output


PROBE = """<script>addEventListener("load", () => setTimeout(() => {
  const root = document.documentElement;
  document.querySelectorAll("details").forEach((e) => e.open = true);
  const beyond = (e) => !e.closest(".picture, pre, svg") && e.getBoundingClientRect().right > innerWidth + 1;
  root.dataset.inner = innerWidth;
  root.dataset.scroll = root.scrollWidth;
  root.dataset.wide = [...document.querySelectorAll("main *")].filter(beyond).map((e) => e.tagName).join(" ");
  parent.postMessage({ ...root.dataset }, "*");
}, 500))</script>"""
AROUND = """<!doctype html><html><body style="margin:0"><script>
addEventListener("message", (event) => Object.assign(document.documentElement.dataset, event.data));
</script><iframe src="probed.html" style="border:0;width:{width}px;height:800px"></iframe></body></html>"""


@pytest.mark.skipif(BROWSER is None, reason="no chromium, chromium-browser or google-chrome on this machine")
@pytest.mark.parametrize("width", [1280, 400])
def test_the_page_fits_the_window(width: int, run: tuple[Any, Path, Path], tmp_path: Path) -> None:
    text = (run[1] / "papers.html").read_text(encoding="utf-8")
    free = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", text)
    (tmp_path / "probed.html").write_text(free.replace("</body></html>", f"{PROBE}</body></html>"), encoding="utf-8")
    around = tmp_path / "around.html"
    around.write_text(AROUND.replace("{width}", str(width)), encoding="utf-8")
    dom = dump(around.as_uri(), tmp_path / "profile", 1300)
    tag = re.search(r"<html\b([^>]*)>", dom)
    assert tag
    found = dict(re.findall(r'data-([\w-]+)="([^"]*)"', tag[1]))
    assert "problems" not in found
    assert (found["inner"], found["wide"]) == (str(width), "") and int(found["scroll"]) <= width
