"""Where the active flank lies in the course of a record: its waves with the revolutions, and what never comes back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.measured.checks.band import Band
from gears3d.measured.checks.view import MESH, View

TURNS = 3.0
"""Fewer turns of the slower gear do not tell a wave from a drift."""
WINDOWS = 400
PARTS = 16
"""Windows in a turn of the faster gear, at most."""
ORDERS = (1, 2)
MOST = 12_000
FLIES = 0.02
"""Part of the blocks out of contact from which on a gear flies."""
FEWEST = 5
"""Blocks in contact that a window needs."""
BESIDE = 0.1
"""Part of the backlash within which contact beside the lowest of a window is that of the same flank."""
SPARE = 4
"""Windows at both ends, in which no step is sought."""


class Places(NamedTuple):
    """The active flank over the record.

    Args:
        level: the place without its waves, amid the record [m].
        waves: complex amplitude of the place, A·exp(iφ) for A·cos(kθ + φ), by (column, order) [m].
        sigma: of each amplitude [m].
        drift: how far the place moves over the record [m].
        drift_sigma: [m].
        step: how far it moves at once where that explains it better than a steady drift [m], else 0.
        step_sigma: [m].
        step_time: when [s].
        turns: of the slower gear.
    """

    level: float
    waves: dict[tuple[str, int], complex]
    sigma: float
    drift: float
    drift_sigma: float
    step: float
    step_sigma: float
    step_time: float
    turns: float


def places(view: View, band: Band) -> Places | None:
    """Return where the active flank lies, ``None`` where the record is too short or contact is not seen.

    In each window of time the place of contact that lies lowest is taken, as the drag brings the loose gear back to its
    active flank in every period; then the mean of all contact beside it.

    Args:
        view: the record.
        band: its blocks.
    """
    inside = np.flatnonzero(band.stretch >= 0)
    inside = inside[:: max(len(inside) // MOST, 1)]
    window = np.floor((band.time[inside] - band.time[0]) / _length(band)).astype(np.intp)
    lowest = _lowest(band.place[inside], window)
    table, names = _table(view, band, inside)
    turns = min(abs(float(np.ptp(angle))) / (2 * np.pi) for angle in (band.drive, band.loose))
    if turns < TURNS or len(lowest) < 2 * table.shape[1]:
        return None
    waving = table[:, 1:-1] @ _robust(table[lowest], band.place[inside][lowest], 0.1 * band.noise)[0][1:-1]
    near = _beside(band.place[inside] - waving, window, lowest, BESIDE * (view.declared.backlash or 0.0))
    rows, at = np.unique(window[near], return_inverse=True)
    count = np.bincount(at)
    mean = [np.bincount(at, column[near]) / count for column in (*table.T, band.place[inside], band.time[inside])]
    table, place, time = np.column_stack(mean[:-2]), mean[-2], mean[-1]
    if len(rows) < 2 * table.shape[1]:
        return None
    numbers, off, spread = _robust(table, place, 0.1 * band.noise)
    sigma = np.sqrt(np.diag(spread))
    step = _step(table[:, :-1], place, time, float(off @ off))
    if step[0] != 0.0:
        stepping = np.column_stack([table[:, :-1], time > step[2]])
        refit, _, spread = _robust(stepping, place, 0.1 * band.noise)
        numbers[:-1], sigma[:-1] = refit[:-1], np.sqrt(np.diag(spread))[:-1]
    waves = {name: complex(numbers[1 + 2 * k], -numbers[2 + 2 * k]) for k, name in enumerate(names)}
    return Places(
        float(numbers[0]), waves, float(sigma[1:-1].max()), float(numbers[-1]), float(sigma[-1]), *step, turns
    )


def _length(band: Band) -> float:
    """Return the length of a window [s]: a part of a turn, and a period of the drive's motion where the gear flies."""
    lasting = float(band.time[-1] - band.time[0])
    fastest = max(float(np.ptp(band.drive)), float(np.ptp(band.loose))) / (2 * np.pi * lasting)
    length = max(lasting / WINDOWS, 1.0 / (PARTS * max(fastest, 1e-12)))
    flies = np.mean(band.stretch < 0) > FLIES
    return max(length, 1.0 / band.frequency) if band.frequency and flies else length


def _lowest(place: np.ndarray, window: np.ndarray) -> np.ndarray:
    """Return the row in each window that lies lowest, but for the lowest tenth, (w,)."""
    order = np.lexsort((place, window))
    first = np.flatnonzero(np.diff(window[order], prepend=-1))
    count = np.diff(np.append(first, len(order)))
    return order[first + count // 10][count >= FEWEST]


def _beside(place: np.ndarray, window: np.ndarray, lowest: np.ndarray, reach: float) -> np.ndarray:
    """Return the rows that lie no further from the lowest one of their window than ``reach`` [m], indices."""
    low = np.full(int(window.max()) + 1, np.inf)
    low[window[lowest]] = place[lowest]
    return np.flatnonzero(np.abs(place - low[window]) < reach)


def _table(view: View, band: Band, rows: np.ndarray) -> tuple[np.ndarray, list[tuple[str, int]]]:
    """Return constant, waves and drift at some blocks, and the names of the waves."""
    radii = view.declared.radii or (1.0, 1.0)
    angles = {MESH[0]: band.drive[rows]}
    if abs(radii[0] / radii[1] - 1.0) > 1e-6:
        angles[MESH[1]] = band.loose[rows]
    names = [(name, order) for name in angles for order in ORDERS]
    columns = [np.ones(len(rows))]
    for name, order in names:
        columns += [np.cos(order * angles[name]), np.sin(order * angles[name])]
    lasting = float(band.time[-1] - band.time[0])
    return np.column_stack([*columns, (band.time[rows] - band.time[0]) / lasting - 0.5]), names


def _robust(table: np.ndarray, values: np.ndarray, floor: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return numbers, what is left, and covariance of a least-squares fit with Tukey's weights."""
    weight = np.ones(len(values))
    numbers = off = np.zeros(0)
    rough = floor
    for _ in range(5):
        numbers = np.linalg.lstsq(table * weight[:, None], values * weight, rcond=None)[0]
        off = values - table @ numbers
        rough = max(1.4826 * float(np.median(np.abs(off))), floor)
        weight = np.sqrt(np.clip(1.0 - (off / (6.0 * rough)) ** 2, 0.0, None))
    return numbers, off, rough**2 * np.linalg.pinv((table * weight[:, None] ** 2).T @ table)


def _step(table: np.ndarray, place: np.ndarray, time: np.ndarray, drifting: float) -> tuple[float, float, float]:
    """Return the step that explains the places at least twice as well as a drift, its sigma and time; 0 for none."""
    base = np.linalg.qr(table)[0]
    rest = place - base @ (base.T @ place)
    best, found, sigma, when = 0.5 * drifting, 0.0, 0.0, 0.0
    for k in range(SPARE, len(place) - SPARE):
        step = (np.arange(len(place)) >= k).astype(float)
        step -= base @ (base.T @ step)
        size = float(step @ rest) / float(step @ step)
        left = float(np.square(rest - size * step).sum())
        if left < best:
            best, found, when = left, size, float(0.5 * (time[k] + time[k - 1]))
            sigma = float(np.sqrt(left / len(place) / (step @ step)))
    return found, sigma, when
