"""A second simulator of a rattling loose gear: flights in closed form, events by bisection, in fixed steps.

It shares no equation with the models and with the generator of hidden effects, only the description of rigs.
"""

from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet
from numba import njit

KINDS = (
    "drag_coulomb", "drag_viscous", "restitution_offset", "restitution_scatter", "backlash_offset", "eccentricity",
    "transmission_error", "encoder_eccentricity", "encoder_skew",
)  # fmt: skip
SHARES = (0.1, 0.5)
"""Sizes of causes as shares of what would change their place by 100 %."""
MAP = '[[record]]\nfile = "{}"\n[record.drive]\nzero = "arbitrary"\n[record.loose]\nzero = "arbitrary"\n'


@njit(cache=True)
def drive(t, mean, sines):
    """Angle, speed and acceleration of the drive; ``sines``: amplitude and circular frequency of the speed, phase."""
    x, v, a = mean * t, mean, 0.0
    for size, turn, phase in sines:
        x += size / turn * (np.cos(phase) - np.cos(turn * t + phase))
        v += size * np.sin(turn * t + phase)
        a += size * turn * np.cos(turn * t + phase)
    return x, v, a


@njit(cache=True)
def flank(side, t, s, rig, sines, waves):
    """Place, speed and acceleration of a flank of the drive in the loose gear's path s along the line of action.

    ``waves``: gear, order, cosine and sine on the active and on the reverse flank [m].
    """
    mean, r1, r2, gap = rig[0], rig[1], rig[2], rig[3]
    x, v, a = drive(t, mean, sines)
    off, slope, bend = 0.0, 0.0, 0.0
    for wave in waves:
        at = wave[1] * (x if wave[0] == 0.0 else s / r2)
        rate = wave[1] * (1.0 if wave[0] == 0.0 else r1 / r2)
        c, d = wave[2 + 2 * side], wave[3 + 2 * side]
        off += c * np.cos(at) + d * np.sin(at)
        slope += rate * (d * np.cos(at) - c * np.sin(at))
        bend -= rate * rate * (c * np.cos(at) + d * np.sin(at))
    return r1 * x + off + (gap if side else 0.0), (r1 + slope) * v, (r1 + slope) * a + bend * v * v


@njit(cache=True)
def on_flank(side, t, s, rig, sines, waves):
    """The same where the loose gear is on that flank."""
    for _ in range(4):
        s, v, a = flank(side, t, s, rig, sines, waves)
    return s, v, a


@njit(cache=True)
def fly(s, v, dt, rig):
    """Place and speed after a flight under constant and viscous drag."""
    a, k = rig[4], rig[5]
    if k * dt < 1e-9:
        return s + v * dt - 0.5 * (a + k * v) * dt * dt, v - (a + k * v) * dt
    e = np.exp(-k * dt)
    return s + (v + a / k) * (1.0 - e) / k - a / k * dt, (v + a / k) * e - a / k


@njit(cache=True)
def clear(side, t, s, v, dt, rig, sines, waves):
    """Distance from a flank after a flight."""
    at, _ = fly(s, v, dt, rig)
    away = at - flank(side, t + dt, at, rig, sines, waves)[0]
    return away if side == 0 else -away


@njit(cache=True)
def struck(side, t, s, v, h, rig, sines, waves):
    """Time from the begin of a flight to the impact on a flank that is behind it after a step."""
    low, high, seen = 0.0, h, False
    for i in range(1, 65):
        dt = h * i / 64.0
        if clear(side, t, s, v, dt, rig, sines, waves) >= 0.0:
            low, seen = dt, True
        elif seen:
            high = dt
            break
    for i in range(0 if seen else 40):  # a rebound shorter than a 64th of the step
        dt = h / 64.0 * 0.5**i
        if clear(side, t, s, v, dt, rig, sines, waves) > 0.0:
            low = dt
            break
        high = dt
    for _ in range(70):
        dt = 0.5 * (low + high)
        if clear(side, t, s, v, dt, rig, sines, waves) > 0.0:
            low = dt
        else:
            high = dt
    return high


