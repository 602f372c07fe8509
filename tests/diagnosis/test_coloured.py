"""Residuals under 1/f noise: white, without a cause where there is none, and with one where there is."""

from functools import cache

import numpy as np
import pytest

from gears3d.diagnosis import residuals
from gears3d.diagnosis.evidence import evidence
from gears3d.diagnosis.search import search, without_strays
from gears3d.measured.segmentation import measure
from gears3d.recording import Recording
from gears3d.scenario import load
from gears3d.simulation import record

BENCH = {"run.duration": "3 s", "sensors.sample_rate": "10 kHz", "sensors.loose.noise": "5e-6 rad",
         "sensors.drive.noise": "5e-6 rad"}  # fmt: skip
SLOW = 1.5e-5
"""Standard deviation of the 1/f noise of each encoder [rad]: three times the white noise, 0.6 % of the backlash."""


def pink(random, count):
    """Return 1/f noise of unit standard deviation, made in the frequency domain."""
    made = np.fft.rfft(random.standard_normal(count))[1:] / np.sqrt(np.arange(1, count // 2 + 1))
    noise = np.fft.irfft(np.append(0.0, made), count)
    return noise / noise.std()


@cache
def seen(offset=0.0, seed=1):
    """Return two records at two speeds, the drive gear eccentric by some metres, under 1/f noise, as evidence."""
    random, found = np.random.default_rng(seed), []
    for mean in ("47 rpm", "61 rpm"):
        plain = load("scenarios/rigaud-2020/fig5-20rpm.toml", BENCH | {"motion.mean": mean})
        off = {"kind": "eccentricity", "gear": "drive", "offset": f"{offset} m"}
        shown = record(plain.with_({"effect": [off]}) if offset else plain)
        count = len(shown.time)
        signals = {name: values + SLOW * pink(random, count) if name.startswith("theta") else values
                   for name, values in shown.signals.items()}  # fmt: skip
        found.append(evidence(measure(Recording(signals, meta=shown.meta), plain), plain, mean, stated=False))
    return found


@pytest.mark.slow
def test_residuals_are_white_and_no_larger_than_one_under_slow_noise():
    for one in map(without_strays, seen()):
        assert one.channels.flicker.place > 0.0
        rest = residuals(one)
        for name in ("contact", "flight"):
            assert 0.4 < np.std(rest[name]) < 1.2, name
        own = rest["contact"][np.argsort(one.channels.contacts.time)]
        means = own[: len(own) // 50 * 50].reshape(-1, 50).mean(axis=1) * np.sqrt(50.0)
        assert np.std(means) < 1.4  # of white noise 1; of this one, weighted as white, 13


@pytest.mark.slow
def test_slow_noise_is_no_cause_and_hides_none_of_its_own_size():
    assert not search(seen(), 6).fit.causes
    (cause,) = search(seen(offset=2e-5), 6).fit.causes
    assert cause.candidate.kind == "eccentricity"
    assert cause.effect.offset == pytest.approx(2e-5, rel=0.1)
