"""MATLAB and HDF5 as acquisition systems export them: the sampling, the names and the units that they state."""

import h5py
import numpy as np
import pytest
import scipy.io

from gears3d.errors import GearsError, InputError
from gears3d.measured.readers import open_source, propose, read

ROWS = 2000
STEP = 1.0 / 25_600.0
TIME = STEP * np.arange(ROWS)
DRIVE = 30.0 * TIME + 0.01 * np.sin(300.0 * TIME)
LOOSE = 0.5 * DRIVE
GEARS = 'format = 1\ndrive = {{ channel = "{}" }}\nloose = {{ channel = "{}" }}\n'


def chars(text):
    return np.array([[ord(each)] for each in text], dtype=np.uint16)


def write73(path, tree):
    """Write a structure as MATLAB 7.3 does: groups, characters as uint16, cells as references."""

    def put(file, group, name, value):
        if isinstance(value, dict):
            own = group.create_group(name)
            own.attrs["MATLAB_class"] = np.bytes_("struct")
            for key, one in value.items():
                put(file, own, key, one)
            return
        kind = "double"
        if isinstance(value, str):
            kind, data = "char", chars(value)
        elif isinstance(value, list):
            for k, one in enumerate(value):
                put(file, file.require_group("#refs#"), f"{name}{k}", one)
            kind = "cell"
            data = np.array([[file[f"#refs#/{name}{k}"].ref] for k in range(len(value))], dtype=h5py.ref_dtype)
        else:
            data = np.atleast_2d(np.asarray(value, dtype=float)).T if np.ndim(value) else np.array([[float(value)]])
            data = data.T if np.ndim(value) == 1 else data
        group[name] = data
        group[name].attrs["MATLAB_class"] = np.bytes_(kind)

    with h5py.File(path, "w", userblock_size=512) as file:
        for key, value in tree.items():
            put(file, file, key, value)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def write5(path, tree):
    def cells(node):
        if isinstance(node, dict):
            return {key: cells(value) for key, value in node.items()}
        return np.array(node, dtype=object) if isinstance(node, list) else node

    scipy.io.savemat(path, cells(tree), do_compression=True)


WRITERS = {"v5": write5, "v7.3": write73}


def quantity(label, factor):
    about = {"label": label, "unit_transformation": {"factor": factor, "offset": 0.0, "log_reference": 1.0}}
    return {**about, "quantity_terms": {"angle": 1.0}}


def function_of(values, label="deg", factor=np.pi / 180, name="drive:+RZ", start=0.5, axis="s"):
    steps = {"start_value": start, "increment": STEP, "number_of_values": float(len(values))}
    return {
        "x_values": {**steps, "quantity": quantity(axis, 1.0)},
        "y_values": {"values": values, "quantity": quantity(label, factor)},
        "function_record": {"name": name, "type": "Signal"},
    }


@pytest.mark.parametrize("write", WRITERS.values(), ids=WRITERS)
def test_testlab_states_its_sampling_its_names_and_its_units(write, tmp_path):
    path, chart = tmp_path / "run.mat", tmp_path / "record.toml"
    write(path, {"Signal_0": function_of(np.degrees(DRIVE)), "Signal_1": function_of(np.degrees(LOOSE), name="loose")})
    chart.write_text(GEARS.format("drive:+RZ", "loose"))
    found = read(path, chart).columns
    np.testing.assert_allclose(found["time_s"], 0.5 + TIME, rtol=1e-12)
    np.testing.assert_allclose(found["theta_drive_rad"], DRIVE, atol=1e-12)
    np.testing.assert_allclose(found["theta_loose_rad"], LOOSE, atol=1e-12)


@pytest.mark.parametrize("write", WRITERS.values(), ids=WRITERS)
def test_testlab_with_several_channels_in_one_function(write, tmp_path):
    path, chart = tmp_path / "run.mat", tmp_path / "record.toml"
    values = np.column_stack([np.degrees(DRIVE), np.degrees(LOOSE)])
    write(path, {"Signal": function_of(values, name=["1:drive", "2:loose"])})
    chart.write_text(GEARS.format("1:drive", "2:loose"))
    found = read(path, chart).columns
    np.testing.assert_allclose(found["theta_loose_rad"], LOOSE, atol=1e-12)
    assert np.median(np.diff(found["time_s"])) == pytest.approx(STEP, rel=1e-9)


