"""Records without the waves of their flanks: what is left over a contact that lasts is noise."""

from __future__ import annotations

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.identify.swing import BINS, Periods

PRESSED = (0.3, 1.4)
"""Phases of the drive's acceleration in which the gear lies on the active flank, flights and bounces over [rad]."""
ORDERS = (1, 2, 3)
MESH = (1, 2)
"""Orders of the mesh."""
_ROUNDS = 4
_FAR = 3.0
"""Deviations beyond which a bin weighs less."""


def phases() -> np.ndarray:
    """Return the phase in the middle of each bin [rad], (BINS,)."""
    return (np.arange(BINS) + 0.5) * 2.0 * np.pi / BINS


def pressed() -> np.ndarray:
    """Return which bins lie on the active flank whatever happens later in the period, (BINS,)."""
    phase = phases()
    return (phase > PRESSED[0]) & (phase < PRESSED[1])


def flattened(found: Periods, teeth: tuple[int, int], file: str = "", quiet: np.ndarray | None = None) -> Periods:
    """Return periods with the flanks' waves, a slow drift and a delay between the encoders taken off.

    They are fitted to the phases in which the drive speeds up: there is contact, whatever flies later. What counting
    does in these few phases, the same in every period, would pass for a delay, which goes on into the flights: where
    quiet periods are known, all their phases count.

    Args:
        found: the record by periods.
        teeth: of drive and loose gear.
        file: named in faults.
        quiet: periods that are contact from end to end, (k,).

    Raises:
        InputError: too little was read in contact.
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
                columns += [np.cos(order * angle).ravel(), np.sin(order * angle).ravel()]
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
    """Return least squares in which what is far off weighs less."""
    weight = np.ones(len(place))
    numbers = np.zeros(basis.shape[1])
    for _ in range(_ROUNDS):
        numbers = np.linalg.lstsq(basis * weight[:, None], place * weight, rcond=None)[0]
        rest = place - basis @ numbers
        spread = max(1.4826 * float(np.median(np.abs(rest))), 1e-15)
        weight = np.sqrt(np.minimum(1.0, _FAR * spread / np.maximum(np.abs(rest), 1e-300)))
    return numbers
