"""Gears and pairs as data: ISO 21771 relations, the published rig, and what is refused."""

from dataclasses import replace
from math import acos, cos, pi, radians, sin, tan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gears3d.errors import InputError
from gears3d.gears import Gear, HarmonicDeviation, Pair, ToothDeviation, data_sheet, inv, inverse_inv
from gears3d.gears.limits import clearance

RIG = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)


@given(st.floats(0.0, 1.5))
def test_inverse_involute(angle):
    assert inv(inverse_inv(inv(angle))) == pytest.approx(inv(angle), rel=1e-14, abs=1e-16)


def test_rig_of_rigaud_2020_table_1():
    """Centre distance 315 to 318 mm, contact ratio 1.84 to 1.02, backlash 0 to 2 mm."""
    closed, open_ = (Pair.from_centre_distance(RIG, RIG, a) for a in (0.315, 0.318))
    assert closed.backlash == pytest.approx(0.0, abs=1e-15)
    assert closed.contact_ratio == pytest.approx(1.84, abs=0.005)
    assert open_.contact_ratio == pytest.approx(1.02, abs=0.005)
    assert open_.backlash == pytest.approx(2e-3, rel=0.07)


def test_centre_distance_follows_from_the_involute_relation_and_not_from_a_straight_tooth():
    pair = Pair.from_backlash(RIG, RIG, 250e-6)
    alpha = pair.working_pressure_angle
    # with equal gears and no shift: 2·(rb1 + rb2)·(inv alpha_wt − inv alpha_t) = backlash
    assert 4 * RIG.base_radius * (inv(alpha) - inv(radians(20))) == pytest.approx(250e-6, abs=1e-15)
    assert pair.backlash == pytest.approx(250e-6, abs=1e-15)
    straight = Pair.from_centre_distance(RIG, RIG, 0.315 + 250e-6 / (2 * sin(radians(20))))
    assert straight.backlash - 250e-6 == pytest.approx(1.09e-6, abs=5e-9)


def test_data_sheet_backlashes():
    helical = Gear(2.75e-3, 17, helix_angle=radians(28), face_width=16e-3)
    pair = Pair.from_backlash(helical, Gear(2.75e-3, 43, helix_angle=radians(28), face_width=16e-3), 120e-6)
    assert pair.normal_backlash == pytest.approx(120e-6 * cos(helical.base_helix_angle), rel=1e-14)
    assert pair.circumferential_backlash == pytest.approx(120e-6 / cos(pair.working_pressure_angle), rel=1e-14)


def test_helical_relations():
    """cos beta_b = sin alpha_n / sin alpha_t, cos alpha_t·cos beta_b = cos alpha_n·cos beta; and a published size."""
    gear = Gear(2.75e-3, 17, helix_angle=radians(28), face_width=16e-3)
    mate = Gear(2.75e-3, 43, helix_angle=radians(28), face_width=16e-3)
    alpha_t, beta_b = gear.transverse_pressure_angle, gear.base_helix_angle
    assert cos(beta_b) == pytest.approx(sin(radians(20)) / sin(alpha_t), rel=1e-14)
    assert cos(alpha_t) * cos(beta_b) == pytest.approx(cos(radians(20)) * cos(radians(28)), rel=1e-14)
    assert gear.transverse_module == pytest.approx(2.75e-3 / cos(radians(28)), rel=1e-15)
    pair = Pair.from_backlash(gear, mate, 0.0)
    assert pair.centre_distance == pytest.approx(93.437e-3, abs=1e-6)
    assert (pair.contact_ratio, pair.overlap_ratio) == pytest.approx((1.372, 0.869), abs=1e-3)


def test_both_centre_distance_and_backlash_thin_the_teeth_equally():
    drive, loose = Gear(2e-3, 23, profile_shift=0.2), Gear(2e-3, 40)
    full = Pair.from_backlash(drive, loose, 50e-6)
    pair = Pair.from_both(drive, loose, full.centre_distance, 130e-6)
    assert pair.backlash == pytest.approx(130e-6, abs=1e-15)
    for which in ("drive", "loose"):
        removed = full.half_angle(which) - pair.half_angle(which)
        assert 2 * pair.gear(which).base_radius * removed == pytest.approx(40e-6, rel=1e-9)
    with pytest.raises(InputError, match=r"backlash: is 40 um, but full teeth leave 50 um .*at least that"):
        Pair.from_both(drive, loose, full.centre_distance, 40e-6)


