"""From a scenario to the numbers of the lubricated kernel."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import cos, pi, sqrt
from typing import TYPE_CHECKING

import numpy as np

from gears3d.effects import Code
from gears3d.effects.support import refused
from gears3d.errors import Fault, InputError
from gears3d.laws.film import contact_length, equivalent_radius
from gears3d.lumped.lower import eccentric, motion
from gears3d.lumped.lubricated import layout as at
from gears3d.lumped.lubricated.friction import levers, shearing
from gears3d.stiffness import harmonics

if TYPE_CHECKING:
    from gears3d.effects import Rig, Row
    from gears3d.gears import Pair
    from gears3d.scenario import Scenario
    from gears3d.scenario.lubricated import Lubricated

POINTS = 256
"""Of the table over one pitch of the drive."""
REMEDY = "run it with --model rigid"


@dataclass(frozen=True)
class Model:
    """The packed model.

    Args:
        numbers: as :mod:`gears3d.lumped.lubricated.layout` has them.
        sines: of the drive: amplitude [rad/s], omega [rad/s], phase [rad], its cosine; (n, 4).
        waves: of the flanks: gear, order, phase [rad], size on active and reverse flank [m]; (n, 5).
        powers: drag torques: coefficient and exponent; (n, 2).
        table: over one pitch of the drive; (n, 6).
        longest: largest step [s].
        period: of the slowest excitation [s].
    """

    numbers: np.ndarray
    sines: np.ndarray
    waves: np.ndarray
    powers: np.ndarray
    table: np.ndarray
    longest: float
    period: float

    def arguments(self) -> tuple[np.ndarray, ...]:
        """What the kernel takes first."""
        return self.numbers, self.sines, self.waves, self.powers, self.table


def pack(scenario: Scenario) -> Model:
    """Return the lubricated model of a scenario.

    Args:
        scenario: with an effect ``oil_film``; ``tooth_compliance`` takes the place of the stiffness of its own teeth.

    Returns:
        The packed model.

    Raises:
        InputError: the scenario holds what the model cannot do, or no oil; carries every fault.

    >>> from gears3d.scenario import load
    >>> m = pack(load("scenarios/dct-helical-lubricated/fig13.toml"))
    >>> bool(2.2e8 < m.table[:, 0].mean() < 2.8e8)
    True
    """
    rig, rows, teeth = scenario.rig(), scenario.rows(), scenario.lubricated
    if faults := refusals(scenario):
        raise InputError(faults)
    sines = [(h.amplitude, h.frequency, h.phase) for h in scenario.motion.harmonics]
    mean, moving = motion(rig, sines + [row.p for row in rows if row.code == Code.MOTION_HARMONIC])
    waves, thinner = _waves(rig, rows)
    numbers = _numbers(rig, rows, teeth, scenario.pair())
    numbers[at.MEAN] = mean
    numbers[at.BACKLASH] -= thinner
    springs = [row.p[0] for row in rows if row.code == Code.GAP_SPRING]
    table = _table(scenario.pair(), float(sum(springs)) if springs else None, teeth).copy()
    slowest = 2.0 * pi / float(moving[:, 1].min()) if len(moving) else scenario.run.duration
    fastest = abs(mean) + float(np.abs(moving[:, 0]).sum())
    fast = [2.0 * pi / float(moving[:, 1].max()) / 12.0] if len(moving) else []
    fast += [2.0 * pi / (fastest * rig.teeth_drive) / 3.0] if fastest > 0.0 else []
    longest = min([*fast, scenario.run.duration / 10.0])
    powers = np.array([row.p[:2] for row in rows if row.code == Code.TORQUE_POWER], dtype=float).reshape(-1, 2)
    return Model(numbers, moving, waves, powers, table, longest, slowest)


def _numbers(rig: Rig, rows: tuple[Row, ...], settings: Lubricated, pair: Pair) -> np.ndarray:
    """The numbers of the rig, its film and its teeth."""
    p = np.zeros(at.NUMBERS)
    tilt = cos(rig.base_helix_angle)
    p[at.MASS] = rig.inertia / rig.base_radius_loose**2
    p[at.RADIUS_DRIVE], p[at.RADIUS_LOOSE] = rig.base_radius_drive, rig.base_radius_loose
    p[at.BACKLASH], p[at.TEETH] = rig.backlash, rig.teeth_drive
    film = next(row.p for row in rows if row.code == Code.GAP_FILM)
    p[at.WEDGE], p[at.SQUEEZE], p[at.ROLL_DRIVE], p[at.ROLL_LOOSE], p[at.FLOOR] = film[:5]
    p[at.PUBLISHED] = float(settings.dead_zone == "published")
    p[at.THRESHOLD] = settings.published_gap / tilt if p[at.PUBLISHED] else film[4]
    p[at.FELT] = min(max(film[5], 1.5 * p[at.THRESHOLD]), 0.3 * rig.backlash)
    p[at.DAMPING] = 2.0 * settings.damping_ratio * sqrt(p[at.MASS])
    springs = [row.p for row in rows if row.code == Code.GAP_SPRING]
    p[at.FIXED_DAMPING] = sum(damping for _, damping in springs) if springs else -1.0
    p[at.RAMP] = max(film[4] if settings.ramp is None else settings.ramp / tilt, 1e-15)
    p[at.TORQUE] = rig.drag_torque + sum(row.p[0] for row in rows if row.code == Code.TORQUE_CONSTANT)
    linear = [row.p for row in rows if row.code == Code.TORQUE_LINEAR]
    p[at.VISCOUS], p[at.CARRIED] = sum(c for c, _ in linear), sum(c * shaft for c, shaft in linear)
    p[at.RUBBING] = sum(row.p[0] for row in rows if row.code == Code.TORQUE_FRICTION)
    if settings.sheared_oil == "rubs" and settings.friction != "none":
        radius = equivalent_radius(
            rig.base_radius_drive, rig.base_radius_loose, rig.working_pressure_angle, rig.base_helix_angle
        )
        length = contact_length(rig.face_width, rig.contact_ratio, rig.base_helix_angle)
        viscosity = film[0] / (2.0 * length * radius) if film[0] else 0.0  # of the wedge, L·req·η0·2
        p[at.SHEARING] = pi * viscosity * sqrt(radius / (2.0 * tilt))
    return p


@lru_cache(maxsize=8)
def _table(pair: Pair, spring: float | None, settings: Lubricated) -> np.ndarray:
    """Stiffness and levers over one pitch of the drive; many runs of one pair share them."""
    theta = np.arange(POINTS) / POINTS * 2.0 * pi / pair.drive.teeth
    table = np.zeros((POINTS, at.COLUMNS))
    printed = settings.friction == "published"
    length = contact_length(pair.drive.face_width, pair.contact_ratio, pair.drive.base_helix_angle)
    for flank, name in enumerate(("active", "reverse")):
        teeth = harmonics(pair, settings.harmonics, name)(theta) if spring is None else np.full(POINTS, spring)
        table[:, at.STIFFNESS + flank] = teeth
        if settings.friction != "none":
            rubbing = (settings.average_friction, settings.regularisation, printed)
            table[:, at.LEVER + flank] = levers(pair, theta, flank, *rubbing)
            table[:, at.SHEAR + flank] = shearing(pair, theta, flank, printed, length)
    return table


def _waves(rig: Rig, rows: tuple[Row, ...]) -> tuple[np.ndarray, float]:
    """Waves of the flanks, and what they take off the backlash for good [m]."""
    shifted = [wave for row in rows if row.code == Code.FLANK_ECCENTRIC for wave in eccentric(rig, row)]
    waves, taken = [], 0.0
    for row in (*rows, *shifted):
        if row.code != Code.FLANK_HARMONIC:
            continue
        gear, flank, order, amplitude, phase = row.p
        if order == 0.0 and flank == 1.0:
            taken += amplitude * np.cos(phase)
        else:
            waves.append((gear, order, phase, amplitude * (flank == 0.0), amplitude * (flank == 1.0)))
    return np.array(waves, dtype=float).reshape(-1, 5), taken


def refusals(scenario: Scenario) -> list[Fault]:
    """Return a fault for everything in a scenario that the lubricated model does not take."""
    faults = []
    file = "" if scenario.path is None else str(scenario.path)
    if scenario.motion.record is not None:
        faults.append(Fault("motion.record", "is a measured motion; the lubricated model has harmonics", REMEDY, file))
    faults += refused(scenario.effects, scenario.rig(), "lubricated", file)
    films = sum(row.code == Code.GAP_FILM for row in scenario.rows())
    if films != 1:
        message = "there is no oil between the flanks" if not films else f"there are {films} oil films"
        remedy = 'give one [[effect]] with kind = "oil_film" and viscosity = "0.01 Pa s"'
        faults.append(Fault("effect", message, remedy, file))
    return faults
