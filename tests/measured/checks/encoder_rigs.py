"""Rigs at random with a wrong count per revolution, wrong teeth or nothing wrong; nothing here knows any check.

A loose gear between two flanks, integrated with short steps: drag, contact, impacts with restitution. Flanks run out
once and twice per revolution of either gear, encoders are off centre, counts are rounded, the drive fluctuates freely
or in step with its revolution.
"""

from typing import NamedTuple

import numba
import numpy as np

from gears3d.scenario import Scenario, load

DRIVE, LOOSE = "theta_drive_rad", "theta_loose_rad"
BENCH = "scenarios/rigaud-2020/fig5-20rpm.toml"
ROWS = 400_000
CAUSES = ("drive", "loose", "teeth", "nothing")


class Rig(NamedTuple):
    """A record and what is wrong with it: the cause, the true counts of the wrong encoder, and the conditions."""

    scenario: Scenario
    columns: dict
    cause: str
    counts: float
    declared: int
    about: str


@numba.njit(cache=True)
def fly(forced, low, high, step, drag, restitution, rows, sub):
    """Displacement of the loose gear [m] at an acceleration of the drive, between flanks ``low`` and ``high``."""
    out = np.zeros(rows)
    place, speed = low[0], 0.0
    for row in range(rows):
        for k in range(sub):
            i = row * sub + k
            speed += (-drag - forced[i]) * step
            place += speed * step
            if place < low[i]:
                place = low[i] + restitution * (low[i] - place)
                speed = -restitution * speed if speed < 0.0 else speed
            elif place > high[i]:
                place = high[i] - restitution * (place - high[i])
                speed = -restitution * speed if speed > 0.0 else speed
        out[row] = place
    return out


