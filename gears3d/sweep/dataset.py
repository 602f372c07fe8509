"""The labelled dataset of a sweep, and the thresholds in it."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.extras import require
from gears3d.files import replacing
from gears3d.signals.impacts import REGIMES
from gears3d.sweep.block import STATUS
from gears3d.sweep.measures import MISSING, Variable, variables
from gears3d.sweep.plan import DIRECTIONS, FORMAT, Plan
from gears3d.sweep.store import DATA, FAILED, Store, slabs
from gears3d.version import __version__

if TYPE_CHECKING:
    import xarray


_OWN = (
    Variable("status", "1", "how the point ended: " + ", ".join(f"{i} {word}" for i, word in enumerate(STATUS)), True),
    Variable("seed", "1", "run.seed of the point"),
)


AT_ONCE = 1 << 25  # Bytes of blocks that are written together
FLAGS = {"status": STATUS, "regime": REGIMES}  # Words of the numbers of a variable, in order


def refuse_lacking() -> None:
    """Refuse to begin where the dataset could not be written."""
    for name in ("xarray", "h5netcdf", "h5py"):
        require(name, "the dataset of a sweep", "sweep")


def assemble(store: Store, about: dict[str, Any]) -> dict[str, int]:
    """Write ``sweep.nc`` and, where points failed, ``failed.csv``."""
    import h5netcdf

    plan, failed = store.plan, []
    counts: dict[str, int] = dict.fromkeys(STATUS, 0)
    with replacing(store.place / DATA) as unfinished, _Sink(unfinished) as sink, h5netcdf.File(sink, "w") as file:
        targets = _layout(file, plan, about)
        for begin, end, values, why in _joined(store):
            failed += why
            for code, word in enumerate(STATUS):
                counts[word] += int(np.count_nonzero(values["status"] == code))
            for name, target in targets.items():
                ordered = _ordered(plan, begin, values[name])
                for box, first, after in slabs(plan.shape, begin, end):
                    shape = tuple(part.stop - part.start for part in box) + ordered.shape[1:]
                    target[(*box, *(slice(None),) * (ordered.ndim - 1))] = ordered[
                        first - begin : after - begin
                    ].reshape(shape)
    _write_failed(store, sorted(failed))
    return counts


class _Sink(io.FileIO):
    """A file whose first error is raised when it is closed: HDF5 crashes on a full disk, at the end of the process."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, "w+")
        self.error: OSError | None = None

    def write(self, data: Any) -> int:
        """Write all bytes; after an error they are discarded."""
        left = memoryview(data).cast("B")
        size = len(left)
        try:
            while self.error is None and len(left):
                left = left[super().write(left) :]
        except OSError as error:
            self.error = error
        return size

    def __exit__(self, *_: object) -> None:
        self.close()
        if self.error is not None:
            raise self.error


def _joined(store: Store) -> Iterator[tuple[int, int, dict[str, np.ndarray], list[tuple[int, str]]]]:
    """Yield blocks that follow each other as one, up to what memory is for: many small writes take most of the time."""
    parts: list[dict[str, np.ndarray]] = []
    failed: list[tuple[int, str]] = []
    first, held = 0, 0
    for begin, end in store.blocks():
        values, why = store.read(begin, end)
        parts.append(values)
        failed += list(why.items())
        held += sum(one.nbytes for one in values.values())
        if held >= AT_ONCE or end == store.plan.size:
            yield first, end, {name: np.concatenate([one[name] for one in parts]) for name in values}, failed
            parts, failed, first, held = [], [], end, 0


def _ordered(plan: Plan, begin: int, values: np.ndarray) -> np.ndarray:
    """Return the values of a block in the order of the grid: the way down was run from the end."""
    if not plan.follow:
        return values
    rows = values.reshape(-1, plan.chain, *values.shape[1:]).copy()
    first_down = plan.size // 2
    down = begin + plan.chain * np.arange(len(rows)) >= first_down
    rows[down] = rows[down, ::-1]
    return rows.reshape(values.shape)


def _layout(file: Any, plan: Plan, about: dict[str, Any]) -> dict[str, Any]:
    """Make dimensions, coordinates and empty variables; return the variables by name."""
    sizes = dict(plan.dims)
    some = variables(plan.measures)
    if any(variable.sections for variable in some):
        sizes["period"] = plan.keep
    file.dimensions = sizes
    if plan.follow:
        made = file.create_variable("direction", ("direction",), data=np.array(DIRECTIONS, dtype=object), dtype=_text())
        made.attrs["long_name"] = "way along the axis that is followed"
    if "period" in sizes:
        made = file.create_variable("period", ("period",), data=np.arange(-plan.keep, 0))
        made.attrs["long_name"] = "periods before the end of the point's run"
    for axis in plan.axes:
        if axis.family == "choice":
            words = np.array(axis.written, dtype=object)
            made = file.create_variable(axis.name, (axis.name,), data=words, dtype=_text())
        else:
            made = file.create_variable(axis.name, (axis.name,), data=np.array(axis.values))
        made.attrs.update({"units": axis.unit or "1", "long_name": axis.key, "written": axis.text})
    targets = {}
    for variable in (*some, *_OWN):
        dims = tuple(name for name, _ in plan.dims) + (("period",) if variable.sections else ())
        dtype = "i1" if variable.whole else "i8" if variable.name == "seed" else "f8"
        always = variable.name in ("status", "seed")
        fill = {} if always else {"fillvalue": np.int8(MISSING) if variable.whole else np.nan}
        made = file.create_variable(variable.name, dims, dtype, compression="gzip", compression_opts=1, **fill)
        made.attrs.update({"units": variable.unit, "long_name": variable.about})
        if variable.name in FLAGS:
            words = FLAGS[variable.name]
            made.attrs.update({"flag_values": np.arange(len(words), dtype="i1"), "flag_meanings": " ".join(words)})
        targets[variable.name] = made
    times = {"periods": plan.periods, "settle_periods": plan.settle, "strobe_cycles": plan.strobe, "seed": plan.seed}
    own = {"Conventions": "CF-1.11", "gears3d_format": FORMAT, "version": __version__, "key": plan.key}
    told = {"model": plan.model, "scenario": plan.document, "plan": json.dumps(plan.table())}
    file.attrs.update({**own, **told, **times, **about})
    return targets


