"""Resolved rates against direct linear algebra: pseudo-inverse, metric, projector, damping, conflicts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import null_space

import bodyplan as bp
from bodyplan.errors import InputError, SolveError, UnknownNameError
from bodyplan.robot.walkers import LINKS
from solve_cases import LEGS, Case, crouching, random_base, random_case

resolve, Metric = bp.solve.resolve, bp.solve.Metric
STILL = {f"{leg}.foot.v": 0.0 for leg in LEGS}
CRAWL = [*STILL, "body.x", "body.y", "body.yaw"]


def standing(robot: bp.Robot, q: Any = None, known: list[str] = CRAWL, height: float = 0.2) -> Any:
    base = [0.0, 0.0, height, 1.0, 0.0, 0.0, 0.0]
    return bp.solve.partition(robot, crouching(robot) if q is None else q, base, known=known, axes="world")


def consistent(case: Case, rng: np.random.Generator) -> tuple[Any, np.ndarray]:
    """A partition and rates Y of some motion of the robot, so that there is a solution."""
    body, qd = rng.normal(size=6), rng.normal(size=case.robot.n)
    values = dict(zip(case.want.feet, case.want.P @ body + case.want.Q @ qd, strict=True))
    values |= dict(zip(case.want.body, body, strict=True)) | dict(zip(case.robot.joints, qd, strict=True))
    part = case.partition()
    return part, np.array([values[name] for name in part.known])


# --- the formulas -------------------------------------------------------------------------------------------


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_pseudo_inverse_and_null_space(seed: int) -> None:
    case, rng = random_case(seed), np.random.default_rng(seed)
    part, Y = consistent(case, rng)
    G, H, X, _ = case.want.split(case.known)
    rho, d = rng.normal(size=len(X)), rng.normal()
    got = resolve(part, Y, rho=rho, d=d)
    pinv = np.linalg.pinv(G, rcond=1e-12)
    want = pinv @ H @ Y + d * (np.eye(len(X)) - pinv @ G) @ rho
    sizes = np.linalg.svd(G, compute_uv=False)
    sizes = sizes[sizes > 1e-12 * sizes[0]]
    condition = sizes[0] / sizes[-1]
    assert got.status == "ok"
    assert np.abs(got.X - want).max() < 1e-13 * condition**2 * (1.0 + np.abs(want).max())
    assert got.rank == len(sizes)
    assert got.condition == pytest.approx(condition, rel=1e-6)
    assert got.residual < 1e-13 * condition * (1.0 + np.abs(G).max() * np.abs(want).max())
    assert np.abs(got.residuals - (G @ got.X - H @ Y)).max() < 1e-11 * (1.0 + np.abs(want).max())


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_the_metric_is_minimal(seed: int) -> None:
    """X minimises (X - r) W (X - r) with G X = H Y: it fulfils the equations, and along all that they leave free, by
    SciPy's basis of it, the cost has no slope."""
    case, rng = random_case(seed), np.random.default_rng(seed)
    part, Y = consistent(case, rng)
    G, H, X, _ = case.want.split(case.known)
    A = rng.normal(size=(len(X), len(X)))
    W, r = A @ A.T + 0.5 * np.eye(len(X)), 0.7 * rng.normal(size=len(X))
    N = null_space(G, rcond=1e-12)
    for metric, matrix in ((W, W), (np.diag(W), np.diag(np.diag(W)))):
        got = resolve(part, Y, metric=metric, rho=r / 0.7, d=0.7, damping=0)
        assert got.status == "ok"
        size = 1.0 + np.abs(got.X).max()
        assert np.abs(G @ got.X - H @ Y).max() < 1e-11 * size
        assert np.abs(N.T @ matrix @ (got.X - r)).max(initial=0.0) < 1e-10 * size * np.abs(matrix).max()


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_projector_identities(seed: int, weighted: bool) -> None:
    case, rng = random_case(seed), np.random.default_rng(seed)
    part = case.partition()
    x = len(part.unknown)
    metric = np.exp(rng.normal(size=x)) if weighted else None
    W = np.diag(np.ones(x) if metric is None else metric)

    def N(rho: np.ndarray) -> Any:
        return resolve(part, np.zeros(len(part.known)), metric=metric, rho=rho, damping=0).X

    a, b = rng.normal(size=(2, x))
    Na, Nb = N(a), N(b)
    scale = np.abs(a).max()
    assert np.abs(part.G @ Na).max() < 1e-11 * scale
    assert np.abs(N(Na) - Na).max() < 1e-11 * scale
    # it is symmetric in the metric, not in the plain product
    assert abs(Na @ W @ b - a @ W @ Nb) < 1e-9 * (np.abs(a @ W @ Nb) + 1.0)
    # what the inverse gives has no part in the null space
    _, Y = consistent(case, rng)
    assert np.abs(N(resolve(part, Y, metric=metric, damping=0).X)).max() < 1e-8


