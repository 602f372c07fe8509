"""From a document to a scenario, with every fault found on the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from difflib import get_close_matches
from functools import cache
from math import isfinite, pi
from pathlib import Path
from typing import Any

from pydantic.dataclasses import dataclass as model

from gears3d.effects import Param, catalogue, excluded
from gears3d.errors import InputError, did_you_mean
from gears3d.gears import Eccentricity, Misalignment, Relief, Wobble
from gears3d.gears.deviation import FLANKS, Deviation, Mounting, ProfileSlope, ProfileWave
from gears3d.gears.gear import STARTS
from gears3d.scenario import models
from gears3d.scenario.checks import check
from gears3d.scenario.document import Document, Overrides, apply, read_text
from gears3d.scenario.models import (
    DEVIATIONS,
    INNER,
    MOUNTINGS,
    RELIEFS,
    REQUIRED,
    SECTIONS,
    GearCommon,
    Gears,
    GearSpec,
    Harmonic,
    Key,
    Motion,
    Run,
    Sensor,
    Sensors,
    Setup,
    keys_of,
    solid_inertia,
)
from gears3d.scenario.reader import Reader
from gears3d.units import FAMILIES, parse, show


@dataclass(frozen=True, repr=False)
class Scenario(Setup):
    """Everything that is simulated, SI, with the document that it was made of.

    Args:
        title: one line for people.
        source: where the numbers are from.
        gears: both gears.
        mount: their distance or backlash.
        motion: of the drive.
        drag: on the loose gear.
        impact: base impact law.
        start: state at t = 0.
        run: duration and output.
        sensors: encoders.
        lubricated: how teeth close and rub in the lubricated model; others do not read it.
        effects: what extends the base model, in order.
        expect: what must come out: ``regime`` and ``impacts_per_period``, those that were asked for.
        uncertainty: key path -> standard uncertainty in the key's SI unit.
        document: the resolved scenario as TOML text.
        path: its file; ``None`` when it came as text.
    """

    expect: dict[str, Any] = field(default_factory=dict, hash=False)
    uncertainty: dict[str, float] = field(default_factory=dict, hash=False)
    document: str = field(default="", repr=False)
    path: Path | None = None

    def __repr__(self) -> str:
        teeth = f"{self.gears.drive.teeth}:{self.gears.loose.teeth} teeth"
        effects = [effect.kind for effect in self.effects]
        motion = " + ".join(self._motion("recorded motion"))
        return f"Scenario({', '.join([repr(self.title), teeth, motion, show(self.run.duration, 'time'), *effects])})"

    def _repr_html_(self) -> str:
        from gears3d import notebook

        gear, other = self.gears.drive, self.gears.loose
        helix = f", helix {show(gear.helix_angle, 'angle')}" if gear.helix_angle else ""
        rows = [
            ("source", self.source),
            ("gears", f"{gear.teeth}:{other.teeth} teeth, module {show(gear.module, 'length')}{helix}"),
            ("backlash", show(self.pair().backlash, "length")),
            ("drive", " + ".join(self._motion("as recorded"))),
            ("drag", show(self.drag.torque, "torque")),
            ("restitution", show(self.impact.restitution, "ratio")),
            ("effects", ", ".join(effect.kind for effect in self.effects)),
            ("duration", show(self.run.duration, "time")),
        ]
        return notebook.table(self.title or "Scenario", rows)

    def _motion(self, recorded: str) -> list[str]:
        """Return mean speed and harmonics in words."""
        sines = [f"{show(h.amplitude, 'speed')} at {show(h.frequency, 'frequency')}" for h in self.motion.harmonics]
        return [recorded if self.motion.record else show(self.motion.mean, "speed"), *sines]

    def with_(self, overrides: Overrides) -> Scenario:
        """Return the scenario with some values changed.

        Args:
            overrides: ``{"motion.mean": "90 rpm"}``, pairs, or ``"KEY=VALUE"`` texts.

        Raises:
            InputError: the result is bad; carries every fault.
        """
        document = read_text(self.document, self.path)
        apply(document, overrides)
        return build(document)


def build(document: Document) -> Scenario:
    """Return the scenario that a merged document describes; an ``InputError`` carries every fault."""
    reader = Reader(document)
    top = document.toml.unwrap()
    _check_top(reader, top)
    sections = {name: reader.table(top.get(name, {}), name) for name in SECTIONS}
    read = {name: reader.read(SECTIONS[name], sections[name], name, INNER.get(name, ()))
            for name in ("drag", "impact", "start", "lubricated", "expect")}  # fmt: skip
    expect = asdict(read.pop("expect"))
    heading = reader.read(models.Heading, {name: top[name] for name in ("title", "source") if name in top}, "")
    tilt = _tables(reader, sections["mount"], "mount", {"misalignment": models.MisalignmentTable})
    tilted = Misalignment(**tilt["misalignment"]) if tilt else None
    mount = reader.read(models.Mount, sections["mount"], "mount", INNER["mount"], misalignment=tilted)
    gears, motion = _gears(reader, sections["gears"]), _motion(reader, sections["motion"])
    scenario = Scenario(
        title=heading.title,
        source=heading.source,
        gears=gears,
        mount=mount,
        motion=motion,
        run=_run(reader, sections["run"], motion, sections["motion"]),
        sensors=_sensors(reader, sections["sensors"]),
        effects=_effects(reader, top.get("effect", [])),
        expect={name: value for name, value in expect.items() if value is not None},
        uncertainty=reader.uncertainty,
        document=document.text(),
        path=document.path,
        **read,
    )
    check(reader, scenario, sections)
    if reader.faults:
        raise InputError(reader.in_order())
    loose = gears.loose
    if loose.inertia is not None:
        return scenario
    loose = replace(loose, inertia=solid_inertia(scenario.pair(), "loose", loose.density))
    return replace(scenario, gears=replace(gears, loose=loose))


def _check_top(reader: Reader, top: Mapping[str, Any]) -> None:
    known = ["format", "effect", "versions", *keys_of(models.Heading), *SECTIONS]
    if "format" not in top:
        reader.fault("format", "is missing", "write format = 1 as the first line")
    elif top["format"] != 1 or isinstance(top["format"], bool):
        reader.fault("format", f"is {top['format']!r}; this version reads format 1", "write format = 1")
    for name in top:
        if name in known:
            continue
        homes = [section for section, table in SECTIONS.items() if name in keys_of(table)]
        remedy = f"it belongs into [{homes[0]}]" if homes else did_you_mean(name, known)
        reader.fault(name, "is not a known key", remedy)


def _gears(reader: Reader, section: dict[str, Any]) -> Gears:
    """Read both gears; a gear's own keys go before the common ones."""
    common = reader.read(GearCommon, section, "gears", INNER["gears"])
    reliefs = {name: _relief(reader, section[name], f"gears.{name}") for name in RELIEFS if name in section}
    profiles = _tables(reader, section, "gears", DEVIATIONS)
    gears = []
    for which in ("drive", "loose"):
        place = f"gears.{which}"
        table = reader.table(section.get(which, {}), place)
        own_reliefs = {name: _relief(reader, table[name], f"{place}.{name}") for name in RELIEFS if name in table}
        own_profiles = _tables(reader, table, place, DEVIATIONS)
        mounting = _tables(reader, table, place, MOUNTINGS)
        gear = reader.read(
            GearSpec,
            table,
            place,
            (*RELIEFS, *DEVIATIONS, *MOUNTINGS),
            **{name: getattr(common, name) for name in keys_of(GearCommon) if name not in table},
            **(reliefs | own_reliefs),
            deviations=_deviations(which, profiles | own_profiles),
            mounting=_mounting(which, mounting),
        )
        if gear.module is None and "module" not in table and "module" not in section:
            reader.fault(f"{place}.module", "is missing (normal module)", 'e.g. module = "3.5 mm" in [gears]')
        if gear.face_width is None and gear.module is not None:
            if gear.helix_angle and "face_width" not in (*section, *table):
                angle = show(gear.helix_angle, "angle")
                reader.fault(
                    f"{place}.face_width", f"is missing with a helix_angle of {angle}", 'e.g. face_width = "20 mm"'
                )
            gear = replace(gear, face_width=10 * gear.module)
        gears.append(gear)
    return Gears(*gears)


