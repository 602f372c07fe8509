"""Readings that stand still while the gear turns: clipped or frozen channels, samples given twice."""

from __future__ import annotations

import numpy as np

from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.view import View, when

BANDS = 3.0
"""A gear that stands while the other turns by so many backlashes is not in mesh."""
SURE = 6.0
"""Standard deviations of a change by which a gear must turn in a row for a change of nothing to be impossible."""
REACH = 12
"""Rows to either side that tell how fast a gear turns."""
MOST = 200_000


def examine(view: View) -> list[Finding]:
    """Find channels that freeze while the mating gear turns, and rows that repeat the angles of the row before.

    Args:
        view: the record; its time rises.
    """
    still = {name: _standing(view, name) for name in view.angles}
    frozen = [one for name, rows in still.items() for one in _frozen(view, name, rows)] if view.declared.meshed else []
    return frozen or _repeated(view, still)


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
    reach = BANDS * view.declared.backlash + 10.0 * (own * view.noise[other] + far * view.noise[name])
    longest = np.argpartition(lasts, -min(5, len(lasts)))[-5:]
    for k in longest[np.argsort(-lasts[longest])]:
        first = int(still[begins[k]])
        last = first + int(lasts[k])
        moved = own * float(np.ptp(view.angles[other][first : last + 1])) if last > first else 0.0
        if moved > reach:
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
