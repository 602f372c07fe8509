"""Good scenarios: SI values, units of every kind, extends, overrides, the resolved document, the JSON Schema."""

import dataclasses
import json
import math
import pickle
import tomllib
from pathlib import Path

import jsonschema
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gears3d.effects import catalogue
from gears3d.errors import InputError
from gears3d.scenario import Harmonic, Scenario, Sensor, load, schema
from gears3d.scenario.document import names
from gears3d.units import show

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = [ROOT / "scenarios" / f"{name}.toml" for name in names()]
BASE = ROOT / "scenarios/base/rigaud-2020.toml"
FIG5 = ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml"
RPM = math.pi / 30

HALF = """
format = 1
title  = "Rigaud & Perret-Liaudet 2020, fig. 5, 20 rpm"
source = "rigaud-2020, fig. 5"
[gears]
module = "3.5 mm"
pressure_angle = "20 deg"
helix_angle = "0 deg"
face_width = "7.5 mm"
drive = { teeth = 90 }
loose = { teeth = 90, inertia = "0.0695 kg m^2" }
[mount]
backlash = "250 um"
[motion]
mean = "30 rpm"
harmonics = [ { amplitude = "20 rpm", frequency = "3 Hz", phase = "0 deg" } ]
[drag]
torque = "0.22 N m"
"""


@pytest.fixture(scope="module")
def validator():
    """What checks against the schema, which takes longer to read than a document."""
    return jsonschema.Draft202012Validator(schema())


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_every_shipped_scenario_is_sound(path, validator):
    scenario = load(path)
    assert scenario.title
    assert scenario.source
    assert scenario.path == path
    assert scenario.rig().backlash == pytest.approx(scenario.mount.backlash, rel=1e-9)
    validator.validate(tomllib.loads(path.read_text()))


def test_the_bench_is_the_papers():
    scenario = load(FIG5)
    rig = scenario.rig()
    assert rig.base_radius_drive == pytest.approx(0.1480016, abs=1e-7)
    assert rig.base_radius_loose == rig.base_radius_drive
    assert (rig.inertia, rig.drag_torque, rig.restitution) == (0.0695, 0.22, 0.3)
    assert (rig.teeth_drive, rig.teeth_loose) == (90, 90)
    assert scenario.motion.mean == pytest.approx(30 * RPM, rel=1e-15)
    (harmonic,) = scenario.motion.harmonics
    assert (harmonic.amplitude, harmonic.frequency, harmonic.phase) == (pytest.approx(20 * RPM), 3.0, 0.0)
    assert scenario.run.duration == 5.0
    assert scenario.run.settle == pytest.approx(2 / 3, rel=1e-15)
    assert scenario.period == pytest.approx(1 / 3, rel=1e-15)
    assert scenario.expect == {"regime": "double_sided"}
    assert rig.inertia * 2 * math.pi * 3 * harmonic.amplitude / rig.drag_torque == pytest.approx(12.47159, abs=5e-6)


@pytest.mark.parametrize(
    ("name", "excitation"),
    [("fig5-1.6rpm", 0.997727), ("fig6-1Hz", 1.039299), ("fig5-5rpm", 3.117898), ("fig10", 8.31439)],
)
def test_the_excitations_of_the_figures(name, excitation):
    scenario = load(FIG5.with_name(f"{name}.toml"))
    (harmonic,) = scenario.motion.harmonics
    found = 0.0695 * 2 * math.pi * harmonic.frequency * harmonic.amplitude / scenario.drag.torque
    assert found == pytest.approx(excitation, rel=1e-6)


def test_half_a_scenario_is_enough():
    half, whole = load(HALF), load(FIG5)
    same = ("title", "source", "gears", "mount", "motion", "drag", "start", "effects")
    assert all(getattr(half, name) == getattr(whole, name) for name in same)
    assert half.impact.stick_velocity == whole.impact.stick_velocity
    assert half.impact.restitution == 0
    assert half.run.duration == pytest.approx(20 / 3)
    assert half.sensors.drive.counts_per_revolution is None
    assert half.path is None


def test_a_harmonic_may_be_a_speed_an_angle_or_an_acceleration():
    omega = 2 * math.pi * 3
    for amplitude in ("20 rpm", show(20 * RPM / omega, "angle", 17), show(20 * RPM * omega, "acceleration", 17)):
        scenario = load(FIG5, {"motion.harmonics[0].amplitude": amplitude})
        assert scenario.motion.harmonics[0].amplitude == pytest.approx(20 * RPM, rel=1e-14)


