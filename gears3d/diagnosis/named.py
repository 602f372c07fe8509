"""Causes in the words and units of a scenario: parameters with intervals, and the table for ``[[effect]]``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

import numpy as np

from gears3d.diagnosis.candidates import FREE
from gears3d.diagnosis.cause import Cause
from gears3d.identify import Parameter
from gears3d.units import FAMILIES, show

Array = np.ndarray
# Digits of numbers without an interval in a scenario.
DIGITS = 8
# Digits of those with an interval.
FEWEST, MOST = 3, 12


def parameters(cause: Cause, covariance: Array) -> dict[str, Parameter]:
    """Return the free parameters of a cause with 95 % intervals.

    covariance: (p, p) [SI].
    """
    effect: Any = cause.effect
    found, sizes = {}, 2 if cause.candidate.phased else 1
    numbers, units = cause.numbers, _units(effect)
    name = cause.candidate.size
    if cause.candidate.phased:
        size = float(np.hypot(*numbers[:2]))
        toward = numbers[:2] / max(size, 1e-300)
        across = np.array([-toward[1], toward[0]])
        own = covariance[:2, :2]
        found[name] = _parameter(size, float(np.sqrt(toward @ own @ toward)), units[name])
        turn = float(np.sqrt(across @ own @ across)) / max(size, 1e-300)
        found["phase"] = _parameter(float(effect.phase), turn, units["phase"])
    else:
        found[name] = _parameter(float(numbers[0]), float(np.sqrt(covariance[0, 0])), units[name])
    for k, free in enumerate(cause.free, start=sizes):
        sigma = float(np.sqrt(covariance[k, k]))
        value = float(getattr(effect, free))
        log = FREE[cause.candidate.kind][free].log
        found[free] = _parameter(value, sigma * abs(value) if log else sigma, units[free])
    return found


def _parameter(value: float, sigma: float, unit: str) -> Parameter:
    return Parameter(value, unit, value - 1.96 * sigma, value + 1.96 * sigma)


def _units(effect: Any) -> dict[str, str]:
    """Return the SI unit of each parameter of an effect."""
    return {name: FAMILIES[param.family].si if param.family in FAMILIES else ""
            for name, param in effect.params.items()}  # fmt: skip


def table(effect: Any, numbers: Mapping[str, Parameter] | None = None, digits: int = DIGITS) -> dict[str, Any]:
    """Return an effect as its table under ``[[effect]]`` of a scenario, numbers rounded by their intervals.

    >>> from gears3d.effects import catalogue
    >>> table(catalogue()["transmission_error"](amplitude=2e-5, order=3))
    {'kind': 'transmission_error', 'amplitude': '20 um', 'order': 3, 'phase': '0 deg', 'gear': 'drive', 'flank': 'both'}
    >>> table(catalogue()["restitution_offset"](offset=0.1 / 3.0), {"offset": Parameter(0.1 / 3.0, "", 0.03, 0.036)})
    {'kind': 'restitution_offset', 'offset': 0.0333}
    """
    written: dict[str, Any] = {"kind": effect.kind}
    defaults = {one.name: one.default for one in fields(effect) if one.default is not MISSING}
    for name, param in effect.params.items():
        value = getattr(effect, name)
        if name in defaults and value == defaults[name] and name in ("frequency", "order") and value == 0.0:
            continue
        worth = worth_of(numbers[name]) if numbers is not None and name in numbers else digits
        if param.family in ("choice", "count", "ratio"):
            written[name] = float(f"{value:.{worth}g}") if isinstance(value, float) else value
        else:
            written[name] = show(value, getattr(effect, f"{name}_family", param.family), worth)
    return written


def worth_of(number: Parameter) -> int:
    """Return the significant digits of a number: rounding changes it by at most 5 % of its 95 % interval.

    >>> worth_of(Parameter(41.69612, "", 41.69533, 41.69691)), worth_of(Parameter(1.0, "", 0.2, 1.8))
    (7, 3)
    """
    half = 0.5 * (number.high - number.low)
    if not (number.value and half > 0.0 and np.isfinite(half)):
        return FEWEST
    return int(np.clip(np.floor(np.log10(abs(number.value))) - np.floor(np.log10(0.1 * half)) + 1, FEWEST, MOST))
