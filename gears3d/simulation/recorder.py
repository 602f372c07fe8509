"""Synthetic records: a scenario run as a test on a bench, seen through its encoders."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.recording import Recording
from gears3d.simulation.encoder import encode
from gears3d.simulation.models import simulate
from gears3d.simulation.sensors import observe
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

TESTS = ("rattle", "rundown", "threshold")
"""What a bench can do: run the scenario; let gears run down; let the swing grow and fall."""


def record(
    scenario: Scenario,
    test: str = "rattle",
    *,
    model: str = "rigid",
    seed: int | None = None,
    speed: float | None = None,
    turning: str = "loose",
    drive_drag: tuple[float, float] = (0.0, 0.0),
    amplitudes: tuple[float, float] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Return what encoders would have recorded of a scenario.

    Args:
        scenario: what happens, and its ``[sensors]``.
        test: ``"rattle"`` runs the scenario, ``"rundown"`` lets gears run down, ``"threshold"`` lets the first
            harmonic's amplitude grow and fall.
        model: of the rattle test, as ``simulate`` takes it.
        seed: of the encoders' noise; that of the scenario unless given.
        speed: at the start of a run-down, of the gear that turns, the loose one of both [rad/s].
        turning: in a run-down: ``"loose"`` or ``"drive"`` out of mesh, ``"both"`` in mesh.
        amplitudes: of a threshold test: smallest and largest amplitude of the first harmonic's speed [rad/s].
        drive_drag: of the drive's own shaft when it runs down: dry [N·m], viscous [N·m·s/rad].
        progress: called now and then with the simulated time done [s].

    Returns:
        Time and both angles at the encoders' rate, with noise, counts and sensor effects.

    Raises:
        InputError: the scenario is bad.
        UsageError: the test or the model is not known.
        KeyboardInterrupt: the simulation was interrupted; half a record would pass for a whole one.

    >>> from gears3d.scenario import load
    >>> record(load("scenarios/rigaud-2020/fig5-20rpm.toml", {"run.duration": "1 s"}))
    Recording(50001 samples of 0..1 s, 0 impacts)
    """
    if test not in TESTS:
        raise UsageError(f"there is no test {test!r}; {did_you_mean(test, list(TESTS))}")
    sensors = scenario.sensors
    if test == "rundown":
        from gears3d.lumped.rundown import DriveDrag, rundown

        coasted = rundown(scenario, speed, progress=progress, turning=turning, drive_drag=DriveDrag(*drive_drag))
        happened = observe(coasted, scenario.effects, scenario.rig())
    elif test == "threshold":
        from gears3d.simulation.sweep import sweep

        _check_rate(scenario)
        happened = sweep(scenario, amplitudes, progress)
    else:
        _check_rate(scenario)
        sampled = scenario.with_({"run.output_rate": f"{sensors.sample_rate!r} Hz"})
        happened = simulate(sampled, model, progress=progress)
    if happened.meta.get("interrupted"):
        raise KeyboardInterrupt
    return encode(happened, sensors, scenario.run.seed if seed is None else seed)


def _check_rate(scenario: Scenario) -> None:
    """Refuse a rate of the encoders that folds a harmonic of the drive down."""
    rate = scenario.sensors.sample_rate
    fastest = max((harmonic.frequency for harmonic in scenario.motion.harmonics), default=0.0)
    if fastest > rate / 2:
        message = f"is {show(rate, 'frequency')}, less than twice the drive's {show(fastest, 'frequency')}"
        raise InputError(Fault("sensors.sample_rate", message, f"give more than {show(2 * fastest, 'frequency')}"))
