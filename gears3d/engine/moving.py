"""The state of a run and its changes, compiled: motion along a path, impacts, and the records of both.

Bullet is not used here: between two queries the loose gear moves along paths that the torques alone give, and every
event follows from gap and gap rate on the true flanks.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from gears3d.engine.closing import Arc, angle_after, speed_after
from gears3d.engine.compile import inner
from gears3d.engine.impact import coefficient, normal_impulse
from gears3d.engine.log import fill_flight
from gears3d.engine.mesh import call_side, touching_teeth
from gears3d.engine.motion import drive_at
from gears3d.engine.sustained_contact import softly, supporting
from gears3d.engine.torques import FREE
from gears3d.records import Floats2, Record

# Why a compiled loop returns: it has done its steps; the run is over; Bullet is to be queried; a block is full; both
# flanks touch; teeth lie too deep in each other; a gap is not closed at its impact; the state is not a number; no time
# passes.
GO_ON, DONE, QUERY, FULL, JAMS, SINKS, OPEN, NO_NUMBER, STANDS = range(9)
NEAR = 1e-10  # largest gap at the time of its impact [m]
NOBODY = -1  # stands for no flank

STATE = np.dtype(
    [
        ("time", "f8"),  # s
        ("theta", "f8"),  # of the loose gear [rad]
        ("omega", "f8"),  # rad/s
        ("place", "i8"),  # FREE, ON_ACTIVE or ON_REVERSE
        ("steps", "i8"),
        ("standing", "i8"),  # steps in a row without any time passing
        ("asked", "f8"),  # angle of the drive at the last query [rad]
        ("located", "f8"),  # largest gap at an impact [m]
        ("fault", "f8"),  # depth or gap that stops the run [m]
        # the flight, or the contact or passage under way
        ("left", "i8"),  # flank that the flight left
        ("height", "f8"),  # largest distance from it so far [m]
        ("flank", "i8"),  # whose passage it is, or NOBODY
        ("began", "f8"),  # when that, or permanent contact, began [s]
        ("stays", "i8"),  # whether the contact is permanent
        ("entry", "f8"),  # rate of the gap when the passage began [m/s]
        ("entry_height", "f8"),  # of the flight before [m]
        ("entry_theta", "f8"),  # angle of the loose gear then [rad]
        ("entry_drive", "i8"),  # teeth in contact then
        ("entry_loose", "i8"),
        ("impulse", "f8"),  # of film and flank so far [N s]
        ("turned", "i8"),  # whether the gap has opened since
        # forces of the gap and their integration
        ("squeezed", "i8", (2,)),  # whether the gap of the active and of the reverse flank closes
        ("pushing", "i8"),  # whether compliant flanks in contact push on each other
        ("sense", "f8"),  # sign of the loose gear's motion, 0 where dry torque keeps it at rest
        ("body", "f8", (2,)),  # angle [rad] and speed [rad/s] of a carried body
        ("step", "f8"),  # next step [s]
        ("tried", "f8"),  # last step [s]
        ("error", "f8"),  # eighth root of its error in parts of the tolerance
        ("fresh", "i8"),  # whether the rates at the begin of the next step are those at the end of the last
        # what the blocks hold
        ("samples", "i8"),
        ("impacts", "i8"),
        ("contacts", "i8"),
        ("draws", "i8"),
    ]
)
HIT = np.dtype(
    [
        ("time", "f8"),
        ("flank", "i8"),
        ("rate", "f8"),  # of the gap before [m/s]
        ("rebound", "f8"),  # after
        ("impulse", "f8"),  # along the contact normal [N s]
        ("height", "f8"),  # of the flight before [m]
        ("drive", "i8"),  # teeth in contact
        ("loose", "i8"),
        ("met", "f8"),  # when they did [s]
        ("theta", "f8"),  # angle of the loose gear then [rad]
    ]
)


class Rules(Record):
    """The settings of a compiled loop in addition to the system.

    Args:
        duration: of the run [s].
        longest_step: s.
        stretched_step: the longest that may be taken to the end of a window of near teeth [s].
        width: of such a window [rad], 0 for a run without flanks.
        compare_after: turn of the drive after which Bullet is queried again in any case [rad].
        stick_velocity: rebounds slower than this become permanent contact [m/s].
        restitution: base coefficient.
        law: table of :func:`gears3d.engine.impact.law_table`.
        springs: compliant flanks (1, 2), (0, 2) for impulses.
        deepest: largest overlap of compliant flanks [m].
        tolerance: of steps under forces of the gap, see :mod:`gears3d.engine.forced`.
    """

    duration: float
    longest_step: float
    stretched_step: float
    width: float
    compare_after: float
    stick_velocity: float
    restitution: float
    law: Floats2
    springs: Floats2
    deepest: float
    tolerance: float


class Blocks(NamedTuple):
    """The blocks that a compiled loop writes to.

    Args:
        times: of the samples [s], (n,).
        loose: angle [rad] and speed [rad/s] of the loose gear at them (n, 2).
        hits: impacts, of type ``HIT``.
        contacts: permanent contacts: flank, start and end [s], (k, 3).
        draws: standard normal numbers for the next impacts.
    """

    times: np.ndarray
    loose: np.ndarray
    hits: np.ndarray
    contacts: np.ndarray
    draws: np.ndarray


@inner
def here(s):
    """Return where the loose gear is, as the start of an arc."""
    return Arc(s.time, s.theta, s.omega, 0.0, 0.0)


@inner
def gap_of(system, teeth, s, side):
    """Return gap [m], gap rate [m/s] and the loose gear's lever [m] of one side."""
    angle, speed, _ = drive_at(system.motion, s.time)
    gap, by_drive, by_loose, _ = call_side(system.surfaces.side, (system.surfaces, teeth, side, angle, s.theta))
    return gap, by_drive * speed + by_loose * s.omega, by_loose


