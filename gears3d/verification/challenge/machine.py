"""From a scenario and its effects, read as plain data, to the numbers of the machine that makes the records.

Pitch deviations need the pair of teeth that carries, with tips that meet flanks outside the path of contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, atan2, cos, hypot, pi, sqrt, tan
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import CubicSpline

from gears3d.errors import Fault, InputError
from gears3d.verification.challenge.physics import DRIVE, EDGE_POINTS, LOOSE, MACHINE, STICK_SLIP

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

SLIP = 1.0 / 17.0  # Part of a cycle of stick-slip that a slip of the catalogue takes
SENSORS = ("encoder_eccentricity", "encoder_skew")  # Kinds that act in :mod:`gears3d.verification.challenge.sensing`


def values(effect: Any) -> dict[str, Any]:
    """Return an effect as plain data: its table of the scenario."""
    return {"kind": effect.kind, **{name: getattr(effect, name) for name in effect.params}} | {
        name: value for name, value in vars(effect).items() if name.endswith("_family")
    }


class _Draft:
    """The lists that become the arrays of a machine."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        pair = scenario.pair()
        self.rb1, self.rb2 = pair.drive.base_radius, pair.loose.base_radius
        self.one: dict[str, Any] = {"coulomb": 0.0, "viscous": 0.0, "mesh_drag": 0.0, "friction": 0.0}
        self.one |= {"drift": (0.0, 1.0), "power": (0.0, 1.0), "differential": (0.0, 0.0), "spring": (0.0, 0.0)}
        self.one |= {"film": (0.0, 0.0, 0.0, 0.0, 1.0, 0.0), "second": (0.0, 0.0, 0.0, 0.0)}
        self.impact = [scenario.impact.restitution, 0.0, 0.0, 0.0, scenario.impact.stick_velocity]
        self.waves: list[tuple[float, ...]] = []
        self.axes: list[tuple[float, ...]] = []
        self.position: list[tuple[float, ...]] = []
        self.tooth: list[tuple[float, ...]] = []
        self.foreign: list[tuple[float, ...]] = []
        self.sines = [(h.amplitude, 2.0 * pi * h.frequency, h.phase) for h in scenario.motion.harmonics]

    def add(self, e: dict[str, Any]) -> None:
        """Take in one effect."""
        kind = e["kind"]
        act = getattr(self, f"_{kind}", None)
        if act is None:
            why = "is an effect of another package: the generator of a challenge has no equation for it"
            raise InputError(Fault("effect", f"{kind!r} {why}", "remove it from the rig"))
        act(e)

    def _once(self, name: str, value: Any) -> None:
        if self.one[name] not in (0.0, (0.0, 1.0), (0.0, 0.0), (0.0,) * 4, (0.0, 0.0, 0.0, 0.0, 1.0, 0.0)):
            raise InputError(Fault("effect", f"{name} is there twice", "leave one out"))
        self.one[name] = value

    def _transmission_error(self, e: dict[str, Any]) -> None:
        gear = DRIVE if e["gear"] == "drive" else LOOSE
        behind = e["amplitude"] if e["flank"] == "both" else 0.0
        self.waves.append((gear, e["order"], e["phase"], e["amplitude"], behind))

    def _backlash_offset(self, e: dict[str, Any]) -> None:
        self.waves.append((DRIVE, 0.0, 0.0, 0.0, e["offset"]))

    def _backlash_variation(self, e: dict[str, Any]) -> None:
        self.waves.append((DRIVE, e["order"], e["phase"], 0.0, e["amplitude"]))

    def _eccentricity(self, e: dict[str, Any]) -> None:
        self.axes.append((DRIVE if e["gear"] == "drive" else LOOSE, e["offset"], e["phase"]))

    def _pitch_error(self, e: dict[str, Any]) -> None:
        size, flank = e["offset"], e["flank"]
        active = 0.0 if flank == "reverse" else size
        reverse = 0.0 if flank == "active" else -size  # displaced forwards, a tooth lacks material behind
        count = getattr(self.scenario.gears, e["gear"]).teeth
        self.tooth.append((DRIVE if e["gear"] == "drive" else LOOSE, count, (e["tooth"] - 1) % count, active, reverse))

    def _drag_coulomb(self, e: dict[str, Any]) -> None:
        self.one["coulomb"] += e["torque"]

    def _drag_viscous(self, e: dict[str, Any]) -> None:
        self.one["viscous"] += e["coefficient"]

    def _drag_power(self, e: dict[str, Any]) -> None:
        self._once("power", (e["coefficient"], e["exponent"]))

    def _drag_differential(self, e: dict[str, Any]) -> None:
        self._once("differential", (e["coefficient"], e["shaft_speed"]))

    def _drag_position(self, e: dict[str, Any]) -> None:
        self.position.append((e["order"], e["amplitude"], e["phase"]))

    def _drag_stick_slip(self, e: dict[str, Any]) -> None:
        order, wound = 2.0 * pi / e["angle"], e["phase"] / (2.0 * pi)
        self.foreign.append((float(STICK_SLIP), e["amplitude"], order, wound, SLIP))

    def _drag_drift(self, e: dict[str, Any]) -> None:
        self._once("drift", (e["relative_change"], e["time_constant"]))

    def _mesh_drag(self, e: dict[str, Any]) -> None:
        self.one["mesh_drag"] += e["coefficient"]

    def _mesh_friction(self, e: dict[str, Any]) -> None:
        self.one["friction"] += e["coefficient"]

    def _restitution_offset(self, e: dict[str, Any]) -> None:
        self.impact[0] += e["offset"]

    def _restitution_speed(self, e: dict[str, Any]) -> None:
        self.impact[1] += e["slope"]

    def _restitution_asymmetry(self, e: dict[str, Any]) -> None:
        self.impact[2] += e["asymmetry"]

    def _restitution_scatter(self, e: dict[str, Any]) -> None:
        self.impact[3] = float(np.hypot(self.impact[3], e["standard_deviation"]))

    def _tooth_compliance(self, e: dict[str, Any]) -> None:
        self._once("spring", (e["stiffness"], e["damping"]))

    def _oil_film(self, e: dict[str, Any]) -> None:
        self._once("film", film(self.scenario, e))

    def _carried_inertia(self, e: dict[str, Any]) -> None:
        self._once("second", (e["inertia"], e["stiffness"], e["damping"], 0.5 * e["play"]))

    def _drive_motion(self, e: dict[str, Any]) -> None:
        w = 2.0 * pi * e["frequency"] if e["frequency"] else e["order"] * self.scenario.motion.mean
        as_speed = {"speed": 1.0, "angle": w, "acceleration": 1.0 / w}[e.get("amplitude_family", "speed")]
        self.sines.append((e["amplitude"] * as_speed, w, e["phase"]))


