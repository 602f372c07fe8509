"""Readings that stand still while the gear turns: clipped or frozen channels, held readings, samples given twice."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gears3d.measured.checks.declared import Declared
from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.view import View, when

BANDS = 3.0
"""A gear that stands while the other turns by so many backlashes is not in mesh."""
SURE = 6.0
"""Standard deviations of a change by which a gear must turn in a row for a change of nothing to be impossible."""
REACH = 12
"""Rows to either side that tell how fast a gear turns."""
MOST = 200_000
SHARE = 0.005
"""Part of the rows in motion from which on held readings are how a channel is read, not single samples given twice."""
FEW = 10
"""Runs of held rows of one channel that make a finding."""
STEP = 2.5
"""Counts by which a reading changes at once that was held; a gear slow enough to repeat a reading makes one, or two."""
THROUGHOUT = 0.4
"""Part of the rows that repeat a reading from which on a channel is held all along; at every second row it is half."""
LONGER, RARE = 3.0, 7.0
"""A hold of such a channel is at most so many times as long as nearly all others, or, where updates come at random, as
long as the longest of their number with a probability of 1 - e^-7."""
REGULAR = 0.99
"""Part of the updates that come at the same row of so many, from which on they are regular."""
TIMES = 3.0
"""So many times as often as after a change of one count such a change must come after none."""


class Hold(NamedTuple):
    """Runs of rows that repeat the reading before them, ended by a change that no gear at rest makes.

    Args:
        first: the row whose reading is repeated, (k,).
        lasts: rows that repeat it, (k,).
    """

    first: np.ndarray
    lasts: np.ndarray


def examine(view: View) -> list[Finding]:
    """Find channels that freeze while the mating gear turns, held readings, and rows that repeat the row before.

    Args:
        view: the record; its time rises.
    """
    still = {name: _standing(view, name) for name in view.angles}
    frozen = [one for name, rows in still.items() for one in _frozen(view, name, rows)] if view.declared.meshed else []
    if frozen:
        return frozen
    held = [one for name, rows in still.items() for one in _held(view, name, rows)]
    return held or _repeated(view, still)


def correct(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Interpolate held readings between the rows that were updated.

    Args:
        columns: each (n,).
        findings: of this check, of kind ``"held"``.
    """
    mended = dict(columns)
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
        mended[finding.channel] = angle.copy()
        mended[finding.channel][held] = own
    return mended


def quietest(declared: Declared, findings: list[Finding]) -> Declared:
    """Return what is declared with the noise of readings that are held, which interpolated ones hide.

    Args:
        declared: of the bench.
        findings: of any check.
    """
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
    if len(hold.first) >= FEW and hold.lasts.sum() > THROUGHOUT * len(view.time):
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
        remedy = "in mesh both gears rotate; evaluate a coast-down with `gears3d identify rundown`"
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
