"""Files as test benches write them, read into channels of the contract's names and units, unchecked.

Names are loaded on first use: a file whose names are those of the contract needs no map and no guess.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gears3d.measured.readers.channels import Channels as Channels
    from gears3d.measured.readers.channels import Span as Span
    from gears3d.measured.readers.channels import read as read
    from gears3d.measured.readers.channels import within as within
    from gears3d.measured.readers.formats import Reader as Reader
    from gears3d.measured.readers.formats import open_source as open_source
    from gears3d.measured.readers.guess import propose as propose
    from gears3d.measured.readers.maps import files_of as files_of
    from gears3d.measured.readers.source import Signal as Signal
    from gears3d.measured.readers.source import Source as Source

_HOME = {
    "Channels": "channels",
    "Reader": "formats",
    "Signal": "source",
    "Source": "source",
    "Span": "channels",
    "files_of": "maps",
    "open_source": "formats",
    "propose": "guess",
    "read": "channels",
    "within": "channels",
}


def __getattr__(name: str) -> Any:
    """Load a public name on first use."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(_HOME)
