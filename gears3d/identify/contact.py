"""Where the flanks touch in measured records: slow turns in both directions, or contact during rattle, in bins."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.drive_motion import drive_motion
from gears3d.signals import noise_of
from gears3d.signals.noise import quantum

if TYPE_CHECKING:
    from gears3d.measured.checks import Admitted
    from gears3d.measured.segmentation import Segments

TURNING = 0.3  # Way at both ends on which the drive may not move smoothly [rad]
DITHERED = 0.3  # Noise in counts from which on counting makes no lines
FEWEST = 1000  # Readings of a way, at least, that tell its motion
SAWTOOTH = 400  # Harmonics of the sawtooth, at most
LAGS = 400  # Samples apart, at most, over which a gear is sought to turn by whole counts
WHOLE = 0.02  # Part of a count by which it may miss them
NEAR = 0.75  # Cycles over the record that a line of counting makes at most, to shift the mean place


def whole_count(angle: np.ndarray, declared: float | None) -> float:
    """Return the angle of a declared count where the readings are multiples of it, else 0 [rad].

    >>> whole_count(np.array([0.0, 0.25, 1.75]) * np.pi, 8) / np.pi, whole_count(np.array([0.0, 1.0]), 8)
    (0.25, 0.0)
    """
    if not declared:
        return 0.0
    count = 2 * np.pi / declared
    changes = np.diff(angle[:: max(len(angle) // 1000, 1)]) / count
    off = np.abs(changes - np.round(changes))
    return count if len(off) and np.mean(off < 1e-3 + 1e-13 * np.abs(angle).max() / count) > 0.99 else 0.0


def count_noise(counts: np.ndarray) -> float:
    """Return the noise of an angle before it was counted, in counts; rounding does not count as noise.

    Readings so far apart that the gear has turned by whole counts are equal except for noise: they differ by a count in
    2σ/√π of all cases while the noise σ is small.

    >>> place = 444.4444 * np.arange(20_000)
    >>> noise = np.random.default_rng(1).normal(size=len(place))
    >>> [round(float(count_noise(np.floor(place + sigma * noise))), 2) for sigma in (0.0, 0.1, 0.5)]
    [0.0, 0.1, 0.5]
    """
    if len(counts) < 2 * LAGS:
        return np.inf
    step = float(counts[-1] - counts[0]) / (len(counts) - 1)
    lag = np.arange(1, LAGS + 1)
    off = np.abs(lag * step - np.round(lag * step))
    best = int(lag[np.argmin(off)])
    if off[best - 1] > WHOLE:
        return np.inf
    apart = counts[best:] - counts[:-best]
    moved = float(np.var(apart - np.round(np.mean(apart))))
    return moved * np.sqrt(np.pi) / 2.0 if moved < 0.3 else float(np.sqrt(0.5 * (moved - 1.0 / 6.0)))


def shift_by_counting(
    angles: tuple[np.ndarray, np.ndarray], quanta: tuple[float, float], radii: tuple[float, float]
) -> float:
    """Return the error of a flank's mean position where the count rate is commensurate with the rotation [m]."""
    spare = len(angles[0]) // 8  # a way begins and ends at rest
    variance = 0.0
    for angle, count, radius in zip(angles, quanta, radii, strict=True):
        inner = angle[spare : len(angle) - spare]
        if count <= 0.0 or len(inner) < 2:
            continue
        counts = np.rint(inner / count)
        order = np.arange(1, SAWTOOTH + 1)
        row = np.arange(len(counts)) - 0.5 * (len(counts) - 1)
        step = float(row @ counts) / float(row @ row)  # of all readings: the first and the last are rounded
        still = np.abs(order * step - np.round(order * step)) * len(counts) < NEAR
        size = radius * count / (np.pi * order) * np.exp(-2.0 * (np.pi * order * count_noise(counts)) ** 2)
        variance += 0.5 * float(np.sum(size[still] ** 2))
    return float(np.sqrt(variance))


