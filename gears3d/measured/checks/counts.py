"""Counts of encoders: how many there are, where they start again, edges of a gear that were merged or doubled."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.measured.checks.columns import EVEN
from gears3d.measured.checks.view import Finding, View, when
from gears3d.signals import noise_of, some_steps

# Relative deviation of counts found from the declared ones, at most.
CLOSE = 1e-3
# Relative deviation up to which it is a wrong number of lines, not lines taken for edges.
ALIKE = 0.1
# Part of the backlash: records with more noise were never segmented.
NOISY = 0.06
# Rows in which the noise of the displacement is measured.
FIRST = 1 << 18
# Noise in counts that may be due to rounding alone.
ROUNDING = 0.65
TIMES = (2.0, 4.0, 8.0, 0.5, 0.25, 0.125)
# Index marks contradict a count by more than what so many rows turn in all, and by so many counts a revolution: a mark
# stands at the row after its edge, and a few counts may be lost.
ROWS, COUNTS = 3.0, 2.0


def examine_counts(view: View) -> list[Finding]:
    """Find encoders that count otherwise than declared, and noise that fills the backlash."""
    found = [finding for name in view.angles for finding in (*_between_marks(view, name), *_counts(view, name))]
    return [*found, *_noise(view)]


def otherwise(view: View, name: str) -> str:
    """Return as text that an angle comes in slightly other counts than declared, empty where it does not."""
    declared, count = view.declared.counts.get(name), view.quanta[name]
    seen = 2 * np.pi / count if count else 0.0
    if declared is None or not CLOSE < abs(seen / declared - 1.0) < ALIKE:
        return ""
    return f"{name} was made with {seen:.6g} counts per revolution, the rig declares {declared:.6g}"


def _between_marks(view: View, name: str) -> list[Finding]:
    """Find a count that index marks contradict: between two of them is one true revolution."""
    seen = view.declared.marks.get(name)
    turns = float(np.ptp(view.angles[name])) / (2 * np.pi)
    if seen is None or turns < 1.0:
        return []
    count = view.quanta[name] or 0.0
    row = float(np.quantile(np.abs(view.some_changes(name)), 0.99))
    error = (ROWS * max(row, count) / turns) / (2 * np.pi)
    if abs(seen - 1.0) < max(error, COUNTS * count / (2 * np.pi)):
        return []
    gear, declared = name.split("_")[1], view.declared.counts.get(name)
    told = (
        f"index marks are {seen:.6g} (± {error:.2g}) revolutions of the angle apart: its count per revolution is wrong"
    )
    remedy = f"multiply the {gear} angle by {1.0 / seen:.7g} ({1.0 / (seen + error):.7g} to {1.0 / (seen - error):.7g})"
    if declared is not None:
        true, spread = declared * seen, declared * error
        remedy = f"[{gear}] counts_per_revolution = {true:.6g} instead of {declared:.6g} "
        remedy += f"({true - spread:.6g} to {true + spread:.6g})"
    remedy += ', or zero = "arbitrary" where the encoder is not on the shaft of the gear'
    return [Finding("counts", name, seen, "1", told, remedy, True)]


def _counts(view: View, name: str) -> list[Finding]:
    declared, count = view.declared.counts.get(name), view.quanta[name]
    if declared is None:
        return []
    if count is None:
        return _unseen(view, name, declared)
    seen = 2 * np.pi / count
    if abs(seen / declared - 1.0) < CLOSE or _written(count, 2 * np.pi / declared):
        return []
    told = f"changes in steps of {count:.6g} rad, {seen:.6g} counts per revolution; declared are {declared:.6g}"
    for times in TIMES:
        if abs(seen / declared / times - 1.0) < CLOSE:
            what = f"{times:.0f} times as many" if times > 1.0 else f"one in {1.0 / times:.0f}"
            told += f": {what}, as where lines and edges are confused"
    return [Finding("counts", name, seen, "1", told, "correct sensors.*.counts_per_revolution or the map")]


def _unseen(view: View, name: str, declared: float) -> list[Finding]:
    """Find angles that are not multiples of a count although counts are declared and large enough to show."""
    step = 2 * np.pi / declared
    rounding = 1e-13 * float(np.abs(view.angles[name]).max(initial=0.0))
    moving = np.abs(view.some_changes(name)) > 10.0 * rounding
    if rounding > 1e-3 * step or np.count_nonzero(moving) < 100:
        return []
    told = f"shows no counts although {declared:.6g} per revolution are declared: filtered, resampled or interpolated"
    return [Finding("counts", name, 0.0, "1", told, "record the raw counter")]


def _written(count: float, declared: float) -> bool:
    """Return whether steps are those of digits in a file, finer than the counts."""
    digits = np.log10(count)
    return count < 0.5 * declared and abs(digits - np.round(digits)) < 1e-3


def _noise(view: View) -> list[Finding]:
    declared = view.declared
    if not declared.meshed or declared.radii is None or declared.backlash is None or len(view.angles) < 2:
        return []
    noise = {name: view.noise[name] for name in view.angles}
    beyond = [one if one > ROUNDING * (view.quanta[name] or 0.0) else 0.0 for name, one in noise.items()]
    length = float(np.hypot(beyond[0] * declared.radii[0], beyond[1] * declared.radii[1]))
    if length >= NOISY * declared.backlash:  # jitter of a clock that both encoders share is not in their difference
        drive, loose = (radius * view.angles[f"theta_{name}_rad"][:FIRST]
                        for name, radius in zip(("drive", "loose"), declared.radii, strict=True))  # fmt: skip
        way = np.sign((drive[-1] - drive[0]) * (loose[-1] - loose[0]))
        length = min(length, noise_of(view.time[:FIRST], loose - way * drive, clip=4.0))
    if length < NOISY * declared.backlash:
        return []
    told = f"noise of the readings is {1e6 * length:.3g} um along the line of action, "
    told += f"{length / declared.backlash:.0%} of the backlash ("
    told += ", ".join(f"{name}: {one:.3g} rad" for name, one in noise.items()) + ")"
    return [Finding("noise", "", length, "m", told, "check couplings, or use encoders with a finer resolution")]


# Ratio of a wrap to the motion of the gear per row, at least.
FASTER = 20.0
WIDTHS = {"a turn": 2 * np.pi, "half a revolution": np.pi, "360 deg": 360.0, "1 revolution": 1.0}
BITS = range(8, 49)


def examine_wraps(view: View) -> list[Finding]:
    """Find angles that wrap at a revolution, or at a power of two of their counts."""
    found = []
    for name in view.angles:
        usual = float(np.quantile(np.abs(view.some_changes(name)), 0.99))
        least = FASTER * max(usual, 1e-12)
        far = np.concatenate([first + np.flatnonzero(np.abs(change) > least) for first, change in view.changes(name)])
        if not far.size:
            continue
        wide = np.abs(view.angles[name][far + 1] - view.angles[name][far]) + usual * 0.5
        width, what = _width(float(np.median(wide)), usual, view.quanta[name])
        angle = view.angles[name]
        if not what or np.ptp(wide) > 3.0 * usual or float(np.ptp(angle)) > width + 3.0 * usual:
            continue
        told = f"jumps {len(far)} times by {what}, at {when(view.time, far)}"
        rows = tuple(map(int, far[:20] + 1))
        found.append(Finding("angle-wrap", name, width, "rad", told, "", True, True, rows=rows))
    return found


def correct_wraps(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Unwrap the angles."""
    corrected = dict(columns)
    for finding in findings:
        angle = columns[finding.channel]
        turns = np.round(np.diff(angle, prepend=angle[0]) / finding.size)
        corrected[finding.channel] = angle - finding.size * np.cumsum(turns)
    return corrected


