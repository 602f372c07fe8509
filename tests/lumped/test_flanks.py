"""Tables of flanks: against the surfaces they stand for, waves that the model has without them, closed forms."""

from math import pi

import numpy as np
import pytest

from gears3d.effects import Flank, Rig, flank_harmonic
from gears3d.effects import Gear as G
from gears3d.gears import Eccentricity, Gear, HarmonicDeviation, Pair, Relief, ToothDeviation, quasi_static
from gears3d.lumped import layout, rigid
from gears3d.lumped.flanks import fit, flank_tables, table_period
from gears3d.lumped.tables import Table
from gears3d.scenario import load
from gears3d.simulation import simulate
from gears3d.verification.validation import closed_form
from tests.lumped.rig import RPM, model, run

RIGAUD = Pair.from_backlash(Gear(3.5e-3, 90, face_width=7.5e-3), Gear(3.5e-3, 90, face_width=7.5e-3), 250e-6)
SMALL = Pair.from_backlash(Gear(3.5e-3, 19), Gear(3.5e-3, 37), 250e-6)
RELIEVED = Pair.from_backlash(Gear(3.5e-3, 19, tip_relief=Relief(20e-6, length=7e-3)), Gear(3.5e-3, 37), 250e-6)
MASS, FORCE = 0.0695 / 0.148**2, 0.22 / 0.148
FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"

PAIRS = {
    "thick tooth of the loose gear": (SMALL.with_deviations(ToothDeviation("loose", "active", 5, 20e-6)), 13.0),
    "thin tooth of the drive": (SMALL.with_deviations(ToothDeviation("drive", "reverse", 2, -20e-6)), 7.0),
    "eccentric teeth": (SMALL.with_mounting(Eccentricity("drive", 20e-6, 0.3)), 7.0),
    "linear relief": (RELIEVED, 1.0),
    "waves of both": (SMALL.with_deviations(HarmonicDeviation("loose", "active", 3, 6e-6, 0.3)), 13.0),
}


@pytest.mark.parametrize("name", PAIRS)
def test_tables_are_the_surfaces_to_a_picometre(name):
    pair, turn = PAIRS[name]
    theta = np.sort(np.random.default_rng(1).uniform(0.0, turn, 1500))
    active, reverse = flank_tables(pair, 0.0, turn)
    found = quasi_static(pair, theta)
    assert np.abs(active(theta) - found.phi_active).max() < 1e-12
    assert np.abs(reverse(theta) + found.phi_reverse).max() < 1e-12


def test_periods():
    pitch, drive = 2 * pi / 19, 2 * pi
    assert table_period(RELIEVED) == pytest.approx(pitch)
    assert table_period(PAIRS["thin tooth of the drive"][0]) == pytest.approx(drive)
    assert table_period(PAIRS["thick tooth of the loose gear"][0]) == pytest.approx(37 * pitch)
    both = SMALL.with_deviations(ToothDeviation("drive", "active", 1, 1e-6), ToothDeviation("loose", "active", 1, 1e-6))
    assert table_period(both) == pytest.approx(37 * drive)


@pytest.mark.parametrize("span", [1e9, 20.0])
def test_waves_in_tables_are_waves(span):
    """The same order on a table from the surfaces, repeated or not, and as the model's own wave."""
    rig = Rig(RIGAUD.drive.base_radius, RIGAUD.loose.base_radius, 0.0695, 0.22, 250e-6, 0.5, 30 * RPM, 90, 90)
    sizes = [("active", 20e-6), ("reverse", -20e-6)]
    pair = RIGAUD.with_deviations(*(HarmonicDeviation("drive", f, 4, a, 0.7) for f, a in sizes))  # type: ignore[arg-type]
    rows = [flank_harmonic(G.DRIVE, Flank[f.upper()], 4, a, 0.7) for f, a in sizes]
    drive = [(20 * RPM, 3.0, 0.0)]
    tabled = run(model(rig, drive, flanks=flank_tables(pair, -2.0, span)), 5.0, 1e-3)
    waves = run(model(rig, drive, rows), 5.0, 1e-3)
    assert tabled.counters["impacts"] == waves.counters["impacts"] > 100
    assert np.abs(tabled.impacts[:, 0] - waves.impacts[:, 0]).max() < 1e-8
    assert np.allclose(tabled.impacts[:, 2:4], waves.impacts[:, 2:4], rtol=1e-4, atol=1e-8)
    assert np.abs(tabled.samples[:, 5] - waves.samples[:, 5]).max() < 1e-10


def saw(slope, length):
    """φ rises and falls with ``slope`` [m/rad], ``length`` [rad] each."""
    pieces = np.array([[0.0, 0.0, slope], [length, slope * length, -slope]])
    flat = np.zeros((1, 3))
    return (
        Table(layout.THETA1, np.array([0.0, length, 2 * length]), pieces, 2 * length),
        Table(layout.THETA1, np.array([0.0, 2 * length]), flat, 2 * length),
    )


