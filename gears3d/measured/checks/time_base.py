"""Time base: order of rows, even steps, unit of seconds."""

from __future__ import annotations

import numpy as np

from gears3d.measured.checks.view import MESH, Finding, View, when
from gears3d.signals import changes, robust_deviation, some_steps

# Units that clocks count in [s].
TICKS = (1.0, 1e-3, 1e-6, 1e-7, 1e-8, 1e-9)
# Where clocks of minutes, hours and days restart [s].
ROUND = (60.0, 3600.0, 86400.0)
BITS = range(8, 65)
# Rows that are out of order by no more were written in blocks; further ones belong to another record.
LOCAL = 1000


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
    factor that only one of them shows does not suffice.
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
    return _by_motion(view)


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
