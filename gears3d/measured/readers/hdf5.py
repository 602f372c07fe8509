"""HDF5, and MATLAB v7.3, which is HDF5, by h5py."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.readers.source import Signal, Source, Whole, library, reading, refuse_large, unique
from gears3d.measured.readers.structures import COLUMNS, Stated, Tree, stated

# Samples read at a time.
BLOCK = 1 << 18
UNIT_KEYS = ("unit", "units", "Unit", "Units", "unit_string")
# Bytes of an attribute.
LONGEST = 1 << 16
# Numbers or characters of a dataset that is read while a file is opened.
SMALL = 4096
# Such datasets in a file.
MOST = 20_000


class _Place(NamedTuple):
    """Where the samples of a signal lie: a dataset, a field of it, and a column or row of it."""

    dataset: str
    field: str
    at: int | None
    along: int


def open_hdf5(path: Path, form: str = "HDF5") -> Source:
    """Open an HDF5 file; a matrix gives its columns, a table its fields.

    Raises InputError when it is damaged, or h5py is not installed.
    """
    h5py = library("h5py", path)
    places: dict[str, _Place] = {}
    signals: list[Signal] = []
    notes: list[str] = []
    away: list[InputError] = []
    found: list[tuple[Signal, _Place]] = []
    objects: list[str] = []

    def visit(name: str, node: Any) -> None:
        if name.startswith("#") or "/#" in name:
            return
        notes.extend(_notes(name, node))
        if "MATLAB_object_decode" in node.attrs:
            objects.append(name)
        elif isinstance(node, h5py.Dataset):
            found.extend(_signals(name, node, told.get(name, Stated())))

    def follow(name: str, link: Any) -> None:
        if isinstance(link, h5py.ExternalLink):
            away.append(_elsewhere(path, name, link.filename))

    with reading(path, form), h5py.File(path, "r") as file:
        file.visititems_links(follow)
        if away:
            raise away[0]
        notes.extend(_notes("", file))
        told = stated(_tree(file, file, [MOST], 0))
        file.visititems(visit)
    if objects and form.startswith("MATLAB"):
        from gears3d.measured.readers.matlab import open_objects

        return open_objects(path)
    names = unique([signal.name for signal, _ in found])
    first = {signal.name: name for name, (signal, _) in reversed(list(zip(names, found, strict=True)))}
    for name, (signal, place) in zip(names, found, strict=True):
        places[name] = place
        signals.append(replace(signal, name=name, axis=first.get(signal.axis, "")))

    def load(names: Sequence[str], most: int | None) -> dict[str, np.ndarray]:
        with reading(path, form), h5py.File(path, "r") as file:
            found = [(file[place.dataset], place) for place in map(places.__getitem__, names)]
            rows = [each.shape[place.along] for each, place in found]
            more = max((_at_once(each, path) for each, _ in found), default=0)
            refuse_large(path, rows if most is None else [min(row, most) for row in rows], more)
            whole = Whole()
            return {
                name: _values(file[places[name].dataset], places[name], most, partial(whole.floats, name))
                for name in names
            }

    return Source(str(path), form, tuple(signals), load, {}, tuple(notes))


def _signals(name: str, dataset: Any, about: Stated) -> Iterator[tuple[Signal, _Place]]:
    """Iterate over the signals of a dataset."""
    kind, shape = dataset.dtype, dataset.shape
    if not shape or max(shape) < 2 or len(shape) > 2 or _class(dataset) in (b"char", b"cell"):
        return
    told = {key: _text(value) for key, value in _attributes(dataset)}
    unit = next((told[key] for key in UNIT_KEYS if key in told), "")
    if kind.names and len(shape) == 1:
        for field in kind.names:
            if kind[field].kind in "biuf" and not kind[field].shape:
                yield Signal(f"{name}/{field}", unit, shape[0], about.clock), _Place(name, field, None, 0)
        return
    if kind.kind not in "biuf":
        yield Signal(name, unit, shape[0], numeric=False), _Place(name, "", None, 0)
        return
    along = int(np.argmax(shape))
    count = 1 if len(shape) == 1 else min(shape)
    if count > COLUMNS:
        return
    own = about.names if len(about.names) == count else ()
    plain = [name] if count == 1 else [f"{name} column {k + 1}" for k in range(count)]
    for k, each in enumerate(own or plain):
        signal = Signal(each, unit or about.unit(k), shape[along], about.clock, about.axis)
        yield signal, _Place(name, "", None if len(shape) == 1 else k, along)


def _tree(file: Any, node: Any, left: list[int], depth: int) -> Tree:
    """Return groups as dictionaries, with their attributes; of datasets that are not small nothing is read."""
    tree: Tree = {key: value for key, value in _attributes(node) if not key.startswith("MATLAB")}
    for key in node:
        if key.startswith("#") or depth > 16 or left[0] <= 0:
            continue
        left[0] -= 1
        one = node[key]
        if not hasattr(one, "dtype"):
            tree[key] = _tree(file, one, left, depth + 1)
            continue
        tree[key] = _value(file, one, left)
        own = {name: value for name, value in _attributes(one) if not name.startswith("MATLAB")}
        if own and getattr(tree[key], "shape", ()):
            tree[key] = _Leaf(tree[key].shape, tree[key].dtype, own)
    return tree


class _Leaf(NamedTuple):
    """A dataset of which nothing is read: its shape, its type, and what its attributes state."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    about: Tree


