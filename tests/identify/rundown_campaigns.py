"""Synthetic campaigns of run-downs, assemblies, gears in mesh and threshold sweeps, seen by three rigs' encoders."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from math import pi
from typing import Any, NamedTuple

import numpy as np

from gears3d.errors import InputError
from gears3d.identify import (
    Inertia,
    Run,
    Share,
    Sweep,
    Track,
    identify_assemblies,
    identify_mesh_drag,
    identify_rundown,
    identify_threshold,
    make_track,
)
from gears3d.recording import Recording
from gears3d.scenario import Scenario, Sensor, Sensors, load
from gears3d.simulation import encode
from gears3d.simulation.recorder import sweep
from tests.identify import shafts

RIGS = shafts.ENCODERS


class Outcome(NamedTuple):
    """Truth and answer by name; empty when nothing was told; whether the right law would have been chosen."""

    truth: Mapping[str, float]
    found: Mapping[str, Any]
    right: bool = True


def told(truth: Mapping[str, float], identify: Callable[[], Any]) -> Outcome:
    """Return the outcome of an identification whose law is given."""
    try:
        found = identify().parameters
    except InputError:
        return Outcome(truth, {})
    return Outcome(truth, found if truth.keys() <= found.keys() else {})


def campaign(encoder: str, seed: int, kinds: tuple[str, ...]) -> tuple[list, list, list]:
    """Return rows of (law, parameter, error over deviation, inside), laws that told nothing, laws not chosen."""
    rows, missed, false = [], [], []
    for kind in kinds:
        for law, make in LAWS[kind].items():
            one = make(encoder, seed)
            if not one.found:
                missed.append((law, law))
            if not one.right:
                false.append((law, law))
            for name, truth in one.truth.items() if one.found else ():
                parameter = one.found[name]
                pull = (parameter.value - truth) / ((parameter.high - parameter.low) / 3.92)
                rows.append((law, name, pull, parameter.low <= truth <= parameter.high))
    return rows, missed, false


SPEEDS = (20.0, 80.0)
"""At the release [rad/s]."""


def seen(
    encoder: str, seed: int, inertia: float, torque=0.0, viscous=0.0, power=0.0, exponent=1.0, speed=50.0
) -> Track:
    """Return a run-down as an encoder sees it, sampled at 10 kHz at most to keep the campaigns short."""
    counts, rate = shafts.ENCODERS[encoder]
    if viscous or power:
        time, angle = shafts.solved(inertia, torque, viscous, power, exponent, speed, min(rate, 1e4))
    else:
        slowing = torque / inertia
        time = np.arange(0.0, speed / slowing, 1.0 / min(rate, 1e4))
        angle = speed * time - 0.5 * slowing * time**2
    return make_track(time, shafts.counted(angle, counts, seed))


def plain(law: str, encoder: str, seed: int) -> Outcome:
    """One run-down of one law: numbers with the law given, and whether it would have been chosen."""
    random = np.random.default_rng(seed)
    truth = {}
    speed = random.uniform(*SPEEDS)
    typical = random.uniform(0.1, 0.8)
    if "coulomb" in law:
        truth["coulomb"] = typical
    if "viscous" in law:
        truth["viscous"] = typical * random.uniform(0.5, 2.0) / speed
    if "power" in law:
        truth["exponent"] = random.uniform(1.5, 2.5)
        truth["coefficient"] = typical * random.uniform(0.5, 2.0) / speed ** truth["exponent"]
    track = seen(
        encoder,
        seed,
        shafts.INERTIA,
        truth.get("coulomb", 0.0),
        truth.get("viscous", 0.0),
        truth.get("coefficient", 0.0),
        truth.get("exponent", 1.0),
        speed,
    )
    found = told(truth, lambda: identify_rundown([track], shafts.INERTIA, law=law))
    try:
        right = identify_rundown([track], shafts.INERTIA).law == law
    except InputError:
        right = False
    return found._replace(right=right)


def assemblies(encoder: str, seed: int) -> Outcome:
    """Kadmiri's three assemblies: bearings, shear, churning."""
    random = np.random.default_rng(seed)
    shaft, geared = 1e-3, 2.2e-3
    dry, viscous = random.uniform(0.01, 0.03), random.uniform(1e-4, 4e-4)
    shear, churning, exponent = random.uniform(2e-4, 9e-4), random.uniform(5e-3, 2e-2), random.uniform(0.5, 0.9)
    truth = {
        "bearing.coulomb": dry,
        "bearing.viscous": viscous,
        "shear.viscous": shear,
        "churning.coefficient": churning,
        "churning.exponent": exponent,
    }
    made = (
        (shaft, "shaft", (dry, viscous), ("bearing",)),
        (geared, "geared", (dry, viscous + shear), ("bearing", "shear")),
        (geared, "geared", (dry, viscous + shear, churning, exponent), ("bearing", "shear", "churning")),
    )
    runs = [
        Run(seen(encoder, 10 * seed + at, inertia, *drag, speed=78.0), tuple(map(Share, parts)), ((name, 1.0),))
        for at, (inertia, name, drag, parts) in enumerate(made)
    ]
    known = {"shaft": Inertia(shaft), "geared": Inertia(geared)}
    return told(truth, lambda: identify_assemblies(runs, known, {"bearing": "coulomb+viscous"}))


