"""How well a motion's mechanism follows its curve, over a cycle and at key times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bodyplan import gaits
from bodyplan.arrays import Array
from bodyplan.errors import BodyplanError
from bodyplan.motion import Motion
from bodyplan.show.fitted import Drawn
from bodyplan.spatial import compose, inverse

#: samples of a cycle at which the fit is measured, and key times at which it is drawn
SAMPLES, KEYS = 25, 4


@dataclass(frozen=True, eq=False)
class Following:
    """Fits of the motion's curve over a cycle (or over a motion that runs once, not ``cyclic``): at times ``t`` (k,) s
    the ``error`` E_nm and the ``distance`` m, largest along the body; ``keys`` at times ``key_times`` s, placed in the
    world; ``length`` m of the body; ``problem``: why there is none of that."""

    t: Array
    error: Array
    quadrature_error: Array
    distance: Array
    key_times: Array
    keys: tuple[Drawn, ...]
    length: float
    cyclic: bool
    problem: str = ""

    @classmethod
    def of(cls, motion: Motion, span: float, cyclic: bool) -> Following | None:
        """Measured over ``span`` s from the motion's beginning (``cyclic``: it is a cycle); None for a gait that does
        not follow a curve."""
        kind = motion.gait.get("kind")
        planner = gaits.KINDS.get(kind) if isinstance(kind, str) else None
        if planner is None or not hasattr(planner, "fit_at"):
            return None
        none = np.zeros(0)
        try:
            gait: Any = planner(**{name: value for name, value in motion.gait.items() if name != "kind"})
            inside = np.flatnonzero(motion.t <= motion.t[0] + span * (1.0 + 1e-9))
            chosen = np.unique(np.linspace(0, inside[-1], SAMPLES).round().astype(int))
            fits = {int(i): gait.fit_at(motion.robot, float(motion.t[i])) for i in chosen}
            shown = chosen[[round(k * (len(chosen) - 1) / KEYS) for k in range(KEYS)]]
            drawn = []
            for i in np.unique(shown):
                fit = fits[int(i)]
                drawn.append(Drawn.of(fit, compose(motion.base[i], inverse(np.asarray(fit.base)))))
            error, quadrature, distance = (
                np.array([float(getattr(fit, name)) for fit in fits.values()])
                for name in ("error", "quadrature_error", "max_distance")
            )
        except BodyplanError as failed:  # a report is worth having without this part
            return cls(none, none, none, none, none, (), 0.0, cyclic, str(failed))
        t0 = motion.t[0]
        length = float(drawn[0].s[-1])
        key_times = motion.t[np.unique(shown)] - t0
        return cls(motion.t[chosen] - t0, error, quadrature, distance, key_times, tuple(drawn), length, cyclic)
