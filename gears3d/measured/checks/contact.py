"""Encoder faults that contact shows: a delay between encoders, drift, errors once per revolution of an encoder."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.measured.checks.view import MESH, PERIOD, Band, Finding, Places, View
from gears3d.signals import robust_deviation
from gears3d.signals.orders import harmonics, off_multiples, phasors_of

# A delay τ of the loose gear's channel takes Rb2·ω(t)·τ from the displacement. In contact nothing else is in phase with
# the speed: tooth compliance follows the acceleration, transmission error follows the angles. Where the drive's motion
# is in step with a revolution, orders of the flanks imitate a delay; they are fitted with it, which its uncertainty
# includes. Both flanks have the same orders but for the variation of the backlash, which is fitted where both are
# touched.

# Standard deviations from which a delay or a drift is reported.
SURE = 7.0
# Part of the backlash that a delay must move the displacement by, peak to peak.
LEAST = 0.01
# Part of the backlash by which contact may deviate from its fit; larger deviations are not contact.
ROUGH = 0.01
# Part of the speed's changes that waves of the flanks may explain, at most.
ALIKE = 0.985
# Part of the backlash that the noise of 1/60 of a period may be, and the residual of contact over the noise of blocks
# where it is more: gears in flight appear at rest there, and counts of a gear that hardly turns do not scatter.
HIDING, EXPLAINED = 0.0025, (0.7, 1.3)
# Blocks in a stretch, at least; blocks and part of a period spared at both ends: bounces die out, flight begins.
LONG, TRIM, SPARED = 8, 1, 0.08
# Part of a period that a stretch lasts, at least: in a shorter one any curvature imitates the speed.
LASTS = 0.12
# Half width of a flank's range, in backlashes, and the part of contact that must lie in two of them.
FLANK, PLACED = 0.08, 0.7
MOST = 12_000
MOST_ORDER = 12
# Orders that each flank has for itself: the backlash varies once per revolution.
OWN_ORDERS = 1
# Expected size of orders of the flanks, in backlashes.
WANDER = 0.3
# Groups of neighbouring blocks, at least, whose errors are taken as independent.
STEPS = 40


class Delay(NamedTuple):
    """How much later the loose gear is read.

    Args:
        value: [s].
        sigma: [s].
        fluctuation: change of the speed along the line of action in contact, peak to peak [m/s].
        off: root mean square of the residual in contact [m].
        imitated: part of the speed's changes that waves of the flanks could imitate.
        placed: part of the contact that lies on two flanks once the delay is taken out.
    """

    value: float
    sigma: float
    fluctuation: float
    off: float
    imitated: float
    placed: float


def examine_delay(view: View) -> list[Finding]:
    """Find a delay between both channels."""
    band = view.band
    if band is None or (delay := delay_of(view, band)) is None:
        return []
    backlash, moved = view.declared.backlash or 0.0, abs(delay.value) * delay.fluctuation
    hidden = band.noise * min(np.sqrt(PERIOD * band.frequency * band.width), 1.0) > HIDING * backlash
    explained = not hidden or EXPLAINED[0] < delay.off / band.noise < EXPLAINED[1]
    placed = delay.placed > PLACED and delay.off < max(ROUGH * backlash, 3.0 * band.noise)
    trusted = explained and placed and delay.imitated < ALIKE
    least = max(LEAST * backlash, 4.0 * delay.off)
    if not trusted or abs(delay.value) < SURE * delay.sigma or moved < least:
        return []
    which = "loose" if delay.value > 0.0 else "drive"
    told = (
        f"the {which} gear is read {1e6 * abs(delay.value):.4g} us (± {1e6 * delay.sigma:.2g}) after the other one: in "
    )
    told += f"contact the displacement follows the speed, {1e6 * moved:.3g} um peak to peak"
    return [
        Finding(
            "skew", str(MESH[1]), delay.value, "s", told, "or the shaft of the drive encoder is compliant", False, True
        )
    ]


def correct_delay(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Read the loose gear's channel earlier by the delay: whole rows are shifted, parts of one interpolated."""
    time, delay = columns["time_s"], findings[0].size
    inside = (time + delay >= time[0]) & (time + delay <= time[-1])
    shifted = np.interp(time[inside] + delay, time, columns[MESH[1]])
    return {name: shifted if name == MESH[1] else values[inside] for name, values in columns.items()}


