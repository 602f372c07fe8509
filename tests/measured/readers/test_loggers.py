"""Text as acquisition systems write it: preambles, dates, epochs, torn rows; the truth is that of the generator."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.measured.checks import examine
from gears3d.measured.readers import open_source, read

STEP = 0.001
ROWS = 400
TIME = STEP * np.arange(ROWS)
ANGLE = 0.25 * np.arange(ROWS)


def loaded(path, text, *names, encoding="utf-8"):
    path.write_bytes(text.encode(encoding))
    source = open_source(path)
    return source, source.load(list(names) or [each.name for each in source.signals if each.numeric], None)


def stamped(form, start=datetime(2026, 3, 31, 23, 59, 59, 800_000)):
    """Return times of the rows as text; over midnight, a month and a year where it begins late."""
    return [form(start + timedelta(milliseconds=k)) for k in range(ROWS)]


FORMS = {
    "ISO with T": lambda t: t.isoformat(timespec="milliseconds"),
    "ISO with a blank": lambda t: t.isoformat(" ", timespec="microseconds"),
    "ISO with Z": lambda t: t.isoformat(timespec="milliseconds") + "Z",
    "ISO with an offset": lambda t: t.isoformat(timespec="milliseconds") + "+02:00",
    "ISO, comma": lambda t: t.isoformat(" ", timespec="milliseconds").replace(".", ","),
    "slashes": lambda t: t.strftime("%Y/%m/%d %H:%M:%S.%f"),
    "day.month.year": lambda t: t.strftime("%d.%m.%Y %H:%M:%S,") + f"{t.microsecond // 1000:03d}",
    "month/day/year": lambda t: t.strftime("%m/%d/%Y %I:%M:%S.%f %p"),
    "clock over midnight": lambda t: t.strftime("%H:%M:%S.%f"),
    "quoted": lambda t: '"' + t.isoformat(" ", timespec="microseconds") + '"',
    "epoch, s": lambda t: f"{(t - datetime(1970, 1, 1)) // timedelta(microseconds=1) // 10**6}.{t.microsecond:06d}",
    "epoch, us": lambda t: str((t - datetime(1970, 1, 1)) // timedelta(microseconds=1)),
    "epoch, ns": lambda t: str((t - datetime(1970, 1, 1)) // timedelta(microseconds=1) * 1000),
}
UNITS = {"epoch, us": 1e6, "epoch, ns": 1e9}


@pytest.mark.parametrize("name", FORMS)
def test_dates_and_epochs_count_from_the_first_reading(name, tmp_path):
    lines = [f"{time};{angle}" for time, angle in zip(stamped(FORMS[name]), ANGLE, strict=True)]
    source, found = loaded(tmp_path / "run.csv", "stamp;phi\n" + "\n".join(lines) + "\n")
    unit = {"epoch, us": "us", "epoch, ns": "ns"}.get(name, "s")
    assert [(each.name, each.unit) for each in source.signals] == [("stamp", unit), ("phi", "")]
    np.testing.assert_allclose(found["stamp"], TIME * UNITS.get(name, 1.0), rtol=0, atol=1e-9 * UNITS.get(name, 1.0))
    np.testing.assert_array_equal(found["phi"], ANGLE)


def test_nanoseconds_of_an_epoch_are_exact_and_a_map_reads_them(tmp_path):
    first = 1_764_000_000_123_456_789
    rows = [f"{first + 37 * k},{k},{2 * k}" for k in range(200)]
    (tmp_path / "run.csv").write_text("t,a,b\n" + "\n".join(rows))
    gears = '[drive]\nchannel = "a"\nunit = "deg"\n[loose]\nchannel = "b"\nunit = "deg"\n'
    chart = f'format = 1\n[time]\nchannel = "t"\n{gears}'
    (tmp_path / "record.toml").write_text(chart)
    time = read(tmp_path / "run.csv", tmp_path / "record.toml").columns["time_s"]
    np.testing.assert_allclose(time, 37e-9 * np.arange(200), rtol=1e-12)


def test_a_counter_of_microseconds_is_no_epoch(tmp_path):
    rows = [f"{1_200_000_000 + 200 * k},{k}" for k in range(50)]
    source, found = loaded(tmp_path / "run.csv", "micros,a\n" + "\n".join(rows))
    assert source.signals[0].unit == ""
    assert found["micros"][0] == 1.2e9


def table(rows=ROWS, mark=","):
    return [f"{TIME[k]:.4f}{mark}{ANGLE[k]}{mark}{0.5 * ANGLE[k]}" for k in range(rows)]


HEAD = "time_s,theta_drive_rad,theta_loose_rad"
DAMAGE = {
    "last row": (lambda rows: [*rows[:-1], rows[-1][:9]], [ROWS - 1], "torn-rows", "row 400"),
    "first row": (lambda rows: ["23,4", *rows], [], None, None),
    "middle row": (lambda rows: [*rows[:99], rows[99][:8], *rows[100:]], [99], "torn-rows", "row 100"),
    "two rows in one": (
        lambda rows: [*rows[:99], rows[99] + rows[100], *rows[101:]],
        [99, 100],
        "torn-rows",
        "row 100",
    ),
    "repeated names": (lambda rows: [*rows[:200], HEAD, *rows[200:]], [], "rows-of-words", "row 201"),
    "a message": (lambda rows: [*rows[:200], "buffer overrun", *rows[200:]], [], "rows-of-words", "row 201"),
}


@pytest.mark.parametrize("name", DAMAGE)
def test_damaged_rows_are_excluded_and_reported(name, tmp_path):
    change, lost, kind, where = DAMAGE[name]
    path = tmp_path / "run.csv"
    path.write_text("\n".join([HEAD, *change(table())]) + "\n")
    found = read(path)
    kept = np.delete(np.arange(ROWS), lost)
    np.testing.assert_allclose(found.columns["time_s"], TIME[kept], atol=1e-12)
    np.testing.assert_array_equal(found.columns["theta_drive_rad"], ANGLE[kept])
    findings = [each for each in examine(found) if each.kind in ("torn-rows", "rows-of-words")]
    assert [each.kind for each in findings] == ([kind] if kind else [])
    assert all(where in each.evidence and not each.fatal for each in findings)


def test_a_damaged_row_keeps_its_place_where_only_a_rate_gives_the_time(tmp_path):
    rows = [line.split(",", 1)[1] for line in table()]
    rows[50] = "1"
    (tmp_path / "run.csv").write_text("a,b\n" + "\n".join(rows))
    chart = 'format = 1\ntime.sample_rate = "1 kHz"\ndrive = { channel = "a", unit = "rad" }\n'
    (tmp_path / "record.toml").write_text(chart)
    found = read(tmp_path / "run.csv", tmp_path / "record.toml")
    np.testing.assert_allclose(found.columns["time_s"], TIME, atol=1e-12)
    assert np.flatnonzero(np.isnan(found.columns["theta_drive_rad"])).tolist() == [50]


def test_too_many_damaged_rows_are_refused(tmp_path):
    rows = table()
    rows[10:60:10] = ["1,2"] * 5
    (tmp_path / "run.csv").write_text("\n".join([HEAD, *rows]))
    with pytest.raises(InputError, match="row 11: has 2 cells, not 3; 5 rows are damaged, at most 1 %"):
        read(tmp_path / "run.csv")


def test_damage_in_a_later_block_of_a_long_file(tmp_path):
    rows = [f"{k * STEP:.3f},{k},{k}" for k in range(60_000)]
    rows[50_000] = "50"
    (tmp_path / "run.csv").write_text("\n".join([HEAD, *rows]))
    found = read(tmp_path / "run.csv")
    np.testing.assert_array_equal(found.columns["theta_drive_rad"], np.delete(np.arange(60_000.0), 50_000))
    assert found.meta["decoded"][0]["text"].endswith("excluded: row 50001")


@pytest.mark.parametrize(
    ("cells", "values"),
    [
        ("1,234.5;0|2,234.5;1", [1234.5, 2234.5]),
        ("1.234,5;0|22.234,5;1", [1234.5, 22234.5]),
        ("1'234.5;0|2'000'234.5;1", [1234.5, 2000234.5]),
        ("998;0|999;1|1,000;2|1,001;3", [998, 999, 1000, 1001]),
        ("0,125;0|0,250;1|1,000;2", [0.125, 0.25, 1.0]),
        ("0,125;0|1;1|1,25;2", [0.125, 1.0, 1.25]),
        ('"1,234.5",0|"2,234.5",1', [1234.5, 2234.5]),
    ],
)
def test_thousands_are_told_from_decimals(cells, values, tmp_path):
    mark = "," if '"' in cells else ";"
    _, found = loaded(tmp_path / "run.csv", f"n{mark}k\n" + cells.replace("|", "\n") + "\n")
    np.testing.assert_allclose(found["n"], values)


LVM = """LabVIEW Measurement
Writer_Version\t2
Reader_Version\t2
Separator\tTab
Decimal_Separator\t{mark}
Multi_Headings\tNo
X_Columns\t{columns}
Time_Pref\tRelative
Operator\tbench
Date\t2026/03/12
Time\t17:18:18{mark}9389457
***End_of_Header***

