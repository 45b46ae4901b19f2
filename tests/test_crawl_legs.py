"""Feet of any chain of rows: joints that put them in place, and their exact rates and accelerations."""

import numpy as np
import pytest

import bodyplan as bp
from bodyplan.errors import InputError
from bodyplan.gaits.crawl import leg_kernel
from bodyplan.gaits.crawl.legs import Legs, bent, cross, direction, stance_guess
from bodyplan.robot import Arc, Joint, Row
from crawl_cases import random_legs
from robot_cases import frame_matrices

SEEDS = range(40)
STEP = 1e-30


def legs_of(seed):
    """Random legs that are no special case, with coordinates at which none is near to changing sides."""
    rng = np.random.default_rng(seed)
    while True:
        robot = random_legs(rng)
        try:
            legs = Legs.of(robot)
        except InputError as error:
            assert "in all directions" in str(error)
            continue
        for _ in range(20):
            q = rng.uniform(-1.0, 1.0, robot.n)
            columns = [leg.square(leg.jacobian(robot.forward(q[None]).array)[3])[0] for leg in legs.legs]
            if min(np.linalg.svd(c, compute_uv=False)[-1] for c in columns) > 0.03:
                return legs, q, rng


def feet(robot, q):
    """Centres (m, 3) of the balls seen from the base, complex where q is, from products of elementary matrices."""
    frames = frame_matrices(robot, q)
    return np.array([(frames[c.frame] @ np.array([*c.start, 1.0]))[:3] for c in robot.contacts])


def foot_jacobian(robot, q):
    """d feet / d q, (m, 3, n), by complex steps."""
    return np.stack([feet(robot, q + 1j * STEP * axis).imag / STEP for axis in np.eye(robot.n)], axis=-1)


def moves(legs, j, q):
    """Place (3,) of foot ``j`` and its Jacobian (3, 3), by the kernels."""
    frames, _ = leg_kernel.room(legs.tables)
    foot, square = np.empty(3), np.empty((3, 3))
    leg_kernel.chain(legs.tables, j, q, frames)
    leg_kernel.moves(legs.tables, j, frames, foot, square)
    return foot, square


@pytest.mark.parametrize("seed", SEEDS)
def test_feet_and_their_derivatives(seed):
    legs, q, _ = legs_of(seed)
    robot = legs.robot
    assert np.abs(legs.feet(q[None])[0] - feet(robot, q).real).max() < 1e-13
    jacobian = foot_jacobian(robot, q)
    poses = robot.forward(q[None]).array
    for j, leg in enumerate(legs.legs):
        *_, columns = leg.jacobian(poses)
        assert np.abs(leg.square(columns)[0] - jacobian[j][:, leg.columns]).max() < 1e-13
        foot, square = moves(legs, j, q)
        assert np.abs(foot - feet(robot, q).real[j]).max() < 1e-13
        assert np.abs(square - jacobian[j][:, leg.columns]).max() < 1e-13


@pytest.mark.parametrize("seed", SEEDS)
def test_placing_finds_the_feet_of_known_joints(seed):
    legs, q, rng = legs_of(seed)
    robot = legs.robot
    near = np.array([q + robot.actuated * rng.uniform(-0.1, 0.1, robot.n) for _ in range(8)])
    targets = np.array([feet(robot, one).real for one in near])
    found, placed = legs.place(targets, q)
    made = np.array([feet(robot, one).real for one in found])
    assert np.abs(made - targets)[placed].max() < 1e-12
    sides = np.array([[bent(leg.square(leg.jacobian(robot.forward(one[None]).array)[3]))[0] for leg in legs.legs]
                      for one in (q, *near, *found)])  # fmt: skip
    # reached, whenever the known joints are bent to the same side as the guess; and nothing else is called reached
    assert placed[sides[1:9] == sides[0]].all()
    assert (sides[9:] == sides[0])[placed].all()
    assert np.array_equal(found[:, ~robot.actuated], np.repeat(q[None, ~robot.actuated], 8, axis=0))