def off_by_counting(time: np.ndarray, angle: np.ndarray, quantum: float) -> np.ndarray:
    """Return the deviation of readings from the smooth motion of their gear [rad], (n,)."""
    from gears3d.measured.encoder import read_encoder
    from gears3d.measured.segmentation import steady

    off = np.zeros(len(time))
    inner = np.flatnonzero(np.minimum(np.abs(angle - angle[0]), np.abs(angle - angle[-1])) > TURNING)
    if len(inner) >= FEWEST and quantum > 0.0 and count_noise(np.rint(angle[inner] / quantum)) < DITHERED:
        rows = slice(int(inner[0]), int(inner[-1]) + 1)
        off[rows] = angle[rows] - steady(read_encoder(time[rows], angle[rows])).curve(time[rows])
    return off


PER_TOOTH = 12  # Bins a tooth of the drive; and so many a turn at least:
LEAST_BINS = 512
HARMONICS = 3  # Orders are looked at up to so many times the tooth number
SHORTEST = 0.95  # Turns of the drive that a way has at least
STEADY = 0.02  # part of the mean speed; an eccentric encoder makes less than 0.001
HELD = 0.7  # Largest acceleration over that of drag that leaves gears in contact; drag is known to some 30 %
STRETCHES = 2000  # of a record, between which speeds are differenced
AFTER_TURNING = 0.05  # Turns that are left out where the drive has changed its direction and the gears change flanks


class Contact(NamedTuple):
    """Contact with one flank, averaged in bins of the drive's angle."""

    drive: np.ndarray  # mean angle of each bin [rad], (n,)
    loose: np.ndarray  # of the loose gear [rad], (n,)
    place: np.ndarray  # mean displacement [m], (n,)
    weight: np.ndarray  # samples in it, mean 1, (n,)
    file: np.ndarray  # number of the record, (n,)
    turn: np.ndarray  # number of the drive's turn, different in different records, (n,)
    counted: np.ndarray  # place that the drive's own counting makes, as far as its smooth motion tells [m], (n,)
    width: float  # of the bins [rad of the drive]
    samples: float  # in a bin, on average
    # of both encoders in the displacement of slow turns [m]; a bin that is off by less is not off the flank
    count: float = 0.0

    @property
    def turns(self) -> float:
        """Turns of the drive that the bins cover."""
        return len(self.drive) * self.width / (2.0 * pi)


class Contacts(NamedTuple):
    """Contact of a gear pair, from its records."""

    # contact with the active and with the reverse flank; ``None`` without contact
    flanks: tuple[Contact | None, Contact | None]
    radii: tuple[float, float]  # base radii of drive and loose gear [m]
    teeth: tuple[int, int]  # of both
    pressure_angle: float  # working, transverse [rad]
    quanta: tuple[float, float]  # of the coarser reading of each gear [rad], 0 for a smooth one
    speed: float  # of the drive, mean of its size [rad/s]
    source: str  # ``"slow turns"`` or ``"rattle"``
    # what counting in step with the turning may put each flank's mean place off by, an entry a record [m]
    shifts: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    cuts: tuple[Segments, ...] = ()  # segmentation of records that rattle, where there are no slow turns
    unused: int = 0  # records that rattle in addition to slow turns