def _value(file: Any, dataset: Any, left: list[int]) -> Any:
    """Return a scalar or text of a small dataset, cells as a list, and of any other its shape."""
    count, kind = math.prod(dataset.shape), dataset.dtype.kind
    if _class(dataset) == b"char" and kind == "u" and count <= SMALL:
        return "".join(map(chr, np.ravel(dataset[()], "F" if dataset.ndim < 2 else "C")))
    if kind == "O" and _class(dataset) == b"cell" and count <= COLUMNS:
        cells = []
        for reference in np.ravel(dataset[()]):
            left[0] -= 1
            cells.append(_value(file, file[reference], left) if reference and left[0] > 0 else None)
        return cells
    if count == 1 and kind in "biufSO" and dataset.dtype.itemsize <= LONGEST:
        return np.ravel(dataset[()])[0]
    return _Leaf(dataset.shape, dataset.dtype, {})


def _elsewhere(path: Path, name: str, file: str) -> InputError:
    what = f"has its samples in another file: {file!r}"
    return InputError(Fault(name, what, "copy them into one file: h5repack, or export it again", str(path)))


def _at_once(dataset: Any, path: Path) -> int:
    """Return the size of a unit of decompression, a chunk or a row [bytes].

    Raises InputError when its samples lie in another file.
    """
    if dataset.external or dataset.is_virtual:
        files = dataset.external or dataset.virtual_sources()
        raise _elsewhere(path, dataset.name, str(files[0][0] if dataset.external else files[0].file_name))
    return 2 * math.prod(dataset.chunks or (1,)) * dataset.dtype.itemsize


def _values(dataset: Any, place: _Place, most: int | None, floats: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    count = dataset.shape[place.along] if most is None else min(dataset.shape[place.along], most)
    values = np.zeros(count)
    for start in range(0, count, BLOCK):
        part = slice(start, min(start + BLOCK, count))
        if place.at is None:
            block = dataset.fields(place.field)[part] if place.field else dataset[part]
        else:
            block = dataset[part, place.at] if place.along == 0 else dataset[place.at, part]
        values[part] = floats(np.asarray(block))
    return values


def _notes(name: str, node: Any) -> Iterator[str]:
    for key, value in _attributes(node):
        if not key.startswith("MATLAB"):
            yield f"{name}.{key} = {_text(value)}".lstrip(".")


def _attributes(node: Any) -> Iterator[tuple[str, Any]]:
    """Iterate over the attributes that hold one value; others may be of any size."""
    for key in node.attrs:
        about = node.attrs.get_id(key)
        if math.prod(about.shape) == 1 and about.get_type().get_size() <= LONGEST:
            yield key, node.attrs[key]


def _class(dataset: Any) -> Any:
    """Return the class that MATLAB gave a dataset."""
    return next((value for key, value in _attributes(dataset) if key == "MATLAB_class"), b"")


def _text(value: Any) -> str:
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.ravel()[0]
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
