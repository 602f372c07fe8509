"""What a mounting leaves of the dead band, against rolling on the surfaces."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.gears import Eccentricity, Gear, Misalignment, Pair, ToothDeviation, Wobble, mounted_band, quasi_static

RIG = Gear(module=3.5e-3, teeth=90, face_width=20e-3)
PAIR = Pair.from_backlash(RIG, RIG, 250e-6)
CROWNED = Pair.from_backlash(replace(RIG, lead_crowning=12e-6), replace(RIG, helix_slope=9e-6), 250e-6)
UNEQUAL = Pair.from_backlash(Gear(2e-3, 20, profile_shift=0.3), Gear(2e-3, 40), 120e-6)


@pytest.mark.parametrize(
    "mounting",
    [
        (),
        (Eccentricity("drive", 40e-6, 0.3),),
        (Eccentricity("drive", 40e-6), Eccentricity("loose", 40e-6)),
        (Eccentricity("drive", 40e-6), Eccentricity("loose", 40e-6, pi)),
        (Wobble("loose", 2e-3, 0.9), Misalignment(1e-3, -2e-3)),
        (Wobble("drive", 2e-3), Eccentricity("loose", 20e-6, 1.0), Misalignment(-1e-3, 1e-3)),
    ],
)
@pytest.mark.parametrize("pair", [PAIR, CROWNED, UNEQUAL], ids=["rig", "crowned", "unequal"])
def test_narrowest_band_is_that_of_rolling(pair, mounting):
    """Over all positions of both gears; sections in eighths of the face and angles in 96ths of a turn are enough."""
    mounted = pair.with_mounting(*mounting)
    turns = np.lcm(pair.drive.teeth, pair.loose.teeth) // pair.drive.teeth
    found = quasi_static(mounted, np.linspace(0, 2 * pi * turns, 96 * turns, endpoint=False))
    assert mounted_band(mounted)[0] == pytest.approx(found.backlash.min(), abs=0.3e-6)


def test_equal_gears_meet_in_the_same_positions_for_ever():
    """Both offsets of the same phase keep the distance of the axes nearly, of opposite phase change it twice."""
    offsets = Eccentricity("drive", 100e-6), Eccentricity("loose", 100e-6, pi)
    assert mounted_band(PAIR.with_mounting(*offsets))[0] > 249e-6
    with pytest.raises(InputError, match="jam"):
        PAIR.with_mounting(offsets[0], replace(offsets[1], offset=500e-6))
    with pytest.raises(InputError, match="jam"):
        Pair.from_backlash(RIG, RIG, 120e-6).with_mounting(offsets[0], replace(offsets[1], phase=0.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: PAIR.with_mounting(Eccentricity("drive", 400e-6)),
            r"backlash: is 250 um, of which the mounting takes 2[67]\d\.?\d* um where it is least: the gears would jam",
        ),
        (
            lambda: PAIR.with_mounting(Misalignment(0.0, 0.0139)),
            r"backlash: is 250 um, of which the mounting takes 2[56]\d\.?\d* um where it is least",
        ),
        (
            lambda: PAIR.with_deviations(ToothDeviation("loose", "active", 3, 100e-6)).with_mounting(
                Eccentricity("drive", 250e-6)
            ),
            r"takes 17\d\.?\d* um and deviations of the flanks 100 um where it is least",
        ),
        (
            lambda: Pair.from_backlash(RIG, RIG, 1.7e-3).with_mounting(Eccentricity("loose", 1e-3)),
            r"centre_distance: is 317.\d+ mm and grows to 318.\d+ mm by the mounting \(Eccentricity\): the contact "
            r"ratio falls to 0.\d+ there",
        ),
    ],
)
def test_impossible_mountings(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_what_leaves_a_nanometre_is_taken():
    """No wrong refusal: the bound found by bisection is where rolling finds the band closed."""
    low, high = 0.0, 400e-6
    for _ in range(30):
        middle = 0.5 * (low + high)
        try:
            PAIR.with_mounting(Eccentricity("drive", middle))
            low = middle
        except InputError:
            high = middle
    found = quasi_static(PAIR.with_mounting(Eccentricity("drive", low)), np.linspace(0, 2 * pi, 721))
    assert 0.0 <= found.backlash.min() < 1e-9
