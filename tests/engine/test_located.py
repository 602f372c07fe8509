"""Located contact against closed forms and against the rigid twin, whose code shares nothing with the engine's."""

import numpy as np
import pytest

from gears3d.engine import moving, run, simulate
from gears3d.errors import UsageError
from gears3d.lumped import rigid
from gears3d.scenario import load

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
HIGH = 0.05e-6
"""Impacts after flights higher than this are compared one by one [m]."""


def fig5(*changes, duration="1 s"):
    return load(FIG5, [f"run.duration={duration}", *changes])


def test_plastic_orbit_has_the_closed_form():
    """Rigaud & Perret-Liaudet 2020, eqs (17)-(19), roots found to 30 digits; Rb = 148.0016 mm shifts them by 1e-5."""
    hits = simulate(fig5("impact.restitution=0.0")).impacts
    assert hits["flank"].tolist() == [1, 0, 1, 0, 1, 0]
    assert hits["time_s"][:2] == pytest.approx([0.1116544, 0.2696574], rel=2e-5)
    assert hits["velocity_m_s"][:2] == pytest.approx([0.0308581, -0.0312425], rel=2e-5)
    assert hits["phase_rad"][2:4] == pytest.approx(hits["phase_rad"][:2], abs=1e-7)
    assert hits["flight_height_m"] == pytest.approx(250e-6, abs=1e-8)


@pytest.mark.parametrize("mean", ["30 rpm", "90 rpm", "750 rpm"])
@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.5, 0.7])
def test_agrees_with_the_twin_at_full_rotation(restitution, mean):
    scenario = fig5(f"impact.restitution={restitution}", f"motion.mean={mean}")
    ours, twin = simulate(scenario).impacts, rigid.simulate(scenario).impacts
    ours, twin = ({k: v[hits["flight_height_m"] > HIGH] for k, v in hits.items()} for hits in (ours, twin))
    assert ours["flank"].tolist() == twin["flank"].tolist()  # none missed, none invented
    assert len(ours["flank"]) >= 6
    error = ours["velocity_m_s"] / twin["velocity_m_s"] - 1.0
    assert np.median(np.abs(error)) <= 1e-7  # promised: 2e-3
    assert np.quantile(np.abs(error), 0.95) <= 1e-6  # promised: 6e-3
    assert abs(np.mean(error)) <= 1e-7  # promised: 1e-3
    assert np.abs(ours["phase_rad"] - twin["phase_rad"]).max() / (2 * np.pi) <= 1e-8  # promised: 1e-4
    for column in ("rebound_m_s", "impulse_N_s", "flight_height_m"):
        assert ours[column] == pytest.approx(twin[column], rel=1e-5, abs=1e-9)


def test_signals_are_the_twins():
    scenario = fig5()
    ours, twin = simulate(scenario).signals, rigid.simulate(scenario).signals
    assert list(ours) == list(twin)
    for column, tolerance in {"theta_loose_rad": 1e-11, "displacement_m": 1e-12, "velocity_m_s": 1e-9}.items():
        assert np.abs(ours[column] - twin[column]).max() <= tolerance, column


@pytest.mark.parametrize("state", ["reverse", "free"])
def test_other_starts(state):
    scenario = fig5(f"start.state={state}")
    ours, twin = simulate(scenario).impacts, rigid.simulate(scenario).impacts
    assert ours["velocity_m_s"] == pytest.approx(twin["velocity_m_s"], rel=1e-6)
    assert ours["flight_height_m"][1:] == pytest.approx(twin["flight_height_m"][1:], rel=1e-5)


def test_active_teeth_are_those_next_to_the_pitch_point():
    scenario = fig5("motion.mean=90 rpm")
    hits = simulate(scenario).impacts
    angle = np.interp(hits["time_s"], *(simulate(scenario).signals[k] for k in ("time_s", "theta_drive_rad")))
    active = hits["flank"] == 0
    expected = np.mod(np.round(angle[active] * 90 / (2 * np.pi)), 90) + 1
    assert hits["tooth_drive"][active].tolist() == expected.tolist()
    assert hits["tooth_loose"][active].tolist() == expected.tolist()
    assert np.all(hits["tooth_loose"][~active] == hits["tooth_drive"][~active] % 90 + 1)


def test_rebuilt_worlds_agree_bit_by_bit():
    scenario = fig5()
    first, second = simulate(scenario), simulate(scenario)
    for table in ("signals", "impacts"):
        one, two = getattr(first, table), getattr(second, table)
        assert all(one[name].tobytes() == two[name].tobytes() for name in one)
    assert {**first.meta, "wall_s": 0} == {**second.meta, "wall_s": 0}


def test_scatter_follows_the_seed(monkeypatch):
    from gears3d.effects import impact_scatter
    from gears3d.scenario import Scenario

    monkeypatch.setattr(Scenario, "rows", lambda self: (impact_scatter(0.05),))
    runs = [simulate(fig5(f"run.seed={seed}")).impacts["rebound_m_s"][0] for seed in (1, 1, 2)]
    assert runs[0] == runs[1] != runs[2]


def test_budget_and_bookkeeping():
    done = []
    record = simulate(fig5(), progress=done.append)
    budget = record.meta["error_budget"]
    assert budget["total"] < 2e-11
    assert budget["raw_minus_refined_max"] < budget["raw_allowed"] < 2.5e-6
    assert budget["raw_minus_refined_mean"] == pytest.approx(-budget["hull_margins"], abs=0.5e-6)
    assert record.meta["queries"] <= 1 + 45  # one and a pitch
    assert (record.meta["model"], record.meta["contact"]) == ("bullet", "located")
    assert record.meta["interrupted"] is False
    assert done == sorted(done)
    assert 0.5 < done[-1] <= 1.0
    assert record.time[[0, -1]].tolist() == [0.0, 1.0]
    assert len(record.time) == 20001


def test_permanent_contacts_lie_between_the_impacts():
    record = simulate(fig5("impact.restitution=0.0"))
    flanks, starts, ends = np.array(record.meta["contacts"]).T
    assert flanks.tolist() == [0, 1, 0, 1, 0, 1, 0]
    assert starts[1:] == pytest.approx(record.impacts["time_s"], abs=1e-12)
    assert np.all(starts < ends)
    assert ends[0] == pytest.approx(0.0875917, rel=2e-5)  # arccos(-1/Λ)/ω, Rigaud & Perret-Liaudet 2020, eq. (17)


def test_interrupt_keeps_what_there_is():
    def stop(reached):
        if reached > 0.4:
            raise KeyboardInterrupt

    record = simulate(fig5(), progress=stop)
    assert record.meta["interrupted"] is True
    assert 0.4 < record.meta["reached_s"] < 0.7
    assert record.time[-1] == pytest.approx(record.meta["reached_s"], abs=1e-4)
    assert record.impacts["time_s"].max() <= record.meta["reached_s"]


def test_bad_arguments():
    with pytest.raises(UsageError, match="did you mean 'located'"):
        simulate(fig5(), contact="locate")


def test_steps_resolve_the_fastest_wave():
    scenario = fig5("motion.mean=750 rpm")
    from gears3d.engine.motion import motion_table

    pair = scenario.pair()
    step = run.longest_step(motion_table(scenario), (), pair)
    assert step == pytest.approx(0.3 / 90 / (770 / 60), rel=1e-12)
    assert moving.NEAR <= 1e-10
