"""The backlash that is asked for, by closest points of the two solids of a pair, spur or helical."""

from math import cos, sin
from pathlib import Path

import numpy as np
import pytest

from gears3d.gears import solid
from gears3d.scenario import load
from tests.gears.closest import mesh_distance

ROOT = Path(__file__).resolve().parents[2]
PAPERS = ("helical-17-43", "kadmiri-2012", "ottewill-2010")
PAIRS = {name: load(ROOT / f"scenarios/base/{name}.toml").pair() for name in PAPERS}


def in_mesh(pair, bodies):
    """Return a function that poses the triangles of the teeth in mesh: walls within the reach of both tips."""
    walls = [body.triangles[np.abs(body.face_normals[:, 2]) < 0.9] for body in bodies]

    def posed(which, theta):
        number = ("drive", "loose").index(which)
        angle = pair.rotation(which, theta)
        turn = np.array([[cos(angle), sin(angle), 0.0], [-sin(angle), cos(angle), 0.0], [0.0, 0.0, 1.0]])
        corners = walls[number] @ turn + np.append(pair.centre(which)[:2], 0.0)
        mate = pair.centre("loose" if which == "drive" else "drive")[:2]
        reach = pair.gear("loose" if which == "drive" else "drive").tip_radius
        near = np.hypot(corners[:, :, 0] - mate[0], corners[:, :, 1] - mate[1]).min(axis=1) < reach
        return corners[near]

    return posed


def touches(pair, posed, theta, side):
    """Return where along the line of action the loose gear's solid touches the drive's, turned from the middle [m].

    A turn brings flanks together along their normal by at most its base radius × cos of the base helix angle: a
    thousandth less than that is left after each step, so that the solids never cut each other.
    """
    drive = posed("drive", theta)
    rate = cos(pair.loose.base_helix_angle)
    s = 0.5 * pair.backlash
    for _ in range(12):
        theta_loose = (pair.drive.base_radius * theta + s) / pair.loose.base_radius
        gap = mesh_distance(drive, posed("loose", theta_loose))
        if gap < 1e-9:
            return s
        s += side * 0.98 * gap / rate
    raise AssertionError(f"still {gap} m apart")


@pytest.mark.parametrize(
    ("name", "theta"),
    [
        pytest.param("helical-17-43", 0.0, marks=pytest.mark.slow),
        ("helical-17-43", 0.07),
        ("kadmiri-2012", 0.02),
        pytest.param("ottewill-2010", 0.07, marks=pytest.mark.slow),
    ],
)
def test_backlash_asked_is_that_of_the_solids(name, theta):
    """Facets stand back from convex flanks by no more than the chord, along the normal, on each flank of each gear."""
    pair, chord = PAIRS[name], 1e-6
    posed = in_mesh(pair, [solid(pair, which, chord) for which in ("drive", "loose")])
    budget = 2.0 * chord / cos(pair.loose.base_helix_angle)
    active, reverse = touches(pair, posed, theta, -1), touches(pair, posed, theta, 1)
    assert -budget <= active <= 2e-9
    assert -2e-9 <= reverse - pair.backlash <= budget
