"""Excitation of the loose gear against its drag, and the excitation at which contact is lost."""

from __future__ import annotations

from math import pi

from gears3d.laws.contact import drag_force as force_of
from gears3d.laws.contact import drive_amplitude as amplitude_of
from gears3d.laws.contact import equivalent_mass
from gears3d.laws.excitation import excitation as excitation_of
from gears3d.verification.papers.bench import Case
from gears3d.verification.papers.measures.registry import measure


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
