"""A measured record as a recording with impacts, and its quality."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.checks import admit
from gears3d.measured.drive_motion import DriveMotion, drive_motion, of_period
from gears3d.measured.encoder import usual
from gears3d.measured.segmentation.displacement import Blocks, Shape, Track, track
from gears3d.measured.segmentation.flights import clearance
from gears3d.measured.segmentation.orders import Contact, resolved, strongest
from gears3d.measured.segmentation.results import (
    Measurement,
    NotExplained,
    Segments,
    backlash_sigma,
    explain,
    orders_in_step,
    place_slack,
    refuse,
)
from gears3d.measured.segmentation.segments import DOUBTFUL, doubtful, segment, unsegmented
from gears3d.recording import FLANKS, SIGNAL_UNITS, Recording, describe
from gears3d.recording.columns import Derived, part_of
from gears3d.scenario import Scenario, load
from gears3d.signals import changes, some_steps
from gears3d.signals.orders import deviations, phasors_of

# Rows from which columns of the recording are computed on access.
LONG = 1 << 20
# Keys of the summary of a record that is not explained; the rest is null.
KEPT = {"format", "status", "warnings", "quality", "flanks", "cut", "contacts_seen"}
# Blocks in which orders are searched, and orders reported, of such a record.
VISIBLE, MOST_VISIBLE = 20_000, 6
# Impacts, and their part, that must have a duration for durations to be tested, and ratio of the 90 % to the 10 %
# quantile: speeds of impact differ by a factor of a hundred, and durations by 2.5.
FEW, MOSTLY, UNLIKE = 10, 0.1, 10.0
# Part of the backlash: a gear that moves more about its flank is not in contact with it all the time.
MOVES = 0.1
# Parts of the backlash by which contact of real teeth may differ from that of rigid ones: where the noise is less and
# rigid flanks do not explain a record, its readings count as no better than that.
YIELDING = (1e-4, 1e-3)


def measure(
    record: Recording | str | Path,
    rig: Scenario | str | Path | None = None,
    file: str = "",
    progress: Callable[[float], None] | None = None,
    shapes: tuple[Shape, ...] = (),
    motion: DriveMotion | None = None,
    stated_motion: bool = False,
) -> Measurement:
    """Segment a measured record into flights and contacts, with uncertainties.

    Args:
        record: time and both angles, zeros of the angles may be anywhere; or the file of one, which has to pass the
            sensor gate (:func:`gears3d.measured.checks.admit`).
        rig: scenario of the bench, or its file: base radii and teeth, inertia and period; what the record itself shows
            is not taken from it. A record of a model carries its own base radii.
        file: named in faults.
        progress: called now and then with the part that is done, 0 to 1; what it raises ends the work.
        shapes: that flanks are known to have besides orders, such as a single tooth's, of unit size over the record's
            angles of drive and loose gear; their sizes are fitted.
        motion: of the drive as measured, where the rig's is stated or was put in the rig already; it is estimated from
            the record otherwise.
        stated_motion: whether the rig's ``[motion]`` is a statement about the record.

    Returns:
        The measurement. Where flights and contact do not explain the motion, ``summary["status"]`` is
        ``"unexplained"``: nothing is said of impacts, regime and backlash, ``summary["visible"]`` has what is seen.

    Raises:
        InputError: base radii are not known, or noise and counts hide what happens in the backlash.

    Theory: docs/theory/segmentation.md, equations (1), (2), (3).

    >>> from gears3d.scenario import load
    >>> from gears3d.simulation import record
    >>> bench = load("scenarios/rigaud-2020/fig5-20rpm.toml", {"run.duration": "1 s"})
    >>> found = measure(record(bench), bench)
    >>> len(found.recording.impacts["time_s"]), found.summary["regime"]
    (18, 'double_sided')
    >>> round(1e6 * found.summary["flanks"]["backlash_m"]["value"])
    250
    """
    if isinstance(rig, str | Path):
        rig = load(rig)
    if isinstance(record, str | Path):
        admitted = admit(record, rig, stated_motion=stated_motion)
        record, rig, file, motion = admitted.recording, admitted.rig, admitted.file, admitted.motion
    about = _about(record, rig, file)
    stated = stated_motion or motion is not None
    if motion is None:
        motion = drive_motion(record.time, record.signals["theta_drive_rad"])
    if (period := _period(record, rig, motion, stated)) is not None:
        about["period_s"] = period
    known = path_of(record, rig, file)
    try:
        cut = segments_of(known, rig, file, progress, shapes)
    except NotExplained as error:
        seen = _withheld(record, known, about, error)
        return replace(seen, summary={**seen.summary, "drive_motion": motion.to_dict()}, rig=rig)
    made = _recording(record, cut, about, _teeth(rig))
    return Measurement(made, cut, {**_summary(record, made, cut), "drive_motion": motion.to_dict()}, rig)


def segments_of(
    known: Track,
    rig: Scenario | None = None,
    file: str = "",
    progress: Callable[[float], None] | None = None,
    shapes: tuple[Shape, ...] = (),
) -> Segments:
    """Segment the path of a measured record, without a recording or a summary of it.

    Args:
        known: of :func:`path_of`.
        rig: as for :func:`measure`.
        file: named in faults.
        progress: as for :func:`measure`.
        shapes: as for :func:`measure`.

    Raises:
        NotExplained: flights and contact do not explain the motion.
        InputError: noise and counts hide what happens in the backlash.
    """
    best, refused = None, None
    try:
        best = _rigid(known, rig, file, progress, shapes)
    except InputError as error:
        refused = error
    extent = rig.rig().backlash if rig is not None else float(np.ptp(known.place))
    for part in YIELDING:
        if known.noise > part * extent or (best is not None and doubtful(best) < DOUBTFUL):
            continue
        with suppress(InputError):
            coarse = _rigid(_coarser(known, part * extent), rig, file, progress, shapes)
            best = coarse if best is None or doubtful(coarse) < doubtful(best) else best
    if best is None:
        assert refused is not None
        raise refused
    return best


def _coarser(known: Track, noise: float) -> Track:
    """Return a path whose readings count as no better than so much [m]."""
    return replace(known, noise=noise, sigma_loose=np.maximum(known.sigma_loose, noise / known.radii[1]))


def _rigid(
    known: Track,
    rig: Scenario | None,
    file: str,
    progress: Callable[[float], None] | None,
    shapes: tuple[Shape, ...],
) -> Segments:
    """Return the segments of a path; arguments and errors as above."""
    try:
        cut = segment(known, _teeth(rig), file, progress, shapes)
    except (np.linalg.LinAlgError, OverflowError, FloatingPointError) as error:
        what = f"the displacement has a range of {np.ptp(known.place):.3g} m; flanks cannot be fitted: {error}"
        raise InputError(Fault("", what, "check the units of the angles", file)) from error
    if rig is not None and not len(cut.flights["start_s"]):
        _refuse_blind(cut, rig.rig().backlash, file)
    refuse(explain(cut), file)
    return cut


def _teeth(rig: Scenario | None) -> tuple[int, int] | None:
    return (rig.gears.drive.teeth, rig.gears.loose.teeth) if rig else None


def path_of(record: Recording, rig: Scenario | None = None, file: str = "") -> Track:
    """Return displacement and angles of a measured record, without segmentation.

    Args:
        record: as for :func:`measure`.
        rig: as for :func:`measure`.
        file: named in faults.

    Raises:
        InputError: base radii are not known, there are too few readings, or a gear stands still.
    """
    about = _about(record, rig, file)
    radii = (about["base_radius_drive_m"], about["base_radius_loose_m"])
    angles = (record.signals["theta_drive_rad"], record.signals["theta_loose_rad"])
    _refuse_parted(angles, radii, file)
    return track(record.time, *angles, radii, file)


def _refuse_parted(angles: tuple[Any, Any], radii: tuple[float, float], file: str) -> None:
    """Refuse a gear that stands still while the other turns: nothing is in mesh."""
    way = [float(np.ptp(angle)) * radius for angle, radius in zip(angles, radii, strict=True) if len(angle)]
    for name, own in zip(("theta_drive_rad", "theta_loose_rad"), way, strict=False):
        if own == 0.0 and max(way) > 0.0:
            remedy = "a run-down is for `gears3d identify coastdown`; in mesh both gears turn"
            raise InputError(Fault(name, "stands still while the other gear turns", remedy, file))


def _refuse_blind(cut: Segments, backlash: float, file: str) -> None:
    """Refuse a verdict of contact only where motion or noise may hide a crossing of the gap."""
    seen = clearance(cut.path, cut.flanks)
    if cut.flanks.rough > max(MOVES * backlash, 3.0 * cut.path.noise):
        what = f"moves by {1e6 * cut.flanks.rough:.3g} um about a flank of low orders, but shows no impact"
        raise NotExplained(
            Fault("theta_loose_rad", what, "record faster, or with less noise, or nothing rattles", file)
        )
    if 3.0 * seen > backlash:
        sizes = f"less than {1e6 * seen:.3g} um, in a backlash of {1e6 * backlash:.3g} um"
        what = f"shows no flight, but would show none of {sizes}"
        raise InputError(Fault("theta_loose_rad", what, "record with less noise, or with more counts", file))


def _about(record: Recording, rig: Scenario | None, file: str) -> dict[str, Any]:
    """Return the known data of the rig, in the form of ``meta`` of a recording."""
    keys = ("base_radius_drive_m", "base_radius_loose_m", "inertia_kg_m2", "title")
    about = {key: record.meta[key] for key in keys if key in record.meta}
    if rig is not None:
        values = rig.rig()
        about |= {
            "base_radius_drive_m": values.base_radius_drive,
            "base_radius_loose_m": values.base_radius_loose,
            "inertia_kg_m2": values.inertia,
            "drag_torque_N_m": values.drag_torque,
            "title": rig.title,
            "source": rig.source,
        }
    if not {"base_radius_drive_m", "base_radius_loose_m"} <= about.keys():
        remedy = "give --rig SCENARIO: angles alone have no displacement"
        raise InputError(Fault("--rig", "is missing, and the record does not tell its base radii", remedy, file))
    return about | {"model": "measured"}


def _period(record: Recording, rig: Scenario | None, motion: DriveMotion, known: bool) -> float | None:
    """Return the period of the drive's fluctuation [s]: that of the rig where its motion is the record's."""
    if known and rig is not None and rig.motion.harmonics:
        return rig.period
    return record.meta.get("period_s") or (motion.period if motion.harmonics else None)


def _recording(record: Recording, cut: Segments, about: dict[str, Any], teeth: tuple[int, int] | None) -> Recording:
    """Return the record with displacement from the mean active flank, state and impacts."""
    known = cut.track
    radii, shift = known.radii, float(cut.flanks.active[0])
    drive, loose = record.signals["theta_drive_rad"], record.signals["theta_loose_rad"]
    index = "index" in record.meta.get("zero", {}).get("drive", "")
    begin = 0.0 if index else float(drive[0])
    zero = known.origin[1] + (shift - radii[0] * (known.origin[0] - begin)) / radii[1]
    same = len(known.time) == len(record.time) and np.array_equal(known.time, record.time)
    slope = np.gradient(cut.path.place, cut.path.time)

    def place(rows: slice) -> np.ndarray:
        return (known.part(rows)[2] if same else np.interp(record.time[rows], known.time, known.place)) - shift

    shown: dict[str, Callable[[slice], np.ndarray]] = {
        "theta_drive_rad": lambda rows: drive[rows] - begin,
        "theta_loose_rad": lambda rows: loose[rows] - zero,
        "displacement_m": place,
        "velocity_m_s": lambda rows: np.interp(record.time[rows], cut.path.time, slope),
        "state": lambda rows: cut.states(record.time[rows]).astype(float),
    }
    impacts = dict(cut.impacts)
    mass = about["inertia_kg_m2"] / radii[1] ** 2 if "inertia_kg_m2" in about else np.nan
    impacts["impulse_N_s"] = mass * (impacts["rebound_m_s"] - impacts["velocity_m_s"])
    impacts["phase_rad"] = _phase(record, about.get("period_s"), impacts["time_s"])
    if teeth is not None:
        turned = known.steady.curve(impacts["time_s"]) - begin
        follows = known.angles(impacts["time_s"])[1] - zero
        impacts |= {"tooth_drive": _tooth(turned, teeth[0]), "tooth_loose": _tooth(follows, teeth[1])}
    contacts = np.column_stack([cut.contacts[name] for name in ("flank", "start_s", "end_s")])
    meta = {**about, "contacts": contacts.tolist(), "duration_s": float(record.time[-1] - record.time[0])}
    meta["zero_rad"] = {"drive": begin, "loose": float(zero)}
    meta["teeth_from"] = "index" if index else "record"
    if (found := cut.flanks.backlash) is not None:
        meta["backlash_m"] = found[0]
    order = [*(name for name in SIGNAL_UNITS if name in {*record.signals, *shown})]
    order += [name for name in {**record.signals, **shown} if name not in order]
    signals = Derived(record.signals, shown, order)
    if len(record.time) <= LONG:
        signals = {name: signals[name] for name in order}
    return Recording(signals, _in_order(impacts), meta)


def _withheld(record: Recording, known: Track, about: dict[str, Any], error: NotExplained) -> Measurement:
    """Return the summary of a record that flights and contact do not explain: directly visible quantities only."""
    cut = unsegmented(known)
    bare = _recording(record, cut, about, None)
    reason = error.faults[0].message
    signals = {name: np.asarray(bare.signals[name]) for name in bare.signals if name != "state"}
    meta = {key: value for key, value in bare.meta.items() if key != "contacts"} | {"unexplained": reason}
    made = Recording(signals, {}, meta)
    summary = _summary(record, Recording(signals, {}, {**meta, "unexplained": None}), cut)
    found = error.explanation
    summary |= dict.fromkeys(set(summary) - KEPT)
    share = None if found is None else found.time
    summary["status"] = "unexplained"
    summary["warnings"] = [f"no impacts, regime or backlash are reported: the loose gear {reason}"]
    summary["visible"] = _visible(cut.path, known)
    summary["explained"] = {"time": share, "path": None if found is None else found.path,
                            "reasons": [reason] if found is None else list(found.reasons)}  # fmt: skip
    summary["cut"] |= {"whole_flights": 0, "testifying": 0, "unexplained": None if share is None else 1.0 - share}
    summary["quality"] |= {"flight_height_min_m": None, "noise_in_contact_m": None}
    summary["contacts_seen"] = dict.fromkeys(FLANKS, 0)
    summary["flanks"] = {"backlash_m": None, "orders": {}}
    return Measurement(made, cut, summary)


def _visible(path: Blocks, known: Track) -> dict[str, Any]:
    """Return what a displacement shows without any segmentation: ratio, range, drift and strongest orders."""
    some = slice(None, None, max(len(path.time) // VISIBLE, 1))
    time, drive, loose, place = (column[some] for column in (path.time, path.drive, path.loose, path.place))
    x = 2.0 * (time - time[0]) / max(float(time[-1] - time[0]), 1e-300) - 1.0
    base = np.stack([np.ones_like(x), x, x**2], axis=1)
    shown = Contact(base, np.stack([drive, loose]), place, path.stray)
    taken, numbers, covariance = strongest([shown], resolved(path.drive, path.loose), MOST_VISIBLE)
    found = zip(taken, np.abs(phasors_of(numbers[0][3:])), deviations(covariance[0][3:, 3:]), strict=True)
    orders = [
        {"gear": gear, "order": order, "amplitude_m": float(amplitude), "sigma_m": float(sigma)}
        for (gear, order), amplitude, sigma in found
    ]
    slope = np.polyfit(drive - drive.mean(), loose - loose.mean(), 1)[0] if np.ptp(drive) > 0.0 else np.nan
    lasts = float(path.time[-1] - path.time[0])
    return {
        "ratio_loose_over_drive": float(slope) if np.isfinite(slope) else None,
        "ratio_of_base_radii": known.radii[0] / known.radii[1],
        "drive_speed_mean_rad_s": float(path.drive[-1] - path.drive[0]) / lasts,
        "displacement_range_m": float(np.ptp(place)),
        "drift_m_s": float(2.0 * numbers[0][1] / lasts),
        "orders": sorted(orders, key=lambda one: -one["amplitude_m"]),
    }


def _thinned(made: Recording) -> Recording:
    """Return a long record with some of its rows, which suffice to determine how a motion repeats."""
    if len(made.time) <= LONG:
        return made
    rows = slice(None, None, -(-len(made.time) // (LONG // 2)))
    return Recording({name: part_of(made.signals, name, rows) for name in made.signals}, made.impacts, made.meta)


def _tooth(angle: np.ndarray, teeth: int) -> np.ndarray:
    """Return the number of the tooth in mesh, counted in order of meshing from 1 at angle 0."""
    return (1 + np.mod(np.round(angle * teeth / (2 * pi)), teeth)).astype(np.int32)


def _in_order(impacts: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    order = np.argsort(impacts["time_s"], kind="stable")
    return {name: values[order] for name, values in impacts.items()}


def _phase(record: Recording, period: float | None, times: np.ndarray) -> np.ndarray:
    """Return the phase of the drive's fluctuation at some times [rad], NaN without one."""
    if not period or record.time[-1] - record.time[0] < period:
        return np.full(len(times), np.nan)
    return of_period(record.time, record.signals["theta_drive_rad"], period, times)


