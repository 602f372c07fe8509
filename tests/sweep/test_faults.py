"""What goes wrong with many runs: processes that die, points that hang or fail, full disks, Ctrl-C, endless grids."""

import csv
import errno
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from gears3d.errors import EngineError, InputError
from gears3d.scenario import load
from gears3d.sweep import Estimate, block_size, compute, make_plan, open_dataset, refuse_endless, sweep
from gears3d.sweep import pool as pool_module
from gears3d.sweep.block import Watch
from gears3d.sweep.pool import Pool
from tests.sweep import faulty

RIG = load("scenarios/rigaud-2020/fig5-20rpm.toml")
AMPLITUDE = "motion.harmonics[0].amplitude"
SPANS = [(0, 4), (4, 8), (8, 12)]


@pytest.fixture
def plan(tmp_path):
    made = make_plan(RIG, [f"{AMPLITUDE}=1..20 rpm log 12"], measures=["regime", "velocities"], periods=10, settle=3)
    return replace(made, path=str(tmp_path / "scenario.toml"))


def gathered(plan, run, limit=float("inf")):
    blocks = list(Pool(plan, 1, limit, run).blocks(SPANS))
    assert sorted((block.begin, block.end) for block in blocks) == SPANS  # nothing lost, nothing doubled
    blocks.sort(key=lambda block: block.begin)
    values = {name: np.concatenate([block.values[name] for block in blocks]) for name in blocks[0].values}
    return values, {point: why for block in blocks for point, why in block.why.items()}


def test_the_block_of_a_killed_process_is_run_again(plan):
    expected = compute(plan, 0, 12).values
    values, why = gathered(plan, faulty.killed_once)
    assert not why
    for name, value in expected.items():
        assert value.tobytes() == values[name].tobytes()


def test_a_point_that_kills_every_process_is_given_up_alone(plan):
    values, why = gathered(plan, faulty.killed_always)
    assert list(why) == [faulty.POINT]
    assert "3 processes died" in why[faulty.POINT]
    assert np.flatnonzero(values["status"]).tolist() == [faulty.POINT]
    assert values["status"][faulty.POINT] == 3
    assert np.isnan(values["impacts_per_period"][faulty.POINT])
    assert values["regime"][faulty.POINT] == -9


def test_a_point_that_hangs_is_killed_and_given_up_alone(plan, monkeypatch):
    monkeypatch.setattr(pool_module, "GRACE", 0.5)
    values, why = gathered(plan, faulty.hangs, limit=0.5)
    assert list(why) == [faulty.POINT]
    assert values["status"].tolist() == [0] * 5 + [2] + [0] * 6


def test_a_mistake_in_a_process_is_raised_here(plan):
    with pytest.raises(EngineError, match="points 0 to 3 cannot be run: ValueError: a mistake of ours"):
        gathered(plan, faulty.fails)


def test_a_machine_that_starts_no_process_is_a_fault(plan, monkeypatch):
    def refused(*_):
        raise OSError(errno.EAGAIN, os.strerror(errno.EAGAIN))

    pool = Pool(plan, 1)
    monkeypatch.setattr(pool._context.Process, "start", refused)
    with pytest.raises(EngineError, match="no process can be started; give fewer --workers"):
        next(pool.blocks(SPANS))


def test_a_point_that_never_ends_is_stopped_in_compiled_code():
    bouncing = RIG.with_({"impact.restitution": 1.0, "impact.stick_velocity": "0 mm/s"})
    endless = make_plan(bouncing, [f"{AMPLITUDE}=0.5,20 rpm"], measures=["regime"], periods=10**7, settle=3)
    begin = time.monotonic()
    found = compute(endless, 0, 2, Watch(0.5))
    assert time.monotonic() - begin < 20.0
    assert found.values["status"].tolist() == [0, 2]
    assert found.why == {1: "ran for longer than 0.5 s"}


def test_a_motion_that_repeats_for_ever_is_stopped():
    endless = make_plan(RIG, [f"{AMPLITUDE}=20 rpm"], measures=["regime"], periods=10**9, settle=3)
    begin = time.monotonic()
    found = compute(endless, 0, 1, Watch(0.5))
    assert time.monotonic() - begin < 20.0
    assert found.values["status"].tolist() == [2]


def test_a_lubricated_point_that_never_ends_is_stopped():
    oily = load("scenarios/dct-helical-lubricated/fig13.toml")
    endless = make_plan(oily, ["drag.torque=0.1 N m"], "lubricated", ["regime"], periods=10**5)
    assert compute(endless, 0, 1, Watch(1.0)).values["status"].tolist() == [2]


