"""The judge's report: one line a test."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from bodyplan.errors import SolveError, Status


@dataclass(frozen=True)
class Line:
    """One test: ``what`` was tested, the measured ``value`` against ``limit`` (both in ``unit``; the limit is the
    largest allowed value unless ``at_least``), ``passed`` (None: could not be tested), ``detail`` where or why."""

    what: str
    value: float | None
    limit: float | None
    unit: str
    passed: bool | None
    detail: str = ""
    at_least: bool = False
    kind: str = ""

    def __str__(self) -> str:
        verdict = {True: "pass", False: "FAIL", None: "not tested"}[self.passed]
        sign = ">=" if self.at_least else "<="
        figures = "" if self.value is None else f"{self.value:.4g} {self.unit}"
        if self.value is not None and self.limit is not None:
            figures += f" ({sign} {self.limit:.4g})"
        return f"{verdict:10} {self.what}: {figures}{'  ' + self.detail if self.detail else ''}"

    def to_dict(self) -> dict[str, Any]:
        """JSON types."""
        return {
            "what": self.what,
            "value": self.value,
            "limit": self.limit,
            "unit": self.unit,
            "at_least": self.at_least,
            "passed": self.passed,
            "detail": self.detail,
            "kind": self.kind,
        }


@dataclass(frozen=True)
class Report:
    """Every line of one check; true in a condition when nothing failed."""

    lines: tuple[Line, ...]

    @property
    def ok(self) -> bool:
        """True where no line failed."""
        return all(line.passed is not False for line in self.lines)

    @property
    def failures(self) -> tuple[Line, ...]:
        """The lines that failed."""
        return tuple(line for line in self.lines if line.passed is False)

    def __bool__(self) -> bool:
        return self.ok

    def __iter__(self) -> Iterator[Line]:
        return iter(self.lines)

    def __getitem__(self, what: str) -> Line:
        """The first line whose name starts with ``what``."""
        for line in self.lines:
            if line.what.startswith(what):
                return line
        raise KeyError(f"no check called {what!r}; there are: {', '.join(line.what for line in self.lines)}")

    def raise_if_failed(self) -> Report:
        """This report, or SolveError with the first failed line."""
        if not self.ok:
            raise SolveError(Status.LIMIT, str(self.failures[0]))
        return self

    def __str__(self) -> str:
        passed = sum(line.passed is True for line in self.lines)
        return "\n".join([*map(str, self.lines), f"{passed} of {len(self.lines)} checks passed"])

    def to_dict(self) -> dict[str, Any]:
        """JSON types."""
        return {"ok": self.ok, "lines": [line.to_dict() for line in self.lines]}