def _relief(reader: Reader, written: Any, place: str) -> Relief | None:
    """Read a relief; one that takes nothing off is ``None``."""
    if not isinstance(written, Mapping):
        reader.table(written, place)
        return None
    values = asdict(reader.read(models.ReliefTable, written, place))
    given = [name for name in STARTS if name in written]
    if len(given) != 1:
        held = f"has {' and '.join(given)}" if given else "has no start"
        reader.fault(f"{place}.{given[-1]}" if given else place, held, f"give one of {', '.join(STARTS)}")
        return None
    if values["amount"] is None or values["shape"] is None or values[given[0]] is None:
        return None
    return Relief(**values) if values["amount"] > 0.0 else None


def _tables(reader: Reader, written: Mapping[str, Any], place: str, known: Mapping[str, type]) -> dict[str, Any]:
    """Return the values of those tables that are there and whole, by name."""
    found = {}
    for name, table in known.items():
        if isinstance(written.get(name), Mapping):
            values = asdict(reader.read(table, written[name], f"{place}.{name}"))
            if all(value is not None for value in values.values()):
                found[name] = values
        elif name in written:
            reader.table(written[name], f"{place}.{name}")
    return found


def _deviations(which: Any, values: Mapping[str, dict[str, Any]]) -> tuple[Deviation, ...]:
    kinds = {"profile_slope": ProfileSlope, "profile_wave": ProfileWave}
    return tuple(
        kinds[name](which, side, **{key: value for key, value in table.items() if key != "flank"})
        for name, table in values.items()
        for side in FLANKS
        if table["flank"] in ("both", side)
    )


