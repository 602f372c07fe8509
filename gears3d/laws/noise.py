"""Sound pressure levels of whine and rattle in the near field, re 20 µPa.

Source: Rigaud & Perret-Liaudet 2020, section 7. In print the reference pressure lacks its minus sign; it is 2·10⁻⁵ Pa.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

REFERENCE_PRESSURE = 2e-5  # Pref [Pa]
REFERENCE_POWER = 1e-12  # W
WHINE_30_RPM = 78.0  # Measured level of whine at 30 rpm and 0.22 N·m, eq. (22) [dB]


def pressure_level(pressure: ArrayLike) -> np.ndarray:
    """Return the level of a sound pressure, 20·log10(P/Pref) [dB].

    Args:
        pressure: root mean square, above 0 [Pa].

    Source: Rigaud & Perret-Liaudet 2020, eq. (22).

    >>> pressure_level([2e-5, 0.2]).round(9).tolist()
    [0.0, 80.0]
    """
    return 20.0 * np.log10(np.asarray(pressure, dtype=float) / REFERENCE_PRESSURE)


def power_level(power: ArrayLike) -> np.ndarray:
    """Return the level of a power, 10·log10(W/1 pW) [dB].

    Args:
        power: above 0 [W].

    Source: ISO 1683, whose reference is 1 pW.

    >>> power_level(1e-3).round(9).tolist()
    90.0
    """
    return 10.0 * np.log10(np.asarray(power, dtype=float) / REFERENCE_POWER)


def impacts_per_second(frequency: ArrayLike) -> np.ndarray:
    """Return the impacts a second of a motion with two impacts a period, n = ω/π [1/s].

    Args:
        frequency: circular, of the fluctuation, ω [rad/s].

    Source: Rigaud & Perret-Liaudet 2020, eq. (24).

    >>> impacts_per_second(6 * np.pi).round(9).tolist()
    6.0
    """
    return np.asarray(frequency, dtype=float) / np.pi


def rattle_drive(frequency: ArrayLike, amplitude: ArrayLike) -> np.ndarray:
    """Return ω²·ΔΩ, to which the acoustic power of rattle is proportional [rad³/s³].

    Each impact gives an energy proportional to ω·ΔΩ (23), and there are ω/π of them a second (24).

    Args:
        frequency: circular, of the fluctuation, ω [rad/s].
        amplitude: of the drive's speed ΔΩ [rad/s].

    Source: Rigaud & Perret-Liaudet 2020, eqs (23) to (25).

    >>> rattle_drive(2.0, 3.0).tolist()
    12.0
    """
    return np.asarray(frequency, dtype=float) ** 2 * np.asarray(amplitude, dtype=float)


def rattle_level(frequency: ArrayLike, amplitude: ArrayLike, constant: float) -> np.ndarray:
    """Return the level of rattle, 10·log10(A·ω²·ΔΩ) [dB].

    Args:
        frequency: circular, of the fluctuation, ω [rad/s].
        amplitude: of the drive's speed ΔΩ [rad/s].
        constant: A, of the bench and the place of the microphone, not printed [s³/rad³].

    Source: Rigaud & Perret-Liaudet 2020, eq. (26).

    >>> round(float(rattle_level(20.0, 2.0, 1e4) - rattle_level(2.0, 2.0, 1e4)), 9)
    20.0
    """
    return 10.0 * np.log10(constant * rattle_drive(frequency, amplitude))


def total_level(whine: ArrayLike, rattle: ArrayLike) -> np.ndarray:
    """Return the level of both sounds together, 10·log10(10^(Lw/10) + 10^(Lr/10)) [dB].

    Args:
        whine: Lw [dB].
        rattle: Lr [dB].

    Source: Rigaud & Perret-Liaudet 2020, eq. (27).

    >>> round(float(total_level(78.0, 78.0)), 4)
    81.0103
    """
    return 10.0 * np.logaddexp(np.asarray(whine) * np.log(10) / 10, np.asarray(rattle) * np.log(10) / 10) / np.log(10)
