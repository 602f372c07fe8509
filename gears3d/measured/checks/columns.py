"""Completeness and time base: columns, rows, notes of decoders, records given twice; order, steps and unit of time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from gears3d.errors import did_you_mean
from gears3d.measured.checks.view import MESH, Finding, View, when
from gears3d.measured.readers import Channels
from gears3d.signals import changes, robust_deviation, some_steps

DROPPED = "drop-outs"
# Rows without a reading that are excluded without a request, at most.
FEW = 20
# Part of the rows that they may be, as of damaged rows; only the flights that they interrupt are lost.
SHARE = 0.01
# Rows in a row that they may be.
LONGEST = 2
# Ratio of the distance from zero to the motion of neighbouring readings, from which a zero is a missing reading.
FAR = 10.0
# Angle [rad] that no gear reaches: ten years at 30 000 rpm.
FARTHEST = 1e12
# Units that clocks count in [s].
TICKS = (1.0, 1e-3, 1e-6, 1e-7, 1e-8, 1e-9)
# Where clocks of minutes, hours and days restart [s].
ROUND = (60.0, 3600.0, 86400.0)
BITS = range(8, 65)
# Rows that are out of order by no more were written in blocks; further ones belong to another record.
LOCAL = 1000


def examine(view: View) -> list[Finding]:
    """Find columns that are missing, empty, of another length or no numbers, and rows that hold NaN or infinity."""
    found = [*_missing(view), *_shapes(view)]
    return found or _holes(view)


def correct(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Exclude rows without a reading: NaN, infinity, or a zero far from the readings around it."""
    good = np.ones(len(columns["time_s"]), bool)
    for finding in findings:
        values = columns[finding.channel]
        good &= np.isfinite(values)
        if finding.kind == DROPPED:
            good[_zeros(values)] = False
    return {name: values[good] for name, values in columns.items()}


def _missing(view: View) -> list[Finding]:
    found = []
    for need in ("time_s", *view.declared.needs):
        either = (need,) if isinstance(need, str) else need
        if not any(name in view.columns for name in either):
            have = list(view.columns)
            remedy = did_you_mean(either[0], have).replace("known:", "it has") if have else "the file has no columns"
            remedy += "; name the channels in record.toml" if have else ""
            told = f"column {' or '.join(either)} is missing"
            found.append(Finding("missing", either[0], 1.0, "column", told, remedy, fatal=True))
    return found


def _shapes(view: View) -> list[Finding]:
    found = []
    if "time_s" not in view.columns:
        return []
    rows = np.shape(view.time)[:1]
    for name in view.used:
        values = view.columns[name]
        if values.dtype.kind not in "biuf" and len(values):
            told = f"contains {values.flat[0]!r}, which is not a number"
            found.append(Finding("not-numbers", name, float(len(values)), "row", told, "write numbers", fatal=True))
        elif values.ndim != 1 or values.shape[:1] != rows:
            told = f"has shape {values.shape}, time_s has {rows[0] if rows else 0} rows"
            found.append(
                Finding("lengths", name, float(len(values)), "row", told, "give one value per row", fatal=True)
            )
    return found or empty(view)


def empty(view: View) -> list[Finding]:
    """Find records with too few rows."""
    rows = len(view.time)
    if rows >= 3:
        return []
    remedy = "give a record with at least 3 rows"
    return [Finding("empty", "time_s", float(rows), "row", f"has {rows} rows", remedy, fatal=True)]


def _holes(view: View) -> list[Finding]:
    found = []
    for name in view.used:
        values = view.columns[name]
        if not np.isfinite(values.sum()) and (bad := np.flatnonzero(~np.isfinite(values))).size:
            some = tuple(map(int, bad[:20]))
            told = f"{len(bad)} of {len(values)} rows are not finite numbers, "
            told += f"the first is {values[bad[0]]} in row {bad[0]}"
            if name in MESH and _few(bad, len(values)):
                found.append(_dropped(name, bad, told))
                continue
            part = 2 * len(bad) < len(values)
            remedy = "" if part else "the channel was not recorded"
            found.append(Finding("not-finite", name, float(len(bad)), "row", told, remedy, True, part, rows=some))
        elif name in MESH and (far := float(np.max(np.abs(values), initial=0.0))) > FARTHEST:
            told = f"goes to {far:.3g} rad, {far / (2.0 * np.pi):.3g} revolutions: no angle of a gear"
            found.append(Finding("too-large", name, far, "rad", told, "correct the unit or the decoder", True))
        elif name in MESH and (bad := _zeros(values)).size:
            told = (
                f"{len(bad)} of {len(values)} rows are zero although the rows around them are not, first row {bad[0]}"
            )
            found.append(_dropped(name, bad, told, not _few(bad, len(values))))
    return found


