"""Motion over periods of the excitation: Poincaré sections, period, closed curves, Lyapunov exponent."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, log
from typing import NamedTuple

import numpy as np

FEWEST_OF_CURVE = 100  # States below which nothing is said
# Part of the states that a neighbourhood holds; a smaller one is an arc of a curve that is folded more closely
BALLS = (0.08, 0.04, 0.02)
RETURNS = 9  # Returns that a neighbourhood has at least
AGREED = 0.8  # Part of the neighbourhoods that must return as a rotation does
BLOCKS = 8  # Stretches of the series whose exponents are compared
NOTHING = -27.6  # Logarithm of a distance, relative to the spread, that is rounding
REFERENCES = 2500  # States that are followed at most
FEWEST_OF_EXPONENT = 60  # States below which nothing is estimated
TIME_TOLERANCE = 0.01  # In periods
VELOCITY_TOLERANCE = 0.05  # Relative to the root mean square of the impact speeds
FAR = (0.5, 0.309)  # Parts of the time after which the impacts must come back, too
# Beyond this n the tolerances shrink to this part: by chance much comes near itself after many periods
EASY, STRICT = 8, 0.2
RECURRING = 0.95  # Part of the impacts that must come back
Table = Mapping[str, np.ndarray]
LONGEST = 32  # Largest n of nT that is tried; three repetitions must fit into the time that is looked at
ENOUGH = 24  # Periods below which a motion that does not repeat is too short to tell
MOST = 4000  # Periods of the section at most; the last ones are taken
MARGIN = 3.0  # A model's disturbance must have grown by e to this power, and the number of periods, to be called chaos
PER_PERIOD = 32  # States a period between which the distance of neighbours is followed
LEAST = 0.05  # Growth per period that an exponent from a recording must exceed by three deviations to be called chaos


def on_closed_curve(states: np.ndarray) -> bool | None:
    """Return whether the states follow each other as points of a rotation do.

    A rotation comes back to any arc after one of at most three numbers of steps, the largest of them the sum of the
    other two. A neighbourhood of a state on a closed curve is such an arc for any shape of the curve and however many
    loops it has; in chaos and noise the numbers of steps are of all sizes, in a periodic motion there is one.

    Args:
        states: equally long steps apart, (n, d); each column is scaled by its own spread.

    Returns:
        The verdict over all neighbourhoods; ``None`` with fewer than 100 states or without any spread.

    Source: Slater 1967, Proc. Camb. Phil. Soc. 63, 1115; as a test for invariant curves: Altmann, Cristadoro & Pazó
    2006, Phys. Rev. E 73, 056201.

    >>> angle = 2 * np.pi * 0.381966 * np.arange(300)
    >>> on_closed_curve(np.stack([np.cos(angle), np.sin(angle)], axis=1))
    True
    >>> on_closed_curve(np.random.default_rng(0).normal(size=(300, 2)))
    False
    """
    scale = states.std(axis=0)
    if len(states) < FEWEST_OF_CURVE or not scale.any():
        return None
    points = states / np.where(scale > 0.0, scale, 1.0)
    centres = points[:: max(len(points) // 60, 1)]
    counts = {max(int(part * len(points)), RETURNS) for part in BALLS}
    return any(_agreed(points, centres, count) >= AGREED for count in sorted(counts, reverse=True))


def _agreed(points: np.ndarray, centres: np.ndarray, count: int) -> float:
    """Return the part of the centres to whose ``count`` nearest points the series returns as a rotation does."""
    verdicts = []
    for centre in centres:
        distance = np.linalg.norm(points - centre, axis=1)
        inside = np.flatnonzero(distance <= np.partition(distance, count)[count])
        verdicts.append(_as_rotation(np.diff(inside)))
    return float(np.mean(verdicts))


def _as_rotation(returns: np.ndarray) -> bool:
    """Return whether numbers of steps between returns are those of a rotation, but for one in twenty at the rim."""
    sizes, counts = np.unique(returns, return_counts=True)
    order = np.argsort(-counts)[:3]
    if counts[order].sum() < 0.95 * len(returns) or len(sizes) < 2:
        return False
    three = np.sort(sizes[order])
    return len(three) < 3 or three[2] == three[0] + three[1]


class Exponent(NamedTuple):
    """An estimate.

    Args:
        value: per step; minus infinity when neighbours fall together.
        deviation: its standard deviation, per step.
        steps: of the series over which the growth was read.
    """

    value: float
    deviation: float
    steps: int


def exponent(states: np.ndarray, per: int = 1, apart: int = 10, longest: int = 25) -> Exponent | None:
    """Return the largest Lyapunov exponent per step of a series of states.

    Each state's nearest neighbour is followed, and the mean logarithm of the distance is fitted by a line over the
    steps until it has risen by six tenths towards that of states taken at random. The first step, in which a small
    distance turns into the growing direction, is left out where there are enough others. The deviation is that between
    stretches of the series, with the change that a fit over fewer steps would bring. With few steps to fit the estimate
    reads low by up to 20 %, and noise looks like chaos to it.

    Args:
        states: equally long steps apart, (n, d); each column is scaled by its own spread.
        per: steps in a period of the excitation; neighbours are looked for at the same phase of it.
        apart: periods that neighbours must be apart in time.
        longest: periods over which neighbours are followed at most.

    Returns:
        The estimate; ``None`` with fewer than 60 states or where no line is seen.

    Source: Rosenstein, Collins & De Luca 1993, Physica D 65, 117-134.

    >>> x = [0.3]
    >>> for _ in range(800):
    ...     x.append(4.0 * x[-1] * (1.0 - x[-1]))
    >>> found = exponent(np.array(x)[:, None])
    >>> bool(abs(found.value - np.log(2.0)) < 0.1)
    True
    """
    scale = states.std(axis=0)
    points = (states / np.where(scale > 0.0, scale, 1.0)).reshape(len(states), -1)
    if len(points) < FEWEST_OF_EXPONENT:
        return None
    if not scale.any():
        return Exponent(-np.inf, 0.0, 0)
    phase = 1e6 * (np.arange(len(points)) % per)
    if len(points) < 2 * (apart + 1) * per:
        return None
    near, gap = neighbours(np.column_stack([points, phase]), apart * per, 2 * apart + 2)
    rng = np.random.default_rng(0)
    one, shift = rng.integers(0, len(points), 4000), per * rng.integers(1, max(len(points) // per, 2), 4000)
    far = np.linalg.norm(points[one] - points[(one + shift) % (len(points) - len(points) % per)], axis=1)
    gaps = gap[(near >= 0) & (gap > 0.0)]
    if not gaps.size or not far.any():
        return Exponent(-np.inf, 0.0, 0) if np.any(near >= 0) else None
    far = float(np.mean(np.log(far[far > 0.0])))
    floor = float(np.mean(np.log(gaps)))
    ceiling = floor + 0.6 * (far - floor)
    reach = min(24, longest * per)
    while True:
        logs = _logs(points, near, gap, reach)
        if logs is None:
            return None
        mean = logs.mean(axis=0)
        if np.any(mean > ceiling) or reach >= longest * per:
            break
        reach = min(2 * reach, longest * per)
    if np.mean(logs[:, : reach // 2 + 1] <= NOTHING) > 0.5:
        return Exponent(-np.inf, 0.0, 0)
    below = int(np.argmax(mean > ceiling)) if np.any(mean > ceiling) else reach + 1
    first = 1 if below >= 4 else 0
    if below - first < 2:
        return None
    span = slice(first, below)
    value = _slope(mean[span])
    parts = np.array([_slope(one.mean(axis=0)[span]) for one in np.array_split(logs, BLOCKS)])
    shorter = _slope(mean[first : max(first + 2, below - max((below - first) // 3, 1))])
    deviation = float(np.hypot(parts.std(ddof=1) / np.sqrt(BLOCKS), value - shorter))
    return Exponent(value, deviation, below - first)


def _logs(points: np.ndarray, near: np.ndarray, gap: np.ndarray, reach: int) -> np.ndarray | None:
    """Return the logarithms of the distance between neighbours over the steps that follow, (rows, reach + 1)."""
    own = np.arange(len(points))
    rows = np.flatnonzero((near >= 0) & (np.maximum(near, own) + reach < len(points)) & (gap > 0.0))
    if len(rows) < FEWEST_OF_EXPONENT // 2:
        return None
    rows = rows[:: max(len(rows) // REFERENCES, 1)]
    follow = np.arange(reach + 1)
    distance = np.linalg.norm(points[rows[:, None] + follow] - points[near[rows][:, None] + follow], axis=2)
    return np.maximum(np.log(np.maximum(distance, 1e-300)), NOTHING)


def neighbours(points: np.ndarray, apart: int, looked_at: int) -> tuple[np.ndarray, np.ndarray]:
    """Return for each point its nearest neighbour that is far enough away in time.

    >>> neighbours(np.array([[0.0], [0.1], [5.0], [0.3]]), 2, 4)[0].tolist()
    [3, 3, 0, 1]
    """
    from scipy.spatial import KDTree

    most = min(looked_at, len(points))
    gaps, found = (np.asarray(one) for one in KDTree(points).query(points, k=most))
    allowed = np.abs(found - np.arange(len(points))[:, None]) >= apart
    pick = np.argmax(allowed, axis=1)
    row = np.arange(len(points))
    any_ = allowed[row, pick]
    return np.where(any_, found[row, pick], -1), gaps[row, pick]


def _slope(line: np.ndarray) -> float:
    return float(np.polyfit(np.arange(len(line)), line, 1)[0])


def periodicity(
    times: np.ndarray,
    flanks: np.ndarray,
    velocities: np.ndarray,
    period: float,
    start: float,
    end: float,
    longest: int = 8,
) -> int | None:
    """Return the smallest n for which the impacts repeat every n periods of the excitation.

    They must repeat after multiples of n periods, a half and three tenths of the time long, too: a motion that drifts,
    a slow beat or a quasi-periodic one, comes near itself after n periods but not after many times n.

    Args:
        times: of the impacts that count [s], (k,).
        flanks: 0 active, 1 reverse, (k,).
        velocities: of the impacts [m/s], (k,).
        period: of the excitation [s].
        start: of what is looked at [s].
        end: of what is looked at [s].
        longest: largest n that is tried.

    Returns:
        n, or ``None`` when nothing repeats, there are no impacts, or fewer than three repetitions to judge by.

    >>> times = np.arange(12) + np.where(np.arange(12) % 2, 0.1, 0.3)
    >>> periodicity(times, np.zeros(12), np.full(12, -0.02), 1.0, 0.0, 12.0)
    2
    """
    inside = (times >= start) & (times <= end)
    times, flanks, velocities = times[inside], flanks[inside], velocities[inside]
    if not times.size:
        return None
    slack = VELOCITY_TOLERANCE * float(np.sqrt(np.mean(velocities**2)))
    periods = (end - start) / period + 1e-9
    for n in range(1, min(longest, int(periods / 3.0)) + 1):
        shifts = {n} | {n * max(int(part * periods / n), 1) for part in FAR}
        close = 1.0 if n <= EASY else STRICT
        margins = (close * TIME_TOLERANCE * period, close * slack)
        if all(_recurs(times, flanks, velocities, shift * period, (start, end), margins) for shift in shifts):
            return n
    return None


def _recurs(
    times: np.ndarray,
    flanks: np.ndarray,
    velocities: np.ndarray,
    shift: float,
    span: tuple[float, float],
    margins: tuple[float, float],
) -> bool:
    """Return whether nearly every impact has its like ``shift`` seconds later and earlier, as far as the span goes."""
    margin, slack = margins
    later = times <= span[1] - shift - margin
    earlier = times >= span[0] + shift + margin
    hits = np.concatenate(
        [
            _recurring(times, flanks, velocities, which, step, margin, slack)
            for which, step in ((later, shift), (earlier, -shift))
        ]
    )
    return bool(hits.size and hits.mean() >= RECURRING)


def _recurring(
    times: np.ndarray,
    flanks: np.ndarray,
    velocities: np.ndarray,
    which: np.ndarray,
    shift: float,
    time_slack: float,
    velocity_slack: float,
) -> np.ndarray:
    """Return for each of the impacts ``which`` whether an equal one lies ``shift`` away."""
    found = []
    for flank in (0, 1):
        mine = np.flatnonzero(flanks == flank)
        asked = mine[which[mine]]
        if not asked.size:
            continue
        wanted = times[asked] + shift
        right = np.clip(np.searchsorted(times[mine], wanted), 0, len(mine) - 1)
        near = np.zeros(len(asked), dtype=bool)
        for candidate in (right, np.maximum(right - 1, 0)):
            there = mine[candidate]
            close = np.abs(times[there] - wanted) <= time_slack
            near |= close & (np.abs(velocities[there] - velocities[asked]) <= velocity_slack)
        found.append(near)
    return np.concatenate(found) if found else np.zeros(0, dtype=bool)


def section(times: np.ndarray, velocities: np.ndarray, period: float) -> np.ndarray:
    """Return the Poincaré section through the impacts.

    Args:
        times: of the impacts [s], (k,).
        velocities: of the impacts [m/s], (k,).
        period: of the excitation [s].

    Returns:
        Phase in cycles, 0 to 1, and velocity [m/s], (k, 2).

    >>> section(np.array([0.25, 1.25]), np.array([-0.02, -0.03]), 1.0).tolist()
    [[0.25, -0.02], [0.25, -0.03]]
    """
    return np.column_stack([np.mod(times / period, 1.0), velocities])


def stroboscope(
    signals: Mapping[str, np.ndarray],
    impacts: Mapping[str, np.ndarray],
    period: float,
    phase: float,
    start: float,
    end: float,
) -> np.ndarray:
    """Return the stroboscopic section: displacement and velocity once a period.

    Between samples the path follows the samples on the same side of an impact, so that no speed is averaged over one.

    Args:
        signals: ``time_s``, ``displacement_m``, ``velocity_m_s``, (n,).
        impacts: ``time_s``, (k,).
        period: of the excitation [s].
        phase: when in the period, in cycles after t = 0.
        start: of what is looked at [s].
        end: of what is looked at [s].

    Returns:
        Displacement [m] and velocity [m/s], a row a period, (m, 2).

    >>> time = np.linspace(0.0, 3.0, 31)
    >>> path = {"time_s": time, "displacement_m": time**2, "velocity_m_s": 2 * time}
    >>> stroboscope(path, {"time_s": np.zeros(0)}, 1.0, 0.55, 0.0, 3.0).round(6).tolist()
    [[0.3025, 1.1], [2.4025, 3.1], [6.5025, 5.1]]
    """
    time, place, speed = (signals[name] for name in ("time_s", "displacement_m", "velocity_m_s"))
    first = np.ceil((start / period - phase) * (1 - 1e-12))
    at = (np.arange(first, np.floor(end / period - phase) + 1) + phase) * period
    at = at[(at >= time[0]) & (at <= time[-1])] if len(time) > 1 else at[:0]
    if not at.size:
        return np.zeros((0, 2))
    left = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    step = time[left + 1] - time[left]
    share = (at - time[left]) / step
    hits = impacts["time_s"]
    before = np.searchsorted(hits, at) > np.searchsorted(hits, time[left])
    after = np.searchsorted(hits, time[left + 1]) > np.searchsorted(hits, at)
    smooth = (
        (1 + 2 * share) * (1 - share) ** 2 * place[left]
        + share * (1 - share) ** 2 * step * speed[left]
        + share**2 * (3 - 2 * share) * place[left + 1]
        + share**2 * (share - 1) * step * speed[left + 1]
    )
    from_left = place[left] + speed[left] * share * step
    from_right = place[left + 1] - speed[left + 1] * (1 - share) * step
    where = np.select([before & after, before, after], [np.interp(at, time, place), from_right, from_left], smooth)
    fast = np.select([before & ~after, after & ~before], [speed[left + 1], speed[left]], np.interp(at, time, speed))
    return np.column_stack([where, fast])


def widest_phase(
    signals: Mapping[str, np.ndarray],
    impacts: Mapping[str, np.ndarray],
    period: float,
    start: float,
    end: float,
    tried: int = 12,
) -> float:
    """Return the phase at which the stroboscopic section is widest: not where contact holds all states together.

    Args:
        signals: as for :func:`stroboscope`.
        impacts: as for :func:`stroboscope`.
        period: of the excitation [s].
        start: of what is looked at [s].
        end: of what is looked at [s].
        tried: number of phases.

    Returns:
        Phase in cycles.
    """
    phases = np.arange(tried) / tried
    spread = []
    for phase in phases:
        points = stroboscope(signals, impacts, period, float(phase), start, end)
        spread.append(float(points.std(axis=0)[1]) if len(points) else 0.0)
    return float(phases[int(np.argmax(spread))])


def return_map(values: np.ndarray, lag: int = 1) -> np.ndarray:
    """Return each value with the one that follows it.

    Args:
        values: e.g. impact speeds or phases, or one column of a section, (k,).
        lag: how many places later.

    Returns:
        Pairs, (k - lag, 2).

    >>> return_map(np.array([1.0, 2.0, 3.0])).tolist()
    [[1.0, 2.0], [2.0, 3.0]]
    """
    return np.column_stack([values[: max(len(values) - lag, 0)], values[lag:]])


class Motion(NamedTuple):
    """How a motion repeats.

    Args:
        name: ``"1T"``, ``"2T"``, ...; ``"quasi_periodic"``; ``"chaotic"``; ``"aperiodic"``; ``"too_short"``;
            ``None`` without impacts.
        exponent: largest Lyapunov exponent [1/s], minus infinity where contact wipes out every disturbance;
            ``None`` where it is not known.
        deviation: of an exponent that was estimated [1/s].
        source: of the exponent: ``"model"`` or ``"recording"``.
    """

    name: str | None
    exponent: float | None = None
    deviation: float | None = None
    source: str | None = None


def chaotic(exponent: float, span: float, period: float) -> bool:
    """Return whether a largest Lyapunov exponent of the model, over a finite time, says chaos.

    In regular motion a disturbance may still grow in proportion to time, so that ln(number of periods) is not a sign of
    chaos; what counts is growth well beyond that.

    >>> chaotic(2.0, 5.0, 1 / 3), chaotic(0.1, 5.0, 1 / 3), chaotic(float("-inf"), 5.0, 1.0)
    (True, False, False)
    """
    return exponent * span > MARGIN + log(max(span / period, 1.0))


def motion(signals: Table, impacts: Table, period: float, start: float, end: float, known: float | None) -> Motion:
    """Return how the motion repeats.

    A model's exponent says chaos where it is clearly positive. Then it is tested whether the impacts repeat, the
    stroboscopic section whether it is a closed curve, and neighbours in it whether they part.

    Args:
        signals: ``time_s`` and, where known, ``displacement_m``, ``velocity_m_s``, (n,).
        impacts: those that count: ``time_s``, ``flank``, ``velocity_m_s``, (k,).
        period: of the excitation [s].
        start: of what is looked at [s].
        end: of what is looked at [s].
        known: largest Lyapunov exponent of the model [1/s], ``None`` where no disturbance was followed.

    Returns:
        Its name and what is known of its exponent.

    >>> impacts = {"time_s": np.arange(30.0), "flank": np.zeros(30), "velocity_m_s": np.full(30, -0.02)}
    >>> motion({"time_s": np.arange(31.0)}, impacts, 1.0, 0.0, 30.0, None).name
    '1T'
    >>> few = {name: values[:2] for name, values in impacts.items()}
    >>> motion({"time_s": np.arange(3.0)}, few, 1.0, 0.0, 2.0, None).name
    'too_short'
    """
    known = None if known is None or np.isnan(known) else float(known)
    said = Motion(None, known, None, None if known is None else "model")
    times, flanks, velocities = (impacts[name] for name in ("time_s", "flank", "velocity_m_s"))
    if not times.size:
        return said
    if known is not None and chaotic(known, end - start, period):
        return said._replace(name="chaotic")
    n = periodicity(times, flanks, velocities, period, start, end, LONGEST)
    if n is not None:
        return said._replace(name=f"{n}T")
    if end - start < ENOUGH * period:
        return said._replace(name="too_short")
    begin = max(start, end - MOST * period)
    found = _by_section(signals, impacts, period, begin, end, said)
    return found or said._replace(name="aperiodic")


def _by_section(signals: Table, impacts: Table, period: float, start: float, end: float, said: Motion) -> Motion | None:
    """Return what the stroboscopic section tells, ``None`` if nothing."""
    if not {"displacement_m", "velocity_m_s"} <= signals.keys():
        return None
    points = stroboscope(signals, impacts, period, widest_phase(signals, impacts, period, start, end), start, end)
    spread = max(float(np.ptp(signals["velocity_m_s"])), 1e-300)
    if len(points) < 2 or float(points[:, 1].std()) < 1e-6 * spread:
        return None
    if on_closed_curve(np.hstack([points[:-1], points[1:]])):
        return said._replace(name="quasi_periodic")
    if said.exponent == -inf:
        return None
    grown = growth(signals, impacts, period, start, end)
    if grown is None:
        return None
    rate = PER_PERIOD / period
    if said.source is None:
        said = said._replace(exponent=grown.value * rate, deviation=grown.deviation * rate, source="recording")
        if (grown.value - 3.0 * grown.deviation) * PER_PERIOD > LEAST:
            return said._replace(name="chaotic")
    return said._replace(name="aperiodic")


def growth(signals: Table, impacts: Table, period: float, start: float, end: float) -> Exponent | None:
    """Return the largest Lyapunov exponent that a recording itself shows, per 32nd of a period."""
    whole = [stroboscope(signals, impacts, period, k / PER_PERIOD, start, end) for k in range(PER_PERIOD)]
    offset = int(np.argmin([phase_first(start, period, k / PER_PERIOD) for k in range(PER_PERIOD)]))
    whole = whole[offset:] + whole[:offset]
    count = min(map(len, whole))
    return exponent(np.stack([one[:count] for one in whole], axis=1).reshape(-1, 2), PER_PERIOD)


def phase_first(start: float, period: float, phase: float) -> float:
    """Return how long after ``start`` a phase comes for the first time, in cycles.

    >>> round(phase_first(1.0, 1.0, 0.25), 12)
    0.25
    """
    return float(np.mod(phase - start / period + 1e-9, 1.0) - 1e-9)
