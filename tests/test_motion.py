"""Motion: shapes, names, read-only arrays, times, and files that give an equal motion back."""

import csv

import numpy as np
import pytest

import bodyplan as bp


@pytest.fixture(scope="module")
def motion():
    return bp.plan(
        bp.snake(12, 0.05),
        bp.Concertina(body_modules=2, contraction="mirror"),
        bp.Corridor(0.3),
        bp.times(0, 10, dt=0.1),
    )


def test_times_are_even_and_include_both_ends():
    t = bp.times(0, 8, dt=0.02)
    assert len(t) == 401 and t[0] == 0.0 and t[-1] == 8.0
    np.testing.assert_allclose(np.diff(t), 0.02, rtol=1e-12)
    assert np.diff(bp.times(0, 1, dt=0.3)).max() <= 0.3
    for wrong in ((0, 0, 0.1), (1, 0, 0.1), (0, 1, 0.0), (0, np.inf, 0.1)):
        with pytest.raises(bp.InputError):
            bp.times(*wrong)


def test_arrays_are_read_only_and_named(motion):
    for name in ("t", "base", "q", "qd", "qdd", "residual", "status"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(motion, name)[0] = 0
    np.testing.assert_array_equal(motion.joint("yaw3"), motion.q[:, 2])
    with pytest.raises(bp.UnknownNameError, match="yaw3"):
        motion.joint("yow3")
    with pytest.raises(AttributeError):
        motion.q = motion.q


@pytest.mark.parametrize(
    "changes",
    [
        {"t": [0.0]},
        {"q": np.zeros((3, 3))},
        {"qd": None},
        {"base": np.zeros((101, 7))},
        {"residual": np.full(101, np.nan)},
        {"status": ["ok"]},
        {"torques": np.zeros((101, 3))},
    ],
)
def test_refuses_fields_that_do_not_fit(motion, changes):
    with pytest.raises(bp.InputError, match="Motion"):
        motion.replace(**changes)


def test_npz_gives_an_equal_motion(motion, tmp_path):
    path = motion.save(tmp_path / "m.npz")
    back = bp.Motion.load(path)
    assert back == motion and back.ground == motion.ground and back.robot == motion.robot
    assert str(bp.check(back)) == str(bp.check(motion))
    assert motion.replace(q=motion.q + 1e-12) != motion
    full = motion.replace(contacts=np.ones((101, 12)), torques=np.zeros((101, 11)), forces=np.zeros((101, 12, 3)))
    assert bp.load(full.save(tmp_path / "full.npz")) == full != motion


def test_csv_has_names_units_and_exact_numbers(motion, tmp_path):
    with motion.save(tmp_path / "m.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0][:4] == ["t [s]", "base.x [m]", "base.y [m]", "base.z [m]"]
    assert rows[0][8] == "yaw1 [rad]" and "yaw11.rate [rad/s]" in rows[0] and "yaw1.acceleration [rad/s^2]" in rows[0]
    numbers = np.array([[float(x) for x in row[:-1]] for row in rows[1:]])
    np.testing.assert_array_equal(numbers, np.column_stack([motion.t, motion.base, motion.q, motion.qd, motion.qdd]))
    assert {row[-1] for row in rows[1:]} == {"ok"}


def test_writing_fails_whole(motion, tmp_path, monkeypatch):
    path = tmp_path / "m.csv"
    path.write_text("old")
    monkeypatch.setattr("bodyplan.export.csv_file.columns", lambda m: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        motion.save(path)
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_refuses_files(motion, tmp_path):
    with pytest.raises(bp.UnknownNameError, match="csv"):
        motion.save(tmp_path / "m.cvs")
    with pytest.raises(bp.InputError, match="folder"):
        motion.save(tmp_path / "no" / "m.csv")
    with pytest.raises(bp.InputError, match="no such file"):
        bp.load(tmp_path / "none.npz")
    (tmp_path / "bad.npz").write_bytes(b"not a zip")
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    for name in ("bad.npz", "other.npz"):
        with pytest.raises(bp.InputError, match="not a bodyplan motion"):
            bp.load(tmp_path / name)


def test_failed_samples_raise_on_request(motion):
    status = np.array(motion.status)
    status[4] = "out_of_reach"
    spoiled = motion.replace(status=status)
    assert motion.ok and motion.raise_if_failed() is motion and not spoiled.ok
    with pytest.raises(bp.SolveError, match=r"out_of_reach.*0\.4 s") as caught:
        spoiled.raise_if_failed()
    assert caught.value.status == "out_of_reach" and caught.value.index == 4


def test_the_joint_that_is_farthest_beyond_its_limits_is_named():
    robot = bp.snake(4, 0.1, limits=(-0.5, 0.5))
    t = np.arange(10.0)
    q, base = np.zeros((10, 3)), np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], (10, 1))
    q[5, 2], q[6, 0] = -0.75, 0.6
    q[8, 0] = 9.0  # not a sample that is said to be beyond
    status = np.array(["ok"] * 4 + ["limit"] * 3 + ["ok"] * 3, dtype="U24")
    made = bp.Motion(
        robot=robot, ground=bp.Plane(), gait={"kind": "none"}, t=t, base=base, q=q, qd=0.0 * q, qdd=0.0 * q,
        residual=np.zeros(10), status=status,
    )  # fmt: skip
    with pytest.raises(bp.SolveError, match=r"beyond its limits is 'yaw3', by 0\.25 at 5 s"):
        made.raise_if_failed()
