"""Thresholds of contact from sweeps: of the rigid model, whose threshold is Λ = 1, and of motions made by hand."""

import json
from functools import cache
from math import pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gears3d import cli
from gears3d.errors import InputError
from gears3d.identify import Sweep, identify_threshold
from gears3d.identify.threshold import lifted
from gears3d.recording import Recording
from gears3d.scenario import Sensor, Sensors, load
from gears3d.simulation import encode, record
from gears3d.simulation.recorder import sweep
from tests.identify import shafts

BENCH = "scenarios/rigaud-2020/fig5-5rpm.toml"
DRAG = 0.22


@cache
def bench(**changes):
    """Return Rigaud's bench at 3 Hz, 10 kHz."""
    keys = {"run.duration": "20 s", "sensors.sample_rate": "10 kHz", "impact.restitution": 0.3}
    return load(BENCH, keys | {key.replace("__", "."): value for key, value in changes.items()})


@cache
def swept(**changes):
    return sweep(bench(**changes))


def seen(recording, counts, seed=1, rate=10e3):
    return encode(recording, Sensors(rate, Sensor(counts), Sensor(counts)), seed)


def test_a_flight_is_that_of_the_equation_of_motion():
    phase, ramp = np.linspace(0.0, 2 * pi, 4001), 0.01
    found = lifted(phase, np.array([1.2]), ramp)[0]
    lost = phase[np.flatnonzero(found)[0]]

    def relative(tau, y):
        return [y[1], -1.0 / 1.2 - (1.0 + ramp * (tau - pi)) * np.cos(tau)]

    assert relative(lost, [0.0, 0.0])[1] == pytest.approx(0.0, abs=2e-3)
    after = phase[found > 0.0]
    truth = solve_ivp(relative, (lost - 1.5e-3, after[-1]), [0.0, 0.0], t_eval=after, rtol=1e-10, atol=1e-12)
    assert found[found > 0.0] == pytest.approx(truth.y[0], abs=2e-5)


@pytest.mark.parametrize("counts", [8192, pytest.param(40_000, marks=pytest.mark.slow), 1_600_000])
def test_the_threshold_is_where_inertia_takes_the_whole_drag(counts):
    found = identify_threshold([Sweep(seen(swept(), counts), bench())])
    assert {"up", "down"} <= found.goodness.keys()
    for way in ("up", "down"):
        drag = found.parameters[f"drag_{way}"]
        assert abs(drag.value - DRAG) < 4.5 * (drag.high - drag.low) / 3.92
        assert drag.value == pytest.approx(DRAG, rel=3e-3)
        assert found.parameters[f"excitation_{way}"].value == pytest.approx(drag.value / DRAG)
        assert found.goodness[way]["method"] == "flights"
        known = 1e-4 if counts == 1_600_000 else 0.02  # heights of fine encoders tell it to a few parts in a million
        assert drag.high - drag.low < known * DRAG
    lag = found.parameters["hysteresis"]
    assert lag.low < 0.0 < lag.high
    assert load('format = 1\nextends = "scenarios/base/rigaud-2020.toml"\n' + found.snippet).drag.torque > 0.21


def test_the_threshold_is_that_of_the_whole_drag_whatever_it_is_made_of():
    """Viscous drag at the mean speed counts as dry drag does; higher up it is another, so that flights do not tell."""
    viscous = {"kind": "drag_viscous", "coefficient": f"{0.11 / (30 * pi / 30)} N m s/rad"}
    scenario = bench().with_({"drag.torque": "0.11 N m", "effect[+]": viscous})
    found = identify_threshold([Sweep(seen(sweep(scenario), 1_600_000), scenario)])
    drag = found.parameters["drag_up"]
    assert drag.low <= DRAG <= drag.high
    assert drag.value == pytest.approx(DRAG, rel=0.02)


@pytest.mark.slow
def test_waves_of_the_flanks_and_a_late_encoder_do_not_move_it():
    scenario = bench().with_(
        {
            "effect[+]": {"kind": "transmission_error", "order": 1, "amplitude": "40 um", "phase": "30 deg"},
        }
    )
    late = scenario.with_({"effect[+]": {"kind": "encoder_skew", "delay": "20 us", "gear": "loose"}})
    found = identify_threshold([Sweep(seen(sweep(late), 1_600_000), bench())])
    assert found.parameters["drag_up"].value == pytest.approx(DRAG, rel=5e-3)


@pytest.mark.slow
def test_steady_swings_in_several_records_tell_the_same():
    rpm = DRAG / 0.0695 / (6 * pi) * 30 / pi
    sweeps = []
    for seed, ratio in enumerate((0.8, 0.95, 1.1, 1.25, 1.1, 0.95, 0.8)):
        scenario = bench(run__duration="4 s").with_(
            {"motion.harmonics": [{"amplitude": f"{ratio * rpm} rpm", "frequency": "3 Hz"}]}
        )
        sweeps.append(Sweep(record(scenario, seed=seed), scenario))
    found = identify_threshold(sweeps)
    for way in ("up", "down"):
        assert found.parameters[f"drag_{way}"].value == pytest.approx(DRAG, rel=3e-3)


