"""Located contact under oil, compiled: films act all the time, and passages through them count as impacts.

A film turns most approaches back before the flanks touch. An impact is here a passage: the gap falls below the height
at which the film begins to act, and rises above it again; speed and rebound are those at that height, the impulse is
that of film and flank together. A gear that turns towards the flank a second time within a passage is in contact over
oil. As the oil becomes thinner, passages become impacts of the bare flanks.
"""

from __future__ import annotations

from gears3d.engine.closing import TOUCH, highest
from gears3d.engine.compile import inner
from gears3d.engine.forced import (
    AT_REST,
    CLEARS,
    ENTERS,
    FLIPS,
    HALTS,
    LEAVES,
    TOUCHES,
    TURNS,
    Forces,
    plan_forced,
)
from gears3d.engine.holding import on_flank
from gears3d.engine.moving import (
    GO_ON,
    JAMS,
    NEAR,
    NO_NUMBER,
    NOBODY,
    SINKS,
    begin_flight,
    gap_of,
    here,
    met,
    move,
    rebound_of,
    teeth_now,
    write_contact,
    write_impact,
)
from gears3d.engine.pressing import pressed_step
from gears3d.engine.torques import FREE


@inner
def swim(plant, rules, teeth, s, blocks, longest):
    """Do one step under the films, and its event; return the fault, or GO_ON."""
    touching = s.place - 1 if s.place != FREE else NOBODY
    if touching != NOBODY:
        step = pressed_step(rules.springs, plant.inertia / gap_of(plant, teeth, s, touching)[2] ** 2)
        longest = min(longest, rules.share * step)
    forces = Forces(AT_REST, (s.squeezed[0] != 0, s.squeezed[1] != 0), touching, s.pushing != 0, s.flank)
    steps = (longest, rules.share)
    duration, arc, impulse, end = plan_forced(plant, teeth, rules.springs, forces, here(s), steps)
    s.height = max(s.height, highest(plant, teeth, s.left, arc, duration))
    s.film_impulse += impulse
    if not move(s, blocks, arc, duration):
        return NO_NUMBER
    if touching != NOBODY:
        gap = gap_of(plant, teeth, s, touching)[0]
        if gap < -rules.deepest:
            s.fault = -gap
            return SINKS
        if gap < -TOUCH and gap_of(plant, teeth, s, 1 - touching)[0] < -NEAR:
            return JAMS
    if end == HALTS:
        s.omega = 0.0
    elif end > HALTS:
        return _happen(plant, rules, teeth, s, blocks, end - end % 2, end % 2)
    return GO_ON


@inner
def _happen(plant, rules, teeth, s, blocks, event, side):
    """Apply the changes of an event at one of the flanks."""
    if event == TURNS:
        _turn(plant, teeth, s, blocks, side)
    elif event == TOUCHES:
        return strike_film(plant, rules, teeth, s, blocks, side)
    elif event == FLIPS:
        s.pushing = 1 - s.pushing
    elif event == CLEARS:
        s.place, s.pushing = FREE, 1
    elif event == ENTERS:
        _set_passage(s, side)
        s.film_began, s.film_entry, s.film_height = s.time, gap_of(plant, teeth, s, side)[1], s.height
        s.film_drive, s.film_loose = teeth_now(plant, teeth, s, side)
        s.film_theta = s.theta
    elif event == LEAVES:
        if s.film_stays != 0:
            write_contact(s, blocks, side, s.film_began)
        else:
            _write(s, blocks, gap_of(plant, teeth, s, side)[1], s.film_impulse)
        begin_flight(s, side)
        _set_passage(s, NOBODY)
    return GO_ON


@inner
def _set_passage(s, flank):
    """Begin a passage through the film of a flank, or with NOBODY end one."""
    s.flank, s.film_impulse, s.turned, s.film_stays = flank, 0.0, 0, 0


@inner
def _turn(plant, teeth, s, blocks, side):
    """Begin or end the squeeze of a film; a second approach within a passage is contact over oil."""
    s.squeezed[side] = 1 - s.squeezed[side]
    if s.flank != side:
        return
    if s.squeezed[side] == 0:
        s.turned = 1
    elif s.turned != 0:
        _capture(plant, teeth, s, blocks)


@inner
def _capture(plant, teeth, s, blocks):
    """Log a passage that has become contact; its rebound is 0."""
    if s.film_stays == 0:
        s.film_stays = 1
        mass = plant.inertia / gap_of(plant, teeth, s, s.flank)[2] ** 2
        _write(s, blocks, 0.0, -mass * s.film_entry)


@inner
def _write(s, blocks, rebound, impulse):
    """Log a passage."""
    rates, teeth = (s.film_entry, rebound), (s.film_drive, s.film_loose)
    write_impact(s, blocks, s.flank, s.film_began, rates, impulse, s.film_height, teeth, s.film_began, s.film_theta)


@inner
def strike_film(plant, rules, teeth, s, blocks, side):
    """The flanks touch during a passage: their impact law or their compliance acts."""
    fault, rate, lever = met(plant, teeth, s, side)
    if fault != GO_ON:
        return fault
    s.turned = 1
    if rules.springs.shape[0] > 0:
        s.place, s.pushing = 1 + side, 1
        return GO_ON
    _, after, impulse = rebound_of(plant, rules, teeth, s, blocks, side, rate, lever)
    s.omega = after
    s.film_impulse += impulse
    s.squeezed[side] = 0
    if s.place != FREE:
        s.theta, s.omega = on_flank(plant, teeth, side, s.time, s.theta)
        _capture(plant, teeth, s, blocks)
    return GO_ON


@inner
def leave_film(s, side):
    """Separate from the flank, still within its film."""
    s.place, s.squeezed[side] = FREE, 0
