"""The compiled loop of located contact: from one query of Bullet to the next, step by step.

Each step is shortened so that the refined gap closes at its end. There the impact law acts as an impulse at the contact
point along the flank's normal, through the generalised inertia that the contact Jacobian gives; rebounds below the
stick velocity become permanent contact, kept on the measured gap until the flank would have to pull.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gears3d.engine.carried import INERTIA, PART, body_among, follow, foresee, resolved
from gears3d.engine.closing import CLOSES_ACTIVE, CLOSES_REVERSE, STOPS, TOUCH, ContactSystem, plan_flight
from gears3d.engine.compile import entry, inner
from gears3d.engine.faults import SUNK
from gears3d.engine.log import fill_contact
from gears3d.engine.motion import drive_at
from gears3d.engine.moving import (
    DONE,
    FULL,
    GO_ON,
    JAMS,
    NO_NUMBER,
    QUERY,
    SINKS,
    STANDS,
    Blocks,
    Rules,
    gap_of,
    here,
    leave,
    move,
)
from gears3d.engine.nearby import until_edge
from gears3d.engine.passages import bounce, passage_step
from gears3d.engine.sustained_contact import HELD, MEETS, on_flank, plan_contact, softly
from gears3d.engine.torques import FREE, until_kink

STANDSTILL = 2000  # successive events without progress in time after which the run is given up
ROOM = 3  # largest number of impacts or contacts that one step may write


@inner
def _rigid_step(system, rules, teeth, s, blocks, work, longest):
    """Do one step between rigid flanks; return the fault, or GO_ON."""
    if s.place != FREE:
        return _ride(system, rules, teeth, s, blocks, longest)
    duration, arc, event, top = plan_flight(system, teeth, here(s), longest, s.left)
    s.height = max(s.height, top)
    if not move(s, blocks, arc, duration):
        return NO_NUMBER
    if event == STOPS:
        s.omega = 0.0
    if event in (CLOSES_ACTIVE, CLOSES_REVERSE):
        return bounce(system, rules, teeth, s, blocks, event - CLOSES_ACTIVE)
    return GO_ON


@inner
def _forced_step(system, rules, teeth, s, blocks, work, longest):
    """Do one step between compliant or lubricated flanks, or with a carried body; return the fault, or GO_ON."""
    if s.place != FREE and rules.springs.shape[0] == 0:
        s.fresh = 0
        return _ride(system, rules, teeth, s, blocks, longest)
    return passage_step(system, rules, teeth, s, blocks, work, longest)


@inner
def _ride(system, rules, teeth, s, blocks, longest):
    """Do one step of permanent contact with a rigid flank, and its event; return the fault, or GO_ON."""
    side = s.place - 1
    fault, event = _hold(system, rules, teeth, s, blocks, longest)
    if event == HELD:
        return fault
    if system.film.minimum == 0.0:
        leave(s, blocks, side)
    else:  # still within its film
        s.place, s.squeezed[side] = FREE, 0
    if fault != GO_ON or event != MEETS:
        return fault
    return bounce(system, rules, teeth, s, blocks, side)


@inner
def _hold(system, rules, teeth, s, blocks, longest):
    """Follow the flank in permanent contact; return the fault, or GO_ON, and how the step ends."""
    side = s.place - 1
    gap = gap_of(system, teeth, s, side)[0]
    if gap < -SUNK:
        s.fault = -gap
        return SINKS, HELD
    body, begin = body_among(system.torques), (s.time, s.theta, s.omega)
    if body >= 0:
        spring = system.torques[body]
        twist, rate = s.body[0] - s.theta, s.body[1] - s.omega
        longest = min(longest, PART * resolved(spring, 1.0 / spring[INERTIA], twist, rate))
        foresee(system, teeth, spring, s, longest)
    soft = softly(system, s.time, rules.stick_velocity)
    duration, event, row = plan_contact(system, teeth, side, here(s), longest, soft)
    if duration > 0.0:
        fault = _follow(system, teeth, teeth[row : row + 1], s, blocks, side, duration)
        if fault != GO_ON:
            return fault, HELD
        if body >= 0:
            follow(system.torques[body], begin, s)
    return GO_ON, event


@inner
def _follow(system, teeth, held, s, blocks, side, duration):
    """Put the loose gear on the held teeth at the end of a step; check the gap of the other flank."""
    until = s.time + duration
    theta, omega = on_flank(system, held, side, until, s.theta + s.omega * duration)
    if not (math.isfinite(theta) and math.isfinite(omega)):
        return NO_NUMBER
    ends = (s.time, s.theta, s.omega, until, theta, omega)
    s.samples = fill_contact(system, held, side, ends, blocks.times, s.samples, blocks.loose)
    s.time, s.theta, s.omega = until, theta, omega
    s.steps += 1
    return JAMS if gap_of(system, teeth, s, 1 - side)[0] < -TOUCH else GO_ON


def _looped(step: Any) -> Any:
    """Return the loop over one kind of step."""

    @entry
    def advance(
        system: ContactSystem,
        rules: Rules,
        near: tuple[np.ndarray, np.ndarray],
        state: np.ndarray,
        blocks: Blocks,
        work: tuple[np.ndarray, ...],
        ends: tuple[int, bool],
    ) -> int:
        """Continue a run until Python is needed, and return why the loop returns.

        ``near`` holds windows of near teeth, and their rows, see :class:`gears3d.engine.nearby.Nearby`; ``state`` is
        one item of type ``STATE``, changed; ``work`` is of :func:`gears3d.engine.forced.workspace`; ``ends`` is the
        number of steps after which the loop returns, and whether the samples continue in another block.
        """
        table, rows = near
        s = state[0]
        last = blocks.times.size - 1
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
                angle = drive_at(system.motion, s.time)[0]
                window = math.floor(angle / rules.width) % table.shape[0]
                first, end = table[window, 0], table[window, 1]
                if end == 0 or table[window, 2] == 0 or not abs(angle - s.asked) <= rules.compare_after:
                    return QUERY
                longest = until_edge(system.motion, s.time, rules.width, (longest, rules.stretched_step))
            kink = until_kink(system.torques, system.inertia, s.place, s.time, s.theta, s.omega)
            longest = min(longest, rules.duration - s.time, kink)
            if ends[1] and blocks.times[last] < s.time + longest:
                if s.samples > 0:
                    return FULL
                longest = blocks.times[last] - s.time
            before = s.time
            fault = step(system, rules, rows[first:end], s, blocks, work, longest)
            if fault != GO_ON:
                return fault
            s.standing = 0 if s.time > before else s.standing + 1
            if s.standing > STANDSTILL:
                return STANDS
        return GO_ON

    return advance


advance_rigid: Any = _looped(_rigid_step)  # the loop of rigid flanks, with impulses
advance_forced: Any = _looped(_forced_step)  # the loop of compliant or lubricated flanks and of carried bodies
