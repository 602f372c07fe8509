"""What is hidden: effects of the catalogue, and causes outside it, which a diagnosis must report as unknown.

Effects are drawn as TOML values and sized by their own unit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import degrees, pi, sqrt
from typing import TYPE_CHECKING, Any

from gears3d.verification.challenge.physics import (
    ADHESION,
    BEARING,
    COGGING,
    DRIVE_ANGLE,
    IMPACT_ANGLE,
    STICK_SLIP,
    WARMING,
)

if TYPE_CHECKING:
    import numpy as np

    from gears3d.scenario import Scenario

# The catalogue of format 1
KINDS = (
    "transmission_error",
    "eccentricity",
    "pitch_error",
    "backlash_offset",
    "backlash_variation",
    "drag_coulomb",
    "drag_viscous",
    "drag_power",
    "drag_differential",
    "drag_position",
    "drag_drift",
    "mesh_drag",
    "mesh_friction",
    "restitution_offset",
    "restitution_speed",
    "restitution_asymmetry",
    "restitution_scatter",
    "tooth_compliance",
    "oil_film",
    "drive_motion",
    "encoder_eccentricity",
    "encoder_skew",
)
# Kinds that are hidden where they are asked for: what a seed draws among the others stays what it was
ASKED = ("carried_inertia", "drag_stick_slip")
# Periods of a body on a spring in a fall across the backlash, and its damping ratio
PERIODS, DAMPING = (2.0, 8.0), (0.01, 0.1)
# Least stiffness of teeth that is hidden, N/m; a scenario accepts softer ones, since fits scatter about it
SOFTEST = 1e3

_LEADING: dict[str, tuple[str, str, dict[str, Any]]] = {
    "transmission_error": ("amplitude", "m", {}),
    "eccentricity": ("offset", "m", {}),
    "pitch_error": ("offset", "m", {"tooth": 1}),
    "backlash_offset": ("offset", "m", {}),
    "backlash_variation": ("amplitude", "m", {}),
    "drag_coulomb": ("torque", "N m", {}),
    "drag_viscous": ("coefficient", "N m s/rad", {}),
    "drag_power": ("coefficient", "N m", {"exponent": 2.0}),
    "drag_differential": ("coefficient", "N m s/rad", {"shaft_speed": "0 rad/s"}),
    "drag_position": ("amplitude", "N m", {}),
    "drag_drift": ("relative_change", "", {"time_constant": "5 s"}),
    "drag_stick_slip": ("amplitude", "N m", {"angle": "60 deg"}),
    "mesh_drag": ("coefficient", "N m s/rad", {}),
    "mesh_friction": ("coefficient", "", {}),
    "restitution_offset": ("offset", "", {}),
    "restitution_speed": ("slope", "s/m", {}),
    "restitution_asymmetry": ("asymmetry", "", {}),
    "restitution_scatter": ("standard_deviation", "", {}),
    "tooth_compliance": ("stiffness", "N/m", {}),
    "oil_film": ("viscosity", "Pa s", {}),
    "drive_motion": ("amplitude", "rad/s", {"frequency": "1 Hz"}),
    "encoder_eccentricity": ("amplitude", "rad", {}),
    "encoder_skew": ("delay", "s", {}),
    "carried_inertia": ("inertia", "kg m^2", {"stiffness": "1 N m/rad"}),
}
_SIGNED = ("backlash_offset", "drag_coulomb", "drag_drift", "restitution_offset", "restitution_speed")
_SIGNED += ("restitution_asymmetry", "encoder_skew")


def quantity(value: float, unit: str) -> Any:
    """Return a number as the scenario's TOML has it.

    >>> quantity(2e-5, "m"), quantity(0.1, "")
    ('2e-05 m', 0.1)
    """
    return f"{value!r} {unit}" if unit else value


def draw(kind: str, scenario: Scenario, size: float, random: np.random.Generator) -> dict[str, Any]:
    """Draw an effect of a kind."""
    name, unit, more = _LEADING[kind]
    more = {"kind": kind, **more, **_rest(kind, scenario, random)}
    whole = _unit(scenario, more, name, unit)
    sign = float(random.choice((-1.0, 1.0))) if kind in _SIGNED else 1.0
    value = float(f"{(max(whole / size, SOFTEST) if kind == 'tooth_compliance' else sign * size * whole):.6g}")
    if kind == "tooth_compliance":
        mass = float(scenario.gears.loose.inertia or 0.0) / scenario.pair().loose.base_radius ** 2
        more["damping"] = quantity(float(f"{2.0 * random.uniform(0.02, 0.2) * sqrt(value * mass):.6g}"), "N s/m")
    if kind == "carried_inertia":
        more |= _spring(scenario, value, random)
    return {"kind": kind, name: quantity(value, unit), **{k: v for k, v in more.items() if k != "kind"}}


def _spring(scenario: Scenario, inertia: float, random: np.random.Generator) -> dict[str, Any]:
    """Stiffness and damping of a body on a spring, by its natural frequency and damping ratio in flight."""
    own, radius = float(scenario.gears.loose.inertia or 0.0), scenario.pair().loose.base_radius
    fall = sqrt(2.0 * scenario.pair().backlash * own / (scenario.drag.torque or 0.2 * own) / radius)
    turn, damping = 2.0 * pi * random.uniform(*PERIODS) / fall, random.uniform(*DAMPING)
    swings = own * inertia / (own + inertia)
    stiffness, damped = (float(f"{one:.6g}") for one in (swings * turn**2, 2.0 * damping * turn * swings))
    return {"stiffness": quantity(stiffness, "N m/rad"), "damping": quantity(damped, "N m s/rad")}


def _unit(scenario: Scenario, effect: dict[str, Any], name: str, unit: str) -> float:
    """The size that changes the effect's channel by 100 %: the one number that is taken from the effect itself."""
    trial = 1e6 if effect["kind"] == "tooth_compliance" else 1e-6
    tried = scenario.with_({"effect": [{**effect, name: quantity(trial, unit)}]})
    return tried.effects[-1].unit_size(scenario.rig())


