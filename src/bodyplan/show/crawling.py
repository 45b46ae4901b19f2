"""The part of a report that shows a walk: footholds and body from above and from the side, how it stands, and what the
null space of resolved rates would buy."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from bodyplan.check.support import polygon_margin
from bodyplan.errors import BodyplanError
from bodyplan.gaits.crawl import Benefit, Crawl, null_space
from bodyplan.motion import Motion
from bodyplan.show.crawling_loads import is_crawl, loads_plots, loads_text
from bodyplan.show.layout import layout, line
from bodyplan.show.series import LIMIT, PLANNED
from bodyplan.show.text import degrees, esc, figure, picture, plot, section, table

#: what the choices of the null space are called
NAMES = {
    "off": "null space not used",
    "printed": "(22) as printed",
    "text": "(22) as its text says",
    "barrier": "barrier on the support polygon, ours",
}
#: samples of a long motion that are drawn; how much of the margin over its least is shown
SAMPLES, SHOWN = 1500, 4.0


def crawling_section(motion: Motion, pictures: Mapping[str, str]) -> str:
    """The section; empty for other gaits."""
    if not is_crawl(motion):
        return ""
    margin = polygon_margin(motion)
    k = int(margin.argmin())
    verb = "is at least" if margin[k] >= 0.0 else "goes down to"
    out = (
        f"<p>The distance of the centre of mass from the edges of its support {verb} <b>{figure(float(margin[k]), 'm')}"
        f"</b>, at {figure(float(motion.t[k] - motion.t[0]), 's', 3)}"
        + ("." if margin[k] >= 0.0 else ": <b>there the robot tips</b>.")
        + " It is that of the whole robot with its swinging leg, recomputed from forward kinematics.</p>"
    )
    if "walk" in pictures:
        out += picture(pictures["walk"], "Footholds, body and support from above, and the walk from the side")
    out += plot(
        "walk_margin",
        "Distance of the centre of mass from the nearest edge of the support polygon while a leg swings, planned; all "
        "feet stand where it is beyond the top. Red: what the plan was to keep.",
    )
    return section("walk", "On its feet", out + loads_text(motion) + _benefits(motion))


def _benefits(motion: Motion) -> str:
    span = min(float(motion.facts.get("cycle_time", 12.0)), float(motion.t[-1] - motion.t[0]))
    try:
        rows = _null_space(motion.robot, motion.gait, motion.ground, span)
    except BodyplanError as error:  # a report is worth having without this part
        return f"<p>The null space was not measured: {esc(error)}</p>"
    cells = [
        (
            NAMES[row.choice] + ("" if row.status == "ok" else f" <small>({esc(row.status)})</small>"),
            figure(row.margin, "m", 3),
            degrees(row.roll),
            degrees(row.pitch),
            figure(row.low, "m", 3),
            figure(row.high, "m", 3),
        )
        for row in rows
    ]
    worst = max(row.margin for row in rows)
    said = (
        "even the best choice leaves a negative margin: that walk tips, and only sway, as in this plan, mends it"
        if worst < 0.0
        else "what is left of the margin is the walk's own"
    )
    head = (
        "what the null space is used for",
        "least margin",
        "largest roll",
        "largest pitch",
        "lowest body",
        "highest",
    )
    return (
        "<h3>What the null space buys</h3><p>The paper commands the body’s x, y and yaw evenly and leaves height, roll "
        "and pitch to X = G<sup>#</sup> H Y + d (I − G<sup>#</sup>G) ρ. Over one cycle of that walk, with the same "
        f"steps, {said}. As printed, (22) crouches.</p>" + table(head, cells, numbers=range(1, 6))
    )


@lru_cache(maxsize=4)
def _cached(robot: Any, gait: Crawl, ground: Any, span: float) -> tuple[Benefit, ...]:
    return tuple(null_space(robot, gait, ground, span))


def _null_space(robot: Any, gait: Mapping[str, Any], ground: Any, span: float) -> tuple[Benefit, ...]:
    return _cached(robot, Crawl(**{name: value for name, value in gait.items() if name != "kind"}), ground, span)


def crawling_plots(motion: Motion) -> dict[str, dict[str, Any] | None]:
    """The margin over time."""
    if not is_crawl(motion):
        return {}
    chosen = _thin(motion)
    margin = 1e3 * polygon_margin(motion, chosen)
    shown = np.where(np.isfinite(margin), margin, np.nan)
    t = motion.t[chosen] - motion.t[0]
    made = layout("time (s)", "margin (mm)", 260)
    made["yaxis"]["zeroline"] = True
    curves = [line(t, shown, "margin", PLANNED, showlegend=False)]
    wanted = next((claim.data["required"] for claim in motion.claims if claim.kind == "supported"), None)
    low, high = float(np.nanmin(shown, initial=0.0)), float(np.nanmin(np.abs(shown), initial=np.inf))
    if wanted is not None:
        curves.append(line(t[[0, -1]], np.full(2, 1e3 * float(wanted)), "kept", LIMIT, showlegend=False,
                           line={"dash": "dash", "width": 1}))  # fmt: skip
        high = max(high, 1e3 * float(wanted))
    if np.isfinite(high) and high > 0.0:
        made["yaxis"]["range"] = [min(0.0, 1.1 * low), SHOWN * high]
    return {"walk_margin": {"data": curves, "layout": made}} | loads_plots(motion)


def _thin(motion: Motion) -> Any:
    count = len(motion.t)
    return np.unique(np.linspace(0, count - 1, min(count, SAMPLES)).round().astype(int))
