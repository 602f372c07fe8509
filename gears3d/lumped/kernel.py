"""The event-driven run of the rigid model, compiled once for every list of effects."""

from __future__ import annotations

import zlib
from math import isfinite
from pathlib import Path

from gears3d.kernels import njit
from gears3d.lumped import layout as at
from gears3d.lumped.bounces import bounce_on, eligible, ride
from gears3d.lumped.compile import borrowed
from gears3d.lumped.start import begin
from gears3d.lumped.steps import contact_step, free_step, spring_step

SOURCES = ("bounces", "compile", "impacts", "kernel", "layout", "model", "roots", "series", "start", "steps")
"""The files whose functions are compiled into the kernel, and the model and layout that they depend on."""
PATIENCE = 20_000
"""So many steps in a row that are SHORTEST or less on average break a run off."""
SHORTEST = 1e-12
"""Mean length of a step that leads nowhere [s]."""


def _compiled(fingerprint: int):
    @njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
    def advance(m, state, count, out, end):
        if fingerprint == 0:
            return at.BROKEN
        m, state, count = borrowed(m), borrowed(state), borrowed(count)
        w, samples, spacing = borrowed(out.work), borrowed(out.samples), out.spacing
        impacts, contacts = borrowed(out.impacts), borrowed(out.contacts)
        if state[at.MODE] == at.BEFORE:
            begin(m, state, w)
        while state[at.TIME] < end:
            if count[at.N_IMPACTS] >= impacts.shape[0]:
                return at.IMPACTS_FULL
            if count[at.N_CONTACTS] >= contacts.shape[0]:
                return at.CONTACTS_FULL
            mode = state[at.MODE]
            if mode == at.FREE and eligible(m, state):
                if not bounce_on(m, state, count, impacts, spacing, samples.shape[0], end, w):
                    free_step(m, state, count, w, samples, spacing, end - state[at.TIME])
            elif mode == at.FREE:
                free_step(m, state, count, w, samples, spacing, end - state[at.TIME])
            elif mode < at.PRESSED:
                if m[at.SIMPLE] == 0.0 or not ride(m, state, count, spacing, samples.shape[0], end, w):
                    contact_step(m, state, count, w, samples, spacing, end - state[at.TIME])
            else:
                spring_step(m, state, count, w, samples, spacing, end - state[at.TIME])
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


def _fingerprint() -> int:
    """Checksum of what is compiled: numba's cache looks only at this file's date, not at those it calls."""
    here = Path(__file__).parent
    return zlib.crc32(b"".join((here / f"{name}.py").read_bytes() for name in SOURCES)) or 1


advance = _compiled(_fingerprint())
"""``advance(model, state, counters, buffers, end)`` moves the state to the time ``end`` or to the first buffer that is
full, and returns how it ended (:mod:`gears3d.lumped.layout`)."""
