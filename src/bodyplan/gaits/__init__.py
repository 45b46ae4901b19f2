"""One file a gait. :data:`KINDS` is the registry: a new gait is one class and one line."""

from bodyplan.gaits.base import Gait
from bodyplan.gaits.carry import Carry
from bodyplan.gaits.concertina import Concertina
from bodyplan.gaits.crawl import Crawl
from bodyplan.gaits.rectilinear import Rectilinear
from bodyplan.gaits.rolling import Rolling
from bodyplan.gaits.serpentine import Serpentine
from bodyplan.gaits.sidewinding import Sidewinding
from bodyplan.gaits.sinuslifting import SinusLifting

#: every gait by its name in mission files
KINDS: dict[str, type[Gait]] = {
    gait.kind: gait for gait in (Concertina, Serpentine, SinusLifting, Sidewinding, Rolling, Rectilinear, Crawl, Carry)
}

__all__ = [
    "KINDS",
    "Carry",
    "Concertina",
    "Crawl",
    "Gait",
    "Rectilinear",
    "Rolling",
    "Serpentine",
    "Sidewinding",
    "SinusLifting",
]
