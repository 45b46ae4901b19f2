"""From a body curve to joint angles."""

from bodyplan.fitting.links import ExactLength, LinksFit, exact_link_length, links_on_curve

__all__ = ["ExactLength", "LinksFit", "exact_link_length", "links_on_curve"]
