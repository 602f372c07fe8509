"""Whether what restitution has left scatters, or follows something that is not known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.remains import channel_of
from gears3d.diagnosis.scatter import Scatter, scatter
from gears3d.diagnosis.search import ACCEPT, Search
from gears3d.diagnosis.structure import Structure

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence

FAINT = 0.05
"""Scatter of restitution, in units of the coefficient, that the cutting of records makes by itself."""
ALIKE, MOST = 0.5, 0.5
"""Part of the scatter of all that a record must have by itself, and of the records that must have it: it belongs to the
gears, and what shows in some of the records alone to their cutting."""
ORDERED = 0.1
"""Part of what impacts have left that structure may explain, where the rest is called scatter."""


def own_scatter(records: Sequence[Evidence], found: Search, left: Sequence[Structure]) -> Scatter | None:
    """Return how restitution scatters about what the causes make of it; ``None`` where it does not, or does by a law.

    Rebounds that depend on angles, speed, flank or those before them do not scatter: something that is not known makes
    them so.

    Args:
        records: all, as they were cut.
        found: by the search.
        left: structure that remains.
    """
    effects = [cause.effect for cause in found.fit.causes if cause.effect is not None]
    spread = scatter(records, effects)
    unit = max(found.records[0].rig.restitution, 0.1)
    if spread is None or spread.gain < ACCEPT or spread.value < FAINT * unit:
        return None
    own = np.array([each.value for one in records if (each := scatter([one], effects)) is not None])
    like = (own > ALIKE * spread.value) & (own < spread.value / ALIKE)
    if len(own) and float(np.mean(like)) < MOST:
        return None
    rest = found.fit.rest[found.known.spans["impact"]]
    worth = max((one.worth for one in left if channel_of(one.name) == "impact"), default=0.0)
    return spread if worth < ORDERED * float(rest @ rest) else None
