"""Formulas as data: texts such as ``sin(0.5*(x+y))/15``, parsed by a whitelist and never run as code."""

from __future__ import annotations

from bodyplan.expressions.expression import Expression

__all__ = ["Expression"]
