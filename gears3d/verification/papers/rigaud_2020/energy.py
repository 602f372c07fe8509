"""Figures 7 and 13 of Rigaud & Perret-Liaudet 2020: how hard the flanks are struck, and what is heard of it."""

from __future__ import annotations

from functools import partial
from math import log10, sqrt
from typing import TYPE_CHECKING

import numpy as np

from gears3d.verification.papers.rigaud_2020.points import SCATTER_DB, crossing, plastic, row

if TYPE_CHECKING:
    from gears3d.verification.papers.bench import Bench

SQUARES = "{}_velocity_mean_square_m2_s2"


def decades(bench: Bench, quantity: str, power: int) -> tuple[np.ndarray, np.ndarray]:
    """Return log10 of ω^power·ΔΩ, without unit, and a quantity of the outcome in dB, for all double-sided points.

    Args:
        bench: of the papers.
        quantity: key of the outcome.
        power: of the frequency, 1 or 2.
    """
    points = crossing(bench)
    abscissa = np.log10([amplitude * frequency**power for amplitude, frequency in points])
    return abscissa, 10 * np.log10([plastic(bench, *place)[quantity] for place in points])


def slope(bench: Bench, quantity: str, power: int = 1) -> float:
    """Return how a quantity of the outcome rises [dB per decade of ω^power·ΔΩ].

    Args:
        bench: of the papers.
        quantity: key of the outcome.
        power: of the frequency, 1 or 2.
    """
    return float(np.polyfit(*decades(bench, quantity, power), 1)[0])


def faster_flank(bench: Bench) -> str:
    """Return which flank is struck faster in the mean square, over all double-sided points.

    Args:
        bench: of the papers.
    """
    active, reverse = (decades(bench, SQUARES.format(flank), 1)[1] for flank in ("active", "reverse"))
    if (active > reverse).all():
        return "active"
    return "reverse" if (active < reverse).all() else "mixed"


def same_product(bench: Bench) -> float:
    """Return the mean squared velocity at 5 rpm, 10 Hz over that at 10 rpm, 5 Hz, active flank [dB].

    Args:
        bench: of the papers.
    """
    one, two = (plastic(bench, *place)[SQUARES.format("active")] for place in ((5, 10), (10, 5)))
    return 10 * log10(one / two)


def impacts(bench: Bench) -> float:
    """Return the number of impacts in a period, mean of all double-sided points.

    Args:
        bench: of the papers.
    """
    return float(np.mean([plastic(bench, *place)["impacts_per_period"] for place in crossing(bench)]))


def trend(bench: Bench) -> str:
    """Return whether the energy that impacts take a second rises with ω²·ΔΩ (rank correlation above 0.9).

    Args:
        bench: of the papers.
    """
    product, energy = (np.argsort(np.argsort(each)) for each in decades(bench, "energy_J_s", 2))
    rank = float(np.corrcoef(product, energy)[0, 1])
    return "rises" if rank > 0.9 else "falls" if rank < -0.9 else "no trend"


_fig7, _fig13 = partial(row, figure="fig. 7"), partial(row, figure="fig. 13")
_ENDS = "printed scatter of the impact velocity, 0.8 dB, at both ends of {} decades"
_SHORT = (
    "short flights give v = ½·(6b)^⅔·(ω²ΔV)^⅓ in the rigid model: the velocity depends on ω²·ΔΩ, not on ω·ΔΩ, and its "
    "square rises by 6.7 dB per decade of it; between that and the threshold there is no single line. A backlash that "
    "differed from run to run, or contact that takes up part of the energy at low speed, could straighten it"
)

CLAIMS = (
    *(
        _fig7(
            quantity=f"mean squared impact velocity, {flank} flank, over ω·ΔΩ",
            published=10.0,
            tolerance=round(float(SCATTER_DB) * sqrt(2) / 1.4, 1),
            unit="dB/decade",
            compute=partial(slope, quantity=SQUARES.format(flank)),
            basis=_ENDS.format(1.4),
            recorded="disagrees" if note else "agrees",
            note=note,
        )
        for flank, note in (("active", ""), ("reverse", _SHORT))
    ),
    _fig7(quantity="flank with the higher mean squared velocity, all points", published="active", compute=faster_flank),
    _fig7(
        quantity="mean squared velocity at equal ω·ΔΩ: 5 rpm at 10 Hz over 10 rpm at 5 Hz, active flank",
        published=0.0,
        tolerance=round(float(SCATTER_DB) * sqrt(2), 1),
        unit="dB",
        compute=same_product,
        basis="the paper plots all points over ω·ΔΩ alone; printed scatter of the impact velocity, 0.8 dB, twice",
        recorded="disagrees",
        note=_SHORT,
    ),
)
"""Rows of figure 7."""

SOUND = (
    _fig13(
        quantity="impacts in a period (n = ω/π a second), mean of all double-sided points",
        published=2.0,
        tolerance=0.05,
        compute=impacts,
        basis="one impact more or less in the 18 periods counted",
    ),
    _fig13(quantity="trend of the energy that the impacts take a second, with ω²·ΔΩ", published="rises", compute=trend),
    _fig13(
        quantity="energy that the impacts take a second, over ω²·ΔΩ",
        published=10.0,
        tolerance=round(float(SCATTER_DB) * sqrt(2) / 2.3, 1),
        unit="dB/decade",
        compute=partial(slope, quantity="energy_J_s", power=2),
        basis=_ENDS.format(2.3),
        recorded="disagrees",
        note="the sound pressure follows eq. (27) with this slope and a constant that is not printed, so no levels can "
        "be computed, only how they rise. Over the figure's grid the rigid model's energy goes with ω^2.33·ΔΩ^0.79 "
        "within 0.3 dB, not with ω²·ΔΩ: the velocity's law of short flights (fig. 7)",
    ),
)
"""Rows of figure 13."""
