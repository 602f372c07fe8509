"""The static transmission error as a sum of orders, synthesised from what two quantised encoders say."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike


class Orders(NamedTuple):
    """An error function, Σ aj·cos(j·θ + ϕj).

    Args:
        order: j, cycles per revolution, (n,).
        amplitude: aj [rad or m], (n,).
        phase: ϕj [rad], (n,).
    """

    order: np.ndarray
    amplitude: np.ndarray
    phase: np.ndarray

    def at(self, angle: ArrayLike, derivative: int = 0) -> np.ndarray:
        """Return the error, or a derivative with respect to the angle.

        Args:
            angle: θ [rad].
            derivative: how often the error is differentiated.

        Returns:
            Error [unit of the amplitudes / rad^derivative], of the shape of ``angle``.

        >>> two = Orders(np.array([1, 2]), np.array([1.0, 0.5]), np.zeros(2))
        >>> float(two.at(0.0)), float(two.at(0.0, 2))
        (1.5, -3.0)
        """
        angle = np.asarray(angle, dtype=float)[..., None]
        turned = self.order * angle + self.phase + 0.5 * np.pi * derivative
        return np.sum(self.amplitude * self.order.astype(float) ** derivative * np.cos(turned), axis=-1)


def averaged(error: ArrayLike, revolutions: int) -> np.ndarray:
    """Return the mean revolution of a record; the noise in it lifts the encoder's steps (dither).

    Source: Ottewill et al. 2010, section 4: 25 revolutions.

    Args:
        error: sampled evenly over whole revolutions [rad], (revolutions·n,).
        revolutions: how many they are.

    Returns:
        One revolution [rad], (n,).

    Raises:
        ValueError: the samples are no whole number a revolution.

    >>> averaged([0.0, 2.0, 1.0, 4.0], 2).tolist()
    [0.5, 3.0]
    """
    error = np.asarray(error, dtype=float)
    if revolutions < 1 or len(error) % revolutions:
        raise ValueError(f"{len(error)} samples are no whole number in each of {revolutions} revolutions")
    return error.reshape(revolutions, -1).mean(axis=0)


def strongest_orders(revolution: ArrayLike, keep: int = 21) -> Orders:
    """Return the strongest orders of one revolution, the strongest first; its mean is left out.

    Source: Ottewill et al. 2010, eq. (11), with 21 orders.

    Args:
        revolution: sampled evenly over one revolution [rad], (n,).
        keep: how many orders.

    Returns:
        At most ``keep`` orders.

    >>> angle = np.arange(100) * 2 * np.pi / 100
    >>> found = strongest_orders(np.cos(angle + 0.3) + 0.2 * np.cos(18 * angle + 1), 2)
    >>> found.order.tolist(), found.amplitude.round(9).tolist(), found.phase.round(9).tolist()
    ([1, 18], [1.0, 0.2], [0.3, 1.0])
    """
    revolution = np.asarray(revolution, dtype=float)
    count = len(revolution)
    spectrum = np.fft.rfft(revolution) * (2.0 / count)
    last = (count - 1) // 2  # an even count's last line has no phase
    lines = spectrum[1 : last + 1]
    chosen = np.argsort(-np.abs(lines), kind="stable")[:keep]
    return Orders(chosen + 1, np.abs(lines[chosen]), np.angle(lines[chosen]))
