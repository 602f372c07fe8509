"""What to expect of a scenario before anything is simulated: mass, drag, Λ, dimensionless backlash, regime."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import inf, isfinite, pi
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.laws.contact import drag_force, drive_amplitude, equivalent_mass
from gears3d.laws.excitation import (
    dimensionless_backlash,
    excitation,
    riding,
    threshold_amplitude,
    threshold_omega,
)
from gears3d.results import Result
from gears3d.simulation.expectation import Expectation, Sine, expect
from gears3d.simulation.resistance import mean_resisting, resisting

if TYPE_CHECKING:
    from gears3d.effects import Rig, Row
    from gears3d.scenario import Harmonic, Scenario

SAMPLES_A_CYCLE = 64
"""Of the fastest wave, when the largest deceleration is looked for; it is then off by 0.12 % at most."""
MOST_SAMPLES = 2_000_000


@dataclass(frozen=True)
class Wave:
    """One harmonic of the drive.

    Args:
        source: its key.
        frequency_Hz: Hz.
        amplitude_rad_s: of the drive's speed.
        phase_rad: of the sine at t = 0.
        stroke_m: H, amplitude on the line of action.
        excitation: Λ of this harmonic alone; infinite without drag.
        backlash_dimensionless: j̄ = j/H.
        threshold_amplitude_rad_s: amplitude of the speed at which Λ = 1 at this frequency.
        threshold_frequency_Hz: frequency at which Λ = 1 with this amplitude.
    """

    source: str
    frequency_Hz: float
    amplitude_rad_s: float
    phase_rad: float
    stroke_m: float
    excitation: float
    backlash_dimensionless: float
    threshold_amplitude_rad_s: float
    threshold_frequency_Hz: float


@dataclass(frozen=True)
class Assessment(Result):
    """What a scenario asks of the drag.

    Args:
        mass_kg: m = J/Rb2².
        drag: the torques one by one at the mean speed: ``source``, ``torque_N_m``, ``acts``.
        drag_torque_N_m: their sum in contact on the active flank.
        drag_force_N: F, of that sum.
        deceleration_rad_s2: Td/J.
        backlash_m: with what effects change about its mean.
        backlash_narrowest_m: with the waves of the reverse flanks at their worst.
        harmonics: of the drive.
        deceleration_largest_rad_s2: of the loose gear riding on the active flank, over the run.
        excitation_total: largest ratio of J times that deceleration to the drag at the same moment; above 1 contact
            of rigid teeth is lost.
        expected: what is to be expected.
        notes: a sentence each.
        title: of the scenario.
    """

    mass_kg: float
    drag: tuple[dict[str, Any], ...]
    drag_torque_N_m: float
    drag_force_N: float
    deceleration_rad_s2: float
    backlash_m: float
    backlash_narrowest_m: float
    harmonics: tuple[Wave, ...]
    deceleration_largest_rad_s2: float
    excitation_total: float
    expected: Expectation
    notes: tuple[str, ...] = ()
    title: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold; what is infinite or unknown is ``None``."""
        return _finite(asdict(self))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def assess(scenario: Scenario) -> Assessment:
    """Return what a scenario asks of the drag, and the regime to be expected of the rigid model.

    Args:
        scenario: nothing of it is simulated.

    Returns:
        Numbers that follow from the scenario alone.

    Raises:
        InputError: an effect does not fit the rig.

    Source: Kadmiri et al. 2012, eqs (23), (24); Rigaud & Perret-Liaudet 2020, eqs (2)-(10), (17)-(19).

    >>> from gears3d.scenario import load
    >>> found = assess(load("scenarios/rigaud-2020/fig5-20rpm.toml"))
    >>> round(found.excitation_total, 1), found.expected.regime
    (12.5, 'double_sided')
    """
    from gears3d.effects import Gate

    rig = scenario.rig()
    rows = [
        (f"effect[{i}] {effect.kind}", row) for i, effect in enumerate(scenario.effects) for row in effect.rows(rig)
    ]
    ratio = rig.base_radius_drive / rig.base_radius_loose
    speed = rig.mean_speed * ratio
    acting = (Gate.ALWAYS, Gate.CONTACT, Gate.ACTIVE)
    drag = [{"source": "drag.torque", "torque_N_m": rig.drag_torque, "acts": "always"}]
    drag += [
        {"source": source, "torque_N_m": mean_resisting(row, speed), "acts": Gate(row.gate).name.lower()}
        for source, row in rows
        if 100 <= row.code < 200
    ]
    total = rig.drag_torque + sum(mean_resisting(row, speed) for _, row in rows if row.gate in acting)
    mass, force = equivalent_mass(rig.inertia, rig.base_radius_loose), float(drag_force(total, rig.base_radius_loose))
    backlash, narrowest, waves = _flanks(rig, [row for _, row in rows])
    sines = _sines(scenario, rows)
    listed = tuple(_wave(*sine, rig, total, mass, force, backlash) for sine in sines)
    largest, ratio_largest = _combined(scenario, rig, sines, waves, [row for _, row in rows if row.gate in acting])
    wavy = bool(np.any(waves[:, 1] != 0.0)) or narrowest != backlash
    expected = expect(scenario, rig, sines, wavy, rows, backlash, ratio_largest)
    return Assessment(
        mass, tuple(drag), total, force, total / rig.inertia, backlash, narrowest, listed, largest, ratio_largest,
        expected, tuple(_notes(scenario, expected, rows)), scenario.title,
    )  # fmt: skip


