"""Significant orders of a flank in slow turns, over the angles of both gears, with their intervals.

Slow turns show a flank at all angles, so that insignificant neighbouring orders are the noise of an order, including
what repeats every revolution, as rounding to counts does. Contact during rattle has gaps and needs another test
(:mod:`gears3d.measured.segmentation.orders`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.identify.contact import HARMONICS, Contact
from gears3d.signals.orders import GEARS, chances, deviations, harmonics, phasors_of, sums

APART = 0.7  # Cycles over the record by which orders of both gears differ at least to be distinguished


class Line(NamedTuple):
    """An order: cycles a turn of a gear.

    Args:
        gear: 0 drive, 1 loose.
        order: cycles a turn.
    """

    gear: int
    order: int

    @property
    def name(self) -> str:
        """As parameters are called: ``drive_1``."""
        return f"{GEARS[self.gear]}_{self.order}"


class Lines(NamedTuple):
    """The orders that are examined."""

    all: tuple[Line, ...]  # distinguishable ones; of a set of indistinguishable ones the drive's
    frequency: np.ndarray  # of each, cycles a turn of the drive, (m,)
    alike: dict[Line, Line]  # to each of the drive's, the loose gear's that is indistinguishable from it


def lines_of(contact: Contact, teeth: tuple[int, int]) -> Lines:
    """Return the orders that can be examined in a record."""
    turns = np.ptp(contact.turn % 1_000_000) + 1.0 if contact.turns < 1.0 else contact.turns
    ratio = teeth[0] / teeth[1]
    highest = min(HARMONICS * teeth[0] + 2, int(0.8 * np.pi / contact.width))
    chosen = [Line(0, order) for order in range(1, highest + 1)]
    alike: dict[Line, Line] = {}
    for order in range(1, int(highest / ratio) + 1):
        nearest = round(order * ratio)
        if abs(order * ratio - nearest) < APART / turns and 1 <= nearest <= highest:
            alike.setdefault(Line(0, nearest), Line(1, order))
        else:
            chosen.append(Line(1, order))
    frequency = np.array([line.order * (ratio if line.gear else 1.0) for line in chosen])
    keep = frequency * turns > APART
    return Lines(tuple(line for line, k in zip(chosen, keep, strict=True) if k), frequency[keep], alike)


NEIGHBOURS = 24  # Insignificant neighbouring orders whose mean size is the noise of one
TURNS = 6  # So many turns make a scatter


def left_of(contact: Contact, lines: Lines, values: np.ndarray) -> np.ndarray:
    """Return the size of the sum of values·exp(-i·order·angle) at every order, (m,)."""
    highest = [max((line.order for line in lines.all if line.gear == gear), default=0) for gear in (0, 1)]
    angles = (contact.drive, contact.loose)
    found = [np.abs(sums(angle, values, top)) for angle, top in zip(angles, highest, strict=True)]
    return np.array([found[line.gear][line.order] for line in lines.all])


def near(lines: Lines, chosen: tuple[Line, ...], turns: float) -> np.ndarray:
    """Whether orders are fitted ones, or too near to one to be noise, (m,)."""
    near = np.array([line in chosen for line in lines.all])
    for line in chosen:
        near |= np.abs(lines.frequency - lines.frequency[lines.all.index(line)]) * turns < APART
    return near


def floor_of(lines: Lines, seen: np.ndarray, free: np.ndarray, robust: bool) -> tuple[np.ndarray, float]:
    """Return the deviation of each part of a phasor from neighbouring orders without significance, and its freedom."""
    some = np.flatnonzero(free)
    some = some[np.argsort(lines.frequency[some], kind="stable")]
    at, power = lines.frequency[some], seen[some] ** 2
    count = min(NEIGHBOURS, len(some))
    begin = np.searchsorted(at, lines.frequency) - count // 2
    begin = np.clip(begin, 0, len(some) - count)
    windows = power[begin[:, None] + np.arange(count)]
    mean = windows.mean(axis=1)
    middle = np.median(windows, axis=1) / np.log(2.0)
    return np.sqrt(0.5 * (middle if robust else np.minimum(mean, 4.0 * middle))), 2.0 * count


def by_turns(
    contact: Contact, design: np.ndarray, inverse: np.ndarray, values: np.ndarray, covariance: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return factors, 1 or more, by which turns scatter more than neighbouring orders say, and the largest ratio."""
    from scipy.stats import f as fisher

    turns, number = np.unique(contact.turn, return_inverse=True)
    ones = np.ones(len(inverse))
    if len(turns) < TURNS:
        return ones, 1.0
    order = np.argsort(number, kind="stable")
    begins = np.searchsorted(number[order], np.arange(len(turns)))
    scores = np.add.reduceat((design * values[:, None])[order], begins, axis=0)
    moves = scores @ inverse
    variance = (moves**2).sum(axis=0) * len(turns) / (len(turns) - 1.0)
    ratio = variance / np.maximum(np.diag(covariance), 1e-300)
    head = len(np.unique(contact.file))
    pairs = ratio.copy()
    pairs[head:] = np.repeat(ratio[head:].reshape(-1, 2).mean(axis=1), 2)
    limit = fisher.ppf(0.99, 2 * (len(turns) - 1), 2 * NEIGHBOURS)
    return np.sqrt(np.where(pairs > limit, pairs, 1.0)), float(np.sqrt(pairs.max()))


