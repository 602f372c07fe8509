"""``record.toml``: units, signs, ratios, raw channels, index marks, several records; every fault by its key."""

import tomllib

import numpy as np
import pytest
import scipy.io
from hypothesis import given, settings
from hypothesis import strategies as st

from gears3d.errors import InputError, UsageError
from gears3d.measured.readers import files_of, read

ROWS = 20000
TIME = np.arange(ROWS) / 10e3
DRIVE = 12.0 * TIME + 0.3 * np.sin(20.0 * TIME)
LOOSE = 0.5 * DRIVE + 1e-3 * np.sin(31.0 * TIME)
OMEGA = 12.0 + 6.0 * np.cos(20.0 * TIME)


def square(angle, lines, shift=0.0):
    return 5.0 * (np.mod(angle * lines / (2 * np.pi) - shift, 1.0) < 0.5)


def record(tmp_path, chart, **signals):
    """Write signals and a map, and read both."""
    scipy.io.savemat(tmp_path / "run.mat", signals)
    (tmp_path / "record.toml").write_text("format = 1\n" + chart)
    return read(tmp_path / "run.mat", tmp_path / "record.toml")


@pytest.mark.parametrize(
    ("unit", "factor", "more"),
    [
        ("rad", 1.0, ""),
        ("deg", 180 / np.pi, ""),
        ("°", 180 / np.pi, ""),
        ("mrad", 1e3, ""),
        ("rev", 1 / (2 * np.pi), ""),
        ("0.36 deg", 180 / np.pi / 0.36, ""),
        ("counts", 4096 / (2 * np.pi), "counts_per_revolution = 4096"),
        ("ticks", 4096 / (2 * np.pi), "counts_per_revolution = 4096"),
    ],
)
def test_angles_of_every_unit(unit, factor, more, tmp_path):
    chart = f'[time]\nchannel="t"\nunit="us"\n[drive]\nchannel="a"\nunit="{unit}"\n{more}\n'
    found = record(tmp_path, chart, t=1e6 * TIME, a=DRIVE * factor).columns
    np.testing.assert_allclose(found["theta_drive_rad"], DRIVE, rtol=1e-14)
    np.testing.assert_allclose(found["time_s"], TIME, rtol=1e-15)


@pytest.mark.parametrize(
    ("unit", "factor"), [("rpm", 30 / np.pi), ("1/min", 30 / np.pi), ("rad/s", 1), ("deg/s", 180 / np.pi)]
)
def test_a_speed_is_integrated_with_second_order(unit, factor, tmp_path):
    chart = f'time.sample_rate = "10 kHz"\n[loose]\nchannel="n"\nunit="{unit}"\nsign=-1\n'
    errors = []
    for every in (1, 2):
        rate = chart.replace("10 kHz", f"{10 / every:g} kHz")
        found = record(tmp_path, rate, n=-OMEGA[::every] * factor).columns
        errors.append(np.abs(found["theta_loose_rad"] - DRIVE[::every]).max())
    assert errors[0] < 1e-5
    assert errors[1] / errors[0] == pytest.approx(4.0, rel=0.02)


def test_sign_ratio_and_counts_of_an_encoder_on_another_shaft(tmp_path):
    chart = """
    time.sample_rate = "10 kHz"
    [drive]
    channel = "a"
    counts_per_revolution = 1000
    ratio = "20/60"
    sign = -1
    """
    found = record(tmp_path, chart, a=-3.0 * DRIVE * 1000 / (2 * np.pi))
    np.testing.assert_allclose(found.columns["theta_drive_rad"], DRIVE, rtol=1e-13)
    told = found.meta["encoders"]
    assert (told["sample_rate_Hz"], told["counts_per_revolution_drive"]) == (1e4, pytest.approx(3000.0))


@pytest.mark.parametrize("time", ['channel="k"\nunit="samples"\nsample_rate="10 kHz"', 'sample_rate="1e4 Hz"'])
def test_samples_become_seconds_by_the_rate(time, tmp_path):
    found = record(tmp_path, f'[time]\n{time}\n[drive]\nchannel="a"\nunit="rad"\n', k=np.arange(ROWS), a=DRIVE)
    np.testing.assert_allclose(found.columns["time_s"], TIME, rtol=1e-15)


