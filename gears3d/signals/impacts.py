"""Impacts, free flights and contacts: counts and regime, restitution and impulse, durations, stroke."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from math import pi
from typing import Any, NamedTuple

import numpy as np

FLANKS = ("active", "reverse")  # Names of the flanks, in the order of their codes
REGIMES = ("contact", "single_sided", "double_sided")
# Impacts after flights no higher than this, m, are not counted: they are the last trembling of a bounce
FLIGHT_HEIGHT_MIN = 0.05e-6
SHARE = 0.1  # A flank has impacts when they occur in more than this part of the periods
LANDED = -1  # Index of the impact of a flight that ended without one
ACTIVE, REVERSE, FLIGHT = 0, 1, 2  # States of the loose gear; the first two are the codes of the flanks
NEAR = 0.1e-6  # Closer to a flank than this counts as touching it [m]
ENOUGH = 20_000  # Samples of the fit at most


def regime(times: np.ndarray, flanks: np.ndarray, period: float, start: float, end: float) -> str:
    """Return which flanks have impacts in the steady motion.

    A flank with impacts in 10 % of the periods or fewer counts as one without: a transient that outlasted
    the settling time does not name the regime.

    Args:
        times: of the impacts that count [s], (k,).
        flanks: 0 active, 1 reverse, (k,).
        period: of the excitation [s].
        start: of what is looked at [s].
        end: of what is looked at [s].

    Returns:
        ``"contact"`` (no impacts), ``"single_sided"`` or ``"double_sided"``.

    Source: the three regimes of Comparin & Singh 1989 (no impact, single-sided and double-sided impacts).

    >>> regime(np.array([0.1, 0.6, 1.1, 1.6]), np.array([0, 1, 0, 1]), 1.0, 0.0, 2.0)
    'double_sided'
    """
    inside = (times >= start) & (times <= end)
    periods = max((end - start) / period, 1.0)
    struck = 0
    for flank in (0, 1):
        cycles = np.floor((times[inside & (flanks == flank)] - start) / period)
        struck += len(np.unique(cycles)) > SHARE * periods
    return REGIMES[struck]


def impacts_per_period(times: np.ndarray, period: float, start: float, end: float) -> float | None:
    """Return the mean number of impacts in a period, over the last whole number of periods.

    Args:
        times: of the impacts that count [s], (k,).
        period: of the excitation [s].
        start: of what is looked at [s].
        end: of what is looked at [s].

    Returns:
        The mean; ``None`` when there is not one whole period.

    >>> impacts_per_period(np.array([0.1, 0.6, 1.1, 1.6, 2.1]), 1.0, 0.0, 2.05)
    2.0
    """
    periods = int((end - start) / period + 1e-9)
    if periods < 1:
        return None
    first = end - periods * period
    return float(np.count_nonzero((times > first) & (times <= end)) / periods)


def mass(impacts: Mapping[str, np.ndarray]) -> float | None:
    """Return the loose gear's equivalent mass on the line of action, from impulses and jumps of velocity.

    Args:
        impacts: with ``velocity_m_s``, ``rebound_m_s``, ``impulse_N_s`` where they are known, (k,).

    Returns:
        ``m = Σ|I| / Σ|ẋ⁺ − ẋ⁻|`` over the impacts that rebound [kg]; ``None`` where that is not known. A rebound of
        exactly 0 is left out: it may stand for one too slow to count.

    Source: Kadmiri et al. 2012, eqs (27), (28).

    >>> mass({"velocity_m_s": np.array([-0.02]), "rebound_m_s": np.array([0.01]), "impulse_N_s": np.array([0.09])})
    3.0
    """
    if not {"rebound_m_s", "impulse_N_s"} <= impacts.keys():
        return None
    jump = np.abs(impacts["rebound_m_s"] - impacts["velocity_m_s"])
    impulse = np.abs(impacts["impulse_N_s"])
    known = np.isfinite(jump) & np.isfinite(impulse) & (impacts["rebound_m_s"] != 0.0)
    total = float(jump[known].sum())
    return float(impulse[known].sum()) / total if total > 0.0 else None


def impact_values(
    impacts: Mapping[str, np.ndarray], mass: float | None = None, speed: float | None = None
) -> dict[str, np.ndarray]:
    """Return what follows from the contract's columns for each impact.

    Args:
        impacts: ``time_s``, ``velocity_m_s`` and, where known, ``rebound_m_s``, ``impulse_N_s``, (k,).
        mass: equivalent mass m of the loose gear on the line of action [kg].
        speed: H·ω, amplitude of the drive's velocity fluctuation on the line of action [m/s].

    Returns:
        Columns (k,), NaN where unknown: ``restitution`` −ẋ⁺/ẋ⁻ (1); ``impulse_N_s``, from the mass where it was not
        recorded; ``impulse_dimensionless`` I/(m·H·ω) (1); ``energy_J`` lost, ½·m·(ẋ⁻² − ẋ⁺²); ``interval_s`` since
        the impact before.

    Source: Kadmiri et al. 2012, eqs (3), (27) to (29).

    >>> impacts = {"time_s": np.array([0.5]), "velocity_m_s": np.array([-0.02]), "rebound_m_s": np.array([0.01])}
    >>> found = impact_values(impacts, mass=3.0, speed=0.05)
    >>> {name: values.round(9).tolist() for name, values in found.items() if name != "interval_s"}
    {'restitution': [0.5], 'impulse_N_s': [0.09], 'impulse_dimensionless': [0.6], 'energy_J': [0.00045]}
    """
    before = impacts["velocity_m_s"]
    unknown = np.full(len(before), np.nan)
    after = impacts.get("rebound_m_s", unknown)
    heavy = np.nan if mass is None else mass
    ratio = np.divide(-after, before, out=unknown.copy(), where=before != 0.0)
    recorded = impacts.get("impulse_N_s", unknown)
    impulse = np.where(np.isfinite(recorded), recorded, heavy * (after - before))
    return {
        "restitution": ratio + 0.0,
        "impulse_N_s": impulse,
        "impulse_dimensionless": impulse / (heavy * speed) if speed else unknown.copy(),
        "energy_J": 0.5 * heavy * (before**2 - after**2),
        "interval_s": np.diff(impacts["time_s"], prepend=np.nan),
    }


def powers(
    velocities: np.ndarray, rebounds: np.ndarray, flanks: np.ndarray, mass: float | None, span: float
) -> dict[str, Any]:
    """Return, flank by flank, mean squares, effective restitution and the energy that the impacts take a second.

    Args:
        velocities: just before the impacts [m/s], (k,).
        rebounds: just after [m/s], NaN where unknown, (k,).
        flanks: 0 active, 1 reverse, (k,).
        mass: equivalent mass of the loose gear [kg], ``None`` where unknown.
        span: time that is looked at [s].

    Returns:
        For each flank ``active_velocity_mean_square_m2_s2``, ``active_restitution`` (the square root of mean square
        rebound over mean square velocity), ``active_energy_J_s``; for both ``energy_J_s``. ``None`` where unknown.

    Source: Rigaud & Perret-Liaudet 2020, fig. 7 (mean squared impact velocity) and section 7 (energy per second).

    >>> found = powers(np.array([-0.02]), np.array([0.01]), np.array([0]), 3.0, 2.0)
    >>> round(found["active_restitution"], 6), round(found["active_energy_J_s"], 9), found["reverse_restitution"]
    (0.5, 0.000225, None)
    """
    found: dict[str, Any] = {}
    total = 0.0 if mass is not None and span > 0.0 and np.isfinite(rebounds).all() else None
    for code, name in enumerate(FLANKS):
        mine = flanks == code
        before, after = velocities[mine] ** 2, rebounds[mine] ** 2
        known = before.size > 0 and bool(np.isfinite(after).all()) and float(before.sum()) > 0.0
        found[f"{name}_velocity_mean_square_m2_s2"] = float(before.mean()) if before.size else None
        found[f"{name}_restitution"] = float(np.sqrt(after.sum() / before.sum())) if known else None
        energy = None if total is None or mass is None else 0.5 * mass * float((before - after).sum()) / span
        found[f"{name}_energy_J_s"] = energy
        total = None if total is None or energy is None else total + energy
    found["energy_J_s"] = total
    return found


class Flights(NamedTuple):
    """Flights, one row each, in order of time.

    Args:
        start: when the flank was left [s], (n,).
        end: when the next one was touched [s], (n,).
        left: flank that was left, 0 active, 1 reverse, (n,).
        struck: flank that was touched, (n,).
        impact: index of the impact that ended it, -1 when it landed without one, (n,).
    """

    start: np.ndarray
    end: np.ndarray
    left: np.ndarray
    struck: np.ndarray
    impact: np.ndarray


def flights(
    times: np.ndarray, flanks: np.ndarray, contacts: Sequence[Sequence[float]] | np.ndarray, slack: float = 1e-9
) -> Flights:
    """Return the flights between touches: from an impact or the end of a contact to the next impact or contact.

    What lies before the first touch and after the last one is not known in full and left out.

    Args:
        times: of all impacts, the trembling ones too [s], (k,).
        flanks: 0 active, 1 reverse, (k,).
        contacts: permanent contacts as [flank, start s, end s], (c, 3).
        slack: what is not longer than this is not a flight [s].

    Returns:
        The flights, as exact as times and contacts are.

    >>> found = flights(np.array([0.3, 0.9]), np.array([1, 0]), [[0, 0.0, 0.1], [1, 0.3, 0.8]])
    >>> (found.end - found.start).round(9).tolist(), found.left.tolist(), found.struck.tolist()
    ([0.2, 0.1], [0, 1], [1, 0])
    """
    table = np.asarray(contacts, dtype=float).reshape(-1, 3)
    begins = np.concatenate([times, table[:, 1]])
    ends = np.concatenate([times, table[:, 2]])
    kinds = np.concatenate([flanks, table[:, 0]]).astype(np.int64)
    hit = np.concatenate([np.arange(len(times)), np.full(len(table), LANDED)])
    order = np.lexsort((ends, begins))
    begins, ends, kinds, hit = begins[order], ends[order], kinds[order], hit[order]
    if not begins.size:
        nothing = np.zeros(0)
        return Flights(nothing, nothing, *(nothing.astype(np.int64) for _ in range(3)))
    latest = np.maximum.accumulate(ends)
    rising = np.diff(latest, prepend=-np.inf) > 0.0
    holder = np.maximum.accumulate(np.where(rising, np.arange(len(ends)), 0))
    gap = np.flatnonzero(begins[1:] - latest[:-1] > slack)
    return Flights(latest[gap], begins[gap + 1], kinds[holder[gap]], kinds[gap + 1], hit[gap + 1])


def shares(contacts: Sequence[Sequence[float]] | np.ndarray, start: float, end: float) -> dict[str, float] | None:
    """Return which part of the time the gear rests on either flank and flies.

    Args:
        contacts: permanent contacts as [flank, start s, end s], (c, 3).
        start: of what is looked at [s].
        end: of what is looked at [s].

    Returns:
        ``active_share``, ``reverse_share``, ``flight_share``, together 1; ``None`` when no time is looked at.

    >>> shares([[0, 0.0, 0.5], [1, 0.75, 2.0]], 0.25, 1.25)
    {'active_share': 0.25, 'reverse_share': 0.5, 'flight_share': 0.25}
    """
    if not end > start:
        return None
    table = np.asarray(contacts, dtype=float).reshape(-1, 3)
    inside = np.maximum(np.minimum(table[:, 2], end) - np.maximum(table[:, 1], start), 0.0)
    part = [float(inside[table[:, 0] == code].sum()) / (end - start) for code in (0, 1)]
    return {"active_share": part[0], "reverse_share": part[1], "flight_share": max(1.0 - part[0] - part[1], 0.0)}


def times_of(
    impacts: Mapping[str, np.ndarray], contacts: Sequence[Sequence[float]] | np.ndarray, start: float, end: float
) -> dict[str, Any]:
    """Return how long flights, crossings and permanent contacts last, in a few numbers.

    Flights no higher than 0.05 µm are left out, as their impacts are; what began before ``start`` is, too.

    Args:
        impacts: ``time_s``, ``flank`` and, where known, ``flight_height_m`` and ``velocity_m_s``, all impacts, (k,).
        contacts: permanent contacts as [flank, start s, end s], (c, 3).
        start: of what is looked at [s].
        end: of what is looked at [s].

    Returns:
        ``flights``, ``flight_mean_s``, ``flight_longest_s``, ``flight_height_max_m``; for each flank
        ``active_crossings`` (flights from the other flank that end on it), ``active_crossing_mean_s``,
        ``active_crossing_velocity_mean_m_s`` (of the impacts that end them, without bounces),
        ``active_contacts`` (permanent ones that ended), ``active_contact_mean_s``; and the shares of :func:`shares`.
        ``None`` where there is nothing to count.

    >>> impacts = {"time_s": np.array([0.3, 0.9]), "flank": np.array([1, 0])}
    >>> found = times_of(impacts, [[0, 0.0, 0.1], [1, 0.3, 0.8]], 0.0, 1.0)
    >>> found["flights"], round(found["reverse_crossing_mean_s"], 9), round(found["reverse_contact_mean_s"], 9)
    (2, 0.2, 0.5)
    """
    every = flights(impacts["time_s"], impacts["flank"], contacts)
    unknown = np.full(len(impacts["time_s"]), np.nan)
    heights = np.append(impacts.get("flight_height_m", unknown), np.nan)[every.impact]
    counts = (every.start >= start) & (every.end <= end) & ~(heights <= FLIGHT_HEIGHT_MIN)
    some = Flights(*(column[counts] for column in every))
    heights, lasted = heights[counts], some.end - some.start
    known = heights[np.isfinite(heights)]
    found: dict[str, Any] = {
        "flights": len(lasted),
        "flight_mean_s": _mean(lasted),
        "flight_longest_s": float(lasted.max()) if lasted.size else None,
        "flight_height_max_m": float(known.max()) if known.size else None,
    }
    hard = np.append(impacts.get("velocity_m_s", unknown), np.nan)[some.impact]
    table = np.asarray(contacts, dtype=float).reshape(-1, 3)
    whole = table[(table[:, 1] >= start) & (table[:, 2] < end)]
    for code, name in enumerate(FLANKS):
        across = lasted[(some.struck == code) & (some.left != code)]
        stays = (whole[:, 2] - whole[:, 1])[whole[:, 0] == code]
        found[f"{name}_crossings"], found[f"{name}_crossing_mean_s"] = len(across), _mean(across)
        blows = hard[(some.struck == code) & (some.left != code)]
        found[f"{name}_crossing_velocity_mean_m_s"] = _mean(blows[np.isfinite(blows)])
        found[f"{name}_contacts"], found[f"{name}_contact_mean_s"] = len(stays), _mean(stays)
    part = shares(contacts, start, end)
    return found | (part or dict.fromkeys(("active_share", "reverse_share", "flight_share")))


def _mean(values: np.ndarray) -> float | None:
    return float(values.mean()) if values.size else None


def states(
    displacement: np.ndarray,
    active: np.ndarray | float,
    reverse: np.ndarray | float,
    tolerance: float = NEAR,
) -> np.ndarray:
    """Return for each sample whether the gear rests on a flank or flies.

    Args:
        displacement: of the loose gear [m], (n,).
        active: position of the active flank [m], one number or (n,).
        reverse: position of the reverse flank [m], one number or (n,).
        tolerance: distance from a flank that still counts as touching [m].

    Returns:
        0 on the active flank, 1 on the reverse flank, 2 in flight, int8 (n,).

    >>> states(np.array([0.0, 1e-4, 2e-4]), 0.0, 2e-4).tolist()
    [0, 2, 1]
    """
    state = np.full(np.shape(displacement), FLIGHT, dtype=np.int8)
    state[displacement >= reverse - tolerance] = REVERSE
    state[displacement <= active + tolerance] = ACTIVE
    return state


def durations(time: np.ndarray, state: np.ndarray) -> dict[int, np.ndarray]:
    """Return how long each stay in a state lasts; the first and the last, which are cut off, are left out.

    The gear leaves a flank slowly: a stay that ends in a flight looks longer than it was, by the time that it took to
    get out of the tolerance (:func:`contacts` corrects that).

    Args:
        time: of the samples, rising [s], (n,).
        state: of the samples, as :func:`states` gives them, (n,).

    Returns:
        For each state of :func:`states` the durations [s] in order of time, to within one sampling interval.

    >>> durations(np.arange(6.0), np.array([0, 2, 2, 1, 1, 1]))[2].tolist()
    [2.0]
    """
    change = np.flatnonzero(np.diff(state)) + 1
    length = np.diff(time[change])
    kind = state[change[:-1]]
    return {code: length[kind == code] for code in (ACTIVE, REVERSE, FLIGHT)}


def contacts(
    time: np.ndarray,
    displacement: np.ndarray,
    active: np.ndarray | float,
    reverse: np.ndarray | float,
    impacts: Mapping[str, np.ndarray],
    tolerance: float = NEAR,
) -> np.ndarray:
    """Return the permanent contacts that samples and impacts show.

    Contact is lost where the force on the flank passes zero, so the gap grows with the third power of time (with the
    second where the force jumps); that root of it, or another that is straighter, is carried back to zero. A stay near
    a flank that its last impact's rebound explains is a bounce, no contact.

    Args:
        time: of the samples, rising [s], (n,).
        displacement: of the loose gear [m], (n,).
        active: position of the active flank [m], one number or (n,).
        reverse: position of the reverse flank [m], one number or (n,).
        impacts: ``time_s``, ``flank`` and, where known, ``rebound_m_s``, (k,).
        tolerance: distance from a flank that still counts as touching [m].

    Returns:
        Flank, start [s] and end [s], (c, 3).

    >>> time = np.linspace(0.0, 1.0, 1001)
    >>> path = 1e-3 * np.maximum(time - 0.5, 0.0) ** 3
    >>> none = {"time_s": np.zeros(0), "flank": np.zeros(0)}
    >>> contacts(time, path, 0.0, 1.0, none).round(4).tolist()
    [[0.0, 0.0, 0.5]]
    """
    state = states(displacement, active, reverse, tolerance)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(state)) + 1, [len(state)]])
    gaps = (displacement - active, reverse - displacement)
    hits, struck = impacts["time_s"], impacts["flank"]
    rebounds = np.abs(impacts.get("rebound_m_s", np.full(len(hits), np.nan)))
    found = []
    for first, stop in pairwise(edges):
        flank = int(state[first]) if len(state) else FLIGHT
        if flank == FLIGHT:
            continue
        begin = time[first]
        before = time[first - 1] if first else -np.inf
        last = time[stop] if stop < len(time) else np.inf
        mine = np.flatnonzero((struck == flank) & (hits > before) & (hits < last))
        if mine.size:
            begin = hits[mine[-1]]
            if time[stop - 1] - begin < 3.0 * tolerance / (rebounds[mine[-1]] or np.inf):
                continue
        end = _departure(time, gaps[flank], stop, tolerance) if stop < len(time) else time[-1]
        if end > begin:
            found.append((float(flank), float(begin), float(end)))
    return np.array(found).reshape(-1, 3)


def _departure(time: np.ndarray, gap: np.ndarray, stop: int, tolerance: float) -> float:
    """Return when the gap that is open at sample ``stop`` began to open [s]."""
    some = slice(stop, min(stop + 64, len(time)))
    low = (gap[some] < 30.0 * tolerance) | (np.arange(len(gap[some])) < 4)
    rising = low & np.logical_and.accumulate(np.diff(gap[some], prepend=-np.inf) > 0)
    since, high = time[some][rising] - time[stop], gap[some][rising]
    if len(high) < 2:
        return float(time[stop])
    best, end = np.inf, 0.0
    for power in (3, 2, 1):
        slope, root = np.polyfit(since, high ** (1.0 / power), 1)
        error = float(np.abs((slope * since + root) ** power - high).max())
        if error < best and (len(high) > 2 or power == 3):
            best, end = error, -root / slope
    return float(time[stop] + min(end, 0.0))


def stroke(time: np.ndarray, angle: np.ndarray, period: float) -> float | None:
    """Return the amplitude of the drive angle's fluctuation at one frequency.

    Args:
        time: of the samples, rising [s], (n,).
        angle: of the drive gear [rad], (n,).
        period: of the fluctuation [s].

    Returns:
        Amplitude of the angle [rad], by least squares in addition to a steady rotation; times the base radius it is H.
        ``None`` for less than one period, fewer than 16 samples, or an amplitude below 1e-6 of the rotation.

    Source: Kadmiri et al. 2012, eqs (18), (26), y = H·cos(ωt − ϕ).

    >>> time = np.linspace(0.0, 2.0, 500)
    >>> round(stroke(time, 3.0 * time + 0.02 * np.cos(10.0 * pi * time + 1.0), 0.2), 9)
    0.02
    """
    step = max(len(time) // ENOUGH, 1)
    time, angle = time[::step], angle[::step]
    if len(time) < 16 or time[-1] - time[0] < period * (1 - 1e-9):
        return None
    since = time - 0.5 * (time[0] + time[-1])
    turn = 2 * pi / period * since
    basis = np.column_stack([np.ones(len(time)), since / (since[-1] or 1.0), np.cos(turn), np.sin(turn)])
    fit = np.linalg.lstsq(basis, angle - angle.mean(), rcond=None)[0]
    size = float(np.hypot(fit[2], fit[3]))
    return size if size > 1e-6 * float(np.ptp(angle)) else None
