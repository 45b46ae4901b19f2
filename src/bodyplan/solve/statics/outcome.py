"""Status and reason of every item of a batch, as all results of contact forces have them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from bodyplan.arrays import BoolArray, TextArray
from bodyplan.errors import SolveError, Status


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """``status`` (...): "ok", "slips", "tips_over" or "not_converged"; one text for a single item. ``reasons`` (...):
    why, empty where it is ok."""

    status: Any
    reasons: TextArray = field(repr=False)

    @property
    def ok(self) -> BoolArray:
        """(...) True where the solve has a result."""
        return np.asarray(np.asarray(self.status) == Status.OK.value)

    def reason(self, index: Any = ()) -> str:
        """Why the status at an index of the batch is what it is; empty where it is ok."""
        return str(np.asarray(self.reasons)[index])

    def raise_if_failed(self) -> Self:
        """This result, or SolveError with the first item of the batch that failed."""
        bad = np.argwhere(~self.ok)
        if len(bad):
            index = tuple(int(i) for i in bad[0])
            status = np.asarray(self.status)
            flat = int(np.ravel_multi_index(index, status.shape)) if index else None
            raise SolveError(str(status[index]), self.reason(index), flat)
        return self


def shaped(flat: Any, shape: tuple[int, ...]) -> Any:
    """(n, ...) as (*shape, ...), read-only; a single number or text as such."""
    out = np.asarray(flat)
    out = out.reshape((*shape, *out.shape[1:]))
    out.flags.writeable = False
    return out[()]
