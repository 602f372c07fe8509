"""The virtual test of the transmission error gives back what was imposed, by closed forms and by rolled surfaces."""

import json

import numpy as np
import pytest

from gears3d import cli
from gears3d.bench import Drops, StaticError, Sweep, Thresholds, static_error, static_picture, threshold_picture
from gears3d.errors import InputError
from gears3d.gears import quasi_static
from gears3d.recording import Recording
from gears3d.scenario import eccentricities, flank_deviations, load

RIG = """
format = 1
title = "Bench 20:20"
[gears]
module = "12 mm"
face_width = "30 mm"
drive = { teeth = 20 }
loose = { teeth = 20, inertia = "0.05 kg m^2" }
[mount]
backlash = "150 um"
[motion]
mean = "200 rpm"
harmonics = [ { amplitude = "40 rpm", frequency = "5 Hz" } ]
[drag]
torque = "0.5 N m"
[sensors]
sample_rate = "20 kHz"
counts_per_revolution = 400000
"""
ANGLES = {"theta_drive_rad": [0.0], "theta_loose_rad": [0.0]}
TENTH = 1e-7
"""0.1 µm."""


def bench(*effects, **changes):
    return load(RIG, {"effect": list(effects), **{key.replace("__", "."): value for key, value in changes.items()}})


def rms(difference):
    return float(np.sqrt(np.mean(difference**2)))


@pytest.mark.slow
def test_waves_come_back_on_the_flank_they_are_on():
    waves = [
        {"kind": "transmission_error", "order": 2, "amplitude": "30 um", "phase": "0.4 rad"},
        {"kind": "transmission_error", "order": 90, "amplitude": "1.5 um", "phase": "1 rad", "flank": "active"},
        {"kind": "transmission_error", "order": 3, "amplitude": "10 um", "gear": "loose", "phase": "2 rad"},
    ]
    found = static_error(bench(*waves), turns=1.0)
    theta = found.theta
    # a wave on the loose gear is over that gear's angle, which runs ahead by the error itself
    radius = bench().rig().base_radius_loose
    both = 30e-6 * np.cos(2 * theta + 0.4)
    phi, psi = both + 1.5e-6 * np.cos(90 * theta + 1.0), both + 150e-6
    for _ in range(6):
        phi_loose, psi_loose = (10e-6 * np.cos(3 * (theta + curve / radius) + 2.0) for curve in (phi, psi))
        phi, psi = both + 1.5e-6 * np.cos(90 * theta + 1.0) + phi_loose, both + 150e-6 + psi_loose
    # a wave's slope turns the normal: half its square times the flank's radius of curvature is not in the closed form
    assert rms(found.phi - phi) < TENTH
    assert rms(found.psi - psi) < TENTH
    scenario = bench(*waves)
    exact = quasi_static(scenario.pair().with_deviations(*flank_deviations(scenario.rows())), theta)
    assert rms(found.phi - exact.phi_active) < 1e-9
    told = found.to_dict()["phi"]["orders"]
    assert [round(one["order_drive"]) for one in told[:3]] == [2, 3, 90]
    assert told[0]["amplitude_m"] == pytest.approx(30e-6, abs=TENTH)


def test_a_thick_tooth_is_a_step_while_it_is_in_mesh():
    thick = {"kind": "pitch_error", "tooth": 7, "offset": "8 um", "flank": "active"}
    scenario = bench(thick)
    found = static_error(scenario, turns=1.0)
    pair = scenario.pair()
    # tooth 7 meets the pitch point at 6 pitches; from first to last point of contact it carries alone
    from_pitch = pair.drive.base_radius * (found.theta - 2 * np.pi * 6 / 20)
    wide = 0.5 * pair.contact_ratio * 2 * np.pi * pair.drive.base_radius / 20
    inside, outside = np.abs(from_pitch) < 0.999 * wide, np.abs(from_pitch) > 1.5 * wide
    assert inside.sum() > 200
    assert rms(found.phi[inside] - 8e-6) < 1e-10
    assert rms(found.phi[outside]) < 1e-10
    assert rms(found.psi - 150e-6) < 1e-10
    exact = quasi_static(pair.with_deviations(*flank_deviations(scenario.rows())), found.theta)
    assert rms(found.phi - exact.phi_active) < 0.1 * TENTH
    assert found.backlash.min() == pytest.approx(142e-6, abs=1e-10)


@pytest.mark.parametrize("gear", ["drive", "loose"])
def test_an_eccentric_gear_gives_the_closed_forms(gear):
    offset, phase = 30e-6, 0.7
    scenario = bench({"kind": "eccentricity", "gear": gear, "offset": f"{offset} m", "phase": f"{phase} rad"})
    found = static_error(scenario, turns=1.0)
    pair = scenario.pair()
    sense, lean = (1.0, 1.0) if gear == "drive" else (-1.0, -1.0)
    tilt = lean * pair.working_pressure_angle
    # the loose gear's own angle runs ahead by its displacement
    ahead = [0.0 if gear == "drive" else curve / pair.loose.base_radius for curve in (found.phi, found.psi)]
    active, reverse = (found.theta + phase + more for more in ahead)
    # each flank touches elsewhere by the offset's part along its normal; backlash grows by 2 e cos(angle) sin(alpha)
    assert rms(found.phi - sense * offset * np.sin(active + tilt)) < TENTH
    assert rms(found.psi - 150e-6 - sense * offset * np.sin(reverse - tilt)) < TENTH
    opened = -2.0 * offset * np.cos(0.5 * (active + reverse)) * np.sin(pair.working_pressure_angle)
    assert np.abs(found.backlash - 150e-6 - opened).max() < TENTH
    exact = quasi_static(pair.with_mounting(*eccentricities(scenario.rows())), found.theta)
    assert np.abs(found.backlash - exact.backlash).max() < 1e-10


