"""Drag part by part: joint fits of assemblies, trends over temperature, the mesh as what is lost together."""

import json

import numpy as np
import pytest

from gears3d import cli
from gears3d.errors import InputError
from gears3d.identify import (
    Inertia,
    Oil,
    Run,
    Share,
    identify_assemblies,
    identify_mesh_drag,
    identify_rundown,
    make_track,
)
from gears3d.laws import dynamic_viscosity
from gears3d.lumped.rig_tests import DriveDrag, rundown
from gears3d.recording import Recording
from gears3d.scenario import load
from tests.identify import shafts

SHAFT, GEARED = 1e-3, 2.2e-3
"""Inertias of the shaft alone and with its gear [kg m^2]."""
BEARING = (0.02, 2e-4)
"""Dry [N m] and viscous [N m s/rad]."""
OIL = Oil(((40.0, 34e-6), (100.0, 7e-6)), 850.0)


def added(seed, inertia, torque=0.0, coefficient=0.0, power=0.0, exponent=1.0, speed=78.0, counts=8192, rate=5e3):
    """Return a track of a run-down solved to 1e-11, cut at 2 % of the speed, seen by an encoder."""
    time, angle = shafts.solved(inertia, torque, coefficient, power, exponent, speed, rate)
    return make_track(time, shafts.counted(angle, counts, seed))


def assembled(temperatures=(50.0,), shaft_speed=0.0):
    """Return runs of the three assemblies, and the true drags of shear and churning at each temperature."""
    dry, viscous = BEARING
    runs = [
        Run(added(seed, SHAFT, dry, viscous, speed=speed), (Share("bearing"),), (("shaft", 1.0),))
        for seed, speed in ((1, 78.0), (2, 60.0))
    ]
    truth = {}
    for seed, at in enumerate(temperatures):
        thick = float(dynamic_viscosity(OIL.points, OIL.density, at))
        shear, churning = 0.02 * thick, 0.02 * thick**0.21
        truth[at] = (shear, churning)
        both, slow = (Share("bearing"), Share("shear", 1.0, shaft_speed)), shear * shaft_speed
        one = added(10 + seed, GEARED, dry - slow, viscous + shear)
        other = added(20 + seed, GEARED, dry - slow, viscous + shear, churning, 0.59)
        runs.append(Run(one, both, (("geared", 1.0),), at))
        runs.append(Run(other, (*both, Share("churning")), (("geared", 1.0),), at))
    return runs, truth


LAWS = {"bearing": "coulomb+viscous"}
KNOWN = {"shaft": Inertia(SHAFT), "geared": Inertia(GEARED)}


def off(parameter, truth):
    """Return the error in standard deviations."""
    return (parameter.value - truth) / ((parameter.high - parameter.low) / 3.92)


def test_each_part_is_found_where_it_comes_in():
    runs, truth = assembled()
    found = identify_assemblies(runs, KNOWN)
    assert found.law == "bearing: coulomb+viscous, shear: viscous, churning: power"
    shear, churning = truth[50.0]
    expected = {
        "bearing.coulomb": BEARING[0],
        "bearing.viscous": BEARING[1],
        "shear.viscous": shear,
        "churning.coefficient": churning,
        "churning.exponent": 0.59,
    }
    for name, value in expected.items():
        assert abs(off(found.parameters[name], value)) < 4.0, name
        assert found.parameters[name].value == pytest.approx(value, rel=1e-3)
    scenario = load('format = 1\nextends = "scenarios/base/rigaud-2020.toml"\n' + found.snippet)
    assert [effect.kind for effect in scenario.effects] == ["drag_viscous", "drag_viscous", "drag_power"]


