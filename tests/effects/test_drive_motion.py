"""One more sine of the drive: the same run as with the sine written into the motion, in every unit family."""

from math import pi

import pytest

from tests.effects.bench import MODELS, bench, run, same

MAIN = {"amplitude": "20 rpm", "frequency": "3 Hz"}


@pytest.mark.parametrize("model", MODELS)
def test_it_is_a_harmonic_of_the_motion(model):
    sine = {"amplitude": "2 rpm", "frequency": "14 Hz", "phase": "50 deg"}
    ours = run(model, {"kind": "drive_motion", **sine}, run__duration="0.3 s")
    written = run(model, run__duration="0.3 s", motion__harmonics=[MAIN, sine])
    assert same(ours, written) < 1e-12
    assert (ours.impacts["phase_rad"] == written.impacts["phase_rad"]).all()


@pytest.mark.parametrize(
    "sine",
    [
        {"amplitude": "0.1 rad/s", "order": 4},  # 30 rpm: 2 Hz
        {"amplitude": f"{0.1 / (4 * pi)} rad", "frequency": "2 Hz"},
        {"amplitude": f"{0.1 * 4 * pi} rad/s^2", "order": 4.0},
    ],
)
def test_families_and_orders(sine):
    (row,) = bench({"kind": "drive_motion", **sine}).rows()
    assert row.p == pytest.approx((0.1, 2.0, 0.0))
    (harmonic,) = bench(motion__harmonics=[sine]).motion.harmonics
    assert (harmonic.amplitude, harmonic.frequency, harmonic.phase) == pytest.approx(row.p)


@pytest.mark.parametrize("unit", ["rad/s", "rad", "rad/s^2"])
def test_unit_size_is_an_excitation_of_one(unit):
    case = bench({"kind": "drive_motion", "amplitude": f"1 {unit}", "frequency": "5 Hz"})
    size = case.effects[0].unit_size(case.rig())
    speed, frequency, _ = (
        bench({"kind": "drive_motion", "amplitude": f"{size} {unit}", "frequency": "5 Hz"}).rows()[0].p
    )
    assert 0.0695 * 2 * pi * frequency * speed / 0.22 == pytest.approx(1.0)
