"""Clean records drawn at random: rigs, motions, regimes, flanks, drags, noise and counts; nothing is wrong."""

import numpy as np

from gears3d.scenario import load
from gears3d.simulation import simulate
from tests.measured.checks.clean import HELICAL, KADMIRI, OTTEWILL, RIGAUD, seen

KINDS = ("rattle", "contact", "even", "reversing", "strong")
RIGS = {
    RIGAUD: (20.0, 60.0, 0.5, 10.0, (1_600_000, 160_000, None)),
    KADMIRI: (100.0, 1000.0, 5.0, 40.0, (8192, 400_000, None)),
    OTTEWILL: (30.0, 120.0, 1.0, 4.0, (40_000, 1_000_000, None)),
    HELICAL: (300.0, 1500.0, 10.0, 50.0, (100_000, 1_000_000, None)),
}
"""Mean speed [rpm], frequency [Hz] of the drive from and to, counts a revolution."""


def draw(seed):
    """Return a scenario, its record's columns, and in a word what it is."""
    random = np.random.default_rng(seed)
    file = list(RIGS)[seed % len(RIGS)]
    kind = KINDS[seed // len(RIGS) % len(KINDS)]
    low, high, slow, fast, counts = RIGS[file]
    bench = load(file)
    rig = bench.rig()
    mean = float(np.exp(random.uniform(np.log(low), np.log(high))))
    frequency = float(np.exp(random.uniform(np.log(slow), np.log(fast))))
    excitation = {"rattle": random.uniform(1.2, 6.0), "contact": random.uniform(0.1, 0.9), "even": 0.0}.get(
        kind, random.uniform(2.0, 20.0)
    )
    ratio = rig.base_radius_drive / rig.base_radius_loose
    drag = max(rig.drag_torque, 0.05)
    swing = excitation * drag / rig.inertia / (2 * np.pi * frequency) / ratio * 60.0 / (2 * np.pi)
    if kind == "reversing":
        mean = random.uniform(-0.3, 0.3) * swing
    elif kind != "strong":
        swing = min(swing, 0.8 * mean)
    duration = max(3.0, 4.0 / frequency) if file != OTTEWILL else 12.0
    changes = {
        "motion.mean": f"{mean!r} rpm",
        "motion.harmonics": [{"amplitude": f"{swing!r} rpm", "frequency": f"{frequency!r} Hz"}] if swing else [],
        "impact.restitution": float(random.uniform(0.0, 0.6)),
        "run.duration": f"{duration!r} s",
        "run.settle": "0 s",
        "drag.torque": f"{drag!r} N m",
        "effect": effects(random, rig),
        "sensors.sample_rate": f"{bench.sensors.sample_rate if file == OTTEWILL else 20_000.0} Hz",
    }
    scenario = bench.with_(changes)
    truth = simulate(scenario.with_({"run.output_rate": f"{scenario.sensors.sample_rate!r} Hz"}), "rigid")
    noise = float(np.exp(random.uniform(np.log(5e-4), np.log(0.03))))
    counted = counts[random.integers(len(counts))]
    own, columns = seen(scenario, truth, noise, seed, counted)
    shift = random.uniform(-50.0, 50.0, 3)
    for name, off in zip(("time_s", "theta_drive_rad", "theta_loose_rad"), shift, strict=True):
        count = None if name == "time_s" or counted is None else 2 * np.pi / counted
        columns[name] = columns[name] + (off if count is None else np.round(off / count) * count)
    return own, columns, f"{kind} of {file.split('/')[1].removesuffix('.toml')}"


def effects(random, rig):
    """Flanks that are not perfect, and drags that change: what is no fault of an encoder."""
    b = rig.backlash
    chosen = []
    for gear in ("drive", "loose"):
        if random.random() < 0.4:
            order = int(random.choice([1, 1, 1, 2, 3, 5, 7]))
            size = float(random.uniform(0.01, 0.25) * b / order)
            turn = f"{random.uniform(0, 360)} deg"
            chosen.append(
                {"kind": "transmission_error", "order": order, "amplitude": f"{size} m", "phase": turn, "gear": gear}
            )
    if random.random() < 0.3:
        size = float(random.uniform(0.01, 0.2) * b)
        chosen.append({"kind": "backlash_variation", "order": 1, "amplitude": f"{size} m"})
    if random.random() < 0.3:
        chosen.append({"kind": "drag_viscous", "coefficient": f"{0.01 * random.uniform()} N m s/rad"})
    return chosen
