"""The bench of a challenge and the records to take on it: several speeds and amplitudes, in random order."""

from __future__ import annotations

from math import pi, sqrt
from typing import TYPE_CHECKING, Any

from gears3d.verification.challenge.causes import quantity

if TYPE_CHECKING:
    import numpy as np

    from gears3d.scenario import Scenario

# Mean speeds of the records over the rig's: a decade tells a slope from a curve, and speed from time
SPEEDS = (0.3, 0.6, 1.0, 1.6, 2.4)
# Λ of the records: one barely rattles and stays on its flanks, the others cross the gap at different speeds
EXCITATIONS = (4.0, 1.3, 6.0, 3.0, 8.0)
DURATION = 12.0  # Of a record [s]
RATE = 50e3  # Samples a second [Hz]
NOISE = 0.002  # Of both encoders together, as a share of the gap


def bench(random: np.random.Generator) -> dict[str, Any]:
    """Draw a rig: gears, backlash, drag, restitution and encoders of a bench as the papers have them."""
    teeth = ((90, 90, 3.5, 0.0), (47, 61, 2.5, 0.0), (31, 53, 3.0, 0.0), (37, 29, 2.75, 20.0))
    drive, loose, module, helix = teeth[int(random.integers(len(teeth)))]
    radius = 0.5e-3 * module * loose * 0.94
    backlash = float(f"{random.uniform(150e-6, 350e-6):.3g}")
    inertia = float(f"{3.2 * radius**2 * random.uniform(0.8, 1.25):.4g}")
    drag = float(f"{inertia / radius * random.uniform(0.4, 1.2):.3g}")
    counts = int(2.0 ** (6 + int(2.0 * pi * radius / (1e-3 * backlash) / 64).bit_length()))
    return {
        "format": 1,
        "title": f"Bench {drive}:{loose}",
        "gears": {
            "module": f"{module} mm",
            "helix_angle": f"{helix} deg",
            "face_width": "15 mm",
            "drive": {"teeth": drive},
            "loose": {"teeth": loose, "inertia": quantity(inertia, "kg m^2")},
        },
        "mount": {"backlash": quantity(backlash, "m")},
        "motion": {"mean": "60 rpm"},
        "drag": {"torque": quantity(drag, "N m")},
        "impact": {"restitution": round(float(random.uniform(0.25, 0.55)), 2)},
        "run": {"duration": f"{DURATION} s", "settle": "0 s", "output_rate": f"{RATE} Hz"},
        "sensors": {"sample_rate": f"{RATE} Hz", "counts_per_revolution": counts},
    }


def excite(rig: Scenario, random: np.random.Generator) -> dict[str, Any]:
    """Return a motion that makes a rig rattle: a fluctuation slow against the fall across the gap, a fitting mean."""
    force, frequency = _scales(rig)
    frequency *= random.uniform(0.85, 1.2)
    largest = max(EXCITATIONS) * force / (2.0 * pi * frequency) / rig.pair().drive.base_radius
    mean = 4.5 * largest * random.uniform(1.0, 1.4)
    sine = {"amplitude": f"{0.5 * largest:.5g} rad/s", "frequency": f"{frequency:.4g} Hz"}
    return {"motion.mean": f"{mean:.5g} rad/s", "motion.harmonics": [sine]}


def _scales(rig: Scenario) -> tuple[float, float]:
    """Deceleration under the drag [m/s²], and a frequency at which some ten falls fill a period [Hz]."""
    pair = rig.pair()
    inertia = float(rig.gears.loose.inertia or 0.0)
    decelerated = (rig.drag.torque or 0.2 * inertia) * pair.loose.base_radius / inertia
    return decelerated, 0.1 / sqrt(2.0 * pair.backlash / decelerated)


def conditions(rig: Scenario, random: np.random.Generator, records: int = len(SPEEDS)) -> list[dict[str, Any]]:
    """Return what differs between the records of a rig: mean speed and amplitude, in random order."""
    force, _ = _scales(rig)
    sine = rig.motion.harmonics[0]
    made = []
    for i in range(records):
        share = SPEEDS[i % len(SPEEDS)] * random.uniform(0.95, 1.05)
        mean = share * rig.motion.mean
        size = EXCITATIONS[i % len(EXCITATIONS)] * random.uniform(0.93, 1.08)
        speed = size * force / (2.0 * pi * sine.frequency) / rig.pair().drive.base_radius
        swing = {"amplitude": f"{min(speed, 0.8 * abs(mean)):.5g} rad/s", "frequency": f"{sine.frequency!r} Hz"}
        made.append({"motion.mean": f"{mean:.5g} rad/s", "motion.harmonics": [swing]})
    order = random.permutation(records)
    return [made[i] for i in order]