def test_placement():
    pair = Pair.from_backlash(RIG, RIG, 250e-6)
    assert (pair.rotation("drive", 0.3), pair.rotation("loose", 0.3)) == (0.3, pi - 0.3)
    assert pair.centre("loose") == (pair.centre_distance, 0.0, 0.0)
    with pytest.raises(InputError, match=r"which: is 'driv' \(did you mean 'drive'\?\)"):
        pair.rotation("driv", 0.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"teeth": 2}, r"teeth: is 2 \(give 5 to 2000\)"),
        ({"teeth": 20.5}, r"teeth: is 20.5 \(give a whole number\)"),
        ({"module": 0.0}, r"module: is 0 m \(give 0 to 1 m\)"),
        ({"module": float("nan")}, r"module: is nan m"),
        ({"face_width": -1e-3}, r"face_width: is -0.001 m \(give > 0 m\)"),
        ({"pressure_angle": radians(60)}, r"pressure_angle: is 60 deg \(give 5 to 45 deg\)"),
        ({"teeth": 8, "profile_shift": 1.2}, r"addendum: of 1 modules with profile shift 1.2 makes pointed teeth"),
        (
            {"addendum": 0.06, "teeth": 10, "profile_shift": -0.5},
            r"addendum: .* inside the base .*more than 0.1985",
        ),
        ({"fillet_radius": 0.6}, r"fillet_radius: is 0.6 modules.*give 0 to 0.4719 modules"),
        ({"tip_shortening": 2.0}, r"tip_shortening: is 2 modules \(give -0.5 to 1 modules\)"),
        ({"tip_diameter": 0.34}, r"tip_diameter: is 340 mm: makes pointed teeth \(give more than 306.25 and less than"),
        ({"tip_diameter": 0.3}, r"tip_diameter: is 300 mm: puts the tip .* inside the root circle \(153.1 mm\)"),
        ({"tip_diameter": 0.32, "tip_shortening": 0.1}, r"tip_diameter: is 320 mm in addition to a tip_shortening"),
        ({"helix_slope": 1e-3}, r"helix_slope: is 1000 um \(give -175 to 175 um"),
        ({"rim": 5e-3}, r"rim: is 5 mm without a web \(give web too\)"),
        ({"hub": 0.05}, r"hub: is 50 mm without a rim \(give rim too\)"),
        ({"rim": 5e-3, "web": 8e-3}, r"web: is 8 mm \(give more than 0 and less than face_width \(7.5 mm\)\)"),
        ({"rim": 0.2, "web": 2e-3}, r"rim: is 200 mm \(give at least .* and less than 153.1 mm\)"),
        ({"rim": 5e-3, "web": 2e-3, "bore": 0.05, "hub": 0.04}, r"hub: is 40 mm \(give more than 50 and less than"),
        ({"bore": 0.4}, r"bore: is 400 mm at module 3.5 mm \(give more than 0 up to 244.9 mm\)"),
    ],
)
def test_impossible_gears(change, message):
    values = {"module": 3.5e-3, "teeth": 90, "face_width": 7.5e-3, **change}
    with pytest.raises(InputError, match=message):
        Gear(**values)