def test_an_order_counts_per_mean_revolution():
    scenario = load(BASE, {"motion.harmonics": [{"amplitude": "20 rpm", "order": 6}]})
    (harmonic,) = scenario.motion.harmonics
    assert harmonic.frequency == pytest.approx(3.0, rel=1e-15)
    assert harmonic.order == 6
    assert scenario.with_({"motion.mean": "90 rpm"}).motion.harmonics[0].frequency == pytest.approx(9.0, rel=1e-15)


def test_uncertainties_are_absolute_si_by_key():
    scenario = load(
        FIG5,
        {
            "drag.torque": {"value": "0.22 N m", "uncertainty": "5 %"},
            "gears.loose.inertia": {"value": "0.0695 kg m^2", "uncertainty": "30 kg cm^2"},
            "motion.harmonics[0].amplitude": {"value": "2 rad/s^2", "uncertainty": "10 %"},
            "impact.restitution": {"value": 0.3, "uncertainty": 0.05},
            "effect": [{"kind": "transmission_error", "amplitude": {"value": "-50 um", "uncertainty": "10 %"}}],
        },
    )
    assert scenario.drag.torque == 0.22
    assert scenario.effects[0].amplitude == pytest.approx(-50e-6)
    assert scenario.uncertainty == pytest.approx(
        {
            "drag.torque": 0.011,
            "gears.loose.inertia": 0.003,
            "motion.harmonics[0].amplitude": 0.2 / (6 * math.pi),
            "impact.restitution": 0.05,
            "effect[0].amplitude": 5e-6,
        }
    )


def test_a_gear_overrides_the_common_keys():
    scenario = load(
        BASE, {"gears.profile_shift": 0.1, "gears.loose.profile_shift": -0.2, "gears.loose.face_width": "9 mm"}
    )
    assert (scenario.gears.drive.profile_shift, scenario.gears.loose.profile_shift) == (0.1, -0.2)
    assert (scenario.gears.drive.face_width, scenario.gears.loose.face_width) == (0.0075, 0.009)


@pytest.mark.parametrize("bore", ["", ', bore = "100 mm"'])
def test_an_inertia_that_is_not_given_is_the_solids(bore):
    from gears3d.gears import mass_properties, solid

    text = HALF.replace(', inertia = "0.0695 kg m^2"', bore + ', density = "7000 kg/m^3"')
    scenario = load(text)
    weighed = mass_properties(solid(scenario.pair(), "loose"), 7000.0)
    assert scenario.rig().inertia == pytest.approx(weighed.inertia[2, 2], rel=2e-5)
    assert scenario.gears.drive.inertia is None


def test_the_face_is_ten_modules_wide_when_nobody_says():
    assert load(HALF.replace('face_width = "7.5 mm"\n', "")).gears.drive.face_width == pytest.approx(0.035)


def test_centre_distance_in_place_of_backlash_and_beside_it():
    only = load(HALF.replace('backlash = "250 um"', 'centre_distance = "315.5 mm"'))
    assert only.rig().backlash == pytest.approx(only.pair().backlash)
    both = load(BASE, {"mount.centre_distance": "315.2 mm"})
    assert both.rig().backlash == pytest.approx(250e-6, rel=1e-9)
    assert both.pair().centre_distance == 0.3152
    back = load(HALF.replace('backlash = "250 um"', f'centre_distance = "{load(BASE).pair().centre_distance!r} m"'))
    assert back.rig().backlash == pytest.approx(250e-6, rel=1e-9)


def test_a_sensor_value_given_once_serves_both_gears():
    scenario = load(BASE, {"sensors.loose.counts_per_revolution": 8192})
    assert scenario.sensors.drive.counts_per_revolution == 1_600_000
    assert scenario.sensors.loose.counts_per_revolution == 8192
    assert scenario.sensors.sample_rate == 50e3


def test_effects_are_objects_in_order_and_rows_follow():
    text = FIG5.read_text() + (
        '[[effect]]\nkind = "transmission_error"\norder = 1\namplitude = "50 um"\nphase = "40 deg"\n'
        '[[effect]]\nkind = "drag_viscous"\ncoefficient = "1e-3 N m s/rad"\n'
    )
    scenario = load(text)
    first, second = scenario.effects
    assert first == catalogue()["transmission_error"](amplitude=first.amplitude, order=1, phase=math.radians(40))
    assert type(first.order) is int
    assert first.amplitude == pytest.approx(50e-6)
    assert second.coefficient == 1e-3
    assert scenario.rows() == (*first.rows(scenario.rig()), *second.rows(scenario.rig()))


