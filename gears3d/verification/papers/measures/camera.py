"""Nine pictures of the teeth in one period, Rigaud & Perret-Liaudet 2020, fig. 8.

Backlash and phase of the pictures are not printed. "T = 0.333 ms" is 0.333 s.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gears3d.verification.papers.bench import Case
from gears3d.verification.papers.measures.registry import measure

FRAMES = ("active", "active", "flight", "flight", "reverse", "reverse", "flight", "flight", "active")  # at 0, T/8 ... T
BACKLASHES = range(50, 2001, 50)  # range of the rig [µm]
ORIGINS = np.arange(0.0, 1.0, 0.005)  # phases of the first picture in the period [cycles]


def contacts(case: Case) -> tuple[np.ndarray, float]:
    """Return flank, begin and end of the contacts [s], (n, 3), and the period [s], of a run of 7 periods."""
    meta = case.with_({"run.duration": "7 periods", "run.output_rate": "1 kHz"}).run.meta
    return np.array(meta["contacts"]).reshape(-1, 3), meta["period_s"]


def states(case: Case, origin: float) -> list[str]:
    """Return what nine pictures would show, the first of them at a phase [cycles]."""
    found, period = contacts(case)
    shown = []
    for frame in range(9):
        time = period * (4 + origin + frame / 8)
        there = found[(found[:, 1] <= time) & (time <= found[:, 2]), 0]
        shown.append(("active", "reverse")[int(there[0])] if there.size else "flight")
    return shown


def best(case: Case) -> tuple[int, int, float]:
    """Return the largest number of pictures that agree, and the first backlash [µm] and origin [cycles] with it."""

    def compute() -> tuple[int, int, float]:
        found = [
            (sum(one == two for one, two in zip(states(at, float(origin)), FRAMES, strict=True)), backlash, origin)
            for backlash in BACKLASHES
            for at in [case.with_({"mount.backlash": f"{backlash} um"})]
            for origin in ORIGINS
        ]
        most = max(count for count, _, _ in found)
        _, backlash, origin = next(each for each in found if each[0] == most)
        return most, backlash, float(origin)

    return case.once("pictures", compute)


@measure
def agreeing_pictures(case: Case) -> float:
    """Return how many pictures show the state of the paper, at the best backlash and the best origin."""
    return float(best(case)[0])


@measure
def tooth_pair(case: Case, frame: int) -> float:
    """Return the number of the tooth pair at the pitch point in a picture, fractions between two."""
    scenario, run = case.scenario, case.run
    origin = best(case)[2] * scenario.period
    angle = np.interp([origin, origin + frame / 8 * scenario.period], run.time, run.signals["theta_drive_rad"])
    return float(1 + np.diff(angle)[0] * scenario.gears.drive.teeth / (2 * np.pi))


@measure
def state_order(case: Case) -> str:
    """Return the order of the states over a period, from the active flank."""
    found, period = contacts(case)
    inside = found[(found[:, 2] > 3 * period) & (found[:, 1] < 4.9 * period)]
    names = [("active", "reverse")[int(flank)] for flank in inside[:, 0]]
    first = names.index("active")
    return ", flight, ".join(names[first : first + 2]) + ", flight"


@measure
def shortest_state(case: Case) -> float:
    """Return the shorter of the mean flight across the backlash and the mean contact, in meshing periods."""
    found: dict[str, Any] = case.outcome
    scenario = case.scenario
    mesh = 2 * np.pi / scenario.motion.mean / scenario.gears.drive.teeth
    means = [
        np.mean([found[f"{flank}_{state}_mean_s"] for flank in ("active", "reverse")])
        for state in ("crossing", "contact")
    ]
    return float(min(means) / mesh)
