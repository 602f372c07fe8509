"""Whether restitution depends on how fast the teeth slide: tested, with a bound on what may have been missed."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.stats import t

from gears3d.identify.restitution.fitting import Fit, fit
from gears3d.identify.restitution.pairs import Pairs

NARROWEST = 0.05
"""Range of sliding speeds over their mean, below which nothing is tested."""


def sliding_test(pairs: Pairs, best: Fit) -> dict[str, Any]:
    """Return the slope of restitution with the sliding speed, beside the law that was taken.

    The law keeps its other terms, so that what is due to the approach or the flank is not taken for sliding.

    Args:
        pairs: with rebounds that were seen.
        best: the law taken.

    Returns:
        ``tested``; ``slope`` [s/m] with ``ci95``, ``p_value`` of no dependence, ``range_m_s`` of sliding speeds (5 to
        95 % of the impacts), ``change`` over that range and ``change_bound``: the most
        it may be (95 %).

    Source: Kadmiri et al. 2012, section 3.1: no influence of the sliding velocity.
    """
    low, high = (float(x) for x in np.quantile(pairs.sliding, (0.05, 0.95)))
    middle = float(np.mean(pairs.sliding))
    if not high - low > NARROWEST * middle or len(pairs.time) < 5 + len(best.numbers):
        why = f"sliding speeds lie between {low:.3g} and {high:.3g} m/s only: record at several speeds of the drive"
        return {"tested": False, "why": why, "range_m_s": [low, high]}
    found = fit(pairs, best.terms._replace(sliding=True))
    slope = float(found.numbers[-1]) / middle
    error = float(np.sqrt(max(found.covariance[-1, -1], 0.0))) / middle
    freedom = max(found.count - len(found.numbers) - 1, 1)
    half = found.quantile * error
    return {
        "tested": True,
        "slope": {"value": slope, "unit": "s/m", "ci95": [slope - half, slope + half]},
        "p_value": float(2.0 * t.sf(abs(slope) / max(error, 1e-300), freedom)),
        "range_m_s": [low, high],
        "change": slope * (high - low),
        "change_bound": (abs(slope) + half) * (high - low),
    }