def test_an_unsure_inertia_is_known_from_the_part_that_stays():
    """The dry friction of the bearing is known from the shaft alone, so its deceleration tells the second inertia."""
    runs, truth = assembled()
    wrong = {**KNOWN, "geared": Inertia(1.03 * GEARED, 0.02 * GEARED)}
    found = identify_assemblies(runs, wrong, LAWS)
    assert abs(off(found.parameters["shear.viscous"], truth[50.0][0])) < 4.0
    assert found.parameters["shear.viscous"].value == pytest.approx(truth[50.0][0], rel=3e-3)
    sure = identify_assemblies(runs, KNOWN, LAWS).parameters["shear.viscous"]
    assert found.parameters["shear.viscous"].high - found.parameters["shear.viscous"].low > sure.high - sure.low


def test_where_nothing_stays_the_inertia_is_as_unsure_as_it_was():
    shares, sigma = (Share("gear"),), 0.02 * GEARED
    runs = [Run(added(seed, GEARED, 0.02, 6e-4), shares, (("geared", 1.0),)) for seed in (1, 2)]
    found = identify_assemblies(runs, {"geared": Inertia(GEARED, sigma)}, {"gear": "coulomb+viscous"}).parameters
    for name, value in (("gear.coulomb", 0.02), ("gear.viscous", 6e-4)):
        assert found[name].high - found[name].low == pytest.approx(3.92 * 0.02 * value, rel=1e-2)


@pytest.mark.slow
def test_the_trend_over_temperature_is_that_of_the_oil():
    runs, truth = assembled((30.0, 40.0, 50.0))
    found = identify_assemblies(runs, KNOWN, LAWS, oil=OIL)
    assert found.parameters["shear@30.viscous"].value == pytest.approx(truth[30.0][0], rel=1e-3)
    assert "bearing.coulomb" in found.parameters  # recorded dry, so the same at every temperature
    trend = found.goodness["temperature"]
    assert trend["shear.viscous"]["p_constant"] < 1e-6
    assert trend["shear.viscous"]["viscosity_exponent"]["value"] == pytest.approx(1.0, abs=2e-3)
    assert trend["shear.viscous"]["p_viscosity"] > 1e-3
    assert trend["churning.coefficient"]["viscosity_exponent"]["value"] == pytest.approx(0.21, abs=2e-3)
    assert trend["churning.exponent"]["p_constant"] > 1e-3
    assert found.snippet.startswith("# at 40 degC")


def test_shear_goes_with_the_speed_against_the_shaft():
    runs, truth = assembled(shaft_speed=-15.0)
    found = identify_assemblies(runs, KNOWN, LAWS)
    assert abs(off(found.parameters["shear.viscous"], truth[50.0][0])) < 4.0
    assert abs(off(found.parameters["bearing.coulomb"], BEARING[0])) < 4.0
    assert 'kind = "drag_differential"' in found.snippet
    assert 'shaft_speed = "-15 rad/s"' in found.snippet


def test_parts_that_always_come_together_are_refused():
    runs, _ = assembled()
    with pytest.raises(InputError, match="bearing and shear come together in every run"):
        identify_assemblies(runs[2:], KNOWN)


def test_plain_records_at_several_temperatures_have_a_law_at_each():
    tracks = [
        added(seed, GEARED, 0.02, slope)._replace(temperature=at)
        for seed, (at, slope) in enumerate(((30.2, 8e-4), (40.1, 6e-4), (49.8, 4.5e-4)))
    ]
    found = identify_rundown(tracks, GEARED, law="coulomb+viscous")
    assert found.parameters["drag@40.viscous"].value == pytest.approx(6e-4, rel=1e-3)
    assert found.goodness["temperature"]["drag.viscous"]["change_1_K"]["value"] < -0.02
    assert found.goodness["temperature"]["drag.coulomb"]["p_constant"] > 1e-4


MESH = """format = 1
extends = "scenarios/base/ottewill-2010.toml"
[gears]
drive = { teeth = 27, inertia = "0.03 kg m^2" }
[drag]
torque = "0.01 N m"
[[effect]]
kind = "drag_viscous"
coefficient = "0.02 N m s/rad"
[[effect]]
kind = "mesh_drag"
coefficient = "0.015 N m s/rad"
"""


