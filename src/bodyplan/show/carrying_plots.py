"""Plots over time of a body that is carried on wheels."""

from __future__ import annotations

from typing import Any

import numpy as np

from bodyplan.arrays import Array
from bodyplan.show.carrying import Carrying
from bodyplan.show.layout import layout, line
from bodyplan.show.outcome import Outcome
from bodyplan.show.series import LIMIT, PLANNED, SERIES, compact

Plot = dict[str, Any]
#: colours of wheels and how their bands are filled
BANDS = ("rgba(0,114,178,0.13)", "rgba(217,130,0,0.15)", "rgba(0,158,115,0.13)", "rgba(204,121,167,0.15)",
         "rgba(86,180,233,0.15)", "rgba(92,75,138,0.13)")  # fmt: skip
#: m/s
SLIPPING = 1e-6


def carrying_plots(outcome: Outcome, found: Carrying | None) -> dict[str, Plot | None]:
    """Every plot, by name; none for other gaits."""
    if found is None:
        return {}
    turns = any(found.adjusted)
    return {
        "wheel_angles": _angles(outcome, found) if turns else None,
        "wheel_radii": _radii(found) if turns else None,
        "wheel_torques": _torques(found) if turns and np.isfinite(found.torque).any() else None,
        "wheel_hubs": _lines(found, found.hub, "hub torque (N m)") if np.isfinite(found.hub).any() else None,
        "wheel_spins": _lines(found, found.spin, "spin (rad/s)"),
        "wheel_slips": _lines(found, 1e3 * found.slip, "slip to the left (mm/s)") if _slips(found) else None,
        "wheel_friction": _friction(found) if np.isfinite(found.used).any() else None,
        "hull_clearance": _clearance(found),
    }


def _slips(found: Carrying) -> bool:
    """Whether any wheel is dragged sideways by more than rounding."""
    return bool(np.nanmax(np.abs(found.slip), initial=0.0) > SLIPPING)


def color(k: int) -> str:
    """The colour of a wheel."""
    return SERIES[k % len(SERIES)]


def _lines(found: Carrying, values: Array, name: str, height: int = 260) -> Plot:
    made = layout("time (s)", name, height)
    data = [line(found.t, values[:, k], wheel, color(k)) for k, wheel in enumerate(found.names)]
    return {"data": data, "layout": made}


def _angles(outcome: Outcome, found: Carrying) -> Plot:
    """Adjusting angles, with those that the paper prints."""
    shown = np.where(found.adjusted, np.degrees(found.angle), np.nan)
    plot = _lines(found, shown, "adjusting angle q (°)", 320)
    plot["data"] = [one for one, turns in zip(plot["data"], found.adjusted, strict=True) if turns]
    for row in outcome.paper:
        if row.unit in ("deg", "degree", "degrees") and row.ours.startswith("plan.") and "angle" in row.ours:
            ends = [found.t[0], found.t[-1]]
            named = next((k for k, name in enumerate(found.names) if row.ours.startswith(f"plan.{name}_")), None)
            style = {"dash": "dot", "width": 1.5}
            shade = "#5c6670" if named is None else color(named)
            text = f"the paper: {row.printed:g}°"
            plot["data"].append(
                line(ends, [row.printed] * 2, text, shade, line=style, hovertemplate=f"{row.what}: %{{y}}°")
            )
    return plot


def _radii(found: Carrying) -> Plot:
    """Radii, with the range of the wheels where it is the same for all."""
    plot = _lines(found, 1e3 * found.radius, "radius at the contact (mm)", 300)
    for end, name in zip((0, 1), ("smallest", "largest"), strict=True):
        values = np.unique(found.reach[:, end])
        if len(values) == 1:
            style = {"dash": "dot", "width": 1.5}
            ends = [found.t[0], found.t[-1]]
            plot["data"].append(line(ends, [1e3 * values[0]] * 2, f"{name} there is", LIMIT, line=style))
    return plot


def _torques(found: Carrying) -> Plot:
    """Adjusting torques by (34) and (35), in the band of all that hold the body."""
    made = layout("time (s)", "adjusting torque (N m)", 380)
    data: list[dict[str, Any]] = []
    t = found.motion.t[found.few] - found.motion.t[0]
    for k, wheel in enumerate(found.names):
        if not found.adjusted[k]:
            continue
        if found.statics is not None:
            one = found.statics[wheel]
            whole = np.isfinite(one.lowest) & np.isfinite(one.highest)
            if whole.any():
                edge = {"width": 0.0}
                hidden = {"showlegend": False, "hoverinfo": "skip", "legendgroup": wheel}
                data.append(line(t[whole], one.lowest[whole], wheel, color(k), line=edge, **hidden))
                data.append(
                    line(
                        t[whole],
                        one.highest[whole],
                        wheel,
                        color(k),
                        line=edge,
                        fill="tonexty",
                        fillcolor=BANDS[k % len(BANDS)],
                        **hidden,
                    )
                )
        data.append(line(found.t, found.torque[:, k], wheel, color(k), legendgroup=wheel))
        dashed = {"dash": "dash", "width": 1.3}
        data.append(line(found.t, found.paper[:, k], f"{wheel} by (35)", color(k), line=dashed, legendgroup=wheel))
    return {"data": data, "layout": made}


def _friction(found: Carrying) -> Plot:
    """Friction that the forces use, that which is needed at least, and what there is."""
    plot = _lines(found, found.used, "friction / load", 300)
    if found.statics is not None:
        t = found.motion.t[found.few] - found.motion.t[0]
        need = np.where(np.isfinite(found.statics.required), found.statics.required, np.nan)
        plot["data"].append(
            line(t, need, "least that holds the body, μ*", "#1c2530", line={"dash": "dash", "width": 1.6})
        )
        most = float(np.nanmax(np.where(np.isfinite(found.used), found.used, 0.0), initial=0.0))
        ends = [found.t[0], found.t[-1]]
        for mu in np.unique(found.statics.friction):
            if mu <= 4.0 * max(most, 0.02):
                plot["data"].append(
                    line(ends, [float(mu)] * 2, f"given, μ = {mu:g}", LIMIT, line={"dash": "dot", "width": 1.5})
                )
    plot["layout"]["yaxis"]["rangemode"] = "tozero"
    return plot


def _clearance(found: Carrying) -> Plot | None:
    if found.clearance is None:
        return None
    made = layout("time (s)", "hull over the ground (mm)", 240)
    made["yaxis"]["rangemode"] = "tozero"
    data = {**line(found.t, [], "hull", PLANNED, showlegend=False), "y": compact(1e3 * found.clearance)}
    return {"data": [data], "layout": made}
