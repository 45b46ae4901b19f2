"""The part of a report that shows a walk: footholds and body from above and from the side, how it stands, and what the
null space of resolved rates would buy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.check.support import polygon_margin
from bodyplan.errors import BodyplanError
from bodyplan.gaits.crawl import Benefit, Crawl, null_space
from bodyplan.motion import Motion
from bodyplan.robot.masses import center_from_poses
from bodyplan.show.layout import layout, line
from bodyplan.show.series import EXECUTED, PLANNED
from bodyplan.show.text import degrees, esc, figure, picture, plot, section, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: what the choices of the null space are called
NAMES = {
    "off": "null space not used",
    "printed": "(22) as printed",
    "text": "(22) as its text says",
    "barrier": "barrier on the support polygon, ours",
}
#: colours of legs, told apart by colour-blind eyes, too
LEGS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
#: samples of a long motion that are drawn, and cells of the ground along its longer side
SAMPLES, CELLS = 1500, 160


def is_crawl(motion: Motion) -> bool:
    """True for the plan of a :class:`bodyplan.Crawl` of a robot with masses."""
    return motion.gait.get("kind") == Crawl.kind and motion.contacts is not None and motion.robot.mass > 0.0


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
    out += plot("walk_margin", "Distance of the centre of mass from the nearest edge of the support polygon, planned.")
    return section("walk", "On its feet", out + _benefits(motion))


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
    made = layout("time (s)", "margin (mm)", 260)
    made["yaxis"]["zeroline"] = True
    return {"walk_margin": {"data": [line(motion.t[chosen] - motion.t[0], shown, "margin", PLANNED, showlegend=False)],
                            "layout": made}}  # fmt: skip


def _thin(motion: Motion) -> Any:
    count = len(motion.t)
    return np.unique(np.linspace(0, count - 1, min(count, SAMPLES)).round().astype(int))


def walk_figure(motion: Motion, new_figure: Callable[[float], Figure]) -> Figure | None:
    """From above: ground, footholds, body, centre of mass and the support of each swing; the same from the side."""
    if not is_crawl(motion):
        return None
    robot = motion.robot
    feet = [(k, c) for k, c in enumerate(robot.contacts) if np.asarray(motion.contacts)[:, k].any()]
    poses = robot.forward(motion.q, motion.base)
    places = np.stack([poses[c.frame][:, :3] for _, c in feet], axis=1)
    standing = np.stack([np.asarray(motion.contacts)[:, k] > 0.5 for k, _ in feet], axis=1)
    center = center_from_poses(robot, poses.array)
    body = motion.base[:, :3]
    made = new_figure(8.2)
    above, side = made.subplots(2, 1, height_ratios=[2.2, 1.0])
    every = np.concatenate([places.reshape(-1, 3), body])
    low, high = every.min(axis=0) - 0.08, every.max(axis=0) + 0.08
    _ground(above, motion.ground, low, high)
    _supports(above, places, standing)
    above.plot(body[:, 0], body[:, 1], color="#333333", linewidth=1.2, label="body")
    above.plot(center[:, 0], center[:, 1], color=EXECUTED, linewidth=0.9, linestyle="--", label="centre of mass")
    for j, (_, contact) in enumerate(feet):
        stood = _footholds(places[:, j], standing[:, j])
        above.plot(stood[:, 0], stood[:, 1], "o", markersize=4, color=LEGS[j % len(LEGS)], label=contact.name)
        side.plot(places[:, j, 0], places[:, j, 2], color=LEGS[j % len(LEGS)], linewidth=0.8)
    above.set_aspect("equal", adjustable="box")
    above.set_xlim(low[0], high[0])
    above.set_ylim(low[1], high[1])
    above.set_ylabel("y (m)")
    above.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), fontsize=7)
    x = np.linspace(low[0], high[0], 400)
    middle = np.interp(x, body[np.argsort(body[:, 0]), 0], body[np.argsort(body[:, 0]), 1])
    side.plot(x, motion.ground.height(x, middle), color="#8a8f94", linewidth=1.2)
    side.plot(body[:, 0], body[:, 2], color="#333333", linewidth=1.2)
    side.set_xlim(low[0], high[0])
    side.set_xlabel("x (m)")
    side.set_ylabel("z (m)")
    side.set_title("from the side: ground under the body, feet, body")
    above.set_title("from above: footholds, body, and the support of each swing in the first cycle")
    return made


def _ground(ax: Any, ground: Any, low: Array, high: Array) -> None:
    """The height of the ground as shades, where it is not level."""
    span = high[:2] - low[:2]
    nx, ny = (max(2, int(CELLS * s / span.max())) for s in span)
    x, y = np.meshgrid(np.linspace(low[0], high[0], nx), np.linspace(low[1], high[1], ny))
    try:
        z = ground.height(x, y)
    except BodyplanError:  # beyond the edge of a map
        return
    if np.ptp(z) > 1e-9:
        mesh = ax.pcolormesh(x, y, 1e3 * z, cmap="terrain", alpha=0.45, shading="auto", rasterized=True)
        ax.figure.colorbar(mesh, ax=ax, label="ground (mm)", shrink=0.7, pad=0.14)


def _supports(ax: Any, places: Array, standing: Any) -> None:
    """The feet that stand, joined round, at the middle of every swing of the first cycle."""
    swings = np.flatnonzero(np.diff((~standing).any(axis=1).astype(int)) != 0)
    for start, end in list(zip(swings[0::2], swings[1::2], strict=False))[: standing.shape[1]]:
        k = (start + end) // 2
        corners = places[k][standing[k], :2]
        middle = corners.mean(axis=0)
        order = np.argsort(np.arctan2(*(corners - middle).T[::-1]))
        ax.fill(*corners[order].T, facecolor="#56b4e9", alpha=0.12, edgecolor="#56b4e9", linewidth=0.7)


def _footholds(place: Array, standing: Any) -> Array:
    """Places (h, 3) where one foot stood."""
    begins = np.flatnonzero(standing & ~np.concatenate([[False], standing[:-1]]))
    return np.asarray(place[begins])
