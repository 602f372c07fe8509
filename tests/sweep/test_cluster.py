"""The same sweep on a cluster: the same bits, and clear errors when the scheduler or its workers go."""

import os
import subprocess
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest

from gears3d.errors import EngineError, InputError
from gears3d.scenario import load
from gears3d.sweep import cluster as cluster_module
from gears3d.sweep import compute, make_plan, open_dataset, sweep
from gears3d.sweep.cluster import Cluster, compute_there, cpu_model

RIG = load("scenarios/rigaud-2020/fig5-20rpm.toml")
AMPLITUDE = "motion.harmonics[0].amplitude"


def plan(points=40, periods=20):
    return make_plan(RIG, [f"{AMPLITUDE}=0.5..40 rpm log {points}"], measures=["regime", "velocities"],
                     periods=periods, settle=5)  # fmt: skip


@contextmanager
def machines(tmp_path, workers, port):
    """Start a scheduler and workers on 127.0.0.1 as processes of their own; give the address and the processes."""
    address = f"tcp://127.0.0.1:{port}"
    here = ("--host", "127.0.0.1", "--no-dashboard", "--dashboard-address", "127.0.0.1:0")
    started = [_start(tmp_path, "scheduler", *here, "--port", str(port))]
    for name in range(workers):
        started.append(_start(tmp_path, "worker", address, *here, "--name", str(name), "--nworkers", "1",
                              "--nthreads", "1", "--no-nanny", "--local-directory", str(tmp_path)))  # fmt: skip
    try:
        yield address, started
    finally:
        for process in started:
            process.kill()
            process.wait()


def _start(tmp_path, *command):
    with (tmp_path / f"{command[0]}.log").open("a") as log:
        return subprocess.Popen([sys.executable, "-m", "dask", *command], stdout=log, stderr=log)


def test_a_scheduler_that_does_not_answer_is_told(monkeypatch):
    monkeypatch.setattr(cluster_module, "ANSWER_S", 0.5)
    with pytest.raises(InputError, match=r"tcp://127.0.0.1:9 does not answer within 0.5 s"):
        Cluster(plan(), "tcp://127.0.0.1:9")
    with pytest.raises(InputError, match="is not an address"):
        Cluster(plan(), "nowhere://127.0.0.1:9")


def test_a_worker_of_another_version_is_refused():
    with pytest.raises(InputError, match="another version"):
        compute_there(plan(), "0" * 32, 0, 2, 10.0)
    one = plan()
    assert (
        compute_there(one, one.key, 0, 2, 10.0).values["regime"].tolist()
        == compute(one, 0, 2).values["regime"].tolist()
    )
    assert cpu_model()


@pytest.mark.slow
@pytest.mark.parametrize("place", ["cluster", "alone"])
def test_kernels_that_are_not_compiled_yet_cost_no_point_its_time(place, tmp_path):
    code = (
        "from gears3d.sweep import make_plan\nfrom gears3d.scenario import load\n"
        "from gears3d.sweep.cluster import compute_there\nfrom gears3d.sweep.run import Alone\n"
        "rig = load('scenarios/rigaud-2020/fig5-20rpm.toml')\n"
        f"plan = make_plan(rig, ['{AMPLITUDE}=5..40 rpm log 4'], periods=20, settle=5)\n"
        "cluster = lambda: compute_there(plan, plan.key, 0, 4, 1.0)\n"
        "alone = lambda: next(iter(Alone(plan, 1.0).blocks([(0, 4)])))\n"
        f"print({place}().values['status'].tolist())"
    )
    fresh = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=fresh, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[0, 0, 0, 0]"


@pytest.mark.slow
def test_a_cluster_gives_the_same_bits_and_outlives_a_worker(tmp_path):
    long = plan(2000, 200)
    with machines(tmp_path, 2, 18786) as (address, started):

        def kill_one(done):
            if done >= 200 and started[1].poll() is None:
                started[1].kill()

        there = sweep(long, tmp_path / "there", scheduler=address, block=100, track=kill_one)
        assert started[1].poll() is not None
    here = sweep(long, tmp_path / "here", workers=1)
    assert there.counts == here.counts == {"done": 2000, "failed": 0, "time_limit": 0, "lost": 0}
    with open_dataset(tmp_path / "there") as one, open_dataset(tmp_path / "here") as other:
        for name in one.variables:
            assert one[name].values.tobytes() == other[name].values.tobytes()


@pytest.mark.slow
def test_a_killed_scheduler_is_told_and_the_sweep_goes_on(tmp_path):
    long = plan(2000, 200)
    with machines(tmp_path, 1, 18787) as (address, started):

        def kill_it(done):
            if done >= 200:
                started[0].kill()

        begin = time.monotonic()
        with pytest.raises(EngineError, match=r"the scheduler at .* is gone; finished blocks are kept"):
            sweep(long, tmp_path / "a", scheduler=address, block=100, track=kill_it)
        assert time.monotonic() - begin < 120.0
    kept = len(list((tmp_path / "a" / "parts").iterdir()))
    assert 2 <= kept < 20
    again = sweep(long, tmp_path / "a", workers=1)
    assert again.resumed == 100 * kept
    with open_dataset(tmp_path / "a") as data:
        expected = compute(long, 500, 520).values["active_velocity_mean_m_s"]
        np.testing.assert_array_equal(data.active_velocity_mean_m_s.values[500:520], expected)


@pytest.mark.slow
def test_a_scheduler_without_workers_is_told(tmp_path):
    with machines(tmp_path, 0, 18788) as (address, _), pytest.raises(EngineError, match="has no workers"):
        list(Cluster(plan(), address).blocks([(0, 2)]))
