"""Formulas and generated code of random robots against the numeric kernels and facts of paper *legs*."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import bodyplan as bp
from bodyplan.errors import InputError, MissingExtraError, UnknownNameError
from bodyplan.robot import Arc, Joint, Robot, Row, WheelRadius
from bodyplan.robot.symbolic import SymbolicRobot
from c_cases import Compiled
from robot_cases import random_robot

SILO4 = Path(__file__).parents[1] / "examples" / "silo4_legs.csv"


def everything() -> Robot:
    """All kinds of element and drive in one robot: arcs driven both ways, one way and not at all, prismatic rows, a
    shared joint with scale and offset, a wheel, a chain on a chain, constant turns."""
    return Robot.from_rows(
        {
            "arm": [
                Row(theta=0.3, d=0.1, a=-0.2, epsilon=0.7),
                Arc(0.3, Joint("p"), Joint("y", offset=0.2, scale=-0.5)),
                Row(theta=Joint("t", offset=np.pi / 2), d=Joint("slide", scale=2.0), a=0.1, epsilon=-np.pi / 2),
                Arc(0.2, 0.3, Joint("p", scale=0.5)),
                Arc(0.1, 0.0, Joint("z")),
                Row(theta=Joint("t", scale=0.5), epsilon=Joint("e", offset=-1.0), name="wrist"),
            ],
            "wheel": [
                Arc(0.2, 0.4, -0.3),
                Row(theta=Joint("t", scale=-1.0), d=WheelRadius(Joint("w"), 0.2, 0.01), epsilon=np.pi),
                Row(theta=Joint("u"), a=WheelRadius(Joint("w"), 0.1)),
            ],
            "finger": [Row(theta=Joint("v"), a=0.05), Row(theta=Joint("u", offset=0.1), a=Joint("slide"))],
        },
        parents={"finger": "wrist"},
        name="everything",
    )


def numeric(formulas: Any, model: SymbolicRobot, q: np.ndarray) -> Any:
    """A matrix of formulas at q, or a list of them."""
    values = sp.lambdify(model.q, formulas, "numpy", cse=True)(*q)
    return [np.array(v, dtype=float) for v in values] if isinstance(formulas, list) else np.array(values, dtype=float)


def check_formulas(robot: Robot, q: np.ndarray, most: float = 1e-13) -> None:
    model, last = robot.symbolic(), robot.frames[-1]
    pairs = list(zip((model.P, model.Q), robot.velocity_model(q), strict=True))
    for name in {robot.frames[index] for index in (1, len(robot.frames) // 2, *robot.ends)}:
        T = np.eye(4)
        T[:3, 3], T[:3, :3] = robot.forward(q)[name][:3], robot.forward(q).rotations[robot.frame_index(name)]
        D, E = robot.element_matrices(q, name)
        pairs += [(model.forward(name), T), (model.D(name), D), (model.E(name), E)]
    for reference in ("body", "world"):
        J = robot.jacobian(q, last, reference=reference)
        pairs.append((model.jacobian(last, reference=reference), J))
    for ours, (_, theirs) in zip(numeric([formula for formula, _ in pairs], model, q), pairs, strict=True):
        assert ours.shape == theirs.shape
        assert np.abs(ours - theirs).max() < most


def check_code(robot: Robot, folder: Path, qs: np.ndarray, most: float = 1e-12) -> None:
    """C and Python against the kernels, at every q."""
    source = robot.symbolic().c_source()
    compiled = Compiled(source, folder)
    namespace: dict[str, Any] = {}
    exec(robot.symbolic().python(), namespace)
    m, at = len(robot.chains), robot.ends_and_jacobians(qs)
    assert namespace["JOINTS"] == robot.joints
    assert namespace["FRAMES"] == tuple(robot.frames[i] for i in robot.ends)
    assert list(namespace["FIRST"]) == at.offsets.tolist() == compiled.numbers("first", m + 1)
    assert list(namespace["JOINT_OF"]) == at.joints.tolist() == compiled.numbers("joint_of", len(at.joints))
    assert compiled.names("joint_names", robot.n) == list(robot.joints)
    assert compiled.names("frame_names", m) == [robot.frames[i] for i in robot.ends]
    want = (at.positions, at.rotations, at.twists)
    for ours, theirs in zip(namespace["ends"](qs), want, strict=True):
        assert ours.shape == theirs.shape
        assert np.abs(ours - theirs).max() < most
    models = robot.velocity_model(qs)
    for ours, theirs in zip(namespace["velocity_model"](qs), models, strict=True):
        assert np.abs(ours - theirs).max() < most
    for i, q in enumerate(qs):
        for ours, theirs in zip(compiled.ends(robot, q, m, len(at.joints)), want, strict=True):
            assert np.abs(ours - theirs[i]).max() < most
        for ours, theirs in zip(compiled.velocity_model(q, m), models, strict=True):
            assert np.abs(ours - theirs[i]).max() < most


# --- formulas -----------------------------------------------------------------------------------------------


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 2))
def test_formulas_of_random_robots(seed: int, chains: int) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, chains, share=0.2)
    check_formulas(robot, rng.uniform(-2.0, 2.0, robot.n))


@pytest.mark.parametrize("size", [0.0, 1e-9, 1e-3, 1.0, 2.0])
def test_formulas_of_every_kind_of_element(size: float) -> None:
    robot = everything()
    check_formulas(robot, size * np.random.default_rng(1).uniform(-1.5, 1.5, robot.n))


def test_composite_is_the_product_of_the_rows() -> None:
    """P = D_n ... D_1, Q = [D_n ... D_2 E_1 | ... | E_n], as formulas."""
    robot = Robot.from_table(SILO4)
    model = robot.symbolic()
    P, Q = sp.eye(6), sp.zeros(6, robot.n)
    for frame, element in zip(robot.frames[1:8], robot.elements[:7], strict=True):
        D, E = model.D(frame), model.E(frame)
        P, Q = D * P, D * Q
        if isinstance(element.theta, Joint):
            Q += E[:, 0] * sp.Matrix([[int(name == element.theta.name) for name in robot.joints]])
    q = np.random.default_rng(2).uniform(-2, 2, (3, robot.n))
    for x in q:
        assert np.abs(numeric(model.P[:6, :] - P, model, x)).max() < 1e-15
        assert np.abs(numeric(model.Q[:6, :] - Q, model, x)).max() < 1e-15


def test_determinant_of_a_leg_as_a_formula() -> None:
    """notes: det Q = a2 a3 sin(theta3) cos(theta5) (a1 + a2 cos theta2 + a3 cos(theta2 + theta3)), up to its sign."""
    t1, t2, t3, t4, t5, t6, a1, a2, a3, d6 = sp.symbols("t1 t2 t3 t4 t5 t6 a1 a2 a3 d6")
    quarter = np.pi / 2
    leg = Robot.from_rows(
        {
            "leg": [
                Row(theta=Joint("t1"), a=Joint("a1"), epsilon=quarter),
                Row(theta=Joint("t2"), a=Joint("a2")),
                Row(theta=Joint("t3"), a=Joint("a3")),
                Row(theta=Joint("t4"), epsilon=quarter),
                Row(theta=Joint("t5", offset=quarter), epsilon=-quarter),
                Row(theta=Joint("t6", offset=quarter), d=Joint("d6")),
            ]
        }
    )
    model = leg.symbolic()
    Q = model.Q[:, [leg.joint_index(f"t{i}") for i in range(1, 7)]]
    want = a2 * a3 * sp.sin(t3) * sp.cos(t5) * (a1 + a2 * sp.cos(t2) + a3 * sp.cos(t2 + t3))
    f = sp.lambdify((t1, t2, t3, t4, t5, t6, a1, a2, a3, d6), (Q.det(method="berkowitz"), want), cse=True)
    for x in np.random.default_rng(3).uniform(-2, 2, (20, 10)):
        det, formula = f(*x)
        assert abs(abs(det) - abs(formula)) < 1e-13


def test_formulas_are_short_where_axes_are_parallel() -> None:
    """Turns about parallel axes add up, right angles are exact, and a foot is where a textbook puts it."""
    model = bp.silo4().symbolic()
    hip, knee, shoulder = (model.symbols[f"hl.{name}"] for name in ("hip", "knee", "shoulder"))
    T = model.forward("hl.foot")
    assert sp.expand(T[2, 3] - 0.24 * sp.sin(hip) - 0.24 * sp.sin(hip + knee)) == 0
    reach = 0.06 + 0.24 * sp.cos(hip) + 0.24 * sp.cos(hip + knee)
    assert sp.expand(T[0, 3] + 0.155 - sp.cos(shoulder + 3 * sp.pi / 4) * reach) == 0
    assert T[2, 2] == 0
    J = model.jacobian("hl.foot")
    assert J[5, model.robot.joint_index("hl.knee")] == 1
    assert model.q == tuple(sp.symbols(" ".join(model.robot.joints)))


def test_a_snake_in_the_plane_sums_its_angles() -> None:
    robot = bp.snake(12, 0.1)
    T = robot.symbolic().forward("link12")
    assert T[0, 0] == sp.cos(sum(sp.Symbol(name) for name in robot.joints))
    check_formulas(robot, np.linspace(-1, 1, robot.n))


def test_derivatives_of_formulas() -> None:
    """Columns of Q's v, turned into the base, are the derivatives of the end point; SymPy differentiates arcs."""
    robot = Robot.from_rows({"arm": [Arc(0.3, Joint("p"), Joint("y")), Row(theta=Joint("t"), a=0.2, epsilon=0.3)]})
    model = robot.symbolic()
    T, J = model.forward("arm"), model.jacobian("arm", reference="world")
    for q in ([0.4, -0.7, 0.2], [2.0, 1.0, -1.0]):
        slopes = T[:3, 3].jacobian(sp.Matrix(model.q))
        assert np.abs(numeric(slopes - J[:3, :], model, np.array(q))).max() < 1e-15