def film(scenario: Scenario, e: dict[str, Any]) -> tuple[float, float, float, float, float, float]:
    """Return the oil film's numbers: wedge, squeeze, rolling radii, cos of the base helix angle, layer.

    One flank pushes along the normal with 2·L·η·r/h·u - (3π/√2)·L·η·(r/h)^1.5·ḣ, u the sum of the rolling speeds at the
    pitch point in the normal section, where r = r_t/cos βb and L = width·εα/cos βb.

    Source: the lubricated dual-clutch transmission, eqs (11)-(13).

    >>> from gears3d.scenario import load
    >>> e = {"viscosity": 0.01, "wedge": 1.0, "squeeze": 1.0, "minimum_thickness": 1e-6}
    >>> e |= {"radius": 0.0, "contact_length": 0.0}
    >>> numbers = film(load("scenarios/base/helical-17-43.toml"), e)
    >>> round(157.08 * (numbers[2] + numbers[3] * 17 / 43), 2)  # m/s at 1500 rpm
    3.16
    """
    pair, gears = scenario.pair(), scenario.gears
    rb1, rb2 = pair.drive.base_radius, pair.loose.base_radius
    tangent = tan(acos((rb1 + rb2) / pair.centre_distance))
    lean = abs(gears.drive.helix_angle)
    cos_b = cos(atan2(tan(lean) * rb1, rb1 / cos(_transverse(gears.drive)))) if lean else 1.0
    radius = e["radius"] or tangent * rb1 * rb2 / (rb1 + rb2) / cos_b
    width = min(gears.drive.face_width, gears.loose.face_width)
    ahead = sqrt(pair.drive.tip_radius**2 - rb1**2) + sqrt(pair.loose.tip_radius**2 - rb2**2) - tangent * (rb1 + rb2)
    ratio = ahead / (2.0 * pi * rb1 / gears.drive.teeth)
    length = e["contact_length"] or width * ratio / cos_b
    wedge = 2.0 * length * e["viscosity"] * radius * e["wedge"]
    squeeze = 3.0 * pi / sqrt(2.0) * length * e["viscosity"] * radius**1.5 * e["squeeze"]
    rolling = (
        tangent * cos(atan2(sqrt(1.0 - cos_b**2) * hypot(1.0, tangent), cos_b)) / cos_b
    )  # helix at the pitch point
    return wedge, squeeze, rolling * rb1, rolling * rb2, cos_b, e["minimum_thickness"] / cos_b


