"""Which effect is hidden, and with which parameters: drawn as TOML values, sized by the effect's own unit."""

from __future__ import annotations

from math import degrees, pi, sqrt
from typing import TYPE_CHECKING, Any

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
ASKED = ("carried_inertia",)
# Periods of a body on a spring in a fall across the backlash, and its damping ratio
PERIODS, DAMPING = (2.0, 8.0), (0.01, 0.1)

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
    value = float(f"{(whole / size if kind == 'tooth_compliance' else sign * size * whole):.6g}")
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
    elif kind == "drag_drift":
        rest["time_constant"] = f"{random.uniform(0.2, 0.5) * scenario.run.duration:.4g} s"
    elif kind == "drive_motion":
        first = scenario.motion.harmonics[0].frequency if scenario.motion.harmonics else 1.0
        rest |= {"frequency": f"{first * random.uniform(1.3, 2.7):.4g} Hz", "phase": phase}
    return rest
