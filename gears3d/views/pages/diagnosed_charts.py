"""Charts of a cause: residual without it and with it, over the coordinate on which the cause depends."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis import deceleration_response, gap_deceleration, impact_sigma, in_units, loss_sigma
from gears3d.diagnosis.causes import contribution
from gears3d.diagnosis.channels import BINS
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.residual_patterns import channel_of
from gears3d.views.pages.charts import series

if TYPE_CHECKING:
    from gears3d.diagnosis import Diagnosis, Resonance

Array = np.ndarray
# Points of a series that are drawn.
SHOWN = 600
# Points of a series below which they are drawn larger.
FEW = 250
# Means of a series.
MEANS = 14
# Times the range of means and curves that the frame shows of the points at most.
MAGNIFIED = 2.5
# Times the usual error of a mean beyond which it does not widen the frame.
VAGUE = 4.0


class Series(NamedTuple):
    """Points of one kind.

    Args:
        name: in the legend.
        look: ``active``, ``reverse`` or ``flight``, as the style sheet has it.
        x: coordinate, (n,).
        y: value, (n,).
        sure: one over the standard deviation of ``y``, (n,).
        curve: what is expected at each point, (n,); ``None`` draws none.
        edge: half width of a band about zero, (n,); ``None`` draws none.
        line: whether the points are one line, and nothing but that is drawn.
    """

    name: str
    look: str
    x: Array
    y: Array
    sure: Array
    curve: Array | None = None
    edge: Array | None = None
    line: bool = False


class Frame(NamedTuple):
    """What a chart is drawn in.

    Args:
        x: name of the coordinate, with its unit.
        y: name of the value, with its unit.
        across: range of the coordinate.
        up: range of the value.
        turn: whether the coordinate is an angle from 0 to 360 degrees.
    """

    x: str
    y: str
    across: tuple[float, float]
    up: tuple[float, float]
    turn: bool = False


def means(x: Array, y: Array, sure: Array, pieces: int = MEANS) -> tuple[Array, Array, Array]:
    """Return means over as many points each, with the standard deviations of the means.

    >>> at, mean, sigma = means(np.arange(8.0), np.tile([1.0, 3.0], 4), np.ones(8), 2)
    >>> at.tolist(), mean.tolist(), sigma.tolist()
    ([1.5, 5.5], [2.0, 2.0], [0.5, 0.5])
    """
    pieces = max(min(pieces, len(x) // 4), 1)
    found = []
    for part in np.array_split(np.argsort(x, kind="stable"), pieces):
        if len(part):
            weight = sure[part] ** 2 / np.sum(sure[part] ** 2)
            middle = float(weight @ y[part])
            spread = float(np.sqrt(np.sum(weight**2 * (y[part] - middle) ** 2)))
            found.append((float(np.mean(x[part])), middle, spread))
    at = np.array(found).reshape(-1, 3)
    return at[:, 0], at[:, 1], at[:, 2]


def limits(groups: list[list[Series]]) -> tuple[float, float]:
    """Return a common range of values for several charts."""
    own, points = [0.0], []
    for one in (one for group in groups for one in group):
        _, mean, sigma = means(one.x, one.y, one.sure)
        sure = sigma <= VAGUE * np.median(sigma) if len(sigma) else sigma > 0.0
        own += [*(mean - 2.0 * sigma)[sure], *(mean + 2.0 * sigma)[sure]]
        own += [] if one.edge is None or not len(one.edge) else [float(one.edge.max()), -float(one.edge.max())]
        own += [] if one.curve is None or not len(one.curve) else [float(one.curve.min()), float(one.curve.max())]
        points.append(one.y)
    low, high = min(own), max(own)
    space = (MAGNIFIED - 1.0) / 2.0 * max(high - low, 1e-30)
    every = np.concatenate(points) if points else np.zeros(1)
    ends = np.quantile(every, [0.005, 0.995]) if len(every) else (0.0, 0.0)
    low, high = min(low, max(float(ends[0]), low - space)), max(high, min(float(ends[1]), high + space))
    pad = 0.07 * max(high - low, 1e-30)
    return low - pad, high + pad


def chart(drawn: list[Series], frame: Frame, says: str) -> dict[str, Any]:
    """Return a chart: points, their means with 95 % intervals, curves and limits."""
    sets = []
    for one in drawn:
        if one.line:
            sets.append(series("line", one.name, one.look, one.x, np.clip(one.y, *frame.up), width=1.4))
            continue
        some = np.unique(np.linspace(0, len(one.x) - 1, min(len(one.x), SHOWN)).astype(int)) if len(one.x) else []
        x, y, square = one.x[some], one.y[some], one.look == "reverse"
        seen, size = (y >= frame.up[0]) & (y <= frame.up[1]), 4 if len(one.x) < FEW else 3
        sets.append(series("dots", one.name, one.look, x[seen], y[seen], size=size, square=square, alpha=0.45))
        at, mean, sigma = means(one.x, one.y, one.sure)
        sets.append(series("marks", f"{one.name}, mean", one.look, at, mean, tall=1.96 * sigma, square=square, size=9))
        lines = [] if one.curve is None else [(f"{one.name}, contribution", one.curve)]
        lines += [] if one.edge is None else [("95 % of the rebounds", one.edge), ("", -one.edge)]
        for label, values in lines:
            at, line, _ = means(one.x, values, np.ones_like(one.x), 60)
            sets.append(series("line", label, "twin" if one.look == "flight" else "run", at, line, dash=square))
    return {"x": frame.x, "y": frame.y, "title": "", "words": says, "half": True, "distr": [1, 1],
            "xrange": list(frame.across), "yrange": list(frame.up), "turn": frame.turn, "sets": sets}  # fmt: skip


# Name and scale of the residual of each channel.
VALUES = {
    "flight": ("extra deceleration of flights [rad/s²]", 1.0),
    "contact": ("displacement residual [µm]", 1e6),
    "impact": ("rebound residual [mm/s]", 1e3),
    "loss": ("extrapolated separation speed [µm/s]", 1e6),
    "drive": ("drive angle residual [µrad]", 1e6),
}
# Channel in which causes of each place are shown.
PLACES = {"torque": "flight", "geometry": "contact", "impact": "impact", "motion": "drive", "sensor": "contact"}
# Times the frequency of a resonance up to which spectra are shown; 0 dB [m].
WIDE, REFERENCE = 3.0, 1e-6
RPM = 30.0 / pi
# Teeth to either side of a deviating tooth that its chart shows.
TEETH = 3.0


class Samples(NamedTuple):
    """Points of a channel of all records.

    Args:
        value: residual [SI], (n,).
        sure: one over its standard deviation, (n,).
        time: [s].
        drive: angle of the drive gear [rad].
        loose: angle of the loose gear [rad].
        speed: of the loose gear in flights, else of the drive gear; of approach at impacts [rad/s or m/s].
        flank: 0 active, 1 reverse, 2 neither.
        record: index of the record.
    """

    value: Array
    sure: Array
    time: Array
    drive: Array
    loose: Array
    speed: Array
    flank: Array
    record: Array


class Coordinate(NamedTuple):
    """The horizontal coordinate of a chart.

    Args:
        name: with its unit.
        x: (n,).
        turn: whether it is an angle from 0 to 360 degrees.
    """

    name: str
    x: Array
    turn: bool = False


class Picture(NamedTuple):
    """Charts of a residual before and after a correction, or of one residual alone.

    Args:
        channel: that is shown.
        coordinate: in words.
        before: chart.
        after: chart, or ``None``.
        caption: of ``before``.
        points: whether points and their means are drawn, not lines alone.
    """

    channel: str
    coordinate: str
    before: dict[str, Any]
    after: dict[str, Any] | None
    caption: str
    points: bool = True


def samples(records: Sequence[Evidence], name: str, rest: Array) -> Samples:
    """Return the points of a channel with their coordinates."""
    parts, at = [], 0
    for k, one in enumerate(records):
        part, size = _SAMPLES[name](one, rest[at:])
        parts.append([*part, np.full(len(part[0]), k)])
        at += size
    return Samples(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _flights(one: Evidence, rest: Array) -> tuple[list[Array], int]:
    size = one.channels.flights.time.size
    if not size:
        return [np.zeros(0)] * 7, 0
    shape = deceleration_response(one)
    square = np.sum(shape**2, axis=1)
    slow = np.sum(shape * rest[:size].reshape(-1, BINS), axis=1) / square
    time, angle, speed = (values.mean(axis=1) for values in one.fine)
    drive = np.interp(time, one.channels.drive.time, one.channels.drive.angle)
    return [slow, np.sqrt(square), time, drive, angle, speed, np.full(len(time), 2)], size


def _contacts(one: Evidence, rest: Array) -> tuple[list[Array], int]:
    seen = one.channels.contacts
    size, speed = len(seen.time), one.motion.speed(seen.time)
    off = in_units(one, "contact", rest[:size])
    return [off, 1.0 / seen.sigma, seen.time, seen.drive, seen.loose, speed, seen.flank], size


def _impacts(one: Evidence, rest: Array) -> tuple[list[Array], int]:
    seen, sigma = one.channels.impacts, impact_sigma(one)
    size, speed = len(seen.time), np.abs(seen.velocity)
    toward = np.where(seen.flank == 0, 1.0, -1.0)  # more rebound is more on either flank
    made = [toward * rest[:size] * sigma, 1.0 / sigma, seen.time, seen.drive, seen.loose, speed, seen.flank]
    return [column[seen.seen] for column in made], size


def _losses(one: Evidence, rest: Array) -> tuple[list[Array], int]:
    seen, sigma = one.channels.losses, loss_sigma(one)
    size, speed = len(seen.time), one.motion.speed(seen.time)
    return [rest[:size] * sigma, 1.0 / sigma, seen.time, seen.drive, seen.loose, speed, seen.flank], size


def _drives(one: Evidence, rest: Array) -> tuple[list[Array], int]:
    seen = one.drive
    size, speed = len(seen.time), one.motion.speed(seen.time)
    loose = seen.angle * one.radii[0] / one.radii[1]
    sure = np.full(size, 1.0 / seen.sigma)
    off = in_units(one, "drive", rest[:size])
    return [off, sure, seen.time, seen.angle, loose, speed, np.full(size, 2)], size


_SAMPLES = {"flight": _flights, "contact": _contacts, "impact": _impacts, "loss": _losses, "drive": _drives}


def of_cause(found: Diagnosis, effect: Any) -> Picture | None:
    """Return the picture of a cause; ``None`` where its channel has no points.

    Before: residual with all other causes; after: with this cause as well; the curve is the contribution of the cause.
    """
    records, name = found.found.records, "loss" if effect.kind == "mesh_drag" else PLACES.get(effect.place, "flight")
    rest = found.found.fit.rest[found.found.known.spans[name]]
    own = contribution(records, [effect], (name,))
    before, after, curve = (samples(records, name, values) for values in (rest + own, rest, own))
    if effect.kind == "pitch_error":
        near = np.abs(_teeth(records, effect, before)) <= TEETH
        before, after, curve = (Samples(*(column[near] for column in one)) for one in (before, after, curve))
    if len(before.value) < 2:
        return None
    along = _coordinate(records, name, effect, before)
    if effect.kind == "restitution_scatter":
        edge = 1.96e3 * effect.standard_deviation * before.speed
        flown = [one._replace(edge=edge[before.flank == k]) for k, one in _by_flank(before, along, name)]
        return _picture(name, along, [flown], effect.kind, "Lines: limits of 95 % of the rebounds with this scatter.")
    charts = [_series(before, along, name, curve), _series(after, along, name)]
    words = "Before: without this cause, with all others. Curve: contribution of this cause."
    return _picture(name, along, charts, effect.kind, words)


def of_remains(found: Diagnosis, structure: str, where: float | None) -> Picture | None:
    """Return the chart of a residual pattern; ``None`` where its channel has no points, or where it is the path."""
    if structure == "impact.duration" and found.rings is not None:
        return _spectra(found.rings)
    if structure == "flight.gap":
        return _pull(found)
    if structure == "path.all":  # the film shows the path
        return None
    records, name = found.found.records, channel_of(structure)
    seen = samples(records, name, found.found.fit.rest[found.found.known.spans[name]])
    if len(seen.value) < 2:
        return None
    if structure in ("impact.tooth", "impact.flank"):
        along = _folded(seen.drive, 1.0, "drive")
    elif structure.startswith("contact.tooth_"):
        gear = structure.removeprefix("contact.tooth_")
        along = _folded(getattr(seen, gear), 1.0, gear)
    elif where is not None and structure.split(".")[1] in ("order_drive", "order_loose", "angle_drive", "angle_loose"):
        gear = "loose" if structure.endswith("loose") else "drive"
        along = _folded(getattr(seen, gear), where, gear)
    elif structure in ("flight.time", "impact.time", "sensor.ratio", "contact.time"):
        along = Coordinate("time [s]", seen.time)
    else:
        along = _speed(name, seen)
    return _picture(name, along, [_series(seen, along, name)], structure, "Residual.")


def _spectra(rings: Resonance) -> Picture:
    """Return the spectra of all records near a resonance: one line per record, with a peak at the same frequency."""
    near = rings.frequency < WIDE * rings.structure.where
    near &= np.isfinite(rings.power).all(axis=0)
    level = 10.0 * np.log10(np.maximum(rings.power[:, near], 1e-30) / REFERENCE**2)
    ones, words = np.ones(np.count_nonzero(near)), "each record"
    lines = [Series("" if k else words, "flight", rings.frequency[near], row, ones, line=True)
             for k, row in enumerate(level)]  # fmt: skip
    frame = Frame("frequency [Hz]", "displacement amplitude [dB re 1 µm]", (0.0, float(rings.frequency[near][-1])),
                  (float(level.min()) - 3.0, float(level.max()) + 3.0))  # fmt: skip
    drawn = chart(lines, frame, f"{frame.y} over {frame.x}: a peak of every record at {rings.structure.where:.0f} Hz")
    told = "A peak caused by the drive or by an order would shift with the speed; this one does not."
    return Picture("flight", frame.x, drawn, None, told, False)


def _pull(found: Diagnosis) -> Picture | None:
    """Return decelerations over the position in the gap: one line per record, and their common curve."""
    records, rest = found.found.records, found.found.fit.rest[found.found.known.spans["flight"]]
    cuts = np.cumsum([one.channels.flights.time.size for one in records])[:-1]
    if (told := gap_deceleration(records, np.split(rest, cuts))) is None:
        return None
    across, ones = 100.0 * told.place, np.ones(len(told.place))
    lines = [Series("" if k else "each record", "flight", across, row - row.mean(), ones, line=True)
             for k, row in enumerate(told.own)]  # fmt: skip
    lines.append(Series("common curve", "active", across, told.common - told.common.mean(), ones, line=True))
    frame = Frame(
        "position in the gap, from the active flank [%]", VALUES["flight"][0], (0.0, 100.0), _ends(told.common)
    )
    drawn = chart(lines, frame, f"{frame.y} over {frame.x}")
    words = "Residual deceleration, without the mean of each record."
    return Picture("flight", frame.x, drawn, None, words, False)


def _ends(common: Array) -> tuple[float, float]:
    """Return limits of which the common curve takes 2/3: poorly determined parts of single records may exceed them."""
    size = 1.5 * float(np.max(np.abs(common - common.mean())))
    return -size, size


def _picture(name: str, along: Coordinate, charts: list[list[Series]], what: str, words: str) -> Picture:
    low, high = float(along.x.min()), float(along.x.max())
    pad = 0.02 * max(high - low, 1e-9)
    across = (0.0, 360.0) if along.turn else (low - pad, high + pad)
    frame = Frame(along.name, VALUES[name][0], across, limits(charts), along.turn)
    titles = (f"{frame.y} over {along.name}, {what}: before", f"{frame.y} over {along.name}, {what}: after")
    drawn = [chart(group, frame, says) for group, says in zip(charts, titles, strict=False)]
    return Picture(name, along.name, drawn[0], drawn[1] if len(drawn) > 1 else None, words)


def _series(seen: Samples, along: Coordinate, name: str, curve: Samples | None = None) -> list[Series]:
    return [one for _, one in _by_flank(seen, along, name, curve)]


def _by_flank(seen: Samples, along: Coordinate, name: str, curve: Samples | None = None) -> list[tuple[int, Series]]:
    """Return the points of each flank that has any."""
    scale, found = VALUES[name][1], []
    looks = ((0, "active", "active flank"), (1, "reverse", "reverse flank"), (2, "flight", "all records"))
    for code, look, words in looks:
        own = seen.flank == code
        if np.any(own):
            drawn = None if curve is None else scale * curve.value[own]
            one = Series(words, look, along.x[own], scale * seen.value[own], seen.sure[own] / scale, drawn)
            found.append((code, one))
    return found


def _coordinate(records: Sequence[Evidence], name: str, effect: Any, seen: Samples) -> Coordinate:
    """Return the coordinate on which a cause depends."""
    kind, gear, order = effect.kind, getattr(effect, "gear", "drive"), float(getattr(effect, "order", 1.0))
    if kind == "pitch_error":
        words = f"{gear} gear, teeth after tooth {effect.tooth} at the pitch point"
        return Coordinate(words, _teeth(records, effect, seen))
    if kind == "drag_drift":
        return Coordinate("time [s]", seen.time)
    if effect.place == "torque" and "order" in effect.params:
        return _folded(seen.loose, order, "loose")
    if kind == "drive_motion":
        cycles = np.array([effect.rows(one.rig)[0].p[1] for one in records])[seen.record] * seen.time
        return Coordinate("phase of this motion [°]", 360.0 * np.mod(cycles, 1.0), True)
    if name in ("flight", "impact", "loss") or kind == "encoder_skew":
        return _speed(name, seen)
    return _folded(getattr(seen, gear), order, gear)


def _teeth(records: Sequence[Evidence], effect: Any, seen: Samples) -> Array:
    """Return by how many teeth a gear has rotated after the tooth of a pitch error."""
    teeth = records[0].rig.teeth_drive if effect.gear == "drive" else records[0].rig.teeth_loose
    since = getattr(seen, effect.gear) - (effect.tooth - 1.0) * 2.0 * pi / teeth
    return (np.mod(since + pi, 2.0 * pi) - pi) * teeth / (2.0 * pi)


def _folded(angle: Array, order: float, gear: str) -> Coordinate:
    times = "" if order == 1.0 else f"{order:.4g} × "
    return Coordinate(f"{times}angle of the {gear} gear [°]", np.degrees(np.mod(order * angle, 2.0 * pi)), True)


def _speed(name: str, seen: Samples) -> Coordinate:
    if name == "impact":
        return Coordinate("approach speed [mm/s]", 1e3 * seen.speed)
    gear = "loose" if name == "flight" else "drive"
    return Coordinate(f"speed of the {gear} gear [rpm]", RPM * seen.speed)