def test_a_sawtooth_is_unwrapped_and_a_counter_too(tmp_path):
    chart = 'time.sample_rate="10 kHz"\ndrive={channel="a",unit="deg",wraps_at="1 rev"}\n'
    chart += 'loose={channel="n",counts_per_revolution=4000,decode={kind="counter",bits=12}}'
    counts = np.floor(LOOSE * 4000 / (2 * np.pi))
    found = record(tmp_path, chart, a=np.degrees(DRIVE) % 360, n=counts % 4096)
    np.testing.assert_allclose(found.columns["theta_drive_rad"], DRIVE, atol=1e-12)
    np.testing.assert_allclose(found.columns["theta_loose_rad"], counts * 2 * np.pi / 4000, atol=1e-12)
    assert {note["kind"] for note in found.meta["decoded"]} == {"wraps"}


def test_quadrature_with_index_counts_the_angle_from_the_mark(tmp_path):
    lines, mark = 500, 1.234
    pulse = 5.0 * (np.mod(DRIVE - mark, 2 * np.pi) < 2 * np.pi / lines / 2)
    signals = {"A": square(DRIVE, lines), "B": square(DRIVE, lines, 0.25), "Z": pulse, "phi": LOOSE}
    chart = 'time.sample_rate="10 kHz"\nloose={channel="phi",unit="rad"}\n[drive]\nindex={channel="Z"}\n'
    chart += 'decode={kind="quadrature",a="A",b="B",lines=500}\n'
    found = record(tmp_path, chart, **signals)
    count = 2 * np.pi / (4 * lines)
    assert np.abs(found.columns["theta_drive_rad"] - (DRIVE - mark)).max() < 2 * count
    assert found.meta["zero"] == {"drive": "index", "loose": "arbitrary"}
    assert found.meta["encoders"]["counts_per_revolution_drive"] == 2000
    swapped = record(
        tmp_path, chart.replace('a="A",b="B"', 'a="B",b="A"').replace("index=", "sign=-1\nindex="), **signals
    )
    assert np.abs(swapped.columns["theta_drive_rad"] - (DRIVE - mark)).max() < 2 * count


def test_a_sampled_angle_with_an_index_channel(tmp_path):
    pulse = (np.mod(DRIVE - 2.0, 2 * np.pi) < 0.05).astype(float)
    chart = 'time.sample_rate="10 kHz"\n[drive]\nchannel="a"\nunit="rad"\nindex={channel="z",threshold=0.5}\n'
    found = record(tmp_path, chart, a=DRIVE + 77.0, z=pulse)
    np.testing.assert_allclose(found.columns["theta_drive_rad"], DRIVE - 2.0, atol=2e-3)
    np.testing.assert_allclose(np.diff(found.meta["index_rad"]["drive"]), 2 * np.pi, atol=4e-3)
    with pytest.raises(InputError, match=r"drive.index: z never rises above 9"):
        record(tmp_path, chart.replace("0.5", "9"), a=DRIVE, z=pulse)


def test_toothed_wheels_and_stamps_meet_on_one_axis(tmp_path):
    teeth = square(DRIVE, 60)
    edges = np.arange(0.0, LOOSE[-1], 2 * np.pi / 360)
    stamps = np.round(np.interp(edges, LOOSE, TIME) * 20e6)
    chart = """
    time = { sample_rate = "10 kHz", axis = "loose" }
    drive = { channel = "tacho", decode = { kind = "tacho", positions = 60 } }
    loose = { channel = "ticks", counts_per_revolution = 360, decode = { kind = "stamps", clock = "20 MHz" } }
    """
    found = record(tmp_path, chart, tacho=teeth, ticks=stamps).columns
    drive, loose = (np.interp(found["time_s"], TIME, angle) for angle in (DRIVE, LOOSE))
    assert len(found["time_s"]) > 300
    # of the wheel: an edge is amid two samples (1.8e-3 rad at 18 rad/s), straight lines between teeth (2.2e-3 rad)
    for name, true, slack in (("theta_loose_rad", loose, 1e-6), ("theta_drive_rad", drive, 5e-3)):
        off = found[name] - true
        assert np.ptp(off) < slack, name