Channels\t2
Samples\t400\t400
Date\t2026/03/12\t2026/03/12
Time\t17:18:18{mark}9389457\t17:18:18{mark}9389457
Y_Unit_Label\tdeg\tdeg
X_Dimension\tTime\tTime
X0\t0{mark}0000000000000000E+0\t0{mark}0000000000000000E+0
Delta_X\t0{mark}001000\t0{mark}001000
***End_of_Header***
X_Value\tdrive\tloose\tComment
"""


@pytest.mark.parametrize("mark", [".", ","])
@pytest.mark.parametrize("columns", ["No", "One"])
@pytest.mark.parametrize("comment", ["", "\tstart"])
def test_labview_measurement_files(mark, columns, comment, tmp_path):
    rows = [
        f"{TIME[k] if columns == 'One' else ''}\t{ANGLE[k]:.6f}\t{0.5 * ANGLE[k]:.6f}".replace(".", mark)
        for k in range(ROWS)
    ]
    rows[0] += comment
    path = tmp_path / "run.lvm"
    path.write_text(LVM.format(mark=mark, columns=columns) + "\n".join(rows) + "\n")
    source = open_source(path)
    assert source.find("drive").clock == pytest.approx((0.0, STEP))
    chart = 'format = 1\ndrive = { channel = "drive", unit = "deg" }\nloose = { channel = "loose", unit = "deg" }\n'
    (tmp_path / "record.toml").write_text(chart)
    found = read(path, tmp_path / "record.toml").columns
    np.testing.assert_allclose(found["time_s"], TIME, atol=1e-9)
    np.testing.assert_allclose(found["theta_loose_rad"], np.radians(0.5 * ANGLE), atol=1e-7)


PREAMBLES = {
    "imc": ("\ufeffZeit\tphi1\ts\n[s]\t[deg]\n", None),
    "catman": (
        "CATMAN_AP 5\nMessrate\t1000 Hz\nKanäle\t2\n\nZeit  1 - Standardmessrate\tphi1\ns\tdeg\n",
        1000.0,
    ),
    "dewesoft": (
        "Data file info\nFile name: run.dxd\nStart time: 3/12/2026 10:00:00.000\nSample rate: 1000 Hz\n\n"
        '"Time (s)"\t"phi1 (deg)"\n',
        1000.0,
    ),
    "picoscope": ("Time,Channel A\n(ms),(mV)\n\n", None),
    "saleae": ("Time [s],Channel 0\n", None),
    "arduino": ("ets Jun  8 2016 00:22:57\nrst:0x1 (POWERON_RESET)\nready\n", None),
}


@pytest.mark.parametrize("name", PREAMBLES)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "latin-1"])
def test_preambles_of_loggers_are_read_over(name, encoding, tmp_path):
    head, rate = PREAMBLES[name]
    mark = "\t" if "\t" in head else ","
    if encoding == "latin-1":
        head = head.replace("\ufeff", "")
    rows = [f"{TIME[k]:.4f}{mark}{ANGLE[k]}" for k in range(ROWS)]
    source, found = loaded(tmp_path / "run.txt", head + "\n".join(rows) + "\n", encoding=encoding)
    first, second = list(found.values())[:2]
    np.testing.assert_allclose(first, TIME, atol=1e-9)
    np.testing.assert_allclose(second, ANGLE)
    assert source.signals[1].clock == (None if rate is None else (0.0, 1.0 / rate))
