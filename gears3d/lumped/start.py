"""The state that a run begins with."""

from __future__ import annotations

from math import inf

import numpy as np

from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.lumped import impacts, layout, series
from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner
from gears3d.lumped.cursors import walk
from gears3d.lumped.film_steps import settle_on_film
from gears3d.lumped.model import Model

STATES = ("active", "reverse", "free")


def start_state(start: str, tables: int = 0) -> np.ndarray:
    """Return the state from which the kernel works out where the run begins.

    Args:
        start: ``"active"`` or ``"reverse"``, riding on that flank if it holds, else leaving it with no relative
            speed; ``"free"``: in the middle of the backlash, with no relative speed.
        tables: how many the model has.

    Returns:
        The state, (STATE + 2*tables,).

    Raises:
        InputError: the start is unknown.

    >>> int(start_state("reverse")[layout.DEPARTED])
    1
    """
    if start not in STATES:
        raise InputError(Fault("start.state", f"is {start!r}", did_you_mean(start, STATES)))
    state = np.zeros(layout.STATE + 2 * tables)
    state[at.MODE], state[at.WITHIN], state[at.SENSE] = at.BEFORE, -1.0, 1.0
    state[at.DEPARTED] = STATES.index(start)
    return state


def refuse_jammed(m: Model, state: np.ndarray) -> None:
    """Refuse flanks that leave no backlash at the start.

    Args:
        m: the packed model.
        state: at time 0.

    Raises:
        InputError: there is none.
    """
    left = state[at.GAPS] + state[at.GAPS + 1]
    if left <= 0.0 and m.stiffness == 0.0:
        raise InputError(
            Fault(
                "mount.backlash",
                f"the gears are jammed at the start: {m.backlash:.6g} m and the flanks' deviations leave {left:.6g} m",
                "give more backlash or smaller deviations",
            )
        )


@inner
def begin(m, state, w):
    """Put the state on its flank, or into the middle of the backlash, at time 0."""
    start = int(state[at.DEPARTED])
    state[at.GUESS], state[at.LAST_IMPACT], state[at.LIFT] = inf, -inf, -1.0
    flank = 1 if start == 1 else 0
    for i in range(int(m[at.N_TABLES])):
        walk(m, state, i, 0.0)
    series.drive(m, state, 2, w)
    state[at.DRIVE_SPEED] = w[0, 0]
    for _ in range(50):  # the loose gear's deviation shifts its own angle
        away = series.deviation(m, state, 0, flank, 0.0)[0] + series.deviation(m, state, 1, flank, state[at.ANGLE])[0]
        state[at.DISPLACEMENT] = away if flank == 0 else m[at.BACKLASH] - away
        state[at.ANGLE] = state[at.DISPLACEMENT] / m[at.RADIUS_LOOSE]
    impacts.place_on_flank(m, state, flank, 0.0)
    if start == 2:
        _amid(m, state)
        state[at.MODE], state[at.DEPARTED] = at.FREE, 0.0
        impacts.let_go(m, state, w)
    elif impacts.holds(m, state, flank, w):
        if m[at.FLOOR] > 0.0:
            state[at.PASSED], state[at.WITHIN] = 1.0, flank
        if m[at.STIFFNESS] > 0.0:
            _sink(m, state, flank, w[at.REACTION, 0])
            impacts.let_go(m, state, w)
        else:
            impacts.stick(m, state, flank)
    elif m[at.FLOOR] > 0.0:
        settle_on_film(m, state, flank, w)
    else:
        impacts.take_off(m, state, flank, w)


@inner
def _amid(m, state):
    """Put the loose gear amid the backlash, at rest before the active flank."""
    a1 = a2 = r1 = r2 = p1 = p2 = q1 = q2 = 0.0
    for _ in range(50):  # the loose gear's deviation shifts its own angle
        a1, p1 = series.deviation(m, state, 0, 0, 0.0)
        a2, p2 = series.deviation(m, state, 1, 0, state[at.ANGLE])
        r1, q1 = series.deviation(m, state, 0, 1, 0.0)
        r2, q2 = series.deviation(m, state, 1, 1, state[at.ANGLE])
        state[at.DISPLACEMENT] = 0.5 * (m[at.BACKLASH] + a1 + a2 - r1 - r2)
        state[at.ANGLE] = state[at.DISPLACEMENT] / m[at.RADIUS_LOOSE]
    omega = state[at.DRIVE_SPEED]
    state[at.SPEED] = (m[at.RADIUS_DRIVE] + p1) * omega / (m[at.RADIUS_LOOSE] - p2)
    state[at.GAPS] = state[at.GAPS + 1] = 0.5 * (m[at.BACKLASH] - a1 - a2 - r1 - r2)
    state[at.RATES], state[at.RATES + 1] = 0.0, -(p1 + q1) * omega - (p2 + q2) * state[at.SPEED]


@inner
def _sink(m, state, flank, reaction):
    """Rest on a yielding flank."""
    depth = reaction / m[at.STIFFNESS]
    state[at.GAPS + flank], state[at.GAPS + 1 - flank] = -depth, state[at.GAPS + 1 - flank] + depth
    state[at.DISPLACEMENT] += -depth if flank == 0 else depth
    state[at.ANGLE] = state[at.DISPLACEMENT] / m[at.RADIUS_LOOSE]
    state[at.MODE] = at.PRESSED + flank
    state[at.PASSED], state[at.ENTRY], state[at.CONTACT_SINCE] = 1.0, 0.0, 0.0
    state[at.DEPARTED] = flank
