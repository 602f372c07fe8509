"""Records without any fault, of rigs and motions of many kinds; nothing here knows how they are examined."""

from functools import lru_cache

import numpy as np

from gears3d.measured.readers import Channels
from gears3d.recording import Recording
from gears3d.scenario import load
from gears3d.simulation import encode, simulate

RIGAUD, KADMIRI, OTTEWILL = (
    f"scenarios/{name}.toml" for name in ("rigaud-2020/fig5-20rpm", "kadmiri-2012/fig7-100rpm", "ottewill-2010/case-i")
)
HELICAL = "scenarios/base/helical-17-43.toml"


@lru_cache(maxsize=4)
def happened(file=RIGAUD, changes=()):
    """A scenario and what the rigid model makes of it; ``changes`` as pairs of key and TOML text or value."""
    scenario = load(file, dict(changes))
    rate = f"{scenario.sensors.sample_rate!r} Hz"
    return scenario, simulate(scenario.with_({"run.output_rate": rate}), "rigid")


def seen(scenario, truth, noise=0.0, seed=1, counts=None, change=None):
    """What encoders make of it; ``noise`` of one angle along the line of action, in parts of the backlash.

    ``change`` of the columns happens before they are counted.
    """
    rig = scenario.rig()
    changes = {}
    for gear, radius in (("drive", rig.base_radius_drive), ("loose", rig.base_radius_loose)):
        changes[f"sensors.{gear}.noise"] = f"{noise * rig.backlash / radius!r} rad"
        if counts is not None:
            changes[f"sensors.{gear}.counts_per_revolution"] = counts
    own = scenario.with_(changes)
    if change is not None:
        truth = Recording(change(dict(truth.signals)))
    record = encode(truth, own.sensors, seed)
    return own, {name: np.array(values) for name, values in record.signals.items()}


def rattling(noise=0.005, seed=1, counts=None, duration="3 s", change=None):
    """Rigaud's bench at 20 rpm, both flanks struck; columns may be changed."""
    return seen(*happened(RIGAUD, (("run.duration", duration),)), noise, seed, counts, change)


def turning(noise=0.005, seed=1, counts=None, duration="4 s", change=None):
    """The same bench in contact all the time, turning unevenly, with a transmission error of order 1 and 90."""
    return seen(*_touching(duration), noise, seed, counts, change)


@lru_cache(maxsize=2)
def _touching(duration):
    changes = {
        "run.duration": duration,
        "motion.harmonics": [{"amplitude": "0.5 rpm", "frequency": "3 Hz"}],
        "effect": [
            {"kind": "transmission_error", "order": 1, "amplitude": "20 um", "phase": "40 deg"},
            {"kind": "transmission_error", "order": 90, "amplitude": "0.3 um"},
        ],
    }
    return happened.__wrapped__(RIGAUD, tuple(changes.items()))


def channels(columns, file="record.csv"):
    return Channels(dict(columns), file)
