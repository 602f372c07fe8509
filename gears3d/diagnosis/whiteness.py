"""Whether what restitution has left scatters, or follows something that is not known."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from gears3d.diagnosis.remains import channel_of
from gears3d.diagnosis.scatter import Scatter, scatter
from gears3d.diagnosis.search import ACCEPT, Search
from gears3d.diagnosis.structure import Structure

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence

FAINT = 0.05
"""Scatter of restitution, in units of the coefficient, that the cutting of records makes by itself."""
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
    spread = scatter(records, [cause.effect for cause in found.fit.causes if cause.effect is not None])
    unit = max(found.records[0].rig.restitution, 0.1)
    if spread is None or spread.gain < ACCEPT or spread.value < FAINT * unit:
        return None
    rest = found.fit.rest[found.known.spans["impact"]]
    worth = max((one.worth for one in left if channel_of(one.name) == "impact"), default=0.0)
    return spread if worth < ORDERED * float(rest @ rest) else None
