"""Quantities with units: right values, right refusals, and nothing that would have to be computed."""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.units import SI_UNITS, to_si


@pytest.mark.parametrize("text,dimension,value", [
    ("25 mm", "length", 0.025), ("30 deg", "angle", np.pi / 6), ("90 deg/s", "angular_rate", np.pi / 2),
    ("0.5 N*m", "torque", 0.5), ("12 / m", "curvature", 12.0), ("12 1/m", "curvature", 12.0),
    ("0.25 Hz", "frequency", 0.25),
    ("30 mm/s", "speed", 0.03), (" -5 deg ", "angle", -np.pi / 36), ("1e-3 m", "length", 1e-3), ("50 g", "mass", 0.05),
    ("2 kg*m**2/s**2", "torque", 2.0), ("3 \u00b5m", "length", 3e-6), ("0.8", "none", 0.8), ("7", "none", 7.0),
])  # fmt: skip
def test_values(text, dimension, value):
    assert to_si(text, dimension) == pytest.approx(value, rel=1e-14)
    assert to_si(value, dimension) == value


@pytest.mark.parametrize("text", [
    "9**9**9**9 mm", "(10**10) mm", "1 mm * 9**9", "mm", "", "1 mm; 2", "5 s", "1 deg", "1e9999 m", "1 parrot", "nan m",
    "1 m" + " m" * 50, "1 __import__", True, None, [1], float("nan"),
])  # fmt: skip
def test_refuses(text):
    with pytest.raises(bp.InputError, match="width"):
        to_si(text, "length", "width")


def test_every_dimension_has_an_example_that_it_accepts():
    for dimension in SI_UNITS:
        with pytest.raises(bp.InputError) as caught:
            to_si("?", dimension)
        example = str(caught.value).rpartition("such as ")[2].rstrip(".").strip('"')
        assert np.isfinite(to_si(example, dimension))
