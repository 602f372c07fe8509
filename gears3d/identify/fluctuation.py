"""The drive's speed fluctuation in a record, over time, and the record divided into its periods."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.signals import robust_deviation
from gears3d.signals.orders import harmonics

BINS = 192  # Bins of a period
_STEPS = 128  # Means of the drive's angle in a period before the fluctuation is fitted
_WINDOW = 2  # Periods in which one amplitude is fitted
_SMOOTH = 5  # Amplitudes, half a period apart, that a straight line runs through
FEWEST = 6  # Periods that a record must have


class Fluctuation(NamedTuple):
    """The drive's acceleration about its mean motion as the real part of level·exp(i·omega·t), slowly changing."""

    omega: float  # [rad/s]
    time: np.ndarray  # where it is known [s], (w,)
    level: np.ndarray  # complex amplitude of the acceleration [rad/s²], (w,)

    def phase(self, time: np.ndarray) -> np.ndarray:
        """Return the phase of the acceleration, a cosine's, at some times, growing [rad], (n,)."""
        return self.omega * time + np.interp(time, self.time, np.unwrap(np.angle(self.level)))

    def amplitude(self, time: np.ndarray) -> np.ndarray:
        """Return the amplitude of the acceleration at some times [rad/s²], (n,)."""
        return np.interp(time, self.time, np.abs(self.level))


class Periods(NamedTuple):
    """A record laid out by periods, which begin where the drive speeds up most and flanks are pressed hardest."""

    place: np.ndarray  # mean displacement in each bin [m], NaN where nothing was read, (k, BINS)
    drive: np.ndarray  # mean angle of the drive gear there [rad], (k, BINS)
    loose: np.ndarray  # mean angle of the loose gear there [rad], (k, BINS)
    time: np.ndarray  # mean time there [s], (k, BINS)
    phase: np.ndarray  # mean phase there, from the beginning of the period [rad], (k, BINS)
    middle: np.ndarray  # time in the middle of each period [s], (k,)
    level: np.ndarray  # amplitude of the drive's acceleration in each period [rad/s²], (k,)
    rise: np.ndarray  # its change from period to period [rad/s²], (k,)
    rate: np.ndarray  # of the phase, which a growing amplitude shifts [rad/s], (k,)
    omega: float  # of the fluctuation [rad/s]


def find_fluctuation(time: np.ndarray, angle: np.ndarray, frequency: float, file: str = "") -> Fluctuation:
    """Return amplitude and phase of the drive's speed fluctuation over time.

    >>> time = np.linspace(0.0, 4.0, 8001)
    >>> fluctuation = find_fluctuation(time, 3.0 * time + (0.1 + 0.02 * time) * np.cos(6 * np.pi * time), 3.0)
    >>> (fluctuation.amplitude(np.array([1.0, 2.0, 3.0])) / (6 * np.pi) ** 2).round(4).tolist()
    [0.12, 0.14, 0.16]
    """
    span = float(time[-1] - time[0])
    if span * frequency < FEWEST:
        remedy = f"record {FEWEST} periods or more"
        raise InputError(Fault("time_s", f"holds {span * frequency:.3g} periods of {frequency:.6g} Hz", remedy, file))
    edge = np.arange(time[0], time[-1], 1.0 / (frequency * _STEPS))
    at = np.unique(np.searchsorted(time, edge))
    at = at[at < len(time)]
    size = np.diff(at, append=len(time))
    if len(at) < 16 * span * frequency:
        raise InputError(Fault("theta_drive_rad", "is read less than 16 times a period", "record faster", file))
    mean = np.add.reduceat(time, at) / size
    angle = np.add.reduceat(angle, at) / size
    omega = 2.0 * np.pi * frequency
    shrunk = np.sinc(1.0 / _STEPS)
    middles = np.arange(mean[0] + 0.5 * _WINDOW / frequency, mean[-1] - 0.5 * _WINDOW / frequency, 0.5 / frequency)
    levels = np.zeros(len(middles), complex)
    for place, middle in enumerate(middles):
        low, high = np.searchsorted(mean, [middle - 0.5 * _WINDOW / frequency, middle + 0.5 * _WINDOW / frequency])
        since = mean[low:high] - middle
        turn, ramp = omega * mean[low:high], since * frequency
        columns = [np.ones_like(since), since, np.cos(turn), np.sin(turn), ramp * np.cos(turn), ramp * np.sin(turn)]
        found = np.linalg.lstsq(np.column_stack(columns), angle[low:high] - angle[low], rcond=None)[0]
        levels[place] = (found[2] - 1j * found[3]) / shrunk
    smooth = _smooth(levels)
    if len(smooth) < 2:
        raise InputError(Fault("time_s", "holds too few periods", f"record {FEWEST} periods or more", file))
    return Fluctuation(omega, middles, 2j * omega * np.gradient(smooth, middles) - omega**2 * smooth)


