"""The event-driven run of the rigid model: in closed form where it exists, by power series, or integrated."""

from __future__ import annotations

from math import inf, isfinite

import numpy as np

from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.integrator import DENSE, STAGES
from gears3d.lumped import layout
from gears3d.lumped import layout as at
from gears3d.lumped.closed_form import PATIENCE, SHORTEST
from gears3d.lumped.closed_form import advance as closed
from gears3d.lumped.compile import borrowed, entry, inner
from gears3d.lumped.compliant import KNOTS, compliant_step, go, size_of, wake
from gears3d.lumped.cursors import walk
from gears3d.lumped.forces import imposed, material
from gears3d.lumped.impacts import holds, let_go, place_on_flank, reaction, stick, take_off
from gears3d.lumped.model import Model
from gears3d.lumped.steps import contact_step, free_step

STATES = ("active", "reverse", "free")
FIRST_STEP = 1e-6  # first step of the integrator, unless it is too long [s]


def start_state(start: str, tables: int = 0) -> np.ndarray:
    """Return the state (STATE + 2*tables,) from which the kernel finds where the run begins.

    ``"active"`` or ``"reverse"`` is in contact with that flank if contact holds, else separating from it with no
    relative speed; ``"free"`` is in the middle of the backlash, with no relative speed. Another start is an InputError.

    >>> int(start_state("reverse")[layout.DEPARTED])
    1
    """
    if start not in STATES:
        raise InputError(Fault("start.state", f"is {start!r}", did_you_mean(start, STATES)))
    state = np.zeros(layout.STATE + 2 * tables)
    state[at.MODE], state[at.WITHIN] = at.BEFORE, -1.0
    state[at.DEPARTED] = STATES.index(start)
    return state


def refuse_jammed(m: Model, state: np.ndarray) -> None:
    """Raise an InputError for flanks without backlash in the state at time 0."""
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
def begin(m, state):
    """Put the state on its flank, or into the middle of the backlash, at time 0."""
    start = int(state[at.DEPARTED])
    state[at.GUESS], state[at.LAST_IMPACT], state[at.LIFT], state[at.STEP] = inf, -inf, -1.0, FIRST_STEP
    flank = 1 if start == 1 else 0
    for i in range(int(m[at.N_TABLES])):
        walk(m, state, i, 0.0)
    state[at.DRIVE_SPEED] = imposed(m, state, 0.0)[1]
    for _ in range(50):  # the loose gear's deviation shifts its own angle
        drive, loose = material(m, state, 0, 0.0), material(m, state, 1, state[at.ANGLE])
        away = drive[0] + loose[0] if flank == 0 else m[at.BACKLASH] - drive[3] - loose[3]
        state[at.DISPLACEMENT], state[at.ANGLE] = away, away / m[at.RADIUS_LOOSE]
    place_on_flank(m, state, flank, 0.0)
    if start == 2:
        _amid(m, state)
        state[at.MODE], state[at.DEPARTED] = at.FREE, 0.0
    _awake(m, state)
    if start == 2:
        let_go(m, state)
    elif m[at.FLOOR] == 0.0 and m[at.STIFFNESS] == 0.0:
        if holds(m, state, flank):
            stick(m, state, flank)
        else:
            take_off(m, state, flank)
    else:
        _settle(m, state, flank)


@inner
def _awake(m, state):
    """Set the direction of the oil flow, the squeezed films, and the carried body at the loose gear's speed."""
    for flank in range(2):
        state[at.SQUEEZED + flank] = 1.0 if state[at.RATES + flank] < 0.0 else 0.0
    if m[at.DEVIATES] == 0.0:  # one gap opens as the other closes
        state[at.SQUEEZED + 1] = 1.0 - state[at.SQUEEZED]
    rolling = m[at.ROLL_DRIVE] * state[at.DRIVE_SPEED] + m[at.ROLL_LOOSE] * state[at.SPEED]
    state[at.SENSE] = -1.0 if rolling < 0.0 else 1.0


@inner
def _amid(m, state):
    """Put the loose gear in the middle of the backlash, at rest relative to the active flank."""
    a1 = a2 = r1 = r2 = p1 = p2 = q1 = q2 = 0.0
    for _ in range(50):  # the loose gear's deviation shifts its own angle
        a1, p1, _, r1, q1, _ = material(m, state, 0, 0.0)
        a2, p2, _, r2, q2, _ = material(m, state, 1, state[at.ANGLE])
        state[at.DISPLACEMENT] = 0.5 * (m[at.BACKLASH] + a1 + a2 - r1 - r2)
        state[at.ANGLE] = state[at.DISPLACEMENT] / m[at.RADIUS_LOOSE]
    omega = state[at.DRIVE_SPEED]
    state[at.SPEED] = (m[at.RADIUS_DRIVE] + p1) * omega / (m[at.RADIUS_LOOSE] - p2)
    state[at.GAPS] = state[at.GAPS + 1] = 0.5 * (m[at.BACKLASH] - a1 - a2 - r1 - r2)
    state[at.RATES], state[at.RATES + 1] = 0.0, -(p1 + q1) * omega - (p2 + q2) * state[at.SPEED]


@inner
def _settle(m, state, flank):
    """Begin at rest where film and compliant teeth carry the load, on the bare flank, or where no force acts.

    The force that a bare flank would have to add to theirs vanishes there.
    """
    side, oil = 1.0 if flank == 0 else -1.0, m[at.FLOOR] > 0.0
    room, place = state[at.GAPS + 1 - flank], state[at.DISPLACEMENT]
    short = reaction(m, state, flank, 0.0)
    low, high = 0.0, 0.5 * room
    if short > 0.0:
        if m[at.STIFFNESS] == 0.0:
            stick(m, state, flank)
            state[at.PASSED], state[at.WITHIN] = 1.0, flank
            return
        low, high = -2.0 * short / m[at.STIFFNESS] - (m[at.LAYER] if m[at.PUBLISHED] > 0.0 else 0.0), 0.0
        state[at.INSIDE + flank], state[at.MODE] = at.PUSHES, at.PRESSED + flank
    for _ in range(200):
        gap = 0.5 * (low + high)
        state[at.DISPLACEMENT] = place + side * gap
        if reaction(m, state, flank, 0.0) > 0.0:
            high = gap
        else:
            low = gap
    gap = 0.5 * (low + high)
    if short <= 0.0 and gap > 0.499 * room:
        gap = m[at.FELT] if oil else 0.0
    state[at.DISPLACEMENT] = place + side * gap
    state[at.ANGLE] += side * gap / m[at.RADIUS_LOOSE]
    state[at.GAPS + flank], state[at.GAPS + 1 - flank] = gap, room - gap
    if short <= 0.0:
        take_off(m, state, flank)
        state[at.LIFT] = -1.0
    if short > 0.0 or (oil and gap < m[at.FELT]):
        state[at.PASSED], state[at.WITHIN], state[at.DEPARTED] = 1.0, flank, flank
    let_go(m, state)


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
