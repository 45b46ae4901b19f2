"""Crawling on legs over uneven ground (paper *legs*, sections 3 and 4, and past them): see :class:`Crawl`;
:func:`null_space` measures what the paper's null space buys."""

from bodyplan.gaits.crawl.gait import Crawl
from bodyplan.gaits.crawl.null_space import Benefit, null_space

__all__ = ["Benefit", "Crawl", "null_space"]
