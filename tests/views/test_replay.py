"""replay.rrd: what is in it, when marks are there, how large it is, and what happens to bad input."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from gears3d.cli import main
from gears3d.effects import Code, Gate, Row
from gears3d.errors import InputError, UsageError
from gears3d.recording import Recording
from gears3d.runs import RunFolder
from gears3d.scenario import load
from gears3d.views.plots.section import Motion, Section, frames
from gears3d.views.replay import replay, viewer
from tests.views.film import FREQUENCY, film

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def scenario():
    return load(ROOT / "scenarios/rigaud-2020/fig5-20rpm.toml")


@pytest.fixture(scope="module")
def recording(scenario):
    return film(scenario)


@pytest.fixture(scope="module")
def rrd(scenario, recording, tmp_path_factory):
    return replay(recording, scenario, recording, tmp_path_factory.mktemp("replay") / "replay.rrd")


@pytest.fixture(scope="module")
def chunks(rrd):
    return [chunk for chunk in RrdReader(str(rrd)).stream().to_chunks() if not chunk.is_static]


def columns(chunks, entity):
    tables = [chunk.to_record_batch().to_pydict() for chunk in chunks if chunk.entity_path == entity]
    assert tables, entity
    return {name: [value for table in tables for value in table[name]] for name in tables[0]}


def seconds(values):
    return (
        np.array([value.value if hasattr(value, "value") else value / np.timedelta64(1, "ns") for value in values])
        * 1e-9
    )


def test_the_viewer_accepts_it(rrd):
    done = subprocess.run([viewer.executable(), "rrd", "verify", str(rrd)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "1 file verified without error" in done.stdout + done.stderr
    assert len(RrdReader(str(rrd)).blueprints()) == 1


def test_entities_and_timelines(chunks):
    assert {chunk.entity_path for chunk in chunks} == {
        "/scene/drive/body",
        "/scene/loose/body",
        "/scene/contacts",
        "/scene/normals",
        "/scene/impulses",
        "/zone/drive/body",
        "/zone/loose/body",
        "/zone/contacts",
        "/zone/normals",
        "/zone/gaps",
        "/zone/impulses",
        "/displacement/loose_gear",
        "/displacement/by_twin",
        "/displacement/active_flank",
        "/displacement/reverse_flank",
        "/displacement/impacts_active",
        "/displacement/impacts_reverse",
        "/velocity/relative",
        "/velocity/impacts_active",
        "/velocity/impacts_reverse",
        "/speed",
        "/torque/drag",
        "/torque/loose_gear",
        "/poincare/active",
        "/poincare/reverse",
        "/touching",
        "/impacts",
    }
    for chunk in chunks:
        expected = {"sim_time", "impact"} if chunk.entity_path == "/impacts" else {"sim_time"}
        assert set(chunk.timeline_names) == expected, chunk.entity_path


def test_one_row_an_impact(chunks, recording):
    table = columns(chunks, "/impacts")
    assert table["impact"] == list(range(1, len(recording.impacts["time_s"]) + 1))
    assert seconds(table["sim_time"]) == pytest.approx(recording.impacts["time_s"], abs=1e-9)
    assert [text[0].split()[0] for text in table["TextLog:text"]] == ["reverse", "active"] * 3
    for code, word in enumerate(("active", "reverse")):
        shown = columns(chunks, f"/velocity/impacts_{word}")["Scalars:scalars"]
        here = recording.impacts["flank"] == code
        assert np.ravel(shown) == pytest.approx(recording.impacts["velocity_m_s"][here] * 1e3)


def present(chunks, entity, component, times):
    """How many marks the viewer shows at some instants: those of the latest row."""
    table = columns(chunks, entity)
    row = np.searchsorted(seconds(table["sim_time"]), times, side="right") - 1
    return np.array([len(table[component][i] or []) if i >= 0 else 0 for i in row])


@pytest.mark.parametrize("scene", ["/scene", "/zone"])
def test_contacts_are_there_in_contact_and_cleared_in_flight(chunks, scenario, recording, scene):
    half = 0.5 / FREQUENCY
    contact = np.array([half / 2, half * 1.5])
    flight = np.array([half, 2 * half])
    points = present(chunks, f"{scene}/contacts", "Points3D:positions", np.r_[contact, flight])
    assert set(points[:2]) <= {1, 2}
    assert set(points[2:]) == {0}
    hits = recording.impacts["time_s"]
    life = 50 / 500
    arrows = present(
        chunks, f"{scene}/impulses", "Arrows3D:vectors", np.r_[hits + 1e-3, hits + life + 1e-3, hits - 1e-3]
    )
    assert arrows.tolist() == [1] * 6 + [0] * 12
    painted = columns(chunks, f"{scene}/impulses")
    sizes = [max(colour >> 24 for colour in row) for row in painted["Arrows3D:colors"] if row]
    assert sizes[:4] == sorted(sizes[:4], reverse=True)
    assert sizes[3] < 0.25 * sizes[0]
    if scene == "/zone":
        gaps = present(chunks, "/zone/gaps", "LineStrips3D:strips", np.r_[contact, flight])
        assert gaps.tolist() == [0, 0, 2, 2]


def test_section_grows_by_a_point_an_impact(chunks, recording):
    for code, word in enumerate(("active", "reverse")):
        table = columns(chunks, f"/poincare/{word}")
        here = recording.impacts["flank"] == code
        assert seconds(table["sim_time"]) == pytest.approx(recording.impacts["time_s"][here], abs=1e-9)
        spots = np.array([row[0] for row in table["Points2D:positions"]])
        assert spots[:, 0] == pytest.approx(360 * np.mod(FREQUENCY * recording.impacts["time_s"][here], 1.0), abs=1e-3)
        assert np.sign(spots[:, 1]).tolist() == [-1 if code else 1] * 3  # velocities upwards, pictures downwards
        assert np.abs(spots[:, 1]) == pytest.approx(120.0)


def test_torque_is_the_drag_in_flight(scenario, tmp_path):
    from gears3d.simulation import simulate

    run = simulate(scenario, "rigid")
    path = replay(run, scenario, out=tmp_path / "a.rrd")
    chunks = [chunk for chunk in RrdReader(str(path)).stream().to_chunks() if not chunk.is_static]
    table = columns(chunks, "/torque/loose_gear")
    time, torque = seconds(table["sim_time"]), np.ravel(table["Scalars:scalars"])
    gap = np.interp(time, run.time, run.signals["displacement_m"]) / scenario.pair().backlash
    flying = (gap > 0.02) & (gap < 0.98)
    assert flying.sum() > 1000
    assert torque[flying] == pytest.approx(-scenario.drag.torque, rel=1e-6)
    assert torque[gap == 0.0].min() > -1.02 * scenario.drag.torque  # a flank that pushes, never pulls
    assert torque[gap == 0.0].max() > 2.0 * scenario.drag.torque
    assert np.ravel(columns(chunks, "/torque/drag")["Scalars:scalars"]) == pytest.approx(-scenario.drag.torque)


def test_impulses_push_the_loose_gear_off_the_flank(chunks, scenario, recording):
    vectors = [row[0] for row in columns(chunks, "/scene/impulses")["Arrows3D:vectors"] if row][::4]  # 4 levels each
    lengths = np.linalg.norm(vectors, axis=1)
    assert lengths / lengths[0] == pytest.approx(recording.impacts["impulse_N_s"] / recording.impacts["impulse_N_s"][0])
    assert np.sign(np.array(vectors)[:, 1]).tolist() == np.where(recording.impacts["flank"] == 0, 1, -1).tolist()


def test_gears_turn_as_recorded(chunks, recording):
    table = columns(chunks, "/scene/loose/body")
    time = seconds(table["sim_time"])
    z, w = np.array([row[0] for row in table["Transform3D:quaternion"]])[:, 2:].T
    angle = np.interp(time, recording.time, recording.signals["theta_loose_rad"])
    assert np.abs(np.exp(2j * np.arctan2(z, w)) - np.exp(1j * (np.pi - angle))).max() < 1e-6
    assert np.isin(np.round(recording.impacts["time_s"] * 1e9), np.round(time * 1e9)).all()
    assert np.diff(time).max() <= 1 / 500 + 1e-9


def test_curves_lose_less_than_the_eye_sees(chunks, recording):
    table = columns(chunks, "/displacement/loose_gear")
    shown = np.interp(recording.time, seconds(table["sim_time"]), np.ravel(table["Scalars:scalars"]))
    lost = np.abs(shown - recording.signals["displacement_m"] * 1e6)  # um of 250
    assert lost.max() < 0.3
    half_cycles = 2 * FREQUENCY * recording.time - (1 - np.arcsin(0.625) / np.pi)  # whole where a flank is left
    assert lost[np.abs((half_cycles + 0.5) % 1.0 - 0.5) > 0.01].max() < 0.02
    assert len(shown) > 4 * len(table["sim_time"])


def test_states_change_where_flanks_are_reached(chunks, recording):
    table = columns(chunks, "/touching")
    words = [row[0] for row in table["StateChange:state"]]
    assert words[:5] == ["flight", "reverse flank", "flight", "active flank", "flight"]
    begins = seconds(table["sim_time"])[[i for i, word in enumerate(words) if word != "flight"]]
    assert begins == pytest.approx(recording.impacts["time_s"], abs=1.5e-3)


def test_size_at_full_rate(scenario, tmp_path):
    busy = film(scenario, duration=4.0)
    assert replay(busy, scenario, busy, tmp_path / "a.rrd").stat().st_size <= 3e6 * 4.0


def test_single_tooth_moves_its_flank_only_while_it_meets(scenario, recording):
    row = Row(Code.FLANK_TOOTH, Gate.ALWAYS, (0.0, 0.0, 5.0, 20e-6))
    motion = Motion(recording, Section(scenario.pair()), (row,))
    angle = np.linspace(0.0, 2 * np.pi, 90_001)
    active, reverse = motion.flanks(angle, angle)
    assert np.unique(active).tolist() == [0.0, 20e-6]
    assert np.ptp(reverse) == 0.0
    pitches = np.count_nonzero(active) / 1000
    assert pitches == pytest.approx(scenario.pair().contact_ratio, abs=0.01)
    at = angle[active > 0] * 90 / (2 * np.pi)
    assert at.min() < 4.0 < at.max()


def test_transmission_error_moves_both_flanks(scenario, recording):
    rows = [Row(Code.FLANK_HARMONIC, Gate.ALWAYS, (0.0, f, 2.0, a, 0.1)) for f, a in ((0.0, 9e-6), (1.0, -9e-6))]
    motion = Motion(recording, Section(scenario.pair()), tuple(rows))
    angle = np.linspace(0.0, 7.0, 50)
    active, reverse = motion.flanks(angle, angle)
    assert active == pytest.approx(9e-6 * np.cos(2 * angle + 0.1))
    assert reverse - active == pytest.approx(np.full(50, scenario.pair().backlash))


def test_touching_follows_the_moved_flank(scenario):
    pair = scenario.pair()
    time = np.linspace(0.0, 1.0, 2001)
    drive = 3.0 * time
    error = 30e-6 * np.cos(drive)
    signals = {
        "time_s": time,
        "theta_drive_rad": drive,
        "theta_loose_rad": (error + pair.drive.base_radius * drive) / pair.loose.base_radius,
        "displacement_m": error,
    }
    rows = tuple(Row(Code.FLANK_HARMONIC, Gate.ALWAYS, (0.0, f, 1.0, a, 0.0)) for f, a in ((0.0, 3e-5), (1.0, -3e-5)))
    shown = frames(Motion(Recording(signals), Section(pair), rows))
    assert set(shown.flank) == {0}
    assert set(shown.share) == {0.0}


@pytest.mark.parametrize("samples", [1, 2, 500])
def test_little_and_no_impacts(scenario, recording, tmp_path, samples):
    end = recording.time[samples - 1]
    part = recording.between(0.0, end)
    path = replay(part, scenario, out=tmp_path / "a.rrd")
    assert "/impacts" not in {chunk.entity_path for chunk in RrdReader(str(path)).stream().to_chunks()}


def test_only_angles_are_enough(scenario, recording, tmp_path):
    names = ("time_s", "theta_drive_rad", "theta_loose_rad")
    bare = Recording({name: recording.signals[name] for name in names})
    path = replay(bare, scenario, out=tmp_path / "a.rrd")
    entities = {chunk.entity_path for chunk in RrdReader(str(path)).stream().to_chunks()}
    assert "/displacement/loose_gear" in entities
    assert "/velocity/relative" not in entities


def test_nothing_recorded(scenario, tmp_path):
    empty = Recording({"time_s": [], "theta_drive_rad": [], "theta_loose_rad": []})
    with pytest.raises(InputError, match="the recording is empty"):
        replay(empty, scenario, out=tmp_path / "a.rrd")


def test_run_folder_brings_scenario_and_twin(scenario, recording, tmp_path):
    with RunFolder(tmp_path / "run") as folder:
        folder.write_scenario(scenario, "made by a test")
        folder.write_recording(recording)
        folder.write_recording(recording, "twin")
        folder.write_summary({"status": "complete"})
        place = folder.commit()
    with pytest.raises(SystemExit) as stop:
        main(["replay", str(place), "--no-open"])
    assert not stop.value.code
    chunks = RrdReader(str(place / "replay.rrd")).stream().to_chunks()
    assert {"/displacement/by_twin", "/impacts"} <= {chunk.entity_path for chunk in chunks}


def test_gears_must_be_known(recording):
    with pytest.raises(UsageError, match=r"replay\(recording, scenario\)"):
        replay(recording)


def test_no_run_folder(tmp_path):
    with pytest.raises(InputError, match="gears3d run"):
        replay(tmp_path)


def test_unwritable_place_leaves_nothing(scenario, recording, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        replay(recording, scenario, out=tmp_path / "file" / "a.rrd")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_nothing_is_left_beside_it(rrd):
    assert [path.name for path in rrd.parent.iterdir()] == ["replay.rrd"]