def test_the_factor_of_testlab_counts_where_the_label_contradicts_it(tmp_path):
    path, chart = tmp_path / "run.mat", tmp_path / "record.toml"
    write5(path, {"A": function_of(100.0 * DRIVE, "rad", 0.01), "B": function_of(LOOSE, "rad", 1.0, "b")})
    chart.write_text(GEARS.format("drive:+RZ", "b"))
    np.testing.assert_allclose(read(path, chart).columns["theta_drive_rad"], DRIVE, atol=1e-12)


def test_a_spectrum_of_testlab_has_no_time(tmp_path):
    write5(tmp_path / "run.mat", {"FRF": function_of(DRIVE, axis="Hz")})
    (signal,) = open_source(tmp_path / "run.mat").signals
    assert (signal.clock, signal.axis) == (None, "")


def test_testlab_needs_no_rig_to_be_proposed(tmp_path):
    path = tmp_path / "run.mat"
    write5(path, {"S": function_of(np.column_stack([np.degrees(DRIVE), np.degrees(LOOSE)]), name=["drive", "loose"])})
    text = propose(path, None, tmp_path)
    assert "declared by the file: a sample every 3.90625e-05 s" in text
    assert "[condition]" not in text


EXPORTS = {
    "catman": {
        "File_Header": {"SampleFrequency": "25600", "NumberOfChannels": "2"},
        "Channel_1_Header": {"SignalName": "drive", "Unit": "deg"},
        "Channel_1_Data": np.degrees(DRIVE),
        "Channel_2_Header": {"SignalName": "loose", "Unit": "rad"},
        "Channel_2_Data": LOOSE,
    },
    "dewesoft": {
        "Data1_drive": np.degrees(DRIVE),
        "Data1_time_drive": TIME,
        "Data1_loose": LOOSE,
        "Sample_rate": 25600.0,
    },
    "fs beside the channels": {"fs": 25600.0, "drive": np.degrees(DRIVE), "loose": LOOSE},
    "structure with dt": {"rig": {"dt": STEP, "drive": np.degrees(DRIVE), "loose": LOOSE}},
    "timeseries": {
        "drive": {"Time": TIME, "Data": np.degrees(DRIVE), "Name": "drive"},
        "loose": {"Time": TIME, "Data": LOOSE, "Name": "loose"},
    },
}
NAMES = {"dewesoft": ("Data1_drive", "Data1_loose"), "timeseries": ("drive/Data", "loose/Data")}


@pytest.mark.parametrize("write", WRITERS.values(), ids=WRITERS)
@pytest.mark.parametrize("name", EXPORTS)
def test_exports_state_their_sampling(name, write, tmp_path):
    path, chart = tmp_path / "run.mat", tmp_path / "record.toml"
    write(path, EXPORTS[name])
    drive, loose = NAMES.get(name, ("drive", "loose"))
    units = "" if name == "catman" else '[drive]\nchannel = "{}"\nunit = "deg"\n[loose]\nchannel = "{}"\nunit = "rad"\n'
    chart.write_text("format = 1\n" + units.format(drive, loose) if units else GEARS.format(drive, loose))
    found = read(path, chart).columns
    np.testing.assert_allclose(found["time_s"], TIME, atol=1e-12)
    np.testing.assert_allclose(found["theta_drive_rad"], DRIVE, atol=1e-12)
    np.testing.assert_allclose(found["theta_loose_rad"], LOOSE, atol=1e-12)


def test_arrays_of_structures_are_numbered(tmp_path):
    path = tmp_path / "run.mat"
    array = np.zeros(2, dtype=[("phi", "O"), ("unit", "O")])
    array["phi"], array["unit"] = [DRIVE, LOOSE], ["rad", "rad"]
    scipy.io.savemat(path, {"gear": array})
    source = open_source(path)
    assert [(each.name, each.unit) for each in source.signals] == [("gear(1)/phi", "rad"), ("gear(2)/phi", "rad")]
    assert source.find("gear(2).phi").name == "gear(2)/phi"


