"""Orders of both gears in contact: significant orders, and the residual at every order as noise floor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.measured.segmentation import contact_orders
from gears3d.measured.segmentation.orders import STRAY, resolved
from gears3d.measured.segmentation.touching import ROWS, within
from gears3d.recording import FLANKS
from gears3d.signals import robust_deviation
from gears3d.signals.orders import GEARS, each_alone, harmonics

if TYPE_CHECKING:
    from gears3d.measured.segmentation import Measurement

HIGHEST = 400
"""Order up to which the noise floor is drawn."""
FINE = 32
"""Bins of the angle in a wave of the highest order, at least."""
RIDGE = 1e-4
"""Regularisation, relative to the number of readings, of orders that few contact angles determine poorly."""
FEWEST = 50
"""Points in contact below which no orders are reported."""


def orders_told(found: Measurement) -> dict[str, list[dict[str, Any]]]:
    """Return the orders of both gears by flank, as ``contact_orders`` of ``summary.json`` has them."""
    told = {}
    for flank, name in enumerate(FLANKS):
        if _enough(found, flank):
            table = contact_orders(found, flank)
            told[name] = [
                {
                    "gear": GEARS[int(table["gear"][k])],
                    "order": int(table["order"][k]),
                    **{key: float(table[key][k]) for key in ("amplitude_m", "sigma_m", "phase_rad", "share")},
                }
                for k in range(len(table["order"]))
            ]
        else:
            told[name] = []
    return told


def spectra(found: Measurement) -> dict[str, Any]:
    """Return the residual at every order without the significant orders."""
    left: dict[str, dict[str, list[float]]] = {}
    for flank, name in enumerate(FLANKS):
        if not _enough(found, flank):
            continue
        for gear, floor in _floors(found, flank, found.summary["contact_orders"][name]).items():
            left.setdefault(gear, {})[name] = [float(f"{value:.3g}") for value in floor]
    return left


def _enough(found: Measurement, flank: int) -> bool:
    return len(_near(found, flank)) >= FEWEST


def _near(found: Measurement, flank: int) -> np.ndarray:
    cut = found.segments
    return within(cut.path.time, cut.contacts, cut.path.width, flank)


def _floors(found: Measurement, flank: int, taken: list[dict[str, Any]]) -> dict[str, np.ndarray]:
    """Return the amplitude of the residual at each order of each gear [m]."""
    path = found.segments.path
    near = _near(found, flank)
    some = near[:: max(len(near) // ROWS, 1)]
    angles = dict(zip(GEARS, (path.drive[some], path.loose[some]), strict=True))
    x = np.linspace(-0.5, 0.5, len(some))
    waves = [harmonics(angles[one["gear"]], [one["order"]]) for one in taken]
    columns = np.hstack([np.stack([np.ones_like(x), x, x * x], axis=1), *waves])
    rest = path.place[some] - columns @ np.linalg.lstsq(columns, path.place[some], rcond=None)[0]
    limit = STRAY * robust_deviation(rest)
    rest = np.clip(rest, -limit, limit)
    highest = dict(zip(GEARS, resolved(path.drive, path.loose), strict=True))
    return {
        gear: np.abs(each_alone(angles[gear], rest, min(top, HIGHEST), RIDGE, FINE)[0][1:])
        for gear, top in highest.items()
        if top > 1
    }