def test_stamps_beside_samples_are_read_at_the_samples(tmp_path):
    edges = np.arange(0.0, LOOSE[-1], 2 * np.pi / 360)
    chart = """
    time.sample_rate = "10 kHz"
    drive = { channel = "a", unit = "rad" }
    loose = { channel = "ticks", counts_per_revolution = 360, decode = { kind = "stamps", clock = "20 MHz" } }
    [extra]
    oil_K = { channel = "T", unit = "degC" }
    """
    ticks = np.interp(edges, LOOSE, TIME) * 20e6
    oil = np.linspace(40.0, 50.0, ROWS)
    found = record(tmp_path, chart, a=DRIVE, ticks=ticks, T=oil).columns
    inside = ticks[-1] / 20e6 >= TIME
    np.testing.assert_array_equal(found["theta_drive_rad"], DRIVE[inside])
    speed = np.gradient(LOOSE, TIME)
    sag = np.abs(np.gradient(speed, TIME)) * (2 * np.pi / 360 / speed) ** 2 / 8  # of straight lines between edges
    assert np.abs(found["theta_loose_rad"] - LOOSE[inside]).max() < 1.1 * sag.max()
    np.testing.assert_allclose(found["oil_K"], oil[inside] + 273.15)


def test_a_run_down_by_stamps_is_known_at_its_edges(tmp_path):
    chart = 'loose={channel="s",counts_per_revolution=4,decode={kind="stamps"}}'
    found = record(tmp_path, chart, s=np.array([0.0, 0.1, 0.3, 0.6])).columns
    assert found["time_s"].tolist() == [0.0, 0.1, 0.3, 0.6]
    np.testing.assert_allclose(found["theta_loose_rad"], np.arange(4) * np.pi / 2)


