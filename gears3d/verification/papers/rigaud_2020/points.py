"""The operating points of Rigaud & Perret-Liaudet 2020 and what is read off their runs."""

from __future__ import annotations

from functools import partial
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.verification.papers.claim import Claim

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.verification.papers.bench import Bench

row = partial(Claim, paper="rigaud-2020")
"""A row of this paper."""

BASE = "base/rigaud-2020.toml"
PLASTIC = {"impact.restitution": 0}
"""The bench shows a lasting contact after every impact: section 6.2 takes it as perfectly plastic."""
SCATTER = 2.1 / 22.3
"""Printed standard deviation of an impact velocity over its mean (fig. 5)."""
SCATTER_DB = 20 * np.log10(1 + SCATTER)
"""The same for its square [dB]."""
THRESHOLD_SCATTER = 0.19 / 1.09
"""Printed standard deviation of the threshold over its mean (fig. 4)."""

AMPLITUDES = (1.6, 5, 10, 20)
FREQUENCIES = (1, 2, 3, 5, 10)
"""Points of figs 7 and 13 [rpm], [Hz]."""
_SHARED = {
    (1.6, 3): "fig5-1.6rpm",
    (20, 3): "fig5-20rpm",
    (5, 1): "fig6-1Hz",
    (5, 3): "fig5-5rpm",
    (5, 5): "fig6-5Hz",
    (5, 10): "fig6-10Hz",
}


def point(amplitude: float, frequency: float) -> str:
    """Return the scenario of a point of figs 7 and 13.

    Args:
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].

    >>> point(5, 3), point(10, 2)
    ('rigaud-2020/fig5-5rpm.toml', 'rigaud-2020/fig13-10rpm-2Hz.toml')
    """
    name = _SHARED.get((amplitude, frequency), f"fig13-{amplitude:g}rpm-{frequency:g}Hz")
    return f"rigaud-2020/{name}.toml"


def plastic(bench: Bench, amplitude: float, frequency: float) -> dict[str, Any]:
    """Return the outcome of a point with perfectly plastic impacts over twenty periods.

    Args:
        bench: of the papers.
        amplitude: of the drive's speed [rpm].
        frequency: [Hz].
    """
    return bench.outcome(point(amplitude, frequency), {**PLASTIC, "run.duration": "20 periods"})


def crossing(bench: Bench) -> list[tuple[float, float]]:
    """Return the points of figs 7 and 13 where both flanks are struck: amplitude [rpm], frequency [Hz].

    Args:
        bench: of the papers.
    """
    grid = [(amplitude, frequency) for amplitude in AMPLITUDES for frequency in FREQUENCIES]
    return [place for place in grid if plastic(bench, *place)["regime"] == "double_sided"]


def phases(recording: Recording, times: np.ndarray) -> np.ndarray:
    """Return the phases of times in the period of the excitation [cycles], (n,).

    Args:
        recording: for its period.
        times: [s], (n,).
    """
    return np.mod(times / recording.meta["period_s"], 1.0)


def excitation(bench: Bench, name: str) -> float:
    """Return Λ = J·ω·ΔΩ/Td of a scenario.

    Args:
        bench: of the papers.
        name: of its file.

    Source: Rigaud & Perret-Liaudet 2020, eq. (8).
    """
    scenario = bench.scenario(name)
    rig, harmonic = scenario.rig(), scenario.motion.harmonics[0]
    return rig.inertia * 2 * pi * harmonic.frequency * harmonic.amplitude / rig.drag_torque
