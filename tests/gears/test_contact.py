"""Contact lines, curvature and sliding of ideal flanks, against the surfaces themselves."""

from math import atan2, cos, hypot, pi, radians, sin

import numpy as np
import pytest

from gears3d.gears import (
    Gear,
    HarmonicDeviation,
    Pair,
    candidates,
    compile_surfaces,
    contact_lines,
    curvature_radii,
    flank_point,
    path_points,
    sliding_speed,
    specific_sliding,
    surface_point,
)
from gears3d.gears.flank import support


def pair_of(beta=28.0, teeth=(17, 43), width=16e-3, shift=(0.2, 0.0)):
    gears = [
        Gear(2.75e-3, z, helix_angle=radians(beta), face_width=width, profile_shift=x)
        for z, x in zip(teeth, shift, strict=True)
    ]
    return Pair.from_backlash(*gears, 120e-6)


@pytest.mark.parametrize("flank", ["active", "reverse"])
@pytest.mark.parametrize("beta", [0.0, 12.0, 28.0, -28.0])
def test_contact_lines_lie_on_both_flanks(beta, flank):
    """Every point of every line, by tooth and roll angle, in world coordinates to a picometre; normals opposed."""
    pair, number = pair_of(beta), ["active", "reverse"].index(flank)
    surfaces = compile_surfaces(pair)
    for theta in np.linspace(-1, 9, 41):
        s = number * pair.backlash
        turns = (theta, pi - (s + pair.drive.base_radius * theta) / pair.loose.base_radius)
        lines = contact_lines(pair, theta, flank)
        assert len(lines.lengths) >= 1
        for teeth, ends, rolls in zip(lines.teeth, lines.points, lines.rolls, strict=True):
            for share in (0.0, 0.4, 1.0):
                point, roll = (1 - share) * ends[0] + share * ends[1], (1 - share) * rolls[0] + share * rolls[1]
                normals = []
                for gear, turn in enumerate(turns):
                    found, normal, _, _ = surface_point(surfaces, gear, number, teeth[gear], roll[gear], point[2])
                    c, s = cos(turn), sin(turn)
                    matrix = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
                    world = matrix @ found + pair.centre(("drive", "loose")[gear])
                    assert world == pytest.approx(point, abs=1e-12)
                    normals.append(matrix @ normal)
                assert normals[0] == pytest.approx(-normals[1], abs=1e-11)


def test_mean_length_of_the_lines_is_the_area_of_the_plane_of_action():
    for pair in (pair_of(), pair_of(15.0, (30, 50), 30e-3), pair_of(0.0)):
        theta = np.linspace(0, 2 * pi / pair.drive.teeth, 400, endpoint=False)
        for flank in ("active", "reverse"):
            mean = np.mean([contact_lines(pair, t, flank).lengths.sum() for t in theta])
            expected = pair.drive.face_width * pair.contact_ratio / cos(pair.drive.base_helix_angle)
            assert mean == pytest.approx(expected, rel=3e-3)


def test_with_a_whole_overlap_the_length_of_the_lines_is_constant():
    gear = Gear(2e-3, 31, helix_angle=0.3, face_width=0.01)
    width = 0.01 / Pair.from_backlash(gear, gear, 1e-4).overlap_ratio
    whole = Gear(2e-3, 31, helix_angle=0.3, face_width=width)
    pair = Pair.from_backlash(whole, whole, 1e-4)
    assert pair.overlap_ratio == pytest.approx(1.0, rel=1e-12)
    total = [contact_lines(pair, t).lengths.sum() for t in np.linspace(0, 0.5, 101)]
    assert total == pytest.approx(np.full(101, total[0]), rel=1e-12)


@pytest.mark.parametrize("flank", ["active", "reverse"])
def test_spur_lines_are_the_candidates_of_the_flanks(flank):
    pair, number = pair_of(0.0), ["active", "reverse"].index(flank)
    for theta in np.linspace(0, 3, 50):
        theta_loose = (number * pair.backlash + pair.drive.base_radius * theta) / pair.loose.base_radius
        teeth = candidates(pair.compiled(), theta, theta_loose, number).tolist()
        assert sorted(contact_lines(pair, theta, flank).teeth.tolist()) == sorted(teeth)


def test_radii_of_curvature_are_those_of_the_flanks():
    pair = pair_of(0.0)
    flanks, points = pair.compiled(), path_points(pair)
    for place in np.linspace(points["A"], points["E"], 7):
        for gear, (radius, tangent) in enumerate(
            zip(curvature_radii(pair, place)[:2], (place - points["T1"], points["T2"] - place), strict=True)
        ):
            roll = tangent / (pair.drive, pair.loose)[gear].base_radius
            _, _, nx, ny, dx, dy = flank_point(flanks, gear, 0, 1, roll)
            h, _, c = support(flanks, gear, 0, 1, atan2(ny, nx))
            assert radius == pytest.approx(h + c, rel=1e-11)
            assert radius == pytest.approx(hypot(dx, dy), rel=1e-11)
    drive, loose, both = curvature_radii(pair_of(28.0), 0.0)
    assert 1 / both == pytest.approx(1 / drive + 1 / loose, rel=1e-14)
    tilted = pair_of(28.0).drive
    assert drive * cos(tilted.base_helix_angle) == pytest.approx(
        tilted.base_radius * np.tan(pair_of(28.0).working_pressure_angle), rel=1e-14
    )


def test_sliding_is_the_difference_of_the_flanks_own_velocities():
    """Velocities of both material points at the contact, across the common normal."""
    pair, speed = pair_of(0.0), 12.0
    points, alpha = path_points(pair), pair.working_pressure_angle
    normal, across = np.array([sin(alpha), cos(alpha)]), np.array([cos(alpha), -sin(alpha)])
    pitch = np.array([pair.drive.base_radius / cos(alpha), 0.0])
    for place in np.linspace(points["A"], points["E"], 7):
        at = pitch + place * normal
        loose = speed * pair.drive.teeth / pair.loose.teeth
        v1 = speed * np.array([-at[1], at[0]])
        v2 = -loose * np.array([-at[1], at[0] - pair.centre_distance])
        assert (v1 - v2) @ normal == pytest.approx(0.0, abs=1e-14)
        # outwards on the drive: its flank's contact point moves along +across as the roll angle grows
        assert sliding_speed(pair, place, speed) == pytest.approx((v2 - v1) @ across, rel=1e-9, abs=1e-14)
        drive, mate = specific_sliding(pair, place)
        roll1, roll2 = v1 @ across, v2 @ across
        assert drive == pytest.approx((roll1 - roll2) / roll1, rel=1e-9, abs=1e-12)
        assert mate == pytest.approx((roll2 - roll1) / roll2, rel=1e-9, abs=1e-12)


def test_deviations_do_not_enter():
    pair = pair_of(0.0)
    moved = pair.with_deviations(HarmonicDeviation("drive", "active", 1, 5e-6))
    assert np.array_equal(contact_lines(pair, 0.3).points, contact_lines(moved, 0.3).points)
