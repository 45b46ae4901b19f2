"""A robot's formulas as LaTeX, in the notation of paper *legs*: c and s for cosine and sine, theta for joint angles."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import sympy as sp
from sympy.printing.latex import LatexPrinter

from bodyplan.errors import InputError, UnknownNameError
from bodyplan.robot.elements import Arc, Chain, Element, Joint, WheelRadius, joint_of
from bodyplan.robot.symbolic.formulas import formula

if TYPE_CHECKING:
    from bodyplan.robot.symbolic.model import SymbolicRobot

PARTS = ("table", "rows", "poses", "model", "P", "Q")
DEFAULT_PARTS = ("table", "rows", "poses", "model")
#: digits of a printed number; code has all of them
DIGITS = 10
#: a matrix with more recurring parts than this is written with names for them
FEW = 12
_VARIABLES = {"theta": r"\theta", "d": "d", "a": "a", "epsilon": r"\varepsilon", "pitch": r"\phi_p", "yaw": r"\phi_y"}
_SPECIAL = {**{c: rf"\{c}" for c in "&%#$_{}"}, "~": r"\sim ", "^": r"\wedge ", "\\": r"\backslash "}

HEAD = r"""\documentclass{article}
\usepackage[a4paper,landscape,margin=15mm]{geometry}
\usepackage{amsmath,graphicx,longtable}
\setcounter{MaxMatrixCols}{200}
\allowdisplaybreaks
\newcommand{\fit}[1]{\[\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}{$\displaystyle #1$}\]}
\begin{document}
\section*{Kinematics of TITLE}
Extended D--H table, standard form: $T = R_z(\theta)\,T_z(d)\,T_x(a)\,R_x(\varepsilon)$ maps each frame to the one
before; lengths in m, angles in rad, numbers rounded to DIGITS digits. $c$ and $s$ are cosine and sine. Twists
$V = (v, \omega)$ are body-fixed: both parts in the axes of their own frame, $v$ at its origin.
"""
ARCS = r"""
For an arc that turns by $x$: $A(x^2) = \sin x / x$, $B(x^2) = (1 - \cos x)/x^2$, $C(x^2) = (x - \sin x)/x^3$, with the
limits $1$, $\frac{1}{2}$, $\frac{1}{6}$ at $x = 0$.
"""


class _Printer(LatexPrinter):  # type: ignore[misc]
    """SymPy's printer with names of joints, short trigonometry and rounded numbers."""

    def __init__(self, kinds: dict[str, str]) -> None:
        super().__init__({"mat_delim": "[", "mat_str": "matrix"})
        self._kinds = kinds

    def _print_Symbol(self, symbol: Any, style: str = "plain") -> str:
        return symbol_tex(symbol.name, self._kinds.get(symbol.name, "angle"))

    def _print_Float(self, value: Any) -> str:
        return f"{float(value):.{DIGITS}g}" if 1e-4 <= abs(value) < 1e6 else str(super()._print_Float(value))

    def _print_cos(self, value: Any, exp: Any = None) -> str:
        return self._short("c", value.args[0], exp)

    def _print_sin(self, value: Any, exp: Any = None) -> str:
        return self._short("s", value.args[0], exp)

    def _short(self, name: str, angle: Any, exp: Any) -> str:
        power = "" if exp is None else f"^{{{exp}}}"
        inner = self._print(angle)
        return f"{name}{power}{inner}" if angle.is_Symbol else rf"{name}{power}\left({inner}\right)"


def tex(value: Any, kinds: dict[str, str] | None = None) -> str:
    """An expression or matrix as LaTeX; ``kinds``: "angle" or "length" of every joint."""
    return str(_Printer(kinds or {}).doprint(value))


def symbol_tex(name: str, kind: str, accent: str = "") -> str:
    """A joint's symbol: a letter of either alphabet, with a number perhaps, stands for itself; any other name is the
    index of theta or, for a length, of l. ``accent``: a command over the letter."""
    found = re.fullmatch(r"([A-Za-z]+)_?(\d*)", name)
    letter = str(sp.latex(sp.Symbol(found[1]))) if found else ""
    if found and (len(letter) == 1 or letter.startswith("\\")):
        index = found[2]
    else:
        letter = r"\theta" if kind == "angle" else r"\ell"
        index = rf"\mathrm{{{''.join(_SPECIAL.get(c, c) for c in name)}}}"
    dressed = f"{accent}{{{letter}}}" if accent else letter
    return f"{dressed}_{{{index}}}" if index else dressed


def plain_tex(text: str) -> str:
    """Text with LaTeX's special characters in mathematics mode."""
    return "".join(f"${_SPECIAL[c]}$" if c in "~^\\" else _SPECIAL.get(c, c) for c in " ".join(text.split()))


def latex(model: SymbolicRobot, parts: str | Sequence[str] | None, document: bool) -> str:
    """The parts asked for, one after the other; see :meth:`SymbolicRobot.latex`."""
    wanted = DEFAULT_PARTS if parts is None else (parts,) if isinstance(parts, str) else tuple(parts)
    for part in wanted:
        if part not in PARTS:
            raise UnknownNameError("part", part, PARTS, where="latex")
    if not wanted:
        raise InputError(f"parts: expected some of {', '.join(PARTS)}, got {parts!r}.")
    writer = _Writer(model, document)
    body = "\n".join(writer.part(part) for part in wanted)
    if not document:
        return body
    arcs = ARCS if any(isinstance(element, Arc) for element in model.robot.elements) else ""
    head = HEAD.replace("TITLE", plain_tex(model.robot.name)).replace("DIGITS", str(DIGITS))
    return f"{head}{arcs}\n{body}\\end{{document}}\n"


class _Writer:
    def __init__(self, model: SymbolicRobot, document: bool) -> None:
        self.model, self.robot, self.document = model, model.robot, document
        self.kinds = dict(zip(self.robot.joints, self.robot.kinds, strict=True))

    def part(self, name: str) -> str:
        writers: dict[str, Callable[[], str]] = {
            "table": self.table,
            "rows": self.rows,
            "poses": self.poses,
            "model": self.composite,
            "P": lambda: self.matrix("P", self.model.P),
            "Q": lambda: self.matrix("Q", self.model.Q),
        }
        return writers[name]()

    def table(self) -> str:
        kind = "longtable" if self.document else "tabular"
        lines = [rf"\begin{{{kind}}}{{lllllll}}", r"chain & from & to & $\theta$ & $d$ & $a$ & $\varepsilon$ \\ \hline"]
        for chain in self.robot.chains:
            before = chain.parent
            for i, element in enumerate(chain.elements):
                after = chain.frame_name(i)
                cells = [plain_tex(word) for word in (chain.name, before, after)]
                if isinstance(element, Arc):
                    values = [self.variable(element, field) for field in element.VARIABLES]
                    about = rf"arc of ${element.length:.{DIGITS}g}$: pitch ${values[0]}$, yaw ${values[1]}$"
                    cells.append(rf"\multicolumn{{4}}{{l}}{{{about}}}")
                else:
                    cells += [f"${self.variable(element, field)}$" for field in element.VARIABLES]
                lines.append(" & ".join(cells) + r" \\")
                before = after
        return "\n".join([*lines, rf"\end{{{kind}}}", ""])

    def rows(self) -> str:
        out = []
        for chain in self.robot.chains:
            before = chain.parent
            for i, element in enumerate(chain.elements):
                after = chain.frame_name(i)
                D, E = self.model.D(after), self.model.E(after)
                terms = [f"{self.tex(D)} {_twist(before)}"]
                for k, field in enumerate(element.VARIABLES):
                    if isinstance(getattr(element, field), (Joint, WheelRadius)):
                        terms.append(f"{self.tex(E[:, k])} {self.rate(element, field)}")
                out.append(self.equation(_twist(after), " + ".join(terms)))
                before = after
        return "\n".join([*out, ""])

    def poses(self) -> str:
        names = [self.robot.frames[end] for end in self.robot.ends]
        return "\n".join([*(self.abbreviated(f"T_{{{_word(n)}}}", self.model.forward(n)) for n in names), ""])

    def composite(self) -> str:
        """P and Q as products of the D_i and E_i of the rows."""
        out = [self.equation(r"V_{\mathrm{ends}}", r"P\, V_{\mathrm{base}} + Q\, \dot q")]
        for chain in self.robot.chains:
            elements = self._path(chain)
            carried = [rf"D_{{{_word(frame)}}}" for frame, _ in reversed(elements)]
            out.append(self.equation(f"P_{{{_word(chain.name)}}}", " ".join(carried)))
            terms = []
            for i, (frame, element) in enumerate(elements):
                driven = [f for f in element.VARIABLES if isinstance(getattr(element, f), (Joint, WheelRadius))]
                if not driven:
                    continue
                rates = ", ".join(self.rate(element, f) for f in driven)
                columns = ", ".join(_VARIABLES[f] for f in driven)
                after = " ".join(carried[: len(elements) - 1 - i])
                terms.append(rf"{after} E_{{{_word(frame)}}}^{{{columns}}}\,({rates})")
            out.append(self.equation(rf"Q_{{{_word(chain.name)}}}\, \dot q", " + ".join(terms) or "0"))
        return "\n".join([*out, ""])

    def matrix(self, name: str, value: Any) -> str:
        """P or Q, the six rows of a chain at a time."""
        blocks = [(chain.name, value[6 * c : 6 * c + 6, :]) for c, chain in enumerate(self.robot.chains)]
        return "\n".join([*(self.abbreviated(f"{name}_{{{_word(of)}}}", block) for of, block in blocks), ""])

    def abbreviated(self, left: str, value: Any) -> str:
        """An equation for a matrix; where it is long, after lines that give what recurs in it a name."""
        names = sp.numbered_symbols("w_", start=1, exclude=self.model.q)
        short, (rest,) = sp.cse([value], symbols=names)
        if len(short) <= FEW:
            return self.equation(left, self.tex(value))
        lines = " \\\\\n".join(f"{self.tex(name)} &= {self.tex(part)}" for name, part in short)
        return f"\\begin{{align*}}\n{lines}\n\\end{{align*}}\n{self.equation(left, self.tex(rest))}"

    def equation(self, left: str, right: str) -> str:
        """A displayed equation; in a document shrunk to the width of the page where it must be."""
        return rf"\fit{{{left} = {right}}}" if self.document else rf"\[ {left} = {right} \]"

    def tex(self, value: Any) -> str:
        return tex(value, self.kinds)

    def variable(self, element: Element, field: str) -> str:
        return self.tex(formula(getattr(element, field), turns=field in element.ANGLES))

    def rate(self, element: Element, field: str) -> str:
        """Rate of a driven variable in terms of its joint's."""
        value = getattr(element, field)
        name = joint_of(value).name
        slope = formula(value, turns=field in element.ANGLES).diff(sp.Symbol(name))
        dot = symbol_tex(name, self.kinds[name], r"\dot")
        return dot if slope == 1 else rf"{self.tex(slope)}\,{dot}"

    def _path(self, chain: Chain) -> list[tuple[str, Element]]:
        """Frames and elements from the base to the end of a chain."""
        before: list[tuple[str, Element]] = []
        if chain.parent != "base":
            for other in self.robot.chains:
                names = [other.frame_name(i) for i in range(len(other.elements))]
                if chain.parent in names:
                    before = self._path(other)
                    before = before[: len(before) - len(names) + names.index(chain.parent) + 1]
        return before + [(chain.frame_name(i), element) for i, element in enumerate(chain.elements)]


def _word(name: str) -> str:
    return rf"\mathrm{{{''.join(_SPECIAL.get(c, c) for c in name)}}}"


def _twist(frame: str) -> str:
    return rf"V_{{{_word(frame)}}}"
