"""From a document to a scenario, with every fault found on the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches
from math import isfinite, pi
from pathlib import Path
from typing import Any

from gears3d.errors import InputError, did_you_mean
from gears3d.scenario import keys
from gears3d.scenario.checks import check
from gears3d.scenario.document import Document
from gears3d.scenario.effect_list import read_effects
from gears3d.scenario.gear_tables import deviations, misalignment, mounting, relief, tables
from gears3d.scenario.lubricated import Lubricated
from gears3d.scenario.meshing import solid_inertia
from gears3d.scenario.model import (
    Drag,
    Gears,
    GearSpec,
    Harmonic,
    Impact,
    Motion,
    Mount,
    Run,
    Scenario,
    Sensor,
    Sensors,
    Start,
    period,
)
from gears3d.scenario.reader import Reader, check_bounds
from gears3d.units import parse, show


def build(document: Document) -> Scenario:
    """Return the scenario that a document describes.

    Args:
        document: merged, with overrides applied.

    Returns:
        The scenario.

    Raises:
        InputError: carries every fault.
    """
    reader = Reader(document)
    top = document.toml.unwrap()
    _check_top(reader, top)
    sections = {name: reader.table(top.get(name, {}), name) for name in keys.SECTIONS}
    values = {
        name: reader.keys(sections[name], name, known, keys.EXTRA.get(name, ()))
        for name, known in keys.SECTIONS.items()
        if name not in ("gears", "sensors", "run")
    }
    drive, loose = _gears(reader, sections["gears"])
    motion = _motion(reader, sections["motion"], values["motion"])
    run = _run(
        reader, sections["run"], motion, values["motion"]["mean"] == 0 and not sections["motion"].get("harmonics")
    )
    parts = {
        "title": reader.value(top, "", "title", keys.TOP["title"]),
        "source": reader.value(top, "", "source", keys.TOP["source"]),
        "gears": Gears(drive, loose),
        "mount": Mount(**values["mount"], misalignment=misalignment(reader, sections["mount"])),
        "motion": motion,
        "drag": Drag(**values["drag"]),
        "impact": Impact(**values["impact"]),
        "start": Start(**values["start"]),
        "lubricated": Lubricated(**values["lubricated"]),
        "run": run,
        "sensors": _sensors(reader, sections["sensors"]),
        "effects": read_effects(reader, top.get("effect", [])),
        "expect": {name: value for name, value in values["expect"].items() if value is not None},
    }
    scenario = Scenario(**parts, uncertainty=reader.uncertainty, document=document.text(), path=document.path)
    check(reader, scenario, sections)
    if reader.faults:
        raise InputError(reader.in_order())
    return _weighed(scenario)


def _weighed(scenario: Scenario) -> Scenario:
    """Return the scenario with the loose gear's inertia; when it was not given, that of its solid."""
    loose = scenario.gears.loose
    if loose.inertia is not None:
        return scenario
    inertia = solid_inertia(scenario.pair(), "loose", loose.density)
    return replace(scenario, gears=replace(scenario.gears, loose=replace(loose, inertia=inertia)))


def _check_top(reader: Reader, top: Mapping[str, Any]) -> None:
    known = ["format", "effect", "versions", *keys.TOP, *keys.SECTIONS]
    if "format" not in top:
        reader.fault("format", "is missing", "write format = 1 as the first line")
    elif top["format"] != 1 or isinstance(top["format"], bool):
        reader.fault("format", f"is {top['format']!r}; this version reads format 1", "write format = 1")
    for name in top:
        if name in known:
            continue
        homes = [section for section, table in keys.SECTIONS.items() if name in table]
        remedy = f"it belongs into [{homes[0]}]" if homes else did_you_mean(name, known)
        reader.fault(name, "is not a known key", remedy)


def _gears(reader: Reader, section: dict[str, Any]) -> tuple[GearSpec, GearSpec]:
    """Read both gears; a gear's own keys go before the common ones."""
    reader.unknown(section, "gears", [*keys.COMMON, *keys.EXTRA["gears"]])
    common = {name: reader.value(section, "gears", name, key) for name, key in keys.COMMON.items()}
    reliefs = {name: relief(reader, section[name], f"gears.{name}") for name in keys.RELIEFS if name in section}
    profiles = tables(reader, section, "gears", keys.DEVIATIONS)
    gears = []
    for which in ("drive", "loose"):
        place = f"gears.{which}"
        table = reader.table(section.get(which, {}), place)
        reader.unknown(table, place, [*keys.GEAR, *keys.RELIEFS, *keys.DEVIATIONS, *keys.MOUNTINGS])
        own = {name: reader.value(table, place, name, key) for name, key in keys.GEAR.items() if name in table}
        if "teeth" not in table:
            own["teeth"] = reader.value(table, place, "teeth", keys.TEETH)
        merged = {**common, **own}
        if merged["module"] is None and "module" not in table and "module" not in section:
            reader.fault(f"{place}.module", "is missing (normal module)", 'e.g. module = "3.5 mm" in [gears]')
        if merged["face_width"] is None and merged["module"] is not None:
            merged["face_width"] = 10 * merged["module"]
            if merged["helix_angle"] and "face_width" not in (*section, *table):
                angle = show(merged["helix_angle"], "angle")
                reader.fault(
                    f"{place}.face_width", f"is missing beside a helix_angle of {angle}", 'e.g. face_width = "20 mm"'
                )
        for name in keys.RELIEFS:
            merged[name] = reliefs.get(name)
            if name in table:
                merged[name] = relief(reader, table[name], f"{place}.{name}")
        own_profiles = tables(reader, table, place, keys.DEVIATIONS)
        merged["deviations"] = deviations(which, {**profiles, **own_profiles})
        merged["mounting"] = mounting(which, tables(reader, table, place, keys.MOUNTINGS))
        gears.append(GearSpec(**merged))
    return gears[0], gears[1]