def read_contacts(records: Sequence[Admitted]) -> Contacts:
    """Return the contacts of records: complete passes of slow turns, or the contacts during rattle.

    Args:
        records: each with its rig.

    Raises:
        InputError: no rig, or no contact.
    """
    if not records or any(record.rig is None for record in records):
        file = records[0].file if records else ""
        raise InputError(Fault("--rig", "is missing", "give the scenario of the bench: base radii and teeth", file))
    rig = records[0].rig.rig()  # type: ignore[union-attr]
    radii, teeth = (rig.base_radius_drive, rig.base_radius_loose), (rig.teeth_drive, rig.teeth_loose)
    quanta = [0.0, 0.0]
    parts: tuple[list[Contact], list[Contact]] = ([], [])
    shifts: tuple[list[float], list[float]] = ([], [])
    rattling: list[Admitted] = []
    speeds = []
    for number, record in enumerate(records):
        drive, loose = (record.recording.signals[f"theta_{gear}_rad"] for gear in ("drive", "loose"))
        for place, angle in enumerate((drive, loose)):
            quanta[place] = max(quanta[place], quantum(angle) or 0.0)
        time = record.recording.time
        speeds.append(float(np.abs(np.diff(drive[:: max(len(drive) // 1000, 1)])).sum() / (time[-1] - time[0])))
        side = _sides(record, drive, loose, radii)
        if side is None:
            rattling.append(record)
            continue
        for flank in (0, 1):
            if (side == flank).any():
                off = _off(time, drive, side == flank, _counts(record)[0])
                binned = _bins(drive, loose, radii, side == flank, teeth[0], number, off)
                parts[flank].append(binned._replace(count=float(np.dot(radii, _counts(record)))))
                way = (drive[side == flank], loose[side == flank])
                shifts[flank].append(shift_by_counting(way, _counts(record), radii))
    flanks = (_joined(parts[0]), _joined(parts[1]))
    cuts = () if any(flanks) else tuple(_segmented(record) for record in rattling)
    if not any(flanks) and not cuts:
        example = "gears3d synthesize SCENARIO --test transmission-error"
        remedy = f"turn the drive slowly for a turn or more each way (`{example}`)"
        raise InputError(Fault("theta_drive_rad", "has no whole turn in contact", remedy, records[0].file))
    source = "rattle" if cuts else "slow turns"
    angle = rig.working_pressure_angle
    return Contacts(
        flanks,
        radii,
        teeth,
        angle,
        (quanta[0], quanta[1]),
        float(np.mean(speeds)),
        source,
        (tuple(shifts[0]), tuple(shifts[1])),
        cuts,
        0 if cuts else len(rattling),
    )


def _segmented(record: Admitted) -> Segments:
    """Return a record that rattles as free flights and contacts."""
    from gears3d.measured.segmentation import path_of, segments_of

    return segments_of(path_of(record.recording, record.rig, record.file), record.rig, record.file)


def _off(time: np.ndarray, drive: np.ndarray, chosen: np.ndarray, count: float) -> np.ndarray:
    """Return the deviation of the drive's readings on a flank from its smooth motion, by direction [rad]."""
    at = np.flatnonzero(chosen)
    ways = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
    return np.concatenate([off_by_counting(time[way], drive[way], count) for way in ways])


def _counts(record: Admitted) -> tuple[float, float]:
    """Return the angle of a count of both encoders as far as it shows or the rig declares it, 0 without [rad]."""
    found = []
    for gear in ("drive", "loose"):
        angle = record.recording.signals[f"theta_{gear}_rad"]
        declared = getattr(record.rig.sensors, gear).counts_per_revolution if record.rig else None
        found.append(quantum(angle) or whole_count(angle, declared))
    return found[0], found[1]


def _sides(record: Admitted, drive: np.ndarray, loose: np.ndarray, radii: tuple[float, float]) -> np.ndarray | None:
    """Return for every sample of slow turns the flank it touches, -1 for none; ``None`` for a record that rattles."""
    ways = ways_of(drive)
    side = np.full(len(drive), -1)
    for first, last, forth in ways:
        inner = slice(first, last)
        if first > 0:
            away = np.abs(drive[inner] - drive[first])
            first += int(np.searchsorted(away, 2.0 * pi * AFTER_TURNING))
        side[first:last] = 0 if forth else 1
    both = bool((side == 0).any() and (side == 1).any())
    if both or (_steady(record.recording.time, drive) and _held(record, drive, loose, radii)):
        return side if both or not _thrown(record, drive, radii) else None
    return None


def _thrown(record: Admitted, drive: np.ndarray, radii: tuple[float, float]) -> bool:
    """Whether the drive's fluctuation may separate the loose gear from its flank: it exceeds the deceleration by drag.

    Small amplitudes do at high frequency, in flights of less than the backlash and at nearly one speed.
    """
    assert record.rig is not None
    rig = record.rig.rig()
    harmonics = drive_motion(record.recording.time, drive).harmonics
    fastest = sum(2.0 * pi * one.frequency * one.amplitude for one in harmonics) * radii[0]
    return fastest > HELD * rig.drag_torque / rig.inertia * radii[1]


def _steady(time: np.ndarray, drive: np.ndarray) -> bool:
    """Whether the drive turns at one speed: where it fluctuates, a gear in contact repeats itself in step with that."""
    at = np.linspace(0, len(time) - 1, min(len(time), STRETCHES)).astype(int)
    step = np.diff(time[at])
    speed = np.diff(drive[at]) / step
    noise = 2.0 * max(noise_of(time, drive), quantum(drive) or 0.0) ** 2 / float(np.median(step)) ** 2
    return float(np.var(speed)) - noise < (STEADY * float(np.mean(speed))) ** 2


def _held(record: Admitted, drive: np.ndarray, loose: np.ndarray, radii: tuple[float, float]) -> bool:
    """Whether a record that turns one way never leaves its flank: it moves less than the gap is wide."""
    assert record.rig is not None
    place = radii[1] * loose - radii[0] * drive
    count = max(quantum(drive) or 0.0, quantum(loose) or 0.0) * max(radii)
    return float(np.ptp(place)) < 0.5 * record.rig.rig().backlash + 3.0 * count


def ways_of(drive: np.ndarray) -> list[tuple[int, int, bool]]:
    """Return the long enough passes of the drive between reversals: first, last, whether forwards.

    >>> there = np.linspace(0.0, 7.0, 700)
    >>> ways_of(np.concatenate([there, there[::-1]]))
    [(0, 699, True), (699, 1400, False)]
    """
    every = max(len(drive) // 20_000, 1)
    rough = drive[::every]
    corners, extreme, up = [0], 0, None
    swing = 2.0 * pi * 0.02
    for place in range(1, len(rough)):
        gone = rough[place] - rough[extreme]
        if up is None:
            if abs(gone) > swing:
                up, extreme = gone > 0.0, place
        elif (gone > 0.0) == up:
            extreme = place
        elif abs(gone) > swing:
            corners.append(extreme)
            up, extreme = not up, place
    edges = [min(corner * every, len(drive)) for corner in corners] + [len(drive)]
    found = []
    for first, last in pairwise(edges):
        gone = float(drive[last - 1] - drive[first])
        if abs(gone) >= 2.0 * pi * SHORTEST:
            found.append((first, last, gone > 0.0))
    return found


def _bins(
    drive: np.ndarray,
    loose: np.ndarray,
    radii: tuple[float, float],
    chosen: np.ndarray,
    teeth: int,
    file: int,
    off: np.ndarray,
) -> Contact:
    """Average samples in bins of the drive's angle.

    Bins are whole counts of a coarse encoder, whose rounding is then the same in each.
    """
    at = np.flatnonzero(chosen)
    turn = 2.0 * pi
    moved = float(np.abs(np.diff(drive[at])).sum()) / turn
    per_turn = int(max(min(max(PER_TOOTH * teeth, LEAST_BINS), len(at) / max(moved, 1e-9) / 2.0), 8))
    width = turn / per_turn
    _, number = np.unique(np.floor(drive[at] / width + 1e-9).astype(np.int64), return_inverse=True)
    size = np.bincount(number)
    means = [np.bincount(number, angle[at] - angle[at[0]]) / size + angle[at[0]] for angle in (drive, loose)]
    counted = -radii[0] * np.bincount(number, off) / size
    whole = size >= 0.5 * np.median(size)
    first, second = (mean[whole] for mean in means)
    place = radii[1] * second - radii[0] * first
    size = size[whole]
    turns = np.floor(first / turn).astype(int) + 1_000_000 * file
    count = np.full(len(first), file)
    return Contact(first, second, place, size / size.mean(), count, turns, counted[whole], width, float(size.mean()))


def _joined(parts: list[Contact]) -> Contact | None:
    if not parts:
        return None
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in Contact._fields[:7]}
    means = {name: float(np.mean([getattr(part, name) for part in parts])) for name in Contact._fields[7:]}
    return Contact(**arrays, **means)  # type: ignore[arg-type]
