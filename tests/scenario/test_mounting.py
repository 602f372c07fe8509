"""Keys for deviations of profiles and for how gears are mounted."""

from math import pi

import jsonschema
import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.gears import Eccentricity, Misalignment, ProfileSlope, ProfileWave, Wobble
from gears3d.scenario import load, schema
from gears3d.simulation import simulate
from gears3d.units import parse

HEAD = """
format = 1
[gears]
module = "3.5 mm"
face_width = "20 mm"
drive = { teeth = 90 }
loose = { teeth = 90 }
[mount]
backlash = "250 um"
[motion]
mean = "30 rpm"
[run]
duration = "0.05 s"
settle = "0 s"
"""
ALL = {
    "gears.profile_slope": {"amount": "6 um"},
    "gears.loose.profile_slope": {"amount": "-4 um", "flank": "reverse"},
    "gears.drive.profile_wave": {"amplitude": "0.3 um", "waves": 2.5, "phase": "90 deg", "flank": "active"},
    "gears.drive.eccentricity": {"offset": "20 um", "phase": "30 deg"},
    "gears.loose.wobble": {"angle": "0.01 deg", "phase": "-1 rad"},
    "mount.misalignment": {"in_plane": "0.01 deg", "out_of_plane": "-0.02 deg"},
}


def test_the_pair_carries_them():
    scenario = load(HEAD, ALL)
    pair = scenario.pair()
    assert pair.deviations == (
        ProfileSlope("drive", "active", 6e-6),
        ProfileSlope("drive", "reverse", 6e-6),
        ProfileWave("drive", "active", parse("0.3 um", "length"), 2.5, pi / 2),
        ProfileSlope("loose", "reverse", -4e-6),
    )
    assert pair.mounting == (
        Eccentricity("drive", parse("20 um", "length"), parse("30 deg", "angle")),
        Wobble("loose", parse("0.01 deg", "angle"), -1.0),
        Misalignment(parse("0.01 deg", "angle"), parse("-0.02 deg", "angle")),
    )
    assert load(scenario.document).pair() == pair
    assert load(HEAD).pair().mounting == load(HEAD).pair().deviations == ()
    assert load(HEAD, {"mount.misalignment": {}}).pair().mounting == (Misalignment(),)


def test_uncertainties_of_offsets_are_read():
    offset = {"value": "20 um", "uncertainty": "5 %"}
    scenario = load(HEAD, {"gears.drive.eccentricity": {"offset": offset}})
    assert scenario.uncertainty == {"gears.drive.eccentricity.offset": pytest.approx(1e-6)}


@pytest.mark.parametrize(
    ("change", "key", "message", "remedy"),
    [
        ({"gears.drive.eccentricity": {}}, "gears.drive.eccentricity.offset", "is missing", "e.g."),
        ({"gears.drive.eccentricity": "20 um"}, "gears.drive.eccentricity", "is not a table", "write"),
        ({"gears.eccentricity": {"offset": "1 um"}}, "gears.eccentricity", "is not a known key", ""),
        (
            {"gears.drive.eccentricity": {"ofset": "1 um", "offset": "1 um"}},
            "gears.drive.eccentricity.ofset",
            "",
            "offset",
        ),
        ({"gears.drive.eccentricity": {"offset": "20 deg"}}, "gears.drive.eccentricity.offset", "", ""),
        ({"gears.loose.eccentricity": {"offset": "-2 um"}}, "gears.loose.eccentricity.offset", "at least 0 m", ""),
        ({"gears.drive.wobble": {"angle": "2 deg"}}, "gears.drive.wobble.angle", "at most", "sections"),
        ({"mount.misalignment": {"in_plane": "2 deg"}}, "mount.misalignment.in_plane", "at most", "sections"),
        ({"mount.misalignment": {"inplane": "0 deg"}}, "mount.misalignment.inplane", "not a known", "in_plane"),
        ({"mount.misalignment": 3}, "mount.misalignment", "is not a table", ""),
        ({"gears.profile_wave": {"amplitude": "1 um"}}, "gears.profile_wave.waves", "is missing", ""),
        ({"gears.profile_wave": {"amplitude": "1 um", "waves": 0}}, "gears.profile_wave.waves", "more than 0", ""),
        (
            {"gears.profile_slope": {"amount": "1 um", "flank": "activ"}},
            "gears.profile_slope.flank",
            "'activ' is not allowed",
            "active",
        ),
        (
            {"gears.profile_wave": {"amplitude": "5 um", "waves": 12}},
            "gears.profile_wave",
            "flanks hollow",
            "at most 0.",
        ),
        (
            {"gears.loose.profile_wave": {"amplitude": "5 um", "waves": 12}},
            "gears.loose.profile_wave",
            "flanks hollow",
            "at most 0.",
        ),
        (
            {"gears.drive.eccentricity": {"offset": "400 um"}},
            "mount.backlash",
            "of which the mounting takes",
            "smaller offsets",
        ),
    ],
)
def test_faults_are_told_once_with_their_key(change, key, message, remedy):
    with pytest.raises(InputError) as told:
        load(HEAD, change)
    (fault,) = told.value.faults
    assert fault.key == key
    assert message in fault.message
    assert remedy in fault.remedy


