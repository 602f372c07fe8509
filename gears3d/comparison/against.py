"""Two recordings, or their places, compared with each other."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np

from gears3d.comparison.distribution import compare_distributions
from gears3d.comparison.matching import Table, compare_trajectories
from gears3d.comparison.result import Comparison, Mode
from gears3d.errors import InputError, UsageError, did_you_mean
from gears3d.recording import Recording, read, refuse_unexplained
from gears3d.signals import FLIGHT_HEIGHT_MIN, regime, window

SAME_WITHIN = 1e-9  # Relative difference of rig values that is rounding


def compare(
    a: Recording | str | Path,
    b: Recording | str | Path,
    mode: str | None = None,
    flight_height_min: float = FLIGHT_HEIGHT_MIN,
) -> Comparison:
    """Hold a recording against a reference.

    Args:
        a: the recording under test, or its folder or file.
        b: the reference, or its folder or file.
        mode: ``"trajectory"`` or ``"distribution"``; when not given, by the reference's largest Lyapunov exponent
            (``meta["lyapunov_1_s"]``), never by the result: above 0 distribution, otherwise or unknown trajectory.
        flight_height_min: impacts count after flights higher than this [m].

    Returns:
        What the comparison comes to; errors are relative to the reference, settling times are left out.

    Raises:
        InputError: a recording cannot be read, is not explained by flights and contact, or both have no time in common.
        UsageError: the mode is not known, or what is compared is neither recording nor path.

    >>> rest = Recording({"time_s": [0, 1], "theta_drive_rad": [0, 3], "theta_loose_rad": [0, 3]})
    >>> compare(rest, rest).regime_equal
    True
    """
    tested, reference = (_opened(one) for one in (a, b))
    for recording, name in ((tested, a), (reference, b)):
        refuse_unexplained(recording, str(name) if isinstance(name, str | Path) else "")
    mode = mode or mode_of(reference)
    if mode not in get_args(Mode):
        raise UsageError(f"there is no mode {mode!r}; {did_you_mean(mode, get_args(Mode))}")
    period = period_of(reference, tested)
    windows = [window(one.signals, one.meta) for one in (tested, reference)]
    if mode == "trajectory":
        windows = [_common(windows)] * 2
    counting = [
        _within(one.impacts, *w, flight_height_min) for one, w in zip((tested, reference), windows, strict=True)
    ]
    if mode == "trajectory":
        fields = compare_trajectories(tested.impacts, reference.impacts, period, *windows[1], flight_height_min)
    else:
        lyapunov = float(reference.meta.get("lyapunov_1_s") or 0.0)
        fields = compare_distributions((counting[0], counting[1]), (windows[0], windows[1]), period, lyapunov)
    regimes = [regime(hits["time_s"], hits["flank"], period, *w) for hits, w in zip(counting, windows, strict=True)]
    return Comparison(
        flight_height_min_m=flight_height_min,
        regime_equal=regimes[0] == regimes[1],
        mode=cast(Mode, mode),
        regimes=(regimes[0], regimes[1]),
        window_s=windows[1],
        notes=(*differences(tested, reference), *fields.pop("notes", ())),
        tested=tested,
        reference=reference,
        **fields,
    )


def _opened(one: Any) -> Recording:
    if isinstance(one, Recording):
        return one
    if isinstance(one, str | PathLike):
        return read(Path(one))
    what = f"{one!r} is a {type(one).__name__}"
    raise UsageError(f"compare: {what}, no recording: give what simulate() returned, or the path of a run folder")


def mode_of(reference: Recording) -> Mode:
    """Return how to compare with a reference, by the sign of its largest Lyapunov exponent."""
    return "distribution" if (reference.meta.get("lyapunov_1_s") or 0.0) > 0.0 else "trajectory"


def period_of(*recordings: Recording) -> float:
    """Return the period of the excitation [s]: the first known one, else the mean time between impacts on a flank."""
    for one in recordings:
        if one.meta.get("period_s"):
            return float(one.meta["period_s"])
    time, flank = recordings[0].impacts["time_s"], recordings[0].impacts["flank"]
    span = window(recordings[0].signals, {})
    changes = np.count_nonzero(np.diff(flank)) if len(time) > 1 else 0
    return max(span[1] - span[0], 1e-12) / max(changes / 2, 1.0)


def differences(a: Recording, b: Recording) -> tuple[str, ...]:
    """Return in which of the rig's values two recordings differ, a sentence each.

    >>> rest = {"time_s": [0, 1], "theta_drive_rad": [0, 3], "theta_loose_rad": [0, 3]}
    >>> differences(Recording(rest, {}, {"period_s": 1.0}), Recording(rest, {}, {"period_s": 2.0}))
    ('different scenarios: period_s is 1.0 and 2.0',)
    """
    keys = ("title", "period_s", "backlash_m", "base_radius_drive_m", "base_radius_loose_m", "effects", "seed")
    found = []
    for key in keys:
        one, other = a.meta.get(key), b.meta.get(key)
        if one is not None and other is not None and not _alike(one, other):
            found.append(f"different scenarios: {key} is {one!r} and {other!r}")
    return tuple(found)


def _alike(one: Any, other: Any) -> bool:
    if isinstance(one, float) and isinstance(other, float | int):
        return abs(one - other) <= SAME_WITHIN * max(abs(one), abs(other))
    return one == other


def _common(windows: list[tuple[float, float]]) -> tuple[float, float]:
    begin, end = max(w[0] for w in windows), min(w[1] for w in windows)
    if end < begin:
        spans = " and ".join(f"{w[0]:.6g}..{w[1]:.6g} s" for w in windows)
        raise InputError(f"after settling the recordings have no time in common: {spans}")
    return begin, end


def _within(impacts: Table, begin: float, end: float, least_height: float) -> Table:
    time = impacts["time_s"]
    kept = (time >= begin) & (time <= end) & ~(impacts["flight_height_m"] <= least_height)
    return {name: values[kept] for name, values in impacts.items()}
