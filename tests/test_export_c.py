"""C headers of trajectories and C sources of kinematics, compiled strictly and called."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

import bodyplan as bp
from c_cases import STRICT, compiler
from export_cases import CASES, small

REAL = {"float": ctypes.c_float, "double": ctypes.c_double}
WRAP = """\
#include "HEADER"
int at(NAME_real t, NAME_real *q, NAME_real *qd) { return NAME_at(t, q, qd); }
int joints(void) { return BIG_JOINTS; }
int samples(void) { return BIG_SAMPLES; }
double duration(void) { return (double)BIG_DURATION; }
const char *joint_name(int i) { return NAME_joint_names[i]; }
NAME_real value(int k, int j) { return NAME_q[k][j]; }
"""


def compiled(folder: Path, text: str, name: str = "wrap") -> Any:
    """Compile as C99, every warning an error."""
    (folder / f"{name}.c").write_text(text)
    library = folder / f"{name}.so"
    command = [compiler(), *STRICT, "-Wconversion", "-Wdouble-promotion", "-shared", "-fPIC", f"{name}.c", "-lm"]
    done = subprocess.run([*command, "-o", str(library)], capture_output=True, text=True, cwd=folder)
    assert done.returncode == 0, done.stderr
    return ctypes.CDLL(str(library))


class Header:
    """An exported header, compiled."""

    def __init__(self, motion: bp.Motion, path: Path, **options: Any) -> None:
        bp.save(motion, path, **options)
        word = path.stem.replace("-", "_").replace(" ", "_")
        words = {"HEADER": path.name, "NAME": word, "BIG": word.upper()}
        text = WRAP
        for key, value in words.items():
            text = text.replace(key, value)
        self.library = compiled(path.parent, text)
        self.real = REAL[options.get("dtype", "float")]
        self.kind = np.dtype(self.real)
        self.library.at.argtypes = [self.real, ctypes.c_void_p, ctypes.c_void_p]
        self.library.value.restype, self.library.duration.restype = self.real, ctypes.c_double
        self.library.joint_name.restype = ctypes.c_char_p
        self.joints, self.samples = self.library.joints(), self.library.samples()
        self.names = [self.library.joint_name(i).decode() for i in range(self.joints)]

    def at(self, t: float, rates: bool = True) -> tuple[int, np.ndarray, np.ndarray]:
        q, qd = np.full(self.joints, np.nan, self.kind), np.full(self.joints, np.nan, self.kind)
        back = self.library.at(t, q.ctypes.data, qd.ctypes.data if rates else None)
        return back, q, qd

    def table(self) -> np.ndarray:
        return np.array([[self.library.value(k, j) for j in range(self.joints)] for k in range(self.samples)])


@pytest.mark.parametrize("dtype", ["float", "double"])
@pytest.mark.parametrize("case", CASES)
def test_samples_are_those_of_the_motion(case: str, dtype: str, tmp_path: Path) -> None:
    motion = small(case)
    header = Header(motion, tmp_path / "small-motion.h", dtype=dtype, joints="all")
    assert header.names == list(motion.joints)
    assert header.library.duration() == pytest.approx(motion.t[-1] - motion.t[0], rel=1e-7)
    np.testing.assert_array_equal(header.table(), motion.q.astype(header.kind))
    # at the samples themselves, reached through the interpolation
    for k, t in enumerate(motion.t - motion.t[0]):
        back, q, qd = header.at(t)
        assert back == 0
        tolerance = {"rtol": 0.0, "atol": 1e-13 if dtype == "double" else 1e-5}
        np.testing.assert_allclose(q, motion.q[k], **tolerance)
        np.testing.assert_allclose(qd, motion.qd[k], **{**tolerance, "atol": tolerance["atol"] * 100})


@pytest.mark.parametrize("case", ["concertina", "everything"])
def test_between_samples_it_is_the_cubic_hermite_spline(case: str, tmp_path: Path) -> None:
    """Of SciPy; samples at even and at uneven times."""
    motion = small(case)
    t = motion.t - motion.t[0]
    spline = CubicHermiteSpline(t, motion.q, motion.qd)
    double = Header(motion, tmp_path / "m.h", dtype="double", joints="all")
    for at in np.linspace(0.0, t[-1], 173):
        back, q, qd = double.at(at)
        assert back == 0
        np.testing.assert_allclose(q, spline(at), atol=1e-12)
        np.testing.assert_allclose(qd, spline(at, 1), atol=1e-11)
        np.testing.assert_array_equal(double.at(at, rates=False)[1], q)


@pytest.mark.parametrize("case", ["crawl", "everything"])
def test_linear_is_linear(case: str, tmp_path: Path) -> None:
    motion = small(case)
    t = motion.t - motion.t[0]
    header = Header(motion, tmp_path / "m.h", dtype="double", joints="all", interpolation="linear")
    text = (tmp_path / "m.h").read_text()
    assert "m_qd[" not in text and f"{8 * (motion.q.size + (len(t) if case == 'everything' else 0))} bytes" in text
    for at in np.linspace(0.0, t[-1], 57)[:-1]:
        i = int(np.searchsorted(t, at + 1e-12, side="right")) - 1
        _, q, qd = header.at(at)
        np.testing.assert_allclose(q, [np.interp(at, t, column) for column in motion.q.T], atol=1e-12)
        np.testing.assert_allclose(qd, (motion.q[i + 1] - motion.q[i]) / (t[i + 1] - t[i]), atol=1e-10)


def test_before_and_after_the_joints_rest(tmp_path: Path) -> None:
    motion = small("crawl")
    header = Header(motion, tmp_path / "m.h", dtype="double")
    for t, back, sample in ((-0.1, -1, 0), (float("nan"), -1, 0), (2.0 + 1e-9, 1, -1), (1e300, 1, -1)):
        found, q, qd = header.at(t)
        assert found == back
        np.testing.assert_array_equal(q, motion.q[sample])
        np.testing.assert_array_equal(qd, 0.0)
    # no jump where it ends
    np.testing.assert_allclose(header.at(2.0)[1], motion.q[-1], atol=1e-14)


def test_motors_only_at_a_rate(tmp_path: Path) -> None:
    motion = small("everything")
    header = Header(motion, tmp_path / "m.h", rate=50)
    assert header.samples == 51 and header.names == ["bend", "slide", "nod", "wag", "spin", "adjust"]
    text = (tmp_path / "m.h").read_text()
    assert "#define M_DT 0.02f /* s between samples */" in text and "M_Q_SLIDE = 1" in text and "slide (m)" in text
    columns = [motion.joints.index(name) for name in header.names]
    for k, t in enumerate(motion.t - motion.t[0]):
        np.testing.assert_allclose(header.at(t)[1], motion.q[k, columns], atol=2e-6)


def test_names_that_c_does_not_allow(tmp_path: Path) -> None:
    rows = {
        "a": [bp.Row(theta=bp.Joint(name), a=0.1) for name in ("3 d", "3*d", "int", "*", "é\\?", "a.b", "dt", "joints")]
    }
    robot = bp.Robot.from_rows(rows, name="*/ #error no")
    zero = np.zeros((2, 8))
    base = np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (2, 1))
    motion = bp.Motion(robot, bp.Plane(), {}, [0.0, 1.0], base, zero, zero, zero, [0.0, 0.0], ["ok", "ok"])
    header = Header(motion, tmp_path / "my-motion 2.h")
    assert header.names == list(robot.joints)


def test_two_headers_in_one_program(tmp_path: Path) -> None:
    motion = small("crawl")
    bp.save(motion, tmp_path / "there.h")
    bp.save(motion, tmp_path / "back.h", dtype="double", interpolation="linear")
    includes = '#include "there.h"\n#include "there.h"\n#include "back.h"\n'
    compiled(tmp_path, includes + "int n(void) { return THERE_JOINTS + BACK_JOINTS + THERE_Q_FL_KNEE; }\n", "both")


def test_misuse(tmp_path: Path) -> None:
    motion = small("crawl")
    for options, words in (
        ({"dtype": "half"}, "dtype: must be float or double, got 'half'"),
        ({"interpolation": "none"}, "interpolation: must be cubic or linear"),
        ({"joints": "none"}, "joints: must be actuated or all"),
        ({"rate": -1}, "rate: must be a finite number > 0"),
        ({"dtypes": "float"}, "unknown option of header 'dtypes'. Did you mean 'dtype'"),
    ):
        with pytest.raises(bp.InputError, match=words):
            bp.save(motion, tmp_path / "m.h", **options)
    close = np.array([*motion.t[:-1], motion.t[-2] + 1e-9])
    with pytest.raises(bp.InputError, match="times are too close to each other for float; use double"):
        bp.save(motion.replace(t=close), tmp_path / "m.h")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("case", ["double joints", "crawl", "everything"])
def test_the_source_of_the_kinematics(case: str, tmp_path: Path) -> None:
    motion = small(case)
    robot = motion.robot
    assert bp.save(motion, tmp_path / "my-robot.c") == tmp_path / "my-robot.c"
    assert {p.name for p in tmp_path.iterdir()} == {"my-robot.c", "my-robot.h"}
    command = [compiler(), *STRICT, "-shared", "-fPIC", "my-robot.c", "-lm", "-o", "robot.so"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    library = ctypes.CDLL(str(tmp_path / "robot.so"))
    P, Q = np.full((6 * len(robot.ends), 6), np.nan), np.full((6 * len(robot.ends), robot.n), np.nan)
    q = np.array(motion.q[-1])
    library.my_robot_velocity_model(*(a.ctypes.data_as(ctypes.c_void_p) for a in (q, P, Q)))
    for found, expected in zip((P, Q), robot.velocity_model(q), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-12)


def test_a_header_and_a_source_do_not_replace_each_other(tmp_path: Path) -> None:
    motion = small("crawl")
    bp.save(motion, tmp_path / "robot.c")
    before = (tmp_path / "robot.h").read_bytes()
    with pytest.raises(bp.InputError, match=r"robot\.h: belongs to the C source"):
        bp.save(motion, tmp_path / "robot.h")
    bp.save(motion, tmp_path / "robot.c")
    assert (tmp_path / "robot.h").read_bytes() == before
    bp.save(motion, tmp_path / "walk.h")
    before = (tmp_path / "walk.h").read_bytes()
    with pytest.raises(bp.InputError, match=r"walk\.h would replace another file"):
        bp.save(motion, tmp_path / "walk.c")
    assert (tmp_path / "walk.h").read_bytes() == before and not (tmp_path / "walk.c").exists()
