"""Readings that do not follow the gear: held, frozen or repeated ones, and jumps that are not motion of a gear."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gears3d.measured.checks.view import MESH, Declared, Finding, View, when

# Travel of one gear, in backlashes, from which a mate at standstill is not in mesh.
BANDS = 3.0
# Standard deviations of a change by which a gear must turn in a row for a change of nothing to be impossible.
SURE = 6.0
# Rows to either side from which the speed of a gear is estimated.
REACH = 12
MOST = 200_000
# Part of the rows in motion from which held readings are the update rate of a channel, not repeated samples.
SHARE = 0.005
# Runs of held rows of one channel that make a finding.
FEW = 10
# Counts by which a held reading changes at once; a gear slow enough to repeat a reading changes by one or two.
STEP = 2.5
# Longest hold over that of nearly all others, or, where updates come at random, the exponent of the probability
# 1 - e^-7 that the longest of their number is shorter.
LONGER, RARE = 3.0, 7.0
# Part of the updates at the same phase from which they are regular.
REGULAR = 0.99
# Ratio of such changes after no change to those after a change of one count, at least.
TIMES = 3.0


class Hold(NamedTuple):
    """Runs of rows that repeat the reading before them, ended by a change that no gear at rest makes.

    Args:
        first: the row whose reading is repeated, (k,).
        lasts: rows that repeat it, (k,).
    """

    first: np.ndarray
    lasts: np.ndarray


def examine_holds(view: View) -> list[Finding]:
    """Find channels that freeze while the mating gear turns, held readings, and rows that repeat the row before."""
    still = {name: _standing(view, name) for name in view.angles}
    frozen = [one for name, rows in still.items() for one in _frozen(view, name, rows)] if view.declared.meshed else []
    if frozen:
        return frozen
    held = [one for name, rows in still.items() for one in _held(view, name, rows)]
    return held or _repeated(view, still)


def correct_holds(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Interpolate held readings between the rows that were updated."""
    corrected = dict(columns)
    for finding in findings:
        angle, about = columns[finding.channel], finding.parameters
        count, every = about["count_rad"], int(about["every_rows"])
        still = np.flatnonzero(np.diff(angle) == 0.0)
        if every:
            held = np.zeros(len(angle), bool)
            held[still + 1] = (still + 1) % every != int(about["updated_row"])
        else:
            hold = _runs(angle, still, count)
            some = hold.lasts <= about["longest_rows"]
            mark = np.zeros(len(angle) + 1, int)
            np.add.at(mark, hold.first[some] + 1, 1)
            np.add.at(mark, hold.first[some] + hold.lasts[some] + 1, -1)
            held = np.cumsum(mark[:-1]) > 0
        time = columns["time_s"]
        own = np.interp(time[held], time[~held], angle[~held])
        if count:  # counts stay counts
            own = angle[held] + np.round((own - angle[held]) / count) * count
        corrected[finding.channel] = angle.copy()
        corrected[finding.channel][held] = own
    return corrected


def quietest(declared: Declared, findings: list[Finding]) -> Declared:
    """Return what is declared with the noise of readings that are held, which interpolated ones hide."""
    known = {one.channel: one.parameters["noise_rad"] for one in findings if one.kind == "held"}
    return replace(declared, noise={**declared.noise, **known}) if known else declared


def _runs(angle: np.ndarray, still: np.ndarray, count: float) -> Hold:
    """Return the runs of rows that repeat a reading and end with a change of more than two counts."""
    begins = np.flatnonzero(np.diff(still, prepend=-2) > 1)
    first, lasts = still[begins], np.diff(begins, append=len(still))
    whole = first + lasts + 1 < len(angle)
    first, lasts = first[whole], lasts[whole]
    large = np.abs(angle[first + lasts + 1] - angle[first]) > STEP * count
    return Hold(first[large], lasts[large])


