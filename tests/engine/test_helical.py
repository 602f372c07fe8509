"""Helical teeth: lines of contact where geometry has them, a constant ratio, impacts and thrust as they must be."""

import json
from math import cos, isfinite, tan

import numpy as np
import pytest

from gears3d import cli
from gears3d.bench import static_error
from gears3d.comparison import compare
from gears3d.engine import run, simulate
from gears3d.engine.lines import line_gap
from gears3d.engine.mesh import meshed
from gears3d.errors import EngineError, InputError
from gears3d.gears import (
    ToothDeviation,
    compile_surfaces,
    contact_lines,
    mates,
    quasi_static,
    surface_gap,
    surface_point,
)
from gears3d.gears.surface import facing
from gears3d.lumped import rigid
from gears3d.scenario import eccentricities, flank_deviations, load

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
TWIN = {"gears.helix_angle": "25 deg", "run.settle": "0 s"}
WAVE = {"kind": "transmission_error", "order": 5, "amplitude": "20 um"}
BENCH = """
format = 1
[gears]
module = "3 mm"
helix_angle = "25 deg"
face_width = "14 mm"
drive = { teeth = 19, profile_shift = 0.3 }
loose = { teeth = 31, profile_shift = -0.2, inertia = "4e-3 kg m^2" }
[mount]
backlash = "150 um"
[motion]
mean = "150 rpm"
[drag]
torque = "0.2 N m"
[run]
duration = "1 s"
settle = "0 s"
[sensors]
sample_rate = "20 kHz"
"""


def shaped(scenario):
    rows = scenario.rows()
    return scenario.pair().with_deviations(*flank_deviations(rows)).with_mounting(*eccentricities(rows))


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"effect": [{"kind": "pitch_error", "tooth": 3, "offset": "9 um"}]},
        {"effect": [{"kind": "transmission_error", "order": 7, "amplitude": "6 um"}]},
        {"effect": [{"kind": "eccentricity", "gear": "loose", "offset": "20 um"}]},
        {"gears.lead_crowning": "8 um"},
        {"gears.tip_relief": {"amount": "15 um", "length": "2 mm"}},
        {"gears.drive.helix_slope": "10 um"},
        {"gears.helix_angle": "0 deg", "gears.loose.helix_slope": "-8 um"},
        {"gears.loose.profile_wave": {"amplitude": "1 um", "waves": 2}},
    ],
    ids=["perfect", "tooth", "wave", "eccentric", "crowned", "relief", "slope", "spur slope", "profile wave"],
)
def test_the_gap_is_the_least_over_the_face(changes):
    scenario = load(BENCH, changes)
    pair = shaped(scenario)
    mesh, surfaces = meshed(pair), compile_surfaces(pair)
    draw = np.random.default_rng(3)
    compared = 0
    for _ in range(12):
        theta = draw.uniform(-3.0, 3.0)
        ahead = (pair.drive.base_radius * theta + draw.uniform(0.0, pair.backlash)) / pair.loose.base_radius
        for side in (0, 1):
            found = [line_gap(mesh.along, theta, ahead, *both, side) for both in mates(surfaces, theta, ahead, side)]
            exact = [surface_gap(surfaces, theta, ahead, *both, side) for both in mates(surfaces, theta, ahead, side)]
            for mine, theirs in zip(found, exact, strict=True):
                if isfinite(theirs[0]) and theirs[0] < 1e-3:
                    compared += 1
                    assert mine[0] == pytest.approx(theirs[0], abs=2e-10)
            nearest = int(np.argmin([theirs[0] for theirs in exact]))
            assert found[nearest][0] == pytest.approx(exact[nearest][0], abs=1e-12)
            assert found[nearest][1:3] == pytest.approx(exact[nearest][1:3], rel=1e-5)
    assert compared > 30


def test_teeth_face_each_other_where_lines_of_contact_lie():
    pair = load(BENCH).pair()
    mesh = meshed(pair)
    for theta in (-0.4, 0.0, 0.07, 0.21, 1.3):
        for side, flank in enumerate(("active", "reverse")):
            lines = contact_lines(pair, theta, flank)
            loose = (pair.drive.base_radius * theta + side * pair.backlash) / pair.loose.base_radius
            assert len(lines.teeth) >= 2
            for teeth, points in zip(lines.teeth, lines.points, strict=True):
                low, high, _ = facing(mesh.along.surfaces, (theta, loose), tuple(teeth), side, 0.0)
                assert (low, high) == pytest.approx(np.sort(points[:, 2]), abs=1e-12)


