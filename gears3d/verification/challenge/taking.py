"""Records of the rigs of :mod:`.space`: with what truly happened in them, and with hidden effects, any number of them.

Both come with and without dirt.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.recording import Recording
from gears3d.verification.challenge.causes import draw
from gears3d.verification.challenge.hiding import Plan
from gears3d.verification.challenge.machine import values
from gears3d.verification.challenge.motion import happen
from gears3d.verification.challenge.sensing import UNSTATED, delay, sense, wander
from gears3d.verification.challenge.space import Rig

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

SAMPLES = 2_000_000  # Samples of a record at most; its duration is shortened, to no less than
PERIODS = 30  # periods of the fluctuation
BEFORE = 5  # Periods before the record begins: a rig has run for a while
# Steps of integration in a fall across the backlash and in a period: Runge and Kutta's parabolas are exact
PER_FALL, PER_PERIOD = 150.0, 150.0
GRID = 720  # Moments in a period of the fastest wave at which contact may be left
ALONG = 129  # Moments of a flight at which its height is looked for
# A flank has impacts when they occur in more than this part of the periods, as the contract has it
SHARE = 0.1
ACTIVE, REVERSE = 0, 1
# Amplitudes of flanks that are not perfect over the backlash: order 1 of the drive (order 2 has 1/3 of it) and
# its mesh order; runout and transmission error of quality grades 6 to 9
RUNOUT, MESH = (0.01, 0.15), (0.001, 0.01)
# Acceleration of a wave over the deceleration of the loose gear at most: the drive makes the rattle, not the waves
GENTLE = 0.1
# Kinds without a trace: records bring their own motion, and friction needs compliant teeth
BLIND = ("drive_motion", "mesh_friction")
SIZES = (0.1, 0.5)  # Of hidden effects as shares of their unit sizes, evenly over the logarithm
# Highest order that is drawn of deviations of flanks; that of a single tooth is the number of teeth
GEOMETRY = {"transmission_error": 4, "eccentricity": 1, "backlash_variation": 4, "pitch_error": 0}
# Acceleration of a deviation of flanks over the deceleration of the loose gear at most: the drive makes the rattle
FLUNG = 0.5
LEAST = 0.02  # Share of its unit size below which a deviation of flanks is not hidden


class Wave(NamedTuple):
    """An order of both flanks over the drive's angle from its zero in the motion: amplitude·cos(order·θ + phase)."""

    order: int  # per revolution of the drive
    amplitude: float  # m
    phase: float  # rad


@dataclass(frozen=True, eq=False)
class Truth:
    """What truly happened in a record, from the displacement s of ideal flanks at 0 and at the backlash."""

    backlash: float  # m
    restitution: float  # coefficient
    # ``time_s``, ``flank`` (0 active, 1 reverse), ``velocity_m_s`` and ``rebound_m_s`` (ds/dt before and after),
    # ``flight_height_m`` and ``flight_s`` (of the flight that it ends), (k,) each
    impacts: dict[str, np.ndarray]
    # ``start_s``, ``end_s``, ``left``, ``struck``, ``height_m``, (f,) each; whole ones
    flights: dict[str, np.ndarray]
    contacts: np.ndarray  # flank, begin, end [s], (c, 3)
    waves: tuple[Wave, ...]  # of both flanks
    mean: float  # speed of the drive, rad/s
    # of the drive's speed: amplitude, rad/s, circular frequency, rad/s, and phase at the record's begin
    sines: tuple[tuple[float, float, float], ...]
    period: float  # of the fluctuation, s
    duration: float  # of the record, s
    step: float  # between samples, s
    begin: float  # of the record, after a start on the active flank, in the motion's own time, s
    dirt: dict[str, float]  # its sizes by kind

    def drive_speed(self, time: np.ndarray) -> np.ndarray:
        """Return the speed of the drive at times of the record [rad/s], (n,).

        Units: ``time`` [s], (n,).
        """
        return self.mean + sum((a * np.sin(w * time + phase) for a, w, phase in self.sines), np.zeros_like(time))

    def regime(self, height: float = 0.0) -> str:
        """Return the regime: ``contact``, ``single_sided`` or ``double_sided``."""
        hits = self.impacts
        high = hits["flight_height_m"] > height
        periods = max(self.duration / self.period, 1.0)
        struck = 0
        for flank in (ACTIVE, REVERSE):
            own = hits["time_s"][high & (hits["flank"] == flank)]
            struck += len(np.unique(np.floor(own / self.period))) > SHARE * periods
        return ("contact", "single_sided", "double_sided")[struck]


