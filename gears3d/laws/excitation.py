"""What the drive's fluctuation asks of the drag: Λ, dimensionless backlash, thresholds, riding on wavy flanks.

Source: Kadmiri et al. 2012, eqs (23), (24); Rigaud & Perret-Liaudet 2020, eqs (1)-(10).
"""

from __future__ import annotations

from math import inf

import numpy as np
from numpy.typing import ArrayLike


def excitation(mass: float, stroke: float, omega: float, force: float) -> float:
    """Return Λ = m·H·ω²/F = J·ω·ΔΩ·(Rb1/Rb2)/Td: contact of rigid teeth is lost above 1; infinite without drag.

    Source: Kadmiri et al. 2012, eq. (24); Rigaud & Perret-Liaudet 2020, eqs (7), (8).
    Theory: docs/theory/rattle.md, equation (3).

    Args:
        mass: m [kg].
        stroke: H [m].
        omega: circular frequency [rad/s].
        force: F [N].

    >>> [round(excitation(0.38, h, w, f), 3) for h, w, f in ((4.83e-3, 52.3, 14.5), (0.38e-3, 209.2, 18.9))]
    [0.346, 0.334]
    """
    inertial = mass * stroke * omega**2
    if force > 0.0:
        return inertial / force
    return inf if inertial > 0.0 else 0.0


def dimensionless_backlash(backlash: float, stroke: float) -> float:
    """Return j̄ = j/H; infinite where the drive does not fluctuate.

    Source: Kadmiri et al. 2012, eq. (23).

    Args:
        backlash: j [m].
        stroke: H [m].

    >>> dimensionless_backlash(1e-4, 2e-4)
    0.5
    """
    return backlash / stroke if stroke > 0.0 else inf


def threshold_amplitude(inertia: float, torque: float, omega: float, ratio: float = 1.0) -> float:
    """Return the amplitude of the drive's speed at which Λ = 1, ΔΩ* = Td/(J·ω)·Rb2/Rb1 [rad/s].

    Source: Rigaud & Perret-Liaudet 2020, eqs (9), (10).

    Args:
        inertia: J [kg·m²].
        torque: Td [N·m].
        omega: circular frequency [rad/s].
        ratio: Rb1/Rb2.

    >>> round(threshold_amplitude(0.0695, 0.22, 6 * np.pi) * 30 / np.pi, 3)
    1.604
    """
    return torque / (inertia * omega * ratio)


def threshold_omega(inertia: float, torque: float, amplitude: float, ratio: float = 1.0) -> float:
    """Return the circular frequency at which a speed amplitude has Λ = 1, ω* = Td/(J·ΔΩ)·Rb2/Rb1 [rad/s].

    Source: Rigaud & Perret-Liaudet 2020, eqs (9), (10).

    Args:
        inertia: J [kg·m²].
        torque: Td [N·m].
        amplitude: ΔΩ of the drive's speed [rad/s]; infinite for 0.
        ratio: Rb1/Rb2.

    >>> round(threshold_omega(0.0695, 0.22, 5 * np.pi / 30) / (2 * np.pi), 3)
    0.962
    """
    return torque / (inertia * abs(amplitude) * ratio) if amplitude else inf


def riding(
    radii: tuple[float, float],
    drive: tuple[ArrayLike, ArrayLike, ArrayLike],
    waves: ArrayLike,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the loose gear's angle, speed and acceleration while it rides on the active flank.

    Rb2·θ2 = Rb1·θ1 + Σ φ1(θ1) + Σ φ2(θ2). In print θ̈2 = θ̈1 + φ'·θ̈1 + φ''·θ̇1² with one φ(θ1); contact is lost
    where the *de*celeration exceeds Td/J.

    Source: Rigaud & Perret-Liaudet 2020, eqs (1)-(6).

    Args:
        radii: base radii of drive and loose gear [m].
        drive: the drive's angle [rad], speed [rad/s] and acceleration [rad/s²], (n,) each.
        waves: of the active flanks: gear (0 drive, 1 loose), order, amplitude [m], phase [rad], (k, 4).

    Returns:
        Angle [rad], speed [rad/s], acceleration [rad/s²], (n,) each.

    >>> angle, speed, acceleration = riding((0.1, 0.1), ([0.0], [2.0], [0.0]), [(0, 3, 1e-4, 0.0)])
    >>> round(float(acceleration[0]), 9)  # -amplitude·order²·Ω²/Rb
    -0.036
    """
    one, two = radii
    angle, speed, acceleration = (np.asarray(part, dtype=float) for part in drive)
    waves = np.asarray(waves, dtype=float).reshape(-1, 4)
    own, mate = waves[waves[:, 0] == 0.0, 1:], waves[waves[:, 0] == 1.0, 1:]
    rise, slope, bend = _waves(own, angle)
    loose = (one * angle + rise) / two
    for _ in range(30 if len(mate) else 0):  # the loose gear's own deviation shifts its angle
        loose = (one * angle + rise + _waves(mate, loose)[0]) / two
    _, slope_mate, bend_mate = _waves(mate, loose)
    arm = two - slope_mate
    omega = (one + slope) * speed / arm
    return loose, omega, ((one + slope) * acceleration + bend * speed**2 + bend_mate * omega**2) / arm


def _waves(waves: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return deviation [m], slope [m/rad] and bend [m/rad²]."""
    sums = np.zeros((3, *angle.shape))
    for order, amplitude, phase in waves:
        at = order * angle + phase
        sums += amplitude * np.stack([np.cos(at), -order * np.sin(at), -(order**2) * np.cos(at)])
    return sums[0], sums[1], sums[2]
