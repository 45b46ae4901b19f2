"""The parts that all plotly figure descriptions are made of."""

from __future__ import annotations

import html
from typing import Any

from bodyplan.show.series import compact

AXIS = {"gridcolor": "#e4e6e8", "zeroline": False, "automargin": True, "linecolor": "#9aa3ab"}


def layout(x: str, y: str, height: int = 340, **more: Any) -> dict[str, Any]:
    """A plot's layout with named axes; ``more`` overrides."""
    return {
        "height": height,
        "margin": {"l": 56, "r": 14, "t": 30, "b": 46},
        "font": {"family": "system-ui, sans-serif", "size": 13, "color": "#1c2530"},
        "paper_bgcolor": "#fff",
        "plot_bgcolor": "#fff",
        "xaxis": {**AXIS, "title": {"text": x}},
        "yaxis": {**AXIS, "title": {"text": y, "standoff": 6}},
        "legend": {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0},
        "hovermode": "closest",
        **more,
    }


def label(name: str) -> str:
    """A name as plotly shows it letter by letter: it reads labels as a kind of HTML."""
    return html.escape(name, quote=False)


def line(x: Any, y: Any, name: str, color: str, **more: Any) -> dict[str, Any]:
    """A curve; ``more`` overrides."""
    return {
        "type": "scatter",
        "mode": "lines",
        "x": compact(x),
        "y": compact(y),
        "name": name,
        "line": {"color": color, "width": 2, **more.pop("line", {})},
        **more,
    }
