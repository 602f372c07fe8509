"""Operating points of Ottewill et al. 2010 on the rigid twin: amplitude and phase of the drive."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi
from typing import Any

import numpy as np

from gears3d.verification.papers.bench import Bench
from gears3d.verification.papers.ottewill_2010.errors import error_function

FOLDER = "ottewill-2010"
AMPLITUDES = tuple(0.39 + 0.01 * i for i in range(8))
"""Drive amplitudes of the contours [rad]; the paper has steps of 0.005."""
PHASES = tuple(2 * pi * i / 30 for i in range(30))
"""Phases of the contours [rad]; the paper has 50."""
HALF_BACKLASH = 1.63e-2
"""β [rad]."""


def drive_phase(case: str, amplitude: float, phase: float) -> float:
    """Return the phase of the drive's speed in a scenario, whose drive angle is 0 at time 0.

    The paper's θ1 = 2πτ + ε·cos(2πτ + ϕ) passes 0 at another time; the error depends on θ1, so time is shifted.

    Args:
        case: whose eccentricity the phase is relative to.
        amplitude: ε [rad].
        phase: ϕ relative to the eccentricity [rad].

    Returns:
        Phase of the sine [rad].

    >>> round(drive_phase("i", 0.0, 1.0) - drive_phase("i", 0.0, 0.5), 9)
    0.5
    """
    absolute = phase + float(error_function(case).phase[0])
    shift = 0.0
    for _ in range(200):
        shift = -amplitude * cos(shift + absolute)
    return (absolute + shift + pi) % (2 * pi)


def swing(case: str, amplitude: float, phase: float) -> dict[str, Any]:
    """Return the settings that put a case at a drive amplitude and phase.

    Args:
        case: ``"i"`` to ``"iv"``.
        amplitude: ε [rad].
        phase: relative to the eccentricity [rad].

    >>> list(swing("i", 0.43, 2.6))
    ['motion.harmonics', 'run.duration', 'run.settle', 'run.output_rate']
    """
    turned = round(drive_phase(case, amplitude, phase), 9)
    harmonic = {"amplitude": f"{amplitude:.6g} rad", "frequency": "1 Hz", "phase": f"{turned} rad"}
    return {
        "motion.harmonics": [harmonic],
        "run.duration": "4 s",
        "run.settle": "1 s",
        "run.output_rate": "1 kHz",
    }


def effects(bench: Bench, name: str, *kinds: str) -> tuple[Any, ...]:
    """Return the effects of a scenario, of some kinds only if any are given.

    Args:
        bench: of the papers.
        name: of the scenario's file in the paper's folder.
        kinds: of effects.
    """
    return tuple(each for each in bench.scenario(f"{FOLDER}/{name}").effects if not kinds or each.kind in kinds)


def heights(
    bench: Bench, name: str, case: str, points: Sequence[tuple[float, float]], with_effects: Sequence[Any] | None = None
) -> np.ndarray:
    """Return how far the loose gear leaves the driving flank at operating points, in the first two revolutions.

    Args:
        bench: of the papers.
        name: of the scenario's file in the paper's folder.
        case: whose eccentricity the phases are relative to.
        points: amplitude and phase [rad].
        with_effects: in place of the scenario's.

    Returns:
        Largest disconnection [rad], (n,).
    """
    from gears3d.lumped.model import model
    from gears3d.lumped.run import run

    scenario = bench.scenario(f"{FOLDER}/{name}")
    rig = scenario.rig()
    chosen = scenario.effects if with_effects is None else with_effects
    rows = [row for effect in chosen for row in effect.rows(rig)]
    found = []
    for amplitude, phase in points:
        harmonic = (2 * pi * amplitude, 1.0, drive_phase(case, amplitude, phase))
        outcome = run(model(rig, [harmonic], rows), 2.0)
        left = outcome.impacts[outcome.impacts[:, 1] == 0.0, 6]
        crossed = (outcome.impacts[:, 1] == 1.0).any()
        found.append(rig.backlash if crossed else left.max(initial=0.0))
    return np.array(found) / rig.base_radius_loose


def contour(
    bench: Bench, name: str, case: str, label: str = "", with_effects: Sequence[Any] | None = None
) -> np.ndarray:
    """Return the disconnections over amplitudes and phases, computed once.

    Args:
        bench: of the papers.
        name: of the scenario's file in the paper's folder.
        case: whose eccentricity the phases are relative to.
        label: of other effects than the scenario's.
        with_effects: in place of the scenario's.

    Returns:
        Disconnection [rad], (8, 30).
    """
    points = [(amplitude, phase) for amplitude in AMPLITUDES for phase in PHASES]
    key = f"{FOLDER} contour {name} {label}"
    return bench.once(
        key, lambda: heights(bench, name, case, points, with_effects).reshape(len(AMPLITUDES), len(PHASES))
    )


def turned(reference: np.ndarray, other: np.ndarray) -> float:
    """Return by how much a contour is shifted in phase against another, from the peak of their correlation [rad].

    Args:
        reference: (amplitudes, phases).
        other: (amplitudes, phases).

    >>> steps = np.eye(1, 30, 4)
    >>> round(turned(steps, np.roll(steps, 15, axis=1)), 6)
    3.141593
    """
    count = reference.shape[1]
    likeness = [float((np.roll(reference, step, axis=1) * other).sum()) for step in range(count)]
    step = int(np.argmax(likeness))
    return abs((2 * pi * step / count + pi) % (2 * pi) - pi) if step != count // 2 else pi
