"""The tool that compares gears3d with published records, on synthetic files of the same layout with known laws."""

import importlib.machinery
import importlib.util
import io
import pickle
import re
import struct
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

TOOL = Path(__file__).resolve().parents[2] / "tools" / "real_records"


@pytest.fixture(scope="module")
def tool():
    loader = importlib.machinery.SourceFileLoader("real_records", str(TOOL))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("real_records", loader))
    sys.modules["real_records"] = module
    loader.exec_module(module)
    return module


def table(tool, capsys, folder, key):
    """Return exit code and cells of the table: quantity, published, independent, gears3d, verdict."""
    code = tool.main([str(folder), "--only", key])
    lines = capsys.readouterr().out.splitlines()[2:]
    return code, [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[4:-1]] for line in lines]


def number(cell):
    value, half = cell.split(" ± ")
    return float(value), float(half)


def turned(decelerate, start, end):
    """Return time and angle of a coast-down whose deceleration is a function of the speed."""

    def stop(_, y):
        return y[1] - end

    stop.terminal = True
    made = solve_ivp(lambda _, y: [y[1], -decelerate(y[1])], (0, 1e4), [0.0, start], rtol=1e-9, atol=1e-9,
                     dense_output=True, events=stop)  # fmt: skip
    time = np.linspace(0.0, made.t_events[0][0], 40_000)
    return time, made.sol(time)[0]


def law(speed):
    return 0.3 + 0.017 * speed + 0.0002 * speed**2


def test_a_wheel_with_eight_uneven_magnets(tool, tmp_path, capsys):
    time, angle = turned(law, 90.0, 3.0)
    uneven = 0.01 * np.random.default_rng(1).normal(size=8)
    count = np.arange(int(angle[-1] * 8 / (2 * np.pi)))
    passed = np.interp((count + uneven[count % 8]) * 2 * np.pi / 8, angle, time)
    driven = -np.cumsum(np.linspace(0.009, 0.1, 60))[::-1]  # it is brought up to speed first
    (tmp_path / "data04cover.txt").write_text("\n".join(f"{1e3 * (20 + t):.2f}" for t in [*driven, *passed]))
    code, rows = table(tool, capsys, tmp_path, "wheel")
    assert code == 0
    assert float(rows[2][3]) == pytest.approx(0.0002, rel=0.02)
    for row, speed in zip(rows, (20.0, 60.0), strict=False):
        for cell in row[2:4]:
            assert abs(number(cell)[0] - law(speed)) < max(2 * number(cell)[1], 0.004 * law(speed))
        assert row[4] == "agrees"


def test_speeds_of_telemetry_with_held_readings(tool, tmp_path, capsys):
    time, angle = turned(lambda v: 0.05 + 0.01 * v + 0.001 * v**2, 18.0, 0.6)
    at = np.arange(0.0, time[-1], 0.1)
    speed = np.round(np.interp(at, time, np.gradient(angle, time)), 2)
    rows = [f"18.5 -0.002 -0.05 {v:.2f} 0.6 {10 * t:.2f} 0.00 1 0.00 {100 * k + 13643}"
            for k, (t, v) in enumerate([(0.0, 0.0)] * 30 + list(zip(at, speed, strict=True)))]  # fmt: skip
    (tmp_path / "disengaged.txt").write_text("\n".join(rows))
    code, found = table(tool, capsys, tmp_path, "telemetry")
    assert (code, [row[4] for row in found]) == (0, ["agrees", "agrees"])
    assert number(found[1][2])[0] == pytest.approx(0.25, rel=0.01)
    assert number(found[1][3])[0] == pytest.approx(0.25, rel=0.01)


def test_rollers_whose_counts_are_logged_at_events(tool, tmp_path, capsys):
    edges = []
    for place in (0, 1):
        time, angle = turned(lambda w: 0.02 + 0.01 * w, 60.0, 2.0)
        count = np.arange(1, int(angle[-1] / (2 * np.pi)))
        edges += [(t, place) for t in np.interp(2 * np.pi * count, angle, time) * (1 + 0.1 * place)]
    counts, lines = [0, 0], []
    for moment, place in sorted(edges):
        counts[place] += 1
        lines.append(f"{1e6 * (3 + moment):.0f},1.0,{counts[0]},2.0,{counts[1]}")
    (tmp_path / "Grandprix - Separate - Left - 120 psi.csv").write_text("\n".join(lines))
    code, rows = table(tool, capsys, tmp_path, "rollers")
    assert (code, [row[4] for row in rows]) == (0, ["agrees", "agrees"])
    assert number(rows[0][3])[0] == pytest.approx(0.17, rel=0.03)


