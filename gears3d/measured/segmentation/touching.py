"""Orders of both gears in contact with one flank, from a measured record."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gears3d.measured.segmentation.orders import MOST, STRAY, Contact, columns_of, resolved, strongest
from gears3d.measured.segmentation.tables import Measurement, Segments
from gears3d.signals import robust_deviation
from gears3d.signals.orders import GEARS, deviations, phasors_of

# Blocks in one of four parts of the contacts from which on its mean counts: its noise is 25 % of one block's.
QUARTER = 20
# Impacts on a flank, at least, for where paths meet.
FEWEST = 4
# Places that are fitted at most.
ROWS = 20_000


def contact_orders(measurement: Measurement, flank: int = 0, most: int = MOST) -> dict[str, np.ndarray]:
    """Return the orders of both gears in the displacement while the gears touch, strongest first.

    An order is significant when noise alone would hardly be as strong, and when it predicts the revolutions
    from which it was not fitted. Phases refer to the datum of the record's own angles.

    Args:
        measurement: of a record.
        flank: 0 active, 1 reverse.
        most: orders that are taken at most.

    Returns:
        ``gear`` (0 drive, 1 loose; the drive's only where both turn equally fast), ``order``, ``amplitude_m``,
        ``sigma_m`` and ``phase_rad`` of amplitude·cos(order·θ + phase), and ``share``, the part of the variance that
        no other order of these explains, each (k,).

    >>> from gears3d.measured.segmentation import measure
    >>> from gears3d.scenario import load
    >>> from gears3d.simulation import record
    >>> wave = [{"kind": "transmission_error", "order": 5, "amplitude": "9 um", "phase": "30 deg"}]
    >>> bench = load("scenarios/rigaud-2020/fig5-20rpm.toml", {"motion.harmonics": [], "effect": wave})
    >>> bench = bench.with_({"sensors.loose.noise": "2e-6 rad"})
    >>> found = contact_orders(measure(record(bench), bench))
    >>> found["order"].tolist(), found["amplitude_m"].round(7).tolist()
    ([5], [9e-06])
    """
    cut = measurement.segments
    path, contacts = cut.path, cut.contacts
    near = within(path.time, contacts, path.width, flank)
    some = near[:: max(len(near) // ROWS, 1)]
    x = (path.time[some] - path.time[0]) / max(float(path.time[-1] - path.time[0]), 1e-300)
    base = np.stack([np.ones_like(x), x - 0.5, (x - 0.5) ** 2], axis=1)
    floor = max(path.noise, path.slack / np.sqrt(3.0))
    touched = Contact(base, np.stack([path.drive[some], path.loose[some]]), path.place[some], floor)
    highest = resolved(path.drive, path.loose)
    taken, numbers, covariance = strongest([touched], highest, most)
    phasors = phasors_of(numbers[0, base.shape[1] :])
    amplitude = np.abs(phasors)
    rank = np.argsort(-amplitude, kind="stable")
    found = {
        "gear": np.array([GEARS.index(gear) for gear, _ in taken], int),
        "order": np.array([order for _, order in taken], int),
        "amplitude_m": amplitude,
        "sigma_m": deviations(covariance[0, base.shape[1] :, base.shape[1] :]),
        "phase_rad": np.angle(phasors),
        "share": shares(touched, taken, numbers[0]),
    }
    return {name: column[rank] for name, column in found.items()}


def within(time: np.ndarray, contacts: dict[str, np.ndarray], width: float, flank: int | None = None) -> np.ndarray:
    """Return the indices of blocks that lie well within contacts.

    ``time``: of the blocks [s], (m,); ``width``: of a block [s]; ``flank``: 0 active, 1 reverse; ``None`` for both.
    """
    mine = np.ones(len(contacts["flank"]), bool) if flank is None else contacts["flank"] == flank
    start, end = contacts["start_s"][mine], contacts["end_s"][mine]
    lasts = end - start
    spare = np.minimum(np.maximum(0.15 * lasts, 2.0 * width), 0.4 * lasts)
    spare = np.minimum(spare, np.maximum(20.0 * width, 5e-3))
    first, stop = np.searchsorted(time, start + spare), np.searchsorted(time, end - spare)
    spans = [np.arange(a, b) for a, b in zip(first, stop, strict=True)]
    return np.concatenate([*spans, np.zeros(0, int)])


def place_slack(cut: Segments) -> tuple[float, float]:
    """Return the bound of the mean error of each flank's position [m]: active, reverse.

    Bounces too low to be resolved lie at the beginning of a contact, on one side of the flank. Their effect is
    bounded by the disagreement of the quarters of the contacts about the flank, or by half the noise of a block where
    no contact lasts long enough to be divided, and by the disagreement of the flank with where paths meet at impacts.
    """
    path, contacts = cut.path, cut.contacts
    slack = []
    lines = cut.flanks.places(path.time, path.drive, path.loose)
    for flank, line in enumerate(lines):
        near = within(path.time, contacts, path.width, flank)
        off = path.place[near] - line[near]
        mine = contacts["flank"] == flank
        start, end = contacts["start_s"][mine], contacts["end_s"][mine]
        own = np.searchsorted(start, path.time[near], "right") - 1
        part = np.floor(4.0 * (path.time[near] - start[own]) / (end[own] - start[own])) if len(near) else off
        close = np.abs(off) < 5.0 * cut.flanks.rough
        quarters = [off[close & (part == k)] for k in range(4)]
        means = [float(np.mean(one)) for one in quarters if len(one) > QUARTER]
        apart = float(np.std(means)) if len(means) > 1 else 0.5 * path.noise
        slack.append(float(np.hypot(apart, _depth(cut, flank))))
    return slack[0], slack[1]


def depths(flights: Mapping[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the depth of each impact behind the flank, its standard deviation [m], and the flank, each (k,).

    The path before an impact reaches the assumed flank at one moment, the path after it leaves it at another.
    Both paths meet deeper by the time between, over 1/v + 1/w.

    >>> two = {"struck": np.array([0, 0]), "blow": np.array([0, 1]), "end_s": np.array([1.0, 2.0])}
    >>> two |= {"start_s": np.array([0.0, 1.003]), "end_sigma_s": np.ones(2), "start_sigma_s": np.ones(2)}
    >>> two |= {"velocity_m_s": np.array([-2.0, -1.0]), "departure_m_s": np.array([0.0, 1.0])}
    >>> depths(two)[0].round(6).tolist()
    [0.002]
    """
    after = np.flatnonzero(np.asarray(flights["blow"]) == 1)
    after = after[after > 0]
    before = after - 1
    slow = 1.0 / np.abs(flights["velocity_m_s"][before]) + 1.0 / np.maximum(
        np.abs(flights["departure_m_s"][after]), 1e-9
    )
    apart = flights["start_s"][after] - flights["end_s"][before]
    sigma = np.hypot(flights["start_sigma_s"][after], flights["end_sigma_s"][before])
    return apart / slow, sigma / slow, np.asarray(flights["struck"][before], dtype=int)


def _depth(cut: Segments, flank: int) -> float:
    """Return by how much the paths before and after the impacts on a flank meet away from it, in the median [m]."""
    depth, sigma, struck = depths(cut.flights)
    own = depth[(struck == flank) & (sigma > 0.0) & np.isfinite(depth)]
    return float(np.median(own)) if len(own) >= FEWEST else 0.0


def shares(one: Contact, taken: list[tuple[str, int]], numbers: np.ndarray) -> np.ndarray:
    """Return the growth of the residual without each order, as a part of the residual without any, (k,).

    Where gears touch at some angles only, two orders may nearly cancel: their amplitudes show no share.

    ``numbers``: that were fitted, (p,).
    """
    columns = columns_of(one, taken)
    rest = one.place - columns @ numbers
    keep = np.abs(rest) <= STRAY * max(robust_deviation(rest), one.noise)
    rows, place = columns[keep], one.place[keep]
    base = rows[:, : one.base.shape[1]]
    total = place - base @ np.linalg.lstsq(base, place, rcond=None)[0]
    inverse = np.linalg.pinv(rows.T @ rows, hermitian=True)
    found, first = inverse @ (rows.T @ place), base.shape[1]
    pairs = [slice(at, at + 2) for at in range(first, len(found), 2)]
    more = np.array([found[pair] @ np.linalg.pinv(inverse[pair, pair]) @ found[pair] for pair in pairs])
    return np.clip(more / max(float(total @ total), 1e-300), 0.0, 1.0)
