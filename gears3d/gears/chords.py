"""How fine a solid is: its default chord, its slices and triangles before it is made, and when it is too large."""

from __future__ import annotations

from math import ceil, pi, sqrt

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.gears.body import inner_radius
from gears3d.gears.deviation import GEARS
from gears3d.gears.outline import segments_at
from gears3d.gears.pair import Pair
from gears3d.gears.surface import flank_leads, lead_turn

MOST_TRIANGLES = 2e7
"""Of a solid: about 3 GB while it is made and written."""
FINEST, SHARE = 0.2e-6, 1.6e-6
"""Default chord [m] of large gears, and of small ones in tip radii: what chords take off a gear's volume and inertia
goes with their distance from the surface over its size."""


def default_chord(pair: Pair, which: str) -> float:
    """Return the chord with which volume and inertia of a solid are within 1e-5 of those of the exact gear [m].

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.

    >>> from gears3d.gears import Gear
    >>> gear = Gear(module=2e-3, teeth=20, face_width=5e-3)
    >>> round(default_chord(Pair.from_backlash(gear, gear, 1e-4), "drive") * 1e9)
    35
    """
    return min(FINEST, SHARE * pair.gear(which).tip_radius)


def triangles_at(pair: Pair, which: str, chord: float, root_chord: float | None = None) -> int:
    """Return about how many triangles a solid has, without making it.

    Args:
        pair: the pair, deviations included.
        which: ``"drive"`` or ``"loose"``.
        chord: largest distance of the facets from the flanks [m].
        root_chord: the same elsewhere [m]; ``chord`` when not given.
    """
    _check_chords(chord, root_chord)
    coarse, gear = root_chord or chord, pair.gear(which)
    root, fillet, flank, tip = segments_at(pair, which, chord, root_chord)
    ring = gear.teeth * (2 * (root + fillet + flank) + tip)
    inner = gear.teeth * 2 * root + 2.0 * pi * sqrt(inner_radius(gear) / (8.0 * coarse)) if inner_radius(gear) else 0.0
    return round(2.0 * (ring + inner) * (layers_at(pair, which, coarse) + 1))


def _check_chords(chord: float, root_chord: float | None) -> None:
    for each in (chord, root_chord):
        if each is not None and not each > 0.0:
            raise InputError(Fault("chord", f"is {each:g} m", "give a positive length"))


def check_size(pair: Pair, which: str, chord: float, root_chord: float | None = None) -> None:
    """Refuse a chord whose triangles fit into no memory.

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.
        chord: largest distance of the facets from the flanks [m].
        root_chord: the same elsewhere [m]; ``chord`` when not given.

    Raises:
        InputError: too fine a chord, with the finest that is not; or one that is not positive.
    """
    count = triangles_at(pair, which, chord, root_chord)
    if count <= MOST_TRIANGLES:
        return
    ratio = (root_chord or chord) / chord
    low, high = chord, pair.gear(which).tip_radius
    for _ in range(50):
        middle = sqrt(low * high)
        fits = triangles_at(pair, which, middle, ratio * middle) <= MOST_TRIANGLES
        low, high = (low, middle) if fits else (middle, high)
    words = f"is {chord * 1e6:.3g} um: the {which} gear would have {count:.2g} triangles, {MOST_TRIANGLES:.0e} are "
    words += "the most that fit into memory"
    raise InputError(Fault("chord", words, f"give at least {high * 1.05e6:.2g} um"))


def layers_at(pair: Pair, which: str, chord: float) -> int:
    """Return how many slices keep edges of helical tips and crowned flanks within the chord between their ends.

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.
        chord: largest distance of those edges from the true ones [m].
    """
    gear = pair.gear(which)
    lead = lead_turn(gear, 1.0 if which == "drive" else -1.0)
    most = abs(lead) + float(np.max(np.abs(flank_leads(pair)[GEARS.index(which)]), initial=0.0))
    count = max(1, ceil(most * gear.face_width * sqrt(gear.tip_radius / (8.0 * chord))))
    if gear.lead_crowning != 0.0:
        count = 2 * ceil(0.5 * max(count, sqrt(abs(gear.lead_crowning) / chord)))
    return count
