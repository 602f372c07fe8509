"""The lubricated model: a scenario as the rigid model with oil, compliance and friction of teeth; its recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from math import cos, factorial, pi, sin, sqrt, tan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gears3d.effects import Code
from gears3d.effects.support import refused
from gears3d.errors import Fault, InputError
from gears3d.laws.film import contact_length, equivalent_radius
from gears3d.lumped import layout as at
from gears3d.lumped.model import Model, Teeth
from gears3d.lumped.rigid import packed, recorded
from gears3d.lumped.run import Outcome, run
from gears3d.recording import Recording
from gears3d.stiffness import harmonics
from gears3d.stiffness.mesh import contact_path, pair_stiffness, reverse_lead

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.gears import Pair
    from gears3d.scenario import Scenario
    from gears3d.scenario.models import Lubricated

Array = NDArray[np.float64]
SLICES = 64  # slices of the face over which lines of contact are averaged
# Points of the table over one pitch of the drive; SHARP where friction changes sign at one place.
POINTS, SHARP = 64, 256
# Height at which the film begins to act: at most in backlashes, at least in gaps at which teeth touch.
WIDEST, NARROWEST = 0.3, 1.5
REMEDY = "run it with --model rigid"
WORKS = ("mesh", "drag", "friction", "spring", "damping", "squeeze", "wedge", "drive")


def coefficient(place: ArrayLike, average: float, regularisation: float) -> Array:
    """Return µ at a distance from the pitch point, (2µ/π)·(atan x + x/(1 + x²)) with x = Φ·place.

    ``place`` [m] counts in the sense of the contact's motion, ``average`` is µ far from the pitch point,
    ``regularisation`` is Φ [1/m]. Printed is ε, the contact ratio, in place of the second Φ, with which both terms
    would change sign at different places.

    Source: the lubricated dual-clutch transmission, eq. (29), after Vaishya & Singh 2003.

    >>> coefficient([-1.0, 0.0, 1.0], 0.05, 50e3).round(6).tolist()
    [-0.05, 0.0, 0.05]
    """
    x = regularisation * np.asarray(place, float)
    return 2.0 * average / pi * (np.arctan(x) + x / (1.0 + x * x))


def levers(pair: Pair, theta: Array, flank: int, average: float, regularisation: float, published: bool) -> Array:
    """Return the ratio (n,) of friction to flank force on the loose gear along the transverse line of action.

    ``theta`` are angles of the drive [rad], (n,); ``flank`` is 0 active, 1 reverse; ``published`` takes one place for
    all lines and the arm at the pitch point, r·sin αt, as printed. Friction on the loose gear acts along the rolling
    direction while the drive slides faster, behind the pitch point; its arm is the distance from the contact to the
    point where the line of action touches the loose gear's base circle.

    Source: the lubricated dual-clutch transmission, eqs (27) to (29).
    """
    tilt = cos(pair.drive.base_helix_angle)
    base, tangent = pair.loose.base_radius, tan(pair.working_pressure_angle)
    if published:
        place = _one_place(pair, theta, flank)
        return coefficient(place, average, regularisation) * tangent / tilt
    places = _places(pair, theta, flank)
    weights = pair_stiffness(pair, places)
    moments = coefficient(places, average, regularisation) * (base * tangent - places) * weights
    return moments.sum(axis=(1, 2)) / np.maximum(weights.sum(axis=(1, 2)), 1e-300) / (base * tilt)


def shearing(pair: Pair, theta: Array, flank: int, published: bool, length: float) -> Array:
    """Return the integral over all lines of contact of place times arm, in base radii of the loose gear [m²], (n,).

    Times π·η0·√(req/2h) and both speeds together it is the force of sheared oil along the line of action. ``theta``
    [rad], (n,), ``flank`` and ``published`` are as for :func:`levers`; ``length`` [m] of the lines of contact counts
    where printed.

    Source: the lubricated dual-clutch transmission, eqs (30), (31).
    """
    base, tangent = pair.loose.base_radius, tan(pair.working_pressure_angle)
    if published:
        return length * _one_place(pair, theta, flank) * tangent
    places = _places(pair, theta, flank)
    begin, end = contact_path(pair)
    inside = (places >= begin) & (places <= end)
    width = min(pair.drive.face_width, pair.loose.face_width) / SLICES / cos(pair.drive.base_helix_angle)
    return np.where(inside, places * (tangent - places / base), 0.0).sum(axis=(1, 2)) * width


def _one_place(pair: Pair, theta: Array, flank: int) -> Array:
    """The contact in the middle of the face that is next to the pitch point [m]."""
    pitch = pair.drive.base_pitch
    place = pair.drive.base_radius * theta if flank == 0 else reverse_lead(pair) - pair.drive.base_radius * theta
    return np.mod(place + 0.5 * pitch, pitch) - 0.5 * pitch


def _places(pair: Pair, theta: Array, flank: int) -> Array:
    """Contacts of all teeth in all slices, those beyond the path included, (n, teeth, slices) [m]."""
    width = min(pair.drive.face_width, pair.loose.face_width)
    heights = ((np.arange(SLICES) + 0.5) / SLICES - 0.5) * width * tan(pair.drive.base_helix_angle)
    begin, end = contact_path(pair)
    reach = float(np.max(np.abs(heights)))
    pitch = pair.drive.base_pitch
    count = int(np.ceil((max(end, -begin) + reach) / pitch)) + 1
    first = _one_place(pair, theta, flank)
    return first[:, None, None] + pitch * np.arange(-count, count + 1)[:, None] + heights


def arm(pair: Pair) -> float:
    """Return the arm of friction at the pitch point, r·sin αt of the loose gear [m]."""
    angle = pair.working_pressure_angle
    return pair.loose.base_radius / cos(angle) * sin(angle)


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


def simulate(scenario: Scenario, progress: Callable[[float], None] | None = None) -> Recording:
    """Run a scenario in the lubricated model.

    Args:
        scenario: with an effect ``oil_film``; its restitution is not used, as the teeth are compliant. Effects of
            sensors do not act here.
        progress: called now and then with the simulated time done [s].

    Returns:
        The recording, with ``mesh_force_N`` (along the normal, on the loose gear, active flank positive) and the
        signals of the contract. An impact is a passage through the height at which the film begins to act, as in the
        rigid twin with oil. ``meta`` has ``rattle_index``, ``works_J`` (:data:`WORKS`), ``felt_height_m``,
        ``counters``, ``contacts`` and ``lyapunov_1_s``.

    Raises:
        InputError: the scenario holds what the model cannot do, or no oil.
        EngineError: the motion cannot continue.

    Source: the lubricated dual-clutch transmission, eqs (1) to (14) and (27) to (33).

    >>> from gears3d.scenario import load
    >>> short = load("scenarios/dct-helical-lubricated/fig13.toml", {"run.duration": "0.1 s", "run.settle": "0 s"})
    >>> recording = simulate(short)
    >>> sorted(set(recording.impacts["flank"].tolist()))
    [0, 1]
    """
    m = pack(scenario)
    rig, duration = scenario.rig(), scenario.run.duration
    m = m._replace(settle=min(scenario.run.settle, duration), works=True)
    outcome = run(m, duration, 1.0 / scenario.run.output_rate, scenario.start.state, progress, lyapunov=True)
    made, tilt = recorded(flown(outcome, m), m, scenario, "lubricated"), cos(rig.base_helix_angle)
    signals = {**made.signals, "mesh_force_N": (outcome.forces[:, 0] - outcome.forces[:, 1]) / tilt}
    meta = {
        **made.meta,
        "rattle_index": sqrt(outcome.jerk) / tilt / rig.inertia if outcome.jerk >= 0.0 else None,
        "works_J": dict(zip(WORKS, outcome.works.tolist(), strict=True)),
        "felt_height_m": float(m.film[5] + m.flat()[at.LAYER]),
    }
    return Recording(signals, made.impacts, meta)


def flown(outcome: Outcome, m: Model) -> Outcome:
    """Return a run whose flights are as high as they get above the height at which the film begins to act."""
    impacts = outcome.impacts.copy()
    impacts[:, 6] = np.maximum(impacts[:, 6] - m.film[5], 0.0)
    return replace(outcome, impacts=impacts)