def delay_of(view: View, band: Band) -> Delay | None:
    """Return the delay of the loose gear's channel, ``None`` where contact or changes of speed are too few."""
    inside = _chosen(band)
    if len(inside) < 50 or view.declared.radii is None or view.declared.backlash is None:
        return None
    stretch = band.stretch[inside]
    radius = view.declared.radii[1]
    backlash, group = view.declared.backlash, _groups(band.time[inside], stretch)
    waves = _orders(view, band, inside)
    columns = [-radius * band.speed[inside], band.acceleration[inside], band.time[inside], *waves]
    whole = np.column_stack([*columns, band.place[inside]])
    table = _centred(whole, stretch)
    spread = table.std(axis=0)
    if spread[0] <= 0.0:
        return None
    numbers, sigma, off = _fit(table, spread, group, band.noise, backlash)
    alike = _alike(table[:, 2:-1], table[:, 0])
    freed = whole[:, -1] - (whole[:, :-1] - whole[:, :-1].mean(axis=0)) @ numbers
    if (side := _sides(freed, stretch, backlash)) is not None:
        own = np.column_stack([side * wave for wave in _orders(view, band, inside, OWN_ORDERS)])
        table = np.column_stack([table[:, :-1], _centred(own, stretch), table[:, -1]])
        numbers, sigma, off = _fit(table, table.std(axis=0), group, band.noise, backlash)
    fluctuation = radius * float(np.ptp(np.quantile(band.speed[inside], [0.01, 0.99])))
    return Delay(float(numbers[0]), sigma, fluctuation, off, alike, _placed(freed, backlash))


def _sides(place: np.ndarray, stretch: np.ndarray, backlash: float) -> np.ndarray | None:
    """Return 1 for blocks whose stretch lies nearer to the reverse flank, -1 for the others, ``None`` for one flank."""
    _, at, count = np.unique(stretch, return_inverse=True, return_counts=True)
    mean = np.bincount(at, place) / count
    low, high = np.quantile(mean, [0.05, 0.95])
    return np.where(mean > 0.5 * (low + high), 1.0, -1.0)[at] if high - low > 0.5 * backlash else None


def _placed(place: np.ndarray, backlash: float) -> float:
    """Return the part of the places that lies in the two fullest narrow ranges: the flanks."""
    edges = np.arange(place.min() - backlash * FLANK, place.max() + 2.0 * backlash * FLANK, 0.5 * backlash * FLANK)
    if len(edges) > 10_000:
        return 0.0
    half = np.histogram(place, edges)[0]
    count = np.convolve(half, [1, 1, 1, 1], "valid") if len(half) > 4 else np.array([half.sum()])
    best = int(np.argmax(count))
    far = np.abs(np.arange(len(count)) - best) >= 4
    return float(count[best] + count[far].max(initial=0)) / len(place)


