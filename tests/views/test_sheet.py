"""The drawing of a mesh: what stands where, in the plane's own millimetres."""

from math import cos, radians

import numpy as np
import pytest
from shapely.geometry import Polygon

from gears3d.gears import Gear, Pair, path_points
from gears3d.views.plots.section import widening
from gears3d.views.sheet import drawing, posed

RIG = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
SPUR = Pair.from_backlash(RIG, RIG, 250e-6)
HELICAL = Pair.from_backlash(
    *(Gear(2.75e-3, z, helix_angle=radians(28), face_width=16e-3) for z in (17, 43)), backlash=120e-6
)


def shapes(axes):
    return [Polygon(patch.get_xy()) for patch in axes.patches if len(patch.get_xy()) > 100]


@pytest.mark.parametrize("pair", [SPUR, HELICAL], ids=["spur", "helical"])
def test_section_shows_gears_that_touch_at_the_pitch_point_and_nowhere_overlap(pair):
    section, inset, plane, sliding = drawing(pair, "title", 3.0).axes
    for axes, factor in ((section, 1), (inset, widening(pair))):
        drive, loose = shapes(axes)
        assert drive.is_valid
        assert loose.is_valid
        assert drive.intersection(loose).area < 1e-3
        assert drive.distance(loose) < 8e-3
        assert factor == 1 or f"drawn {factor:g} times" in axes.get_title(loc="left")
    assert "title" in section.figure.get_suptitle()
    pitch_point = 1e3 * pair.drive.base_radius / cos(pair.working_pressure_angle)
    (dots,) = [line for line in section.lines if line.get_label() == "teeth touch here"]
    assert [pitch_point, 0.0] in np.round(dots.get_xydata(), 9).tolist() or np.abs(
        dots.get_xydata() - [pitch_point, 0.0]
    ).sum(axis=1).min() < 1e-9
    (path,) = [line for line in section.lines if str(line.get_label()).startswith("path of contact")]
    length = 1e-3 * np.hypot(*np.diff(path.get_xydata(), axis=0)[0])
    assert length == pytest.approx(pair.contact_ratio * pair.drive.base_pitch, rel=1e-9)
    lines = [line for line in plane.lines if line.get_color() == "#0072B2"]
    assert len(lines) == (1 if pair is SPUR else 3)
    (curve,) = [line for line in sliding.lines if len(line.get_xdata()) == 201]
    assert curve.get_xdata()[[0, -1]] == pytest.approx([1e3 * path_points(pair)[end] for end in "AE"])


@pytest.mark.parametrize("backlash", [1e-6, 20e-6, 250e-6, 2e-3])
def test_backlash_is_widened_by_a_round_factor_that_shows_it(backlash):
    pair = Pair.from_backlash(RIG, RIG, backlash)
    factor = widening(pair)
    shown = factor * backlash / (np.pi * RIG.module)
    assert 0.09 < shown < 0.45
    assert factor == 1 or backlash < 2e-3
    _, inset, *_ = drawing(pair).axes
    drive, loose = shapes(inset)
    assert drive.intersection(loose).area < 1e-3


def test_outlines_stand_where_the_gears_do():
    for which in ("drive", "loose"):
        ring = Polygon(np.vstack(posed(HELICAL, which, 1e-6)))
        assert ring.centroid.coords[0] == pytest.approx(HELICAL.centre(which)[:2], abs=1e-9)
