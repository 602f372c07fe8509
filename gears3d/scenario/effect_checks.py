"""Whether the effects fit the rig they are added to, and leave it a gap and a drag that resists."""

from __future__ import annotations

from dataclasses import replace
from math import sin
from typing import TYPE_CHECKING, Any

from gears3d.effects import Code, Gate, Rig, Row
from gears3d.errors import InputError
from gears3d.scenario.flanks import eccentricities, flank_deviations
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.gears import Pair
    from gears3d.scenario.model import Scenario
    from gears3d.scenario.reader import Reader

_NEEDED = ("gears", "mount", "motion", "drag", "impact", "run", "effect")
"""Where a fault leaves nothing to hold the effects against."""


def check_effects(reader: Reader, scenario: Scenario) -> None:
    """Note a fault for every effect that does not fit.

    Args:
        reader: takes the faults.
        scenario: as far as it could be read.
    """
    if not scenario.effects or any(fault.key.startswith(_NEEDED) for fault in reader.faults):
        return
    loose = scenario.gears.loose
    weighed = replace(loose, inertia=loose.inertia or 1.0)  # a solid's own is found later and bears on no fault
    rig = replace(scenario, gears=replace(scenario.gears, loose=weighed)).rig()
    lowered: list[list[Row]] = []
    for index, effect in enumerate(scenario.effects):
        try:
            lowered.append(list(effect.rows(rig)))
        except InputError as why:
            lowered.append([])
            for fault in why.faults:
                reader.fault(f"effect[{index}].{fault.key}".rstrip("."), fault.message, fault.remedy)
    _check_motion(reader, scenario, lowered)
    _check_drag(reader, scenario, lowered, rig)
    _check_gap(reader, scenario, lowered)


def _leading(effect: Any) -> str:
    """Return the name of an effect's first parameter."""
    return next(iter(effect.params), "kind")


def _check_motion(reader: Reader, scenario: Scenario, lowered: list[list[Row]]) -> None:
    rate = scenario.run.output_rate
    for index, (effect, rows) in enumerate(zip(scenario.effects, lowered, strict=True)):
        fastest = max((row.p[1] for row in rows if row.code == Code.MOTION_HARMONIC), default=0.0)
        if fastest > rate / 2:
            name = "order" if getattr(effect, "order", 0.0) else "frequency"
            reader.fault(
                f"effect[{index}].{name}",
                f"is {show(fastest, 'frequency')}, above half of run.output_rate ({show(rate, 'frequency')}): "
                "the recording could not show it",
                f"give an output_rate above {show(2 * fastest, 'frequency')}",
            )


def _check_drag(reader: Reader, scenario: Scenario, lowered: list[list[Row]], rig: Rig) -> None:
    """Check whether all dry drag together resists, in flight and on either flank; drifts count with their end."""
    for gates in ((Gate.FLIGHT,), (Gate.CONTACT, Gate.ACTIVE), (Gate.CONTACT, Gate.REVERSE)):
        total = rig.drag_torque
        for index, rows in enumerate(lowered):
            dry = [row.p[0] for row in rows if row.gate in (Gate.ALWAYS, *gates) and _is_dry(row)]
            total += sum(dry)
            if sum(dry) < 0.0 and total < -1e-12 * rig.drag_torque:
                reader.fault(
                    f"effect[{index}].{_leading(scenario.effects[index])}",
                    f"leaves {show(total, 'torque')} of dry drag: it would drive the gear",
                    f"drag.torque and the effects before give {show(total - sum(dry), 'torque')} to take from",
                )
                return


def _is_dry(row: Row) -> bool:
    return row.code == Code.TORQUE_CONSTANT or (row.code == Code.TORQUE_RELAX and row.p[0] < 0.0)


def _check_gap(reader: Reader, scenario: Scenario, lowered: list[list[Row]]) -> None:
    """Check whether the flanks leave a gap at every angle; the effect with which it closes is told."""
    pair, rows = scenario.pair(), [row for own in lowered for row in own]
    if not any(row.code // 100 == 2 or row.code == Code.GAP_FILM for row in rows) or _least_gap(pair, rows) > 0.0:
        return
    for index in range(len(lowered)):
        rows = [row for own in lowered[: index + 1] for row in own]
        left = _least_gap(pair, rows)
        if left <= 0.0:
            oil = any(row.code == Code.GAP_FILM for row in lowered[index])
            name = "minimum_thickness" if oil else _leading(scenario.effects[index])
            reader.fault(
                f"effect[{index}].{name}",
                f"uses up the backlash: of {show(pair.backlash, 'length')} {show(left, 'length')} is left where the "
                "gap is narrowest",
                f"give a larger mount.backlash or a smaller {name}",
            )
            return


def _least_gap(pair: Pair, rows: list[Row]) -> float:
    """Return the least backlash over all angles [m]; an eccentricity e changes it by 2·e·sin αw, once a turn.

    Oil takes its smallest thickness on either flank.
    """
    from gears3d.gears import HarmonicDeviation
    from gears3d.gears.limits import clearance, mounted_band

    taken = pair.backlash - mounted_band(pair)[0] if pair.mounting else 0.0
    taken += 2.0 * sum(row.p[4] for row in rows if row.code == Code.GAP_FILM)
    more = 2.0 * sin(pair.working_pressure_angle)
    waves = [HarmonicDeviation(e.gear, "reverse", 1, more * e.offset, e.phase) for e in eccentricities(rows)]
    return clearance(pair, (*flank_deviations(rows), *waves)) - taken