def _motion(reader: Reader, section: dict[str, Any], values: dict[str, Any]) -> Motion:
    record = values["record"]
    mean = values["mean"]
    if mean is None and record is None and "mean" not in section:
        reader.fault("motion.mean", "is missing (mean speed of the drive)", 'e.g. mean = "30 rpm"')
    if record == "":
        reader.fault("motion.record", "is empty", "name a file, or leave it out")
    written = section.get("harmonics", [])
    if not isinstance(written, list):
        reader.fault("motion.harmonics", f"{written!r} is no list", "write harmonics = [ { amplitude = ..., } ]")
        written = []
    harmonics = [_harmonic(reader, item, f"motion.harmonics[{i}]", mean) for i, item in enumerate(written)]
    return Motion(
        mean=mean or 0.0,
        harmonics=tuple(harmonic for harmonic in harmonics if harmonic is not None),
        record=Path(record) if record else None,
        bandwidth=values["bandwidth"],
    )


def _harmonic(reader: Reader, written: Any, place: str, mean: float | None) -> Harmonic | None:
    values = reader.keys(reader.table(written, place), place, keys.HARMONIC)
    amplitude, frequency, order = values["amplitude"], values["frequency"], values["order"]
    given = {name for name in ("frequency", "order") if isinstance(written, Mapping) and name in written}
    if len(given) == 2:
        reader.fault(f"{place}.order", "stands beside frequency", "keep one of the two")
    elif not given:
        reader.fault(f"{place}.frequency", "is missing", 'e.g. frequency = "3 Hz", or order = 2')
    elif order is not None and mean == 0:
        reader.fault(f"{place}.order", "needs a mean speed, and motion.mean is 0 rpm", 'e.g. frequency = "3 Hz"')
    elif order is not None and mean is not None:
        frequency = order * abs(mean) / (2 * pi)
    if frequency is not None and (frequency <= 0.0 or not isfinite(1.0 / frequency)):
        reader.fault(f"{place}.frequency", f"is {frequency:g} Hz, and has no period", 'e.g. frequency = "3 Hz"')
        return None
    if amplitude is None or frequency is None or values["phase"] is None:
        return None
    family = reader.families.get(f"{place}.amplitude", "speed")
    factor = {"speed": 1.0, "angle": 2 * pi * frequency, "acceleration": 1 / (2 * pi * frequency)}[family]
    if f"{place}.amplitude" in reader.uncertainty:
        reader.uncertainty[f"{place}.amplitude"] *= factor
    return Harmonic(amplitude * factor, frequency, values["phase"], order)


def _run(reader: Reader, section: dict[str, Any], motion: Motion, still: bool) -> Run:
    """Read the run; times in periods need a drive that is not ``still``."""
    one = period(motion)
    table = dict(section)
    for name in ("duration", "settle"):
        written = table.get(name, keys.RUN[name].default)
        if isinstance(written, str) and _counts_periods(written):
            if one is None:
                table[name] = "1 s" if name == "duration" else "0 s"
                if name in section and still:
                    reader.fault(f"run.{name}", f"is {written!r}, but nothing has a period", 'e.g. "5 s"')
            else:
                table[name] = _periods(reader, written, name, one)
    return Run(**reader.keys(table, "run", keys.RUN))


def _counts_periods(written: str) -> bool:
    """Whether a time is written in periods, or nearly so."""
    return bool(get_close_matches(written.strip("0123456789.+-eE "), ("period", "periods"), cutoff=0.75))


def _periods(reader: Reader, written: str, name: str, one: float) -> str:
    """Return a number of periods as a time."""
    number, _, unit = written.strip().partition(" ")
    try:
        if unit.strip() not in ("period", "periods"):
            raise InputError(f"{written!r} is not known")
        count = parse(number, "ratio")
        check_bounds(written, count, keys.RUN[name])
    except InputError as why:
        reader.fault(f"run.{name}", why.faults[0].message, 'e.g. "2 periods" or "5 s"')
        return "1 s" if name == "duration" else "0 s"
    return f"{count * one!r} s"


def _sensors(reader: Reader, section: dict[str, Any]) -> Sensors:
    """Read the sensors; what is given once serves both gears."""
    values = reader.keys(section, "sensors", keys.SENSORS, ("drive", "loose"))
    sensors = []
    for which in ("drive", "loose"):
        place = f"sensors.{which}"
        table = reader.table(section.get(which, {}), place)
        reader.unknown(table, place, list(keys.SENSOR))
        own = {name: reader.value(table, place, name, key) for name, key in keys.SENSOR.items() if name in table}
        sensors.append(Sensor(**{**{name: values[name] for name in keys.SENSOR}, **own}))
    return Sensors(values["sample_rate"], sensors[0], sensors[1], "sample_rate" in section)