def test_all_faults_of_a_gear_at_once():
    with pytest.raises(InputError) as caught:
        Gear(module=-1.0, teeth=2, face_width=0.0)
    assert [fault.key for fault in caught.value.faults] == ["module", "teeth", "face_width"]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Pair.from_backlash(RIG, RIG, -1e-6), r"backlash: is -1 um: the gears would jam"),
        (lambda: Pair.from_centre_distance(RIG, RIG, 0.3149), r"314.9 mm: the gears jam.*68.\d+ um.*at least 315 mm"),
        (lambda: Pair.from_centre_distance(RIG, RIG, 0.29), r"290 mm, less than the base radii together"),
        (lambda: Pair.from_centre_distance(RIG, RIG, 0.3185), r"contact ratio is 0.\d+, teeth lose contact"),
        (
            lambda: Pair.from_backlash(RIG, Gear(3e-3, 90), 1e-4),
            r"module: is 3.5 mm on the drive and 3 mm on the loose",
        ),
        (lambda: Pair.from_backlash(RIG, Gear(3.5e-3, 8), 1e-4), r"loose.teeth: is 8: .*the rack undercuts"),
    ],
)
def test_impossible_pairs(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_impossible_deviations():
    pair = Pair.from_backlash(RIG, RIG, 250e-6)
    with pytest.raises(InputError, match=r"tooth: is 91 \(the loose gear has 1 to 90\)"):
        pair.with_deviations(ToothDeviation("loose", "active", 91, 1e-6))
    with pytest.raises(InputError, match=r"amplitude: .*too large for its order.*at order 90 give at most \d"):
        pair.with_deviations(HarmonicDeviation("drive", "active", 90, 20e-6))
    with pytest.raises(InputError, match=r"order: is 1.5 \(a flank is closed"):
        HarmonicDeviation("drive", "active", 1.5, 1e-6)
    with pytest.raises(InputError, match="flank: is 'left'"):
        HarmonicDeviation("drive", "left", 1, 1e-6)
    with pytest.raises(InputError, match=r"backlash: is 250 um and the deviations take 260 um where.*would jam"):
        pair.with_deviations(
            HarmonicDeviation("drive", "active", 1, 240e-6), ToothDeviation("loose", "reverse", 3, 20e-6)
        )


def test_displaced_teeth_use_up_no_backlash():
    """As much off the reverse flank as on the active one: the dead band moves and keeps its width."""
    pair = Pair.from_backlash(RIG, RIG, 250e-6)
    displaced = pair.with_deviations(
        HarmonicDeviation("drive", "active", 1, 500e-6, 0.3), HarmonicDeviation("drive", "reverse", 1, -500e-6, 0.3)
    )
    assert clearance(displaced) == pytest.approx(250e-6, abs=1e-15)
    thick = displaced.with_deviations(HarmonicDeviation("loose", "active", 3, 10e-6))
    assert clearance(thick) == pytest.approx(240e-6, abs=1e-12)


def test_tip_and_undercut_radii_of_a_standard_gear():
    gear = Gear(module=2e-3, teeth=25)
    assert gear.tip_radius == pytest.approx(27e-3, rel=1e-14)
    assert gear.root_radius == pytest.approx(22.5e-3, rel=1e-14)
    assert gear.tip_roll == pytest.approx(tan(acos(gear.base_radius / gear.tip_radius)), rel=1e-12)


@pytest.mark.parametrize("beta", [0.0, radians(18)])
def test_thickness_allowances_give_the_backlash_and_each_gear_its_own_teeth(beta):
    """ISO 21771: j_bt grows by both allowances, taken along the base circle."""
    plain = [Gear(1.75e-3, z, helix_angle=beta, face_width=14e-3) for z in (23, 41)]
    distance = sum(gear.reference_radius for gear in plain) + 10e-6
    full = Pair.from_centre_distance(*plain, distance)
    thin = [replace(gear, thickness_allowance=size) for gear, size in zip(plain, (-14e-6, -48e-6), strict=True)]
    pair = Pair.from_centre_distance(*thin, distance)
    lead = cos(plain[0].transverse_pressure_angle) / cos(beta)
    assert pair.backlash - full.backlash == pytest.approx(62e-6 * lead, rel=1e-9)
    assert pair.thinning == 0.0
    thick, thinned = ({q.symbol: q.values for q in data_sheet(one)}["s_n"] for one in (full, pair))
    assert [b - a for a, b in zip(thick, thinned, strict=True)] == pytest.approx([-14e-6, -48e-6], rel=1e-9)
    with pytest.raises(InputError, match=r"thickness_allowance: is -400 um \(give -350 to 350 um"):
        replace(plain[0], thickness_allowance=-400e-6)
