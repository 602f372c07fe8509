"""Unchecked content of a file: channels with the contract's names in SI units.

A map is put on an opened file: signals become channels of the contract; without one, names are those of the contract.
"""

from __future__ import annotations

import collections
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.readers.decode import (
    Angle,
    Counted,
    Edges,
    common_axis,
    counter,
    evened,
    indexed,
    integrated,
    levels,
    on_grid,
    quadrature,
    spacing,
    stamped,
    switches,
    tacho,
    wrapped_angle,
)
from gears3d.measured.readers.maps import Counter, ExtraMap, GearMap, Quadrature, RecordMap, Stamps, Tacho
from gears3d.measured.readers.source import Signal, Source
from gears3d.measured.readers.unit import SAMPLES, is_counts, scaled, to_si
from gears3d.recording.columns import unit_of

ANGLE = ("angle", "speed")
At = Callable[[str], AbstractContextManager[None]]
GEARS = ("drive", "loose")
# Part by which the rate of a map and that of a file may differ; larger differences are not clock drift.
CONTRADICTS = 0.1
# Seconds since 1970 in 2001: no record begins so late in its own time.
EPOCH = 1e9
# Names that a file without a map must have one of.
CONTRACT = ("time_s", "theta_drive_rad", "theta_loose_rad", "theta_rad", "omega_rad_s")


class Inputs(NamedTuple):
    """What the angle of a gear is made of.

    Args:
        chart: map of the gear.
        signals: by key of the map: ``channel``, ``index.channel``, ``decode.a`` ...
        take: gives the values of a signal by its name, to do with as one likes, once a use.
        time: of the samples [s]; empty without samples.
        at: puts file and key on faults.
    """

    chart: GearMap
    signals: Mapping[str, Signal]
    take: Callable[[str], np.ndarray]
    time: np.ndarray
    at: At

    def of(self, key: str) -> tuple[np.ndarray, str]:
        """Return the values and the name of the signal of a key."""
        name = self.signals[key].name
        return self.take(name), name


def turned(inputs: Inputs) -> Angle | Edges:
    """Return the angle of a gear, in its own sense of rotation [rad].

    Raises InputError when a unit is not known, or a channel cannot be decoded.
    """
    chart, decode = inputs.chart, inputs.chart.decode
    with inputs.at("decode" if decode else "channel"):
        if isinstance(decode, Quadrature):
            found: Angle | Edges = _quadrature(inputs, decode)
        elif isinstance(decode, Tacho):
            found = _tacho(inputs, decode)
        elif isinstance(decode, Stamps):
            found = _stamps(inputs, decode)
        elif isinstance(decode, Counter):
            values, name = inputs.of("channel")
            found = counter(values, _counts(inputs), decode.bits, decode.signed, decode.period, name)
        else:
            found = _plain(inputs)
    if chart.index is not None and isinstance(found, Edges) and not isinstance(decode, Quadrature):
        with inputs.at("index"):
            raise InputError(Fault("", "goes with an angle at samples or with quadrature", "leave it out"))
    if chart.sign * chart.ratio != 1.0:
        np.multiply(found.angle, chart.sign * chart.ratio, out=found.angle)
        if isinstance(found, Angle) and found.speed is not None:
            found = found._replace(speed=found.speed * (chart.sign * chart.ratio))
    return found


def counts_of(chart: GearMap) -> float | None:
    """Return the counts per revolution of the gear, where the map gives them.

    >>> counts_of(GearMap(counts_per_revolution=4096, ratio="1/2"))
    8192.0
    """
    own = chart.counts_per_revolution
    if isinstance(chart.decode, Quadrature):
        own = chart.decode.lines * chart.decode.decoding
    return None if own is None else own / chart.ratio