def test_a_point_that_raises_is_noted_and_the_rest_goes_on(tmp_path):
    wavy = RIG.with_({"effect": [{"kind": "transmission_error", "order": 1, "amplitude": "10 um", "flank": "active"}]})
    plan = make_plan(wavy, ["effect[0].amplitude=10,400,20 um"], measures=["regime"], periods=5, settle=2)
    done = sweep(plan, tmp_path / "a", workers=0)
    assert done.counts == {"done": 2, "failed": 1, "time_limit": 0, "lost": 0}
    with open_dataset(tmp_path / "a") as data:
        assert data.status.values.tolist() == [0, 1, 0]
        assert np.isnan(data.regime.values).tolist() == [False, True, False]
    with (tmp_path / "a" / "failed.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert row["point"] == "1"
    assert "uses up the backlash" in row["why"]


def test_a_full_disk_keeps_what_is_finished_and_the_sweep_goes_on(plan, tmp_path, monkeypatch):
    expected = compute(plan, 0, 12).values
    place, save, left = tmp_path / "a", np.savez, [2]

    def full(*arguments, **values):
        if not left[0]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        left[0] -= 1
        save(*arguments, **values)

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(InputError, match="No space left on device"):
        sweep(plan, place, workers=0, block=3)
    assert len(list((place / "parts").iterdir())) == 2
    assert not (place / "sweep.nc").exists()
    left[0] = 100
    assert sweep(plan, place, workers=0, block=3).resumed == 6
    with open_dataset(place) as data:
        assert data.active_velocity_mean_m_s.values.tobytes() == expected["active_velocity_mean_m_s"].tobytes()


def test_a_block_that_was_torn_is_run_again(plan, tmp_path):
    place = tmp_path / "a"

    def stop(done):
        if done >= 6:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(plan, place, workers=0, block=3, track=stop)
    parts = sorted((place / "parts").iterdir())
    assert len(parts) == 2
    parts[0].write_bytes(parts[0].read_bytes()[:100])
    assert sweep(plan, place, workers=0, block=3).resumed == 3


def test_an_interrupt_amid_compiled_code_is_raised_where_one_waits_for_it(tmp_path):
    long = make_plan(RIG, [f"{AMPLITUDE}=5..20 rpm log 40"], measures=["regime"], periods=2_000_000, settle=3)

    def stop(done):
        if done > 2:
            raise KeyboardInterrupt

    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        sweep(long, tmp_path / "a", workers=0, block=40, track=stop)
    assert time.monotonic() - begin < 20.0
    assert not list((tmp_path / "a").glob("parts/*"))


def test_what_a_kill_before_the_first_block_leaves_is_gone_on_with(plan, tmp_path):
    place = tmp_path / "a"
    (place / "parts").mkdir(parents=True)
    (place / ".lock").touch()
    (place / ".gears3d-x").mkdir()
    assert sweep(plan, place, workers=0).counts["done"] == plan.size


def test_a_sweep_that_does_not_begin_leaves_nothing(plan, tmp_path):
    place = tmp_path / "a"
    with pytest.raises(InputError, match=r"does not answer|is not an address"):
        sweep(plan, place, scheduler="nowhere://127.0.0.1:9")
    assert not place.exists()


def test_what_a_kill_after_the_dataset_leaves_is_taken_away(plan, tmp_path):
    place = tmp_path / "a"
    sweep(plan, place, workers=0)
    (place / "parts").mkdir()
    (place / "parts" / "000000000000-000000000012.npz").touch()
    sweep(plan, place, workers=0)
    assert not (place / "parts").exists()


def test_two_processes_do_not_fill_one_folder(plan, tmp_path):
    def other(done):
        if done:
            with pytest.raises(InputError, match="being filled by another process"):
                sweep(plan, tmp_path / "a", workers=0)

    sweep(plan, tmp_path / "a", workers=0, track=other)


def test_a_grid_that_would_take_a_year_is_refused_before_it_begins():
    expected = Estimate(10**9, 0.1, 2)
    with pytest.raises(InputError, match=r"1.58 years in 2 processes.*--longest"):
        refuse_endless(expected, 86400.0)
    refuse_endless(Estimate(10**6, 1e-3, 2), 86400.0)
    plan = make_plan(RIG, ["drag.torque=0.1..1 N m lin 1000", "impact.restitution=0..0.5 lin 1000"])
    assert block_size(plan, Estimate(plan.size, 1e-4, 2)) == 16384
    assert block_size(plan, Estimate(plan.size, 10.0, 2)) == 1


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_finished_and_the_same_command_goes_on(tmp_path):
    place = tmp_path / "a"
    command = [sys.executable, "-m", "gears3d", "sweep", "scenarios/rigaud-2020/fig5-20rpm.toml", "--vary",
               f"{AMPLITUDE}=2..40 rpm log 3000", "--periods", "400", "--settle", "100", "--block", "50",
               "--measure", "regime", "--workers", "1", "--out", str(place)]  # fmt: skip
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
        while not len(list((place / "parts").glob("*.npz"))) >= 3:
            assert process.poll() is None
            time.sleep(0.05)
        os.killpg(process.pid, signal.SIGINT)
        told = process.stderr.read()
        assert process.wait(timeout=60) == 130
    assert "the same command continues" in told
    kept = len(list((place / "parts").glob("*.npz")))
    again = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True)
    assert f"{50 * kept} of 3000 points are there already" in again.stderr
    with open_dataset(place) as data:
        assert set(data.status.values.tolist()) == {0.0}


@pytest.mark.slow
def test_an_endless_grid_is_refused_at_the_command_line(tmp_path):
    command = [sys.executable, "-m", "gears3d", "sweep", "scenarios/rigaud-2020/fig5-20rpm.toml", "--vary",
               f"{AMPLITUDE}=2..40 rpm log 100000", "--vary", "drag.torque=0.1..1 N m lin 100000", "--workers", "1",
               "--periods", "1000", "--out", str(tmp_path / "a")]  # fmt: skip
    told = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert told.returncode == 3
    assert "10000000000 points" in told.stderr
    assert "--longest" in told.stderr
    assert not (tmp_path / "a" / "sweep.json").exists()
