"""What can go wrong: errors for misuse, statuses for solves that fail.

Misuse raises where the object is built and names the field, the value and what is allowed.
A solve that is numerically or physically impossible is a :class:`Status` in the result;
``.raise_if_failed()`` of that result turns it into a :class:`SolveError`.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from enum import StrEnum


class Status(StrEnum):
    """Outcome of one solve; compares equal to its text, for example ``status == "ok"``."""

    OK = "ok"
    TOO_TIGHT = "too_tight"  # a curve bends more than links of this length can follow
    CURVE_ENDED = "curve_ended"  # the curve is shorter than the body
    NO_EXACT_LENGTH = "no_exact_length"  # no link length covers the contracted curve exactly
    OUT_OF_REACH = "out_of_reach"
    COLLAPSED = "collapsed"  # two anchors are nearer to each other than the links between them can fold
    WRONG_ORDER = "wrong_order"  # an anchor is not ahead of the one behind it
    NOT_COPLANAR = "not_coplanar"  # points that must lie in one upright plane do not
    LINKS_CROSSING = "links_crossing"
    NO_CONTACT = "no_contact"
    LIMIT = "limit"
    SLIPS = "slips"
    TIPS_OVER = "tips_over"
    ABOVE_CEILING = "above_ceiling"
    BELOW_FLOOR = "below_floor"
    NOT_CONVERGED = "not_converged"
    CONFLICT = "conflict"  # what is commanded contradicts itself
    INFEASIBLE = "infeasible"  # what is commanded cannot be done within the limits
    DAMPED = "damped"  # near a singularity, where damping misses what is commanded
    STANDS_STILL = "stands_still"  # a path that gives no direction to head for
    JUMPS = "jumps"  # a contact leaves its place at once: the ground bends like what rolls on it
    DIVERGED = "diverged"  # the physics left the realm of finite numbers


class BodyplanError(Exception):
    """Root of every error that bodyplan raises on purpose."""


class InputError(BodyplanError, ValueError):
    """Misuse: a field has a value that is not allowed."""


class UnknownNameError(InputError):
    """A name that does not exist; the message lists the names that do, nearest first."""

    def __init__(self, kind: str, name: object, valid: Iterable[str], where: str = "") -> None:
        self.kind, self.name, self.valid = kind, str(name), sorted(valid)
        near = difflib.get_close_matches(self.name, self.valid, n=1)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        shown = ", ".join(self.valid[:40]) + (" ..." if len(self.valid) > 40 else "")
        prefix = f"{where}: " if where else ""
        super().__init__(f"{prefix}unknown {kind} {self.name!r}.{hint} Valid names: {shown or '(none)'}.")


class MissingExtraError(BodyplanError, ImportError):
    """An optional library is not installed; the message says how to get it."""

    def __init__(self, library: str, extra: str, purpose: str) -> None:
        super().__init__(f"{purpose} needs {library}; install it with: pip install 'bodyplan[{extra}]'.")


class SolveError(BodyplanError):
    """A failed solve, raised on request.

    Attributes: ``status`` (the :class:`Status`), ``index`` (sample or link it happened at, or None).
    """

    def __init__(self, status: Status | str, reason: str, index: int | None = None) -> None:
        self.status, self.reason, self.index = Status(status), reason, index
        at = "" if index is None else f" at index {index}"
        super().__init__(f"{self.status}{at}: {reason}")
