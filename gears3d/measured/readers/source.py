"""A file that was opened: which signals it has, how to load some of them; optional libraries of the formats."""

from __future__ import annotations

import logging
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gears3d.errors import Fault, GearsError, InputError, did_you_mean
from gears3d.extras import EXTRAS, require
from gears3d.inputs import refuse_beyond

_OWN = ("hdf5", "matlab", "tdms", "mdf", "uff")
# The extra that installs a library and nothing else.
_ALONE = {next(iter(one.libraries)): name for name, one in EXTRAS.items() if name in _OWN}
# Signals that a fault lists.
SHOWN = 24
# Whole numbers from which on float64 does not hold every one.
LONG = 2**53
_BRACKETS = {"]": "[", ")": "("}
_INSIDE = re.compile(r"\[([^\[\]]{1,12})\]")
# Length of a name up to which a unit is looked for in it.
LONGEST = 200


def library(module: str, path: Path, otherwise: str = "") -> Any:
    """Return an optional library.

    Raises MissingExtraError, with the command that installs it, when it is not installed.

    >>> library("numpy", Path("a.npy")).__name__
    'numpy'
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return require(module, "this format", _ALONE.get(module, "formats"), file=str(path), otherwise=otherwise)


@contextmanager
def reading(path: Path, form: str) -> Iterator[None]:
    """Convert every exception of a library on a damaged file to an InputError.

    Damaged files make the libraries raise errors of every kind, so all are caught; the block must hold nothing but
    calls of the library.

    Raises InputError when the library raised anything.

    >>> with reading(Path("a.mat"), "MATLAB"):
    ...     raise IndexError("index 7 out of range")
    Traceback (most recent call last):
    gears3d.errors.InputError: a.mat: cannot be read as MATLAB: index 7 out of range (damaged or cut off: export again)
    """
    quiet = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except GearsError:
        raise
    except MemoryError as error:
        what = f"does not fit into memory, or is damaged: {form} asks for too much"
        raise InputError(Fault("", what, "name fewer channels, or export it again", str(path))) from error
    except Exception as error:
        why = " ".join(str(error).split())[:200] or type(error).__name__
        remedy = "damaged or cut off: export again"
        raise InputError(Fault("", f"cannot be read as {form}: {why}", remedy, str(path))) from error
    finally:
        logging.disable(quiet)


@dataclass(frozen=True)
class Signal:
    """One channel as the file has it.

    Args:
        name: with its group, ``"Rig/phi1"``; unique in the file.
        unit: as the file tells it, empty where it does not.
        rows: number of samples, where known without reading.
        clock: start and step [s] of even sampling, where the file declares it.
        axis: name of the signal that is its time, where the file declares it.
        numeric: whether it holds numbers.
    """

    name: str
    unit: str = ""
    rows: int | None = None
    clock: tuple[float, float] | None = None
    axis: str = ""
    numeric: bool = True

    @property
    def bare(self) -> str:
        """Name without its group and without a unit in brackets.

        >>> Signal("Rig/phi1 [deg]").bare
        'phi1'
        """
        return split_unit(self.name.rpartition("/")[2])[0] if "/" in split_unit(self.name)[0] else self.label

    @property
    def label(self) -> str:
        """Name with its group, without a unit in brackets."""
        return split_unit(self.name)[0]

    @property
    def told_unit(self) -> str:
        """The unit that the file states, or that follows the name in brackets.

        >>> Signal("n1 [1/min]").told_unit, Signal("t", "ms").told_unit
        ('1/min', 'ms')
        """
        return self.unit or split_unit(self.name)[1]


class Remark(NamedTuple):
    """Something about the rows of a file that the gate reports.

    Args:
        kind: one word with hyphens: ``"torn-rows"``.
        size: number of rows or cells.
        text: one sentence.
    """

    kind: str
    size: float
    text: str


@dataclass(frozen=True, eq=False)
class Source:
    """An opened file.

    Args:
        file: its name.
        form: name of the format.
        signals: what it has.
        load: takes names of signals and a largest number of rows (``None``: all), returns float64 arrays.
        meta: what it tells besides.
        notes: lines or properties that people wrote into it.
        gaps: indices of rows of NaN in place of damaged ones, known once signals were loaded.
        remarks: on damaged rows, known once signals were loaded.
    """

    file: str
    form: str
    signals: tuple[Signal, ...]
    load: Callable[[Sequence[str], int | None], dict[str, np.ndarray]]
    meta: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    gaps: list[int] = field(default_factory=list)
    remarks: list[Remark] = field(default_factory=list)

    def find(self, name: str, group: str = "", key: str = "") -> Signal:
        """Return the signal of a name.

        Args:
            name: with or without its group and unit; ``"column 3"`` counts from one in a file without names.
            group: where to look first.
            key: of the map, named in the fault.

        Raises:
            InputError: no or several signals have the name, or it holds no numbers; lists the signals.
        """
        signals = [each for each in self.signals if not group or each.name.startswith(group + "/")]
        if group and not signals:
            groups = sorted({each.name.rpartition("/")[0] for each in self.signals})
            raise InputError(Fault("group", f"{group!r} is not in the file", did_you_mean(group, groups), self.file))
        tests: tuple[Callable[[Signal], bool], ...] = (
            lambda each: each.name in (name, f"{group}/{name}"),
            lambda each: each.label in (name, f"{group}/{name}"),
            lambda each: each.name.rpartition("/")[2] == name,
            lambda each: each.bare == name,
            lambda each: each.name.replace("/", ".") == name,
        )
        for test in tests:
            found = [each for each in signals if test(each)]
            if len(found) == 1:
                break
            if found:
                names = ", ".join(repr(each.name) for each in found[:SHOWN])
                what = f"{name!r} is the name of several signals: {names}"
                raise InputError(Fault(key, what, "write the group, too", self.file))
        else:
            near = did_you_mean(name, [each.name for each in signals] + [each.bare for each in signals])
            near = near if near.startswith("did") else self.listing()
            raise InputError(Fault(key, f"{name!r} is not in the file", near, self.file))
        if not found[0].numeric:
            raise InputError(Fault(key, f"{name!r} holds no numbers", self.listing(), self.file))
        return found[0]

    def remarked(self, meta: dict[str, Any]) -> None:
        """Put the remarks of the last loading into the metadata of a record, where the gate finds them.

        Args:
            meta: gets entries in ``decoded``.
        """
        own = [each._asdict() | {"channel": "", "unit": "1", "harmless": False} for each in self.remarks]
        if own:
            meta["decoded"] = [*meta.get("decoded", []), *own]

    def without_gaps(self, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return columns without the rows that were damaged.

        Args:
            columns: as they were loaded, (n,).
        """
        return {name: np.delete(values, self.gaps) for name, values in columns.items()} if self.gaps else columns

    def listing(self) -> str:
        """Return one clause with what the file has."""
        told = [f"{each.name} [{each.unit}]" if each.unit else each.name for each in self.signals if each.numeric]
        more = f" and {len(told) - SHOWN} more" if len(told) > SHOWN else ""
        return "it has: " + (", ".join(told[:SHOWN]) + more if told else "no numbers")


