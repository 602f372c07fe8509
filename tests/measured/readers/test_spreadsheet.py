"""Spreadsheets written by hand after their standards: their cells come back; bombs and damage are one line."""

import zipfile

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.measured.readers import open_source, propose, read

ROWS = 300
TIME = np.arange(ROWS) / 1000.0
DRIVE = 30.0 * TIME
LOOSE = 15.0 * TIME + 1e-3 * np.sin(70.0 * TIME)
COLUMNS = {"t [s]": TIME, "drive [rad]": DRIVE, "loose [rad]": LOOSE}
MAIN = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
REL = 'xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships"'
OFFICE = " ".join(
    f'xmlns:{name}="urn:oasis:names:tc:opendocument:xmlns:{name}:1.0"' for name in ("office", "table", "text")
)


def letters(place):
    return chr(65 + place)


def sheet_of(rows):
    """Return the XML of a sheet; text is shared, numbers stand in the cells, None is left out."""
    words, lines = [], []
    for at, row in enumerate(rows, 1):
        cells = []
        for place, value in enumerate(row):
            where = f'r="{letters(place)}{at}"'
            if isinstance(value, str):
                words.append(value)
                cells.append(f'<c {where} t="s"><v>{len(words) - 1}</v></c>')
            elif isinstance(value, tuple):
                cells.append(f'<c {where} s="1"><v>{value[0]!r}</v></c>')
            elif value is not None:
                cells.append(f"<c {where}><v>{float(value)!r}</v></c>")
        lines.append(f'<row r="{at}">{"".join(cells)}</row>')
    return f"<worksheet {MAIN}><sheetData>{''.join(lines)}</sheetData></worksheet>", words


def write_xlsx(path, *tables):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        every, names = [], []
        for number, rows in enumerate(tables, 1):
            xml, words = sheet_of(rows)
            for at in range(len(words) - 1, -1, -1):
                xml = xml.replace(f't="s"><v>{at}<', f't="s"><v>{at + len(every)}<')
            every += words
            file.writestr(f"xl/worksheets/sheet{number}.xml", xml)
            names.append(f'<sheet name="Sheet {number}" sheetId="{number}" r:id="rId{number}"/>')
        file.writestr("xl/workbook.xml", f"<workbook {MAIN} {REL}><sheets>{''.join(names)}</sheets></workbook>")
        links = [f'<Relationship Id="rId{k}" Target="worksheets/sheet{k}.xml"/>' for k in range(1, len(tables) + 1)]
        file.writestr("xl/_rels/workbook.xml.rels", f"<Relationships>{''.join(links)}</Relationships>")
        shared = "".join(f"<si><t>{word}</t></si>" for word in every)
        file.writestr("xl/sharedStrings.xml", f"<sst {MAIN}>{shared}</sst>")
        xfs = '<cellXfs><xf numFmtId="0"/><xf numFmtId="22"/></cellXfs>'
        file.writestr("xl/styles.xml", f"<styleSheet {MAIN}>{xfs}</styleSheet>")


def write_ods(path, *tables):
    made = []
    for number, rows in enumerate(tables, 1):
        lines = []
        for row in rows:
            cells = []
            for value in row:
                if isinstance(value, str):
                    kind = 'office:value-type="string"'
                    cells.append(f"<table:table-cell {kind}><text:p>{value}</text:p></table:table-cell>")
                elif value is None:
                    cells.append('<table:table-cell table:number-columns-repeated="1"/>')
                else:
                    told = f'office:value-type="float" office:value="{float(value)!r}"'
                    cells.append(f"<table:table-cell {told}><text:p>{value:.2f}</text:p></table:table-cell>")
            cells.append('<table:table-cell table:number-columns-repeated="16380"/>')
            lines.append(f"<table:table-row>{''.join(cells)}</table:table-row>")
        empty = '<table:table-row table:number-rows-repeated="1048000"><table:table-cell/></table:table-row>'
        made.append(f'<table:table table:name="Sheet {number}">{"".join(lines)}{empty}</table:table>')
    body = f"<office:body><office:spreadsheet>{''.join(made)}</office:spreadsheet></office:body>"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        file.writestr("content.xml", f"<office:document-content {OFFICE}>{body}</office:document-content>")


WRITERS = {"xlsx": write_xlsx, "ods": write_ods}


def rows_of(columns):
    return [list(columns), *map(list, zip(*columns.values(), strict=True))]


