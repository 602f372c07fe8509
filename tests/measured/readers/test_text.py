"""Text of any dialect gives the same numbers; bad cells are told by column and row; nothing makes a traceback."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gears3d.errors import InputError, UsageError
from gears3d.measured.readers import open_source, read
from gears3d.recording import read_csv
from gears3d.recording.dialect import sniff

ROWS = np.random.default_rng(3).normal(size=(40, 3)) * [1.0, 1e3, 1e-6]
NAMES = ("time_s", "theta_drive_rad", "theta_loose_rad")


def table(delimiter=",", decimal=".", names=NAMES, rows=ROWS, quote="", end="\n"):
    lines = [delimiter.join(names)] if names else []
    lines += [delimiter.join(quote + repr(float(x)).replace(".", decimal) + quote for x in row) for row in rows]
    return end.join(lines) + end


HEADER = "Prüfstand 3\nDatum: 12.03.2026\nKanäle;3\n\n"
DIALECTS = {
    "comma": table(),
    "semicolon": table(";"),
    "tab": table("\t"),
    "bar": table("|"),
    "space": table(" "),
    "aligned": table("    ").replace("\n", "\n   "),
    "comma and space": table(", "),
    "decimal comma, semicolon": table(";", ","),
    "decimal comma, tab": table("\t", ","),
    "decimal comma, spaces": table("  ", ","),
    "decimal comma in quotes": table(",", ",", quote='"'),
    "quoted names": table(names=[f'"{name}"' for name in NAMES]),
    "header lines": HEADER + table(";", ","),
    "row of units": table(";", ",").replace("\n", "\ns;rad;rad\n", 1),
    "units in brackets": table(";").replace("\n", "\n[s];[rad];[rad]\n", 1),
    "comments above": "# made by a logger\n# 2026\n" + table(),
    "comments amid": table().replace("\n", "\n# paused, 3 of 4\n", 9),
    "percent comments": "% made by a logger\n" + table("\t"),
    "names in a comment": "# " + table(" "),
    "plus signs": table().replace("\n-", "\n-").replace(",1", ",+1"),
    "blank lines": table().replace("\n", "\n\n"),
    "windows": table(end="\r\n"),
    "old mac": table(end="\r"),
    "separator at the end": table(";", end=";\n"),
    "no end of line": table().rstrip("\n"),
}


@pytest.mark.parametrize("name", DIALECTS)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16", "utf-16-le"])
def test_every_dialect_gives_the_same_numbers(name, encoding, tmp_path):
    path = tmp_path / "run.csv"
    path.write_bytes(DIALECTS[name].encode(encoding))
    for found in (read(path).columns, read_csv(path)):
        assert tuple(found) == NAMES
        np.testing.assert_array_equal(np.stack(list(found.values()), axis=1), ROWS)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " ", "|"])
def test_numbers_without_names_are_columns_by_number(delimiter, tmp_path):
    path, chart = tmp_path / "run.txt", tmp_path / "record.toml"
    path.write_text(table(delimiter, names=()))
    chart.write_text('format = 1\ntime.sample_rate = "1 kHz"\n[drive]\nchannel = "column 2"\nunit = "rad"\n')
    np.testing.assert_array_equal(read(path, chart).columns["theta_drive_rad"], ROWS[:, 1])


def test_words_and_units_of_columns_are_known_to_the_map(tmp_path):
    path, chart = tmp_path / "run.txt", tmp_path / "record.toml"
    path.write_text("Zeit [ms];phi 1 (deg);Kommentar;n / rpm\n0,5;180,0;an;60\n1,5;360,0;an;60\n", encoding="latin-1")
    chart.write_text('format = 1\ntime.channel = "Zeit"\ndrive.channel = "phi 1"\nloose.channel = "n"\n')
    found = read(path, chart).columns
    assert found["time_s"].tolist() == [0.0005, 0.0015]
    np.testing.assert_allclose(found["theta_drive_rad"], [np.pi, 2 * np.pi])
    np.testing.assert_allclose(found["theta_loose_rad"], [0, 2e-3 * np.pi])
    chart.write_text('format = 1\ntime.channel = "Zeit"\ndrive.channel = "Kommentar"\n')
    with pytest.raises(InputError, match="'Kommentar' holds no numbers"):
        read(path, chart)


def test_a_long_file_is_read_in_blocks_without_a_seam(tmp_path):
    path = tmp_path / "run.csv"
    values = np.arange(400_000.0)
    lines = [f"{k};{k * 0.5:.1f};ä" + ("\n# pause" if k % 90_000 == 7 else "") for k in range(len(values))]
    for encoding in ("utf-8", "utf-16"):
        path.write_text("time_s;theta_loose_rad;note\n" + "\n".join(lines), encoding=encoding)
        found = read(path).columns
        np.testing.assert_array_equal(found["time_s"], values)
        np.testing.assert_array_equal(found["theta_loose_rad"], 0.5 * values)
    source = open_source(path)
    assert len(source.load(["time_s"], 7)["time_s"]) == 7
    path.write_text(path.read_text(encoding="utf-16").replace("\n399000;", "\n39x9000;"))
    found = read(path)
    assert np.flatnonzero(np.isnan(found.columns["time_s"])).tolist() == [399_000]
    assert [(note["kind"], note["text"]) for note in found.meta["decoded"]] == [
        ("no-numbers", "1 cells hold no number: time_s row 399001")
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time_s,theta_loose_rad\n0,1\n1\n2,3\n3,4", "row 2: has 1 cells, not 2; 1 rows are damaged, at most 1 %"),
        ("time_s,theta_loose_rad\n0,1\n1,2,3\n4,5\n", "row 2: has 3 cells, not 2"),
        ("time_s,theta_loose_rad\n0,1\n1,1.2.3\n2,3\n", "theta_loose_rad, row 2: is '1.2.3'"),
        ("time_s,theta_loose_rad\n", "has no rows"),
        ("time_s\x00theta\x00\x01\x02", "is not a text"),
    ],
)
def test_bad_text_is_told(text, message, tmp_path):
    (tmp_path / "run.csv").write_text(text)
    with pytest.raises(InputError, match=message):
        read(tmp_path / "run.csv")


def test_holes_are_nan_and_nothing_is_judged(tmp_path):
    (tmp_path / "run.csv").write_text("time_s,theta_loose_rad\n0,NaN\n0,\n-1,inf\nnan,1e400\n")
    found = read(tmp_path / "run.csv").columns
    np.testing.assert_array_equal(found["time_s"], [0, 0, -1, np.nan])
    np.testing.assert_array_equal(found["theta_loose_rad"], [np.nan, np.nan, np.inf, np.inf])


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("text") / "run.txt"


def attempt(place, data):
    place.write_bytes(data)
    try:
        return read(place)
    except (InputError, UsageError) as error:
        return error


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=300))
@example(b'"')
@example(b'a,b\r\n"1,2\n3,4')
@example(b"\xff\xfe1")
@example(b"1\n")
def test_random_bytes_make_nothing_but_an_input_error(place, data):
    assert attempt(place, data) is not None
    assert attempt(place, b"time_s,theta_loose_rad\n0,1\n" + data) is not None


@settings(max_examples=150, deadline=None)
@given(
    name=st.sampled_from(sorted(DIALECTS)),
    cuts=st.lists(st.tuples(st.floats(0, 1), st.integers(0, 6), st.binary(max_size=4)), max_size=4),
)
def test_mutations_of_good_files_make_nothing_but_an_input_error(place, name, cuts):
    data = DIALECTS[name].encode()
    for part, gone, put in cuts:
        at = int(part * len(data))
        data = data[:at] + put + data[at + gone :]
    assert attempt(place, data) is not None


@settings(max_examples=100, deadline=None)
@given(st.text(max_size=120))
def test_a_dialect_is_found_or_refused(text):
    found = told(text.encode("utf-8", "replace"))
    if isinstance(found, str):
        assert found in ("has no rows", "is empty", "is not a text")
    else:
        assert len(found.names) == len(found.numeric) > 0


def told(head):
    try:
        return sniff(head)
    except ValueError as error:
        return str(error)