def _width(seen: float, slack: float, count: float | None) -> tuple[float, str]:
    """Return the width of the wrap that a jump is and its name, empty without one."""
    for what, width in WIDTHS.items():
        if abs(seen - width) < 2.0 * slack + 1e-6 * width:
            return width, what
    for unit, what in ((count or 0.0, "counts"), (1.0, "")):
        for bits in BITS if unit > 0.0 else ():
            if abs(seen - unit * 2.0**bits) < 2.0 * slack:
                return unit * 2.0**bits, f"2^{bits} {what}".strip()
    return 0.0, ""


# A row of such a record is an edge, or the moment just before one; a missing edge is a permanent error of one count,
# which the times between edges show and changes from row to row do not.

# Times between edges to either side that show the usual time.
REACH = 4
# Part of the changes that must be one count, for rows to be edges.
WHOLE = 0.99
# Ratio of a time between edges to the usual one from which an edge is missing.
LONGER = 1.6
# Distance of its logarithm from those of its neighbours, in their range.
WIDE = 2.5
# How near the logarithm of a time must be to that of whole usual ones; how much neighbours may differ for that.
NEAR, STEADY = 0.15, 0.12
# Places that can be corrected one by one; an encoder with more of them cannot be used.
TOLD = 20
# Part of the backlash from which on lost or additional edges falsify flights.
TORN = 0.1


class Marks(NamedTuple):
    """The edges of one gear.

    Args:
        row: at which the angle has changed, (k,).
        time: [s], (k,).
        sense: of the change, (k,).
        count: angle between two [rad].
    """

    row: np.ndarray
    time: np.ndarray
    sense: np.ndarray
    count: float


def examine_edges(view: View) -> list[Finding]:
    """Find edges of a gear that were stamped as one, or twice."""
    found = []
    for name in view.angles:
        marks = marks_of(view, name)
        if marks is None or len(marks.row) < 4 * REACH:
            continue
        for kind, what, (place, missing) in (
            ("merged-edges", "too long for one count: edges are missing", _merged(marks)),
            ("doubled-edges", "divided by an additional edge: the signal bounced", _doubled(marks)),
        ):
            if len(place):
                found.append(_told(view, name, kind, what, marks, place, missing))
    return found


