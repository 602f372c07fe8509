"""Geometry of the pair: what follows from its data, and both flanks rolled over a revolution without load."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.units import parse
from gears3d.verification.papers.bench import Case
from gears3d.verification.papers.measures.registry import measure

if TYPE_CHECKING:
    from gears3d.gears.rolling import QuasiStatic

FIRST_MESH_ORDER = 45  # half of the 90 teeth: orders from here on belong to the mesh, lower ones to the revolution


@measure
def line_of_action_speed(case: Case, speed: str) -> float:
    """Return a speed of the drive along the line of action [m/s]."""
    return case.scenario.pair().drive.base_radius * parse(speed, "speed")


@measure
def at_centre_distance(case: Case, of: str, centre_distance: str) -> float:
    """Return a property of the pair at another centre distance: ``contact_ratio``, or ``backlash`` [m]."""
    from gears3d.gears import Pair

    pair = case.scenario.pair()
    return getattr(Pair.from_centre_distance(pair.drive, pair.loose, parse(centre_distance, "length")), of)


def rolled(case: Case) -> QuasiStatic:
    """Return both flanks of the pair with the scenario's deviations, rolled over a revolution without load."""
    from gears3d.gears import HarmonicDeviation
    from gears3d.gears.deviation import FLANKS, GEARS
    from gears3d.gears.rolling import quasi_static

    def compute() -> QuasiStatic:
        scenario = case.scenario
        material: list[Any] = [
            HarmonicDeviation(GEARS[int(p[0])], FLANKS[int(p[1])], int(p[2]), p[3], p[4])  # type: ignore[arg-type]
            for p in (each.p for each in scenario.rows())
        ]
        return quasi_static(scenario.pair().with_deviations(*material), samples=16)

    return case.once("rolled", compute)


def parts(signal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the part of a revolution's signal below the mesh orders, and the rest, both (n,).

    >>> angle = np.arange(720) * 2 * np.pi / 720
    >>> slow, mesh = parts(50 * np.cos(angle) + 5 * np.cos(90 * angle))
    >>> round(float(np.ptp(slow)), 6), round(float(np.ptp(mesh)), 6)
    (100.0, 10.0)
    """
    spectrum = np.fft.rfft(signal)
    spectrum[FIRST_MESH_ORDER:] = 0.0
    slow = np.fft.irfft(spectrum, len(signal))
    return slow, signal - slow


@measure
def rolled_curve(case: Case, curve: str, part: str = "") -> np.ndarray:
    """Return ``phi_active`` or ``backlash`` over a revolution, or its ``revolution`` or ``mesh`` part [m]."""
    found = getattr(rolled(case), curve)
    return parts(found)[("revolution", "mesh").index(part)] if part else found