def _transverse(gear: Any) -> float:
    """Transverse pressure angle [rad]."""
    return atan2(tan(gear.pressure_angle), cos(gear.helix_angle))


def machine(scenario: Scenario, foreign: Sequence[Sequence[float]] = (), second: Sequence[float] = ()) -> Any:
    """Return the numbers of a scenario with its effects."""
    _refuse(scenario)
    draft = _Draft(scenario)
    for effect in scenario.effects:
        if effect.kind not in SENSORS:
            draft.add(values(effect))
    pair = scenario.pair()
    tables = {"sines": [s for s in draft.sines if s[0] != 0.0], "waves": draft.waves, "axes": draft.axes}
    tables |= {"position": draft.position, "teeth": draft.tooth, "foreign": [*draft.foreign, *foreign]}
    m = np.zeros(1, MACHINE)[0]
    for name, rows in tables.items():
        if len(rows) > len(m[name]):
            text = f"{len(rows)} effects of one sort"
            raise InputError(Fault("effect", text, f"at most {len(m[name])}", str(scenario.path or "")))
        m[f"n_{name}"] = len(rows)
        if rows:
            m[name][: len(rows)] = rows
    m["rb1"], m["rb2"], m["inertia"] = draft.rb1, draft.rb2, scenario.gears.loose.inertia
    m["backlash"], m["centre"], m["speed"] = pair.backlash, pair.centre_distance, scenario.motion.mean
    m["drag"], m["impact"] = scenario.drag.torque, draft.impact
    for name, number in draft.one.items():
        m[name] = number
    if second:
        m["second"] = second
    if draft.tooth:
        m["edge"] = edge_gap(scenario)
        m["pitch"] = 2.0 * pi / scenario.gears.drive.teeth, reverse_pitch_point(scenario)
    return m


def _refuse(scenario: Scenario) -> None:
    faults = []
    file = str(scenario.path or "")
    if scenario.motion.record is not None:
        faults.append(Fault("motion.record", "is a measured motion", "give mean and harmonics", file))
    for name in ("drive", "loose"):
        gear = getattr(scenario.gears, name)
        if gear.tip_relief or gear.root_relief or gear.deviations or gear.mounting or gear.lead_crowning:
            text = "has relief, crowning, deviations or a mounting, which hidden effects are not made for"
            faults.append(Fault(f"gears.{name}", text, "give a perfect pair; effects may deviate it", file))
    if scenario.mount.misalignment is not None:
        faults.append(Fault("mount.misalignment", "tilts an axis", "leave it out", file))
    if faults:
        raise InputError(faults)


