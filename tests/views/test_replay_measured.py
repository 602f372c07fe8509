"""A measured record in the replay: what touches is what was measured, not what the rig would have."""

import json

import numpy as np
import pytest

from gears3d import load
from gears3d.cli import main
from gears3d.measured.segmentation import measure
from gears3d.simulation import record
from gears3d.views.plots.section import Motion, Section, as_measured, frames, is_measured

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
BENCH = {"run.duration": "1 s"}
CLAIMED = {**BENCH, "mount.backlash": "200 um"}
"""The rig as somebody believes it to be: the bench has 250 um."""


@pytest.fixture(scope="module")
def taken():
    return record(load(FIG5, BENCH), model="rigid")


@pytest.fixture(scope="module")
def found(taken):
    return measure(taken, load(FIG5, CLAIMED))


def test_the_pair_has_the_backlash_that_was_measured(found):
    pair = as_measured(load(FIG5, CLAIMED).pair(), found.recording)
    assert is_measured(found.recording)
    assert pair.backlash == pytest.approx(250e-6, abs=0.5e-6)


def test_frames_show_the_state_that_was_measured(found):
    section = Section(as_measured(load(FIG5, CLAIMED).pair(), found.recording))
    motion = Motion(found.recording, section)
    some = np.linspace(0.1, 0.9, 4001)
    shown = frames(motion, some)
    cut = found.segments.states(some)
    assert np.mean(shown.flank == np.where(cut == 2, -1, cut)) > 0.999
    assert set(shown.flank) == {-1, 0, 1}
    assert set(np.unique(shown.share[shown.flank == 1])) == {1.0}


def test_a_simulation_shows_its_own_pair(taken):
    pair = load(FIG5, CLAIMED).pair()
    assert not is_measured(taken)
    assert as_measured(pair, taken) is pair


def test_the_command_line(taken, tmp_path, capsys):
    rattle = taken.write(tmp_path / "rattle.parquet")

    def run(*arguments):
        with pytest.raises(SystemExit) as end:
            main(["replay", str(rattle), "--no-open", *arguments])
        said = capsys.readouterr()
        return end.value.code, said.out, said.err

    code, out, _ = run("--rig", FIG5, "--json")
    assert code == 0
    assert json.loads(out)["replay"] == str(tmp_path / "rattle.rrd")
    assert (tmp_path / "rattle.rrd").read_bytes()[:3] == b"RRF"
    code, _, err = run("--rig", FIG5, "--at", "7")
    assert code == 3
    assert "outside the record" in err