def test_feet_that_cost_nothing_are_the_limit_of_feet_that_cost_little() -> None:
    rng = np.random.default_rng(8)
    robot = bp.silo4(passive=True)
    part = standing(robot, crouching(robot, rng))
    Y = STILL | {"body.x": 0.05, "body.y": 0.01, "body.yaw": 0.02}
    gradient = rng.normal(size=len(part.unknown))
    exact = resolve(part, Y, metric=Metric(), gradient=gradient * 1e-2)
    assert exact.residual < 1e-15
    assert exact.rank == 24
    # a gradient on a foot costs dearly where the foot is almost free: only that of the others has a limit
    on = np.array([".foot." not in name for name in part.unknown])
    exact = resolve(part, Y, metric=Metric(), gradient=on * gradient * 1e-2)
    errors = []
    for feet in (1e-3, 1e-5, 1e-7):
        near = resolve(part, Y, metric=Metric(feet=feet), gradient=on * gradient * 1e-2)
        errors.append(np.abs(near.X - exact.X).max())
    assert errors[1] < 0.02 * errors[0]
    assert errors[2] < 0.02 * errors[1]


def test_a_gradient_on_a_foot_is_handed_to_what_moves_the_foot() -> None:
    rng = np.random.default_rng(9)
    robot = bp.silo4(passive=True)
    part = standing(robot, crouching(robot, rng))
    gradient = rng.normal(size=len(part.unknown))
    got = resolve(part, np.zeros(15), metric=Metric(), gradient=gradient)
    # by hand: x_feet = F x_others, so the gradient by the others is g_others + F^T g_feet
    foot = np.array([".foot." in name for name in part.unknown])
    rows = [part.rows.index(name) for name in part.unknown if ".foot." in name]
    others = np.setdiff1d(np.arange(24), rows)
    F, A = part.G[rows][:, ~foot], part.G[others][:, ~foot]
    w = Metric().vector(part)[~foot]
    g = gradient[~foot] + F.T @ gradient[foot]
    root = np.sqrt(w)
    V = np.linalg.svd(A / root)[2][12:]
    want = V.T @ (V @ (g / root)) / root
    assert np.abs(got.X[~foot] - want).max() < 1e-10 * np.abs(want).max()
    assert np.abs(got.X[foot] - F @ want).max() < 1e-10 * np.abs(want).max()


def test_the_gradient_never_lowers_what_it_is_of() -> None:
    rng = np.random.default_rng(10)
    robot = bp.silo4(passive=True)
    part = standing(robot, crouching(robot, rng))
    gradients = rng.normal(size=(200, len(part.unknown)))
    gradients[:, [".foot." in name for name in part.unknown]] = 0.0
    up = resolve(part, np.zeros(15), metric=Metric(), gradient=gradients)
    assert np.all(np.sum(up.X * gradients, axis=-1) > 0.0)
    # the bare gradient through the oblique projector may: along where that projector's symmetric part is negative
    some = np.array([".foot." not in name for name in part.unknown])
    projector = resolve(part, np.zeros(15), metric=Metric(), rho=np.eye(len(some))[some]).X.T[some]
    slope, worst = np.linalg.eigh(0.5 * (projector + projector.T))
    assert slope[0] < -1e-3
    bad = np.zeros(len(some))
    bad[some] = worst[:, 0]
    assert resolve(part, np.zeros(15), metric=Metric(), rho=bad).X @ bad == pytest.approx(slope[0])
    assert resolve(part, np.zeros(15), metric=Metric(), gradient=bad).X @ bad > 0.0


