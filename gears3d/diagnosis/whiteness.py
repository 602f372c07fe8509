"""Whether the residual of restitution is scatter, or follows an unknown variable."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gears3d.diagnosis.candidates import ACCEPT
from gears3d.diagnosis.remains import channel_of
from gears3d.diagnosis.restitution_scatter import Scatter, scatter
from gears3d.diagnosis.search import Search
from gears3d.diagnosis.structure import Structure

if TYPE_CHECKING:
    from gears3d.diagnosis.evidence import Evidence

# Scatter of restitution, in units of the coefficient, that segmentation causes by itself.
FAINT = 0.05
# Minimum scatter of a record relative to that of all, and fraction of the records that must have it: it belongs to the
# gears; in a few records only, it comes from segmentation.
ALIKE, MOST = 0.5, 0.5
# Largest fraction of the residuals of impacts explained by patterns, for the rest to be called scatter.
ORDERED = 0.1


def own_scatter(records: Sequence[Evidence], found: Search, left: Sequence[Structure]) -> Scatter | None:
    """Return the scatter of restitution about the prediction with causes; ``None`` without any, or if it follows a law.

    Rebounds that depend on angles, speed, flank or earlier rebounds do not scatter: an unknown variable causes them.
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
