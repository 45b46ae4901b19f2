"""Figs. 10 to 14 of paper *wheels*. They draw what the paper's entries have planned."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bodyplan.papers.entries import Drawing
from bodyplan.show.series import EXECUTED, LIMIT, PLANNED, SERIES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NAMES = {"fl": "front left", "fr": "front right", "r": "rear"}


def _path(figure: Figure) -> None:
    from bodyplan.papers.wheels import HILLS, mission_1

    motion = mission_1()
    x, y = np.meshgrid(np.linspace(-2.0, 2.0, 81), np.linspace(-2.0, 2.0, 81))
    z = HILLS.height(np.stack([x, y], axis=-1))
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.3))
    filled = left.contourf(x, y, 1e3 * z, levels=12, cmap="YlGn", alpha=0.5)
    figure.colorbar(filled, ax=left, label="ground (mm)", shrink=0.8)
    left.plot(*motion.base[:, :2].T, color=EXECUTED, label="body")
    poses = motion.poses()
    for name, color in zip(NAMES, SERIES[2:], strict=False):
        left.plot(*poses[name][:, :2].T, color=color, linewidth=0.9, label=f"contact, {NAMES[name]}")
    left.set_aspect("equal")
    left.set_xlabel("x (m)")
    left.set_ylabel("y (m)")
    right.plot(motion.t, 1e3 * motion.base[:, 2], color=EXECUTED, label="2: centre of mass")
    right.plot(motion.t, 1e3 * HILLS.height(motion.base[:, :2]), color=PLANNED, label="1: path on the ground")
    right.set_xlabel("t (s)")
    right.set_ylabel("z (mm)")
    right.legend(fontsize=8)
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower left", ncols=2, fontsize=7.5)


def _angles(figure: Figure) -> None:
    from bodyplan.papers.wheels import mission_1

    motion, ax = mission_1(), figure.subplots()
    for (name, label), color in zip(NAMES.items(), SERIES, strict=False):
        q = motion.q[:, motion.joints.index(f"{name}.adjust")]
        ax.plot(motion.t, np.degrees(q), color=color, label=label)
    for value, place in ((20.0, "bottom"), (40.0, "bottom"), (170.0, "top")):
        ax.axhline(value, color=LIMIT, linestyle=":", linewidth=1.0)
        ax.text(5.0, value, f"printed {value:.0f}°", color=LIMIT, fontsize=7.5, ha="right", va=place)
    ax.set_ylim(0.0, 180.0)
    ax.set_xlabel("t (s)")
    ax.set_ylabel("adjusting angle (deg)")
    ax.legend(fontsize=8, ncols=3, loc="upper left", bbox_to_anchor=(0.0, 1.15))


def _torques(figure: Figure) -> None:
    from bodyplan.papers.wheels import MASS, held, mission_1
    from bodyplan.robot import tri_wheel

    motion, ax = mission_1(), figure.subplots()
    found, robot = held(), tri_wheel()
    for (name, label), color in zip(NAMES.items(), SERIES, strict=False):
        rim = next(
            contact for contact in robot.contacts if contact.frame.startswith(f"{name}.") or contact.name == name
        )
        q = motion.q[:, motion.joints.index(f"{name}.adjust")]
        assert rim.drive is not None
        ax.plot(
            motion.t,
            np.abs(MASS * 9.81 / 3.0 * rim.drive.slope(q)),
            "--",
            color=color,
            linewidth=1.2,
            label=f"{label}, (35)",
        )
        ax.plot(motion.t[::50], np.abs(found[name].adjust), "o-", color=color, markersize=3, label=f"{label}, (34)")
    for value in (1.4, 4.0):
        ax.axhline(value, color=LIMIT, linestyle=":", linewidth=1.0)
        ax.text(5.0, value, f"printed {value:g} N m", color=LIMIT, fontsize=7.5, ha="right", va="bottom")
    ax.set_ylim(0.0, 7.0)
    ax.set_xlabel("t (s)")
    ax.set_ylabel("torque (N m)")
    ax.legend(fontsize=7.5, ncols=3, loc="upper left", bbox_to_anchor=(0.0, 1.25))


def _errors(figure: Figure) -> None:
    from bodyplan.papers.wheels import mission_1

    motion, ax = mission_1(), figure.subplots()
    ax.semilogy(motion.t, np.maximum(motion.residual, 1e-17), color=EXECUTED, label="residual of (12), (14)")
    ax.axhline(1e-5, color=LIMIT, linestyle=":", label="the paper's criterion")
    ax.set_ylim(1e-18, 1e-3)
    ax.set_xlabel("t (s)")
    ax.set_ylabel("residual (m)")
    ax.legend(fontsize=8)


def _ramp(figure: Figure) -> None:
    """Seen from behind: level body, wheels across a slope of 0.2."""
    from bodyplan.papers.wheels import TABLE_2, mission_2

    motion = mission_2()
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    y = np.array([-0.9, 0.9])
    ground = -0.2 * y
    left.fill_between(y, ground, ground.min() - 0.05, color="#e7e2d6")
    left.plot(y, ground, color="#7a6f57")
    z = float(motion.base[0, 2])
    left.plot([-0.6, 0.6], [z, z], color="#1c2530", linewidth=3.0)
    for name, place in (("fl", 0.6), ("fr", -0.6), ("r", 0.0)):
        q = float(motion.q[0, motion.joints.index(f"{name}.adjust")])
        radius = 0.3 * np.cos(0.5 * q) * np.cos(np.pi / 6.0) + 0.02
        left.plot([place, place], [z - radius, z + radius], color=EXECUTED, linewidth=5.0, solid_capstyle="butt")
        left.annotate(
            f"{NAMES[name]}\n{np.degrees(q):.1f}°", (place, z + radius), fontsize=7.5, ha="center", va="bottom"
        )
    left.set_xlim(0.9, -0.9)
    left.set_ylim(-0.25, 0.62)
    left.set_aspect("equal")
    left.set_xlabel("y (m), seen from behind")
    left.set_ylabel("z (m)")
    width = 0.38
    ours = [np.degrees(float(motion.facts[f"{name}_largest_angle"])) for name in NAMES]
    right.bar(
        np.arange(3) - 0.5 * width, [float(TABLE_2[name][0]) for name in NAMES], width, color=LIMIT, label="printed"
    )
    right.bar(np.arange(3) + 0.5 * width, ours, width, color=EXECUTED, label="ours")
    right.set_xticks(np.arange(3), list(NAMES.values()), fontsize=8)
    right.set_ylabel("adjusting angle (deg)")
    right.set_ylim(0.0, 215.0)
    right.legend(fontsize=8, ncols=2)


DRAWINGS = (
    Drawing("Fig. 10", "Mission 1: the body on a circle over rough ground", _path, 3.4),
    Drawing("Fig. 11", "Mission 1: adjusting angles", _angles, 2.8),
    Drawing("Fig. 12", "Mission 1: torques by the paper’s estimate (35), and by statics of least norm", _torques, 3.0),
    Drawing("Fig. 13", "Mission 1: residual of the constraints", _errors, 2.2),
    Drawing("Fig. 14", "Mission 2: a level body across a ramp of 0.2, height 150 mm", _ramp, 3.0),
)
