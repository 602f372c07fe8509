"""What is told of a channel in its unit is the root mean square of its points, whatever their errors."""

import numpy as np
import pytest

from gears3d.diagnosis import CHANNELS, preprocess, residuals
from gears3d.diagnosis.prediction import rms_of, sigmas
from gears3d.diagnosis.residual_tests import splits
from gears3d.measured.checks import admit
from gears3d.measured.readers import files_of
from gears3d.scenario import load
from gears3d.verification.challenge import hide, plan


@pytest.fixture(scope="module")
def hidden(tmp_path_factory):
    """Records of flanks that rebound differently, and by how much."""
    folder = tmp_path_factory.mktemp("sizes")
    made = plan(7, ("restitution_asymmetry",), records=3, duration=4.0, noise=0.003)
    hide(made, folder)
    rig = load(folder / "rig.toml")
    records = [preprocess(admit(file, rig, chart)) for file, chart in files_of([folder / "record.toml"])]
    return records, made.effects[0]["asymmetry"]


@pytest.mark.slow
def test_rebounds_are_off_by_half_the_asymmetry_times_the_speed(hidden):
    records, asymmetry = hidden
    for one, split in zip(records, splits(records, []), strict=True):
        seen = one.channels.impacts
        clear = np.abs(seen.velocity) > 20.0 * seen.rebound_sigma
        assert np.mean(clear) > 0.5
        told, _ = split.sizes["impact"]
        assert told == pytest.approx(0.5 * abs(asymmetry) * np.sqrt(np.mean(seen.velocity**2)), rel=0.15)
        assert told < 0.5 * abs(asymmetry) * np.abs(seen.velocity).max() * 1.05


def test_sizes_are_those_of_the_points(hidden):
    records, _ = hidden
    for name in CHANNELS:
        rest = [residuals(one)[name] for one in records]
        assert [len(sigmas(one, name)) for one in records] == [len(own) for own in rest]
        points = [float(own) * float(sigma) for k, one in enumerate(records)
                  for own, sigma in zip(rest[k], sigmas(one, name), strict=True)]  # fmt: skip
        mean = sum(point**2 for point in points) / len(points)
        assert rms_of(np.concatenate(rest), records, name) == pytest.approx(mean**0.5, rel=1e-9)
