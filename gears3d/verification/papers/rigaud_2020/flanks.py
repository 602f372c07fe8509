"""Figure 2 of Rigaud & Perret-Liaudet 2020: the unloaded transmission error, rolled on the flank surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.verification.papers.rigaud_2020.points import row

if TYPE_CHECKING:
    from gears3d.gears.rolling import QuasiStatic
    from gears3d.verification.papers.bench import Bench

FILE = "rigaud-2020/fig2.toml"
FIRST_MESH_ORDER = 45
"""Orders above belong to the mesh, below to the revolution."""


def rolled(bench: Bench) -> QuasiStatic:
    """Return both flanks of the pair of fig. 2, rolled over a revolution without load.

    Args:
        bench: of the papers.
    """
    return bench.once("rigaud-2020 fig. 2 rolled", lambda: _roll(bench))


def _roll(bench: Bench) -> QuasiStatic:
    from gears3d.gears import HarmonicDeviation
    from gears3d.gears.deviation import FLANKS, GEARS
    from gears3d.gears.rolling import quasi_static

    scenario = bench.scenario(FILE)
    material: list[Any] = [
        HarmonicDeviation(GEARS[int(p[0])], FLANKS[int(p[1])], int(p[2]), p[3], p[4])  # type: ignore[arg-type]
        for p in (each.p for each in scenario.rows())
    ]
    return quasi_static(scenario.pair().with_deviations(*material), samples=16)


def parts(signal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the part of a revolution's signal below the mesh orders, and the rest.

    Args:
        signal: equally spaced over one revolution, (n,).

    >>> angle = np.arange(720) * 2 * np.pi / 720
    >>> slow, mesh = parts(50 * np.cos(angle) + 5 * np.cos(90 * angle))
    >>> round(float(np.ptp(slow)), 6), round(float(np.ptp(mesh)), 6)
    (100.0, 10.0)
    """
    spectrum = np.fft.rfft(signal)
    spectrum[FIRST_MESH_ORDER:] = 0.0
    slow = np.fft.irfft(spectrum, len(signal))
    return slow, signal - slow


def constancy(bench: Bench) -> str:
    """Return whether the backlash varies by less than a tenth over the revolution.

    Args:
        bench: of the papers.
    """
    backlash = rolled(bench).backlash
    return "almost constant" if np.ptp(backlash) < 0.1 * backlash.mean() else "varies"


INPUT = "given to the flanks of both gears' teeth; shows that the surfaces carry it"
TWO_DIGITS = "two printed digits"

CLAIMS = (
    row(
        figure="fig. 2",
        quantity="transmission error, peak to peak per revolution (input, rolled on the flanks)",
        published=100.0,
        tolerance=5.0,
        unit="µm",
        model="gears",
        compute=lambda bench: float(1e6 * np.ptp(parts(rolled(bench).phi_active)[0])),
        note=INPUT,
        basis=TWO_DIGITS,
    ),
    row(
        figure="fig. 2",
        quantity="transmission error, peak to peak per mesh (input, rolled on the flanks)",
        published=10.0,
        tolerance=0.5,
        unit="µm",
        model="gears",
        compute=lambda bench: float(1e6 * np.ptp(parts(rolled(bench).phi_active)[1])),
        note=INPUT,
        basis=TWO_DIGITS,
    ),
    row(
        figure="fig. 2",
        quantity="backlash, mean over a revolution (input, rolled on both flanks)",
        published=250.0,
        tolerance=5.0,
        unit="µm",
        model="gears",
        compute=lambda bench: float(1e6 * rolled(bench).backlash.mean()),
        note="the distance of the two transmission errors, as the bench measures it",
        basis=TWO_DIGITS,
    ),
    row(
        figure="fig. 2",
        quantity="backlash over a revolution",
        published="almost constant",
        model="gears",
        compute=constancy,
        note="teeth displaced as a whole; an eccentric gear of the same transmission error would move it by 68 µm",
    ),
)
"""Rows of figure 2."""
