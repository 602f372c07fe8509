"""Moreau's time stepping with Newton's restitution: no event is looked for, steps of one length go over everything.

Where the gap predicted for the middle of a step is closed, the step's end velocity must satisfy v⁺ ≥ −e·v⁻ there;
else it is free. Source: Moreau 1988 and Jean 1999, as in Acary & Brogliato 2008, section 10.1; θ = 1/2.
"""

from __future__ import annotations

import numpy as np

from gears3d.verification.validation.oracles.case import Case


def step_through(case: Case, duration: float, steps: int) -> np.ndarray:
    """Return the relative displacement at the ends of the steps [m], (steps + 1,), from rest on the active flank.

    Units: ``duration`` [s].
    """
    length = duration / steps
    place, speed = 0.0, 0.0
    places = np.zeros(steps + 1)
    for index in range(steps):
        free = speed + length * case.push((index + 0.5) * length)
        middle = place + 0.5 * length * speed
        after = free
        if middle <= 0.0:
            after = max(free, -case.restitution * speed)
        elif middle >= case.backlash:
            after = min(free, -case.restitution * speed)
        place += 0.5 * length * (speed + after)
        speed = after
        places[index + 1] = place
    return places
