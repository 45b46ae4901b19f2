"""Crawling on legs over uneven ground (paper *legs*, sections 3 and 4, and past them): see :class:`Crawl`."""

from bodyplan.gaits.crawl.gait import Crawl

__all__ = ["Crawl"]
