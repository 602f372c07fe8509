"""Pulses of a shaft that coasts down: which are real, the number of each, and the spacing errors of the magnets."""

from __future__ import annotations

from math import pi

import numpy as np

# Pulses by which a count is locked.
LOCK = 24
# Resultant length of the pulses' phases that makes a lock: 24 random phases reach it with a chance of 2e-7, and some
# 10^4 periods are tried.
LOCKED = 0.8
# Pitches a pulse, on average, beyond which (80 % missing) no period is significant.
FINEST = 5
# Pulses whose deviations from whole numbers are tested, and the root mean square from which on the count is lost: it
# is 0.05 of magnets spaced unevenly by 5 % of a pitch, and 0.24 of pulses at random.
RECENT, RANDOM = 20, 0.15

# Share of pulses counted with an even pitch below which, as where that count is lost, magnets may stand unevenly.
COUNTED = 0.8
# Revolutions, with their missing pulses, in which the places of uneven magnets are looked for, and most magnets.
TURNS, MOST = 8, 24
# Sum of the gaps between the places of magnets in a revolution from which on pulses have places: a sixth of the gaps of
# pulses at random are 0.47 in all. Least distance of two places, in pitches.
PLACED, APART = 0.93, 0.3
# Share of the highest speed below which pulses do not tell where magnets stand.
SLOW = 0.3
# Change of the logarithm of the wait from pulse to pulse below which no pulse is missing (log 2) or extra.
CALM = 0.25

# Pulses at either end that may be less calm: near standstill waits change by half from one to the next.
ENDS = 8


