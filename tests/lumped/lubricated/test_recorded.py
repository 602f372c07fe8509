"""The lubricated model as a recording: columns, works, refusals."""

import numpy as np
import pytest

from gears3d import simulate
from gears3d.errors import InputError
from gears3d.lumped.lubricated import error_indices, rattle_index, sensitivity
from gears3d.recording import describe
from gears3d.scenario import load

CASE = "scenarios/dct-helical-lubricated/fig13.toml"


@pytest.fixture(scope="module")
def recording():
    changes = {"run.duration": "1 s", "run.settle": "20 periods", "run.output_rate": "200 kHz"}
    return simulate(load(CASE, changes), "lubricated")


def test_the_base_case_repeats_every_two_periods_on_both_flanks(recording):
    found = describe(recording)
    assert found["regime"] == "double_sided"
    assert found["motion"] == "2T"
    assert found["impacts_per_period"] == pytest.approx(3.0, abs=0.1)
    assert recording.meta["lyapunov_1_s"] < 0.0


def test_impacts_have_the_impulse_of_their_speeds(recording):
    hits = recording.impacts
    mass = recording.meta["inertia_kg_m2"] / recording.meta["base_radius_loose_m"] ** 2
    change = mass * (hits["rebound_m_s"] - hits["velocity_m_s"])
    assert np.all(np.sign(hits["impulse_N_s"]) == np.where(hits["flank"] == 0, 1.0, -1.0))
    # what is left is the drive's own change of speed, up to 300 rad/s², and the drag, within a passage of some 1.5 ms
    most = mass * (300.0 * recording.meta["base_radius_drive_m"]) + 0.1 / recording.meta["base_radius_loose_m"]
    assert np.abs(hits["impulse_N_s"] - change).max() < 1.5e-3 * most


def test_the_rattle_index_of_the_run_is_that_of_its_samples(recording):
    later = recording.between(0.4, 1.0).signals
    sampled = rattle_index(later["mesh_force_N"], 5e-6, recording.meta["inertia_kg_m2"])
    assert recording.meta["rattle_index"] == pytest.approx(sampled, rel=0.03)
    error = recording.signals["displacement_m"]
    size, lively = error_indices(error, 5e-6)
    assert size == pytest.approx(np.sqrt(np.mean(error**2)))
    assert lively == pytest.approx(np.sqrt(np.mean(recording.signals["velocity_m_s"] ** 2)), rel=1e-2)
    assert sensitivity([1.0, 3.0], [0.0, 4.0]).tolist() == [0.5]


@pytest.mark.slow
def test_speeds_and_displacement_belong_together(recording):
    signals, meta = recording.signals, recording.meta
    rate = meta["base_radius_loose_m"] * signals["omega_loose_rad_s"]
    rate = rate - meta["base_radius_drive_m"] * signals["omega_drive_rad_s"]
    assert signals["velocity_m_s"] == pytest.approx(rate, abs=1e-12)
    assert np.gradient(signals["displacement_m"], 5e-6)[1:-1] == pytest.approx(signals["velocity_m_s"][1:-1], abs=2e-4)


def test_what_the_model_cannot_do_is_told_all_at_once():
    effects = [{"kind": "restitution_offset", "offset": 0.1}]
    with pytest.raises(InputError) as caught:
        simulate(load(CASE, {"effect": effects}), "lubricated")
    assert [fault.key for fault in caught.value.faults] == ["effect[0]", "effect"]
    assert "oil_film" in str(caught.value)
    with pytest.raises(InputError, match=r"lubricated\.dead_zone.*did you mean 'published'"):
        load(CASE, {"lubricated.dead_zone": "publisht"})


def test_what_the_scenario_says_of_teeth_is_what_is_run():
    def index(**table):
        return simulate(
            load(CASE, {"run.duration": "0.4 s", "run.settle": "0.2 s", "lubricated": table}), "lubricated"
        ).meta["rattle_index"]

    plain = index()
    assert index(friction="lines", damping_ratio=0.1, regularisation="50 1/mm") == plain
    assert index(damping_ratio=0.3) != plain
    assert index(sheared_oil="slips") != plain
    assert index(average_friction=0.0) != plain
