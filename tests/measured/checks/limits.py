"""Detection limits: faults of rising size put into records, and how many of them are found with which size."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.stats import beta

from gears3d.measured.checks import examine
from tests.measured.checks import faults
from tests.measured.checks.clean import RIGAUD, channels, happened, rattling, seen, turning

DRIVE, LOOSE = faults.DRIVE, faults.LOOSE
COUNT = 2 * np.pi / 1_600_000
RADIUS = 0.148009
"""Base radius of the gears of Rigaud & Perret-Liaudet's bench [m], for displacements put in as angles."""


class Fault(NamedTuple):
    """A fault to be found: ``make(columns, size, random)``, in the records of ``bench(seed, change)``."""

    name: str
    kind: str
    channel: str | None
    bench: Callable
    make: Callable
    sizes: tuple[float, ...]
    unit: str
    before: bool = False  # whether it happens before the angles are counted
    size_of: Callable = float
    sure: bool = True  # whether the largest of them is found always


def rattle(noise):
    return lambda seed, change: rattling(noise=noise, seed=seed, duration="10 s", change=change)


def contact(noise):
    return lambda seed, change: turning(noise=noise, seed=seed, duration="10 s", change=change)


def fast(noise):
    changes = (("run.duration", "16 s"), ("motion.mean", "300 rpm"))
    return lambda seed, change: seen(*happened(RIGAUD, changes), noise, seed, None, change)


def _row(columns, random):
    return int(random.uniform(0.2, 0.8) * len(columns["time_s"]))


def _lost(columns, size, random):
    return faults.lost(columns, LOOSE, _row(columns, random), -size * COUNT)


def _slip(columns, size, random):
    time = columns["time_s"]
    begin = random.uniform(0.3, 0.7) * time[-1]
    return {**columns, LOOSE: columns[LOOSE] - size / RADIUS * np.clip((time - begin) / 0.1, 0.0, 1.0)}


def _drift(columns, size, random):
    return {**columns, LOOSE: columns[LOOSE] + size / RADIUS * columns["time_s"] / columns["time_s"][-1]}


def _late(columns, size, random):
    return faults.late(columns, LOOSE, size)


def _eccentric(name):
    return lambda columns, size, random: faults.eccentric(columns, name, size, random.uniform(0, 2 * np.pi))


def _jitter(columns, size, random):
    return faults.jitter(columns, size, random.integers(1 << 30))


def _spike(columns, size, random):
    return faults.spike(columns, LOOSE, _row(columns, random), size)


def _left_out(columns, size, random):
    return faults.left_out(columns, _row(columns, random), int(size))


def _ratio(columns, size, random):
    return faults.scaled(columns, **{LOOSE: 1.0 + size})


def _rounded(function):
    """Whole counts again after what was done to them."""

    def made(columns, size, random):
        bad = function(columns, size, random)
        return {**bad, **{name: np.floor(bad[name] / COUNT) * COUNT for name in (DRIVE, LOOSE)}}

    return made


LADDER = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 256.0)
FAULTS = (
    *(
        Fault(
            f"counts lost at once, {where}, noise {noise:.1%}",
            "lost-counts",
            LOOSE,
            bench(noise),
            _lost,
            LADDER,
            "counts",
            size_of=lambda one: -one.size / COUNT,
        )
        for where, bench in (("rattle", rattle), ("contact", contact))
        for noise in (0.001, 0.01)
    ),
    *(
        Fault(
            f"slip within 0.1 s, {where}, noise 1 %",
            "offset",
            "",
            bench(0.01),
            _rounded(_slip),
            (4e-6, 8e-6, 16e-6, 32e-6),
            "m",
            size_of=lambda one: -one.size,
        )
        for where, bench in (("rattle", rattle), ("contact", contact))
    ),
    *(
        Fault(
            f"drift over 10 s, {where}, noise 1 %",
            "drift",
            "",
            bench(0.01),
            _rounded(_drift),
            (4e-6, 8e-6, 16e-6, 32e-6),
            "m",
            size_of=lambda one: one.size,
        )
        for where, bench in (("rattle", rattle), ("contact", contact))
    ),
    *(
        Fault(
            f"skew, rattle, noise {noise:.1%}",
            "skew",
            LOOSE,
            rattle(noise),
            _late,
            (1e-6, 2e-6, 4e-6, 8e-6, 16e-6, 32e-6, 64e-6),
            "s",
            True,
            lambda one: one.size,
            noise < 0.03,
        )
        for noise in (0.001, 0.01, 0.03)
    ),
    Fault(
        "drive encoder once a turn, rattle, noise 1 %",
        "encoder-wave",
        DRIVE,
        rattle(0.01),
        _eccentric(DRIVE),
        (5e-5, 1e-4, 2e-4, 4e-4),
        "rad",
        True,
        lambda one: one.size,
    ),
    Fault(
        "loose encoder once a turn, flights at 300 rpm, noise 0.1 %",
        "encoder-wave",
        LOOSE,
        fast(0.001),
        _eccentric(LOOSE),
        (2.5e-5, 5e-5, 1e-4, 2e-4),
        "rad",
        True,
        lambda one: one.size,
    ),
    Fault(
        "ratio, rattle, noise 1 %",
        "ratio",
        "",
        rattle(0.01),
        _ratio,
        (1e-5, 1e-4, 2e-4, 4e-4, 1e-3),
        "1",
        True,
        lambda one: one.size,
    ),
    Fault(
        "jitter of 50 kHz stamps",
        "jitter",
        "time_s",
        rattle(0.01),
        _jitter,
        (1e-7, 2e-7, 5e-7, 1e-6, 2e-6),
        "s",
        size_of=lambda one: one.size,
    ),
    Fault(
        "one reading off, rattle, noise 1 %",
        "spikes",
        LOOSE,
        rattle(0.01),
        _spike,
        (5e-5, 1e-4, 2e-4, 4e-4),
        "rad",
        size_of=lambda one: one.size,
    ),
    Fault(
        "rows left out, even stamps, noise 0.1 %",
        "left-out",
        "",
        rattle(0.001),
        _left_out,
        (1, 2, 4, 8, 16, 32),
        "rows",
        size_of=lambda one: one.size * 50_000.0,
    ),
)


def interval(hits, tries):
    """Clopper and Pearson's 95 % interval of a share."""
    low = beta.ppf(0.025, hits, tries - hits + 1) if hits else 0.0
    high = beta.ppf(0.975, hits + 1, tries - hits) if hits < tries else 1.0
    return float(low), float(high)


def tried(fault, size, seeds):
    """How many of the faults of a size are found, and the errors of their size relative to it."""
    errors = []
    for seed in seeds:
        random = np.random.default_rng(seed)

        def change(columns, random=random):
            return fault.make(columns, size, random)

        scenario, columns = fault.bench(seed, change if fault.before else None)
        bad = columns if fault.before else change(columns)
        right = [one for one in examine(channels(bad), scenario) if one.kind == fault.kind]
        right = [one for one in right if fault.channel is None or one.channel == fault.channel]
        if len(right) == 1:
            errors.append(fault.size_of(right[0]) / size - 1.0)
    return len(errors), np.array(errors)


def limit(fault, seeds, share=0.9):
    """The smallest size of which at least ``share`` is found, with all larger ones; hits there and size errors."""
    found = None
    for size in reversed(fault.sizes):
        hits, errors = tried(fault, size, seeds)
        if hits < share * len(seeds):
            break
        found = size, hits, errors
    return found