def _rest(kind: str, scenario: Scenario, random: np.random.Generator) -> dict[str, Any]:
    """The parameters that do not say how large an effect is."""
    rest: dict[str, Any] = {}
    gear = str(random.choice(("drive", "loose")))
    phase = f"{degrees(random.uniform(-pi, pi)):.4f} deg"
    speed = abs(scenario.motion.mean) * scenario.gears.drive.teeth / scenario.gears.loose.teeth
    if kind in ("transmission_error", "backlash_variation", "drag_position", "encoder_eccentricity"):
        rest |= {"order": int(random.integers(1, 5)), "phase": phase}
    if kind in ("transmission_error", "eccentricity", "pitch_error", "encoder_eccentricity"):
        rest["gear"] = gear
    if kind == "eccentricity":
        rest["phase"] = phase
    elif kind == "transmission_error":
        rest["flank"] = str(random.choice(("both", "active"), p=(0.75, 0.25)))
    elif kind == "pitch_error":
        rest["tooth"] = int(random.integers(1, getattr(scenario.gears, gear).teeth + 1))
        rest["flank"] = str(random.choice(("both", "active", "reverse"), p=(0.5, 0.25, 0.25)))
    elif kind == "drag_power":
        rest["exponent"] = round(float(random.uniform(1.5, 2.5)), 2)
    elif kind == "drag_differential":
        rest["shaft_speed"] = f"{random.uniform(0.2, 0.8) * speed:.6g} rad/s"
    elif kind == "drag_stick_slip":
        rest |= {"angle": f"{360.0 / random.uniform(5.0, 15.0):.4f} deg", "phase": phase}
    elif kind == "drag_drift":
        rest["time_constant"] = f"{random.uniform(0.2, 0.5) * scenario.run.duration:.4g} s"
    elif kind == "drive_motion":
        first = scenario.motion.harmonics[0].frequency if scenario.motion.harmonics else 1.0
        rest |= {"frequency": f"{first * random.uniform(1.3, 2.7):.4g} Hz", "phase": phase}
    return rest


@dataclass(frozen=True)
class Foreign:
    """One cause outside the catalogue."""

    name: str  # of the cause
    parameters: dict[str, float]  # SI, for the answer
    coordinates: tuple[str, ...]  # where a diagnosis may see it
    rows: tuple[tuple[float, ...], ...] = ()  # of ``foreign`` in ``MACHINE``
    second: tuple[float, ...] = ()  # a body behind a coupling with play
    mount: tuple[float, ...] = field(default=())  # frequency [Hz] and damping of an encoder's disc on its mount


