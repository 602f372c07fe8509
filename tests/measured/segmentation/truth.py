"""Records with known impacts: the rigid twin seen through encoders; nothing here knows how a record is cut."""

from functools import lru_cache

import numpy as np

from gears3d.measured.segmentation import segment, track
from gears3d.scenario import load
from gears3d.simulation import encode, simulate

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"


@lru_cache(maxsize=8)
def happened(restitution=0.3, wander=0.0, swing="20 rpm", duration="5 s", file=FIG5, rate="50 kHz", frequency="3 Hz"):
    """A scenario and what the rigid model makes of it; ``wander`` in m moves flanks and backlash once a turn."""
    changes = {
        "impact.restitution": restitution,
        "run.duration": duration,
        "run.output_rate": rate,
        "sensors.sample_rate": rate,
        "motion.harmonics": [{"amplitude": swing, "frequency": frequency}],
    }
    scenario = load(file, changes)
    if wander:
        effects = [
            {"kind": "transmission_error", "order": 1, "amplitude": f"{wander} m", "phase": "40 deg"},
            {"kind": "backlash_variation", "order": 1, "amplitude": f"{0.5 * wander} m"},
        ]
        scenario = scenario.with_({"effect": effects})
    return scenario, simulate(scenario, "rigid")


def seen(scenario, truth, noise, seed, counts=1_600_000):
    """What encoders make of it; ``noise`` in parts of the gap."""
    rig = scenario.rig()
    loose = {"noise": f"{noise * rig.backlash / rig.base_radius_loose} rad", "counts_per_revolution": counts}
    return encode(
        truth, scenario.with_({"sensors.loose": loose, "sensors.drive.counts_per_revolution": counts}).sensors, seed
    )


def cut(scenario, record):
    """The segments of a record."""
    rig = scenario.rig()
    angles = (record.signals["theta_drive_rad"], record.signals["theta_loose_rad"])
    known = track(record.time, *angles, (rig.base_radius_drive, rig.base_radius_loose))
    return segment(known, (rig.teeth_drive, rig.teeth_loose))


def judged(truth, found, height):
    """How impacts after flights higher than ``height`` [m] and flanks in contact were told.

    An impact is found when one lies within a fifth of its flight; it is in time within 2 samples or 2 % of the flight.
    """
    hits, high = truth.impacts, truth.impacts["flight_height_m"] > height
    time, mine = hits["time_s"], found.impacts["time_s"]
    ends = np.sort(np.concatenate([time, [stop for _, _, stop in truth.meta["contacts"]]]))
    lasted = time - ends[np.maximum(np.searchsorted(ends, time) - 1, 0)]
    sample = truth.time[1] - truth.time[0]
    result = {"high": int(high.sum()), "found": 0, "flank": 0, "in_time": 0, "speeds": [], "pulls": [], "vpulls": []}
    for k in np.flatnonzero(high):
        if not len(mine):
            break
        near = int(np.argmin(np.abs(mine - time[k])))
        late = mine[near] - time[k]
        if abs(late) < max(5 * sample, 0.2 * lasted[k]):
            result["found"] += 1
            result["flank"] += int(found.impacts["flank"][near] == hits["flank"][k])
            result["in_time"] += int(abs(late) <= max(2 * sample, 0.02 * lasted[k]))
            result["speeds"].append(found.impacts["velocity_m_s"][near] / hits["velocity_m_s"][k] - 1.0)
            result["pulls"].append(late / found.impacts["time_sigma_s"][near])
            off = found.impacts["velocity_m_s"][near] - hits["velocity_m_s"][k]
            result["vpulls"].append(off / found.impacts["velocity_sigma_m_s"][near])
    lasting = found.flights["end_s"] - found.flights["start_s"]
    off = np.array([np.min(np.abs(time - t)) if len(time) else np.inf for t in mine])
    result["invented"] = int(np.sum(off > np.maximum(5 * sample, 0.2 * lasting)))
    state = np.full(len(truth.time), 2)
    for flank, begin, end in truth.meta["contacts"]:
        state[(truth.time >= begin) & (truth.time <= end)] = int(flank)
    mine = found.states(truth.time)
    both = (state < 2) & (mine < 2)
    result["flanks_right"] = float(np.mean(state[both] == mine[both]))
    result["states_right"] = float(np.mean(state == mine))
    return result
