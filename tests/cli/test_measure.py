"""``gears3d segment``: a map proposed, several records by one map, each into a folder of its own."""

import json
import re

import numpy as np
import pytest

from gears3d import cli
from gears3d.scenario import load
from gears3d.simulation import record

RIG = "scenarios/rigaud-2020/fig5-20rpm.toml"


def run(arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main([str(each) for each in arguments])
    return stop.value.code or 0


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A folder with a record as Parquet and as a bench's own text."""
    folder = tmp_path_factory.mktemp("bench")
    taken = record(load(RIG, {"run.duration": "1 s"}))
    taken.write(folder / "plain.parquet")
    record(load(RIG, {"run.duration": "1 s"}), seed=2).write(folder / "later.parquet")
    time, drive, loose = (taken.signals[name] for name in ("time_s", "theta_drive_rad", "theta_loose_rad"))
    table = np.stack([1e3 * time, np.degrees(drive), -np.degrees(loose)], axis=1)
    lines = ["Prüfstand 3", "Zeit [ms];Antrieb [deg];Abtrieb [deg]"]
    lines += [";".join(repr(float(each)).replace(".", ",") for each in row) for row in table]
    (folder / "bench.txt").write_text("\n".join(lines), encoding="latin-1")
    return folder


@pytest.mark.slow
def test_guess_then_measure_comes_to_what_the_plain_record_says(bench, capsys):
    chart = bench / "record.toml"
    assert run(["inspect", bench / "bench.txt", "--guess", "--rig", RIG]) == 0
    printed = capsys.readouterr().out
    assert run(["inspect", bench / "bench.txt", "--guess", "--rig", RIG, "--out", chart]) == 0
    assert [line for line in printed.splitlines() if "file" not in line] == [
        line for line in chart.read_text().splitlines() if "file" not in line
    ]
    capsys.readouterr()
    assert run(["segment", chart, "--rig", RIG, "--json"]) == 0
    mapped = json.loads(capsys.readouterr().out)
    assert run(["segment", bench / "plain.parquet", "--rig", RIG, "--json"]) == 0
    plain = json.loads(capsys.readouterr().out)
    assert mapped["impacts"] == plain["impacts"] > 10
    assert mapped["flanks"]["backlash_m"]["value"] == pytest.approx(plain["flanks"]["backlash_m"]["value"], rel=1e-6)


@pytest.mark.slow
def test_several_records_go_into_folders_of_their_own(bench, tmp_path, capsys):
    chart = bench / "several.toml"
    chart.write_text(
        'format = 1\n[[record]]\nfile = "plain.parquet"\ncondition.drag.torque = "0.3 N m"\n'
        '[[record]]\nfile = "later.parquet"\n'
        '[[record]]\nfile = "bench.txt"\ntime.channel = "Zeit"\ndrive.channel = "Antrieb"\n'
        'loose = { channel = "Abtrieb", sign = -1 }\n'
    )
    code = run(["segment", "--map", chart, "--rig", RIG, "--out", tmp_path, "--json", "--correct", "duplicated-file"])
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    assert code == 0
    assert [each["file"].rpartition("/")[2] for each in found] == ["plain.parquet", "later.parquet"]
    assert "excluded" in printed.err  # bench.txt holds the readings of plain.parquet
    assert sorted(path.name for path in tmp_path.iterdir()) == ["later", "plain"]
    for place in ("later", "plain"):
        told = json.loads((tmp_path / place / "summary.json").read_text())
        assert {"active", "reverse"} == told["contact_orders"].keys() == told["durations"].keys()
        page = (tmp_path / place / "report.html").read_text(encoding="utf-8")
        assert 'class="strip"' in page
        linked = set(re.findall('href="([^"#]+)"', page))
        assert linked == {"impacts.parquet", "measured.png", "signals.parquet", "summary.json"}
        assert all((tmp_path / place / name).is_file() for name in linked)


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ([], 2, "name a measured record"),
        (["--guess"], 2, "name one or several of one rig"),
        (["a.toml", "--guess"], 2, "is already a map"),
        (["none.tdms"], 3, "none.tdms: is not there"),
        (["none.csv", "gone.csv", "--rig", RIG], 3, "gone.csv: is not there"),
        (["none.csv", "--guess"], 3, "none.csv: is not there"),
        (["none.toml"], 3, "none.toml: is not there"),
    ],
)
def test_what_cannot_be_is_told(arguments, code, message, capsys):
    assert run(["segment", *arguments]) == code
    assert message in capsys.readouterr().err


def test_a_condition_that_the_rig_has_not_is_told_by_the_map(bench, capsys):
    chart = bench / "wrong.toml"
    chart.write_text('format = 1\nfile = "plain.parquet"\n[condition]\ndrag.torqe = "0.3 N m"\n')
    assert run(["segment", chart, "--rig", RIG]) == 3
    told = capsys.readouterr().err
    assert "wrong.toml" in told
    assert "condition.drag.torqe" in told
    assert "'torque'" in told