@pytest.mark.parametrize("seed", SEEDS)
def test_rates_and_accelerations(seed):
    """Complex-step Jacobian J: J qd is the foot's velocity, J qdd + dJ/dt qd its acceleration."""
    legs, q, rng = legs_of(seed)
    robot = legs.robot
    velocity, acceleration = rng.normal(size=(2, 1, len(legs), 3))
    qd, qdd = legs.rates(q[None], velocity, acceleration)
    jacobian = foot_jacobian(robot, q)
    assert np.abs(jacobian @ qd[0] - velocity[0]).max() < 1e-11
    h = 1e-5 / max(1.0, np.abs(qd).max())
    ahead, behind = (foot_jacobian(robot, q + s * h * qd[0]) for s in (1, -1))
    drift = (ahead - behind) @ qd[0] / (2 * h)
    size = 1.0 + np.abs(drift).max()
    assert np.abs(jacobian @ qdd[0] + drift - acceleration[0]).max() < 1e-7 * size
    frames, _ = leg_kernel.room(legs.tables)
    for j in range(len(legs)):
        leg_kernel.chain(legs.tables, j, q, frames)
        found = np.empty(3)
        leg_kernel.drift(legs.tables, j, qd[0], frames, found)
        assert np.abs(found - drift[j]).max() < 1e-7 * size
    assert not qd[:, ~robot.actuated].any() and not qdd[:, ~robot.actuated].any()


def test_small_formulas():
    rng = np.random.default_rng(0)
    a, b = rng.normal(size=(2, 50, 3))
    assert np.abs(cross(a, b) - np.cross(a, b)).max() < 1e-15
    quaternion = rng.normal(size=(50, 4))
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    for upright, axis in ((True, 2), (False, 0)):
        assert np.abs(direction(quaternion, upright) - bp.spatial.rotate(quaternion, np.eye(3)[axis])).max() < 1e-15


def test_solved_is_that_of_numpy_or_of_least_square():
    rng = np.random.default_rng(1)
    square, wanted = rng.normal(size=(100, 3, 3)), rng.normal(size=(100, 3))
    square[::10, :, 2] = square[::10, :, 0] + 2.0 * square[::10, :, 1]
    room = np.empty((6, 3))
    x, sides = np.empty((100, 3)), np.array([leg_kernel.side_of(one) for one in square])
    for one, b, out in zip(square, wanted, x, strict=True):
        leg_kernel.solve(one, b, out, room)
    regular = sides != 0
    assert np.array_equal(np.flatnonzero(~regular), np.arange(0, 100, 10))
    assert np.abs(x[regular] - np.linalg.solve(square[regular], wanted[regular, :, None])[..., 0]).max() < 1e-10
    least = np.array(
        [np.linalg.lstsq(a, b, rcond=1e-9)[0] for a, b in zip(square[~regular], wanted[~regular], strict=True)]
    )
    assert np.abs(x[~regular] - least).max() < 1e-10
    assert np.array_equal(sides[regular], np.sign(np.linalg.det(square[regular])))
    assert np.array_equal(bent(square), sides)


def test_least_is_the_pseudoinverse():
    """Of any rank, with directions just inside and outside of what counts, and of any size."""
    rng = np.random.default_rng(2)
    room, x = np.empty((6, 3)), np.empty(3)
    for sizes in (
        (1, 1, 1),
        (1, 0.5, 1e-3),
        (1, 1, 0),
        (1, 1e-5, 0),
        (1, 3e-6, 1e-7),
        (1, 1e-8, 1e-9),
        (1, 0, 0),
        (0, 0, 0),
    ):
        for scale in (1.0, 1e-4, 1e5):
            (u, _, v), b = np.linalg.svd(rng.normal(size=(3, 3))), rng.normal(size=3)
            square = scale * (u * np.array(sizes, float)) @ v
            leg_kernel.least(square, b, x, room)
            want = np.linalg.pinv(square, leg_kernel.SINGULAR) @ b
            kept = [size for size in sizes if size > leg_kernel.SINGULAR]
            assert np.abs(x - want).max() <= 1e-14 * np.abs(want).max() / min(kept, default=1.0) + 1e-300
    columns = np.array([[1.0, 2.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 3.0]])  # two alike, to the digit
    leg_kernel.least(columns, np.array([5.0, 7.0, 6.0]), x, room)
    assert np.abs(x - [1.0, 2.0, 2.0]).max() < 1e-15


