"""``gears3d sweep`` at the command line."""

import json

import pytest

from gears3d.cli import main
from gears3d.sweep import open_dataset

FILE = "scenarios/rigaud-2020/fig5-20rpm.toml"
ASK = ["sweep", FILE, "--vary", "drag.torque=0.2..0.8 N m lin 4", "--periods", "8", "--settle", "2", "--workers", "0"]


def told(capsys, *arguments):
    with pytest.raises(SystemExit) as caught:
        main([*arguments])
    return caught.value.code, *capsys.readouterr()


def test_a_sweep_tells_what_became_of_it_and_what_it_wrote(tmp_path, capsys):
    code, out, _ = told(capsys, *ASK, "--out", str(tmp_path / "a"), "--json")
    answer = json.loads(out)
    assert code == 0
    assert (answer["points"], answer["done"], answer["resumed"]) == (4, 4, 0)
    assert answer["dims"] == {"drag_torque": 4}
    assert answer["files"][0].endswith("/sweep.nc")
    assert all((tmp_path / "a" / path.rpartition("/")[2]).exists() for path in answer["files"])
    code, out, _ = told(capsys, *ASK, "--out", str(tmp_path / "a"), "--no-pictures")
    assert code == 0
    assert out.splitlines()[0].startswith("4 points (4 drag_torque)")
    with open_dataset(tmp_path / "a") as data:
        assert data.attrs["command"].startswith("gears3d")


@pytest.mark.parametrize(
    ("more", "code", "words"),
    [
        (["--vary", "drag.torqe=1..2 N m lin 3"], 3, "did you mean 'drag.torque'"),
        (["--vary", "impact.restitution=0.1..0.2 mm lin 3"], 3, "is a length, not a plain number"),
        (["--vary", "impact.restitution=0..0.5 lin 0"], 3, "the grid would be empty"),
        (["--measure", "regime,speed"], 3, "there is no measure 'speed'"),
        (["--point-limit", "3 Hz"], 3, "is a frequency, not a time"),
        (["--longest", "0 s"], 3, "give a time above 0 s"),
        (["--block", "0"], 2, "--block 0"),
        (["--follow", "impact.restitution"], 3, "is not varied"),
        (["--scheduler", "127.0.0.1"], 3, "is not an address"),
        (["--scheduler", "tcp://127.0.0.1:9"], 3, "does not answer within 0.3 s"),
    ],
)
def test_what_cannot_be_swept_is_told_with_a_remedy(more, code, words, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("gears3d.sweep.cluster.ANSWER_S", 0.3)
    found, _, error = told(capsys, *ASK, *more, "--out", str(tmp_path / "a"))
    assert found == code
    assert words in error.replace("\n       ", " ")
    assert "Traceback" not in error
