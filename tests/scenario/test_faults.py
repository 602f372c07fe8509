# ruff: noqa: E501  (one bad value a line)
"""Bad scenarios: each wrong value is found, named by its key, and told with a remedy."""

import datetime

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gears3d.errors import InputError, UsageError
from gears3d.scenario import load

BASE = "scenarios/base/rigaud-2020.toml"
SINE = {"amplitude": "20 rpm", "frequency": "3 Hz"}


def faults(source, overrides=()):
    with pytest.raises(InputError) as caught:
        load(source, overrides)
    return caught.value.faults


def without(*names):
    """Return the bench as plain data without some keys."""
    import tomlkit

    data = tomlkit.parse(load(BASE).document).unwrap()
    for name in names:
        *path, last = name.split(".")
        table = data
        for step in path:
            table = table[step]
        del table[last]
    return data


@pytest.mark.parametrize(
    ("key", "value", "where", "message", "remedy"),
    [
        ("motion.harmonics", [{**SINE, "frequency": "180 rpm"}], "motion.harmonics[0].frequency",
         "'180 rpm' is a rotational speed, not a frequency", 'write "3 Hz"'),
        ("gears.loose.inertia", "-1 kg m^2", "gears.loose.inertia", "is '-1 kg m^2'; must be more than 0 kg m^2", "mass"),
        ("gears.loose.inertia", "0 kg m^2", "gears.loose.inertia", "must be more than 0 kg m^2", "mass"),
        ("gears.drive.teeth", 2, "gears.drive.teeth", "is 2; must be at least 5", "lets go"),
        ("gears.drive.teeth", 90.5, "gears.drive.teeth", "90.5 is not a whole number", "90"),
        ("gears.drive.module", "3 mm", "gears.drive.module", "drive has 3 mm and loose 3.5 mm: the gears do not mesh", "same"),
        ("gears.loose.pressure_angle", "25 deg", "gears.loose.pressure_angle", "drive has 20 deg and loose 25 deg", "same"),
        ("gears.loose.helix_angle", "10 deg", "gears.loose.helix_angle", "the gears do not mesh", "opposite hands"),
        ("gears.addendum", 1.9, "gears.addendum", "pointed teeth", "less than 1."),
        ("gears.modul", "3 mm", "gears.modul", "is not a known key", "did you mean 'module'?"),
        ("mount.backlash", "-5 um", "mount.backlash", "is '-5 um'; must be more than 0 m", "gears jammed"),
        ("mount.backlash", "0 um", "mount.backlash", "must be more than 0 m", "gears jammed"),
        ("mount.backlash", "5 mm", "mount.backlash", "contact ratio is 0.051", "smaller backlash"),
        ("motion.mean", "30 Hz", "motion.mean", "'30 Hz' is a frequency, not a rotational speed", '"1800 rpm"'),
        ("motion.harmonics", [{"amplitude": "3 mm", "frequency": "3 Hz"}], "motion.harmonics[0].amplitude",
         "'3 mm' is a length, not a rotational speed or an angle or an angular acceleration", '"30 rpm"'),
        ("motion.harmonics", [SINE, {**SINE, "frequency": "15 kHz"}], "motion.harmonics[1].frequency",
         "is 15 kHz, above half of run.output_rate (20 kHz)", "above 30 kHz"),
        ("motion.harmonics", [{**SINE, "order": 2}], "motion.harmonics[0].order", "is given in addition to frequency", "keep one"),
        ("motion.harmonics", [{"amplitude": "20 rpm"}], "motion.harmonics[0].frequency", "is missing", "3 Hz"),
        ("motion.harmonics", [{"frequency": "3 Hz"}], "motion.harmonics[0].amplitude", "is missing", "rpm"),
        ("motion.harmonics", SINE, "motion.harmonics", "is not a list", "[ {"),
        ("motion.record", "nowhere.csv", "motion.record", "there is no file", ""),
        ("drag.torque", "0.22 J", "drag.torque", "'0.22 J' is an energy, not a torque", "N m"),
        ("drag.torque", "-0.1 N m", "drag.torque", "must be at least 0 N m", "resists"),
        ("drag.torque", 0.22, "drag.torque", "0.22 has no unit; a torque is needed", '"0.22 N m"'),
        ("drag.torque", {"value": "0.22 N m", "uncertainity": "5 %"}, "drag.torque.uncertainity", "is not a known key",
         "did you mean 'uncertainty'?"),
        ("drag.torque", {"uncertainty": "5 %"}, "drag.torque", "needs a value", "value ="),
        ("drag.torque", {"value": "0.22 N m", "uncertainty": "5 mm"}, "drag.torque", "is a length, not a torque", "N m"),
        ("drag.torque", {"value": "0.22 N m", "uncertainty": "-5 %"}, "drag.torque", "'-5 %' is negative", "deviation"),
        ("impact.restitution", 1.3, "impact.restitution", "is 1.3; must be at least 0 and at most 1", "energy"),
        ("impact.restitution", "-10 %", "impact.restitution", "is '-10 %'; must be at least 0", "energy"),
        ("start.state", "actif", "start.state", "'actif' is not allowed", "did you mean 'active'?"),
        ("run.duration", "0 s", "run.duration", "is '0 s'; must be more than 0 s", ""),
        ("run.duration", "1 s", "run.settle", "is 4 s, not less than run.duration (1 s)", "longer duration"),
        ("run.settle", "2 peroids", "run.settle", "'2 peroids' is not known", '"2 periods"'),
        ("run.settle", "-1 periods", "run.settle", "is '-1 periods'; must be at least 0 s", '"2 periods"'),
        ("run.output_rate", "0.1 Hz", "run.output_rate", "less than one sample", "higher rate"),
        ("run.seed", -1, "run.seed", "is -1; must be at least 0", ""),
        ("expect.regime", "rattle", "expect.regime", "'rattle' is not allowed", "double_sided"),
        ("effect", [{"kind": "transmision_error"}], "effect[0].kind", "'transmision_error' is not a known effect",
         "did you mean 'transmission_error'?"),
        ("effect", [{"amplitude": "5 um"}], "effect[0].kind", "is missing", "drag_viscous"),
        ("effect", [{"kind": "drag_viscous"}], "effect[0].coefficient", "is missing (a rotational damping)", "N m s/rad"),
        ("effect", [{"kind": "drag_viscous", "coefficient": "-1 N m s/rad"}], "effect[0].coefficient",
         "is '-1 N m s/rad'; must be at least 0 N m s/rad", ""),
        ("effect", [{"kind": "drag_viscous", "coefficient": "1 N m"}], "effect[0].coefficient",
         "'1 N m' is a torque, not a rotational damping", "N m s/rad"),
        ("effect", [{"kind": "transmission_error", "amplitude": "5 um", "flank": "left"}], "effect[0].flank",
         "'left' is not allowed", "active"),
        ("effect", [{"kind": "transmission_error", "amplitude": "5 um", "orders": 1}], "effect[0].orders",
         "is not a known key", "did you mean 'order'?"),
        ("effect", {"kind": "drag_viscous"}, "effect", "is not a list", "[[effect]]"),
        ("format", 2, "format", "is 2; this version reads format 1", "format = 1"),
        ("titel", "x", "titel", "is not a known key", "did you mean 'title'?"),
        ("duration", "5 s", "duration", "is not a known key", "it belongs into [run]"),
        ("title", 5, "title", "5 is not a text", "quotes"),
        ("drag", "0.22 N m", "drag", "'0.22 N m' is not a table", "[drag]"),
    ],
)  # fmt: skip
def test_a_bad_value_is_told_by_its_key(key, value, where, message, remedy):
    found = faults(BASE, {key: value})
    assert [fault.key for fault in found] == [where]
    assert message in found[0].message
    assert remedy in found[0].remedy