# --- the metric ---------------------------------------------------------------------------------------------


def scaled(s: float) -> bp.Robot:
    """SILO4 with passive feet and lengths in units of 1/s m."""
    links = s * np.array(LINKS)
    return bp.silo4(body=0.31 * s, links=links, passive=True, sole=0.02 * s, foot_radius=0.01 * s)


@pytest.mark.parametrize("method", ["min_norm", "weighted"])
def test_millimetres_change_the_plain_pseudo_inverse_but_not_the_metric(method: str) -> None:
    q = crouching(scaled(1.0), np.random.default_rng(11))
    m, mm = (
        resolve(
            standing(scaled(s), q, height=0.2 * s),
            STILL | {"body.x": 0.03 * s, "body.y": 0.0, "body.yaw": 0.0},
            method=method,
        )
        for s in (1.0, 1000.0)
    )
    assert m.status == mm.status == "ok"
    rise, rise_mm = float(m["body.z"]), float(mm["body.z"]) / 1000.0
    if method == "min_norm":
        assert abs(rise / rise_mm) > 1000.0
        assert np.abs(m.qd - mm.qd).max() > 1e-3
    else:
        assert rise_mm == pytest.approx(rise, rel=1e-9)
        assert np.abs(m.qd - mm.qd).max() < 1e-12
        assert mm.condition == pytest.approx(float(m.condition), rel=1e-9)


def test_passive_joints_are_no_motors() -> None:
    robot = bp.silo4(passive=True)
    part = standing(robot, crouching(robot, np.random.default_rng(12)))
    Y = STILL | {"body.x": 0.03, "body.y": 0.0, "body.yaw": 0.0}
    plain, ours = resolve(part, Y), resolve(part, Y, method="weighted")
    passive = ~robot.actuated
    assert np.abs(plain.qd[passive]).max() > 0.2 * np.abs(plain.qd[~passive]).max()
    assert np.abs(ours.qd[passive]).max() < 1e-4 * np.abs(ours.qd[~passive]).max()
    # a foot flat on the ground leaves passive joints no choice: they follow, whatever they cost
    flat = [f"{leg}.foot" for leg in LEGS]
    known = standing(robot, part.model.q, [*flat, "body"])
    still = dict.fromkeys(flat, 0.0) | {"body": [0.02, 0.0, 0.0, 0.0, 0.0, 0.0]}
    dear, cheap = (resolve(known, still, metric=Metric(passive=p)) for p in (1e4, 1e-4))
    assert dear.status == "ok"
    assert np.abs(dear.qd[passive]).max() > 0.01
    assert np.abs(dear.qd - cheap.qd).max() < 1e-9


def test_weights_and_units_of_the_metric() -> None:
    robot = bp.silo4(passive=True)
    part = standing(robot)
    weights = dict(zip(part.unknown, Metric(length=0.5, body=3.0).vector(part), strict=True))
    assert weights["fl.knee"] == 0.25
    assert weights["fl.sole"] == 0.25 * 1e4
    assert weights["body.z"] == 3.0
    assert weights["body.roll"] == 0.75
    assert weights["hr.foot.wx"] == 0.0
    # mean of the legs' lengths: mount 155 sqrt 2, links 60, 240, 240, sole 20 mm
    assert part.model.leg_length == pytest.approx(0.155 * np.sqrt(2) + 0.56)
    own = Metric(weights={"fl.knee": 1e9})
    rates = resolve(part, STILL | {"body.x": 0.03, "body.y": 0.0, "body.yaw": 0.0}, metric=own)
    assert abs(rates["fl.knee"]) < 1e-6
    assert abs(rates["fr.knee"]) > 1e-2


# --- singularities and conflicts ----------------------------------------------------------------------------


