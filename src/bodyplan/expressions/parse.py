"""From a text to a tape of operations, through a whitelist over Python's own syntax tree.

Only the tree is taken from Python; nothing of the text is ever compiled or run. A **tape** is a list of
nodes in which every node uses earlier ones only; equal sub-expressions share one node, and parts
without a variable are computed once.
"""

from __future__ import annotations

import ast
import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bodyplan.errors import InputError, UnknownNameError

MAX_TEXT = 2000
MAX_NODES = 1000
MAX_DEPTH = 200
MAX_EXPONENT = 64
MAX_ARGUMENTS = 16

CONSTANTS = {"pi": float(np.pi), "e": float(np.e)}
#: functions of one argument
UNARY = ("sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs")
FUNCTIONS = (*UNARY, "atan2", "min", "max")
_BINARY = {ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "div", ast.Pow: "pow"}


@dataclass(frozen=True)
class Node:
    """One operation: ``op`` on the results of the nodes ``args``; ``source`` is its text.

    ``number``: value of a ``"number"``, index of a ``"variable"``, exponent of a ``"power"``.
    """

    op: str
    args: tuple[int, ...] = ()
    number: float = 0.0
    source: str = ""


Fold = Callable[[Node, list[float]], float]


def parse(text: str, variables: tuple[str, ...], fold: Fold) -> tuple[Node, ...]:
    """The tape of ``text``; its last node is the result. ``fold`` computes one operation on numbers.

    Raises InputError (UnknownNameError for names) with the offending part of the text and what is allowed.
    """
    if not isinstance(text, str):
        raise InputError(f"Expression: expected a text such as 'sin(x) + 2*y', got {text!r}.")
    if len(text) > MAX_TEXT:
        raise InputError(f"Expression: a text may have {MAX_TEXT} characters, this one has {len(text)}.")
    text = " ".join(text.split())  # a line break is a space: mission files may wrap a long formula
    if not text:
        raise InputError(f"Expression: the text is empty; write {_allowed(variables)}.")
    strange = next((c for c in text if not c.isascii() or not c.isprintable() or c in "#\\"), None)
    if strange is not None:
        raise InputError(
            f"Expression {shown(text)}: the character {strange!r} is not allowed; write {_allowed(variables)}."
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # such as that on "1or x", refused below in our own words
            tree = ast.parse(text, mode="eval")
    except SyntaxError as error:
        at = f" at column {error.offset} ({text[max(0, error.offset - 1) :][:20]!r})" if error.offset else ""
        raise InputError(f"Expression {shown(text)}: cannot be read{at}; write {_allowed(variables)}.") from error
    except (ValueError, MemoryError, RecursionError) as error:
        raise InputError(f"Expression {shown(text)}: too deeply nested, at most {MAX_DEPTH} levels.") from error
    builder = _Builder(text, variables, fold)
    last = builder.visit(tree.body, 0)
    return (*builder.nodes[: last + 1],)


def shown(text: str) -> str:
    """``text`` in quotes, cut where it is long, for an error of one sentence."""
    return repr(text if len(text) <= 80 else text[:77] + "...")


def _allowed(variables: tuple[str, ...]) -> str:
    return (
        f"numbers, {', '.join([*variables, *CONSTANTS])}, + - * / **, parentheses and the functions "
        f"{', '.join(FUNCTIONS)}"
    )


class _Builder:
    """Walks the syntax tree and lays down the tape."""

    def __init__(self, text: str, variables: tuple[str, ...], fold: Fold) -> None:
        self.text, self.variables, self.fold = text, variables, fold
        self.where = f"Expression {shown(text)}"
        self.nodes: list[Node] = []
        self.known: dict[tuple[str, tuple[int, ...], str], int] = {}
        self.visited = 0

    def visit(self, tree: ast.AST, depth: int) -> int:
        """Index of the node that computes ``tree``."""
        self.visited += 1
        if depth > MAX_DEPTH:
            raise InputError(f"{self.where}: too deeply nested, at most {MAX_DEPTH} levels.")
        if self.visited > MAX_NODES:
            raise InputError(f"{self.where}: too long, at most {MAX_NODES} operations and numbers.")
        match tree:
            case ast.Constant(value=bool()):
                raise self.refused(tree)
            case ast.Constant(value=int() | float() as value):
                return self.add("number", (), self.real(value, tree), tree)
            case ast.Name(id=name):
                return self.name(name, tree)
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                return self.visit(inner, depth + 1)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return self.add("neg", (self.visit(inner, depth + 1),), 0.0, tree)
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
                name, args = _BINARY[type(op)], (self.visit(left, depth + 1), self.visit(right, depth + 1))
                return self.power(*args, tree) if name == "pow" else self.add(name, args, 0.0, tree)
            case ast.BinOp(op=ast.BitXor()):
                raise InputError(f"{self.where}: {shown(self.segment(tree))}: a power is written **, not ^.")
            case ast.Call(func=ast.Name(id=name), args=given, keywords=[]):
                return self.call(name, given, tree, depth)
        raise self.refused(tree)

    def name(self, name: str, tree: ast.AST) -> int:
        """Node of a variable or a constant."""
        if name in self.variables:
            return self.add("variable", (), float(self.variables.index(name)), tree)
        if name in CONSTANTS:
            return self.add("number", (), CONSTANTS[name], tree)
        if name in FUNCTIONS:
            raise InputError(f"{self.where}: the function {name} needs arguments: {name}(...).")
        raise UnknownNameError("name", name, [*self.variables, *CONSTANTS, *FUNCTIONS], self.where)

    def call(self, name: str, given: list[ast.expr], tree: ast.AST, depth: int) -> int:
        """Node of a function of its arguments."""
        if name not in FUNCTIONS:
            raise UnknownNameError("function", name, FUNCTIONS, self.where)
        low, high = (1, 1) if name in UNARY else (2, 2) if name == "atan2" else (2, MAX_ARGUMENTS)
        if not low <= len(given) <= high:
            count = str(low) if low == high else f"{low} to {high}"
            raise InputError(f"{self.where}: {name} takes {count} argument(s), got {len(given)}.")
        args = [self.visit(arg, depth + 1) for arg in given]
        if name not in ("min", "max"):
            return self.add(name, tuple(args), 0.0, tree)
        result = args[0]
        for arg in args[1:]:
            result = self.add(name, (result, arg), 0.0, tree)
        return result

    def power(self, base: int, exponent: int, tree: ast.AST) -> int:
        """Node of ``base ** exponent``, or of ``exp(exponent log(base))`` where the exponent varies."""
        if self.nodes[exponent].op == "number":
            p = self.nodes[exponent].number
            if abs(p) > MAX_EXPONENT:
                raise InputError(
                    f"{self.where}: the exponent in {shown(self.segment(tree))} is {p:g}, at most "
                    f"{MAX_EXPONENT} in size is allowed."
                )
            if p == 0.0:  # also 0**0, as in Python
                return self.add("number", (), 1.0, tree)
            return base if p == 1.0 else self.add("power", (base,), p, tree)
        # only a positive base has a derivative with respect to its exponent
        log = self.add("log", (base,), 0.0, tree)
        return self.add("exp", (self.add("mul", (exponent, log), 0.0, tree),), 0.0, tree)

    def add(self, op: str, args: tuple[int, ...], number: float, tree: ast.AST) -> int:
        """Index of this node, new or known; a number where it depends on no variable."""
        source = self.segment(tree)
        if args and all(self.nodes[i].op == "number" for i in args):
            number = self.fold(Node(op, args, number, source), [self.nodes[i].number for i in args])
            if not np.isfinite(number):
                raise InputError(f"{self.where}: {shown(source)} is not a finite number.")
            op, args = "number", ()
        key = (op, args, float(number).hex())
        if key not in self.known:
            self.known[key] = len(self.nodes)
            self.nodes.append(Node(op, args, number, source))
        return self.known[key]

    def real(self, value: float, tree: ast.AST) -> float:
        """A literal as a finite float."""
        try:
            out = float(value)
        except OverflowError:
            out = float("inf")
        if not np.isfinite(out):
            raise InputError(f"{self.where}: {shown(self.segment(tree))} is too large for a number.")
        return out

    def refused(self, tree: ast.AST) -> InputError:
        """The error for a part of the text that is no formula."""
        what, allowed = shown(self.segment(tree)), _allowed(self.variables)
        return InputError(f"{self.where}: {what} is not allowed; write {allowed}.")

    def segment(self, tree: ast.AST) -> str:
        """The part of the text that ``tree`` was read from (the text is ASCII: offsets are columns)."""
        start, end = getattr(tree, "col_offset", 0), getattr(tree, "end_col_offset", None)
        return self.text[start:end]
