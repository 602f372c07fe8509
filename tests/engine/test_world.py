"""Bullet's world: what it is made of, what it measures, and how exactly it moves."""

import numpy as np
import pybullet
import pytest

from gears3d.engine import run, world
from gears3d.engine.budget import MARGINS
from gears3d.engine.mesh import meshed, side_gap, teeth_of_points
from gears3d.engine.world import GRID, QUANTA, against_truncation, write_compound
from gears3d.errors import EngineError
from gears3d.gears import Gear, Pair, edged_gap, nearest_gap
from gears3d.scenario import load

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
SCENARIO = load(FIG5)


@pytest.fixture(scope="module")
def fig5_world():
    with world.World(*run.bodies(SCENARIO, SCENARIO.pair()), respond=False) as made:
        yield made


def poses(pair, count, seed=0):
    rng = np.random.default_rng(seed)
    drive = rng.uniform(0.0, 2.0 * np.pi, count)
    above = rng.uniform(0.0, pair.backlash, count)
    return zip(drive, (pair.drive.base_radius * drive + above) / pair.loose.base_radius, above, strict=True)


def test_backlash_of_the_solids_as_bullet_measures_it(fig5_world):
    """250 µm asked: 250.0 ± 0.5 from the hulls, margins taken out; ± 0.01 refined."""
    pair = SCENARIO.pair()
    shape = meshed(pair)
    raw, refined = [], []
    for drive, loose, above in poses(pair, 200):
        fig5_world.place((drive, loose), (0.0, 0.0))
        on_drive, on_loose, gaps = fig5_world.nearest(400e-6)
        found = teeth_of_points(shape, (90, 90), on_drive, on_loose, drive, loose)
        sides = [found[:, 2] == side for side in (0, 1)]
        raw.append(sum(gaps[side].min() + MARGINS for side in sides))
        each = [side_gap(shape, found[side], number, drive, loose)[0] for number, side in enumerate(sides)]
        refined.append(sum(each))
        assert each[0] == pytest.approx(above, abs=1e-10)
    assert np.mean(raw) == pytest.approx(250e-6, abs=0.5e-6)
    assert np.std(raw) < 0.5e-6
    assert refined == pytest.approx(np.full(200, 250e-6), abs=0.01e-6)


def test_found_teeth_are_those_that_mesh(fig5_world):
    pair = SCENARIO.pair()
    shape = meshed(pair)
    for drive, loose, _ in poses(pair, 50, seed=1):
        fig5_world.place((drive, loose), (0.0, 0.0))
        found = teeth_of_points(shape, (90, 90), *fig5_world.nearest(400e-6)[:2], drive, loose)
        for side in (0, 1):
            expected = tuple(nearest_gap(shape.edged.flanks, drive, loose, side)[:2])
            assert expected in {tuple(row[:2]) for row in found if row[2] == side}


def test_bullet_flies_as_the_closed_form_says(fig5_world):
    """20 steps of different lengths under constant torques: speed exact, place exact once half a step is taken back."""
    inertia, omega, theta, time = SCENARIO.rig().inertia, 3.0, 40.0, 0.0
    fig5_world.place((0.0, theta), (0.0, omega))
    for step, torque in zip(np.geomspace(1e-7, 2e-3, 20), np.linspace(-0.5, 0.3, 20), strict=True):
        accel = torque / inertia
        theta, omega, time = theta + omega * step + 0.5 * accel * step**2, omega + accel * step, time + step
        angle, speed = fig5_world.step(step, torque)
        fig5_world.place((0.0, angle - 0.5 * accel * step**2), (0.0, speed))
    angle, speed = fig5_world.step(1e-12, 0.0)
    assert speed == pytest.approx(omega, rel=1e-14)
    assert angle == pytest.approx(theta + omega * 1e-12, rel=1e-14)


def test_settings_that_do_not_arrive_are_refused(monkeypatch):
    honest = pybullet.changeDynamics

    def forgetful(*args, **kwargs):
        honest(*args, **{key: value for key, value in kwargs.items() if key != "restitution"})

    monkeypatch.setattr(pybullet, "changeDynamics", forgetful)
    bodies = run.bodies(SCENARIO, SCENARIO.pair())
    with pytest.raises(EngineError, match="did not take these settings: restitution, friction of the drive gear"):
        world.World(*bodies, respond=True)