def bent(knee: float) -> Any:
    """SILO4 with the knee of fl almost straight, its foot commanded to move along the leg and aside."""
    robot = bp.silo4()
    q = crouching(robot)
    q[robot.joint_index("fl.hip")], q[robot.joint_index("fl.knee")] = -0.5, knee
    part = standing(robot, q, [*(f"{leg}.foot.v" for leg in LEGS), "body"])
    foot, hip = (robot.forward(q)[f"fl.{name}"][:3] for name in ("foot", "hip"))
    along = (foot - hip) / np.linalg.norm(foot - hip)
    aside = np.cross([0.0, 0.0, 1.0], along)
    return part, along, aside / np.linalg.norm(aside)


def command(fl: np.ndarray) -> dict[str, Any]:
    return {"fl.foot.v": fl, "body": 0.0} | {f"{leg}.foot.v": [0.01, 0.02, -0.01] for leg in LEGS[1:]}


def test_damped_only_near_a_singularity() -> None:
    for knee in (-2.0, -0.5, -0.01, -1e-4):
        part, along, _ = bent(knee)
        rates = resolve(part, command(0.05 * along))
        assert (rates.status, bool(rates.damped)) == ("ok", False)
        assert np.array_equal(rates.X, resolve(part, command(0.05 * along), damping=0).X)
        assert rates.residual < 1e-9
    part, along, aside = bent(-1e-7)
    rates = resolve(part, command(0.05 * along))
    assert (rates.status, bool(rates.damped)) == ("damped", True)
    assert "near a singularity" in rates.reason
    # rates no larger than the command over near, of a largest singular value below 3; only the foot itself slips
    assert np.linalg.norm(rates.X) < np.linalg.norm(0.06) / 1e-6
    assert 0.01 < np.abs(rates.residuals[:3]).max() < 0.06
    assert np.abs(rates.residuals[6:]).max() < 1e-9
    # what the leg can still do it does, damped or not
    fine = resolve(part, command(0.05 * aside))
    assert (fine.status, bool(fine.damped)) == ("ok", True)
    assert fine.residual < 1e-9
    with pytest.raises(SolveError, match="damped"):
        rates.raise_if_failed()


def test_damping_begins_without_a_jump() -> None:
    part, along, _ = bent(-0.02)
    exact = resolve(part, command(0.05 * along), method="weighted")
    share = 1.0 / float(exact.condition)
    before = resolve(part, command(0.05 * along), method="weighted", near=0.999999 * share)
    after = resolve(part, command(0.05 * along), method="weighted", near=1.000001 * share)
    assert (bool(before.damped), bool(after.damped)) == (False, True)
    assert np.abs(after.X - before.X).max() < 1e-5 * np.abs(before.X).max()
    # gains fall from 1/s to s/e^2 as the threshold e rises
    half = resolve(part, command(0.05 * along), method="weighted", near=2.0 * share)
    assert np.abs(half.qd[:3]).max() < 0.3 * np.abs(exact.qd[:3]).max()


def test_damping_in_all_directions_makes_stance_feet_slip_and_is_told() -> None:
    robot = bp.silo4()
    part = standing(robot)
    Y = STILL | {"body.x": 0.03, "body.y": 0.0, "body.yaw": 0.0}
    rates = resolve(part, Y, damping=0.01)
    assert (rates.status, bool(rates.damped)) == ("damped", True)
    assert rates.residual > 1e-6
    # it is the formula of damped least squares
    b = part.H @ part.values(Y)
    want = part.G.T @ np.linalg.solve(part.G @ part.G.T + 1e-4 * np.eye(24), b)
    assert np.abs(rates.X - want).max() < 1e-12
    # and the null space stays the true one: what is free moves no foot
    rho = np.random.default_rng(13).normal(size=len(part.unknown))
    moved = resolve(part, Y, damping=0.01, rho=rho)
    assert np.abs(part.G @ (moved.X - rates.X)).max() < 1e-13
    assert np.abs(moved.X - rates.X).max() > 0.1


def test_at_a_singularity_the_lost_direction_is_a_conflict() -> None:
    part, along, aside = bent(0.0)
    lost = resolve(part, command(0.05 * along))
    assert (lost.status, int(lost.rank)) == ("conflict", 23)
    assert np.all(np.isfinite(lost.X))
    assert "fl.foot.v" in lost.reason
    assert "hr" not in lost.reason
    assert resolve(part, command(0.05 * aside)).status == "ok"


