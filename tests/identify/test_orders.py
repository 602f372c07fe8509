"""Transmission error and backlash from contact: orders found, attributed, with intervals that cover."""

import json
import tomllib

import numpy as np
import pytest

from gears3d import cli
from gears3d.errors import InputError
from gears3d.identify import Line, identify_backlash, identify_transmission_error
from gears3d.identify.rolling import reach_of
from gears3d.measured.checks import Admitted
from gears3d.measured.readers import Channels
from gears3d.scenario import load
from gears3d.simulation import record
from tests.identify import campaigns

FEWER = {"sensors.counts_per_revolution": 2048}
"""Edges of so many counts are quick to read: for what asks 37 turns, after which both gears stand as at first."""
KADMIRI, RIGAUD = "scenarios/base/kadmiri-2012.toml", "scenarios/base/rigaud-2020.toml"


def admitted(scenario, **options):
    return [taken(record(scenario, "transmission-error", **options).signals, scenario)]


def taken(signals, rig):
    return Admitted(Channels(signals), rig, (), "slow.parquet")


@pytest.mark.parametrize("encoder", campaigns.RIGS)
def test_orders_of_random_flanks_are_found_with_sound_intervals(encoder):
    rows, missed, false = campaigns.campaign(encoder, 501)
    assert not missed
    assert not false
    assert max(abs(row[2]) for row in rows) < 4.5
    assert sum(row[3] for row in rows) >= 0.8 * len(rows)


def test_published_transmission_error_and_backlash_come_back():
    """Rigaud & Perret-Liaudet 2020, fig. 2: 100 um p-p a turn, 10 um p-p a mesh, backlash 250 um, almost constant."""
    seen = admitted(load("scenarios/rigaud-2020/fig2.toml"), turns=3)
    told = identify_transmission_error(seen).parameters
    for flank in ("active", "reverse"):
        assert 2e6 * told[f"{flank}_drive_1_amplitude"].value == pytest.approx(100.0, abs=0.05)
        assert 2e6 * told[f"{flank}_drive_90_amplitude"].value == pytest.approx(10.0, abs=0.05)
    width = identify_backlash(seen)
    assert list(width.parameters) == ["backlash"]
    assert width.parameters["backlash"].low <= 250e-6 <= width.parameters["backlash"].high
    assert width.parameters["backlash"].value == pytest.approx(250e-6, abs=5e-9)


def test_gears_of_one_ratio_are_told_as_a_set():
    found = identify_transmission_error(admitted(load("scenarios/rigaud-2020/fig2.toml"), turns=1))
    either = {order["or"] for order in found.goodness["orders"]}
    assert either == {"loose_1", "loose_90"}
    assert any("drive_1 may be loose_1" in note for note in found.warnings)


def test_few_turns_leave_neighbouring_orders_of_both_gears_unseparated():
    effect = [{"kind": "transmission_error", "order": 1, "amplitude": "20 um"}]
    short = identify_transmission_error(admitted(load(KADMIRI, {"effect": effect}), turns=4))
    assert any("drive_1 may be loose_2; 37 turns tell more of them apart" in note for note in short.warnings)


@pytest.mark.parametrize("gear", [pytest.param("drive", marks=pytest.mark.slow), "loose"])
def test_eccentric_teeth_are_told_with_gear_offset_and_phase(gear):
    effect = [{"kind": "eccentricity", "offset": "15 um", "phase": "50 deg", "gear": gear}]
    seen = admitted(load(KADMIRI, {"effect": effect} | FEWER), turns=37)
    for identify in (identify_transmission_error, identify_backlash):
        (axis,) = identify(seen).goodness["eccentricity"]
        assert axis["gear"] == gear
        assert axis["offset_m"] == pytest.approx(15e-6, rel=0.005)
        assert np.degrees(axis["phase_rad"]) == pytest.approx(50.0, abs=0.5)


def test_waves_of_order_one_are_no_eccentricity():
    alike = [{"kind": "transmission_error", "order": 1, "amplitude": "15 um"}]
    assert not identify_backlash(admitted(load(KADMIRI, {"effect": alike}), turns=10)).goodness["eccentricity"]


def test_an_encoder_that_sits_off_its_shaft_moves_both_flanks_alike():
    effect = [{"kind": "encoder_eccentricity", "amplitude": "2e-4 rad", "gear": "loose", "phase": "30 deg"}]
    scenario = load(RIGAUD, {"effect": effect})
    seen = admitted(scenario, turns=2)
    found = identify_transmission_error(seen)
    for flank in ("active", "reverse"):
        size = found.parameters[f"{flank}_loose_1_amplitude"].value
        assert size == pytest.approx(2e-4 * scenario.rig().base_radius_loose, rel=0.002)
    assert not any(name.startswith(("drive_1_", "loose_1_")) for name in identify_backlash(seen).parameters)
    assert not found.goodness["eccentricity"]


