"""Figures of a body on wheels: from above with the tracks of its contacts; maps over heading and height."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.errors import BodyplanError
from bodyplan.gaits.carry import Maps
from bodyplan.motion import Motion
from bodyplan.show.carrying import Carrying
from bodyplan.show.carrying_plots import color
from bodyplan.show.series import EXECUTED
from bodyplan.spatial import apply

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bodyplan.show.playback import Playback

#: cells of the ground along its longer side
CELLS = 160
#: what a cell of the first map is, and its colour
STATES = {
    "ok": ("held", "#9fd3b8"),
    "slips": ("slips", "#f2c14e"),
    "tips_over": ("tips over", "#d1495b"),
    "out_of_reach": ("wheel out of reach", "#c3ced9"),
    "below_floor": ("hull or axle in the ground", "#8a6f5c"),
    "no_contact": ("no contact", "#eceff2"),
    "not_converged": ("not known", "#000000"),
}
#: more friction than this is drawn alike
MOST_FRICTION = 1.0


def wheels_above(playback: Playback, new_figure: Callable[[float], Figure]) -> Figure | None:
    """From above: the ground, the body's path, where wheels touch, and the body at the beginning, middle and end; its
    path in physics."""
    found = playback.carrying
    if found is None:
        return None
    motion = found.motion
    made = None if playback.executed is None else playback.executed[:, 0]
    body = motion.base[found.chosen, :3]
    points = found.points
    shown = [(pose, "planned") for pose in motion.base[np.unique([0, len(motion.t) // 2, len(motion.t) - 1])]]
    if made is not None and len(made):
        shown.append((made[-1], "made"))
    plates = [(corners, kind) for pose, kind in shown for corners in _outlines(motion, pose)]
    every = np.concatenate([points.reshape(-1, 3), body, *([] if made is None else [made[:, :3]])])[:, :2]
    every = np.concatenate([every, *(corners for corners, _ in plates)])
    every = every[np.isfinite(every).all(axis=1)]
    low, high = every.min(axis=0) - 0.15, every.max(axis=0) + 0.15
    span = high - low
    figure = new_figure(float(np.clip(6.2 * span[1] / span[0] + 0.6, 2.6, 7.0)))
    ax = figure.subplots()
    _ground(ax, motion.ground, low, high)
    for k, name in enumerate(found.names):
        ax.plot(points[:, k, 0], points[:, k, 1], color=color(k), linewidth=1.1, label=f"contact of {name}")
    ax.plot(body[:, 0], body[:, 1], color="#333333", linewidth=1.4, label="body")
    for corners, kind in plates:
        if kind == "planned":
            ax.fill(*corners.T, facecolor="#33333318", edgecolor="#333333", linewidth=0.8)
        else:
            ax.fill(*corners.T, facecolor="none", edgecolor=EXECUTED, linewidth=1.0, linestyle="--")
    if made is not None and len(made):
        ax.plot(made[:, 0], made[:, 1], color=EXECUTED, linewidth=1.6, linestyle="--", label="body in physics")
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    ax.set_xlabel("x (m)")
    ax.set_ylabel("y (m)")
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=7)
    return figure


def _outlines(motion: Motion, pose: Array) -> list[Array]:
    """Corners (4, 2) m of the boxes of the hull of a base at ``pose`` (7,)."""
    signs = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    boxes = [c for c in motion.robot.contacts if c.shape == "box" and c.frame == "base"]
    return [np.asarray(apply(pose, np.array(c.start) + signs * np.array(c.half))[:, :2]) for c in boxes]


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
        ax.figure.colorbar(mesh, ax=ax, label="ground (mm)", shrink=0.7, location="bottom", aspect=40)


def wheels_maps(found: Carrying | None, new_figure: Callable[[float], Figure]) -> Figure | None:
    """What happens, the friction that is needed, and the distance to tipping over, by heading and height."""
    if found is None:
        return None
    made = found.maps()
    if isinstance(made, str):
        return None
    figure = new_figure(3.7)
    axes = figure.subplots(1, 3, sharey=True)
    _states(axes[0], made)
    psi, h = np.degrees(made.headings), 1e3 * made.heights
    need = np.where(np.isinf(made.required), np.nan, made.required)
    shown = [
        (axes[1], need, "viridis", "friction needed, μ*", {"vmin": 0.0}),
        (axes[2], 1e3 * made.margin, *_margins(1e3 * made.margin)),
    ]
    for ax, values, shades, name, limits in shown:
        if np.isfinite(values).any():
            top = float(np.nanmax(values))
            if ax is axes[1]:
                limits["vmax"] = min(max(top, 1e-3), MOST_FRICTION)
            mesh = ax.pcolormesh(psi, h, values, cmap=shades, shading="nearest", rasterized=True, **limits)
            figure.colorbar(mesh, ax=ax, location="top", label=name, aspect=30)
        else:
            ax.set_title(f"{name}: not known")
    _, heading, height = found.place
    for ax in axes:
        ax.plot(np.degrees(heading), 1e3 * height, "x", color="#000000", markersize=8, markeredgewidth=1.8)
        ax.grid(visible=False)
        ax.set_xticks([-180, -90, 0, 90, 180])
        ax.set_xlim(-180, 180)
        ax.set_xlabel("heading (°)")
        for line in (made.reach.lowest, made.reach.highest):
            ax.plot(psi, 1e3 * line, color="#333333", linewidth=0.8, linestyle=":")
    top, bottom = max(h.max(), 1e3 * height), min(h.min(), 1e3 * height)
    axes[0].set_ylim(bottom - 0.03 * (top - bottom), top + 0.03 * (top - bottom))
    axes[0].set_ylabel("height (mm)")
    return figure


def _margins(values: Array) -> tuple[str, str, dict[str, float]]:
    """Shades, name and limits of the margin: two colours where there is something to fear."""
    some, name = values[np.isfinite(values)], "inside the contacts (mm)"
    if len(some) and some.min() > 0.0:
        return "YlGn", name, {}
    size = float(np.abs(some).max()) if len(some) else 1.0
    return "PiYG", name, {"vmin": -size, "vmax": size}


def _states(ax: Any, made: Maps) -> None:
    """Cell by cell what the body does there."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    names = [name for name in STATES if np.any(made.status == name)]
    index = np.zeros(made.status.shape)
    for i, name in enumerate(names):
        index[made.status == name] = i
    colors = ListedColormap([STATES[name][1] for name in names])
    psi, h = np.degrees(made.headings), 1e3 * made.heights
    ax.pcolormesh(psi, h, index, cmap=colors, vmin=-0.5, vmax=len(names) - 0.5, shading="nearest", rasterized=True)
    patches = [Patch(facecolor=STATES[name][1], label=STATES[name][0]) for name in names]
    ax.legend(handles=patches, loc="lower left", bbox_to_anchor=(0.0, 1.02), fontsize=7, ncols=2, borderaxespad=0.0)