def test_a_conflict_names_its_equations_and_nothing_else() -> None:
    robot = bp.silo4()
    known = [*(f"{leg}.foot.v" for leg in LEGS), "body", "fl.shoulder", "fl.hip", "fl.knee"]
    part = standing(robot, known=known)
    Y = STILL | {"body": [0.01, 0.0, 0.0, 0.0, 0.0, 0.0], "fl.shoulder": 0.0, "fl.hip": 0.0, "fl.knee": 0.0}
    rates = resolve(part, Y)
    assert rates.status == "conflict"
    assert not rates.ok
    # nothing moves the foot but the body, along x
    assert rates.reason == (
        "the equation of fl.foot.vx cannot hold: the known fl.foot.vx, body.vx, body.wy, body.wz, fl.shoulder, fl.hip, "
        "fl.knee leave 0.01 m/s where it must be 0"
    )
    with pytest.raises(SolveError, match=r"conflict: the equation of fl\.foot\.vx") as failure:
        rates.raise_if_failed()
    assert failure.value.index is None
    # X is the nearest in least squares
    b = part.H @ part.values(Y)
    assert np.abs(rates.X - np.linalg.lstsq(part.G, b, rcond=None)[0]).max() < 1e-12
    assert rates.residual == pytest.approx(0.01)
    # the same command without contradiction
    fine = resolve(part, Y | {"body": 0.0})
    assert fine.status == "ok"
    assert fine.reason == ""


def test_a_conflict_between_feet() -> None:
    """Two feet on one rigid body cannot part: the paper's rank condition, with the rows that break it."""
    rows = {leg: [bp.Row(theta=angle, a=0.3)] for leg, angle in (("a", 0.0), ("b", np.pi))}
    rows["c"] = [bp.Row(theta=bp.Joint("c.hip"), a=0.2)]
    robot = bp.Robot.from_rows(rows)
    part = bp.solve.partition(robot, [0.4], known=["a.v", "b.v", "c.foot.vz"], axes="world")
    rates = resolve(part, {"a.v": [0.02, 0.0, 0.0], "b.v": [0.0, 0.0, 0.0], "c.foot.vz": 0.0})
    assert rates.status == "conflict"
    assert rates.reason == (
        "the equations of a.foot.vx, b.foot.vx cannot hold together: the known a.foot.vx, b.foot.vx leave 0.02 m/s "
        "where it must be 0"
    )
    assert resolve(part, {"a.v": [0.0, 0.1, 0.0], "b.v": [0.0, -0.1, 0.0], "c.foot.vz": 0.0}).status == "ok"


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_conflicts_of_random_robots_are_irreducible(seed: int) -> None:
    case, rng = random_case(seed), np.random.default_rng(seed)
    part = case.partition()
    G, H, _, names = case.want.split(case.known)
    Y = rng.normal(size=len(names))
    rates = resolve(part, Y)
    b = H @ Y
    gap = np.abs(G @ np.linalg.lstsq(G, b, rcond=1e-12)[0] - b).max()
    assert (rates.status == "conflict") == bool(gap > 1e-8)
    if rates.status != "conflict":
        return
    told = rates.reason.partition(" of ")[2].split(" cannot hold")[0].split(", ")
    rows = [part.rows.index(name) for name in told]

    def off(some: list[int]) -> float:
        if not some:
            return 0.0
        return float(np.abs(G[some] @ np.linalg.lstsq(G[some], b[some], rcond=1e-12)[0] - b[some]).max())

    assert off(rows) > 1e-9
    assert all(off([r for r in rows if r != row]) < 1e-7 for row in rows)


def test_one_of_many_fails() -> None:
    part, along, aside = bent(0.0)
    both = np.stack([0.05 * aside, 0.05 * along, 0.05 * aside])
    rates = resolve(part, command(both))
    assert rates.status.tolist() == ["ok", "conflict", "ok"]
    assert rates.reason[0] == "" == rates.reason[2]
    assert "fl.foot.v" in rates.reason[1]
    with pytest.raises(SolveError, match="conflict at index 1") as failure:
        rates.raise_if_failed()
    assert failure.value.index == 1


