"""All formats: every family is written, misuse is told, nothing is left behind, the command line lists them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import bodyplan as bp
from bodyplan.cli import app
from bodyplan.export import FORMATS, format_named, format_of
from export_cases import CASES, small

#: module that a format imports last, and the extra that has it
NEEDS = {"mcap": ("mcap_ros2.writer", "ros"), "glb": ("trimesh", "gltf"), "c": ("sympy", "symbolic")}


def bodyplan(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(app, list(arguments), env={"COLUMNS": "200"})
    return result.exit_code, result.output


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder as a run leaves it, as far as exports look at it."""
    folder = tmp_path_factory.mktemp("runs") / "crawl-here"
    folder.mkdir()
    small("crawl").save(folder / "motion.npz")
    return folder


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("case", CASES)
def test_every_family_is_written_whole(case: str, name: str, tmp_path: Path) -> None:
    form, motion = FORMATS[name], small(case)
    target = tmp_path / f"m{form.suffix}"
    if name == "urdf" and any(isinstance(element, bp.Arc) for element in motion.robot.elements):
        # what a format cannot say it refuses
        with pytest.raises(bp.InputError, match="an arc segment"):
            motion.save(target)
        assert list(tmp_path.iterdir()) == []
        return
    assert motion.save(target) == target == bp.save(motion, str(target))
    written = {p.name for p in tmp_path.iterdir()}
    assert written == {target.name} | ({"m.h"} if name == "c" else set())
    first = target.read_bytes()
    assert len(first) > 500
    # the same motion gives the same file
    motion.save(target)
    if name != "npz":  # zip has the time in it
        assert target.read_bytes() == first
    with pytest.raises(bp.InputError, match="does not exist"):
        motion.save(tmp_path / "nowhere" / target.name)


def test_the_registry_is_sound() -> None:
    suffixes = [s for form in FORMATS.values() for s in (form.suffix, *form.aliases)]
    assert len(set(suffixes)) == len(suffixes) and all(s.startswith(".") and s == s.lower() for s in suffixes)
    for name, form in FORMATS.items():
        assert form.name == name and callable(form.writer) and len(form.about) < 90
        assert format_named(name) is format_named(form.suffix) is format_named(form.suffix[1:].upper()) is form
        assert format_of(f"a.b/m{form.suffix.upper()}") is form
    assert format_named("yml") is format_named("yaml") and format_of("m.yml").name == "yaml"
    assert {"dtype", "rate", "interpolation", "joints"} == set(FORMATS["header"].options)


def test_unknown_names_and_options(tmp_path: Path) -> None:
    motion = small("crawl")
    with pytest.raises(bp.UnknownNameError, match=r"unknown format '\.glbb'. Did you mean '\.glb'"):
        motion.save(tmp_path / "m.glbb")
    with pytest.raises(bp.UnknownNameError, match="unknown format 'noending'"):
        motion.save(tmp_path / "noending")
    with pytest.raises(bp.UnknownNameError, match=r"unknown option of csv 'rate'.*\(none\)"):
        bp.save(motion, tmp_path / "m.csv", rate=5)
    with pytest.raises(bp.UnknownNameError, match=r"unknown option of yaml 'rat'. Did you mean 'rate'"):
        motion.save(tmp_path / "m.yaml", rat=5)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", NEEDS)