def coloured(seed, length, rows, angle, lines):
    """Errors of an encoder that are not white [rad], of a seed: 1/f noise and interpolation errors of its lines.

    Each is 0.1 to 2 % of an angle ``length`` (of the backlash), as standard deviation and amplitude.
    """
    random = np.random.default_rng([seed, 78])
    sizes = np.exp(random.uniform(np.log(1e-3), np.log(2e-2), 2)) * length
    frequency = np.maximum(np.arange(rows // 2 + 1), 1)
    pink = np.fft.irfft(np.fft.rfft(random.standard_normal(rows)) / np.sqrt(frequency), rows)
    pink -= pink.mean()
    waves = [np.cos(times * lines * angle + random.uniform(0, 2 * np.pi)) / times for times in (1, 2)]
    return sizes[0] * pink / pink.std() + sizes[1] * sum(waves)


def draw(seed, cause=None, dirty=False):
    """Return the rig of a seed; where it is ``dirty``, its encoders have 1/f noise and interpolation errors."""
    random = np.random.default_rng([seed, 77])

    def log(low, high):
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    cause = cause or CAUSES[random.integers(4)]
    z1 = round(log(15, 60))
    z2 = z1 if random.random() < 0.15 else int(np.clip(round(z1 * log(0.6, 4.0)), 15, 120))
    module, backlash = random.uniform(1e-3, 4e-3), log(40e-6, 400e-6)
    named = (z1, z2)
    if cause == "teeth":
        steps = [(1, 0), (-1, 0), (0, 1), (0, -1)]
        i, j = steps[random.integers(4)]
        named = (z1 + i, z2 + j)
    counts = int(np.clip(2 * np.pi * 0.47 * module * z2 * log(8, 2000) / backlash, 1000, 4_000_000))
    r1, r2 = (0.5 * module * z * np.cos(np.deg2rad(20)) for z in (z1, z2))
    revolutions = log(3, 200)
    mean = log(3, 300)
    lasting = 2 * np.pi * revolutions / mean
    locked = random.random() < 0.5
    order = float(random.choice([0.5, 1, 2, 3, 4, 6])) if locked else log(0.3, 8.0)
    turn = order * mean
    drag, lam = log(0.3, 60.0), log(0.1, 20.0)
    amplitude = float(min(lam * drag / r1 / turn, 0.6 * mean))
    rows = int(np.clip(revolutions * log(200, 4000), 3000, ROWS))
    scenario = load(
        BENCH,
        {
            "gears.module": f"{module!r} m",
            "gears.drive.teeth": named[0],
            "gears.drive.profile_shift": 0.4 if named[0] < 25 else 0.0,
            "gears.loose.teeth": named[1],
            "gears.loose.profile_shift": 0.4 if named[1] < 25 else 0.0,
            "mount.backlash": f"{backlash!r} m",
            "run.duration": f"{lasting!r} s",
            "run.settle": "0 s",
            "motion.mean": f"{mean!r} rad/s",
            "motion.harmonics": [{"amplitude": f"{amplitude!r} rad/s", "frequency": f"{turn / (2 * np.pi)!r} Hz"}],
            "sensors.sample_rate": f"{rows / lasting!r} Hz",
            "sensors.counts_per_revolution": counts,
        },
    )
    sub = max(int(np.ceil(lasting / rows * turn * 60)), int(np.ceil(lasting / rows / np.sqrt(backlash / drag) * 20)), 1)
    sub = min(sub, max(2_000_000 // rows, 1))
    time = np.arange(rows * sub) * (lasting / rows / sub)
    step = time[1]
    phase = random.uniform(0, 2 * np.pi, 20)
    wander = log(1e-4, 1e-2) * mean
    slow = 2 * np.pi / lasting * random.uniform(0.3, 2.0)
    first = mean * time - amplitude / turn * np.cos(turn * time + phase[0]) + wander / slow * np.sin(slow * time)
    forced = r1 * (amplitude * turn * np.cos(turn * time + phase[0]) - wander * slow * np.sin(slow * time))
    run = [random.uniform(0, 20e-6), random.uniform(0, 20e-6), random.uniform(0, 8e-6), random.uniform(0, 8e-6)]
    second = first * r1 / r2
    waves = [(1, first), (1, second), (2, first), (2, second)]
    flank = sum(a * np.cos(n * angle + p) for a, (n, angle), p in zip(run, waves, phase[1:5], strict=True))
    flank = flank + random.uniform(0, 3e-6) * np.cos(z1 * first + phase[5])
    place = fly(forced, flank, flank + backlash, step, drag, random.uniform(0.05, 0.8), rows, sub)
    first, time = first[sub - 1 :: sub], time[sub - 1 :: sub]
    second = (r1 * first + place) / r2
    read = {}
    wrong, true_counts = 1.0, float(counts)
    if cause in ("drive", "loose"):
        while abs(wrong - 1.0) < 1e-4:
            wrong = 1.0 + random.uniform(-0.05, 0.05) * (1.0 if random.random() < 0.7 else 0.1)
        true_counts = float(round(counts * wrong))
    noise = backlash / r2 * log(1e-5, 0.05)
    for k, (name, angle) in enumerate(((DRIVE, first), (LOOSE, second))):
        own = true_counts if name.split("_")[1] == cause else counts
        off = random.uniform(0, 3e-4) * np.cos(angle + phase[6 + k])
        off += random.uniform(0, 3e-5) * np.cos(2 * angle + phase[8 + k])
        seen = angle + off + noise * random.standard_normal(rows)
        if dirty:
            seen = seen + coloured(2 * seed + k, backlash / (r1, r2)[k], rows, angle, max(counts // 256, 64))
        read[name] = np.floor(seen * own / (2 * np.pi)) * (2 * np.pi / counts)
    travel = np.ptp(place - flank[sub - 1 :: sub]) / backlash
    about = f"{z1}:{z2}, {revolutions:.0f} rev, wrong {wrong - 1:+.4f}, order {order:.2f}{' locked' if locked else ''}"
    about += f", lambda {lam:.2f}, b {1e6 * backlash:.0f} um, y {travel:.2f} b"
    return Rig(scenario, {"time_s": time, **read}, cause, true_counts, counts, about)


def turned(cause, wrong=1.0, revolutions=100, hopping=False, patterns=10e-6, named=(30, 43), order=2.3, teeth=(30, 43)):
    """Return a rig with a wrong count of one encoder, or with other teeth declared than it has.

    ``patterns`` is the run-out of both gears [m]; the eccentricity of the encoders goes with it.
    """
    random = np.random.default_rng(5)
    module, backlash, counts, mean = 2e-3, 150e-6, 200_000, 20.0
    r1, r2 = (0.5 * module * z * np.cos(np.deg2rad(20)) for z in teeth)
    lasting = 2 * np.pi * revolutions / mean
    amplitude, turn = (0.3 * mean, order * mean) if hopping else (0.02 * mean, order * mean)
    rows = 600 * revolutions
    sub = 4
    scenario = load(
        BENCH,
        {
            "gears.module": f"{module} m",
            "gears.drive.teeth": named[0],
            "gears.loose.teeth": named[1],
            "mount.backlash": f"{backlash} m",
            "run.duration": f"{lasting!r} s",
            "run.settle": "0 s",
            "motion.mean": f"{mean} rad/s",
            "motion.harmonics": [{"amplitude": f"{amplitude!r} rad/s", "frequency": f"{turn / (2 * np.pi)!r} Hz"}],
            "sensors.sample_rate": f"{rows / lasting!r} Hz",
            "sensors.counts_per_revolution": counts,
        },
    )
    time = np.arange(rows * sub) * (lasting / rows / sub)
    first = mean * time - amplitude / turn * np.cos(turn * time)
    forced = r1 * amplitude * turn * np.cos(turn * time)
    flank = patterns * (np.cos(first + 0.3) + np.cos(first * r1 / r2 + 1.0))
    drag = 6.0 if hopping else 60.0
    place = fly(forced, flank, flank + backlash, time[1], drag, 0.3, rows, sub)
    first, time = first[sub - 1 :: sub], time[sub - 1 :: sub]
    true, read = float(round(counts * wrong)), {}
    for gear, angle in (("drive", first), ("loose", (r1 * first + place) / r2)):
        seen = angle + 0.3 * patterns / r1 * np.cos(angle + 2.0) + 2e-5 * random.standard_normal(rows)
        own = true if gear == cause else counts
        read[f"theta_{gear}_rad"] = np.floor(seen * own / (2 * np.pi)) * (2 * np.pi / counts)
    return Rig(scenario, {"time_s": time, **read}, cause, true, counts, f"{cause} {wrong}")
