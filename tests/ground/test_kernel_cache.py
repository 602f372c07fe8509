"""Processes that compile the same kernels at the same time share one cache without disturbing each other."""

import json
import os
import subprocess
import sys

import pytest

LOOK = """
import json, sys
from numba.core.event import install_recorder
import gears3d as g3
from gears3d.gears import Gear, HarmonicDeviation, Pair, nearest_gap, piece_budget
sys.stdin.readline()
with install_recorder("numba:compile") as compiled:
    {work}
print(json.dumps([sum(event.is_start for _, event in compiled.buffer), found]))
"""
GEARS = """gear = Gear(2e-3, 20, face_width=0.01)
    pair = Pair.from_backlash(gear, gear, 1e-4).with_deviations(HarmonicDeviation("drive", "active", 3, 5e-6))
    found = [value.hex() for value in piece_budget(pair).values()]
    found += [float(value).hex() for value in nearest_gap(pair.compiled(), 0.1, 0.1001, 0)]"""
TWIN = """made = g3.simulate("scenarios/rigaud-2020/fig5-20rpm.toml", model="rigid")
    found = [float(value).hex() for value in made.impacts["velocity_m_s"]]"""


@pytest.mark.slow
@pytest.mark.parametrize("work", [GEARS, TWIN], ids=["gears", "twin"])
def test_two_processes_fill_an_empty_cache_at_once(work, tmp_path):
    def start():
        return subprocess.Popen(
            [sys.executable, "-c", LOOK.format(work=work)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
        )

    def kept():
        return {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()}

    def told(process):
        out, err = process.communicate(timeout=600)
        assert process.returncode == 0, err
        assert not err
        return json.loads(out)

    both = [start(), start()]
    for process in both:  # both have imported everything and wait for this line
        process.stdin.write("\n")
        process.stdin.flush()
    (compiled, first), (compiled_too, second) = [told(process) for process in both]
    files = kept()
    assert compiled > 0
    assert compiled_too > 0
    assert files
    assert not [path for path in files if path.suffix not in (".nbi", ".nbc")]
    process = start()
    process.stdin.write("\n")
    compiled_again, third = told(process)
    assert compiled_again == 0
    assert kept() == files
    assert first == second == third


KEPT = """
import sys
import numpy as np
from gears3d.kernels import njit

@njit(cache=True)
def doubled(x):
    return 2.0 * x

@njit
def product(a, b):
    return np.dot(a, b)

print(doubled(np.ones(2)), "scipy.linalg" in sys.modules, product(np.ones(2), np.ones(2)))
"""


@pytest.mark.slow
def test_a_kept_kernel_runs_without_what_compiles_others(tmp_path):
    def told():
        whole = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
        return subprocess.run(
            [sys.executable, "-c", KEPT], capture_output=True, text=True, check=True, env=whole
        ).stdout

    assert told().split() == ["[2.", "2.]", "True", "2.0"]
    assert told().split() == ["[2.", "2.]", "False", "2.0"]