def coasting(scenario, turning, seed):
    """Return what the encoder of Ottewill's rig sees of a run-down from 2 Hz."""
    made = rundown(scenario, 12.0, turning=turning, drive_drag=DriveDrag(0.03, 0.005))
    gear = "drive" if turning == "drive" else "loose"
    return make_track(made.time, shafts.counted(made.signals[f"theta_{gear}_rad"], 40_000, seed))


@pytest.mark.slow
def test_the_mesh_is_what_both_gears_lose_together_more_than_alone():
    scenario = load(MESH)
    tracks = [[coasting(scenario, turning, seed)] for seed, turning in enumerate(("loose", "drive", "both"))]
    found = identify_mesh_drag(*tracks, (Inertia(0.01), Inertia(0.03)), 18 / 27)
    assert abs(off(found.parameters["mesh_drag"], 0.015)) < 4.0
    assert found.parameters["mesh_drag"].value == pytest.approx(0.015, rel=2e-3)
    assert found.parameters["drive.viscous"].value == pytest.approx(0.005, rel=2e-3)
    back = load('format = 1\nextends = "scenarios/base/rigaud-2020.toml"\n' + found.snippet)
    assert [effect.kind for effect in back.effects] == ["drag_viscous", "mesh_drag"]
    assert not found.warnings


@pytest.mark.slow
def test_a_mesh_that_rubs_dry_is_told():
    base, both = load(MESH), load(MESH.replace('torque = "0.01', 'torque = "0.05'))
    tracks = [
        [coasting(base, "loose", 1)],
        [coasting(base, "drive", 2)],
        [coasting(both, "both", 3)],
    ]
    found = identify_mesh_drag(*tracks, (Inertia(0.01), Inertia(0.03)), 18 / 27)
    assert any("a constant part of 0.04 N m" in note for note in found.warnings)


def test_both_gears_run_down_as_one():
    """Two coupled equations of motion, solved with a stiff spring between them, agree with the single inertia."""
    from scipy.integrate import solve_ivp

    scenario, n = load(MESH), 18 / 27
    made = rundown(scenario, 12.0, turning="both", drive_drag=DriveDrag(0.03, 0.005))

    def slowing(_, y):
        twist = 300.0 * (y[0] - n * y[2]) + 2.0 * (y[1] - n * y[3])  # on the drive; n times as much on the loose gear
        drive = -0.03 - 0.005 * y[1] - twist
        loose = -0.01 - (0.02 + 0.015) * y[3] + n * twist
        return [y[1], drive / 0.03, y[3], loose / 0.01]

    at = made.time[made.time < 0.5]
    truth = solve_ivp(slowing, (0.0, at[-1]), [0.0, n * 12.0, 0.0, 12.0], t_eval=at, rtol=1e-9, atol=1e-9)
    assert made.signals["theta_loose_rad"][: len(at)] == pytest.approx(truth.y[2], abs=2e-3)
    assert made.signals["theta_drive_rad"] == pytest.approx(n * made.signals["theta_loose_rad"])


CAMPAIGN = """format = 1
inertia = "2.2e-3 kg m^2"
[[run]]
files = ["bearing.csv"]
parts = ["bearing"]
inertia = { value = "1e-3 kg m^2", uncertainty = "1 %" }
[[run]]
files = ["shear.csv"]
parts = ["bearing", "shear"]
temperature = "50 degC"
"""


@pytest.fixture
def campaign(tmp_path):
    for name, inertia, viscous, seed in (("bearing", SHAFT, 2e-4, 1), ("shear", GEARED, 6e-4, 2)):
        time, angle = shafts.solved(inertia, 0.02, viscous, 0.0, 1.0, 78.0, 2e3)
        seen = shafts.counted(angle, 8192, seed)
        Recording({"time_s": time, "theta_drive_rad": 0 * time, "theta_loose_rad": seen}).write(
            tmp_path / f"{name}.csv"
        )
    file = tmp_path / "campaign.toml"
    file.write_text(CAMPAIGN)
    return file