@pytest.mark.parametrize("key", ["sample_rate", "fs", "Sampling_Frequency", "dt"])
def test_attributes_of_hdf5_state_the_sampling(key, tmp_path):
    path = tmp_path / "run.h5"
    with h5py.File(path, "w") as file:
        file["rig/drive"] = DRIVE
        file["rig/loose"] = LOOSE
        value = STEP if key == "dt" else 25_600.0
        (file["rig"] if key == "fs" else file["rig/drive"]).attrs[key] = value
        file["rig/drive"].attrs["units"] = "rad"
    signal = open_source(path).find("drive")
    assert (signal.unit, signal.clock) == ("rad", pytest.approx((0.0, STEP)))


def test_tables_of_matlab_name_the_library_or_the_line_that_saves_plain_numbers(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "matio", None)
    path = tmp_path / "run.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["TT"] = np.zeros((1, 6), np.uint32)
        file["TT"].attrs["MATLAB_class"] = np.bytes_("timetable")
        file["TT"].attrs["MATLAB_object_decode"] = np.int32(3)
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    with pytest.raises(
        GearsError, match=r"needs mat-io.*gears3d\[matlab\].*table2struct\(T,'ToScalar',true\)"
    ) as caught:
        open_source(path)
    assert "\n" not in str(caught.value)


@pytest.mark.filterwarnings("ignore")
def test_timetables_come_back_by_mat_io(tmp_path):
    matio = pytest.importorskip("matio")
    pandas = pytest.importorskip("pandas")
    path, chart = tmp_path / "run.mat", tmp_path / "record.toml"
    index = pandas.to_timedelta(np.arange(ROWS) * 40_000, unit="ns").rename("Time")
    table = pandas.DataFrame({"drive": np.degrees(DRIVE), "loose": np.degrees(LOOSE)}, index=index)
    matio.save_to_mat(str(path), {"TT": table})
    chart.write_text('format = 1\n[drive]\nchannel = "drive"\nunit = "deg"\n[loose]\nchannel = "loose"\nunit = "deg"\n')
    found = read(path, chart).columns
    np.testing.assert_allclose(found["time_s"], 4e-5 * np.arange(ROWS), rtol=1e-12)
    np.testing.assert_allclose(found["theta_drive_rad"], DRIVE, atol=1e-12)


def test_damaged_objects_are_one_line(tmp_path):
    matio = pytest.importorskip("matio")
    pandas = pytest.importorskip("pandas")
    matio.save_to_mat(str(tmp_path / "a.mat"), {"T": pandas.DataFrame({"a": np.arange(50.0)})})
    data = (tmp_path / "a.mat").read_bytes()
    told = []
    for cut in range(200, len(data), 97):
        (tmp_path / "b.mat").write_bytes(data[:cut])
        try:
            open_source(tmp_path / "b.mat")
        except InputError as error:
            told.append(str(error))
    assert told
    assert all(len(each.splitlines()) == 1 for each in told)


@pytest.mark.parametrize("element", [(1, 4), (5, 4)])
def test_matrices_that_end_before_their_numbers_end_no_process(element, tmp_path):
    path = tmp_path / "run.mat"
    scipy.io.savemat(path, {"S": {"label": "s", "a": {"b": np.arange(3.0)}}})
    data = bytearray(path.read_bytes())
    at = data.find(np.array([4, 0], "<u4").tobytes()) + 24  # behind class and size of the characters: their name
    data[at : at + 8] = np.array(element, "<u4").tobytes()
    path.write_bytes(data)
    with pytest.raises(InputError, match="cannot be read as MATLAB"):
        open_source(path)


def test_timeseries_are_proposed_by_the_names_of_their_structures(tmp_path):
    angle = 2 * np.pi * 3 * np.arange(500) / 1000
    made = {name: {"Time": np.arange(500) / 1000, "Data": k * angle, "DataInfo": {"Units": "rad"}}
            for name, k in (("loose", 2.0), ("drive", 3.0))}  # fmt: skip
    scipy.io.savemat(tmp_path / "run.mat", made)
    text = propose(tmp_path / "run.mat", None, tmp_path)
    assert '[drive]\nchannel = "drive/Data"\nunit = "rad"' in text
    assert '[loose]\nchannel = "loose/Data"\nunit = "rad"' in text
