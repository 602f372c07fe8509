import math

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gears3d.errors import InputError, UsageError
from gears3d.recording import IMPACT_UNITS, SIGNAL_UNITS, Recording, read

HEADER = "time_s,theta_drive_rad,theta_loose_rad"
FINITE = st.floats(allow_nan=False, allow_infinity=False)


def columns(values):
    return hnp.arrays(np.float64, values, elements=FINITE)


@st.composite
def recordings(draw):
    n, k = draw(st.integers(0, 30)), draw(st.integers(0, 10))
    time = np.cumsum(draw(hnp.arrays(np.float64, n, elements=st.floats(1e-6, 1.0))))
    signals = {name: draw(columns(n)) for name in SIGNAL_UNITS} | {"time_s": time}
    signals["mic_Pa"] = draw(hnp.arrays(np.float64, n, elements=st.floats()))
    hits = {name: draw(columns(k)) for name in IMPACT_UNITS}
    hits["time_s"] = np.sort(hits["time_s"])
    hits["flank"] = draw(hnp.arrays(np.int8, k, elements=st.integers(0, 1)))
    for gear in ("drive", "loose"):
        hits[f"tooth_{gear}"] = draw(hnp.arrays(np.int32, k, elements=st.integers(0, 90)))
    meta = draw(st.dictionaries(st.text(), st.none() | st.booleans() | st.text() | st.floats(allow_nan=False)))
    return Recording(signals, hits, meta)


@settings(max_examples=60, deadline=None)
@given(record=recordings())
def test_parquet_keeps_every_bit(record, tmp_path_factory):
    folder = tmp_path_factory.mktemp("record")
    back = read(record.write(folder))
    for mine, theirs in ((record.signals, back.signals), (record.impacts, back.impacts)):
        for name, values in mine.items():
            assert values.tobytes() == theirs[name].tobytes(), name
            assert values.dtype == theirs[name].dtype
    assert back == record
    assert sorted(path.name for path in folder.iterdir()) == ["impacts.parquet", "signals.parquet"]


def example(**meta):
    time = np.linspace(0, 1, 11)
    hits = {"time_s": [0.2, 0.5], "flank": [0, 1], "velocity_m_s": [-0.02, 0.03]}
    return Recording({"time_s": time, "theta_drive_rad": time, "theta_loose_rad": time}, hits, meta)


def measured():
    return Recording(example().signals)


def test_infinite_and_missing_numbers_in_meta_survive_and_are_json_to_others(tmp_path):
    example(lyapunov_1_s=-math.inf, x=[math.inf], y={"z": math.nan}).write(tmp_path)
    meta = read(tmp_path).meta
    assert meta["lyapunov_1_s"] == -math.inf
    assert meta["x"] == [math.inf]
    assert math.isnan(meta["y"]["z"])
    text = pq.read_schema(tmp_path / "signals.parquet").metadata[b"gears3d"].decode()
    assert "Infinity" not in text
    assert "NaN" not in text


def test_units_and_text_flanks_stand_in_the_files(tmp_path):
    example().write(tmp_path)
    schema = pq.read_schema(tmp_path / "impacts.parquet")
    units = {field.name: field.metadata[b"unit"].decode() for field in schema}
    assert units == IMPACT_UNITS
    assert pa.types.is_dictionary(schema.field("flank").type)
    assert pq.read_table(tmp_path / "impacts.parquet")["flank"].to_pylist() == ["active", "reverse"]
    assert pq.ParquetFile(tmp_path / "signals.parquet").metadata.row_group(0).column(0).compression == "ZSTD"


def test_a_record_of_one_file_goes_there_and_back(tmp_path):
    for name in ("a.parquet", "a.csv"):
        assert read(measured().write(tmp_path / name)) == measured()
    with pytest.raises(UsageError, match="one file cannot hold the impacts"):
        example().write(tmp_path / "b.csv")
    assert not (tmp_path / "b.csv").exists()


def test_signals_parquet_named_alone_brings_its_impacts(tmp_path):
    assert read(example().write(tmp_path) / "signals.parquet") == example()


def test_a_failed_write_leaves_what_was_there(tmp_path, monkeypatch):
    example().write(tmp_path)

    def full(*args, **options):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(pq.ParquetWriter, "write_table", full)
    with pytest.raises(InputError, match="No space left on device"):
        example(model="other").write(tmp_path)
    monkeypatch.undo()
    assert read(tmp_path) == example()
    assert len(list(tmp_path.iterdir())) == 2