def test_a_campaign_file_says_what_was_in(campaign, capsys):
    with pytest.raises(SystemExit) as stop:
        cli.main(["identify", "coastdown", str(campaign), "--json", "--out", str(campaign.with_suffix(".png"))])
    assert not stop.value.code
    told = json.loads(capsys.readouterr().out)
    low, high = told["parameters"]["shear.viscous"]["ci95"]
    assert low <= 4e-4 <= high
    assert campaign.with_suffix(".png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("format = 1", "format = 2", "format: is 2"),
        ('parts = ["bearing"]', "parts = []", r"run\[0\].parts: is \[\]"),
        ('temperature = "50 degC"', 'temperature = "50 rpm"', r"run\[1\].temperature"),
        ('temperature = "50 degC"', 'temprature = "50 degC"', "did you mean 'temperature'"),
        ('inertia = "2.2e-3 kg m^2"', "", r"run\[1\].inertia: is missing"),
        ('uncertainty = "1 %"', 'uncertainty = "1 kg"', r"run\[0\].inertia.uncertainty"),
        ('files = ["bearing.csv"]', 'files = ["no.csv"]', "is not there"),
        ("[[run]]", "[part.churn]\nlaw = 'power'\n[[run]]", "part.churn: is in no run"),
        ("[[run]]", "[part.shear]\nlaw = 'cubic'\n[[run]]", "there is no law 'cubic'"),
        ("[[run]]", "[oil]\nkinematic_viscosity = [1]\n[[run]]", "is no pair of points"),
        ("format = 1", "format 1", "is no TOML"),
    ],
)
def test_what_is_wrong_in_a_campaign_is_told_by_its_key(campaign, old, new, told):
    from gears3d.identify import read_campaign

    campaign.write_text(CAMPAIGN.replace(old, new, 1))
    with pytest.raises(InputError, match=told):
        read_campaign(campaign)


def test_a_bench_records_and_identifies_its_mesh_drag(tmp_path, capsys):
    rig = tmp_path / "rig.toml"
    rig.write_text(
        MESH.replace("scenarios/", f"{load('scenarios/base/ottewill-2010.toml').path.parents[1].resolve()}/")
    )
    for turning in ("loose", "drive", "both"):
        words = ["synthesize", str(rig), "--test", "coastdown", "--speed", "12 rad/s", "--turning", turning]
        words += [
            "--drive-drag",
            "0.03 N m",
            "--drive-damping",
            "5e-3 N m s/rad",
            "--out",
            str(tmp_path / f"{turning}.csv"),
        ]
        with pytest.raises(SystemExit) as stop:
            cli.main(words)
        assert not stop.value.code
    capsys.readouterr()
    files = [str(tmp_path / "loose.csv"), "--drive-alone", str(tmp_path / "drive.csv"), "--meshed"]
    with pytest.raises(SystemExit) as stop:
        cli.main(["identify", "coastdown", *files, str(tmp_path / "both.csv"), "--rig", str(rig), "--json"])
    assert not stop.value.code
    low, high = json.loads(capsys.readouterr().out)["parameters"]["mesh_drag"]["ci95"]
    assert low < 0.015 < high
    assert high - low < 1e-3 * 0.015 or high - low < 1e-4


def test_what_a_bench_cannot_do_is_told():
    scenario = load(MESH)
    with pytest.raises(InputError, match=r"gears\.drive\.inertia"):
        rundown(load("scenarios/base/ottewill-2010.toml"), 12.0, turning="both")
    rubbed = scenario.with_({"effect[+]": {"kind": "mesh_friction", "coefficient": 0.05}})
    with pytest.raises(InputError, match="mesh_friction"):
        rundown(rubbed, 12.0, turning="both")
    with pytest.raises(InputError, match=r"--drive-alone"):
        identify_mesh_drag([added(1, SHAFT, 0.02)], [], [added(1, SHAFT, 0.02)], (Inertia(1.0), Inertia(1.0)), 1.0)
    assert np.all(
        rundown(scenario, 12.0, turning="drive", drive_drag=DriveDrag(0.03)).signals["theta_loose_rad"] == 0.0
    )
