"""The event-driven run of the rigid model, compiled once for every list of effects."""

from __future__ import annotations

import zlib
from math import isfinite
from pathlib import Path

from numba import njit

from gears3d.lumped.layout import (
    BEFORE,
    BROKEN,
    CONTACTS_FULL,
    DISPLACEMENT,
    DONE,
    FREE,
    IDLE,
    IMPACTS_FULL,
    MARK,
    MODE,
    N_CONTACTS,
    N_IMPACTS,
    PRESSED,
    SPEED,
    STANDSTILL,
    STEPS,
    TIME,
)  # fmt: skip
from gears3d.lumped.start import begin
from gears3d.lumped.steps import contact_step, free_step, spring_step

SOURCES = ("compile", "impacts", "kernel", "layout", "model", "roots", "series", "start", "steps")
"""The files whose functions are compiled into the kernel, and the model and layout that they depend on."""
PATIENCE = 20_000
"""So many steps in a row that are SHORTEST or less on average break a run off."""
SHORTEST = 1e-12
"""Mean length of a step that leads nowhere [s]."""


def _compiled(fingerprint: int):
    @njit(cache=True, nogil=True)
    def advance(m, state, count, out, end):
        if fingerprint == 0:
            return BROKEN
        if state[MODE] == BEFORE:
            begin(m, state, out)
        while state[TIME] < end:
            if count[N_IMPACTS] >= out.impacts.shape[0]:
                return IMPACTS_FULL
            if count[N_CONTACTS] >= out.contacts.shape[0]:
                return CONTACTS_FULL
            mode = state[MODE]
            if mode == FREE:
                free_step(m, state, count, out, end - state[TIME])
            elif mode < PRESSED:
                contact_step(m, state, count, out, end - state[TIME])
            else:
                spring_step(m, state, count, out, end - state[TIME])
            count[STEPS] += 1
            if not (isfinite(state[DISPLACEMENT]) and isfinite(state[SPEED])):
                return BROKEN
            count[IDLE] += 1
            if count[IDLE] == PATIENCE:
                if state[TIME] - state[MARK] < PATIENCE * SHORTEST:
                    return STANDSTILL
                count[IDLE], state[MARK] = 0, state[TIME]
        return DONE

    return advance


def _fingerprint() -> int:
    """Checksum of what is compiled: numba's cache looks only at this file's date, not at those it calls."""
    here = Path(__file__).parent
    return zlib.crc32(b"".join((here / f"{name}.py").read_bytes() for name in SOURCES)) or 1


advance = _compiled(_fingerprint())
"""``advance(model, state, counters, buffers, end)`` moves the state to the time ``end`` or to the first buffer that is
full, and returns how it ended (:mod:`gears3d.lumped.layout`)."""
