"""The excitation at which contact is lost, from records whose swing slowly grows and falls, or is another in each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.identify.law import Identified, Parameter
from gears3d.identify.onset import DIRECTIONS, Onset, onset
from gears3d.identify.recounting import SIGNS, Laid, recounted
from gears3d.identify.swing import Periods, find_swing, periods
from gears3d.identify.unwaved import flattened
from gears3d.measured.segmentation.smoothing import track
from gears3d.recording import Recording
from gears3d.signals import count_of

if TYPE_CHECKING:
    from gears3d.scenario import Scenario


class Sweep(NamedTuple):
    """A record of a sweep.

    Args:
        record: time and both angles.
        rig: base radii, teeth, inertia, backlash, and ``motion.harmonics[0]`` for the frequency.
        file: named in faults.
    """

    record: Recording
    rig: Scenario
    file: str = ""


def identify_threshold(sweeps: Sequence[Sweep]) -> Identified:
    """Identify the excitation at which contact is lost, rising and falling, and the drag that it stands for.

    Above the threshold the first flight of each period has a known shape; its height over the excitation tells the
    threshold far better than the moment at which a flight can be seen. Where flights are not those of rigid teeth that
    lie on the flank before (bounces that outlast a period, flanks that throw), the last quiet and the first lively
    period bracket it.

    Args:
        sweeps: records with a swing that grows, falls, or both; or one swing each, in the order of recording.

    Returns:
        For ``up`` and ``down``, as far as recorded: ``acceleration_up`` (amplitude of the drive's acceleration
        [rad/s²]), ``amplitude_up`` (of its speed [rad/s], if all were at one frequency), ``excitation_up`` (Λ with the
        rig's drag) and ``drag_up`` [N·m] (that Λ = 1 stands for); with both, ``hysteresis`` (up less down, over up).

    Raises:
        InputError: a record cannot be used, or contact is never or always lost.

    Source: Rigaud & Perret-Liaudet 2020, section 4, eqs (5)-(10); Kadmiri et al. 2012, eq. (24) and table 1.
    """
    laid: list[Laid] = []
    ways = []
    for sweep in sweeps:
        laid.append(_laid(sweep))
        ways.append(_direction(laid[-1].raw, laid[-2].raw if len(laid) > 1 else None))
    found = _onsets(laid, ways, sweeps)
    laid = [_again(one, way, found, sweep) for one, way, sweep in zip(laid, ways, sweeps, strict=True)]
    rig = sweeps[0].rig.rig()
    found = recounted(_onsets(laid, ways, sweeps), laid, ways, (rig.teeth_drive, rig.teeth_loose), rig.backlash)
    if all(one.value is None for one in found.values()):
        raise _never(found, laid, sweeps)
    return _told(found, sweeps, laid)


def _onsets(laid: list[Laid], ways: list[np.ndarray], sweeps: Sequence[Sweep]) -> dict[str, Onset]:
    rig, flat = sweeps[0].rig.rig(), [one.periods for one in laid]
    return {
        name: onset(flat, [way == sign for way in ways], rig.base_radius_drive, rig.backlash, name)
        for name, sign in SIGNS.items()
        if any(np.any(way == sign) for way in ways)
    }


def _laid(sweep: Sweep) -> Laid:
    """Return a record by periods, its flanks' waves taken off."""
    rig, file = sweep.rig.rig(), sweep.file
    if not sweep.rig.motion.harmonics:
        remedy = "give the swing's frequency in motion.harmonics of the rig or of the record's [condition]"
        raise InputError(Fault("motion.harmonics", "is empty: no frequency is known", remedy, file))
    radii = (rig.base_radius_drive, rig.base_radius_loose)
    angles = (sweep.record.signals["theta_drive_rad"], sweep.record.signals["theta_loose_rad"])
    known = track(sweep.record.time, *angles, radii, file)
    driven = known.readings[0]
    frequency = sweep.rig.motion.harmonics[0].frequency
    swing = find_swing(driven.time, driven.angle, frequency, file)
    raw = periods(swing, known.time, known.place, known.drive, known.loose)
    flat = flattened(raw, (rig.teeth_drive, rig.teeth_loose), file)
    quanta = (count_of(angles[0]), count_of(angles[1]))
    return Laid(flat, raw, swing, known, sweep.record.time, quanta, frequency, np.zeros(len(raw.level), bool))


CALM = 0.95
"""Part of a threshold below which periods are contact from end to end."""


def _again(laid: Laid, way: np.ndarray, found: dict[str, Onset], sweep: Sweep) -> Laid:
    """Return the record with the delay between its encoders told by the periods in which contact lasts."""
    quiet = np.zeros(len(way), bool)
    for name, sign in SIGNS.items():
        if name in found and found[name].value is not None:
            quiet |= (way == sign) & (laid.raw.level < CALM * found[name].ci95[0])
    rig = sweep.rig.rig()
    flat = flattened(laid.raw, (rig.teeth_drive, rig.teeth_loose), sweep.file, quiet)
    return laid._replace(periods=flat, quiet=quiet)


STEADY = 2e-3
"""Relative change of the swing in a period below which it does not move."""


def _direction(here: Periods, before: Periods | None) -> np.ndarray:
    """Return 1 where the swing grows, -1 where it falls; a steady one is told by the record before."""
    moving = np.abs(here.rise) > STEADY * here.level
    if np.mean(moving) > 0.5:
        return np.sign(here.rise).astype(int)
    fell = before is not None and np.median(here.level) < np.median(before.level)
    return np.full(len(here.level), -1 if fell else 1)


def _never(found: dict[str, Onset], laid: list[Laid], sweeps: Sequence[Sweep]) -> InputError:
    level = np.concatenate([one.raw.level for one in laid])
    lost = all(one.lively for one in found.values())
    what = "is lost in every period" if lost else "is never lost"
    span = f"between amplitudes of {level.min():.4g} and {level.max():.4g} rad/s^2 of the drive's acceleration"
    remedy = "sweep from a smaller swing on" if lost else "sweep to a larger swing"
    return InputError(Fault("theta_loose_rad", f"contact {what} {span}", remedy, sweeps[0].file))


def _told(found: dict[str, Onset], sweeps: Sequence[Sweep], laid: list[Laid]) -> Identified:
    rig, scenario = sweeps[0].rig.rig(), sweeps[0].rig
    lever = rig.inertia * rig.base_radius_drive / rig.base_radius_loose
    unsure = scenario.uncertainty.get("gears.loose.inertia", 0.0) / rig.inertia
    omegas = np.array([one.raw.omega for one in laid])
    parameters: dict[str, Parameter] = {}
    for name, one in found.items():
        if one.value is None:
            continue

        def scaled(factor: float, unit: str, one: Onset = one, more: float = 0.0) -> Parameter:
            value = factor * float(one.value or 0.0)
            low, high = (np.hypot(factor * (end - float(one.value or 0.0)), 1.96 * more * value) for end in one.ci95)
            return Parameter(value, unit, value - float(low), value + float(high))

        parameters[f"acceleration_{name}"] = scaled(1.0, "rad/s^2")
        if np.ptp(omegas) < 1e-9 * omegas[0]:
            parameters[f"amplitude_{name}"] = scaled(1.0 / omegas[0], "rad/s")
        if rig.drag_torque > 0.0:
            parameters[f"excitation_{name}"] = scaled(lever / rig.drag_torque, "")
        parameters[f"drag_{name}"] = scaled(lever, "N m", more=unsure)
    both = [found[name] for name in DIRECTIONS if name in found and found[name].value is not None]
    if len(both) == 2:
        parameters["hysteresis"] = _hysteresis(*both)
    name = next(name for name in DIRECTIONS if f"drag_{name}" in parameters)
    drag = parameters[f"drag_{name}"].value
    snippet = f'# all drag in contact at the mean speed: leave other drags out\n[drag]\ntorque = "{drag:.6g} N m"\n'
    goodness: dict[str, Any] = {name: one.goodness for name, one in found.items()}
    goodness["periods"] = int(sum(len(one.raw.level) for one in laid))
    curves = {name: one.curve for name, one in found.items()}
    curves |= {"scale": {"factor": lever / rig.drag_torque if rig.drag_torque > 0.0 else 1.0}}
    notes = tuple(f"{name}: {note}" for name, one in found.items() for note in one.notes)
    return Identified("threshold", parameters, goodness, snippet, curves, notes)


def _hysteresis(up: Onset, down: Onset) -> Parameter:
    assert up.value is not None
    assert down.value is not None
    value = 1.0 - down.value / up.value
    low = np.hypot((down.ci95[1] - down.value) / up.value, down.value * (up.value - up.ci95[0]) / up.value**2)
    high = np.hypot((down.value - down.ci95[0]) / up.value, down.value * (up.ci95[1] - up.value) / up.value**2)
    return Parameter(value, "", value - float(low), value + float(high))