def test_a_centre_distance_too_small_jams():
    data = {**without("mount.backlash"), "mount": {"centre_distance": "314.9 mm"}}
    (fault,) = faults(data)
    assert fault.key == "mount.centre_distance"
    assert "the gears jam" in fault.message
    assert "at least 315 mm" in fault.remedy


@pytest.mark.parametrize(
    ("missing", "where", "message"),
    [
        ("mount", "mount", "has neither backlash nor centre_distance"),
        ("mount.backlash", "mount", "has neither backlash nor centre_distance"),
        ("gears.loose.teeth", "gears.loose.teeth", "is missing"),
        ("motion.mean", "motion.mean", "is missing"),
        ("format", "format", "is missing"),
    ],
)
def test_what_must_be_given_is_asked_for(missing, where, message):
    (fault,) = faults(without(missing))
    assert fault.key == where
    assert message in fault.message
    assert fault.remedy


def test_a_gear_that_stands_still_has_no_periods():
    assert [fault.key for fault in faults(BASE, {"motion.mean": "0 rpm"})] == ["run.settle"]
    load(BASE, {"motion.mean": "0 rpm", "motion.harmonics": [SINE]})


def test_a_missing_module_is_asked_of_both_gears():
    assert [fault.key for fault in faults(without("gears.module"))] == ["gears.drive.module", "gears.loose.module"]


