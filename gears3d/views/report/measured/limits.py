"""Limits of a measured record, as sentences of its report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d.views.plots.numbers import figure

if TYPE_CHECKING:
    from gears3d.measured.segmentation import Measurement

SAMPLES = 4.0
"""Duration of impacts, in samples, below which a limit is stated."""


def limits(found: Measurement) -> list[str]:
    """Return the limits of the record, one sentence each."""
    summary, hits = found.summary, found.recording.impacts
    if summary["status"] == "unexplained":
        seen = summary["visible"]
        span, speed = figure(seen["displacement_range_m"], "length", 3).text, seen["drive_speed_mean_rad_s"]
        ratio = "unknown" if seen["ratio_loose_over_drive"] is None else f"{seen['ratio_loose_over_drive']:.6g}"
        return [
            "Impacts, regime, contact and backlash are withheld: free flights and contact do not explain the motion.",
            f"The displacement has a range of {span}; the loose gear turns {ratio} times as fast as the drive gear, "
            f"{seen['ratio_of_base_radii']:.6g} by the rig; the drive gear turns at {speed:.5g} rad/s on average.",
        ]
    lowest = figure(summary["quality"]["flight_height_min_m"], "length", 3).text
    told = [
        f"Bounces lower than {lowest} cannot be distinguished from contact; mean speeds exclude impacts after them."
    ]
    if summary["flanks"]["backlash_m"] is None:
        told.append("There was no impact on the reverse flank: its position, its orders and the backlash are unknown.")
    unseen = int(np.count_nonzero(~np.isfinite(hits["rebound_m_s"])))
    if unseen:
        told.append(
            f"No rebound was observed after {unseen} of {len(hits['rebound_m_s'])} impacts: unknown (NaN), not 0."
        )
    bare = [flank for flank, one in summary["durations"].items() if one["impacts"] and not one["resolved"]]
    if bare:
        told.append(
            f"No impact on the {' and the '.join(bare)} flank is long enough to be resolved: "
            "only an upper bound is stated."
        )
    step = 1.0 / summary["quality"]["sample_rate_Hz"]
    brief = [name for name, one in summary["durations"].items() if one["resolved"] and one["median_s"] < SAMPLES * step]
    if brief:
        told.append(
            f"Impacts on the {' and the '.join(brief)} flank last about as long as a sample "
            f"({figure(step, 'time', 3).text}): filtering of the record, also by a "
            "delay correction, increases them by a similar amount."
        )
    if found.recording.meta.get("teeth_from") == "record" and "tooth_drive" in hits:
        told.append(
            "Teeth are numbered from the first angle of the record (no index mark): numbers differ between records."
        )
    if not found.recording.meta.get("period_s"):
        told.append("The period of the drive's fluctuation is unknown (no --rig with harmonics): no phases are stated.")
    touched = summary["contacts_seen"]
    quiet = [flank for flank, orders in summary["contact_orders"].items() if touched[flank] and not orders]
    if quiet:
        told.append(f"On the {' and the '.join(quiet)} flank no order exceeds the noise, or contact is too short.")
    told.append(
        "Orders are determined at the gear angles of contact only. If the fluctuation is synchronous with the "
        "revolution, these angles repeat, and orders may be confused with each other."
    )
    return told
