"""A sweep from scenario to dataset: its numbers are those of single runs, in whatever order and process."""

import json
from itertools import pairwise

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.lumped import rigid
from gears3d.recording import describe
from gears3d.scenario import load
from gears3d.simulation import simulate
from gears3d.sweep import compute, make_plan, open_dataset, open_plan, scenario_of, sweep
from gears3d.sweep.dataset import thresholds
from gears3d.sweep.models import flat, is_plain, quantities
from gears3d.sweep.store import slabs

RIG = load("scenarios/rigaud-2020/fig5-20rpm.toml")
AMPLITUDE, FREQUENCY = "motion.harmonics[0].amplitude", "motion.harmonics[0].frequency"
GRID = [f"{AMPLITUDE}=1..20 rpm log 4", "drag.torque=0.22,0.46 N m", f"{FREQUENCY}=2..8 Hz lin 3"]


def same(one, other):
    """Whether two datasets have the same bits."""
    return all(one[name].values.tobytes() == other[name].values.tobytes() for name in one.variables)


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    place = tmp_path_factory.mktemp("sweep") / "grid"
    plan = make_plan(RIG, GRID, periods=20, settle=5)
    done = sweep(plan, place, workers=0)
    with open_dataset(place) as data:
        yield plan, done, data.load()


def test_a_point_is_what_a_run_of_its_scenario_is(grid):
    plan, done, data = grid
    assert done.counts["done"] == 24
    for point in (0, 7, 13, 23):
        scenario = plan.scenario(point)
        told = describe(simulate(scenario, "rigid"))
        here = data.isel(dict(zip(data.regime.dims, np.unravel_index(point, plan.shape), strict=True)))
        assert ("contact", "single_sided", "double_sided")[int(here.regime)] == told["regime"]
        assert float(here.excitation) == pytest.approx(told["excitation"], rel=1e-6)
        for name in ("velocity_mean_m_s", "velocity_std_m_s", "impulse_dimensionless"):
            for flank in ("active", "reverse"):
                ours, theirs = float(here[f"{flank}_{name}"]), told[f"{flank}_{name}"]
                assert np.isnan(ours) if theirs is None else ours == pytest.approx(theirs, rel=1e-5, abs=1e-9)
        assert float(here.energy_J_s) == pytest.approx(told["energy_J_s"], rel=1e-6, abs=1e-15)
        assert int(here.seed) == scenario.run.seed


def test_points_packed_at_once_are_those_of_their_scenarios(grid):
    plan, _, _ = grid
    assert is_plain(plan)
    for text in (GRID, [*GRID[:1], "mount.backlash=100..300 um lin 3", "gears.loose.inertia=0.05,0.07 kg m^2"],
                 [f"{AMPLITUDE}=100..300 rad/s^2 lin 2", f"{FREQUENCY}=2,3 Hz", "run.seed=1,2"]):  # fmt: skip
        one = make_plan(RIG, text, periods=20, settle=5)
        raw = compute(one, 0, one.size).values
        assert set(raw["status"]) == {0}
        from gears3d.sweep.block import Raw
        from gears3d.sweep.models import _packed

        room = Raw.empty(one, 0, one.size)
        table = _packed(one, room)
        for point in range(one.size):
            np.testing.assert_array_equal(table[point], flat(one.scenario(point)))
            assert room.setting[point, 0] == one.scenario(point).period
    assert quantities(plan, np.arange(2))["amplitude"][0] == plan.scenario(0).motion.harmonics[0].amplitude


def test_effects_are_packed_one_by_one_and_give_the_same(grid):
    plan, _, _ = grid
    nothing = {"effect": [{"kind": "drag_coulomb", "torque": "0 N m"}]}
    other = make_plan(RIG.with_(nothing), GRID, periods=20, settle=5)
    assert not is_plain(other)
    values = compute(other, 0, 6).values
    ours = compute(plan, 0, 6).values
    for name in ("regime", "excitation", "active_velocity_mean_m_s"):
        np.testing.assert_array_equal(values[name], ours[name])


def test_any_division_gives_the_same_bits(grid, tmp_path):
    plan, _, data = grid
    for size in (1, 7, 24):
        sweep(plan, tmp_path / str(size), workers=0, block=size)
        with open_dataset(tmp_path / str(size)) as other:
            assert same(data, other)


def test_the_dataset_is_labelled(grid):
    plan, done, data = grid
    assert data.regime.dims == ("motion_harmonics_0_amplitude", "drag_torque", "motion_harmonics_0_frequency")
    assert data.section_velocity_m_s.dims[-1] == "period"
    assert data.drag_torque.attrs["units"] == "N m"
    assert data.active_velocity_mean_m_s.attrs["units"] == "m/s"
    assert data.drag_torque.values.tolist() == [0.22, 0.46]
    assert all("units" in data[name].attrs for name in data.data_vars)
    assert data.attrs["key"] == plan.key
    assert not (done.place / "parts").exists()
    assert open_plan(done.place) == plan


def test_thresholds_up_and_down_are_at_unit_excitation(tmp_path):
    plan = make_plan(RIG, [f"{AMPLITUDE}=0.5..8 rpm log 60", f"{FREQUENCY}=2,5 Hz"], measures=["regime", "threshold"],
                     follow=AMPLITUDE, periods=30, settle=10)  # fmt: skip
    sweep(plan, tmp_path / "a", workers=0)
    with open_dataset(tmp_path / "a") as data:
        found = thresholds(data)
        for way in ("up", "down"):
            np.testing.assert_allclose(found[f"excitation_{way}"], 1.0, atol=0.06)
        np.testing.assert_allclose(found.up, found.down, rtol=0.05)
        step = data["motion_harmonics_0_amplitude"].values
        assert np.all(found.within_up > 0)
        assert np.all(found.within_up < 0.03 * step.max())


