"""The README tells the truth: its Python blocks run, its commands and missions exist, its files are written."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bodyplan.cli import app
from bodyplan.missions import ready_missions

README = Path(__file__).parents[1] / "README.md"
TEXT = README.read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", TEXT, flags=re.S)


@pytest.mark.parametrize("block", BLOCKS, ids=range(len(BLOCKS)))
def test_python_blocks_run(block, tmp_path, monkeypatch, capsys):
    if "simulate" in block:
        pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "README.md", "exec"), {})
    if "simulate" in block:  # the ten lines
        assert "of the planned advance" in capsys.readouterr().out
        assert (tmp_path / "motion.csv").stat().st_size > 0


def test_commands_and_missions_exist():
    listed = CliRunner().invoke(app, ["--help"]).output
    for command in re.findall(r"^bodyplan (\w+)", TEXT, flags=re.M):
        assert command in listed
    assert set(re.findall(r"^\| `([a-z][\w-]*)` \|", TEXT, flags=re.M)) == set(ready_missions())


def test_links_point_to_files():
    for target in re.findall(r"\]\((?!http)([^)#]+)\)", TEXT):
        assert (README.parent / target).exists(), target
