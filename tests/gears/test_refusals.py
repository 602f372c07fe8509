"""Pairs that cannot be: one line that names parameter, value and what may be given, and is right about it."""

from math import radians

import pytest

from gears3d.errors import InputError
from gears3d.gears import Gear, Pair

RIG = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)


def test_the_largest_backlash_that_is_named_is_the_largest_that_meshes():
    with pytest.raises(InputError, match=r"contact ratio is 0\.\d+, .*at most 2178\.\d+ um at 318\.\d+ mm") as caught:
        Pair.from_backlash(RIG, RIG, 3e-3)
    named = float(caught.value.faults[0].remedy.split("at most ")[1].split(" um")[0]) * 1e-6
    assert Pair.from_backlash(RIG, RIG, named * (1 - 1e-5)).contact_ratio == pytest.approx(1.0, abs=1e-4)
    with pytest.raises(InputError, match="contact ratio"):
        Pair.from_backlash(RIG, RIG, named * (1 + 1e-5))


def test_teeth_too_short_for_any_backlash():
    stub = Gear(3.5e-3, 90, addendum=0.3)
    with pytest.raises(InputError, match=r"contact ratio is 0\.\d+, .*give longer teeth: these lose contact at any"):
        Pair.from_backlash(stub, stub, 1e-6)


def test_hands_that_do_not_mate():
    left, right = (Gear(2e-3, 30, helix_angle=radians(sign * 20), face_width=20e-3) for sign in (-1, 1))
    with pytest.raises(InputError, match=r"helix_angle: is 20 deg on the drive and -20 deg .*loose gear 20 deg"):
        Pair.from_backlash(right, left, 1e-4)
    with pytest.raises(InputError, match=r"opposite of the drive's by itself"):
        Pair.from_backlash(Gear(2e-3, 30), right, 1e-4)
    assert Pair.from_backlash(left, left, 1e-4).contact_ratio > 1


@pytest.mark.parametrize("teeth", [8, 12, 30, 90])
@pytest.mark.parametrize("shift", [0.0, 0.5])
def test_the_largest_addendum_that_is_named_makes_no_pointed_tooth(teeth, shift):
    with pytest.raises(InputError, match="pointed teeth") as caught:
        Gear(2e-3, teeth, profile_shift=shift, addendum=2.9)
    named = float(caught.value.faults[0].remedy.split("less than ")[1].split(" ")[0])
    assert Gear(2e-3, teeth, profile_shift=shift, addendum=named * 0.999).addendum > 0
    with pytest.raises(InputError, match="pointed teeth"):
        Gear(2e-3, teeth, profile_shift=shift, addendum=named * 1.001)
