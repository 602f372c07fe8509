"""Involute gears: data, meshing pairs, exact flanks, solids and convex pieces.

Knows no scenario and no effect. ``Gear``, ``Pair`` and the deviations cost nothing to import; the compiled flanks
and the solids are loaded on first use.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from gears3d.gears.deviation import HarmonicDeviation, ToothDeviation
from gears3d.gears.gear import Gear
from gears3d.gears.pair import Pair
from gears3d.gears.relief import Relief

if TYPE_CHECKING:
    from gears3d.gears.flank import Flanks, candidates, flank_gap, flank_point, gap_at, nearest_gap
    from gears3d.gears.hulls import piece_budget, pieces
    from gears3d.gears.outline import profile
    from gears3d.gears.solids import mass_properties, solid, solid_arrays

_HOME = {
    "Flanks": "flank",
    "candidates": "flank",
    "flank_gap": "flank",
    "flank_point": "flank",
    "gap_at": "flank",
    "nearest_gap": "flank",
    "piece_budget": "hulls",
    "pieces": "hulls",
    "profile": "outline",
    "mass_properties": "solids",
    "solid": "solids",
    "solid_arrays": "solids",
}

__all__ = [
    "Flanks",
    "Gear",
    "HarmonicDeviation",
    "Pair",
    "Relief",
    "ToothDeviation",
    "candidates",
    "flank_gap",
    "flank_point",
    "gap_at",
    "mass_properties",
    "nearest_gap",
    "piece_budget",
    "pieces",
    "profile",
    "solid",
    "solid_arrays",
]


def __getattr__(name: str) -> Any:
    """Load a public name on first use."""
    if name not in _HOME:
        raise AttributeError(f"module 'gears3d.gears' has no attribute {name!r}")
    return getattr(importlib.import_module(f"gears3d.gears.{_HOME[name]}"), name)