@njit(cache=True)
def run(times, rig, sines, waves, h, stays, restitutions):
    """Path along the line of action at times [m]; ``rig``: mean, radii, gap, deceleration, viscous rate [1/s]."""
    out, n, m, t, side, contact = np.zeros(len(times)), 0, 0, 0.0, 0, True
    s, v, _ = on_flank(0, 0.0, 0.0, rig, sines, waves)
    while n < len(times):
        way = 1.0 if side == 0 else -1.0
        if contact:
            s, v, a = on_flank(side, t, s, rig, sines, waves)
            if (a + rig[4] + rig[5] * v) * way < 0.0:
                contact = False
                continue
            low, high = t, t + h
            ahead, speed, bend = on_flank(side, high, s + h * v, rig, sines, waves)
            if (bend + rig[4] + rig[5] * speed) * way < 0.0:
                contact = False
                for _ in range(60):
                    mid = 0.5 * (low + high)
                    _, speed, bend = on_flank(side, mid, ahead, rig, sines, waves)
                    if (bend + rig[4] + rig[5] * speed) * way < 0.0:
                        high = mid
                    else:
                        low = mid
            while n < len(times) and times[n] <= high:
                out[n] = on_flank(side, times[n], ahead, rig, sines, waves)[0]
                n += 1
            t = high
            s, v, _ = on_flank(side, t, ahead, rig, sines, waves)
            continue
        lasts, hit = h, -1
        for each in (0, 1):
            if clear(each, t, s, v, h, rig, sines, waves) < 0.0:
                hit = each
                lasts = struck(each, t, s, v, h, rig, sines, waves)
        while n < len(times) and times[n] <= t + lasts:
            out[n] = fly(s, v, times[n] - t, rig)[0]
            n += 1
        s, v = fly(s, v, lasts, rig)
        t += lasts
        if hit >= 0:
            s, speed, bend = flank(hit, t, s, rig, sines, waves)
            rebound = restitutions[m % len(restitutions)] * (v - speed)
            presses = (bend + rig[4] + rig[5] * speed) * (1.0 if hit == 0 else -1.0) > 0.0
            side, contact, m = hit, abs(rebound) < stays and presses, m + 1
            if lasts < 1e-6 * h and abs(rebound) < stays:  # about to be left: neither state would last
                contact, t = True, t + 1e-3 * h
            v = speed if contact else speed - rebound
    return out


class Cause(NamedTuple):
    """What a rig hides.

    Args:
        kind: as an effect of a scenario.
        size: of its leading number [SI].
        gear: 0 drive, 1 loose.
        order: in a revolution.
        phase: [rad].
    """

    kind: str
    size: float
    gear: int = 0
    order: int = 1
    phase: float = 0.0


def cause_of(rig, kind, random):
    """A cause of some size that is not too fast for the loose gear to follow."""
    share, sign = float(np.exp(random.uniform(*np.log(SHARES)))), float(random.choice([-1.0, 1.0]))
    gear, phase = int(random.integers(2)), float(random.uniform(0.0, 2.0 * np.pi))
    order = int(random.integers(2, 5)) if kind == "transmission_error" else 1
    speeds = np.array([one.mean for one in rig.conditions])
    turning = speeds.max() * (1.0, rig.base_radius[0] / rig.base_radius[1])[gear if kind == "eccentricity" else 0]
    gentle = min(share * rig.backlash, 0.5 * rig.deceleration / (order * turning) ** 2)
    offset = sign * share if 0.02 < rig.restitution + sign * share < 0.95 else -sign * share
    size = {
        "drag_coulomb": sign * share * rig.drag,
        "drag_viscous": share * rig.drag / (speeds.mean() * rig.base_radius[0] / rig.base_radius[1]),
        "restitution_offset": float(np.clip(offset, 0.02 - rig.restitution, 0.95 - rig.restitution)),
        "restitution_scatter": 0.5 * share * min(rig.restitution, 1.0 - rig.restitution),
        "backlash_offset": sign * share * rig.backlash,
        "eccentricity": gentle,
        "transmission_error": gentle,
        "encoder_eccentricity": share * rig.backlash / rig.base_radius[gear],
        "encoder_skew": sign * share * rig.backlash / (rig.base_radius[0] * speeds.mean()),
    }[kind]
    return Cause(kind, float(size), 0 if kind == "transmission_error" else gear, order, phase)


def waves_of(rig, causes):
    """Rows of :func:`flank` of run-out by an eccentric gear, and of transmission errors."""
    angle = rig.scenario().rig().working_pressure_angle  # more than 20 degrees with profile shift
    sine, cosine = np.sin(angle), np.cos(angle)
    rows = []
    for one in causes:
        c, s = one.size * np.cos(one.phase), one.size * np.sin(one.phase)
        if one.kind == "transmission_error":
            rows.append([0.0, one.order, c, -s, c, -s])
        elif one.kind == "eccentricity":  # the centre goes round by (cos, sin) of the angle; both lines of action
            way, sizes = 1.0 - 2.0 * one.gear, []  # external gears turn in opposite directions
            for along in (sine, -sine):
                sizes += [way * (c * along + s * cosine), -s * along + c * cosine]
            rows.append([float(one.gear), 1.0, *sizes])
    return np.array(rows).reshape(-1, 6)


