"""The tour: one period, the events in their order, as replay, MP4 and GIF, simulated and measured."""

import numpy as np
import pytest
from PIL import Image
from rerun.chunk import RrdReader

from gears3d import load, replay, simulate
from gears3d.cli import main
from gears3d.errors import UsageError
from gears3d.measured.segmentation import measure
from gears3d.simulation import record
from gears3d.views.camera import measured, subject, write_tour
from gears3d.views.camera.film import events, stretch

NAME = "rigaud-2020/fig5-20rpm"
ROUND = ["contact loss", "flight", "impact", "bounce", "contact"]


@pytest.fixture(scope="module")
def scenario():
    return load(NAME, {"run.duration": "2 s"})


@pytest.fixture(scope="module")
def recording(scenario):
    return simulate(scenario, "rigid")


@pytest.fixture(scope="module")
def seen(recording, scenario):
    return subject(recording, scenario)


def without_repeats(kinds):
    return [kind for k, kind in enumerate(kinds) if not k or kinds[k - 1] != kind]


def test_a_period_is_contact_loss_flight_impact_bounces_and_contact_on_both_flanks(seen):
    start, lasts = stretch(seen)
    told = events(seen, start, lasts)
    assert lasts == pytest.approx(1.0 / 3.0)
    assert without_repeats([one.kind for one in told]) == ["contact", *ROUND, *ROUND]
    hits = seen.motion.recording.impacts
    inside = (hits["time_s"] >= start) & (hits["time_s"] <= start + lasts)
    assert [one.time for one in told if one.kind in ("impact", "bounce")] == hits["time_s"][inside].tolist()
    first = next(one for one in told if one.kind == "impact")
    assert "reverse flank at 30.9 mm/s" in first.words
    assert [one.time for one in told] == sorted(one.time for one in told)


def test_a_measured_record_has_the_same_tour(seen, scenario):
    found = measured(measure(record(scenario, model="rigid"), scenario), scenario)
    kinds = [without_repeats([one.kind for one in events(one, *stretch(one))]) for one in (seen, found)]
    assert kinds[0] == kinds[1]


def test_without_an_impact_the_tour_is_one_contact():
    quiet = load(NAME, {"run.duration": "2 s", "motion.harmonics": [], "run.settle": "0 s"})
    told = events(*(lambda one: (one, *stretch(one)))(subject(simulate(quiet, "rigid"), quiet)))
    assert [one.kind for one in told] == ["contact"]


@pytest.mark.slow
def test_a_gif_repeats_and_stops_at_each_event(seen, tmp_path):
    told = write_tour(tmp_path / "tour.gif", seen)
    stops = sum(one.stops for one in events(seen, told["start_s"], told["lasts_s"]))
    with Image.open(tmp_path / "tour.gif") as film:
        lasting = 0
        for number in range(film.n_frames):
            film.seek(number)
            lasting += film.info["duration"]
        assert film.info["loop"] == 0
    assert lasting / 1000.0 == pytest.approx(12.0 + stops, rel=0.03)
    assert {one["kind"] for one in told["captions"]} == set(ROUND)


@pytest.mark.slow
def test_an_mp4_has_its_pictures(seen, tmp_path):
    av = pytest.importorskip("av")
    told = write_tour(tmp_path / "tour.mp4", seen)
    with av.open(str(tmp_path / "tour.mp4")) as film:
        assert sum(1 for _ in film.decode(video=0)) == told["frames"]
        assert film.streams.video[0].average_rate == 25


def test_the_replay_of_a_tour_has_one_period_and_its_captions(recording, scenario, seen, tmp_path):
    place = replay(recording, scenario, out=tmp_path / "tour.rrd", tour=True)
    start, lasts = stretch(seen)
    tables = {}
    for chunk in RrdReader(str(place)).stream().to_chunks():
        if not chunk.is_static:
            tables.setdefault(chunk.entity_path, []).append(chunk.to_record_batch().to_pydict())
    said = [words for table in tables["/caption"] for words in table["TextDocument:text"]]
    assert len(said) == len(events(seen, start, lasts))
    assert any("Loss of contact" in str(words) for words in said)
    time = np.concatenate([table["sim_time"] for table in tables["/displacement/loose_gear"]])
    ends = [one.value * 1e-9 if hasattr(one, "value") else one / np.timedelta64(1, "s") for one in (time[0], time[-1])]
    assert np.diff(ends)[0] == pytest.approx(lasts, rel=1e-3)


def test_a_tour_shows_one_recording(recording, scenario, tmp_path, capsys):
    with pytest.raises(UsageError, match="one"):
        replay([(recording, scenario)] * 2, out=tmp_path / "tour.rrd", tour=True)
    with pytest.raises(UsageError, match="mp4"):
        write_tour(tmp_path / "tour.avi", subject(recording, scenario))
    for words in (["a", "b", "--tour"], ["a", "--tour", "--at", "1"]):
        with pytest.raises(SystemExit) as stop:
            main(["replay", *words])
        assert stop.value.code == 2
        assert "--tour" in capsys.readouterr().err
