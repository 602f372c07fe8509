"""The drive's motion: what is averaged to quieten counts must not flatten the motion itself."""

import numpy as np
import pytest

from gears3d.measured.segmentation import read_encoder, steady


@pytest.mark.parametrize("counts", [8192, 400_000])
def test_a_swinging_drive_is_not_flattened_by_means(counts):
    """Means over 0.4 ms of a swing lie beside the path by half its acceleration times their variance."""
    time = np.arange(0.0, 0.8, 1e-6 if counts == 8192 else 2e-5)
    swing = 2.0 * np.pi * 30.0
    angle = 10.0 * time + 3.0 / swing * np.sin(swing * time)
    count = 2.0 * np.pi / counts
    curve = steady(read_encoder(time, np.floor(angle / count) * count)).curve
    some = np.arange(0.05, 0.75, 1e-4)
    off = curve(some) - 10.0 * some - 3.0 / swing * np.sin(swing * some)
    in_step = 2.0 * np.mean((off - off.mean()) * np.sin(swing * some))
    beside = 0.5 * 3.0 * swing * (0.4e-3) ** 2 / 12.0
    assert abs(in_step) < 0.1 * beside