def columns_of(rig, number, causes, samples, random):
    """A record: time and angles as sampled, with the dirt of the rig."""
    now, size = rig.conditions[number], {one.kind: one.size for one in causes}
    r1, r2 = rig.base_radius
    count = int(min(now.duration, max(samples / rig.rate, 30.0 / now.frequency)) * rig.rate)
    even = np.arange(count) / rig.rate
    times = (5.0 + random.uniform()) / now.frequency + even
    if "jitter" in rig.dirt:  # of the clock of both encoders
        times = times + random.normal(0.0, 1e-3 / rig.rate, count)
    turn = 2.0 * np.pi * now.frequency
    sines = [(now.amplitude, turn, 0.0)]
    if "drive_harmonics" in rig.dirt:
        sines += [(0.05 * now.amplitude, n * turn, float(random.uniform(0.0, 2.0 * np.pi))) for n in (2, 3)]
    sines = np.array(sines)
    deceleration = rig.deceleration * (1.0 + size.get("drag_coulomb", 0.0) / rig.drag)
    known = np.array([now.mean, r1, r2, rig.backlash + size.get("backlash_offset", 0.0), deceleration,
                      size.get("drag_viscous", 0.0) / rig.inertia])  # fmt: skip
    spread = size.get("restitution_scatter", 0.0) * random.standard_normal(100_003)
    restitutions = np.clip(rig.restitution + size.get("restitution_offset", 0.0) + spread, 0.0, 1.0)
    late = size.get("encoder_skew", 0.0)
    both = np.concatenate([times, times - late])
    order = np.argsort(both, kind="stable")
    h = min(rig.fall / 100.0, 2.0 * np.pi / float(sines[:, 1].max()) / 200.0)
    path = np.zeros(2 * count)
    stays = 1e-4 * np.sqrt(2.0 * rig.deceleration * rig.backlash)
    path[order] = run(both[order], known, sines, waves_of(rig, causes), h, stays, restitutions)
    angles = [np.array([drive(t, now.mean, sines)[0] for t in times]), path[count:] / r2]
    columns = {"time_s": even * (1.0 + 30e-6 * ("clock" in rig.dirt))}
    for gear, name in enumerate(("drive", "loose")):
        seen, radius = angles[gear], rig.base_radius[gear]
        for one in causes:
            if one.kind == "encoder_eccentricity" and one.gear == gear:
                seen = seen + one.size * np.cos(seen + one.phase)
        if "one_over_f" in rig.dirt:
            frequency = np.fft.rfftfreq(count)
            frequency[0] = frequency[1]
            slow = np.fft.irfft(np.fft.rfft(random.standard_normal(count)) / np.sqrt(frequency), count)
            seen = seen + 3e-3 * rig.backlash / radius * slow / np.std(slow)
        if "interpolation" in rig.dirt:
            lines = rig.counts // 4
            seen = seen + 0.003 * 2.0 * np.pi / lines * np.cos(lines * seen + 1.0)
        seen = seen + rig.noise * random.standard_normal(count) + random.uniform(0.0, 2.0 * np.pi)
        edge = 2.0 * np.pi / rig.counts
        seen = np.floor(seen / edge) * edge
        if "held" in rig.dirt:  # single readings that repeat the one before
            fresh = random.uniform(size=count) > 0.01
            seen = seen[np.maximum.accumulate(np.where(fresh, np.arange(count), 0))]
        columns[f"theta_{name}_rad"] = seen
    return columns


def write(rig, causes, folder, samples=100_000):
    """Write records of a rig with a map, as a test bench without index marks leaves them; return the map's path."""
    folder.mkdir(parents=True, exist_ok=True)
    told = ["format = 1\n"]
    for number in range(len(rig.conditions)):
        random = np.random.default_rng([rig.seed, rig.index, number, 5])
        columns = columns_of(rig, number, causes, samples, random)
        pa.parquet.write_table(pa.table(columns), folder / f"record-{number + 1}.parquet")
        told.append(MAP.format(f"record-{number + 1}.parquet"))
    (folder / "record.toml").write_text("\n".join(told))
    return folder / "record.toml"