def test_all_faults_come_at_once_in_the_order_of_the_file(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(
        'format = 1\ntitel = "x"\n[gears]\nmodule = "3 um rad"\ndrive = { teeth = 2 }\nloose = { teeth = 90 }\n'
        '[mount]\n[motion]\nmean = "3 Hz"\nharmonics = [ { amplitude = "1 rpm", frequency = "1 rpm" } ]\n'
        '[impact]\nrestitution = 2\n[[effect]]\nkind = "x"\n[run]\nduration = "0 s"\n'
    )
    found = faults(path)
    assert [fault.key for fault in found] == [
        "titel",
        "gears.module",
        "gears.drive.teeth",
        "mount",
        "motion.mean",
        "motion.harmonics[0].frequency",
        "impact.restitution",
        "effect[0].kind",
        "run.duration",
    ]
    assert {fault.file for fault in found} == {str(path)}


def test_a_missing_file_names_its_neighbours():
    (fault,) = faults("scenarios/rigaud-2020/fig5-20rmp.toml")
    assert fault.message == "there is no such file and no shipped scenario of this name"
    assert "'scenarios/rigaud-2020/fig5-20rpm.toml'" in fault.remedy
    (fault,) = faults("scenarios/rigaud-202/fig5-20rpm.toml")
    assert "'scenarios/rigaud-2020/fig5-20rpm.toml'" in fault.remedy


def test_a_folder_is_no_scenario():
    assert "is a folder" in faults("scenarios")[0].message


def test_what_is_not_toml_is_told_with_its_line(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text("format = 1\n[gears\n")
    (fault,) = faults(path)
    assert fault.message.startswith("is not TOML: line 2, column ")
    assert fault.file == str(path)
    path.write_text('format = 1\ntitle = "a"\ntitle = "b"\n')
    assert "is not TOML" in faults(path)[0].message
    path.write_bytes(b"title = '\xff'")
    assert "is not UTF-8" in faults(path)[0].message
    path.write_bytes(b"PK\x03\x04\x00\x00")
    assert "is not TOML" in faults(path)[0].message


@pytest.mark.parametrize("override", ["run.duration", "a..b=1", "=1", "motion.harmonics[x].phase=1"])
def test_a_malformed_override_is_a_usage_error(override):
    with pytest.raises(UsageError):
        load(BASE, [override])


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("motion.harmonics[3].phase=1 deg", "[3] of a list of 0; [+] appends"),
        ("gears[0].module=3 mm", "[0] of what is not a list"),
        ("extends=other.toml", "write it in the file"),
        ("drag.torque.max=1 N m", "leads through a value that is not a table"),
    ],
)
def test_an_override_that_leads_nowhere_is_told(override, message):
    (fault,) = faults(BASE, [override])
    assert fault.file == "--set"
    assert message in fault.message


def test_a_fault_of_an_override_is_blamed_on_it():
    (fault,) = faults(BASE, ["motion.mean=30 Hz"])
    assert (fault.file, fault.key) == ("--set", "motion.mean")


def test_an_effect_that_refuses_its_values_is_a_fault(monkeypatch):
    from gears3d.effects import drag_viscous

    def refuse(self):
        raise ValueError("the oil is cold")

    monkeypatch.setattr(drag_viscous.DragViscous, "__post_init__", refuse, raising=False)
    monkeypatch.setattr(
        drag_viscous.DragViscous, "__init__", lambda self, coefficient: self.__post_init__(), raising=True
    )
    (fault,) = faults(BASE, {"effect": [{"kind": "drag_viscous", "coefficient": "1 N m s"}]})
    assert (fault.key, fault.message) == ("effect[0]", "the oil is cold")


JUNK = st.recursive(
    st.one_of(
        st.booleans(),
        st.integers(-(10**6), 10**6),
        st.floats(),
        st.text(max_size=8),
        st.sampled_from(
            ["1 mm", "-3 Hz", "1e400 s", "2 periods", "x periods", "0 rpm", "1e300 m", "1e-300 kg m^2", "active"]
        ),
        st.just(datetime.date(2020, 1, 1)),
    ),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.dictionaries(
            st.sampled_from(["value", "uncertainty", "kind", "amplitude", "teeth", "x"]), inner, max_size=3
        ),
    ),
    max_leaves=4,
)
PLACES = [
    *[
        "format",
        "title",
        "gears",
        "gears.module",
        "gears.drive",
        "gears.loose.teeth",
        "gears.loose.inertia",
        "gears.bore",
    ],
    *[
        "gears.helix_angle",
        "gears.addendum",
        "mount",
        "mount.backlash",
        "mount.centre_distance",
        "motion.mean",
        "motion",
    ],
    *[
        "motion.harmonics",
        "motion.record",
        "drag.torque",
        "impact",
        "start.state",
        "run.duration",
        "run.settle",
        "run.seed",
    ],
    *["sensors", "sensors.drive", "sensors.loose.noise", "effect", "expect", "expect.regime", "versions", "extends"],
]


@pytest.mark.slow
@settings(max_examples=300, deadline=None)
@given(st.dictionaries(st.sampled_from(PLACES), JUNK, min_size=1, max_size=3))
def test_whatever_is_written_loads_or_is_told(values):
    try:
        scenario = load(BASE, values)
    except InputError as error:
        told = [fault.message for fault in error.faults]
    else:
        told = ["loads"] if load(scenario.document).rig() == scenario.rig() else []
    assert told
    assert all(told)