def test_a_followed_axis_is_in_rising_order_both_ways(tmp_path):
    plan = make_plan(RIG, ["drag.torque=0.2..0.8 N m lin 4"], follow="drag.torque", periods=8, settle=2)
    sweep(plan, tmp_path / "a", workers=0)
    with open_dataset(tmp_path / "a") as data:
        assert data.regime.dims == ("direction", "drag_torque")
        expected = RIG.gears.loose.inertia * 2 * np.pi * 3 * RIG.motion.harmonics[0].amplitude / data.drag_torque
        for way in ("up", "down"):
            np.testing.assert_allclose(data.excitation.sel(direction=way), expected, rtol=1e-9)
    values = plan.values(np.arange(8))["drag.torque"]
    assert values.tolist() == [0.2, 0.4, 0.6, 0.8, 0.8, 0.6, 0.4, 0.2]


def test_the_closed_form_and_the_twin_agree_on_a_grid(tmp_path):
    plastic = RIG.with_({"impact.restitution": 0})
    found = {}
    for model in ("rigid", "plastic"):
        plan = make_plan(plastic, [f"{AMPLITUDE}=1.2,4,12,20 rpm"], model, periods=12, settle=4)
        found[model] = compute(plan, 0, 4).values
    assert found["rigid"]["regime"].tolist() == found["plastic"]["regime"].tolist()
    for name in ("active_velocity_mean_m_s", "reverse_velocity_mean_m_s", "energy_J_s", "opening_m"):
        np.testing.assert_allclose(found["rigid"][name], found["plastic"][name], rtol=1e-8)


def test_the_lubricated_model_is_swept(tmp_path):
    oily = load("scenarios/dct-helical-lubricated/fig13.toml")
    plan = make_plan(oily, ["drag.torque=0.1,0.5 N m"], "lubricated", periods=12, settle=6, keep=4)
    values = compute(plan, 0, 2).values
    told = describe(simulate(plan.scenario(0), "lubricated"))
    assert values["active_velocity_mean_m_s"][0] == pytest.approx(told["active_velocity_mean_m_s"], rel=1e-4)
    assert values["rattle_index"][0] > 1.5 * values["rattle_index"][1] > 0.0
    assert np.isfinite(values["section_displacement_m"]).all()


def test_a_followed_lubricated_motion_begins_where_it_ended():
    oily = load("scenarios/dct-helical-lubricated/fig13.toml")
    plan = make_plan(oily, ["effect[0].viscosity=10,10.0001 mPa s"], "lubricated", follow="effect[0].viscosity",
                     periods=8, settle=4, keep=2)  # fmt: skip
    values = compute(plan, 0, plan.size).values
    alone = compute(make_plan(oily, ["effect[0].viscosity=10,10.0001 mPa s"], "lubricated", periods=16, settle=12,
                              keep=2), 0, 1).values  # fmt: skip
    assert values["active_velocity_mean_m_s"][1] == pytest.approx(alone["active_velocity_mean_m_s"][0], rel=0.02)


def test_what_is_done_is_not_done_again(grid, tmp_path, monkeypatch):
    plan, _, _ = grid
    sweep(plan, tmp_path / "a", workers=0)
    monkeypatch.setattr("gears3d.sweep.run.compute", None)
    assert sweep(plan, tmp_path / "a", workers=0).resumed == 24


def test_a_folder_of_something_else_stays_as_it_is(grid, tmp_path):
    plan, _, _ = grid
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(InputError, match="not a folder of a sweep"):
        sweep(plan, tmp_path, workers=0)
    (tmp_path / "a").mkdir()
    sweep(plan, tmp_path / "a", workers=0)
    with pytest.raises(InputError, match=r"holds another sweep: periods, settle differ"):
        sweep(make_plan(RIG, GRID, periods=21, settle=6), tmp_path / "a", workers=0)
    table = json.loads((tmp_path / "a" / "sweep.json").read_text())
    assert table["key"] == plan.key


def test_boxes_fill_a_grid_once():
    rng = np.random.default_rng(0)
    for _ in range(50):
        shape = tuple(rng.integers(1, 5, rng.integers(1, 5)))
        cuts = np.unique(np.concatenate([[0, np.prod(shape)], rng.integers(0, np.prod(shape) + 1, 4)]))
        filled = np.full(shape, -1)
        for begin, end in pairwise(cuts):
            for box, first, after in slabs(shape, int(begin), int(end)):
                assert np.all(filled[box] == -1)
                filled[box] = np.arange(first, after).reshape(filled[box].shape)
        np.testing.assert_array_equal(filled.ravel(), np.arange(np.prod(shape)))


def test_measured_motions_are_refused(tmp_path):
    record = tmp_path / "drive.parquet"
    rigid.simulate(RIG.with_({"run.duration": "1 s", "run.settle": "0 s"})).write(tmp_path)
    (tmp_path / "signals.parquet").rename(record)
    with pytest.raises(InputError, match="cannot be swept"):
        make_plan(RIG.with_({"motion.record": str(record), "run.duration": "0.5 s", "run.settle": "0 s"}), GRID)
    assert scenario_of(make_plan(RIG, GRID)) is scenario_of(make_plan(RIG, GRID))
