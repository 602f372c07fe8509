"""Impacts under oil: passages through the height from which on a film is felt, and stays in it."""

from __future__ import annotations

from gears3d.lumped.compile import inner
from gears3d.lumped.lubricated import layout as at


@inner
def note(p, state, flags, count, which, out, impacts, contacts):
    """Write down what a changed flag means for impacts and contacts.

    An impact has the speeds at the felt height, going in and coming out; a gear that turns back to the flank before it
    comes out is in contact, and its impact has no rebound.
    """
    flank = which % 2
    rate = out[at.GAP_RATE + flank]
    if which < at.INSIDE:
        if flags[which] == 1:  # the way out ends: the greatest distance from the other flank, or a turn back
            other = 1 - flank
            if state[at.LEFT] == flank:
                state[at.HIGHEST] = max(state[at.HIGHEST], out[at.GAP + flank])
            if flags[at.NEAR + flank] == 1 and state[at.TURNED] == 1.0 and state[at.STAYS] == 0.0 and other >= 0:
                state[at.STAYS] = 1.0
                _impact(p, state, count, flank, 0.0, out, impacts)
        elif flags[at.NEAR + flank] == 1:
            state[at.TURNED] = 1.0
    elif which < at.NEAR:
        if flags[which] == 1:
            count[at.TOUCHES] += 1
    elif flags[which] == 1:
        state[at.ENTRY], state[at.ENTRY_RATE], state[at.ENTRY_SPEED] = state[at.TIME], rate, out[at.OMEGA_LOOSE]
        state[at.TURNED], state[at.STAYS] = 0.0, 0.0
        if state[at.LEFT] != flank:
            state[at.HIGHEST] = p[at.BACKLASH] - out[at.GAP + flank]
    else:
        if state[at.STAYS] == 0.0:
            _impact(p, state, count, flank, rate, out, impacts)
        else:
            row = contacts[count[at.CONTACTS]]
            row[0], row[1], row[2] = float(flank), state[at.ENTRY], state[at.TIME]
            count[at.CONTACTS] += 1
        state[at.STAYS], state[at.TURNED] = 0.0, 0.0
        state[at.LEFT], state[at.HIGHEST] = float(flank), out[at.GAP + flank]


@inner
def _impact(p, state, count, flank, rebound, out, impacts):
    """Write an impact: time, flank, speed in and out, impulse, displacement, height of the flight before."""
    if count[at.IMPACTS] >= len(impacts):
        return
    sign = 1.0 if flank == 0 else -1.0
    taken = (p[at.TORQUE] + p[at.VISCOUS] * out[at.OMEGA_LOOSE]) / p[at.RADIUS_LOOSE]
    gained = p[at.MASS] * p[at.RADIUS_LOOSE] * (out[at.OMEGA_LOOSE] - state[at.ENTRY_SPEED])
    row = impacts[count[at.IMPACTS]]
    row[0], row[1] = state[at.ENTRY], float(flank)
    row[2], row[3] = sign * state[at.ENTRY_RATE], sign * rebound
    row[4] = gained + taken * (state[at.TIME] - state[at.ENTRY])
    row[5] = p[at.FELT] if flank == 0 else p[at.BACKLASH] - p[at.FELT]
    row[6] = max(state[at.HIGHEST] - p[at.FELT], 0.0)
    count[at.IMPACTS] += 1