# --- SILO4, whose legs have a closed form ---


def silo4_by_hand(targets, legs):
    """Shoulder, hip and knee (..., 3) with the knee up, and which targets (...,) in the base are in reach."""
    away = targets - legs.roots
    bearing = np.arctan2(legs.roots[:, 1], legs.roots[:, 0])
    turn = np.arctan2(away[..., 1], away[..., 0]) - bearing
    shoulder = np.remainder(turn + np.pi, 2 * np.pi) - np.pi
    out, up = np.hypot(away[..., 0], away[..., 1]) - 0.06, away[..., 2]
    cosine = (out**2 + up**2 - 2 * 0.24**2) / (2 * 0.24**2)
    knee = -np.arccos(np.clip(cosine, -1, 1))
    hip = np.arctan2(up, out) - np.arctan2(0.24 * np.sin(knee), 0.24 + 0.24 * np.cos(knee))
    return np.stack([shoulder, hip, knee], axis=-1), np.hypot(out, up) < 0.48


@pytest.mark.parametrize("spread", [0.1, 0.2, 0.3])
def test_a_reachable_foot_is_placed_with_its_knee_up_wherever_it_is(spread):
    robot = bp.silo4()
    legs = Legs.of(robot)
    planner = bp.Crawl().planner(robot, bp.Plane())
    rng = np.random.default_rng(2)
    nominal = planner.offsets - [0.0, 0.0, planner.height]
    targets = nominal + rng.uniform(-spread, spread, (3000, 4, 3))
    wanted, near = silo4_by_hand(targets, legs)
    limits = robot.limits.reshape(4, 3, 2)
    inside = near & np.all((wanted > limits[..., 0]) & (wanted < limits[..., 1]), axis=-1)
    q, placed = legs.place(targets, planner.guess)
    assert inside.mean() > 0.5
    assert placed[inside].all()
    assert np.abs(q.reshape(-1, 4, 3) - wanted)[inside].max() < 1e-9
    assert not placed[~near].any()


def test_what_a_sample_gets_does_not_depend_on_the_others():
    robot = bp.silo4()
    legs, planner = Legs.of(robot), bp.Crawl().planner(robot, bp.Plane())
    rng = np.random.default_rng(3)
    nominal = planner.offsets - [0.0, 0.0, planner.height]
    targets = nominal + rng.uniform(-0.2, 0.2, (60, 4, 3))
    targets[::7] += [0.5, 0.0, 0.0]  # some far beyond reach
    q, placed = legs.place(targets, planner.guess)
    for k in range(len(targets)):
        alone, one = legs.place(targets[k : k + 1], planner.guess)
        assert np.array_equal(one[0], placed[k])
        assert np.abs(alone[0] - q[k]).max() < 1e-12


def test_beyond_reach_and_a_straight_knee_are_not_in_place():
    legs = Legs.of(bp.silo4())
    planner = bp.Crawl().planner(bp.silo4(), bp.Plane())
    nominal = planner.offsets - [0.0, 0.0, planner.height]
    way = np.array([1.0, 1.0, 0.0]) / np.sqrt(2)
    out = np.repeat(nominal[None], 3, axis=0)
    for k, length in enumerate((0.5399, 0.54, 0.55)):  # fl stretched out level
        out[k, 0] = legs.roots[0] + length * way
    q, placed = legs.place(out, planner.guess)
    assert placed[0].all() and not placed[1:, 0].any() and placed[:, 1:].all()
    assert np.isfinite(q).all()
    # rates are finite there, too, of least square
    qd, qdd = legs.rates(np.zeros((1, 12)), np.ones((1, 4, 3)), np.zeros((1, 4, 3)))
    assert np.isfinite(qd).all() and np.isfinite(qdd).all()


