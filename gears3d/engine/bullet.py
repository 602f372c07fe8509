"""PyBullet, imported without the line about its build that it prints on the error stream of every process."""

from __future__ import annotations

import os
import sys
from typing import Any


def _quietly() -> Any:
    sys.stderr.flush()
    kept, silence = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 2)
    try:
        import pybullet
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(silence)
    return pybullet


pybullet = _quietly()
