"""From channels of encoders to impacts: decoded records are measured as the encoders' own."""

from math import pi

import numpy as np
import pytest

from gears3d.measured.readers.decode import Even, common_axis, quadrature
from gears3d.measured.segmentation import measure
from gears3d.recording import Recording
from gears3d.scenario import load
from gears3d.simulation import simulate

LINES = 2048
RATE = 1e6


@pytest.mark.slow
def test_ttl_channels_at_a_megahertz_show_the_impacts_that_the_counters_show():
    bench = load("scenarios/rigaud-2020/fig5-20rpm.toml", {"run.duration": "2 s", "run.output_rate": "50 kHz"})
    model, rng = simulate(bench, "rigid"), np.random.default_rng(0)
    time = np.arange(round(2 * RATE)) / RATE
    record, found = {"time_s": time}, {}
    for gear in ("drive", "loose"):
        angle = np.interp(time, model.time, model.signals[f"theta_{gear}_rad"]) + 2e-6 * rng.normal(size=len(time))
        count = np.floor(angle * (4 * LINES / (2 * pi)) + 0.37)
        quarter = np.mod(count, 4)
        found[gear] = quadrature(quarter < 2, (quarter == 1) | (quarter == 2), LINES)
        record[f"theta_{gear}_rad"] = count * (2 * pi / (4 * LINES))
    decoded = {"time_s": time, **{f"theta_{gear}_rad": one.angle().angle for gear, one in found.items()}}
    for name in list(record)[1:]:
        assert np.ptp(decoded[name] - record[name]) < 1e-12
    both = common_axis(found["drive"].edges(Even(1 / RATE)), found["loose"].edges(Even(1 / RATE)), "counters")
    own, counted, stamped = (
        measure(Recording(columns), bench).recording.impacts
        for columns in (record, decoded, dict(zip(record, both[:3], strict=True)))
    )
    assert len(own["time_s"]) >= 20
    assert counted["time_s"] == pytest.approx(own["time_s"], abs=1e-9)
    assert np.array_equal(counted["flank"], own["flank"])
    assert counted["velocity_m_s"] == pytest.approx(own["velocity_m_s"], abs=1e-9)
    assert stamped["time_s"] == pytest.approx(own["time_s"], abs=2e-4)
    assert np.array_equal(stamped["flank"], own["flank"])