def correct_edges(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Restore or remove counts from the row on in which they were lost or added."""
    corrected = dict(columns)
    for finding in findings:
        angle = corrected[finding.channel].copy()
        for row in finding.rows:
            angle[row:] += finding.parameters[f"row_{row}"]
        corrected[finding.channel] = angle
    return corrected


def marks_of(view: View, name: str) -> Marks | None:
    """Return the edges of a gear, ``None`` where rows are samples."""
    if view.spacing <= 0.0:
        return None
    some = np.abs(view.some_changes(name))
    steps = some_steps(view.time)
    even = np.mean(np.abs(steps - view.spacing) < 0.4 * view.spacing) >= EVEN
    moved = some > 0.0
    if not moved.any() or (even and not moved.all()):
        return None
    count = float(np.median(some[moved]))
    if np.mean(np.abs(some[moved] / count - 1.0) < 1e-3) < WHOLE:
        return None
    pieces = [(first + np.flatnonzero(change), change[change != 0.0]) for first, change in view.changes(name)]
    row = np.concatenate([rows for rows, _ in pieces]) + 1
    return Marks(row, view.time[row], np.sign(np.concatenate([change for _, change in pieces])), count)


def _around(length: np.ndarray, first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the logarithm of what is usual about stretches of times, and how far neighbours are off their trend."""
    reach = np.arange(1, REACH + 1)
    near = np.concatenate([length[first[:, None] - reach[::-1]], length[last[:, None] + reach]], axis=1)
    place = np.concatenate([-reach[::-1], reach])
    middle = near.mean(axis=1)
    slope = (near - middle[:, None]) @ place / float(place @ place)
    return middle, np.ptp(near - slope[:, None] * place, axis=1)


def _one_way(marks: Marks, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Return whether the gear turns one way all around stretches of times."""
    turned = np.concatenate([[0], np.cumsum(np.diff(marks.sense) != 0.0)])
    return turned[first - REACH] == turned[last + REACH + 1]


def _merged(marks: Marks) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of the edges before which others are missing, and how many."""
    with np.errstate(divide="ignore"):
        length = np.log(np.diff(marks.time))
    long = np.arange(REACH, len(length) - REACH)
    long = long[length[long] > np.maximum(length[long - 1], length[long + 1]) + np.log(LONGER)]
    usual, spread = _around(length, long, long)
    beyond = length[long] - usual
    whole = np.round(np.exp(beyond))
    near = np.abs(beyond - np.log(np.maximum(whole, 1.0))) < NEAR
    sure = (whole > 1.0) & near & (beyond > WIDE * spread) & _one_way(marks, long, long)
    return long[sure] + 1, whole[sure] - 1.0


def _doubled(marks: Marks) -> tuple[np.ndarray, np.ndarray]:
    """Return the numbers of the edges that are too many, and minus one for each."""
    step = np.diff(marks.time)
    first = np.arange(REACH, len(step) - REACH - 1)
    both = step[first] + step[first + 1]
    first = first[both < LONGER * np.minimum(step[first - 1], step[first + 2])]
    with np.errstate(divide="ignore"):
        length = np.log(step)
    usual, spread = _around(length, first, first + 1)
    with np.errstate(invalid="ignore"):
        off = np.abs(np.log(step[first] + step[first + 1]) - usual)
        sure = (off < NEAR) & (spread < STEADY) & _one_way(marks, first, first + 1)
    first, off = first[sure], off[sure]
    run = np.cumsum(np.diff(first, prepend=first[:1] - 9) > 2)  # an edge too many makes two pairs that are too short
    best = np.array([np.flatnonzero(run == one)[np.argmin(off[run == one])] for one in np.unique(run)], int)
    return first[best] + 1, np.full(len(best), -1.0)


def _told(view: View, name: str, kind: str, what: str, marks: Marks, place: np.ndarray, missing: np.ndarray) -> Finding:
    off = missing * marks.count * marks.sense[place]
    worst = float(np.abs(np.cumsum(off)).max())
    many = len(place) > TOLD
    told = f"{len(place)} intervals between edges are {what}, at {when(marks.time, place)}; error of the angle up to "
    told += f"{worst:.4g} rad ({worst / marks.count:.0f} counts)"
    fatal, declared = many, view.declared
    if declared.meshed and declared.radii is not None and declared.backlash is not None:
        moved = worst * declared.radii[0 if "drive" in name else 1]
        fatal |= moved > TORN * declared.backlash
        told += f": permanent shift of the backlash by {1e6 * moved:.3g} um"
    rows = tuple(map(int, marks.row[place[:TOLD]]))
    numbers = {f"row_{row}": float(one) for row, one in zip(rows, off, strict=False)}
    remedy = "check threshold and hysteresis of the edge detection"
    return Finding(kind, name, worst, "rad", told, remedy, fatal, not many, rows=rows, parameters=numbers)
