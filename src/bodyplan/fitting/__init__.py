"""From a body curve to joint angles."""

from bodyplan.fitting.links import ExactLength, LinksFit, exact_link_length, links_on_curve
from bodyplan.fitting.mechanism import Mechanism, mechanism
from bodyplan.fitting.rules import GAUSS_P, Bends, Rule, rule

__all__ = [
    "GAUSS_P",
    "Bends",
    "ExactLength",
    "LinksFit",
    "Mechanism",
    "Rule",
    "exact_link_length",
    "links_on_curve",
    "mechanism",
    "rule",
]