POINTS = EDGE_POINTS // 2  # Points of the gap outside either end of the path


def _beside(rb1: float, rb2: float, tip2: float, centre: float, reach: float, of_tip: bool) -> np.ndarray:
    """Gap where the tip of gear 2 meets the flank of gear 1 before the path of contact begins.

    The tip corner at its radius, the flank's point at radius r and both axes make a triangle; gear 1 has then turned to
    one angle and gear 2 to another, and what gear 2 lacks to the law of gearing, times Rb2, is the gap. Few teeth turn
    back, where the gap rises vertically: the table ends where it rises as fast as gear 1 turns, far from contact.
    """
    path, lead = sqrt(centre**2 - (rb1 + rb2) ** 2), sqrt(tip2**2 - rb2**2)
    first = sqrt((path - lead) ** 2 + rb1**2)
    r = first + (min(first * (1.0 + 2.0 * reach), centre) - first) * np.linspace(0.0, 1.0, 40 * POINTS) ** 2
    at1 = np.arccos(np.clip((centre**2 + r**2 - tip2**2) / (2.0 * centre * r), -1.0, 1.0))
    at2 = np.arccos(np.clip((centre**2 + tip2**2 - r**2) / (2.0 * centre * tip2), -1.0, 1.0))
    roll = np.sqrt(r**2 - rb1**2) / rb1
    turned1, turned2 = roll - np.arctan(roll) - at1, -at2
    turned1, turned2 = turned1 - turned1[0], turned2 - turned2[0]
    angle, gap = (turned2 if of_tip else turned1), rb1 * turned1 - rb2 * turned2
    near = np.diff(gap) < -rb1 * np.diff(angle)
    many = len(angle) if near.all() else int(np.argmin(near)) + 1
    spline = CubicSpline(angle[:many][::-1], gap[:many][::-1])
    grid = max(-reach, angle[many - 1]) * np.linspace(1.0, 0.0, POINTS) ** 2
    table = np.stack([grid, spline(grid), spline(grid, 1)], axis=1)
    table[-1] = 0.0
    return table


def edge_gap(scenario: Scenario) -> np.ndarray:
    """Return the gap of a pair of teeth over the drive's angle past the pitch point: none on the path of contact."""
    pair = scenario.pair()
    rb1, rb2, centre = pair.drive.base_radius, pair.loose.base_radius, pair.centre_distance
    alpha = acos((rb1 + rb2) / centre)
    before = (sqrt(pair.loose.tip_radius**2 - rb2**2) - rb2 * tan(alpha)) / rb1
    after = (sqrt(pair.drive.tip_radius**2 - rb1**2) - rb1 * tan(alpha)) / rb1
    wide = 0.5 * min(pair.drive.face_width, pair.loose.face_width) * tan(abs(pair.drive.base_helix_angle)) / rb1
    reach = 2.0 * pi / scenario.gears.drive.teeth
    head = _beside(rb1, rb2, pair.loose.tip_radius, centre, reach, of_tip=False)
    head[:, 0] -= before + wide
    tail = _beside(rb2, rb1, pair.drive.tip_radius, centre, reach, of_tip=True)
    tail = (tail * (-1.0, 1.0, -1.0))[::-1]
    tail[:, 0] += after + wide
    return np.vstack([head, tail])


def reverse_pitch_point(scenario: Scenario) -> float:
    """Return the drive's angle at which the reverse flank of its tooth 1 passes the pitch point [rad]."""
    pair = scenario.pair()
    alpha = acos((pair.drive.base_radius + pair.loose.base_radius) / pair.centre_distance)
    return 2.0 * (pair.half_angle("drive") - (tan(alpha) - alpha))
