"""Micro-geometry and body of the gears as written in a scenario."""

import json
from math import radians

import jsonschema
import pytest

from gears3d.errors import InputError
from gears3d.gears import Relief, mass_properties, solid
from gears3d.scenario import load, schema

HEAD = """
format = 1
[gears]
module = "3.5 mm"
face_width = "7.5 mm"
drive = { teeth = 90 }
loose = { teeth = 90 }
[mount]
backlash = "250 um"
[motion]
mean = "30 rpm"
"""


def faults(overrides):
    with pytest.raises(InputError) as caught:
        load(HEAD, overrides)
    return caught.value.faults


def test_reliefs_are_read_with_their_units():
    tip = {"amount": "20 um", "start_diameter": "318 mm", "shape": "parabolic"}
    scenario = load(HEAD, {"gears.tip_relief": tip, "gears.loose.root_relief": {"amount": "8 um", "length": "2 mm"}})
    assert scenario.gears.drive.tip_relief == Relief(20e-6, start_diameter=0.318, shape="parabolic")
    assert scenario.gears.loose.tip_relief == scenario.gears.drive.tip_relief
    assert scenario.gears.drive.root_relief is None
    assert scenario.gears.loose.root_relief == Relief(8e-6, length=2e-3)
    assert scenario.pair().loose.root_relief == scenario.gears.loose.root_relief


def test_a_gears_own_relief_goes_before_the_common_one():
    common, own = ({"amount": amount, "start_roll": "23 deg"} for amount in ("20 um", "0 um"))
    gears = load(HEAD, {"gears.tip_relief": common, "gears.loose.tip_relief": own}).gears
    assert gears.drive.tip_relief.start_roll == pytest.approx(radians(23))
    assert gears.loose.tip_relief is None


def test_tip_and_body_reach_the_gear():
    gears = load(
        HEAD,
        {
            "gears.tip_shortening": 0.1,
            "gears.lead_crowning": "8 um",
            "gears.loose.helix_slope": "-5 um",
            "gears.loose.tip_shortening": 0,
            "gears.loose.tip_diameter": "321 mm",
            "gears.drive": {"teeth": 90, "bore": "40 mm", "rim": "9 mm", "web": "3 mm", "hub": "60 mm"},
        },
    ).gears
    assert gears.drive.gear().tip_radius == pytest.approx(0.161 - 0.35e-3)
    assert gears.drive.gear().lead_crowning == pytest.approx(8e-6)
    assert (gears.drive.helix_slope, gears.loose.gear().helix_slope) == (0.0, pytest.approx(-5e-6))
    assert gears.loose.gear().tip_radius == pytest.approx(0.1605)
    assert gears.drive.gear().pocket == pytest.approx((0.03, gears.drive.gear().root_radius - 9e-3))


def test_inertia_of_a_gear_with_a_web_is_its_solids():
    scenario = load(HEAD, {"gears.rim": "9 mm", "gears.web": "2 mm", "gears.hub": "50 mm", "gears.bore": "30 mm"})
    weighed = mass_properties(solid(scenario.pair(), "loose"), 7850.0)
    assert scenario.rig().inertia == pytest.approx(weighed.inertia[2, 2], rel=5e-5)
    assert scenario.rig().inertia < 0.6 * load(HEAD).rig().inertia


@pytest.mark.parametrize(
    ("overrides", "key", "message", "remedy"),
    [
        ({"gears.tip_relief": {"amount": "20 um"}}, "gears.tip_relief", "has no start", "start_roll"),
        (
            {"gears.tip_relief": {"amount": "20 um", "length": "2 mm", "start_roll": "20 deg"}},
            "gears.tip_relief.length",
            "has start_roll and length",
            "one of",
        ),
        ({"gears.tip_relief": {"amount": "-1 um", "length": "2 mm"}}, "gears.tip_relief.amount", "at least 0 m", ""),
        ({"gears.tip_relief": {"length": "2 mm"}}, "gears.tip_relief.amount", "is missing", "e.g."),
        ({"gears.tip_relief": "20 um"}, "gears.tip_relief", "is not a table", "write"),
        ({"gears.tip_relief": {"amont": "1 um", "length": "1 mm"}}, "gears.tip_relief.amont", "not a known", "amount"),
        (
            {"gears.loose.tip_relief": {"amount": "20 um", "length": "30 mm"}},
            "gears.loose.tip_relief.length",
            "off the flank",
            "less than 20.",
        ),
        (
            {"gears.tip_relief": {"amount": "20 um", "length": "30 mm"}},
            "gears.tip_relief.length",
            "off the flank",
            "less than 20.",
        ),
        ({"gears.web": "2 mm"}, "gears.web", "without a rim", "give rim"),
        ({"gears.tip_diameter": "340 mm"}, "gears.tip_diameter", "pointed teeth", "less than 328.253 mm"),
    ],
)
def test_bad_teeth_are_told_by_their_key(overrides, key, message, remedy):
    told = [fault for fault in faults(overrides) if fault.key == key]
    assert len(told) == 1
    assert message in told[0].message
    assert remedy in told[0].remedy


def test_helical_teeth_need_a_width():
    text = HEAD.replace('face_width = "7.5 mm"\n', "")
    with pytest.raises(InputError, match=r"gears.drive.face_width: is missing with a helix_angle of 20 deg"):
        load(text, {"gears.helix_angle": "20 deg"})
    assert load(text).gears.drive.face_width == pytest.approx(0.035)


def test_the_schema_knows_reliefs():
    def document(relief):
        gears = {"module": "3.5 mm", "tip_relief": relief, "drive": {"teeth": 90, "root_relief": relief}}
        return json.loads(json.dumps({"format": 1, "gears": gears}))

    jsonschema.validate(document({"amount": "20 um", "length": "2 mm", "shape": "parabolic"}), schema())
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(document({"amount": "20 um", "lenght": "2 mm"}), schema())
