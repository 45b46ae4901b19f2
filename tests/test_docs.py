"""The documentation tells the truth: its Python blocks run, its pages build without a warning, examples run."""

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import bodyplan as bp

HOME = Path(__file__).parents[1]
DOCS = HOME / "docs"
EXAMPLES = HOME / "examples"


def blocks() -> list[tuple[str, str]]:
    found = []
    for page in sorted(DOCS.rglob("*.md")):
        texts = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.S)
        found += [(f"{page.relative_to(DOCS)}-{k}", text) for k, text in enumerate(texts)]
    return found


BLOCKS = blocks()


@pytest.mark.parametrize("name, text", BLOCKS, ids=[name for name, _ in BLOCKS])
def test_python_blocks_run(name, text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(text, name, "exec"), {"__name__": "__main__"})


def test_there_is_a_page_for_every_family():
    assert {p.stem for p in (DOCS / "families").glob("*.md")} == {"concertina", "curves", "inching", "legs", "wheels"}
    assert len(BLOCKS) >= 15


def test_pages_build_without_a_warning(tmp_path):
    pytest.importorskip("mkdocs")
    env = os.environ | {"NO_MKDOCS_2_WARNING": "1"}
    made = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path / "site")],
        cwd=HOME,
        env=env,
        capture_output=True,
        text=True,
    )
    assert made.returncode == 0, made.stderr
    page = (tmp_path / "site" / "families" / "wheels" / "index.html").read_text(encoding="utf-8")
    assert "<math" in page and "$$" not in page
    reference = (tmp_path / "site" / "reference" / "index.html").read_text(encoding="utf-8")
    assert "<code>Motion</code>" in reference and not re.search(r":(class|func|meth|mod):", reference)
    # nothing is fetched from elsewhere
    for path in (tmp_path / "site").rglob("*.html"):
        for address in re.findall(r'<(?:script|link|img)[^>]*(?:src|href)="(https?://[^"]+)"', path.read_text("utf-8")):
            pytest.fail(f"{path.name} fetches {address}")


def test_the_robot_of_the_tutorial_fits_its_mission(tmp_path):
    """Its table in place of the ready mission's: the same snake as in the tutorial's Python."""
    page = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    table = re.findall(r"```toml\n(.*?)```", page, flags=re.S)[0]
    text = (Path(bp.__file__).parent / "missions" / "ready" / "serpentine.toml").read_text(encoding="utf-8")
    path = tmp_path / "my.toml"
    path.write_text(re.sub(r"\[robot\].*?(?=\n\[)", lambda _: table, text, flags=re.S), encoding="utf-8")
    robot = bp.load_mission(path).robot
    snake = bp.snake(13, 0.06, radius=0.02, mass=0.08, limits=(-np.pi / 2, np.pi / 2), rate=5.0, effort=1.5)
    assert robot.joints == snake.joints and robot.mass == pytest.approx(snake.mass)
    np.testing.assert_allclose(robot.limits, snake.limits)
    np.testing.assert_allclose(robot.efforts, snake.efforts)


def test_every_status_is_explained():
    text = (DOCS / "statuses.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `([a-z_]+)` \|", text, flags=re.M)) == {str(status) for status in bp.Status}


def test_the_face_is_in_the_reference():
    text = (DOCS / "reference.md").read_text(encoding="utf-8")
    listed = {name.rsplit(".", 1)[1] for name in re.findall(r"^::: ([\w.]+)$", text, flags=re.M)}
    verbs = {"plan", "check", "simulate", "fit", "times", "save", "load"}
    kinds = {name for name in bp.__all__ if name[0].isupper() and not name.endswith("Error")}
    gaits = {"Carry", "Concertina", "Crawl", "Rectilinear", "Rolling", "Serpentine", "Sidewinding", "SinusLifting"}
    assert verbs | gaits | {"Robot", "Motion", "Claim"} <= listed and gaits <= kinds


# a search of many corridors has a test of its own, with few trials
SHORT = sorted({*EXAMPLES.glob("*.py")} - {EXAMPLES / "corridor_chart.py"})


@pytest.mark.parametrize("path", SHORT, ids=lambda path: path.stem)
def test_examples_run(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(path), run_name="__main__")
    said = capsys.readouterr().out
    assert said.strip() and "FAIL" not in said and "does not pass" not in said


def test_examples_are_listed():
    text = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    files = {path.name for path in EXAMPLES.iterdir() if path.suffix in {".py", ".csv", ".ipynb"}}
    assert set(re.findall(r"^\| `([\w.]+)` \|", text, flags=re.M)) == files


def test_the_notebook_runs(tmp_path):
    """Its code cells, in order; what the replay cells show is a frame of their own."""
    import json

    book = json.loads((EXAMPLES / "tour.ipynb").read_text(encoding="utf-8"))
    space: dict[str, object] = {}
    here = Path.cwd()
    os.chdir(tmp_path)
    try:
        for cell in book["cells"]:
            source = "".join(cell["source"])
            if cell["cell_type"] == "code":
                if source.startswith("bp.inline"):
                    shown = eval(source, space)._repr_html_()
                    assert shown.startswith("<iframe srcdoc=") and "&lt;script" in shown
                else:
                    exec(source, space)
    finally:
        os.chdir(here)
    assert (tmp_path / "tour.csv").stat().st_size > 0


def test_inline_refuses_what_is_no_motion():
    with pytest.raises(bp.InputError, match="motion"):
        bp.inline(3)  # type: ignore[arg-type]
    with pytest.raises(bp.InputError, match="height"):
        bp.inline(3, height=10)  # type: ignore[arg-type]
