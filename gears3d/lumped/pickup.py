"""The rigid twin started within a motion: from a measured state, under the drive's measured motion.

The model's clock and both its angles begin at 0. Functions of time or of an angle are therefore shifted by the readings
of the clock and the encoders at that state.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from math import exp, inf
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.effects import Code, Row
from gears3d.effects.rows import Variable
from gears3d.lumped import layout as at
from gears3d.lumped.model import Model, model
from gears3d.lumped.rigid import SIGNALS, flanks_of, impact_columns, tooth
from gears3d.lumped.run import Outcome, run
from gears3d.lumped.tables import Table, quintic
from gears3d.recording import Recording

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

Array = np.ndarray
# Smallest gap to either flank at the start of a motion that is picked up, as a part of the backlash.
LEAST = 0.002
# The motion is the measured one; scatter predicts nothing.
LEFT_OUT = (Code.MOTION_HARMONIC, Code.IMPACT_SCATTER)


class Start(NamedTuple):
    """Where a motion is picked up.

    Args:
        time: [s].
        drive: angle of the drive gear [rad].
        loose: angle of the loose gear, from which its effects count [rad].
        place: displacement from the active flank without deviations [m].
        rate: of the displacement [m/s].
    """

    time: float
    drive: float
    loose: float
    place: float
    rate: float


def pick_up(
    scenario: Scenario, start: Start, time: Array, drive: Array, output_rate: float, riding: int | None = None
) -> Recording:
    """Run a scenario in the rigid model from a measured state, under the drive's measured motion.

    Its own motion and the scatter of impacts are not used. ``drive`` is the angle of the drive gear [rad] at ``time``
    [s], (n,), twelve points or more: the first is that of the start, the last ends the run. ``riding`` is the flank on
    which the gear begins, 0 active or 1 reverse, in place of the start's displacement and rate. Times and angles of the
    recording are those of the start. A scenario that the rigid model cannot simulate is an InputError, a motion that
    cannot continue an EngineError.
    """
    rig = scenario.rig()
    path = quintic(time - start.time, drive - start.drive)
    rows = turned_back(scenario.rows(), start, rig.base_radius_loose)
    flanks = _flanks(scenario, [row for row in scenario.rows() if row.code not in LEFT_OUT], start, drive)
    speed = (drive[-1] - drive[0]) / (time[-1] - time[0])
    m = model(replace(rig, mean_speed=float(speed)), [], rows, scenario.impact.stick_velocity, 0, flanks, path)
    lasts = float(time[-1] - start.time)
    begin = "free" if riding is None else ("active", "reverse")[riding]
    put = (lambda state: _put(m, state, start.place, start.rate)) if riding is None else None
    outcome = run(m, lasts, 1.0 / output_rate, begin, chunk=lasts, put=put)
    return _recording(outcome, m, scenario, start)


def turned_back(rows: Iterable[Row], start: Start, radius_loose: float) -> list[Row]:
    """Return rows for a clock and angles that begin where a motion is picked up; motion and scatter are excluded.

    >>> from gears3d.effects.rows import flank_harmonic, torque_relax
    >>> start = Start(2.0, 0.25, 0.0, 0.0, 0.0)
    >>> [row.p for row in turned_back([flank_harmonic(0, 0, 4, 1e-5, 0.5)], start, 0.1)]
    [(0.0, 0.0, 4.0, 1e-05, 1.5)]
    >>> one, two = turned_back([torque_relax(1.0, 2.0)], start, 0.1)
    >>> one.p[0] + two.p[0], round(two.p[0], 6)
    (1.0, 0.367879)
    """
    zeros = (start.drive, start.loose - start.place / radius_loose)
    found = []
    for row in rows:
        p = row.p
        if row.code in LEFT_OUT:
            continue
        if row.code == Code.FLANK_HARMONIC:
            found.append(row._replace(p=(*p[:4], p[4] + p[2] * zeros[int(p[0])])))
        elif row.code == Code.FLANK_ECCENTRIC:
            found.append(row._replace(p=(*p[:2], p[2] + zeros[int(p[0])])))
        elif row.code == Code.TORQUE_HARMONIC:
            found.append(row._replace(p=(*p[:2], p[2] + p[0] * zeros[1])))
        elif row.code == Code.TORQUE_RELAX:
            left = p[0] * exp(-start.time / p[1])
            found += [Row(Code.TORQUE_CONSTANT, row.gate, (p[0] - left,)), row._replace(p=(left, p[1]))]
        elif row.code == Code.TORQUE_TABLE and p[0] != Variable.SPEED:
            zero = zeros[1] if p[0] == Variable.ANGLE else start.time
            found.append(row._replace(table=tuple((x - zero, y) for x, y in row.table)))
        else:
            found.append(row)
    return found


def _flanks(scenario: Scenario, rows: list[Row], start: Start, drive: Array) -> tuple[Table, Table] | None:
    """Return tables of flanks with other deviations than waves, over an angle that begins at the start."""
    whole = flanks_of(scenario, rows, (float(drive.min()), float(drive.max())))
    if whole is None:
        return None
    reach = np.array([drive.min() - start.drive, drive.max() - start.drive]) + np.array([-0.01, 0.01])
    active, reverse = (_from(table, start.drive, reach) for table in whole)
    return active, reverse


def _from(table: Table, zero: float, reach: Array) -> Table:
    """Return a table over an angle that begins at another one, laid out over a reach where it repeats."""
    column = np.eye(1, table.pieces.shape[1])[0]
    if not table.period:
        return table._replace(knots=table.knots - zero, pieces=table.pieces - column * zero)
    first, last = (int(np.floor((one + zero) / table.period)) for one in reach)
    shifts = table.period * np.arange(first, last + 1) - zero
    pieces = np.concatenate([table.pieces + column * shift for shift in shifts])
    starts = np.concatenate([np.r_[0.0, table.knots[1:-1]] + shift for shift in shifts])
    return table._replace(knots=np.r_[-inf, starts[1:], inf], pieces=pieces, period=0.0)


def _put(m: Model, state: Array, place: float, rate: float) -> None:
    """Put the loose gear where it was measured, between the flanks."""
    omega = float(state[at.DRIVE_SPEED])
    speed = (rate + m.radius_drive * omega) / m.radius_loose
    for _ in range(2):  # a place on or in a flank is moved into the gap
        active, lean = _material(m, 0, place, omega, speed)
        reverse, slope = _material(m, 1, place, omega, speed)
        room = m.backlash - active - reverse
        inside = float(np.clip(place, active + LEAST * room, active + (1.0 - LEAST) * room))
        if inside != place:
            place = inside
    state[at.MODE], state[at.DEPARTED], state[at.LIFT], state[at.GUESS] = at.FREE, 0.0, -1.0, inf
    state[at.DISPLACEMENT], state[at.ANGLE], state[at.SPEED] = place, place / m.radius_loose, speed
    state[at.SIGN] = np.sign(speed) or 1.0
    state[at.GAPS], state[at.GAPS + 1] = place - active, m.backlash - reverse - place
    state[at.RATES], state[at.RATES + 1] = rate - lean, -rate - slope


def _material(m: Model, flank: int, place: float, omega: float, speed: float) -> tuple[float, float]:
    """Return a flank's deviation at angles 0 of the drive and place / Rb2 of the loose gear [m], and its rate."""
    value, rate = m.film[4] if flank == 0 else 0.0, 0.0
    if m.flank_tables >= 0:
        table, step = m.tables[m.flank_tables + flank], 1e-6
        low, there, high = (float(x) for x in table(np.array([-step, 0.0, step])))
        value += there
        rate = omega * (high - low) / (2.0 * step)
    for gear, order, phase, *sizes in m.flanks:
        turn = order * (place / m.radius_loose if gear else 0.0) + phase
        value += sizes[flank] * np.cos(turn)
        rate -= sizes[flank] * order * np.sin(turn) * (speed if gear else omega)
    return value, rate


