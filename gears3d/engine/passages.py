"""Impacts of compliant or lubricated flanks, compiled: passages, from their begin to their end.

A film of oil turns most approaches back before the flanks touch. An impact is here a passage: the gap falls below the
height at which the film begins to act, and rises above it again; speed and rebound are those at that height, the
impulse is that of film and flank together. A gear that turns towards the flank a second time within a passage is in
contact over oil. As the oil becomes thinner, passages become impacts of the bare flanks. Without oil a passage begins
where compliant flanks touch and ends where they separate; one that lasts is permanent contact.
"""

from __future__ import annotations

import math

from gears3d.engine.compile import inner
from gears3d.engine.forced import BORDERS, FLIPS, STOPS, TOUCHES, TURNS, forced_step
from gears3d.engine.moving import (
    GO_ON,
    JAMS,
    NEAR,
    NOBODY,
    SINKS,
    begin_flight,
    gap_of,
    met,
    rebound_of,
    teeth_now,
    write_contact,
    write_impact,
)
from gears3d.engine.sustained_contact import on_flank
from gears3d.engine.torques import FREE

LASTING = 10.0 * math.pi  # phase of the oscillation on compliant flanks after which contact is permanent [rad]


@inner
def passage_step(system, rules, teeth, s, blocks, work, longest):
    """Do one step under forces of the gap, and its event; return the fault, or GO_ON."""
    fault, event = forced_step(system, rules, teeth, s, blocks, work, longest)
    if fault != GO_ON:
        return fault
    if s.place != FREE:
        side, springs = s.place - 1, rules.springs
        gap, _, lever = gap_of(system, teeth, s, side)
        if gap < -rules.deepest:
            s.fault = -gap
            return SINKS
        if gap < -NEAR and gap_of(system, teeth, s, 1 - side)[0] < -NEAR:
            return JAMS
        phase = (s.time - s.began) * math.sqrt(springs[0, 0] / system.inertia) * abs(lever)
        if system.film.minimum == 0.0 and phase > LASTING:
            _capture(system, teeth, s, blocks)
    if event > STOPS:
        return _happen(system, rules, teeth, s, blocks, event)
    return GO_ON


@inner
def _happen(system, rules, teeth, s, blocks, event):
    """Apply the changes of an event at one of the flanks."""
    if event < TOUCHES:
        side = event - TURNS
        if system.film.minimum == 0.0 or s.flank != side:
            return GO_ON
        if s.squeezed[side] == 0:
            s.turned = 1
        elif s.turned != 0:
            _capture(system, teeth, s, blocks)
    elif event < FLIPS:
        return _touch(system, rules, teeth, s, blocks, event - TOUCHES)
    elif event < BORDERS:
        s.pushing = 1 - s.pushing
    elif s.flank == NOBODY:
        _enter(system, teeth, s, event - BORDERS)
    else:
        _end(system, teeth, s, blocks)
    return GO_ON


@inner
def _touch(system, rules, teeth, s, blocks, side):
    """Begin contact of the flanks, by their impact law or their compliance, or end it."""
    dry = system.film.minimum == 0.0
    if s.place == 1 + side:
        s.place, s.pushing = FREE, 1
        if dry:
            _end(system, teeth, s, blocks)
        return GO_ON
    if rules.springs.shape[0] == 0:
        return bounce(system, rules, teeth, s, blocks, side)
    fault = met(system, teeth, s, side)[0]
    s.place, s.pushing, s.turned = 1 + side, 1, 1
    if dry:
        _enter(system, teeth, s, side)
    return fault


@inner
def _enter(system, teeth, s, side):
    """Begin a passage."""
    s.flank, s.began, s.entry, s.entry_height = side, s.time, gap_of(system, teeth, s, side)[1], s.height
    s.entry_drive, s.entry_loose = teeth_now(system, teeth, s, side)
    s.entry_theta, s.impulse, s.turned, s.stays = s.theta, 0.0, 0, 0


@inner
def _end(system, teeth, s, blocks):
    """End a passage, and log it or its contact."""
    if s.stays != 0:
        write_contact(s, blocks, s.flank, s.began)
    else:
        _write(s, blocks, gap_of(system, teeth, s, s.flank)[1], s.impulse)
    begin_flight(s, s.flank)


@inner
def _capture(system, teeth, s, blocks):
    """Log a passage that has become contact; its rebound is 0."""
    if s.stays == 0:
        s.stays = 1
        mass = system.inertia / gap_of(system, teeth, s, s.flank)[2] ** 2
        _write(s, blocks, 0.0, -mass * s.entry)


@inner
def _write(s, blocks, rebound, impulse):
    """Log the impact of a passage."""
    rates, teeth = (s.entry, rebound), (s.entry_drive, s.entry_loose)
    write_impact(s, blocks, s.flank, s.began, rates, impulse, s.entry_height, teeth, s.began, s.entry_theta)


@inner
def bounce(system, rules, teeth, s, blocks, side):
    """Apply the impact law to bare flanks that touch, under oil within a passage; return the fault, or GO_ON."""
    fault, rate, lever = met(system, teeth, s, side)
    if fault != GO_ON:
        return fault
    rebound, after, impulse = rebound_of(system, rules, teeth, s, blocks, side, rate, lever)
    dry = system.film.minimum == 0.0
    if dry:
        pair = teeth_now(system, teeth, s, side)
        write_impact(s, blocks, side, s.time, (rate, rebound), impulse, s.height, pair, s.time, s.theta)
        begin_flight(s, side)
    else:
        s.impulse += impulse
        s.turned, s.squeezed[side] = 1, 0
    s.omega = after
    if s.place != FREE:
        s.theta, s.omega = on_flank(system, teeth, side, s.time, s.theta)
        if dry:
            s.began, s.stays = s.time, 1
        else:
            _capture(system, teeth, s, blocks)
    return GO_ON
