"""Equations (10)-(13) of paper *legs* as printed, beside what its own Table 1 gives; writes docs/legs-equations.md.

python tests/legs_equations.py        # after a change here or in the formulas; test_legs_equations.py compares
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

from bodyplan.robot import Joint, Robot, Row
from bodyplan.robot.symbolic.latex import tex

PAGE = Path(__file__).parents[1] / "docs" / "legs-equations.md"
QUARTER = np.pi / 2
KINDS = {f"{letter}_{i}": "length" for letter in "ad" for i in range(7)}


def leg() -> Robot:
    """One leg of Table 1 with every letter a joint, so that all of them are symbols."""

    def angle(i: int, offset: float = 0.0) -> Joint:
        return Joint(f"theta_{i}", offset=offset)

    return Robot.from_rows(
        {
            "leg": [
                Row(angle(0), d=Joint("d_0"), a=Joint("a_0"), name="SR"),
                Row(angle(1), a=Joint("a_1"), epsilon=QUARTER, name="HP"),
                Row(angle(2), a=Joint("a_2"), name="KE"),
                Row(angle(3), a=Joint("a_3"), name="AE"),
                Row(angle(4), epsilon=QUARTER, name="HL"),
                Row(angle(5, QUARTER), epsilon=-QUARTER, name="SE"),
                Row(angle(6, QUARTER), d=Joint("d_6"), name="CT"),
            ]
        }
    )


def _printed() -> dict[int, tuple[sp.Matrix, sp.Matrix | None]]:
    """number -> (6x6 matrix, coefficient of the rate or None), entry by entry from the paper."""

    def blocks(turn: list[list[Any]], corner: list[list[Any]]) -> sp.Matrix:
        return sp.Matrix([[*t, *c] for t, c in zip(turn, corner, strict=True)] + [[0, 0, 0, *t] for t in turn])

    th = sp.symbols("theta_0:4")
    a0, a2, a3, d0, d2 = sp.symbols("a_0 a_2 a_3 d_0 d_2")
    (c0, s0), (c2, s2), (c3, s3) = ((sp.cos(th[i]), sp.sin(th[i])) for i in (0, 2, 3))
    bar = sp.Symbol("thetabar_1")  # theta_1 - theta_0, says the text below (11)
    c1, s1 = sp.cos(bar), sp.sin(bar)
    return {
        10: (
            blocks(
                [[c0, s0, 0], [-s0, c0, 0], [0, 0, 1]],
                [[-d0 * s0, d0 * c0, 0], [-d0 * c0, -d0 * s0, a0], [a0 * s0, -a0 * c0, 0]],
            ),
            None,
        ),
        11: (blocks([[c1, s1, 0], [-s1, c1, 0], [0, 0, 1]], [[0, 0, 0]] * 3), sp.Matrix([0, 0, 0, 0, 0, 1])),
        12: (
            blocks(
                [[s2, -c2, 0], [c2, s2, 0], [0, 0, 1]],
                [[d2 * c2, d2 * s2, 0], [-d2 * s2, d2 * c2, a2], [-a2 * c2, -a2 * s2, 0]],
            ),
            sp.Matrix([0, a2, 0, 0, 0, 1]),
        ),
        13: (
            blocks([[c3, s3, 0], [-s3, c3, 0], [0, 0, 1]], [[0, 0, 0], [0, 0, a3], [a3 * c3, -a3 * s3, 0]]),
            sp.Matrix([0, a3, 0, 0, 0, 1]),
        ),
    }


PRINTED = _printed()
#: number of the equation -> frame that it leads from and to, joint whose rate is in it
FRAMES = {10: ("BY", "SR", None), 11: ("SR", "HP", 1), 12: ("HP", "KE", 2), 13: ("KE", "AE", 3)}
ABOUT = {
    10: "Right, once the twists are read as body-fixed: both parts in the axes of their own frame.",
    11: "Wrong: it is the row (theta_1, 0, 0, 0). Table 1 has (theta_1, 0, a_1, 90 deg): the turn by 90 deg about x "
    "and the coxa are missing, in the matrix and in the coefficient of the rate. Its angle is theta_1 - theta_0, but "
    "(10) has turned by theta_0 already and Table 1 says theta_1.",
    12: "Wrong: it is the row (theta_2 - 90 deg, d_2, a_2, 0), which is not in Table 1: that has (theta_2, 0, a_2, 0). "
    "The coefficient of the rate is right.",
    13: 'Sine and cosine are exchanged in row 3. The text above it says "from the hip to the knee"; it leads from the '
    "knee to the ankle. The coefficient of the rate is right.",
}


def correct(number: int) -> tuple[sp.Matrix, sp.Matrix | None]:
    """(D, column of E for theta) of the row of Table 1 that an equation is about."""
    model = leg().symbolic()
    _, frame, joint = FRAMES[number]
    return sp.Matrix(model.D(frame)), None if joint is None else sp.Matrix(model.E(frame)[:, 0])


def wrong(number: int) -> tuple[set[tuple[int, int]], set[int]]:
    """Entries (row, column), from 1, of the printed matrix and rows of the printed coefficient that are not those of
    Table 1; the printed angle of (11) read as theta_1."""
    (D, E), (right, coefficient) = PRINTED[number], correct(number)
    D = D.subs(sp.Symbol("thetabar_1"), sp.Symbol("theta_1"))
    entries = {(i + 1, j + 1) for i in range(6) for j in range(6) if sp.simplify(D[i, j] - right[i, j]) != 0}
    return entries, set() if E is None else {i + 1 for i in range(6) if sp.simplify(E[i] - coefficient[i]) != 0}


def matrix_tex(matrix: sp.Matrix, boxed: set[tuple[int, int]]) -> str:
    """A matrix as LaTeX that GitHub's pages render, with a box around some entries."""
    rows = []
    for i in range(matrix.rows):
        cells = [tex(matrix[i, j], KINDS).replace(r"thetabar", r"\theta") for j in range(matrix.cols)]
        rows.append(" & ".join(rf"\boxed{{{c}}}" if (i + 1, j + 1) in boxed else c for j, c in enumerate(cells)))
    return "\\begin{bmatrix}\n" + " \\\\\n".join(rows) + "\n\\end{bmatrix}"