def test_bounces_in_sheets_with_several_drops(tool, tmp_path, capsys):
    random = np.random.default_rng(2)
    drops = 0.8 * np.cumprod(np.exp(np.log(0.9) + 0.005 * random.normal(size=(4, 7))), axis=1)
    rows = [["Event time (s)", "Interval (s)", ""] * 4]
    rows += [[f"{each:.6f}" for own in drops for each in (own[: k + 1].sum(), own[k], np.nan)] for k in range(7)]
    spreadsheet(tmp_path / "data_golfball.xlsx", rows)
    code, found = table(tool, capsys, tmp_path, "bounces")
    assert (code, found[0][0], found[0][4]) == (0, "restitution, 4 drops", "agrees")
    assert number(found[0][3])[0] == pytest.approx(0.9, abs=0.005)


def spreadsheet(path, rows):
    """Write a minimal workbook of one sheet."""

    def cell(text):
        try:
            float(text)
        except ValueError:
            return f'<c t="inlineStr"><is><t>{text}</t></is></c>'
        return "<c/>" if text == "nan" else f"<c><v>{text}</v></c>"

    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    packed = "http://schemas.openxmlformats.org/package/2006/relationships"
    body = "".join("<row>" + "".join(map(cell, row)) + "</row>" for row in rows)
    with zipfile.ZipFile(path, "w") as file:
        file.writestr(
            "xl/worksheets/sheet1.xml", f'<worksheet xmlns="{main}"><sheetData>{body}</sheetData></worksheet>'
        )
        sheet = '<sheet name="80 cm" sheetId="1" r:id="r1"/>'
        book = f'<workbook xmlns="{main}" xmlns:r="{office}"><sheets>{sheet}</sheets></workbook>'
        file.writestr("xl/workbook.xml", book)
        link = f'<Relationship Id="r1" Target="worksheets/sheet1.xml" Type="{office}/worksheet"/>'
        file.writestr("xl/_rels/workbook.xml.rels", f'<Relationships xmlns="{packed}">{link}</Relationships>')


class _Named:
    """Pickled as the global name of a module, or as something that lies outside the pickle."""

    def __init__(self, module="", name="", outside=None):
        self.module, self.name, self.outside = module, name, outside


class _Pickler(pickle._Pickler):
    """Writes names of torch without torch."""

    def save(self, obj, save_persistent_id=True):
        if isinstance(obj, _Named) and not obj.outside:
            self.write(f"c{obj.module}\n{obj.name}\n".encode())
        else:
            super().save(obj, save_persistent_id)

    def persistent_id(self, obj):
        return obj.outside if isinstance(obj, _Named) else None


def saved(values):
    """Return a table as versions of torch before 1.6 save a tensor: five pickles and the numbers."""
    stream = io.BytesIO()
    for each in (0x1950A86A20F9469CFC6C, 1001, {"protocol_version": 1001, "little_endian": True}):
        pickle.dump(each, stream, protocol=2)
    storage = ("storage", _Named("torch", "DoubleStorage"), "1", "cpu", values.size, None)
    tensor = io.BytesIO()
    pickler = _Pickler(tensor, protocol=2)
    pickler.write(pickle.PROTO + bytes([2]))
    pickler.save(_Named("torch._utils", "_rebuild_tensor_v2"))
    pickler.save((_Named(outside=storage), 0, values.shape, (values.shape[1], 1), False, {}))
    pickler.write(pickle.REDUCE + pickle.STOP)
    stream.write(tensor.getvalue())
    pickle.dump(["1"], stream, protocol=2)
    return stream.getvalue() + struct.pack("<q", values.size) + values.astype("<f8").tobytes()


def tossed(seed):
    """Return poses of a cube that falls on a corner and rebounds with 0.3, in half edges."""
    random = np.random.default_rng(seed)
    time = np.arange(-25, 20) / 148.0 + random.uniform(0, 1 / 148.0)
    tilt = Rotation.from_euler("xy", [0.6, 0.5]).as_quat()
    corner = Rotation.from_quat(tilt).apply(np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]))
    speed = random.uniform(0.9, 1.3) / 0.0524
    gravity = 9.81 / 0.0524
    height = np.where(time < 0, -speed * time, 0.3 * speed * time) - 0.5 * gravity * time**2 - corner[:, 2].min()
    pose = np.zeros((len(time), 19))
    pose[:, 2], pose[:, 3:7] = height, np.roll(tilt, 1)
    return pose


