"""The compiled loop of located contact: from one query of Bullet to the next, step by step.

Each step is shortened so that the refined gap closes at its end. There the impact law acts as an impulse at the contact
point along the flank's normal, through the generalised inertia that the contact Jacobian gives; rebounds below the
stick velocity become permanent contact, kept on the measured gap until the flank would have to pull.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gears3d.engine.carried import body_among, follow, foresee, reach_of
from gears3d.engine.closing import CLOSES_ACTIVE, CLOSES_REVERSE, STOPS, TOUCH, Plant, plan_flight
from gears3d.engine.compile import entry, inner
from gears3d.engine.faults import SUNK
from gears3d.engine.forced import AT_REST, CLEARS, FLIPS, HALTS, Forces, plan_forced
from gears3d.engine.holding import HELD, MEETS, on_flank, plan_contact, softly
from gears3d.engine.log import fill_contact
from gears3d.engine.motion import drive_at
from gears3d.engine.moving import (
    DONE,
    FULL,
    GO_ON,
    JAMS,
    NO_NUMBER,
    NOBODY,
    QUERY,
    SINKS,
    STANDS,
    Blocks,
    Rules,
    begin_flight,
    gap_of,
    here,
    leave,
    met,
    move,
    note,
    rebound_of,
)
from gears3d.engine.nearby import until_edge
from gears3d.engine.oiled import leave_film, strike_film, swim
from gears3d.engine.pressing import lasting, pressed_step
from gears3d.engine.torques import FREE, until_kink

STANDSTILL = 2000  # successive events without progress in time after which the run is given up
ROOM = 3  # largest number of impacts or contacts that one step may write


@inner
def _rigid_step(plant, rules, teeth, s, blocks, longest):
    """Do one step between rigid flanks; return the fault, or GO_ON."""
    if s.place == FREE:
        fault, side = _fly(plant, teeth, s, blocks, longest)
        closes = side != NOBODY
    else:
        side = s.place - 1
        fault, event = _hold(plant, rules, teeth, s, blocks, longest)
        closes = event == MEETS
        if event != HELD:
            leave(s, blocks, side)
    if fault != GO_ON or not closes:
        return fault
    fault, rate, lever = met(plant, teeth, s, side)
    if fault != GO_ON:
        return fault
    rebound, after, impulse = rebound_of(plant, rules, teeth, s, blocks, side, rate, lever)
    note(plant, teeth, s, blocks, side, s.time, (rate, rebound), impulse)
    s.omega = after
    begin_flight(s, side)
    if s.place != FREE:
        s.began, s.stays = s.time, 1
        s.theta, s.omega = on_flank(plant, teeth, side, s.time, s.theta)
    return GO_ON


@inner
def _soft_step(plant, rules, teeth, s, blocks, longest):
    """Do one step between compliant or lubricated flanks; return the fault, or GO_ON."""
    if s.place != FREE and rules.springs.shape[0] == 0:
        side = s.place - 1
        fault, event = _hold(plant, rules, teeth, s, blocks, longest)
        if event != HELD:
            leave_film(s, side)
        if event == MEETS:
            return strike_film(plant, rules, teeth, s, blocks, side)
        return fault
    if plant.film.minimum > 0.0:
        return swim(plant, rules, teeth, s, blocks, longest)
    if s.place != FREE:
        return _press(plant, rules, teeth, s, blocks, longest)
    fault, side = _fly(plant, teeth, s, blocks, longest)
    if fault != GO_ON or side == NOBODY:
        return fault
    fault, rate, _ = met(plant, teeth, s, side)
    s.entry, s.began, s.impulse = rate, s.time, 0.0
    s.place = 1 + side
    return fault


@inner
def _fly(plant, teeth, s, blocks, longest):
    """Do one step of a flight; return the fault, or GO_ON, and the flank whose gap closes at its end, or NOBODY."""
    duration, arc, event, top = plan_flight(plant, teeth, here(s), longest, s.left)
    s.height = max(s.height, top)
    if not move(s, blocks, arc, duration):
        return NO_NUMBER, NOBODY
    if event == STOPS:
        s.omega = 0.0
    return GO_ON, event - CLOSES_ACTIVE if event in (CLOSES_ACTIVE, CLOSES_REVERSE) else NOBODY


@inner
def _hold(plant, rules, teeth, s, blocks, longest):
    """Follow the flank in permanent contact; return the fault, or GO_ON, and how the step ends."""
    side = s.place - 1
    gap = gap_of(plant, teeth, s, side)[0]
    if gap < -SUNK:
        s.fault = -gap
        return SINKS, HELD
    soft = softly(plant, s.time, rules.stick_velocity)
    duration, event, row = plan_contact(plant, teeth, side, here(s), longest, soft)
    if duration > 0.0:
        fault = _follow(plant, teeth, teeth[row : row + 1], s, blocks, side, duration)
        if fault != GO_ON:
            return fault, HELD
    return GO_ON, event


@inner
def _follow(plant, teeth, held, s, blocks, side, duration):
    """Put the loose gear on the held teeth at the end of a step; check the gap of the other flank."""
    until = s.time + duration
    theta, omega = on_flank(plant, held, side, until, s.theta + s.omega * duration)
    if not (math.isfinite(theta) and math.isfinite(omega)):
        return NO_NUMBER
    ends = (s.time, s.theta, s.omega, until, theta, omega)
    s.samples = fill_contact(plant, held, side, ends, blocks.times, s.samples, blocks.loose)
    s.time, s.theta, s.omega = until, theta, omega
    s.steps += 1
    return JAMS if gap_of(plant, teeth, s, 1 - side)[0] < -TOUCH else GO_ON


@inner
def _press(plant, rules, teeth, s, blocks, longest):
    """Compliant contact: one short step under the gap's own force; a passage that lasts is permanent contact."""
    side, springs = s.place - 1, rules.springs
    mass = plant.inertia / gap_of(plant, teeth, s, side)[2] ** 2
    longest = min(longest, rules.share * pressed_step(springs, mass))
    forces = Forces(AT_REST, (False, False), side, s.pushing != 0, side)
    duration, arc, impulse, end = plan_forced(plant, teeth, springs, forces, here(s), (longest, 1.0))
    s.impulse += impulse
    if not move(s, blocks, arc, duration):
        return NO_NUMBER
    gap, rate, _ = gap_of(plant, teeth, s, side)
    if gap < -rules.deepest:
        s.fault = -gap
        return SINKS
    # only one flank has a force of its own here
    if gap < -TOUCH and gap_of(plant, teeth, s, 1 - side)[0] < -TOUCH:
        return JAMS
    if s.stays == 0 and s.time - s.began > lasting(springs, mass):
        s.stays = 1
        note(plant, teeth, s, blocks, side, s.began, (s.entry, 0.0), -mass * s.entry)
    if end == HALTS:
        s.omega = 0.0
    elif end == FLIPS + side:
        s.pushing = 1 - s.pushing
    elif end == CLEARS + side:
        if s.stays == 0:
            note(plant, teeth, s, blocks, side, s.began, (s.entry, rate), s.impulse)
        leave(s, blocks, side)
    return GO_ON