def _summary(record: Recording, made: Recording, cut: Segments) -> dict[str, Any]:
    flights, contacts = cut.flights, cut.contacts
    sane = flights["testifies"] == 1
    told = describe(_thinned(made))
    slowing = flights["deceleration_rad_s2"][sane]
    return {
        "format": 1,
        "status": "complete",
        "warnings": _warnings(cut),
        "explained": _explained(cut),
        "flight_height_min_m": cut.lowest,
        "quality": _quality(record, cut),
        "flanks": _flanks(cut),
        "cut": {
            "whole_flights": len(sane),
            "testifying": int(sane.sum()),
            "chi2_median": float(np.median(flights["chi2"])) if len(sane) else None,
            "deceleration_median_rad_s2": float(np.median(slowing)) if len(slowing) else None,
            "slope_1_s": {"value": cut.slope[0], "sigma": cut.slope[1]} if np.isfinite(cut.slope[1]) else None,
            "durations_resolved": int(np.count_nonzero(np.isfinite(cut.impacts["duration_s"]))),
            "duration_max_median_s": _median(cut.impacts["duration_max_s"]),
            "dropped": cut.dropped,
            "unexplained": doubtful(cut),
        },
        "contacts_seen": {name: int(np.sum(contacts["flank"] == code)) for code, name in enumerate(FLANKS)},
        **told,
    }


