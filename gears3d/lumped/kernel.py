"""The event-driven run of the rigid model: in closed form where there is one, else over power series."""

from __future__ import annotations

from math import isfinite

import numpy as np

from gears3d.lumped import layout as at
from gears3d.lumped.closed_kernel import PATIENCE, SHORTEST
from gears3d.lumped.closed_kernel import advance as closed
from gears3d.lumped.compile import borrowed, entry
from gears3d.lumped.film_steps import film_step, hush
from gears3d.lumped.start import begin
from gears3d.lumped.steps import contact_step, free_step, spring_step


def _compiled(oiled: bool):
    @entry
    def advance(m, state, count, w, impacts, contacts, samples, spacing, end):
        m, state, count = borrowed(m), borrowed(state), borrowed(count)
        w, samples = borrowed(w), borrowed(samples)
        impacts, contacts = borrowed(impacts), borrowed(contacts)
        if state[at.MODE] == at.BEFORE:
            begin(m, state, w)
        while state[at.TIME] < end:
            if count[at.N_IMPACTS] >= impacts.shape[0]:
                return at.IMPACTS_FULL
            if count[at.N_CONTACTS] >= contacts.shape[0]:
                return at.CONTACTS_FULL
            mode = state[at.MODE]
            if oiled and (mode == at.FREE or mode >= at.PRESSED):
                film_step(m, state, count, w, samples, spacing, end - state[at.TIME])
            elif mode == at.FREE:
                free_step(m, state, count, w, samples, spacing, end - state[at.TIME])
            elif mode < at.PRESSED:
                contact_step(m, state, count, w, samples, spacing, end - state[at.TIME])
            else:
                spring_step(m, state, count, w, samples, spacing, end - state[at.TIME])
            if oiled and at.STUCK <= mode < at.PRESSED:
                hush(count)
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
        return at.DONE

    return advance


dry, oiled = (_compiled(oiled) for oiled in (False, True))


def advance(m: np.ndarray, state: np.ndarray, count: np.ndarray, out: at.Buffers, end: float) -> int:
    """Move the state to the time ``end`` or to the first buffer that is full, and return how it ended.

    Compiled three times: for what has a closed form, for all other effects, and for those with an oil film.

    Args:
        m: the packed model, flat.
        state: moved on.
        count: counters, moved on.
        out: buffers, filled.
        end: [s].

    Returns:
        How it ended, one of those in :mod:`gears3d.lumped.layout`.
    """
    tables = (out.impacts, out.contacts, out.samples, out.spacing, end)
    if m[at.SIMPLE] > 0.0:
        return closed(m, state, count, *tables)
    return (oiled if m[at.FLOOR] > 0.0 else dry)(m, state, count, out.work, *tables)
