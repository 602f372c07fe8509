import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gears3d.errors import InputError, MissingExtraError, UsageError
from gears3d.recording import IMPACT_UNITS, SIGNAL_UNITS, Recording, unit_of


def signals(n=5):
    time = np.arange(n) / 10
    return {"time_s": time, "theta_drive_rad": 3 * time, "theta_loose_rad": 3 * time + 0.01}


def impacts(n=3):
    return {
        "time_s": np.arange(n) / 10,
        "flank": np.arange(n) % 2,
        "velocity_m_s": np.where(np.arange(n) % 2, 0.03, -0.03),
    }


def test_the_contracts_columns_have_units_and_come_first():
    table = Recording({"zeta_m": np.zeros(5), **dict.fromkeys(SIGNAL_UNITS, np.zeros(5)), **signals()}).signals
    assert list(table) == [*SIGNAL_UNITS, "zeta_m"]
    assert {name: unit_of(name) for name in SIGNAL_UNITS} == SIGNAL_UNITS
    assert unit_of("velocity_m_s") == "m/s"
    assert all(values.dtype == np.float64 for values in table.values())


def test_what_is_not_known_of_impacts_is_nan_and_tooth_nought():
    table = Recording(signals(), impacts()).impacts
    assert list(table) == list(IMPACT_UNITS)
    assert table["flank"].dtype == np.int8
    assert table["tooth_drive"].tolist() == [0, 0, 0]
    assert np.isnan(table["flight_height_m"]).all()


def test_flanks_are_taken_as_text_and_as_codes():
    text = Recording(signals(), {**impacts(), "flank": ["active", "reverse", "active"]})
    assert text == Recording(signals(), impacts())


def test_a_recording_cannot_be_changed_in_place():
    record = Recording(signals(), impacts())
    with pytest.raises(ValueError, match="read-only"):
        record.signals["time_s"][0] = 7.0
    with pytest.raises(AttributeError):
        record.meta = {}


def test_equality_sees_every_part():
    base = Recording(signals(), impacts(), {"model": "rigid"})
    assert base == Recording(signals(), impacts(), {"model": "rigid"})
    assert base != Recording(signals(), impacts(), {"model": "bullet"})
    assert base != Recording(signals(), impacts(2), {"model": "rigid"})
    assert base != Recording({**signals(), "mic_Pa": np.zeros(5)}, impacts(), {"model": "rigid"})
    nudged = impacts()["velocity_m_s"] * (1 + 2e-16)
    assert base != Recording(signals(), {**impacts(), "velocity_m_s": nudged}, {"model": "rigid"})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time_s": None}, "signals.time_s: is missing"),
        ({"theta_loose_rad": [1.0, 2.0]}, "signals.theta_loose_rad: has 2 rows, time_s has 5"),
        ({"theta_loose_rad": [0, 1, np.nan, 3, np.inf]}, r"theta_loose_rad\[2\]: is nan, and 1 more rows"),
        ({"time_s": [0, 1, 1, 2, 3]}, r"signals.time_s\[2\]: is 1.0 s after 1.0 s"),
        ({"mic_Pa": list("abcde")}, "mic_Pa: holds .*'a'.*no number"),
        ({"mic_Pa": np.zeros((5, 2))}, r"mic_Pa: has shape \(5, 2\)"),
    ],
)
def test_bad_signals_are_refused_by_name_and_row(change, message):
    columns = {name: values for name, values in {**signals(), **change}.items() if values is not None}
    with pytest.raises(InputError, match=message):
        Recording(columns)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"flank": None}, "impacts.flank: is missing"),
        ({"flank": [0, 1, 2]}, r"impacts.flank\[2\]: is '2'"),
        ({"flank": ["active", "left", "active"]}, r"impacts.flank\[1\]: is 'left'"),
        ({"velocity_m_s": [0, np.nan, 0]}, r"impacts.velocity_m_s\[1\]: is nan"),
        ({"time_s": [0.0, 0.2, 0.1]}, r"impacts.time_s\[2\]: is 0.1 s after 0.2 s"),
        ({"tooth_drive": [1, 2, np.nan]}, r"impacts.tooth_drive\[2\]: is nan"),
        ({"tooth_loose": [1, 2.5, 3]}, r"impacts.tooth_loose\[1\]: is 2.5"),
    ],
)
def test_bad_impacts_are_refused_by_name_and_row(change, message):
    columns = {name: values for name, values in {**impacts(), **change}.items() if values is not None}
    with pytest.raises(InputError, match=message):
        Recording(signals(), columns)


