"""The lubricated helical pair: oil films, compliant teeth, friction and drag in one degree of freedom.

The loose gear moves along the transverse line of action, s = Rb2·θ_loose − Rb1·θ_drive, as in the rigid twin; the
drive's motion is imposed. Between the flanks there is oil at every gap, and teeth where it is as thin as their
roughness. "The lubricated dual-clutch transmission" is the paper on the nonlinear rattle of a lubricated helical pair
of a dual-clutch transmission, its equations quoted by number.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gears3d.lumped.lubricated.drag import Bath, Bearing, Synchroniser, drag_parts
    from gears3d.lumped.lubricated.indices import error_indices, rattle_index, sensitivity
    from gears3d.lumped.lubricated.model import simulate

_HOME = {
    "simulate": "model",
    "rattle_index": "indices",
    "sensitivity": "indices",
    "error_indices": "indices",
    "Bath": "drag",
    "Bearing": "drag",
    "Synchroniser": "drag",
    "drag_parts": "drag",
}
__all__ = [
    "Bath",
    "Bearing",
    "Synchroniser",
    "drag_parts",
    "error_indices",
    "rattle_index",
    "sensitivity",
    "simulate",
]


def __getattr__(name: str) -> Any:
    """Load a public name on first use."""
    if name not in _HOME:
        raise AttributeError(f"module 'gears3d.lumped.lubricated' has no attribute {name!r}")
    return getattr(importlib.import_module(f"gears3d.lumped.lubricated.{_HOME[name]}"), name)
