"""From a raw record to free coast-downs: held readings, dropouts and lost pulses repaired, driven phases excluded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import pi
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.identify.coastdown_pulses import count_pulses, uneven_magnets
from gears3d.measured.checks import Admitted, Finding, admit, admit_each
from gears3d.measured.readers import Channels
from gears3d.signals import edges, noise_of, quantum

# Share of the starting speed below which a coast-down is not used: stiction and the last count disturb it.
SLOWEST = 0.03
# Least error of an edge, in counts.
FLOOR = 0.1
# Edges or readings below which no drag is identified: two to four numbers, a start and their scatter.
FEWEST = 20
# Rows of a file below which readings were taken by hand or by a slow display: each counts, and fewer are enough.
SHORT = 50
# Readings of a short file below which nothing is identified: one number of a law, the start, and three degrees of
# freedom for their scatter; pulses show their own numbers only among others.
LEAST = {"speed": 5, "angle": 6, "pulses": 8}
# Share of its speed by which a free phase must slow down; less hardly separates drag from fluctuations of a drive.
LEAST_FALL = 0.25
# Share of the highest speed of a record at which a free phase must begin; below it are inching and standstill.
LEAST_PEAK = 0.15
# Mean speeds in which free phases are looked for: 0.2 % of the record each.
GROUPS = 600
# Degree of the motion over 10 % of a record of pulses: they are far apart near standstill.
DEGREE = 6
# Noise of mean speeds, in the highest one, from which on longer means are taken: rises and falls must be significant.
CALM = 0.01
# Share of a free phase by which its use begins after the release found, which is the uncertainty of the release.
LATE = 0.015
# Findings of the sensor checks that are repaired here, and reported with what became of them.
OWN = ("not-finite", "jumps", "spikes", "lost-counts", "left-out", "repeated", "held", "merged-edges", "doubled-edges",
       "drift",
       "integration")  # fmt: skip
# Findings about even sampling, that times of pulses do not have.
PACE = ("gaps", "jitter")
# Findings that never end a coast-down; rows without a reading are excluded by the checks, however many they are.
TOLERATED = (*OWN, "drop-outs")
# Share of pulses that no smooth motion explains from which on a record is refused.
RUINED = 0.2
GEARS = ("loose", "drive")
Span = tuple[float | None, float | None]


class Track(NamedTuple):
    """One free coast-down.

    Args:
        time: since the first point [s], (n,).
        value: angle from 0 [rad] or speed [rad/s], whichever was measured, in the sense of rotation, (n,).
        sigma: standard deviation of the value, (n,).
        speed: at the first point [rad/s].
        slowest: speed at the last point [rad/s].
        quantum: smallest step of the value [rad or rad/s], ``None`` for a smooth record.
        file: where it came from.
        temperature: mean of the record's own [°C], ``None`` where it has none.
        findings: of the sensor checks and of the repair.
        measured: ``"angle"``, ``"speed"`` or ``"pulses"``.
        span: first and last point in the time of the record [s].
        torque: known, that spins the gear up here [N·m]; 0 of a coast-down.
        fastest: highest speed [rad/s], that at the last point of a spin-up.
    """

    time: np.ndarray
    value: np.ndarray
    sigma: np.ndarray
    speed: float
    slowest: float
    quantum: float | None
    file: str
    temperature: float | None = None
    findings: tuple[Finding, ...] = ()
    measured: str = "angle"
    span: tuple[float, float] = (0.0, 0.0)
    torque: float = 0.0
    fastest: float = 0.0


def read_track(
    path: str | Path,
    gear: str = "loose",
    map_file: str | Path | None = None,
    correct: Sequence[str] = (),
    span: Span = (None, None),
) -> Track:
    """Read the longest free coast-down of a file.

    Args:
        path: a file with ``time_s`` and ``theta_loose_rad`` (or ``omega_rad_s``), maybe ``temperature_degC``.
        gear: ``"loose"`` or ``"drive"``, whose motion counts.
        map_file: ``record.toml``.
        correct: kinds of findings of the sensor checks to correct.
        span: first and last time of the free phase [s]; found where both are ``None``.

    Returns:
        The coast-down.

    Raises:
        InputError: columns are missing, or nothing coasts down freely.
    """
    return _longest(
        _tracks(admit(path, None, map_file, correct, needs=(_names(gear),), tolerate=TOLERATED), gear, span)
    )


def read_tracks(
    paths: Sequence[str | Path],
    gear: str = "loose",
    map_file: str | Path | None = None,
    correct: Sequence[str] = (),
    excluded: Callable[[Sequence[Admitted]], object] = len,
    span: Span = (None, None),
    torque: float = 0.0,
) -> list[Track]:
    """Read all free coast-downs of several files, each file once.

    Args:
        paths: as for :func:`read_track`.
        gear: as for :func:`read_track`.
        map_file: as for :func:`read_track`.
        correct: as for :func:`read_track`; ``"duplicated-file"`` excludes a file that repeats another's readings.
        excluded: called with the records that are excluded for that.
        span: as for :func:`read_track`.
        torque: known, under which the gear spins up in phases of rising speed, which are then used, too [N·m].

    Returns:
        The coast-downs, those of one file in order of time.

    Raises:
        InputError: as for :func:`read_track`, of all files together, or a file repeats the readings of another.
    """
    admission = admit_each(paths, None, map_file, correct, needs=(_names(gear),), tolerate=TOLERATED)
    admitted = admission.all()
    excluded(admission.repeated)
    return [track for one in admitted for track in _tracks(one, gear, span, torque)]


def make_track(time: np.ndarray, angle: np.ndarray, file: str = "", span: Span = (None, None)) -> Track:
    """Return the longest free coast-down from bare arrays.

    Args:
        time: [s], rising, (n,).
        angle: [rad], (n,).
        file: named in faults.
        span: first and last time of the free phase [s]; found where both are ``None``.

    Raises:
        InputError: nothing coasts down.

    >>> t = np.linspace(0.0, 1.0, 1001)
    >>> round(make_track(t, 3.0 * t - 1.5 * t**2).speed, 1)
    3.0
    """
    return _longest(make_tracks(time, angle, "angle", file, span))


def make_tracks(
    time: np.ndarray,
    value: np.ndarray,
    measured: str = "angle",
    file: str = "",
    span: Span = (None, None),
    torque: float = 0.0,
) -> list[Track]:
    """Return all free coast-downs from bare arrays, repaired.

    Args:
        time: [s], rising, (n,).
        value: angle [rad], speed [rad/s], or the angles of pulses that may be missing or too many [rad], (n,).
        measured: ``"angle"``, ``"speed"`` or ``"pulses"``.
        file: named in faults.
        span: first and last time of the free phase [s]; found where both are ``None``.
        torque: known, under which the gear spins up in phases of rising speed, which are then used, too [N·m].

    Raises:
        InputError: nothing coasts down.
    """
    time, value = np.asarray(time, float), np.asarray(value, float)
    name = "omega_rad_s" if measured == "speed" else "theta_loose_rad"
    some = np.isfinite(time) & np.isfinite(value)
    lost = len(time) - int(some.sum())
    found = [_finding("not-finite", name, lost, f"{lost} readings are not numbers: excluded")] if lost else []
    if 2 * lost > len(time):
        raise InputError(Fault(name, f"{lost} of {len(time)} readings are not numbers", "record it again", file))
    time, value = time[some], value[some]
    fewest = _fewest(len(time), measured)
    if len(time) and (span[0] is not None or span[1] is not None):
        low, high = (time[0] if span[0] is None else span[0]), (time[-1] if span[1] is None else span[1])
        inside = (time >= low) & (time <= high)
        if inside.sum() < fewest:
            what = f"has {inside.sum()} rows between {low:g} and {high:g} s, it covers {time[0]:g} to {time[-1]:g} s"
            raise InputError(Fault("--from, --to", what, "give times within the record", file))
        time, value = time[inside], value[inside]
    if len(time) < fewest:
        raise InputError(Fault("time_s", f"has {len(time)} rows", f"give at least {fewest}", file))
    if measured == "angle" and _are_pulses(time, value):
        measured = "pulses"
    prepare = {"speed": _speeds, "angle": _angles, "pulses": _pulses}[measured]
    points, more = prepare(time, value, name, file)
    found += more
    phases = _free(points) if span == (None, None) or torque else [_given(points)]
    fewest = min(fewest, _fewest(len(time), measured))
    tracks = [track for phase in phases for track in _cut(points, phase, measured, file, fewest)]
    if torque:
        risen = [one for phase in _risen(points) for one in _cut(points, phase, measured, file, fewest, torque)]
        tracks = sorted([*tracks, *risen], key=lambda one: one.span)
    if not tracks:
        raise _still(points, phases, name, measured, file, fewest)
    record = (points.time[0], points.time[-1])
    if len(tracks) > 1 or any(t.span[0] > record[0] + 0.02 * (record[1] - record[0]) for t in tracks):
        spans = ", ".join(f"{t.span[0]:.6g} to {t.span[1]:.6g} s" for t in tracks[:6])
        risen = sum(track.torque > 0.0 for track in tracks)
        what = f"{len(tracks) - risen} free coast-down{'s' * (len(tracks) - risen != 1)}"
        what += f" and {risen} spin-up{'s' * (risen != 1)}" * bool(risen)
        what += f" found: {spans}{' ...' * (len(tracks) > 6)}"
        found.append(_finding("free-phase", name, len(tracks), f"{what} of {record[0]:.6g} to {record[1]:.6g} s",
                              "give --from and --to where this is wrong"))  # fmt: skip
    return [track._replace(findings=tuple(found) if at == 0 else ()) for at, track in enumerate(tracks)]


class _Points(NamedTuple):
    """A preprocessed record: the measured quantity, and the points between which it may have jumped."""

    time: np.ndarray
    value: np.ndarray
    sigma: np.ndarray
    breaks: np.ndarray  # rows at which a new unknown offset of the angle begins
    quantum: float | None
    speeds: tuple[np.ndarray, np.ndarray]  # mean speeds of groups, and their times
    pitch: float | None = None


def _names(gear: str) -> tuple[str, ...]:
    """Columns of which one must be there, the best first."""
    return (f"theta_{gear}_rad", "theta_rad", f"omega_{gear}_rad_s", "omega_rad_s")


def _tracks(admitted: Admitted, gear: str, span: Span, torque: float = 0.0) -> list[Track]:
    channels = admitted.channels
    columns, file = channels.columns, channels.file
    names = [name for name in _names(gear) if name in columns]
    if gear in channels.meta.get("speeds", ()):  # the angle would be an integrated speed
        names = [name for name in names if name.startswith("omega")] or names
    limits = channels.meta.get("span_s", (None, None))
    span = (limits[0] if span[0] is None else span[0], limits[1] if span[1] is None else span[1])
    kind = "speed" if names[0].startswith("omega") else "angle"
    if gear in channels.meta.get("pulses", ()):
        kind = "pulses"
    tracks = make_tracks(columns["time_s"], columns[names[0]], kind, file, span, torque)
    beside = (*OWN, *PACE) if kind == "pulses" else OWN
    seen = tuple(one for one in admitted.findings if one.kind not in beside)
    warm = _temperature(channels, file)
    return [
        track._replace(temperature=warm, findings=(*seen * (at == 0), *track.findings))
        for at, track in enumerate(tracks)
    ]


def _temperature(channels: Channels, file: str) -> float | None:
    """Return the mean temperature of a record [°C]."""
    if (values := channels.columns.get("temperature_degC")) is not None:
        if not np.all(np.isfinite(values)):
            raise InputError(Fault("temperature_degC", "is not finite everywhere", "cut it out", file))
        return float(values.mean())
    stated = channels.meta.get("temperature_degC")
    return float(stated) if isinstance(stated, int | float) else None


def _longest(tracks: list[Track]) -> Track:
    best = max(tracks, key=lambda track: (track.speed - track.slowest) * len(track.time) ** 0.5)
    return best._replace(findings=tracks[0].findings)


def _finding(kind: str, channel: str, size: float, what: str, remedy: str = "", unit: str = "") -> Finding:
    return Finding(kind, channel, float(size), unit, what, remedy)


def _fewest(rows: int, measured: str) -> int:
    """Return how many readings a coast-down must have, in a file of some rows."""
    return FEWEST if rows >= SHORT else LEAST[measured]


def _still(
    points: _Points, phases: list[tuple[float, float]], name: str, measured: str, file: str, fewest: int
) -> InputError:
    """Return the fault of a record without a free phase."""
    speed = points.speeds[1]
    if measured != "speed" and len(points.time) < fewest:
        remedy = "record a longer coast-down, or with more counts"
        return InputError(Fault(name, f"changes {len(points.time)} times only", remedy, file))
    if phases:
        low, high = max(phases, key=lambda phase: phase[1] - phase[0])
        few = int(np.sum((points.time >= low) & (points.time <= high)))
        what = f"has {few} readings in its free phase, {low:.6g} to {high:.6g} s"
        return InputError(Fault(name, what, f"record with more counts or updates: {fewest} are needed", file))
    what = f"does not run down: its speed is {np.min(speed):.4g} to {np.max(speed):.4g} rad/s without a free phase"
    remedy = "record from the release to the standstill, or give --from and --to"
    return InputError(Fault(name, what, remedy, file))


def _speeds(time: np.ndarray, value: np.ndarray, name: str, file: str) -> tuple[_Points, list[Finding]]:
    """Return the readings of a speed log: one an update, without dropouts and outliers."""
    from scipy.ndimage import median_filter

    found: list[Finding] = []
    if np.median(value) < 0.0:
        value = -value
    some = np.ones(len(value), bool)
    if (zero := _dropouts(value)).any():
        found.append(_finding("dropouts", name, zero.sum(), f"{zero.sum()} readings of 0 amid motion: excluded"))
        some &= ~zero
    time, value = time[some], value[some]
    kept, every = _updates(value)
    if every > 1.0:
        what = (
            f"each reading is held for {every:.3g} rows: one reading per update is used, {kept.sum()} of {len(value)}"
        )
        found.append(_finding("held", name, every, what))
        time, value = time[kept], value[kept]
    step = np.abs(np.diff(value))
    count = quantum(value)
    if count is not None and np.median(step[step > 0.0]) > 200 * count:
        count = None
    rest = value - np.mean(_neighbours(value), axis=0)
    before, after = _neighbours(value)
    outside = np.maximum(value - np.maximum(before, after), np.minimum(before, after) - value)  # a bend lies inside
    around = 1.4826 * median_filter(np.abs(rest), min(101, 2 * (len(value) // 4) + 1), mode="nearest")
    turning = np.abs(rest[value > 0.0])
    around = np.maximum(around, 0.7 * float(np.median(turning)) if turning.size else 0.0)  # a standstill has no noise
    usual = np.maximum(around, max(0.5 * (count or 0.0), 1e-6 * float(np.max(np.abs(value)))))
    wild = outside > 8.0 * usual  # nearly none of a normal noise
    if wild.any() and wild.sum() < 0.1 * len(value):
        found.append(_finding("outliers", name, wild.sum(), f"{wild.sum()} outliers among {len(value)}: excluded"))
        time, value = time[~wild], value[~wild]
    sigma = np.hypot(_local_noise(time, value), (count or 0.0) / np.sqrt(12.0))
    sigma = np.maximum(sigma, 1e-9 * float(np.abs(value).max(initial=1e-300)))
    group = max(len(value) // GROUPS, 1)
    rows = len(value) // group * group
    coarse = time[:rows].reshape(-1, group).mean(1), np.median(value[:rows].reshape(-1, group), axis=1)
    return _Points(time, value, sigma, np.zeros(0, int), count, coarse), found


def _neighbours(value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the medians of the five readings before and after each; at the ends those of the inner side, (n,) each."""
    if len(value) < 13:
        return value, value
    windows = np.median(np.lib.stride_tricks.sliding_window_view(value, 5), axis=1)
    before = np.concatenate([np.full(5, windows[0]), windows[:-1]])[: len(value)]
    after = np.concatenate([windows[1:], np.full(5, windows[-1])])[-len(value) :]
    return before, after


