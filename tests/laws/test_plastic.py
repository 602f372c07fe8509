"""The plastic orbit against roots found to 30 digits (Rb = 0.148 m, J = 0.0695 kg m², Td = 0.22 N m)."""

from math import pi

import pytest

from gears3d.laws import crossing, loss_phases

PULL = 0.22 * 0.148 / 0.0695
CASES = [  # rpm, Hz, µm: excitation, phases of loss and impact [rad], speeds [mm/s]
    (4, 10, 200, 8.31439, (1.691362, 2.796124, 4.591824, 5.670984), (32.3132, -33.9644)),
    (20, 3, 250, 12.47159, (1.651065, 2.104635, 4.632121, 5.082921), (30.8581, -31.2425)),
    (5, 3, 250, 3.117898, (1.897295, 2.648203, 4.385890, 5.105371), (18.0340, -19.6954)),
]


@pytest.mark.parametrize(("rpm", "hertz", "backlash", "excitation", "phases", "speeds"), CASES)
def test_the_plastic_orbit_to_every_digit(rpm, hertz, backlash, excitation, phases, speeds):
    omega, speed = 2 * pi * hertz, 0.148 * rpm * pi / 30
    found = omega * speed / PULL
    assert found == pytest.approx(excitation, rel=1e-6)
    lost = loss_phases(found)
    assert lost == pytest.approx((phases[0], phases[2]), abs=6e-7)
    for phase, gap, hit, velocity in zip(lost, (backlash, -backlash), phases[1::2], speeds, strict=True):
        time, approach = crossing(speed, omega, PULL, phase, gap * 1e-6)
        assert omega * time == pytest.approx(hit, abs=6e-7)
        assert approach * 1e3 == pytest.approx(velocity, abs=6e-5)


def test_below_the_threshold_nothing_is_lost():
    with pytest.raises(ValueError, match="never lost"):
        loss_phases(0.997727)
