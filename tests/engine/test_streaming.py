"""A run that is written as it goes is the run in memory, bit by bit, however it ends, in memory that does not grow."""

import errno
import subprocess
import sys

import numpy as np
import pytest

from gears3d.engine import simulate, stream, streaming
from gears3d.errors import EngineError, InputError
from gears3d.recording import describe, excerpt, read
from gears3d.recording import streaming as tables
from gears3d.scenario import load
from gears3d.simulation import simulate as any_model
from gears3d.simulation import stream as any_stream
from tests.engine.poison import poison

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(streaming, "ROWS", 1000)
    monkeypatch.setattr(streaming, "EVENTS", 5)


def fig5(duration=0.7, **changes):
    return load(FIG5, {"run.duration": f"{duration} s", "run.settle": "0 s", **changes})


def begins(kept, whole):
    """Whether the tables are the beginning of the run, bit by bit."""
    for mine, other in ((kept.signals, whole.signals), (kept.impacts, whole.impacts)):
        assert mine.keys() == other.keys()
        for name, values in mine.items():
            np.testing.assert_array_equal(values, other[name][: len(values)], err_msg=name)


def test_what_is_streamed_is_what_memory_would_have_held(tmp_path, small):
    scenario = fig5()
    whole = simulate(scenario)
    meta = stream(scenario, tmp_path, about={"title": "long"})
    kept = read(tmp_path)
    begins(kept, whole)
    assert len(kept.time) == len(whole.time) > 10_000
    assert len(kept.impacts["time_s"]) == len(whole.impacts["time_s"]) > 10
    assert (kept.meta["title"], kept.meta["interrupted"], kept.meta["reached_s"]) == ("long", False, 0.7)
    assert "contacts" not in kept.meta
    assert excerpt(tmp_path).meta["contacts"] == [list(each) for each in whole.meta["contacts"]]
    assert meta["steps"] == whole.meta["steps"]
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "contacts.parquet",
        "impacts.parquet",
        "signals.parquet",
    ]


def test_an_excerpt_is_described_as_the_whole(tmp_path, small):
    scenario = fig5(1.5)
    any_stream(scenario, tmp_path)
    told, whole = describe(excerpt(tmp_path)), describe(any_model(scenario))
    for name in ("regime", "impacts", "active_velocity_mean_m_s", "energy_J_s", "flight_share", "active_contacts"):
        assert told[name] == pytest.approx(whole[name]), name
    assert told["excitation"] == pytest.approx(whole["excitation"], rel=1e-3)


def test_a_run_that_cannot_go_on_leaves_its_tables(tmp_path, small, monkeypatch):
    scenario = fig5()
    whole = simulate(scenario)
    poison(monkeypatch, 0.26)
    with pytest.raises(EngineError, match="not a number") as caught:
        stream(scenario, tmp_path)
    kept = read(tmp_path)
    begins(kept, whole)
    assert 1000 < len(kept.time) < len(whole.time)
    assert kept.meta["stopped_by"] == str(caught.value)
    assert kept.meta["interrupted"]


class _Full:
    """A disk with room for so many bytes, and more once what is held back is given up."""

    def __init__(self, path, size):
        self.path, self.size, self.file = path, size, path.open("wb", buffering=0)

    def write(self, data):
        spare = self.path.with_name(f"{self.path.name}.room")
        left = self.size + (0 if spare.exists() else tables.ROOM) - self.file.tell()
        if left <= 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        return self.file.write(memoryview(data)[:left])

    def tell(self):
        return self.file.tell()

    def close(self):
        self.file.close()


@pytest.mark.parametrize("size", [100_000, 300_000])
def test_a_full_disk_keeps_everything_until_then(tmp_path, small, monkeypatch, size):
    scenario = fig5(1.0)
    whole = simulate(scenario)
    monkeypatch.setattr(tables, "_opened", lambda path: _Full(path, size))
    with pytest.raises(InputError, match=r"signals.parquet: cannot be written: the disk is full \(free") as caught:
        stream(scenario, tmp_path)
    kept = read(tmp_path)
    begins(kept, whole)
    assert 1000 <= len(kept.time) < len(whole.time)
    assert kept.time[-1] <= kept.meta["reached_s"] + scenario.run.duration / 100
    assert kept.meta["stopped_by"] == str(caught.value)
    assert (tmp_path / "signals.parquet").stat().st_size > 0.8 * size
    assert not list(tmp_path.glob(".*"))


def test_a_disk_full_from_the_start_leaves_nothing(tmp_path, monkeypatch):
    def nothing(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(tables.os, "posix_fallocate", nothing)
    with pytest.raises(InputError, match="cannot be written: No space left"):
        stream(fig5(0.1), tmp_path / "run")
    assert not list((tmp_path / "run").iterdir())


def test_sensors_want_a_whole_recording(tmp_path):
    skew = {"kind": "encoder_skew", "delay": "1 ms"}
    with pytest.raises(InputError, match=r"effect\[0\]: 'encoder_skew' acts on a whole recording"):
        any_stream(fig5(effect=[skew]), tmp_path)


MEASURED = """
import resource, sys
from gears3d.engine import stream
from gears3d.scenario import load
changes = {"run.duration": f"{sys.argv[1]} s", "run.settle": "0 s", "run.output_rate": "400 kHz"}
stream(load("%s", changes), __import__("pathlib").Path(sys.argv[2]))
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""


@pytest.mark.slow
def test_ten_times_as_long_takes_the_same_memory(tmp_path):
    """Twenty seconds at 400 kHz are 450 MB of samples."""

    def peak(duration):
        command = [sys.executable, "-c", MEASURED % FIG5, str(duration), str(tmp_path / str(duration))]
        return float(subprocess.run(command, capture_output=True, text=True, check=True, timeout=300).stdout)

    short, long = peak(2), peak(20)
    assert len(read(tmp_path / "20").time) == 8_000_001
    assert long < 1.1 * short