def _explained(cut: Segments) -> dict[str, Any]:
    found = explain(cut)
    return {"time": found.time, "path": found.path, "reasons": list(found.reasons)}


def _warnings(cut: Segments) -> list[str]:
    """Return the warnings about the segmentation."""
    told = []
    if (part := doubtful(cut)) > DOUBTFUL:
        what = "is neither flight nor contact as the flanks have it: look at the picture, or record with more counts"
        told.append(f"{part:.1%} of the time {what}")
    told += _behind(cut)
    return told


def _behind(cut: Segments) -> list[str]:
    """Return a warning where durations of impacts and their spread are those that a misplaced flank imitates.

    Compliant teeth give all impacts similar durations: it changes with the fifth root of the speed (Hertz).
    """
    lasts, speed = cut.impacts["duration_s"], np.abs(cut.impacts["velocity_m_s"])
    long = np.isfinite(lasts)
    if np.count_nonzero(long) < max(FEW, MOSTLY * len(lasts)):
        return []
    deep = float(np.median(lasts[long] * speed[long])) / pi  # of half a sine
    short, most = np.quantile(lasts[long], (0.1, 0.9))
    if deep < 5.0 * cut.path.stray or most < UNLIKE * short:
        return []
    size = f"{np.count_nonzero(long)} of {len(lasts)} impacts seem to last {1e3 * short:.2g} to {1e3 * most:.2g} ms"
    where = f"with the gear {1e6 * deep:.2g} um behind its flank"
    why = "the flanks have orders that contact at these angles does not show: speeds and backlash may err by as much"
    return [f"{size}, {where}: {why}; record at another speed, or slow turns both ways"]