@pytest.mark.parametrize(
    ("chart", "message"),
    [
        ("", r"drive: neither drive nor loose gear has a channel .*it has: t, a"),
        ('[dirve]\nchannel="a"', r"dirve: is not a key of a map \(did you mean 'drive'"),
        ('[drive]\nchannel="a"\nunits="deg"', r"drive.units: is not a key of a map \(did you mean 'unit'"),
        (
            '[loose]\nchannel="a"\ndecode={kind="stamps", unit="s"}',
            r"loose.decode.unit: is not a key of a map \(it stands in \[loose\], next to decode",
        ),
        ('[drive]\nchannel="a"\nsign=2', r"drive.sign: is 2, not 1 or -1"),
        ('[drive]\nchannel="a"\nratio="1/0"', r"drive.ratio: is '1/0'"),
        ('[drive]\nchannel="a"\nratio=-2', r"drive.ratio: is -2, not positive"),
        ("[drive]\nchannel=3", r"drive.channel: is 3, no text"),
        ('drive="a"', r"drive: is 'a', no table"),
        ('[drive]\nchannel="a"', r"drive.unit: is missing: a tells none .*rpm"),
        ('[drive]\nchannel="a"\nunit="furlong"', r"drive.unit: unit 'furlong' is not known|drive.unit: .*length"),
        ('[drive]\nchannel="a"\nunit="Hz"', r"drive.unit: .*frequency"),
        ('[drive]\nchannel="a"\nunit="counts"', r"drive.unit: .*counts_per_revolution"),
        ('[drive]\nchannel="a"\nunit="rpm"\nwraps_at="1 rev"', r"drive.wraps_at: is given for a speed"),
        ('[drive]\nchannel="aa"\nunit="rad"', r"drive.channel: 'aa' is not in the file"),
        ('[drive]\nchannel="a"\nunit="rad"\n[time]\nunit="deg"\nchannel="t"', r"time.unit: .*angle, not a time"),
        ('[drive]\nchannel="a"\nunit="rad"\n[time]\nchannel="t"', r"time.unit: is missing: t tells none"),
        ('[drive]\nchannel="a"\nunit="rad"\n[time]\nsample_rate="5"', r"time.sample_rate: '5' has no unit"),
        ('[drive]\nchannel="a"\nunit="rad"\n[time]\nsample_rate="-5 Hz"', r"time.sample_rate: is '-5 Hz'"),
        ('[drive]\nchannel="a"\nunit="rad"', r"time: is missing, and the file declares none"),
        (
            '[drive]\nchannel="a"\ndecode={kind="quadratur"}',
            r"drive.decode.kind: is 'quadratur' \(did you mean 'quadrature'",
        ),
        ('[drive]\nchannel="a"\ndecode={kind="tacho"}', r"drive.decode.positions: is missing"),
        (
            '[drive]\nchannel="a"\ndecode={kind="tacho",positons=3}',
            r"drive.decode.positons: .*did you mean 'positions'",
        ),
        (
            'time.sample_rate="1 kHz"\n[drive]\nchannel="a"\ndecode={kind="counter",bits=8}',
            r"counts_per_revolution: is missing",
        ),
        (
            '[drive]\nchannel="a"\nunit="rad"\n[time]\nchannel="t"\nunit="s"\nsample_rate="1 Hz"',
            r"time.sample_rate: is 1 Hz, t in s makes \d+ Hz \(leave out time.sample_rate or time.channel",
        ),
        (
            '[drive]\nchannel="a"\nunit="rad"\n[time]\nchannel="t"\nunit="s"\nfrom="99 s"',
            r"time.from: is '99 s': no row lies there \(the record goes from",
        ),
        (
            '[drive]\nchannel="a"\nunit="rad"\n[time]\nchannel="t"\nunit="s"\nfrom="2 s"\nto="1 s"',
            r"time.from: is '2 s' and time.to '1 s': nothing lies between",
        ),
        ('file="x"\n[[record]]\nfile="y"', r"file: stands in addition to \[\[record\]\]"),
        ('[[record]]\ngroup="y"', r"record\[0\].file: is missing"),
        ("record=[1]", r"record: is not a list of tables"),
        ("[drive", r"is not TOML"),
    ],
)
def test_every_fault_of_a_map_names_its_key(chart, message, tmp_path):
    timed = "" if "time" in chart + message or not chart.startswith("[drive]") else 'time.sample_rate="1 kHz"\n'
    with pytest.raises(InputError, match=message):
        record(tmp_path, timed + chart, t=TIME, a=DRIVE)


def test_format_must_be_told_and_known(tmp_path):
    chart = tmp_path / "record.toml"
    scipy.io.savemat(tmp_path / "run.mat", {"a": DRIVE})
    for text, message in (("", "format: is missing"), ("format = 2", "format: is 2, not 1")):
        chart.write_text(text)
        with pytest.raises(InputError, match=message):
            read(tmp_path / "run.mat", chart)
    with pytest.raises(InputError, match=r"none.toml: is not there .*--guess proposes"):
        read(tmp_path / "run.mat", tmp_path / "none.toml")


SEVERAL = """
format = 1
title = "bench 3"
time.sample_rate = "10 kHz"
[drive]
channel = "a"
unit = "rad"
[condition]
drag.torque = "0.3 N m"
[[record]]
file = "one.mat"
condition.motion.mean = "90 rpm"
[[record]]
file = "two.mat"
drive = { unit = "deg", sign = -1 }
[record.condition]
"motion.mean" = "180 rpm"
effect = [{ kind = "oil_film" }]
impact.restitution = { value = 0.3, uncertainty = "5 %" }
"""


