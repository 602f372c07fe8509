"""What a measured record does not show, as sentences of its report."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d.views.report.figures import figure

if TYPE_CHECKING:
    from gears3d.measurement import Measurement

SAMPLES = 4.0
"""Samples that impacts must last for their duration to be taken without a word."""


def limits(found: Measurement) -> list[str]:
    """Return what was not seen or is not to be relied on, a sentence each.

    Args:
        found: of a record.
    """
    summary, hits = found.summary, found.recording.impacts
    lowest = figure(summary["quality"]["flight_height_min_m"], "length", 3).text
    told = [f"Bounces lower than {lowest} cannot be told from contact; mean speeds are of impacts after higher ones."]
    if summary["flanks"]["backlash_m"] is None:
        told.append("The reverse flank was never struck: its place, its orders and the backlash are unknown.")
    unseen = int(np.count_nonzero(~np.isfinite(hits["rebound_m_s"])))
    if unseen:
        told.append(f"Of {unseen} of {len(hits['rebound_m_s'])} impacts no rebound was seen: unknown (NaN), not 0.")
    bare = [flank for flank, one in summary["durations"].items() if one["impacts"] and not one["resolved"]]
    if bare:
        told.append(f"No impact on the {' and the '.join(bare)} flank is long enough to be resolved; see its bound.")
    step = 1.0 / summary["quality"]["sample_rate_Hz"]
    brief = [name for name, one in summary["durations"].items() if one["resolved"] and one["median_s"] < SAMPLES * step]
    if brief:
        told.append(
            f"Impacts on the {' and the '.join(brief)} flank last about as long as a sample "
            f"({figure(step, 'time', 3).text}): what smears the record over samples, a "
            "correction of a delay too, lengthens them as much."
        )
    if found.recording.meta.get("teeth_from") == "record" and "tooth_drive" in hits:
        told.append("Teeth are numbered from the record's first angle (no index mark): in another record they differ.")
    if not found.recording.meta.get("period_s"):
        told.append("The period of the drive's fluctuation is not known (no --rig with harmonics): no phases.")
    touched = summary["contacts_seen"]
    quiet = [flank for flank, orders in summary["contact_orders"].items() if touched[flank] and not orders]
    if quiet:
        told.append(f"On the {' and the '.join(quiet)} flank no order stands out, or contact is too short.")
    told.append(
        "Orders are known at the angles at which the gears touch. Where the swing keeps step with the revolution"
    )
    told[-1] += " these are always the same, and one order may pass for another."
    return told