def count_pulses(time: np.ndarray, magnets: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return which pulses are real, the number of each, and the real pulses before which the count was lost.

    A phase-locked count: the speed of the pulses before predicts the phase of the next one; near a whole number it is
    real, and the number gives how many are missing; between two numbers it is an extra one.

    ``time``: of the pulses, rising [s], (n,).

    >>> even = np.cumsum(np.linspace(1.0, 1.5, 100))
    >>> kept, number, breaks = count_pulses(np.delete(even, [30, 31, 60]))
    >>> bool(kept.all()), int(number[-1]), len(breaks)
    (True, 99, 0)
    """
    count = len(time)
    kept, number = np.zeros(count, bool), np.zeros(count, np.int64)
    rough = np.flatnonzero(np.abs(np.diff(_evened_waits(time, magnets))) >= CALM)
    inner = rough[(rough >= ENDS) & (rough < count - 2 - ENDS)]
    if not rough.size or (not inner.size and count > 4 * ENDS):  # nothing lost: no lock is needed
        early, late = rough[rough < ENDS], rough[rough >= ENDS]
        kept[(early[-1] + 1 if early.size else 0) : (late[0] + 2 if late.size else count)] = True
        return kept, np.arange(count), np.zeros(0, int)
    breaks, row, last = [], 0, 0
    while row < count - 8:
        locked = _lock(time[row : row + LOCK])
        if locked is None:
            row += 4
            continue
        real, numbers = locked
        begin = row
        places = [begin + int(one) for one in np.flatnonzero(real)]
        numbers = [int(one) for one in numbers[real]]
        row, lost = _follow(time, places, numbers, begin + min(LOCK, count - begin))
        if len(places) >= 20:
            offset = last + (1 if breaks or kept.any() else 0) - numbers[0]
            if kept.any():
                breaks.append(int(kept.sum()))
            kept[places] = True
            number[places] = np.array(numbers) + offset
            last = int(number[places[-1]])
        row = max(row - lost, begin + 4)
    if 1 < magnets <= MOST and (breaks or kept.mean() < COUNTED):
        uneven = _count_uneven(time, magnets)
        if uneven is not None and uneven[0].sum() >= kept.sum():
            return *uneven, np.zeros(0, int)
    return kept, number, np.array(breaks, int)


def _evened_waits(time: np.ndarray, magnets: int) -> np.ndarray:
    """Return the logarithms of the waits between pulses, without what repeats in every revolution, (n - 1,).

    The pattern is that of all revolutions together: where pulses are missing or too many it is smeared, and no wait
    is corrected wrongly.
    """
    wait = np.log(np.maximum(np.diff(time), 1e-300))
    if magnets < 2 or len(wait) < 4 * magnets:
        return wait
    turns = len(wait) // magnets
    table = wait[: turns * magnets].reshape(turns, magnets)
    slope = np.arange(magnets) / magnets - 0.5
    trend = np.gradient(table.mean(axis=1)) if turns > 1 else np.zeros(turns)
    pattern = np.median(table - table.mean(axis=1)[:, None] - trend[:, None] * slope, axis=0)
    return wait - np.resize(pattern, len(wait))


def _lock(time: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return which of some pulses are real and their numbers, by the coarsest period that divides nearly all."""
    since = time - time[0]
    wait = np.diff(time)
    if len(time) < 8 or since[-1] <= 0.0:
        return None
    longest = float(np.median(wait)) * 1.3
    shortest = max(float(np.percentile(wait, 10)) * 0.8, since[-1] / (FINEST * len(time)))
    if shortest >= longest:
        return None
    period = np.exp(np.arange(np.log(shortest), np.log(longest), 0.1 / max(since[-1] / shortest, 10.0)))
    bend = np.linspace(-0.25, 0.25, 41)[:, None, None]
    phase = since * (1.0 - bend * since / since[-1]) / period[:, None]
    fit = np.abs(np.exp(2j * pi * phase).mean(axis=2))
    best = fit.max(axis=0)
    good = np.flatnonzero(best >= max(0.92 * best.max(), LOCKED))
    if not good.size:
        return None
    top = good[-1]
    while top > 0 and best[top - 1] > best[top]:
        top -= 1
    chosen = phase[int(np.argmax(fit[:, top])), top]
    shift = np.angle(np.exp(2j * pi * chosen).mean()) / (2 * pi)
    number = np.round(chosen - shift).astype(np.int64)
    real = np.abs(chosen - shift - number) < 0.25
    real[1:] &= np.diff(number) > 0
    return (real, number) if real.sum() >= 6 and real[0] else None


def _count_uneven(time: np.ndarray, magnets: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Return which pulses are real, and their numbers, of magnets that stand unevenly, some of their pulses missing."""
    for start in np.linspace(0, len(time) // 2, 5).astype(int):
        locked = _places(time[start : start + TURNS * magnets], magnets)
        if locked is None:
            continue
        numbers, pattern = locked
        places = list(range(start, start + len(numbers)))
        numbers = [int(one) for one in numbers]
        _follow(time, places, numbers, start + len(numbers), pattern)
        kept, number = np.zeros(len(time), bool), np.zeros(len(time), np.int64)
        kept[places], number[places] = True, np.array(numbers) - numbers[0]
        number[places] += numbers[0] % magnets
        return kept, number
    return None


def _places(time: np.ndarray, magnets: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the numbers of some pulses and how far each magnet stands from its even place [pitches], (magnets,).

    The turns and their change are those at which all pulses of a magnet fall in one place of the revolution, so that
    the widest gaps between the places take up the revolution.
    """
    since = time - time[0]
    if len(time) < 6 * magnets or since[-1] <= 0.0:
        return None
    turns = np.exp(np.arange(np.log(len(time) / magnets), np.log(2.5 * len(time) / magnets), 1e-3))[::-1]
    part = since / since[-1]
    best, least = None, PLACED
    for bend in np.linspace(-0.25, 0.25, 126):
        for few in np.array_split(turns, 1 + len(turns) * len(time) // 200_000):
            phase = np.sort((few[:, None] * (part * (1.0 - bend * (part - 1.0)))) % 1.0, axis=1)
            gaps = np.diff(phase, axis=1, append=phase[:, :1] + 1.0)
            widest = np.partition(gaps, -magnets, axis=1)[:, -magnets:]
            total = np.where(widest.min(axis=1) >= APART / magnets, widest.sum(axis=1), 0.0)
            at = int(np.argmax(total))
            if total[at] > least:
                best, least = (few[at], bend), float(total[at])
    if best is None:
        return None
    where = best[0] * part * (1.0 - best[1] * (part - 1.0))
    phase = np.sort(where % 1.0)
    gaps = np.diff(phase, prepend=phase[-1] - 1.0)
    first = np.sort(np.argpartition(gaps, -magnets)[-magnets:])
    origin = phase[first[0]] - 0.5 * gaps[first[0]]
    turn, place = np.divmod(where - origin, 1.0)
    which = np.searchsorted(phase[first] - origin - 0.5 * gaps[first], place, side="right") - 1
    number = (turn * magnets + which).astype(np.int64)
    seen = np.bincount(which, minlength=magnets)
    if seen.min() < 2 or np.any(np.diff(number) < 1):
        return None
    pattern = magnets * np.bincount(which, place, magnets) / seen - np.arange(magnets)
    return number, pattern - pattern.mean()


def _follow(
    time: np.ndarray, places: list[int], numbers: list[int], row: int, pattern: np.ndarray | None = None
) -> tuple[int, int]:
    """Follow the pulses from a lock on; return the row where the count was lost, and how many were rejected last.

    ``pattern``: how far each magnet stands from its even place [pitches], (magnets,); even where it is ``None``.
    """
    off = [0.0] if pattern is None else [float(one) for one in pattern]
    near = 0.3 * min(1.0, min(1.0 + b - a for a, b in zip(off, [*off[1:], off[0]], strict=True)))
    rejected = 0
    deviations = [0.0] * RECENT  # of accepted pulses from whole numbers; those of rejected ones count as large
    while row < len(time):
        if np.mean(np.square(deviations[-RECENT:])) > RANDOM**2:
            return row, rejected
        half = min(8, (len(places) - 1) // 2)
        a, b, c = places[-1], places[-1 - half], places[-1 - 2 * half]
        ta, tb, tc = time[a], time[b], time[c]
        na, nb, nc = (one + off[one % len(off)] for one in (numbers[-1], numbers[-1 - half], numbers[-1 - 2 * half]))
        late, early = (na - nb) / (ta - tb), (nb - nc) / (tb - tc)
        bend = 2.0 * (late - early) / (ta - tc)
        wait = time[row] - ta
        now = late + 0.5 * bend * (ta - tb)
        step = now * wait + 0.5 * bend * wait**2
        if now <= 0.0 or (bend < 0.0 and wait > -now / bend) or step > max(4 * (na - nc), 40):
            return row, rejected
        middle = round(na + step)
        some = (middle,) if pattern is None else (middle - 1, middle, middle + 1)
        miss, whole = min((abs(na + step - one - off[one % len(off)]), one) for one in some)
        deviations.append(min(miss, 0.3))
        if whole > numbers[-1] and miss < near:
            places.append(row)
            numbers.append(whole)
            rejected = 0
        else:
            rejected += 1
            if rejected > 6:
                return row, rejected
        row += 1
    return row, 0


def _fast(time: np.ndarray, number: np.ndarray, magnets: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the longest stretch of pulses that is not slow: near standstill the speed varies within a revolution."""
    if len(time) <= 2 * magnets:
        return time, number
    speed = (number[magnets:] - number[:-magnets]) / (time[magnets:] - time[:-magnets])
    slow = np.concatenate([[-1], np.flatnonzero(speed < SLOW * speed.max()), [len(speed)]])
    at = int(np.argmax(np.diff(slow)))
    some = slice(slow[at] + 1, slow[at + 1] + magnets)
    return time[some], number[some]


def uneven_magnets(time: np.ndarray, number: np.ndarray, magnets: int, breaks: np.ndarray) -> np.ndarray | None:
    """Return the spacing error of each magnet [pitches], (magnets,), where that is significant."""
    from scipy.interpolate import BSpline
    from scipy.stats import f as fisher

    start = np.concatenate([[0], breaks, [len(time)]])
    at = int(np.argmax(np.diff(start)))
    some = slice(start[at], start[at + 1])
    t, n = _fast(time[some], number[some], magnets)
    turns = (n[-1] - n[0]) / magnets
    free = len(t) - magnets
    knots = int(min(turns / 3, len(t) / 12, 60))
    if turns < 6 or knots < 2 or free < 4 * knots + 20:
        return None
    inner = t[np.linspace(0, len(t) - 1, knots + 2).astype(int)]
    vector = np.concatenate([[inner[0]] * 3, inner, [inner[-1]] * 3])
    smooth = BSpline.design_matrix(np.clip(t, vector[0], vector[-1]), vector, 3).toarray()
    place = n % magnets
    which = np.zeros((len(t), magnets))
    which[np.arange(len(t)), place] = 1.0
    which = which - which.mean(axis=1, keepdims=True)
    target = (n - n[0]).astype(float)
    without = target - smooth @ np.linalg.lstsq(smooth, target, rcond=None)[0]
    both = np.column_stack([smooth, which[:, 1:]])
    numbers = np.linalg.lstsq(both, target, rcond=None)[0]
    rest = target - both @ numbers
    dof = len(t) - both.shape[1]
    if dof < 20:
        return None
    ratio = (np.sum(without**2) - np.sum(rest**2)) / (magnets - 1) / max(np.sum(rest**2) / dof, 1e-300)
    if fisher.sf(ratio, magnets - 1, dof) > 1e-4:
        return None
    error = np.concatenate([[0.0], numbers[smooth.shape[1] :]])
    return error - error.mean()