def _looped(step: Any) -> Any:
    """Return the loop over one kind of step."""

    @entry
    def advance(
        plant: Plant,
        rules: Rules,
        near: tuple[np.ndarray, np.ndarray],
        state: np.ndarray,
        blocks: Blocks,
        ends: tuple[int, bool],
    ) -> int:
        """Continue a run until Python is needed, and return why the loop returns.

        ``near`` holds windows of near teeth, and their rows, see :class:`gears3d.engine.nearby.Nearby`; ``state`` is
        one item of type ``STATE``, changed; ``ends`` is the number of steps after which the loop returns, and whether
        the samples continue in another block.
        """
        table, rows = near
        s = state[0]
        last, body = blocks.times.size - 1, body_among(plant.torques)
        for _ in range(ends[0]):
            if s.time >= rules.duration:
                return DONE
            if max(s.impacts + ROOM - blocks.hits.size, s.contacts + ROOM - blocks.contacts.shape[0]) > 0:
                return FULL
            if s.draws + ROOM > blocks.draws.size:
                return FULL
            longest = rules.longest_step
            first, end = 0, 0
            if rules.width > 0.0:
                angle = drive_at(plant.motion, s.time)[0]
                window = math.floor(angle / rules.width) % table.shape[0]
                first, end = table[window, 0], table[window, 1]
                if end == 0 or not abs(angle - s.asked) <= rules.compare_after:
                    return QUERY
                longest = until_edge(plant.motion, s.time, rules.width, (longest, rules.stretched_step))
            kink = until_kink(plant.torques, plant.inertia, s.place, s.time, s.theta, s.omega)
            longest = min(longest, rules.duration - s.time, kink)
            if ends[1] and blocks.times[last] < s.time + longest:
                if s.samples > 0:
                    return FULL
                longest = blocks.times[last] - s.time
            before, theta, omega, accel, place, impacts = s.time, s.theta, s.omega, 0.0, s.place, s.impacts
            rigid = rules.springs.shape[0] == 0
            if body >= 0:
                longest = min(longest, reach_of(plant.torques[body], plant.inertia))
                held = place != FREE and rigid
                accel = foresee(plant, rows[first:end], plant.torques[body], held, s, longest)
            fault = step(plant, rules, rows[first:end], s, blocks, longest)
            if body >= 0:
                free = place == FREE and plant.film.minimum == 0.0
                smooth = place != FREE and s.impacts == impacts
                follow(plant.torques[body], free, (before, theta, omega, accel), s, smooth)
            if fault != GO_ON:
                return fault
            s.standing = 0 if s.time > before else s.standing + 1
            if s.standing > STANDSTILL:
                return STANDS
        return GO_ON

    return advance


advance_rigid: Any = _looped(_rigid_step)  # the loop of rigid flanks, with impulses
advance_soft: Any = _looped(_soft_step)  # the loop of compliant or lubricated flanks
