"""Significant orders of either gear in contact during rattle.

Contact has gaps, through which orders leak into their neighbours: these do not show the noise, as they do in slow turns
(:mod:`gears3d.identify.orders`). Orders are therefore fitted together, and an order must predict revolutions from
which it was not fitted.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.signals import robust_deviation
from gears3d.signals.orders import GEARS, colour_of, each_alone, harmonics, off_multiples, trimmed

# p-value of the strongest of all orders below which it is significant.
DOUBT = 1e-4
# Orders that are taken at most.
MOST = 40
# Parts of a record of few revolutions, every other one held out; in longer ones every other revolution is.
STRETCHES = 37
# Scatter of places over their noise from which orders are searched.
QUIET = 1.15
# Times the power of the strongest order that a further one may have at most: they are not quite independent.
HOPE = 2.0
# Orders that are fitted before one of them is taken.
CANDIDATES = 8
# Part of the strongest order's power that makes another one a candidate.
TRIED = 0.3
# Part of the reduction by the best order from which on a lower order is preferred.
ALIKE = 0.97
# Places with which candidates are compared.
SOME = 4000
# Standard deviations from which on a place is a bounce and not contact.
STRAY = 4.0
# Blocks, and bins of the angle, in a wave of the highest order at least.
FINE, BINS = 8.0, 8
# Regularisation of all orders together and of one alone: blocks in contact lie at some angles only.
RIDGE, POOR = 1e-6, 0.02
# Readings in which the order of the fluctuation is sought.
READ = 20_000
# Of the fluctuation after which a rattling motion often repeats.
PERIODS = 2
# The same where the fluctuation is locked to the rotation: all that repeats is an order then.
LOCKED_PERIODS = 6
# Power of the strongest line of the drive over that of the next, from which on it is the fluctuation.
COMMON = 3


class Contact(NamedTuple):
    """Places in contact with one flank.

    Args:
        base: columns that are fitted in addition, such as offset and drift, (n, p).
        angles: of drive and loose gear [rad], (2, n).
        place: [m], (n,).
        noise: of a place [m]; nothing is looked for below it.
    """

    base: np.ndarray
    angles: np.ndarray
    place: np.ndarray
    noise: float = 0.0


def resolved(drive: np.ndarray, loose: np.ndarray) -> tuple[int, int]:
    """Return the highest order of each gear that blocks resolve; 0 for the loose gear where both turn equally fast.

    ``drive``: angles of the blocks [rad], (m,); ``loose``: [rad], (m,).
    """
    turns = [abs(float(angle[-1] - angle[0])) / (2 * np.pi) for angle in (drive, loose)]
    steps = [max(float(np.quantile(np.abs(np.diff(angle)), 0.9)), 1e-12) / (2 * np.pi) for angle in (drive, loose)]
    highest = [
        int(min(1.0 / (FINE * step), 1000)) if turn > 0.8 else 0 for step, turn in zip(steps, turns, strict=True)
    ]
    if abs(turns[0] - turns[1]) < 0.5:
        highest[1] = 0
    return highest[0], highest[1]


def strongest(
    touched: list[Contact],
    highest: tuple[int, int],
    most: int = MOST,
    known: tuple[tuple[str, int], ...] = (),
    quiet: float = QUIET,
    goal: float = 0.0,
) -> tuple[list[tuple[str, int]], list[np.ndarray], list[np.ndarray]]:
    """Return significant orders, one after the other, each with its own phasor on every flank.

    ``goal``: standard deviation [m] that must be within reach: no further order takes more than the strongest one.
    Returns gear and order of each, and by flank the numbers of base columns and phasors, and their covariance. Flanks
    differ in their numbers of base columns where a record touches one flank only.
    """
    taken: list[tuple[str, int]] = []
    candidates = sum(highest)
    least = 2.0 * len(touched) + 2.0 * np.log(max(candidates, 1) / DOUBT)
    while True:
        fits = [_fit(one, taken) for one in touched]
        if len(taken) >= most or not candidates:
            break
        if all(robust_deviation(rest) < quiet * one.noise for one, (_, _, rest, _) in zip(touched, fits, strict=True)):
            break
        best = _best(touched, fits, highest, {*taken, *known})
        if not best or best[0][1] < least or _out_of_reach(fits, best[0][1], most - len(taken), goal):
            break
        chosen = _exact(touched, taken, [name for name, power in best if power > max(least, TRIED * best[0][1])])
        if not _predicts(touched, taken, chosen):
            break
        taken.append(chosen)
    return taken, [one[0] for one in fits], [one[1] for one in fits]


def _out_of_reach(fits: list, power: float, room: int, goal: float) -> bool:
    """Return whether a residual above the goal remains after so many orders as strong as the strongest."""
    if goal <= 0.0:
        return False
    return all(float(rest @ rest) - HOPE * room * power * var > len(rest) * goal**2 for _, _, rest, var in fits)


def columns_of(one: Contact, taken: list[tuple[str, int]]) -> np.ndarray:
    """Return what is fitted to places: the base columns, and both columns of each order, (n, p)."""
    return np.hstack([one.base, *(harmonics(one.angles[GEARS.index(gear)], [order]) for gear, order in taken)])


def _fit(one: Contact, taken: list[tuple[str, int]]) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return numbers, covariance, residual [m], outliers clipped, and its variance [m²]."""
    kept = np.abs(one.place) <= STRAY * max(robust_deviation(one.place), one.noise)
    numbers, inverse, rest, limit = made = trimmed(columns_of(one, taken), one.place, STRAY, one.noise, kept, RIDGE)
    rest = np.clip(rest, -limit, limit)
    variance = float(rest @ rest) / max(np.count_nonzero(made.kept) - len(numbers), 1) * colour_of(rest)
    return numbers, inverse * variance, rest, variance


