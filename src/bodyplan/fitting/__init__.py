"""From a body curve to joint angles."""

from bodyplan.fitting.angles import JointAngles
from bodyplan.fitting.convergence import Convergence, ConvergenceRow, convergence
from bodyplan.fitting.exact_length import ExactLength, exact_link_length
from bodyplan.fitting.fits import Fit, Turning, fit
from bodyplan.fitting.following import largest_distances
from bodyplan.fitting.links import LinksFit, links_on_curve
from bodyplan.fitting.mechanism import Mechanism, mechanism
from bodyplan.fitting.rules import GAUSS_P, Bends, Rule, rule

__all__ = [
    "GAUSS_P",
    "Bends",
    "Convergence",
    "ConvergenceRow",
    "ExactLength",
    "Fit",
    "JointAngles",
    "LinksFit",
    "Mechanism",
    "Rule",
    "Turning",
    "convergence",
    "exact_link_length",
    "fit",
    "largest_distances",
    "links_on_curve",
    "mechanism",
    "rule",
]
