"""What one tooth does to the displacement, against gears that are rolled on each other with that tooth."""

import numpy as np
import pytest

from gears3d.diagnosis.prediction import deviation, influence, over_tooth
from gears3d.effects.rows import flank_eccentric
from gears3d.gears import Gear, Pair, ToothDeviation, quasi_static

SPUR = Pair.from_backlash(Gear(3e-3, 31), Gear(3e-3, 53), 2e-4)
HELICAL = Pair.from_backlash(Gear(3e-3, 31, helix_angle=0.35), Gear(3e-3, 53, helix_angle=0.35), 2e-4)
TOOTH = 3


def _rolled(pair, gear, side, thickness, count):
    """Displacement of one tooth's doing, rolled, and the angle of its gear."""
    theta = np.linspace(-1.0, 1.4, count) * 2.0 * np.pi * 3.0 / pair.drive.teeth
    bent = quasi_static(pair.with_deviations(ToothDeviation(gear, side, TOOTH, thickness)), theta)
    phi, plain = (getattr(one, f"phi_{side}") for one in (bent, quasi_static(pair, theta)))
    behind = phi + (pair.backlash if side == "reverse" else 0.0)
    loose = (theta * pair.drive.base_radius + behind) / pair.loose.base_radius
    return phi - plain, theta if gear == "drive" else loose


@pytest.mark.parametrize("thickness", [2e-6, 4e-5, 1.2e-4, -2e-6, -2e-5, -1.2e-4])
@pytest.mark.parametrize("side", ["active", "reverse"])
@pytest.mark.parametrize("gear", ["drive", "loose"])
def test_a_tooth_out_or_back_moves_gears_as_rolling_does(gear, side, thickness):
    rolled, own = _rolled(SPUR, gear, side, thickness, 701)
    told = over_tooth(SPUR, gear, TOOTH, side, thickness, own)
    assert np.max(np.abs(rolled)) > 0.5 * min(abs(thickness), 2e-5)
    assert np.sqrt(np.mean((told - rolled) ** 2)) < 0.03 * np.sqrt(np.mean(rolled**2))
    assert np.max(np.abs(told - rolled)) < max(0.15 * abs(thickness), 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("gear", "side"), [("drive", "active"), ("loose", "reverse")])
def test_helical_teeth_do_as_well(gear, side):
    rolled, own = _rolled(HELICAL, gear, side, 6e-5, 201)
    told = over_tooth(HELICAL, gear, TOOTH, side, 6e-5, own)
    assert np.sqrt(np.mean((told - rolled) ** 2)) < 0.03 * np.sqrt(np.mean(rolled**2))


@pytest.mark.parametrize("side", ["active", "reverse"])
def test_gears_fall_no_deeper_than_neighbours_let_them(side):
    deep, deeper = (np.abs(influence(SPUR, "drive", side, -size)[1]) for size in (1e-4, 2e-4))
    assert np.array_equal(deep, deeper)
    assert 1e-5 < np.max(deep) < 1e-4


def test_a_thicker_tooth_carries_for_longer():
    spans = [np.count_nonzero(influence(SPUR, "loose", "active", size)[1]) for size in (1e-6, 2e-5, 1e-4)]
    assert spans == sorted(spans)
    assert spans[0] < spans[-1]


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
@pytest.mark.parametrize("gear", ["drive", "loose"])
def test_eccentric_teeth_have_the_backlash_of_their_centre_distance(pair, gear):
    """Teeth that are off their axis mesh as those of a pair at another distance, whose line of centres has turned."""
    offset, angle = 8e-5, np.linspace(0.0, 2.0 * np.pi, 9)
    row = flank_eccentric(("drive", "loose").index(gear), offset, 0.4)
    active, reverse = (deviation([row], pair, angle, angle, np.full(9, flank)) for flank in (0, 1))
    apart = np.hypot(pair.centre_distance - offset * np.cos(angle + 0.4), offset * np.sin(angle + 0.4))
    at = [Pair.from_centre_distance(pair.drive, pair.loose, one).backlash for one in apart]
    np.testing.assert_allclose(reverse - active, np.array(at) - pair.backlash, atol=1e-12)
    turned = np.arcsin(offset * np.sin(angle + 0.4) / apart) * (1.0 if gear == "drive" else -1.0)
    base = pair.drive.base_radius + pair.loose.base_radius
    np.testing.assert_allclose(0.5 * (active + reverse), base * turned, atol=1e-12)