def _recording(outcome: Outcome, m: Model, scenario: Scenario, start: Start) -> Recording:
    rig = scenario.rig()
    impacts = impact_columns(outcome, m, rig, [])
    impacts["time_s"] = impacts["time_s"] + start.time
    signals: dict[str, Array] = dict(zip(SIGNALS, outcome.samples.T.copy(), strict=True))
    signals["time_s"] = signals["time_s"] + start.time
    signals["theta_drive_rad"] = signals["theta_drive_rad"] + start.drive
    signals["theta_loose_rad"] = signals["theta_loose_rad"] + start.loose - start.place / rig.base_radius_loose
    for gear, teeth in (("drive", rig.teeth_drive), ("loose", rig.teeth_loose)):
        angle = np.interp(impacts["time_s"], signals["time_s"], signals[f"theta_{gear}_rad"])
        impacts[f"tooth_{gear}"] = tooth(angle, teeth)
    contacts = outcome.contacts + np.array([0.0, start.time, start.time])
    meta = {
        "model": "rigid", "contacts": contacts.tolist(), "counters": outcome.counters, "title": scenario.title,
        "base_radius_drive_m": rig.base_radius_drive, "base_radius_loose_m": rig.base_radius_loose,
    }  # fmt: skip
    return Recording(signals, impacts, meta)