def _median(values: np.ndarray) -> float | None:
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else None


def _quality(record: Recording, cut: Segments) -> dict[str, Any]:
    spacing = float(np.median(some_steps(record.time)))
    steps = [step for _, change in changes(record.time) for step in (float(change.min()), float(change.max()))]
    encoders = {}
    for gear, reading in zip(("drive", "loose"), cut.track.readings, strict=True):
        encoders[gear] = {
            "read_as": reading.kind,
            "counts_per_revolution": 2 * pi / reading.quantum if reading.quantum else None,
            "sigma_rad": usual(reading.sigma),
        }
    return {
        "samples": len(record.time),
        "duration_s": float(record.time[-1] - record.time[0]),
        "sample_rate_Hz": 1.0 / spacing,
        "jitter": float(max(max(steps) - spacing, spacing - min(steps)) / spacing),
        "encoders": encoders,
        "noise": {gear: model.describe() for gear, model in zip(("drive", "loose"), cut.track.models, strict=True)},
        "noise_m": cut.track.noise,
        "noise_in_contact_m": cut.flanks.rough,
        "averaged_over_s": cut.path.width,
        "flight_height_min_m": cut.lowest,
    }


def _flanks(cut: Segments) -> dict[str, Any]:
    found, flanks = cut.flanks.backlash, cut.flanks
    found = None if found is None else (found[0], backlash_sigma(cut))
    terms = {"active": _orders(flanks.terms.kinds, flanks.active)}
    if flanks.gap is not None:
        barred = orders_in_step(cut)  # the interval of the mean includes them
        told = _orders(flanks.terms.kinds, flanks.gap)
        terms["backlash"] = [{**one, "in_step": (one["gear"], one["order"]) in barred} for one in told]
    value = None
    if found is not None:
        reach = 1.96 * float(np.hypot(found[1], np.hypot(*place_slack(cut))))
        value = {"value": found[0], "ci95": [found[0] - reach, found[0] + reach]}
    return {"backlash_m": value, "orders": terms}


def _orders(kinds: tuple[tuple[str, int], ...], numbers: np.ndarray) -> list[dict[str, Any]]:
    """Return the amplitudes of a flank's orders."""
    found, at = [], 0
    for kind, order in kinds:
        wide = 2 if kind in ("drive", "loose") else 1
        if wide == 2:
            amplitude = float(np.hypot(*numbers[at : at + 2]))
            phase = float(np.arctan2(-numbers[at + 1], numbers[at]))
            found.append({"gear": kind, "order": order, "amplitude_m": amplitude, "phase_rad": phase})
        at += wide
    return found
