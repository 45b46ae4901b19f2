"""Which entries of the printed equations (10)-(13) of paper *legs* are wrong, and that the page about them is true."""

from __future__ import annotations

import re

import numpy as np
import pytest
import sympy as sp

from bodyplan.robot import Joint, Robot, Row
from bodyplan.robot.rows import row_matrices
from legs_equations import FRAMES, PAGE, PRINTED, correct, leg, page, wrong
from robot_cases import STEP, body_twist, frame_matrices

QUARTER = sp.pi / 2


@pytest.mark.parametrize("number", FRAMES)
def test_correct_equations_are_the_motion_of_the_frames(number: int) -> None:
    """Against products of 4x4 matrices with complex steps: neither formulas nor kernels."""
    robot, (before, after, joint) = leg(), FRAMES[number]
    q = np.random.default_rng(number).uniform(-1.5, 1.5, robot.n)
    values = dict(zip(robot.symbolic().q, q, strict=True))
    D, E = correct(number)
    frames = frame_matrices(robot, q)
    start = np.eye(4) if before == "BY" else frames[before].real
    T = np.linalg.inv(start) @ frames[after].real
    R, p = T[:3, :3], T[:3, 3]
    skew = np.array([[0, -p[2], p[1]], [p[2], 0, -p[0]], [-p[1], p[0], 0]])
    want = np.block([[R.T, -R.T @ skew], [np.zeros((3, 3)), R.T]])
    assert np.abs(np.array(D.subs(values), dtype=float) - want).max() < 1e-15
    if E is not None:
        moved = frame_matrices(robot, q + 1j * STEP * np.eye(robot.n)[robot.joint_index(f"theta_{joint}")])
        twist = body_twist(frames[after].real, moved[after].imag / STEP)
        assert np.abs(np.array(E.subs(values), dtype=float)[:, 0] - twist).max() < 1e-15


def test_equation_10_is_right() -> None:
    assert wrong(10) == (set(), set())


def test_equation_11_lacks_the_turn_and_the_coxa() -> None:
    """Rows 2, 3, 5, 6 of the matrix, where y and z are turned by 90 deg; v_z and omega_y, omega_z of the rate."""
    rows = {2: (1, 2, 3, 4, 5), 3: (1, 2, 3, 6), 5: (4, 5, 6), 6: (4, 5, 6)}
    assert wrong(11) == ({(i, j) for i, columns in rows.items() for j in columns}, {3, 5, 6})
    t1, bar = sp.symbols("theta_1 thetabar_1")
    printed = PRINTED[11][0].subs(bar, t1)
    assert printed == sp.Matrix(leg().symbolic().D(Row(theta=Joint("theta_1"))))


def test_equation_12_is_another_row() -> None:
    """It is (theta_2 - 90 deg, d_2, a_2, 0); only the coefficient of the rate follows from Table 1."""
    other = Row(theta=Joint("theta_2", offset=-np.pi / 2), d=Joint("d_2"), a=Joint("a_2"))
    assert PRINTED[12][0] == sp.Matrix(leg().symbolic().D(other))
    entries, rate = wrong(12)
    assert rate == set()
    # all entries in which theta_2 or d_2 stands: four cosines and sines twice, the columns of d_2 and a_2
    turned = {(i, j) for i in (1, 2) for j in (1, 2)}
    assert entries == turned | {(i + 3, j + 3) for i, j in turned} | {(i, j) for i in (1, 2, 3) for j in (4, 5)}


def test_equation_13_exchanges_sine_and_cosine() -> None:
    assert wrong(13) == ({(3, 4), (3, 5)}, set())
    a3, t3 = sp.symbols("a_3 theta_3")
    assert list(correct(13)[0][2, 3:]) == [a3 * sp.sin(t3), -a3 * sp.cos(t3), 0]


def test_printed_equations_as_numbers() -> None:
    """The same verdict from the numeric model at one place, independent of any symbols of bodyplan."""
    x = {f"{letter}_{i}": 0.2 + 0.1 * i for letter in ("theta", "a", "d") for i in range(4)} | {"thetabar_1": 0.3}
    numbers = {n: np.array(D.subs(x), dtype=float) for n, (D, _) in PRINTED.items()}
    table = {
        10: (0.2, 0.2, 0.2, 0.0),
        11: (0.3, 0.0, 0.3, np.pi / 2),
        12: (0.4, 0.0, 0.4, 0.0),
        13: (0.5, 0.0, 0.5, 0.0),
    }
    error = {n: np.abs(numbers[n] - row_matrices(*row)[0]).max() for n, row in table.items()}
    assert error[10] < 1e-15
    assert min(error[11], error[12], error[13]) > 0.1
    assert np.abs(numbers[12] - row_matrices(0.4 - np.pi / 2, 0.4, 0.4, 0.0)[0]).max() < 1e-15


def test_printed_order_of_the_product() -> None:
    """P = D_0 ... D_n-1, as the paper has it, is off by tenths; reversed it is the model's P."""
    robot = leg()
    q = np.random.default_rng(0).uniform(-1, 1, robot.n)
    D = [robot.element_matrices(q, frame)[0] for frame in robot.frames[1:]]
    P, _ = robot.velocity_model(q)
    assert np.abs(np.linalg.multi_dot(D[::-1]) - P).max() < 1e-15
    assert np.abs(np.linalg.multi_dot(D) - P).max() > 0.4


def test_z_of_the_sole_points_back_up_the_shank() -> None:
    """Table 1 at theta_4 = theta_5 = 0: the sole's z is minus the shank's x, so d_6 < 0 puts the contact below."""
    model = leg().symbolic()
    zero = {model.symbols[f"theta_{i}"]: 0 for i in range(7)} | {model.symbols["d_0"]: 0}
    sole, ankle = (model.forward(frame).subs(zero) for frame in ("SE", "AE"))
    assert sole[:3, 2] == -ankle[:3, 0]
    assert model.robot.joints[-2:] == ("theta_6", "d_6")


def test_the_page_is_up_to_date() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert text == page(), "run: python tests/legs_equations.py"
    assert len(re.findall(r"\\boxed", text)) == sum(len(part) for n in FRAMES for part in wrong(n))
    exec(re.findall(r"```python\n(.*?)```", text, flags=re.S)[0], {"print": lambda *_: None})


def test_a_letter_for_every_length_needs_no_new_notation() -> None:
    """A joint per letter is how to get formulas in letters; their numbers are those of a robot with numbers."""
    letters = leg().symbolic()
    numbers = {"a_0": 0.2, "a_1": 0.06, "a_2": 0.24, "a_3": 0.24, "d_0": 0.0, "d_6": -0.02}
    rows = [
        Row(theta=Joint("theta_0"), a=0.2),
        Row(theta=Joint("theta_1"), a=0.06, epsilon=np.pi / 2),
        Row(theta=Joint("theta_2"), a=0.24),
        Row(theta=Joint("theta_3"), a=0.24),
    ]
    plain = Robot.from_rows({"leg": rows})
    q = np.random.default_rng(1).uniform(-1, 1, 4)
    values = numbers | dict(zip(plain.joints, q, strict=True))
    J = letters.jacobian("AE").subs({sp.Symbol(name): value for name, value in values.items()})
    columns = [letters.robot.joint_index(name) for name in plain.joints]
    assert np.abs(np.array(J[:, columns], dtype=float) - plain.jacobian(q, "leg")).max() < 1e-15
