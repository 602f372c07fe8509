"""A user's own lumped model as a recording: its angles or its displacement, segmented like a measured record."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.measured.readers import read as read_channels
from gears3d.measured.segmentation import measure
from gears3d.recording import Recording, columns_of, read
from gears3d.scenario import Scenario, load
from gears3d.simulation import simulate

EVEN = 0.2  # Part of the sampling period by which steps of time may differ
FEWEST = 100  # Samples at least
TABLES = (".csv", ".txt", ".parquet")  # Endings of files whose columns may have any names
PARTS = (2, 4)  # Parts that a motion is cut into where it is not explained as a whole
OWN = "own"  # Model of the recordings that are made here


def from_angles(time: Any, theta_drive: Any, theta_loose: Any, rig: Scenario | str | Path) -> Recording:
    """Return the recording of a user's model, with the impacts and contacts that its angles show."""
    scenario = rig if isinstance(rig, Scenario) else load(rig)
    columns = _columns(time_s=time, theta_drive_rad=theta_drive, theta_loose_rad=theta_loose)
    try:
        found = measure(Recording(columns), scenario, stated_motion=True).recording
    except InputError as error:  # what no record of a rig may be, a model may
        known = scenario.rig()
        found = Recording(columns).with_base_radii(known.base_radius_drive, known.base_radius_loose)
        found = Recording(found.signals, {}, {**found.meta, "unexplained": error.faults[0].message})
    meta = {**found.meta, "model": OWN, "settle_s": min(scenario.run.settle, 0.5 * float(columns["time_s"][-1]))}
    return Recording(found.signals, found.impacts, meta)


def from_displacement(time: Any, displacement: Any, rig: Scenario | str | Path) -> Recording:
    """Return the recording of a user's model that has the displacement as its only degree of freedom."""
    scenario = rig if isinstance(rig, Scenario) else load(rig)
    columns = _columns(time_s=time, displacement_m=displacement)
    drive, known = drive_angle(scenario, columns["time_s"]), scenario.rig()
    loose = (columns["displacement_m"] + known.base_radius_drive * drive) / known.base_radius_loose
    return from_angles(columns["time_s"], drive, loose, scenario)


def read_own(
    path: Path, scenario: Scenario, map_file: Path | None = None, names: Mapping[str, str] | None = None
) -> Recording:
    """Read the result of a user's own model: a table of time with both angles or with the displacement."""
    columns: Mapping[str, np.ndarray]
    if path.is_dir():
        columns = read(path).signals
    elif map_file is None and path.suffix.lower() in TABLES:
        columns = _renamed(columns_of(path), names or {}, path)
    else:
        columns = read_channels(path, map_file).columns
    time = columns.get("time_s")
    if time is not None and {"theta_drive_rad", "theta_loose_rad"} <= columns.keys():
        return from_angles(time, columns["theta_drive_rad"], columns["theta_loose_rad"], scenario)
    if time is not None and "displacement_m" in columns:
        return from_displacement(time, columns["displacement_m"], scenario)
    what = "needs time_s with theta_drive_rad and theta_loose_rad, or with displacement_m"
    remedy = f"rename them with --column displacement_m=NAME; it has {', '.join(columns) or 'none'}"
    raise InputError(Fault("", what, remedy, str(path)))


def _renamed(columns: Mapping[str, np.ndarray], names: Mapping[str, str], path: Path) -> dict[str, np.ndarray]:
    missing = [
        Fault(f"--column {name}", f"there is no column {own!r}", did_you_mean(own, [*columns]), str(path))
        for name, own in names.items()
        if own not in columns
    ]
    if missing:
        raise InputError(missing)
    return {**columns, **{name: columns[own] for name, own in names.items()}}


def reference(scenario: Scenario, time: np.ndarray) -> Recording:
    """Return the scenario in the rigid model, sampled as often and as long as a user's model."""
    rate = 1.0 / float(np.median(np.diff(time)))
    spanned = scenario.with_(
        {"run.duration": f"{float(time[-1])!r} s", "run.settle": "0 s", "run.output_rate": f"{rate!r} Hz"}
    )
    return simulate(spanned, "rigid")


def explained_part(recording: Recording, scenario: Scenario) -> Recording:
    """Return the longest part of a recording that flights and contact explain: the whole, a half or 25 % of it.

    Many low bounces at once can keep a whole motion from being explained; its laws show in any part.
    """
    if "unexplained" not in recording.meta:
        return recording
    columns = [recording.signals[name] for name in ("time_s", "theta_drive_rad", "theta_loose_rad")]
    for parts in PARTS:
        size = len(recording.time) // parts
        for first in range(0, parts * size, size):
            if size < FEWEST:
                continue
            time, drive, loose = (column[first : first + size] for column in columns)
            made = from_angles(time, drive, loose, scenario)
            if "unexplained" not in made.meta:
                return made
    return recording


def drive_angle(scenario: Scenario, time: np.ndarray) -> np.ndarray:
    """Return the angle of the drive gear that a scenario states [rad], (n,)."""
    from scipy.interpolate import CubicSpline

    made = reference(scenario, time)
    angle = made.signals["theta_drive_rad"]
    if len(made.time) >= len(time) and np.allclose(made.time[: len(time)], time, rtol=0.0, atol=1e-12):
        return angle[: len(time)]
    return CubicSpline(made.time, angle)(time)


def _columns(**given: Any) -> dict[str, np.ndarray]:
    """Return columns of equal length, finite, with even times."""
    columns = {name: np.asarray(values, dtype=float).ravel() for name, values in given.items()}
    time = columns["time_s"]
    faults = [
        Fault(name, f"has {len(values)} values, time_s has {len(time)}", "give one value per time")
        for name, values in columns.items()
        if len(values) != len(time)
    ]
    faults += [
        Fault(name, f"is not finite at {np.count_nonzero(~np.isfinite(values))} of {len(values)} values", "repair it")
        for name, values in columns.items()
        if not np.isfinite(values).all()
    ]
    if faults:
        raise InputError(faults)
    if len(time) < FEWEST:
        raise InputError(Fault("time_s", f"has {len(time)} values", f"give {FEWEST} or more, some periods of motion"))
    steps = np.diff(time)
    usual = float(np.median(steps))
    if usual <= 0.0 or np.abs(steps - usual).max() > EVEN * usual:
        remedy = "sample the solution evenly, e.g. solve_ivp(..., t_eval=numpy.linspace(0, T, n))"
        raise InputError(Fault("time_s", "is not evenly spaced", remedy))
    if time[0] < -0.5 * usual:
        raise InputError(Fault("time_s", f"begins at {time[0]:.6g} s", "the motion of the scenario begins at 0 s"))
    return columns