LEVEL = 0.01  # Chance of one false order among all that are looked at
MOST = 80  # Orders that are fitted at most
SHARE = 0.3  # Part of the largest power down to which orders are taken in one round
ROUNDS = 40
STRAY = 7.0  # Deviations from the fit at which a bin is taken to be without contact
LEAST = 0.7  # Part of the bins that is kept at least


class Fit(NamedTuple):
    """Orders of one flank."""

    lines: tuple[Line, ...]  # that were fitted
    phasors: np.ndarray  # of each, amplitude·exp(i·phase) [m], (p,)
    covariance: np.ndarray  # of the real and imaginary parts, one after the other [m²], (2p, 2p)
    offsets: dict[int, float]  # mean place in each record [m], by number
    offset_deviation: float  # of these [m]
    floor: np.ndarray  # deviation of each part of a phasor that noise makes at each order looked at [m], (m,)
    seen: np.ndarray  # amplitude of what was found or left at each order looked at [m], (m,)
    rest: np.ndarray  # of the bins [m], (n,)
    kept: np.ndarray  # bins that are in contact, (n,)
    freedom: float  # degrees of freedom of the deviations
    scatter: float  # largest ratio of the deviation by turns to that by neighbouring orders
    counted: np.ndarray  # of each, the same of what the drive's counting makes alone [m], (p,)

    @property
    def deviation(self) -> np.ndarray:
        """Standard deviation of each part of a phasor [m], (p,)."""
        return deviations(self.covariance)

    @property
    def chance(self) -> np.ndarray:
        """p-value of each order, (p,)."""
        return chances(self.phasors, self.covariance)


def find(contact: Contact, lines: Lines, ratio: float) -> list[Line]:
    """Return the orders of a flank that exceed its noise.

    The largest come first; each round searches the residual of the orders found so far.
    """
    found: list[Line] = []
    for _ in range(ROUNDS):
        made = fit(contact, lines, found, ratio)
        free = ~near(lines, made.lines, contact.turns)
        power = np.where(free, made.seen**2, 0.0)
        limit = -2.0 * made.floor**2 * np.log(LEVEL / (2 * len(lines.all)))
        new = (power > limit) & (power > SHARE * power.max())
        if not new.any() or len(found) >= MOST:
            break
        strongest = np.flatnonzero(new)[np.argsort(-power[new])]
        for place in strongest:
            if (
                not any(abs(lines.frequency[place] - _frequency(line, ratio)) * contact.turns < 1.5 for line in found)
                or place == strongest[0]
            ):
                found.append(lines.all[place])
        found = found[:MOST]
    return [line for line, chance in zip(made.lines, made.chance, strict=True) if chance < LEVEL / (2 * len(lines.all))]


