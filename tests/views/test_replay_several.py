"""Several recordings in one replay: each in its place, measured ones in phase, and what is refused."""

import json

import numpy as np
import pytest
from rerun.chunk import RrdReader

from gears3d.cli import main
from gears3d.errors import InputError, UsageError
from gears3d.recording import Recording
from gears3d.runs import RunFolder
from gears3d.scenario import load
from gears3d.views.replay import replay, viewer
from gears3d.views.replay import scene as colours
from gears3d.views.replay.document import Shown, several
from tests.views.film import FREQUENCY, film
from tests.views.test_replay import ROOT, columns, seconds
from tests.views.test_replay_viewer import painted, share

EARLIER = 0.07


@pytest.fixture(scope="module")
def scenario():
    return load(ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml")


def phased(recording, by=0.0, **meta):
    """The recording with its impacts' phases, its clock set back."""
    impacts = {**recording.impacts, "phase_rad": np.mod(2 * np.pi * FREQUENCY * recording.impacts["time_s"], 2 * np.pi)}
    impacts["time_s"] = impacts["time_s"] - by
    return Recording({**recording.signals, "time_s": recording.time - by}, impacts, {**recording.meta, **meta})


@pytest.fixture(scope="module")
def shown(scenario):
    run = film(scenario)
    measured = phased(run, EARLIER, model="measured", backlash_m=scenario.pair().backlash)
    return [Shown("hard", phased(run), scenario), Shown("bench", measured, scenario)]


@pytest.fixture(scope="module")
def rrd(shown, tmp_path_factory):
    return several(shown, tmp_path_factory.mktemp("several") / "replay.rrd")


@pytest.fixture(scope="module")
def chunks(rrd):
    return [chunk for chunk in RrdReader(str(rrd)).stream().to_chunks() if not chunk.is_static]


def test_each_has_its_zone_curve_section_and_states(chunks):
    entities = {chunk.entity_path for chunk in chunks}
    for name in ("run_1", "run_2"):
        assert {f"/{name}/loose/body", f"/{name}/contacts", f"/{name}/impulses"} <= entities
        assert {f"/displacement/{name}", f"/touching/{name}", f"/poincare/{name}/active"} <= entities
    assert "/displacement/run_1_active_flank" in entities
    assert "/displacement/run_2_active_flank" not in entities  # the same flanks once


def test_what_was_measured_is_shown_in_phase(chunks, shown):
    first, second = (columns(chunks, f"/displacement/run_{k}") for k in (1, 2))
    grid = np.linspace(0.1, 0.9, 500)
    lines = [np.interp(grid, seconds(one["sim_time"]), np.ravel(one["Scalars:scalars"])) for one in (first, second)]
    assert np.abs(lines[0] - lines[1]).max() < 0.5  # um of 250
    own = np.interp(grid, shown[1].recording.time, shown[1].recording.signals["displacement_m"]) * 1e6
    assert np.abs(lines[0] - own).max() > 100.0


def test_other_fluctuations_keep_their_clock(shown, tmp_path):
    other = shown[1].scenario.with_({"motion.harmonics[0].frequency": "4 Hz"})
    path = several([shown[0], shown[1]._replace(scenario=other)], tmp_path / "a.rrd")
    chunks = [chunk for chunk in RrdReader(str(path)).stream().to_chunks() if not chunk.is_static]
    assert seconds(columns(chunks, "/displacement/run_2")["sim_time"])[0] == pytest.approx(-EARLIER)


@pytest.mark.parametrize("many", [0, 1, 5])
def test_two_to_four(shown, many, tmp_path):
    with pytest.raises(UsageError, match="2 to 4 recordings"):
        several([shown[0]] * many, tmp_path / "a.rrd")
    assert not list(tmp_path.iterdir())


def test_nothing_recorded(shown, tmp_path):
    empty = Recording({"time_s": [], "theta_drive_rad": [], "theta_loose_rad": []})
    with pytest.raises(InputError, match="bench: the recording is empty"):
        several([shown[0], shown[1]._replace(recording=empty)], tmp_path / "a.rrd")


def written(scenario, recording, place):
    with RunFolder(place) as folder:
        folder.write_scenario(scenario, "made by a test")
        folder.write_recording(recording)
        folder.write_summary({"status": "complete"})
        return folder.commit()


def test_verb_and_python_write_the_same(scenario, shown, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    runs = [written(scenario, shown[0].recording, tmp_path / name) for name in ("one", "two")]
    with pytest.raises(SystemExit) as stop:
        main(["replay", *map(str, runs), "--no-open", "--json"])
    assert not stop.value.code
    assert json.loads(capsys.readouterr().out)["replay"] == "replay.rrd"
    again = replay([runs[0], (shown[0].recording, scenario)], out="python.rrd")
    stores = [RrdReader(str(tmp_path / name)).stream().to_chunks() for name in ("replay.rrd", again)]
    entities = [{chunk.entity_path for chunk in store} for store in stores]
    assert entities[0] == entities[1]
    assert "/run_2/loose/body" in entities[0]


def test_verb_refuses_replays_among_them(rrd, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        main(["replay", str(rrd), str(rrd)])
    assert stop.value.code == 3
    assert "is already a replay" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.viewer
def test_viewer_paints_both_zones_and_all_curves(rrd, shown):
    try:
        with viewer.Headless(rrd, (1280, 720)) as window:
            picture = painted(window, shown[0].recording.impacts["time_s"][2] + 1e-3, "")
    except viewer.ViewerError as error:
        pytest.skip(str(error))
    for half in np.split(picture[60:300, :1280], 2, axis=1):
        assert share(half[:, 150:300], colours.DRIVE, 40) > 0.25
        assert share(half[:, -300:-150], colours.LOOSE, 40) > 0.25
    curves, bottom = picture[330:530], picture[560:]
    assert min(share(curves, colour) for colour in (colours.LINE, colours.TWIN)) > 1e-4
    assert min(share(bottom[:, 440:960], colour) for colour in colours.FLANKS) > 1e-4  # points of the sections
