"""Impacts as a sound to listen to: every impact rings a few modes of a made-up structure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.errors import UsageError

PEAK = 0.9  # Loudest sample of a normalised sound, of full scale
LONGEST_S = 600.0  # Longest sound that is made [s]


class Mode(NamedTuple):
    """A mode that rings after an impact, as exp(-t/decay)·sin(2π·frequency·t).

    Args:
        frequency: [Hz].
        decay: time in which it falls to 1/e [s].
        weight: its part in the burst.
    """

    frequency: float
    decay: float
    weight: float


# A small steel box, chosen for the ear: no measured structure
MODES = (Mode(1150.0, 0.012, 1.0), Mode(2480.0, 0.007, 0.6), Mode(4370.0, 0.004, 0.35))


def ring(
    times: np.ndarray,
    strengths: np.ndarray,
    duration: float,
    rate: int = 48_000,
    modes: tuple[Mode, ...] = MODES,
    slow: float = 1.0,
) -> np.ndarray:
    """Return the sound of impacts: the sum of their bursts, not normalised.

    Bursts begin at the exact moment, between samples where it lies there, and keep their pitch in slow motion.

    Args:
        times: of the impacts [s], (k,).
        strengths: of the impacts, in any unit, (k,).
        duration: of the recording [s]; the sound is longer by the slowing and the last burst's ringing.
        rate: samples of the sound a second [Hz].
        modes: that ring.
        slow: how many times slower than real the impacts follow each other.

    Returns:
        The sound in units of the strengths, (n,).

    Raises:
        UsageError: a mode above half the sampling rate, no decay, slowing not above 0, more than ten minutes.

    >>> sound = ring(np.array([0.0]), np.array([2.0]), 0.01, 8000, (Mode(1000.0, 0.005, 1.0),))
    >>> sound[:3].round(4).tolist()
    [0.0, 1.3793, 1.9025]
    """
    from scipy.signal import lfilter

    _refuse(duration, rate, modes, slow)
    tail = 7.0 * max((one.decay for one in modes), default=0.0)
    total = int(np.ceil((duration * slow + tail) * rate)) + 1
    at = np.asarray(times, dtype=float) * slow * rate
    first = np.ceil(at - 1e-9).astype(np.int64)
    inside = (at >= 0.0) & (first < total)
    first, late, size = first[inside], (first - at)[inside] / rate, np.asarray(strengths, dtype=float)[inside]
    sound = np.zeros(total)
    for one in modes:
        pole = complex(-1.0 / one.decay, 2.0 * np.pi * one.frequency)
        kick = np.zeros(total, dtype=complex)
        np.add.at(kick, first, one.weight * size * np.exp(pole * late))
        sound += np.imag(np.asarray(lfilter([1.0], [1.0, -np.exp(pole / rate)], kick)))
    return sound


def normalised(sound: np.ndarray) -> tuple[np.ndarray, float]:
    """Return a sound as 16 bit integers with its loudest sample at nine tenths of full scale, and the factor to that.

    Args:
        sound: (n,) or (n, channels).

    Returns:
        int16 of the same shape, and the part of full scale that stands for 1 unit of the sound; 0 for silence.

    >>> whole, factor = normalised(np.array([0.0, -4.0, 2.0]))
    >>> whole.tolist(), factor
    ([0, -29490, 14745], 0.225)
    """
    loudest = float(np.abs(sound).max()) if sound.size else 0.0
    factor = PEAK / loudest if loudest >= np.finfo(float).tiny else 0.0  # of less it is not finite
    return np.rint(sound * factor * 32767).astype(np.int16), factor


def _refuse(duration: float, rate: int, modes: tuple[Mode, ...], slow: float) -> None:
    if not slow > 0.0:
        raise UsageError(f"slow is {slow:g}: a number above 0, 1 for real time, 10 for ten times slower")
    if duration * slow > LONGEST_S:
        text = f"the sound would last {duration * slow:.0f} s, more than {LONGEST_S:.0f} s"
        raise UsageError(f"{text}: cut the recording or slow it less")
    for one in modes:
        if not 0.0 < one.frequency < 0.5 * rate:
            raise UsageError(f"a mode of {one.frequency:g} Hz cannot be heard in {rate} samples a second")
        if not one.decay > 0.0:
            raise UsageError(f"a mode decays in {one.decay:g} s: give a time above 0")
