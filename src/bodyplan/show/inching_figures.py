"""Pictures of a snake on its anchors: from the side at key times, and its footholds over steps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bodyplan.arrays import Array
from bodyplan.show.inching import Inching, NotShown
from bodyplan.show.series import LIMIT, PLANNED, SERIES
from bodyplan.show.stages import Stage, cycle_number, plain_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: most pictures
MOST = 8
#: bodies drawn on the whole way
BODIES = 6
GOOD = SERIES[2]
SOIL, EDGE, INK = "#c9ced3", "#8d97a1", "#33404d"


@dataclass(frozen=True)
class Key:
    """A picture: the sample, and its caption."""

    index: int
    caption: str


def keys(found: Inching) -> list[Key]:
    """Start, middle and end of every move of a cycle; over steps, and where there are many moves, middles of moves that
    are spread over all of them, between the start and the end. And where it tips most."""
    last = len(found.t) - 1
    first_cycle = found.moves if found.cyclic else _first_cycle(found.moves)
    whole_way = not found.track.level
    moves = found.moves if whole_way else first_cycle
    if not whole_way and 1 + 2 * len(moves) <= MOST:
        chosen = [(move[1], "") for move in moves[:1]]
        for numbered, start, end in moves:
            name = plain_name(numbered)
            chosen += [(0.5 * (start + end), name), (end, f"after {name}")]
    else:
        some = [moves[k] for k in np.unique(np.linspace(0, len(moves) - 1, MOST - 2).round().astype(int))]
        chosen = [(found.t[0], ""), *((0.5 * (a + b), name) for name, a, b in some), (moves[-1][2], "at the end")]
    worst = None if found.margin is None else int(found.margin.argmin())
    if worst is not None and found.tips(worst):
        chosen.append((found.t[worst], plain_name(found.move_at(float(found.t[worst])))))
    out: dict[int, Key] = {}
    for t, name in chosen:
        if t <= found.t[last] + 1e-9:
            index = found.sample(float(t))
            out.setdefault(index, Key(index, f"{found.t[index]:.2f} s   {name}".rstrip()))
    return [out[index] for index in sorted(out)]


def _first_cycle(moves: tuple[Stage, ...]) -> tuple[Stage, ...]:
    return tuple(move for move in moves if cycle_number(move[0]) == cycle_number(moves[0][0]))


def side_views(found: Inching | NotShown | None, new_figure: Callable[[float], Figure]) -> Figure | None:
    """The body on its anchors at the key times, from the side, all at one scale."""
    if not isinstance(found, Inching) or not found.moves:
        return None
    shown = keys(found)
    boxes = np.array([_box(found, key.index) for key in shown])  # (k, 2, 2)
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    own = float((boxes[:, 1, 0] - boxes[:, 0, 0]).max())
    together = high[0] - low[0] <= 1.5 * own
    width = float(high[0] - low[0]) if together else own
    size = 1.06 * width
    bottom, top = float(low[1] - 0.045 * size), float(high[1] + 0.03 * size)
    ratio = (top - bottom) / size
    columns = 1 if ratio < 0.2 else 2 if ratio < 0.7 else 3
    rows = -(-len(shown) // columns)
    figure = new_figure(rows * (7.9 / columns * ratio + 0.42) + 0.75)
    grid = figure.subplots(rows, columns, squeeze=False)
    for number, (ax, key) in enumerate(zip(grid.flat, shown, strict=False)):
        middle = 0.5 * (low[0] + high[0]) if together else float(boxes[number, :, 0].mean())
        window = middle - 0.5 * size, middle + 0.5 * size
        draw_ground(ax, found, window, (bottom, top))
        draw_body(ax, found, key.index, bottom)
        _caption(ax, found, key)
        ax.set_xlim(*window)
        ax.set_ylim(bottom, top)
        ax.set_aspect("equal")
        ax.grid(False)
        ax.tick_params(labelsize=7)
        ax.locator_params(axis="y", nbins=4)
        if number % columns == 0:
            ax.set_ylabel("z (m)", fontsize=8)
        if number >= len(shown) - columns:
            ax.set_xlabel(axis_name(found), fontsize=8)
    for ax in list(grid.flat)[len(shown) :]:
        ax.set_visible(False)
    _legend(figure)
    return figure


def axis_name(found: Inching) -> str:
    """What the distance along the way is called."""
    return "x (m)" if np.allclose(found.way, [1.0, 0.0, 0.0]) else "along the way (m)"


def _box(found: Inching, k: int) -> Array:
    """Corners (2, 2) m around the body, the floor under it, and the ceiling where it is near."""
    points, radius = found.points[k], max(found.snake.top, found.snake.rest)
    low, high = points.min(axis=0) - radius, points.max(axis=0) + radius
    tall = 2.0 * float(found.snake.links.max())
    floors = [z for _, _, z in found.floor.between(float(low[0]), float(high[0]))]
    ceilings = [z for _, _, z in found.ceiling.between(float(low[0]), float(high[0]))]
    low[1] = min([low[1], *floors])
    high[1] = max([high[1], *(z for z in ceilings if z < low[1] + 1.3 * tall)])
    return np.array([low, high])


def draw_ground(ax: Axes, found: Inching, window: tuple[float, float], span: tuple[float, float]) -> None:
    """Floor and ceiling as solids, with their outlines."""
    for levels, to in ((found.floor, span[0]), (found.ceiling, span[1])):
        some = [level for level in levels.between(*window) if np.isfinite(level[2])]
        for start, end, z in some:
            ax.fill_between([start, end], [z, z], [to, to], color=SOIL, linewidth=0.0, zorder=0)
        # an upright face belongs to both of its levels
        xs = [x for start, end, _ in some for x in (start, end)]
        ax.plot(xs, [z for _, _, z in some for _ in (0, 1)], color=EDGE, linewidth=0.9, zorder=1)


def draw_body(ax: Axes, found: Inching, k: int, bottom: float) -> None:
    """Links, elbows, anchors that stand (filled) and swing (hollow), centre of mass with its plumb line, and what
    carries it; red where it tips."""
    points, standing = found.points[k], found.standing[k]
    anchors, elbows = found.anchors[k], found.elbows[k]
    ax.plot(*points.T, color=PLANNED, linewidth=2.4, solid_joinstyle="round", zorder=3)
    ax.plot(*elbows.T, "o", color=PLANNED, markersize=3.5, zorder=4)
    ax.plot(*anchors[standing].T, "o", color=INK, markersize=6.0, zorder=5)
    ax.plot(*anchors[~standing].T, "o", markerfacecolor="white", markeredgecolor=INK, markersize=6.0, zorder=5)
    if found.gait.ceiling is not None:
        level = float(anchors[:, 1].min()) + found.gait.ceiling
        ax.plot(points[[0, -1], 0], [level, level], color=EDGE, linewidth=0.9, linestyle=(0, (5, 3)), zorder=1)
    if found.centre is None:
        return
    x, z = found.centre[k]
    color = LIMIT if found.tips(k) else GOOD
    under = min([level for a, b, level in found.floor.between(x - 1e-9, x + 1e-9)], default=bottom)
    rear, front = float(found.rear[k]), float(found.front[k])
    line = under - 0.45 * (under - bottom)
    line = min(line, *(level - 0.3 * (under - bottom) for _, _, level in found.floor.between(rear, front + 1e-9)))
    ax.plot([x, x], [z, line], color=color, linewidth=1.2, linestyle=(0, (3, 2)), zorder=4)
    ax.plot([rear, front], [line, line], color=color, linewidth=3.2, solid_capstyle="butt", zorder=2)
    ax.plot([rear, front], [line, line], "|", color=color, markersize=9.0, markeredgewidth=1.4, zorder=2)
    ax.plot(x, z, "o", color=color, markersize=6.5, markeredgecolor="white", zorder=6)


def _caption(ax: Axes, found: Inching, key: Key) -> None:
    said, color = key.caption, INK
    if found.margin is not None:
        tips, margin = found.tips(key.index), float(found.margin[key.index])
        if tips:
            said, color = f"{said}   tips {tips}: {_length(-margin)} beyond", LIMIT
        else:
            said += f"   margin {_length(margin)}"
    ax.set_title(said, fontsize=8, pad=3, color=color)


def _length(x: float) -> str:
    return f"{1e3 * x:.3g} mm" if abs(x) < 1.0 else f"{x:.3g} m"


def _legend(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    swinging = Line2D([], [], marker="o", linestyle="", label="swinging anchor")
    swinging.set(markerfacecolor="white", markeredgecolor=INK)
    handles = [
        Line2D([], [], color=PLANNED, linewidth=2.4, marker="o", markersize=3.5, label="links, elbows"),
        Line2D([], [], color=INK, marker="o", linestyle="", label="standing anchor"),
        swinging,
        Line2D([], [], color=GOOD, marker="o", linestyle="--", label="centre of mass"),
        Line2D([], [], color=GOOD, linewidth=3.2, label="what carries it"),
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=5, fontsize=7.5)


def footholds(found: Inching | NotShown | None, new_figure: Callable[[float], Figure]) -> Figure | None:
    """The whole way over steps: the body at some times, and where every anchor stood."""
    if not isinstance(found, Inching) or found.track.level or not found.moves:
        return None
    # in the middle of moves the body shows more of itself
    some = [found.moves[k] for k in np.unique(np.linspace(0, len(found.moves) - 1, BODIES).round().astype(int))]
    chosen = [found.sample(0.5 * (start + end)) for _, start, end in some]
    boxes = np.array([_box(found, int(k)) for k in np.arange(0, len(found.t), max(1, len(found.t) // 200))])
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    size = 1.04 * float(high[0] - low[0])
    window = (float(0.5 * (low[0] + high[0]) - 0.5 * size), float(0.5 * (low[0] + high[0]) + 0.5 * size))
    bottom, top = float(low[1] - 0.02 * size), float(high[1] + 0.02 * size)
    tall = 7.9 * (top - bottom) / size
    count = found.anchors.shape[1]
    figure = new_figure(tall + 0.28 * count + 1.3)
    side, below = figure.subplots(2, 1, sharex=True, height_ratios=[tall, 0.28 * count + 0.2])
    draw_ground(side, found, window, (bottom, top))
    for shade, k in zip(np.linspace(0.35, 1.0, len(chosen)), chosen, strict=True):
        side.plot(*found.points[k].T, color=PLANNED, linewidth=1.6, alpha=float(shade), zorder=3)
    for i in range(count):
        x = found.anchors[:, i, 0]
        stands = found.standing[:, i]
        below.plot(x, np.full(len(x), i + 1.0), color=EDGE, linewidth=0.7, zorder=1)
        places = np.unique(np.round(x[stands], 9))
        below.plot(places, np.full(len(places), i + 1.0), "o", color=INK, markersize=3.5, zorder=3)
    for at in found.floor.breaks[np.diff(found.floor.z) != 0.0]:
        below.axvline(float(at), color=LIMIT, linewidth=0.9, linestyle=":", zorder=0)
    side.set_xlim(*window)
    side.set_ylim(bottom, top)
    side.set_aspect("equal")
    side.grid(False)
    side.tick_params(labelsize=7)
    side.locator_params(axis="y", nbins=4)
    side.set_ylabel("z (m)", fontsize=8)
    side.set_title(f"The whole way; the body at {len(chosen)} times", fontsize=9)
    below.set_ylim(0.4, count + 0.6)
    below.grid(False)
    below.set_yticks(np.arange(1, count + 1))
    below.tick_params(labelsize=7)
    below.set_ylabel("anchor", fontsize=8)
    below.set_xlabel(axis_name(found), fontsize=8)
    below.set_title("Where each anchor stood (dots); dotted: steps of the floor", fontsize=9)
    return figure