def _text() -> Any:
    import h5py

    return h5py.string_dtype()


def _write_failed(store: Store, failed: list[tuple[int, str]]) -> None:
    place = store.place / FAILED
    if not failed:
        place.unlink(missing_ok=True)
        return
    plan = store.plan
    with replacing(place) as unfinished, unfinished.open("w", newline="", encoding="utf-8") as file:
        lines = csv.writer(file)
        lines.writerow(["point", *(["direction"] if plan.follow else []), *(axis.key for axis in plan.axes), "why"])
        for point, why in failed:
            places = plan.places(np.array([point]))
            told = [axis.written[int(at[0])] for axis, at in zip(plan.axes, places, strict=True)]
            way = [DIRECTIONS[int(point >= plan.size // 2)]] if plan.follow else []
            lines.writerow([point, *way, *told, why])


def counted(place: Path) -> dict[str, int]:
    """Return how many points of a dataset ended in which way."""
    import h5netcdf

    with h5netcdf.File(place / DATA, "r") as file:
        status = np.asarray(file["status"][...])
    return {word: int(np.count_nonzero(status == code)) for code, word in enumerate(STATUS)}


def open_dataset(place: str | Path) -> xarray.Dataset:
    """Open the dataset of a sweep; its variables are read when they are asked for.

    Args:
        place: the folder of the sweep, or its ``sweep.nc``.

    Returns:
        Coordinates are the varied keys with underscores, SI units in ``attrs``.

    Raises:
        InputError: it is missing.
        MissingExtraError: xarray is not installed.
    """
    refuse_lacking()
    import xarray

    path = Path(place)
    path = path / DATA if path.is_dir() else path
    if not path.is_file():
        raise InputError(
            Fault(
                "", "there is no such dataset", "a sweep that was interrupted continues when it is run again", str(path)
            )
        )
    return xarray.open_dataset(path, engine="h5netcdf")


def thresholds(data: xarray.Dataset) -> xarray.Dataset:
    """Return the values of the followed axis, and Λ, at which rattle begins or ends on the way up and on the way down.

    On a way that begins in contact it is the first place that rattles, on one that begins with rattle the place from
    which on contact holds. It lies between two values of the grid: given are their middle and, as ``within``, half
    their distance. NaN where contact holds all the way, or rattle is there at both ends.

    Source: Rigaud & Perret-Liaudet 2020, section 4: the rise and the collapse of rattle.
    """
    import xarray

    if "direction" not in data.dims or "regime" not in data or "excitation" not in data:
        raise InputError(Fault("sweep", "has no thresholds", "give --follow KEY, and --measure regime,threshold"))
    along = [str(name) for name in data["status"].dims][-1]
    others = tuple(name for name in data["regime"].dims if name not in ("direction", along))
    found = {}
    for way in ("up", "down"):
        order = slice(None) if way == "up" else slice(None, None, -1)
        part = data.sel(direction=way).transpose(*others, along, ...).isel({along: order})
        before, crossed = _crossing(part["regime"].values > 0)
        values, push = (
            np.broadcast_to(part[along].values, (*crossed.shape, part.sizes[along])),
            part["excitation"].values,
        )
        ends = [[_pick(table, before + step) for step in (0, 1)] for table in (values, push)]
        middle, within = 0.5 * (ends[0][0] + ends[0][1]), 0.5 * np.abs(ends[0][1] - ends[0][0])
        told = (middle, within, 0.5 * (ends[1][0] + ends[1][1]))
        names = (way, f"within_{way}", f"excitation_{way}")
        found |= {name: np.where(crossed, value, np.nan) for name, value in zip(names, told, strict=True)}
    coordinates = {name: data[name] for name in others}
    return xarray.Dataset({name: (others, value) for name, value in found.items()}, coordinates, {"along": along})


def _crossing(lively: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the place before which a way crosses the threshold, and whether it does; the way is the last axis."""
    size = lively.shape[-1]
    first, last = np.argmax(lively, axis=-1), size - 1 - np.argmax(lively[..., ::-1], axis=-1)
    begins, ends = lively[..., 0], lively[..., -1]
    rises, falls = lively.any(axis=-1) & ~begins, begins & ~ends
    before = np.where(rises, first - 1, np.where(falls, last, 0))
    return np.clip(before, 0, max(size - 2, 0)), (rises | falls) & (size > 1)


def _pick(table: np.ndarray, place: np.ndarray) -> np.ndarray:
    return np.take_along_axis(table, np.minimum(place, table.shape[-1] - 1)[..., None], axis=-1)[..., 0]
