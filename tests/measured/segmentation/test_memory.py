"""A record of 300 MB is measured with little more memory than its columns take."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from pyarrow import csv

from tests.measured.segmentation.truth import FIG5, happened, seen

SIZE, ROWS = 300e6, 119 * 50_000 + 1
COLUMNS = 3 * 8 * ROWS / 1024**2
"""What the record's three columns take [MB]."""
RIG = str(Path(__file__).resolve().parents[3] / FIG5)
MEASURE = """
import re, sys
from pathlib import Path
from gears3d.cli import main
try:
    main(sys.argv[1:])
finally:
    told = Path("/proc/self/status").read_text()
    print("peak", int(re.search(r"VmHWM:\\s+(\\d+)", told)[1]) / 1024, file=sys.stderr)
"""
# the peak of its own memory map: ru_maxrss of a child begins with what its parent had
LINUX = pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="tells its peak on Linux only")


def write(path, duration):
    """A CSV of the bench that rattles, and how high its flights are, in order."""
    scenario, truth = happened(0.3, 60e-6, duration=f"{duration} s")
    record = seen(scenario, truth, 0.015, 11)
    names = ("time_s", "theta_drive_rad", "theta_loose_rad")
    with path.open("wb") as sink:
        for first in range(0, len(record.time), 1 << 20):
            rows = {name: record.signals[name][first : first + (1 << 20)] for name in names}
            csv.write_csv(pa.table(rows), sink, csv.WriteOptions(include_header=not first))
    return np.sort(truth.impacts["flight_height_m"])


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """The file, and how high the flights in it are."""
    path = tmp_path_factory.mktemp("long") / "run.csv"
    heights = write(path, 119.0)
    assert path.stat().st_size > SIZE
    return path, heights


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """A file of the same bench of 4 s, and how high the flights in it are."""
    path = tmp_path_factory.mktemp("short") / "run.csv"
    return path, write(path, 4.0)


def peak(path, heights, *more):
    """Measure the file in a process of its own; return the peak of its memory [MB], once what it says is right."""
    words = ["segment", str(path), "--rig", RIG, "--json", *more]
    done = subprocess.run([sys.executable, "-c", MEASURE, *words], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    high = int(np.count_nonzero(heights > 2.0 * summary["flight_height_min_m"]))
    assert abs(summary["impacts"] - high) <= 0.01 * high, (summary["impacts"], high)
    assert summary["flanks"]["backlash_m"]["value"] == pytest.approx(250e-6, rel=2e-3)
    return float(done.stderr.rpartition("peak")[2])


@pytest.mark.slow
@LINUX
def test_300_megabytes_take_little_more_than_their_columns(bench, short):
    more = peak(*bench) - peak(*short)  # libraries take 180 MB or more, and a little more with every version
    assert more < 1.5 * COLUMNS, more


@pytest.fixture(scope="module")
def reported(bench, tmp_path_factory):
    """The folder of a measurement with its report, and the peak of the memory [MB]."""
    folder = tmp_path_factory.mktemp("reported") / "measured"
    return folder, peak(*bench, "--out", str(folder))


@pytest.mark.slow
@LINUX
def test_every_row_of_300_megabytes_is_written(reported):
    signals = pa.parquet.read_table(reported[0] / "signals.parquet")
    assert signals.num_rows == ROWS
    assert signals.column_names[:3] == ["time_s", "theta_drive_rad", "theta_loose_rad"]


@pytest.mark.slow
@LINUX
@pytest.mark.xfail(strict=True, reason="takes 510 to 549 MB")
def test_with_a_report_300_megabytes_are_measured_within_490(reported):
    assert reported[1] < 490.0
