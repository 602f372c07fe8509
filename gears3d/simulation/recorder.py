"""Synthetic records of a test rig: one scenario, or a sweep of the drive's speed."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from math import ceil, gcd, pi
from tempfile import gettempdir
from typing import TYPE_CHECKING

import numpy as np

from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.files import PRIVATE, temporary
from gears3d.recording import Recording
from gears3d.simulation.excitation import assess
from gears3d.simulation.models import simulate
from gears3d.simulation.sensors import encode, observe
from gears3d.units import show
from gears3d.virtual_tests import RENAMED, SYNTHESIZED

if TYPE_CHECKING:
    from gears3d.scenario import Scenario
    from gears3d.scenario.models import Sensors


SLOW = 2.0 * pi / 60.0  # Speed of slow turns unless given: 1 rpm, as Rigaud & Perret-Liaudet 2020 turn [rad/s]
# Samples per revolution of slow turns, at most: as fine as any order asks for; no whole number, so that counts of
# encoders do not come again turn by turn
PER_TURN = 9973.618
FEWEST, MOST = 10, 60  # Turns unless given: at least and at most, in whole hunting cycles where there are that many
RANGE = (0.5, 1.6)  # Of the speed fluctuation, over that at which Λ = 1
FEWEST_PERIODS = 20  # Periods that a sweep must have
_SAMPLES = 48  # Of the drive's motion, a period of its fastest harmonic


def synthesize(
    scenario: Scenario,
    test: str = "rattle",
    *,
    model: str = "rigid",
    seed: int | None = None,
    speed: float | None = None,
    turning: str = "loose",
    drive_drag: tuple[float, float] = (0.0, 0.0),
    amplitudes: tuple[float, float] | None = None,
    turns: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Return what encoders would have recorded of a scenario.

    Args:
        scenario: what happens, and its ``[sensors]``.
        test: ``"rattle"`` runs the scenario, ``"coastdown"`` lets gears coast down, ``"threshold"`` lets the first
            harmonic's amplitude grow and fall, ``"transmission-error"`` drives slowly forth on the active flanks and
            back on the reverse ones.
        model: of the rattle test, as ``simulate`` takes it.
        seed: of the encoders' noise; that of the scenario unless given.
        speed: at the start of a coast-down, of the gear that turns, the loose one of both; of the drive in slow turns
            [rad/s].
        turning: in a coast-down: ``"loose"`` or ``"drive"`` out of mesh, ``"both"`` in mesh.
        amplitudes: of a threshold test: smallest and largest amplitude of the first harmonic's speed [rad/s].
        drive_drag: of the drive's own shaft when it runs down: dry [N·m], viscous [N·m·s/rad].
        turns: of the drive in slow turns, each way; unless given so many that orders of both gears come apart.
        progress: called now and then with the simulated time done [s].

    Returns:
        Time and both angles at the encoders' rate, slow turns at no more than 9974 samples per revolution, with noise,
        counts and sensor effects.

    Raises:
        InputError: the scenario is bad.
        UsageError: the test or the model is not known.
        KeyboardInterrupt: the simulation was interrupted; half a record would look like a whole one.

    >>> from gears3d.scenario import load
    >>> synthesize(load("scenarios/rigaud-2020/fig5-20rpm.toml", {"run.duration": "1 s"}))
    Recording(50001 samples of 0..1 s, 0 impacts)
    """
    if test in RENAMED:
        warnings.warn(f"the test {test!r} is called {RENAMED[test]!r} now", DeprecationWarning, stacklevel=2)
        test = RENAMED[test]
    if test not in SYNTHESIZED:
        raise UsageError(f"there is no test {test!r}; {did_you_mean(test, SYNTHESIZED)}")
    sensors = scenario.sensors
    if test == "coastdown":
        from gears3d.lumped.rig_tests import DriveDrag, rundown

        coasted = rundown(scenario, speed, progress=progress, turning=turning, drive_drag=DriveDrag(*drive_drag))
        happened = observe(coasted, scenario.effects, scenario.rig())
    elif test == "threshold":
        _check_rate(scenario)
        happened = sweep(scenario, amplitudes, progress)
    elif test == "transmission-error":
        happened, sensors = _slow(scenario, speed, turns, progress)
    else:
        _check_rate(scenario)
        sampled = scenario.with_({"run.output_rate": f"{sensors.sample_rate!r} Hz"})
        happened = simulate(sampled, model, progress=progress)
    if happened.meta.get("interrupted"):
        raise KeyboardInterrupt
    return encode(happened, sensors, scenario.run.seed if seed is None else seed)


record = synthesize  # Former name of :func:`synthesize`


def _slow(
    scenario: Scenario, speed: float | None, turns: float | None, progress: Callable[[float], None] | None
) -> tuple[Recording, Sensors]:
    """Return slow turns as the sensors see them, and the sensors at the rate that these take."""
    from gears3d.lumped.rig_tests import slow_turns

    speed = SLOW if speed is None else speed
    rate = min(scenario.sensors.sample_rate, PER_TURN * abs(speed) / (2.0 * pi))
    made = slow_turns(scenario, speed, hunting(scenario) if turns is None else turns, rate, progress)
    return observe(made, scenario.effects, scenario.rig()), replace(scenario.sensors, sample_rate=rate)


def hunting(scenario: Scenario) -> int:
    """Return the turns of the drive that slow turns take: whole hunting cycles, in which orders of both gears part.

    >>> from gears3d.scenario import load
    >>> [hunting(load(f"scenarios/base/{name}.toml")) for name in ("rigaud-2020", "kadmiri-2012")]
    [10, 37]
    """
    drive, loose = scenario.gears.drive.teeth, scenario.gears.loose.teeth
    cycle = loose // gcd(drive, loose)
    return min(cycle * ceil(FEWEST / cycle), MOST)


def _check_rate(scenario: Scenario) -> None:
    """Refuse a rate of the encoders that folds a harmonic of the drive down."""
    rate = scenario.sensors.sample_rate
    fastest = max((harmonic.frequency for harmonic in scenario.motion.harmonics), default=0.0)
    if fastest > rate / 2:
        message = f"is {show(rate, 'frequency')}, less than twice the drive's {show(fastest, 'frequency')}"
        raise InputError(Fault("sensors.sample_rate", message, f"give more than {show(2 * fastest, 'frequency')}"))


def sweep(
    scenario: Scenario,
    span: tuple[float, float] | None = None,
    progress: Callable[[float], None] | None = None,
    model: str = "rigid",
) -> Recording:
    """Return a run in which the first harmonic's amplitude grows from one value to another and falls back.

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
    if duration * frequency < FEWEST_PERIODS:
        least, better = show(FEWEST_PERIODS / frequency, "time"), show(3 * FEWEST_PERIODS / frequency, "time")
        remedy = (
            f"give {least} or more; {3 * FEWEST_PERIODS} periods and more are better: --set 'run.duration={better}'"
        )
        raise InputError(
            Fault("run.duration", f"holds {duration * frequency:.3g} periods of the speed fluctuation", remedy)
        )
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