@pytest.mark.slow
def test_the_twin_of_25_degrees_and_its_thrust():
    scenario = load(FIG5, {**TWIN, "gears.face_width": "15 mm", "run.duration": "0.8 s"})
    made = simulate(scenario)
    found = compare(made, rigid.simulate(scenario)).to_dict()
    assert found["impacts_matched"] == found["impacts_compared"] > 10
    assert found["impacts_invented"] == 0
    assert found["velocity_error_median"] < 1e-6
    assert found["velocity_error_p95"] < 1e-6
    pair = scenario.pair()
    surfaces = compile_surfaces(pair)
    hits = made.impacts
    mass = scenario.rig().inertia / pair.loose.base_radius**2
    tangential = mass * (hits["rebound_m_s"] - hits["velocity_m_s"]) * cos(pair.working_pressure_angle)
    assert np.abs(hits["axial_impulse_N_s"] / tangential) == pytest.approx(tan(pair.drive.helix_angle), rel=1e-2)
    # and along the normal of the surface, differenced from its points
    for k in range(6):
        side, teeth = int(hits["flank"][k]), (int(hits["tooth_drive"][k]), int(hits["tooth_loose"][k]))
        z = float(hits["height_m"][k])
        point, _, by_roll, by_height = surface_point(surfaces, 1, side, teeth[1], 0.36, z)
        normal = np.cross(by_roll, by_height)
        torque = point[0] * normal[1] - point[1] * normal[0]
        moment = -mass * pair.loose.base_radius * (hits["rebound_m_s"][k] - hits["velocity_m_s"][k])
        assert hits["axial_impulse_N_s"][k] == pytest.approx(moment * normal[2] / torque, rel=1e-9)
    half = 0.5 * pair.drive.face_width
    assert np.all(np.abs(hits["height_m"]) <= half)


IDLER = """
format = 1
gears.drive = { teeth = 23 }
gears.loose = { teeth = 41, inertia = "1.2e-4 kg m^2" }
gears.module = "1.75 mm"
gears.helix_angle = "18 deg"
gears.face_width = "14 mm"
mount = { centre_distance = "58.88 mm", backlash = "51.8 um" }
motion = { mean = "1500 rpm", harmonics = [ { amplitude = "12 rpm", order = 2 } ] }
drag = { torque = "0.06 N m" }
impact = { restitution = 0.3 }
run = { duration = "0.01 s", settle = "0 s", output_rate = "200 kHz" }
"""
PITCH = {"kind": "pitch_error", "gear": "loose", "tooth": 5, "offset": "5.6 um"}
WAVED = {
    "two": ({"gears.loose.profile_wave": {"amplitude": "2 um", "waves": 2}}, False),
    "one": ({"gears.loose.profile_wave": {"amplitude": "2 um", "waves": 1}}, False),
    "many": ({"gears.loose.profile_wave": {"amplitude": "0.05 um", "waves": 12}}, False),
    "all": (
        {
            "gears.loose.profile_wave": {"amplitude": "2 um", "waves": 2},
            "gears.loose.eccentricity": {"offset": "7.5 um"},
            "effect": [PITCH],
        },
        True,
    ),
    "on both gears": (
        {
            "gears.drive.profile_wave": {"amplitude": "1.5 um", "waves": 1.5, "phase": "40 deg"},
            "gears.drive.helix_slope": "5 um",
            "gears.loose.profile_wave": {"amplitude": "2 um", "waves": 2, "phase": "90 deg"},
            "gears.loose.lead_crowning": "3 um",
        },
        True,
    ),
}


