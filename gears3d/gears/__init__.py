"""Involute gears: data, meshing pairs, exact flanks, solids and convex pieces.

Knows no scenario and no effect. ``Gear``, ``Pair`` and the deviations cost nothing to import; the compiled flanks
and the solids are loaded on first use.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from gears3d.gears.deviation import (
    Eccentricity,
    HarmonicDeviation,
    HelixSlope,
    Misalignment,
    ProfileSlope,
    ProfileWave,
    ToothDeviation,
    Wobble,
)
from gears3d.gears.gear import Gear, Relief
from gears3d.gears.pair import Pair

if TYPE_CHECKING:
    from gears3d.gears.contact import (
        ContactLines,
        contact_lines,
        curvature_radii,
        sliding_speed,
        specific_sliding,
    )
    from gears3d.gears.edge import edged, edged_gap
    from gears3d.gears.export import content_hash, write_meshes
    from gears3d.gears.flank import (
        ACTIVE,
        REVERSE,
        Flanks,
        candidates,
        compile_pair,
        flank_gap,
        flank_point,
        flank_points,
        gap_at,
        nearest_gap,
        roll_at_radius,
    )
    from gears3d.gears.gear import inv, inverse_inv
    from gears3d.gears.hulls import piece_budget, pieces
    from gears3d.gears.limits import mounted_band, steepest
    from gears3d.gears.outline import default_chord, profile, triangles_at
    from gears3d.gears.rolling import QuasiStatic, hunting_period, quasi_static, rolled
    from gears3d.gears.sheet import data_sheet, path_points, radial_backlash
    from gears3d.gears.solids import mass_properties, solid, solid_arrays
    from gears3d.gears.surface import (
        Surfaces,
        compile_surfaces,
        flanks_at,
        lead_turn,
        mates,
        section_gap,
        surface_gap,
        surface_point,
    )

_HOME = {
    "ACTIVE": "flank",
    "REVERSE": "flank",
    "flank_points": "flank",
    "roll_at_radius": "flank",
    "inv": "gear",
    "inverse_inv": "gear",
    "edged": "edge",
    "edged_gap": "edge",
    "data_sheet": "sheet",
    "path_points": "sheet",
    "radial_backlash": "sheet",
    "content_hash": "export",
    "write_meshes": "export",
    "hunting_period": "rolling",
    "rolled": "rolling",
    "mates": "surface",
    "lead_turn": "surface",
    "flanks_at": "surface",
    "mounted_band": "limits",
    "steepest": "limits",
    "triangles_at": "outline",
    "ContactLines": "contact",
    "contact_lines": "contact",
    "curvature_radii": "contact",
    "sliding_speed": "contact",
    "specific_sliding": "contact",
    "Flanks": "flank",
    "candidates": "flank",
    "compile_pair": "flank",
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
    "default_chord": "outline",
    "mass_properties": "solids",
    "solid": "solids",
    "solid_arrays": "solids",
}

__all__ = [
    "ACTIVE",
    "REVERSE",
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
    "compile_pair",
    "compile_surfaces",
    "contact_lines",
    "content_hash",
    "curvature_radii",
    "data_sheet",
    "default_chord",
    "edged",
    "edged_gap",
    "flank_gap",
    "flank_point",
    "flank_points",
    "flanks_at",
    "gap_at",
    "hunting_period",
    "inv",
    "inverse_inv",
    "lead_turn",
    "mass_properties",
    "mates",
    "mounted_band",
    "nearest_gap",
    "path_points",
    "piece_budget",
    "pieces",
    "profile",
    "quasi_static",
    "radial_backlash",
    "roll_at_radius",
    "rolled",
    "section_gap",
    "sliding_speed",
    "solid",
    "solid_arrays",
    "specific_sliding",
    "steepest",
    "surface_gap",
    "surface_point",
    "triangles_at",
    "write_meshes",
]


def __getattr__(name: str) -> Any:
    """Load a public name on first use."""
    if name not in _HOME:
        raise AttributeError(f"module 'gears3d.gears' has no attribute {name!r}")
    return getattr(importlib.import_module(f"gears3d.gears.{_HOME[name]}"), name)
