"""From a scenario to the rigid model with oil and with teeth whose compliance and friction vary along their mesh."""

from __future__ import annotations

from functools import lru_cache
from math import cos, factorial, pi, sqrt
from typing import TYPE_CHECKING

import numpy as np

from gears3d.effects import Code
from gears3d.effects.support import refused
from gears3d.errors import Fault, InputError
from gears3d.laws.film import contact_length, equivalent_radius
from gears3d.lumped import layout as at
from gears3d.lumped.lubricated.friction import levers, shearing
from gears3d.lumped.model import Model, Teeth
from gears3d.lumped.rigid import packed
from gears3d.stiffness import harmonics

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.gears import Pair
    from gears3d.scenario import Scenario
    from gears3d.scenario.models import Lubricated

# Points of the table over one pitch of the drive; SHARP where friction changes sign at one place.
POINTS, SHARP = 64, 256
# Height at which the film begins to act: at most in backlashes, at least in gaps at which teeth touch.
WIDEST, NARROWEST = 0.3, 1.5
REMEDY = "run it with --model rigid"


def pack(scenario: Scenario) -> Model:
    """Return the packed lubricated model of a scenario: the rigid model's, with teeth that vary along their mesh.

    ``tooth_compliance`` replaces the stiffness of its own teeth. An InputError carries every fault of a scenario that
    has no ``oil_film`` or what the model cannot do.

    >>> from gears3d.scenario import load
    >>> m = pack(load("scenarios/dct-helical-lubricated/fig13.toml"))
    >>> bool(2.2e8 < m.stiffness < 2.8e8)
    True
    """
    rig, rows, settings = scenario.rig(), scenario.rows(), scenario.lubricated
    if faults := refusals(scenario):
        raise InputError(faults)
    tilt, mass = cos(rig.base_helix_angle), rig.inertia / rig.base_radius_loose**2
    film = next(row.p for row in rows if row.code == Code.GAP_FILM)
    springs = [row.p[0] for row in rows if row.code == Code.GAP_SPRING]
    published = settings.dead_zone == "published"
    layer = settings.published_gap / tilt if published else film[4]
    teeth = Teeth(
        table=_table(scenario.pair(), float(sum(springs)) if springs else None, settings),
        count=rig.teeth_drive,
        critical=0.0 if springs else 2.0 * settings.damping_ratio * sqrt(mass),
        ramp=film[4] if settings.ramp is None else settings.ramp / tilt,
        layer=layer,
        published=published,
        shearing=_shearing(rig, film, settings),
    )
    m = packed(scenario, teeth, settings.tolerance)
    felt = min(max(film[5], NARROWEST * layer), WIDEST * rig.backlash) - layer
    return m._replace(film=np.array([*film[:5], felt]))


def _shearing(rig: Rig, film: tuple[float, ...], settings: Lubricated) -> float:
    """Return the force of sheared oil by speed, length and thickness^(-1/2) [N·s·m^(-1/2)]."""
    if settings.sheared_oil != "rubs" or settings.friction == "none":
        return 0.0
    radius = equivalent_radius(
        rig.base_radius_drive, rig.base_radius_loose, rig.working_pressure_angle, rig.base_helix_angle
    )
    length = contact_length(rig.face_width, rig.contact_ratio, rig.base_helix_angle)
    viscosity = film[0] / (2.0 * length * radius)  # of the wedge, L·req·η0·2
    return pi * viscosity * sqrt(radius / (2.0 * cos(rig.base_helix_angle)))


@lru_cache(maxsize=8)
def _table(pair: Pair, spring: float | None, settings: Lubricated) -> np.ndarray:
    """Return splines of stiffness and levers over one pitch of the drive; many runs of one pair share them.

    They are as smooth as the integrator's order requires: slope discontinuities at every point would shorten its steps.
    """
    from scipy.interpolate import make_interp_spline

    printed = settings.friction == "published"
    count = SHARP if printed else POINTS
    theta = np.arange(count) / count * 2.0 * pi / pair.drive.teeth
    values = np.zeros((count, at.TOOTH_COLUMNS))
    length = contact_length(pair.drive.face_width, pair.contact_ratio, pair.drive.base_helix_angle)
    for flank, name in enumerate(("active", "reverse")):
        teeth = harmonics(pair, settings.harmonics, name)(theta) if spring is None else np.full(count, spring)
        values[:, at.TOOTH_STIFFNESS + flank] = teeth
        if settings.friction != "none":
            rubbing = (settings.average_friction, settings.regularisation, printed)
            values[:, at.LEVER + flank] = levers(pair, theta, flank, *rubbing)
            values[:, at.SHEAR + flank] = shearing(pair, theta, flank, printed, length)
    degree, around = at.PER_POINT - 1, np.vstack([values, values[:1]])
    spline = make_interp_spline(np.arange(count + 1.0), around, k=degree, bc_type="periodic")
    derivatives = [spline(np.arange(count, dtype=float), nu=k) / factorial(k) for k in range(degree, -1, -1)]
    return np.ascontiguousarray(np.stack(derivatives, axis=-1))


def refusals(scenario: Scenario) -> list[Fault]:
    """Return a fault for everything in a scenario that the lubricated model does not have."""
    faults = []
    file = "" if scenario.path is None else str(scenario.path)
    faults += refused(scenario.effects, scenario.rig(), "lubricated", file)
    films = sum(row.code == Code.GAP_FILM for row in scenario.rows())
    if films != 1:
        message = "there is no oil between the flanks" if not films else f"there are {films} oil films"
        remedy = 'give one [[effect]] with kind = "oil_film" and viscosity = "0.01 Pa s"'
        faults.append(Fault("effect", message, remedy, file))
    return faults
