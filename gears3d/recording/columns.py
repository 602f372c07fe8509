"""Tables of a recording: columns with units, columns computed on request, metadata as JSON, columns of pyarrow."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.errors import Fault, InputError, did_you_mean

if TYPE_CHECKING:
    import pyarrow

ACTIVE = 0
REVERSE = 1
FLANKS = ("active", "reverse")  # Names of the flanks, in the order of their codes

SIGNAL_UNITS: dict[str, str] = {
    "time_s": "s",
    "theta_drive_rad": "rad",
    "theta_loose_rad": "rad",
    "omega_drive_rad_s": "rad/s",
    "omega_loose_rad_s": "rad/s",
    "displacement_m": "m",
    "velocity_m_s": "m/s",
}
SIGNALS_REQUIRED = ("time_s", "theta_drive_rad", "theta_loose_rad")

IMPACT_UNITS: dict[str, str] = {
    "time_s": "s",
    "flank": "",
    "velocity_m_s": "m/s",
    "rebound_m_s": "m/s",
    "impulse_N_s": "N s",
    "phase_rad": "rad",
    "tooth_drive": "1",
    "tooth_loose": "1",
    "flight_height_m": "m",
}
IMPACTS_REQUIRED = ("time_s", "flank", "velocity_m_s")
INTEGERS = {"flank": np.int8, "tooth_drive": np.int32, "tooth_loose": np.int32}

_SUFFIXES = {
    "_rad_s2": "rad/s^2",
    "_m_s2": "m/s^2",
    "_rad_s": "rad/s",
    "_m_s": "m/s",
    "_N_s": "N s",
    "_N_m": "N m",
    "_rad": "rad",
    "_Pa": "Pa",
    "_Hz": "Hz",
    "_N": "N",
    "_s": "s",
    "_m": "m",
}

Table = dict[str, np.ndarray]
Columns = Mapping[str, np.ndarray]
_TAG = "$float"


def unit_of(column: str) -> str:
    """Return the unit that a column's name ends in, empty when it has none.

    Args:
        column: name of a column, of the contract or of one's own.

    >>> unit_of("omega_loose_rad_s"), unit_of("sound_Pa"), unit_of("flank")
    ('rad/s', 'Pa', '')
    """
    known = {**SIGNAL_UNITS, **IMPACT_UNITS}
    if column in known:
        return known[column]
    return next((unit for suffix, unit in _SUFFIXES.items() if column.endswith(suffix)), "")


def signal_table(columns: Mapping[str, Any], file: str = "") -> Table:
    """Check the signals and return them as read-only float arrays.

    Returns:
        The columns as float64, those of the contract first.

    >>> list(signal_table({"theta_drive_rad": [0, 1], "theta_loose_rad": [0, 1], "time_s": [0, 1]}))
    ['time_s', 'theta_drive_rad', 'theta_loose_rad']
    """
    _require(columns, SIGNALS_REQUIRED, "signals", file)
    names = [name for name in SIGNAL_UNITS if name in columns] + [n for n in columns if n not in SIGNAL_UNITS]
    table = {name: _array(name, columns[name], np.float64, "signals", file) for name in names}
    _refuse_unequal(table, "signals", file)
    _refuse_holes(table, SIGNAL_UNITS, "signals", file)
    _refuse_disorder(table["time_s"], True, "signals", file)
    return table


def impact_table(columns: Mapping[str, Any], file: str = "") -> Table:
    """Check the impacts and return them as read-only arrays.

    Returns:
        The columns, those of the contract first and all there; ``flank`` int8, teeth int32, the rest float64.

    >>> table = impact_table({"time_s": [0.5], "flank": ["reverse"], "velocity_m_s": [0.03]})
    >>> table["flank"].tolist(), table["rebound_m_s"].tolist()
    ([1], [nan])
    """
    columns = columns or {name: [] for name in IMPACTS_REQUIRED}
    _require(columns, IMPACTS_REQUIRED, "impacts", file)
    count = np.shape(columns["time_s"])[:1]
    unknown = {name: np.zeros(count) if name in INTEGERS else np.full(count, np.nan) for name in IMPACT_UNITS}
    columns = {**unknown, **columns, "flank": flank_codes(columns["flank"], file)}
    table = {n: _array(n, v, INTEGERS.get(n, np.float64), "impacts", file) for n, v in columns.items()}
    _refuse_unequal(table, "impacts", file)
    _refuse_holes(table, IMPACTS_REQUIRED, "impacts", file)
    _refuse_disorder(table["time_s"], False, "impacts", file)
    return table


def flank_codes(values: Any, file: str = "") -> np.ndarray:
    """Return flanks given as text or as codes as int8 codes.

    >>> flank_codes(["active", "reverse"]).tolist()
    [0, 1]
    """
    given = np.asarray(values)
    codes = np.full(given.shape, -1, dtype=np.int8)
    for code, name in enumerate(FLANKS):
        codes[given == (code if given.dtype.kind in "biuf" else name)] = code
    bad = np.flatnonzero(codes < 0)
    if bad.size:
        word = given.flat[bad[0]]
        raise InputError(
            Fault(f"impacts.flank[{bad[0]}]", f"is {str(word)!r}", "a flank is 'active' (0) or 'reverse' (1)", file)
        )
    return codes


def _require(columns: Mapping[str, Any], required: tuple[str, ...], table: str, file: str) -> None:
    missing = [name for name in required if name not in columns]
    if missing:
        have = [str(name) for name in columns]
        raise InputError(
            [Fault(f"{table}.{name}", "is missing", _nearest(name, have), file) for name in missing],
        )


def _nearest(name: str, have: list[str]) -> str:
    if not have:
        return "the table is empty"
    hint = did_you_mean(name, have)
    return hint.replace("did you mean", "rename") if hint.startswith("did") else hint.replace("known:", "it has")


def _array(name: str, values: Any, dtype: Any, table: str, file: str) -> np.ndarray:
    key = f"{table}.{name}"
    given = np.asarray(values)
    if given.dtype.kind not in "biuf" and given.size:
        raise InputError(Fault(key, f"holds {given.flat[0]!r}, no number", "leave it out or make it numbers", file))
    with np.errstate(invalid="ignore"):
        array = given.astype(dtype, copy=False)
    if np.issubdtype(dtype, np.integer) and not np.array_equal(array, given):
        row = int(np.flatnonzero(array != given)[0])
        raise InputError(Fault(f"{key}[{row}]", f"is {given.flat[row]}", "a whole number, 0 where unknown", file))
    if array.ndim != 1:
        raise InputError(Fault(key, f"has shape {array.shape}", "one value a row", file))
    array = array.view()
    array.flags.writeable = False
    return array


def _refuse_unequal(columns: Table, table: str, file: str) -> None:
    first = len(columns["time_s"])
    faults = [
        Fault(f"{table}.{name}", f"has {len(values)} rows, time_s has {first}", "", file)
        for name, values in columns.items()
        if len(values) != first
    ]
    if faults:
        raise InputError(faults)


def _refuse_holes(columns: Table, names: Any, table: str, file: str) -> None:
    faults = []
    for name in names:
        bad = np.flatnonzero(~np.isfinite(columns.get(name, np.zeros(0))))
        if bad.size:
            more = f", and {len(bad) - 1} more rows" if len(bad) > 1 else ""
            value = columns[name][bad[0]]
            faults.append(Fault(f"{table}.{name}[{bad[0]}]", f"is {value}{more}", "cut or correct the rows", file))
    if faults:
        raise InputError(faults)


def _refuse_disorder(time: np.ndarray, strictly: bool, table: str, file: str) -> None:
    bad = np.flatnonzero(time[1:] <= time[:-1] if strictly else time[1:] < time[:-1])
    if bad.size:
        row = int(bad[0]) + 1
        what = f"is {float(time[row])!r} s after {float(time[row - 1])!r} s"
        raise InputError(Fault(f"{table}.time_s[{row}]", what, "time must increase from row to row", file))


class Derived(Mapping[str, np.ndarray]):
    """A table of which some columns are there and the others follow from them.

    Args:
        stored: columns that are there, each (n,), ``time_s`` among them.
        made: by name what gives a column at some rows; it goes before one that is stored.
        order: names of all columns in order.

    >>> made = {"twice": lambda rows: 2.0 * np.arange(4.0)[rows]}
    >>> table = Derived({"time_s": np.arange(4.0)}, made, ["time_s", "twice"])
    >>> table["twice"].tolist(), table.part("twice", slice(None, None, 3)).tolist(), len(table)
    ([0.0, 2.0, 4.0, 6.0], [0.0, 6.0], 2)
    """

    def __init__(self, stored: Columns, made: Mapping[str, Callable[[slice], np.ndarray]], order: list[str]) -> None:
        self._stored, self._made, self._order = dict(stored), dict(made), list(order)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.part(name, slice(None))

    def __iter__(self) -> Iterator[str]:
        return iter(self._order)

    def __contains__(self, name: object) -> bool:
        return name in self._order

    def __len__(self) -> int:
        return len(self._order)

    def part(self, name: str, rows: slice) -> np.ndarray:
        """Return a column at some rows, read-only.

        Args:
            name: of the column.
            rows: which.

        Raises:
            KeyError: there is no such column.
        """
        if name not in self._made:
            return self._stored[name][rows]
        values = self._made[name](rows)
        values.flags.writeable = False
        return values


def part_of(table: Columns, name: str, rows: slice) -> np.ndarray:
    """Return a column of any table at some rows."""
    return table.part(name, rows) if isinstance(table, Derived) else table[name][rows]


def plain(value: Any, key: str = "meta") -> Any:
    """Return a value as JSON would give it back: numpy scalars and arrays, tuples and keys made plain.

    >>> plain({"b": np.float64(1.5), "c": (1, 2)})
    {'b': 1.5, 'c': [1, 2]}
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, dict):
        return {str(k): plain(v, f"{key}.{k}") for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v, f"{key}[{i}]") for i, v in enumerate(value)]
    raise TypeError(f"{key} is a {type(value).__name__}: JSON cannot hold it")


