"""Rattle campaigns on the benches of the three papers, with known laws of restitution, seen through their encoders."""

import tomllib

import numpy as np

from gears3d.scenario import load
from gears3d.simulation import record

TUNING, TESTING = 10_000, 500_000
"""First seeds of campaigns to try things on, and of those whose coverage is reported."""
LAWS = ("constant", "linear", "asymmetric", "scattered")
BENCHES = {
    "rigaud-2020": ("scenarios/rigaud-2020/fig5-20rpm.toml", 1_600_000),
    "ottewill-2010": ("scenarios/ottewill-2010/fig10.toml", 40_000),
    "kadmiri-2012": ("scenarios/kadmiri-2012/fig13-100rpm-fitted.toml", 8192),
}
"""Scenario that each bench's campaigns begin with, and counts a revolution of its encoders."""
SPEEDS = {"rigaud-2020": 0.02, "ottewill-2010": 0.06, "kadmiri-2012": 0.06}
"""Typical speed of approach [m/s]."""
MOTIONS = {
    "rigaud-2020": ("rpm", (20.0, 7.0), (3.0, 4.7), "5 s"),
    "ottewill-2010": ("rad", (0.2, 0.04), (2.0, 3.1), "15 s"),
    "kadmiri-2012": ("rpm", (100.0, 30.0), (25.0, 38.0), "0.8 s"),
}
"""Unit and sizes of two fluctuations, their frequencies [Hz], and the duration of a record."""


def law_of(bench, law, random):
    """Return the true numbers of a law: a spread over what impacts may be."""
    truth = {"restitution": random.uniform(0.4, 0.65)}
    if law == "linear":
        truth["restitution"] += 0.1
        truth["slope"] = -random.uniform(0.1, 0.25) / SPEEDS[bench]
    if law == "asymmetric":
        truth["asymmetry"] = random.choice([-1.0, 1.0]) * random.uniform(0.06, 0.12)
    if law == "scattered":
        truth["standard_deviation"] = random.uniform(0.04, 0.12)
    return truth


def motion_of(bench, random):
    """Return two fluctuations of the drive, out of step with each other and the revolution, and what else is to be set.

    One fluctuation makes periodic motions, with one to three speeds of approach that tell nothing of a slope.
    """
    unit, (size, second), (slow, fast), duration = MOTIONS[bench]
    swings = [
        {
            "amplitude": f"{random.uniform(0.9, 1.1) * size} {unit}",
            "frequency": f"{random.uniform(0.9, 1.1) * slow} Hz",
        },
        {
            "amplitude": f"{random.uniform(0.8, 1.2) * second} {unit}",
            "frequency": f"{random.uniform(0.9, 1.1) * fast} Hz",
            "phase": f"{random.uniform(0.0, 360.0)} deg",
        },
    ]
    return {"motion.harmonics": swings, "run.duration": duration}


def campaign(bench, law, seed, **more):
    """Return a scenario, what its encoders recorded, and the true numbers of its law."""
    random = np.random.default_rng([seed, list(BENCHES).index(bench), LAWS.index(law)])
    truth = law_of(bench, law, random)
    effects = [
        {"kind": kind, key: f"{truth[key]} s/m" if key == "slope" else truth[key]}
        for kind, key in (
            ("restitution_speed", "slope"),
            ("restitution_asymmetry", "asymmetry"),
            ("restitution_scatter", "standard_deviation"),
        )
        if key in truth
    ]
    changes = motion_of(bench, random) | {"impact.restitution": truth["restitution"], "run.seed": seed} | more
    scenario = load(BENCHES[bench][0], changes)
    base = scenario.with_({"effect": [*_kept(scenario), *effects]})
    return base, record(base, seed=seed), truth


def _kept(scenario):
    """Effects of the bench itself that are no restitution, as tables."""
    written = tomllib.loads(scenario.document).get("effect", [])
    return [one for one in written if not one["kind"].startswith("restitution")]
