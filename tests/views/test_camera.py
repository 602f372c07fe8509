"""The camera shows what the recording says: pairs, states, gaps, at the published instants and as drawn."""

import json
import sys
from io import BytesIO

import numpy as np
import pytest
import shapely

from gears3d import load, simulate
from gears3d.cli import main
from gears3d.errors import InputError, MissingExtraError, UsageError
from gears3d.measured.segmentation import measure
from gears3d.simulation import record
from gears3d.views.camera import Look, camera, measured, shots, strip, subject, write_film
from gears3d.views.camera.subject import named
from gears3d.views.camera.subject import picture_table as table
from gears3d.views.plots.section import _gear, colour_of

STRIP = "scenarios/rigaud-2020/fig8-strip.toml"
PAIRS = [(1,), (6, 7), (12,), (18,), (24,), (29, 30), (35,), (40, 41), (46,)]
STATES = ["active", "active", "flight", "flight", "reverse", "reverse", "flight", "flight", "active"]


@pytest.fixture(scope="module")
def scenario():
    return load(STRIP)


@pytest.fixture(scope="module")
def seen(scenario):
    return subject(simulate(scenario, "rigid"), scenario)


@pytest.fixture(scope="module")
def nine(seen):
    return shots(seen, 9, 2.95 * seen.period, seen.period)


def test_the_published_pairs_and_eight_of_the_nine_published_states(nine):
    """Rigaud & Perret-Liaudet 2020, fig. 8; the ninth is at T/4, where contact ends just after the picture."""
    assert [shot.pairs for shot in nine] == PAIRS
    right = [shot.state == published for shot, published in zip(nine, STATES, strict=True)]
    assert right == [True, True, False] + [True] * 6


def test_forty_five_pairs_pass_in_a_period(nine):
    assert nine[-1].place - nine[0].place == pytest.approx(45.0, abs=1e-6)  # 90 rpm, 90 teeth, 3 Hz


def test_gaps_are_those_of_the_closed_form(seen, nine):
    """Flight under constant drag: s = (ΔV/ω)(cos ωt − cos ωt0) + ẏ0·τ − F/(2m)·τ², eq. (19) without an impact."""
    swing, wave = seen.pair.drive.base_radius * np.pi / 6.0, 6.0 * np.pi
    slowing = 0.22 / 0.0695 * seen.pair.loose.base_radius
    lost = np.arccos(-slowing / (wave * swing)) / wave
    time = nine[3].time % seen.period
    since = time - lost
    path = swing * np.sin(wave * lost) * since - 0.5 * slowing * since**2
    path += swing / wave * (np.cos(wave * time) - np.cos(wave * lost))
    assert nine[3].gaps[0] == pytest.approx(path, abs=2e-9)
    assert sum(nine[3].gaps) == pytest.approx(400e-6, rel=1e-9)


@pytest.mark.parametrize("factor", [1.0, None])
@pytest.mark.parametrize("right", [False, True])
def test_teeth_are_drawn_touching_where_they_touch_and_apart_where_they_fly(seen, nine, factor, right):
    """Distance of the drawn outlines, measured by another geometry library, against the gaps times the factor."""
    look = Look(seen.pair, factor, drive_right=right)
    fine = 1e3 * 2e-4 * 2.0 * look.half[1]
    for shot in nine:
        drive, loose = (shapely.LineString(_gear(look, shot, which).teeth.reshape(-1, 2)) for which in (0, 1))
        drawn = 1e3 * look.factor * np.array([shot.share, 1.0 - shot.share]) * seen.pair.backlash
        assert drive.distance(loose) == pytest.approx(drawn.min(), abs=fine)


def test_a_tooth_has_the_number_under_which_the_recording_has_it(seen, nine):
    hits = seen.motion.recording.impacts
    late = np.flatnonzero((hits["flank"] == 0) & (hits["time_s"] > seen.period))[0]
    shot = shots(seen, 1, float(hits["time_s"][late]), 0.0)[0]
    teeth = table(seen, shot)
    assert hits["tooth_drive"][late] in teeth["teeth_drive"]
    assert hits["tooth_loose"][late] in teeth["teeth_loose"]