def split_unit(name: str) -> tuple[str, str]:
    """Return a signal's name and its unit, separated.

    ``name``: ``"phi [deg]"``, ``"phi (deg)"``, ``"n in rpm"``, ``"n / rpm"``.

    >>> split_unit("Winkel 1 [deg]"), split_unit("n / rpm"), split_unit("theta_drive_rad")
    (('Winkel 1', 'deg'), ('n', 'rpm'), ('theta_drive_rad', ''))
    >>> split_unit("pos (3)"), split_unit("t (s) (2)")  # a number in brackets counts channels
    (('pos (3)', ''), ('t (2)', 's'))
    """
    text = name.strip()
    opening = _BRACKETS.get(text[-1:])
    if len(text) > LONGEST:
        return text, ""
    if opening is not None:
        before, found, unit = text[:-1].rpartition(opening)
        whole = found and before.strip() and not set(unit) & {opening, text[-1]}
        if whole and unit.strip().isdecimal():
            name, own = split_unit(before)
            return f"{name} {opening}{unit}{text[-1]}", own
        return (before.strip(), unit.strip()) if whole else (text, "")
    inside = _INSIDE.search(text)
    if inside is not None and inside.start() > 0:
        return f"{text[: inside.start()]}{text[inside.end() :]}".strip(), inside[1].strip()
    words = text.split()
    at = next((k for k in range(1, len(words) - 1) if words[k] in ("/", "in")), None)
    return (text, "") if at is None else (" ".join(words[:at]), " ".join(words[at + 1 :]))


