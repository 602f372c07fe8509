"""Rows on trends: friction (fig. 8), impacts a period, rattle index (figs 15, 21, 26, 32), transmission error (31)."""

from __future__ import annotations

from typing import Any

from gears3d.verification.papers.bench import Bench
from gears3d.verification.papers.dct_helical_lubricated.points import GEOMETRY, claim, seen, swept, trend

FREQUENCIES = tuple(float(f) for f in range(10, 91, 10))
ACCELERATIONS = (0.0, 100.0, 200.0, 300.0, 450.0, 600.0, 800.0, 1000.0)
DRAGS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8)
VISCOSITIES = (0.005, 0.01, 0.017, 0.024, 0.03, 0.04)
THREE = (0.01, 0.024, 0.03)
SWEEPS = {
    "frequency": FREQUENCIES,
    "acceleration": ACCELERATIONS,
    "drag": DRAGS,
    "viscosity": VISCOSITIES,
}
"""Values over which the rattle index is drawn, by the name of what varies."""


def indices(bench: Bench, key: str) -> list[float]:
    """Return the rattle index over the values of :data:`SWEEPS` [N/(s·kg·m²)].

    Args:
        bench: of the papers.
        key: what varies.
    """
    return [swept(bench, **{key: value})[0] for value in SWEEPS[key]]


def friction(bench: Bench) -> float:
    """Return how much friction changes the effective transmission error, relative.

    Args:
        bench: of the papers.
    """
    return swept(bench)[1] / swept(bench, "none")[1] - 1.0


def impacts(bench: Bench, **where: Any) -> float:
    """Return the impacts a period of a point.

    Args:
        bench: of the papers.
        where: what ``point`` takes.
    """
    return float(seen(bench, "impacts_per_period", **where))


def _index(figure: str, words: str, key: str, published: str, red: bool = False, note: str = ""):  # type: ignore[no-untyped-def]
    return claim(
        figure=figure,
        quantity=f"rattle index over {words}",
        published=published,
        compute=lambda bench: trend(indices(bench, key)),
        recorded="disagrees" if red else "agrees",
        note=note or GEOMETRY,
    )


CLAIMS = (
    claim(
        figure="fig. 8",
        quantity="effective transmission error with friction against none, relative change",
        published=0.0,
        tolerance=0.05,
        compute=friction,
        basis='"limited in general"',
        note="at the base case, friction averaged over the lines of contact",
    ),
    claim(
        figure="fig. 14",
        quantity="impacts a period from 10 over 25 to 60 Hz",
        published="falls",
        compute=lambda bench: trend([impacts(bench, frequency=f) for f in (10.0, 25.0, 60.0)]),
        note="several on each flank at low frequency, one at high",
    ),
    _index("fig. 15", "the frequency, 10 to 90 Hz", "frequency", "rises"),
    _index("fig. 21", "the acceleration, 0 to 1000 rad/s²", "acceleration", "rises"),
    _index(
        "fig. 26",
        "the drag, 0.05 to 0.8 N m",
        "drag",
        "falls",
        True,
        "rises by a tenth up to 0.2 N m, where the gear is thrown hardest, and "
        "falls from there on, to a fortieth at 0.8 N m",
    ),
    claim(
        figure="fig. 31",
        quantity="Rdte over the viscosity, 0.01, 0.024, 0.03 Pa s",
        published="falls",
        compute=lambda bench: trend([swept(bench, viscosity=value)[1] for value in THREE]),
        recorded="disagrees",
        note="rises by 4 %: the error is counted from amid the backlash, and a thicker film holds the gear on the "
        "active flank for longer. What lessens it in print, peaks and the range of the curves, falls here, too (Odte)",
    ),
    claim(
        figure="fig. 31",
        quantity="Odte over the viscosity, 0.01, 0.024, 0.03 Pa s",
        published="falls",
        compute=lambda bench: trend([swept(bench, viscosity=value)[2] for value in THREE]),
        note=GEOMETRY,
    ),
    _index("fig. 32", "the viscosity, 0.005 to 0.04 Pa s", "viscosity", "falls"),
)
"""Rows of sections 2.4 and 4."""