def test_pairs_meet_at_the_pitch_point_when_they_are_named(seen, nine):
    """The middle of the drawn pair that is named alone is within a third of a pitch of the pitch point's height."""
    look = Look(seen.pair, 1.0)
    pitch = 1e3 * seen.pair.drive.base_pitch / np.cos(seen.pair.working_pressure_angle)
    for shot in nine:
        gear = _gear(look, shot, 0)
        shape = look.outlines[0]
        flank = shape.root + shape.fillet + shape.flank + shape.tip
        for number in shot.pairs:
            points = gear.teeth[list(gear.numbers).index(number - shot.first)][flank : flank + shape.flank + 1]
            at_pitch = np.interp(0.0, np.hypot(*(points - gear.axis).T)[::-1] - np.hypot(*gear.axis), points[::-1, 1])
            assert abs(at_pitch / pitch) < (1 / 3 if len(shot.pairs) == 1 else 2 / 3) + 0.01


def test_what_two_numbers_mean():
    assert [named(12 + part) for part in (0.0, 0.32, 0.34, 0.66, 0.68)] == [(12,), (12,), (12, 13), (12, 13), (13,)]


def pixels(seen, look, pictures):
    from matplotlib.image import imread

    picture = BytesIO()
    strip(seen, look, pictures).savefig(picture, format="png", dpi=60)
    picture.seek(0)
    return imread(picture)[..., :3]


def near(image, colour):
    want = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return int((np.abs(image - want).max(axis=2) < 0.04).sum())


def test_the_colours_are_those_of_the_states(seen, nine):
    look = Look(seen.pair)
    for chosen, flank in ((nine[0], 0), (nine[4], 1)):
        image = pixels(seen, look, (chosen,))
        assert near(image, colour_of(flank)) > 3 * near(image, colour_of(1 - flank))


