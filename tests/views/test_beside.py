"""The film of a diagnosis: what was measured, the rig and the extended rig, each in its place and with its colours."""

import sys

import numpy as np
import pytest
from rerun.chunk import RrdReader

from gears3d.cli import main
from gears3d.diagnosis.validity import PERIODS, excerpt
from gears3d.views.replay import scene as colours
from gears3d.views.replay import viewer
from gears3d.views.replay.document import NAMES, beside, off
from tests.views.test_replay import columns, seconds
from tests.views.test_replay_viewer import painted, share


@pytest.fixture(scope="module")
def seen(found, admitted):
    return excerpt(found, admitted)


@pytest.fixture(scope="module")
def rrd(found, seen, tmp_path_factory):
    folder = tmp_path_factory.mktemp("beside")
    return beside(seen, tuple(one.kind for one in found.causes), folder / "replay.rrd")


@pytest.fixture(scope="module")
def chunks(rrd):
    return [chunk for chunk in RrdReader(str(rrd)).stream().to_chunks() if not chunk.is_static]


def rest(seen, one):
    place = np.interp(seen.measured.time, one.time, one.signals["displacement_m"])
    return float(np.sqrt(np.mean((place - seen.measured.signals["displacement_m"]) ** 2)))


@pytest.mark.slow
def test_extended_rig_goes_where_the_record_went_and_the_base_does_not(seen, found):
    assert [one.kind for one in found.causes] == ["drag_viscous"]
    backlash = seen.rig.rig().backlash
    assert rest(seen, seen.extended) < 0.01 * backlash
    assert rest(seen, seen.base) > 5.0 * rest(seen, seen.extended)


def test_all_three_begin_alike_under_the_same_drive(seen):
    assert np.ptp(seen.measured.time) == pytest.approx(PERIODS * seen.rig.period, rel=2e-3)
    for one in (seen.base, seen.extended):
        place = np.interp(seen.measured.time[:8], one.time, one.signals["displacement_m"])
        apart = place - seen.measured.signals["displacement_m"][:8]
        assert abs(apart.mean()) < 2e-7  # noise of a sample: 1.6e-7
        drive = np.interp(seen.measured.time, one.time, one.signals["theta_drive_rad"])
        assert np.abs(drive - seen.measured.signals["theta_drive_rad"]).max() < 1e-6


def test_film_holds_all_three_on_one_time_line(chunks, seen):
    entities = {chunk.entity_path for chunk in chunks}
    for name in NAMES:
        assert {f"/{name}/loose/body", f"/{name}/contacts", f"/displacement/{name}", f"/touching/{name}"} <= entities
        table = columns(chunks, f"/displacement/{name}")
        one = getattr(seen, name)
        assert seconds(table["sim_time"]) == pytest.approx(one.time, abs=1e-9)
        assert np.ravel(table["Scalars:scalars"]) == pytest.approx(1e6 * one.signals["displacement_m"])
    assert all(set(chunk.timeline_names) == {"sim_time"} for chunk in chunks)
    shown = [seconds(columns(chunks, f"/{name}/loose/body")["sim_time"]) for name in NAMES]
    assert np.array_equal(shown[0], shown[1])
    assert np.array_equal(shown[0], shown[2])


def test_states_of_the_measured_gear_are_those_of_the_extended_rig(chunks):
    words, times = {}, {}
    for name in NAMES:
        table = columns(chunks, f"/touching/{name}")
        words[name] = np.array([row[0] for row in table["StateChange:state"]])
        times[name] = seconds(table["sim_time"])
    grid = np.linspace(max(time[0] for time in times.values()), max(time[-1] for time in times.values()), 4000)
    lane = {name: words[name][np.searchsorted(times[name], grid, side="right") - 1] for name in NAMES}
    assert set(lane["measured"]) >= {"flight", "active flank"}
    assert np.mean(lane["measured"] == lane["extended"]) > 0.95
    assert np.mean(lane["measured"] == lane["base"]) < np.mean(lane["measured"] == lane["extended"])


def test_text_tells_how_far_both_are_off(seen, rrd):
    said = off(seen)
    assert f"base {1e6 * rest(seen, seen.base):.3g} um" in said
    assert f"extended {1e6 * rest(seen, seen.extended):.3g} um" in said


@pytest.mark.viewer
def test_viewer_paints_three_zones_side_by_side(rrd):
    try:
        with viewer.Headless(rrd, (1280, 720)) as window:
            begin, end = window.span()
            picture = painted(window, 0.5 * (begin + end), "")
    except viewer.ViewerError as error:
        pytest.skip(str(error))
    for third in np.split(picture[60:300, :1278], 3, axis=1):
        assert share(third[:, :150], colours.DRIVE, 40) > 0.25
        assert share(third[:, -150:], colours.LOOSE, 40) > 0.25
        assert min(share(third, colour) for colour in colours.FLANKS) > 0.002
    curves = picture[330:530]
    assert min(share(curves, colour) for colour in (colours.LINE, colours.EXTENDED, colours.TWIN)) > 1e-4


def run_verb(hidden, found, out, patch, *more):
    patch.setattr("gears3d.diagnosis.diagnose", lambda *about, **how: found)
    arguments = [str(hidden / "record.toml"), "--rig", str(hidden / "rig.toml"), "--out", str(out), *more]
    with pytest.raises(SystemExit) as stop:
        main(["diagnose", *arguments])
    return stop.value.code or 0


def test_verb_writes_it_unless_told_not_to(hidden, found, tmp_path, monkeypatch):
    assert run_verb(hidden, found, tmp_path, monkeypatch, "--no-replay") == 0
    assert not (tmp_path / "replay.rrd").exists()
    assert run_verb(hidden, found, tmp_path, monkeypatch) == 0
    assert (tmp_path / "replay.rrd").stat().st_size > 100_000


def test_verb_without_rerun_tells_the_remedy(hidden, found, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "rerun", None)
    assert run_verb(hidden, found, tmp_path, monkeypatch) == 0
    assert 'pip install "gears3d[replay]"' in capsys.readouterr().err
    assert (tmp_path / "report.html").exists()
    assert not (tmp_path / "replay.rrd").exists()