@pytest.mark.parametrize("ending", WRITERS)
def test_a_sheet_comes_back_to_the_last_bit(ending, tmp_path):
    path, chart = tmp_path / f"run.{ending}", tmp_path / "record.toml"
    rows = [["Bench 3", "a, b"], [None], *rows_of(COLUMNS)]
    WRITERS[ending](path, rows)
    chart.write_text(propose(path, None, tmp_path))
    found = read(chart).columns
    for name, values in zip(("time_s", "theta_drive_rad", "theta_loose_rad"), COLUMNS.values(), strict=True):
        np.testing.assert_array_equal(found[name], values)


@pytest.mark.parametrize("ending", WRITERS)
def test_several_sheets_are_groups(ending, tmp_path):
    path = tmp_path / f"run.{ending}"
    WRITERS[ending](path, rows_of(COLUMNS), [["only words"]], rows_of({"T [degC]": TIME}))
    source = open_source(path)
    assert [each.name for each in source.signals] == [
        *(f"Sheet 1/{name}" for name in COLUMNS),
        "Sheet 3/T [degC]",
    ]
    np.testing.assert_array_equal(source.load(["Sheet 1/loose [rad]"], None)["Sheet 1/loose [rad]"], LOOSE)


def test_dates_of_a_sheet_count_from_the_first(tmp_path):
    rows = [["stamp", "a"], *[[(46_000.75 + k / 86_400.0,), float(k)] for k in range(20)]]
    write_xlsx(tmp_path / "run.xlsx", rows)
    source = open_source(tmp_path / "run.xlsx")
    assert source.signals[0].unit == "s"
    np.testing.assert_allclose(source.load(["stamp"], None)["stamp"], np.arange(20.0), atol=2e-6)


def test_empty_cells_are_missing_numbers(tmp_path):
    rows = [["a", "b"], *[[float(k), None if k == 3 else 2.0 * k] for k in range(20)]]
    for ending, write in WRITERS.items():
        write(tmp_path / f"run.{ending}", rows)
        found = open_source(tmp_path / f"run.{ending}").load(["a", "b"], None)
        assert np.flatnonzero(np.isnan(found["b"])).tolist() == [3]


def bomb(path, kind):
    if kind == "other archive":
        with zipfile.ZipFile(path, "w") as file:
            file.writestr("run.csv", "a,b\n1,2\n")
    elif kind == "declared":
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
            file.writestr("xl/workbook.xml", " " * 30_000_000)
    elif kind == "wide":
        rows = "".join(f'<row r="{k}"><c r="ALL{k}"><v>1</v></c></row>' for k in range(1, 9000))
        write_xlsx(path, rows_of({"a": TIME}))
        replaced(path, "xl/worksheets/sheet1.xml", f"<worksheet {MAIN}><sheetData>{rows}</sheetData></worksheet>")
    elif kind == "repeated":
        write_ods(path, rows_of({"a": TIME}))
        cell = '<table:table-cell office:value="1" table:number-columns-repeated="16000"/>'
        row = f'<table:table-row table:number-rows-repeated="1048576">{cell}</table:table-row>'
        table = f'<table:table table:name="a">{row}</table:table>'
        replaced(path, "content.xml", f"<office:document-content {OFFICE}>{table}</office:document-content>")
    elif kind == "entities":
        write_xlsx(path, rows_of({"a": TIME}))
        replaced(path, "xl/workbook.xml", '<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>')
    elif kind == "words":
        write_xlsx(path, [["a", "b"]])
    else:
        write_xlsx(path, rows_of({"a": TIME}))
        data = bytearray(path.read_bytes())
        data[200:260] = bytes(60)
        path.write_bytes(data)


def replaced(path, member, text):
    with zipfile.ZipFile(path) as file:
        held = {name: file.read(name) for name in file.namelist()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in (held | {member: text.encode()}).items():
            file.writestr(name, data)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("other archive", r"is a ZIP archive \(unpack it\)"),
        ("declared", "its sheets require .* GiB of memory"),
        ("wide", "sheet 'Sheet 1' consists of empty or repeated cells"),
        ("repeated", "sheet 'a' consists of empty or repeated cells"),
        ("entities", "its XML has a document type"),
        ("words", "has no rows of numbers in any sheet"),
        ("damaged", "cannot be read as a spreadsheet"),
    ],
)
def test_bad_sheets_are_refused_in_one_line(kind, message, tmp_path, monkeypatch):
    monkeypatch.setenv("GEARS3D_MAX_BYTES", "100e6")
    bomb(tmp_path / "run.xlsx", kind)
    with pytest.raises(InputError, match=message) as caught:
        open_source(tmp_path / "run.xlsx")
    assert len(str(caught.value).splitlines()) == 1