def _dropouts(value: np.ndarray) -> np.ndarray:
    """Return which readings are 0 although the gear turned just before and just after, (n,)."""
    lost = np.zeros(len(value), bool)
    zero = np.flatnonzero(value == 0.0)
    if not zero.size:
        return lost
    for run in np.split(zero, np.flatnonzero(np.diff(zero) > 1) + 1):
        before, after = value[max(run[0] - 3, 0) : run[0]], value[run[-1] + 1 : run[-1] + 4]
        if not before.size or not after.size or len(run) > 0.05 * len(value):
            continue
        early, late = float(np.median(before)), float(np.median(after))
        lost[run] = late > 0.5 * early > 0.5 * 0.05 * float(np.max(value))
    return lost


def _updates(value: np.ndarray) -> tuple[np.ndarray, float]:
    """Return which rows hold a new reading, and how many rows one is held; 1 where readings are not held.

    A coarse resolution repeats values, too, but for lengths that follow the speed; a hold is a whole number of updates.
    """
    begins = np.flatnonzero(np.diff(value, prepend=np.nan) != 0.0)
    lasts = np.diff(begins, append=len(value))
    moving = (value[begins] != 0.0) & (lasts < 0.2 * len(value))
    all_rows = np.ones(len(value), bool)
    if moving.sum() < 20 or moving.sum() > 0.8 * lasts[moving].sum():
        return all_rows, 1.0
    every = float(np.percentile(lasts[moving], 20))
    near = lasts[moving][np.abs(lasts[moving] - every) <= max(1.0, 0.2 * every)]
    every = float(np.mean(near))
    times = np.maximum(np.round(lasts[moving] / every), 1.0)
    if every < 1.5 or np.mean(np.abs(lasts[moving] - times * every) <= np.maximum(1.0, 0.15 * every)) < 0.8:
        return all_rows, 1.0
    kept = np.zeros(len(value), bool)
    for begin, length in zip(begins, lasts, strict=True):
        many = max(round(length / every), 1)
        kept[begin + np.floor(np.arange(many) * length / many).astype(int)] = True
    return kept, every


