"""What a paper file declares, and how a verdict follows from numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Verdict(StrEnum):
    """What became of one thing that a paper prints."""

    REPRODUCED = "reproduced"  # ours is what is printed, to the digits printed
    CORRECTED = "corrected"  # it is not, and the entry says which equation is wrong and what is right
    NOT_REPRODUCIBLE = "not reproducible"  # no number of ours can decide, or none comes out; the entry says why
    DIFFERS = "differs"  # it is not, and nobody has said why
    ERROR = "error"  # computing it raised

    @property
    def fine(self) -> bool:
        """False where somebody has to look."""
        return self not in (Verdict.DIFFERS, Verdict.ERROR)


class Off(NamedTuple):
    """How far two formulas miss the same truth, found by a third way: the ``printed`` one, and ``ours``. In SI."""

    printed: float
    ours: float


#: relative slack of a comparison with a printed number: rounding of ours
ROUNDING = 1e-12
_NUMBER = re.compile(r"(?P<relation>[<>])?\s*(?P<value>-?\d+(?:\.(?P<decimals>\d*))?)(?:/(?P<under>\d+))?")


@dataclass(frozen=True)
class Printed:
    """A number as a paper prints it: "83.107897", "480.", "1/4", "< 1", "> 0". ``resolution``: one unit of its last
    digit; ``under`` of a fraction 1/4 is 4."""

    text: str
    value: float
    resolution: float
    relation: str = ""
    under: int | None = None

    @classmethod
    def of(cls, text: str) -> Printed | None:
        """None for what is no number."""
        match = _NUMBER.fullmatch(text.strip())
        if match is None:
            return None
        value, under = float(match["value"]), match["under"]
        if under is not None:
            return cls(text, value / int(under), value / int(under) ** 2, match["relation"] or "", int(under))
        return cls(text, value, 10.0 ** -len(match["decimals"] or ""), match["relation"] or "")

    def holds(self, value: float) -> bool:
        """Whether a value is the printed number to its last digit, or meets its relation."""
        if not math.isfinite(value):
            return False
        if self.relation:
            return value < self.value if self.relation == "<" else value > self.value
        if self.under is not None:  # "1/4": as a quotient, 1/ours rounds to 4
            return value != 0.0 and abs(self.value * self.under / value - self.under) <= 0.5
        return abs(value - self.value) <= 0.5 * self.resolution * (1.0 + ROUNDING) + ROUNDING * abs(self.value)

    def digits(self) -> int:
        """Significant digits to show of a number beside it: two more than printed, at least four."""
        return max(4, len(self.text.strip("<>- .").replace(".", "").lstrip("0")) + 2)


@dataclass(frozen=True)
class Entry:
    """One thing that a paper prints.

    ``place``: "Fig. 8", "(11)-(17)", "Table 2", "section 7"; what it covers is read off it. ``what``: the quantity, or
    what the equation or claim is about. ``printed``: a number as printed (see :class:`Printed`), or a formula.
    ``compute``: our number in SI, or for a formula its :class:`Off`; None where nothing can be computed. ``unit`` of
    both. ``correct``: the formula that is right. ``why``: what is wrong, beside ``correct``; must be given for what
    may be corrected. ``reason``: why it cannot be reproduced. ``tolerance``: of a formula, in SI. ``physics``: needs
    MuJoCo and seconds; left out unless asked for.

    The verdict is decided by the numbers: neither ``why`` nor ``reason`` makes a number that agrees corrected.
    """

    place: str
    what: str
    printed: str = ""
    compute: Callable[[], float | Off] | None = None
    unit: str = ""
    correct: str = ""
    why: str = ""
    reason: str = ""
    tolerance: float = 1e-9
    physics: bool = False

    def __post_init__(self) -> None:
        if self.compute is None and not self.reason:
            raise ValueError(f"{self.place}, {self.what}: nothing is computed, and no reason is given.")
        if self.why and self.reason:
            raise ValueError(f"{self.place}, {self.what}: give why it is wrong, or the reason why it cannot be had.")

    def verdict(self, found: float | Off) -> Verdict:
        """By the numbers alone; ``found`` in ``unit``, :class:`Off` in SI."""
        if isinstance(found, Off):
            ours = math.isfinite(found.ours) and found.ours <= self.tolerance
            if not ours:
                return Verdict.DIFFERS
            if math.isfinite(found.printed) and found.printed <= self.tolerance:
                return Verdict.REPRODUCED
            return Verdict.CORRECTED if self.why else Verdict.DIFFERS
        printed = Printed.of(self.printed)
        if printed is not None and printed.holds(found):
            return Verdict.REPRODUCED
        if self.reason:
            return Verdict.NOT_REPRODUCIBLE
        return Verdict.CORRECTED if self.why and math.isfinite(found) else Verdict.DIFFERS


@dataclass(frozen=True)
class Drawing:
    """A figure of the paper, drawn again from ours. ``draw`` fills an empty matplotlib figure of ``height`` inches."""

    place: str
    caption: str
    draw: Callable[[Figure], None]
    height: float = 2.6


@dataclass(frozen=True)
class Paper:
    """A paper: what it prints, and its figures redrawn. ``tables``, ``figures``, ``equations``: how many it numbers."""

    name: str
    title: str
    authors: str
    about: str
    tables: int
    figures: int
    equations: int
    entries: tuple[Entry, ...]
    drawings: tuple[Drawing, ...] = ()

    def missing(self) -> set[tuple[str, int]]:
        """Tables, figures and equations that no entry is about."""
        every = {
            (kind, number)
            for kind, count in (("table", self.tables), ("figure", self.figures), ("equation", self.equations))
            for number in range(1, count + 1)
        }
        return every - {item for entry in self.entries for item in covered(entry.place)}


_ROMAN = {"I": 1, "II": 2, "III": 3}


def covered(place: str) -> set[tuple[str, int]]:
    """The ("figure" | "table" | "equation", number) that a place names: "Figs. 3-5, 9, (11)-(17)"."""
    out: set[tuple[str, int]] = set()
    for kind, pattern in (("figure", r"Figs?\. ((?:\d+(?:\([a-z]\))?(?:-\d+)?(?:, )?)+)"),
                          ("table", r"Tables? ((?:[\dI]+(?:-\d+)?(?:, )?)+)")):  # fmt: skip
        for match in re.findall(pattern, place):
            for part in re.split(r", ", re.sub(r"\([a-z]\)", "", match).strip(", ")):
                low, _, high = part.partition("-")
                first = _ROMAN.get(low) or int(low)
                out |= {(kind, number) for number in range(first, int(high or first) + 1)}
    for low, high in re.findall(r"\((\d+)\)(?:-\((\d+)\))?", place):
        out |= {("equation", number) for number in range(int(low), int(high or low) + 1)}
    return out