def _sines(scenario: Scenario, rows: list[tuple[str, Row]]) -> list[Sine]:
    """Return key, amplitude [rad/s], frequency [Hz] and phase [rad] of everything that moves the drive."""
    from gears3d.effects import Code

    own = [Sine(f"motion.harmonics[{i}]", *_numbers(h)) for i, h in enumerate(scenario.motion.harmonics)]
    more = [Sine(source, *row.p[:3]) for source, row in rows if row.code == Code.MOTION_HARMONIC]
    return [sine for sine in (*own, *more) if sine.frequency > 0.0]


def _numbers(harmonic: Harmonic) -> tuple[float, float, float]:
    return harmonic.amplitude, harmonic.frequency, harmonic.phase


def _wave(
    source: str, amplitude: float, frequency: float, phase: float, rig: Rig, torque: float, mass: float, force: float,
    backlash: float,
) -> Wave:  # fmt: skip
    omega, ratio = 2 * pi * frequency, rig.base_radius_drive / rig.base_radius_loose
    stroke = float(drive_amplitude(abs(amplitude), rig.base_radius_drive, omega))
    return Wave(
        source, frequency, amplitude, phase, stroke, excitation(mass, stroke, omega, force),
        dimensionless_backlash(backlash, stroke), threshold_amplitude(rig.inertia, torque, omega, ratio),
        threshold_omega(rig.inertia, torque, amplitude, ratio) / (2 * pi),
    )  # fmt: skip


def _flanks(rig: Rig, rows: list[Row]) -> tuple[float, float, np.ndarray]:
    """Return the backlash without its waves, its smallest value with them all at their worst [m], and the waves.

    The waves are those of the active flanks: gear, order, amplitude [m], phase [rad].
    """
    from gears3d.effects import Code, Flank
    from gears3d.lumped.lower import eccentric

    shifted = [wave for row in rows if row.code == Code.FLANK_ECCENTRIC for wave in eccentric(rig, row)]
    waves = [row.p for row in (*rows, *shifted) if row.code == Code.FLANK_HARMONIC]
    backlash = rig.backlash - sum(size * np.cos(phase) for _, _, order, size, phase in waves if order == 0.0)
    opening: dict[tuple[float, float], complex] = {}
    for gear, _, order, size, phase in waves:
        if order != 0.0:
            opening[gear, order] = opening.get((gear, order), 0.0) + size * np.exp(1j * phase)
    active = [(gear, order, size, phase) for gear, flank, order, size, phase in waves if flank == Flank.ACTIVE]
    return (
        float(backlash),
        float(backlash - sum(abs(part) for part in opening.values())),
        np.array(active, dtype=float).reshape(-1, 4),
    )


def _combined(
    scenario: Scenario, rig: Rig, sines: list[Sine], waves: np.ndarray, rows: list[Row]
) -> tuple[float, float]:
    """Return the largest deceleration on the active flank [rad/s²], and of J·deceleration over the drag."""
    fastest = abs(rig.mean_speed) + sum(abs(sine.amplitude) for sine in sines)
    turning = [order * fastest * (1.0 if gear == 0 else rig.base_radius_drive / rig.base_radius_loose)
               for gear, order, _, _ in waves]  # fmt: skip
    turning += [abs(row.p[0]) * fastest for row in rows if row.code == 104]
    highest = max([2 * pi * sine.frequency for sine in sines] + turning + [2 * pi / scenario.run.duration])
    number = min(int(scenario.run.duration * highest / (2 * pi) * SAMPLES_A_CYCLE) + 2, MOST_SAMPLES)
    time = np.linspace(0.0, scenario.run.duration, number)
    angle, speed, acceleration = rig.mean_speed * time, np.full(number, rig.mean_speed), np.zeros(number)
    for _, amplitude, frequency, phase in sines:
        omega = 2 * pi * frequency
        angle -= amplitude / omega * (np.cos(omega * time + phase) - np.cos(phase))
        speed += amplitude * np.sin(omega * time + phase)
        acceleration += amplitude * omega * np.cos(omega * time + phase)
    radii = (rig.base_radius_drive, rig.base_radius_loose)
    loose, turned, gained = riding(radii, (angle, speed, acceleration), waves)
    torque = rig.drag_torque * np.sign(turned)
    for row in rows:
        torque = torque + resisting(row, turned, loose, time)
    inertial = -rig.inertia * gained
    lost = inertial > torque
    held = np.where(torque > 0.0, inertial / np.where(torque > 0.0, torque, 1.0), np.where(lost, inf, 0.0))
    return 0.0 - float(gained.min()), max(0.0, float(held.max()))


def _notes(scenario: Scenario, expected: Expectation, rows: list[tuple[str, Row]]) -> list[str]:
    from gears3d.effects import Code

    found = []
    if scenario.impact.restitution > 0.0 and expected.periods and expected.flights:
        found.append("bounces die out before contact is lost again, so it is lost where it would be without them")
    if any(row.code == Code.TORQUE_FRICTION for _, row in rows):
        found.append("friction in the mesh changes forces, not the motion of rigid flanks: it is not in the drag")
    if any(row.code == Code.TORQUE_RELAX for _, row in rows):
        found.append("a drag that drifts is listed as it is in the end")
    if any(row.code == Code.FLANK_TOOTH for _, row in rows):
        found.append("deviations of single teeth are not in the deceleration")
    return found