def _chosen(band: Band) -> np.ndarray:
    """Return blocks in the midst of contact, not too many: ends of stretches, where the gear lifts off, are spared."""
    edge = np.flatnonzero(np.diff(np.concatenate([[-2], band.stretch, [-2]])))
    first, last = edge[:-1], edge[1:]
    least = max(LONG, int(LASTS / (band.frequency * band.width)) if band.frequency else 0)
    good = (band.stretch[first] >= 0) & (last - first >= least)
    spared = int(SPARED / (band.frequency * band.width)) if band.frequency else 0
    cut = TRIM + np.minimum((last - first) // 4, spared)[good]
    first, last = first[good] + cut, last[good] - cut
    total = int((last - first).sum())
    every = max(total // MOST, 1)
    if len(first) > 20 * every:
        first, last, every = first[::every], last[::every], 1
    if not len(first):
        return np.zeros(0, np.intp)
    return np.concatenate([np.arange(begin, end, every) for begin, end in zip(first, last, strict=True)])


def _alike(columns: np.ndarray, speed: np.ndarray) -> float:
    """Return the part of the speed's changes that the other columns explain."""
    scale = np.sqrt(np.square(columns).sum(axis=0)) + 1e-300
    columns = columns / scale
    fit = np.linalg.pinv(columns.T @ columns, rcond=1e-9, hermitian=True) @ (columns.T @ speed)
    return 1.0 - float(np.square(speed - columns @ fit).sum() / np.square(speed).sum())


def _orders(view: View, band: Band, inside: np.ndarray, most: int | None = None) -> list[np.ndarray]:
    """Return waves of both gears up to an order; without one up to that in step with the drive, and of the mesh."""
    angles = {MESH[0]: band.drive[inside]}
    radii = view.declared.radii or (1.0, 1.0)
    if abs(radii[0] / radii[1] - 1.0) > 1e-6:
        angles[MESH[1]] = band.loose[inside]
    waves = []
    lasting = float(band.time[-1] - band.time[0])
    for k, angle in enumerate(angles.values()):
        turns = abs(float(angle[-1] - angle[0])) / (2 * np.pi) / lasting
        locked = int(band.frequency / turns) + 2 if turns > 0.0 else 2
        top = max(min(locked, MOST_ORDER), 2)
        teeth = [view.declared.teeth[k]] if view.declared.teeth else []
        for order in [*range(1, top + 1), *teeth] if most is None else range(1, most + 1):
            waves += [*harmonics(angle, [order]).T]
    return waves


def _centred(table: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Return the columns less their mean in each stretch: the place of a flank is a free parameter."""
    _, at, count = np.unique(stretch, return_inverse=True, return_counts=True)
    mean = np.column_stack([np.bincount(at, column) / count for column in table.T])
    return table - mean[at]


def _groups(time: np.ndarray, stretch: np.ndarray) -> np.ndarray:
    """Return the group of each block: its stretch, long ones cut."""
    length = float(time[-1] - time[0]) / STEPS
    return np.unique(np.column_stack([stretch, np.floor((time - time[0]) / length)]), axis=0, return_inverse=True)[1]


def _fit(
    table: np.ndarray, spread: np.ndarray, group: np.ndarray, noise: float, backlash: float
) -> tuple[np.ndarray, float, float]:
    """Return the coefficients, the delay's sigma from errors of whole groups, and the residual, without outliers."""
    scale = np.where(spread > 0.0, spread, 1.0)[:-1]
    columns, place = table[:, :-1] / scale, table[:, -1]
    size = np.full(len(scale), WANDER * backlash) * scale
    size[:3] = np.inf
    rough, keep = noise, np.ones(len(place), bool)
    for _ in range(4):
        normal = columns[keep].T @ columns[keep] + np.diag((rough / size) ** 2)
        inverse = np.linalg.pinv(normal, hermitian=True)
        numbers = inverse @ (columns[keep].T @ place[keep])
        off = place - columns @ numbers
        rough = max(robust_deviation(off), 0.3 * noise)
        keep = np.abs(off) < 5.0 * rough
    part = columns[keep] * off[keep, None]
    sums = np.column_stack([np.bincount(group[keep], column) for column in part.T])
    spread_of = inverse @ (sums.T @ sums) @ inverse
    floor = rough**2 * inverse[0, 0]
    left = float(np.sqrt(np.mean(off**2)))
    return numbers / scale, float(np.sqrt(max(spread_of[0, 0], floor)) / scale[0]), left


# Part of the backlash from which a drift is reported.
DRIFT = 0.03


def examine_drift(view: View) -> list[Finding]:
    """Find a dead band whose displacement does not repeat with the revolutions."""
    found = view.places
    if found is None:
        return []
    least = DRIFT * (view.declared.backlash or 0.0)
    either = "lost or additional counts, or a slipping hub or coupling"
    if abs(found.step) > max(least, SURE * found.step_sigma):
        told = f"the position of the active flank jumps by {1e6 * found.step:.4g} um at t = {found.step_time:.4g} s: "
        return [Finding("offset", "", found.step, "m", told + either, "split the record there")]
    if abs(found.drift) < max(least, SURE * found.drift_sigma) or found.step:
        return []
    told = f"the position of the active flank drifts by {1e6 * found.drift:.4g} um (± {1e6 * found.drift_sigma:.2g}), "
    told += f"{found.drift / (view.declared.backlash or 1.0):.0%} of the backlash: {either}, or thermal expansion"
    return [Finding("drift", "", found.drift, "m", told, "a linear drift is corrected in the analysis")]


# In contact an eccentric encoder of the loose gear imitates a transmission error. In flight it does not: the loose gear
# decelerates evenly there, and only its encoder bends the angle. An eccentric encoder of the drive shows in the drive's
# angle alone while the loose gear turns evenly; with a transmission error it is the reverse.

# Standard deviations, and part of the backlash, from which a wave is reported.
WAVE, WAVE_LEAST = 6.0, 0.05
# Relative difference up to which two amplitudes are the same.
NEAR = 0.3
# Flights that show whether a wave is in them.
FEWEST = 20
# Part of the backlash by which a flight is distant from both flanks.
AMID = 0.1
# Blocks in such a flight, at least, and so many flights at most.
FLOWN, FLIGHTS = 2, 3000
# Blocks in which a wave of the drive is sought.
SOUGHT = 4000
# Distances of neighbouring orders, which show the noise amplitude.
BESIDE = (-0.45, -0.35, -0.25, 0.25, 0.35, 0.45)


def examine_waves(view: View) -> list[Finding]:
    """Find waves of the displacement with the revolutions, and whose they are where that is decidable."""
    band, found = view.band, view.places
    if band is None or found is None:
        return []
    least = WAVE_LEAST * (view.declared.backlash or 0.0)
    told = []
    for (name, order), wave in found.waves.items():
        if abs(wave) > max(least, WAVE * found.sigma):
            told += _told(view, band, found, name, order)
    return told


def correct_waves(columns: dict[str, np.ndarray], findings: list[Finding]) -> dict[str, np.ndarray]:
    """Remove the waves of encoders."""
    corrected = dict(columns)
    for finding in findings:
        angle = columns[finding.channel]
        corrected[finding.channel] = angle - finding.size * np.cos(
            finding.parameters["order"] * angle + finding.parameters["phase_rad"]
        )
    return corrected


def _told(view: View, band: Band, found: Places, name: str, order: int) -> list[Finding]:
    wave, radii = found.waves[name, order], view.declared.radii or (1.0, 1.0)
    equal = abs(radii[0] / radii[1] - 1.0) < 1e-6
    seen = f"transmission error of the active flank has {1e6 * abs(wave):.4g} um (± {1e6 * found.sigma:.2g}) "
    seen += f"at order {order} "
    seen += "of both gears" if equal else f"of {name}"
    if name == MESH[0] and (own := _carried(view, band, order)) is not None and _same(own, -wave / radii[0]):
        seen += f"; {name} has this order with {abs(own):.3g} rad and the loose gear does not follow: "
        seen += "its encoder is eccentric"
        return [_encoder(name, order, own, seen)]
    flown = _flown(view, band, found, order) if name == MESH[1] or equal else None
    if flown is not None:
        own, sigma = flown
        meant = wave / radii[1]
        if equal:  # the same wave over the other gear's angle
            meant *= np.exp(1j * order * float(band.drive[0] - band.loose[0]))
        if abs(own) > WAVE * sigma and (_same(own, meant) or abs(own - meant) < 3.0 * sigma):
            seen += (
                f"; free flights have this order, too ({abs(own):.3g} rad): the encoder of the loose gear is eccentric"
            )
            return [_encoder(MESH[1], order, own, seen)]
        if abs(own) < 3.0 * sigma and abs(meant) > WAVE * sigma:
            return []
    if _in_step(band, name, order):
        return []
    remedy = "rotate an encoder on its shaft, or record flights; `gears3d segment` attributes this order to the flanks"
    return [Finding("wave", name, abs(wave), "m", f"{seen}: either an eccentric encoder or the gears", remedy)]


def _in_step(band: Band, name: str, order: int) -> bool:
    """Return whether an order has the frequency of the drive's fluctuation, or a multiple: rattle itself has these."""
    angle, lasting = band.drive if name == MESH[0] else band.loose, float(band.time[-1] - band.time[0])
    turns = abs(float(angle[-1] - angle[0])) / (2.0 * np.pi)
    periods = band.frequency * lasting
    return (
        periods > 0.0 and order * turns > periods - 1.0 and off_multiples(np.array([order * turns]), periods)[0] < 1.0
    )


def _same(one: complex, other: complex) -> bool:
    return abs(one - other) < NEAR * abs(other)


def _encoder(name: str, order: int, wave: complex, seen: str) -> Finding:
    about = {"order": float(order), "phase_rad": float(np.angle(wave))}
    return Finding("encoder-wave", name, abs(wave), "rad", seen, "", False, True, parameters=about)


def _carried(view: View, band: Band, order: int) -> complex | None:
    """Return the wave of the drive's own angle at an order [rad], ``None`` where its motion hides or imitates one."""
    lasting = float(band.time[-1] - band.time[0])
    turns = abs(float(band.drive[-1] - band.drive[0])) / (2 * np.pi)
    if any(abs(times * band.frequency * lasting - order * turns) < 3.0 for times in (1, 2) if band.frequency):
        return None
    some = slice(None, None, max(len(band.time) // SOUGHT, 1))
    time, drive = band.time[some], band.drive[some]
    row = (time - band.time[0]) / lasting
    base = [np.ones_like(row), row]
    for times in (1, 2, 3):
        if band.frequency:
            turn = 2 * np.pi * times * band.frequency * time
            base += [np.cos(turn), np.sin(turn), row * np.cos(turn), row * np.sin(turn)]
    even = 2 * np.pi * turns * row

    def amplitude(of: float, angle: np.ndarray) -> complex:
        table = np.column_stack([*base, harmonics(angle, [of])])
        return complex(phasors_of(np.linalg.lstsq(table, drive, rcond=None)[0][-2:])[0])

    own = amplitude(order, drive)
    usual = float(np.median([abs(amplitude(order + off, even)) for off in BESIDE]))
    return own if abs(own) > WAVE * usual else None


def _flown(view: View, band: Band, found: Places, order: int) -> tuple[complex, float] | None:
    """Return the wave of the loose gear's angle in its flights and its sigma [rad], ``None`` with too few flights."""
    angles: dict[str, np.ndarray] = {MESH[0]: band.drive, MESH[1]: band.loose}
    above = band.place - found.level
    for (name, times), wave in found.waves.items():
        above -= np.real(wave * np.exp(1j * times * angles[name]))
    spare = AMID * (view.declared.backlash or 0.0)
    flying = (above > spare) & (above < float(np.quantile(above, 0.999)) - spare)
    edge = np.diff(np.concatenate([[False], flying, [False]]).astype(np.int8))
    first, last = np.flatnonzero(edge == 1), np.flatnonzero(edge == -1) - 1
    good = last - first >= FLOWN
    begins = np.searchsorted(view.time, band.time[first[good]])
    ends = np.searchsorted(view.time, band.time[last[good]])
    rows, bends = [], []
    for begin, end in list(zip(begins.tolist(), ends.tolist(), strict=True))[:FLIGHTS]:
        time, angle = view.time[begin:end], view.angles[MESH[1]][begin:end]
        lasts = float(time[-1] - time[0])
        table = np.polynomial.legendre.legvander(2.0 * (time - time[0]) / lasts - 1.0, 2)
        shown = np.column_stack([angle - angle[0], harmonics(angle, [order])])
        fit = np.linalg.lstsq(table, shown, rcond=None)[0]
        weight = np.sqrt(len(time))
        rows.append(np.array([lasts**2, lasts * fit[1, 0], fit[2, 1], fit[2, 2]]) * weight)
        bends.append(fit[2, 0] * weight)
    if len(rows) < FEWEST:
        return None
    table, bend = np.array(rows), np.array(bends)
    keep = np.ones(len(bend), bool)
    for _ in range(4):
        numbers = np.linalg.lstsq(table[keep], bend[keep], rcond=None)[0]
        off = bend - table @ numbers
        rough = robust_deviation(off)
        keep = np.abs(off) <= 4.0 * rough
    inverse = np.linalg.pinv(table[keep].T @ table[keep])
    sigma = rough * float(np.sqrt(np.diag(inverse)[2:].max()))
    return complex(numbers[2], numbers[3]), sigma
