"""What follows from a scenario before anything is simulated: excitation, expected regime, threshold."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from math import inf, isfinite, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.errors import InputError
from gears3d.laws.contact import drag_force, drive_amplitude, equivalent_mass
from gears3d.laws.excitation import dimensionless_backlash, excitation, riding, threshold_amplitude, threshold_omega
from gears3d.laws.orbit import Cycle, SineDrive, cycle
from gears3d.results import Result
from gears3d.signals import FLIGHT_HEIGHT_MIN
from gears3d.simulation.models import refuse_unseen

if TYPE_CHECKING:
    from gears3d.effects import Rig, Row
    from gears3d.scenario import Harmonic, Scenario

EXACT, APPROXIMATE, NONE = "closed form", "approximate", "none"
# Of the fastest wave, when the largest deceleration is looked for; it is then off by 0.12 % at most
SAMPLES_A_CYCLE = 64
MOST_SAMPLES = 2_000_000


def resisting(row: Row, speed: Any, angle: Any = 0.0, time: Any = np.inf) -> np.ndarray:
    """Return the torque that a row puts against the loose gear's motion, friction in the mesh excepted.

    >>> from gears3d.effects.rows import torque_linear
    >>> float(resisting(torque_linear(0.1, shaft_speed=2.0), 5.0).round(9))
    0.3
    """
    from gears3d.effects import Code
    from gears3d.effects.rows import Variable

    speed, p = np.asarray(speed, dtype=float), row.p
    if row.code == Code.TORQUE_CONSTANT:
        return p[0] * np.sign(speed)
    if row.code == Code.TORQUE_LINEAR:
        return p[0] * (speed - p[1])
    if row.code == Code.TORQUE_POWER:
        return p[0] * np.abs(speed) ** p[1] * np.sign(speed)
    if row.code == Code.TORQUE_HARMONIC:
        return p[1] * np.cos(p[0] * np.asarray(angle) + p[2]) + 0.0 * speed
    if row.code == Code.TORQUE_RELAX:
        return p[0] * -np.expm1(-np.asarray(time) / p[1]) * np.sign(speed)
    if row.code == Code.TORQUE_TABLE:
        at = {Variable.SPEED: speed, Variable.ANGLE: angle, Variable.TIME: time}[Variable(int(p[0]))]
        points = np.array(row.table)
        return np.interp(at, points[:, 0], points[:, 1]) + 0.0 * speed
    return np.zeros_like(speed)


def mean_resisting(row: Row, speed: float) -> float:
    """Return a row's torque at a steady speed, its mean over a revolution of the loose gear, in the end [N·m]."""
    turn = np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False)
    return float(np.mean(resisting(row, np.full_like(turn, speed), turn)))


class Sine(NamedTuple):
    """One sine of the drive's speed."""

    source: str  # its key
    amplitude: float  # [rad/s]
    frequency: float  # [Hz]
    phase: float  # [rad]


@dataclass(frozen=True)
class Expectation:
    """What is to be expected."""

    regime: str  # ``"contact"``, ``"single_sided"``, ``"double_sided"`` or ``"unknown"``
    basis: str  # ``"closed form"`` (exact for the rigid model), ``"approximate"`` or ``"none"``
    why: str = ""  # what stands in the way of a closed form; empty when nothing does
    periods: int | None = None  # of the drive that a cycle takes; ``None`` when it is not known
    impacts_per_period: float | None = None  # those after flights higher than 0.05 µm; ``None`` when it is not known
    flights: tuple[dict[str, Any], ...] = ()  # of the cycle, in order


