"""Excitation of the loose gear against its drag, and the excitation at which contact is lost."""

from __future__ import annotations

from math import pi, sqrt
from typing import Any

import numpy as np

from gears3d.laws.contact import drag_force as force_of
from gears3d.laws.contact import drive_amplitude as amplitude_of
from gears3d.laws.contact import equivalent_mass
from gears3d.laws.excitation import excitation as excitation_of
from gears3d.verification.papers.bench import Case
from gears3d.verification.papers.measures.registry import measure

STEPS = 12  # of the bisection over a factor of 4: the frequency is found to 0.03 %


@measure
def drive_amplitude(case: Case) -> float:
    """Return the drive's amplitude along the line of action, of its first harmonic [m]."""
    harmonic = case.scenario.motion.harmonics[0]
    return float(amplitude_of(harmonic.amplitude, case.rig.base_radius_drive, 2 * pi * harmonic.frequency))


@measure
def drag_force(case: Case) -> float:
    """Return the drag along the line of action [N]."""
    return float(force_of(case.rig.drag_torque, case.rig.base_radius_loose))


@measure
def excitation(case: Case) -> float:
    """Return Λ = m·H·ω²/F of the first harmonic."""
    omega = 2 * pi * case.scenario.motion.harmonics[0].frequency
    mass = equivalent_mass(case.rig.inertia, case.rig.base_radius_loose)
    return excitation_of(mass, drive_amplitude(case), omega, drag_force(case))


@measure
def threshold_excitation(case: Case) -> float:
    """Return Λ at which the rigid model loses contact, bisected over the drive's amplitude."""
    from gears3d.lumped.model import model
    from gears3d.lumped.run import run

    def compute() -> float:
        harmonic = case.scenario.motion.harmonics[0]
        low, high = 0.1, 10.0
        for _ in range(20):
            middle = 0.5 * (low + high)
            drive = (middle * harmonic.amplitude, harmonic.frequency, harmonic.phase)
            lost = len(run(model(case.rig, [drive]), 5.0 / harmonic.frequency).impacts)
            low, high = (low, middle) if lost else (middle, high)
        return 0.5 * (low + high) * excitation(case)

    return case.once("threshold", compute)


@measure
def threshold_amplitude(case: Case) -> float:
    """Return the amplitude of the drive's speed at which the rigid model loses contact [rad/s]."""
    return case.scenario.motion.harmonics[0].amplitude * threshold_excitation(case) / excitation(case)


def threshold(case: Case, amplitude: float, way: str = "up", error: str = "") -> float:
    """Return the frequency at which rattle begins (``up``, from contact) or ends (``down``, from flight) [Hz].

    As on the rig of Rigaud & Perret-Liaudet 2020, the frequency is swept at a constant amplitude [rpm]. The sweep is
    a bisection; each step is a run of its own. ``error`` names a scenario whose transmission error is added.
    """

    def search() -> float:
        _ = case.run  # its command belongs to the figure
        scenario = case.scenario
        unit = case.rig.drag_torque / case.rig.inertia / (2 * pi * amplitude * pi / 30)
        low, high = (unit * (0.05 if error else 0.5), unit * 2.0)
        more: dict[str, Any] = {"start.state": "active" if way == "up" else "free", "expect": {}}
        if error:
            more["effect"] = _transmission_errors(case.bench.case(error))
        for _ in range(STEPS):
            case.bench.breathe()
            middle = sqrt(low * high)
            lost = _rattles(scenario.with_({**_swept(amplitude, middle), **more}))
            low, high = (low, middle) if lost else (middle, high)
        return sqrt(low * high)

    return case.once(f"threshold {amplitude} {way} {error}", search)


def _swept(amplitude: float, frequency: float) -> dict[str, Any]:
    return {
        "motion.harmonics": [{"amplitude": f"{amplitude} rpm", "frequency": f"{frequency!r} Hz"}],
        "run.duration": "8 periods",
        "run.settle": "4 periods",
        "run.output_rate": "1 kHz",
    }


def _transmission_errors(case: Case) -> list[dict[str, Any]]:
    return [
        {"kind": "transmission_error", "order": e.order, "amplitude": f"{e.amplitude!r} m", "phase": f"{e.phase!r} rad"}
        for e in case.scenario.effects
    ]


def _rattles(scenario: Any) -> bool:
    from gears3d.signals import counted, window
    from gears3d.simulation import simulate

    run = simulate(scenario, "rigid")
    return counted(run.impacts, *window(run.signals, run.meta))["time_s"].size > 0


@measure
def threshold_frequency(case: Case, amplitude: float) -> float:
    """Return the frequency at which rattle begins at an amplitude of the drive's speed [rpm] [Hz]."""
    return threshold(case, amplitude)


@measure
def swept_excitation(case: Case, amplitude: float, error: str = "") -> float:
    """Return Λ* = J·ω·ΔΩ/Td at the frequency where rattle begins (Rigaud & Perret-Liaudet 2020, eq. (8))."""
    rig = case.rig
    return rig.inertia * 2 * pi * threshold(case, amplitude, error=error) * amplitude * pi / 30 / rig.drag_torque


@measure
def threshold_slope(case: Case, amplitudes: list[float]) -> float:
    """Return the slope of the threshold's frequency over the amplitude, both logarithmic."""
    found = [threshold(case, amplitude) for amplitude in amplitudes]
    return float(np.polyfit(np.log10(amplitudes), np.log10(found), 1)[0])


@measure
def hysteresis(case: Case, amplitudes: list[float]) -> float:
    """Return the largest ratio of the frequency where rattle ends to that where it begins.

    Amplitudes at which the drive would turn back are omitted.
    """
    kept = [each for each in amplitudes if each * pi / 30 < case.scenario.motion.mean]
    return max(threshold(case, each, "down") / threshold(case, each, "up") for each in kept)
