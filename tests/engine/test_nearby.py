"""Bullet is asked once a pitch, later less: no pair that could touch in between is missed, all flanks are compared."""

import math

import numpy as np
import pytest

from gears3d.engine import run, simulate
from gears3d.engine.budget import Watch
from gears3d.engine.closing import ContactSystem
from gears3d.engine.lines import slices_of
from gears3d.engine.mesh import meshed, side_gap, teeth_of_points
from gears3d.engine.motion import there_and_back
from gears3d.engine.world import World
from gears3d.gears import Eccentricity, Misalignment, ToothDeviation
from gears3d.scenario import load

FIG5 = "scenarios/rigaud-2020/fig5-20rpm.toml"
FEW = {"gears.drive.teeth": 17, "gears.loose.teeth": 43}
THICK = ToothDeviation("drive", "active", 4, 20e-6), ToothDeviation("loose", "reverse", 7, 20e-6)
CASES = {
    "spur": ({}, (), ()),
    "17 and 43 teeth": (FEW, (), ()),
    "helical": ({**FEW, "gears.helix_angle": "25 deg"}, (), ()),
    "tip relief": ({"gears.tip_relief": {"amount": "20 um", "length": "7 mm"}}, (), ()),
    "thick teeth": (FEW, THICK, ()),
    "eccentric": (FEW, (), (Eccentricity("drive", 60e-6, 0.3), Eccentricity("loose", 40e-6, 1.0))),
    "leaning": ({**FEW, "gears.helix_angle": "10 deg"}, (), (Misalignment(0.2e-3, 0.1e-3),)),
}
WIDE = 5e-3
"""Reach of the queries that the kept answers are compared with [m]."""


def true_gap(shape, row, drive, loose):
    return side_gap(shape, row[None], row[2], drive, loose)[0]


@pytest.mark.parametrize("case", CASES)
def test_no_near_pair_is_missed_between_queries(case):
    """Two turns and back with the loose gear anywhere in the backlash, against queries of a wide reach everywhere."""
    keys, deviations, mounting = CASES[case]
    scenario = load(FIG5, keys)
    pair = scenario.pair().with_deviations(*deviations).with_mounting(*mounting)
    shape, torques = meshed(pair), np.zeros((0, 10))
    watch, counts = Watch(pair, shape, slices_of(pair)), (pair.drive.teeth, pair.loose.teeth)
    pitch, way = 2.0 * math.pi / counts[0], 30.3
    system = ContactSystem(shape, there_and_back(1.0, way * pitch, pitch), torques, False, 1.0)
    rng = np.random.default_rng(2)
    compared = 0
    with World(*run.bodies(scenario, pair), respond=False) as world:
        for time in np.linspace(0.0, 2.0 * way * pitch, 500):
            drive = time if time < way * pitch else 2.0 * way * pitch - time
            plant_time = time if time < way * pitch else time + pitch
            share = rng.uniform(0.2, 0.8)
            loose = (pair.drive.base_radius * drive + share * pair.backlash) / pair.loose.base_radius
            world.place((drive, loose), (0.0, 0.0))
            if not watch.nearby.known(drive):
                watch.look(world, system, plant_time, loose)
            kept = {tuple(row) for row in watch.nearby.teeth(drive).tolist()}
            found = np.unique(teeth_of_points(shape, counts, *world.nearest(WIDE)[:2], drive, loose), axis=0)
            for side in (0, 1):
                rows = [row for row in found if row[2] == side]
                least, _, lever, _ = side_gap(shape, np.array(rows), side, drive, loose)
                for place in (loose, loose - least / lever):  # where it is, and on this flank
                    gaps = np.array([true_gap(shape, row, drive, place) for row in rows])
                    near = [
                        tuple(row.tolist()) for row, gap in zip(rows, gaps, strict=True) if gap <= gaps.min() + 1e-6
                    ]
                    assert set(near) <= kept, (drive / pitch, side)
                    compared += len(near)
    assert compared > 2000
    assert watch.queries <= (3 if watch.nearby.equal else way + 3)


def test_bullet_is_asked_once_a_pitch_and_later_to_compare():
    """Half a turn asks once a pitch; the turns after the first ask once in 0.6 of a turn."""
    short, long = (
        load(FIG5, {"motion.mean": "750 rpm", "run.duration": f"{turns / 12.5} s", "run.settle": "0 s"})
        for turns in (0.5, 4.0)
    )
    assert 45 <= simulate(short).meta["queries"] <= 47
    assert 90 + 4 <= simulate(long).meta["queries"] <= 90 + 6


def test_pairs_of_different_teeth_are_compared_until_all_flanks_have_been():
    """Of 17 and 43 teeth 731 pairs meet; queries come once a pitch for 43 pitches, then once in 0.6 of a turn."""
    keys = {**FEW, "motion.mean": "1500 rpm", "motion.harmonics": [], "run.duration": "0.4 s", "run.settle": "0 s"}
    later = (25.0 * 0.4 - 43.0 / 17.0) / 0.618
    assert 43 + later - 3 <= simulate(load(FIG5, keys)).meta["queries"] <= 43 + later + 3


@pytest.mark.parametrize("tooth", [2, 30, 43])
def test_a_faulty_hull_of_a_tooth_is_found_in_gears_whose_teeth_are_equal(monkeypatch, tooth):
    scenario = load(FIG5, {**FEW, "run.duration": "0.5 s", "motion.mean": "400 rpm", "motion.harmonics": []})
    honest = run.pieces
    moved = scenario.pair().with_deviations(ToothDeviation("loose", "active", tooth, 5e-6))
    monkeypatch.setattr(run, "pieces", lambda pair, which, **how: honest(moved, which, **how))
    with pytest.raises(run.EngineError, match=rf"against loose tooth {tooth}\b"):
        simulate(scenario)


def test_every_pair_in_mesh_is_compared_with_bullets_gaps(monkeypatch):
    """Whichever tooth the hulls have moved, the run stops at it."""
    scenario = load(FIG5, {"run.duration": "0.4 s", "motion.harmonics": [], "run.settle": "0 s"})
    honest = run.pieces
    monkeypatch.setattr(run, "pieces", lambda pair, which, **how: honest(scenario.pair(), which, **how))
    for tooth in range(2, 18):
        moved = scenario.pair().with_deviations(ToothDeviation("loose", "active", tooth, -5e-6))
        with pytest.raises(run.EngineError, match=rf"against loose tooth {tooth}\b"):
            simulate(scenario, pair=moved)
