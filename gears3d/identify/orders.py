"""Orders of a flank's place over the angles of both gears: which are there, how large, and how sure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.identify.contact import Contact
from gears3d.identify.order_lines import Line, Lines
from gears3d.identify.order_noise import by_turns, floor_of, left_of, near

LEVEL = 0.01
"""Chance of one false order among all that are looked at."""
MOST = 80
"""Orders that are fitted at most."""
SHARE = 0.3
"""Part of the largest power down to which orders are taken in one round."""
ROUNDS = 40
STRAY = 7.0
"""Deviations from the fit at which a bin is taken to be without contact."""
LEAST = 0.7
"""Part of the bins that is kept at least."""


class Fit(NamedTuple):
    """Orders of one flank.

    Args:
        lines: that were fitted.
        phasors: of each, amplitude·exp(i·phase) [m], (p,).
        deviation: of each part of a phasor [m], (p,).
        covariance: of the real and imaginary parts, one after the other [m²], (2p, 2p).
        offsets: mean place in each record [m], by number.
        offset_deviation: of these [m].
        chance: that noise makes an order so large, (p,).
        floor: deviation of each part of a phasor that noise makes at each order looked at [m], (m,).
        seen: amplitude of what was found or left at each order looked at [m], (m,).
        rest: of the bins [m], (n,).
        kept: bins that are in contact, (n,).
        freedom: degrees of freedom of the deviations.
        scatter: largest ratio of the deviation by turns to that by neighbouring orders.
        counted: of each, the same of what the drive's counting makes alone [m], (p,).
    """

    lines: tuple[Line, ...]
    phasors: np.ndarray
    deviation: np.ndarray
    covariance: np.ndarray
    offsets: dict[int, float]
    offset_deviation: float
    chance: np.ndarray
    floor: np.ndarray
    seen: np.ndarray
    rest: np.ndarray
    kept: np.ndarray
    freedom: float
    scatter: float
    counted: np.ndarray


def find(contact: Contact, lines: Lines, ratio: float) -> list[Line]:
    """Return the orders of a flank that stand out of its noise.

    The largest come first; each round looks at what the orders so far leave over.

    Args:
        contact: with the flank.
        lines: that are looked at.
        ratio: turns of the loose gear in a turn of the drive.
    """
    found: list[Line] = []
    for _ in range(ROUNDS):
        made = fit(contact, lines, found, ratio)
        free = ~near(lines, made.lines, contact.turns)
        power = np.where(free, made.seen**2, 0.0)
        limit = -2.0 * made.floor**2 * np.log(LEVEL / (2 * len(lines.all)))
        new = (power > limit) & (power > SHARE * power.max())
        if not new.any() or len(found) >= MOST:
            break
        strongest = np.flatnonzero(new)[np.argsort(-power[new])]
        for place in strongest:
            if (
                not any(abs(lines.frequency[place] - _frequency(line, ratio)) * contact.turns < 1.5 for line in found)
                or place == strongest[0]
            ):
                found.append(lines.all[place])
        found = found[:MOST]
    return [line for line, chance in zip(made.lines, made.chance, strict=True) if chance < LEVEL / (2 * len(lines.all))]


def fit(contact: Contact, lines: Lines, chosen: list[Line], ratio: float) -> Fit:
    """Fit orders to a flank by least squares, on the angles of both gears at once.

    Noise is what stands at neighbouring orders that are not among the fitted ones: it counts what comes again every
    turn, as rounding to counts does; where turns scatter by more, their scatter is taken.

    Args:
        contact: with the flank.
        lines: that are looked at.
        chosen: those that are fitted.
        ratio: turns of the loose gear in a turn of the drive.
    """
    return _judged(contact, lines, chosen, solve(contact, chosen, ratio))


class Solved(NamedTuple):
    """Least squares of orders.

    Args:
        design: a column a record, then two an order, (n, q).
        numbers: (q,).
        inverse: of the weighted normal matrix, (q, q).
        rest: of the bins [m], (n,).
        kept: bins that are in contact, (n,).
    """

    design: np.ndarray
    numbers: np.ndarray
    inverse: np.ndarray
    rest: np.ndarray
    kept: np.ndarray


def solve(contact: Contact, chosen: list[Line], ratio: float) -> Solved:
    """Solve for orders by least squares; bins far off are left out.

    Args:
        contact: with the flank.
        chosen: the orders.
        ratio: turns of the loose gear in a turn of the drive.
    """
    angles = (contact.drive, contact.loose)
    columns = [(contact.file == file).astype(float) for file in np.unique(contact.file)]
    for line in chosen:
        weak = _blur(contact, _frequency(line, ratio))
        turning = line.order * angles[line.gear]
        columns += [weak * np.cos(turning), -weak * np.sin(turning)]
    design = np.column_stack(columns)
    kept = np.ones(len(contact.drive), bool)
    place = contact.place - contact.place.mean()
    while True:
        weight = contact.weight * kept
        inverse = np.linalg.pinv((design * weight[:, None]).T @ design, hermitian=True)
        numbers = inverse @ (design.T @ (weight * place))
        rest = place - design @ numbers
        spread = 1.4826 * np.median(np.abs(rest[kept] - np.median(rest[kept]))) + 1e-15
        now = kept & (np.abs(rest) < max(STRAY * spread, contact.count))
        if not chosen or now.sum() > 0.9999 * kept.sum() or now.sum() < LEAST * len(kept):
            return Solved(design, numbers, inverse, rest, kept)
        kept = now


def _judged(
    contact: Contact,
    lines: Lines,
    chosen: list[Line],
    solved: Solved,
) -> Fit:
    """Return a fit with its deviations."""
    design, numbers, inverse, rest, kept = solved
    weight = contact.weight * kept
    total = float(weight.sum())
    files = np.unique(contact.file)
    seen = left_of(contact, lines, weight * rest) * 2.0 / total
    free = ~near(lines, tuple(chosen), contact.turns)
    floor, freedom = floor_of(lines, seen, free, robust=not chosen)
    places = [lines.all.index(line) for line in chosen]
    sizes = np.concatenate([np.full(len(files), floor[np.argmin(lines.frequency)]), np.repeat(floor[places], 2)])
    scale = sizes * np.sqrt(total / 2.0)
    covariance = inverse * np.outer(scale, scale)
    wider, ratio_found = by_turns(contact, design, inverse, weight * rest, covariance)
    covariance = covariance * np.outer(wider, wider)
    own = covariance[len(files) :, len(files) :]
    parts = numbers[len(files) :].reshape(-1, 2)
    phasors = parts[:, 0] + 1j * parts[:, 1]
    blocks = [own[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] for i in range(len(chosen))]
    chance = [
        np.exp(-0.5 * part @ np.linalg.solve(block, part)) if part.any() else 1.0
        for part, block in zip(parts, blocks, strict=True)
    ]
    shown = seen.copy()
    shown[places] = np.abs(phasors)
    return Fit(
        lines=tuple(chosen),
        phasors=phasors,
        deviation=np.array([np.sqrt(0.5 * np.trace(block)) for block in blocks]),
        covariance=own,
        offsets={int(f): float(numbers[i] + contact.place.mean()) for i, f in enumerate(files)},
        offset_deviation=float(np.sqrt(covariance[0, 0])),
        chance=np.array(chance),
        floor=floor,
        seen=shown,
        rest=rest,
        kept=kept,
        freedom=freedom,
        scatter=ratio_found,
        counted=_phasors(contact, chosen, weight * contact.counted * 2.0 / total),
    )


def _phasors(contact: Contact, chosen: list[Line], values: np.ndarray) -> np.ndarray:
    """Return the sum of values·exp(-i·order·angle) of some orders, (p,)."""
    angles = (contact.drive, contact.loose)
    return np.array([values @ np.exp(-1j * line.order * angles[line.gear]) for line in chosen], complex)


def _blur(contact: Contact, frequency: float) -> float:
    """Return what averaging in bins leaves of a wave."""
    half = 0.5 * frequency * contact.width
    return float(np.sin(half) / (contact.samples * np.sin(half / contact.samples))) if half else 1.0


def _frequency(line: Line, ratio: float) -> float:
    return line.order * (ratio if line.gear else 1.0)
