"""Result of an identification: a law, its parameters with intervals, and a snippet for a scenario."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite
from typing import Any

from gears3d.results import Result


@dataclass(frozen=True)
class Parameter:
    """One identified number.

    Args:
        value: in ``unit``.
        unit: of the value, SI.
        low: lower end of the 95 % interval.
        high: upper end of the 95 % interval.

    >>> Parameter(0.5, "N m", float("-inf"), float("inf")).to_dict()
    {'value': 0.5, 'unit': 'N m', 'ci95': None}
    """

    value: float
    unit: str
    low: float
    high: float

    def to_dict(self) -> dict[str, Any]:
        """Return ``value``, ``unit`` and ``ci95``, null without bounds, as JSON can hold them."""
        bounded = isfinite(self.low) and isfinite(self.high)
        return {"value": self.value, "unit": self.unit, "ci95": [self.low, self.high] if bounded else None}


@dataclass(frozen=True)
class Identified(Result):
    """A law found in data.

    Args:
        law: its name.
        parameters: by name.
        goodness: how well it fits and predicts.
        snippet: TOML that goes into a scenario.
        curves: arrays for plots, by name.
        warnings: what the reader should know before relying on it.
    """

    law: str
    parameters: dict[str, Parameter]
    goodness: dict[str, Any]
    snippet: str
    curves: dict[str, Any] = field(default_factory=dict, repr=False)
    warnings: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold, without the curves."""
        return {
            "law": self.law,
            "parameters": {name: parameter.to_dict() for name, parameter in self.parameters.items()},
            "goodness": self.goodness,
            "snippet": self.snippet,
            "warnings": list(self.warnings),
        }
