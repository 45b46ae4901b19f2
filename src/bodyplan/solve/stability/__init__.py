"""Static stability of standing robots: margins against tipping over, and objectives to raise them.

from bodyplan.solve import stability

margins = stability.tip_margins(feet, gravity, com)       # (..., m, 3), (3,), (..., 3)
margins.min_distance, margins.min_angle, margins.tipping_edge

psi = stability.Objective("barrier").at(model, stance=["fl", "fr", "hl"])
psi.value, psi.coordinates, psi.rho(partition)
"""

from bodyplan.solve.stability.ascent import Ascent, Psi, center_and_slope
from bodyplan.solve.stability.margins import DOWN, Margins, tip_margins
from bodyplan.solve.stability.objectives import KINDS, Objective

__all__ = ["DOWN", "KINDS", "Ascent", "Margins", "Objective", "Psi", "center_and_slope", "tip_margins"]
