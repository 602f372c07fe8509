"""The columns of a recording: names, units, and what makes a table of them valid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError, did_you_mean

ACTIVE = 0
REVERSE = 1
FLANKS = ("active", "reverse")
"""Names of the flanks, in the order of their codes."""

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

    Args:
        columns: values by name, each of shape (n,); those of the contract must be finite, others may hold NaN.
        file: named in the faults.

    Returns:
        The columns as float64, those of the contract first.

    Raises:
        InputError: a column is missing, has another length or type, is not finite, or time does not increase.

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

    Args:
        columns: values by name, each of shape (k,); ``flank`` as 0 and 1 or as text. Columns of the contract that
            are not known may be left out: they become NaN, teeth 0. Nothing at all is a table of no impacts.
        file: named in the faults.

    Returns:
        The columns, those of the contract first and all there; ``flank`` int8, teeth int32, the rest float64.

    Raises:
        InputError: a column is missing, has another length or type, or holds what cannot be; times do not ascend.

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

    Args:
        values: ``"active"`` and ``"reverse"``, or 0 and 1, shape (k,).
        file: named in the fault.

    Raises:
        InputError: a value is neither.

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
            faults.append(Fault(f"{table}.{name}[{bad[0]}]", f"is {value}{more}", "cut or mend the rows", file))
    if faults:
        raise InputError(faults)


def _refuse_disorder(time: np.ndarray, strictly: bool, table: str, file: str) -> None:
    bad = np.flatnonzero(time[1:] <= time[:-1] if strictly else time[1:] < time[:-1])
    if bad.size:
        row = int(bad[0]) + 1
        what = f"is {float(time[row])!r} s after {float(time[row - 1])!r} s"
        raise InputError(Fault(f"{table}.time_s[{row}]", what, "time must increase from row to row", file))
