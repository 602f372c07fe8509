"""What a file holds before anyone trusts it: channels with the contract's names in SI units."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gears3d.errors import UsageError


@dataclass(frozen=True, eq=False)
class Channels:
    """Channels of one file as they were read: nothing is checked, nothing is corrected.

    Args:
        columns: by name of the contract (``time_s``, ``theta_drive_rad``, ``theta_loose_rad``, or what else the file
            has), SI units, each (n,); they may hold NaN, and time need not rise.
        file: where they came from.
        meta: what the file or its map tells besides.
        condition: keys of the rig that this record overrides, dotted, with TOML values: ``{"motion.mean": "180 rpm"}``.
    """

    columns: dict[str, np.ndarray]
    file: str = ""
    meta: dict[str, Any] = field(default_factory=dict)
    condition: dict[str, Any] = field(default_factory=dict)


def read(path: str | Path, map_file: str | Path | None = None) -> Channels:
    """Read the channels of a file.

    Args:
        path: a Parquet or CSV file, or a folder of a recording.
        map_file: ``record.toml`` that tells names, units and ratio signs of the channels.

    Returns:
        The channels, unchecked.

    Raises:
        InputError: it is not there or cannot be read.
        UsageError: there is a map, which this version does not read.
    """
    from gears3d.recording import columns_of
    from gears3d.recording.files import SIGNALS, read_parquet

    if map_file is not None:
        raise UsageError(f"{map_file}: maps of channels are not read yet")
    path = Path(path)
    inside = path / SIGNALS if path.is_dir() else path
    if inside.suffix == ".parquet" and inside.is_file():
        columns, meta = read_parquet(inside)
        return Channels(columns, str(path), meta)
    return Channels(columns_of(inside), str(path))
