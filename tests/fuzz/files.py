"""Small measured files of every format, written by the libraries of the formats; files that lie about their size."""

import random
import warnings
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import asammdf
import h5py
import nptdms
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pyuff
import scipy.io

Columns = dict[str, np.ndarray]
NAMES = ("time_s", "theta_drive_rad", "theta_loose_rad")
MAP = 'format = 1\n[drive]\nchannel = "theta_drive_rad"\n[loose]\nchannel = "theta_loose_rad"\n'
"""For formats whose time has no name of its own."""


def drawn(rng: random.Random, rows: int) -> Columns:
    """Return a record with angles of any size."""
    draw = np.random.default_rng(rng.getrandbits(32))
    time = np.cumsum(draw.uniform(0.1, 1.0, rows)) * 10.0 ** rng.randint(-6, 2)
    drive = draw.normal(0.0, 10.0 ** rng.randint(-3, 6), rows)
    return {"time_s": time, "theta_drive_rad": drive, "theta_loose_rad": draw.normal(0.0, 1.0, rows)}


def rattling(rows: int) -> Columns:
    """Return a record as a bench has it."""
    time = np.arange(rows) / 1000.0
    drive = 2.0 * time + 0.11 * np.sin(18.0 * time)
    return {"time_s": time, "theta_drive_rad": drive, "theta_loose_rad": drive + 1e-4 * np.sin(71.0 * time)}


def write_csv(path: Path, columns: Columns, rng: random.Random) -> None:
    """Write text in one of many dialects; every number comes back to the last bit."""
    delimiter = rng.choice((",", ";", "\t", " ", "|"))
    decimal = "," if delimiter in ";\t|" and rng.random() < 0.4 else "."
    form = rng.choice((repr, "{:.17g}".format, "{:.17e}".format, "{:+.17e}".format))
    end = rng.choice(("\n", "\n", "\r\n", "\r"))
    quote = '"' if delimiter in ",;" and rng.random() < 0.2 else ""
    lines = [f"# note {at}" for at in range(rng.choice((0, 0, 1, 5)))]
    lines.append(delimiter.join(f"{quote}{name}{quote}" for name in columns))
    if rng.random() < 0.2 and delimiter != " ":
        lines.append(delimiter.join(["[s]", *["[rad]"] * (len(columns) - 1)]))
    for row in zip(*columns.values(), strict=True):
        lines.append(delimiter.join(form(float(each)).replace(".", decimal) for each in row))
    text = end.join(lines) + (end if rng.random() < 0.8 else "")
    path.write_bytes(text.encode(rng.choice(("utf-8", "utf-8", "utf-8-sig", "utf-16", "latin-1", "utf-16-le"))))


def write_parquet(path: Path, columns: Columns, rng: random.Random) -> None:
    """Write Parquet of any encoding."""
    options = {"compression": rng.choice(("none", "snappy", "gzip", "zstd", "lz4", "brotli"))}
    table = pa.table({name: pa.array(values) for name, values in columns.items()})
    pq.write_table(
        table,
        path,
        row_group_size=rng.choice((None, 7, 50)),
        use_dictionary=rng.random() < 0.5,
        data_page_version=rng.choice(("1.0", "2.0")),
        **options,
    )


def write_hdf5(path: Path, columns: Columns, rng: random.Random) -> None:
    """Write HDF5: datasets, columns of a matrix, or fields of a table."""
    options = rng.choice(
        ({}, {"chunks": True, "compression": "gzip"}, {"chunks": True, "shuffle": True, "fletcher32": True})
    )
    with h5py.File(path, "w", libver=rng.choice(("earliest", "latest"))) as file:
        if rng.random() < 0.3:
            table = np.zeros(len(columns["time_s"]), [(name, rng.choice(("<f8", ">f8"))) for name in columns])
            for name, values in columns.items():
                table[name] = values
            file.create_dataset("rig/table", data=table, **options)
            return
        for name, values in columns.items():
            shape = rng.choice(((-1,), (-1, 1), (1, -1)))
            own = file.create_dataset(f"rig/{name}", data=values.reshape(shape), **options)
            own.attrs["units"] = "s" if name == "time_s" else "rad"


