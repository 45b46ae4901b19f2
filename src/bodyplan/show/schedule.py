"""Which parts the plan means to touch the ground, and when."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.show.crawling_loads import is_crawl, stood
from bodyplan.show.layout import label, layout
from bodyplan.show.playback import Playback
from bodyplan.show.series import PLANNED, compact, one_cycle
from bodyplan.show.text import counted, figure, percent, plot

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LIFTED = "#edf0f2"


def schedule(playback: Playback) -> tuple[Array, tuple[str, ...], Array] | None:
    """Times (k,) s of one cycle, names of the contacts and (k, c) 1 where they are to touch; None where the plan does
    not say, or means everything to touch always."""
    motion = playback.motion
    if motion.contacts is None or motion.contacts.size == 0 or bool(np.all(motion.contacts)):
        return None
    chosen = one_cycle(playback)
    # of a robot on feet only they are ever to touch, and not the shell of its links and body
    kept = stood(motion) if is_crawl(motion) else list(range(len(motion.robot.contacts)))
    names = tuple(motion.robot.contacts[k].name for k in kept)
    return motion.t[chosen] - motion.t[0], names, (motion.contacts[chosen][:, kept] > 0.5).astype(float)


def schedule_part(playback: Playback) -> str:
    """The schedule in words, and where its plot goes; empty where there is none."""
    found = schedule(playback)
    if found is None:
        return ""
    touching = found[2].sum(axis=1)
    said = (
        f"Of {counted(len(found[1]), 'part')}, {figure(float(touching.min()))} to {figure(float(touching.max()))} are "
        f"meant to touch the ground at a time; each is on the ground for {percent(float(found[2].mean()))} of the "
        "cycle on average."
    )
    return f"<h3>What touches the ground, and when</h3><p>{said}</p>" + plot("contacts", "Coloured: meant to touch.")


def schedule_plot(playback: Playback) -> dict[str, Any] | None:
    """A strip a part: coloured while it is to touch."""
    found = schedule(playback)
    if found is None:
        return None
    t, names, touching = found
    trace = {
        "type": "heatmap",
        "x": compact(t),
        "y": [label(name) for name in names],
        "z": touching.T.astype(int).tolist(),
        "zmin": 0,
        "zmax": 1,
        "ygap": 1,
        "colorscale": [[0.0, LIFTED], [1.0, PLANNED]],
        "showscale": False,
        "hovertemplate": "%{y}, %{x} s<extra></extra>",
    }
    made = layout("time (s)", "", max(220, 90 + 13 * len(names)))
    made["yaxis"].update({"tickfont": {"size": 10}, "type": "category"})
    return {"data": [trace], "layout": made}


def schedule_figure(playback: Playback, new_figure: Callable[[float], Figure]) -> Figure | None:
    """The same for papers and slides."""
    found = schedule(playback)
    if found is None:
        return None
    t, names, touching = found
    made = new_figure(max(2.2, 0.8 + 0.14 * len(names)))
    ax = made.subplots()
    for row in range(len(names)):
        ax.broken_barh(_stretches(t, touching[:, row] > 0.5), (row - 0.4, 0.8), color=PLANNED)
    step = max(1, -(-len(names) // 30))
    ax.set_yticks(np.arange(0, len(names), step), names[::step], fontsize=7)
    ax.set_ylim(-0.6, len(names) - 0.4)
    ax.set_xlim(t[0], t[-1])
    ax.set_xlabel("time (s)")
    ax.set_title("Parts meant to touch the ground")
    return made


def _stretches(t: Array, on: Any) -> list[tuple[float, float]]:
    """(start, length) of the stretches of time in which ``on`` (k,) holds; a sample stands for the time to the next."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]]).astype(int)))
    stop = np.append(t, t[-1])
    return [(float(t[a]), float(stop[b] - t[a])) for a, b in edges.reshape(-1, 2)]
