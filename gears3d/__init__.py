"""gears3d: involute gears as exact solids that rattle inside their backlash.

The public names below are loaded on first use, so that ``import gears3d`` loads no other package.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from gears3d.version import __version__

_HOME = {
    "assess": "gears3d.simulation",
    "bundle": "gears3d.runs",
    "load": "gears3d.scenario",
    "Scenario": "gears3d.scenario",
    "Recording": "gears3d.recording",
    "simulate": "gears3d.simulation",
    "compare": "gears3d.comparison",
    "describe": "gears3d.recording",
    "synthesize": "gears3d.simulation",
    "validate_model": "gears3d.comparison",
    "measure": "gears3d.measured.segmentation",
    "segment": "gears3d.measured.segmentation:measure",
    "diagnose": "gears3d.diagnosis",
    "replay": "gears3d.views.replay",
    "camera": "gears3d.views.camera",
    "gears": "gears3d.gears",
}

if TYPE_CHECKING:
    from gears3d import gears
    from gears3d.comparison import compare, validate_model
    from gears3d.diagnosis import diagnose
    from gears3d.measured.segmentation import measure
    from gears3d.measured.segmentation import measure as segment
    from gears3d.recording import Recording, describe
    from gears3d.runs import bundle
    from gears3d.scenario import Scenario, load
    from gears3d.simulation import assess, simulate, synthesize
    from gears3d.views.camera import camera
    from gears3d.views.replay import replay

__all__ = [
    "Recording",
    "Scenario",
    "__version__",
    "assess",
    "bundle",
    "camera",
    "compare",
    "describe",
    "diagnose",
    "gears",
    "load",
    "measure",
    "replay",
    "segment",
    "simulate",
    "synthesize",
    "validate_model",
]


def __getattr__(name: str) -> Any:
    """Load a public name on first use."""
    home = _HOME.get(name)
    if home is None:
        raise AttributeError(f"module 'gears3d' has no attribute {name!r}; it has {', '.join(sorted(_HOME))}")
    place, _, renamed = home.partition(":")
    module = importlib.import_module(place)
    return module if place == f"gears3d.{name}" else getattr(module, renamed or name)


def __dir__() -> list[str]:
    return sorted(__all__)