def expect(
    scenario: Scenario,
    rig: Rig,
    sines: list[Sine],
    wavy: bool,
    rows: list[tuple[str, Row]],
    backlash: float,
    total: float,
) -> Expectation:
    """Return what is to be expected of the rigid model.

    Source: Rigaud & Perret-Liaudet 2020, eqs (7), (17)-(19).
    """
    from gears3d.effects import Code

    codes = {row.code for _, row in rows}
    for code, why in (
        (Code.GAP_FILM, "an oil film carries the gear before the flanks touch"),
        (Code.FLANK_TOOTH, "single teeth deviate"),
    ):
        if code in codes:
            return Expectation("unknown", NONE, why)
    try:
        refuse_unseen(scenario, "plastic")
    except InputError as unseen:
        return Expectation("unknown", NONE, "; ".join(f"{fault.key} has no closed form" for fault in unseen.faults))
    if scenario.motion.record is not None:
        return Expectation("unknown", NONE, "the drive's motion is a record")
    soft = "the teeth are compliant" if Code.GAP_SPRING in codes else ""
    if total <= 1.0:
        other = f"the run begins {scenario.start.state}" if scenario.start.state != "active" else ""
        return Expectation("contact", APPROXIMATE if soft or other else EXACT, soft or other, 1, 0.0)
    moving = [sine for sine in sines if sine.amplitude != 0.0]
    for hindered, why in (
        (bool(soft), soft),
        (wavy, "contact is lost, and the flanks are wavy"),
        (len(moving) != 1, f"contact is lost, and {len(moving)} harmonics move the drive, not one"),
    ):
        if hindered:
            return Expectation("unknown", NONE, why)
    return _in_closed_form(scenario, rig, moving[0], rows, backlash)


def _in_closed_form(
    scenario: Scenario, rig: Rig, sine: Sine, rows: list[tuple[str, Row]], backlash: float
) -> Expectation:
    from gears3d.effects import Code, Gate

    torques = [row for _, row in rows if 100 <= row.code < 200 and row.code != Code.TORQUE_FRICTION]
    speed = rig.mean_speed * rig.base_radius_drive / rig.base_radius_loose
    free = [row for row in torques if row.gate in (Gate.ALWAYS, Gate.FLIGHT)]
    drag = rig.drag_torque + sum(mean_resisting(row, speed) for row in free)
    pull = drag * rig.base_radius_loose / rig.inertia
    drive = SineDrive(rig.base_radius_drive * abs(sine.amplitude), 2 * pi * sine.frequency, pull)
    if drag < 0.0:
        return Expectation("unknown", NONE, "the torques drive the loose gear")
    found = cycle(drive, backlash, _restitution(rig, rows), scenario.impact.stick_velocity, FLIGHT_HEIGHT_MIN)
    if not found.why and drive.pull > 0.0 and rig.base_radius_drive * rig.mean_speed + found.slowest <= 0.0:
        found = found._replace(regime="unknown", why="the loose gear comes to a stop, where dry drag turns round")
    if rig.mean_speed <= 0.0:
        found = found._replace(regime="unknown", why="the drive does not turn forwards")
    if found.why:
        return Expectation("unknown", NONE, found.why, flights=_told(found))
    rough = []
    if any(row.code != Code.TORQUE_CONSTANT or row.gate != Gate.ALWAYS for row in torques):
        rough.append("the drag is taken at the mean speed")
    if any(row.code == Code.IMPACT_SCATTER for _, row in rows):
        rough.append("the restitution scatters")
    if scenario.start.state != "active":
        rough.append(f"the run begins {scenario.start.state}, the cycle on the active flank")
    counted = sum(flight.height > FLIGHT_HEIGHT_MIN for flight in found.flights)
    return Expectation(
        found.regime, APPROXIMATE if rough else EXACT, "; ".join(rough), found.periods,
        counted / found.periods if found.periods else None, _told(found),
    )  # fmt: skip


def _restitution(rig: Rig, rows: list[tuple[str, Row]]) -> Any:
    from gears3d.effects import Code

    def total(code: Code) -> float:
        return sum(row.p[0] for _, row in rows if row.code == code)

    base, slope, asymmetry = (
        rig.restitution + total(Code.IMPACT_OFFSET), total(Code.IMPACT_SLOPE), total(Code.IMPACT_FLANK)
    )  # fmt: skip
    return lambda flank, speed: min(max(base + slope * speed + (0.5 - flank) * asymmetry, 0.0), 1.0)


def _told(found: Cycle) -> tuple[dict[str, Any], ...]:
    names = ("active", "reverse")
    return tuple(
        {
            "left": names[flight.left], "lost_rad": flight.lost, "struck": names[flight.struck], "hit_rad": flight.hit,
            "duration_s": flight.duration, "velocity_m_s": flight.velocity, "height_m": flight.height,
        }
        for flight in found.flights
    )  # fmt: skip


