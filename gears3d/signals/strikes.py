"""What each impact takes and gives: restitution, impulse, energy, interval; and their powers by flank."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gears3d.signals.pattern import FLANKS


def mass(impacts: Mapping[str, np.ndarray]) -> float | None:
    """Return the loose gear's equivalent mass on the line of action, from impulses and jumps of velocity.

    Args:
        impacts: with ``velocity_m_s``, ``rebound_m_s``, ``impulse_N_s`` where they are known, (k,).

    Returns:
        m = Σ|I| / Σ|ẋ⁺ − ẋ⁻| over the impacts that rebound [kg]; ``None`` where that is not known. A rebound of
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


def strikes(
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

    >>> hits = {"time_s": np.array([0.5]), "velocity_m_s": np.array([-0.02]), "rebound_m_s": np.array([0.01])}
    >>> found = strikes(hits, mass=3.0, speed=0.05)
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
