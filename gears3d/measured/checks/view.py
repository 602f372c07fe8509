"""A record under examination, with what several checks need worked out once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gears3d.measured.checks.declared import MESH as MESH
from gears3d.measured.checks.declared import Declared
from gears3d.signals import changes, count_of, quantum, some_steps

if TYPE_CHECKING:
    from gears3d.measured.checks.band import Band
    from gears3d.measured.checks.places import Places

SOME = 200_000
"""So many rows are looked at for what is typical."""
FLOOR = 0.3
"""Noise of an encoder that rounds, in counts."""


class View:
    """Columns and what is declared of them.

    Args:
        columns: by name of the contract, each (n,).
        declared: of the bench.
    """

    def __init__(self, columns: Mapping[str, np.ndarray], declared: Declared) -> None:
        self.columns = dict(columns)
        self.declared = declared

    @property
    def time(self) -> np.ndarray:
        """Time of the rows [s], (n,)."""
        return self.columns["time_s"]

    @property
    def angles(self) -> dict[str, np.ndarray]:
        """Angles that are needed, by column [rad], each (n,)."""
        asked = {name for need in self.declared.needs for name in ((need,) if isinstance(need, str) else need)}
        return {name: self.columns[name] for name in MESH if name in asked and name in self.columns}

    @property
    def used(self) -> list[str]:
        """Names of the columns that are looked at."""
        asked = {name for need in self.declared.needs for name in ((need,) if isinstance(need, str) else need)}
        return ["time_s", *(name for name in self.columns if name in asked and name != "time_s")]

    @cached_property
    def spacing(self) -> float:
        """Median distance of the rows [s]."""
        return float(np.median(some_steps(self.time))) if len(self.time) > 1 else 0.0

    def changes(self, name: str) -> Iterator[tuple[int, np.ndarray]]:
        """Yield the changes of an angle from row to row [rad] in pieces, each with the number of its first one.

        Args:
            name: of the column.
        """
        return changes(self.angles[name])

    def some_changes(self, name: str, run: int = 1) -> np.ndarray:
        """Return some changes of an angle from row to row, spread evenly [rad].

        Args:
            name: of the column.
            run: length of the runs of neighbours that stay together.
        """
        angle = self.angles[name]
        if len(angle) - 1 <= SOME:
            return np.diff(angle)
        row = typical(np.arange(len(angle) - 1), run)
        return angle[row + 1] - angle[row]

    @cached_property
    def quanta(self) -> dict[str, float | None]:
        """Angle of one count [rad], by column; ``None`` for what shows no counts."""
        return {name: self._quantum(name, angle) for name, angle in self.angles.items()}

    def _quantum(self, name: str, angle: np.ndarray) -> float | None:
        """Return the declared count where the angles keep to it, else the one that shows by itself, if any does."""
        counts = self.declared.counts.get(name)
        some = self.some_changes(name)
        rounding = 1e-13 * float(np.abs(angle[:: max(len(angle) // 1000, 1)]).max(initial=0.0))
        if counts is not None:
            step = 2 * np.pi / counts
            whole = np.round(some / step)
            if rounding < 0.01 * step and np.mean(np.abs(some - whole * step) < 1e-3 * step + 10.0 * rounding) > 0.99:
                sizes = np.unique(np.abs(whole)).astype(np.int64)
                return step * max(int(np.gcd.reduce(sizes)), 1) if len(sizes) > 2 else step
        found = quantum(angle) or count_of(angle)  # fast turning, no change may be a single count
        return found if found is not None and np.ptp(some) > 0.5 * found else None

    @cached_property
    def band(self) -> Band | None:
        """Short blocks and stretches in contact; ``None`` without a rig."""
        from gears3d.measured.checks.band import band_of

        return band_of(self)

    @cached_property
    def places(self) -> Places | None:
        """Where the active flank lies; ``None`` where the record does not tell."""
        from gears3d.measured.checks.places import places

        return None if self.band is None else places(self, self.band)

    @cached_property
    def noise(self) -> dict[str, float]:
        """Standard deviation of one reading of each angle [rad], rounding to counts among it."""
        return {name: self._noise(name) for name in self.angles}

    def _noise(self, name: str) -> float:
        bend = np.abs(np.diff(self.some_changes(name, run=64)))
        usual = 1.4826 * max(float(np.median(bend)) if len(bend) else 0.0, 0.5 * (self.quanta[name] or 0.0))
        bend = bend[bend <= 4.0 * usual]  # not the median itself: of counts it takes few values
        seen = float(np.sqrt(np.mean(bend**2) / 6.0)) if len(bend) else 0.0
        scale = float(np.abs(self.angles[name][:: max(len(self.time) // 1000, 1)]).max(initial=0.0))
        return max(seen, self.declared.noise.get(name, 0.0), FLOOR * (self.quanta[name] or 0.0), 4e-16 * scale)


def typical(values: np.ndarray, run: int = 1) -> np.ndarray:
    """Return some of many values, spread evenly.

    Args:
        values: (n,).
        run: length of the runs of neighbours that stay together.

    >>> typical(np.arange(3)).tolist(), len(typical(np.arange(1_000_000)))
    ([0, 1, 2], 200000)
    """
    if len(values) <= SOME:
        return values
    if run == 1:
        return values[:: len(values) // SOME][:SOME]
    count = SOME // run
    first = np.linspace(0, len(values) - run, count).astype(np.intp)
    return values[(first[:, None] + np.arange(run)).ravel()]


def when(time: np.ndarray, rows: np.ndarray) -> str:
    """Return the first few times of some rows as text.

    Args:
        time: [s], (n,).
        rows: indices, (k,).

    >>> when(np.arange(10.0), np.arange(5))
    't = 0, 1, 2 s ...'
    """
    shown = ", ".join(f"{time[row]:.6g}" for row in rows[:3])
    return f"t = {shown} s" + (" ..." if len(rows) > 3 else "")