def test_one_map_for_several_records(tmp_path):
    chart = tmp_path / "record.toml"
    chart.write_text(SEVERAL)
    for name in ("one", "two", "three"):
        scipy.io.savemat(tmp_path / f"{name}.mat", {"a": DRIVE})
    pairs = files_of([chart])
    assert [file.name for file, _ in pairs] == ["one.mat", "two.mat"]
    assert files_of([], chart) == pairs
    one, two = (read(*pair) for pair in pairs)
    assert one.condition == {"drag.torque": "0.3 N m", "motion.mean": "90 rpm"}
    assert two.condition == {
        "drag.torque": "0.3 N m",
        "motion.mean": "180 rpm",
        "effect": [{"kind": "oil_film"}],
        "impact.restitution": {"value": 0.3, "uncertainty": "5 %"},
    }
    np.testing.assert_allclose(two.columns["theta_drive_rad"], -np.radians(one.columns["theta_drive_rad"]))
    assert one.meta["title"] == "bench 3"
    with pytest.raises(InputError, match=r"three.mat is not among the files"):
        read(tmp_path / "three.mat", chart)
    with pytest.raises(InputError, match=r"record: names several files: one.mat, two.mat"):
        read(chart)
    with pytest.raises(UsageError, match="leave --map out"):
        files_of([chart], chart)
    chart.write_text(SEVERAL[: SEVERAL.index("[[record]]")])
    with pytest.raises(InputError, match=r"file: is missing"):
        files_of([chart])
    assert read(tmp_path / "three.mat", chart).condition == {"drag.torque": "0.3 N m"}


LEAVES = st.none() | st.booleans() | st.integers(-5, 5) | st.floats(allow_nan=True) | st.text(max_size=8)
KEYS = st.sampled_from(
    [
        "format",
        "file",
        "title",
        "group",
        "time",
        "drive",
        "loose",
        "extra",
        "condition",
        "record",
        "channel",
        "unit",
        "sample_rate",
        "sign",
        "ratio",
        "wraps_at",
        "zero",
        "index",
        "decode",
        "kind",
        "a",
        "b",
        "lines",
        "positions",
        "bits",
        "counts_per_revolution",
        "threshold",
        "axis",
        "clock",
        "value",
    ]
) | st.text(max_size=5)
VALUES = LEAVES | st.sampled_from(
    ["a", "t", "deg", "rpm", "counts", "1 kHz", "quadrature", "tacho", "stamps", "counter", "1/2"]
)
TREES = st.recursive(
    VALUES, lambda inner: st.dictionaries(KEYS, inner, max_size=4) | st.lists(inner, max_size=3), max_leaves=12
)
GOOD = {
    "format": 1,
    "time": {"sample_rate": "1 kHz"},
    "drive": {"channel": "a", "unit": "deg"},
    "loose": {"channel": "b", "decode": {"kind": "tacho", "positions": 3}},
}


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    folder = tmp_path_factory.mktemp("maps")
    scipy.io.savemat(folder / "run.mat", {"t": TIME[:300], "a": DRIVE[:300], "b": square(40 * TIME[:300], 1)})
    return folder


def attempt(folder, text):
    (folder / "record.toml").write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "replace"))
    try:
        return read(folder / "run.mat", folder / "record.toml")
    except (InputError, UsageError) as error:
        return error


@settings(max_examples=150, deadline=None)
@given(change=st.dictionaries(KEYS, TREES, max_size=3), where=st.sampled_from(["", "time", "drive", "loose"]))
def test_no_map_makes_anything_but_an_input_error(small, change, where):
    import copy

    import tomlkit

    document = copy.deepcopy(GOOD)
    (document[where] if where else document).update(change)
    try:
        text = tomlkit.dumps(document)
        tomllib.loads(text)
    except Exception:
        return
    assert attempt(small, text) is not None


@settings(max_examples=150, deadline=None)
@given(st.binary(max_size=200) | st.text(max_size=200))
def test_no_bytes_make_anything_but_an_input_error(small, text):
    assert isinstance(attempt(small, text), InputError)
    assert (
        attempt(small, b"format = 1\n" + (text if isinstance(text, bytes) else text.encode("utf-8", "replace")))
        is not None
    )


def test_the_maps_of_the_documentation_are_maps():
    import re
    from pathlib import Path

    from gears3d.measured.readers.maps import RecordMap

    blocks = re.findall(r"```toml\n(.*?)```", Path("docs/howto/record-map.md").read_text(encoding="utf-8"), re.DOTALL)
    assert len(blocks) == 2
    for block in blocks:
        document = tomllib.loads(block)
        for record in document.pop("record", [{}]):
            RecordMap.model_validate({**document, "file": "a", **record})
