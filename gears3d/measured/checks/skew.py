"""Is one channel read later than the other: in contact the displacement then follows the speed.

A delay τ of the loose gear's channel takes Rb2·ω(t)·τ from the displacement. In contact nothing else is in phase with
the speed: tooth compliance follows the acceleration, the flanks' errors follow the angles. Where the drive's motion is
in step with a revolution, orders of the flanks look alike; they are fitted along, and the uncertainty says so. Both
flanks wave alike but for the backlash's own variation, which is fitted along where both are touched.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.measured.checks.band import PERIOD, Band
from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.view import MESH, View

SURE = 7.0
"""Standard deviations from which a delay is told."""
LEAST = 0.01
"""Part of the backlash that a delay must move the displacement by, peak to peak."""
ROUGH = 0.01
"""Part of the backlash by which contact may be off: what is more is no contact."""
ALIKE = 0.985
"""Part of the speed's changes from which on waves of the flanks may stand for it."""
HIDING, EXPLAINED = 0.0025, (0.7, 1.3)
"""Part of the backlash that the noise of a sixtieth of a period may be, and what contact may be off over the noise of
blocks where it is more: gears that lift off look at rest there, and counts of one that hardly turns do not scatter."""
LONG, TRIM, SPARED = 8, 1, 0.08
"""Blocks in a stretch, at least; blocks and part of a period spared at both ends: bounces die out, flight begins."""
SWUNG = 0.12
"""Part of a period that a stretch lasts, at least: in a shorter one any bow looks like the speed."""
FLANK, PLACED = 0.08, 0.7
"""Half width of a flank's range, in backlashes, and the part of contact that must lie in two of them."""
MOST = 12_000
MOST_ORDER = 12
OWN_ORDERS = 1
"""Orders that each flank has for itself: the backlash varies once a turn."""
WANDER = 0.3
"""Expected size of orders of the flanks, in backlashes."""
STEPS = 40
"""Groups of neighbouring blocks, at least, whose errors are taken as independent."""


class Delay(NamedTuple):
    """How much later the loose gear is read.

    Args:
        value: [s].
        sigma: [s].
        swing: change of the speed along the line of action in contact, peak to peak [m/s].
        off: root of the mean square of what the displacement in contact is off [m].
        alike: part of the speed's changes that waves of the flanks could imitate.
        placed: part of the contact that lies on two flanks once the delay is taken out.
    """

    value: float
    sigma: float
    swing: float
    off: float
    alike: float
    placed: float


def examine(view: View) -> list[Finding]:
    """Find a delay between both channels.

    Args:
        view: the record; its time rises, its angles do not wrap, its ratio is right.
    """
    band = view.band
    if band is None or (delay := delay_of(view, band)) is None:
        return []
    backlash, moved = view.declared.backlash or 0.0, abs(delay.value) * delay.swing
    hidden = band.noise * min(np.sqrt(PERIOD * band.frequency * band.width), 1.0) > HIDING * backlash
    explained = not hidden or EXPLAINED[0] < delay.off / band.noise < EXPLAINED[1]
    placed = delay.placed > PLACED and delay.off < max(ROUGH * backlash, 3.0 * band.noise)
    trusted = explained and placed and delay.alike < ALIKE
    least = max(LEAST * backlash, 4.0 * delay.off)
    if not trusted or abs(delay.value) < SURE * delay.sigma or moved < least:
        return []
    which = "loose" if delay.value > 0.0 else "drive"
    told = (
        f"the {which} gear is read {1e6 * abs(delay.value):.4g} us (± {1e6 * delay.sigma:.2g}) after the other one: in "
    )
    told += f"contact the displacement follows the speed, {1e6 * moved:.3g} um peak to peak"
    return [
        Finding(
            "skew", str(MESH[1]), delay.value, "s", told, "or the shaft of the drive encoder is compliant", False, True
        )
    ]