def test_backlit_pictures_are_without_colour(seen, nine):
    image = pixels(seen, Look(seen.pair, backlit=True), nine[:1])
    half = image[60 : image.shape[0] // 2]
    assert (half.max(axis=2) - half.min(axis=2)).max() < 0.02
    assert (half < 0.1).mean() > 0.3


def test_without_a_start_it_begins_in_contact_after_settling(seen, scenario):
    start = seen.begin(seen.period)
    assert start >= scenario.run.settle
    assert shots(seen, 1, start, 0.0)[0].state == "active"


def test_a_measured_record_shows_what_was_simulated(seen):
    """The record of the same scenario through encoders: the same states and gaps to within what it can tell."""
    bench = load(STRIP, {"run.duration": "4 periods"})
    found = measured(measure(record(bench, model="rigid"), bench), bench)
    assert found.pair.backlash == pytest.approx(400e-6, abs=1e-6)
    time = np.linspace(1.0, 3.5, 400) * seen.period
    same = found.flank(time) == seen.flank(time)
    assert same.mean() > 0.97
    assert np.abs(found.gaps(time)[0] - seen.gaps(time)[0]).max() < 3e-6
    assert not found.placed


@pytest.mark.parametrize(
    ("setting", "word"),
    [({"zoom": "moon"}, "zoom"), ({"exaggerate": 0.5}, "exaggerate"), ({"exaggerate": 60.0}, "auto")],
)
def test_what_cannot_be_drawn_is_refused(seen, setting, word):
    with pytest.raises(InputError, match=word):
        Look(seen.pair, **setting)


def test_python_takes_the_pictures_that_notebooks_show(seen, scenario, tmp_path):
    taken = camera(seen.motion.recording, scenario, frames=3, over=0.1, at=1.0, exaggerate=2.0, numbers="teeth")
    assert repr(taken) == "<3 pictures of the mesh from 1 s over 0.1 s, gap drawn 2 times as wide>"
    assert [one["time_s"] for one in taken.table()] == pytest.approx([1.0, 1.05, 1.1])
    assert taken._repr_png_().startswith(b"\x89PNG")
    assert taken.save(tmp_path / "few.pdf").stat().st_size > 5_000
    with pytest.raises(InputError, match="did you mean"):
        camera(seen.motion.recording, scenario, drive="lft")
    with pytest.raises(InputError, match="over"):
        camera(seen.motion.recording, scenario, over="3 apples")


def test_the_command_line(seen, scenario, tmp_path, capsys):
    from gears3d.runs import RunFolder

    with RunFolder(tmp_path / "run") as folder:
        folder.write_scenario(scenario, "")
        folder.write_recording(seen.motion.recording)
        folder.write_summary({"format": 1})
        folder.commit()

    def run(*arguments):
        with pytest.raises(SystemExit) as end:
            main(["camera", *map(str, arguments)])
        said = capsys.readouterr()
        return end.value.code, said.out, said.err

    picture = tmp_path / "strip.svg"
    code, out, _ = run(tmp_path / "run", "--at", "2.95 periods", "--out", picture, "--json")
    told = json.loads(out)
    assert code == 0
    assert picture.stat().st_size > 10_000
    assert [tuple(frame["pairs"]) for frame in told["frames"]] == PAIRS
    assert told["exaggeration"] == 5.0
    taken = camera(seen.motion.recording, scenario, at="2.95 periods")
    assert json.loads(json.dumps(taken.table())) == told["frames"]
    assert run(tmp_path / "run", "--at", "9 s", "--out", picture)[0] == 3
    for option, value in (("--over", "3 apples"), ("--at", "noon"), ("--zoom", "moon"), ("--exaggerate", "0.5")):
        code, _, said = run(tmp_path / "run", option, value, "--out", picture)
        assert code == (2 if option == "--zoom" else 3)
        assert option in said
    assert run(tmp_path / "run", "--drive", "up", "--out", picture)[0] == 2
    assert "summary.json" in run(tmp_path, "--out", picture)[2]


def test_a_film_has_its_frames_and_says_how_slow_it_is(seen, tmp_path):
    av = pytest.importorskip("av")
    place = tmp_path / "film.mp4"
    told = write_film(place, seen, Look(seen.pair), (2.0 * seen.period, 12 / 12_800), rate=12_800, slow=1280)
    assert told == {
        "video": str(place), "camera_Hz": 12_800, "slowed": 1280, "played_Hz": 10.0, "frames": 13, "size": [640, 400]
    }  # fmt: skip
    with av.open(str(place)) as film:
        assert (film.streams.video[0].average_rate, film.streams.video[0].codec_context.name) == (10, "h264")
        pictures = [frame.to_ndarray(format="rgb24") / 255 for frame in film.decode(video=0)]
    assert len(pictures) == 13
    assert pictures[0].shape == (400, 640, 3)
    state = shots(seen, 1, 2.0 * seen.period, 0.0)[0].flank
    assert state >= 0
    assert near(pictures[0], colour_of(state)) > 50


@pytest.mark.parametrize(
    ("name", "more", "word"),
    [("a.avi", {}, "mp4"), ("a.mp4", {"slow": 1.0}, "--slow"), ("a.mp4", {"rate": 1e6}, "fewer|less")],
)
def test_films_that_cannot_be_are_refused(seen, tmp_path, name, more, word):
    pytest.importorskip("av")
    with pytest.raises((UsageError, InputError), match=word):
        write_film(tmp_path / name, seen, Look(seen.pair), (1.0, seen.period), **more)
    assert not list(tmp_path.iterdir())


def test_without_an_encoder_it_says_how_to_get_one(seen, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(MissingExtraError, match=r'pip install "gears3d\[video\]"'):
        write_film(tmp_path / "a.mp4", seen, Look(seen.pair), (1.0, 0.01))
