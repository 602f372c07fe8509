"""Files that would grow, hang, reach for other files or run code: each is refused before it does."""

import os
import pickle
import zlib

import asammdf
import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io

from gears3d import recording
from gears3d.errors import InputError
from gears3d.inputs import VARIABLE
from gears3d.measured.readers import open_source, propose, read
from gears3d.measured.readers.source import split_unit, unique

NAMES = ("time_s", "theta_drive_rad", "theta_loose_rad")
ROWS = 30_000_000


@pytest.fixture(autouse=True)
def small(monkeypatch):
    monkeypatch.setenv(VARIABLE, "2e8")


def write_hdf5(path):
    with h5py.File(path, "w") as file:
        for name in NAMES:
            file.create_dataset(name, (ROWS,), "f8")


def write_hdf5_chunk(path):
    with h5py.File(path, "w") as file:
        for name in NAMES:
            file.create_dataset(name, (ROWS,), "f8", chunks=(ROWS,), compression="gzip")


def write_parquet(path):
    zeros = pa.array(np.zeros(1 << 18))
    schema = pa.schema([(name, pa.float64()) for name in NAMES])
    with pq.ParquetWriter(path, schema) as file:
        for _ in range(0, ROWS, 1 << 18):
            file.write_table(pa.Table.from_arrays([zeros] * 3, schema=schema))


def write_matlab_double(path):
    scipy.io.savemat(path, {"rig": {"t": np.zeros(ROWS)}}, do_compression=True)


def write_matlab_lies(path):
    """A compressed variable whose own tag declares few bytes, and the matrix in it many."""
    scipy.io.savemat(path, {"t": np.zeros(ROWS)})
    data = path.read_bytes()
    content = data[128:132] + np.uint32(100).tobytes() + data[136:]
    packed = zlib.compress(content)
    path.write_bytes(data[:128] + np.array([15, len(packed)], "<u4").tobytes() + packed)


def write_mdf(path):
    with asammdf.MDF(version="4.10") as file:
        time = np.arange(1000) / 1000.0
        file.append([asammdf.Signal(time, time, name=name, unit="rad") for name in NAMES[1:]])
        file.save(path, compression=1, overwrite=True)
    data = bytearray(path.read_bytes())
    at = data.index(b"##DZ")
    bomb = zlib.compress(bytes(8 * ROWS))
    head = data[at : at + 24] + data[at + 24 : at + 40] + np.uint64(len(bomb)).tobytes()
    links = [k for k in range(0, len(data) - 8, 8) if data[k : k + 8] == np.uint64(at).tobytes()]
    end = len(data) + -len(data) % 8
    data += bytes(end - len(data)) + head + bomb
    for link in links:
        data[link : link + 8] = np.uint64(end).tobytes()
    path.write_bytes(data)


def write_uff(path):
    path.write_bytes(b"    -1\n    58\n" + b"x" * 20_000_000)


def write_csv(path):
    path.write_bytes(",".join(NAMES).encode() + b"\n0,0,0\n1,1,1" + b"\n" * ROWS)