def test_a_place_that_cannot_be_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"file/run/signals.parquet: cannot be written: Not a directory"):
        example().write(tmp_path / "file" / "run")
    with pytest.raises(InputError, match=r"file/record.csv: cannot be written"):
        measured().write(tmp_path / "file" / "record.csv")


def test_summary_tells_what_bare_tables_do_not(tmp_path):
    for name, table in (("signals", example().signals), ("impacts", example().impacts)):
        pq.write_table(pa.table(dict(table)), tmp_path / f"{name}.parquet")
    (tmp_path / "summary.json").write_text('{"title": "fig. 5", "model": "rigid", "regime": "contact"}')
    assert read(tmp_path) == example(title="fig. 5", model="rigid")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "cannot be read as CSV: is empty"),
        (HEADER + "\n", "has no rows"),
        (HEADER + "\n0,0,0\n1,1\n", "row 2: has 2 cells, not 3"),
        (HEADER + "\n0,0,0\n1,1,x\n", "theta_loose_rad, row 2: is 'x'"),
        (HEADER + "\n0,0,0\n1,,1\n", r"signals.theta_drive_rad\[1\]: is nan"),
        (HEADER + "\n0,0,0\n0,1,1\n", r"signals.time_s\[1\]: is 0.0 s after 0.0 s"),
        (
            HEADER.replace(",", ";") + "\n0,5;0;0\n1.5;0;0\n2,5;0;0\n",
            r"time_s, row 2: is '1.5' \(write plain numbers with a decimal comma",
        ),
        (HEADER + "\n0,2020-01-01 00:00,0\n", "theta_drive_rad, row 1: is '2020-01-01 00:00'"),
        (
            "time_s,theta_drive_rad,theta_lose_rad\n0,0,0\n",
            r"is missing \(rename 'theta_lose_rad'\?\)",
        ),
        (HEADER + ",time_s\n0,0,0,0\n", "time_s: is the name of several columns"),
        (HEADER + ",mic_Pa\n0,0,0,1\n1,0,0,a\n", "mic_Pa, row 2: is 'a'"),
    ],
)
def test_malformed_csv_is_told_by_file_column_and_row(text, message, tmp_path):
    path = tmp_path / "record.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read(path)
    assert all(str(path) in str(fault) for fault in caught.value.faults)


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_csv_from_elsewhere_is_understood(separator, tmp_path):
    path = tmp_path / "record.csv"
    text = "\ufeff" + HEADER + ", mic_Pa\r\n0,0,0,\r\n\r\n1, 2 ,3e0,4\r\n"
    path.write_text(text.replace(",", separator), encoding="utf-8")
    expected = {"time_s": [0, 1], "theta_drive_rad": [0, 2], "theta_loose_rad": [0, 3], "mic_Pa": [np.nan, 4]}
    assert read(path) == Recording(expected)


def test_malformed_parquet_is_told(tmp_path):
    path = tmp_path / "record.parquet"
    with pytest.raises(InputError, match=r"record.parquet: is not there"):
        read(path)
    path.write_bytes(b"PAR1 no more")
    with pytest.raises(InputError, match=r"record.parquet: cannot be read as Parquet"):
        read(path)
    pq.write_table(pa.table({"time_s": [0.0, 1.0], "theta_drive_rad": ["a", None], "theta_loose_rad": [0, 1]}), path)
    with pytest.raises(InputError, match=r"record.parquet: signals.theta_drive_rad: holds 'a', no number"):
        read(path)
    pq.write_table(pa.table({"time_s": [0.0, None], "theta_drive_rad": [0, 1], "theta_loose_rad": [0, 1]}), path)
    with pytest.raises(InputError, match=r"record.parquet: signals.time_s\[1\]: is nan"):
        read(path)


def test_a_folder_without_a_recording_and_bad_impacts_are_told(tmp_path):
    with pytest.raises(InputError, match=r"has no signals.parquet"):
        read(tmp_path)
    example().write(tmp_path)
    pq.write_table(pa.table({"time_s": [0.1], "flank": ["left"], "velocity_m_s": [0.1]}), tmp_path / "impacts.parquet")
    with pytest.raises(InputError, match=r"impacts.parquet: impacts.flank\[0\]: is 'left'"):
        read(tmp_path)
