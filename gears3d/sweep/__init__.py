"""Many runs: a grid of scenarios in any model becomes one labelled dataset.

A **plan** says which scenario, which keys are varied, which model and which times; its points are cut into blocks, a
block runs in one process here or on a cluster, and finished blocks become one netCDF file. A point's numbers depend on
its own values alone, so they are the same to the bit in any order, on any number of processes.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gears3d.sweep.block import scenario_of
    from gears3d.sweep.dataset import open_dataset
    from gears3d.sweep.drawing import draw
    from gears3d.sweep.models import compute
    from gears3d.sweep.plan import Axis, Plan, parse_axis
    from gears3d.sweep.run import Done, Estimate, block_size, make_plan, refuse_endless, sweep
    from gears3d.sweep.store import open_plan

_HOME = {
    "compute": "models",
    "scenario_of": "block",
    "open_plan": "store",
    "Estimate": "run",
    "block_size": "run",
    "refuse_endless": "run",
    "draw": "drawing",
    "Axis": "plan",
    "parse_axis": "plan",
    "Plan": "plan",
    "Done": "run",
    "make_plan": "run",
    "sweep": "run",
    "open_dataset": "dataset",
}
__all__ = [
    "Axis",
    "Done",
    "Estimate",
    "Plan",
    "block_size",
    "compute",
    "draw",
    "make_plan",
    "open_dataset",
    "open_plan",
    "parse_axis",
    "refuse_endless",
    "scenario_of",
    "sweep",
]


def __getattr__(name: str) -> Any:
    """Load a public name on first use."""
    if name not in _HOME:
        raise AttributeError(f"module 'gears3d.sweep' has no attribute {name!r}")
    return getattr(importlib.import_module(f"gears3d.sweep.{_HOME[name]}"), name)