def test_arc_functions_written_out() -> None:
    robot = Robot.from_rows({"arm": [Arc(0.3, 0.0, Joint("y"))]})
    model, y = robot.symbolic(), sp.Symbol("y")
    x = model.forward("arm")[0, 3]
    assert x.subs(y, 0) == sp.Float(0.3)
    assert abs(float(x.subs(y, 0.5)) - 0.3 * np.sin(0.5) / 0.5) < 1e-16
    assert abs(float(x.rewrite(sp.sin).subs(y, 0.5)) - 0.3 * np.sin(0.5) / 0.5) < 1e-16
    for matrix in (model.Q, model.E("arm"), model.Q.diff(y)):
        written = matrix.applyfunc(lambda entry: entry.rewrite(sp.sin))
        a, b = (np.array(m.subs(y, sp.Rational(7, 5)).evalf(30), dtype=float) for m in (matrix, written))
        assert np.abs(a - b).max() < 1e-15


def test_elements_of_no_robot_have_formulas() -> None:
    model = bp.silo4().symbolic()
    assert model.D(6) == model.D("fr.knee")
    theta, a = sp.symbols("theta a")
    row = Row(theta=Joint("theta"), a=Joint("a"))
    assert model.E(row)[:, 0] == sp.Matrix([0, a, 0, 0, 0, 1])
    assert model.D(row)[2, 3] == a * sp.sin(theta)