BOMBS = {
    "hdf5": write_hdf5,
    "hdf5-chunk": write_hdf5_chunk,
    "parquet": write_parquet,
    "matlab-double": write_matlab_double,
    "matlab-lies": write_matlab_lies,
    "uff": write_uff,
    "csv": write_csv,
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", BOMBS)
def test_what_takes_too_much_memory_is_refused_before_it_is_loaded(kind, tmp_path):
    path = tmp_path / "a.csv"
    BOMBS[kind](path)
    with pytest.raises(InputError, match=r"GiB of memory, 0.186 GiB are permitted .*, or set GEARS3D_MAX_BYTES"):
        read(path)


def test_a_block_of_mdf_that_lies_about_its_size_is_refused(tmp_path):
    path = tmp_path / "a.mf4"
    write_mdf(path)
    (tmp_path / "record.toml").write_text('format = 1\n[drive]\nchannel = "theta_drive_rad"\n')
    with pytest.raises(InputError, match="a block unpacks to more than it declares"):
        read(path, tmp_path / "record.toml")


@pytest.mark.parametrize("name", ["signals.parquet", "a.parquet"])
def test_a_recording_that_takes_too_much_memory_is_refused(name, tmp_path):
    write_parquet(tmp_path / name)
    with pytest.raises(InputError, match="GEARS3D_MAX_BYTES"):
        recording.read(tmp_path / name)


@pytest.mark.parametrize("how", ["storage", "link", "virtual"])
def test_samples_in_another_file_are_refused(how, tmp_path):
    path, other = tmp_path / "a.h5", tmp_path / "b.h5"
    np.arange(100.0).tofile(tmp_path / "raw.bin")
    with h5py.File(other, "w") as file:
        file["time_s"] = np.arange(100.0)
    with h5py.File(path, "w") as file:
        file["theta_drive_rad"] = np.arange(100.0)
        if how == "storage":
            file.create_dataset("time_s", (100,), "f8", external=[(str(tmp_path / "raw.bin"), 0, 800)])
        elif how == "link":
            file["time_s"] = h5py.ExternalLink(str(other), "time_s")
        else:
            layout = h5py.VirtualLayout((100,), "f8")
            layout[:] = h5py.VirtualSource(str(other), "time_s", (100,))
            file.create_virtual_dataset("time_s", layout)
    with pytest.raises(InputError, match="time_s: has its samples in another file"):
        read(path)


class Code:
    def __reduce__(self):
        return os.mkdir, ("made",)


@pytest.mark.parametrize("form", ["npy", "npz", "pickle"])
def test_no_code_of_a_file_runs(form, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / f"a.{form}"
    objects = np.array([Code()], dtype=object)
    with path.open("wb") as file:
        if form == "pickle":
            pickle.dump(objects, file)
        else:
            (np.save if form == "npy" else np.savez)(file, objects, allow_pickle=True)
    with pytest.raises(InputError):
        read(path)
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("formula", ["9**9**9**9", "__import__('os').getpid()", "X1**9**9", "X" * 300])
def test_a_formula_that_is_no_arithmetic_is_refused(formula, tmp_path):
    path = tmp_path / "a.mf4"
    time = np.arange(100) / 1000.0
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(time, time, name="phi", unit="rad", conversion={"formula": formula})])
        file.save(path, overwrite=True)
    (tmp_path / "record.toml").write_text('format = 1\n[drive]\nchannel = "phi"\n')
    with pytest.raises(InputError, match="is the value of a formula"):
        read(path, tmp_path / "record.toml")


def test_a_formula_of_arithmetic_is_read(tmp_path):
    path = tmp_path / "a.mf4"
    time = np.arange(100) / 1000.0
    with asammdf.MDF(version="4.10") as file:
        signal = asammdf.Signal(time, time, name="phi", unit="rad", conversion={"formula": "2.5*X1 + X1**2"})
        file.append([signal])
        file.save(path, overwrite=True)
    (tmp_path / "record.toml").write_text('format = 1\n[drive]\nchannel = "phi"\n')
    found = read(path, tmp_path / "record.toml").columns["theta_drive_rad"]
    np.testing.assert_allclose(found, 2.5 * time + time**2, rtol=1e-14)


TABLE = ",".join(NAMES) + "\n" + "".join(f"{k},{k},{k}\n" for k in range(50))


@pytest.mark.parametrize(
    "header",
    [
        " " * 100_000,
        "[" * 100_000,
        "rate" + " " * 100_000 + "x",
        "sample rate:" + "\t" * 100_000,
        "(" * 100_000,
        "a " * 50_000,
    ],
    ids=range(6),
)
def test_a_long_header_is_read_in_seconds(header, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(f"{header}\n{TABLE}")
    assert len(read(path).columns["time_s"]) == 50
    path.write_text(f"{header}\n{TABLE.replace(',', '  ')}")
    assert len(read(path).columns["time_s"]) == 50
    propose(path)


def test_many_columns_are_read_in_seconds(tmp_path):
    path = tmp_path / "a.csv"
    names = [*NAMES, *(f"x{k}" for k in range(8000))]
    path.write_text("\n".join([",".join(names), *(",".join([str(row)] * len(names)) for row in range(4))]))
    assert len(read(path).columns) == len(names)


def test_a_line_without_end_is_refused(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text(TABLE + "1" * 3_000_000)
    with pytest.raises(InputError, match="a line has more than 1048576 bytes"):
        read(path)


def test_pipes_and_devices_are_no_records(tmp_path):
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "run").mkdir()
    os.mkfifo(tmp_path / "run" / "signals.parquet")
    for path in (tmp_path / "pipe.csv", tmp_path / "run", "/dev/zero", "/dev/stdin", "a\0b", "a" * 300):
        for reads in (read, recording.read, open_source):
            with pytest.raises(InputError):
                reads(path)


def test_a_unit_behind_a_name_is_found_in_long_names_too():
    assert split_unit("a" + " " * 100_000 + "b")[1] == ""
    assert split_unit("a [" + "[" * 100_000) == ("a [" + "[" * 100_000, "")
    assert split_unit("phi in deg") == ("phi", "deg")


def test_names_that_were_made_unique_stay_so():
    names = unique(["t", "t", "t (2)", "t", "t (2)"])
    assert len(set(names)) == len(names)
    assert names[0] == "t"
    assert names[2] == "t (2)"