@pytest.mark.slow
def test_pitch_errors_of_every_tooth_on_both_gears():
    draw = np.random.default_rng(5)
    effects = [
        {"kind": "pitch_error", "gear": gear, "tooth": tooth, "offset": f"{size:.3f} um", "flank": flank}
        for gear, teeth in (("drive", 19), ("loose", 23))
        for flank in ("active", "reverse")
        for tooth, size in enumerate(draw.normal(0.0, 4.0, teeth), 1)
    ]
    scenario = bench(*effects, gears__drive__teeth=19, gears__loose__teeth=23)
    found = static_error(scenario, turns=23.0)
    exact = quasi_static(scenario.pair().with_deviations(*flank_deviations(scenario.rows())), found.theta)
    assert rms(found.phi - exact.phi_active) < TENTH
    assert rms(found.backlash - exact.backlash) < TENTH


def test_without_drag_nothing_holds_the_gear():
    with pytest.raises(InputError, match="off its reverse flank"):
        static_error(bench(drag__torque="0 N m", impact__restitution=0.9), turns=0.3)


def test_the_folder_is_read_by_identify(tmp_path, capsys):
    rig, out = tmp_path / "rig.toml", tmp_path / "ste"
    wave = '\n[[effect]]\nkind = "transmission_error"\norder = 2\namplitude = "20 um"\n'
    rig.write_text(RIG + wave)

    def run(*words):
        with pytest.raises(SystemExit) as stop:
            cli.main([*map(str, words)])
        return stop.value.code or 0, capsys.readouterr()

    code, said = run("bench", "transmission-error", rig, "--out", out, "--turns", 1, "--json")
    assert code == 0
    summary = json.loads(said.out)
    assert summary == json.loads((out / "summary.json").read_text())
    assert summary["turns"] == 1
    assert summary["backlash"]["mean_m"] == pytest.approx(150e-6, abs=1e-10)
    table = np.genfromtxt(out / "ste.csv", delimiter=",", names=True)
    assert table["psi_m"] - table["phi_m"] == pytest.approx(table["backlash_m"], abs=1e-15)
    code, said = run("identify", "transmission-error", out / "record.parquet", "--rig", out / "scenario.toml", "--json")
    assert code == 0
    amplitude = json.loads(said.out)["parameters"]["active_drive_2_amplitude"]
    assert amplitude["ci95"][0] < 20e-6 < amplitude["ci95"][1]
    code, said = run("bench", "transmission-error", rig, "--out", out, "--speed", "1 Hz")
    assert code == 3
    assert "--speed" in said.err
    code, said = run("bench", "transmision-error", rig, "--out", out)
    assert code == 2
    assert "did you mean 'transmission-error'" in said.err


@pytest.mark.parametrize(("size", "high"), [(1e-14, 2e-3), (1e-6, 2.0)])
def test_rounding_is_not_drawn_as_a_deviation(size, high):
    theta = np.linspace(0.0, 2 * np.pi, 101)
    phi = np.where(np.arange(101) == 40, -size, 0.0)
    found = StaticError(theta, phi, 0.0 * phi + 1e-4, Recording({"time_s": [0.0], **ANGLES}), 0.1, 1.0, {})
    flanks, gap, _ = static_picture(found).axes
    for axis in (flanks, gap):
        assert np.ptp(axis.get_ylim()) == pytest.approx(high, rel=0.6)
        for line in axis.lines:
            drawn = line.get_ydata()
            assert axis.get_ylim()[0] <= drawn.min() <= drawn.max() <= axis.get_ylim()[1]


def test_pictures_of_nothing_to_be_seen(tmp_path):
    even = np.linspace(0.0, 2 * np.pi, 100)
    found = StaticError(even, 0.0 * even, 0.0 * even + 1e-4, Recording({"time_s": [0.0], **ANGLES}), 0.1, 1.0, {})
    static_picture(found).savefig(tmp_path / "ste.png")
    quiet = Sweep(3.0, 0.1, 1.0, np.nan, np.nan, np.zeros((0, 3)), found.record)
    threshold_picture(Thresholds((quiet,), 0.2, 0.1)).savefig(tmp_path / "threshold.png")
    assert quiet.to_dict()["excitation_up"] is None
    nothing = {name: np.zeros(0) for name in ("velocity_m_s", "rebound_m_s")}
    assert Drops(nothing, {}).to_dict()["drops"] == 0