def _torque(code: int, name: str, where: tuple[str, ...], orders: tuple[float, ...]) -> Callable[..., Foreign]:
    def draw(scenario: Scenario, size: float, random: np.random.Generator) -> Foreign:
        order, phase = float(random.choice(orders)), float(random.uniform(0.0, 2.0 * pi))
        torque = size * _drag(scenario)
        if code == STICK_SLIP:
            phase /= 2.0 * pi
        row = (float(code), torque, order, phase, 0.0 if code == STICK_SLIP else _loose_speed(scenario))
        return Foreign(name, {"torque": torque, "order": order, "phase": phase}, where, (row,))

    return draw


def _loose_speed(scenario: Scenario) -> float:
    return abs(scenario.motion.mean) * scenario.gears.drive.teeth / scenario.gears.loose.teeth


def _drag(scenario: Scenario) -> float:
    return scenario.drag.torque or 0.1 * float(scenario.gears.loose.inertia or 0.0)


def _adhesion(scenario: Scenario, size: float, random: np.random.Generator) -> Foreign:
    reach = float(random.uniform(0.05, 0.15)) * scenario.pair().backlash
    force = 2.0 * size * _drag(scenario) / scenario.pair().loose.base_radius
    values = {"force": force, "reach": reach}
    return Foreign("adhesion to a flank", values, ("flight.gap",), ((float(ADHESION), force, reach, 0.0, 0.0),))


def _impact_angle(scenario: Scenario, size: float, random: np.random.Generator) -> Foreign:
    order, phase = float(random.choice((1.0, 2.0, 3.0))), float(random.uniform(0.0, 2.0 * pi))
    swing = size * max(scenario.impact.restitution, 0.1)
    row = (float(IMPACT_ANGLE), swing, order, phase, 0.0)
    return Foreign("restitution over the angle", {"swing": swing, "order": order}, ("impact.tooth",), (row,))


def _warming(scenario: Scenario, size: float, random: np.random.Generator) -> Foreign:
    change = size * scenario.pair().backlash * float(random.choice((-1.0, 1.0)))
    time = float(random.uniform(0.2, 0.6)) * scenario.run.duration
    where = ("contact.time", "flight.gap")
    row = (float(WARMING), change, time, 0.0, 0.0)
    return Foreign("backlash that drifts", {"change": change, "time_constant": time}, where, (row,))


def _coupling(scenario: Scenario, size: float, random: np.random.Generator) -> Foreign:
    inertia = size * float(scenario.gears.loose.inertia or 0.0)
    play = float(random.uniform(0.1, 0.3)) * scenario.pair().backlash / scenario.pair().loose.base_radius
    stiff = inertia * (2.0 * pi * float(random.uniform(80.0, 160.0))) ** 2
    damping = 0.1 * (stiff * inertia) ** 0.5
    values = {"inertia": inertia, "half_play": play, "stiffness": stiff}
    where = ("flight.time", "flight.speed", "impact.speed", "impact.duration")
    return Foreign("a body behind a coupling with play", values, where, (), (inertia, stiff, damping, play))


def _mount(scenario: Scenario, size: float, random: np.random.Generator) -> Foreign:
    frequency = float(random.uniform(60.0, 120.0)) / max(size / 0.3, 0.3)
    damping = float(random.uniform(0.01, 0.04))
    where = ("flight.time", "impact.duration", "sensor.delay")
    values = {"frequency": frequency, "damping": damping}
    return Foreign("an encoder that sways on its mount", values, where, (), (), (frequency, damping))


# How each cause outside the catalogue is drawn: scenario, size and random numbers -> cause
UNKNOWN: dict[str, Callable[..., Foreign]] = {
    "bearing_defect": _torque(BEARING, "a bearing's balls", ("flight.angle_loose",), (3.57, 5.43, 2.38)),
    "cogging_speed": _torque(COGGING, "cogging over speed", ("flight.angle_loose", "flight.speed"), (6.5, 9.5)),
    "stick_slip": _torque(STICK_SLIP, "stick-slip", ("flight.angle_loose", "flight.time"), (7.3, 11.7)),
    "drive_angle": _torque(DRIVE_ANGLE, "a torque over the drive's angle", ("flight.angle_drive",), (2.41, 3.33)),
    "adhesion": _adhesion,
    "restitution_angle": _impact_angle,
    "backlash_drift": _warming,
    "coupling_play": _coupling,
    "encoder_mount": _mount,
}


def draw_foreign(name: str, scenario: Scenario, size: float, random: Any) -> Foreign:
    """Draw a cause outside the catalogue."""
    return UNKNOWN[name](scenario, size, random)
