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
    IMPACTS_FULL,
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

PATIENCE = 10_000
"""Steps without any progress in time after which a run is broken off."""


def _compiled(fingerprint: int):
    @njit(cache=True, nogil=True)
    def advance(m, state, count, out, end):
        if fingerprint == 0:
            return BROKEN
        if state[MODE] == BEFORE:
            begin(m, state, out)
        idle, last = 0, state[TIME]
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
            idle = idle + 1 if state[TIME] <= last else 0
            last = state[TIME]
            if idle > PATIENCE:
                return STANDSTILL
        return DONE

    return advance


def _fingerprint() -> int:
    """Checksum of what is compiled: numba's cache looks only at this file's date, not at those it calls."""
    here = Path(__file__).parent
    names = ("compile", "impacts", "kernel", "layout", "model", "roots", "series", "start", "steps")
    return zlib.crc32(b"".join((here / f"{name}.py").read_bytes() for name in names)) or 1


advance = _compiled(_fingerprint())
"""``advance(model, state, counters, buffers, end)`` moves the state to the time ``end`` or to the first buffer that is
full, and returns how it ended (:mod:`gears3d.lumped.layout`)."""