@pytest.mark.slow
def test_snippets_make_the_flanks_again(tmp_path):
    effect = [
        {"kind": "transmission_error", "order": 1, "amplitude": "20 um", "phase": "40 deg"},
        {"kind": "transmission_error", "order": 2, "amplitude": "5 um", "phase": "1 rad", "gear": "loose"},
        {
            "kind": "transmission_error",
            "order": 5,
            "amplitude": "4 um",
            "phase": "2 rad",
            "gear": "loose",
            "flank": "active",
        },
        {"kind": "backlash_variation", "order": 3, "amplitude": "6 um", "phase": "-1 rad"},
    ]
    scenario = load(KADMIRI, {"effect": effect, "mount.backlash": "123 um"} | FEWER)
    seen = admitted(scenario, turns=37)
    first = tomllib.loads(identify_transmission_error(seen).snippet)
    second = tomllib.loads(identify_backlash(seen).snippet)
    again = load(KADMIRI, {"effect": first["effect"] + second["effect"], "mount": second["mount"]} | FEWER)
    made = [record(one, "transmission-error", turns=5, seed=1).signals for one in (scenario, again)]
    rig = scenario.rig()
    places = [
        rig.base_radius_loose * one["theta_loose_rad"] - rig.base_radius_drive * one["theta_drive_rad"] for one in made
    ]
    half = len(places[0]) // 2
    for part in (slice(1000, half - 2000), slice(half + 2000, None)):
        smooth = [np.convolve(place[part], np.ones(2000) / 2000, "valid") for place in places]
        assert smooth[0] == pytest.approx(smooth[1], abs=0.5e-6)


def test_a_bare_flank_has_no_orders_and_the_reverse_flank_is_asked_for():
    still = load(KADMIRI, {"sensors.drive.noise": "2e-4 rad", "sensors.loose.noise": "2e-4 rad"})
    seen = admitted(still, turns=3, seed=5)
    found = identify_transmission_error(seen)
    assert not found.parameters
    assert "no order exceeds the noise" in found.warnings
    forth = seen[0].recording.signals
    half = int(np.argmax(forth["theta_drive_rad"]))
    cut = taken({name: values[:half] for name, values in forth.items()}, still)
    with pytest.raises(InputError, match="shows one flank only: no backlash follows"):
        identify_backlash([cut])
    notes = identify_transmission_error([cut]).warnings
    assert any("reverse flank was not seen" in note for note in notes)


def test_angles_of_the_wrong_sense_and_a_missing_rig_are_named():
    scenario = load(RIGAUD)
    (seen,) = admitted(scenario, turns=1)
    turned = {**seen.recording.signals}
    turned["theta_drive_rad"], turned["theta_loose_rad"] = turned["theta_loose_rad"], turned["theta_drive_rad"]
    with pytest.raises(InputError, match="which gear drives"):
        identify_backlash([taken(turned, scenario)])
    with pytest.raises(InputError, match="--rig: is missing"):
        identify_backlash([taken(turned, None)])


def test_the_chance_of_a_false_order_is_the_stated_one():
    """Bare flanks, noisy encoders: one false order in a hundred records is stated; 0 in 25 has a chance of 78 %."""
    noise = {f"sensors.{gear}.noise": "1e-4 rad" for gear in ("drive", "loose")}
    quiet = load("scenarios/base/ottewill-2010.toml", noise)
    told = [identify_transmission_error(admitted(quiet, turns=2, seed=seed)).parameters for seed in range(25)]
    false = sum(map(bool, told))
    assert false <= 2


def test_half_a_count_and_noise_together_hold_95_percent():
    random = np.random.default_rng(4)
    for deviation, half in ((1.0, 0.3), (1.0, 3.0), (0.2, 3.0)):
        error = random.normal(0.0, deviation, 200_000) + random.uniform(-half, half, 200_000)
        assert np.mean(np.abs(error) < reach_of(deviation, half)) == pytest.approx(0.95, abs=0.002)


def test_lines_have_names():
    assert Line(1, 37).name == "loose_37"


def test_the_commands_print_json_and_draw(tmp_path, capsys):
    slow, picture = tmp_path / "slow.parquet", tmp_path / "orders.png"
    fig2 = "scenarios/rigaud-2020/fig2.toml"
    for arguments in (
        ["synthesize", fig2, "--test", "transmission-error", "--turns", "2", "--out", str(slow), "--json"],
        ["identify", "transmission-error", str(slow), "--rig", fig2, "--out", str(picture), "--json"],
        ["identify", "backlash", str(slow), "--rig", fig2, "--json"],
    ):
        with pytest.raises(SystemExit) as stop:
            cli.main(arguments)
        assert not stop.value.code
        told = json.loads(capsys.readouterr().out)
    assert picture.stat().st_size > 20_000
    assert told["law"] == "backlash"
    assert set(told) == {"law", "parameters", "goodness", "snippet", "warnings", "provenance"}
    assert told["parameters"]["backlash"]["ci95"][0] < 250e-6 < told["parameters"]["backlash"]["ci95"][1]


def test_half_a_turn_of_rattle_gives_a_backlash_without_orders_and_names_other_ways():
    rig = load("scenarios/rigaud-2020/fig5-20rpm.toml", {"run.duration": "1 s", "mount.backlash": "60 um"}).with_(
        {"sensors.noise": "100 urad"}
    )
    found = identify_backlash([taken(record(rig).signals, rig)])
    width = found.parameters["backlash"]
    assert list(found.parameters) == ["backlash"]
    assert width.low <= 60e-6 <= width.high
    assert width.high - width.low > 0.04 * width.value
    assert any("gears3d diagnose" in note for note in found.warnings)
    json.dumps(found.to_dict(), allow_nan=False)
