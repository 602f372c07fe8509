"""Sweeps of the drive's speed fluctuation up and down in the 3D engine: where contact is lost and regained."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.bench.ste import refuse_oil
from gears3d.errors import Fault, InputError
from gears3d.results import Result
from gears3d.simulation.excitation import assess
from gears3d.simulation.recorder import sweep
from gears3d.simulation.sensors import encode

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

OPENING = 1e-7  # A gap that opens wider is a loss of contact [m]
SPAN = (0.9, 1.1)  # Of the speed fluctuation, over that at which contact loss is expected, unless given
PERIODS = 80  # Of a sweep, half of them rising
PER_PERIOD = 2000.0  # Samples a period of the record at most
_WAVES = 60  # Periods over which waves of the flanks and the speed fluctuation meet in every phase
_HALVINGS = 30  # Of the amplitude: 2**-30 of it, below all other errors


@dataclass(frozen=True, eq=False)
class Sweep:
    """One sweep.

    Args:
        frequency: of the speed fluctuation [Hz].
        amplitude: of the drive's speed at which Λ = 1 [rad/s].
        predicted: Λ at which contact on the active flank asks for a pull, waves of the flanks included.
        up: Λ at the first loss of contact while the fluctuation grows; not a number where there was none, or at once.
        down: Λ at the last loss while it falls; not a number where there was none, or it went on to the end.
        losses: time [s], Λ, and opening [m] of every flight wider than 0.1 µm, (n, 3).
        record: what encoders would have recorded.
    """

    frequency: float
    amplitude: float
    predicted: float
    up: float
    down: float
    losses: np.ndarray
    record: Recording

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers, what is not a number as ``None``; ``hysteresis`` is 1 - down/up."""
        told = {
            "frequency_Hz": self.frequency,
            "threshold_amplitude_rad_s": self.amplitude,
            "excitation_predicted": self.predicted,
            "excitation_up": self.up,
            "excitation_down": self.down,
            "amplitude_up_rad_s": self.up * self.amplitude,
            "amplitude_down_rad_s": self.down * self.amplitude,
            "hysteresis": 1.0 - self.down / self.up,
        }
        return {name: None if np.isnan(value) else float(value) for name, value in told.items()}


@dataclass(frozen=True, eq=False)
class Thresholds(Result):
    """Sweeps at several frequencies.

    Args:
        sweeps: one a frequency.
        torque: drag in contact at the mean speed [N·m].
        inertia: of the loose gear [kg·m²].
    """

    sweeps: tuple[Sweep, ...]
    torque: float
    inertia: float

    @property
    def slope(self) -> float:
        """Slope of log ω over log(ΔΩ/Td) at the losses of growing fluctuations: -1 on the master curve."""
        seen = [one for one in self.sweeps if not np.isnan(one.up)]
        if len({one.frequency for one in seen}) < 2:
            return float("nan")
        speeds = np.log([one.up * one.amplitude / self.torque for one in seen])
        return float(np.polyfit(speeds, np.log([2 * pi * one.frequency for one in seen]), 1)[0])

    def to_dict(self) -> dict[str, Any]:
        """Return ``sweeps``, ``slope`` and the drag."""
        slope = None if np.isnan(self.slope) else self.slope
        told = [one.to_dict() for one in self.sweeps]
        return {"test": "threshold", "drag_torque_N_m": self.torque, "slope": slope, "sweeps": told}


