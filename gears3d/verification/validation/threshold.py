"""Slow sweeps in the engine lose contact where the master curve says; waves of the flanks lower that as riding does.

The gap must open by more than 0.1 um; Rigaud & Perret-Liaudet 2020, figs 3 and 4 and eq. (6).
"""

from __future__ import annotations

from collections.abc import Iterator

from gears3d.bench import thresholds
from gears3d.verification.validation.bench import fig5
from gears3d.verification.validation.check import Check

TORQUES = (0.22, 0.46, 0.75)  # N m
MEANS = (30, 90)  # rpm
FREQUENCIES = (0.75, 1.7, 3.0)  # Hz
WAVE = {"kind": "transmission_error", "order": 20, "amplitude": "30 um"}


def checks(quick: bool = False) -> Iterator[Check]:
    """Measure them."""
    for torque in TORQUES[:1] if quick else TORQUES:
        for mean in MEANS[:1] if quick else MEANS:
            scenario = fig5(drag__torque=f"{torque} N m", motion__mean=f"{mean} rpm")
            found = thresholds(scenario, FREQUENCIES[-1:] if quick else FREQUENCIES, span=(0.93, 1.08), periods=42)
            for name in ("up", "down"):
                off = max(abs(getattr(one, name) - 1.0) for one in found.sweeps)
                yield Check(f"{torque} N m, {mean} rpm: excitation at which contact is lost, {name}: off 1", off, 0.02)
            if len(found.sweeps) > 1:
                yield Check(f"{torque} N m, {mean} rpm: slope off -1", abs(found.slope + 1.0), 0.01)
    if not quick:
        (one,) = thresholds(fig5(effect=[WAVE])).sweeps
        yield Check("wave of order 20, 30 um: excitation that riding on it asks for", one.predicted, 0.9)
        yield Check("wave of order 20, 30 um: contact is lost off that", abs(one.up - one.predicted), 0.03)
