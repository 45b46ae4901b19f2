"""bodyplan doctor: what it finds is what is installed."""

import importlib.metadata
import importlib.util
import sys
from types import ModuleType

import pytest
from typer.testing import CliRunner

import bodyplan as bp
from bodyplan.cli import app, doctor
from bodyplan.simulate.library import mujoco


def test_all_well():
    found = {f.what: f for f in doctor.findings()}
    assert found["numpy"].found == importlib.metadata.version("numpy") and found["numpy"].ok is True
    assert found["physics"].found == "steps"
    result = CliRunner().invoke(app, ["doctor"])
    assert result.exit_code == 0 and "Python" in result.output


def test_missing_extras_are_a_choice_and_say_how_to_get_them(monkeypatch):
    whole = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name in {"viser", "mujoco"} else whole(name))
    found = {f.what: f for f in doctor.findings()}
    assert found["viser"].ok is None and "bodyplan[view]" in found["viser"].for_
    assert found["physics"].ok is None
    result = CliRunner().invoke(app, ["doctor"])
    assert result.exit_code == 0 and "without" in result.output and "viser" in result.output


def test_a_broken_core_fails(monkeypatch):
    whole = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "pint" else whole(name))
    result = CliRunner().invoke(app, ["doctor"])
    assert result.exit_code == 1 and "does not work: pint" in result.output


def test_a_library_of_which_a_part_is_left(monkeypatch):
    whole = importlib.metadata.version

    def version(name):
        if name == "mujoco":
            raise importlib.metadata.PackageNotFoundError(name)
        return whole(name)

    monkeypatch.setattr(importlib.metadata, "version", version)
    found = {f.what: f for f in doctor.findings()}
    assert found["mujoco"].ok is False and "--force-reinstall" in found["mujoco"].for_
    monkeypatch.setitem(sys.modules, "mujoco", ModuleType("mujoco"))
    with pytest.raises(bp.errors.MissingExtraError):
        mujoco()


def test_an_old_python_is_named(monkeypatch):
    monkeypatch.setattr(doctor, "PYTHON", (99, 0))
    assert next(iter(doctor.findings())).ok is False
