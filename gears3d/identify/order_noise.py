"""The noise of orders: what stands beside them, and how turns scatter."""

from __future__ import annotations

import numpy as np

from gears3d.identify.contact import Contact
from gears3d.identify.order_lines import APART, Line, Lines

NEIGHBOURS = 24
"""Orders beside one, of no significance, whose mean size is its noise."""
TURNS = 6
"""So many turns make a scatter."""


def left_of(contact: Contact, lines: Lines, values: np.ndarray) -> np.ndarray:
    """Return the size of the sum of values·exp(-i·order·angle) at every order, (m,).

    Args:
        contact: with the flank.
        lines: that are looked at.
        values: one a bin, (n,).
    """
    found = {}
    for gear, angle in enumerate((contact.drive, contact.loose)):
        wanted = [line.order for line in lines.all if line.gear == gear]
        turn = np.exp(-1j * angle)
        at = values.astype(complex)
        for order in range(1, max(wanted, default=0) + 1):
            at = at * turn
            found[Line(gear, order)] = abs(at.sum())
    return np.array([found[line] for line in lines.all])


def near(lines: Lines, chosen: tuple[Line, ...], turns: float) -> np.ndarray:
    """Whether orders are fitted ones, or too near to one to be noise, (m,).

    Args:
        lines: that are looked at.
        chosen: those that are fitted.
        turns: of the drive.
    """
    near = np.array([line in chosen for line in lines.all])
    for line in chosen:
        near |= np.abs(lines.frequency - lines.frequency[lines.all.index(line)]) * turns < APART
    return near


def floor_of(lines: Lines, seen: np.ndarray, free: np.ndarray, robust: bool) -> tuple[np.ndarray, float]:
    """Return the deviation of each part of a phasor from neighbouring orders without significance, and its freedom.

    Args:
        lines: that are looked at.
        seen: amplitude at each [m], (m,).
        free: which of them are noise, (m,).
        robust: whether some of them may be real.
    """
    some = np.flatnonzero(free)
    some = some[np.argsort(lines.frequency[some], kind="stable")]
    at, power = lines.frequency[some], seen[some] ** 2
    count = min(NEIGHBOURS, len(some))
    begin = np.searchsorted(at, lines.frequency) - count // 2
    begin = np.clip(begin, 0, len(some) - count)
    windows = power[begin[:, None] + np.arange(count)]
    mean = windows.mean(axis=1)
    middle = np.median(windows, axis=1) / np.log(2.0)
    return np.sqrt(0.5 * (middle if robust else np.minimum(mean, 4.0 * middle))), 2.0 * count


def by_turns(
    contact: Contact, design: np.ndarray, inverse: np.ndarray, values: np.ndarray, covariance: np.ndarray
) -> tuple[np.ndarray, float]:
    """Return factors, 1 or more, by which turns scatter more than neighbouring orders say, and the largest ratio.

    Args:
        contact: with the flank.
        design: of the fit, (n, q).
        inverse: of its weighted normal matrix, (q, q).
        values: weighted rest of each bin [m], (n,).
        covariance: by neighbouring orders [m²], (q, q).
    """
    from scipy.stats import f as fisher

    turns, number = np.unique(contact.turn, return_inverse=True)
    ones = np.ones(len(inverse))
    if len(turns) < TURNS:
        return ones, 1.0
    order = np.argsort(number, kind="stable")
    begins = np.searchsorted(number[order], np.arange(len(turns)))
    scores = np.add.reduceat((design * values[:, None])[order], begins, axis=0)
    moves = scores @ inverse
    variance = (moves**2).sum(axis=0) * len(turns) / (len(turns) - 1.0)
    ratio = variance / np.maximum(np.diag(covariance), 1e-300)
    head = len(np.unique(contact.file))
    pairs = ratio.copy()
    pairs[head:] = np.repeat(ratio[head:].reshape(-1, 2).mean(axis=1), 2)
    limit = fisher.ppf(0.99, 2 * (len(turns) - 1), 2 * NEIGHBOURS)
    return np.sqrt(np.where(pairs > limit, pairs, 1.0)), float(np.sqrt(pairs.max()))
