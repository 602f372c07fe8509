"""What a sweep is: scenario, model, axes and times, with a key that changes with everything its numbers depend on."""

from __future__ import annotations

import hashlib
import json
import pickle
from dataclasses import asdict, dataclass
from functools import cached_property, lru_cache
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.sweep.axes import Axis
from gears3d.version import __version__

FORMAT = 1
DIRECTIONS = ("up", "down")


@dataclass(frozen=True)
class Plan:
    """A sweep as data that any process can take.

    Args:
        document: the resolved scenario as TOML text.
        path: its file, from which files that it names are found; empty for none.
        model: ``"rigid"``, ``"lubricated"``, ``"plastic"`` or ``"bullet"``.
        measures: groups of variables.
        axes: what is varied; the one that is followed is the last.
        follow: whether the motion is followed along the last axis, up and down, each point from where one ended.
        periods: whole periods that a point runs.
        settle: of these, left out at the begin.
        keep: of these, at the end, of which a section is kept.
        strobe: when in a period sections are taken, in cycles.
        seed: of all random numbers.
    """

    document: str
    path: str
    model: str
    measures: tuple[str, ...]
    axes: tuple[Axis, ...]
    follow: bool
    periods: int
    settle: int
    keep: int
    strobe: float
    seed: int

    @cached_property
    def key(self) -> str:
        """Digits that change with scenario, model, axes, times, seed, version and compiled kernels."""
        from gears3d.kernels import sources

        whole = {**self.table(), "version": __version__, "kernels": sources(), "format": FORMAT}
        return hashlib.sha256(json.dumps(whole, sort_keys=True).encode()).hexdigest()[:32]

    def table(self) -> dict[str, Any]:
        """Return the plan as JSON can hold it."""
        axes = [{**asdict(axis), "values": [value.hex() for value in axis.values]} for axis in self.axes]
        return {**asdict(self), "axes": axes}

    @property
    def dims(self) -> tuple[tuple[str, int], ...]:
        """Names and sizes of the grid's dimensions, the last one running fastest."""
        ways = (("direction", len(DIRECTIONS)),) if self.follow else ()
        return (*ways, *((axis.name, len(axis)) for axis in self.axes))

    @property
    def shape(self) -> tuple[int, ...]:
        """Sizes of the grid's dimensions."""
        return tuple(size for _, size in self.dims)

    @property
    def size(self) -> int:
        """Number of points."""
        return prod(self.shape)

    @property
    def chain(self) -> int:
        """Points that follow each other and cannot be parted."""
        return len(self.axes[-1]) if self.follow else 1

    def places(self, points: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the places of points on each axis, (n,) each.

        A followed axis is run backwards on the way down.

        Args:
            points: numbers of points, (n,).
        """
        found = list(np.unravel_index(points, self.shape))
        if self.follow:
            down = found[0] == 1
            found = found[1:]
            found[-1] = np.where(down, len(self.axes[-1]) - 1 - found[-1], found[-1])
        return tuple(found)

    def values(self, points: np.ndarray) -> dict[str, np.ndarray]:
        """Return the SI values of points by key, (n,) each.

        Args:
            points: numbers of points, (n,).
        """
        return {
            axis.key: np.array(axis.values)[place] for axis, place in zip(self.axes, self.places(points), strict=True)
        }

    def changes(self, point: int) -> dict[str, Any]:
        """Return what a point sets over the scenario, as it would be written.

        Args:
            point: its number.
        """
        places = self.places(np.array([point]))
        told = {axis.key: axis.written[int(place[0])] for axis, place in zip(self.axes, places, strict=True)}
        return {**told, "run.duration": f"{self.periods} periods", "run.settle": f"{self.settle} periods"}

    def seeds(self, points: np.ndarray) -> np.ndarray:
        """Return the seed of each point, (n,); it depends on the values there and on nothing else of the grid.

        Args:
            points: numbers of points, (n,).
        """
        values = self.values(points)
        if "run.seed" in values:
            return values["run.seed"].astype(np.int64)
        found = np.full(len(points), self.seed, dtype=np.uint64)
        for name in sorted(values):
            told = hashlib.blake2b(name.encode(), digest_size=8).digest()
            found = _mixed(found ^ np.uint64(int.from_bytes(told, "little")))
            found = _mixed(found ^ (values[name] + 0.0).view(np.uint64))
        return (found >> np.uint64(16)).astype(np.int64)

    def scenario(self, point: int | None = None) -> Any:
        """Return the scenario, or that of one point.

        Args:
            point: its number.

        Raises:
            InputError: the values of the point do not go together.
        """
        from gears3d.scenario.build import build
        from gears3d.scenario.overrides import apply

        document = pickle.loads(_read(self.document, self.path))
        if point is not None:
            seed = int(self.seeds(np.array([point]))[0])
            apply(document, {**self.changes(point), "run.seed": seed})
        return build(document)


@lru_cache(maxsize=4)
def _read(text: str, path: str) -> bytes:
    """Return a document read once a process; reading it takes six times as long as unpickling it."""
    from gears3d.scenario.document import read_text

    return pickle.dumps(read_text(text, Path(path) if path else None))


def _mixed(numbers: np.ndarray) -> np.ndarray:
    """Return numbers of 64 bits stirred so that every bit depends on all (splitmix64)."""
    z = numbers + np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


def from_table(table: dict[str, Any]) -> Plan:
    """Return the plan that :meth:`Plan.table` gave.

    Args:
        table: from JSON.
    """
    axes = [
        Axis(a["key"], a["family"], tuple(a["written"]), tuple(map(float.fromhex, a["values"])), a["text"])
        for a in table["axes"]
    ]
    return Plan(**{**table, "axes": tuple(axes), "measures": tuple(table["measures"])})
