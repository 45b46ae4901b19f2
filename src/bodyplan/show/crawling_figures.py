"""Figure of a walk: footholds, body and support from above, and the walk from the side."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import BodyplanError
from bodyplan.ground.field import Field
from bodyplan.motion import Motion
from bodyplan.robot.masses import center_from_poses
from bodyplan.show.crawling_loads import LEGS, is_crawl, stood
from bodyplan.show.series import EXECUTED

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: cells of the ground along its longer side, heights of its contour lines in all, and their colour
CELLS, CONTOURS, SHADE = 160, 9, "#8a8f94"
#: m around all that is drawn; inches of titles and axes; least and largest height of the figure, inches
ROOM, FRAME, LEAST, MOST = 0.06, 2.3, 5.0, 11.0


def walk_figure(motion: Motion, new_figure: Callable[[float], Figure]) -> Figure | None:
    """From above: ground, footholds, ways of the feet, body, centre of mass and the support of each swing of the first
    cycle; the same from the side, to the same scale."""
    if not is_crawl(motion):
        return None
    robot = motion.robot
    feet = stood(motion)
    poses = robot.forward(motion.q, motion.base)
    places = np.stack([poses[robot.contacts[k].frame][:, :3] for k in feet], axis=1)
    standing = np.asarray(motion.contacts)[:, feet] > 0.5
    center = center_from_poses(robot, poses.array)
    body = motion.base[:, :3]
    every = np.concatenate([places.reshape(-1, 3), body])
    low, high = every.min(axis=0) - ROOM, every.max(axis=0) + ROOM
    wide, deep, tall = high - low
    made = new_figure(float(np.clip(7.4 * (deep + tall) / wide + FRAME, LEAST, MOST)))
    made.set_layout_engine("constrained")
    above, side = made.subplots(2, 1, height_ratios=[deep, tall], sharex=True)
    _ground(above, motion.ground, low, high)
    _supports(above, places, standing)
    for j, k in enumerate(feet):
        color = LEGS[j % len(LEGS)]
        at = _footholds(places[:, j], standing[:, j])
        for ax, up in ((above, 1), (side, 2)):
            ax.plot(places[:, j, 0], places[:, j, up], color=color, linewidth=0.8, alpha=0.8)
            label = robot.contacts[k].name if ax is above else None
            ax.plot(at[:, 0], at[:, up], "o", markersize=4, color=color, label=label)
    for ax, up in ((above, 1), (side, 2)):
        ax.plot(body[:, 0], body[:, up], color="#1c2530", linewidth=1.5, label="body" if ax is above else None)
        name = "centre of mass" if ax is above else None
        ax.plot(center[:, 0], center[:, up], color=EXECUTED, linewidth=1.0, linestyle="--", label=name)
        ax.set_aspect("equal", adjustable="box")
        ax.set_xlim(low[0], high[0])
        ax.grid(False)
    above.set_ylim(low[1], high[1])
    above.set_ylabel("y (m)")
    x = np.linspace(low[0], high[0], 400)
    order = np.argsort(body[:, 0])
    middle = np.interp(x, body[order, 0], body[order, 1])
    try:
        under = np.asarray(motion.ground.height(x, middle))
        side.fill_between(x, under, low[2], color=SHADE, alpha=0.25, linewidth=0)
        side.plot(x, under, color=SHADE, linewidth=1.2)
        low[2] = min(low[2], float(under.min()) - 0.5 * ROOM)
    except BodyplanError:  # beyond the edge of a map
        pass
    side.set_ylim(low[2], high[2])
    side.set_xlabel("x (m)")
    side.set_ylabel("z (m)")
    above.set_title("from above: footholds, ways of the feet, body, and the support of each swing of the first cycle")
    side.set_title("from the side: ground under the body, ways of the feet, body")
    made.legend(*above.get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8)
    return made


def _ground(ax: Any, ground: Any, low: Array, high: Array) -> None:
    """The height of the ground as shades and contour lines, where it is not level."""
    span = high[:2] - low[:2]
    nx, ny = (max(2, int(CELLS * s / span.max())) for s in span)
    x, y = np.meshgrid(np.linspace(low[0], high[0], nx), np.linspace(low[1], high[1], ny))
    try:
        z = 1e3 * np.asarray(ground.height(x, y))
    except BodyplanError:  # beyond the edge of a map
        return
    if np.ptp(z) > 1e-6:
        shades = ax.pcolormesh(x, y, z, cmap="Greys", alpha=0.45, shading="auto", rasterized=True)
        if isinstance(ground, Field):  # of steps the shades say enough
            lines = ax.contour(x, y, z, levels=CONTOURS, colors=SHADE, linewidths=0.5)
            ax.clabel(lines, fontsize=6, fmt="%g")
        ax.figure.colorbar(shades, ax=ax, label="ground (mm)", shrink=0.8, pad=0.02)


def _supports(ax: Any, places: Array, standing: Any) -> None:
    """The feet that stand, joined round, at the middle of every swing of the first cycle."""
    swings = np.flatnonzero(np.diff((~standing).any(axis=1).astype(int)) != 0)
    for start, end in list(zip(swings[0::2], swings[1::2], strict=False))[: standing.shape[1]]:
        k = (start + end) // 2
        corners = places[k][standing[k], :2]
        middle = corners.mean(axis=0)
        order = np.argsort(np.arctan2(*(corners - middle).T[::-1]))
        ax.fill(*corners[order].T, facecolor="#56b4e9", alpha=0.10, edgecolor="#56b4e9", linewidth=0.7)


def _footholds(place: Array, standing: Any) -> Array:
    """Places (h, 3) where one foot stood."""
    begins = np.flatnonzero(standing & ~np.concatenate([[False], standing[:-1]]))
    return np.asarray(place[begins])