def _held(view: View, name: str, still: np.ndarray) -> list[Finding]:
    """Find a channel whose readings are held between updates.

    Readings of a slow gear repeat, too, but then change by a count; noise of many counts repeats a reading as often as
    it changes it by one count.
    """
    angle, count = view.angles[name], view.quanta[name] or 0.0
    hold = _runs(angle, still, count)
    rows = int(hold.lasts.sum())
    if len(hold.first) < FEW or rows < SHARE * len(angle):
        return []
    if count:
        step = np.rint(np.diff(angle) / count)
        large = np.abs(step[1:]) > STEP
        alike = max(np.count_nonzero((step[:-1] == side) & large) for side in (-1.0, 1.0))
        if len(hold.first) < TIMES * alike + FEW:
            return []
    updates = len(angle) - 1 - len(still)
    typical = float(np.median(hold.lasts)) + 1.0
    every, row = _regular(still, len(angle), int(np.quantile(hold.lasts, 0.1)) + 1)
    share = 1.0 / every if every else updates / (updates + rows)
    rate, own = (0.0, 0.0) if not view.spacing else (share / view.spacing, 1.0 / view.spacing)
    told = f"readings are held between updates: {rows} of {len(angle)} rows repeat the one before although the gear "
    told += (
        f"rotates, {'regularly' if every else 'irregularly'}, at most {int(hold.lasts.max())} in a row; the channel "
    )
    told += f"is updated at {rate:.5g} Hz, rows come at {own:.5g} Hz"
    remedy = "or record at the rate of the encoder: what happens between updates is not measured"
    longest = 50.0 * typical  # a gear that stands at the ends of a record is not held
    about = {"count_rad": count, "longest_rows": longest, "noise_rad": _noise_of_updates(angle, still, count)}
    about |= {"every_rows": float(every), "updated_row": float(row)}
    some = tuple(map(int, hold.first[:20] + 1))
    return [Finding("held", name, rate, "Hz", told, remedy, False, True, rows=some, parameters=about)]


def _regular(still: np.ndarray, rows: int, every: int) -> tuple[int, int]:
    """Return every how many rows a channel is updated, and in which of them; 0 where it is not regular."""
    updated = np.ones(rows, bool)
    updated[still + 1] = False
    places = np.bincount(np.flatnonzero(updated[1:]) % every, minlength=every)
    row = int(np.argmax(places))
    return (every, (row + 1) % every) if places[row] > REGULAR * places.sum() else (0, 0)


def _noise_of_updates(angle: np.ndarray, still: np.ndarray, count: float) -> float:
    """Return the standard deviation of readings that were updated [rad]."""
    kept = np.ones(len(angle), bool)
    kept[still + 1] = False
    at = np.flatnonzero(kept)[:MOST]
    if len(at) < 3:
        return 0.0
    first, mid, last = at[:-2], at[1:-1], at[2:]
    share = (mid - first) / (last - first)
    bend = np.abs(angle[mid] - angle[first] - share * (angle[last] - angle[first]))
    bend /= np.sqrt(1.0 + share**2 + (1.0 - share) ** 2)
    usual = 1.4826 * max(float(np.median(bend)), 0.3 * count)
    return float(np.sqrt(np.mean(bend[bend <= 4.0 * usual] ** 2)))


def _standing(view: View, name: str) -> np.ndarray:
    """Return the rows after which an angle stands."""
    return np.concatenate([first + np.flatnonzero(step == 0.0) for first, step in view.changes(name)])