def _best(
    touched: list[Contact], fits: list, highest: tuple[int, int], known: set[tuple[str, int]]
) -> list[tuple[tuple[str, int], float]]:
    """Return the orders that reduce the residual most, and by how much in units of its variance, strongest first."""
    found: list[tuple[tuple[str, int], float]] = []
    for which, gear in enumerate(GEARS):
        top = highest[which]
        if top < 1:
            continue
        power = np.zeros(top + 1)
        for one, (_, _, rest, variance) in zip(touched, fits, strict=True):
            power += each_alone(one.angles[which], rest, top, POOR, BINS)[1] / max(variance, 1e-300)
        taken = [0, *(order for name, order in known if name == gear and order <= top)]
        power[taken] = 0.0
        found += [((gear, int(order)), float(power[order])) for order in np.argsort(-power)[:CANDIDATES]]
    return sorted(found, key=lambda one: -one[1])[:CANDIDATES]


def _exact(touched: list[Contact], taken: list[tuple[str, int]], tried: list[tuple[str, int]]) -> tuple[str, int]:
    """Return the lowest of the orders whose residual hardly exceeds the smallest.

    Where gears touch at some angles only, orders are hardly distinguishable.
    """
    left = []
    for name in tried:
        rests = [_fit(_few(one), [*taken, name])[2] for one in touched]
        left.append(sum(float(rest @ rest) for rest in rests))
    before = sum(float(rest @ rest) for rest in (_fit(_few(one), taken)[2] for one in touched))
    good = [name for name, rest in zip(tried, left, strict=True) if before - rest > ALIKE * (before - min(left))]
    return min(good or [tried[int(np.argmin(left))]], key=lambda name: name[1])


def _few(one: Contact) -> Contact:
    step = max(len(one.place) // SOME, 1)
    return Contact(one.base[::step], one.angles[:, ::step], one.place[::step], one.noise)


def _predicts(touched: list[Contact], taken: list[tuple[str, int]], new: tuple[str, int]) -> bool:
    """Return whether an order that is fitted to every other stretch reduces the residual of the others."""
    gain = 0.0
    for one in touched:
        count = len(one.place)
        if count < 64:
            continue
        turn = np.abs(one.angles[0] - one.angles[0, 0]) / (2 * np.pi)
        part = (turn if turn[-1] > 1.9 else np.arange(count) * STRETCHES / count).astype(int) % 2 == 1
        if not part.any() or part.all():  # all contact lies in revolutions of one kind
            continue
        for held in (part, ~part):
            mine = Contact(one.base[~held], one.angles[:, ~held], one.place[~held], one.noise)
            theirs = Contact(one.base[held], one.angles[:, held], one.place[held], one.noise)
            left, limit = [], 0.0
            for orders in (taken, [*taken, new]):
                numbers = _fit(mine, orders)[0]
                rest = np.abs(theirs.place - columns_of(theirs, orders) @ numbers)
                limit = STRAY * max(robust_deviation(rest) if not left else limit / STRAY, one.noise)
                left.append(float(np.mean(np.square(np.minimum(rest, limit)))))
            gain += (left[0] - left[1]) / max(left[0], 1e-300)
    return gain > 0.0


def fluctuation_order(time: np.ndarray, drive: np.ndarray) -> tuple[float, float] | None:
    """Return the order of the drive's strongest fluctuation and its uncertainty; ``None`` without one.

    >>> time = np.linspace(0.0, 10.0, 20_001)
    >>> [round(part, 2) for part in fluctuation_order(time, 30.0 * time + 0.02 * np.sin(75.0 * time))]
    [2.5, 0.02]
    """
    from scipy.signal import detrend

    turns = float(np.ptp(drive)) / (2.0 * np.pi)
    if turns < 1.0 or len(time) < 64:
        return None
    even = np.linspace(time[0], time[-1], min(len(time), READ))
    x = np.linspace(-1.0, 1.0, len(even))
    angle = np.interp(even, time, drive)
    slow = np.polynomial.chebyshev.chebvander(x, 3)
    rest = detrend(angle - slow @ np.linalg.lstsq(slow, angle, rcond=None)[0])
    size = np.abs(np.fft.rfft(rest * np.hanning(len(rest)), 8 * len(rest)))
    size *= np.arange(len(size))  # of the speed: slow drift of the angle is not a fluctuation
    top = int(np.argmax(size))
    away = np.abs(np.arange(len(size)) - top) > 32  # beyond the window's own width
    if not top or size[top] < COMMON * np.quantile(size[away], 0.99):
        return None
    return top / (8.0 * turns), 1.0 / turns


def in_step(highest: tuple[int, int], steps: list[tuple[float, float]], ratio: float) -> list[tuple[str, int]]:
    """Return the orders of both gears that are multiples of a fluctuation's order or of its subharmonics."""
    barred = []
    for gear, scale in ((0, 1.0), (1, ratio)):
        order = scale * np.arange(1, highest[gear] + 1)
        near = np.zeros(len(order), bool)
        for base, slack in steps:
            locked = abs(2.0 * base - round(2.0 * base)) < 2.0 * slack and round(2.0 * base) > 0
            for part in range(1, (LOCKED_PERIODS if locked else PERIODS) + 1):
                near |= off_multiples(order, base / part) < slack
        barred += [(GEARS[gear], int(k) + 1) for k in np.flatnonzero(near)]
    return barred