@pytest.mark.parametrize("e", [0.0, 0.4])
@pytest.mark.parametrize("turns", [1, -1])
def test_corners_throw_and_hit(e, turns):
    """Thrown off a crest with 2·slope·Ω, back after 4·slope·Ω·m/F; hit in the valley with 2·slope·Ω."""
    slope, length, speed = 4e-5, 0.1, pi
    rig = Rig(0.148, 0.148, 0.0695, 0.22, 250e-6, e, turns * speed, 90, 90)
    tables = saw(slope, length)
    done = run(model(rig, [], flanks=tables), 1.0, start="active" if turns == 1 else "reverse")
    if turns == -1:  # backwards the reverse flank carries, which is flat here
        assert done.counters["impacts"] == 0
        return
    hard = done.impacts[np.abs(done.impacts[:, 2]) > 0.5 * 2 * slope * speed]
    away, back = 2 * slope * speed, 4 * slope * speed * MASS / FORCE
    crest, valley = length / speed, 2 * length / speed
    assert (done.impacts[:, 1] == 0).all()
    if e == 0.0:
        expected = np.ravel([[crest + back + k * valley, (k + 1) * valley] for k in range(20)])
        expected = expected[expected < 1.0]
        assert np.abs(done.impacts[:, 0] - expected).max() < 1e-12
        assert np.abs(done.impacts[:, 2] + away).max() < 1e-14
        assert done.impacts[0, 6] == pytest.approx(away**2 * MASS / FORCE / 2, rel=1e-9)
    else:
        assert np.abs(hard[:, 2] + away).max() < 1e-12
        assert np.abs(done.impacts[0, 3] - e * away) < 1e-14


@pytest.mark.parametrize("gear", ["drive", "loose"])
def test_a_thick_tooth_moves_its_impact_as_the_closed_form_says(gear):
    """The first reverse impact of figure 5 meets 10 µm more material, on a tooth that is in mesh before and after."""
    sound = simulate(load(FIG5, ["run.duration=1 s"]), "rigid")
    angle = np.interp(sound.impacts["time_s"][0], sound.signals["time_s"], sound.signals["theta_drive_rad"])
    places = {
        t: quasi_static(
            RIGAUD.with_deviations(ToothDeviation(gear, "reverse", t, 1e-5)), angle + np.array([-0.02, 0.02])
        )
        for t in range(5, 13)
    }
    tooth = next(t for t, found in places.items() if (found.phi_reverse < -0.99e-5).all())
    fault = f'{{ kind = "pitch_error", gear = "{gear}", tooth = {tooth}, flank = "reverse", offset = "-10 um" }}'
    faulty = simulate(load(FIG5, ["run.duration=1 s", f"effect[+]={fault}"]), "rigid")
    time, speed = closed_form(10e-6)
    assert faulty.impacts["time_s"][0] - sound.impacts["time_s"][0] == pytest.approx(time, rel=1e-9)
    assert faulty.impacts["velocity_m_s"][0] - sound.impacts["velocity_m_s"][0] == pytest.approx(speed, rel=1e-9)


def test_corners_are_found_where_they_are():
    corners = np.array([0.1234567, 1.7654321, 2.0])

    def bent(x):
        return 1e-4 * (np.abs(x - corners[0]) + np.maximum(0, x - corners[1]) ** 2 + np.sin(3 * x) + np.abs(x - 2.0))

    knots, pieces = fit(bent, np.array([0.0, 1.0, 2.0, 3.0]), 1e-13, 1e-9)
    anywhere = np.linspace(0.0, 3.0, 5001)
    found = Table(layout.THETA1, knots, pieces)(anywhere)
    assert np.abs(found - bent(anywhere)).max() < 2e-13
    assert np.abs(knots[:, None] - corners).min(axis=0).max() < 1e-4
    assert np.abs(knots - corners[0]).min() < 1e-9
    assert len(pieces) < 60


def test_jumps_are_refused():
    with pytest.raises(ValueError, match=r"0\.29999|0\.3"):
        fit(lambda x: np.where(x > 0.3, 1e-3, 0.0), np.array([0.0, 1.0]), 1e-13, 1e-9)


def test_an_interrupt_acts_while_the_flanks_roll_on_each_other():
    """Tables of a rig with waves, eccentricity and pitch deviation take seconds."""
    changes = {"gears.loose.profile_wave": {"amplitude": "1 um", "waves": 2}, "gears.helix_angle": "20 deg"}
    pitch = {"kind": "pitch_error", "gear": "loose", "tooth": 5, "offset": "5 um"}
    scenario, asked = load("scenarios/rigaud-2020/fig5-20rpm.toml", {**changes, "effect": [pitch]}), []

    def stop(done):
        asked.append(done)
        if len(asked) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        rigid.simulate(scenario, progress=stop)
    assert asked == [0.0] * 3