def correct(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Read the loose gear's channel earlier by the delay: whole rows are shifted, parts of one interpolated.

    Args:
        columns: each (n,).
        findings: of this check.
    """
    time, delay = columns["time_s"], findings[0].size
    inside = (time + delay >= time[0]) & (time + delay <= time[-1])
    shifted = np.interp(time[inside] + delay, time, columns[MESH[1]])
    return {name: shifted if name == MESH[1] else values[inside] for name, values in columns.items()}


def delay_of(view: View, band: Band) -> Delay | None:
    """Return the delay of the loose gear's channel, ``None`` where contact or changes of speed are too few.

    Args:
        view: the record.
        band: its blocks.
    """
    inside = _chosen(band)
    if len(inside) < 50 or view.declared.radii is None or view.declared.backlash is None:
        return None
    stretch = band.stretch[inside]
    radius = view.declared.radii[1]
    backlash, group = view.declared.backlash, _groups(band.time[inside], stretch)
    waves = _orders(view, band, inside)
    columns = [-radius * band.speed[inside], band.acceleration[inside], band.time[inside], *waves]
    whole = np.column_stack([*columns, band.place[inside]])
    table = _centred(whole, stretch)
    spread = table.std(axis=0)
    if spread[0] <= 0.0:
        return None
    numbers, sigma, off = _fit(table, spread, group, band.noise, backlash)
    alike = _alike(table[:, 2:-1], table[:, 0])
    freed = whole[:, -1] - (whole[:, :-1] - whole[:, :-1].mean(axis=0)) @ numbers
    if (side := _sides(freed, stretch, backlash)) is not None:
        own = np.column_stack([side * wave for wave in _orders(view, band, inside, OWN_ORDERS)])
        table = np.column_stack([table[:, :-1], _centred(own, stretch), table[:, -1]])
        numbers, sigma, off = _fit(table, table.std(axis=0), group, band.noise, backlash)
    swing = radius * float(np.ptp(np.quantile(band.speed[inside], [0.01, 0.99])))
    return Delay(float(numbers[0]), sigma, swing, off, alike, _placed(freed, backlash))


def _sides(place: np.ndarray, stretch: np.ndarray, backlash: float) -> np.ndarray | None:
    """Return 1 for blocks whose stretch lies nearer to the reverse flank, -1 for the others, ``None`` for one flank."""
    _, at, count = np.unique(stretch, return_inverse=True, return_counts=True)
    mean = np.bincount(at, place) / count
    low, high = np.quantile(mean, [0.05, 0.95])
    return np.where(mean > 0.5 * (low + high), 1.0, -1.0)[at] if high - low > 0.5 * backlash else None


def _placed(place: np.ndarray, backlash: float) -> float:
    """Return the part of the places that lies in the two fullest narrow ranges: the flanks."""
    edges = np.arange(place.min() - backlash * FLANK, place.max() + 2.0 * backlash * FLANK, 0.5 * backlash * FLANK)
    if len(edges) > 10_000:
        return 0.0
    half = np.histogram(place, edges)[0]
    count = np.convolve(half, [1, 1, 1, 1], "valid") if len(half) > 4 else np.array([half.sum()])
    best = int(np.argmax(count))
    far = np.abs(np.arange(len(count)) - best) >= 4
    return float(count[best] + count[far].max(initial=0)) / len(place)


def _chosen(band: Band) -> np.ndarray:
    """Return blocks in the midst of contact, not too many: ends of stretches, where the gear lifts off, are spared."""
    edge = np.flatnonzero(np.diff(np.concatenate([[-2], band.stretch, [-2]])))
    first, last = edge[:-1], edge[1:]
    least = max(LONG, int(SWUNG / (band.frequency * band.width)) if band.frequency else 0)
    good = (band.stretch[first] >= 0) & (last - first >= least)
    spared = int(SPARED / (band.frequency * band.width)) if band.frequency else 0
    cut = TRIM + np.minimum((last - first) // 4, spared)[good]
    first, last = first[good] + cut, last[good] - cut
    total = int((last - first).sum())
    every = max(total // MOST, 1)
    if len(first) > 20 * every:
        first, last, every = first[::every], last[::every], 1
    if not len(first):
        return np.zeros(0, np.intp)
    return np.concatenate([np.arange(begin, end, every) for begin, end in zip(first, last, strict=True)])


def _alike(columns: np.ndarray, speed: np.ndarray) -> float:
    """Return the part of the speed's changes that the other columns explain."""
    scale = np.sqrt(np.square(columns).sum(axis=0)) + 1e-300
    columns = columns / scale
    fit = np.linalg.pinv(columns.T @ columns, rcond=1e-9, hermitian=True) @ (columns.T @ speed)
    return 1.0 - float(np.square(speed - columns @ fit).sum() / np.square(speed).sum())


def _orders(view: View, band: Band, inside: np.ndarray, most: int | None = None) -> list[np.ndarray]:
    """Return waves of both gears up to an order; without one up to that in step with the drive, and of the mesh."""
    angles = {MESH[0]: band.drive[inside]}
    radii = view.declared.radii or (1.0, 1.0)
    if abs(radii[0] / radii[1] - 1.0) > 1e-6:
        angles[MESH[1]] = band.loose[inside]
    waves = []
    lasting = float(band.time[-1] - band.time[0])
    for k, angle in enumerate(angles.values()):
        turns = abs(float(angle[-1] - angle[0])) / (2 * np.pi) / lasting
        locked = int(band.frequency / turns) + 2 if turns > 0.0 else 2
        top = max(min(locked, MOST_ORDER), 2)
        teeth = [view.declared.teeth[k]] if view.declared.teeth else []
        for order in [*range(1, top + 1), *teeth] if most is None else range(1, most + 1):
            waves += [np.cos(order * angle), np.sin(order * angle)]
    return waves


def _centred(table: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Return the columns less their mean in each stretch: where a flank lies is not asked."""
    _, at, count = np.unique(stretch, return_inverse=True, return_counts=True)
    mean = np.column_stack([np.bincount(at, column) / count for column in table.T])
    return table - mean[at]


def _groups(time: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Return the group of each block: its stretch, long ones cut."""
    length = float(time[-1] - time[0]) / STEPS
    return np.unique(np.column_stack([stretch, np.floor((time - time[0]) / length)]), axis=0, return_inverse=True)[1]


def _fit(
    table: np.ndarray, spread: np.ndarray, group: np.ndarray, noise: float, backlash: float
) -> tuple[np.ndarray, float, float]:
    """Return the numbers, the delay's sigma from errors of whole groups, and what is left: least squares, no strays."""
    scale = np.where(spread > 0.0, spread, 1.0)[:-1]
    columns, place = table[:, :-1] / scale, table[:, -1]
    size = np.full(len(scale), WANDER * backlash) * scale
    size[:3] = np.inf
    rough, keep = noise, np.ones(len(place), bool)
    for _ in range(4):
        normal = columns[keep].T @ columns[keep] + np.diag((rough / size) ** 2)
        inverse = np.linalg.pinv(normal, hermitian=True)
        numbers = inverse @ (columns[keep].T @ place[keep])
        off = place - columns @ numbers
        rough = max(1.4826 * float(np.median(np.abs(off))), 0.3 * noise)
        keep = np.abs(off) < 5.0 * rough
    part = columns[keep] * off[keep, None]
    sums = np.column_stack([np.bincount(group[keep], column) for column in part.T])
    spread_of = inverse @ (sums.T @ sums) @ inverse
    floor = rough**2 * inverse[0, 0]
    left = float(np.sqrt(np.mean(off**2)))
    return numbers / scale, float(np.sqrt(max(spread_of[0, 0], floor)) / scale[0]), left