@dataclass(frozen=True)
class Wave:
    """One harmonic of the drive."""

    source: str  # its key
    frequency_Hz: float  # Hz
    amplitude_rad_s: float  # of the drive's speed
    phase_rad: float  # of the sine at t = 0
    stroke_m: float  # H, amplitude on the line of action
    excitation: float  # Λ of this harmonic alone; infinite without drag
    backlash_dimensionless: float  # j̄ = j/H
    threshold_amplitude_rad_s: float  # amplitude of the speed at which Λ = 1 at this frequency
    threshold_frequency_Hz: float  # frequency at which Λ = 1 with this amplitude


@dataclass(frozen=True)
class Assessment(Result):
    """What a scenario asks of the drag."""

    mass_kg: float  # m = J/Rb2²
    drag: tuple[dict[str, Any], ...]  # the torques one by one at the mean speed: ``source``, ``torque_N_m``, ``acts``
    drag_torque_N_m: float  # their sum in contact on the active flank
    drag_force_N: float  # F, of that sum
    deceleration_rad_s2: float  # Td/J
    backlash_m: float  # with what effects change about its mean
    backlash_narrowest_m: float  # with the waves of the reverse flanks at their worst
    harmonics: tuple[Wave, ...]  # of the drive
    deceleration_largest_rad_s2: float  # of the loose gear riding on the active flank, over the run
    # largest ratio of J times that deceleration to the drag at the same moment; above 1 contact of rigid teeth is lost
    excitation_total: float
    expected: Expectation  # what is to be expected
    notes: tuple[str, ...] = ()  # a sentence each
    title: str = ""  # of the scenario

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
    Theory: docs/theory/rattle.md, equation (3).

    >>> from gears3d.scenario import load
    >>> found = assess(load("scenarios/rigaud-2020/fig5-20rpm.toml"))
    >>> round(found.excitation_total, 1), found.expected.regime
    (12.5, 'double_sided')
    """
    from gears3d.effects import Gate, Gear
    from gears3d.effects.rows import flank_eccentric
    from gears3d.gears.deviation import GEARS, Eccentricity

    rig = scenario.rig()
    rows = [
        (f"effect[{i}] {effect.kind}", row) for i, effect in enumerate(scenario.effects) for row in effect.rows(rig)
    ]
    ratio = rig.base_radius_drive / rig.base_radius_loose
    shifted = [
        flank_eccentric(Gear(GEARS.index(item.gear)), item.offset, item.phase)
        for which in GEARS
        for item in getattr(scenario.gears, which).mounting
        if isinstance(item, Eccentricity)
    ]
    speed = rig.mean_speed * ratio
    acting = (Gate.ALWAYS, Gate.CONTACT, Gate.ACTIVE)
    drag = [{"source": "drag.torque", "torque_N_m": rig.drag_torque, "acts": "always"}]
    mean: dict[tuple[str, str], float] = {}  # by effect and gate
    for source, row in rows:
        if 100 <= row.code < 200:
            key = source, Gate(row.gate).name.lower()
            mean[key] = mean.get(key, 0.0) + mean_resisting(row, speed)
    drag += [{"source": source, "torque_N_m": torque, "acts": acts} for (source, acts), torque in mean.items()]
    total = rig.drag_torque + sum(mean_resisting(row, speed) for _, row in rows if row.gate in acting)
    mass, force = equivalent_mass(rig.inertia, rig.base_radius_loose), float(drag_force(total, rig.base_radius_loose))
    backlash, narrowest, waves = _flanks(rig, [*(row for _, row in rows), *shifted])
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


def _left_out(scenario: Scenario) -> list[str]:
    """Return the keys of what shapes and tilts flanks, of which only a simulation shows the acceleration."""
    from gears3d.gears.deviation import GEARS, ProfileWave, Wobble

    found = []
    for which in GEARS:
        gear, made = getattr(scenario.gears, which), scenario.pair().gear(which)
        names = ("tip_relief", "root_relief", "lead_crowning", "helix_slope")
        kinds = [name for name in names if getattr(made, name)]
        kinds += sorted({f"profile_{'wave' if isinstance(d, ProfileWave) else 'slope'}" for d in gear.deviations})
        kinds += ["wobble"] * any(isinstance(item, Wobble) for item in gear.mounting)
        found += [f"gears.{which}.{kind}" for kind in kinds]
    return [*found, *(["mount.misalignment"] if scenario.mount.misalignment is not None else [])]


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
    if shapes := _left_out(scenario):
        found.append(
            f"not in the deceleration: {', '.join(shapes)}; contact may be lost at a smaller excitation (simulate it)"
        )
    return found
