"""Every format, written by its own library, comes back to the last bit; damaged files are told."""

import sys
import warnings

import asammdf
import h5py
import nptdms
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import pyuff
import scipy.io
import scipy.io.wavfile

from gears3d.errors import InputError
from gears3d.measured.readers import open_source, read

ROWS = 4000
TIME = np.arange(ROWS) / 1000.0
DRIVE = 30.0 * TIME + 0.3 * np.sin(20.0 * TIME)
LOOSE = 0.5 * DRIVE + 1e-4 * np.cos(70.0 * TIME)
TEMPERATURE = np.linspace(20.0, 30.0, ROWS // 10)

MAP = """
format = 1
[time]
channel = "t"
unit = "ms"
[drive]
channel = "phi1"
unit = "deg"
[loose]
channel = "n2"
unit = "rad"
sign = -1
"""
SIGNALS = {"t": 1e3 * TIME, "phi1": np.degrees(DRIVE), "n2": -LOOSE}


def write_parquet(path, rows=ROWS):
    pq.write_table(pa.table({name: values[:rows] for name, values in SIGNALS.items()}), path)


def write_csv(path, rows=ROWS):
    rows_of = list(zip(*SIGNALS.values(), strict=True))[:rows]
    lines = [";".join(SIGNALS), *(";".join(repr(float(x)) for x in row) for row in rows_of)]
    path.write_text("\n".join(lines) + "\n")


def write_matlab(path, rows=ROWS):
    scipy.io.savemat(path, {name: values[:rows] for name, values in SIGNALS.items()})


def write_matlab_struct(path, rows=ROWS):
    held = {name: values[:rows].reshape(-1, 1) for name, values in SIGNALS.items()}
    scipy.io.savemat(path, {"rig": held, "note": "run 7", "rate": 1000.0}, do_compression=True)


def write_matlab73(path, rows=ROWS):
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in SIGNALS.items():
            file[name] = values[:rows].reshape(1, -1)
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
        file["#refs#/a"] = np.arange(9)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def write_hdf5(path, rows=ROWS):
    with h5py.File(path, "w") as file:
        group = file.create_group("run/rig")
        for name, values in SIGNALS.items():
            group.create_dataset(name, data=values[:rows], chunks=(min(rows, 512),), compression="gzip")
        file["run/slow/temperature"] = TEMPERATURE


def write_tdms(path, rows=ROWS):
    fast = [nptdms.ChannelObject("rig", name, values[:rows]) for name, values in SIGNALS.items()]
    slow = nptdms.ChannelObject("slow", "temperature", TEMPERATURE, {"wf_increment": 0.01})
    with nptdms.TdmsWriter(path) as file:
        file.write_segment([nptdms.RootObject({"rig": "3"}), *fast, slow])


def write_mdf(path, rows=ROWS):
    with asammdf.MDF(version="4.10") as file:
        kept = [(name, values) for name, values in SIGNALS.items() if name != "t"]
        file.append(
            [asammdf.Signal(values[:rows], 1e3 * TIME[:rows], name=name) for name, values in kept], acq_name="rig"
        )
        file.append([asammdf.Signal(TEMPERATURE, TIME[::10], name="temperature", unit="degC")], acq_name="slow")
        file.save(path.with_suffix(".mf4"), overwrite=True).rename(path)


def write_uff(path, rows=ROWS, **more):
    axes = ("abscissa", "ordinate", "orddenom", "z_axis")
    ends = ("spec_data_type", "len_unit_exp", "force_unit_exp", "temp_unit_exp")
    told = {f"{axis}_{end}": 0 for axis in axes for end in ends} | {f"{axis}_axis_units_lab": "NONE" for axis in axes}
    told |= dict.fromkeys(("ver_num", "load_case_id", "rsp_node", "rsp_dir", "ref_node", "ref_dir", "z_axis_value"), 0)
    told |= dict.fromkeys(("id2", "id3", "id4", "id5", "rsp_ent_name", "ref_ent_name"), "NONE")
    told |= {"type": 58, "binary": 1, "func_type": 1, "ord_data_type": 4, "num_pts": rows, "x": TIME[:rows]}
    told |= {"abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": 0.001}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # pyuff writes binary sets with a file that it leaves open
        for name, values in SIGNALS.items():
            pyuff.UFF(str(path)).write_sets(told | {"id1": name, "data": values[:rows]} | more, "add")


WRITERS = {
    "parquet": write_parquet,
    "csv": write_csv,
    "mat": write_matlab,
    "struct.mat": write_matlab_struct,
    "v73.mat": write_matlab73,
    "h5": write_hdf5,
    "tdms": write_tdms,
    "mf4": write_mdf,
    "uff": write_uff,
}


def test_a_universal_file_of_text_with_uneven_times_has_an_axis_of_its_own(tmp_path):
    path, chart = tmp_path / "run.unv", tmp_path / "record.toml"
    write_uff(path, binary=0, abscissa_spacing=0, ordinate_axis_units_lab="deg")
    chart.write_text('format = 1\n[drive]\nchannel = "phi1"\n')
    found = read(path, chart).columns
    np.testing.assert_allclose(found["time_s"], TIME, rtol=1e-5)
    np.testing.assert_allclose(found["theta_drive_rad"], DRIVE, rtol=1e-10)


def map_for(kind):
    return MAP.replace('channel = "t"', 'channel = "rig/time"') if kind == "mf4" else MAP


@pytest.mark.parametrize("kind", WRITERS)
@pytest.mark.parametrize("ending", ["own", "dat"])
def test_a_file_of_the_formats_own_library_is_read_to_the_last_bit(kind, ending, tmp_path):
    path, chart = tmp_path / f"run.{kind if ending == 'own' else 'dat'}", tmp_path / "record.toml"
    WRITERS[kind](path)
    chart.write_text(map_for(kind))
    found = read(path, chart)
    assert list(found.columns) == ["time_s", "theta_drive_rad", "theta_loose_rad"]
    np.testing.assert_array_equal(found.columns["time_s"], 1e3 * TIME / 1000)
    np.testing.assert_array_equal(found.columns["theta_drive_rad"], np.degrees(DRIVE) * (np.pi / 180))
    np.testing.assert_array_equal(found.columns["theta_loose_rad"], LOOSE)
    assert all(values.dtype == np.float64 for values in found.columns.values())


def outcome(path, chart):
    """Return the channels, or the one kind of error that may be."""
    try:
        return read(path, chart)
    except InputError as error:
        return error


@pytest.mark.parametrize("kind", WRITERS)
def test_every_cut_of_a_file_is_an_input_error_or_a_shorter_record(kind, tmp_path):
    path, chart = tmp_path / f"run.{kind}", tmp_path / "record.toml"
    WRITERS[kind](path)
    chart.write_text(map_for(kind))
    whole = path.read_bytes()
    for part in (0.0, 1e-4, 0.01, 0.2, 0.5, 0.9, 0.999):
        path.write_bytes(whole[: int(part * len(whole))])
        found = outcome(path, chart)
        if isinstance(found, InputError):
            assert all(fault.file and fault.message for fault in found.faults)
        else:
            assert len(found.columns["time_s"]) <= ROWS


@pytest.mark.parametrize("kind", WRITERS)
def test_flipped_bytes_never_make_a_traceback(kind, tmp_path):
    path, chart = tmp_path / f"run.{kind}", tmp_path / "record.toml"
    WRITERS[kind](path, 50)
    chart.write_text(map_for(kind))
    whole = np.frombuffer(path.read_bytes(), np.uint8)
    random = np.random.default_rng(7)
    for _ in range(25):
        broken = whole.copy()
        at = random.integers(0, min(len(broken), 4000), 20)
        broken[at] = random.integers(0, 256, 20)
        path.write_bytes(broken.tobytes())
        assert outcome(path, chart)


@pytest.mark.parametrize("kind", [kind for kind in WRITERS if kind not in ("mf4", "uff")])
def test_no_rows_are_told(kind, tmp_path):
    path, chart = tmp_path / f"run.{kind}", tmp_path / "record.toml"
    try:
        WRITERS[kind](path, 0)
    except ValueError:  # HDF5 has no chunks of nothing
        with h5py.File(path, "w") as file:
            file.update({name: np.zeros(0) for name in SIGNALS})
    chart.write_text(map_for(kind))
    with pytest.raises(InputError, match=r"has no rows|has no samples|is not in the file|cannot be read"):
        read(path, chart)


@pytest.mark.parametrize("kind", ["h5", "tdms", "mf4"])
def test_signals_of_two_rates_are_told_apart(kind, tmp_path):
    path, chart = tmp_path / f"run.{kind}", tmp_path / "record.toml"
    WRITERS[kind](path)
    chart.write_text(map_for(kind).replace('"n2"', '"temperature"'))
    with pytest.raises(InputError, match=r"differ in length: .*phi1 has 4000, .*temperature has 400"):
        read(path, chart)
    chart.write_text(map_for(kind).replace('"phi1"', '"ph1"'))
    with pytest.raises(InputError, match=r"drive.channel: 'ph1' is not in the file \(did you mean 'phi1'"):
        read(path, chart)
    chart.write_text(map_for(kind).replace('"n2"', '"torque sensor"'))
    with pytest.raises(InputError, match=r"it has: .*rig/phi1.*slow/temperature"):
        read(path, chart)
    chart.write_text('group = "rigg"\n' + map_for(kind))
    with pytest.raises(InputError, match="'rigg' is not in the file"):
        read(path, chart)


def test_a_name_in_two_groups_asks_for_the_group(tmp_path):
    path, chart = tmp_path / "run.h5", tmp_path / "record.toml"
    with h5py.File(path, "w") as file:
        for at, group in enumerate(("a", "b")):
            file.update({f"{group}/{name}": values[: ROWS // (1 + at)] for name, values in SIGNALS.items()})
    chart.write_text(MAP)
    with pytest.raises(InputError, match=r"'phi1' is the name of several signals: 'a/phi1', 'b/phi1'"):
        read(path, chart)
    chart.write_text('group = "b"\n' + MAP)
    assert len(read(path, chart).columns["time_s"]) == ROWS // 2


@pytest.mark.parametrize("kind", ["tdms", "mf4", "uff"])
def test_a_declared_clock_is_the_time_when_the_map_names_none(kind, tmp_path):
    path, chart = tmp_path / f"run.{kind}", tmp_path / "record.toml"
    if kind == "tdms":
        told = {"wf_increment": 0.001, "wf_start_offset": 0.5, "unit_string": "rad"}
        with nptdms.TdmsWriter(path) as file:
            file.write_segment([nptdms.ChannelObject("rig", "phi1", DRIVE, told)])
    else:
        WRITERS[kind](path)
    chart.write_text('format = 1\n[drive]\nchannel = "phi1"\nunit = "rad"\n')
    time = read(path, chart).columns["time_s"]
    np.testing.assert_allclose(time, {"tdms": 0.5 + TIME, "mf4": 1e3 * TIME, "uff": TIME}[kind], rtol=0, atol=1e-12)


def test_matrices_and_tables_give_their_columns(tmp_path):
    table = np.stack([TIME, DRIVE, LOOSE], axis=1)
    scipy.io.savemat(tmp_path / "run.mat", {"M": table})
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["M"] = table.T
    for name in ("run.mat", "run.h5"):
        source = open_source(tmp_path / name)
        assert [each.name for each in source.signals] == ["M column 1", "M column 2", "M column 3"]
        np.testing.assert_array_equal(source.load(["M column 3"], 7)["M column 3"], LOOSE[:7])
    rows = np.zeros(5, dtype=[("t", "f8"), ("n", "i4")])
    rows["n"] = np.arange(5)
    with h5py.File(tmp_path / "run.h5", "w") as file:
        file["log"] = rows
    assert open_source(tmp_path / "run.h5").load(["log/n"], None)["log/n"].tolist() == [0, 1, 2, 3, 4]


def test_names_of_the_contract_need_no_map(tmp_path):
    named = {"time_s": TIME, "theta_drive_rad": DRIVE, "theta_loose_rad": LOOSE}
    scipy.io.savemat(tmp_path / "run.mat", named | {"mic_Pa": np.ones(ROWS), "filter": np.ones(7)})
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as file:
        file.write_segment([nptdms.ChannelObject("rig", name, values) for name, values in named.items()])
    for name in ("run.mat", "run.tdms"):
        found = read(tmp_path / name)
        assert set(found.columns) >= set(named)
        assert "filter" not in found.columns
        assert all(np.array_equal(found.columns[key], values) for key, values in named.items())


def test_a_file_without_names_of_the_contract_asks_for_a_map(tmp_path):
    write_tdms(tmp_path / "run.tdms")
    with pytest.raises(InputError, match=r"--guess` propose one; it has: rig/t, rig/phi1, rig/n2"):
        read(tmp_path / "run.tdms")


@pytest.mark.parametrize(
    ("module", "kind", "line"),
    [
        ("h5py", "h5", 'pip install "gears3d[hdf5]"'),
        ("h5py", "v73.mat", 'pip install "gears3d[hdf5]"'),
        ("nptdms", "tdms", 'pip install "gears3d[tdms]"'),
        ("asammdf", "mf4", 'pip install "gears3d[mdf]"'),
        ("pyuff", "uff", 'pip install "gears3d[uff]"'),
    ],
)
def test_a_missing_library_is_named_with_the_line_that_installs_it(module, kind, line, tmp_path, monkeypatch):
    WRITERS[kind](tmp_path / f"run.{kind}")
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError) as caught:
        read(tmp_path / f"run.{kind}")
    assert line in str(caught.value)
    assert "Traceback" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"  \n\n", "is empty"),
        (b"PK\x03\x04rest", "cannot be read as a spreadsheet: File is not a zip file"),
        (b"\x1f\x8b\x08", "is compressed by gzip"),
        (bytes(range(256)) * 8, "is not a text"),
        (b"|CF,2,1,1;|CK,1,3,1,1;" + bytes(99), "is a file of imc .*export it as MDF 4"),
        (b"\x93NUMPY\x01\x00v\x00{'descr'", "is an array of NumPy .*numpy.savetxt"),
        (b"ARROW1\x00\x00", "is an Arrow .*write Parquet"),
        (b"\x80\x04\x95\x0b\x00", "is a pickle of Python"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n", "pointer of Git LFS"),
        (b"<!DOCTYPE html><html><body>404</body></html>", "is a web page"),
        (b"t,a,b\n0,True,False\n1,False,True\n", "cells are True and False .*write 1 and 0"),
        (b"hello world\n", "has no rows"),
    ],
)
def test_what_is_no_record_is_told(content, message, tmp_path):
    (tmp_path / "run.dat").write_bytes(content)
    with pytest.raises(InputError, match=message):
        read(tmp_path / "run.dat")
    with pytest.raises(InputError, match="is not there"):
        read(tmp_path / "none.tdms")
    with pytest.raises(InputError, match=r"has no signals\.parquet"):
        read(tmp_path)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("run.bin", (5012).to_bytes(2, "little") + bytes(500), r"is a file of catman \(version 5012\) .*MATLAB, MDF 4"),
        ("run.json", b'{"time": [0, 1], "drive": [1, 2]}', "is JSON .*CSV or Parquet"),
    ],
)
def test_files_of_other_software_are_named_with_the_way_out(name, content, message, tmp_path):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=message):
        read(tmp_path / name)


