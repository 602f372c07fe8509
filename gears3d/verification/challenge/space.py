"""The space of test rigs and records that users have: a scrambled Sobol sequence over geometry, regime and sensors."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, ceil, cos, log2, pi, radians, sqrt, tan
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import qmc

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

# Kinds of dirt: what real sensors and drives do and no rig file states
DIRT = ("one_over_f", "interpolation", "jitter", "clock", "drive_harmonics", "held")
# Orders of a fluctuation that is locked to the rotation of the drive: joint, crank, cylinders
ORDERS = (0.5, 1.0, 2.0, 3.0, 4.0, 6.0)
FASTEST = 630.0  # Speed of the drive at most, 6000 rpm [rad/s]
DEEPEST = 0.8  # Amplitude of the fluctuation over the mean speed at most: no drive turns back
LARGEST = 12.0  # Order of a free fluctuation at most
STEEL = 7850.0  # Density of the loose gear [kg/m³]
WIDTH = 8.0  # Face width in modules
STICK = 1e-3  # Rebounds slower than this part of the speed of a fall across the backlash stay in contact
TEETH, PRESSURE = (15, 120), radians(20.0)
# What data acquisition and encoders on the market do: sample rate [Hz], counts per revolution; durations [s]
RATES, COUNTS, DURATIONS = (2e3, 5e5), (1000, 4_000_000), (2.0, 60.0)
FEW, SHIFT = 20, 0.3  # Gears of fewer teeth have this profile shift, as practice has it against undercut
FACTORS = 20  # Dimensions of the Sobol sequence; one is kept free


@dataclass(frozen=True)
class Condition:
    """One record of a rig."""

    mean: float  # speed of the drive, rad/s
    amplitude: float  # of its fluctuation, rad/s
    frequency: float  # of the fluctuation, Hz
    order: float | None  # of the fluctuation over the drive's rotation where it is locked to it
    duration: float  # s
    excitation: float  # Λ, largest acceleration of the drive's flank over the deceleration of the loose gear


@dataclass(frozen=True)
class Rig:
    """A test rig with its sensors and records."""

    seed: int  # of the draw
    index: int  # in the draw; seed and index repeat the rig
    teeth: tuple[int, int]  # of drive and loose gear
    module: float  # normal, m
    helix: float  # helix angle, rad
    base_radius: tuple[float, float]  # of drive and loose gear, m
    backlash: float  # along the transverse line of action, m
    inertia: float  # of the loose gear, kg·m²
    drag: float  # dry torque on the loose gear, N·m
    restitution: float  # coefficient
    deceleration: float  # of the loose gear along the line of action, m/s²
    # period of the fluctuation that was asked for over the fall across the backlash from rest
    falls_per_period: float
    locked: bool  # whether the fluctuation is locked to the rotation
    rate: float  # of the samples, Hz
    counts: int  # per revolution of either encoder
    noise: float  # white noise of either encoder, rad
    conditions: tuple[Condition, ...]  # of the records
    dirt: tuple[str, ...]  # kinds of ``DIRT``

    @property
    def fall(self) -> float:
        """Time to cross the backlash from rest [s]."""
        return sqrt(2.0 * self.backlash / self.deceleration)

    @property
    def counts_per_backlash(self) -> float:
        """Counts of the loose gear's encoder within the backlash."""
        return self.counts * self.backlash / (2.0 * pi * self.base_radius[1])

    @property
    def noise_share(self) -> float:
        """Noise of the loose gear's encoder over the backlash."""
        return self.noise * self.base_radius[1] / self.backlash

    @property
    def ratio(self) -> float:
        """Teeth of the loose gear over those of the drive."""
        return self.teeth[1] / self.teeth[0]

    def scenario(self, number: int = 0) -> Scenario:
        """Return the rig as its owner describes it, in the condition of one record; noise and dirt are not stated."""
        from gears3d.scenario import load

        return load(self._document(number))

    def _document(self, number: int) -> dict[str, object]:
        """Return the scenario as a mapping."""
        now = self.conditions[number]
        shifts = [SHIFT if count < FEW else 0.0 for count in self.teeth]
        stick = STICK * sqrt(2.0 * self.deceleration * self.backlash)
        sine = {"amplitude": f"{now.amplitude!r} rad/s", "frequency": f"{now.frequency!r} Hz"}
        return {
            "format": 1,
            "title": f"Rig {self.seed}-{self.index}, record {number + 1}",
            "gears": {
                "module": f"{self.module!r} m",
                "helix_angle": f"{self.helix!r} rad",
                "face_width": f"{WIDTH * self.module!r} m",
                "drive": {"teeth": self.teeth[0], "profile_shift": shifts[0]},
                "loose": {"teeth": self.teeth[1], "profile_shift": shifts[1], "inertia": f"{self.inertia!r} kg m^2"},
            },
            "mount": {"backlash": f"{self.backlash!r} m"},
            "motion": {"mean": f"{now.mean!r} rad/s", "harmonics": [sine]},
            "drag": {"torque": f"{self.drag!r} N m"},
            "impact": {"restitution": self.restitution, "stick_velocity": f"{stick!r} m/s"},
            "run": {"duration": f"{now.duration!r} s", "settle": "0 s", "output_rate": f"{self.rate!r} Hz"},
            "sensors": {"sample_rate": f"{self.rate!r} Hz", "counts_per_revolution": self.counts},
        }