def _dropped(name: str, rows: np.ndarray, told: str, fatal: bool = False) -> Finding:
    some = tuple(map(int, rows[:20]))
    remedy = "check for poor electrical contact or interference"
    return Finding(DROPPED, name, float(len(rows)), "row", told, remedy, fatal, True, rows=some)


def _few(rows: np.ndarray, total: int) -> bool:
    """Return whether rows are few and single, so that their loss can be neglected."""
    if len(rows) > FEW or len(rows) > SHARE * total:
        return False
    return not bool(np.any(rows[LONGEST:] - rows[:-LONGEST] == LONGEST))


def _zeros(values: np.ndarray) -> np.ndarray:
    """Return single rows that are exactly zero, while the readings before and after agree far from zero."""
    at = np.flatnonzero(values == 0.0)
    if not at.size or 10 * len(at) > len(values):
        return at[:0]
    sound = np.flatnonzero(np.isfinite(values) & (values != 0.0))
    after = np.searchsorted(sound, at)
    inside = (after >= 2) & (after < len(sound) - 1)
    at, after = at[inside], after[inside]
    one, other = values[sound[after - 1]], values[sound[after]]
    step = np.abs(one - values[sound[after - 2]]) + np.abs(values[sound[after + 1]] - other)
    near = sound[after] - sound[after - 1] - 1 <= LONGEST
    away = np.minimum(np.abs(one), np.abs(other)) > FAR * (np.abs(other - one) + step)
    return at[near & away & (one * other > 0.0)]


REMEDIES = {
    "illegal-transitions": "sample faster, or check thresholds and cables",
    "lost-counts": "check thresholds and cables: counts between index marks differ",
    "lost-pulses": "check the threshold of the tacho",
    "repeated-stamps": "debounce the input, or check the logger",
    "large-steps": "sample faster, or use a counter with more bits",
    "drift": "record an angle: an integrated speed drifts",
}


def examine_decoded(meta: Mapping[str, Any]) -> list[Finding]:
    """Find what a decoder noted that is wrong with a channel.

    >>> note = {"kind": "lost-pulses", "channel": "T", "size": 2.0, "unit": "", "text": "2 missing", "harmless": False}
    >>> [(one.kind, one.channel, one.size) for one in examine_decoded({"decoded": [note, {**note, "harmless": True}]})]
    [('lost-pulses', 'T', 2.0)]
    """
    notes = meta.get("decoded", [])
    return [
        Finding(
            str(note["kind"]),
            str(note.get("channel", "")),
            float(note.get("size", 0.0)),
            str(note.get("unit", "")) or "1",
            str(note.get("text", "")),
            REMEDIES.get(note["kind"], ""),
        )
        for note in (notes if isinstance(notes, list) else [])
        if isinstance(note, Mapping) and note.get("kind") and not note.get("harmless", True)
    ]


# Rows that are looked for in the other record.
SNIPPET = 200
# Rows in common from which on two records overlap.
FEWEST = 1000
# Changes are the same when they differ by no more [rad].
SAME = 1e-9


def examine_copies(channels: Channels, others: Iterable[Channels]) -> list[Finding]:
    """Find records among others that hold the same readings.

    >>> rows = np.random.default_rng(1).normal(size=5000)
    >>> one = Channels({"time_s": np.arange(5000.0), "theta_loose_rad": rows}, "a.csv")
    >>> late = Channels({"time_s": np.arange(5000.0) + 7.0, "theta_loose_rad": rows + 1.0}, "b.csv")
    >>> [finding.kind for finding in examine_copies(late, [one])], examine_copies(one, [])
    (['duplicated-file'], [])
    """
    found = []
    for other in others:
        common = _common(channels.columns, other.columns)
        if common is None:
            continue
        rows, late = common
        whole = rows == len(channels.columns["time_s"])
        told = f"{'all' if whole else rows} of its rows are identical to those of {other.file or 'an earlier file'}"
        told += f", {late:.9g} s later" if late else ""
        remedy = "name each record once: repeated records make all confidence intervals too narrow"
        found.append(Finding("duplicated-file", "", float(rows), "row", told, remedy, True, True))
    return found


