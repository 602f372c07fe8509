"""Every dataset gets the pictures that it has the variables for, and a picture shows what the dataset holds."""

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.scenario import load
from gears3d.sweep import draw, make_plan, open_dataset, sweep
from gears3d.sweep.dataset import thresholds
from gears3d.sweep.drawing import bifurcation_picture, impulse_picture, level_picture, map_picture

RIG = load("scenarios/rigaud-2020/fig5-20rpm.toml")
AMPLITUDE, FREQUENCY = "motion.harmonics[0].amplitude", "motion.harmonics[0].frequency"


def swept(place, vary, **more):
    sweep(make_plan(RIG, vary, periods=16, settle=6, **more), place, workers=0)
    return open_dataset(place)


@pytest.fixture(scope="module")
def plane(tmp_path_factory):
    place = tmp_path_factory.mktemp("plane")
    with swept(place, [f"{AMPLITUDE}=0.5..40 rpm log 12", f"{FREQUENCY}=1..10 Hz lin 9"]) as data:
        yield place, data.load()


@pytest.fixture(scope="module")
def line(tmp_path_factory):
    place = tmp_path_factory.mktemp("line")
    with swept(place, [f"{AMPLITUDE}=0.5..8 rpm lin 30"], follow=AMPLITUDE) as data:
        yield place, data.load()


@pytest.mark.slow
def test_the_pictures_that_fit_are_drawn(plane, line):
    assert sorted(path.stem for path in draw(plane[0])) == ["impulses", "level", "map"]
    assert sorted(path.stem for path in draw(line[0])) == ["bifurcation", "impulses", "level", "threshold"]


def test_the_map_shows_regimes_and_the_threshold(plane):
    left, right = map_picture(plane[1]).axes[:2]
    shown = left.collections[0].get_array()
    np.testing.assert_array_equal(shown.reshape(12, 9), plane[1].regime.values)
    (contour,) = (one for one in left.collections[1:] if hasattr(one, "levels"))
    for path in contour.get_paths():
        frequency, amplitude = path.vertices.T
        push = RIG.gears.loose.inertia * 2 * np.pi * frequency * amplitude
        np.testing.assert_allclose(push, RIG.drag.torque, rtol=0.1)
    assert "frequency" in right.get_xlabel()


def test_a_bifurcation_shows_both_ways(line):
    top = bifurcation_picture(line[1]).axes[0]
    assert [one.get_label() for one in top.lines] == ["up", "down"]
    up = line[1].active_section_impact_m_s.sel(direction="up").values
    np.testing.assert_allclose(top.lines[0].get_ydata(), 1e3 * up.ravel())


def test_impulses_and_levels_are_those_of_the_dataset(plane):
    axis = impulse_picture(plane[1]).axes[0]
    np.testing.assert_array_equal(axis.lines[0].get_xdata(), plane[1].excitation.values.ravel())
    drive, guide = level_picture(plane[1]).axes[0].lines
    assert len(drive.get_xdata()) == int(np.isfinite(plane[1].energy_level_dB).sum())
    (x0, x1), (y0, y1) = guide.get_xdata(), guide.get_ydata()
    assert y1 - y0 == pytest.approx(x1 - x0)


def test_thresholds_are_found_whichever_end_rattles(tmp_path, line):
    with swept(
        tmp_path, ["drag.torque=0.1..4 N m lin 40"], follow="drag.torque", measures=["regime", "threshold"]
    ) as data:
        found = thresholds(data)
    exact = RIG.gears.loose.inertia * 2 * np.pi * 3 * RIG.motion.harmonics[0].amplitude
    for way in ("up", "down"):
        assert abs(float(found[way]) - exact) <= 1.01 * float(found[f"within_{way}"])
        assert float(found[f"within_{way}"]) == pytest.approx(0.05)
    quiet = line[1].isel(motion_harmonics_0_amplitude=slice(0, 3))
    assert np.isnan(thresholds(quiet).up)
    assert np.isnan(thresholds(quiet).down)


def test_thresholds_need_a_followed_axis(plane):
    with pytest.raises(InputError, match="--follow KEY"):
        thresholds(plane[1])
