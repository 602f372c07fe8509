"""Coast-downs as raw logs show them: known drags, three kinds of sensors, and the dirt of real records.

The motion is integrated with scipy; nothing is shared with the code under test. Each case writes one measured file and
its ``record.toml``, and knows the drag torque at every speed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

LAWS = ("coulomb", "viscous", "coulomb+viscous", "quadratic", "stribeck", "drift", "cogging")
CATALOGUE = {"coulomb", "viscous", "coulomb+viscous"}
"""Laws whose parameters can be compared by name; of the others only the torque."""
SENSORS = ("encoder", "speed", "pulses")
ALL = ("driven", "driven-after", "standstill", "several", "gap", "flicker")
DIRT = {
    "encoder": (*ALL, "torn", "wrong-start", "nan", "interpolation", "wrong-counts"),
    "speed": (*ALL, "torn", "wrong-start", "held", "zeros", "outliers"),
    "pulses": (*ALL, "missing", "extra", "uneven"),
}
"""Counts that are wrong by one factor all the time are not among these: no coast-down shows them."""


@dataclass
class Coast:
    """One free phase: when, and the mean drag torque that it had at each speed."""

    start: float
    end: float
    speed: Callable[[np.ndarray], np.ndarray]
    angle: Callable[[np.ndarray], np.ndarray]
    torque: Callable[[np.ndarray, np.ndarray], np.ndarray]  # of speed and time since the release, cogging excluded

    def at(self, speed: float) -> float | None:
        """Return the drag torque when the speed was passed, or nothing where it was not."""
        time = np.linspace(self.start, self.end, 20_001)
        passed = self.speed(time)
        below = np.flatnonzero(passed <= speed)
        if passed[0] < speed or not below.size:
            return None
        some = slice(max(below[0] - 1, 0), below[0] + 1)  # within a step a drifting drag moves further than intervals
        moment = np.interp(-speed, -passed[some], time[some])
        return float(self.torque(np.array([speed]), np.array([moment - self.start]))[0])


@dataclass
class Case:
    """A record with its truth."""

    seed: int
    law: str
    sensor: str
    dirt: tuple[str, ...]
    inertia: float
    parameters: dict[str, float]
    coasts: list[Coast]
    time: np.ndarray = field(default_factory=lambda: np.zeros(0))
    value: np.ndarray = field(default_factory=lambda: np.zeros(0))
    chart: str = ""
    header: tuple[str, ...] = ()

    def torque(self, speed: float) -> float | None:
        """Return the true drag torque at a speed, the mean of the coast-downs that passed it."""
        seen = [value for coast in self.coasts if (value := coast.at(speed)) is not None]
        return float(np.mean(seen)) if seen else None

    def write(self, folder: Path, only: slice | None = None) -> Path:
        """Write the record and its map, and return the path of the map."""
        some = only or slice(None)
        columns = [self.time[some]] if self.sensor == "pulses" else [self.time[some], self.value[some]]
        lines = [",".join(self.header)]
        lines += [",".join("" if np.isnan(v) else f"{v:.9g}" for v in row) for row in zip(*columns, strict=True)]
        if "torn" in self.dirt:
            lines[-1] = lines[-1][: max(len(lines[-1]) // 3, 1)]
        (folder / "log.csv").write_text("\n".join(lines) + "\n")
        chart = folder / "record.toml"
        chart.write_text(f'format = 1\nfile = "log.csv"\n{self.chart}')
        return chart


def drag_of(law: str, random: np.random.Generator, top: float, level: float) -> tuple[Any, float, dict[str, float]]:
    """Return torque(speed, time), amplitude of the cogging, and the parameters that a catalogue law has."""
    a, b = random.uniform(0.2, 0.8), random.uniform(0.3, 1.0)
    if law == "coulomb":
        return (lambda w, t: level + 0.0 * w), 0.0, {"coulomb": level}
    if law == "viscous":
        return (lambda w, t: 1.5 * level * w / top), 0.0, {"viscous": 1.5 * level / top}
    if law == "coulomb+viscous":
        truth = {"coulomb": a * level, "viscous": b * level / top}
        return (lambda w, t: truth["coulomb"] + truth["viscous"] * w), 0.0, truth
    if law == "quadratic":
        return (lambda w, t: level * (0.5 * a + b * (w / top) ** 2)), 0.0, {}
    if law == "stribeck":
        knee, rise = top * random.uniform(0.05, 0.3), random.uniform(0.2, 0.8)
        return (lambda w, t: level * (0.5 + rise * np.exp(-((w / knee) ** 2)) + 0.5 * b * w / top)), 0.0, {}
    if law == "drift":
        loss, slow = random.uniform(0.05, 0.3), random.uniform(0.3, 2.0)
        return (lambda w, t: level * (1.0 - loss * -np.expm1(-t / slow)) * (1.0 + 0.3 * a * w / top)), slow, {}
    return (lambda w, t: level * (1.0 + 0.5 * b * w / top)), level * random.uniform(0.05, 0.4), {}


def coasted(law: str, random: np.random.Generator, inertia: float, speeds: list[float], lasts: float) -> Any:
    """Return the free phases from several speeds, each at its own time 0, under one drag."""
    top = max(speeds)
    level = inertia * top / lasts
    torque, extra, parameters = drag_of(law, random, top, level)
    if law == "drift":
        slow, before = extra * lasts, torque
        torque = lambda w, t: before(w, t / slow * extra)  # noqa: E731
    ripple, order, phase = (
        (extra, int(random.integers(1, 7)), random.uniform(0, 2 * pi)) if law == "cogging" else (0, 1, 0)
    )
    last = (
        random.uniform(0.05, 0.4) if law == "viscous" else (0.0 if random.random() < 0.6 else random.uniform(0.1, 0.5))
    )
    phases = []
    for speed in speeds:

        def slowing(t: float, y: np.ndarray) -> list[float]:
            w = max(float(y[1]), 0.0)
            return [y[1], -(float(torque(w, t)) + ripple * np.sin(order * y[0] + phase)) / inertia]

        def slow_enough(_: float, y: np.ndarray, speed: float = speed) -> float:
            return float(y[1]) - max(last, 1e-4) * speed

        slow_enough.terminal = True  # type: ignore[attr-defined]
        step = pi / (order * speed) if ripple and order * speed * lasts < 5e4 else np.inf
        found = solve_ivp(
            slowing, (0.0, 100 * lasts), [0.0, speed], method="DOP853", rtol=1e-11, atol=1e-11 * speed,
            events=slow_enough, dense_output=True, max_step=step,
        )  # fmt: skip
        phases.append((float(found.t[-1]), found.sol))
    return phases, torque, parameters, last


def case(seed: int, clean: bool = False, laws: tuple[str, ...] = LAWS, sensors: tuple[str, ...] = SENSORS) -> Case:
    """Draw a record."""
    random = np.random.default_rng(seed)
    law, sensor = str(random.choice(laws)), str(random.choice(sensors))
    some = random.permutation(DIRT[sensor])[: random.integers(0, 5)]
    dirt = () if clean else tuple(str(one) for one in some)
    inertia = float(10 ** random.uniform(-4, 1))
    lasts = float(10 ** random.uniform(0.5, 2.3))
    top = float(10 ** random.uniform(1.3, 2.5))
    if law == "cogging":
        top = min(top, 600.0 / lasts + 20.0)
    speeds = [top] + [top * random.uniform(0.6, 1.0) for _ in range(random.integers(1, 3))] * ("several" in dirt)
    phases, torque, parameters, last = coasted(law, random, inertia, speeds, lasts)
    pieces, coasts = assembled(random, phases, torque, lasts, dirt, last)
    one = Case(seed, law, sensor, dirt, inertia, parameters, coasts)
    {"encoder": encoder, "speed": speed_log, "pulses": pulse_log}[sensor](one, random, pieces, top)
    return one


def assembled(random: np.random.Generator, phases: Any, torque: Any, lasts: float, dirt: tuple[str, ...], last: float):
    """Return all phases in order of time, each (start, end, angle(t), speed(t)), and the free ones."""
    now, place = float(random.uniform(0.0, 20.0)), 0.0
    pieces: list[tuple[float, float, Any, Any]] = []
    coasts = []

    def add(length: float, angle: Any, speed: Any) -> None:
        nonlocal now, place
        begin, base = now, place
        pieces.append((begin, begin + length, lambda t: base + angle(t - begin), lambda t: speed(t - begin)))
        now, place = begin + length, base + float(angle(np.array([length]))[0])

    def ramp(low: float, high: float, length: float) -> None:
        slope = (high - low) / length
        add(length, lambda t: low * t + 0.5 * slope * t**2, lambda t: low + slope * t)

    for at, (length, solution) in enumerate(phases):
        speed = float(solution(0.0)[1])
        if at or "driven" in dirt:
            if at or random.random() < 0.6:
                ramp(0.0 if at == 0 else float(phases[at - 1][1](phases[at - 1][0])[1]) * (last > 0), speed,
                     lasts * random.uniform(0.05, 0.4))  # fmt: skip
            ripple, beat = speed * 10 ** random.uniform(-4, -2.5), 2 * pi * random.uniform(4, 12) / lasts
            add(
                2 * pi / beat * random.integers(1, 4),
                lambda t, s=speed, r=ripple, b=beat: s * t + r / b * (1 - np.cos(b * t)),
                lambda t, s=speed, r=ripple, b=beat: s + r * np.sin(b * t),
            )
        begin, base = now, place
        coasts.append(
            Coast(
                begin, begin + length,
                lambda t, b=begin, s=solution: s(t - b)[1],
                lambda t, b=begin, s=solution, p=base: p + s(t - b)[0],
                torque,
            )
        )  # fmt: skip
        add(length, lambda t, s=solution: s(t)[0], lambda t, s=solution: s(t)[1])
        if last == 0.0 and ("standstill" in dirt or at + 1 < len(phases)):
            add(lasts * random.uniform(0.03, 0.5), lambda t: 0.0 * t, lambda t: 0.0 * t)
    if "driven-after" in dirt:
        top = float(phases[0][1](0.0)[1])
        end = float(phases[-1][1](phases[-1][0])[1]) * (last > 0)
        ramp(end, max(top * random.uniform(0.2, 0.9), 1.2 * end), lasts * random.uniform(0.05, 0.4))
        high = float(pieces[-1][3](np.array([now]))[0])
        add(lasts * random.uniform(0.02, 0.3), lambda t: high * t, lambda t: high + 0.0 * t)
    return pieces, coasts


def motion(pieces: Any, time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return angle and speed at sorted times."""
    angle, speed = np.zeros(len(time)), np.zeros(len(time))
    for at, (begin, end, angles, speeds) in enumerate(pieces):
        some = (time >= begin) & ((time < end) if at + 1 < len(pieces) else (time <= end))
        if some.any():
            angle[some], speed[some] = angles(time[some]), speeds(time[some])
    return angle, np.maximum(speed, 0.0)


