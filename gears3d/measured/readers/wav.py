"""WAV: pulses of a tacho or an encoder sampled by a sound card, by scipy."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gears3d.inputs import refuse_beyond
from gears3d.measured.readers.foreign import reading
from gears3d.measured.readers.source import Signal, Source, refuse_large

# Bytes of memory for a byte of the file: 24 bits are unpacked to 32.
GROWTH = 4


def open_wav(path: Path) -> Source:
    """Open a WAV file; its channels are ``channel 1``, ``channel 2``, sampled at the rate of its header.

    Raises InputError when it is damaged, or takes too much memory.
    """
    from scipy.io import wavfile

    refuse_beyond(GROWTH * path.stat().st_size, path, "its samples", "cut the file")
    with reading(path, "WAV"):
        rate, samples = wavfile.read(path)
        table = samples.reshape(len(samples), -1)
        step = 1.0 / rate
    signals = tuple(Signal(f"channel {k + 1}", "", len(table), (0.0, step)) for k in range(table.shape[1]))

    def load(names: Sequence[str], most: int | None) -> dict[str, np.ndarray]:
        refuse_large(path, [len(table)] * len(names))
        places = {each.name: k for k, each in enumerate(signals)}
        return {name: table[:most, places[name]].astype(np.float64) for name in names}

    return Source(str(path), "WAV", signals, load)
