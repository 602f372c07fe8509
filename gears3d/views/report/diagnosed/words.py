"""What channels, places and structures are called in the report of a diagnosis."""

from __future__ import annotations

from collections.abc import Sequence

CHANNEL_WORDS = {
    "flight": ("flight", "angle of the loose gear in flight against free fall under its drag"),
    "contact": ("contact", "place of the loose gear on a flank against the nominal flank"),
    "impact": ("impact", "speed after an impact against e times the speed before"),
    "loss": (
        "loss of contact",
        "speed at which the flight, followed back to where the gap opens slowest, meets the flank it left",
    ),
    "drive": ("drive", "angle of the drive gear against the claimed motion"),
}
"""Name of each channel and what is compared there."""
LEFT_OUT = {
    "flight": ("flight", "flights"),
    "contact": ("point in contact", "points in contact"),
    "impact": ("impact", "impacts"),
    "loss": ("loss of contact", "losses of contact"),
}
"""What is left out of each channel, one and several."""
STRUCTURES = {
    "sensor.ratio": "a displacement in contact that drifts with time",
    "sensor.delay": "a displacement in contact that follows the drive's speed",
    "sensor.order_drive": "an order of the drive gear's angle",
    "flight.speed": "a deceleration in flight that depends on speed",
    "flight.time": "a deceleration in flight that changes with time",
    "flight.gap": "a deceleration in flight that depends on the place in the gap",
    "flight.angle_loose": "a deceleration in flight with an order of the loose gear",
    "flight.angle_drive": "a deceleration in flight with an order of the drive gear",
    "impact.speed": "rebounds that depend on the speed of approach",
    "impact.flank": "rebounds that differ by flank",
    "impact.tooth": "rebounds that depend on the angle at which the gears strike",
    "impact.order_drive": "rebounds with an order of the drive gear",
    "impact.order_loose": "rebounds with an order of the loose gear",
    "impact.time": "rebounds that are like those shortly before them",
    "contact.tooth_drive": "contact that ends at one tooth of the drive gear, as if that stood out",
    "contact.tooth_loose": "contact that ends at one tooth of the loose gear, as if that stood out",
    "contact.time": "a backlash that changes with time",
    "impact.duration": "a path that rings on after impacts",
    "contact.order_drive": "a displacement in contact with an order of the drive gear",
    "contact.order_loose": "a displacement in contact with an order of the loose gear",
    "contact.loss_phase": "moments of losing contact that depend on speed",
    "flight.all": "paths in flight that are off without any order over speed, angle or time",
    "contact.all": "a displacement in contact that is off without any order over angle, speed or time",
}
"""What is left, in words, by its name in the contract."""
RINGS = "readings that ring at one frequency, whatever the speed, as of an encoder that sways on its mount"
"""What is left where a resonance is told of the readings themselves, in metres."""
PLACES = {
    "geometry": "flanks and backlash",
    "torque": "torques on the loose gear",
    "impact": "restitution",
}
"""What the power of each place is about."""


def called(structure: str, unit: str) -> str:
    """Return what is left in words.

    Args:
        structure: its name in the contract.
        unit: of its size.

    >>> called("impact.flank", "m/s"), called("impact.duration", "m").split()[0]
    ('rebounds that differ by flank', 'readings')
    """
    return RINGS if (structure, unit) == ("impact.duration", "m") else STRUCTURES.get(structure, structure)


def joined(names: Sequence[str]) -> str:
    """Return names in a row, as they are written in a sentence.

    Args:
        names: any.

    >>> joined(["a"]), joined(["a", "b", "c"])
    ('a', 'a, b and c')
    """
    return " and ".join([", ".join(names[:-1]), names[-1]]) if len(names) > 1 else "".join(names)