def draw(n: int, seed: int = 0) -> list[Rig]:
    """Return the first rigs of a seed; a rig does not depend on how many are drawn.

    >>> rig = draw(3, 1)[2]
    >>> rig == draw(8, 1)[2], rig.base_radius[0] < 0.2
    (True, True)
    """
    cube = qmc.Sobol(FACTORS, scramble=True, rng=seed).random_base2(max(ceil(log2(max(n, 1))), 0))
    return [_rig(u.tolist(), seed, i) for i, u in enumerate(cube[:n])]


def _between(u: float, low: float, high: float) -> float:
    return low + (high - low) * u


def _decades(u: float, low: float, high: float) -> float:
    return low * (high / low) ** u


def _rig(u: list[float], seed: int, index: int) -> Rig:
    """Return the rig of one point of the cube."""
    random = np.random.default_rng([seed, index])
    drive = round(_decades(u[0], 15, 60))
    ratio = 1.0 if u[1] < 0.15 else _decades((u[1] - 0.15) / 0.85, 0.6, 4.0)
    loose = min(max(round(drive * ratio), TEETH[0]), TEETH[1])
    module = 1e-3 * _between(u[2], 1.0, 4.0)
    helix = 0.0 if u[3] < 0.5 else radians(_between(2.0 * u[3] - 1.0, 8.0, 30.0))
    to_base = 0.5 * module / cos(helix) * cos(atan(tan(PRESSURE) / cos(helix)))
    radii = (to_base * drive, to_base * loose)
    backlash = _decades(u[4], 40e-6, 400e-6)
    slowing = _decades(u[5], 0.3, 60.0)
    disc = 0.5 * pi * STEEL * WIDTH * module * radii[1] ** 4
    inertia = disc * _decades(u[6], 0.6, 3.0)
    fall = sqrt(2.0 * backlash / slowing)
    falls = _decades(u[7], 0.3, 20.0)
    conditions = _conditions(u, radii[0], slowing, 1.0 / (falls * fall), random)
    rate = min(max(_decades(u[15], 60.0, 3000.0) / fall, RATES[0]), RATES[1])
    per_turn = 2.0 * pi * radii[1] / backlash * _decades(u[16], 8.0, 2000.0)
    dirty = u[18] < 0.5
    return Rig(
        seed=seed,
        index=index,
        teeth=(drive, loose),
        module=module,
        helix=helix,
        base_radius=radii,
        backlash=backlash,
        inertia=inertia,
        drag=inertia * slowing / radii[1],
        restitution=_between(u[19], 0.05, 0.8),
        deceleration=slowing,
        falls_per_period=falls,
        locked=u[9] < 0.5,
        rate=rate,
        counts=int(min(max(per_turn, COUNTS[0]), COUNTS[1])),
        noise=backlash / radii[1] * _decades(u[17], 1e-5, 0.05),
        conditions=conditions,
        dirt=tuple(kind for kind in DIRT if random.random() < 0.4) if dirty else (),
    )


def _conditions(
    u: list[float], radius: float, slowing: float, frequency: float, random: np.random.Generator
) -> tuple[Condition, ...]:
    """Return the records of a rig: mean speeds that part by a factor, excitations that scatter about the first."""
    wanted = _decades(u[8], 1.05, 20.0)
    records = min(max(round(_decades(u[10], 1.0, 8.0)), 1), 8)
    apart = 1.0 if u[11] < 0.3 or records == 1 else _decades((u[11] - 0.3) / 0.7, 1.3, 6.0)
    depth = _decades(u[12], 0.02, DEEPEST)
    order = ORDERS[int(u[13] * len(ORDERS))] if u[9] < 0.5 else None
    periods = _decades(u[14], 30.0, 400.0)
    made = []
    for k in range(records):
        factor = float(np.exp(0.5 * random.standard_normal()))
        excitation = min(max(wanted * factor, 1.02), 30.0) if k else wanted
        share = apart ** (0.5 - k / (records - 1)) if records > 1 else 1.0
        if order is not None:  # where the order asks for more than the drive turns, the fluctuation is slower
            mean = min(2.0 * pi * frequency / order, FASTEST / sqrt(apart)) * share
            now = order * mean / (2.0 * pi)
            amplitude = min(excitation * slowing / (2.0 * pi * now * radius), DEEPEST * mean)
        else:
            now = frequency
            amplitude = excitation * slowing / (2.0 * pi * now * radius)
            slowest = max(amplitude / DEEPEST, 2.0 * pi * now / (LARGEST * (1.0 + 0.1 * random.random())))
            mean = max(min(amplitude / depth * share, FASTEST), slowest)
        reached = amplitude * 2.0 * pi * now * radius / slowing
        duration = min(max(periods / now, DURATIONS[0]), DURATIONS[1])
        made.append(Condition(mean, amplitude, now, order, duration, reached))
    return tuple(made)
