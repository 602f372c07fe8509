"""Drops across the gap in the 3D engine: coefficient of restitution of each flank at several speeds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.engine import Bench
from gears3d.results import Result
from gears3d.scenario.models import Motion

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

SPEEDS = (0.005, 0.01, 0.02, 0.05, 0.1)  # On arrival unless given [m/s]
FLANKS = ("active", "reverse")


@dataclass(frozen=True, eq=False)
class Drops(Result):
    """What drops give.

    Args:
        table: of each impact its columns as in a recording, and ``asked_m_s``, (n,) each.
        laws: by flank: restitution at rest and its slope over the speed [s/m], standard deviation about that line.
    """

    table: dict[str, np.ndarray]
    laws: dict[str, tuple[float, float, float]]

    @property
    def restitution(self) -> np.ndarray:
        """Share of the speed that each impact gave back, (n,)."""
        return -self.table["rebound_m_s"] / self.table["velocity_m_s"]

    def to_dict(self) -> dict[str, Any]:
        """Return the law of each flank, and how many drops there were and stuck: they are not in the laws."""
        names = ("restitution_at_rest", "slope_s_m", "standard_deviation")
        told = {flank: dict(zip(names, law, strict=True)) for flank, law in self.laws.items()}
        stuck = int(np.count_nonzero(self.table["rebound_m_s"] == 0.0))
        return {"test": "drop", "drops": len(self.restitution), "stuck": stuck, **told}


def drops(
    scenario: Scenario,
    speeds: Sequence[float] = SPEEDS,
    repeat: int = 4,
    progress: Callable[[float], None] | None = None,
) -> Drops:
    """Let the loose gear come upon each flank at several speeds, the drive turning steadily, and see what comes back.

    Drag pulls the loose gear from the reverse to the active flank: there it falls, towards the reverse one it starts
    with a speed.

    Args:
        scenario: pair, inertia, drag, impact law and effects; of its motion the mean speed counts.
        speeds: on arrival [m/s].
        repeat: drops at each speed, at different places of the mesh.
        progress: called with the number of drops done.

    Returns:
        The impacts, and a straight line over the speed for each flank.

    Raises:
        InputError: what the engine cannot do.
        EngineError: the gears are jammed.

    Source: Newton's law of restitution, Rigaud & Perret-Liaudet 2020, eq. (16); its slope: Kadmiri et al. 2012, fig. 7.

    >>> from gears3d.scenario import load
    >>> found = drops(load("scenarios/base/rigaud-2020.toml"), [0.01, 0.05], repeat=1)
    >>> found.restitution.round(9).tolist()
    [0.3, 0.3, 0.3, 0.3]
    """
    steady = replace(scenario, motion=Motion(scenario.motion.mean))
    pitch = 2.0 * pi / scenario.gears.drive.teeth / max(abs(scenario.motion.mean), 1e-9)
    rows = []
    with Bench(steady) as bench:
        for speed in speeds:
            for side in (0, 1):
                for _ in range(repeat):
                    # golden steps spread any number of places over the mesh
                    time = min(pitch, 1.0) * ((len(rows) * 0.6180339887498949) % 1.0)
                    hit = bench.drop(time, side, speed)
                    rows.append((*hit, speed))
                    if progress is not None:
                        progress(len(rows))
    names = (*hit._fields, "asked_m_s")
    table = dict(zip(names, np.array(rows, dtype=float).T.copy(), strict=True))
    return Drops(table, {name: _line(table, flank) for flank, name in enumerate(FLANKS)})


def _line(table: dict[str, np.ndarray], flank: int) -> tuple[float, float, float]:
    """Return restitution at rest, slope over the speed [s/m] and the deviation about that line."""
    own = (table["flank"] == flank) & (table["rebound_m_s"] != 0.0)
    if not own.any():  # everything sticks
        return 0.0, 0.0, 0.0
    speed, share = np.abs(table["velocity_m_s"][own]), -table["rebound_m_s"][own] / table["velocity_m_s"][own]
    design = np.column_stack([np.ones_like(speed), speed])
    if np.ptp(speed) <= 0.1 * speed.max():
        design = design[:, :1]
    numbers = np.linalg.lstsq(design, share, rcond=None)[0]
    freedom = max(len(share) - len(numbers), 1)
    spread = float(np.sqrt(np.sum((share - design @ numbers) ** 2) / freedom))
    return float(numbers[0]), float(numbers[1]) if len(numbers) > 1 else 0.0, spread