def _common(one: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> tuple[int, float] | None:
    """Return how many rows are the same and how much later they are in the first."""
    names = [name for name in MESH if name in one and name in other] or sorted((one.keys() & other.keys()) - {"time_s"})
    if not names or "time_s" not in one or "time_s" not in other:
        return None
    mine, its = ([np.diff(columns[name]) for name in names] for columns in (one, other))
    for shift in _shifts(mine[-1], its[-1]):
        first, last = max(-shift, 0), min(len(mine[0]), len(its[0]) - shift)
        if last - first + 1 < min(FEWEST, len(one["time_s"])):
            continue
        same = (a[first:last] - b[first + shift : last + shift] for a, b in zip(mine, its, strict=True))
        if all(np.abs(off).max(initial=0.0) < SAME for off in same):
            return last - first + 1, float(one["time_s"][first] - other["time_s"][first + shift])
    return None


def _shifts(mine: np.ndarray, its: np.ndarray) -> list[int]:
    """Return by how many rows a snippet of one lies elsewhere in the other."""
    shifts = [0]
    for part in (0.1, 0.5, 0.9):
        start = int(part * max(len(mine) - SNIPPET, 0))
        snippet = mine[start : start + SNIPPET]
        if len(snippet) < 20 or len(its) < len(snippet) or not np.abs(snippet).max() > SAME:
            continue
        at = np.arange(len(its) - len(snippet) + 1)
        for k in np.argsort(-np.abs(snippet - np.median(snippet)), kind="stable"):
            at = at[np.abs(its[at + k] - snippet[k]) < SAME]
            if len(at) < 2:
                break
        shifts += [int(found) - start for found in at[:3]]
    return list(dict.fromkeys(shifts))


def examine_order(view: View) -> list[Finding]:
    """Find rows given twice and times that do not rise."""
    if np.all(view.time[1:] > view.time[:-1]):
        return []
    found = []
    twice = _twice(view.columns, view.used)
    columns = view.columns
    if 2 * np.count_nonzero(twice) > np.count_nonzero(np.diff(view.time) == 0.0):  # else the stamps are coarse
        rows = np.flatnonzero(twice)
        told = f"{len(rows)} rows repeat the row before with its time, at {when(view.time, rows)}"
        some = tuple(map(int, rows[:20]))
        found.append(Finding("duplicates", "time_s", float(len(rows)), "row", told, "", True, True, rows=some))
        columns = {name: values[~twice] for name, values in columns.items()}
    return found + _disorder(columns["time_s"])


def correct_order(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Exclude repeated rows, add wraps, sort rows, space equal stamps evenly."""
    kind, size = findings[0].kind, findings[0].size
    if kind == "duplicates":
        keep = ~_twice(columns, list(columns))
        return {name: values[keep] for name, values in columns.items()}
    time = columns["time_s"]
    if kind == "time-order":
        order = np.argsort(time, kind="stable")
        return {name: values[order] for name, values in columns.items()}
    if kind == "time-wrap":
        falls = np.concatenate([[0], np.cumsum(np.diff(time) < -0.5 * size)])
        return {**columns, "time_s": time + size * falls}
    return {**columns, "time_s": _even(time)}


def _twice(columns: dict[str, np.ndarray], names: list[str]) -> np.ndarray:
    """Return which rows are equal to the row before, (n,)."""
    same = np.zeros(len(columns["time_s"]), bool)
    same[1:] = np.diff(columns["time_s"]) == 0.0
    at = np.flatnonzero(same)
    for name in names:
        at = at[columns[name][at] == columns[name][at - 1]]
    same[:] = False
    same[at] = True
    return same


def _disorder(time: np.ndarray) -> list[Finding]:
    steps = np.diff(time)
    falls = np.flatnonzero(steps < 0.0) + 1
    rows = tuple(map(int, falls[:20]))
    if not falls.size or (found := _jittered(time, steps, rows)):
        return found if falls.size else _coarse(time, steps)
    rising = steps[steps > 0.0]
    step = float(np.median(rising)) if rising.size else 0.0
    if (wrap := _wrap(time, falls, step)) is not None:
        told = f"decreases by {wrap[0]:.9g} s, {wrap[1]}, {len(falls)} times, first in row {rows[0]}"
        return [Finding("time-wrap", "time_s", wrap[0], "s", told, "", True, True, rows=rows)]
    back = float(-steps.min())
    told = f"decreases {len(falls)} times, by at most {back:.6g} s, first in row {rows[0]} at {time[rows[0]]:.9g} s"
    order = np.argsort(time, kind="stable")
    ordered = np.diff(time[order])
    moved = int(np.abs(order - np.arange(len(order))).max())
    even = ordered.min() > 0.0 and np.mean(np.abs(ordered - np.median(ordered)) < 0.5 * np.median(ordered)) > 0.99
    if moved <= LOCAL and even:
        told += f"; sorted by time the rows are evenly spaced, the largest move is {moved}"
        return [Finding("time-order", "time_s", back, "s", told, "", True, True, rows=rows)]
    remedy = "split the file there: it probably contains several records"
    return [Finding("time-not-rising", "time_s", back, "s", told, remedy, True, rows=rows)]


def _wrap(time: np.ndarray, falls: np.ndarray, step: float) -> tuple[float, str] | None:
    """Return the span of a clock that starts again, and how it was known."""
    span = time[falls - 1] + step - time[falls]
    width = float(np.median(span))
    inside = float(time.max() - time.min()) <= width * (1.0 + 1e-9) + step
    if not inside or np.ptp(span) > 1.5 * step or width < 20.0 * step:
        return None
    for whole in ROUND:
        if abs(width - whole) < 1.5 * step:
            return whole, f"as of a clock that restarts after {whole:.0f} s"
    for tick in (*TICKS, step):
        for bits in BITS:
            if abs(width - tick * 2.0**bits) < 1.5 * step:
                return tick * 2.0**bits, f"2^{bits} ticks of {tick:.6g} s"
    return None


def _coarse(time: np.ndarray, steps: np.ndarray) -> list[Finding]:
    """Find stamps that are constant for some rows."""
    still = np.flatnonzero(steps <= 0.0) + 1
    if not still.size:
        return []
    tick = float(steps[steps > 0.0].min(initial=np.inf))
    off = float(np.abs(time - _even(time)).max())
    rows = tuple(map(int, still[:20]))
    told = f"{len(still)} rows have the time of the row before, but other angles, first row {rows[0]}"
    if np.isfinite(tick) and off < 1.5 * tick:
        told += f"; time stamps have a resolution of {tick:.6g} s and deviate from even spacing by at most {off:.3g} s"
        return [Finding("time-stamps", "time_s", tick, "s", told, "", True, True, rows=rows)]
    return [
        Finding(
            "time-not-rising",
            "time_s",
            float(len(still)),
            "row",
            told,
            "record time stamps with a finer resolution",
            True,
            rows=rows,
        )
    ]


def _jittered(time: np.ndarray, steps: np.ndarray, rows: tuple[int, ...]) -> list[Finding]:
    """Find stamps whose jitter about a straight line is so large that neighbours are interchanged."""
    step = float(np.median(steps))
    if step <= 0.0 or -float(steps.min()) > step:
        return []
    off = time - _even(time)
    if float(np.abs(off).max()) > 2.0 * step:
        return []
    rms = float(np.std(off))
    told = f"time stamps have a jitter of {rms:.3g} s rms, {rms / step:.0%} of the sampling interval, so that some "
    told += f"decrease, first in row {rows[0]}"
    return [Finding("time-stamps", "time_s", rms, "s", told, "", True, True, rows=rows)]


def _even(time: np.ndarray) -> np.ndarray:
    """Return the straight line through the stamps, a row a step, [s], (n,)."""
    row = np.arange(len(time), dtype=float)
    slope, start = np.polyfit(row - row.mean(), time, 1)
    return start + slope * (row - row.mean())


# Part of the steps that must be equal for rows to be samples and not events.
EVEN = 0.9
# Jitter, in steps, from which it is reported.
JITTER = 0.02
# Width of a gap in steps, and its excess over a step in standard deviations of the steps.
WIDE, SURE = 1.6, 6.0


def examine_spacing(view: View) -> list[Finding]:
    """Find gaps in the time base and jitter."""
    steps, step = some_steps(view.time), view.spacing
    if np.mean(np.abs(steps - step) < 0.4 * step) < EVEN:
        return []
    spread = robust_deviation(steps - step)
    widest = max(WIDE * step, step + SURE * spread)
    return [*_gaps(view, step, widest), *_jitter(view, steps, step, widest)]


def _gaps(view: View, step: float, widest: float) -> list[Finding]:
    wide = np.concatenate([first + np.flatnonzero(steps > widest) for first, steps in changes(view.time)])
    if not wide.size:
        return []
    length = view.time[wide + 1] - view.time[wide]
    lost = np.round(length / step - 1.0)
    longest = float(length.max())
    told = f"{lost.sum():.0f} rows of {len(view.time) + lost.sum():.0f} are missing in {len(wide)} gaps, "
    told += f"the longest is {longest:.6g} s, at {when(view.time, wide)}"
    rows = tuple(map(int, wide[:20] + 1))
    return [Finding("gaps", "time_s", longest, "s", told, "flights across a gap are not observed", rows=rows)]


def _jitter(view: View, steps: np.ndarray, step: float, widest: float) -> list[Finding]:
    off = steps[steps < widest] - step
    rms = float(np.sqrt(np.mean(off**2) / 2.0))
    if rms < JITTER * step:
        return []
    ticks = float(np.ptp(off)) < 2.5 * float(np.abs(off)[np.abs(off) > 0.01 * step].min(initial=np.inf))
    told = (
        f"time stamps have a jitter of {rms:.3g} s rms ({rms / step:.1%} of a step), at most {np.abs(off).max():.3g} s"
    )
    told += ", as from rounding to too few digits" if ticks else ""
    if view.declared.radii is not None and view.angles:
        name, angle = next(iter(view.angles.items()))
        radius = view.declared.radii[0 if "drive" in name else 1]
        speed = abs(float(angle[-1] - angle[0]) / max(float(view.time[-1] - view.time[0]), 1e-300)) * radius
        told += f": {1e6 * speed * rms:.3g} um along the line of action"
    return [
        Finding(
            "jitter", "time_s", rms, "s", told, "if sampling was uniform, give the sampling rate instead of time stamps"
        )
    ]


# The unit of time follows from the sampling interval or from the motion: a drive whose relative fluctuation is the
# declared one, but which is 1000 times slower, has its time in milliseconds.
UNITS = {"milliseconds": 1e3, "microseconds": 1e6, "nanoseconds": 1e9, "minutes": 1.0 / 60.0, "hours": 1.0 / 3600.0}
# Part by which the rate of a file and that of a rig may differ.
CONTRADICTS = 0.1
# How near a factor must be to that of a unit.
CLOSE = 0.02
# The same where the motion is the only evidence, as a ratio; 60 is near the 57.3 of an angle in degrees.
MEANT = {"milliseconds": 1.3, "microseconds": 1.3, "nanoseconds": 1.3, "minutes": 1.02, "hours": 1.3}
# Upper limit of a speed [rad/s]; the square of a larger one overflows.
MOST = 1e100
NODES = 20_000
# Change of an angle over its range from which it counts as a wrap.
WRAP = 0.25


def examine_unit(view: View) -> list[Finding]:
    """Find time in another unit than seconds, or counted in rows.

    The step must fit the declared sample rate and, where the mean speed is declared, the speed that follows, too: a
    factor that only one of them shows does not suffice. Even times of another rate than declared are reported.
    """
    rate, step, stated = view.declared.sample_rate, view.spacing, view.declared.stated_rate
    if rate and stated and abs(stated / rate - 1.0) > CONTRADICTS:
        told = f"the file states a sampling rate of {stated:.6g} Hz, the rig declares {rate:.6g} Hz"
        remedy = f'give sensors.sample_rate = "{stated:.6g} Hz" in the rig or below [condition] if the file is right'
        return [Finding("sample-rate", "time_s", stated / rate, "1", told, remedy, True)]
    if rate is None or step <= 0.0:
        return _by_motion(view)
    for what, factor in (("row numbers", rate), *UNITS.items()):
        if abs(step * rate / factor - 1.0) > CLOSE or not _speed_fits(view, factor):
            continue
        told = f"the sampling interval is {step:.6g}, at {rate:.6g} Hz it is {1.0 / rate:.6g} s: time is in {what}"
        remedy = "or give sensors.sample_rate if this sampling interval is right"
        return [Finding("time-unit", "time_s", factor, "1", told, remedy, True, True)]
    return _by_motion(view) or _other_rate(view, rate)


def _other_rate(view: View, rate: float) -> list[Finding]:
    """Find an even time of another sampling rate than declared [Hz]; times of edges follow the speed and have none."""
    step, steps = view.spacing, some_steps(view.time)
    if abs(step * rate - 1.0) <= CONTRADICTS or np.mean(np.abs(steps - step) < 0.4 * step) < EVEN:
        return []
    own = 1.0 / step
    told = f"its steps of {step:.6g} s make {own:.6g} Hz, the rig declares a sampling rate of {rate:.6g} Hz"
    told += "; the times of the file are used"
    remedy = f"--set 'sensors.sample_rate={own:.6g} Hz' (or the same below [condition]) if these are right, else "
    remedy += "correct unit or sample_rate below [time] of a record.toml"
    return [Finding("sample-rate", "time_s", own / rate, "1", told, remedy)]


def correct_unit(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Put time into seconds."""
    return {**columns, "time_s": columns["time_s"] / findings[0].size}


def speed_ratio(view: View) -> float | None:
    """Return how many times faster than declared the drive turns, where it moves as unevenly as declared.

    Returns the ratio; ``None`` where no speed is stated, or the record's fluctuation is another than a stated one.
    """
    about, name = view.declared, MESH[0]
    if about.mean_speed is None or name not in view.angles or not about.meshed or len(view.time) < 4:
        return None
    angle = view.angles[name]
    if angle.dtype.kind not in "fiu" or not np.isfinite(angle.sum()):
        return None
    at = np.unique(np.linspace(0, len(angle) - 1, min(NODES, len(angle))).astype(np.intp))
    way, gone, widest = np.zeros(len(at)), 0.0, WRAP * float(np.ptp(angle))
    for first, change in view.changes(name):
        until = gone + np.cumsum(np.where(np.abs(change) > widest, 0.0, change))
        mine = (at > first) & (at <= first + len(change))
        way[mine] = until[at[mine] - first - 1]
        gone = float(until[-1])
    speed = np.diff(way) / np.diff(view.time[at])
    lasts = float(view.time[-1] - view.time[0])
    mean, whole = float(way[-1]) / lasts, float(np.sqrt(np.mean(speed**2)))
    if not about.harmonics:
        return abs(mean / about.mean_speed) if about.mean_speed and abs(mean) > 0.2 * whole else None
    declared = np.hypot(about.mean_speed, about.fluctuation / np.sqrt(2.0))
    if not 0.0 < whole < MOST or declared <= 0.0:
        return None
    uneven = np.sqrt(max(whole**2 - mean**2, 0.0)) / whole
    stated = about.fluctuation / np.sqrt(2.0) / declared
    return whole / float(declared) if 0.5 * stated < uneven < 2.0 * stated or stated == 0.0 else None


def _by_motion(view: View) -> list[Finding]:
    """Find time in another unit from the speed of the drive; at constant declared speed the interval must agree."""
    ratio, rate = speed_ratio(view), view.declared.sample_rate
    if ratio is None:
        return []
    for what, factor in UNITS.items():
        close = MEANT[what]
        if not 1.0 / close < ratio * factor < close:
            continue
        steady = view.declared.harmonics and view.declared.fluctuation == 0.0
        if steady and not (rate and 1.0 / 30.0 < view.spacing * rate / factor < 30.0):
            continue
        told = f"the drive turns {ratio:.4g} times as fast as the rig declares, as unevenly: time is in {what}"
        remedy = "or give the true speed as motion.mean under [condition]"
        return [Finding("time-unit", "time_s", factor, "1", told, remedy, True, True)]
    return []


def _speed_fits(view: View, factor: float) -> bool:
    """Return whether the drive turns at its declared speed once time is divided by the factor; true when unknown."""
    mean, angle = view.declared.mean_speed, view.angles.get("theta_drive_rad")
    if mean is None or angle is None or abs(mean) <= 0.2 * view.declared.fluctuation or not view.declared.meshed:
        return True
    speed = abs(float(angle[-1] - angle[0]) / float(view.time[-1] - view.time[0])) * factor
    return 0.3 < speed / abs(mean) < 3.0