def test_nothing_known_and_everything_known() -> None:
    robot = bp.silo4()
    part = standing(robot, known=[])
    assert np.array_equal(resolve(part, []).X, np.zeros(12 + 24 + 6))
    full = standing(robot, known=[*part.unknown])
    rng = np.random.default_rng(14)
    body, qd = rng.normal(size=6), rng.normal(size=12)
    P, Q = full.PQ
    Y = np.concatenate([P @ body + Q @ qd, body, qd])
    rates = resolve(full, Y)
    assert rates.X.shape == (0,)
    assert rates.status == "ok"
    assert np.abs(rates.qd - qd).max() == 0.0
    assert np.abs(rates.twist - body).max() < 1e-15
    assert resolve(full, Y + np.eye(len(Y))[2]).status == "conflict"


# --- results ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["min_norm", "weighted", "qp"])
@pytest.mark.parametrize("shape", [(), (1,), (3,), (2, 2), (0,)])
def test_batches(method: str, shape: tuple[int, ...]) -> None:
    rng = np.random.default_rng(15)
    robot = bp.silo4(passive=True)
    q = crouching(robot) + rng.uniform(-0.2, 0.2, (*shape, robot.n))
    part = bp.solve.partition(robot, q, random_base(rng, *shape), known=CRAWL)
    Y, rho = 0.01 * rng.normal(size=(*shape, 15)), 0.01 * rng.normal(size=(*shape, len(part.unknown)))
    rates = resolve(part, Y, method=method, rho=rho)
    assert rates.X.shape == (*shape, len(part.unknown))
    assert rates.qd.shape == (*shape, robot.n)
    assert rates.twist.shape == (*shape, 6)
    assert rates["fl.foot.v"].shape == (*shape, 3)
    assert np.shape(rates.residual) == np.shape(rates.rank) == np.shape(rates.damped) == shape
    for index in np.ndindex(shape):
        one = resolve(part.at(q[index], part.model.base[index]), Y[index], method=method, rho=rho[index])
        assert np.abs(rates.X[index] - one.X).max() < 1e-11
        assert rates.residuals[index].shape == (24,)


def test_batches_broadcast() -> None:
    robot = bp.silo4()
    part = standing(robot, crouching(robot) + np.linspace(0, 0.1, 3)[:, None])
    Y = STILL | {"body.x": np.array([[0.01], [0.02]]), "body.y": 0.0, "body.yaw": np.zeros(3)}
    rates = resolve(part, Y, d=np.ones((4, 1, 1)), rho={"body.z": 0.1}, method="weighted")
    assert rates.X.shape == (4, 2, 3, len(part.unknown))
    assert rates["body.x"][3, 1, 2] == 0.02
    matrices = np.tile(np.diag(np.arange(1.0, 1 + len(part.unknown))), (3, 1, 1))
    assert (
        np.abs(
            resolve(part, Y, metric=matrices).X - resolve(part, Y, metric=np.arange(1.0, 1 + len(part.unknown))).X
        ).max()
        < 1e-13
    )


def test_rates_move_the_robot_as_commanded() -> None:
    """A small step with qd and twist: feet stay, the body's coordinates move on."""
    rng = np.random.default_rng(16)
    robot = bp.silo4(passive=True)
    q, base = crouching(robot, rng), bp.solve.pose_from_coordinates([0.3, -0.2, 0.2, 0.1, -0.15, 0.7])
    part = bp.solve.partition(robot, q, base, known=[*CRAWL[:3], "hr.foot.v", *CRAWL[4:]], axes="world")
    swing = [0.05, 0.02, 0.06]
    rates = resolve(
        part, STILL | {"hr.foot.v": swing, "body.x": 0.03, "body.y": -0.01, "body.yaw": 0.2}, method="weighted"
    )
    h = 1e-6
    ends, bodies = [], []
    for s in (-h, h):
        moved = bp.spatial.compose(base, bp.spatial.exp(s * rates.twist))
        poses = robot.forward(q + s * rates.qd, moved)
        ends.append(np.array([poses[leg][:3] for leg in LEGS]))
        bodies.append(bp.solve.coordinates_from_pose(moved))
    speed = (ends[1] - ends[0]) / (2 * h)
    assert np.abs(speed - [[0, 0, 0], [0, 0, 0], [0, 0, 0], swing]).max() < 1e-9
    went = (bodies[1] - bodies[0]) / (2 * h)
    names = ("x", "y", "z", "roll", "pitch", "yaw")
    assert np.abs(went - [float(rates[f"body.{name}"]) for name in names]).max() < 1e-9
    assert went[[0, 1, 5]] == pytest.approx([0.03, -0.01, 0.2], abs=1e-9)


