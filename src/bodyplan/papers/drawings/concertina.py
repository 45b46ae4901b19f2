"""Figs. 4, 6, 8, 10-12 and 14 of paper *concertina*."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bodyplan.curves import ConcertinaCurve, dynamic_curve
from bodyplan.curves.dynamic import crossing_of
from bodyplan.fitting import exact_link_length, links_on_curve
from bodyplan.gaits.stretching import stretching
from bodyplan.papers.entries import Drawing
from bodyplan.show.series import EXECUTED, LIMIT, PLANNED, SERIES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MODULES = 4


def _dynamic(figure: Figure) -> None:
    ax, x = figure.subplots(), np.linspace(0.0, 10.0, 400)
    for gamma, color in zip((0.0, 0.2, 0.4, 0.6, 0.8, 1.0), SERIES, strict=True):
        ax.plot(x, dynamic_curve(x, gamma), color=color, label=f"γ = {gamma:g}")
    ax.set_xlabel("x")
    ax.set_ylabel("F(x)")
    figure.legend(loc="outside upper right", fontsize=8, ncols=6)


def _modules(figure: Figure) -> None:
    ax, curve = figure.subplots(), ConcertinaCurve([0.0] * MODULES, 0.0)
    edges = [0.0, *(0.5 * np.pi + k * np.pi for k in range(MODULES + 1)), float(curve.flat_from)]
    names = ["tail", *(f"body {k + 1}" for k in range(MODULES)), "head"]
    for k, name in enumerate(names):
        x = np.linspace(edges[k], edges[k + 1], 80)
        ax.plot(x, curve(x), color=SERIES[k % 2], linewidth=2.4)
        ax.text(0.5 * (edges[k] + edges[k + 1]), 1.12, name, ha="center", fontsize=8)
        ax.axvline(edges[k + 1], color="#9aa3ab", linewidth=0.6)
    x = np.linspace(0.0, 0.5 * np.pi, 40)
    ax.plot(x, -np.sin(x), "--", color=LIMIT, linewidth=1.2, label="tail as printed, (2)")
    ax.set_ylim(-1.25, 1.35)
    ax.set_xlabel("x")
    ax.set_ylabel("y")
    figure.legend(loc="outside upper right", fontsize=8)


def _crossings(figure: Figure) -> None:
    ax, x = figure.subplots(), np.linspace(0.0, 10.0, 400)
    for k, (gamma, color) in enumerate(zip((0.01, 0.25, 0.55, 0.80), SERIES, strict=False)):
        ax.plot(x, dynamic_curve(x, gamma), color=color, label=f"γ = {gamma:g}")
        at = float(crossing_of(gamma, 1.0, 2))
        ax.plot(at, 0.0, "o", color=color, markersize=5)
        place = (at - (0.9 if k == 0 else 0.2), (0.3, -0.4, 0.3, 0.3)[k])
        ax.annotate(f"x'$_{k + 1}$ = {at:.3f}", (at, 0.0), place, fontsize=8, color=color,
                    bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8})  # fmt: skip
    ax.axhline(0.0, color="#555", linewidth=0.8)
    ax.set_xlabel("x")
    ax.set_ylabel("F(x)")
    figure.legend(loc="outside upper right", fontsize=8, ncols=4)


def _head(figure: Figure) -> None:
    ax = figure.subplots()
    for gamma, color in zip((0.0, 0.2, 0.4, 0.6, 0.8), SERIES, strict=False):
        curve = ConcertinaCurve([0.0] * MODULES, gamma)
        start = 0.5 * np.pi + MODULES * np.pi
        x = np.linspace(0.0, 11.0, 400)
        ax.plot(x, curve(start + x), color=color, label=f"γ = {gamma:g}")
    ax.set_xlabel("x − x_head")
    ax.set_ylabel("y")
    ax.legend(fontsize=8, ncols=5, loc="upper right")


def _stages(figure: Figure) -> None:
    stages = stretching(MODULES, 0.8, np.ones(MODULES + 2), 0.0, "linear")
    values = np.array([0.0, 1.0, 1.5, 2.5, 4.5, 5.6, stages.total])
    p = stages.parameters(values)
    curve = ConcertinaCurve(p[:, 1:-1], p[:, -1], tail=p[:, 0])
    x = np.linspace(0.0, 27.0, 700)
    names = ("contracted", "head stretched", "module 4 stretching", "module 3 stretching", "module 1 stretching",
             "tail stretching", "flat")  # fmt: skip
    axes = figure.subplots(len(values), 1, sharex=True, sharey=True)
    for ax, y, name in zip(axes, curve(x), names, strict=True):
        ax.plot(x, y, color=EXECUTED)
        ax.set_yticks([])
        ax.set_title(name, fontsize=8, pad=1)
        ax.set_ylim(-1.2, 1.2)
    axes[-1].set_xlabel("x")


def _links(figure: Figure) -> None:
    ax, curve = figure.subplots(), ConcertinaCurve([0.0] * MODULES, 0.0)
    length = float(exact_link_length(26, MODULES, 1.0))
    points = links_on_curve(curve, length, 26).points
    x = np.linspace(0.0, float(curve.flat_from), 500)
    ax.plot(x, curve(x), color="#009e73", linewidth=4.0, alpha=0.45, label="body curve")
    ax.plot(*points.T, "-o", color=EXECUTED, markersize=3.5, linewidth=1.4, label=f"26 links of {length:.6f}")
    turn = np.linspace(0.0, 2.0 * np.pi, 80)
    for k in (2, 3, 4):
        ring = points[k][:, None] + length * np.array([np.cos(turn), np.sin(turn)])
        ax.plot(*ring, color=PLANNED, linewidth=0.8, label="circles" if k == 2 else None)
    ax.set_aspect("equal")
    ax.set_xlabel("x")
    ax.set_ylabel("y")
    ax.legend(fontsize=8, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))


DRAWINGS = (
    Drawing("Fig. 4", "The dynamic curve for ω = 1; γ = 1 by its limit", _dynamic, 2.8),
    Drawing(
        "Fig. 6", "Modules of the contracted curve; the tail of (2) as printed does not meet body module 1", _modules
    ),
    Drawing("Fig. 8", "Second crossing x' of the axis", _crossings, 2.8),
    Drawing("Fig. 10", "The head module for growing γ, flat from x' on", _head, 2.4),
    Drawing("Figs. 11, 12", "Stages of stretching, head first", _stages, 5.0),
    Drawing("Fig. 14", "Links on the contracted curve by circles", _links, 2.2),
)