def _frozen(view: View, name: str, still: np.ndarray) -> list[Finding]:
    """Find the longest stretch in which a channel does not change although the other one moves far."""
    if view.declared.radii is None or view.declared.backlash is None or len(view.angles) < 2:
        return []
    other = next(one for one in view.angles if one != name)
    own, far = view.declared.radii if "drive" in other else view.declared.radii[::-1]
    begins = np.flatnonzero(np.diff(still, prepend=-2) > 1)
    lasts = np.diff(begins, append=len(still))
    if not len(lasts):
        return []
    usual, hold = 0.0, _runs(view.angles[name], still, view.quanta[name] or 0.0)
    if len(hold.first) >= FEW:
        middle, long = (float(one) for one in np.quantile(hold.lasts, [0.5, 0.95]))  # ln 10 apart if at random
        usual = max(LONGER * long, middle + (long - middle) * (np.log(len(hold.lasts)) + RARE) / np.log(10.0))
    reach = BANDS * view.declared.backlash + 10.0 * (own * view.noise[other] + far * view.noise[name])
    longest = np.argpartition(lasts, -min(5, len(lasts)))[-5:]
    for k in longest[np.argsort(-lasts[longest])]:
        first = int(still[begins[k]])
        last = first + int(lasts[k])
        moved = own * float(np.ptp(view.angles[other][first : last + 1])) if last > first else 0.0
        if moved > reach and last - first > usual:
            return [_told(view, name, first, last, moved)]
    return []


def _told(view: View, name: str, first: int, last: int, moved: float) -> Finding:
    angle, time = view.angles[name], view.time
    value = float(angle[first])
    lasting = float(time[last] - time[first])
    if last - first + 1 == len(time):
        told = f"is constant at {value:.9g} while the other gear rotates by {1e3 * moved:.3g} mm"
        remedy = "in mesh both gears rotate; evaluate a coast-down with `gears3d identify coastdown`"
        return Finding("frozen", name, lasting, "s", told, remedy, True, rows=(first, last))
    edge = value in (float(angle.max()), float(angle.min()))
    kind, how = ("saturated", "its extreme value,") if edge else ("frozen", "constant")
    told = f"stays at {value:.9g}, {how} from t = {time[first]:.6g} to {time[last]:.6g} s while the other gear rotates "
    told += f"by {1e3 * moved:.3g} mm"
    return Finding(kind, name, lasting, "s", told, "split the record there", True, rows=(first, last))


def _repeated(view: View, still: dict[str, np.ndarray]) -> list[Finding]:
    """Find rows in which no angle changes although a gear turns too fast for that."""
    at = None
    for rows in still.values():
        at = rows if at is None else np.intersect1d(at, rows, assume_unique=True)
    if at is None or not at.size:
        return []
    fast = np.zeros(len(at), bool)
    for name, angle in view.angles.items():
        low, high = np.maximum(at - REACH, 0), np.minimum(at + 1 + REACH, len(angle) - 1)
        speed = np.abs(angle[high] - angle[low]) / (high - low)
        fast |= speed > SURE * np.sqrt(2.0) * max(view.noise[name], 0.5 * (view.quanta[name] or 0.0))
    at = at[fast]
    if not at.size:
        return []
    told = f"{len(at)} rows repeat all angles of the row before although the gears rotate, at {when(view.time, at + 1)}"
    rows = tuple(map(int, at[:20] + 1))
    remedy = "the recorder repeated samples: record again, or delete these rows"
    return [Finding("repeated", "", float(len(at)), "row", told, remedy, rows=rows)]


# Standard deviations of a change from which it is examined.
JUMP = 7.0
# Excess of a jump over the changes around it, in their range.
WIDE = 1.5
# Rows to either side, without the next ones, that show the usual change.
AROUND = 6
# Jumps that are listed, and can be corrected, one by one.
TOLD = 20
# Jumps from which on their removal is tried.
REMOVED = 5
# Ranges of the displacement beyond which the sum of its jumps cannot be a fault: it would be seen in that range.
BEYOND = 1.5
# Backlashes within which gears in mesh stay: run-out of small ones adds as much, and the declared one may be wrong.
BANDS = 3.0
# Part of the backlash from which on a jump falsifies flights.
TORN = 0.1
# Rows to either side by which a jump is measured.
FITTED = 40
JUMPS_AT_ONCE = 50_000
# Counts by which an angle moves at once, at least, where readings are held: an encoder that is read at every row and
# stands still in most of them moves by one, seldom two.
HELD = 2.5
# Rows that are examined at a time.
AT_ONCE = 1 << 18


