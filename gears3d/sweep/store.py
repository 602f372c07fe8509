"""The folder of a sweep: its plan, finished blocks as files of their own, and the dataset made of them."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from math import prod
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.files import HIDDEN, lock, refuse_folder, replacing, write_text
from gears3d.sweep.block import Block
from gears3d.sweep.plan import Plan, from_table
from gears3d.version import __version__

PLAN, DATA, PARTS, FAILED = "sweep.json", "sweep.nc", "parts", "failed.csv"


class Store:
    """The folder of a sweep."""

    def __init__(self, place: Path, plan: Plan) -> None:
        self.place, self.plan = place, plan
        self.block = 0

    @contextmanager
    def opened(self) -> Iterator[Store]:
        """Hold the folder for one process alone."""
        self._check()
        new = not self.place.exists()
        try:
            self.place.mkdir(parents=True, exist_ok=True)
            held = (self.place / ".lock").open("w")
        except OSError as error:
            why = f"{self.place} cannot be written: {error.strerror}"
            raise InputError(Fault("--out", why, "name a folder that you may write")) from error
        with held:
            try:
                lock(held)
            except OSError as error:
                what = f"{self.place} is being filled by another process"
                raise InputError(Fault("--out", what, "wait for it, or name another folder")) from error
            try:
                yield self
            finally:
                if not self._begun():
                    self._leave(new)

    def _leave(self, new: bool) -> None:
        """Remove the lock, and the folder if it is new, of a sweep that did not start."""
        with suppress(OSError):
            (self.place / ".lock").unlink()
            if new:
                self.place.rmdir()

    def _check(self) -> None:
        here, other = self.place, "name another folder with --out"
        refuse_folder(here)
        if not here.is_dir() or not self._begun():
            return
        try:
            table = json.loads((here / PLAN).read_text(encoding="utf-8"))
            found, known = table["key"], table["plan"]
        except (OSError, ValueError, KeyError, TypeError):
            why = f"{here} is not a folder of a sweep and is not empty; it stays as it is"
            raise InputError(Fault("--out", why, other)) from None
        if found != self.plan.key:
            differs = _differences(self.plan.table(), known, table.get("version"))
            why = f"{here} holds another sweep: {differs}; it stays as it is"
            raise InputError(Fault("--out", why, "name another folder, or delete that one"))
        self.block = int(table["block"])

    def _begun(self) -> bool:
        """Return whether the folder contains more than what a sweep creates before its plan is written."""
        for path in self.place.iterdir():
            empty = path.name == PARTS and path.is_dir() and not any(path.iterdir())
            if not (path.name == ".lock" or path.name.startswith(HIDDEN) or empty):
                return True
        return False

    def write_plan(self, block: int, about: dict[str, Any]) -> None:
        """Write the plan, with the size of its blocks."""
        self.block = block
        table = {"key": self.plan.key, "version": __version__, "block": block, **about, "plan": self.plan.table()}
        write_text(self.place / PLAN, json.dumps(table, indent=1, allow_nan=False) + "\n")

    @property
    def complete(self) -> bool:
        """Whether the dataset is there."""
        return (self.place / DATA).exists()

    def blocks(self) -> Iterator[tuple[int, int]]:
        """Give begin and end of every block."""
        for begin in range(0, self.plan.size, self.block):
            yield begin, min(begin + self.block, self.plan.size)

    def has(self, begin: int, end: int) -> bool:
        """Whether a block is finished and whole."""
        try:
            with self._part(begin, end).open("rb") as file, np.load(file) as part:
                return len(part["status"]) == end - begin
        except (OSError, ValueError, KeyError, BadZipFile, EOFError):
            return False

    def write(self, block: Block) -> None:
        """Keep a finished block."""
        why = np.array([f"{point}\t{text}" for point, text in sorted(block.why.items())], dtype=np.str_)
        with replacing(self._part(block.begin, block.end)) as unfinished, unfinished.open("wb") as file:
            np.savez(file, why=why, **block.values)  # type: ignore[arg-type]

    def read(self, begin: int, end: int) -> tuple[dict[str, np.ndarray], dict[int, str]]:
        """Return the variables of a finished block, and why points failed."""
        with np.load(self._part(begin, end)) as part:
            values = {name: part[name] for name in part.files}
        pairs = (line.split("\t", 1) for line in values.pop("why").tolist())
        return values, {int(point): text for point, text in pairs}

    def clear(self) -> None:
        """Take the blocks away, when the dataset has them."""
        shutil.rmtree(self.place / PARTS, ignore_errors=True)

    def _part(self, begin: int, end: int) -> Path:
        return self.place / PARTS / f"{begin:012d}-{end:012d}.npz"


def open_plan(place: Path) -> Plan:
    """Return the plan of a folder.

    Args:
        place: of a sweep.

    Raises:
        InputError: it is missing.
    """
    try:
        return from_table(json.loads((place / PLAN).read_text(encoding="utf-8"))["plan"])
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(Fault("", "holds no sweep", "give the folder of --out", str(place))) from None


def slabs(shape: tuple[int, ...], begin: int, end: int) -> Iterator[tuple[tuple[slice, ...], int, int]]:
    """Cut a run of points in C order into boxes of a grid.

    Yields:
        A slice for each dimension, and the points that fill it: first and one after the last.

    >>> [(box, a, b) for box, a, b in slabs((2, 3), 1, 6)]  # doctest: +NORMALIZE_WHITESPACE
    [((slice(0, 1, None), slice(1, 3, None)), 1, 3),
     ((slice(1, 2, None), slice(0, 3, None)), 3, 6)]
    """
    if end <= begin:
        return
    if len(shape) <= 1:
        yield (slice(begin, end),) * len(shape), begin, end
        return
    inner = prod(shape[1:])
    row = begin // inner
    while begin < end:
        if begin % inner == 0 and end - begin >= inner:
            last = end // inner
            yield (slice(row, last), *(slice(0, size) for size in shape[1:])), begin, last * inner
            row, begin = last, last * inner
            continue
        stop = min(end, (row + 1) * inner)
        for box, first, after in slabs(shape[1:], begin - row * inner, stop - row * inner):
            yield (slice(row, row + 1), *box), first + row * inner, after + row * inner
        row, begin = row + 1, stop


def _differences(ours: dict[str, Any], theirs: dict[str, Any], version: Any) -> str:
    names = [name for name in ours if json.dumps(ours[name]) != json.dumps(theirs.get(name))]
    words = {"document": "the scenario", "axes": "what is varied", "path": "the scenario's file"}
    told = [words.get(name, name) for name in names]
    if not told:
        told = [f"it was made by version {version}" if version != __version__ else "it was made by other kernels"]
    return ", ".join(told) + (" differ" if len(told) > 1 else " differs" if names else "")
