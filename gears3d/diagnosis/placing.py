"""Decelerations in flight as a function of the place in the gap, from the paths of flights."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from gears3d.diagnosis.channels import BINS
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.structure import FEWEST, Structure, bounded, level_of, likelihood
from gears3d.diagnosis.waving import paths_of

Array = np.ndarray
NEAR = (0.0, 0.03, 0.07, 0.12, 0.2, 0.35)
# Places in the gap, from the active to the reverse flank, between which decelerations are interpolated linearly.
KNOTS = np.array([*NEAR, 0.5, *(1.0 - x for x in reversed(NEAR))])

# Fraction of the largest information on the curve below which a place is skipped: few flights reach every place.
WEAK = 1e-3
# Places at which the curve is evaluated.
PLACES = 201
# Fraction of the curvature of flights beyond noise that the place must explain; a correlated cause explains less.
SHARE = 0.4


class Pull(NamedTuple):
    """Decelerations over the place in the gap, in addition to a constant one in each record.

    Args:
        place: from the active flank, 0, to the reverse one, 1, (n,).
        common: of all records together [rad/s²], (n,).
        own: of each record alone; zero where its flights do not reach [rad/s²], (r, n).
        gains: fall of chi-square in each record by the common one, with its noise level, (r,).
        excess: chi-square beyond noise before, (r,).
        likely: twice the logarithm of the likelihood instead, (r,).
        level: of the noise in standard deviations.
    """

    place: Array
    common: Array
    own: Array
    gains: Array
    excess: Array
    likely: Array
    level: float


def pulled(records: Sequence[Evidence], rest: Sequence[Array]) -> Pull | None:
    """Return the deceleration over the place in the gap; ``None`` with fewer than two records that reach both flanks.

    One record is not sufficient: effects that repeat with the drive's fluctuation depend on the place there, too.

    Args:
        records: all.
        rest: residuals of the flights by record, in standard deviations, each (f * BINS,).
    """
    some = [(one, own) for one, own in zip(records, rest, strict=True) if len(own) and _both(one)]
    if len(some) < 2 or sum(len(own) for _, own in some) < FEWEST * BINS:
        return None
    level = level_of(np.concatenate([own for _, own in some]))
    held = [bounded(own, level) for _, own in some]
    columns = [_columns(one) for one, _ in some]
    heavy = [own.T @ own for own in columns]
    force = [own.T @ value for own, value in zip(columns, held, strict=True)]
    told = _solved(np.sum(heavy, axis=0), np.sum(force, axis=0))
    gains = np.array([2.0 * told @ pull - told @ own @ told for own, pull in zip(heavy, force, strict=True)])
    likely = np.array([likelihood(max(own, 0.0), value) for own, value in zip(gains, held, strict=True)])
    excess = np.array([float(value @ value) - len(value) for value in held])
    each = [level * _solved(own, pull) for own, pull in zip(heavy, force, strict=True)]
    place = np.linspace(0.0, 1.0, PLACES)
    own = np.array([np.interp(place, KNOTS, one) for one in each])
    return Pull(place, np.interp(place, KNOTS, level * told), own, gains, excess, likely, level)


def placed(records: Sequence[Evidence], rest: Sequence[Array]) -> Iterator[Structure]:
    """Return the deceleration over the place in the gap if it explains the curvature of flights, equal in all records.

    rest: by record, in standard deviations, each (f * BINS,).
    """
    from scipy.stats import chi2

    if (found := pulled(records, rest)) is None:
        return
    best, whole = int(np.argmax(found.gains)), float(np.sum(found.gains))
    gain = whole - float(found.gains[best])
    if gain < SHARE * (np.sum(found.excess) - found.excess[best]):
        return
    curve = found.common - np.mean(found.common)
    where, size = float(found.place[int(np.argmax(np.abs(curve)))]), float(np.sqrt(np.mean(curve**2)))
    sure = min(gain, float(np.sum(found.likely) - np.max(found.likely)))
    chance = float(chi2.sf(sure, len(KNOTS) - 1))
    square = found.level**2
    yield Structure("flight.gap", gain, chance, size, "rad/s^2", where, whole * square, rank=gain * square)


def _solved(heavy: Array, pull: Array) -> Array:
    return np.linalg.lstsq(heavy, pull, rcond=WEAK)[0]


def _both(one: Evidence) -> bool:
    """Whether both flanks have impacts, so that their places are known."""
    return len(np.unique(one.channels.impacts.flank)) == 2


def _columns(one: Evidence) -> Array:
    """Return the response of flight points to decelerations about each place, constant removed, (f * BINS, k)."""
    (drive, loose), struck = one.radii, one.channels.impacts
    where = drive * struck.drive - loose * struck.loose
    active, reverse = (float(np.median(where[struck.flank == side])) for side in (0, 1))
    time, angle, _ = one.fine
    at = drive * np.interp(time, one.channels.drive.time, one.channels.drive.angle) - loose * angle
    place = np.clip((at - active) / (reverse - active), 0.0, 1.0)
    made = [-paths_of(one, np.interp(place, KNOTS, hat)).ravel() for hat in np.eye(len(KNOTS))]
    columns, constant = np.stack(made, axis=1), np.sum(made, axis=0)
    return columns - np.outer(constant, constant @ columns) / max(float(constant @ constant), 1e-300)