def _smooth(levels: np.ndarray) -> np.ndarray:
    """Return straight lines through a few neighbours each."""
    from scipy.signal import savgol_filter

    if len(levels) < _SMOOTH:
        return levels
    real, imaginary = (np.asarray(savgol_filter(part, _SMOOTH, 1)) for part in (np.real(levels), np.imag(levels)))
    return real + 1j * imaginary


def periods(
    fluctuation: Fluctuation, time: np.ndarray, place: np.ndarray, drive: np.ndarray, loose: np.ndarray
) -> Periods:
    """Return a record divided into the periods of its fluctuation, whole ones only."""
    inside = (time >= fluctuation.time[0]) & (time <= fluctuation.time[-1])
    time, place, drive, loose = time[inside], place[inside], drive[inside], loose[inside]
    phase = fluctuation.phase(time) / (2.0 * np.pi)
    first, last = int(np.ceil(phase[0])), int(np.floor(phase[-1]))
    bins = np.floor((phase - first) * BINS).astype(int)
    kept = (bins >= 0) & (bins < (last - first) * BINS)
    count = np.bincount(bins[kept], minlength=(last - first) * BINS).astype(float)
    count[count == 0.0] = np.nan

    def mean(values: np.ndarray) -> np.ndarray:
        sums = np.bincount(bins[kept], values[kept], minlength=(last - first) * BINS)
        return (sums / count).reshape(-1, BINS)

    moments = np.interp(first + np.arange(last - first) + 0.5, phase, time)
    rate = 2.0 * np.pi / np.diff(np.interp(first + np.arange(last - first + 1), phase, time))
    level = fluctuation.amplitude(moments)
    turn = 2.0 * np.pi * (mean(phase - first) - np.arange(last - first)[:, None])
    laid = (mean(place), mean(drive), mean(loose), mean(time), turn)
    return Periods(*laid, moments, level, np.gradient(level), rate, fluctuation.omega)


# Phases of the drive's acceleration in which the gear lies on the active flank, flights and bounces over [rad]
PRESSED = (0.3, 1.4)
ORDERS = (1, 2, 3)
MESH = (1, 2)  # Orders of the mesh
_ROUNDS = 4
_FAR = 3.0  # Deviations beyond which a bin weighs less


def phases() -> np.ndarray:
    """Return the phase in the middle of each bin [rad], (BINS,)."""
    return (np.arange(BINS) + 0.5) * 2.0 * np.pi / BINS


def pressed() -> np.ndarray:
    """Return which bins lie on the active flank in every regime, (BINS,)."""
    phase = phases()
    return (phase > PRESSED[0]) & (phase < PRESSED[1])


def flattened(found: Periods, teeth: tuple[int, int], file: str = "", quiet: np.ndarray | None = None) -> Periods:
    """Return periods without the flanks' waves, a slow drift and a delay between the encoders.

    They are fitted to the phases in which the drive speeds up: the gears are in contact there in every regime.
    Counting errors in these few phases, the same in every period, would imitate a delay, which continues into
    the flights: where quiet periods are known, all their phases are used.
    """
    shape = found.place.shape
    delay = np.cumsum(np.cos(np.tile(phases(), shape[0]))) * found.level.repeat(BINS) / found.level.max()
    columns = [np.ones(found.place.size), np.linspace(-1.0, 1.0, found.place.size), delay / np.abs(delay).max()]
    for angle, orders in ((found.drive, (*ORDERS, *(n * teeth[0] for n in MESH))), (found.loose, ORDERS)):
        if angle is found.loose and teeth[0] == teeth[1]:
            continue
        turns = np.nanmax(angle) - np.nanmin(angle)
        for order in orders:
            if turns * order > 4.0 * np.pi:
                columns += [*harmonics(angle.ravel(), [order]).T]
    basis = np.column_stack(columns)
    place = found.place.ravel()
    quiet = np.zeros(shape[0], bool) if quiet is None else quiet
    known = np.isfinite(place) & (np.tile(pressed(), shape[0]) | np.repeat(quiet, BINS))
    if known.sum() < 4 * basis.shape[1]:
        what = f"is read {int(known.sum())} times in contact that is sure"
        raise InputError(Fault("theta_loose_rad", what, "record longer, faster, or with more counts", file))
    numbers = _robust(basis[known], place[known])
    return found._replace(place=(place - basis @ numbers).reshape(shape))


def _robust(basis: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Return robust least squares, with less weight for large residuals."""
    weight = np.ones(len(place))
    numbers = np.zeros(basis.shape[1])
    for _ in range(_ROUNDS):
        numbers = np.linalg.lstsq(basis * weight[:, None], place * weight, rcond=None)[0]
        rest = place - basis @ numbers
        spread = max(robust_deviation(rest), 1e-15)
        weight = np.sqrt(np.minimum(1.0, _FAR * spread / np.maximum(np.abs(rest), 1e-300)))
    return numbers