def _mounting(which: Any, values: Mapping[str, dict[str, Any]]) -> tuple[Mounting, ...]:
    kinds = {"eccentricity": Eccentricity, "wobble": Wobble}
    return tuple(kinds[name](which, **table) for name, table in values.items())


def _motion(reader: Reader, section: dict[str, Any]) -> Motion:
    motion = reader.read(Motion, section, "motion", INNER["motion"])
    if motion.mean is None and motion.record is None and "mean" not in section:
        reader.fault("motion.mean", "is missing (mean speed of the drive)", 'e.g. mean = "30 rpm"')
    if motion.record == "":
        reader.fault("motion.record", "is empty", "name a file, or leave it out")
    written = section.get("harmonics", [])
    if not isinstance(written, list):
        reader.fault("motion.harmonics", f"{written!r} is not a list", "write harmonics = [ { amplitude = ..., } ]")
        written = []
    harmonics = [_harmonic(reader, item, f"motion.harmonics[{i}]", motion.mean) for i, item in enumerate(written)]
    return replace(
        motion,
        mean=motion.mean or 0.0,
        harmonics=tuple(harmonic for harmonic in harmonics if harmonic is not None),
        record=Path(motion.record) if motion.record else None,
    )


def _harmonic(reader: Reader, written: Any, place: str, mean: float | None) -> Harmonic | None:
    read = reader.read(Harmonic, written, place)
    frequency = read.frequency
    given = {name for name in ("frequency", "order") if isinstance(written, Mapping) and name in written}
    if len(given) == 2:
        reader.fault(f"{place}.order", "is given in addition to frequency", "keep one of the two")
    elif not given:
        reader.fault(f"{place}.frequency", "is missing", 'e.g. frequency = "3 Hz", or order = 2')
    elif read.order is not None and mean == 0:
        reader.fault(f"{place}.order", "needs a mean speed, and motion.mean is 0 rpm", 'e.g. frequency = "3 Hz"')
    elif read.order is not None and mean is not None:
        frequency = read.order * abs(mean) / (2 * pi)
    if frequency is not None and (frequency <= 0.0 or not isfinite(1.0 / frequency)):
        reader.fault(f"{place}.frequency", f"is {frequency:g} Hz, and has no period", 'e.g. frequency = "3 Hz"')
        return None
    if read.amplitude is None or frequency is None or read.phase is None:
        return None
    family = reader.families.get(f"{place}.amplitude", "speed")
    factor = {"speed": 1.0, "angle": 2 * pi * frequency, "acceleration": 1 / (2 * pi * frequency)}[family]
    if f"{place}.amplitude" in reader.uncertainty:
        reader.uncertainty[f"{place}.amplitude"] *= factor
    return replace(read, amplitude=read.amplitude * factor, frequency=frequency)


def _run(reader: Reader, section: dict[str, Any], motion: Motion, drive: Mapping[str, Any]) -> Run:
    """Read the run; times in periods need a drive that moves."""
    table, keys = dict(section), keys_of(Run)
    for name, instead in (("duration", "1 s"), ("settle", "0 s")):
        written = table.get(name, keys[name].default)
        if not isinstance(written, str) or not _counts_periods(written):
            continue
        table[name] = instead
        if motion.period is not None:
            table[name] = _periods(reader, written, name, motion.period) or instead
        elif name in section and "mean" in drive and not drive.get("harmonics") and not _faulty(reader, "motion.mean"):
            reader.fault(f"run.{name}", f"is {written!r}, but nothing has a period", 'e.g. "5 s"')
    return reader.read(Run, table, "run")


