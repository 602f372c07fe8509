"""Terms for channels, places and residual patterns in the report of a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence

CHANNEL_WORDS = {
    "flight": ("flight", "angle of the loose gear in free flight, compared with its deceleration by drag"),
    "contact": ("contact", "displacement in contact, compared with the nominal flank"),
    "impact": ("impact", "rebound speed, compared with the coefficient of restitution times the approach speed"),
    "loss": (
        "loss of contact",
        "separation speed, extrapolated from the flight to the instant of contact loss",
    ),
    "drive": ("drive", "angle of the drive gear, compared with the nominal motion"),
}
"""Name of each channel, with the measured and the predicted quantity."""
LEFT_OUT = {
    "flight": ("flight", "flights"),
    "contact": ("point in contact", "points in contact"),
    "impact": ("impact", "impacts"),
    "loss": ("loss of contact", "losses of contact"),
}
"""Names of excluded points of each channel, singular and plural."""
STRUCTURES = {
    "sensor.ratio": "a drift of the displacement in contact",
    "sensor.delay": "a displacement in contact that is proportional to the speed of the drive gear",
    "sensor.order_drive": "an order in the angle of the drive gear",
    "flight.speed": "a deceleration in flight that depends on speed",
    "flight.time": "a deceleration in flight that changes with time",
    "flight.gap": "a deceleration in flight that depends on the position in the gap",
    "flight.angle_loose": "a deceleration in flight with an order of the loose gear",
    "flight.angle_drive": "a deceleration in flight with an order of the drive gear",
    "impact.speed": "a rebound that depends on the approach speed",
    "impact.flank": "a rebound that differs between the flanks",
    "impact.tooth": "a rebound that depends on the gear angle at impact",
    "impact.order_drive": "a rebound with an order of the drive gear",
    "impact.order_loose": "a rebound with an order of the loose gear",
    "impact.time": "correlated rebounds of successive impacts",
    "contact.tooth_drive": "contact loss at one tooth of the drive gear, as with a positive tooth deviation",
    "contact.tooth_loose": "contact loss at one tooth of the loose gear, as with a positive tooth deviation",
    "contact.time": "a backlash that changes with time",
    "impact.duration": "ringing of the displacement after impacts",
    "contact.order_drive": "a displacement in contact with an order of the drive gear",
    "contact.order_loose": "a displacement in contact with an order of the loose gear",
    "contact.loss_phase": "a time of contact loss that depends on speed",
    "flight.all": "deviations in free flight without a pattern over speed, angle or time",
    "drive.all": "deviations of the drive's angle from its stated motion without a pattern over the angle",
    "path.all": "a displacement that the extended model predicts hardly better than the rig, from measured states on",
    "contact.all": "deviations of the displacement in contact without a pattern over angle, speed or time",
}
"""Residual patterns in words, by their names in the contract."""
RINGS = "an oscillation of the readings at one frequency, independent of speed, as of a compliant encoder mount"
"""Words for a resonance of the readings themselves, in metres."""
PLACES = {
    "geometry": "flanks and backlash",
    "torque": "torques on the loose gear",
    "impact": "restitution",
}
"""Quantities of the minimum detectable effects, by place."""


def called(structure: str, unit: str) -> str:
    """Return a residual pattern in words.

    >>> called("impact.flank", "m/s"), called("impact.duration", "m").split()[1]
    ('a rebound that differs between the flanks', 'oscillation')
    """
    return RINGS if (structure, unit) == ("impact.duration", "m") else STRUCTURES.get(structure, structure)


def joined(names: Sequence[str]) -> str:
    """Return names in a row, as they are written in a sentence.

    >>> joined(["a"]), joined(["a", "b", "c"])
    ('a', 'a, b and c')
    """
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)