class TestOverrides:
    def test_texts_pairs_and_mappings_do_the_same(self):
        results = [
            load(FIG5, ["motion.mean=90 rpm", "impact.restitution=0.5"]),
            load(FIG5, [("motion.mean", "90 rpm"), ("impact.restitution", 0.5)]),
            load(FIG5, {"motion.mean": "90 rpm", "impact.restitution": 0.5}),
            load(FIG5).with_({"motion.mean": "90 rpm"}).with_(["impact.restitution = 0.5"]),
        ]
        assert all(result == results[0] for result in results)
        assert results[0].motion.mean == pytest.approx(90 * RPM)
        assert results[0].impact.restitution == 0.5

    def test_lists_take_indices_from_both_ends_and_grow(self):
        scenario = load(
            FIG5,
            [
                "motion.harmonics[0].phase=90 deg",
                'motion.harmonics[+]={ amplitude = "1 rpm", frequency = "6 Hz" }',
                "motion.harmonics[-1].amplitude=2 rpm",
                "effect[+].kind=drag_viscous",
                "effect[0].coefficient=1e-3 N m s/rad",
                'effect[+]={ kind = "transmission_error", amplitude = "5 um" }',
            ],
        )
        first, second = scenario.motion.harmonics
        assert (first.phase, second.frequency) == (pytest.approx(math.pi / 2), 6.0)
        assert second.amplitude == pytest.approx(2 * RPM)
        assert [effect.kind for effect in scenario.effects] == ["drag_viscous", "transmission_error"]
        assert load(scenario.document).effects == scenario.effects

    def test_a_section_that_is_not_there_is_made(self):
        assert load(HALF, ["expect.regime=contact", "sensors.drive.noise=1 mrad"]).expect == {"regime": "contact"}

    def test_the_original_stays_as_it_is(self):
        scenario = load(FIG5)
        document = scenario.document
        scenario.with_({"motion.mean": "90 rpm"})
        assert scenario.document == document
        with pytest.raises(dataclasses.FrozenInstanceError):
            scenario.title = "x"


class TestExtends:
    def test_a_chain_relative_to_each_file(self, tmp_path):
        (tmp_path / "deep").mkdir()
        (tmp_path / "base.toml").write_text(HALF)
        (tmp_path / "deep" / "middle.toml").write_text('extends = "../base.toml"\n[impact]\nrestitution = 0.5\n')
        top = tmp_path / "top.toml"
        top.write_text('extends = "deep/middle.toml"\n[motion]\nmean = "90 rpm"\n[gears]\nloose = { teeth = 45 }\n')
        scenario = load(top)
        assert scenario.motion.mean == pytest.approx(90 * RPM)
        assert scenario.impact.restitution == 0.5
        assert (scenario.gears.loose.teeth, scenario.gears.loose.inertia) == (45, 0.0695)
        assert len(scenario.motion.harmonics) == 1
        assert "extends" not in tomllib.loads(scenario.document)

    def test_a_circle_is_refused(self, tmp_path):
        (tmp_path / "a.toml").write_text('extends = "b.toml"\n')
        (tmp_path / "b.toml").write_text('extends = "a.toml"\n')
        with pytest.raises(InputError, match=r"goes round in a circle: a.toml -> b.toml -> a.toml"):
            load(tmp_path / "a.toml")

    def test_a_missing_base_is_blamed_on_the_file_that_names_it(self, tmp_path):
        (tmp_path / "rigaud.toml").write_text(HALF)
        (tmp_path / "a.toml").write_text('extends = "rigaut.toml"\n')
        with pytest.raises(InputError) as caught:
            load(tmp_path / "a.toml")
        (fault,) = caught.value.faults
        assert (fault.key, fault.file) == ("extends", str(tmp_path / "a.toml"))
        assert "rigaud.toml" in fault.remedy

    def test_a_fault_is_blamed_on_the_file_it_stands_in(self, tmp_path):
        (tmp_path / "base.toml").write_text(HALF.replace("30 rpm", "30 Hz"))
        (tmp_path / "a.toml").write_text('extends = "base.toml"\n[impact]\nrestitution = 2\n')
        with pytest.raises(InputError) as caught:
            load(tmp_path / "a.toml")
        places = {fault.key: Path(fault.file).name for fault in caught.value.faults}
        assert places == {"motion.mean": "base.toml", "impact.restitution": "a.toml"}

    def test_a_record_is_relative_to_the_file_that_names_it(self, tmp_path):
        (tmp_path / "deep").mkdir()
        (tmp_path / "deep" / "drive.csv").write_text("time_s\n")
        (tmp_path / "deep" / "base.toml").write_text(HALF.replace("[drag]", 'record = "drive.csv"\n[drag]'))
        (tmp_path / "a.toml").write_text('extends = "deep/base.toml"\n')
        scenario = load(tmp_path / "a.toml")
        assert scenario.motion.record == (tmp_path / "deep" / "drive.csv").resolve()
        assert load(scenario.document).motion == scenario.motion


