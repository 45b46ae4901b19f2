"""Numbers and words as a report shows them: escaped, with units, and a dash where there is nothing to
show."""

from __future__ import annotations

import base64
import html
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

NOTHING = "–"
#: deg: an angle below this is rounding
NO_ANGLE = 1e-9
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

#: last word of a quantity's name -> its SI unit, for numbers that come without one
_UNITS = {
    **dict.fromkeys(("period", "time", "duration"), "s"),
    **dict.fromkeys(("length", "width", "height", "radius", "distance", "advance", "squeeze", "gain"), "m"),
    **dict.fromkeys(("margin", "drive", "stride", "spread", "floor", "ceiling", "clearance"), "m"),
    **dict.fromkeys(("advance_per_cycle", "sideways_per_cycle", "wavelength", "lift"), "m"),
    **dict.fromkeys(("length_unit", "helix_pitch", "extension_in_flight"), "m"),
    **dict.fromkeys(("speed", "velocity", "speed_along_body"), "m/s"),
    **dict.fromkeys(("angle", "turn_per_cycle"), "rad"),
    "torsion": "rad/m",
    "rate": "rad/s",
    "peak_joint_acceleration": "rad/s²",
    "mass": "kg",
    "torque": "N m",
    "force": "N",
}


def esc(value: object) -> str:
    """Text that is safe in HTML, in attributes too."""
    return html.escape(str(value), quote=True)


def prose(text: str) -> str:
    """Text of a mission as HTML: what stands between backticks is code."""
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", esc(text))


def figure(value: float | None, unit: str = "", digits: int = 4, *, zeros: bool = False) -> str:
    """A number with its unit; lengths and speeds below 1 m in mm; a dash for None and what is not finite.
    ``zeros`` keeps those that end a fraction, so that all digits are there."""
    if value is None or not math.isfinite(value):
        return NOTHING
    if unit in ("m", "m/s") and 1e-6 <= abs(value) < 1.0:
        value, unit = 1e3 * value, "m" + unit
    shown = f"{value:#.{digits}g}" if zeros else f"{value:.{digits}g}"
    mantissa, _, power = shown.partition("e")
    mantissa = mantissa.removesuffix(".")
    text = mantissa.replace("-", "−") + (f"×10{str(int(power)).translate(_RAISED)}" if power else "")
    return f"{text} {unit}".replace(" ", "\u00a0") if unit else text


def elapsed(seconds: float) -> str:
    """A time that something took, in the unit that reads best."""
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if seconds >= 3.0 * size:
            return figure(seconds / size, unit, 3)
    return figure(seconds, "s", 3)


def percent(value: float | None) -> str:
    """A share as a percentage."""
    return figure(None if value is None else 100.0 * value, "%", 3, zeros=True)


def settled(degrees: float) -> float:
    """An angle in degrees; 0 where it is rounding."""
    return 0.0 if abs(degrees) < NO_ANGLE else degrees


def degrees(angle: float | None, digits: int = 3) -> str:
    """An angle in rad as degrees."""
    return figure(None if angle is None else settled(math.degrees(angle)), "°", digits, zeros=True)


def unit_of(name: str) -> str:
    """SI unit of a quantity by its name; empty where the name does not tell."""
    if name in _UNITS:
        return _UNITS[name]
    return "" if "_per_" in name else _UNITS.get(name.rsplit("_", 1)[-1], "")


def words(name: str) -> str:
    """A name with underscores as words."""
    return name.replace("_", " ")


def plain(value: Any) -> str:
    """Any value of a setting as text: numbers, texts, lists, tables."""
    if value is None:
        return NOTHING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (int, float)):
        return figure(float(value), digits=6)
    if isinstance(value, Mapping):
        return ", ".join(f"{words(str(k))} {plain(v)}" for k, v in value.items())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ", ".join(plain(v) for v in value)
    return str(value)


def listed(items: Iterable[str]) -> str:
    """ "a, b and c"."""
    all_items = list(items)
    return " and ".join([", ".join(all_items[:-1]), all_items[-1]]) if len(all_items) > 1 else "".join(all_items)


def counted(number: int, noun: str) -> str:
    """ "1 check", "3 checks"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def table(head: Sequence[str], rows: Iterable[Sequence[str]], *, kind: str = "", numbers: Sequence[int] = ()) -> str:
    """An HTML table in a box of its own that scrolls sideways. Cells are HTML: escape them first; ``numbers``
    are the columns to align at the right."""
    right = dict.fromkeys(numbers, ' class="n"')
    top = "".join(f'<th scope="col"{right.get(i, "")}>{cell}</th>' for i, cell in enumerate(head))
    body = "".join(
        "<tr>" + "".join(f"<td{right.get(i, '')}>{cell}</td>" for i, cell in enumerate(row)) + "</tr>\n" for row in rows
    )
    return (
        f'<div class="scroll" tabindex="0"><table class="{esc(kind)}"><thead><tr>{top}</tr></thead>\n'
        f"<tbody>{body}</tbody></table></div>\n"
    )


def pairs(rows: Iterable[tuple[str, str]]) -> str:
    """A table of names and values; cells are HTML."""
    return table(("", "value"), rows, kind="pairs", numbers=(1,))


def folded(summary: str, content: str, *, opened: bool = False) -> str:
    """Content that opens on a click; both are HTML."""
    return f"<details{' open' if opened else ''}><summary>{summary}</summary>\n{content}</details>\n"


def section(name: str, title: str, content: str) -> str:
    """A part of the page with a heading and a place to link to."""
    return f'<section id="{name}" class="part"><h2>{title}</h2>\n{content}</section>\n'


def picture(svg: str, alt: str) -> str:
    """A figure as part of the page, in a box of its own that scrolls sideways; ``alt`` says what it shows."""
    data = base64.b64encode(svg.encode("utf-8")).decode("ascii")
    return (
        f'<div class="scroll picture" tabindex="0"><img alt="{esc(alt)}" src="data:image/svg+xml;base64,{data}"></div>'
    )


def plot(name: str, caption: str = "") -> str:
    """Where a plot goes; the browser draws it there, and takes the place away where there is no such plot."""
    note = f"<figcaption>{esc(caption)}</figcaption>" if caption else ""
    return f'<figure class="plot"><div data-plot="{esc(name)}"></div>{note}</figure>\n'