def to_json(meta: dict[str, Any]) -> str:
    """Return JSON that every reader takes: infinities and NaN are written ``{"$float": "-inf"}``.

    >>> to_json({"lyapunov_1_s": -math.inf})
    '{"lyapunov_1_s": {"$float": "-inf"}}'
    """
    return json.dumps(_tagged(meta), allow_nan=False, ensure_ascii=False)


def from_json(text: str | bytes) -> dict[str, Any]:
    """Return what :func:`to_json` wrote.

    >>> from_json('{"lyapunov_1_s": {"$float": "-inf"}}')
    {'lyapunov_1_s': -inf}
    """
    try:
        meta = json.loads(text, object_hook=lambda d: float(d[_TAG]) if d.keys() == {_TAG} else d)
    except (TypeError, RecursionError) as error:
        raise ValueError(f"is not metadata of gears3d: {error}") from error
    if not isinstance(meta, dict):
        raise ValueError("is not a JSON object")
    return meta


def _tagged(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return {_TAG: repr(value)}
    if isinstance(value, dict):
        return {k: _tagged(v) for k, v in value.items()}
    return [_tagged(v) for v in value] if isinstance(value, list) else value


def column_of(values: np.ndarray) -> pyarrow.Array:
    """Return an array of numbers as a column; nothing is copied, and NaN stays NaN.

    >>> column_of(np.arange(6.0)[::2]).to_pylist(), str(column_of(np.zeros(2, np.int8)).type)
    ([0.0, 2.0, 4.0], 'int8')
    """
    import pyarrow as pa

    values = np.ascontiguousarray(values)
    return pa.Array.from_buffers(pa.from_numpy_dtype(values.dtype), len(values), [None, pa.py_buffer(values)])


def named_of(codes: np.ndarray, names: Sequence[str]) -> pyarrow.Array:
    """Return codes as a column of names.

    >>> named_of(np.array([1, 0, 1], np.int8), ("active", "reverse")).to_pylist()
    ['reverse', 'active', 'reverse']
    """
    import pyarrow as pa

    begin = np.cumsum([0, *map(len, names)], dtype=np.int32)
    told = pa.StringArray.from_buffers(len(names), pa.py_buffer(begin), pa.py_buffer("".join(names).encode()))
    return pa.DictionaryArray.from_arrays(column_of(codes), told)


def floats_of(column: pyarrow.Array) -> np.ndarray:
    """Return a column of float64 as an array, missing values NaN; without missing values nothing is copied.

    >>> import pyarrow as pa
    >>> floats_of(pa.array([1.0, None, 3.0])).tolist(), floats_of(pa.array([1.0, 2.0, None, 4.0])[1:]).tolist()
    ([1.0, nan, 3.0], [2.0, nan, 4.0])
    """
    count, begin = len(column), column.offset
    known, numbers = column.buffers()
    if numbers is None or not count:
        return np.zeros(count)
    values = np.frombuffer(numbers, np.float64, count, 8 * begin)
    if not column.null_count or known is None:
        return values
    bits = np.unpackbits(np.frombuffer(known, np.uint8), bitorder="little", count=begin + count)
    return np.where(bits[begin:] == 1, values, np.nan)
