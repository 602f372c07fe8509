"""A file of 300 MB is read with less than 400 MB of the whole process."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from pyarrow import csv

ROWS = 1 << 17
SIZE = 300e6
LARGEST = 400.0
MAP = """
format = 1
[time]
channel = "t"
unit = "s"
[drive]
channel = "a0"
unit = "rad"
[loose]
channel = "a1"
unit = "deg"
sign = -1
"""
READ = """
import re, sys
from pathlib import Path
from gears3d.measured.readers import read
found = read(sys.argv[1], sys.argv[2]).columns
print(len(found["time_s"]), found["time_s"][-1], -found["theta_loose_rad"].sum())
print(int(re.search(r"VmHWM:\\s+(\\d+)", Path("/proc/self/status").read_text())[1]) / 1024)
"""


# the peak of its own memory map: ru_maxrss of a child begins with what its parent had


def batches(columns):
    """Yield tables of time and angles, and the sum of the second angle with them, without an end."""
    random, at = np.random.default_rng(1), 0
    while True:
        rows = np.arange(at, at + ROWS)
        angles = {f"a{k}": 1e-3 * rows + random.normal(size=ROWS) for k in range(columns)}
        yield pa.table({"t": rows * 2e-5, **angles}), float(angles["a1"].sum())
        at += ROWS


def write_csv(path):
    total = rows = 0
    with path.open("wb") as sink:
        for table, part in batches(2):
            csv.write_csv(table, sink, csv.WriteOptions(include_header=not rows, delimiter=";"))
            total, rows = total + part, rows + ROWS
            if sink.tell() > SIZE:
                return rows, total


def write_parquet(path):
    total = rows = 0
    made = batches(7)
    table, part = next(made)
    with (
        path.open("wb") as sink,
        pq.ParquetWriter(sink, table.schema, compression="none", use_dictionary=False) as file,
    ):
        while True:
            file.write_table(table)
            total, rows = total + part, rows + ROWS
            if sink.tell() > SIZE:
                return rows, total
            table, part = next(made)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="tells its peak on Linux only")
@pytest.mark.parametrize("write", [write_csv, write_parquet])
def test_300_megabytes_are_read_within_400(write, tmp_path):
    path, chart = tmp_path / "run.dat", tmp_path / "record.toml"
    chart.write_text(MAP)
    rows, total = write(path)
    assert path.stat().st_size > SIZE
    done = subprocess.run(
        [sys.executable, "-c", READ, str(path), str(chart)], capture_output=True, text=True, check=True, timeout=300
    )
    first, second = done.stdout.splitlines()
    count, last, summed = first.split()
    assert int(count) == rows
    assert float(last) == pytest.approx((rows - 1) * 2e-5, rel=1e-12)
    assert float(summed) == pytest.approx(np.radians(total), rel=1e-9)
    assert float(second) < LARGEST, f"{rows} rows"
