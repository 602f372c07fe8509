"""What the replay draws against the gears room's own flanks."""

from math import pi

import numpy as np
import pytest

from gears3d.gears import Gear, Pair
from gears3d.gears.outline import outline
from gears3d.views.plots.section import Section, widening
from gears3d.views.replay.scene import flank_lines

SPUR = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
SMALL = Gear(module=2e-3, teeth=19, face_width=10e-3, profile_shift=0.3)
LARGE = Gear(module=2e-3, teeth=37, face_width=10e-3)
PAIRS = {
    "90/90": Pair.from_backlash(SPUR, SPUR, 250e-6),
    "19/37 shifted": Pair.from_backlash(SMALL, LARGE, 100e-6),
    "thinned": Pair.from_both(LARGE, LARGE, Pair.from_backlash(LARGE, LARGE, 50e-6).centre_distance, 120e-6),
}
ANGLES = np.linspace(-0.3, 7.0, 29)


def to_polygon(points, polygon):
    """Distance of each point from a closed polygon."""
    start, edge = polygon, np.roll(polygon, -1, axis=0) - polygon
    along = np.einsum("ped,ed->pe", points[:, None] - start, edge) / np.einsum("ed,ed->e", edge, edge)
    foot = start + np.clip(along, 0, 1)[..., None] * edge
    return np.linalg.norm(points[:, None] - foot, axis=2).min(axis=1)


def to_lines(points, lines):
    return np.min([to_open(points, line) for line in lines], axis=0)


def to_open(points, line):
    start, edge = line[:-1], np.diff(line, axis=0)
    along = np.einsum("ped,ed->pe", points[:, None] - start, edge) / np.einsum("ed,ed->e", edge, edge)
    foot = start + np.clip(along, 0, 1)[..., None] * edge
    return np.linalg.norm(points[:, None] - foot, axis=2).min(axis=1)


def turned(points, angle, x=0.0):
    c, s = np.cos(angle), np.sin(angle)
    return points @ np.array([[c, s], [-s, c]]) + [x, 0.0]


@pytest.mark.parametrize("flank", [0, 1])
@pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS)
def test_contact_points_lie_on_both_true_outlines(pair, flank):
    section = Section(pair)
    shapes = [outline(pair, which, 0.05e-6).points.reshape(-1, 2) * 1e3 for which in ("drive", "loose")]
    count = 0
    for angle in ANGLES:
        displacement = flank * pair.backlash
        loose = (pair.drive.base_radius * angle + displacement) / pair.loose.base_radius
        _, _, travel = section.touching(np.array([angle]), np.array([flank]))
        points = section.point(travel, np.full(len(travel), flank))
        count += len(points)
        poses = (angle, 0.0), (pi - loose, pair.centre_distance * 1e3)
        for shape, (turn, x) in zip(shapes, poses, strict=True):
            assert to_polygon(points, turned(shape, turn, x)).max() < 2e-4  # mm
    assert len(ANGLES) * (pair.contact_ratio - 0.35) < count < len(ANGLES) * (pair.contact_ratio + 0.35)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS)
def test_widened_flanks_are_apart_by_the_share_of_the_drawn_backlash(pair, share):
    section = Section(pair, widening(pair))
    for angle in (0.013, 0.9):
        loose = (section.base_radii[0] * angle + share * section.backlash) / section.base_radii[1]
        for flank, gap in ((0, share * section.backlash), (1, (1 - share) * section.backlash)):
            travel = section.meeting(np.array([angle]), np.array([flank]), np.array([0]))
            foot = section.point(travel, np.array([flank]))
            head = foot + gap * section.normal(np.array([flank]))
            drive = [turned(line[:, :2], angle) for line in flank_lines(section, 0, flank)]
            mate = [
                turned(line[:, :2], pi - loose, pair.centre_distance * 1e3) for line in flank_lines(section, 1, flank)
            ]
            assert to_lines(foot, drive)[0] < 0.01
            assert to_lines(head, mate)[0] < 0.01


def test_touching_teeth_are_named_in_order_of_meshing():
    section = Section(PAIRS["90/90"])
    pitch = 2 * pi / 90
    for tooth in (0, 1, 7, 95):
        _, teeth, travel = section.touching(np.array([tooth * pitch]), np.array([0]))
        at_pitch_point = teeth[np.abs(travel) < 1e-6]
        assert at_pitch_point.tolist() == [tooth]
    row, _, _ = section.touching(np.zeros(3), np.array([0, -1, 1]))
    assert set(row) == {0, 2}


def test_meeting_prefers_the_tooth_that_was_recorded():
    section = Section(PAIRS["90/90"])
    angle = np.full(3, 0.2 * 2 * pi / 90)
    travel = section.meeting(angle, np.zeros(3, dtype=int), np.array([0, 1, 90]))
    assert travel / section.base_pitch == pytest.approx([0.2, 0.2, 1.2])
    far = section.meeting(angle[:1], np.zeros(1, dtype=int), np.array([40]))
    assert far / section.base_pitch == pytest.approx([0.2])


def test_widening_is_visible_and_leaves_teeth():
    for pair in PAIRS.values():
        factor = widening(pair)
        assert 0.1 < factor * pair.backlash / pair.drive.base_pitch <= 0.2
    loose_fit = Pair.from_both(LARGE, LARGE, PAIRS["thinned"].centre_distance, 1.2e-3)
    assert widening(loose_fit) == 1.0
    assert widening(Pair.from_backlash(LARGE, LARGE, 0.0)) == 1000.0
    assert np.all(np.diff([widening(Pair.from_backlash(SPUR, SPUR, b)) for b in (2e-5, 1e-4, 2e-4, 5e-4)]) < 0)
