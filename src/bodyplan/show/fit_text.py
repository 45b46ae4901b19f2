"""What ``bodyplan fit`` found, as plain text for a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bodyplan.show.fit_outcome import STRAIGHT, FitOutcome, in_degrees, refused, saturated
from bodyplan.show.text import counted


def fit_text(outcome: FitOutcome) -> str:
    """One screen: the angles, how well curve and mechanism match, the other mechanisms beside them."""
    found = outcome.fit
    options = ", ".join(f"{k} {_short(v)}" for k, v in outcome.curve.to_dict().items() if k not in ("kind", "points"))
    parameter = "" if outcome.joint == "straight" else f", p = {found.p:.6g}"
    pitch, yaw = in_degrees(found.kink)
    angles = [["virtual, yaw", f"{yaw:.6f}"], ["virtual, pitch", f"{pitch:.6f}"]]
    values = in_degrees(found.q)
    angles += [[name, f"{value:.6f}"] for name, value in zip(found.robot.joints, values, strict=True)]
    mechanisms = [
        [
            r.mechanism + (" *" if r.mine else ""),
            r.rule,
            "-" if r.joints is None else str(r.joints),
            "-" if r.error is None else f"{r.error:.5e}",
            "-" if r.quadrature_error is None else f"{r.quadrature_error:.0e}",
            "-" if r.max_distance is None else f"{1e3 * r.max_distance:.4g}",
            r.status,
        ]
        for r in outcome.rows
    ]
    head = ["mechanism", "rule", "angles", "E_nm", "+-", "largest distance (mm)", "status"]
    farthest = f"{1e3 * found.max_distance:.6g} mm, {found.max_distance / found.length:.3%} of the length"
    optimal = found.method == "optimal"
    beyond = "; the rule's angles are beyond the limits" if outcome.beyond else ""
    return "\n".join(
        [
            f"  curve      {options or f'{len(outcome.curve.breaks)} pieces'}",
            f"  mechanism  {counted(found.robot.n, 'angle')}, axes {outcome.axes}, length {found.length:.6g} m",
            f"  rule       {found.method}{parameter}; the tail at {float(found.start):.6g} m of the curve",
            "",
            *_columns(["joint", "angle (deg)"], angles, 1),
            "",
            f"  E_nm       {found.error:.6e} (quadrature error {found.quadrature_error:.0e})",
            f"  distance   at most {farthest}",
            *([f"  gain       {found.gain:.4g} of the error of the paper's rule{beyond}"] if optimal else []),
            f"  limits     {_limits(outcome)}",
            *(f"  warning    {text}" for text in outcome.warnings),
            "",
            *_columns(head, mechanisms, 2),
            *(f"  {', '.join(pairs)} cannot be made: {reason}" for reason, pairs in refused(outcome).items()),
            *(["", str(outcome.convergence), "", STRAIGHT] if outcome.convergence is not None else []),
        ]
    )


def _limits(outcome: FitOutcome) -> str:
    beyond = saturated(outcome.fit)
    if beyond:
        return f"at or beyond: {', '.join(beyond)}"
    return "all joints within" if np.all(np.isfinite(outcome.fit.robot.limits)) else "none given"


def _columns(head: Sequence[str], rows: Sequence[Sequence[str]], left: int) -> list[str]:
    """Lines of a table; the first ``left`` columns are aligned at the left, the others at the right."""
    widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
    return ["  " + "  ".join(_aligned(row, widths, left)) for row in (head, *rows)]


def _aligned(row: Sequence[str], widths: Sequence[int], left: int) -> list[str]:
    return [row[i].ljust(w) if i < left else row[i].rjust(w) for i, w in enumerate(widths)]


def _short(value: Any) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."
