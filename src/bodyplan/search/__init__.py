"""Search: a mission at many values of its fields, in many processes, on one machine or a cluster."""

from bodyplan.search.optimising import Search, optimise
from bodyplan.search.sweeps import Sweep, sweep

__all__ = ["Search", "Sweep", "optimise", "sweep"]
