"""One recording compared with another, impact by impact or as samples of one distribution; verdicts on own models.

Verdicts segment records, whose package is loaded on first use: a comparison needs none of it.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from gears3d.comparison.against import compare as compare
from gears3d.comparison.drawing import picture as picture
from gears3d.comparison.drawing import write_picture as write_picture
from gears3d.comparison.result import KEYS as KEYS
from gears3d.comparison.result import Comparison as Comparison
from gears3d.comparison.result import SampleTest as SampleTest

if TYPE_CHECKING:
    from gears3d.comparison.verdict import ModelVerdict as ModelVerdict
    from gears3d.comparison.verdict import validate_model as validate_model


def __getattr__(name: str) -> Any:
    """Load what verdicts need on first use."""
    if name not in ("ModelVerdict", "validate_model"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.verdict"), name)
