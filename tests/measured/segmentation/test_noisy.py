"""Records with 1/f noise, interpolation errors, or none at all are cut like any other, and intervals widen."""

import numpy as np
import pytest

from gears3d.measured.segmentation import measure, path_of
from gears3d.recording import Recording
from gears3d.scenario import load
from gears3d.simulation import record
from tests.measured.segmentation.truth import FIG5, happened, judged

SLOW = pytest.mark.slow


def flicker(rng, count):
    """Noise of unit root mean square with a power spectral density over 1/f."""
    frequency = np.fft.rfftfreq(count)
    waves = rng.normal(size=len(frequency)) + 1j * rng.normal(size=len(frequency))
    waves[1:] /= np.sqrt(frequency[1:])
    waves[0] = 0.0
    made = np.fft.irfft(waves, count)
    return made / np.std(made)


def recorded(truth, error):
    """A record of both angles, each with an error that a function of the angle gives."""
    angles = {name: truth.signals[name] for name in ("theta_drive_rad", "theta_loose_rad")}
    return Recording({"time_s": truth.time, **{name: angle + error(angle) for name, angle in angles.items()}})


@pytest.mark.slow
@pytest.mark.parametrize(("restitution", "wander"), [(0.0, 0.0), pytest.param(0.3, 0.0, marks=SLOW), (0.5, 60e-6)])
@pytest.mark.parametrize("share", [0.001, pytest.param(0.005, marks=SLOW)])
def test_light_flicker_is_no_reason_to_refuse_and_widens_intervals(restitution, wander, share):
    scenario, truth = happened(restitution, wander)
    rig, rng = scenario.rig(), np.random.default_rng(71)
    size = share * rig.backlash / rig.base_radius_loose
    count = len(truth.time)
    record = recorded(truth, lambda _: size * flicker(rng, count) + rng.normal(0.0, 1e-6, count))
    found = measure(record, scenario)
    told = judged(truth, found.segments, 30.0 * found.segments.flanks.rough)
    assert told["found"] >= 0.95 * told["high"] >= 25
    assert told["invented"] <= 0.04 * len(found.recording.impacts["time_s"])  # as low as five times the noise
    assert found.summary["status"] == "complete"
    assert np.mean(found.segments.flights["testifies"]) > 0.9
    low, high = found.summary["flanks"]["backlash_m"]["ci95"]
    assert high - low > 0.2 * share * rig.backlash  # white noise alone would give a hundredth of that
    assert abs(0.5 * (low + high) - rig.backlash) < 1.5 * (high - low)
    assert 1.4826 * np.median(np.abs(told["vpulls"])) < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("own", [1e-6, 1e-5])
def test_jitter_of_a_clock_that_both_encoders_share_is_no_noise_of_the_displacement(own):
    """A gear that turns fast moves by much of the backlash within it; readings of the drive show it as well."""
    scenario, truth = happened(0.5)
    rng, count = np.random.default_rng(73), len(truth.time)
    fast = 500.0 * truth.time  # both gears turn by more without another path, as ideal gears do
    radii = scenario.rig().base_radius_drive, scenario.rig().base_radius_loose
    late, columns = rng.normal(0.0, 4e-7, count), {"time_s": truth.time}
    for name, ratio in (("drive", 1.0), ("loose", radii[0] / radii[1])):
        angle = truth.signals[f"theta_{name}_rad"] + ratio * fast
        columns[f"theta_{name}_rad"] = angle + late * np.gradient(angle, truth.time) + rng.normal(0.0, own, count)
    found = measure(Recording(columns), scenario)
    known = path_of(Recording(columns), scenario, "record")
    assert known.shared == pytest.approx(1.0, abs=0.02)
    assert known.smooth[0] < 0.1 * known.noise  # with the jitter goes the error of the drive's curve
    shared = 4e-7 * 500.0 * radii[0]
    least = own * radii[1]  # the drive's own noise is averaged out unless it tells the jitter
    assert found.summary["quality"]["noise_m"] < min(1.5 * np.sqrt(2.0) * least + 0.02 * shared, 0.5 * shared)
    told = judged(truth, found.segments, 30.0 * found.segments.flanks.rough)
    assert told["found"] >= 0.95 * told["high"] >= 25


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.001, 0.01])
def test_interpolation_errors_are_corrected(share):
    scenario, truth = happened(0.7, 60e-6)
    rng, lines = np.random.default_rng(72), 2500
    size = share * 2.0 * np.pi / lines

    def error(angle):
        wave = size * (np.cos(lines * angle + 1.0) + 0.5 * np.cos(2 * lines * angle))
        return wave + rng.normal(0.0, 1e-6, len(angle))

    found = measure(recorded(truth, error), scenario)
    told = judged(truth, found.segments, 30.0 * found.segments.flanks.rough)
    assert told["found"] == told["high"] >= 150
    assert told["invented"] == 0
    assert np.mean(found.segments.flights["testifies"]) > 0.97
    assert found.summary["flanks"]["backlash_m"]["value"] == pytest.approx(250e-6, abs=0.05e-6)
    for model in found.summary["quality"]["noise"].values():
        (once,) = (one for one in model["interpolation"] if one["order"] == lines)
        low, high = once["ci95"]
        assert low < 1.05 * size
        assert high > 0.95 * size


@pytest.mark.slow
@pytest.mark.parametrize(("restitution", "wander"), [(0.0, 0.0), (0.5, 60e-6), pytest.param(0.7, 60e-6, marks=SLOW)])
@pytest.mark.parametrize("digits", [None, 9])
def test_records_without_noise_are_cut_like_any_other(restitution, wander, digits):
    scenario, truth = happened(restitution, wander)
    record = recorded(truth, lambda angle: 0.0 if digits is None else np.round(angle, digits) - angle)
    found = measure(record, scenario)
    told = judged(truth, found.segments, 30.0 * found.segments.flanks.rough)
    assert told["found"] >= 0.99 * told["high"] >= 25
    assert told["in_time"] >= 0.99 * told["high"]
    assert told["invented"] == 0
    assert found.summary["flanks"]["backlash_m"]["value"] == pytest.approx(250e-6, abs=1e-9)


@pytest.mark.parametrize("holes", [False, True])
def test_impacts_in_step_with_the_revolution_are_no_interpolation_error(holes):
    keys = {"run.duration": "3 s", "run.settle": "0 s", "sensors.sample_rate": "20 kHz", "drag.torque": "0.3 N m"}
    scenario = load(FIG5, {**keys, "gears.loose.teeth": 60})
    made = record(scenario)
    kept = np.arange(len(made.time)) % 1000 != 7 if holes else slice(None)
    found = measure(Recording({name: values[kept] for name, values in made.signals.items()}), scenario).summary
    assert [model["interpolation"] for model in found["quality"]["noise"].values()] == [[], []]
    assert found["explained"]["time"] > 0.99
    assert found["flanks"]["backlash_m"]["value"] == pytest.approx(250e-6, abs=0.05e-6)
