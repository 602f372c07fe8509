"""What a recording came to, in a few words and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, pi
from typing import Any

import numpy as np

from gears3d.laws import excitation as law
from gears3d.signals.impacts import (
    FLANKS,
    FLIGHT_HEIGHT_MIN,
    contacts,
    impact_values,
    impacts_per_period,
    mass,
    powers,
    regime,
    stroke,
    times_of,
)
from gears3d.signals.motion import motion

Table = Mapping[str, np.ndarray]


def window(signals: Table, meta: Mapping[str, Any]) -> tuple[float, float]:
    """Return begin and end of what is looked at: after settling, up to the last sample.

    Args:
        signals: with ``time_s`` [s], (n,).
        meta: with ``settle_s`` when something is to be left out.

    Returns:
        Begin and end [s]; both the same when the recording ends before it has settled.

    >>> window({"time_s": np.array([0.0, 1.0, 2.0])}, {"settle_s": 0.5})
    (0.5, 2.0)
    """
    time = signals["time_s"]
    if not len(time):
        return 0.0, 0.0
    start = max(float(time[0]), float(meta.get("settle_s") or 0.0))
    return min(start, float(time[-1])), float(time[-1])


def describe(signals: Table, impacts: Table, meta: Mapping[str, Any]) -> dict[str, Any]:
    """Return regime, repetition, speeds, energies and durations after the settling time.

    Impacts after flights no higher than 0.05 µm are left out, but for their energy: a step of the flanks in contact
    causes an impact without a flight. Where the height is not known, they count.

    Args:
        signals: with ``time_s`` [s], (n,); more of the contract's columns give more numbers.
        impacts: the contract's columns, (k,).
        meta: ``period_s`` [s], ``settle_s`` [s], ``lyapunov_1_s`` [1/s], ``contacts`` ([flank, start s, end s]),
            ``inertia_kg_m2``, ``drag_torque_N_m``, ``base_radius_drive_m``, ``base_radius_loose_m``, ``backlash_m``
            and ``effects``, as far as known.

    Returns:
        What JSON can hold, ``None`` for what is not known: ``regime``; ``motion`` (``"1T"``, ``"2T"``, ...,
        ``"quasi_periodic"``, ``"chaotic"``, ``"aperiodic"``, ``"too_short"``, ``None`` without impacts); ``impacts``,
        ``impacts_per_period``; for each flank ``active_impacts``, ``active_velocity_mean_m_s``,
        ``active_velocity_std_m_s``, ``active_impulse_dimensionless`` (mean) and what
        :func:`~gears3d.signals.impacts.powers` gives; ``mass_kg``, ``excitation`` (Λ); ``lyapunov_1_s``,
        ``lyapunov_std_1_s``, ``lyapunov_from`` (``"model"``, ``"recording"``; ``"wiped"``: contact wipes out every
        disturbance, the exponent is minus infinity); and what
        :func:`~gears3d.signals.impacts.times_of` gives, with ``durations_from`` (``"contacts"``: exact; ``"samples"``).

    >>> impacts = {"time_s": np.array([0.5]), "flank": np.array([0]), "velocity_m_s": np.array([-0.02])}
    >>> found = describe({"time_s": np.array([0.0, 1.0])}, impacts, {})
    >>> found["regime"], found["active_velocity_mean_m_s"], found["reverse_velocity_mean_m_s"]
    ('single_sided', -0.02, None)
    """
    start, end = window(signals, meta)
    some = counted(impacts, start, end)
    times, flanks, velocities = (some[name] for name in ("time_s", "flank", "velocity_m_s"))
    known = meta.get("period_s")
    period = float(known) if known else max(end - start, 1e-300)
    heavy = equivalent_mass(impacts, meta)
    speed = drive_speed(signals, meta)
    ones = impact_values(some, heavy, speed)
    moved = motion(signals, some, period, start, end, meta.get("lyapunov_1_s"))
    found: dict[str, Any] = {
        "regime": regime(times, flanks, period, start, end),
        "motion": moved.name,
        "impacts": len(times),
        "impacts_per_period": impacts_per_period(times, period, start, end) if known else None,
    }
    for code, name in enumerate(FLANKS):
        speeds = velocities[flanks == code]
        found[f"{name}_impacts"] = len(speeds)
        found[f"{name}_velocity_mean_m_s"] = float(speeds.mean()) if speeds.size else None
        found[f"{name}_velocity_std_m_s"] = float(speeds.std()) if speeds.size else None
        found[f"{name}_impulse_dimensionless"] = _mean(ones["impulse_dimensionless"][flanks == code])
    rebounds = some.get("rebound_m_s", np.full(len(times), np.nan))
    found |= powers(velocities, rebounds, flanks, heavy, end - start) | _energies(impacts, start, end, heavy)
    found |= {"mass_kg": heavy, "excitation": excitation(heavy, speed, meta)}
    found |= {"lyapunov_1_s": moved.exponent, "lyapunov_std_1_s": moved.deviation, "lyapunov_from": moved.source}
    if moved.exponent == -inf:
        found |= {"lyapunov_1_s": None, "lyapunov_from": "wiped"}
    return found | _durations(signals, impacts, meta, start, end)


def counted(impacts: Table, start: float, end: float) -> dict[str, np.ndarray]:
    """Return the impacts that count: from ``start`` to ``end`` and not after the last trembling of a bounce.

    Args:
        impacts: the contract's columns, (k,).
        start: [s].
        end: [s].

    >>> impacts = {"time_s": np.array([0.1, 0.5]), "flight_height_m": np.array([1e-4, 1e-9])}
    >>> counted(impacts, 0.0, 1.0)["time_s"].tolist()
    [0.1]
    """
    height = impacts.get("flight_height_m", np.full(len(impacts["time_s"]), np.nan))
    counts = (impacts["time_s"] >= start) & (impacts["time_s"] <= end) & ~(height <= FLIGHT_HEIGHT_MIN)
    return {name: values[counts] for name, values in impacts.items()}


def _energies(impacts: Table, start: float, end: float, mass: float | None) -> dict[str, float | None]:
    """Return the energies of :func:`powers` of all impacts; those after low flights count with a known rebound only."""
    unknown = np.full(len(impacts["time_s"]), np.nan)
    rebound = impacts.get("rebound_m_s", unknown)
    low = impacts.get("flight_height_m", unknown) <= FLIGHT_HEIGHT_MIN
    some = (impacts["time_s"] >= start) & (impacts["time_s"] <= end) & ~(low & ~np.isfinite(rebound))
    every = powers(impacts["velocity_m_s"][some], rebound[some], impacts["flank"][some], mass, end - start)
    return {key: value for key, value in every.items() if key.endswith("energy_J_s")}


def equivalent_mass(impacts: Table, meta: Mapping[str, Any]) -> float | None:
    """Return the loose gear's equivalent mass m = J/Rb2² [kg], from ``meta`` or else from the impulses.

    Args:
        impacts: the contract's columns, (k,).
        meta: ``inertia_kg_m2`` and ``base_radius_loose_m`` where known.

    Source: Kadmiri et al. 2012, eq. (13).

    >>> round(equivalent_mass({}, {"inertia_kg_m2": 0.0695, "base_radius_loose_m": 0.148}), 4)
    3.1729
    """
    inertia, radius = meta.get("inertia_kg_m2"), meta.get("base_radius_loose_m")
    return inertia / radius**2 if inertia and radius else mass(impacts)


def drive_speed(signals: Table, meta: Mapping[str, Any]) -> float | None:
    """Return H·ω, the amplitude of the drive's speed at ``period_s``, along the line of action [m/s].

    Args:
        signals: ``time_s`` and ``theta_drive_rad``, (n,).
        meta: ``period_s`` and ``base_radius_drive_m``.
    """
    period, radius = meta.get("period_s"), meta.get("base_radius_drive_m")
    if not period or not radius or "theta_drive_rad" not in signals:
        return None
    amplitude = stroke(signals["time_s"], signals["theta_drive_rad"], float(period))
    return None if amplitude is None else amplitude * radius * 2 * pi / float(period)


def excitation(mass: float | None, speed: float | None, meta: Mapping[str, Any]) -> float | None:
    """Return Λ = m·H·ω²/F with the base drag, the fluctuation of the drive at ``period_s`` and nothing else.

    Source: Kadmiri et al. 2012, eq. (24); Rigaud & Perret-Liaudet 2020, eq. (8).

    >>> rig = {"drag_torque_N_m": 0.22, "base_radius_loose_m": 0.148, "period_s": 1 / 3}
    >>> round(excitation(0.0695 / 0.148**2, 0.148 * 20 * pi / 30, rig), 4)
    12.4716
    """
    drag, radius = meta.get("drag_torque_N_m"), meta.get("base_radius_loose_m")
    if mass is None or speed is None or not drag or not radius:
        return None
    omega = 2 * pi / float(meta["period_s"])
    return law.excitation(mass, speed / omega, omega, drag / radius)


def contacts_of(signals: Table, impacts: Table, meta: Mapping[str, Any]) -> tuple[np.ndarray | None, str | None]:
    """Return the permanent contacts, [flank, start s, end s], and whether ``"contacts"`` or ``"samples"`` give them.

    Args:
        signals: with ``displacement_m`` where contacts were not written down.
        impacts: the contract's columns, (k,).
        meta: ``contacts``; or ``backlash_m`` and no ``effects``, which might move the flanks.

    >>> contacts_of({}, {}, {"contacts": [[0, 0.0, 1.0]]})
    (array([[0., 0., 1.]]), 'contacts')
    """
    written = meta.get("contacts")
    if written is not None:
        return np.asarray(written, dtype=float).reshape(-1, 3), "contacts"
    backlash = meta.get("backlash_m")
    if backlash is None or meta.get("effects") or "displacement_m" not in signals or not len(signals["time_s"]):
        return None, None
    return contacts(signals["time_s"], signals["displacement_m"], 0.0, float(backlash), impacts), "samples"


def _durations(signals: Table, impacts: Table, meta: Mapping[str, Any], start: float, end: float) -> dict[str, Any]:
    table, source = contacts_of(signals, impacts, meta)
    if table is None:
        return dict.fromkeys(times_of(impacts, [], start, start)) | {"durations_from": None}
    return times_of(impacts, table, start, end) | {"durations_from": source}


def _mean(values: np.ndarray) -> float | None:
    return float(values.mean()) if values.size and bool(np.isfinite(values).all()) else None
