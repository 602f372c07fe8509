"""Whether the motion repeats: stroboscopic comparison of the impacts, and the section through them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

TIME_TOLERANCE = 0.01
"""In periods."""
VELOCITY_TOLERANCE = 0.05
"""Relative to the root mean square of the impact speeds."""
FAR = (0.5, 0.309)
"""Parts of the time after which the impacts must come back, too."""
EASY, STRICT = 8, 0.2
"""Beyond this n the tolerances shrink to this part: by chance much comes near itself after many periods."""
RECURRING = 0.95
"""Part of the impacts that must come back."""


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
    """Return the phase at which the stroboscopic section is widest: not where a contact holds every state alike.

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
    """Return each value beside the one that follows it.

    Args:
        values: e.g. impact speeds or phases, or one column of a section, (k,).
        lag: how many places later.

    Returns:
        Pairs, (k - lag, 2).

    >>> return_map(np.array([1.0, 2.0, 3.0])).tolist()
    [[1.0, 2.0], [2.0, 3.0]]
    """
    return np.column_stack([values[: max(len(values) - lag, 0)], values[lag:]])