@pytest.mark.parametrize("kind", [np.int16, np.float32])
def test_wav_states_its_rate(kind, tmp_path):
    path, chart = tmp_path / "run.wav", tmp_path / "record.toml"
    rate, teeth = 48_000, 40
    time = np.arange(rate) / rate
    angle = 2 * np.pi * (5.0 * time + 0.5 * time**2)
    pulse = np.where((angle * teeth / (2 * np.pi)) % 1.0 < 0.5, 0.5, -0.5)
    scale = 32767 if kind is np.int16 else 1.0
    scipy.io.wavfile.write(path, rate, (scale * np.column_stack([pulse, pulse])).astype(kind))
    chart.write_text('format = 1\n[loose]\nchannel = "channel 2"\ndecode = { kind = "tacho", positions = 40 }\n')
    found = read(path, chart).columns
    turned = np.interp(found["time_s"], time, angle)
    np.testing.assert_allclose(np.diff(found["theta_loose_rad"]), np.diff(turned), atol=2e-3)


def test_rates_and_units_that_formats_state(tmp_path):
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as file:
        about = {"wf_increment": 0.001, "wf_start_offset": 0.25, "unit_string": "deg"}
        file.write_segment([nptdms.ChannelObject("rig", "drive", DRIVE, about)])
    signal = open_source(tmp_path / "a.tdms").find("drive")
    assert (signal.clock, signal.unit) == ((0.25, 0.001), "deg")
    write_uff(tmp_path / "a.uff", ordinate_axis_units_lab="rad")
    signal = open_source(tmp_path / "a.uff").find("phi1")
    assert (signal.clock, signal.unit) == ((0.0, pytest.approx(0.001)), "rad")
    field = pa.field("drive", pa.float64(), metadata={"units": "deg"})
    table = pa.table({"drive": DRIVE}, schema=pa.schema([field], metadata={"sample_rate": "2000"}))
    pq.write_table(table, tmp_path / "a.parquet")
    signal = open_source(tmp_path / "a.parquet").find("drive")
    assert (signal.clock, signal.unit) == ((0.0, 0.0005), "deg")