def thresholds(
    scenario: Scenario,
    frequencies: Sequence[float] = (),
    span: tuple[float, float] = SPAN,
    periods: float = PERIODS,
    seed: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Thresholds:
    """Let the drive's speed fluctuation grow and fall in the 3D engine and see when the gap opens by more than 0.1 µm.

    Args:
        scenario: rig with one harmonic at least; its first is swept, the others continue.
        frequencies: of the sweeps [Hz]; that of the first harmonic unless given.
        span: smallest and largest amplitude over that at which contact loss is expected.
        periods: of each sweep, half of them rising, 20 at least.
        seed: of the encoders' noise; that of the scenario unless given.
        progress: called now and then with the simulated time done, of all sweeps together [s].

    Returns:
        Λ of loss and return for each frequency, and the records.

    Raises:
        InputError: no harmonic, no drag, oil between the flanks, or what the engine cannot do.
        KeyboardInterrupt: it was interrupted.

    Source: Rigaud & Perret-Liaudet 2020, section 4, eqs (2)-(10), figs 3, 4.
    """
    if not scenario.motion.harmonics:
        raise InputError(Fault("motion.harmonics", "is needed: its first amplitude is swept", "give a harmonic"))
    refuse_oil(scenario, "contact that can be lost")
    done, sweeps, about = 0.0, [], assess(scenario)
    for frequency in frequencies or [scenario.motion.harmonics[0].frequency]:
        tick = None if progress is None else _later(progress, done)
        sweeps.append(_one(scenario, frequency, span, periods, seed, tick))
        done += periods / frequency
    return Thresholds(tuple(sweeps), about.drag_torque_N_m, scenario.rig().inertia)


def _later(progress: Callable[[float], None], begin: float) -> Callable[[float], None]:
    return lambda done: progress(begin + done)


def _one(
    scenario: Scenario,
    frequency: float,
    span: tuple[float, float],
    periods: float,
    seed: int | None,
    progress: Callable[[float], None] | None,
) -> Sweep:
    """Sweep at one frequency."""
    rate = min(scenario.sensors.sample_rate, PER_PERIOD * frequency)
    duration = periods / frequency
    asked = scenario.with_(
        {
            "motion.harmonics[0].frequency": f"{frequency!r} Hz",
            "run.duration": f"{duration!r} s",
            "run.settle": "0 s",
            "sensors.sample_rate": f"{rate!r} Hz",
        }
    )
    unit = assess(asked).harmonics[0].threshold_amplitude_rad_s
    if not 0.0 < unit < np.inf:
        raise InputError(Fault("drag", "is zero: without drag there is no threshold", "give drag.torque"))
    expected = predicted(asked)
    low, high = (part * expected * unit for part in span)
    made = sweep(asked, (low, high), progress, "bullet")
    if made.meta["interrupted"]:
        raise KeyboardInterrupt
    losses = _losses(made)
    level = np.interp(losses[:, 0], [0.0, 0.5 * duration, duration], [low, high, low]) / unit
    losses = np.column_stack([losses[:, 0], level, losses[:, 1]])
    up, down = _ends(losses, duration, frequency)
    record = encode(made, asked.sensors, scenario.run.seed if seed is None else seed)
    return Sweep(frequency, unit, expected, up, down, losses, record)


def predicted(scenario: Scenario) -> float:
    """Return Λ of the first harmonic at which riding on the active flank asks for a pull, waves included.

    Args:
        scenario: with a harmonic and drag.

    Returns:
        Λ; 1 for perfect flanks and nothing else that moves the drive.

    Source: Rigaud & Perret-Liaudet 2020, eq. (6), with the deceleration in place of the acceleration.

    >>> from gears3d.scenario import load
    >>> round(predicted(load("scenarios/rigaud-2020/fig5-20rpm.toml")), 3)
    1.0
    """
    unit = assess(scenario).harmonics[0].threshold_amplitude_rad_s
    frequency = scenario.motion.harmonics[0].frequency

    def held(level: float) -> bool:
        changes = {
            "motion.harmonics[0].amplitude": f"{level * unit!r} rad/s",
            "run.duration": f"{_WAVES / frequency!r} s",
        }
        return assess(scenario.with_(changes)).excitation_total < 1.0

    low, high = 0.0, 1.1
    if not held(1e-6):
        remedy = "take effects out, slow the drive down or give more drag"
        raise InputError(Fault("effect", "separates the flanks without any speed fluctuation", remedy))
    while held(high) and high < 100.0:
        low, high = high, 2.0 * high
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if held(middle) else (low, middle)
        if high - low < 1e-5:
            break
    return 0.5 * (low + high)


def _losses(made: Recording) -> np.ndarray:
    """Return when each flight wider than the opening began [s] and how wide it was [m], (n, 2)."""
    hits, heights = made.impacts["time_s"], made.impacts["flight_height_m"]
    ends = np.sort([end for _, _, end in made.meta["contacts"]])
    wide = np.flatnonzero(heights > OPENING)
    starts = [max(ends[ends <= hits[i]].max(initial=0.0), hits[i - 1] if i else 0.0) for i in wide]
    return np.column_stack([starts, heights[wide]]).reshape(-1, 2)


def _ends(losses: np.ndarray, duration: float, frequency: float) -> tuple[float, float]:
    """Return Λ at the first loss of the rising half and at the last of the falling one."""
    period = 1.0 / frequency
    if not len(losses):
        return float("nan"), float("nan")
    (first, up, _), (last, down, _) = losses[0], losses[-1]
    begun = period < first < 0.5 * duration
    ended = 0.5 * duration < last < duration - 2.0 * period
    return (float(up) if begun else float("nan")), (float(down) if ended else float("nan"))