def test_a_missing_library_is_told(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module, extra = NEEDS[name]
    assert FORMATS[name].extra == extra
    for loaded in [m for m in sys.modules if m.startswith("bodyplan.robot.symbolic")]:
        monkeypatch.delitem(sys.modules, loaded)
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(bp.MissingExtraError, match=rf"pip install 'bodyplan\[{extra}\]'"):
        small("crawl").save(tmp_path / f"m{FORMATS[name].suffix}")
    assert list(tmp_path.iterdir()) == []


def test_formats_without_an_extra_need_none(tmp_path: Path) -> None:
    """In a Python that has none of the optional libraries."""
    small("crawl").save(tmp_path / "m.npz")
    code = """
import sys
for name in ("mcap", "mcap_ros2", "trimesh", "pygltflib", "rosbags", "yaml", "ruamel", "sympy", "mujoco", "matplotlib"):
    sys.modules[name] = None
import bodyplan as bp
from bodyplan.export import FORMATS
motion = bp.load("m.npz")
for form in FORMATS.values():
    if form.extra is None:
        motion.save("out" + form.suffix)
"""
    subprocess.run([sys.executable, "-c", code], cwd=tmp_path, check=True)
    assert {"out.csv", "out.yaml", "out.h"} <= {p.name for p in tmp_path.iterdir()}


def test_the_command_line_lists_the_formats() -> None:
    code, listed = bodyplan("export", "--list")
    assert code == 0
    for form in FORMATS.values():
        assert form.name in listed and form.suffix in listed and form.about in listed
    code, told = bodyplan("export", "--help")
    assert code == 0 and all(name in told for name in FORMATS)
    code, told = bodyplan("export", "crawl-flat", "--to", "gltff")
    assert code == 2 and "unknown format 'gltff'" in told and all(name in told for name in FORMATS)


def test_a_run_is_exported(saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for run in (str(saved), f"{saved}/", str(saved / "motion.npz")):
        for name in ("yaml", "mcap", "glb", "header", "h"):
            code, told = bodyplan("export", run, "--to", name, "--force")
            assert code == 0, told
    assert {p.name for p in tmp_path.iterdir()} == {
        *(f"{stem}{suffix}" for stem in ("crawl-here", "motion") for suffix in (".yaml", ".mcap", ".glb")),
        "crawl-here_trajectory.h",
        "motion_trajectory.h",
    }
    small("crawl").save(tmp_path / "same.yaml")
    assert (tmp_path / "same.yaml").read_bytes() == (tmp_path / "crawl-here.yaml").read_bytes()
    # a header and the source of the kinematics have room beside each other
    code, told = bodyplan("export", str(saved), "--to", "c")
    assert code == 0 and {"crawl-here.c", "crawl-here.h"} <= {p.name for p in tmp_path.iterdir()}
    monkeypatch.chdir(saved)
    code, told = bodyplan("export", ".", "--to", "csv", "--out", str(tmp_path / "m.csv"))
    assert code == 0, told


def test_options_on_the_command_line(saved: Path, tmp_path: Path) -> None:
    target = tmp_path / "m.h"
    code, told = bodyplan(
        "export", str(saved), "--to", "header", "--out", str(target), "--option", "dtype=double", "--option", "rate=100"
    )
    assert code == 0, told
    text = target.read_text()
    assert "typedef double m_real;" in text and "#define M_SAMPLES 201" in text and "#define M_DT 0.01" in text
    for option, words in (
        ("dtype=half", "dtype: must be float or double, got 'half'"),
        ("rat=100", "unknown option of header 'rat'. Did you mean 'rate'"),
        ("rate", "--option rate: must be KEY=VALUE"),
        ("rate=fast", "rate: expected a number, got 'fast'"),
    ):
        code, told = bodyplan("export", str(saved), "--to", "h", "--out", str(target), "--force", "--option", option)
        assert code == 2 and words in told.replace("\n", " "), told
    assert target.read_text() == text
    code, told = bodyplan("export", str(saved), "--to", "header", "--out", str(tmp_path / "m.hpp"))
    assert code == 2 and "does not end in .h" in told
    code, told = bodyplan("export", str(saved), "--to", "csv", "--set", "gait.period=2")
    assert code == 2 and "--set: a saved motion cannot be changed" in told
    code, told = bodyplan("export", str(tmp_path), "--to", "csv")
    assert code == 2 and "folder" in told


def test_a_ready_mission_wins_over_a_folder_of_its_name(
    saved: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A mission is named as ever, where runs are kept, too."""
    (tmp_path / "carry-bump").mkdir()
    small("crawl").save(tmp_path / "carry-bump" / "motion.npz")
    monkeypatch.chdir(tmp_path)
    code, told = bodyplan("export", "carry-bump", "--to", "npz", "--set", "time.stop=0.2 s")
    assert code == 0, told
    assert bp.load("carry-bump.npz").robot.name == "tri_wheel"
    code, told = bodyplan("export", "./carry-bump", "--to", "npz", "--force")
    assert code == 0 and np.array_equal(bp.load("carry-bump.npz").q, small("crawl").q)