def _faulty(reader: Reader, place: str) -> bool:
    return any(fault.key.startswith(place) for fault in reader.faults)


def _counts_periods(written: str) -> bool:
    """Return whether a time is written in periods, or nearly so."""
    return bool(get_close_matches(written.strip("0123456789.+-eE "), ("period", "periods"), cutoff=0.75))


def _periods(reader: Reader, written: str, name: str, period: float) -> str:
    """Return a number of periods as a time; nothing, with a fault, where it is not a number or out of bounds."""
    number, _, unit = written.strip().partition(" ")
    try:
        if unit.strip() not in ("period", "periods"):
            raise InputError(f"{written!r} is not known")
        count = parse(number, "ratio")
        keys_of(Run)[name].check_bounds(written, count)
    except InputError as why:
        reader.fault(f"run.{name}", why.faults[0].message, 'e.g. "2 periods" or "5 s"')
        return ""
    return f"{count * period!r} s"


def _sensors(reader: Reader, section: dict[str, Any]) -> Sensors:
    """Read the sensors; what is given once serves both gears."""
    common = reader.read(models.SensorsTable, section, "sensors", INNER["sensors"])
    sensors = []
    for which in ("drive", "loose"):
        table = reader.table(section.get(which, {}), f"sensors.{which}")
        given = {name: getattr(common, name) for name in keys_of(Sensor) if name not in table}
        sensors.append(reader.read(Sensor, table, f"sensors.{which}", **given))
    return Sensors(common.sample_rate, sensors[0], sensors[1], "sample_rate" in section)


def key_of(param: Param) -> Key:
    """Return a parameter of an effect as a key of the format."""
    words = FAMILIES[param.family].words if param.family in FAMILIES else ""
    default = REQUIRED if param.default is None else param.default
    return Key(param.family, words, default, param.low, param.high, choices=param.choices, also=param.also)


@cache
def _effect_table(kind: Any) -> type:
    """Return the model of an effect's table."""
    names = {name: models.field_of(key_of(param)) for name, param in kind.params.items()}
    made = type(kind.__name__, (models.Table,), {"__annotations__": dict.fromkeys(names, Any), **names})
    return model(frozen=True, kw_only=True, config=models.CONFIG)(made)


def _effects(reader: Reader, written: Any) -> tuple[Any, ...]:
    """Return the effects of a scenario in order, without the faulty ones."""
    if not isinstance(written, list):
        reader.fault("effect", "is not a list", "write [[effect]] with double brackets")
        return ()
    effects = [_effect(reader, item, f"effect[{index}]") for index, item in enumerate(written)]
    return tuple(effect for effect in effects if effect is not None)


def _effect(reader: Reader, written: Any, place: str) -> Any:
    table = reader.table(written, place)
    kinds = catalogue()
    kind = table.pop("kind", None)
    if kind is None:
        reader.fault(f"{place}.kind", "is missing", "known: " + ", ".join(kinds))
        return None
    if not isinstance(kind, str) or kind not in kinds:
        _unknown_kind(reader, place, str(kind), list(kinds))
        return None
    params: Mapping[str, Param] = kinds[kind].params
    before = len(reader.faults)
    defaults = {name: one.default for name, one in params.items() if name not in table and one.default is not None}
    values = asdict(reader.read(_effect_table(kinds[kind]), table, place, **defaults))
    if len(reader.faults) > before:
        return None
    for name, param in params.items():
        if param.also:
            values[f"{name}_family"] = reader.families.get(f"{place}.{name}", param.family)
    try:
        return kinds[kind](**values)
    except InputError as why:
        for fault in why.faults:
            reader.fault(f"{place}.{fault.key}".rstrip("."), fault.message, fault.remedy)
    except ValueError as why:
        reader.fault(place, str(why))
    return None


def _unknown_kind(reader: Reader, place: str, kind: str, known: list[str]) -> None:
    """Note a fault for a kind that is not known; a plug-in that is excluded may be the reason."""
    lost = excluded()
    if kind in lost:
        reader.fault(f"{place}.kind", f"{kind!r} is not available: {lost[kind]}", "correct or update the package")
        return
    others = "".join(f"; {why}" for why in lost.values())
    reader.fault(f"{place}.kind", f"{kind!r} is not a known effect", f"{reader.meant(kind, known)}{others}")