# --- code ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(8))
def test_code_of_random_robots(seed: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, 1 + seed % 4, variable=0.3 + 0.1 * (seed % 5), share=0.3 * (seed % 2))
    qs = rng.uniform(-3.0, 3.0, (12, robot.n))
    qs[0] = 0.0
    check_code(robot, tmp_path, qs)


def test_code_of_every_kind_of_element(tmp_path: Path) -> None:
    """Also where arcs are straight, exactly and nearly, and where their functions change from series to closed form."""
    robot = everything()
    sizes = np.array([0.0, 1e-300, 1e-160, 1e-12, 1e-9, 1e-6, 1e-3, 0.5, 1.0, 2.0, 6.0])
    directions = np.random.default_rng(4).uniform(-1.0, 1.0, (len(sizes), robot.n))
    check_code(robot, tmp_path, sizes[:, None] * directions)


@pytest.mark.parametrize("make", [bp.silo4, bp.hexapod, lambda: bp.silo4(passive=True), lambda: bp.acm_l2(4)])
def test_code_of_ready_robots(make, tmp_path: Path) -> None:
    robot = make()
    check_code(robot, tmp_path, np.random.default_rng(5).uniform(-2, 2, (5, robot.n)))


def test_code_of_a_long_snake(tmp_path: Path) -> None:
    """Thirty joints about axes that turn: the number of lines grows with the joints, not exponentially."""
    robot = bp.snake(31, 0.05, axes="alternating")
    half = bp.snake(16, 0.05, axes="alternating").symbolic().python().count("\n")
    assert robot.symbolic().python().count("\n") < 2.5 * half
    check_code(robot, tmp_path, np.random.default_rng(6).uniform(-1, 1, (3, robot.n)))