def _local_noise(time: np.ndarray, value: np.ndarray, degree: int = 0) -> np.ndarray:
    """Return the noise of a series along it, from second differences in ten stretches, (n,).

    ``degree``: of the motion that is removed before, where a parabola does not pass through four readings.
    """
    if len(value) < 200:
        return np.full(len(value), noise_of(time, _bent(time, value, degree)))
    edge = np.linspace(0, len(value), 11).astype(int)
    each = [noise_of(time[a:b], _bent(time[a:b], value[a:b], degree)) for a, b in pairwise(edge)]
    each = np.maximum(each, 0.2 * float(np.median(each)))
    return np.interp(np.arange(len(value)), 0.5 * (edge[1:] + edge[:-1]), each)


def _bent(time: np.ndarray, value: np.ndarray, degree: int) -> np.ndarray:
    """Return a series without its polynomial of some degree over the time."""
    if not degree or len(time) < 3 * degree:
        return value
    place = 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0
    terms = np.polynomial.chebyshev.chebvander(place, degree)
    return value - terms @ np.linalg.lstsq(terms, value, rcond=None)[0]


def _angles(time: np.ndarray, angle: np.ndarray, name: str, file: str) -> tuple[_Points, list[Finding]]:
    """Return the edges of an encoder, or the samples of a smooth angle, with the places where it jumps."""
    found: list[Finding] = []
    if angle[-1] < angle[0]:
        angle = -angle
    count = quantum(angle)
    kept = np.diff(angle, prepend=np.nan) != 0.0
    if kept.mean() < 0.7 and kept.sum() > FEWEST and _held_angle(angle, kept, count):
        lasts = np.diff(np.flatnonzero(kept))
        every = float(np.mean(lasts[lasts <= 3.0 * np.median(lasts)]))  # without a standstill
        what = f"each reading is held for {every:.3g} rows on average: one reading per update is used"
        found.append(_finding("held", name, every, what))
        time, angle = time[kept], angle[kept]
    spike, jump = _jumps(time, angle, count)
    if spike.any():
        found.append(_finding("outliers", name, spike.sum(), f"{spike.sum()} outliers of the angle: excluded"))
    starts = time[jump]
    time, angle = time[~spike], angle[~spike]
    if count is None:
        sigma = np.maximum(_local_noise(time, angle), 1e-12 * float(np.ptp(angle)) + 1e-300)
    else:
        edge = edges(time, angle, count)
        time, angle, slack = edge
        sigma = np.hypot(np.gradient(angle, time) * slack if len(time) > 2 else 0.0, FLOOR * count)
    breaks = np.searchsorted(time, starts)
    if len(breaks):
        found.append(_finding("jumps", name, len(breaks), f"the angle jumps {len(breaks)} times, first at "
                              f"{starts[0]:.6g} s: fitted in pieces"))  # fmt: skip
    return _Points(time, angle, sigma, breaks, count, _means(time, angle)), found