def marks(angle: np.ndarray, pulse: np.ndarray, name: str, threshold: float | None) -> np.ndarray:
    """Return the angles at which an index pulse rises [rad].

    ``angle``: at every sample [rad], (n,); ``pulse``: of the index, (n,). Raises InputError when it never rises.

    >>> marks(np.arange(5.0), np.array([0.0, 1.0, 0.0, 1.0, 1.0]), "Z", None).tolist()
    [1.0, 3.0]
    """
    known = pulse[np.isfinite(pulse)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    threshold = 0.5 * (low + high) if threshold is None else threshold
    above = pulse > threshold
    at = np.flatnonzero(above[1:] & ~above[:-1]) + 1
    if not at.size:
        remedy = f'it lies between {low:.4g} and {high:.4g}; or write zero = "arbitrary"'
        raise InputError(Fault("", f"{name} never rises above {threshold:.6g}", remedy))
    return angle[at]


def _plain(inputs: Inputs) -> Angle:
    chart, signal = inputs.chart, inputs.signals["channel"]
    unit = chart.unit or signal.told_unit or unit_of(signal.label)
    unit = unit or ("counts" if chart.counts_per_revolution else "")
    with inputs.at("unit"):
        if not unit:
            remedy = 'write unit = "deg" (rad, deg, rev, counts, rpm, rad/s, deg/s)'
            raise InputError(Fault("", f"is missing: {signal.name} tells none", remedy))
        factor, family = to_si(unit, ANGLE, chart.counts_per_revolution)
    values = inputs.take(signal.name)
    if chart.increments:
        with inputs.at("increments"):
            if family == "speed" or chart.wraps_at is not None:
                raise InputError(Fault("", "is given for a speed or a sawtooth", "only counts and angles add up"))
        np.cumsum(values, out=values)
    if family == "speed":
        if chart.wraps_at is not None:
            with inputs.at("wraps_at"):
                raise InputError(Fault("", "is given for a speed", "only angles and counts wrap"))
        return _from_speed(inputs.time, scaled(values, factor), signal.name)
    notes: tuple[Any, ...] = ()
    if chart.wraps_at is not None:
        with inputs.at("wraps_at"):
            period = abs(to_si(chart.wraps_at, ("angle",), chart.counts_per_revolution)[0] / factor)
        values, notes, _ = wrapped_angle(values, period, signal.name)
    return Angle(scaled(values, factor), notes)


def _from_speed(time: np.ndarray, speed: np.ndarray, name: str) -> Angle:
    """Return the angle of a speed; a time that does not rise is left to whoever judges the record."""
    if len(speed) > 1 and np.isfinite(speed).all() and (np.diff(time) > 0.0).all():
        return integrated(time, speed, name)._replace(speed=speed)
    middle = 0.5 * (speed[1:] + speed[:-1])
    return Angle(np.concatenate([[0.0], np.cumsum(middle * np.diff(time))]), speed=speed)


def _quadrature(inputs: Inputs, decode: Quadrature) -> Angle | Edges:
    (a, a_name), (b, b_name) = inputs.of("decode.a"), inputs.of("decode.b")
    names = (a_name, b_name)
    found: Counted = quadrature(a, b, decode.lines, decode.decoding, names, decode.threshold, decode.hysteresis)
    if inputs.chart.index is not None:
        pulse, name = inputs.of("index.channel")
        threshold = inputs.chart.index.threshold
        found = indexed(found, switches(pulse, levels(pulse, name, threshold, decode.hysteresis)))
    return found.edges(inputs.time) if decode.at == "edges" else found.angle()


def _tacho(inputs: Inputs, decode: Tacho) -> Edges:
    pulse, name = inputs.of("channel")
    missing: Any = decode.missing
    found = tacho(inputs.time, pulse, decode.positions, missing, decode.edge, name, decode.threshold, decode.hysteresis)
    return evened(found, spacing(found, decode.positions, name), name) if decode.evened else found


def _stamps(inputs: Inputs, decode: Stamps) -> Edges:
    from gears3d.units import parse

    values, name = inputs.of("channel")
    with inputs.at("decode.clock"):
        clock = None if decode.clock is None else parse(decode.clock, "frequency")
    with inputs.at("unit"):
        factor = _stamp_unit(inputs, decode)
    if inputs.chart.increments:  # a log of the waits between edges
        values = np.cumsum(values)
    if factor != 1.0:
        values = scaled(values, factor)
    direction = inputs.of("decode.direction")[0] if decode.direction else None
    return stamped(values, _counts(inputs), name, clock, decode.bits, direction)


def _stamp_unit(inputs: Inputs, decode: Stamps) -> float:
    """Return the seconds in the unit of time stamps; 1 for ticks of a clock, and where neither map nor file tells."""
    own = inputs.chart.unit
    unit = own or inputs.signals["channel"].told_unit
    if decode.clock is not None:
        if own and not is_counts(own):
            raise InputError(Fault("", f"is {own!r}, but decode.clock makes them ticks", "give unit or decode.clock"))
        return 1.0
    if not unit:
        return 1.0
    if is_counts(unit):
        remedy = 'give decode.clock, such as clock = "20 MHz", or a unit of time'
        raise InputError(Fault("", f"is {unit!r}: stamps in ticks need the frequency of their clock", remedy))
    try:
        return to_si(unit, ("time",))[0]
    except InputError:
        if own:
            raise
        return 1.0  # what the file states of another family is about the edges, not about their times


def _counts(inputs: Inputs) -> float:
    if inputs.chart.counts_per_revolution is None:
        with inputs.at("counts_per_revolution"):
            raise InputError(Fault("", "is missing", "give the counts of a revolution"))
    return inputs.chart.counts_per_revolution or 0.0


class Mapper:
    """One map on one file.

    Args:
        source: the opened file.
        chart: its map.
        map_file: named in the faults of the map.
    """

    def __init__(self, source: Source, chart: RecordMap, map_file: str) -> None:
        self.source, self.chart, self.map_file = source, chart, map_file
        self.meta: dict[str, Any] = dict(source.meta)
        self._loaded: dict[str, np.ndarray] = {}
        self._uses: collections.Counter[str] = collections.Counter()

    def columns(self) -> dict[str, np.ndarray]:
        """Return the channels by the names of the data contract, each (n,).

        Raises InputError when a signal is not there, a unit is not known, or signals differ in length.
        """
        charts = {gear: chart for gear in GEARS if (chart := self._gear_map(gear)) is not None}
        if not charts:
            remedy = "write [drive] and [loose] with channel = ...; " + self.source.listing()
            raise self._fault("drive", "neither drive nor loose gear has a channel", remedy)
        signals = {
            gear: {key: self._find(name, f"{gear}.{key}") for key, name in chart.roles().items()}
            for gear, chart in charts.items()
        }
        extras = {name: self._find(extra.channel, f"extra.{name}.channel") for name, extra in self.chart.extra.items()}
        sampled = [each for gear, chart in charts.items() if chart.sampled for each in signals[gear].values()]
        clock = self._time_signal(sampled[0]) if sampled else None
        stamps = [each for gear, chart in charts.items() if not chart.sampled for each in signals[gear].values()]
        self._load([*sampled, *(extras.values() if sampled else ()), *([clock] if clock else [])], stamps)
        if clock or not sampled:  # without a time, a row that is excluded would shift all that follow
            self._loaded = self.source.without_gaps(self._loaded)
        self.source.remarked(self.meta)
        time = self._time(clock, sampled) if sampled else np.zeros(0)
        found = {gear: self._turned(gear, chart, signals[gear], time) for gear, chart in charts.items()}
        columns = self._joined(found, time, charts)
        for name, extra in self.chart.extra.items():
            if not sampled:
                raise self._fault(f"extra.{name}", "has samples, but both gears are time stamps", "leave it out")
            values = self._extra(name, extra, extras[name])
            columns[name] = (
                values if len(time) == len(columns["time_s"]) else np.interp(columns["time_s"], time, values)
            )
        span = self.span()
        low, high = (-np.inf if span[0] is None else span[0]), (np.inf if span[1] is None else span[1])
        time = columns["time_s"]
        if span != (None, None) and not np.any((time >= low) & (time <= high)):
            self._refuse_span(time, span)
        return columns

    def _refuse_span(self, time: np.ndarray, span: tuple[float | None, float | None]) -> None:
        key, value = ("from", span[0]) if span[0] is not None else ("to", span[1])
        chart = self.chart.time
        told = chart.begin if key == "from" else chart.to
        what = f"is {told!r}" + (f" and time.to {chart.to!r}" if key == "from" and chart.to else "")
        low, high = float(np.nanmin(time)), float(np.nanmax(time))
        if value is not None and span[1] is not None and value >= span[1] and key == "from":
            raise self._fault("time.from", f"{what}: nothing lies between", "give time.from < time.to")
        remedy = f"the record goes from {low:.6g} s to {high:.6g} s"
        raise self._fault(f"time.{key}", f"{what}: no row lies there", remedy)

    def span(self) -> tuple[float | None, float | None]:
        """Return the start and the end of the used part of the record [s].

        Raises InputError when one is not a time.
        """
        from gears3d.units import parse

        limits: list[float | None] = []
        for key, text in (("time.from", self.chart.time.begin), ("time.to", self.chart.time.to)):
            with self._at(key):
                limits.append(None if text is None else parse(text, "time"))
        return limits[0], limits[1]

    def _gear_map(self, gear: str) -> GearMap | None:
        chart: GearMap | None = getattr(self.chart, gear)
        name = f"theta_{gear}_rad"
        own = any(each.name == name for each in self.source.signals)
        if chart is None:
            return GearMap(channel=name) if own else None
        if chart.channel is None and not isinstance(chart.decode, Quadrature):
            if not own:
                raise self._fault(f"{gear}.channel", "is missing", self.source.listing())
            chart = chart.model_copy(update={"channel": name})
        return chart

    def _find(self, name: str, key: str) -> Signal:
        with self._at(key):
            return self.source.find(name, self.chart.group, key)

    def _time_signal(self, first: Signal) -> Signal | None:
        """Return the signal of the time; none where a rate or the file's own clock gives it."""
        chart = self.chart.time
        if chart.channel is not None:
            return self._find(chart.channel, "time.channel")
        if chart.sample_rate is not None:
            return None
        names = {each.name: each for each in self.source.signals}
        if "time_s" in names:
            return names["time_s"]
        if first.axis:
            return names.get(first.axis)
        if first.clock is None:
            remedy = 'write channel = "..." or sample_rate = "50 kHz" below [time]; ' + self.source.listing()
            raise self._fault("time", "is missing, and the file declares none", remedy)
        return None

    def _load(self, wanted: list[Signal], stamps: list[Signal]) -> None:
        self._uses = collections.Counter(each.name for each in [*wanted, *stamps])
        self._loaded = self.source.load(list(self._uses), None)
        for name, values in self._loaded.items():
            if not len(values):
                raise InputError(Fault(name, "has no samples", "record it again", self.source.file))
        lengths = {each.name: len(self._loaded[each.name]) for each in wanted}
        if len(set(lengths.values())) > 1:
            told = ", ".join(f"{name} has {length}" for name, length in lengths.items())
            remedy = "name channels of one group and rate"
            raise InputError(Fault("", f"signals differ in length: {told} samples", remedy, self.source.file))

    def _take(self, name: str) -> np.ndarray:
        """Return a signal that may be overwritten: itself at its last use, else a copy."""
        self._uses[name] -= 1
        return self._loaded[name].copy() if self._uses[name] > 0 else self._loaded.pop(name)

    def _time(self, clock: Signal | None, signals: list[Signal]) -> np.ndarray:
        chart = self.chart.time
        rate = None
        if chart.sample_rate is not None:
            with self._at("time.sample_rate"):
                rate = _positive_rate(chart.sample_rate)
            self.meta.setdefault("encoders", {})["sample_rate_Hz"] = rate
            own = next((each for each in signals if each.clock is not None), None)
            if own is not None and own.clock and abs(rate * own.clock[1] - 1.0) > CONTRADICTS:
                what = f"is {rate:g} Hz, the file states {1.0 / own.clock[1]:g} Hz for {own.name}"
                raise self._fault("time.sample_rate", what, "leave time.sample_rate out; the file's rate is used then")
        rows = len(self._loaded[(clock or signals[0]).name])
        if clock is None:
            start, step = (0.0, 1.0 / rate) if rate is not None else signals[0].clock or (0.0, 1.0)
            other = next((each for each in signals if each.clock not in (signals[0].clock, None)), None)
            if rate is None and other is not None:
                what = f"{signals[0].name} begins and steps at {signals[0].clock} s, {other.name} at {other.clock} s"
                raise InputError(Fault("", what, "name channels of one group and rate", self.source.file))
            if rate is None and signals[0].clock is not None:
                self.meta["stated_rate_Hz"] = 1.0 / step
            return start + step * np.arange(rows)
        unit = chart.unit or clock.told_unit or unit_of(clock.label)
        if unit.lower() in SAMPLES:
            if rate is None:
                raise self._fault("time.sample_rate", "is missing", "samples become seconds by a rate")
            return self._take(clock.name) / rate
        if not unit:
            remedy = 'write unit = "s" (or "ms", "us", "samples") below [time]'
            raise self._fault("time.unit", f"is missing: {clock.name} tells none", remedy)
        with self._at("time.unit"):
            factor, _ = to_si(unit, ("time",))
        values = self._take(clock.name)
        step = float(np.nanmedian(np.diff(values))) * factor if rate is not None and len(values) > 1 else 0.0
        if rate is not None and step > 0.0 and abs(rate * step - 1.0) > CONTRADICTS:
            what = f"is {rate:g} Hz, {clock.name} in {unit} makes {1.0 / step:.6g} Hz"
            raise self._fault("time.sample_rate", what, "leave out time.sample_rate or time.channel")
        if values[0] * factor > EPOCH:  # seconds since 1970 have no digits left for microseconds
            values -= values[0]
        return scaled(values, factor)

    def _turned(self, gear: str, chart: GearMap, signals: dict[str, Signal], time: np.ndarray) -> Angle | Edges:
        """Return the angle of a gear, its zero on the index mark where there is one."""
        inputs = Inputs(chart, signals, self._take, time, lambda key: self._at(f"{gear}.{key}"))
        found = turned(inputs)
        counts = counts_of(chart)
        if counts is not None:
            self.meta.setdefault("encoders", {})[f"counts_per_revolution_{gear}"] = counts
        zero = chart.zero or ("index" if chart.index else "arbitrary")
        self.meta.setdefault("zero", {})[gear] = zero
        if chart.zero == "arbitrary":
            self.meta.setdefault("zero_arbitrary", []).append(gear)
        if found.notes:
            self.meta.setdefault("decoded", []).extend(note._asdict() for note in found.notes)
        if chart.index is None or isinstance(chart.decode, Quadrature) or zero != "index":
            return found
        with self._at(f"{gear}.index"):
            pulse, name = inputs.of("index.channel")
            passed = marks(found.angle, pulse, name, chart.index.threshold)
        self.meta.setdefault("index_rad", {})[gear] = [float(each) for each in passed - passed[0]]
        return found._replace(angle=found.angle - passed[0])

    def _joined(
        self, found: dict[str, Angle | Edges], time: np.ndarray, charts: dict[str, GearMap]
    ) -> dict[str, np.ndarray]:
        """Return time and angles on one axis: that of the samples, or else that of the edges."""
        edges = {gear: each for gear, each in found.items() if isinstance(each, Edges)}
        with self._at("time.axis"):
            if len(edges) == len(GEARS):
                both = common_axis(edges["drive"], edges["loose"], self.chart.time.axis)
                return {"time_s": both.time, "theta_drive_rad": both.drive, "theta_loose_rad": both.loose}
            if len(edges) == len(found):
                gear, only = next(iter(edges.items()))
                self.meta.setdefault("pulses", []).append(gear)
                return {"time_s": only.time, f"theta_{gear}_rad": only.angle}
        inside = np.ones(len(time), dtype=bool)
        for each in edges.values():
            inside &= (time >= each.time[0]) & (time <= each.time[-1])
        columns = {"time_s": time[inside] if edges else time}
        for gear, each in found.items():
            with self._at(f"{gear}.decode"):
                if isinstance(each, Edges):
                    angle = on_grid(each, columns["time_s"], gear).angle
                else:
                    angle = each.angle[inside] if edges else each.angle
            columns[f"theta_{gear}_rad"] = angle
            if isinstance(each, Angle) and each.speed is not None:  # what was measured, for who needs no angle
                columns[f"omega_{gear}_rad_s"] = each.speed[inside] if edges else each.speed
                self.meta.setdefault("speeds", []).append(gear)
        return columns

    def _extra(self, name: str, extra: ExtraMap, signal: Signal) -> np.ndarray:
        """Return a further signal, in the unit that its own name ends in."""
        from gears3d.units import FAMILIES, parse

        values = self._take(signal.name)
        own, unit = unit_of(name) or ("K" if name.endswith("_K") else ""), extra.unit or signal.told_unit
        family = next((key for key, kind in FAMILIES.items() if own and kind.si == own), "")
        if not family or not unit:
            return values
        with self._at(f"extra.{name}.unit"):
            if family == "temperature":
                return values + parse(f"0 {unit}", family)
            return scaled(values, to_si(unit, (family,))[0])

    @contextmanager
    def _at(self, key: str) -> Iterator[None]:
        """Put the map's file and key on faults that have none."""
        try:
            yield
        except InputError as error:
            place = self.map_file or self.source.file
            own = [
                each if each.file else Fault(key, f"{each.key} {each.message}".strip(), each.remedy, place)
                for each in error.faults
            ]
            raise InputError(own) from error

    def _fault(self, key: str, message: str, remedy: str) -> InputError:
        return InputError(Fault(key, message, remedy, self.map_file or self.source.file))


def _positive_rate(text: str) -> float:
    from gears3d.units import parse

    rate = parse(text, "frequency")
    if rate <= 0.0:
        raise InputError(Fault("", f"is {text!r}", "a rate is positive"))
    return rate


@dataclass(frozen=True, eq=False)
class Channels:
    """Channels of one file as they were read: nothing is checked, nothing is corrected.

    Args:
        columns: by name of the contract (``time_s``, ``theta_drive_rad``, ``theta_loose_rad``, or what else the file
            has), SI units, each (n,); they may hold NaN, and time need not rise.
        file: where they came from.
        meta: what the file or its map tells besides.
        condition: keys of the rig that this record overrides, dotted, with TOML values: ``{"motion.mean": "180 rpm"}``.
    """

    columns: dict[str, np.ndarray]
    file: str = ""
    meta: dict[str, Any] = field(default_factory=dict)
    condition: dict[str, Any] = field(default_factory=dict)


def read(path: str | Path, map_file: str | Path | None = None) -> Channels:
    """Read the channels of a file.

    Args:
        path: a measured file of any format that is read, the folder of a recording, or a map that names one file.
        map_file: ``record.toml`` that tells names, units and ratio signs of the channels.

    Returns:
        The channels, unchecked. Without a map every column of numbers, by the names of the file; with one, those
        that it names.

    Raises:
        InputError: it is not there, cannot be read, or lacks what the map names; lists what it has.
    """
    from gears3d.measured.readers.formats import open_source
    from gears3d.measured.readers.maps import flat, load_map, named_files

    path = Path(path)
    if map_file is None and path.suffix.lower() == ".toml":
        files = named_files(path)
        if len(files) > 1:
            names = ", ".join(file.name for file in files)
            raise InputError(Fault("record", f"names several files: {names}", "give one of them and --map", str(path)))
        path, map_file = files[0], path
    if map_file is None:
        return _as_named(open_source(path))

    chart = load_map(Path(map_file), path)
    mapper = Mapper(open_source(path), chart, str(map_file))
    columns = mapper.columns()
    told = {"title": chart.title} if chart.title else {}
    found = Channels(columns, str(path), mapper.meta | told, flat(chart.condition))
    return within(found, mapper.span(), "time.from, time.to")


# First and last time of the part of a record that is used [s]; ``None``: from its beginning, to its end.
Span = tuple[float | None, float | None]


def within(channels: Channels, span: Span, keys: str = "--from, --to") -> Channels:
    """Return the part of a record between two of its own times; the metadata records which part.

    Args:
        channels: the record, unchecked.
        span: first and last time [s].
        keys: named in the fault: what gave the times.

    Raises:
        InputError: there are no rows between these times.

    >>> rows = Channels({"time_s": np.array([0.0, 1.0, 2.0, 3.0])})
    >>> within(rows, (1.0, None)).columns["time_s"].tolist()
    [1.0, 2.0, 3.0]
    """
    time = channels.columns.get("time_s")
    if span == (None, None) or time is None or not np.any(np.isfinite(time)):
        return channels
    low, high = (-np.inf if span[0] is None else span[0]), (np.inf if span[1] is None else span[1])
    inside = (time >= low) & (time <= high)
    first, last = float(np.nanmin(time)), float(np.nanmax(time))
    if not inside.any():
        asked = (
            "the beginning" if span[0] is None else f"{low:.6g} s",
            "the end" if span[1] is None else f"{high:.6g} s",
        )
        what = f"has 0 rows from {asked[0]} to {asked[1]}, the record covers {first:.6g} to {last:.6g} s"
        raise InputError(Fault(keys, what, "give times within the record, in its own time", channels.file))
    columns = {
        name: values[inside] if np.shape(values)[:1] == time.shape else values
        for name, values in channels.columns.items()
    }
    used = columns["time_s"]
    text = f"{used[0]:.6g} to {used[-1]:.6g} s of {first:.6g} to {last:.6g} s are used, "
    text += f"{len(used)} of {len(time)} rows"
    note = {"kind": "part-used", "channel": "time_s", "size": float(len(used)), "unit": "row", "text": text}
    meta: Mapping[str, Any] = channels.meta
    decoded = [*meta.get("decoded", []), note | {"harmless": False}]
    return replace(channels, columns=columns, meta={**meta, "span_s": span, "decoded": decoded})


def _as_named(source: Source) -> Channels:
    """Return the columns of a file whose names are those of the contract."""
    own = {each.bare: each for each in source.signals if each.bare in CONTRACT}
    if not own:
        remedy = f"write a record.toml, or let `gears3d inspect FILE --guess` propose one; {source.listing()}"
        raise InputError(Fault("time_s", "is missing: no channel has a name of the contract", remedy, source.file))
    group = next(iter(own.values())).name.rpartition("/")[0]
    rows = next(iter(own.values())).rows
    kept = [
        each
        for each in source.signals
        if each.bare in own or (each.numeric and each.rows == rows and each.name.rpartition("/")[0] == group)
    ]
    loaded = source.load([each.name for each in kept], None)
    if "time_s" in own:
        loaded = source.without_gaps(loaded)
    meta = dict(source.meta)
    source.remarked(meta)
    return Channels({each.bare: loaded[each.name] for each in kept}, source.file, meta)