def write_matlab(path: Path, columns: Columns, rng: random.Random) -> None:
    """Write MATLAB 4 or 5, plain or compressed, in a structure or not."""
    held = {name: values.reshape(rng.choice(((-1, 1), (1, -1)))) for name, values in columns.items()}
    form = rng.choice(("4", "5", "5"))
    if form == "5" and rng.random() < 0.4:
        held = {"rig": held, "note": "run", "cells": np.array([1, "a"], dtype=object)}
    packed = form == "5" and rng.random() < 0.5
    scipy.io.savemat(path, held, False, form, form == "5", packed)


def write_matlab73(path: Path, columns: Columns, rng: random.Random) -> None:
    """Write MATLAB 7.3."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            file[name] = values.reshape(1, -1)
            file[name].attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


def write_tdms(path: Path, columns: Columns, rng: random.Random) -> None:
    """Write TDMS in one or several segments."""
    parts = rng.choice((1, 1, 3))
    with nptdms.TdmsWriter(path) as file:
        for part in range(parts):
            rows = slice(part * len(columns["time_s"]) // parts, (part + 1) * len(columns["time_s"]) // parts)
            own = [nptdms.ChannelObject("rig", name, values[rows]) for name, values in columns.items()]
            file.write_segment([nptdms.RootObject({"rig": "3"}), *own])


def write_mdf(path: Path, columns: Columns, rng: random.Random) -> None:
    """Write MDF 3 or 4, plain or compressed."""
    version = rng.choice(("3.30", "4.10", "4.10"))
    with asammdf.MDF(version=version) as file:
        time = columns["time_s"]
        own = [
            asammdf.Signal(values, time, name=name, unit="rad") for name, values in columns.items() if name != "time_s"
        ]
        file.append(own)
        ending = ".mdf" if version < "4" else ".mf4"
        made = file.save(path.with_name(f"{path.stem}_{ending}"), overwrite=True, compression=rng.choice((0, 1, 2)))
    Path(made).rename(path)


def write_uff(path: Path, columns: Columns, rng: random.Random, binary: int = 1) -> None:
    """Write universal data sets 58."""
    axes = ("abscissa", "ordinate", "orddenom", "z_axis")
    ends = ("spec_data_type", "len_unit_exp", "force_unit_exp", "temp_unit_exp")
    told = {f"{axis}_{end}": 0 for axis in axes for end in ends} | {f"{axis}_axis_units_lab": "NONE" for axis in axes}
    told |= dict.fromkeys(("ver_num", "load_case_id", "rsp_node", "rsp_dir", "ref_node", "ref_dir", "z_axis_value"), 0)
    told |= dict.fromkeys(("id2", "id3", "id4", "id5", "rsp_ent_name", "ref_ent_name"), "NONE")
    rows = len(columns["time_s"])
    told |= {"type": 58, "binary": binary, "func_type": 1, "ord_data_type": 4, "num_pts": rows, "x": columns["time_s"]}
    told |= {"abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": 0.001}
    path.unlink(missing_ok=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, values in columns.items():
            pyuff.UFF(str(path)).write_sets(told | {"id1": name, "data": values}, "add")


def write_uff_text(path: Path, columns: Columns, rng: random.Random) -> None:
    """Write universal data sets 58 as text, which has 13 digits."""
    write_uff(path, columns, rng, binary=0)


def write_testlab(path: Path, columns: Columns, rng: random.Random) -> None:
    """Write functions as Simcenter Testlab exports them."""
    tree = {}
    for at, (name, values) in enumerate(columns.items()):
        change = {"factor": 1.0, "offset": 0.0}
        quantity = {"label": rng.choice(("s", "rad", "")) if at else "s", "unit_transformation": change}
        steps = {"start_value": 0.0, "increment": 0.001, "number_of_values": float(len(values))}
        tree[f"Signal_{at}"] = {
            "x_values": {**steps, "quantity": {"label": "s"}},
            "y_values": {"values": values.reshape(-1, 1), "quantity": quantity},
            "function_record": {"name": name, "type": "Signal"},
        }
    scipy.io.savemat(path, tree, do_compression=rng.random() < 0.5, appendmat=False)


def write_xlsx(path: Path, columns: Columns, rng: random.Random) -> None:
    """Write a workbook with one sheet."""
    main = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
    link = 'xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships"'
    names = "".join(f'<c t="inlineStr"><is><t>{name}</t></is></c>' for name in columns)
    rows = [f"<row>{names}</row>"]
    for row in zip(*columns.values(), strict=True):
        rows.append("<row>" + "".join(f"<c><v>{float(each)!r}</v></c>" for each in row) + "</row>")
    with zipfile.ZipFile(path, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as file:
        sheet = '<sheet name="a" sheetId="1" r:id="rId1"/>'
        file.writestr("xl/workbook.xml", f"<workbook {main} {link}><sheets>{sheet}</sheets></workbook>")
        target = '<Relationship Id="rId1" Target="worksheets/sheet1.xml"/>'
        file.writestr("xl/_rels/workbook.xml.rels", f"<Relationships>{target}</Relationships>")
        file.writestr(
            "xl/worksheets/sheet1.xml", f"<worksheet {main}><sheetData>{''.join(rows)}</sheetData></worksheet>"
        )


def write_ods(path: Path, columns: Columns, rng: random.Random) -> None:
    """Write an OpenDocument spreadsheet."""
    spaces = " ".join(f'xmlns:{name}="urn:{name}"' for name in ("office", "table", "text"))
    names = "".join(f"<table:table-cell><text:p>{name}</text:p></table:table-cell>" for name in columns)
    rows = [f"<table:table-row>{names}</table:table-row>"]
    for row in zip(*columns.values(), strict=True):
        cells = "".join(f'<table:table-cell office:value="{float(each)!r}"/>' for each in row)
        rows.append(f"<table:table-row>{cells}</table:table-row>")
    with zipfile.ZipFile(path, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as file:
        table = f'<table:table table:name="a">{"".join(rows)}</table:table>'
        file.writestr("content.xml", f"<office:document-content {spaces}>{table}</office:document-content>")


WRITERS: dict[str, Callable[[Path, Columns, random.Random], None]] = {
    "csv": write_csv,
    "parquet": write_parquet,
    "h5": write_hdf5,
    "mat": write_matlab,
    "v73.mat": write_matlab73,
    "testlab.mat": write_testlab,
    "xlsx": write_xlsx,
    "ods": write_ods,
    "tdms": write_tdms,
    "mf4": write_mdf,
    "unv": write_uff,
    "text.unv": write_uff_text,
}


# Files that lie: they declare, or hold compressed, much more than a record of their size has.


def lie_hdf5(path: Path, secret: Path, rng: random.Random) -> None:
    """Write HDF5 with sizes, chunks and types of any kind, and with samples elsewhere."""
    rows = 2 ** rng.randrange(4, 42)
    with h5py.File(path, "w") as file:
        for name in NAMES:
            kind = rng.randrange(9)
            if kind == 0:
                file.create_dataset(name, (rows,), "f8")
            elif kind == 1:
                file.create_dataset(
                    name, (rows,), "f8", chunks=(min(rows, 2 ** rng.randrange(4, 28)),), compression="gzip"
                )
            elif kind == 2:
                file.create_dataset(
                    name, (10,), np.dtype([("a", "f8", (2 ** rng.randrange(26),)), ("b", "f8")]), chunks=(2,)
                )
            elif kind == 3:
                file[name] = h5py.ExternalLink(str(secret), "time_s")
            elif kind == 4:
                file.create_dataset(name, (8,), "f8", external=[(str(secret), 0, 64)])
            elif kind == 5:
                layout = h5py.VirtualLayout((rows,), "f8")
                layout[: min(rows, 8)] = h5py.VirtualSource(str(secret), "time_s", (min(rows, 8),))
                file.create_virtual_dataset(name, layout)
            elif kind == 6:
                file[name] = h5py.SoftLink(rng.choice((f"/{name}", "/", "/nowhere")))
            elif kind == 7:
                file.create_dataset(name, (rng.choice((2, 300)), rows), "f8", chunks=True)
            else:
                own = file.create_dataset(name, data=np.arange(10.0))
                own.attrs["units"] = rng.choice(
                    (np.zeros(6000), "x" * 60000, np.array(["a", "b"], dtype="S5"), b"\xff")
                )


def lie_parquet(path: Path, secret: Path, rng: random.Random) -> None:
    """Write Parquet with a great many rows that take no room."""
    rows = 2 ** rng.randrange(4, 28)
    kind = rng.randrange(4)
    if kind == 0:
        table = pa.table({name: pa.nulls(rows) for name in NAMES})
    elif kind == 1:
        some = min(rows, 1 << 20)
        word = pa.array(["x" * rng.choice((1, 10**6))])
        index = pa.array(np.zeros(some, dtype=np.int32))
        table = pa.table({name: pa.DictionaryArray.from_arrays(index, word) for name in NAMES})
    elif kind == 2:
        table = pa.table({name: pa.array([[1.0] * 10] * 10) for name in NAMES})
    else:
        table = pa.table({name: pa.array(np.zeros(min(rows, 1 << 22), dtype=bool)) for name in NAMES})
    pq.write_table(table, path, compression="zstd")


def lie_matlab(path: Path, secret: Path, rng: random.Random) -> None:
    """Write compressed matrices of zeros, and some whose tags tell other sizes."""
    size = 2 ** rng.randrange(10, 28)
    content = np.array([14, 56 + size, 6, 8, rng.choice((6, 9, 4, 1, 2)), 0, 5, 8, size, 1, 1, 4], "<u4").tobytes()
    content += b"time" + b"\0" * 4 + np.array([rng.choice((2, 9, 14, 1)), size], "<u4").tobytes()
    content = bytearray(content)
    if rng.random() < 0.5:
        at = 4 * rng.randrange(len(content) // 4)
        content[at : at + 4] = np.uint32(rng.choice((0, 1, 8, 2**31 - 1, 2**32 - 1, size * 8))).tobytes()
    packer = zlib.compressobj(1)
    packed = packer.compress(bytes(content))
    zeros = bytes(1 << 16)
    for _ in range(0, size, 1 << 16):
        packed += packer.compress(zeros)
    packed += packer.flush()
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    path.write_bytes(head + np.array([15, len(packed)], "<u4").tobytes() + packed)


def lie_text(path: Path, secret: Path, rng: random.Random) -> None:
    """Write text with endless lines, columns, headers or blanks."""
    kind = rng.randrange(9)
    table = ",".join(NAMES) + "\n" + "".join(f"{k},{k},{k}\n" for k in range(40))
    if kind == 0:
        text = (
            rng.choice((" ", "[", "(", "\t", "a ", '"', "rate ", "#", ",", "1,", "\r")) * rng.randrange(300_000)
            + "\n"
            + table
        )
    elif kind == 1:
        text = table + "1" * rng.randrange(3_000_000)
    elif kind == 2:
        text = table + "\n" * rng.randrange(3_000_000)
    elif kind == 3:
        names = ",".join(f"x{k % rng.choice((1, 7, 10**6))}" for k in range(rng.randrange(20_000)))
        text = names + "\n" + "\n".join(["1," * names.count(",") + "1"] * 3)
    elif kind == 4:
        text = table.replace(",", rng.choice((", ", " , ", ";;", "\t\t", " " * 5000)))
    elif kind == 5:
        text = (
            "    -1\n    58\n" + "\n".join(["x" * 80] * rng.randrange(3, 30)) + "\n    -1\n" * rng.choice((1, 2, 3000))
        )
    elif kind == 6:
        text = table + rng.choice(
            ("1,2\n", "1,2,3,4\n", "a,b,c\n", '"1,2,3\n', "1,,3\n", "1,2,0x10\n", "1,2,1e999\n", "1,2,1_0\n")
        )
    elif kind == 7:
        stamps = rng.choice(
            ("2026-03-{:02d}T10:00:00Z", "{:02d}.03.2026 10:00:00,5", "10:00:{:02d}", "17000000000000000{:02d}")
        )
        text = "\n".join(["time_s,a,b", *(f"{stamps.format(rng.randrange(99))},{k},{k}" for k in range(40))])
    else:
        text = rng.choice(("{", "[", "<", "(", "-", "é")) * rng.randrange(200_000)
    path.write_bytes(text.encode())


def lie_sheet(path: Path, secret: Path, rng: random.Random) -> None:
    """Write spreadsheets with far cells, repeated cells, entities, and members that unpack to far more."""
    kind = rng.randrange(5)
    write = write_ods if kind in (1, 3) else write_xlsx
    write(path, {name: np.arange(9.0) for name in NAMES}, rng)
    member = "content.xml" if write is write_ods else "xl/worksheets/sheet1.xml"
    count = 2 ** rng.randrange(4, 16)
    texts = (
        "<sheetData>" + "".join(f'<row><c r="XFD{k}"><v>1</v></c></row>' for k in range(count)) + "</sheetData>",
        f'<t xmlns:table="a" xmlns:office="b"><table:table table:name="a"><table:table-row table:number-rows-repeated='
        f'"{2 ** rng.randrange(30)}"><table:table-cell office:value="1" table:number-columns-repeated='
        f'"{2 ** rng.randrange(30)}"/></table:table-row></table:table></t>',
        '<!DOCTYPE a [<!ENTITY b "c"><!ENTITY d "&b;&b;">]><a>&d;</a>',
        "<a>" * count,
        " " * (1024 * count),
    )
    with zipfile.ZipFile(path) as file:
        held = {name: file.read(name) for name in file.namelist()}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, data in (held | {member: texts[kind].encode()}).items():
            file.writestr(name, data)


def lie_mdf(path: Path, secret: Path, rng: random.Random) -> None:
    """Write MDF with a conversion by a formula, or a block that unpacks to more than it says."""
    time = np.arange(400) / 1000.0
    formula = rng.choice(
        ("9**9**9**9", "X1**9**9**9", "2*X1+1", "__import__('os').mkdir('made')", "X" * 5000, "(" * 500, "1/0", "X1/0")
    )
    told = {"formula": formula} if rng.random() < 0.5 else None
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(time, time, name=name, unit="rad", conversion=told) for name in NAMES[1:]])
        made = file.save(path.with_name("lie.mf4"), overwrite=True, compression=rng.choice((0, 1)))
    data = bytearray(Path(made).read_bytes())
    Path(made).unlink()
    at = data.find(b"##DZ")
    if at >= 0 and told is None:
        bomb = zlib.compress(bytes(2 ** rng.randrange(10, 29)), 1)
        head = data[at : at + 40] + np.uint64(len(bomb)).tobytes()
        end = len(data) + -len(data) % 8
        for k in range(0, len(data) - 8, 8):
            if data[k : k + 8] == np.uint64(at).tobytes():
                data[k : k + 8] = np.uint64(end).tobytes()
        data += bytes(end - len(data)) + head + bomb
    path.write_bytes(data)


LIES = {
    "h5": lie_hdf5,
    "parquet": lie_parquet,
    "mat": lie_matlab,
    "csv": lie_text,
    "xlsx": lie_sheet,
    "mf4": lie_mdf,
}
