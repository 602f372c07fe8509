"""A published helical pair with profile shift in the normal system, digit by digit.

Elements of Metric Gear Technology (Stock Drive Products / Sterling Instrument), table 6-1, also in KHK's technical
reference; digits as in http://bolsover.com/utilitiesforalibre/profile-shifted-external-helical-gear-normal.html, which
adds the contact ratios for a face width of 20 mm. The addendum h_a1 = (1 + y − x2)·mn of the table shortens the tips.
"""

from math import degrees, radians

import pytest

from gears3d.gears import Gear, Pair, data_sheet, inv

SHIFT = 0.09809


def pair(tip=0.0):
    drive, loose = (
        Gear(3e-3, z, helix_angle=radians(30), face_width=20e-3, profile_shift=x, addendum=1.0 + tip)
        for z, x in ((12, SHIFT), (60, 0.0))
    )
    return Pair.from_backlash(drive, loose, 0.0)


STANDARD = 0.5 * (12 + 60) * 3e-3 / (3**0.5 / 2)
INCREMENT = (pair().centre_distance - STANDARD) / 3e-3
PAIR = pair(INCREMENT - SHIFT)


def digits(value, printed):
    """Whether a value rounds to what is printed."""
    return f"{value:.{len(printed.partition('.')[2])}f}" == printed


PRINTED = [
    ("α_t", 0, degrees(1), "22.79588"),
    ("α_wt", 0, degrees(1), "23.1126"),
    ("a_d", 0, 1e3, "124.7077"),
    ("a", 0, 1e3, "125.000"),
    ("d", 0, 1e3, "41.569"),
    ("d", 1, 1e3, "207.846"),
    ("d_b", 0, 1e3, "38.322"),
    ("d_b", 1, 1e3, "191.611"),
    ("d_w", 0, 1e3, "41.667"),
    ("d_w", 1, 1e3, "208.333"),
    ("d_a", 0, 1e3, "48.154"),
    ("d_a", 1, 1e3, "213.842"),
    ("d_f", 0, 1e3, "34.658"),
    ("d_f", 1, 1e3, "200.346"),
    ("ε_α", 0, 1.0, "1.294"),
    ("ε_β", 0, 1.0, "1.061"),
]


@pytest.mark.parametrize(("symbol", "gear", "scale", "printed"), PRINTED)
def test_printed_digits(symbol, gear, scale, printed):
    (line,) = [line for line in data_sheet(PAIR) if line.symbol == symbol]
    assert digits(line.values[gear] * scale, printed), line.values[gear] * scale


def test_printed_digits_of_what_the_sheet_does_not_hold():
    drive, loose = PAIR.drive, PAIR.loose
    assert digits(inv(drive.transverse_pressure_angle), "0.022414")
    assert digits(inv(PAIR.working_pressure_angle), "0.023405")
    assert digits(1e3 * (drive.tip_radius - drive.reference_radius), "3.292")
    assert digits(1e3 * (loose.tip_radius - loose.reference_radius), "2.998")
    assert digits(1e3 * (drive.reference_radius - drive.root_radius), "3.456")
    assert digits(1e3 * (loose.reference_radius - loose.root_radius), "3.750")
    assert digits(1e3 * (drive.tip_radius - drive.root_radius), "6.748")
    assert int(1e5 * INCREMENT) == 9744  # printed 0.09744, cut and not rounded


def test_profile_shift_counts_normal_modules():
    """In transverse modules (3.464 mm) the same number would open the centre distance by 45 µm more."""
    other = pair().centre_distance + SHIFT * 3e-3 * (1 / (3**0.5 / 2) - 1)
    assert (other - PAIR.centre_distance) * 1e6 == pytest.approx(45.5, abs=0.1)
    assert not digits(1e3 * other, "125.000")