def mesh(encoder: str, seed: int) -> Outcome:
    """Ottewill's run-downs: both shafts alone, then in mesh."""
    random = np.random.default_rng(seed)
    n, loose, drive = 0.7, 0.01, 0.03
    one, other = (random.uniform(0.01, 0.05), random.uniform(0.01, 0.03)), (0.03, random.uniform(2e-3, 8e-3))
    added = random.uniform(0.005, 0.02)
    both = (one[0] + n * other[0], one[1] + n**2 * other[1] + added)
    heavy = loose + n**2 * drive
    tracks = [
        [seen(encoder, 10 * seed + at, inertia, *drag, speed=speed)]
        for at, (inertia, drag, speed) in enumerate(((loose, one, 30.0), (drive, other, 25.0), (heavy, both, 30.0)))
    ]
    given = dict.fromkeys(("loose", "drive"), "coulomb+viscous")
    truth = {"mesh_drag": added, "loose.viscous": one[1], "drive.viscous": other[1]}
    return told(truth, lambda: identify_mesh_drag(*tracks, (Inertia(loose), Inertia(drive)), n, given))


@lru_cache(maxsize=2)
def swept(seed: int, rate: float) -> tuple[Scenario, Recording]:
    """Return Rigaud's bench with another drag, frequency and restitution, swept for 60 periods."""
    random = np.random.default_rng(seed)
    drag, frequency = random.uniform(0.15, 0.75), random.uniform(2.0, 5.0)
    rpm = drag / shafts.INERTIA / (2 * pi * frequency) * 30 / pi
    low, high = random.uniform(0.4, 0.7), random.uniform(1.4, 1.8)
    scenario = load(
        "scenarios/rigaud-2020/fig5-5rpm.toml",
        {
            "drag.torque": f"{drag} N m",
            "impact.restitution": random.uniform(0.0, 0.6),
            "motion.mean": f"{random.uniform(28.0, 45.0)} rpm",
            "motion.harmonics": [{"amplitude": f"{rpm} rpm", "frequency": f"{frequency} Hz", "phase": "20 deg"}],
            "run.duration": f"{60.0 / frequency} s",
            "sensors.sample_rate": f"{rate} Hz",
        },
    )
    return scenario, sweep(scenario, (low * rpm * pi / 30, high * rpm * pi / 30))


def threshold(encoder: str, seed: int) -> Outcome:
    """One sweep up and down."""
    counts, rate = shafts.ENCODERS[encoder]
    scenario, happened = swept(seed, min(rate, 1e4))
    record = encode(happened, Sensors(min(rate, 1e4), Sensor(counts), Sensor(counts)), seed)
    truth = {"drag_up": scenario.drag.torque, "drag_down": scenario.drag.torque}
    return told(truth, lambda: identify_threshold([Sweep(record, scenario)]))


PLAIN = ("coulomb", "viscous", "coulomb+viscous", "coulomb+power", "coulomb+viscous+power")
LAWS = {
    "rundown": {law: partial(plain, law) for law in PLAIN},
    "assemblies": {"assemblies": assemblies},
    "mesh-drag": {"mesh-drag": mesh},
    "threshold": {"threshold": threshold},
}
