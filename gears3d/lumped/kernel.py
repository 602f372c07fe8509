"""The event-driven run of the rigid model: in closed form where it exists, by power series, or integrated."""

from __future__ import annotations

from math import isfinite

import numpy as np

from gears3d.integrator import DENSE, STAGES
from gears3d.lumped import layout as at
from gears3d.lumped.closed_kernel import PATIENCE, SHORTEST
from gears3d.lumped.closed_kernel import advance as closed
from gears3d.lumped.compile import borrowed, entry, inner
from gears3d.lumped.compliant import KNOTS, compliant_step, go, size_of, wake
from gears3d.lumped.start import begin
from gears3d.lumped.steps import contact_step, free_step


@inner
def _told(state, count, impacts, contacts):
    """Write the event at the end of a step into the tables; return whether the run is over, and why."""
    if count[at.HAS_IMPACT]:
        for i in range(at.IMPACT_COLUMNS):
            impacts[count[at.N_IMPACTS], i] = state[at.IMPACT_ROW + i]
        count[at.N_IMPACTS] += 1
    if count[at.HAS_CONTACT]:
        for i in range(3):
            contacts[count[at.N_CONTACTS], i] = state[at.CONTACT_ROW + i]
        count[at.N_CONTACTS] += 1
    count[at.HAS_IMPACT] = count[at.HAS_CONTACT] = 0
    count[at.STEPS] += 1
    if not (isfinite(state[at.DISPLACEMENT]) and isfinite(state[at.SPEED])):
        return at.BROKEN
    count[at.IDLE] += 1
    if count[at.IDLE] == PATIENCE:
        if state[at.TIME] - state[at.MARK] < PATIENCE * SHORTEST:
            return at.STANDSTILL
        count[at.IDLE], state[at.MARK] = 0, state[at.TIME]
    if count[at.N_IMPACTS] >= impacts.shape[0]:
        return at.IMPACTS_FULL
    return at.CONTACTS_FULL if count[at.N_CONTACTS] >= contacts.shape[0] else at.DONE


@entry
def dry(m, state, count, w, impacts, contacts, samples, spacing, end):
    """Run rigid models by power series; see :func:`advance`."""
    m, state, count = borrowed(m), borrowed(state), borrowed(count)
    w, samples = borrowed(w), borrowed(samples)
    impacts, contacts = borrowed(impacts), borrowed(contacts)
    if state[at.MODE] == at.BEFORE:
        begin(m, state)
    while state[at.TIME] < end:
        if state[at.MODE] == at.FREE:
            free_step(m, state, count, w, samples, spacing, end - state[at.TIME])
        else:
            contact_step(m, state, count, w, samples, spacing, end - state[at.TIME])
        ended = _told(state, count, impacts, contacts)
        if ended != at.DONE:
            return ended
    return at.DONE


@entry
def compliant(m, state, count, w, impacts, contacts, samples, spacing, end):
    """Run models with oil, compliant teeth or a carried body by the integrator; see :func:`advance`."""
    m, state, count, samples = borrowed(m), borrowed(state), borrowed(count), borrowed(samples)
    impacts, contacts = borrowed(impacts), borrowed(contacts)
    if state[at.MODE] == at.BEFORE:
        begin(m, state)
    n, events = size_of(m), KNOTS + 2 * int(m[at.N_TABLES])
    motions, functions = np.zeros((3, n)), np.zeros((4, events))
    stages, coefficients, just = np.zeros((STAGES, n)), np.zeros((DENSE + 1, n)), np.zeros(events, dtype=np.int64)
    y, end_y, between = borrowed(motions[0]), borrowed(motions[1]), borrowed(motions[2])
    g, ahead = borrowed(functions[0]), borrowed(functions[1])
    values, seen = borrowed(functions[2]), borrowed(functions[3])
    k, dense, held = borrowed(stages), borrowed(coefficients), borrowed(just)
    work = (y, end_y, between, k, dense, g, ahead, values, seen, held)
    wake(m, state, y, k, g)
    ended = at.DONE
    while state[at.TIME] < end and ended == at.DONE:
        compliant_step(m, state, count, samples, spacing, end, work)
        ended = _told(state, count, impacts, contacts)
    if ended != at.DONE:
        go(m, state, y, state[at.TIME])
    motions[0, 0] = functions[0, 0] = stages[0, 0] = coefficients[0, 0] = just[0] = 0  # kept alive to here
    return ended


def integrated(m: np.ndarray) -> bool:
    """Whether a flat packed model needs the integrator."""
    return bool(m[at.FLOOR] > 0.0 or m[at.STIFFNESS] > 0.0 or m[at.CARRIED] > 0.0)


def advance(m: np.ndarray, state: np.ndarray, count: np.ndarray, out: at.Buffers, end: float) -> int:
    """Advance the state to the time ``end`` [s] or to the first buffer that is full, and return why it ended.

    The reason is one of those in :mod:`gears3d.lumped.layout`. Three programs: closed form where it exists, power
    series for rigid flanks, the integrator for oil films, compliant teeth and carried bodies. State, counters and
    buffers are changed.
    """
    tables = (out.impacts, out.contacts, out.samples, out.spacing, end)
    if m[at.SIMPLE] > 0.0:
        return closed(m, state, count, *tables)
    return (compliant if integrated(m) else dry)(m, state, count, out.work, *tables)
