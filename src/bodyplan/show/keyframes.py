"""The body at key frames of one cycle, from above or from the side, with the ground around it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array, IntArray
from bodyplan.robot.model import Robot
from bodyplan.show.playback import Playback
from bodyplan.show.series import EXECUTED, PLANNED
from bodyplan.show.shapes import Scenery, arc_bones, arc_points, bones, extent, outline, ribbon, scenery
from bodyplan.show.stages import stages_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FRAMES = 7
TOP, SIDE = (0, 1), (0, 2)
#: travel in one cycle, in robot lengths, from which all key frames are drawn in one picture
FAR = 2.5
#: how a body is painted: the plan behind its execution, the plan alone, the execution
GHOST = {"facecolor": "#f5c477", "edgecolor": "#f5c477", "linewidth": 0.4}
SOLID = {"facecolor": PLANNED, "edgecolor": "#ffffff", "linewidth": 0.5}
REAL = {"facecolor": EXECUTED, "edgecolor": "#ffffff", "linewidth": 0.5}


def body_keyframes(playback: Playback, new_figure: Callable[[float], Figure], frames: int = FRAMES) -> Figure:
    """The planned body and, over it, the executed one at ``frames`` even times of the first cycle."""
    chosen = _frames(playback, frames)
    tracks = [playback.planned[chosen]]
    if playback.executed is not None:
        tracks.append(playback.executed[chosen[chosen < len(playback.executed)]])
    robot = playback.motion.robot
    low, high = extent([track for track in tracks if len(track)], robot)
    axes = view_of(playback)
    around = scenery(playback.motion.ground, low, high)
    flat = list(axes)
    size = float(np.linalg.norm(np.ptp(playback.planned[chosen[0], :, :3], axis=0)))
    span = (high - low)[flat]
    if np.linalg.norm(high - low) > FAR * max(size, 1e-9):
        return _in_one(playback, chosen, around, axes, (low, high), new_figure)
    columns = 1 if span[1] < 0.35 * span[0] else 2 if span[1] < 0.8 * span[0] else 4
    rows = -(-len(chosen) // columns)
    panel = 8.2 / columns
    figure = new_figure(min(rows * (panel * min(1.25 * float(span[1] / span[0]), 2.0) + 0.35) + 0.75, 14.0))
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for number, (ax, index) in enumerate(zip(grid.flat, chosen, strict=False)):
        _ground(ax, around, axes, float(np.mean((low + high)[3 - sum(axes)] * 0.5)))
        _robots(ax, playback, int(index), axes)
        ax.set_title(_caption(playback, float(playback.t[index])), fontsize=8, pad=3)
        _frame(ax, low, high, axes, last=number >= len(chosen) - columns, first=number % columns == 0)
    for ax in list(grid.flat)[len(chosen) :]:
        ax.set_visible(False)
    _legend(figure, playback)
    return figure


def view_of(playback: Playback) -> tuple[int, int]:
    """From the side where the body bends more up and down than sideways; else from above."""
    places = playback.planned[..., :3]
    sideways, upwards = (float(np.ptp(places[..., k], axis=1).max()) for k in (1, 2))
    return SIDE if sideways < 0.5 * upwards else TOP


def _frames(playback: Playback, frames: int) -> IntArray:
    times = np.linspace(0.0, min(playback.span, float(playback.t[-1])), frames)
    return np.unique(np.abs(playback.t[None, :] - times[:, None]).argmin(axis=1)).astype(np.int64)


def _caption(playback: Playback, t: float) -> str:
    now = [name for name, start, end in stages_of(playback) if start - 1e-9 <= t < end - 1e-9]
    return f"{t:.2f} s" + (f"   {', '.join(now)}" if now else "")


def _in_one(
    playback: Playback,
    chosen: IntArray,
    around: Scenery,
    axes: tuple[int, int],
    box: tuple[Array, Array],
    new_figure: Callable[[float], Figure],
) -> Figure:
    low, high = box
    span = (high - low)[list(axes)]
    figure = new_figure(float(np.clip(8.2 * span[1] / span[0] + 1.1, 2.6, 8.0)))
    ax = figure.subplots()
    _ground(ax, around, axes, float(0.5 * (low + high)[3 - sum(axes)]))
    for index in chosen:
        _robots(ax, playback, int(index), axes)
        x, y = playback.planned_centre[index, list(axes)]
        ax.annotate(f"{playback.t[index]:.2f} s", (x, y), fontsize=7, xytext=(0, 9), textcoords="offset points")
    _frame(ax, low, high, axes, last=True, first=True)
    _legend(figure, playback)
    return figure


def _robots(ax: Axes, playback: Playback, index: int, axes: tuple[int, int]) -> None:
    robot, executed = playback.motion.robot, playback.executed
    there = executed is not None and index < len(executed)
    _robot(ax, robot, playback.planned[index], axes, GHOST if there else SOLID)
    if executed is not None and there:
        _robot(ax, robot, executed[index], axes, REAL)


def _robot(ax: Axes, robot: Robot, poses: Array, axes: tuple[int, int], style: Mapping[str, Any]) -> None:
    from matplotlib.collections import LineCollection, PolyCollection

    flat = list(axes)
    arcs = arc_bones(robot)
    paths = {(a, b): arc_points(poses[a], poses[b], length)[:, flat] for (a, b), (length, _) in arcs.items()}
    lines = [paths[pair] if pair in paths else poses[list(pair), :3][:, flat] for pair in bones(robot)]
    if lines:
        ax.add_collection(LineCollection(lines, colors=style["facecolor"], linewidths=1.6))
    polygons = [ribbon(paths[pair], radius) for pair, (_, radius) in arcs.items() if radius > 0.0]
    polygons += [p for c in robot.contacts for p in outline(c, poses[robot.frame_index(c.frame)], axes)]
    if polygons:
        ax.add_collection(PolyCollection(polygons, **style))


def _ground(ax: Axes, around: Scenery, axes: tuple[int, int], depth: float) -> None:
    """Walls, steps and hills; ``depth`` m is where along the third axis a side view cuts the hills."""
    from matplotlib.collections import PolyCollection

    flat, third = list(axes), 3 - sum(axes)
    toward = 1.0 if axes == TOP else -1.0
    shown = [f for f in around.faces if toward * f.normal[third] > 0.7]
    # from above a floor is what one stands on: only its edges matter
    solid = [f.corners[:, flat] for f in shown if axes == SIDE or f.role == "wall"]
    edges = [f.corners[:, flat] for f in shown if axes == TOP and f.role != "wall"]
    if solid:
        ax.add_collection(PolyCollection(solid, facecolor="#c9ced3", edgecolor="#8d97a1", linewidth=0.6))
    if edges:
        ax.add_collection(PolyCollection(edges, facecolor="none", edgecolor="#c3c9ce", linewidth=0.6))
    for x, y, z in around.fields:
        if axes == TOP:
            ax.pcolormesh(x, y, z, cmap="Greys", alpha=0.5, shading="gouraud", rasterized=True)
        else:
            row = int(np.abs(y - depth).argmin())
            ax.fill_between(x, z[row], z.min() - 0.05 * np.ptp(x), color="#c9ced3")
    if axes == SIDE:
        for plane in around.planes:
            ax.plot(plane[:2, 0], plane[:2, 2], color="#8d97a1", linewidth=1.0)


def _frame(ax: Axes, low: Array, high: Array, axes: tuple[int, int], *, last: bool, first: bool) -> None:
    flat = list(axes)
    (x0, y0), (x1, y1) = low[flat], high[flat]
    pad = 0.12 * (y1 - y0)
    ax.set_xlim(x0, x1)
    ax.set_ylim(y0 - pad, y1 + pad)
    ax.set_aspect("equal")
    ax.grid(False)
    ax.tick_params(labelsize=7)
    if last:
        ax.set_xlabel("x (m)")
    if first:
        ax.set_ylabel(f"{'xyz'[axes[1]]} (m)", fontsize=8)


def _legend(figure: Figure, playback: Playback) -> None:
    from matplotlib.patches import Patch

    styles = {"planned": SOLID} if playback.executed is None else {"planned": GHOST, "executed in physics": REAL}
    handles = [Patch(facecolor=str(style["facecolor"]), label=name) for name, style in styles.items()]
    figure.legend(handles=handles, loc="outside upper right", ncols=2, fontsize=8)
