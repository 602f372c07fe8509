"""The angle of one gear from the signals that its map names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from typing import Any, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.readers.decode import (
    Angle,
    Counted,
    Edges,
    counter,
    evened,
    indexed,
    integrated,
    levels,
    quadrature,
    spacing,
    stamped,
    switches,
    tacho,
    wrapped_angle,
)
from gears3d.measured.readers.map_model import Counter, GearMap, Quadrature, Stamps, Tacho
from gears3d.measured.readers.source import Signal
from gears3d.measured.readers.unit import is_counts, scaled, to_si
from gears3d.recording.columns import unit_of

ANGLE = ("angle", "speed")
At = Callable[[str], AbstractContextManager[None]]


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
