"""The threshold test of a bench: the drive's swing slowly grows and falls again."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from tempfile import gettempdir
from typing import TYPE_CHECKING

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.files import PRIVATE, temporary
from gears3d.recording import Recording
from gears3d.simulation.excitation import assess
from gears3d.simulation.models import simulate
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

RANGE = (0.5, 1.6)
"""Of the swing, over that at which Λ = 1."""
FEWEST = 20
"""Periods that a sweep must have."""
_SAMPLES = 48
"""Of the drive's motion, a period of its fastest harmonic."""


def sweep(
    scenario: Scenario,
    span: tuple[float, float] | None = None,
    progress: Callable[[float], None] | None = None,
    model: str = "rigid",
) -> Recording:
    """Return a run in which the first harmonic's amplitude grows from one value to another and falls back.

    Args:
        scenario: with at least one harmonic; lasts ``run.duration``, half of it rising.
        span: smallest and largest amplitude of the drive's speed [rad/s]; 0.5 to 1.6 times that at which Λ = 1 unless
            given.
        progress: called now and then with the simulated time done [s].
        model: ``"rigid"`` or ``"bullet"``.

    Returns:
        The recording, sampled at the rate of the sensors.

    Raises:
        InputError: no harmonic, a recorded motion, no span where there is no drag, or less than 20 periods.

    Source: Rigaud & Perret-Liaudet 2020, section 4 (sweeps up and down).
    """
    motion = scenario.motion
    if not motion.harmonics or motion.record is not None:
        raise InputError(Fault("motion.harmonics", "is needed: its first amplitude is swept", "give a harmonic"))
    low, high = span or _usual(scenario)
    if not 0.0 <= low < high:
        what = f"is {show(low, 'speed')} to {show(high, 'speed')}"
        raise InputError(Fault("--amplitudes", what, "give a smaller and a larger one"))
    duration, frequency = scenario.run.duration, motion.harmonics[0].frequency
    if duration * frequency < FEWEST:
        least, better = show(FEWEST / frequency, "time"), show(3 * FEWEST / frequency, "time")
        remedy = f"give {least} or more; {3 * FEWEST} periods and more are better: --set 'run.duration={better}'"
        raise InputError(Fault("run.duration", f"holds {duration * frequency:.3g} periods of the swing", remedy))
    fastest = max(harmonic.frequency for harmonic in motion.harmonics)
    time = np.linspace(0.0, 1.001 * duration, int(np.ceil(1.001 * duration * fastest * _SAMPLES)) + 1)
    angle = motion.mean * time + _swept(time, duration, (low, high), 2 * pi * frequency, motion.harmonics[0].phase)
    for one in motion.harmonics[1:]:
        turn = 2 * pi * one.frequency
        angle -= one.amplitude / turn * (np.cos(turn * time + one.phase) - np.cos(one.phase))
    with temporary(gettempdir(), PRIVATE) as folder:
        file = folder / "drive.parquet"
        Recording({"time_s": time, "theta_drive_rad": angle, "theta_loose_rad": angle}).write(file)
        rate = f"{scenario.sensors.sample_rate!r} Hz"
        asked = scenario.with_({"motion.record": str(file), "run.output_rate": rate})
        return simulate(asked, model, progress=progress)


def _usual(scenario: Scenario) -> tuple[float, float]:
    threshold = assess(scenario).harmonics[0].threshold_amplitude_rad_s
    if not (threshold > 0.0 and np.isfinite(threshold)):
        raise InputError(Fault("--amplitudes", "is missing: without drag there is no threshold", 'e.g. "1 rpm..4 rpm"'))
    return RANGE[0] * threshold, RANGE[1] * threshold


def _swept(time: np.ndarray, duration: float, span: tuple[float, float], omega: float, phase: float) -> np.ndarray:
    """Return the integral of A(t)·sin(ω·t + phase), A in straight lines up and down [rad]."""
    low, high = span
    slope = 2.0 * (high - low) / duration
    half = 0.5 * duration

    def whole(t: np.ndarray, level: float, climb: float) -> np.ndarray:
        """Return the antiderivative of (level + climb·t)·sin(ω·t + phase)."""
        turn = omega * t + phase
        return -(level + climb * t) * np.cos(turn) / omega + climb * np.sin(turn) / omega**2

    rising = whole(np.minimum(time, half), low, slope) - whole(np.zeros(1), low, slope)
    falling = whole(np.maximum(time, half), 2.0 * high - low, -slope) - whole(
        np.full(1, half), 2.0 * high - low, -slope
    )
    return rising + falling