def test_tosses_saved_by_torch(tool, tmp_path, capsys):
    folder = tmp_path / "tosses_processed"
    folder.mkdir()
    for k in range(15):
        (folder / f"{k}.pt").write_bytes(saved(tossed(k)))
    np.testing.assert_allclose(tool.poses(folder / "3.pt")[:, 2], 0.0524 * tossed(3)[:, 2])
    code, rows = table(tool, capsys, tmp_path, "cube")
    assert (code, rows[0][4]) == (0, "agrees")
    assert number(rows[0][3])[0] == pytest.approx(0.3, abs=0.01)


def test_a_record_that_shall_be_refused(tool, tmp_path, capsys):
    time = np.arange(4000) / 500
    angle = np.cumsum(np.clip(time - 4, 0, 1)) * 0.1
    lines = [f"{1e3 * t:.1f},{a:.2f}" for t, a in zip(time, angle, strict=True)]
    (tmp_path / "run8.csv").write_text("timestamp,total_angle\n" + "\n".join(lines))
    code, rows = table(tool, capsys, tmp_path, "flywheel")
    assert (code, rows[0][4]) == (0, "refused, as it shall be")
    assert "run8.csv: theta_loose_rad: does not run down" in rows[0][3]


def test_a_gear_motor_and_servo_logs(tool, tmp_path, capsys):
    time, angle = turned(lambda w: 231 + 6.2 * w, 39.0, 0.5)
    at = np.arange(0, 1.2, 0.005)
    whole = np.where(at < 1.0, 39.0 * at, 39.0 + np.interp(at - 1.0, time, angle))
    counts = np.floor(whole * 12 * 29.861 / (2 * np.pi))
    lines = [f"{7000 + 1e3 * t:.0f},\t{c:.0f},\t0,\t{4 * (t < 1.0):d},\t0" for t, c in zip(at, counts, strict=True)]
    (tmp_path / "encoders1.csv").write_text(
        "time,   leftEncoder,   rightEncoder,   leftMode,   rightMode\n" + "\n".join(lines)
    )
    code, rows = table(tool, capsys, tmp_path, "gearmotor")
    assert (code, rows[0][4]) == (0, "agrees")
    value, half = number(rows[0][3])
    assert abs(value - (231 + 6.2 * 20)) < half
    random = np.random.default_rng(5)
    pose = np.repeat(random.choice([1947, 2047, 2147], 30), 9) + random.integers(-2, 3, 270)
    lines = [f"2025-11-09T09:{k // 600:02d}:{k / 10 % 60:06.3f}Z,1947,{c},{c // 30},0" for k, c in enumerate(pose)]
    header = "timestamp,target pos (1),pos (1),speed (1),load (1)"
    (tmp_path / "motor_telemetry_single.csv").write_text(
        header + "\n2025-11-09T09:00:00.000Z,1947,,,\n" + "\n".join(lines)
    )
    code, rows = table(tool, capsys, tmp_path, "servo")
    assert (code, rows[0][4]) == (0, "refused, as it shall be")
    assert "quadrature" not in rows[0][3]


def test_no_folder_is_one_line_and_nothing_there_is_reported(tool, tmp_path, capsys):
    with pytest.raises(SystemExit):
        tool.main([str(tmp_path / "gone")])
    assert "is no folder" in capsys.readouterr().err
    assert tool.main([str(tmp_path)]) == 0
    err = capsys.readouterr().err
    assert err.count("not there:") == len(tool.RECORDS)


def test_few_readings_and_steady_torques_are_reported_or_refused_in_one_line(tool, tmp_path, capsys):
    minutes = np.arange(0, 14, 2)
    rows = "\n".join(f"{m}\t{690.0 * np.exp(-6.5e-4 * 60 * m):.0f}" for m in minutes)
    (tmp_path / "tab1.txt").write_text("Zeit [min]\tw[rpm] fehler: +/-2\n" + rows)
    _, found = table(tool, capsys, tmp_path, "gyroscope")
    assert number(found[0][2])[0] == pytest.approx(6.5e-4, rel=0.02)
    assert found[0][4] in ("agrees", "refused")
    rpm = np.linspace(3, 97, 25)
    torque = -0.85 + 0.01 * rpm * np.pi / 30 + 0.005 * np.sin(np.arange(25))
    lines = [f"{k},{n:.6f},{t:.6f}" for k, (n, t) in enumerate(zip(rpm, torque, strict=True))]
    (tmp_path / "Tare-torque.csv").write_text("\n".join(["run,rpm,tare_torque", *lines]))
    _, found = table(tool, capsys, tmp_path, "tare")
    assert number(found[1][2])[0] == pytest.approx(-0.01, rel=0.2)
    assert {row[4] for row in found} <= {"agrees", "refused"}
