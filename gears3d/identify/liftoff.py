"""Flights that begin where the drive slows down faster than the drag: how high, over phase and excitation."""

from __future__ import annotations

import numpy as np

_ROUNDING = -1e-12
_TURNS = 8
"""Rounds in which the phase of the loss is found."""


def lost_at(excitation: np.ndarray, ramp: np.ndarray) -> np.ndarray:
    """Return the phase at which contact is lost [rad], π where it is not, (k,).

    Args:
        excitation: Λ at phase π, (k,).
        ramp: relative change of the amplitude in a radian, (k,).
    """
    lost = np.full(len(excitation), np.pi)
    for _ in range(_TURNS):
        here = excitation * (1.0 + ramp * (lost - np.pi))
        lost = np.arccos(-1.0 / np.maximum(here, 1.0))
    return lost


def lifted(phase: np.ndarray, excitation: np.ndarray, ramp: np.ndarray | float = 0.0) -> np.ndarray:
    """Return the height of the first flight of each period, in units of the stroke: u = s·ω²/(Rb1·α).

    The drive's acceleration is α·(1 + ramp·(τ − π))·cos τ. From the loss at cos τ1 = −1/Λ on, the gap opens with
    u'' = −1/Λ − (1 + ramp·(τ − π))·cos τ until the gear is back on the flank; nothing is lifted up to Λ = 1.
    Source: Rigaud & Perret-Liaudet 2020, eqs (11)-(18).

    Args:
        phase: τ of the bins, rising from 0 to 2π [rad], (n,), or (k, n): of each period.
        excitation: Λ of the periods, at phase π, (k,).
        ramp: relative change of the amplitude in a radian, (k,) or one.

    Returns:
        Heights, (k, n), 0 on the flank.

    >>> found = lifted(np.linspace(0.0, 2 * np.pi, 2001), np.array([0.9, 1.039299]))
    >>> found.max(axis=1).round(5).tolist()  # 79.96 um at 5 rpm, 1 Hz of Rigaud & Perret-Liaudet 2020
    [0.0, 0.00648]
    """
    ramp = np.broadcast_to(np.asarray(ramp, dtype=float), excitation.shape)
    lost = lost_at(excitation, ramp)[:, None]
    slope = ramp[:, None]

    def twice(at: np.ndarray) -> np.ndarray:
        """Return the second antiderivative of (1 + ramp·(τ − π))·cos τ."""
        return slope * (2.0 * np.sin(at) - at * np.cos(at)) - (1.0 - slope * np.pi) * np.cos(at)

    def once(at: np.ndarray) -> np.ndarray:
        return slope * (np.cos(at) + at * np.sin(at)) + (1.0 - slope * np.pi) * np.sin(at)

    since = np.maximum(np.atleast_2d(phase) - lost, 0.0)
    fall = 0.5 * since**2 / np.maximum(excitation, 1e-300)[:, None]
    height = twice(lost) + once(lost) * since - twice(lost + since) - fall
    flying = np.minimum.accumulate(height > _ROUNDING, axis=1)
    return np.where(flying & (excitation[:, None] > 1.0), np.maximum(height, 0.0), 0.0)


def landed(phase: np.ndarray, excitation: np.ndarray, ramp: np.ndarray | float = 0.0) -> np.ndarray:
    """Return which bins lie after the first flight of their period, (k, n).

    Args:
        phase: τ of the bins [rad], (n,) or (k, n).
        excitation: Λ of the periods, (k,).
        ramp: relative change of the amplitude in a radian, (k,) or one.
    """
    lost = lost_at(excitation, np.broadcast_to(np.asarray(ramp, dtype=float), excitation.shape))[:, None]
    return (lifted(phase, excitation, ramp) == 0.0) & (np.atleast_2d(phase) > lost) & (excitation[:, None] > 1.0)