def flicker(random: np.random.Generator, count: int) -> np.ndarray:
    """Return 1/f noise of unit deviation, (count,)."""
    spectrum = np.fft.rfft(random.normal(size=count))
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))
    spectrum[0] = 0.0
    noise = np.fft.irfft(spectrum, count)
    return noise / max(float(noise.std()), 1e-300)


def without_gap(one: Case, random: np.random.Generator, time: np.ndarray) -> np.ndarray:
    """Return which rows the recorder kept."""
    kept = np.ones(len(time), bool)
    for _ in range(random.integers(1, 3) if "gap" in one.dirt else 0):
        coast = one.coasts[random.integers(len(one.coasts))]
        length = (coast.end - coast.start) * random.uniform(0.01, 0.06)
        begin = random.uniform(coast.start, coast.end - length)
        kept &= (time < begin) | (time > begin + length)
    return kept


def encoder(one: Case, random: np.random.Generator, pieces: Any, top: float) -> None:
    """Read a counter at an even rate."""
    begin, end = pieces[0][0], pieces[-1][1]
    counts = int(10 ** random.uniform(np.log10(60), np.log10(1.6e6)))
    turned = sum(
        float(coast.angle(np.array([coast.end]))[0] - coast.angle(np.array([coast.start]))[0]) for coast in one.coasts
    )
    counts = max(counts, int(150 * 2 * pi / turned) + 1)
    time = np.linspace(begin, end, int(random.integers(3000, 20_000)))
    angle, _ = motion(pieces, time)
    step = 2 * pi / counts
    if "flicker" in one.dirt:
        angle = angle + step * 10 ** random.uniform(-0.5, 1.0) * flicker(random, len(time))
    if "interpolation" in one.dirt:  # sine and cosine of a line are uneven: an error that repeats with each line
        wave = random.choice([1, 2]) * angle / step / random.choice([4, 20, 100])
        angle = angle + step * 10 ** random.uniform(-1.0, 0.5) * np.sin(2 * pi * wave + random.uniform(0, 2 * pi))
    if "wrong-counts" in one.dirt:  # lost or counted too often in bursts, such as by disturbances of the supply
        share = random.dirichlet(np.ones(random.integers(1, 5))) * random.uniform(-0.05, 0.05)
        for at, part in zip(random.uniform(begin, end, len(share)), share, strict=True):
            angle = angle + np.where(time >= at, part * angle[-1], 0.0)
    angle = np.floor(angle / step + random.uniform()) * step * (1 if random.random() < 0.8 else -1)
    if "wrong-start" in one.dirt:
        angle[: random.integers(2, 12)] = 0.0
        angle = np.where(np.arange(len(angle)) < 2, 0.0, angle + 5 * step)
    if "nan" in one.dirt:
        angle[random.choice(len(angle), random.integers(1, 30), replace=False)] = np.nan
    kept = without_gap(one, random, time)
    one.time, one.value, one.header = time[kept], angle[kept], ("t", "angle")
    one.chart = f'[time]\nchannel = "t"\nunit = "s"\n[loose]\nchannel = "angle"\nunit = "rad"\n# counts {counts}\n'


