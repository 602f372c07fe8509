"""Does the dead band keep its place: counts lost over a while, hubs that slip, ratios a little wrong."""

from __future__ import annotations

from gears3d.measured.checks.finding import Finding
from gears3d.measured.checks.view import View

SURE = 7.0
"""Standard deviations from which a drift is told."""
LEAST = 0.03
"""Part of the backlash from which it is told."""


def examine(view: View) -> list[Finding]:
    """Find a dead band that moves by what no revolution brings back.

    Args:
        view: the record; its ratio is right, its jumps are corrected.
    """
    found = view.places
    if found is None:
        return []
    least = LEAST * (view.declared.backlash or 0.0)
    either = "lost or additional counts, or a slipping hub or coupling"
    if abs(found.step) > max(least, SURE * found.step_sigma):
        told = f"the position of the active flank jumps by {1e6 * found.step:.4g} um at t = {found.step_time:.4g} s: "
        return [Finding("offset", "", found.step, "m", told + either, "split the record there")]
    if abs(found.drift) < max(least, SURE * found.drift_sigma) or found.step:
        return []
    told = f"the position of the active flank drifts by {1e6 * found.drift:.4g} um (± {1e6 * found.drift_sigma:.2g}), "
    told += f"{found.drift / (view.declared.backlash or 1.0):.0%} of the backlash: {either}, or thermal expansion"
    return [Finding("drift", "", found.drift, "m", told, "a linear drift is corrected in the analysis")]
