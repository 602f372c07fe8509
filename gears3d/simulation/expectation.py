"""The regime to be expected before anything is simulated, where a closed form tells it."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING, Any, NamedTuple

from gears3d.errors import InputError
from gears3d.laws.cycle import Cycle, cycle
from gears3d.laws.orbit import Swing
from gears3d.signals import FLIGHT_HEIGHT_MIN
from gears3d.simulation.refusals import refuse_unseen
from gears3d.simulation.resistance import mean_resisting

if TYPE_CHECKING:
    from gears3d.effects import Rig, Row
    from gears3d.scenario import Scenario

EXACT, APPROXIMATE, NONE = "closed form", "approximate", "none"


class Sine(NamedTuple):
    """One sine of the drive's speed.

    Args:
        source: its key.
        amplitude: [rad/s].
        frequency: [Hz].
        phase: [rad].
    """

    source: str
    amplitude: float
    frequency: float
    phase: float


@dataclass(frozen=True)
class Expectation:
    """What is to be expected.

    Args:
        regime: ``"contact"``, ``"single_sided"``, ``"double_sided"`` or ``"unknown"``.
        basis: ``"closed form"`` (exact for the rigid model), ``"approximate"`` or ``"none"``.
        why: what stands in the way of a closed form; empty when nothing does.
        periods: of the drive that a cycle takes; ``None`` when it is not known.
        impacts_per_period: those after flights higher than 0.05 µm; ``None`` when it is not known.
        flights: of the cycle, in order.
    """

    regime: str
    basis: str
    why: str = ""
    periods: int | None = None
    impacts_per_period: float | None = None
    flights: tuple[dict[str, Any], ...] = ()


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

    Args:
        scenario: nothing of it is simulated.
        rig: its constants.
        sines: all that moves the drive.
        wavy: whether a flank deviates with the angle.
        rows: of the effects, each with its source.
        backlash: [m].
        total: largest ratio of inertial to drag torque on the active flank; contact is lost above 1.

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
    soft = "the flanks yield" if Code.GAP_SPRING in codes else ""
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
    swing = Swing(rig.base_radius_drive * abs(sine.amplitude), 2 * pi * sine.frequency, pull)
    if drag < 0.0:
        return Expectation("unknown", NONE, "the torques drive the loose gear")
    found = cycle(swing, backlash, _restitution(rig, rows), scenario.impact.stick_velocity, FLIGHT_HEIGHT_MIN)
    if not found.why and swing.pull > 0.0 and rig.base_radius_drive * rig.mean_speed + found.slowest <= 0.0:
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
