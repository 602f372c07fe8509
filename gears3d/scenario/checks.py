"""Whether values fit together: gears, motion, run, effects. Static, before anything is simulated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import sin
from typing import TYPE_CHECKING, Any

from gears3d.effects import Code, Gate, Rig, Row
from gears3d.errors import InputError
from gears3d.inputs import is_file, refuse_special
from gears3d.scenario.document import near_files
from gears3d.scenario.models import (
    DEVIATIONS,
    Gears,
    GearSpec,
    Mount,
    Setup,
    eccentricities,
    flank_deviations,
    keys_of,
    mesh,
)
from gears3d.scenario.reader import Reader
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.gears import Pair


# Where a fault leaves nothing to hold the effects against
_NEEDED = ("gears", "mount", "motion", "drag", "impact", "run", "effect")
MOST_SAMPLES = 1e8  # Samples of a run, seven columns of eight bytes each: 5.6 GB


def check_effects(reader: Reader, scenario: Setup) -> None:
    """Note a fault for every effect that does not fit."""
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
    _check_driven(reader, scenario, lowered)
    _check_drag(reader, scenario, lowered, rig)
    _check_gap(reader, scenario, lowered)


def _leading(effect: Any) -> str:
    """Return the name of an effect's first parameter."""
    return next(iter(effect.params), "kind")


def _check_driven(reader: Reader, scenario: Setup, lowered: list[list[Row]]) -> None:
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


def _check_drag(reader: Reader, scenario: Setup, lowered: list[list[Row]], rig: Rig) -> None:
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


def _check_gap(reader: Reader, scenario: Setup, lowered: list[list[Row]]) -> None:
    """Check whether the flanks leave a gap at every angle; the effect that closes it is reported."""
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
    """Return the least backlash over all angles [m]; an eccentricity e changes it by 2·e·sin αw, once per revolution.

    Oil takes its smallest thickness on either flank.
    """
    from gears3d.gears import HarmonicDeviation
    from gears3d.gears.limits import clearance, mounted_band

    taken = pair.backlash - mounted_band(pair)[0] if pair.mounting else 0.0
    taken += 2.0 * sum(row.p[4] for row in rows if row.code == Code.GAP_FILM)
    more = 2.0 * sin(pair.working_pressure_angle)
    waves = [HarmonicDeviation(e.gear, "reverse", 1, more * e.offset, e.phase) for e in eccentricities(rows)]
    return clearance(pair, (*flank_deviations(rows), *waves)) - taken


def check(reader: Reader, scenario: Setup, sections: Mapping[str, Mapping[str, Any]]) -> None:
    """Note a fault for everything that does not fit together."""
    _check_gears(reader, scenario, sections)
    _check_motion(reader, scenario)
    _check_run(reader, scenario)
    check_effects(reader, scenario)


def _complete(part: object, *names: str) -> bool:
    return all(getattr(part, name) is not None for name in names)


# Keys that a gear requires
_SHAPE = [
    name for name, key in keys_of(GearSpec).items() if key.default is not None or name in ("module", "face_width")
]


def _check_gears(reader: Reader, scenario: Setup, sections: Mapping[str, Mapping[str, Any]]) -> None:
    gears, mount = scenario.gears, scenario.mount
    mounted = "backlash" in sections["mount"] or "centre_distance" in sections["mount"]
    if not mounted:
        reader.fault("mount", "has neither backlash nor centre_distance", 'e.g. backlash = "250 um"')
    if _check_same_rack(reader, gears, sections["gears"]) and _check_shapes(reader, gears, sections["gears"]):
        _check_mesh(reader, gears, mount, sections)


def _check_same_rack(reader: Reader, gears: Gears, section: Mapping[str, Any]) -> bool:
    """Check whether both gears have the same rack."""
    same = True
    for name in ("module", "pressure_angle", "helix_angle"):
        drive, loose = getattr(gears.drive, name), getattr(gears.loose, name)
        if drive is None or loose is None or abs(drive - loose) <= 1e-9 * abs(drive):
            continue
        same = False
        which = "loose" if _written(section, "loose", name) and name in section.get("loose", {}) else "drive"
        family = keys_of(GearSpec)[name].family
        reader.fault(
            f"gears.{which}.{name}",
            f"drive has {show(drive, family)} and loose {show(loose, family)}: the gears do not mesh",
            "give both the same" + ("; opposite hands are taken care of" if name == "helix_angle" else ""),
        )
    return same


