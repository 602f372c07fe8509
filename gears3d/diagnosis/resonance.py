"""A resonance in the readings: a frequency that stands out of every record's spectrum, whatever the speed.

What comes back with the drive or with an angle moves with the speed. What rings where an encoder is mounted, or in the
body that it is mounted on, does not; it shows before anything is cut, and spoils the cutting.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.diagnosis.paths import Paths
from gears3d.diagnosis.simulated import simulated
from gears3d.diagnosis.structure import Structure
from gears3d.errors import EngineError, InputError

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted
    from gears3d.measured.segmentation import Track

Array = np.ndarray
LOWEST, HIGHEST, APART = 20.0, 1000.0, 1.01
"""Frequencies that are tried [Hz], and from one to the next."""
PER = 10.0
"""Readings to a period of the highest at least; means of as many as that allows are taken before."""
SECONDS = 1.0
"""Length of the stretches whose spectra are averaged."""
WIDE, BESIDE = 0.06, 1.6
"""Part of a frequency over which power is taken, at least the drive's fluctuation, of whose multiples it is made;
times the frequency up and down where it is held against."""
STANDS_OUT = 10.0
"""Times what lies on a straight line between both sides that the power must be, in the record that shows it least."""
SMALL = 0.005
"""Part of the backlash by which it must move the readings (root mean square), to spoil anything."""
RECORDS, UNLIKE = 3, 1.2
"""Records without which a frequency that does not move is none; by how much neighbours' speeds must differ, and the
largest or fastest of their fluctuations from the others."""


class Resonance(NamedTuple):
    """A frequency that stands out of all records.

    Args:
        structure: as it is told.
        frequency: that were tried [Hz], (t,).
        power: of the displacement about each of them, a row a record [m²], (r, t).
    """

    structure: Structure
    frequency: Array
    power: Array


def resonance(
    admitted: Sequence[Admitted], paths: Paths, expected: Callable[[Admitted], Track | None] | None = None
) -> Resonance | None:
    """Return the resonance that stands out of all records; ``None`` where there is none.

    Args:
        admitted: records.
        paths: of the records.
        expected: gives the path of a record as the rig would have given it; by default simulated with the rigid model.
    """
    expected = expected or _expected
    rigs = [one.rig for one in admitted if one.rig is not None]
    speeds = sorted(abs(rig.motion.mean) for rig in rigs)
    if len(rigs) < RECORDS or speeds[-1] < UNLIKE ** (RECORDS - 1) * speeds[0]:
        return None
    first = [rig.motion.harmonics[0] for rig in rigs if rig.motion.harmonics]
    swings = [(one.frequency, one.amplitude) for one in first]
    if swings and all(max(each) < UNLIKE * min(each) for each in zip(*swings, strict=True)):
        return None  # the same fluctuation at every speed makes the same motion, with the same lines
    tried = LOWEST * APART ** np.arange(int(np.log(HIGHEST / LOWEST) / np.log(APART)))
    seen = [_spectrum(one, paths.of(one), tried) for one in admitted]
    ratio, power, sure = (np.array(column) for column in zip(*seen, strict=True))
    best = int(np.argmax(ratio.min(axis=0)))
    if not np.min(ratio[:, best]) > STANDS_OUT:
        return None
    paths_of_rig = [expected(one) for one in admitted]
    own = [np.ones(len(tried)) if known is None else _spectrum(one, known, tried)[0]
           for one, known in zip(admitted, paths_of_rig, strict=True)]  # fmt: skip
    ratio = ratio / np.maximum(own, 1.0)
    best = int(np.argmax(ratio.min(axis=0)))
    if not np.min(ratio[:, best]) > STANDS_OUT:
        return None  # the rattle of the rig has the same lines
    size = float(np.sqrt(np.mean(power[:, best] * (1.0 - 1.0 / ratio[:, best]))))
    if size < SMALL * rigs[0].rig().backlash:
        return None
    gain = float(np.sum(sure[:, best] * np.log(ratio[:, best]) ** 2))
    return Resonance(Structure("impact.duration", gain, 0.0, size, "m", float(tried[best]), gain), tried, power)


def _expected(one: Admitted) -> Track | None:
    """Return the path of a record that the rig would have given; ``None`` where the rigid model gives none."""
    assert one.rig is not None
    try:
        return Paths().of(simulated(one, one.rig))
    except (InputError, EngineError):  # the rig has what that model does not, or its path shows nothing
        return None


def _means(values: Array, together: int) -> Array:
    """Return means of neighbours."""
    whole = len(values) // together * together
    return values[:whole].reshape(-1, together).mean(axis=1)


def _spectrum(one: Admitted, known: Track, tried: Array) -> tuple[Array, Array, Array]:
    """Return by how much power about each frequency stands out, that power [m²], and how surely it is known, each (t,).

    The logarithm of power over a width, in so much time, is known to the root of one over their product.
    """
    from scipy.signal import welch

    assert one.rig is not None
    together = max(int(1.0 / (known.step * PER * HIGHEST)), 1)
    place = _means(known.radii[0] * known.drive - known.radii[1] * known.loose, together)
    rate = 1.0 / (known.step * together)
    turn, power = welch(place, rate, nperseg=min(int(SECONDS * rate), len(place)), detrend="linear")
    total = np.concatenate([[0.0], np.cumsum(power)]) * turn[1]
    # lines stand apart by the strongest harmonic's frequency; weak ones are slower, but carry no rattle
    strongest = max(one.rig.motion.harmonics, key=lambda each: each.amplitude, default=None)
    between = 0.0 if strongest is None else strongest.frequency

    def width(middle: Array) -> Array:
        return np.maximum(WIDE * middle, between)

    def about(middle: Array) -> Array:
        half = 0.5 * width(middle)
        ends = (np.interp(middle + sign * half, turn - 0.5 * turn[1], total[:-1]) for sign in (1.0, -1.0))
        return np.subtract(*ends)

    own, usual = about(tried), np.sqrt(about(tried / BESIDE) * about(tried * BESIDE))
    usual *= width(tried) / np.sqrt(width(tried / BESIDE) * width(tried * BESIDE))
    seen = tried * BESIDE < 0.4 * rate
    ratio = np.where(seen, own / np.maximum(usual, 1e-300), 0.0)
    return ratio, np.where(seen, own, np.nan), width(tried) * len(place) / rate