def test_impacts_at_the_same_instant_are_no_fault():
    assert len(Recording(signals(), {**impacts(), "time_s": [0.1, 0.1, 0.1]}).impacts["time_s"]) == 3


def test_all_faults_of_a_kind_are_told_at_once():
    with pytest.raises(InputError) as caught:
        Recording({"a": [1.0]})
    assert [fault.key for fault in caught.value.faults] == [
        "signals.time_s",
        "signals.theta_drive_rad",
        "signals.theta_loose_rad",
    ]


def test_meta_becomes_what_json_gives_back_and_nothing_else():
    meta = Recording(signals(), {}, {"n": np.int64(3), "radii": (0.1, np.float64(0.2)), 5: np.ones(2)}).meta
    assert meta == {"n": 3, "radii": [0.1, 0.2], "5": [1.0, 1.0]}
    assert type(meta["n"]) is int
    with pytest.raises(TypeError, match=r"meta\.budget\.pair is a object"):
        Recording(signals(), {}, {"budget": {"pair": object()}})


def test_displacement_follows_from_base_radii():
    radii = {"base_radius_drive_m": 0.1, "base_radius_loose_m": 0.2}
    record = Recording(signals(), {}, radii)
    expected = 0.2 * signals()["theta_loose_rad"] - 0.1 * signals()["theta_drive_rad"]
    np.testing.assert_array_equal(record.signals["displacement_m"], expected)
    assert Recording(signals()).with_base_radii(0.1, 0.2) == record
    own = Recording({**signals(), "displacement_m": np.zeros(5)}, {}, radii)
    assert not own.signals["displacement_m"].any()


@given(st.lists(st.floats(-1, 1), max_size=20), st.floats(-1, 1), st.floats(-1, 1))
def test_between_keeps_exactly_what_lies_inside(times, start, end):
    times = np.unique(times)
    columns = {"time_s": times, "theta_drive_rad": times, "theta_loose_rad": times}
    hits = {"time_s": times, "flank": times > 0, "velocity_m_s": times}
    record = Recording(columns, hits, {"title": "t"})
    if start > end:
        with pytest.raises(UsageError, match="the end lies before the start"):
            record.between(start, end)
        return
    part = record.between(start, end)
    kept = times[(times >= start) & (times <= end)]
    np.testing.assert_array_equal(part.time, kept)
    np.testing.assert_array_equal(part.impacts["velocity_m_s"], kept)
    assert part.meta == {"title": "t"}


def test_repr_says_what_it_is():
    record = Recording(signals(), impacts(), {"title": "fig. 5", "model": "rigid"})
    assert repr(record) == "Recording('fig. 5', 'rigid', 5 samples of 0..0.4 s, 3 impacts (2 active, 1 reverse))"
    assert repr(record.between(5, 6)) == "Recording('fig. 5', 'rigid', 0 samples, 0 impacts)"


def test_pandas_has_text_flanks_units_and_every_number():
    pytest.importorskip("pandas")
    record = Recording(signals(), impacts(), {"model": "rigid"})
    samples, hits = record.to_pandas()
    assert hits["flank"].tolist() == ["active", "reverse", "active"]
    assert hits.attrs["units"]["impulse_N_s"] == "N s"
    assert samples.attrs["meta"] == {"model": "rigid"}
    for name, values in record.signals.items():
        np.testing.assert_array_equal(samples[name].to_numpy(), values)
    samples.loc[0, "time_s"] = 9.0
    assert record.time[0] == 0.0


def test_xarray_has_units_and_every_number():
    pytest.importorskip("xarray")
    record = Recording(signals(), impacts(), {"model": "rigid"})
    data = record.to_xarray()
    assert data["theta_drive_rad"].attrs["units"] == "rad"
    assert data["impact_flank"].values.tolist() == ["active", "reverse", "active"]
    assert data.attrs == {"model": "rigid"}
    for name, values in record.signals.items():
        np.testing.assert_array_equal(data[name].values, values)


def test_a_missing_table_library_is_told_with_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, "xarray", None)
    record = Recording(signals())
    for convert in (record.to_pandas, record.to_xarray):
        with pytest.raises(MissingExtraError, match=r'pip install "gears3d\[tables\]"'):
            convert()


def test_import_is_light():
    heavy = ["pyarrow", "pandas", "xarray", "scipy", "matplotlib"]
    code = f"import sys, gears3d.recording; print(*(m for m in {heavy} if m in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
