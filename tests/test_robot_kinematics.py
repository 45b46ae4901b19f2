"""Forward kinematics, the velocity equation and Jacobians of random robots against an independent model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot import Arc, Joint, Robot, Row, snake
from bodyplan.robot.rows import arc_matrices, arc_transform, row_matrices, row_transform
from bodyplan.spatial import compose, exp, matrix_from_quaternion
from robot_cases import STEP, body_twist, element_matrix, frame_matrices, random_robot, reference_jacobians, screw

SILO4 = Path(__file__).parents[1] / "examples" / "silo4_legs.csv"


@pytest.fixture(scope="module")
def silo4() -> Robot:
    return Robot.from_table(SILO4)


def check_robot(robot: Robot, q: np.ndarray) -> None:
    """Every frame's pose and Jacobian, P and Q, against the reference."""
    frames, jacobians = frame_matrices(robot, q), reference_jacobians(robot, q)
    poses = robot.forward(q)
    assert poses.shape == (len(robot.frames), 7)
    for i, name in enumerate(robot.frames):
        T = frames[name].real
        assert np.abs(poses[name][:3] - T[:3, 3]).max() < 1e-13
        assert np.abs(poses.rotations[i] - T[:3, :3]).max() < 1e-13
        assert np.abs(robot.jacobian(q, name) - jacobians[name]).max() < 2e-13
    P, Q = robot.velocity_model(q)
    m = len(robot.chains)
    assert P.shape == (6 * m, 6)
    assert Q.shape == (6 * m, robot.n)
    for c, chain in enumerate(robot.chains):
        rows = slice(6 * c, 6 * c + 6)
        end = robot.frames[robot.ends[c]]
        assert np.abs(Q[rows] - jacobians[end]).max() < 2e-13
        T = frames[end].real
        for k in range(6):
            # the base moves with a unit body-fixed twist: T_end = exp(s xi) T
            dT = (expm(1j * STEP * screw(np.eye(6)[k])) @ T).imag / STEP
            assert np.abs(P[rows, k] - body_twist(T, dT)).max() < 1e-13
        assert np.array_equal(poses[chain.name], poses[end])


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
def test_random_robots(seed: int, chains: int) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, chains)
    check_robot(robot, rng.uniform(-2.0, 2.0, robot.n))


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_shared_joints_add_up(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 3, variable=0.8, share=0.6)
    check_robot(robot, rng.uniform(-2.0, 2.0, robot.n))


