"""Putting a map on an opened file: signals become channels of the contract, in SI units."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.readers.angles import Inputs, counts_of, marks, turned
from gears3d.measured.readers.decode import Angle, Edges, common_axis, on_grid
from gears3d.measured.readers.map_model import ExtraMap, GearMap, Quadrature, RecordMap
from gears3d.measured.readers.source import Signal, Source
from gears3d.measured.readers.unit import SAMPLES, scaled, to_si
from gears3d.recording.columns import unit_of

GEARS = ("drive", "loose")
# Part by which the rate of a map and that of a file may differ; larger differences are not clock drift.
CONTRADICTS = 0.1
# Seconds since 1970 in 2001: no record begins so late in its own time.
EPOCH = 1e9


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
        self._uses: Counter[str] = Counter()

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
        self._uses = Counter(each.name for each in [*wanted, *stamps])
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