def fit(contact: Contact, lines: Lines, chosen: list[Line], ratio: float) -> Fit:
    """Fit orders to a flank by least squares, on the angles of both gears at once.

    Noise is the amplitude at neighbouring orders that are not fitted: it includes what repeats every
    turn, as rounding to counts does; where turns scatter by more, their scatter is taken.
    """
    return _judged(contact, lines, chosen, solve(contact, chosen, ratio))


class Solved(NamedTuple):
    """Least squares of orders."""

    design: np.ndarray  # a column a record, then two an order, (n, q)
    numbers: np.ndarray  # (q,)
    inverse: np.ndarray  # of the weighted normal matrix, (q, q)
    rest: np.ndarray  # of the bins [m], (n,)
    kept: np.ndarray  # bins that are in contact, (n,)


def solve(contact: Contact, chosen: list[Line], ratio: float) -> Solved:
    """Solve for orders by least squares without outlying bins, 30 % of them at most.

    A flank in slow turns has no bounces: bins off it are contact losses, which are excluded.
    """
    angles = (contact.drive, contact.loose)
    columns = [(contact.file == file).astype(float) for file in np.unique(contact.file)]
    waves = [_blur(contact, _frequency(line, ratio)) * harmonics(angles[line.gear], [line.order]) for line in chosen]
    design = np.column_stack([*columns, *waves])
    kept = np.ones(len(contact.drive), bool)
    place = contact.place - contact.place.mean()
    while True:
        weight = contact.weight * kept
        inverse = np.linalg.pinv((design * weight[:, None]).T @ design, hermitian=True)
        numbers = inverse @ (design.T @ (weight * place))
        rest = place - design @ numbers
        spread = 1.4826 * np.median(np.abs(rest[kept] - np.median(rest[kept]))) + 1e-15
        now = kept & (np.abs(rest) < max(STRAY * spread, contact.count))
        if not chosen or now.sum() > 0.9999 * kept.sum() or now.sum() < LEAST * len(kept):
            return Solved(design, numbers, inverse, rest, kept)
        kept = now


def _judged(
    contact: Contact,
    lines: Lines,
    chosen: list[Line],
    solved: Solved,
) -> Fit:
    """Return a fit with its deviations."""
    design, numbers, inverse, rest, kept = solved
    weight = contact.weight * kept
    total = float(weight.sum())
    files = np.unique(contact.file)
    seen = left_of(contact, lines, weight * rest) * 2.0 / total
    counting, angles = weight * contact.counted * 2.0 / total, (contact.drive, contact.loose)
    free = ~near(lines, tuple(chosen), contact.turns)
    floor, freedom = floor_of(lines, seen, free, robust=not chosen)
    places = [lines.all.index(line) for line in chosen]
    sizes = np.concatenate([np.full(len(files), floor[np.argmin(lines.frequency)]), np.repeat(floor[places], 2)])
    scale = sizes * np.sqrt(total / 2.0)
    covariance = inverse * np.outer(scale, scale)
    wider, ratio_found = by_turns(contact, design, inverse, weight * rest, covariance)
    covariance = covariance * np.outer(wider, wider)
    own = covariance[len(files) :, len(files) :]
    phasors = phasors_of(numbers[len(files) :])
    shown = seen.copy()
    shown[places] = np.abs(phasors)
    return Fit(
        lines=tuple(chosen),
        phasors=phasors,
        covariance=own,
        offsets={int(f): float(numbers[i] + contact.place.mean()) for i, f in enumerate(files)},
        offset_deviation=float(np.sqrt(covariance[0, 0])),
        floor=floor,
        seen=shown,
        rest=rest,
        kept=kept,
        freedom=freedom,
        scatter=ratio_found,
        counted=np.array([counting @ np.exp(-1j * one.order * angles[one.gear]) for one in chosen], complex),
    )


def _blur(contact: Contact, frequency: float) -> float:
    """Return the attenuation of a wave by averaging in bins."""
    half = 0.5 * frequency * contact.width
    return float(np.sin(half) / (contact.samples * np.sin(half / contact.samples))) if half else 1.0


def _frequency(line: Line, ratio: float) -> float:
    return line.order * (ratio if line.gear else 1.0)