def test_chosen_frames(tmp_path: Path) -> None:
    robot = bp.silo4()
    frames = ("fl.knee", "hr.foot", "base", "fl")
    source = robot.symbolic().c_source("legs", frames=frames)
    assert source.name == "legs"
    compiled = Compiled(source, tmp_path)
    q = np.random.default_rng(7).uniform(-1, 1, robot.n)
    at = robot.ends_and_jacobians(q, frames=frames)
    for ours, theirs in zip(compiled.ends(robot, q, 4, len(at.joints)), (at.positions, at.rotations, at.twists),
                            strict=True):  # fmt: skip
        assert np.abs(ours - theirs).max() < 1e-15
    P, Q = compiled.velocity_model(q, 4)
    assert np.abs(Q - at.stacked()).max() < 1e-15
    assert np.abs(P - at.carried()).max() < 1e-15


def test_common_subexpressions_are_shared() -> None:
    """No right-hand side is computed twice, and no sine or cosine of a joint is called twice."""
    robot = bp.silo4(passive=True)
    for code in (robot.symbolic().c_source().source, robot.symbolic().python()):
        values = re.findall(r"\bt\d+ = (.*?);?$", code, flags=re.M)
        assert len(values) == len(set(values)) > 250
        for function in ("sin", "cos"):
            assert len(re.findall(rf"\b{function}\(", code)) == robot.n


def test_the_comment_says_the_order() -> None:
    source = bp.silo4().symbolic().c_source()
    for i, name in enumerate(bp.silo4().joints):
        assert re.search(rf"^ +{i}  {re.escape(name)} \(rad\)$", source.header, flags=re.M)
        assert f"SILO4_Q_{name.upper().replace('.', '_')} = {i}" in source.header
    slider = Robot.from_rows({"a": [Row(d=Joint("lift"))]}).symbolic().c_source()
    assert re.search(r"^ +0  lift \(m\)$", slider.header, flags=re.M)


def test_any_name_becomes_a_valid_one(tmp_path: Path) -> None:
    """Names that are no identifiers, that clash, that are keywords, that would end a comment or a text."""
    names = ["a b", "a.b", "a_b", "2nd", "int", "größe", "??!", "back\\slash", "日本", "q", "t0", "percent%d", "sin"]
    robot = Robot.from_rows({"int": [Row(theta=Joint(name), a=0.1) for name in names]}, name='4 "legs" */ int\n??/ ü\\')
    qs = np.random.default_rng(8).uniform(-1, 1, (2, robot.n))
    check_code(robot, tmp_path, qs)
    assert robot.symbolic().c_source().name == "robot_4_legs_int_u"
    assert robot.symbolic().c_source("my leg").name == "my_leg"