class Jumps(NamedTuple):
    """Jumps of one channel.

    Args:
        row: the first row after the jump, (k,).
        size: by how much the channel is off from then on [rad], (k,).
        usual: change in a row around it [rad], (k,).
        peak: how far it was off in between [rad], (k,).
        wide: rows that it took, (k,).
    """

    row: np.ndarray
    size: np.ndarray
    usual: np.ndarray
    peak: np.ndarray
    wide: np.ndarray


def examine_jumps(view: View) -> list[Finding]:
    """Find lost or extra counts, single outliers, and rows missing in both channels at once."""
    if (updates := _updates(view)) is not None:
        thin = View({name: values[updates] for name, values in view.columns.items()}, view.declared)
        return [
            replace(
                one, rows=tuple(int(updates[row]) for row in one.rows), evidence=f"{one.evidence} (update, not row)"
            )
            for one in examine_jumps(thin)
        ]
    jumps = {name: find(view, name) for name in view.angles}
    out = _missing_rows(view, jumps)
    skipped = {row for finding in out for row in finding.rows}
    found = list(out)
    for name, jump in jumps.items():
        some = np.array([row not in skipped for row in jump.row], bool)
        found += _of_channel(view, name, Jumps(*(column[some] for column in jump)))
    return found


def _updates(view: View) -> np.ndarray | None:
    """Return the rows with a new reading where a logger holds each reading for several rows; else ``None``.

    An angle that is held is constant and then moves by many counts, which is not a jump. The counts of a slow encoder
    are constant, too, but move by one.
    """
    moved = np.zeros(len(view.time), bool)
    for name, angle in view.angles.items():
        own = np.flatnonzero(angle[1:] != angle[:-1]) + 1
        if not own.size or 2 * own.size > len(moved):
            return None
        if np.median(np.abs(angle[own] - angle[own - 1])) < HELD * (view.quanta[name] or 0.0):
            return None
        moved[own] = True
    rows = np.flatnonzero(moved)
    if len(rows) < 2 * (AROUND + 2) or 2 * len(rows) > len(moved):
        return None
    low, middle, high = np.percentile(np.diff(rows), (10, 50, 90))
    return rows if middle >= 2.0 and high - low <= max(1.0, 0.2 * middle) else None


