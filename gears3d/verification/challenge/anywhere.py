"""Effects hidden in the rigs of :mod:`.space`: any number of them, with and without dirt."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil
from typing import Any

import numpy as np

from gears3d.recording import Recording
from gears3d.verification.challenge import causes, encoders
from gears3d.verification.challenge.hiding import Plan
from gears3d.verification.challenge.history import happen
from gears3d.verification.challenge.plan import values
from gears3d.verification.challenge.sensing import UNSTATED, sense
from gears3d.verification.challenge.space import Rig
from gears3d.verification.challenge.taking import BEFORE, PER_FALL, PER_PERIOD, PERIODS

# Kinds without a trace: records bring their own motion, and friction needs compliant teeth
BLIND = ("drive_motion", "mesh_friction")
SIZES = (0.1, 0.5)  # Of hidden effects as shares of their unit sizes, evenly over the logarithm
# Highest order that is drawn of deviations of flanks; that of a single tooth is the number of teeth
GEOMETRY = {"transmission_error": 4, "eccentricity": 1, "backlash_variation": 4, "pitch_error": 0}
# Acceleration of a deviation of flanks over the deceleration of the loose gear at most: the drive makes the rattle
FLUNG = 0.5
LEAST = 0.02  # Share of its unit size below which a deviation of flanks is not hidden


def largest(rig: Rig, kind: str) -> float:
    """Return the largest size of an effect in a rig, as a share of its unit size.

    Flanks of a gear that turns fast deviate by little of the backlash: more would fling the loose gear about by itself.
    """
    if kind not in GEOMETRY:
        return SIZES[1]
    fastest = (GEOMETRY[kind] or max(rig.teeth)) * max(now.mean for now in rig.conditions)
    return min(FLUNG * rig.deceleration / fastest**2 / rig.backlash, SIZES[1])


def fits(rig: Rig, kind: str) -> bool:
    """Return whether an effect can be hidden in a rig."""
    return kind not in BLIND and largest(rig, kind) > LEAST


def plan(rig: Rig, kinds: Sequence[str], *, size: float | None = None, samples: int = 300_000) -> Plan:
    """Draw what is hidden in a rig.

    Args:
        rig: of :func:`gears3d.verification.challenge.space.draw`.
        kinds: of the effects, of ``KINDS``.
        size: of each as a share of its unit size; drawn from ``SIZES`` unless given.
        samples: of a record at most, as for :func:`gears3d.verification.challenge.taking.take`.

    Returns:
        The plan; its conditions state the motion and the duration of each record.

    >>> from gears3d.verification.challenge.space import draw
    >>> made = plan(draw(1, 1)[0], ["drag_coulomb"], samples=1000)
    >>> made.effects[0]["kind"], len(made.conditions)
    ('drag_coulomb', 8)
    """
    random = np.random.default_rng([rig.seed, rig.index, 31])
    each = []
    for number, now in enumerate(rig.conditions):
        lasts = min(now.duration, max(samples / rig.rate, PERIODS / now.frequency))
        sines = [(now.amplitude, now.frequency, 0.0)]
        if "drive_harmonics" in rig.dirt:
            phases = np.random.default_rng([rig.seed, rig.index, number, 37]).uniform(-np.pi, np.pi, 2)
            sines += [
                (UNSTATED * now.amplitude, n * now.frequency, float(p)) for n, p in zip((2, 3), phases, strict=True)
            ]
        harmonics = [
            {"amplitude": f"{a!r} rad/s", "frequency": f"{f!r} Hz", "phase": f"{p!r} rad"} for a, f, p in sines
        ]
        each.append(
            {"motion.mean": f"{now.mean!r} rad/s", "motion.harmonics": harmonics, "run.duration": f"{lasts!r} s"}
        )
    base = rig.scenario(0).with_({"run.duration": each[0]["run.duration"]})
    sizes = [float(np.exp(random.uniform(*np.log(SIZES)))) if size is None else size for _ in kinds]
    sizes = [min(own, largest(rig, kind)) for own, kind in zip(sizes, kinds, strict=True)]
    effects = tuple(causes.draw(kind, base, own, random) for kind, own in zip(kinds, sizes, strict=True))
    zeros = tuple((float(a), float(b)) for a, b in random.uniform(-np.pi, np.pi, (len(each), 2)))
    share = float(np.mean(sizes)) if sizes else 0.0
    return Plan(rig.seed, base, tuple(each), effects, (), share, rig.noise_share, zeros)


def observer(rig: Rig) -> Callable[[Plan, int, Any], Recording]:
    """Return what plays one record of a plan out, with the rig's sensors."""

    def observe(plan: Plan, number: int, progress: Callable[[float], None] | None = None) -> Recording:
        now = rig.conditions[number]
        random = np.random.default_rng([rig.seed, rig.index, number, 41])
        before = 0.0 if any(one["kind"] == "drag_drift" for one in plan.effects) else BEFORE + random.uniform()
        skipped = ceil(before / now.frequency * rig.rate)  # a drift begins with its record
        scenario = plan.rig.with_({**plan.conditions[number], "effect": list(plan.effects)})
        lasts = scenario.run.duration + skipped / rig.rate
        scenario = scenario.with_({"run.duration": f"{lasts!r} s"})
        facts = [values(effect) for effect in scenario.effects]
        late = {gear: encoders.delay(facts, gear) for gear in ("drive", "loose")}
        step = min(rig.fall / PER_FALL, 1.0 / (PER_PERIOD * now.frequency * len(scenario.motion.harmonics)))
        seed = int(random.integers(2**31))
        how = {"step": step, "seed": seed, "late": late["loose"], "late_drive": late["drive"], "progress": progress}
        motion = happen(scenario, rate=rig.rate, **how)
        time = motion.time[skipped:] - motion.time[skipped]
        angles = tuple(
            encoders.wander(facts, gear, motion.signals[f"theta_{gear}_rad"][skipped:]) for gear in ("drive", "loose")
        )
        columns, _ = sense(rig, time, (angles[0], angles[1]), random, True, plan.zeros[number])
        return Recording(columns, meta={"sample_rate_Hz": rig.rate})

    return observe