def test_a_centre_distance_is_named_where_it_was_given():
    text = HEAD.replace('backlash = "250 um"', 'centre_distance = "315.3639 mm"')
    with pytest.raises(InputError, match=r"mount.centre_distance: leads to a backlash that is 250\.\d* um, of which"):
        load(text, {"gears.drive.eccentricity": {"offset": "400 um"}, "mount.misalignment": {}})


def test_the_schema_knows_them():
    def document(**more):
        gears = {"module": "3.5 mm", "drive": {"teeth": 90, "wobble": {"angle": "0.01 deg"}, **more}}
        gears["profile_slope"] = {"amount": "6 um", "flank": "active"}
        return {"format": 1, "gears": gears, "mount": {"misalignment": {"in_plane": "0.01 deg"}}}

    jsonschema.validate(document(eccentricity={"offset": "20 um"}), schema())
    for wrong in ({"eccentricity": {"ofset": "20 um"}}, {"profile_wave": {"flank": "left"}}):
        with pytest.raises(jsonschema.ValidationError):
            jsonschema.validate(document(**wrong), schema())


@pytest.mark.parametrize("key", sorted(ALL))
def test_the_closed_form_tells_what_it_does_not_see(key):
    with pytest.raises(InputError) as told:
        simulate(load(HEAD, {key: ALL[key]}), model="plastic")
    expected = key.replace("gears.profile_slope", "gears.drive.profile_slope")
    assert told.value.faults[0].key == expected
    assert "is not in the plastic model yet" in str(told.value)
    assert "gears3d show" in str(told.value)


@pytest.mark.parametrize("key", ["gears.loose.wobble", "mount.misalignment"])
def test_the_engine_sees_axes_that_lean(key):
    leaning, straight = (simulate(load(HEAD, given)).signals["displacement_m"] for given in ({key: ALL[key]}, {}))
    assert np.abs(leaning - straight).max() > 1e-7
    unseen = simulate(load(HEAD, {key: ALL[key]}), pair=load(HEAD).pair()).signals["displacement_m"]
    assert np.array_equal(unseen, straight)


def test_the_engine_sees_the_eccentricity_of_a_gear_as_that_of_an_effect():
    offset = {"offset": "20 um", "phase": "30 deg"}
    as_gear = simulate(load(HEAD, {"gears.drive.eccentricity": offset}))
    as_effect = simulate(load(HEAD, {"effect": [{"kind": "eccentricity", "gear": "drive", **offset}]}))
    moved = as_gear.signals["displacement_m"]
    assert np.array_equal(moved, as_effect.signals["displacement_m"])
    assert np.ptp(moved) > 1e-6


def test_a_tables_fault_does_not_hide_others():
    with pytest.raises(InputError) as told:
        load(
            HEAD, {"gears.drive.wobble": {"angle": "2 deg"}, "mount.misalignment": {"in_plane": "x"}, "drag.torque": 1}
        )
    assert {fault.key for fault in told.value.faults} == {
        "gears.drive.wobble.angle",
        "mount.misalignment.in_plane",
        "drag.torque",
    }
