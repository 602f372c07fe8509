"""What acquisition systems state in structures besides samples: names, units, sampling, the axis of a channel.

A structure is a tree of dictionaries; its leaves are arrays, or datasets of which nothing but the shape is known.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from gears3d.errors import InputError
from gears3d.measured.readers.unit import to_si

Tree = dict[str, Any]
_STEPS = re.compile(
    r"d_?t|t_?s|delta_?t|x_?delta|sample_?(time|interval|period)|sampling_?(time|interval|period)", re.I
)
_RATES = re.compile(
    r"f_?s|sr|sample_?rate(_?hz)?|sampling_?rate(_?hz)?|sampl(e|ing)_?freq(uency)?(_?hz)?|samplerate|abtastrate", re.I
)
_UNITS = ("unit", "units", "y_unit", "yunit", "unit_string", "physicalunit")
_NAMES = ("signalname", "channelname", "name")
_TIMES = ("time", "t", "zeit")
# Columns of a matrix, at most.
COLUMNS = 256
# Structures within structures.
DEEPEST = 16


class Stated(NamedTuple):
    """What a structure states of an array.

    Args:
        names: of its columns, with their group; empty where its own path is the name.
        units: of its columns, one for all, or none.
        clock: start and step [s] of even sampling.
        axis: path of the array that is its time.
    """

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    clock: tuple[float, float] | None = None
    axis: str = ""

    def unit(self, column: int) -> str:
        """Return the unit of a column."""
        return self.units[min(column, len(self.units) - 1)] if self.units else ""


def stated(tree: Tree) -> dict[str, Stated]:
    """Return the stated metadata of the arrays of a tree, by path with slashes.

    >>> signal = {"x_values": {"start_value": 0.0, "increment": 1e-3}, "y_values": {"values": np.zeros(9)}}
    >>> stated({"Signal": signal})["Signal/y_values/values"].clock
    (0.0, 0.001)
    """
    found: dict[str, Stated] = {}
    _walk("", tree, None, found, 0)
    return found


def as_number(value: Any) -> float | None:
    """Return a scalar, or text that is a number, as a float.

    >>> as_number(np.array([[0.5]])), as_number("1000 Hz"), as_number("a"), as_number(np.zeros(3))
    (0.5, 1000.0, None, None)
    """
    if isinstance(value, np.ndarray):
        value = value.ravel()[0] if value.size == 1 else None
    if isinstance(value, bytes | str):
        match = re.match(r"\s*([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)", as_text(value))
        value = None if match is None else float(match[1].replace(",", "."))
    if isinstance(value, np.generic) and value.dtype.kind not in "iuf":  # a timedelta is an integer, too
        return None
    if isinstance(value, bool) or not isinstance(value, int | float | np.integer | np.floating):
        return None
    return float(value) if isfinite(value) else None


def as_text(value: Any) -> str:
    """Return a value as text, empty where it is not text."""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.ravel()[0]
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace").strip()
    return value.strip() if isinstance(value, str) else ""


def children(node: Any) -> Iterator[tuple[str, Any]]:
    """Iterate over the fields of a structure, and the elements of an array of structures as ``(1)``, ``(2)``."""
    if isinstance(node, Mapping):
        yield from ((str(key), value) for key, value in node.items() if not str(key).startswith(("__", "#")))
    elif isinstance(node, list | tuple) or (isinstance(node, np.ndarray) and node.dtype.kind == "O"):
        elements = list(np.ravel(node)) if isinstance(node, np.ndarray) else list(node)
        yield from (
            (f"({k + 1})", one) for k, one in enumerate(elements) if isinstance(one, Mapping | np.ndarray | list)
        )


def joined(path: str, key: str) -> str:
    """Return the path of a field; elements of arrays have no slash before them."""
    return path + key if key.startswith("(") and path else f"{path}/{key}" if path else key


def length_of(value: Any) -> int:
    """Return the number of samples of a leaf, 0 where it is not a vector or matrix of numbers."""
    shape = getattr(value, "shape", ())
    numeric = getattr(getattr(value, "dtype", None), "kind", "") in "biuf"
    return max(shape) if numeric and 0 < len(shape) <= 2 and max(shape) > 1 else 0


def _walk(path: str, node: Any, clock: tuple[float, float] | None, found: dict[str, Stated], depth: int) -> None:
    if depth > DEEPEST:
        return
    fields = dict(children(node))
    if _testlab(path, fields, found):
        return
    clock = clock_of(fields) or clock
    unit = next((as_text(value) for key, value in fields.items() if key.lower() in _UNITS), "")
    about = fields.get("DataInfo")  # of a timeseries
    unit = unit or (as_text(about.get("Units")) if isinstance(about, Mapping) else "")
    axes = _axes(path, fields)
    for axis, known in axes.values():
        found[joined(path, axis)] = Stated((), (known,) if known else ())
    channels = _numbered(path, fields, clock)
    for key, value in fields.items():
        own = joined(path, key)
        if length_of(value):
            step = clock_of(getattr(value, "about", {})) or clock
            told = channels.get(key, Stated((), (unit,) if unit else (), step))
            axis = joined(path, axes[key][0]) if key in axes else ""
            if own not in found and (axis or told.clock or told.units or told.names):
                found[own] = told._replace(axis=axis, clock=None if axis else told.clock)
        else:
            _walk(own, value, clock, found, depth + 1)


def _testlab(path: str, fields: Tree, found: dict[str, Stated]) -> bool:
    """Return whether a structure is a function of Simcenter Testlab; note what it states."""
    x, y = fields.get("x_values"), fields.get("y_values")
    if not isinstance(x, Mapping) or not isinstance(y, Mapping) or not length_of(y.get("values")):
        return False
    label, factor = _quantity(x.get("quantity"))
    step, start = as_number(x.get("increment")), as_number(x.get("start_value")) or 0.0
    clock, axis = None, ""
    try:
        scale = to_si(label, ("time",))[0] if label else factor or 1.0
        clock = (start * scale, step * scale) if step and step > 0.0 else None
    except InputError:  # a spectrum, or an order
        label = ""
    if clock is None and length_of(x.get("values")):
        axis = joined(path, "x_values/values")
        found[axis] = Stated((), (label,) if label else ())
    record = fields.get("function_record")
    names = record.get("name") if isinstance(record, Mapping) else None
    several = isinstance(names, list | tuple | np.ndarray)
    told = [as_text(name) for name in (np.ravel(np.asarray(names, dtype=object)) if several else [names]) if name]
    columns = min(y["values"].shape) if len(y["values"].shape) == 2 else 1
    own = tuple(f"{path}/{name.replace('/', '_')}" for name in told) if len(told) == columns and all(told) else ()
    quantities = y.get("quantity")
    every = [each for _, each in children(quantities)] if not isinstance(quantities, Mapping) else [quantities]
    units = tuple(_unit(*_quantity(each)) for each in every)
    if not own:
        own = (path,) if columns == 1 else tuple(f"{path} column {k + 1}" for k in range(columns))
    found[joined(path, "y_values/values")] = Stated(own, units, clock, axis)
    return True


def _quantity(node: Any) -> tuple[str, float | None]:
    """Return label and factor to SI of a quantity of Testlab."""
    if not isinstance(node, Mapping):
        return "", None
    change = node.get("unit_transformation")
    factor = as_number(change.get("factor")) if isinstance(change, Mapping) else None
    return as_text(node.get("label")), factor


def _unit(label: str, factor: float | None) -> str:
    """Return the unit of samples; where the factor contradicts the label, the factor is what they are in SI."""
    try:
        size, family = to_si(label, ("angle", "speed", "time")) if label else (1.0, "")
    except InputError:
        return label
    if factor is None or factor <= 0.0 or not family or abs(factor / size - 1.0) < 0.01:
        return label
    return f"{factor!r} {({'angle': 'rad', 'speed': 'rad/s', 'time': 's'})[family]}"


def clock_of(fields: Tree) -> tuple[float, float] | None:
    """Return the start and step [s] of the sampling that a field states.

    >>> clock_of({"fs": 1000.0}), clock_of({"dt": "0.5"}), clock_of({"fs": "a"})
    ((0.0, 0.001), (0.0, 0.5), None)
    """
    for key, value in fields.items():
        number = as_number(value)
        if number is None or number <= 0.0:
            continue
        if _RATES.fullmatch(key):
            return 0.0, 1.0 / number
        if _STEPS.fullmatch(key) and number < 1.0:
            return 0.0, number
    return None


def _axes(path: str, fields: Tree) -> dict[str, tuple[str, str]]:
    """Return the field that is the time of others of its length, with its unit where the export fixes it."""
    rows = {key: length_of(value) for key, value in fields.items()}
    lower = {key.lower(): key for key in fields}
    axes: dict[str, tuple[str, str]] = {}
    time = next((lower[name] for name in _TIMES if path and name in lower and rows[lower[name]]), None)
    unit = ""
    if time is not None and "data" in lower:  # timeseries counts in seconds unless it says otherwise
        about = fields.get("TimeInfo")
        unit = (as_text(about.get("Units")) if isinstance(about, Mapping) else "") or "s"
    for key in fields:
        pair = key[:-2] + {"_y": "_x", "_Y": "_X"}.get(key[-2:], "??")  # DEWESoft: Data1_y over Data1_x
        match = re.fullmatch(r"(Data\d+_)(.+)", key)
        timed = f"{match[1]}time_{match[2]}" if match else ""
        named = next((each for each in (pair, timed) if rows[key] and rows.get(each) == rows[key]), None)
        if named is not None:
            axes[key] = named, "s"
        elif time is not None and key != time and rows[time] == rows[key] and not match:
            axes[key] = time, unit
    return axes


def _numbered(path: str, fields: Tree, clock: tuple[float, float] | None) -> dict[str, Stated]:
    """Return what headers state of numbered channels: ``Channel_1_Data`` and ``Channel_1_Header`` of catman."""
    found = {}
    for key in fields:
        match = re.fullmatch(r"(.+_?\d+)_Data", key)
        about = fields.get(f"{match[1]}_Header") if match else None
        if match is None or not isinstance(about, Mapping):
            continue
        lower = {str(name).lower(): value for name, value in about.items()}
        name = next((as_text(lower[each]) for each in _NAMES if as_text(lower.get(each))), match[1])
        unit = next((as_text(lower[each]) for each in _UNITS if each in lower), "")
        common = fields.get("File_Header")
        own = clock_of(dict(about)) or (clock_of(dict(common)) if isinstance(common, Mapping) else None) or clock
        found[key] = Stated((joined(path, name.replace("/", "_")),), (unit,) if unit else (), own)
    return found
