"""The run of the rigid model in closed form: perfect flanks, no torque but a constant one, one harmonic of the drive.

It needs no power series and is small: the code for most scenarios compiles in seconds.
"""

from __future__ import annotations

from math import isfinite

from gears3d.lumped import layout as at
from gears3d.lumped.bounces import follow_bounces
from gears3d.lumped.compile import borrowed, entry
from gears3d.lumped.flank_events import begin
from gears3d.lumped.flights import follow_flight
from gears3d.lumped.sustained_contact import follow_contact

PATIENCE = 20_000  # A run is given up after so many successive steps whose mean is SHORTEST or less
SHORTEST = 1e-12  # mean length of a step without progress [s]


@entry
def advance(m, state, count, impacts, contacts, samples, spacing, end):
    """Advance the state as :func:`gears3d.lumped.kernel.advance` does, with samples ``spacing`` [s] apart."""
    m, state, count = borrowed(m), borrowed(state), borrowed(count)
    impacts, contacts, samples = borrowed(impacts), borrowed(contacts), borrowed(samples)
    if state[at.MODE] == at.BEFORE:
        begin(m, state)
    while state[at.TIME] < end:
        if count[at.N_IMPACTS] >= impacts.shape[0]:
            return at.IMPACTS_FULL
        if count[at.N_CONTACTS] >= contacts.shape[0]:
            return at.CONTACTS_FULL
        if state[at.MODE] >= at.STUCK:
            follow_contact(m, state, count, contacts, samples, spacing, end)
        elif not follow_bounces(m, state, count, impacts, samples, spacing, end):
            follow_flight(m, state, count, impacts, samples, spacing, end)
        count[at.STEPS] += 1
        if not (isfinite(state[at.DISPLACEMENT]) and isfinite(state[at.SPEED])):
            return at.BROKEN
        count[at.IDLE] += 1
        if count[at.IDLE] == PATIENCE:
            if state[at.TIME] - state[at.MARK] < PATIENCE * SHORTEST:
                return at.STANDSTILL
            count[at.IDLE], state[at.MARK] = 0, state[at.TIME]
    return at.DONE
