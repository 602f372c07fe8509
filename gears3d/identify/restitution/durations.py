"""How long impacts last, where the record resolves it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gears3d.identify.restitution.pairs import Measured
from gears3d.recording import FLANKS

FEWEST = 5
"""So few durations give no standard deviation worth telling."""


def impact_durations(measured: Sequence[Measured]) -> dict[str, Any]:
    """Return mean, standard deviation and extent of the impacts' durations, by flank.

    Args:
        measured: records.

    Returns:
        ``resolved``, and ``why`` not; by flank ``impacts``, ``mean_s`` with ``ci95``, ``standard_deviation_s``.

    Source: Kadmiri et al. 2012, fig. 6: 1.2 ms, normal, standard deviation 0.06 ms.
    """
    tables = [one.recording.impacts for one in measured]
    if not all("duration_s" in table for table in tables):
        return {"resolved": False, "why": "the measurement gives no durations of impacts"}
    lasted = np.concatenate([table["duration_s"] for table in tables])
    flank = np.concatenate([table["flank"] for table in tables])
    found: dict[str, Any] = {}
    for code, name in enumerate(FLANKS):
        own = lasted[(flank == code) & np.isfinite(lasted) & (lasted > 0.0)]
        if len(own) >= FEWEST:
            found[name] = _told(own)
    if not found:
        return {"resolved": False, "why": "impacts are shorter than the readings resolve"}
    return {"resolved": True, **found}


def _told(lasted: np.ndarray) -> dict[str, Any]:
    from scipy.stats import t

    mean, spread = float(np.mean(lasted)), float(np.std(lasted, ddof=1))
    half = float(t.ppf(0.975, len(lasted) - 1)) * spread / np.sqrt(len(lasted))
    return {
        "impacts": len(lasted),
        "mean_s": {"value": mean, "unit": "s", "ci95": [mean - half, mean + half]},
        "standard_deviation_s": spread,
    }
