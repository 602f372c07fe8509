"""Slow turns of random flanks seen by random encoders, and the truth about them, from the scenario's effects."""

from math import pi

import numpy as np

from gears3d.identify import read_contacts, roll, transmission_error
from gears3d.identify.transmission import backlash
from gears3d.measured.checks import Admitted
from gears3d.measured.readers import Channels
from gears3d.scenario import load
from gears3d.simulation import record

RIGS = {
    "2048 lines": ("scenarios/base/kadmiri-2012.toml", 37),
    "10 000 ppr": ("scenarios/base/ottewill-2010.toml", 6),
    "400 000 ppr": ("scenarios/base/rigaud-2020.toml", 6),
}
"""Scenario and turns of each encoder."""
LAWS = ("transmission-error", "backlash")


def drawn(encoder, seed):
    """Return a scenario of random flanks and encoders."""
    random = np.random.default_rng([seed, 7])
    base = load(RIGS[encoder][0])
    teeth = base.gears.drive.teeth

    def wave(order, low, high, gear="drive", kind="transmission_error"):
        size = float(np.exp(random.uniform(np.log(low), np.log(high))))
        phase = f"{random.uniform(0.0, 6.28)!r} rad"
        one = {"kind": kind, "order": int(order), "amplitude": f"{size!r} um", "phase": phase}
        return one | ({"gear": gear} if kind == "transmission_error" else {})

    effects = [
        wave(1, 5, 30),
        wave(random.integers(2, 9), 1, 10),
        wave(random.integers(9, teeth - 1), 0.5, 3),
        wave(teeth, 0.5, 5),
        wave(random.integers(1, 6), 1, 10, kind="backlash_variation"),
    ]
    if base.gears.loose.teeth != teeth:
        effects += [wave(1, 3, 15, "loose"), wave(random.integers(2, 19), 0.5, 5, "loose")]
    counts = base.sensors.drive.counts_per_revolution
    noise = random.uniform(0.0, 0.5, 2) * (random.uniform(size=2) < 0.75) * 2 * pi / counts
    changes = {f"sensors.{gear}.noise": f"{float(noise[i])!r} rad" for i, gear in enumerate(("drive", "loose"))}
    changes["sensors.sample_rate"] = "61.803 Hz"  # 3708.18 a turn at 1 rpm: not in step
    changes["mount.backlash"] = f"{1e6 * base.rig().backlash * random.uniform(0.8, 1.5)!r} um"
    return base.with_({**changes, "effect": [*_own(base), *effects]})


def _own(base):
    """Return the effects that the bench has itself."""
    import tomllib

    return tomllib.loads(base.document).get("effect", [])


def truth(scenario):
    """Return amplitude·exp(i·phase) of every order of both flanks and of the backlash, and its mean, all in m."""
    flanks = {"active": {}, "reverse": {}, "": {}}
    for one in scenario.effects:
        if one.kind not in ("transmission_error", "backlash_variation"):
            continue
        moved = ("active", "reverse") if one.kind == "transmission_error" else ("reverse", "")
        name = f"{getattr(one, 'gear', 'drive')}_{one.order}"
        for flank in moved:
            own = flanks[flank]
            own[name] = own.get(name, 0.0) + one.amplitude * np.exp(1j * one.phase)
    return flanks, scenario.rig().backlash


def campaign(encoder, seed, laws=LAWS):
    """Return what one record tells: rows of (law, parameter, error over deviation, inside), missed and false orders."""
    scenario = drawn(encoder, seed)
    seen = record(scenario, "transmission-error", turns=RIGS[encoder][1], seed=seed)
    bench = load(RIGS[encoder][0])
    rolled = roll(read_contacts([Admitted(Channels(seen.signals), bench, (), "")]))
    flanks, width = truth(scenario)
    rows, missed, false = [], [], []
    for law in laws:
        found = (transmission_error if law == LAWS[0] else backlash)(rolled).parameters
        wanted = ("active", "reverse") if law == LAWS[0] else ("",)
        if law == LAWS[1]:
            rows.append((law, "backlash", *_judged(found["backlash"], width)))
        known = set()
        for flank in wanted:
            for order, phasor in flanks[flank].items():
                key = f"{flank}_{order}" if flank else order
                known |= {f"{key}_amplitude", f"{key}_phase"}
                if f"{key}_amplitude" not in found:
                    missed.append((law, key, abs(phasor)))
                    continue
                name = flank or "variation"
                rows.append((law, f"{name} amplitude", *_judged(found[f"{key}_amplitude"], abs(phasor))))
                phase = found[f"{key}_phase"]
                off = (phase.value - np.angle(phasor) + pi) % (2 * pi) - pi
                rows.append((law, f"{name} phase", *_judged(phase, phase.value - off)))
        false += [(law, name, found[name].value) for name in found if name.endswith("amplitude") and name not in known]
    return rows, missed, false


def _judged(parameter, value):
    deviation = (parameter.high - parameter.low) / 3.92
    return (parameter.value - value) / deviation, bool(parameter.low <= value <= parameter.high)
