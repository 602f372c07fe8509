"""The recording: signals, impacts and metadata of a measurement, a lumped model or the 3D engine; its key numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d import signals
from gears3d.errors import Fault, InputError, UsageError
from gears3d.extras import require
from gears3d.recording.columns import FLANKS, Derived, Table, impact_table, plain, signal_table, unit_of
from gears3d.results import Result

if TYPE_CHECKING:
    import pandas
    import xarray


# Package that segments the angles of a user's own model; loaded by name, as it stands above recordings
OWN_MODELS = "gears3d.comparison.own_model"


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Result):
    """Signals on a time axis, a table of impacts, and what is known about both.

    Args:
        signals: ``time_s``, ``theta_drive_rad``, ``theta_loose_rad`` and, where known, ``omega_drive_rad_s``,
            ``omega_loose_rad_s``, ``displacement_m``, ``velocity_m_s``, each (n,); other columns are kept.
        impacts: ``time_s``, ``flank`` (0 active, 1 reverse), ``velocity_m_s`` and, where known, ``rebound_m_s``,
            ``impulse_N_s``, ``phase_rad``, ``tooth_drive``, ``tooth_loose``, ``flight_height_m``, each (k,).
            Unknown columns become NaN (teeth 0); nothing at all is a table of no impacts.
        meta: what JSON can hold: model, title, version, ``period_s``, ``settle_s`` ... With ``base_radius_drive_m``
            and ``base_radius_loose_m`` a missing displacement is worked out.

    Raises:
        InputError: columns are missing, differ in length, are not finite or not in order of time.
        TypeError: ``meta`` holds what JSON cannot.

    >>> record = Recording({"time_s": [0, 1], "theta_drive_rad": [0, 3], "theta_loose_rad": [0, 3]})
    >>> record
    Recording(2 samples of 0..1 s, 0 impacts)
    """

    signals: Mapping[str, np.ndarray]
    impacts: Table = field(default_factory=dict)
    meta: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        meta = plain(dict(self.meta))
        signals: Mapping[str, np.ndarray] = self.signals
        if not isinstance(signals, Derived):
            signals = signal_table(signals)
        radii = [meta.get(f"base_radius_{gear}_m") for gear in ("drive", "loose")]
        if "displacement_m" not in signals and all(isinstance(radius, float) for radius in radii):
            drive, loose = (signals[f"theta_{gear}_rad"] for gear in ("drive", "loose"))
            signals = signal_table({**signals, "displacement_m": radii[1] * loose - radii[0] * drive})
        object.__setattr__(self, "signals", signals)
        object.__setattr__(self, "impacts", impact_table(self.impacts))
        object.__setattr__(self, "meta", meta)

    @classmethod
    def from_angles(cls, time: Any, theta_drive: Any, theta_loose: Any, rig: Any) -> Recording:
        """Return the recording of a user's own model, with the impacts and contacts that its angles show.

        Args:
            time: evenly spaced from 0 on [s], (n,).
            theta_drive: angle of the drive gear [rad], (n,).
            theta_loose: angle of the loose gear [rad], its datum anywhere, (n,).
            rig: scenario of the rig, or its file or name.

        Raises:
            InputError: times are not even, or columns differ in length or are not finite.
        """
        return import_module(OWN_MODELS).from_angles(time, theta_drive, theta_loose, rig)

    @classmethod
    def from_displacement(cls, time: Any, displacement: Any, rig: Any) -> Recording:
        """Return the recording of a user's own model that has the displacement as its only degree of freedom.

        Args:
            time: evenly spaced from 0 on [s]; the drive moves as the scenario states, (n,).
            displacement: Rb2·θ_loose − Rb1·θ_drive [m], 0 on the active and the backlash on the reverse flank, (n,).
            rig: scenario of the rig, or its file or name.

        Raises:
            InputError: as for :meth:`from_angles`.
        """
        return import_module(OWN_MODELS).from_displacement(time, displacement, rig)

    @property
    def time(self) -> np.ndarray:
        """Time of the samples [s], (n,)."""
        return self.signals["time_s"]

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Recording):
            return NotImplemented
        return self.meta == other.meta and _same(self.signals, other.signals) and _same(self.impacts, other.impacts)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        time = self.time
        span = f"{len(time)} samples" + (f" of {time[0]:.6g}..{time[-1]:.6g} s" if len(time) else "")
        flank = self.impacts["flank"]
        counts = [f"{np.count_nonzero(flank == code)} {name}" for code, name in enumerate(FLANKS)]
        impacts = f"{len(flank)} impacts" + (f" ({', '.join(counts)})" if len(flank) else "")
        about = [str(self.meta[key]) for key in ("title", "model") if self.meta.get(key)]
        return f"Recording({', '.join([*map(repr, about), span, impacts])})"

    def _repr_html_(self) -> str:
        from gears3d import notebook

        rows = [("model", str(self.meta.get("model") or "")), ("samples", f"{len(self.time)}")]
        if len(self.time):
            rows.append(("time", f"{self.time[0]:.6g} to {self.time[-1]:.6g} s"))
        flank = self.impacts["flank"]
        rows += [(f"impacts, {name} flank", f"{np.count_nonzero(flank == code)}") for code, name in enumerate(FLANKS)]
        return notebook.table(str(self.meta.get("title") or "Recording"), [*rows, *described(self)])

    def between(self, start: float, end: float) -> Recording:
        """Return the part from ``start`` to ``end``, both included.

        Args:
            start: time [s].
            end: time [s].

        Raises:
            UsageError: ``end`` lies before ``start``.

        >>> record = Recording({"time_s": [0, 1, 2], "theta_drive_rad": [0, 3, 6], "theta_loose_rad": [0, 3, 6]})
        >>> record.between(0.5, 2).time.tolist()
        [1.0, 2.0]
        """
        if not start <= end:
            raise UsageError(f"between({start!r}, {end!r}): the end lies before the start")

        def cut(table: Mapping[str, np.ndarray]) -> Table:
            first = np.searchsorted(table["time_s"], start, "left")
            last = np.searchsorted(table["time_s"], end, "right")
            return {name: values[first:last] for name, values in table.items()}

        return Recording(cut(self.signals), cut(self.impacts), self.meta)

    def with_base_radii(self, drive: float, loose: float) -> Recording:
        """Return the recording with its displacement, s = Rb2·θ_loose − Rb1·θ_drive, where that was missing.

        Args:
            drive: base radius of the drive gear [m].
            loose: base radius of the loose gear [m].

        >>> record = Recording({"time_s": [0, 1], "theta_drive_rad": [0, 3], "theta_loose_rad": [0, 3.5]})
        >>> record.with_base_radii(0.1, 0.1).signals["displacement_m"].round(6).tolist()
        [0.0, 0.05]
        """
        radii = {"base_radius_drive_m": float(drive), "base_radius_loose_m": float(loose)}
        return Recording(self.signals, self.impacts, {**self.meta, **radii})

    def write(self, path: str | Path) -> Path:
        """Write the recording under a temporary name and rename it.

        Args:
            path: a folder, which gets ``signals.parquet`` and ``impacts.parquet``; or a ``.parquet`` or ``.csv``
                file for a record without impacts.

        Returns:
            The path.

        Raises:
            InputError: it cannot be written.
            UsageError: a single file is asked for a recording that has impacts.
        """
        from gears3d.recording.files import write

        return write(Path(path), self.signals, self.impacts, self.meta)

    def to_pandas(self) -> tuple[pandas.DataFrame, pandas.DataFrame]:
        """Return signals and impacts as pandas tables; ``flank`` is categorical text, units are in ``attrs``.

        Raises:
            UsageError: pandas is not installed.
        """
        pandas = require("pandas", "a recording as tables", "tables")

        def frame(table: Mapping[str, np.ndarray]) -> Any:
            columns: dict[str, Any] = dict(table)
            if "flank" in columns:
                columns["flank"] = pandas.Categorical.from_codes(columns["flank"], categories=list(FLANKS))
            made = pandas.DataFrame(columns)
            made.attrs = {"units": {name: unit_of(name) for name in table}, "meta": self.meta}
            return made

        return frame(self.signals), frame(self.impacts)

    def to_xarray(self) -> xarray.Dataset:
        """Return one dataset: signals over ``time_s``, impacts over ``impact`` with names that begin ``impact_``.

        Raises:
            UsageError: xarray is not installed.
        """
        xarray = require("xarray", "a recording as a dataset", "tables")
        variables: dict[str, Any] = {
            name: ("time_s", values, {"units": unit_of(name)})
            for name, values in self.signals.items()
            if name != "time_s"
        }
        for name, values in self.impacts.items():
            shown = np.array(FLANKS)[values] if name == "flank" else values
            variables[f"impact_{name}"] = ("impact", shown, {"units": unit_of(name)})
        time = ("time_s", self.time, {"units": "s"})
        return xarray.Dataset(variables, coords={"time_s": time}, attrs=self.meta)


def _same(one: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]) -> bool:
    return one.keys() == other.keys() and all(
        np.array_equal(values, other[name], equal_nan=values.dtype.kind == "f") for name, values in one.items()
    )


def read(path: str | Path) -> Recording:
    """Read a recording: a folder of one, a Parquet or a CSV record.

    Args:
        path: a folder with ``signals.parquet`` (and ``impacts.parquet``), or a file with the columns ``time_s``,
            ``theta_drive_rad``, ``theta_loose_rad``.

    Returns:
        The recording.

    Raises:
        InputError: it is not there, or not a recording; names file, column and row.
    """
    from gears3d.recording.files import tables_of

    return Recording(*tables_of(Path(path)))


def describe(recording: Recording) -> dict[str, Any]:
    """Return regime, motion, speeds, energies and durations of a recording of any source, after its settling time.

    Args:
        recording: of a model, or measured, with impacts. The more its ``meta`` says (``period_s``, ``settle_s``,
            ``contacts``, ``inertia_kg_m2`` ...), the more numbers there are.

    Returns:
        What :func:`gears3d.signals.describe` returns: plain values by name, ``None`` for what is not known.

    Raises:
        InputError: flights and contact do not explain the motion of the measured record.

    >>> impacts = {"time_s": [0.5], "flank": ["active"], "velocity_m_s": [-0.02]}
    >>> angles = {"time_s": [0, 1], "theta_drive_rad": [0, 3], "theta_loose_rad": [0, 3]}
    >>> describe(Recording(angles, impacts))["regime"]
    'single_sided'
    """
    refuse_unexplained(recording)
    return signals.describe(recording.signals, recording.impacts, recording.meta)


def refuse_unexplained(recording: Recording, file: str = "") -> None:
    """Refuse a measured record whose motion flights and contact do not explain: its impacts mean nothing.

    Args:
        recording: of any source.
        file: named in the fault.

    Raises:
        InputError: the record is such a one.
    """
    if reason := recording.meta.get("unexplained"):
        raise InputError(Fault("", f"has no impacts: the loose gear {reason}", "see `gears3d segment`", file))


def described(recording: Recording) -> list[tuple[str, str]]:
    """Return the numbers that a reader asks for first, name and value; nothing without impacts."""
    if not len(recording.impacts["time_s"]):
        return []
    found = describe(recording)

    def scaled(key: str, factor: float, unit: str) -> str:
        return "" if found.get(key) is None else f"{factor * found[key]:.4g} {unit}".strip()

    return [
        ("regime", " ".join(str(found[key]).replace("_", " ") for key in ("regime", "motion") if found.get(key))),
        ("impacts a period", scaled("impacts_per_period", 1.0, "")),
        ("mean speed, active flank", scaled("active_velocity_mean_m_s", 1e3, "mm/s")),
        ("mean speed, reverse flank", scaled("reverse_velocity_mean_m_s", 1e3, "mm/s")),
        ("longest flight", scaled("flight_longest_s", 1e3, "ms")),
    ]


def settled(recording: Recording) -> Recording:
    """Return the part of a recording after its settling time, cut to whole periods of the excitation if it has one.

    Args:
        recording: with ``settle_s`` and ``period_s`` in its ``meta`` as far as known.
    """
    start, end = signals.window(recording.signals, recording.meta)
    period = recording.meta.get("period_s")
    count = int((end - start) / period + 1e-9) if period else 0
    if count >= 1 and len(recording.time) > 1:
        start = end - count * float(period or 0.0) + 0.5 * float(recording.time[1] - recording.time[0])
    return recording.between(start, end)


def spectra(recording: Recording) -> dict[str, signals.Spectrum | None]:
    """Return the amplitude spectra of the displacement after settling, over frequency and over both gears' orders.

    Args:
        recording: with a displacement.

    Returns:
        By ``"frequency"``, ``"order_drive"``, ``"order_loose"``; ``None`` where there are too few samples or
        revolutions, or a gear turns back.
    """
    part = settled(recording)
    if "displacement_m" not in part.signals:
        return dict.fromkeys(("frequency", "order_drive", "order_loose"))
    place = part.signals["displacement_m"]
    found: dict[str, signals.Spectrum | None] = {}
    for name in ("frequency", "order_drive", "order_loose"):
        try:
            if name == "frequency":
                found[name] = signals.frequency_spectrum(part.time, place)
            else:
                angle = part.signals[name.replace("order", "theta") + "_rad"]
                found[name] = signals.order_spectrum(angle, place)
        except UsageError:
            found[name] = None
    return found
