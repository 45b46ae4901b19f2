"""Transforms of anchors: Figs. 8 and 11, rotated frames against plain products, orientation up to +-90 deg."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.gaits.rectilinear import Transform, drive, relative

#: mm: T, M, H of Figs. 8 and 11 before and after their moves; printed T_WTB = 2400 of Fig. 11 should be 3400
FIGURES = {
    "Fig. 8": ([1000, 2200, 5000], [1720, 3880, 6680], [720, 1680, 1680]),
    "Fig. 11": ([1000, 5000, 9000], [3400, 7400, 11400], [2400, 2400, 2400]),
}
#: mm: L1L, L1R after the tail's, the middle's and the head's move
LENGTHS = {"Fig. 8": [(480, 2800), (2160, 1120), (2160, 2800)], "Fig. 11": [(1600, 4000), (4000, 1600), (4000, 4000)]}

ANGLE = st.floats(-np.pi, np.pi)
PLACE = st.tuples(*[st.floats(-50, 50)] * 3)


def turn(axis: str, angle: Any) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    k = "xyz".index(axis)
    i, j = (k + 1) % 3, (k + 2) % 3
    out = np.eye(3)
    out[i, i], out[j, j], out[j, i], out[i, j] = c, c, s, -s
    return out


def pose_matrix(angles: Any, place: Any) -> np.ndarray:
    x, y, z = angles
    out = np.eye(4)
    out[:3, :3] = turn("z", z) @ turn("y", y) @ turn("x", x)
    out[:3, 3] = place
    return out


@pytest.mark.parametrize("figure", FIGURES)
def test_drives_and_lengths_of_the_figures(figure: str) -> None:
    before, after, drives = FIGURES[figure]
    on_x = [np.stack([np.array(x, float), np.zeros(3), np.zeros(3)], axis=-1) for x in (before, after)]
    found = drive(*on_x)
    printed = np.tile(np.eye(4), (3, 1, 1))
    printed[:, 0, 3] = drives
    np.testing.assert_array_equal(found.matrix, printed)
    here = on_x[0].copy()
    for moved, lengths in enumerate(LENGTHS[figure]):
        here[moved] = on_x[1][moved]
        left, right = relative(here[0], here[1]), relative(here[1], here[2])
        assert (float(left.L1), float(left.L2), float(right.L1), float(right.L2)) == (
            *lengths[:1] * 2,
            *lengths[1:] * 2,
        )
        # and as (25)-(34) have them: from where all stood, with the drives made so far
        made = [found.matrix[i] if i <= moved else np.eye(4) for i in range(3)]
        for i, length in enumerate(lengths):
            driven = relative(on_x[0][i], on_x[0][i + 1], made[i], made[i + 1])
            assert float(driven.L1) == float(driven.L2) == length


@given(st.tuples(ANGLE, ANGLE, ANGLE), PLACE, st.tuples(ANGLE, ANGLE, ANGLE), PLACE)
def test_relative_and_drive_are_products_of_matrices(a: Any, p: Any, b: Any, q: Any) -> None:
    start, end = pose_matrix(a, p), pose_matrix(b, q)
    between = np.linalg.inv(start) @ end
    for found in (relative(start, end), drive(start, end), relative(Transform(start), Transform(end))):
        np.testing.assert_allclose(found.matrix, between, atol=1e-12)
        np.testing.assert_allclose(start @ found.matrix, end, atol=1e-12)  # (1), (16)
        np.testing.assert_allclose(found.inverse.matrix @ found.matrix, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(found.position, between[:3, 3], atol=1e-12)
    assert float(found.L1) == pytest.approx(np.sqrt(between[0, 3] ** 2 + between[1, 3] ** 2), abs=1e-12)
    assert float(found.L2) == pytest.approx(np.sqrt(np.sum(between[:3, 3] ** 2)), abs=1e-12)


@given(
    st.lists(st.tuples(st.tuples(ANGLE, ANGLE, ANGLE), PLACE), min_size=4, max_size=4),
)
def test_drives_in_rotated_frames(four: Any) -> None:
    """After the drives T_TA^MA becomes D_T^-1 T D_M, which is what their own products of (16), (18) give."""
    tail, middle, tail_drive, middle_drive = (pose_matrix(*one) for one in four)
    found = relative(tail, middle, tail_drive, middle_drive)
    np.testing.assert_allclose(
        found.matrix, np.linalg.inv(tail_drive) @ np.linalg.inv(tail) @ middle @ middle_drive, atol=1e-11
    )
    np.testing.assert_allclose(found.matrix, relative(tail @ tail_drive, middle @ middle_drive).matrix, atol=1e-11)
    one_sided = relative(tail, middle, end_drive=middle_drive)
    np.testing.assert_allclose(one_sided.matrix, np.linalg.inv(tail) @ middle @ middle_drive, atol=1e-11)
    np.testing.assert_allclose(relative(tail, middle, tail_drive).matrix, np.linalg.inv(tail @ tail_drive) @ middle,
                               atol=1e-11)  # fmt: skip


@given(PLACE, PLACE, PLACE, PLACE)
def test_parallel_frames_take_the_printed_sums(a: Any, b: Any, d: Any, e: Any) -> None:
    """(25)-(30) corrected: P_B = P_A + d_end - d_start."""
    found = relative(a, b, d, e)
    np.testing.assert_allclose(found.position, np.subtract(b, a) + np.subtract(e, d), atol=1e-12)
    np.testing.assert_array_equal(found.matrix[:3, :3], np.eye(3))


def rebuilt(angles: np.ndarray) -> np.ndarray:
    return turn("z", angles[2]) @ turn("y", angles[1]) @ turn("x", angles[0])


@given(st.tuples(ANGLE, ANGLE, ANGLE))
def test_orientation_gives_the_rotation_back(angles: Any) -> None:
    made = pose_matrix(angles, (0, 0, 0))
    found = Transform(made).orientation
    assert abs(found[1]) <= np.pi / 2
    np.testing.assert_allclose(rebuilt(found), made[:3, :3], atol=4e-15)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("off", [0.0, 1e-17, 1e-16, 1e-15, 3e-15, 1e-12, 1e-9, -1e-9, 1e-6])
def test_orientation_at_90_degrees(sign: int, off: float) -> None:
    rng = np.random.default_rng(7)
    for x, z in rng.uniform(-np.pi, np.pi, (30, 2)):
        made = pose_matrix((x, sign * (np.pi / 2 - off), z), (0, 0, 0))
        found = Transform(made).orientation
        np.testing.assert_allclose(rebuilt(found), made[:3, :3], atol=4e-15)
        assert found[1] == pytest.approx(sign * np.pi / 2, abs=abs(off) + 1e-15)
        if abs(off) >= 1e-9:  # the two other angles are still told apart, as far as they show in the matrix
            beyond = np.pi if off < 0 else 0.0
            np.testing.assert_allclose(
                np.exp(1j * found[[0, 2]]), np.exp(1j * np.array([x + beyond, z + beyond])), atol=1e-6
            )


def test_the_printed_orientation_fails_at_90_degrees() -> None:
    """(4), (6) divide by cos(theta_y): exact quarter turns make 0 / 0 of them."""
    quarter = np.array([[0.0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])
    assert 1.0 - quarter[2, 0] ** 2 == 0.0
    np.testing.assert_array_equal(Transform(quarter).orientation, [0.0, np.pi / 2, 0.0])
    rolled = quarter.copy()
    rolled[:3, :3] = quarter[:3, :3] @ turn("x", 0.7)
    np.testing.assert_allclose(Transform(rolled).orientation, [0.7, np.pi / 2, 0.0], atol=1e-15)


def test_batches_and_positions_broadcast() -> None:
    rng = np.random.default_rng(1)
    many = np.array([[pose_matrix(rng.uniform(-3, 3, 3), rng.uniform(-5, 5, 3)) for _ in range(3)] for _ in range(4)])
    one = pose_matrix((0.1, 0.2, 0.3), (1, 2, 3))
    found = relative(many, one)
    assert found.matrix.shape == (4, 3, 4, 4) and found.position.shape == (4, 3, 3)
    assert found.orientation.shape == (4, 3, 3) and found.L1.shape == found.L2.shape == (4, 3)
    for i, j in np.ndindex(4, 3):
        np.testing.assert_allclose(found.matrix[i, j], np.linalg.inv(many[i, j]) @ one, atol=1e-12)
        np.testing.assert_allclose(rebuilt(found.orientation[i, j]), found.matrix[i, j, :3, :3], atol=4e-15)
    # positions are frames parallel to the world's
    np.testing.assert_allclose(relative([1, 2, 3], many).matrix[..., :3, 3], many[..., :3, 3] - [1, 2, 3], atol=1e-12)
    assert relative(np.zeros((5, 3)), [1.0, 0, 0]).matrix.shape == (5, 4, 4)
    assert relative(np.zeros((0, 3)), [1.0, 0, 0]).matrix.shape == (0, 4, 4)
    product = Transform(many) @ one
    np.testing.assert_allclose(np.asarray(product), many @ one, atol=1e-12)
    assert not found.matrix.flags.writeable
    np.asarray(found, copy=True)[...] = 0.0  # a copy is the caller's own
    assert found.matrix.any()


SCALED = np.diag([2.0, 1, 1, 1])
MIRRORED = np.diag([-1.0, 1, 1, 1])
SHEARED = np.eye(4) + 1e-6 * np.eye(4, k=1)
BROKEN = np.eye(4) + 1e-6 * np.eye(4, k=-3)


@pytest.mark.parametrize(("bad", "message"), [
    (SCALED, "not a rigid transform"), (MIRRORED, "not a rigid transform"), (SHEARED, "not a rigid transform"),
    (BROKEN, "last row"), ([1.0, 2.0], "expected transforms"),
    (3.0, "expected transforms"), ([1.0, np.nan, 0.0], "finite"), ([np.inf, 0, 0], "finite"), ("abc", "numbers"),
    (np.full((4, 4), np.nan), "finite"), ([[1, 2, 3], [1, 2]], "numbers"), (np.eye(4) * 1j, "numbers"),
])  # fmt: skip
def test_refusals(bad: Any, message: str) -> None:
    good = [0.0, 0.0, 0.0]
    for field, call in {
        "start": lambda: relative(bad, good), "end": lambda: relative(good, bad),
        "start_drive": lambda: relative(good, good, bad), "end_drive": lambda: relative(good, good, None, bad),
        "before": lambda: drive(bad, good), "after": lambda: drive(good, bad),
        "matrix": lambda: Transform(bad),
    }.items():  # fmt: skip
        with pytest.raises(bp.InputError, match=message) as caught:
            call()
        assert str(caught.value).startswith(f"{field}: ")


def test_long_products_of_rounded_rotations_stay_transforms() -> None:
    """Inputs may be off by 1e-9; what is made of many of them is not refused for adding that up."""
    almost = pose_matrix((0.3, 0.2, 0.1), (1, 0, 0))
    almost[:3, :3] *= 1.0 + 4e-10
    made = Transform(almost)
    for _ in range(20):
        made = made @ almost
    assert relative(made, almost).matrix.shape == (4, 4)
    assert made.inverse.matrix.shape == (4, 4)