def test_access_by_name() -> None:
    robot = bp.silo4()
    part = standing(robot)
    rates = resolve(part, STILL | {"body.x": 0.03, "body.y": 0.0, "body.yaw": 0.0})
    assert rates["body.x"] == 0.03
    assert rates["fl.knee"] == rates.X[part.column("fl.knee")] == rates.qd[robot.joint_index("fl.knee")]
    assert rates["fl.w"].shape == (3,)
    assert rates["body"].shape == (6,)
    with pytest.raises(UnknownNameError):
        rates["fl.toe"]
    with pytest.raises(UnknownNameError, match="unknown"):
        part.column("body.x")
    with pytest.raises(ValueError, match="read-only"):
        rates.X[0] = 1.0


def test_refusals() -> None:
    robot = bp.silo4()
    part = standing(robot)
    Y = STILL | {"body.x": 0.03, "body.y": 0.0, "body.yaw": 0.0}
    for options, text in (
        ({"method": "dls"}, "method: must be one of min_norm, weighted, qp"),
        ({"method": "min_norm", "metric": Metric()}, "metric: method 'min_norm' has none"),
        ({"method": "weighted", "limits": bp.solve.Limits()}, "limits: method 'weighted' keeps none"),
        ({"limits": 3}, "limits: expected Limits"),
        ({"damping": "always"}, "damping: must be 'auto' or a number"),
        ({"damping": -0.1}, "damping: must be a finite number >= 0"),
        ({"near": 1.5}, "near: must be a finite number > 0"),
        ({"rho": np.zeros(3)}, r"rho: expected shape \(..., 27\)"),
        ({"gradient": np.zeros(3)}, r"gradient: expected shape"),
        ({"rho": np.zeros(27), "gradient": np.zeros(27)}, "give one of them"),
        ({"rho": {"body.x": 1.0}}, "unknown unknown 'body.x'"),
        ({"d": [1.0, np.inf]}, "d: every value must be finite"),
        ({"metric": np.zeros(27)}, "weights must be > 0"),
        ({"metric": -np.eye(27)}, "positive definite"),
        ({"metric": np.triu(np.ones((27, 27)))}, "symmetric"),
        ({"metric": np.ones(5)}, r"\(27,\) weights or \(27, 27\) matrices"),
        ({"metric": Metric(weights={"body.z": 0.0})}, r"Metric.weights\['body.z'\]: must be > 0"),
        ({"metric": Metric(weights={"body.x": 1.0})}, "body.x"),
        ({"d": np.ones(2), "rho": np.zeros((3, 27))}, "does not broadcast"),
    ):
        with pytest.raises(InputError, match=text):
            resolve(part, Y, **options)
    with pytest.raises(InputError, match="expected a Partition"):
        resolve(robot, Y)  # type: ignore[arg-type]
    for field, value in (("length", 0.0), ("actuated", -1.0), ("passive", 0.0), ("body", np.nan), ("feet", -1.0)):
        with pytest.raises(InputError, match=f"Metric.{field}"):
            Metric(**{field: value})
    with pytest.raises(InputError, match=r"Metric.weights\['a'\]"):
        Metric(weights={"a": -1.0})


def test_the_example_of_the_module_runs() -> None:
    lines = bp.solve.__doc__.splitlines()
    code = "\n".join(line[4:] for line in lines if line.startswith("    "))
    space: dict[str, Any] = {}
    exec(code, space)  # our own documentation
    rates = space["rates"]
    assert rates.status == "ok"
    assert rates["hr.foot.v"].tolist() == [0.06, 0.0, 0.04]
    assert space["psi"].rate(rates) > 0.0