def test_slides_and_their_ranges():
    """A leg of three slides puts its foot anywhere in its box; lengths without limits have a first guess, too."""
    quarter = np.pi / 2
    for limits in ((-0.5, 0.5), None):
        rows = {
            f"leg{k}": [
                Row(theta=k * quarter, a=0.4, epsilon=quarter),
                Row(d=Joint(f"{k}.x", limits=limits), epsilon=-quarter),
                Row(theta=quarter, d=Joint(f"{k}.z", limits=limits), epsilon=quarter),
                Row(d=Joint(f"{k}.y", limits=limits)),
            ]
            for k in range(4)
        }
        contacts = [bp.Contact(f"foot{k}", f"leg{k}.4", "sphere", 0.01) for k in range(4)]
        legs = Legs.of(bp.Robot.from_rows(rows, contacts=contacts))
        targets = legs.feet(np.zeros((1, 12)))[0] + [0.1, -0.2, -0.3]
        q, placed = legs.place(targets[None], stance_guess(legs, targets))
        assert placed.all()
        assert np.abs(legs.feet(q)[0] - targets).max() < 1e-13


def test_roots_are_where_the_first_actuated_joints_are():
    for robot in (bp.silo4(), bp.silo4(passive=True)):
        for leg, root in zip(("fl", "fr", "hl", "hr"), Legs.of(robot).roots, strict=True):
            assert np.abs(root - robot.forward(np.zeros(robot.n))[f"{leg}.shoulder"][:3]).max() < 1e-15
    assert Legs.of(bp.silo4()).legs[0].length == pytest.approx(0.54)
    assert Legs.of(bp.silo4(passive=True)).legs[0].length == pytest.approx(0.56)


# --- robots that are no walkers ---


def three(rows, contact=None, **options):
    made = {f"leg{k}": rows(k) for k in range(3)}
    balls = [bp.Contact(f"foot{k}", f"leg{k}.{len(made[f'leg{k}'])}", "sphere", 0.01) for k in range(3)]
    return bp.Robot.from_rows(made, contacts=balls if contact is None else contact, **options)


def leg_rows(k, turns=(1.5, 0.0, 0.0), **joint):
    mount = Row(theta=2.0 * k, a=0.2)
    return [mount, *(Row(theta=Joint(f"{k}.{i}", **joint), a=0.2, epsilon=e) for i, e in enumerate(turns))]


@pytest.mark.parametrize(
    ("robot", "says"),
    [
        (lambda: bp.snake(8, 0.1), "a leg is a chain of rows|ball contact|actuated joints"),
        (
            lambda: bp.Robot.from_table("examples/silo4_legs.csv"),
            r"one ball contact on its last frame, has 0.*Contact\(",
        ),
        (lambda: three(leg_rows, contact=[]), "leg0.*one ball contact on its last frame, has 0"),
        (lambda: three(lambda k: leg_rows(k, (1.5, 0.0))), "leg0.*three actuated joints, has 2"),
        (lambda: three(lambda k: leg_rows(k, (1.5, 0.0, 0.0, 0.0))), "three actuated joints, has 4"),
        (lambda: three(lambda k: leg_rows(k, (1.5, 0.0, 0.0), actuated=False)), "three actuated joints, has 0"),
        (lambda: three(lambda k: leg_rows(k, (0.0, 0.0, 0.0))), "leg0.*cannot move its foot in all directions"),
        (lambda: three(lambda k: leg_rows(0)), "joint '0.0'.*two legs at once"),
        (lambda: three(lambda k: [*leg_rows(k), Arc(0.1, pitch=0.1)]), "a leg is a chain of rows"),
    ],
)
def test_refusals(robot, says):
    with pytest.raises(InputError, match=says):
        bp.plan(robot(), bp.Crawl(), bp.Plane(), bp.times(0, 5, dt=0.1))


def test_two_legs_are_refused():
    robot = bp.walker({"left": (0.0, 0.1, 1.5), "right": (0.0, -0.1, -1.5)}, body=(0.2, 0.2))
    with pytest.raises(InputError, match="three legs at least, 'walker' has 2"):
        bp.plan(robot, bp.Crawl(), bp.Plane(), bp.times(0, 5, dt=0.1))
