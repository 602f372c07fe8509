"""What pulls at gears in flight at some place in the gap: decelerations over the place, in the paths of flights."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from gears3d.diagnosis.channels import BINS
from gears3d.diagnosis.evidence import Evidence
from gears3d.diagnosis.ringing import FAR
from gears3d.diagnosis.structure import FEWEST, Structure, level_of, likelihood
from gears3d.diagnosis.waving import paths_of

Array = np.ndarray
NEAR = (0.0, 0.03, 0.07, 0.12, 0.2, 0.35)
KNOTS = np.array([*NEAR, 0.5, *(1.0 - x for x in reversed(NEAR))])
"""Places in the gap, from the active to the reverse flank, between which decelerations go in straight lines."""

WEAK = 1e-3
"""Part of what is best known of the curve below which nothing is said of it: few flights come everywhere."""
PLACES = 201
"""Places at which the curve is judged."""
SHARE = 0.4
"""Part of what bends flights beyond noise that the place must explain: else it only comes along with something else."""


def placed(records: Sequence[Evidence], rest: Sequence[Array]) -> Iterator[Structure]:
    """Return the deceleration over the place in the gap, the same in all records, beside a constant one in each.

    Of one record alone nothing is told: whatever comes back with the drive's fluctuation goes by the place there.

    Args:
        records: all.
        rest: residuals of the flights by record, in standard deviations, each (f * BINS,).
    """
    from scipy.stats import chi2

    some = [(one, own) for one, own in zip(records, rest, strict=True) if len(own) and _both(one)]
    if len(some) < 2 or sum(len(own) for _, own in some) < FEWEST * BINS:
        return
    level = level_of(np.concatenate([own for _, own in some]))
    heavy, pull, held = [], [], [np.clip(own, -FAR * level, FAR * level) / level for _, own in some]
    for (one, _), value in zip(some, held, strict=True):
        columns = _columns(one)
        heavy.append(columns.T @ columns)
        pull.append(columns.T @ value)
    excess = [float(value @ value) - len(value) for value in held]
    told = np.linalg.lstsq(np.sum(heavy, axis=0), np.sum(pull, axis=0), rcond=WEAK)[0]
    gains = [float(2.0 * told @ force - told @ own @ told) for own, force in zip(heavy, pull, strict=True)]
    best = int(np.argmax(gains))
    gain, whole = sum(gains) - gains[best], sum(gains)
    if gain < SHARE * (sum(excess) - excess[best]):
        return
    place = np.linspace(0.0, 1.0, PLACES)
    curve = np.interp(place, KNOTS, told)
    curve -= np.mean(curve)
    where, size = float(place[int(np.argmax(np.abs(curve)))]), float(np.sqrt(np.mean(curve**2))) * level
    likely = [likelihood(max(own, 0.0), value) for own, value in zip(gains, held, strict=True)]
    chance = float(chi2.sf(min(gain, sum(likely) - max(likely)), len(KNOTS) - 1))
    yield Structure("flight.gap", gain, chance, size, "rad/s^2", where, whole * level**2, rank=gain * level**2)


def _both(one: Evidence) -> bool:
    """Whether both flanks are struck, so that it is known where they are."""
    return len(np.unique(one.channels.impacts.flank)) == 2


def _columns(one: Evidence) -> Array:
    """Return what decelerations about each place do to the points of flights, free of a constant one, (f * BINS, k)."""
    (drive, loose), struck = one.radii, one.channels.impacts
    where = drive * struck.drive - loose * struck.loose
    active, reverse = (float(np.median(where[struck.flank == side])) for side in (0, 1))
    time, angle, _ = one.fine
    at = drive * np.interp(time, one.channels.drive.time, one.channels.drive.angle) - loose * angle
    place = np.clip((at - active) / (reverse - active), 0.0, 1.0)
    made = [paths_of(one, np.interp(place, KNOTS, hat)).ravel() for hat in np.eye(len(KNOTS))]
    columns, constant = np.stack(made, axis=1), np.sum(made, axis=0)
    return columns - np.outer(constant, constant @ columns) / max(float(constant @ constant), 1e-300)