class TestDocument:
    @pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
    def test_the_resolved_text_is_the_same_scenario(self, path, validator):
        scenario = load(path)
        again = load(scenario.document)
        assert dataclasses.replace(again, path=path) == scenario
        validator.validate(tomllib.loads(scenario.document))

    def test_comments_survive(self):
        document = load(FIG5, {"motion.mean": "90 rpm"}).document
        assert "# the loose gear rests on the flank that drives it" in document
        assert 'mean = "90 rpm"' in document
        assert "# The inertia is not printed." in load(FIG5.with_name("fig8.toml")).document

    def test_versions_may_be_noted(self):
        assert load(HALF + '[versions]\ngears3d = "0.1.0"\n') == dataclasses.replace(
            load(HALF), document=HALF + '[versions]\ngears3d = "0.1.0"\n'
        )

    def test_a_scenario_can_be_pickled_and_hashed(self):
        scenario = load(FIG5)
        scenario.rig()
        assert pickle.loads(pickle.dumps(scenario)) == scenario
        assert hash(scenario) == hash(load(FIG5))

    @settings(max_examples=40, deadline=None)
    @given(
        mean=st.floats(-2000, 2000).filter(lambda rpm: abs(rpm) > 1),
        backlash=st.floats(1, 900),
        restitution=st.floats(0, 1),
        phase=st.floats(-360, 360, allow_subnormal=False),  # 5e-324 deg is no number in rad
    )
    def test_values_survive_the_way_through_text(self, mean, backlash, restitution, phase):
        scenario = load(
            FIG5,
            {
                "motion.mean": f"{mean!r} rpm",
                "mount.backlash": f"{backlash!r} um",
                "impact.restitution": restitution,
                "motion.harmonics[0].phase": f"{phase!r} deg",
            },
        )
        again = load(scenario.document)
        assert dataclasses.replace(again, path=FIG5) == scenario
        assert scenario.motion.mean == pytest.approx(mean * RPM, rel=1e-15)
        assert scenario.rig().backlash == pytest.approx(backlash * 1e-6, rel=1e-7)


class TestSchema:
    def test_it_is_a_schema_and_knows_every_effect(self):
        document = schema()
        jsonschema.Draft202012Validator.check_schema(document)
        assert json.loads(json.dumps(document)) == document
        kinds = [item["properties"]["kind"]["const"] for item in document["properties"]["effect"]["items"]["oneOf"]]
        assert kinds == list(catalogue())

    @pytest.mark.parametrize(
        "change",
        [
            {"format": 2},
            {"titel": "x"},
            {"gears": {"modul": "3 mm"}},
            {"gears": {"drive": {"teeth": 2}}},
            {"gears": {"module": 3}},
            {"impact": {"restitution": 1.5}},
            {"start": {"state": "actif"}},
            {"effect": [{"kind": "x"}]},
            {"effect": [{"kind": "drag_viscous"}]},
        ],
    )
    def test_it_refuses_what_the_reader_refuses(self, change, validator):
        document = {**tomllib.loads(HALF), **change}
        assert not validator.is_valid(document)
        with pytest.raises(InputError):
            load(document)


def test_the_types_are_what_the_rooms_expect():
    scenario = load(FIG5)
    assert isinstance(scenario, Scenario)
    for part in dataclasses.astuple(scenario.run):
        assert isinstance(part, float | int)
    assert scenario.pair() is scenario.pair()


def test_parts_made_in_python_take_si_numbers_and_texts_with_a_unit():
    assert Sensor(4096, "1 mrad") == Sensor(4096, 1e-3)
    assert Harmonic("60 rpm", 2.0).amplitude == pytest.approx(2 * math.pi)
    for amplitude, message in (("3 deg", "is an angle, not a rotational speed"), ("60", "has no unit")):
        with pytest.raises(ValueError, match=message):
            Harmonic(amplitude, 2.0)
    with pytest.raises(ValueError, match="at least 1"):
        Sensor("0")