def test_worlds_give_their_server_back():
    before = [pybullet.getConnectionInfo(number)["isConnected"] for number in range(16)]
    bodies = run.bodies(SCENARIO, SCENARIO.pair())
    for _ in range(3):
        world.World(*bodies, respond=False).close()
    assert [pybullet.getConnectionInfo(number)["isConnected"] for number in range(16)] == before


def test_runs_of_the_same_gears_share_a_world_and_nothing_else(monkeypatch):
    """Motion, drag and restitution may differ; a run in a used world is, bit by bit, that in a fresh one."""
    honest, connected = pybullet.connect, []

    def connect(*args):
        connected.append(args)
        return honest(*args)

    monkeypatch.setattr(pybullet, "connect", connect)
    short = load(FIG5, {"run.duration": "0.2 s", "run.settle": "0 s", "gears.face_width": "8.125 mm"})
    other = short.with_({"motion.mean": "200 rpm", "drag.torque": "0.5 N m", "impact.restitution": 0.6})
    fresh, _, used = (run.simulate(scenario) for scenario in (short, other, short))
    assert len(connected) == 1
    for table in ("signals", "impacts"):
        one, two = getattr(fresh, table), getattr(used, table)
        assert all(one[name].tobytes() == two[name].tobytes() for name in one)
    assert {**fresh.meta, "wall_s": 0} == {**used.meta, "wall_s": 0}
    run.simulate(short.with_({"gears.face_width": "8.25 mm"}))
    assert len(connected) == 2


def test_compound_file_names_every_vertex(tmp_path):
    piece = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0]])
    write_compound(tmp_path / "two.obj", np.stack([piece, piece + 5.0]))
    lines = (tmp_path / "two.obj").read_text().splitlines()
    assert [line for line in lines if line.startswith("o ")] == ["o piece0", "o piece1"]
    written, named = [], set()
    for word, *numbers in (line.split() for line in lines):
        if word == "v":
            written.append([GRID * int(x) for x in numbers])
        elif word == "f":  # vertices counted back from the last one
            named |= {len(written) + int(x) for x in numbers}
    assert named == set(range(8))
    written = np.array(written)
    assert written[:4] == pytest.approx(against_truncation(piece), abs=0.5 * GRID)
    assert np.ptp(written[:4], axis=0) == pytest.approx(np.ptp(piece, axis=0) * (1 + 1 / QUANTA), abs=GRID)


@pytest.mark.parametrize(("drive", "loose"), [((2e-3, 19), (2e-3, 37)), ((3.5e-3, 90), (3.5e-3, 90))])
def test_edges_close_the_path_of_contact(drive, loose):
    """On the path the gap is that of the flanks; off it, it grows without a jump, and its derivatives are right."""
    pair = Pair.from_backlash(Gear(*drive, face_width=5e-3), Gear(*loose, face_width=5e-3), 100e-6)
    shape = meshed(pair)
    pitch = 2.0 * np.pi / pair.drive.teeth
    ratio = pair.drive.teeth / pair.loose.teeth
    turns = np.linspace(-1.2, 1.2, 2001) * pitch
    values = np.array([edged_gap(shape.edged, t, t * ratio, 1, 1, 0) for t in turns])
    gaps, on_path = values[:, 0], values[:, 3].astype(bool)
    assert np.abs(gaps[on_path]).max() < 1e-15
    assert np.all(gaps[~on_path] > -1e-15)
    finite = np.isfinite(gaps)
    slopes = values[:, 1] + values[:, 2] * ratio
    both = finite[1:] & finite[:-1]
    expected = 0.5 * (slopes[1:] + slopes[:-1]) * np.diff(turns)
    assert (gaps[1:][both] - gaps[:-1][both]) == pytest.approx(expected[both], abs=3e-9)
    near = np.abs(turns) < 1.0 * pitch
    assert np.all(finite[near])
