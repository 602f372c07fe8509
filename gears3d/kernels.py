"""Compiling kernels: numba's ``njit``, with a cache of its own for every state of the sources.

Numba looks at the file of a kernel only, not at the kernels that it calls from other files: after an update an old
cache would go on running old code without a word. Here the cache lies in a folder that is named after the content of
all rooms with kernels. ``NUMBA_CACHE_DIR`` names another place, as ever, and then the user looks after it.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

import numba
from numba import njit as njit

HOME = Path(__file__).parent
ROOMS = (
    "challenge",
    "effects",
    "engine",
    "gears",
    "identification/kernels",
    "lumped",
    "lumped/lubricated",
    "measurement/kernels",
)
"""Where kernels and the constants that are compiled into them live."""


def fingerprint() -> str:
    """Return twelve digits that change with every file of the rooms that have kernels, and with numba itself."""
    digest = hashlib.sha256(numba.__version__.encode())
    for room in ROOMS:
        for path in sorted((HOME / room).glob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def place() -> Path:
    """Return the folder of the compiled kernels; the one of an older state is removed."""
    name = f"kernels-{fingerprint()}"
    for home in (HOME / "__pycache__", Path(tempfile.gettempdir()) / f"gears3d-{os.getuid()}"):
        with suppress(OSError):
            (home / name).mkdir(parents=True, exist_ok=True)
            for old in home.glob("kernels-*"):
                if old.name != name:
                    shutil.rmtree(old, ignore_errors=True)
            return home / name
    return Path(tempfile.mkdtemp(prefix="gears3d-"))


def compiled() -> bool:
    """Whether the kernels have been compiled before on this machine."""
    return kept() > 0


def kept() -> int:
    """Return how many kernels are compiled and kept on this machine."""
    return sum(1 for _ in Path(numba.config.CACHE_DIR).rglob("*.nbi"))  # type: ignore[attr-defined]


if not os.environ.get("NUMBA_CACHE_DIR"):
    numba.config.CACHE_DIR = str(place())  # type: ignore[attr-defined]