@pytest.mark.slow
def test_a_collapse_below_the_rise_is_told():
    """A gear that, once it rattles, goes on down to 0.8 of where it began: made by hand, flights of one height."""
    time = np.arange(0.0, 40.0, 1e-3)
    rig = bench()
    omega, radius, onset = 6 * pi, rig.rig().base_radius_drive, DRAG / 0.0695
    level = onset * (0.5 + np.minimum(time, 40.0 - time) / 20.0)
    drive = pi * time - level / omega**2 * np.cos(omega * time + pi)
    turn = np.mod(omega * time + pi, 2 * pi)
    rising = time < 20.0
    rattles = np.where(rising, level > onset, level > 0.8 * onset)
    flight = np.where(rattles & (turn > 2.0) & (turn < 5.0), (turn - 2.0) * (5.0 - turn) / 2.25, 0.0)
    loose = drive + 60e-6 / radius * flight
    random = np.random.default_rng(3)
    made = Recording(
        {
            "time_s": time,
            "theta_drive_rad": drive + random.normal(0.0, 2e-6, len(time)),
            "theta_loose_rad": loose + random.normal(0.0, 2e-6, len(time)),
        }
    )
    found = identify_threshold([Sweep(made, rig)])
    assert found.goodness["down"]["method"] == "bracket"
    assert found.parameters["acceleration_down"].low <= 0.8 * onset <= found.parameters["acceleration_down"].high
    assert found.parameters["acceleration_up"].low <= onset <= found.parameters["acceleration_up"].high
    lag = found.parameters["hysteresis"]
    assert lag.low > 0.1
    assert lag.value == pytest.approx(0.2, abs=0.05)
    assert any("bracketed" in note for note in found.warnings)


def test_what_tells_no_threshold_is_refused():
    rig = bench()
    quiet = sweep(rig, (0.2 * 0.168, 0.8 * 0.168))
    with pytest.raises(InputError, match="contact is never lost between"):
        identify_threshold([Sweep(seen(quiet, 1_600_000), rig)])
    wild = sweep(rig, (1.5 * 0.168, 2.5 * 0.168))
    with pytest.raises(InputError, match="contact is lost in every period"):
        identify_threshold([Sweep(seen(wild, 1_600_000), rig)])
    steady = load("scenarios/base/rigaud-2020.toml")
    with pytest.raises(InputError, match=r"motion\.harmonics"):
        identify_threshold([Sweep(seen(quiet, 40_000), steady)])
    with pytest.raises(InputError, match=r"run\.duration"):
        sweep(bench(run__duration="2 s"))
    with pytest.raises(InputError, match="without drag there is no threshold"):
        sweep(bench(drag__torque="0 N m"))
    short = Recording({name: values[:8000] for name, values in seen(quiet, 40_000).signals.items()})
    with pytest.raises(InputError, match="periods"):
        identify_threshold([Sweep(short, rig)])


def test_the_bench_sweeps_and_the_command_answers(tmp_path, capsys):
    file, picture = tmp_path / "sweep.parquet", tmp_path / "threshold.png"
    rate = ["--set", "sensors.sample_rate=10 kHz"]
    words = ["--set", "run.duration=20 s", *rate, "--amplitudes", "0.9 rpm..2.4 rpm"]
    for arguments in (
        ["synthesize", BENCH, "--test", "threshold", *words, "--out", str(file)],
        ["identify", "threshold", str(file), "--rig", BENCH, *rate, "--json", "--out", str(picture)],
    ):
        capsys.readouterr()
        with pytest.raises(SystemExit) as stop:
            cli.main(arguments)
        assert not stop.value.code
    told = json.loads(capsys.readouterr().out)
    assert told["law"] == "threshold"
    low, high = told["parameters"]["amplitude_up"]["ci95"]
    assert low < DRAG / 0.0695 / (6 * pi) < high or high - low < 1e-3 * low
    assert picture.stat().st_size > 10_000


def test_the_drive_swings_as_the_integral_of_its_speed():
    found = swept()
    time, angle = found.time, found.signals["theta_drive_rad"]
    middle = int(np.argmin(np.abs(time - 10.0)))
    speed = np.gradient(angle, time)
    swing = speed - pi
    assert np.abs(swing[middle - 2000 : middle + 2000]).max() == pytest.approx(1.6 * DRAG / 0.0695 / (6 * pi), rel=2e-2)
    assert np.abs(swing[100:2000]).max() == pytest.approx(0.5 * DRAG / 0.0695 / (6 * pi), rel=4e-2)
    assert np.abs(np.diff(speed)).max() < 2e-3  # no jump where the sweep turns
    assert bench().rig().inertia == shafts.INERTIA