def equation(
    number: int, parts: tuple[sp.Matrix, sp.Matrix | None], boxed: tuple[set[tuple[int, int]], set[int]]
) -> str:
    before, after, joint = FRAMES[number]
    D, E = parts
    right = f"{matrix_tex(D, boxed[0])} V_{{{before}}}"
    if E is not None:
        right += f" + {matrix_tex(E, {(i, 1) for i in boxed[1]})} \\dot\\theta_{joint}"
    return f"$$\nV_{{{after}}} = {right}\n$$"


def page() -> str:
    """The whole page."""
    sections = []
    for number, (before, after, _) in FRAMES.items():
        found = wrong(number)
        mistakes = len(found[0]) + len(found[1])
        sections += [f"## ({number}): {before} to {after}", "", ABOUT[number], "", "Printed:", ""]
        sections += [equation(number, PRINTED[number], found), ""]
        if mistakes:
            sections += [
                f"Correct ({mistakes} entries differ):",
                "",
                equation(number, correct(number), (set(), set())),
                "",
            ]
    return HEAD + "\n".join(sections) + "\n" + TAIL


HEAD = """\
# Equations (10)-(13) of paper *legs*: printed and correct

M. Tarokh, M. Lee, "Systematic Method for Kinematics Modeling of Legged Robots on Uneven Terrain" (2009), derives four
matrices of a SILO4 leg by hand from its Table 1. Three of them do not follow from that table. Below each is set beside
the one that `robot.symbolic().D(frame)` and `.E(frame)` give for the same row; what is wrong is boxed. The test
`tests/test_legs_equations.py` recomputes this page.

A row of the extended D-H table is $T = R_z(\\theta)\\,T_z(d)\\,T_x(a)\\,R_x(\\varepsilon)$; $V = (v, \\omega)$ is the
twist of a frame in its own axes (the paper's $\\dot\\phi$ is this $\\omega$, not the rates of roll, pitch and yaw);
$c$ and $s$ are cosine and sine.

| from | to | theta | d | a | epsilon |
|---|---|---|---|---|---|
| BY | SR | theta_0 | d_0 | a_0 | 0 |
| SR | HP | theta_1 | 0 | a_1 | 90 deg |
| HP | KE | theta_2 | 0 | a_2 | 0 |
| KE | AE | theta_3 | 0 | a_3 | 0 |

"""

TAIL = """\
## Their product

The text below (7) defines $P = D_0 D_1 \\dots D_{n-1}$. Twists pass from the body to the foot, so the last row of the
table comes first: $P = D_{n-1} \\dots D_1 D_0$ and $Q = [\\,D_{n-1} \\dots D_1 E_0 \\mid \\dots \\mid E_{n-1}\\,]$.

```python
import bodyplan as bp

leg = bp.silo4(passive=True).symbolic()
print(leg.D("fl.hip"), leg.E("fl.hip"))  # the row of (11): frame fl.hip is HP
print(leg.P.shape, leg.Q.shape)  # (24, 6), (24, 24)
print(leg.latex("rows"))  # every row like the equations above
```
"""

if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