@pytest.mark.parametrize("case", WAVED)
def test_waves_of_profiles_move_helical_gears_as_in_the_twin(case):
    """The load passes from crest to crest, of the same teeth, too; where a next one stands out, by an impact."""
    changes, rattles = WAVED[case]
    scenario = load(IDLER, changes)
    made, twin = simulate(scenario), rigid.simulate(scenario)
    assert made.meta["error_budget"]["location"] < 1.1e-11
    off = made.signals["displacement_m"] - twin.signals["displacement_m"]
    assert np.abs(off).max() < (2e-9 if rattles else 1e-12)
    told = compare(made, twin, mode="trajectory", flight_height_min=1e-9).to_dict()
    assert told["impacts_missed"] == told["impacts_invented"] == 0
    assert told["impacts_matched"] >= (4 if rattles else 0)


def test_spur_gears_have_no_thrust_and_native_contact_no_helix():
    made = simulate(load(FIG5, {"run.duration": "0.2 s", "run.settle": "0 s"}))
    assert not {"height_m", "axial_impulse_N_s"} & set(made.impacts)
    with pytest.raises(InputError, match="helix_angle"):
        simulate(load(FIG5, {**TWIN, "run.duration": "0.2 s"}), contact="native")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("rigaud-2020/fig5-20rpm", {**TWIN, "run.duration": "5 s", "impact.restitution": 0.7}),
        ("rigaud-2020/fig10", {**TWIN, "run.duration": "2 s"}),
        ("kadmiri-2012/fig12-750rpm", {"motion.harmonics[0].amplitude": "180 rpm", "run.duration": "0.6 s"}),
        ("kadmiri-2012/fig12-250rpm", {"motion.harmonics[0].amplitude": "400 rpm", "run.duration": "1 s"}),
        (
            "rigaud-2020/fig5-20rpm",
            {
                **TWIN,
                "run.duration": "2 s",
                "effect": [{"kind": "transmission_error", "order": 5, "amplitude": "20 um"}],
            },
        ),
    ],
)
def test_impacts_are_those_of_the_twin(name, changes):
    scenario = load(f"scenarios/{name}.toml", {"run.settle": "0 s", **changes})
    found = compare(simulate(scenario), rigid.simulate(scenario), mode="trajectory").to_dict()
    assert found["impacts_compared"] > 10
    assert found["velocity_error_median"] < 5e-3
    assert found["velocity_error_p95"] < 1.5e-2
    assert found["regime_equal"]


@pytest.mark.slow
def test_what_is_imposed_on_helical_teeth_comes_back():
    effects = [
        {"kind": "pitch_error", "tooth": 4, "offset": "8 um", "flank": "active"},
        {"kind": "transmission_error", "order": 3, "amplitude": "12 um"},
        {"kind": "eccentricity", "gear": "drive", "offset": "15 um", "phase": "0.5 rad"},
    ]
    scenario = load(BENCH, {"effect": effects})
    found = static_error(scenario, turns=1.0)
    some = slice(0, None, 9)
    exact = quasi_static(shaped(scenario), found.theta[some])
    assert np.sqrt(np.mean((found.phi[some] - exact.phi_active) ** 2)) < 1e-8
    assert np.abs(found.backlash[some] - exact.backlash).max() < 1e-7


@pytest.mark.slow
def test_a_run_folder_of_a_helical_pair(tmp_path, capsys):
    rig = tmp_path / "rig.toml"
    swing = 'harmonics = [{ amplitude = "60 rpm", frequency = "6 Hz" }]'
    rig.write_text(BENCH.replace('mean = "150 rpm"', f'mean = "150 rpm"\n{swing}'))
    with pytest.raises(SystemExit) as stop:
        cli.main(["run", str(rig), "--out", str(tmp_path / "run"), "--json"])
    assert not stop.value.code
    told = json.loads(capsys.readouterr().out)
    assert told["comparison"]["velocity_error_median"] < 1e-6
    with pytest.raises(SystemExit) as stop:
        cli.main(["report", str(tmp_path / "run"), "--json"])
    assert not stop.value.code


def test_a_helical_tooth_moved_behind_the_hulls_back_is_named(monkeypatch):
    scenario = load(FIG5, {**TWIN, "gears.face_width": "15 mm", "run.duration": "0.7 s"})
    honest = run.pieces
    monkeypatch.setattr(run, "pieces", lambda pair, which, **how: honest(scenario.pair(), which, **how))
    moved = scenario.pair().with_deviations(ToothDeviation("loose", "active", 11, 1e-5))
    with pytest.raises(EngineError, match="against loose tooth 11"):
        simulate(scenario, pair=moved)