@dataclass(frozen=True, eq=False)
class Taken:
    """A record, the rig as its owner describes it, and the truth."""

    record: Recording  # ``time_s``, ``theta_drive_rad``, ``theta_loose_rad``
    scenario: Scenario  # rig and condition
    truth: Truth  # about the record


def take(rig: Rig, number: int = 0, *, dirt: bool = True, waves: bool = False, samples: int = SAMPLES) -> Taken:
    """Return a record of a rig with its truth.

    The record has ``samples`` at most: its duration is shortened, to no less than 30 periods. It begins within the
    motion; zeros of the encoders are arbitrary.

    >>> from gears3d.verification.challenge.space import draw
    >>> taken = take(draw(1, 1)[0], samples=1000)
    >>> sorted(taken.record.signals) == ["theta_drive_rad", "theta_loose_rad", "time_s"]
    True
    """
    now, scenario = rig.conditions[number], rig.scenario(number)
    random = np.random.default_rng([rig.seed, rig.index, number, 17])
    duration = min(now.duration, max(samples / rig.rate, PERIODS / now.frequency))
    skipped = ceil((BEFORE + random.uniform()) / now.frequency * rig.rate)
    sines = [(now.amplitude, now.frequency, 0.0)]
    if dirt and "drive_harmonics" in rig.dirt:
        sines += [(UNSTATED * now.amplitude, n * now.frequency, float(random.uniform(0.0, 2.0 * pi))) for n in (2, 3)]
    lasts = duration + skipped / rig.rate
    harmonics = [{"amplitude": f"{a!r} rad/s", "frequency": f"{f!r} Hz", "phase": f"{p!r} rad"} for a, f, p in sines]
    orders = _waves(rig, now.mean, np.random.default_rng([rig.seed, rig.index, number, 23])) if waves else ()
    effects = [
        {"kind": "transmission_error", "order": n, "amplitude": f"{size!r} m", "phase": f"{phase!r} rad"}
        for n, size, phase in orders
    ]
    true = scenario.with_({"run.duration": f"{lasts!r} s", "motion.harmonics": harmonics, "effect": effects})
    step = min(rig.fall / PER_FALL, 1.0 / (PER_PERIOD * now.frequency * len(sines)))
    motion = happen(true, step=step)
    begin = float(motion.time[skipped])
    time = motion.time[skipped:] - begin
    angles = (motion.signals["theta_drive_rad"][skipped:], motion.signals["theta_loose_rad"][skipped:])
    columns, sizes = sense(rig, time, angles, random, dirt)
    impacts, flights, contacts = _events(rig, _Drive(rig.base_radius[0], now.mean, sines, orders), motion)
    scale = 1.0 + sizes.get("clock", 0.0)  # the truth is in the record's own time
    end = float(time[-1])
    inside = (impacts["time_s"] >= begin) & (impacts["time_s"] <= begin + end)
    impacts = {name: values[inside] for name, values in impacts.items()}
    impacts["time_s"] = scale * (impacts["time_s"] - begin)
    whole = (flights["start_s"] >= begin) & (flights["end_s"] <= begin + end)
    flights = {name: values[whole] for name, values in flights.items()}
    for name in ("start_s", "end_s"):
        flights[name] = scale * (flights[name] - begin)
    contacts[:, 1:] = np.clip(scale * (contacts[:, 1:] - begin), 0.0, scale * end)
    contacts = contacts[contacts[:, 2] > contacts[:, 1]]
    period, lasts = scale / now.frequency, scale * end
    turn = 2.0 * pi * begin
    turned = tuple((a / scale, 2.0 * pi * f / scale, f * turn + phase) for a, f, phase in sines)
    known = (rig.backlash, rig.restitution, impacts, flights, contacts, orders, now.mean / scale, turned)
    truth = Truth(*known, period, lasts, scale / rig.rate, begin, sizes)
    about = {"sample_rate_Hz": rig.rate}
    return Taken(Recording(columns, meta=about), scenario, truth)


