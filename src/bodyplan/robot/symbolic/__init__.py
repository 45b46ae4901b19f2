"""The kinematic model of a robot in symbols (SymPy): formulas, LaTeX, NumPy source, C99 source.

Imported only by :meth:`bodyplan.Robot.symbolic`, since SymPy takes a second to load and is an extra.
"""

from bodyplan.errors import MissingExtraError

try:
    import sympy as _sympy  # noqa: F401 - the message below, instead of one from deep inside
except ImportError as error:
    raise MissingExtraError("SymPy", "symbolic", "The symbolic model of a robot") from error

from bodyplan.robot.symbolic.c_source import CSource
from bodyplan.robot.symbolic.model import SymbolicRobot

__all__ = ["CSource", "SymbolicRobot"]
