"""Involute gears: data, meshing pairs, exact flanks, solids and convex pieces.

Knows no scenario and no effect. ``Gear``, ``Pair`` and the deviations cost nothing to import; the compiled flanks
and the solids are loaded on first use.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from gears3d.gears.deviation import HarmonicDeviation, HelixSlope, ProfileSlope, ProfileWave, ToothDeviation
from gears3d.gears.gear import Gear
from gears3d.gears.mounting import Eccentricity, Misalignment, Wobble
from gears3d.gears.pair import Pair
from gears3d.gears.relief import Relief

if TYPE_CHECKING:
    from gears3d.gears.chords import default_chord
    from gears3d.gears.contact import (
        ContactLines,
        contact_lines,
        curvature_radii,
        sliding_speed,
        specific_sliding,
    )
    from gears3d.gears.flank import Flanks, candidates, flank_gap, flank_point, gap_at, nearest_gap
    from gears3d.gears.hulls import piece_budget, pieces
    from gears3d.gears.outline import profile
    from gears3d.gears.rolling import QuasiStatic, quasi_static
    from gears3d.gears.solids import mass_properties, solid, solid_arrays
    from gears3d.gears.surface import Surfaces, compile_surfaces, section_gap, surface_gap, surface_point

_HOME = {
    "ContactLines": "contact",
    "contact_lines": "contact",
    "curvature_radii": "contact",
    "sliding_speed": "contact",
    "specific_sliding": "contact",
    "Flanks": "flank",
    "candidates": "flank",
    "flank_gap": "flank",
    "flank_point": "flank",
    "gap_at": "flank",
    "nearest_gap": "flank",
    "piece_budget": "hulls",
    "pieces": "hulls",
    "profile": "outline",
    "QuasiStatic": "rolling",
    "quasi_static": "rolling",
    "Surfaces": "surface",
    "compile_surfaces": "surface",
    "section_gap": "surface",
    "surface_gap": "surface",
    "surface_point": "surface",
    "default_chord": "chords",
    "mass_properties": "solids",
    "solid": "solids",
    "solid_arrays": "solids",
}

__all__ = [
    "ContactLines",
    "Eccentricity",
    "Flanks",
    "Gear",
    "HarmonicDeviation",
    "HelixSlope",
    "Misalignment",
    "Pair",
    "ProfileSlope",
    "ProfileWave",
    "QuasiStatic",
    "Relief",
    "Surfaces",
    "ToothDeviation",
    "Wobble",
    "candidates",
    "compile_surfaces",
    "contact_lines",
    "curvature_radii",
    "default_chord",
    "flank_gap",
    "flank_point",
    "gap_at",
    "mass_properties",
    "nearest_gap",
    "piece_budget",
    "pieces",
    "profile",
    "quasi_static",
    "section_gap",
    "sliding_speed",
    "solid",
    "solid_arrays",
    "specific_sliding",
    "surface_gap",
    "surface_point",
]


def __getattr__(name: str) -> Any:
    """Load a public name on first use."""
    if name not in _HOME:
        raise AttributeError(f"module 'gears3d.gears' has no attribute {name!r}")
    return getattr(importlib.import_module(f"gears3d.gears.{_HOME[name]}"), name)