@settings(max_examples=4, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_all_four_parameters_variable(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 2, variable=1.0)
    check_robot(robot, rng.uniform(-2.0, 2.0, robot.n))


@pytest.mark.parametrize("size", [0.0, 1e-300, 1e-12, 1e-9, 1e-6, 1e-3, 0.7, 1.0, 1.5, 3.14, 6.28, 2 * np.pi, 9.0])
def test_arcs_at_every_bend(size: float) -> None:
    robot = Robot.from_rows({"arm": [Arc(0.3, Joint("p"), Joint("y")), Row(a=0.1), Arc(0.2, Joint("p"), 0.4)]})
    check_robot(robot, size * np.array([0.6, -0.8]))


def test_one_and_the_same_joint_bends_an_arc_both_ways() -> None:
    robot = Robot.from_rows({"arm": [Arc(0.3, Joint("j", scale=2.0), Joint("j", offset=0.3))]})
    check_robot(robot, np.array([0.8]))


@settings(max_examples=30, deadline=None)
@given(*[st.floats(-7.0, 7.0)] * 4)
def test_matrices_of_one_element(theta: float, d: float, a: float, epsilon: float) -> None:
    q = {"theta": theta, "d": d, "a": a, "epsilon": epsilon}
    for element, names, transform, matrices in (
        (Row(*[Joint(n) for n in q]), tuple(q), row_transform(**q), row_matrices(**q)),
        (
            Arc(0.5 + abs(d), Joint("theta"), Joint("epsilon")),
            ("theta", "epsilon"),
            arc_transform(0.5 + abs(d), theta, epsilon),
            arc_matrices(0.5 + abs(d), theta, epsilon),
        ),
    ):
        T = element_matrix(element, q).real
        assert np.abs(transform[0] - T[:3, 3]).max() < 1e-13
        assert np.abs(transform[1] - T[:3, :3]).max() < 1e-13
        D, E = matrices
        for k, name in enumerate(names):
            moved = element_matrix(element, {**q, name: q[name] + 1j * STEP})
            assert np.abs(E[:, k] - body_twist(T, moved.imag / STEP)).max() < 2e-13
        for k in range(6):
            dT = (expm(1j * STEP * screw(np.eye(6)[k])) @ T).imag / STEP
            assert np.abs(D[:, k] - body_twist(T, dT)).max() < 1e-13


def test_rows_of_the_paper() -> None:
    """Eqs. (10) and (13) of paper legs, the latter with row 3 corrected to [a3 s3, -a3 c3, 0]."""
    c, s, d, a = np.cos(0.3), np.sin(0.3), 0.2, 0.5
    D, _ = row_matrices(0.3, d, a, 0.0)
    upper = [
        [c, s, 0, -d * s, d * c, 0],
        [-s, c, 0, -d * c, -d * s, a],
        [0, 0, 1, a * s, -a * c, 0],
    ]
    lower = [[0, 0, 0, c, s, 0], [0, 0, 0, -s, c, 0], [0, 0, 0, 0, 0, 1]]
    assert np.abs(D - np.array([*upper, *lower])).max() < 1e-15
    _, E = row_matrices(0.3, 0.0, a, 0.0)
    assert np.array_equal(E[:, 0], [0, a, 0, 0, 0, 1])


def test_composite_is_the_product_of_the_rows() -> None:
    """P = D_n ... D_1 and Q = [D_n ... D_2 E_1 | ... | E_n]; the order the paper prints is wrong."""
    rng = np.random.default_rng(11)
    robot = random_robot(rng, 1, variable=0.6)
    q = rng.uniform(-1, 1, robot.n)
    P, Q = robot.velocity_model(q)
    parts = [robot.element_matrices(q, name) for name in robot.frames[1:]]
    product, printed = np.eye(6), np.eye(6)
    columns = np.zeros((6, robot.n))
    for (D, E), element in zip(parts, robot.elements, strict=True):
        product, printed, columns = D @ product, printed @ D, D @ columns
        for k, field in enumerate(element.VARIABLES):
            drive = getattr(element, field)
            if isinstance(drive, Joint):
                columns[:, robot.joint_index(drive.name)] += drive.scale * E[:, k]
    linear = [j for j, name in enumerate(robot.joints) if not name.startswith("w")]
    assert np.abs(P - product).max() < 1e-13
    assert np.abs((Q - columns)[:, linear]).max() < 1e-13
    assert np.abs(P - printed).max() > 0.1


def test_determinant_of_a_silo4_leg(silo4: Robot) -> None:
    """notes/legs.md: det Q = a2 a3 sin(theta3) cos(theta5) (a1 + a2 cos theta2 + a3 cos(theta2 + theta3))."""
    a1, a2, a3 = 0.06, 0.24, 0.24
    q = np.random.default_rng(12).uniform(-2, 2, (20, silo4.n))
    _, Q = silo4.velocity_model(q)
    for c in range(4):
        leg = slice(6 * c, 6 * c + 6)
        t2, t3, t5 = (q[:, 6 * c + k] for k in (1, 2, 4))
        want = a2 * a3 * np.sin(t3) * np.cos(t5) * (a1 + a2 * np.cos(t2) + a3 * np.cos(t2 + t3))
        assert np.abs(np.abs(np.linalg.det(Q[:, leg, leg])) - np.abs(want)).max() < 1e-15
        others = np.delete(np.arange(silo4.n), np.arange(6 * c, 6 * c + 6))
        assert np.array_equal(Q[:, leg, others], np.zeros((20, 6, 18)))
    for joint, value in (("fl.knee", 0.0), ("fl.heel", np.pi / 2)):
        singular = q[0].copy()
        singular[silo4.joint_index(joint)] = value
        assert abs(np.linalg.det(silo4.velocity_model(singular)[1][:6, :6])) < 1e-17


@pytest.mark.parametrize("shape", [(), (0,), (1,), (2, 3), (15,), (16,), (17,), (3, 0, 2)])
def test_batch_shapes(silo4: Robot, shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(13)
    q, base = rng.uniform(-2, 2, (*shape, silo4.n)), exp(rng.normal(size=(*shape, 6)))
    poses, at = silo4.forward(q, base), silo4.ends_and_jacobians(q, base)
    P, Q = silo4.velocity_model(q)
    assert poses.shape == (*shape, 29, 7)
    assert poses.rotations.shape == (*shape, 29, 3, 3)
    assert (P.shape, Q.shape) == ((*shape, 24, 6), (*shape, 24, 24))
    assert silo4.jacobian(q, "fl").shape == (*shape, 6, 24)
    assert at.positions.shape == (*shape, 4, 3)
    assert at.jacobian(2).shape == (*shape, 6, 6)
    # one by one, without lanes
    for index in np.ndindex(*shape):
        alone = silo4.ends_and_jacobians(q[index])
        assert np.abs(alone.twists - at.twists[index]).max() < 4e-15
        placed = compose(base[index], silo4.forward(q[index]).array[list(silo4.ends)])
        assert np.abs(placed[:, :3] - at.positions[index]).max() < 4e-15
        assert np.abs(matrix_from_quaternion(placed[:, 3:]) - at.rotations[index]).max() < 4e-15
        assert np.abs(poses.array[index][list(silo4.ends), :3] - at.positions[index]).max() < 4e-15


def test_threads_and_views(silo4: Robot) -> None:
    rng = np.random.default_rng(14)
    q = rng.uniform(-2, 2, (9001, 2, silo4.n))[:, 1]
    q.flags.writeable = False
    at, poses = silo4.ends_and_jacobians(q), silo4.forward(q)
    for part in (slice(0, 40), slice(4470, 4530), slice(8970, 9001)):
        few = silo4.ends_and_jacobians(q[part])
        assert np.abs(at.twists[part] - few.twists).max() < 1e-15
        assert np.abs(at.positions[part] - few.positions).max() < 1e-15
        assert np.abs(poses.array[part] - silo4.forward(q[part]).array).max() < 1e-15


def test_base_broadcasts(silo4: Robot) -> None:
    rng = np.random.default_rng(15)
    q, base = rng.uniform(-1, 1, (5, silo4.n)), exp(rng.normal(size=(3, 1, 6)))
    poses = silo4.forward(q, base)
    assert poses.shape == (3, 5, 29, 7)
    assert np.abs(poses.array[2, 4] - silo4.forward(q[4], base[2, 0]).array).max() < 1e-15
    one = silo4.forward(q, base[0, 0])
    assert np.abs(one.array - poses.array[0]).max() < 1e-15
    assert np.abs(one["base"] - base[0, 0]).max() < 1e-15
    # body-fixed twists do not know where the base is
    assert np.array_equal(silo4.ends_and_jacobians(q, base).twists[1], silo4.ends_and_jacobians(q).twists)


def test_world_reference(silo4: Robot) -> None:
    q = np.random.default_rng(16).uniform(-1, 1, silo4.n)
    h = 1e-6
    J = silo4.jacobian(q, "hr.KE", reference="world")
    index = silo4.frame_index("hr.KE")
    for k in range(silo4.n):
        step = h * np.eye(silo4.n)[k]
        ahead, behind = silo4.forward(q + step), silo4.forward(q - step)
        v = (ahead.positions[index] - behind.positions[index]) / (2 * h)
        W = (ahead.rotations[index] - behind.rotations[index]) / (2 * h) @ silo4.forward(q).rotations[index].T
        assert np.abs(J[:, k] - [*v, W[2, 1], W[0, 2], W[1, 0]]).max() < 1e-9


def test_result_can_be_reused(silo4: Robot) -> None:
    rng = np.random.default_rng(17)
    for shape in ((), (20,), (2, 3)):
        q = rng.uniform(-1, 1, (2, *shape, silo4.n))
        at = silo4.ends_and_jacobians(q[0])
        positions = at.positions
        again = silo4.ends_and_jacobians(q[1], out=at)
        assert again is at
        assert np.array_equal(positions, silo4.ends_and_jacobians(q[1]).positions)
    with pytest.raises(InputError, match="out"):
        silo4.ends_and_jacobians(q[0], frames=("fl",), out=at)
    with pytest.raises(InputError, match="out"):
        silo4.ends_and_jacobians(q[0, 0], out=at)


def test_angles_of_any_size() -> None:
    robot = Robot.from_rows(
        {"arm": [Row(theta=Joint("a"), a=0.3), Arc(0.2, yaw=Joint("b")), Row(epsilon=Joint("c"), d=0.1)]}
    )
    for q in ([1e9, 0.2, 0.3], [0.1, 0.2, -7e15], [6.7e7, 1.0, 1.0]):
        check_robot(robot, np.array(q))
    bent = np.array([0.1, 3e8, 0.2])
    # the end of an arc of b rad lies on a circle of radius length / b
    start, end = robot.forward(bent).positions[1:3]
    assert np.linalg.norm(end - start) <= 0.4 / 3e8 + 1e-16
    for q in (bent, np.array([1e9, 0.2, 0.3])):
        block = robot.ends_and_jacobians(np.tile(q, (17, 1)))
        assert np.abs(block.twists - robot.ends_and_jacobians(q).twists).max() < 1e-14


def test_quaternions_have_a_canonical_sign() -> None:
    robot = Robot.from_rows({"a": [Row(theta=Joint("t"), epsilon=Joint("e"))]})
    q = np.array([[3.2, 0.0], [-3.2, 1.0], [7.0, 9.0], [np.pi, np.pi], [0.0, 2 * np.pi]])
    quaternions = robot.forward(q).quaternions.reshape(-1, 4)
    for x in quaternions:
        assert x[np.flatnonzero(x)[0]] > 0.0
    assert np.abs(np.linalg.norm(quaternions, axis=1) - 1.0).max() < 1e-15
    assert not np.signbit(quaternions[quaternions == 0.0]).any()


def test_rounding_does_not_pile_up() -> None:
    robot = snake(2000, 0.01, axes="alternating")
    poses = robot.forward(np.random.default_rng(18).uniform(-0.5, 0.5, robot.n))
    assert np.abs(np.linalg.norm(poses.quaternions, axis=-1) - 1.0).max() < 1e-15
    steps = np.linalg.norm(
        np.diff(poses.positions[[robot.frame_index(f"link{i}") for i in range(1, 2001)]], axis=0), axis=1
    )
    assert np.abs(steps - 0.01).max() < 1e-14


def test_refusals(silo4: Robot) -> None:
    q = np.zeros(silo4.n)
    for bad in (np.nan, np.inf, -np.inf):
        spoiled = np.tile(q, (40, 1))
        spoiled[33, 5] = bad
        with pytest.raises(InputError, match=r"finite.*\(33, 5\)"):
            silo4.forward(spoiled)
        with pytest.raises(InputError, match=r"finite.*\(33, 5\)"):
            silo4.ends_and_jacobians(spoiled)
        with pytest.raises(InputError, match=r"finite.*\(5,\)"):
            silo4.ends_and_jacobians(spoiled[33])
        with pytest.raises(InputError, match=r"finite.*\(33, 5\)"):
            silo4.vector(spoiled)
    with pytest.raises(InputError, match=r"\(\.\.\., 24\)"):
        silo4.forward(np.zeros(23))
    with pytest.raises(InputError, match=r"\(\.\.\., 24\)"):
        silo4.ends_and_jacobians(np.zeros((4, 23)))
    with pytest.raises(InputError, match="numbers"):
        silo4.forward(["a"] * 24)
    with pytest.raises(InputError, match="length 1"):
        silo4.forward(q, [0, 0, 0, 1, 0.1, 0, 0])
    with pytest.raises(InputError, match=r"\(\.\.\., 7\)"):
        silo4.forward(q, [0, 0, 0])
    with pytest.raises(InputError, match="broadcast"):
        silo4.forward(np.zeros((4, 24)), np.tile([0, 0, 0, 1.0, 0, 0, 0], (3, 1)))
    with pytest.raises(UnknownNameError, match=r"fl\.KE"):
        silo4.jacobian(q, "fl.KA")
    with pytest.raises(InputError, match="reference"):
        silo4.jacobian(q, "fl", reference="spatial")
    with pytest.raises(InputError, match="base"):
        silo4.element_matrices(q, "base")