@inner
def move(s, blocks, arc, duration):
    """Move the loose gear along a path; return whether its state is a number."""
    if duration <= 0.0:
        return True
    until = arc.time + duration
    theta, omega = angle_after(arc, duration), speed_after(arc, duration)
    if not (math.isfinite(theta) and math.isfinite(omega)):
        return False
    s.samples = fill_flight(arc, until, blocks.times, s.samples, blocks.loose)
    s.time = until if until > arc.time else np.nextafter(arc.time, math.inf)
    s.theta, s.omega = theta, omega
    s.steps += 1
    return True


@inner
def begin_flight(s, side):
    """Clear contacts and passages under way: a flight begins from a flank."""
    s.left, s.height, s.entry, s.began, s.impulse = side, 0.0, 0.0, 0.0, 0.0
    s.flank, s.stays, s.turned, s.pushing = NOBODY, 0, 0, 1


@inner
def write_contact(s, blocks, side, began):
    """Log a permanent contact that ends now."""
    row = blocks.contacts[s.contacts]
    row[0], row[1], row[2] = side, began, s.time
    s.contacts += 1


@inner
def leave(s, blocks, side):
    """Separate from a flank; log its permanent contact."""
    if s.stays != 0:
        write_contact(s, blocks, side, s.began)
    s.place = FREE
    begin_flight(s, side)


@inner
def teeth_now(system, teeth, s, side):
    """Return which teeth touch on a side now."""
    angle, speed, _ = drive_at(system.motion, s.time)
    return touching_teeth(system.surfaces, teeth, side, (angle, s.theta), (speed, s.omega))


@inner
def write_impact(s, blocks, side, when, rates, impulse, height, teeth, met, theta):
    """Log an impact; ``teeth`` touched at the time ``met`` with the loose gear at ``theta``."""
    row = blocks.hits[s.impacts]
    row.time, row.flank, row.rate, row.rebound = when, side, rates[0], rates[1]
    row.impulse, row.height = impulse, height
    row.drive, row.loose, row.met, row.theta = teeth[0], teeth[1], met, theta
    s.impacts += 1


@inner
def met(system, teeth, s, side):
    """Return the fault of a gap that has just closed, or GO_ON, its rate [m/s] and the loose gear's lever [m]."""
    gap, rate, lever = gap_of(system, teeth, s, side)
    s.located = max(s.located, abs(gap))
    fault = GO_ON
    if abs(gap) > NEAR:
        s.fault, fault = gap, OPEN
    elif gap_of(system, teeth, s, 1 - side)[0] < -NEAR:
        fault = JAMS
    return fault, rate, lever


@inner
def rebound_of(system, rules, teeth, s, blocks, side, rate, lever):
    """Return rebound [m/s], speed of the loose gear after it [rad/s] and impulse [N s] by the law of impacts.

    A rebound too slow for separation ends in permanent contact: the place is then that flank.
    """
    draw = blocks.draws[s.draws]
    s.draws += 1
    rebound = coefficient(rules.restitution, rules.law, side, abs(rate), draw) * abs(rate)
    if rebound < rules.stick_velocity:
        soft = softly(system, s.time, rules.stick_velocity)
        if supporting(system, teeth, side, s.time, s.theta, soft)[1] >= 0.0:
            rebound = 0.0
            s.place = 1 + side
    after = s.omega + (rebound - rate) / lever
    return rebound, after, normal_impulse(system.inertia, lever, system.friction, (s.omega, after))
