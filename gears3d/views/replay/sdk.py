"""rerun, imported on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gears3d.extras import Late, require

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb
else:
    rr = Late("rerun", "a replay", "replay")
    rrb = Late("rerun.blueprint", "a replay", "replay")

__all__ = ["require_rerun", "rr", "rrb"]


def require_rerun() -> None:
    """Refuse early where rerun is not installed."""
    require("rerun", "a replay", "replay")