def correct_jumps(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Restore lost counts from the row on in which they were lost."""
    corrected = dict(columns)
    for finding in findings:
        angle = corrected[finding.channel].copy()
        angle[finding.rows[0] :] -= finding.size
        corrected[finding.channel] = angle
    return corrected


def find(view: View, name: str) -> Jumps:
    """Return where a channel jumps.

    A change is compared with the changes of some rows before and after it, without the next ones; an impact changes
    the speed and thereby their range, and is not a jump.
    """
    angle, count = view.angles[name], len(view.time) - 1
    least = JUMP * np.sqrt(2.0) * view.noise[name]
    bent = np.zeros(count + 1, bool)
    for first in range(0, count - 1, AT_ONCE):
        bend = np.diff(angle[first : first + AT_ONCE + 2], 2)
        bent[first + 1 : first + 1 + len(bend)] = np.abs(bend) > 0.7 * least
    at = np.flatnonzero(bent[1:] | bent[:-1])
    at = at[(at >= AROUND + 2) & (at < count - AROUND - 2)]
    around = np.concatenate([np.arange(-AROUND - 1, -1), np.arange(2, AROUND + 2)])
    rows, excess, usual = [], [], []
    for some in np.array_split(at, max(len(at) // JUMPS_AT_ONCE, 1)):
        near = angle[some[:, None] + around + 1] - angle[some[:, None] + around]
        low, high = near.min(axis=1), near.max(axis=1)
        middle = 0.5 * (np.median(near[:, :AROUND], axis=1) + np.median(near[:, AROUND:], axis=1))
        off = angle[some + 1] - angle[some] - middle
        gap = view.time[some + 1] - view.time[some] > 1.6 * view.spacing
        sure = (np.abs(off) > np.maximum(least, WIDE * (high - low))) & ~gap
        rows.append(some[sure])
        excess.append(off[sure])
        usual.append(middle[sure])
    return _joined(*(np.concatenate(parts) for parts in (rows, excess, usual)))


def _joined(rows: np.ndarray, excess: np.ndarray, usual: np.ndarray) -> Jumps:
    """Return jumps with what happens in neighbouring rows added up."""
    if not rows.size:
        return Jumps(rows, excess, usual, excess, rows)
    first = np.flatnonzero(np.diff(rows, prepend=-10) > 2)
    size = np.add.reduceat(excess, first)
    peak = np.maximum.reduceat(np.abs(excess), first)
    last = np.append(first[1:], len(rows)) - 1
    return Jumps(rows[first] + 1, size, usual[first], peak, rows[last] - rows[first] + 1)


def _missing_rows(view: View, jumps: dict[str, Jumps]) -> list[Finding]:
    """Find missing rows in an even time base: all angles jump by the same number of rows."""
    if len(jumps) < 2:
        return []
    one, other = jumps.values()
    _, mine, its = np.intersect1d(one.row, other.row, return_indices=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        rows, same = one.size[mine] / one.usual[mine], other.size[its] / other.usual[its]
    slack = [  # what is usual is known to a count only, and is taken so many times
        (JUMP * np.sqrt(2.0) * view.noise[name] + np.abs(rows) * max(view.noise[name], view.quanta[name] or 0.0))
        / np.maximum(np.abs(jump.usual[some]), 1e-300)
        for (name, jump), some in zip(jumps.items(), (mine, its), strict=True)
    ]
    both = (rows > 0.5) & (np.abs(rows - same) < 0.2 + slack[0] + slack[1])
    if not both.any():
        return []
    lost = np.round(rows[both])
    at = one.row[mine][both]
    told = f"{lost.sum():.0f} rows are missing at {len(at)} places although the time base is even, "
    told += f"at most {lost.max():.0f} at once, first before row {at[0]} (t = {view.time[at[0]]:.6g} s)"
    remedy = "speeds across these places are wrong: repair the time base or split the record"
    return [Finding("left-out", "", float(lost.max()) * view.spacing, "s", told, remedy, rows=tuple(map(int, at)))]


def _of_channel(view: View, name: str, jumps: Jumps) -> list[Finding]:
    found = []
    spike = np.abs(jumps.size) < 0.3 * jumps.peak
    if spike.any():
        rows, worst = jumps.row[spike], float(jumps.peak[spike].max())
        told = f"{len(rows)} outliers of one or two rows, up to {worst:.4g} rad ({_counts(view, name, worst)})"
        told += f", first in row {rows[0]} (t = {view.time[rows[0]]:.6g} s)"
        some = tuple(map(int, rows[:TOLD]))
        found.append(
            Finding("spikes", name, worst, "rad", told, "check for poor electrical contact or interference", rows=some)
        )
    rows, sizes = jumps.row[~spike], jumps.size[~spike]
    if len(rows) > REMOVED and _are_motion(view, name, rows, sizes):
        worst = float(sizes[np.argmax(np.abs(sizes))])
        told = f"changes {len(rows)} times within one row, by up to {worst:.4g} rad ({_counts(view, name, worst)}),"
        told += f" first in row {rows[0]},"
        told += " and yet the gears stay within the backlash, which they would not if these changes were removed"
        remedy = "record faster: impacts are too close together for this sample rate"
        some = tuple(map(int, rows[:TOLD]))
        return [*found, Finding("jumps", name, worst, "rad", told, remedy, rows=some)]
    if len(rows) > TOLD:
        worst = float(sizes[np.argmax(np.abs(sizes))])
        told = (
            f"jumps {len(rows)} times, by up to {worst:.4g} rad ({_counts(view, name, worst)}), first in row {rows[0]}"
        )
        some = tuple(map(int, rows[:TOLD]))
        return [*found, Finding("jumps", name, worst, "rad", told, "do not use this encoder", True, rows=some)]
    for row, size, usual in zip(rows, sizes, jumps.usual[~spike], strict=True):
        found.append(_one(view, name, int(row), *_measured(view, name, int(row), float(size)), float(usual)))
    return found


def _are_motion(view: View, name: str, rows: np.ndarray, sizes: np.ndarray) -> bool:
    """Return whether jumps belong to the motion: without them the gears would part further."""
    declared = view.declared
    if not declared.meshed or declared.radii is None or declared.backlash is None or len(view.angles) < 2:
        return False
    angles = (view.angles[one] - view.angles[one][0] for one in MESH)
    drive, loose = (angle * radius for angle, radius in zip(angles, declared.radii, strict=True))
    added = np.zeros(len(drive))
    added[rows] = sizes * declared.radii[MESH.index(name)] * (1.0 if name == MESH[1] else -1.0)
    added = np.cumsum(added)
    seen = _range(drive, loose)
    further = BEYOND * seen < float(np.ptp(added)) or seen < _range(drive, loose - added)
    return further and seen < BANDS * declared.backlash


def _range(drive: np.ndarray, loose: np.ndarray) -> float:
    """Return the range of the displacement [m] for any ratio: counts or teeth may be wrong as well."""
    slope = np.polyfit(drive, loose, 1)[0]
    return float(np.ptp(np.quantile(loose - slope * drive, [0.001, 0.999])))


def _measured(view: View, name: str, row: int, size: float) -> tuple[float, float]:
    """Return a jump and its sigma [rad]: a step on a parabola through the rows around, if that is what they make."""
    noise = view.noise[name]
    some = np.arange(max(row - FITTED, 0), min(row + FITTED, len(view.time)))
    some = some[np.abs(some - row + 0.5) > 1.0]
    time = (view.time[some] - view.time[row]) / (FITTED * view.spacing)
    table = np.column_stack([np.ones_like(time), time, time**2, some >= row])
    angle = view.angles[name][some] - view.angles[name][row]
    fit = np.linalg.lstsq(table, angle, rcond=None)[0]
    left = float(np.std(angle - table @ fit))
    if left > 1.3 * noise:
        return size, np.sqrt(3.0) * noise
    return float(fit[-1]), noise * float(np.sqrt(np.linalg.inv(table.T @ table)[-1, -1]))


def _one(view: View, name: str, row: int, size: float, sigma: float, usual: float) -> Finding:
    way = "extra" if size * usual > 0.0 else "lost"
    size = _whole(size, view.quanta[name], sigma)
    told = f"jumps by {size:.6g} rad (± {sigma:.2g}, {_counts(view, name, size)} {way}) in row {row}, "
    told += f"t = {view.time[row]:.6g} s"
    fatal = False
    declared = view.declared
    if declared.meshed and declared.radii is not None and declared.backlash is not None:
        moved = abs(size) * declared.radii[0 if "drive" in name else 1]
        fatal = moved > TORN * declared.backlash
        told += f": permanent shift of the backlash by {1e6 * moved:.3g} um"
    return Finding("lost-counts", name, size, "rad", told, "", fatal, True, rows=(row,))


def _whole(size: float, count: float | None, sigma: float) -> float:
    """Return whole counts where there are counts; near enough they are the right ones."""
    return size if count is None or sigma > 100.0 * count else float(np.round(size / count)) * count


def _counts(view: View, name: str, size: float) -> str:
    count = view.quanta[name]
    return f"{abs(size) / count:.0f} counts" if count else "no counts visible"