def speed_log(one: Case, random: np.random.Generator, pieces: Any, top: float) -> None:
    """Read a display in rpm."""
    begin, end = pieces[0][0], pieces[-1][1]
    rate = float(np.clip(10 ** random.uniform(0.7, 2.0), 150 / (end - begin), 6000 / (end - begin)))
    every = int(random.integers(2, 16)) if "held" in one.dirt else 1
    update = np.arange(begin, end, 1.0 / rate)
    rpm = motion(pieces, update)[1] * 30 / pi
    size = top * 30 / pi
    standing = rpm == 0.0
    rpm = rpm + size * 10 ** random.uniform(-4, -2.3) * random.normal(size=len(rpm))
    if "flicker" in one.dirt:
        rpm = rpm + size * 10 ** random.uniform(-3.3, -2.3) * flicker(random, len(rpm))
    rpm = np.where(standing, 0.0, rpm)
    quantum = float(random.choice([0.01, 0.1, 1.0]))
    rpm = np.round(rpm / quantum) * quantum
    time = np.arange(begin, end, 1.0 / (rate * every))
    value = rpm[np.clip(np.floor((time - begin) * rate + 1e-9).astype(int), 0, len(rpm) - 1)].copy()
    if "zeros" in one.dirt:
        hole = 0.0 if random.random() < 0.6 else np.nan
        for at in random.choice(len(value), max(len(value) // 150, 1), replace=False):
            value[at : at + random.integers(1, 5)] = hole
    if "outliers" in one.dirt:
        at = random.choice(len(value), max(len(value) // 200, 1), replace=False)
        value[at] *= random.choice([0.5, 2.0, 1.3, 3.0], len(at))
    if "wrong-start" in one.dirt:
        value[: random.integers(2, 12)] = 0.0
    kept = without_gap(one, random, time)
    one.time, one.value, one.header = time[kept], value[kept], ("t", "rpm")
    one.chart = '[time]\nchannel = "t"\nunit = "s"\n[loose]\nchannel = "rpm"\nunit = "rpm"\n'


def pulse_log(one: Case, random: np.random.Generator, pieces: Any, top: float) -> None:
    """Stamp one pulse a magnet."""
    begin, end = pieces[0][0], pieces[-1][1]
    fine = np.linspace(begin, end, 400_001)
    angle, _ = motion(pieces, fine)
    turned = min(float(c.angle(np.array([c.end]))[0] - c.angle(np.array([c.start]))[0]) for c in one.coasts)
    magnets = int(np.round(10 ** random.uniform(0, np.log10(60))))
    share = random.uniform(0.02, 0.7) if "missing" in one.dirt else 0.0
    magnets = max(magnets, int(120 * 2 * pi / turned / (1 - share)) + 1)
    magnets = max(min(magnets, int(20_000 * 2 * pi / angle[-1])), 1)
    pitch = 2 * pi / magnets
    place = np.arange(int(angle[-1] / pitch))
    at = place * pitch + 0.3 * pitch
    if "uneven" in one.dirt and magnets > 1:
        at = at + (pitch * random.uniform(0.005, 0.05) * random.normal(size=magnets))[place % magnets]
    if "flicker" in one.dirt:
        at = at + pitch * 10 ** random.uniform(-3, -2) * flicker(random, len(at))
    at = at[(at > angle[0]) & (at < angle[-1])]
    rising = np.concatenate([[True], np.diff(angle) > 0])
    time = np.interp(at, angle[rising], fine[rising])
    for begin_, end_, angles, speeds in pieces:  # two Newton steps within each phase
        some = (time >= begin_) & (time <= end_)
        for _ in range(2):
            here = speeds(time[some])
            move = np.where(here > 1e-3 * top, (at[some] - angles(time[some])) / np.maximum(here, 1e-3 * top), 0.0)
            time[some] = np.clip(time[some] + move, begin_, end_)
    time = np.sort(time + random.normal(size=len(time)) * pitch / top * 10 ** random.uniform(-5, -3))
    if share:
        time = time[random.random(len(time)) > share]
    if "extra" in one.dirt:
        some = random.choice(len(time) - 1, max(int(len(time) * random.uniform(0.005, 0.05)), 1), replace=False)
        time = np.sort(
            np.append(time, time[some] + (time[some + 1] - time[some]) * random.uniform(0.05, 0.95, len(some)))
        )
    kept = without_gap(one, random, time)
    one.time = np.unique(time[kept])
    one.header = ("pulse",)
    one.chart = f'[loose]\nchannel = "pulse"\ncounts_per_revolution = {magnets}\n[loose.decode]\nkind = "stamps"\n'