def test_written_whole_and_not_over_others(tmp_path: Path) -> None:
    source = bp.silo4().symbolic().c_source()
    paths = source.write(tmp_path)
    assert [path.name for path in paths] == ["silo4.h", "silo4.c"]
    assert [path.read_text() for path in paths] == [source.header, source.source]
    paths[1].unlink()
    with pytest.raises(InputError, match=r"silo4\.h.*exists"):
        source.write(tmp_path)
    assert not paths[1].exists()
    source.write(tmp_path, force=True)
    with pytest.raises(InputError, match="does not exist"):
        source.write(tmp_path / "nowhere")


# --- LaTeX --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("make", [everything, lambda: bp.silo4(passive=True), lambda: Robot.from_table(SILO4)])
@pytest.mark.parametrize("document", [False, True])
def test_latex_is_well_formed(make, document: bool) -> None:
    model = make().symbolic()
    text = model.latex(("table", "rows", "poses", "model", "P", "Q"), document=document)
    depth = 0
    for c in re.sub(r"\\[{}\\]", "", text):
        depth += (c == "{") - (c == "}")
        assert depth >= 0
    assert depth == 0
    begun, ended = (re.findall(rf"\\{word}{{(\w+)}}", text) for word in ("begin", "end"))
    assert sorted(begun) == sorted(ended)
    assert text.count(r"\left") == text.count(r"\right")
    assert ("documentclass" in text) == document
    for frame in model.robot.frames[1:]:
        assert rf"V_{{\mathrm{{{frame}}}}} = " in text


def test_latex_of_a_row() -> None:
    """The row of eq. (13), corrected, in the paper's notation."""
    robot = Robot.from_rows({"leg": [Row(theta=Joint("theta_3"), a=Joint("a_3"), name="AE")]})
    text = robot.symbolic().latex("rows")
    assert r"0 & 0 & 1 & a_{3} s\theta_{3} & - a_{3} c\theta_{3} & 0" in text
    assert r"\dot{\theta}_{3}" in text
    assert r"\dot{a}_{3}" in text


def test_latex_of_names_and_numbers() -> None:
    robot = Robot.from_rows({"a_b": [Row(theta=Joint("knee_1"), d=Joint("lift"), a=1 / 3, name="x&y")]}, name="50% #1")
    text = robot.symbolic().latex(document=True)
    for part in (r"\theta_{\mathrm{knee\_1}}", r"\ell_{\mathrm{lift}}", "0.3333333333", r"x\&y", r"50\% \#1", r"a\_b"):
        assert part in text


# --- refusals and loading -----------------------------------------------------------------------------------


def test_refusals() -> None:
    model = bp.silo4().symbolic()
    for call in (model.D, model.E, model.forward, model.jacobian):
        with pytest.raises(UnknownNameError, match=r"fl\.foot"):
            call("fl.fot")
    for call in (model.D, model.E):
        with pytest.raises(InputError, match="base"):
            call("base")
        for row in (-1, 16, 1.5, None):
            with pytest.raises(InputError, match="row: must be a whole number >= 0 and <= 15"):
                call(row)
    with pytest.raises(InputError, match="reference"):
        model.jacobian("fl", reference="spatial")
    with pytest.raises(UnknownNameError, match="rows"):
        model.latex("row")
    with pytest.raises(InputError, match="parts"):
        model.latex(())
    with pytest.raises(UnknownNameError, match=r"fl\.foot"):
        model.c_source(frames=["fl.fot"])
    for frames in ("fl.foot", ()):
        with pytest.raises(InputError, match="frames"):
            model.python(frames=frames)
    rigid = Robot.from_rows({"a": [Row(a=0.1)]}).symbolic()
    assert rigid.Q.shape == (6, 0)
    with pytest.raises(InputError, match="no joints"):
        rigid.c_source()


def test_sympy_is_loaded_for_formulas_only() -> None:
    code = "import sys, bodyplan as bp; r = bp.silo4(); r.velocity_model([0.0] * 12); print('sympy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "False"


def test_without_sympy(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [n for n in sys.modules if n.startswith("bodyplan.robot.symbolic")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "sympy", None)
    with pytest.raises(MissingExtraError, match=r"bodyplan\[symbolic\]"):
        bp.silo4().symbolic()
