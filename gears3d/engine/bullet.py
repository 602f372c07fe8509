"""PyBullet, imported on first use and without its line about the build on the error stream."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Any

from gears3d.extras import Late, require


def require_bullet() -> Any:
    """Return PyBullet, or raise a MissingExtraError, before anything is compiled or computed."""
    if "pybullet" in sys.modules:
        return _required()
    sys.stderr.flush()
    kept, silence = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 2)
    try:
        return _required()
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(silence)


def _required() -> Any:
    return require("pybullet", "the 3D engine", "engine", otherwise="take the rigid model (--model rigid)")


class _Bullet(Late):
    def _load(self) -> Any:
        return require_bullet()


if TYPE_CHECKING:
    import pybullet as pybullet
else:
    pybullet = _Bullet("pybullet", "the 3D engine", "engine")