def _held_angle(angle: np.ndarray, kept: np.ndarray, count: float | None) -> bool:
    """Return whether an angle stands still for even lengths and then moves by more than a slow encoder's counts."""
    lasts = np.diff(np.flatnonzero(kept))
    if count is not None and np.median(np.abs(np.diff(angle[kept]))) < 2.5 * count:
        return False
    few, many = np.percentile(lasts, [25, 75])
    return bool(many >= 2.0 and many <= 1.5 * few + 1.0)  # at standstill alone, nothing is held while it turns


def _jumps(time: np.ndarray, angle: np.ndarray, count: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Return which rows are outliers, (n,), and the rows from which on the angle has another offset."""
    from scipy.ndimage import median_filter

    step, wait = np.diff(angle), np.diff(time)
    rest = step - median_filter(step, 15, mode="nearest")
    usual = 1.4826 * median_filter(np.abs(rest), 101, mode="nearest")
    limit = np.maximum(12.0 * usual, 6.0 * (count or 0.0)) + 1e-9 * float(np.abs(angle).max(initial=0.0))
    limit = np.maximum(limit, 2.0 * np.abs(median_filter(step, 15, mode="nearest")))
    wild = (np.abs(rest) > limit) & (wait < 1.6 * np.median(wait))
    at = np.flatnonzero(wild) + 1
    spike = np.zeros(len(angle), bool)
    jump = []
    while at.size:
        first, at = at[0], at[1:]
        near = at[at <= first + 3]
        back = [row for row in near if abs(rest[row - 1] + rest[first - 1]) < 0.3 * abs(rest[first - 1])]
        if back:
            spike[first : back[0]] = True
            at = at[at > back[0]]
        else:
            jump.append(first)
    return spike, np.array(jump, int)


def _means(time: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return times and mean speeds of groups of points."""
    some = np.unique(
        np.linspace(0, len(time) - 1, min(GROUPS, max(len(time) // (3 if len(time) > 100 else 2), 2)) + 1).astype(int)
    )
    t = time[some]
    return 0.5 * (t[1:] + t[:-1]), np.diff(angle[some]) / np.maximum(np.diff(t), 1e-300)


def _are_pulses(time: np.ndarray, angle: np.ndarray) -> bool:
    """Return whether rows are pulses: each moves by one pitch, at uneven times."""
    step, wait = np.diff(angle), np.diff(time)
    pitch = np.median(np.abs(step))
    even = np.mean(np.abs(wait / np.median(wait) - 1.0) < 1e-3) > 0.5
    return bool(pitch > 0.0 and not even and np.mean(np.abs(np.abs(step) / pitch - 1.0) < 1e-3) > 0.95)


def _pulses(time: np.ndarray, angle: np.ndarray, name: str, file: str) -> tuple[_Points, list[Finding]]:
    """Return pulses with their true numbers: missing ones counted, extra ones excluded, uneven magnets evened."""
    found: list[Finding] = []
    pitch = float(np.median(np.abs(np.diff(angle))))
    time = np.unique(time)
    magnets = 2 * pi / pitch
    whole = round(magnets) if abs(magnets - round(magnets)) < 1e-3 else 1
    kept, number, breaks = count_pulses(time, whole)
    missing = int(np.sum(np.diff(number[kept]) - 1) - sum(np.diff(number[kept])[breaks - 1] - 1))
    inner = np.flatnonzero(kept)
    extra = int((~kept[inner[0] : inner[-1]]).sum()) if inner.size else len(time)
    if missing:
        share = missing / (missing + kept.sum())
        found.append(
            _finding("missing-pulses", name, missing, f"{missing} pulses are missing ({share:.1%}): counted in")
        )
    if extra:
        found.append(_finding("extra-pulses", name, extra, f"{extra} pulses of {len(time)} are too many: excluded"))
    if extra > RUINED * len(time):
        what = f"{extra} of {len(time)} pulses follow no smooth motion"
        raise InputError(Fault(name, what, "check the threshold of the pulse detection", file))
    time, number = time[kept], number[kept]
    if len(time) < _fewest(len(kept), "pulses"):
        raise InputError(
            Fault(name, "no smooth motion makes these pulses", "check the threshold of the pulse detection", file)
        )
    angle = pitch * number
    if whole > 1:
        error = uneven_magnets(time, number, whole, breaks)
        if error is not None:
            worst = float(np.abs(error).max())
            what = f"{whole} magnets stand unevenly, by up to {worst:.2%} of a pitch: corrected"
            found.append(_finding("uneven-magnets", name, worst * pitch, what, unit="rad"))
            angle = angle - pitch * error[number % whole]
    sigma = np.maximum(_local_noise(time, angle, DEGREE), 1e-6 * pitch)
    return _Points(time, angle, sigma, breaks, pitch, _means(time, angle), pitch), found


def _free(points: _Points) -> list[tuple[float, float]]:
    """Return begin and end of the free phases: from where a drive releases to standstill or the next drive."""
    from scipy.ndimage import median_filter

    time, speed = points.speeds
    while True:
        if len(time) < 5:
            return []
        smooth = np.abs(median_filter(speed, 3, mode="nearest"))
        bend = np.diff(speed, 2)
        noise = 1.4826 * float(np.median(np.abs(bend - np.median(bend)))) / np.sqrt(6.0)
        top = float(np.percentile(smooth, 99.5))
        if noise < CALM * top or len(time) < 2 * FEWEST:
            break
        time, speed = _halved(time, speed)
    speed = smooth
    phases = []
    for high, low in _falls(speed, max(6.0 * noise, 0.03 * top)):
        first = float(speed[high])
        if first < LEAST_PEAK * top or first - speed[low] < LEAST_FALL * first:
            continue
        begin = _release(time, speed, high, low)
        first = float(np.interp(begin, time, speed))
        slow = np.flatnonzero((speed < max(SLOWEST * first, 2.0 * noise)) & (time > begin))
        end = time[min(slow[0], low) if slow.size else low]
        if low == len(time) - 1 and not slow.size:
            end = points.time[-1]
        elif not slow.size:  # driven again: the lowest point is not free any more
            end -= LATE * (end - begin)
        if end > begin:
            phases.append((begin, float(end)))
    return phases


def _risen(points: _Points) -> list[tuple[float, float]]:
    """Return begin and end of the spin-ups, which are the falls of the record in reversed time."""
    time, speed = points.speeds
    back = points._replace(time=-points.time[::-1], speeds=(-time[::-1], speed[::-1]))
    return [(-end, -begin) for begin, end in reversed(_free(back))]


def _halved(time: np.ndarray, speed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return means of pairs of groups, weighted by how long they last: that of an angle is the mean speed of both."""
    rows = len(time) // 2 * 2
    edge = np.concatenate(
        [[1.5 * time[0] - 0.5 * time[1]], 0.5 * (time[1:] + time[:-1]), [1.5 * time[-1] - 0.5 * time[-2]]]
    )
    lasts = np.diff(edge)[:rows].reshape(-1, 2)
    weight = lasts / lasts.sum(axis=1, keepdims=True)
    return (time[:rows].reshape(-1, 2) * weight).sum(axis=1), (speed[:rows].reshape(-1, 2) * weight).sum(axis=1)


def _given(points: _Points) -> tuple[float, float]:
    """Return the free phase that a user gave, without a standstill at its end."""
    time, speed = points.speeds
    speed = np.abs(speed)
    slow = np.flatnonzero(speed < SLOWEST * float(np.median(speed[: max(len(speed) // 50, 3)])))
    return float(points.time[0]), float(time[slow[0]] if slow.size else points.time[-1])


def _falls(speed: np.ndarray, least: float) -> list[tuple[int, int]]:
    """Return the rows between which a speed falls, smaller rises than ``least`` disregarded."""
    falls, high, low = [], 0, 0
    rising = True
    for at, value in enumerate(speed):
        if rising:
            if value >= speed[high]:
                high = at
            elif value < speed[high] - least:
                rising, low = False, at
        elif value <= speed[low]:
            low = at
        elif value > speed[low] + least:
            falls.append((high, low))
            rising, high = True, at
    if not rising:
        falls.append((high, low))
    return falls


def _release(time: np.ndarray, speed: np.ndarray, high: int, low: int) -> float:
    """Return the start of free coasting: after the knee between a plateau, or a slow ramp, and the fall."""
    from scipy.stats import f as fisher

    peak = speed[high]
    below = high + np.flatnonzero(speed[high : low + 1] < peak - 0.3 * (peak - speed[low]))
    last = min(int(below[0]) if below.size else low, low)
    some = slice(high, last + 1)
    t, v = time[some], speed[some]
    begin = float(time[0] if high == 0 else t[0])
    whole = float(time[low] - begin)
    if len(t) < 8:
        return begin + (LATE * whole if high else 0.0)
    u = (t - t[0]) / (t[-1] - t[0])

    def misfit(knee: float | None) -> float:
        if knee is None:
            table = np.column_stack([np.ones_like(u), u, u**2, u**3])
        else:
            after = np.maximum(u - knee, 0.0)
            table = np.column_stack([np.ones_like(u), u, after, after**2])
        return float(np.sum((v - table @ np.linalg.lstsq(table, v, rcond=None)[0]) ** 2))

    knees = u[2:-4] if len(u) < 100 else np.linspace(u[2], u[-4], 100)
    each = [misfit(float(knee)) for knee in knees]
    best = int(np.argmin(each))
    ratio = (misfit(None) - each[best]) / max(each[best] / max(len(u) - 5, 1), 1e-300)
    slope = np.polyfit(u[u <= knees[best]], v[u <= knees[best]], 1)[0] if np.sum(u <= knees[best]) > 1 else 0.0
    fall = (v[-1] - np.interp(knees[best], u, v)) / (1.0 - knees[best])
    if fisher.sf(max(ratio, 0.0), 1, len(u) - 5) < 1e-4 and slope > 0.6 * fall:
        begin = float(t[0] + knees[best] * (t[-1] - t[0]))
        return begin + LATE * (float(time[low]) - begin)
    return begin + (LATE * whole if high else 0.0)


def _cut(
    points: _Points, phase: tuple[float, float], measured: str, file: str, fewest: int, torque: float = 0.0
) -> list[Track]:
    """Return the tracks of a phase: one, or several where the angle has an unknown offset in between."""
    rows = np.flatnonzero((points.time >= phase[0]) & (points.time <= phase[1]))
    if rows.size < min(8, fewest):
        return []
    first, last = int(rows[0]), int(rows[-1]) + 1
    inner = [int(row) for row in points.breaks if first < row < last]
    bounds = [first, *inner, last]
    tracks = []
    for low, high in pairwise(bounds):
        least = fewest if len(bounds) == 2 else max(fewest // 2, LEAST[measured])
        if high - low < max(least, 0.03 * (last - first)):
            continue
        track = _track(points, low, high, measured, file, torque)
        tracks += [] if track is None else [track]
    return tracks


def _track(points: _Points, low: int, high: int, measured: str, file: str, torque: float = 0.0) -> Track | None:
    time, value, sigma = points.time[low:high], points.value[low:high], points.sigma[low:high]
    part = max(min(len(time) // 25, 200), 4 if len(time) >= FEWEST else 1)
    if measured == "speed":
        if np.median(value) < 0.0:
            value = -value
        first, last = float(np.median(value[:part])), float(np.median(value[-part:]))
    else:
        if value[-1] < value[0]:
            value = -value
        value = value - value[0]
        at = np.linspace(0, len(time) - 1, max(min(len(time) // part, 25), 3)).astype(int)
        mean = np.diff(value[at]) / np.diff(time[at])
        first = float(mean[0] + 0.5 * (mean[0] - mean[1]))
        last = float(max(mean[-1] + 0.5 * (mean[-1] - mean[-2]), 0.3 * mean[-1]))
    span = float(time[0]), float(time[-1])
    if torque:
        if not last > 1.02 * max(first, 0.0):
            return None
        first = max(first, 1e-3 * last)
        return Track(time - time[0], value, sigma, first, first, points.quantum, file, measured=measured, span=span,
                     torque=torque, fastest=last)  # fmt: skip
    if not first > 0.0 or last > 0.98 * first:
        return None
    last = max(last, 1e-3 * first)
    return Track(time - time[0], value, sigma, first, last, points.quantum, file, measured=measured, span=span)


def spans(tracks: Sequence[Track]) -> list[dict[str, Any]]:
    """Return which part of which file each coast-down is, and how it was measured, as JSON can hold it."""
    return [
        {"file": track.file, "from_s": track.span[0], "to_s": track.span[1], "measured": track.measured,
         "points": len(track.time)} | ({"torque_N_m": track.torque} if track.torque else {})
        for track in tracks
    ]  # fmt: skip
