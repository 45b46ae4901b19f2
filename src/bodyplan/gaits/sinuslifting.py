"""Sinus-lifting: serpentine movement with the bends lifted, where a body slips most (paper *acm*, section V)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from bodyplan.arrays import number
from bodyplan.curves.sinuslift import SinusLift
from bodyplan.gaits.serpentine import Serpentine


class SinusLifting(Serpentine):
    """:class:`Serpentine` along a :class:`bodyplan.SinusLift`, eqs. (35), (36).

    ``alpha`` rad, ``lift`` (c0; 0 is plain serpentine movement, > 0 lifts the bends), ``wavelength`` m and ``c1``
    (None: the value that keeps the curve level; "paper": eq. (37); or a number) are those of the curve; all others
    those of :class:`Serpentine`. ``motion.contacts`` says which contacts touch: those where the curve bends least.

    Raises InputError for values out of range, or where no c1 keeps the curve level.
    """

    kind: ClassVar[str] = "sinus_lifting"
    UNITS: ClassVar[Mapping[str, str]] = {
        "alpha": "angle",
        "wavelength": "length",
        "speed": "speed",
        "ramp": "time",
        "stop": "time",
        "start": "length",
        "touch": "length",
    }

    def __init__(
        self,
        alpha: float,
        lift: float,
        wavelength: float,
        c1: float | str | None = None,
        *,
        speed: float = 0.1,
        direction: int = 1,
        steer: float | Sequence[tuple[float, float]] = 0.0,
        base: str = "follow",
        ramp: float = 0.0,
        stop: float | None = None,
        p: float | None = None,
        start: float = 0.0,
        touch: float | None = None,
    ) -> None:
        wavelength = number(wavelength, "wavelength", above=0.0)
        curve = SinusLift(alpha, lift, wavelength, c1, length=wavelength)
        super().__init__(curve, speed, direction, steer, base=base, ramp=ramp, stop=stop, p=p, start=start, touch=touch)
        self._wave = {"alpha": curve.alpha, "lift": curve.lift, "wavelength": curve.wavelength, "c1": c1}

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON types, with ``kind``."""
        general = {name: value for name, value in self._options().items() if not name.startswith("change")}
        return {"kind": self.kind, **self._wave, **general}