def unique(names: Sequence[str]) -> list[str]:
    """Return names of which none occurs twice.

    >>> unique(["t", "n", "n"])
    ['t', 'n', 'n (2)']
    """
    seen: dict[str, int] = {}
    taken = set(names)
    given = []
    for name in names:
        seen[name] = seen.get(name, 0) + 1
        own = name
        while seen[name] > 1 and (own := f"{name} ({seen[name]})") in taken:
            seen[name] += 1
        taken.add(own)
        given.append(own)
    return given


def refuse_large(file: str | Path, rows: Iterable[int], more: float = 0.0) -> None:
    """Refuse signals that take more memory than allowed or declare an impossible number of samples."""
    counts = list(rows)
    if min(counts, default=0) < 0:
        raise InputError(Fault("", f"declares {min(counts)} samples", "damaged: export again", str(file)))
    refuse_beyond(8.0 * sum(counts) + more, file, f"{len(counts)} of its signals", "name fewer channels, cut the file")


class Whole:
    """Turns columns of one file into float64; whole numbers too long for that become distances from a common origin.

    Epochs in nanoseconds have 19 digits, float64 holds 16. The origin is the first reading of the first such column,
    for all columns that are that near to it: stamps of both gears stay on one axis of time.
    """

    def __init__(self) -> None:
        self._origins: list[int] = []
        self._own: dict[str, int | None] = {}

    def floats(self, name: str, values: np.ndarray) -> np.ndarray:
        """Return the next values of a column, float64, (n,).

        ``values``: numbers of any type, (n,).

        >>> Whole().floats("t", np.array([1_700_000_000_000_000_000, 1_700_000_000_000_000_040])).tolist()
        [0.0, 40.0]
        """
        if values.dtype.kind not in "iu" or values.dtype.itemsize < 8 or not len(values):
            return values.astype(np.float64)
        if name not in self._own:
            first = int(values[0])
            near = [one for one in self._origins if abs(first - one) < LONG]
            if abs(first) >= LONG and not near:
                self._origins.append(first)
                near = [first]
            self._own[name] = near[0] if abs(first) >= LONG else None
        origin = self._own[name]
        if origin is None:
            return values.astype(np.float64)
        return (values.astype(np.int64) - np.array(origin).astype(np.int64)).astype(np.float64)


def seconds(times: np.ndarray) -> np.ndarray:
    """Return dates as seconds since the first one.

    ``times``: datetime64, (n,).

    >>> seconds(np.array(["2026-01-01T00:00:00.000", "2026-01-01T00:00:00.250"], "datetime64[us]")).tolist()
    [0.0, 0.25]
    """
    stamps = times.astype("datetime64[ns]")
    missing = np.isnat(stamps)
    known = np.flatnonzero(~missing)
    first = stamps[known[0]] if known.size else np.datetime64(0, "ns")
    return np.where(missing, np.nan, 1e-9 * (stamps - first).astype(np.int64))