def _waves(rig: Rig, mean: float, random: np.random.Generator) -> tuple[Wave, ...]:
    """Return runout, its second order and the mesh order of the flanks."""
    first, mesh = (rig.backlash * float(np.exp(random.uniform(*np.log(span)))) for span in (RUNOUT, MESH))
    made = []
    for order, size in ((1, first), (2, 0.3 * first), (rig.teeth[0], mesh)):
        gentle = GENTLE * rig.deceleration / (order * mean) ** 2
        made.append(Wave(order, min(size, gentle), float(random.uniform(0.0, 2.0 * pi))))
    return tuple(made)


class _Drive(NamedTuple):
    """The active flank along the line of action over time."""

    radius: float  # base radius of the drive, m
    mean: float  # speed, rad/s
    sines: list[tuple[float, float, float]]  # of the speed: amplitude, rad/s, frequency, Hz, phase
    waves: tuple[Wave, ...]  # of both flanks over the drive's angle

    def at(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return place [m], speed [m/s] and acceleration [m/s²] of the flank."""
        angle, speed, gain = self.mean * time, np.full_like(time, self.mean), np.zeros_like(time)
        for amplitude, frequency, phase in self.sines:
            w = 2.0 * pi * frequency
            angle = angle + amplitude / w * (np.cos(phase) - np.cos(w * time + phase))
            speed = speed + amplitude * np.sin(w * time + phase)
            gain = gain + amplitude * w * np.cos(w * time + phase)
        place, slope, bend = self.radius * angle, np.full_like(time, self.radius), np.zeros_like(time)
        for wave in self.waves:
            x = wave.order * angle + wave.phase
            place = place + wave.amplitude * np.cos(x)
            slope = slope - wave.amplitude * wave.order * np.sin(x)
            bend = bend - wave.amplitude * wave.order**2 * np.cos(x)
        return place, slope * speed, slope * gain + bend * speed**2


def _events(
    rig: Rig, drive: _Drive, motion: Recording
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray], np.ndarray]:
    """Return impacts, flights and contacts of a motion that begins on the active flank.

    The generator notes impacts; where contact is left follows from the drive: as soon as its flank is slowed more than
    the loose gear (active flank), or less (reverse flank).
    """
    hits = motion.impacts
    stays = hits["rebound_m_s"] == 0.0
    times = np.concatenate([[0.0], hits["time_s"][stays]])
    sides = np.concatenate([[ACTIVE], hits["flank"][stays].astype(int)])
    left = _leaves(rig, drive, times, sides, float(motion.time[-1]))
    following = np.append(hits["time_s"], np.inf)[np.searchsorted(hits["time_s"], times, "right")]
    ends = np.minimum(np.minimum(left, following), motion.time[-1])
    contacts = np.column_stack([sides, times, ends]).astype(float)
    # a flight ends with each impact; it begins where contact was left, or with the impact before
    k = np.arange(len(stays))
    before = np.maximum(k - 1, 0)
    held = (k == 0) | stays[before]
    place = np.cumsum(np.insert(stays, 0, True))[: len(stays)] - 1  # number of the last contact before each impact
    start = np.where(held, ends[place], hits["time_s"][before])
    side = np.where(held, sides[place], hits["flank"][before]).astype(int)
    departs = np.where(held, 0.0, hits["rebound_m_s"][before])
    struck = hits["flank"].astype(int)
    height = _heights(rig, drive, (start, hits["time_s"]), side, departs)
    height = np.where(struck == side, height, rig.backlash)
    names = ("time_s", "velocity_m_s", "rebound_m_s")
    impacts = {name: hits[name] for name in names}
    impacts |= {"flank": struck, "flight_height_m": height, "flight_s": hits["time_s"] - start}
    flights = {"start_s": start, "end_s": hits["time_s"], "left": side, "struck": struck, "height_m": height}
    return impacts, flights, contacts


def _leaves(rig: Rig, drive: _Drive, times: np.ndarray, sides: np.ndarray, end: float) -> np.ndarray:
    """Return when contacts that begin at some times on some sides are left, never: infinity [s]."""
    fastest = max([f for _, f, _ in drive.sines] + [wave.order * drive.mean / (2.0 * pi) for wave in drive.waves])
    grid = np.linspace(0.0, end, ceil(GRID * fastest * end) + 2)

    def presses(time: np.ndarray) -> np.ndarray:  # on the active flank
        return drive.at(time)[2] + rig.deceleration > 0.0

    on_active = presses(grid)
    found = np.full(len(times), np.inf)
    for flank in (ACTIVE, REVERSE):
        chosen = np.flatnonzero(sides == flank)
        lets_go = np.flatnonzero((on_active[:-1] != on_active[1:]) & (on_active[:-1] == (flank == ACTIVE)))
        begin = times[chosen]
        holds = presses(begin) == (flank == ACTIVE)
        later = np.searchsorted(grid[lets_go + 1], begin, "right")
        some = later < len(lets_go)
        step = lets_go[np.minimum(later, max(len(lets_go) - 1, 0))] if len(lets_go) else np.zeros(len(begin), int)
        low, high = np.maximum(grid[step], begin), grid[step + 1]
        for _ in range(60):
            middle = 0.5 * (low + high)
            still = presses(middle) == (flank == ACTIVE)
            low, high = np.where(still, middle, low), np.where(still, high, middle)
        found[chosen] = np.where(holds, np.where(some, high, np.inf), begin)
    return found


def _heights(
    rig: Rig, drive: _Drive, span: tuple[np.ndarray, np.ndarray], side: np.ndarray, departs: np.ndarray
) -> np.ndarray:
    """Return how far flights go from the flank that they leave [m]; the loose gear is slowed evenly until it stands."""
    start, end = span
    later = (end - start)[:, None] * np.linspace(0.0, 1.0, ALONG)
    place, speed, _ = drive.at(start)
    way = drive.at(start[:, None] + later)[0] - place[:, None]
    speed = (speed + departs)[:, None]  # of the loose gear
    moving = np.minimum(later, np.abs(speed) / rig.deceleration)
    own = speed * moving - 0.5 * np.sign(speed) * rig.deceleration * moving**2
    apart = np.where(side == ACTIVE, 1.0, -1.0)[:, None] * (own - way)
    return apart.max(axis=1, initial=0.0)


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
    effects = tuple(draw(kind, base, own, random) for kind, own in zip(kinds, sizes, strict=True))
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
        late = {gear: delay(facts, gear) for gear in ("drive", "loose")}
        step = min(rig.fall / PER_FALL, 1.0 / (PER_PERIOD * now.frequency * len(scenario.motion.harmonics)))
        seed = int(random.integers(2**31))
        how = {"step": step, "seed": seed, "late": late["loose"], "late_drive": late["drive"], "progress": progress}
        motion = happen(scenario, rate=rig.rate, **how)
        time = motion.time[skipped:] - motion.time[skipped]
        angles = tuple(
            wander(facts, gear, motion.signals[f"theta_{gear}_rad"][skipped:]) for gear in ("drive", "loose")
        )
        columns, _ = sense(rig, time, (angles[0], angles[1]), random, True, plan.zeros[number])
        return Recording(columns, meta={"sample_rate_Hz": rig.rate})

    return observe