def _written(section: Mapping[str, Any], which: str, name: str) -> bool:
    """Whether a gear's key was written at all, for itself or for both."""
    own = section.get(which)
    return name in section or (isinstance(own, Mapping) and name in own)


def _check_shapes(reader: Reader, gears: Gears, section: Mapping[str, Any]) -> bool:
    """Check each gear by itself; a fault of a common key is reported once."""
    sound = True
    told: set[tuple[str, str]] = set()
    for which, gear in (("drive", gears.drive), ("loose", gears.loose)):
        if not _complete(gear, *_SHAPE):
            sound = False
            continue
        try:
            gear.gear()
        except InputError as why:
            sound = False
            for fault in why.faults:
                name = fault.key.split(".")[0]
                own = name in section.get(which, {}) or name not in section
                key = f"gears.{which}.{fault.key}" if own else f"gears.{fault.key}"
                if (key, fault.message) not in told:
                    reader.fault(key, fault.message, fault.remedy)
                told.add((key, fault.message))
    return sound


def _check_mesh(reader: Reader, gears: Gears, mount: Mount, sections: Mapping[str, Mapping[str, Any]]) -> None:
    """Check whether the gears mesh where they are mounted."""
    if any(getattr(mount, name) is None for name in sections["mount"] if hasattr(mount, name)):
        return
    if mount.backlash is None and mount.centre_distance is None:
        return
    try:
        mesh(gears, mount)
    except InputError as why:
        for fault in why.faults:
            if fault.key in ("backlash", "centre_distance"):
                written = fault.key if fault.key in sections["mount"] else "backlash"
                written = written if written in sections["mount"] else "centre_distance"
                reader.fault(f"mount.{written}", _told(fault.key, written, fault.message), fault.remedy)
            else:
                which, _, name = fault.key.partition(".")
                common = name in DEVIATIONS and name not in sections["gears"].get(which, {})
                reader.fault(f"gears.{name if common else fault.key}", fault.message, fault.remedy)


def _told(key: str, written: str, message: str) -> str:
    return message if key == written else f"leads to a {key.replace('_', ' ')} that {message}"


def _check_motion(reader: Reader, scenario: Setup) -> None:
    motion, rate = scenario.motion, scenario.run.output_rate
    if motion.record is not None and not is_file(motion.record):
        try:
            refuse_special(motion.record)
            reader.fault("motion.record", f"there is no file {str(motion.record)!r}", near_files(motion.record))
        except InputError as why:
            reader.fault("motion.record", f"{str(motion.record)!r} {why.faults[0].message}", why.faults[0].remedy)
    if rate is None:
        return
    for index, harmonic in enumerate(motion.harmonics):
        if harmonic.frequency > rate / 2:
            name = "frequency" if harmonic.order is None else "order"
            reader.fault(
                f"motion.harmonics[{index}].{name}",
                f"is {show(harmonic.frequency, 'frequency')}, above half of run.output_rate "
                f"({show(rate, 'frequency')}): the recording could not show it",
                f"give an output_rate above {show(2 * harmonic.frequency, 'frequency')}",
            )


def _check_run(reader: Reader, scenario: Setup) -> None:
    run = scenario.run
    if run.duration is None or run.settle is None or run.output_rate is None:
        return
    if run.settle >= run.duration:
        reader.fault(
            "run.settle",
            f"is {show(run.settle, 'time')}, not less than run.duration ({show(run.duration, 'time')})",
            "give a longer duration or a shorter settle",
        )
    if run.duration * run.output_rate > MOST_SAMPLES:
        reader.fault(
            "run.output_rate",
            f"asks for {run.duration * run.output_rate:.2g} samples in {show(run.duration, 'time')}; "
            f"{MOST_SAMPLES:.0e} are the most that fit into memory",
            "give a lower rate or a shorter duration",
        )
    if run.duration * run.output_rate < 1:
        reader.fault(
            "run.output_rate",
            f"is {show(run.output_rate, 'frequency')}: less than one sample in {show(run.duration, 'time')}",
            "give a higher rate or a longer duration",
        )
