"""Solids and convex pieces against the exact profile they are cut from."""

from math import acos, cos, pi, radians, sin

import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.spatial import ConvexHull

from gears3d.errors import InputError
from gears3d.gears import (
    Gear,
    HarmonicDeviation,
    Pair,
    ToothDeviation,
    candidates,
    flank_gap,
    inv,
    mass_properties,
    piece_budget,
    pieces,
    profile,
    solid,
    solid_arrays,
    triangles_at,
)
from gears3d.gears.gear import fillet, form
from gears3d.gears.outline import MOST_TRIANGLES, outline

RIG = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
PAIR = Pair.from_backlash(RIG, RIG, 250e-6)
SMALL = {"module": 2e-3, "teeth": 24, "face_width": 6e-3, "bore": 0.012}
DEVIATIONS = (
    HarmonicDeviation("drive", "active", 90, 5e-6, 0.4),
    HarmonicDeviation("drive", "reverse", 1, -50e-6, 0.1),
    ToothDeviation("drive", "active", 5, 20e-6),
)


def exact_area(gear, half):
    """Area of the transverse section by ½∮r²dφ: root arc, trochoid by quadrature, involute in closed form, tip arc."""
    roll, angle = form(gear, half)
    step = 1e-6

    def sweep(t):
        return (fillet(gear, half, t + step)[1] - fillet(gear, half, t - step)[1]) / (2 * step)

    root = 0.5 * gear.root_radius**2 * (pi / gear.teeth - fillet(gear, half, pi / 2)[1])
    trochoid = 0.5 * quad(lambda t: fillet(gear, half, t)[0] ** 2 * sweep(t), angle, pi / 2, epsabs=1e-14)[0]
    involute = gear.base_radius**2 * (gear.tip_roll**3 - roll**3) / 6
    tip = 0.5 * gear.tip_radius**2 * (half - inv(acos(gear.base_radius / gear.tip_radius)))
    return 2 * gear.teeth * (root + trochoid + involute + tip)


def exact_volume(gear):
    """Of the section carried along the face, less bore and pockets."""
    volume = (exact_area(gear, gear.base_half_angle) - 0.25 * pi * (gear.bore or 0.0) ** 2) * gear.face_width
    if gear.rim is None:
        return volume
    inner = gear.hub or gear.bore or 0.0
    return volume - pi * ((gear.root_radius - gear.rim) ** 2 - 0.25 * inner**2) * (gear.face_width - gear.web)


def volume_of(gear, mate=None):
    pair = Pair.from_backlash(gear, mate or gear, 0.0)
    return solid(pair, "drive", chord=0.05e-6, root_chord=0.05e-6).volume


def assert_is_a_solid(body):
    assert body.is_watertight
    assert body.is_winding_consistent
    assert body.is_volume
    assert body.body_count == 1


@pytest.mark.parametrize("gear", [RIG, Gear(**SMALL), Gear(2e-3, 17), Gear(2e-3, 25, fillet_radius=0.4719)])
def test_outline_area_converges_to_the_exact_section(gear):
    """In proportion to the chord, and never off by more than a chord all around."""
    pair = Pair.from_backlash(gear, gear, 30e-6)
    exact, errors = exact_area(gear, pair.half_angle("drive")), []
    for chord in (16e-6, 1e-6, 62.5e-9, 3.90625e-9):
        section = outline(pair, "drive", chord, chord)
        edges = np.diff(section.points.reshape(-1, 2), axis=0)
        errors.append(abs(section.area - exact))
        assert errors[-1] <= chord * np.hypot(*edges.T).sum()
    assert errors[-1] / exact < 4e-7
    assert errors[0] / errors[-1] > 500


@pytest.mark.parametrize(
    "change",
    [
        {},
        {"module": 2.2e-3},
        {"teeth": 31},
        {"pressure_angle": radians(22)},
        {"helix_angle": radians(15)},
        {"face_width": 7e-3},
        {"profile_shift": 0.2},
        {"addendum": 0.9},
        {"dedendum": 1.3},
        {"fillet_radius": 0.1},
        {"bore": 0.02},
        {"bore": None},
        {"tip_shortening": 0.1},
        {"tip_diameter": 0.0515},
        {"rim": 4e-3, "web": 2e-3},
        {"rim": 4e-3, "web": 2e-3, "hub": 0.016},
        {"rim": 5e-3, "web": 3e-3, "hub": 0.016, "helix_angle": radians(25)},
        {"rim": 4e-3, "web": 2e-3, "bore": None},
        {"rim": 4e-3, "web": 2e-3, "hub": 0.01, "bore": None},
    ],
)
def test_every_parameter_changes_the_volume_by_the_amount_it_should(change):
    gear = Gear(**{**SMALL, **change})
    expected, start = exact_volume(gear), exact_volume(Gear(**SMALL))
    assert volume_of(gear) == pytest.approx(expected, rel=3e-5)
    if change:
        assert abs(expected / start - 1) > 2e-4


def test_backlash_by_thinning_takes_its_thickness_off_the_solid():
    gear = Gear(**SMALL)
    full = Pair.from_backlash(gear, gear, 0.0)
    thin = Pair.from_both(gear, gear, full.centre_distance, 100e-6)
    change = outline(full, "drive", 0.05e-6).area - outline(thin, "drive", 0.05e-6).area
    angle = full.half_angle("drive") - thin.half_angle("drive")
    assert change == pytest.approx(gear.teeth * angle * (gear.tip_radius**2 - gear.root_radius**2), rel=1e-4)


@pytest.mark.parametrize("which", ["drive", "loose"])
@pytest.mark.parametrize("deviations", [(), DEVIATIONS])
def test_rig_solids_are_watertight_and_one_body(which, deviations):
    body = solid(PAIR.with_deviations(*deviations), which)
    assert_is_a_solid(body)
    assert body.extents[2] == pytest.approx(7.5e-3, abs=1e-18)
    assert body.bounds[1, :2].max() == pytest.approx(RIG.tip_radius, abs=2e-5)


@settings(max_examples=25, deadline=None)
@given(st.integers(9, 60), st.floats(-0.3, 0.8), st.floats(-0.6, 0.6), st.sampled_from([None, 0.4]), st.floats(0, 0.45))
def test_any_gear_is_a_solid_whose_facets_all_face_outwards(teeth, shift, helix, bore, fillet_radius):
    try:
        gear = Gear(1e-3, teeth, helix_angle=helix, profile_shift=shift, fillet_radius=fillet_radius)
        gear = Gear(
            1e-3,
            teeth,
            gear.pressure_angle,
            helix,
            4e-3,
            shift,
            1.0,
            1.25,
            fillet_radius,
            bore and bore * gear.root_radius,
        )
        pair = Pair.from_backlash(gear, Gear(1e-3, 60, helix_angle=helix), 20e-6)
    except InputError:
        assume(False)
    body = solid(pair, "drive", chord=1e-6)
    assert_is_a_solid(body)
    assert body.euler_number == (0 if bore else 2)
    ends = np.abs(body.triangles_center[:, 2]) > 2e-3 - 1e-12
    assert (body.face_normals[ends, 2] * body.triangles_center[ends, 2] > 0).all()
    assert body.area_faces[ends].min() > 0
    vertices, faces, normals = solid_arrays(pair, "drive", chord=1e-6)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0, abs=1e-12)
    drawn = trimesh.Trimesh(vertices, faces, process=False)
    assert drawn.volume == pytest.approx(body.volume, rel=1e-4)
    alignment = np.einsum("ij,ij->i", drawn.face_normals, normals[faces].mean(axis=1))
    assert np.quantile(alignment, 0.01) > 0.9


def test_vertices_lie_on_the_involute_and_chords_within_a_fifth_of_a_micrometre():
    """On every tooth of the solid: polar angle of each vertex, sagitta of each chord, both sides."""
    vertices = solid(PAIR, "drive").vertices
    ring = vertices[vertices[:, 2] < 0][:, :2]
    radius, polar = np.hypot(*ring.T), np.arctan2(ring[:, 1], ring[:, 0])
    half, pitch = PAIR.half_angle("drive"), 2 * pi / 90
    middle = inv(PAIR.working_pressure_angle) - half
    local = np.mod(polar - middle + pitch / 2, pitch) - pitch / 2
    start = RIG.base_radius * (1 + form(RIG, half)[0] ** 2) ** 0.5
    flank = (radius >= start - 1e-12) & (radius <= RIG.tip_radius + 1e-12)
    corner = np.array([half - inv(acos(min(1.0, RIG.base_radius / r))) for r in radius[flank]])
    off = radius[flank] * (np.abs(local[flank]) - corner)
    on_tip = np.abs(radius[flank] - RIG.tip_radius) < 1e-12
    assert np.abs(off[~on_tip]).max() < 1e-12
    assert off[on_tip].max() < 1e-12
    points = profile(PAIR, "drive")
    r = np.hypot(*points.T)
    chain = points[(r > start - 1e-12) & (np.arctan2(points[:, 1], points[:, 0]) > middle)]
    middles = 0.5 * (chain[1:] + chain[:-1])[np.diff(np.hypot(*chain.T)) < -1e-9]
    r = np.hypot(*middles.T)
    depth = (half - np.tan(np.arccos(RIG.base_radius / r)) + np.arccos(RIG.base_radius / r)) - (
        np.arctan2(middles[:, 1], middles[:, 0]) - middle
    )
    sagitta = r * depth * (RIG.base_radius / r)
    assert len(sagitta) > 20
    assert sagitta.min() > 0.0
    assert 0.15e-6 < sagitta.max() <= 0.2e-6


def test_every_tooth_has_its_number():
    """Material on tooth 5 of either gear sits where tooth 5 meshes."""
    for which in ("drive", "loose"):
        pair = PAIR.with_deviations(ToothDeviation(which, "active", 5, 20e-6))
        teeth, perfect = (outline(each, which, 1e-6).points for each in (pair, PAIR))
        (changed,) = np.flatnonzero(np.abs(teeth - perfect).max(axis=(1, 2)) > 1e-6)
        assert np.array_equal(teeth[changed], profile(pair, which, 1e-6, 5))
        theta = 2 * pi * 4 / 90
        assert [5, 5] in candidates(pair.compiled(), theta, theta, 0).tolist()
        moved = profile(pair, which, 1e-6, 5)
        turn = -theta if which == "loose" else theta
        x, y = moved[:, 0] * cos(turn) - moved[:, 1] * sin(turn), moved[:, 0] * sin(turn) + moved[:, 1] * cos(turn)
        assert y[np.argmin(np.abs(y))] == pytest.approx(0, abs=2e-4)
        assert abs(np.median(x) / RIG.reference_radius - 1) < 0.03


def posed(points, pair, which, theta):
    angle = pair.rotation(which, theta)
    turn = np.array([[cos(angle), sin(angle)], [-sin(angle), cos(angle)]])
    return points @ turn + np.array(pair.centre(which)[:2])


def polygon_distance(a, b):
    """Smallest distance of the vertices of each closed polygon from the edges of the other."""

    def one_way(points, polygon):
        start, step = polygon, np.roll(polygon, -1, axis=0) - polygon
        along = np.einsum("pij,ij->pi", points[:, None] - start, step) / np.sum(step**2, axis=1)
        foot = start + np.clip(along, 0, 1)[..., None] * step
        return float(np.hypot(*(points[:, None] - foot).T).min())

    return min(one_way(a, b), one_way(b, a))


@pytest.mark.parametrize("deviations", [(), DEVIATIONS])
@pytest.mark.parametrize("flank", [0, 1])
@pytest.mark.parametrize("form_of", ["solid", "pieces"])
def test_distance_between_the_polygons_is_the_gap_to_the_chord(form_of, flank, deviations):
    pair = PAIR.with_deviations(*deviations)
    flanks = pair.compiled()
    if form_of == "solid":
        chord = 0.2e-6
        teeth = [outline(pair, which).points for which in ("drive", "loose")]
    else:
        chord = piece_budget(pair)["chord_error_m"]
        teeth = [[p[: len(p) // 2, :2] for p in pieces(pair, which)] for which in ("drive", "loose")]
    for theta in np.linspace(0.0, 0.5, 23):
        theta_loose = theta + (90e-6 if flank == 0 else 160e-6) / RIG.base_radius
        for drive, loose in candidates(flanks, theta, theta_loose, flank):
            gap, *_, valid = flank_gap(flanks, theta, theta_loose, drive, loose, flank)
            if not valid:
                continue
            if form_of == "solid":
                shapes = teeth[0][(-(drive - 1)) % 90], teeth[1][loose - 1]
            else:
                shapes = teeth[0][drive - 1], teeth[1][loose - 1]
            near = polygon_distance(
                posed(shapes[0], pair, "drive", theta), posed(shapes[1], pair, "loose", theta_loose)
            )
            assert -1e-9 <= near - gap <= 2 * chord


@pytest.mark.parametrize("deviations", [(), DEVIATIONS])
def test_pieces_are_convex_with_every_vertex_on_the_hull(deviations):
    pair = PAIR.with_deviations(*deviations)
    for which in ("drive", "loose"):
        made = pieces(pair, which, points=24)
        assert len(made) == 90
        for piece in made[:8]:
            assert piece.shape == (96, 3)
            assert len(ConvexHull(piece[:48, :2]).vertices) == 48


def test_piece_budget_is_what_the_chords_do():
    """The chord error falls with the square of the segments, and is the sagitta of the pieces' own chords."""
    coarse, fine = piece_budget(PAIR, 12), piece_budget(PAIR, 23)
    assert coarse["chord_error_m"] / fine["chord_error_m"] == pytest.approx(4.0, rel=0.02)
    assert piece_budget(PAIR, 24)["chord_error_m"] == pytest.approx(0.2e-6, rel=0.02)
    assert 7.5e-3 < fine["extent_m"] < np.hypot(7.5e-3, 7e-3)
    assert fine["quantum_m"] == pytest.approx(fine["extent_m"] / 10216, rel=1e-12)
    steep = HarmonicDeviation("loose", "reverse", 90, 8e-6)
    assert piece_budget(PAIR.with_deviations(steep), 23)["chord_error_m"] > 1.5 * fine["chord_error_m"]


def test_mass_of_the_rig_gear():
    """A disc of steel with the section's area; inertia of a body with its symmetry."""
    body = solid(PAIR, "drive", chord=1e-6)
    found = mass_properties(body, 7850.0)
    area = exact_area(RIG, PAIR.half_angle("drive"))
    assert found.mass == pytest.approx(7850 * area * 7.5e-3, rel=3e-5)
    assert np.abs(found.centre).max() < 1e-12
    assert found.inertia[2, 2] == pytest.approx(0.5 * found.mass * (area / pi), rel=2e-3)
    assert found.inertia[0, 0] == pytest.approx(found.inertia[2, 2] / 2 + found.mass * 7.5e-3**2 / 12, rel=1e-6)


@pytest.mark.parametrize(
    ("helix", "bore", "hub"),
    [(0.0, bore, hub) for bore in (None, 0.012) for hub in (None, 0.018)]
    + [pytest.param(25.0, bore, hub, marks=pytest.mark.slow) for bore in (None, 0.012) for hub in (None, 0.018)],
)
def test_a_web_makes_a_closed_body_that_weighs_and_turns_as_it_should(helix, bore, hub):
    values = {"module": 2e-3, "teeth": 24, "face_width": 12e-3, "helix_angle": radians(helix), "bore": bore}
    gear = Gear(**values, rim=4e-3, web=3e-3, hub=hub)
    full, light = (Pair.from_backlash(g, g, 50e-6) for g in (Gear(**values), gear))
    body = solid(light, "drive")
    assert_is_a_solid(body)
    assert body.euler_number == (0 if bore else 2)
    inner, outer = gear.pocket
    assert inner == 0.5 * (hub or bore or 0.0)
    assert outer == pytest.approx(gear.root_radius - 4e-3, rel=1e-14)
    heavy, found = (mass_properties(each, 7850.0) for each in (solid(full, "drive"), body))
    taken = 7850 * 9e-3 * pi * (outer**2 - inner**2)
    assert heavy.mass - found.mass == pytest.approx(taken, rel=1e-4)
    polar = 0.5 * taken * (outer**2 + inner**2)
    assert heavy.inertia[2, 2] - found.inertia[2, 2] == pytest.approx(polar, rel=2e-4)
    assert np.abs(found.centre).max() < 1e-12
    vertices, faces, normals = solid_arrays(light, "drive")
    drawn = trimesh.Trimesh(vertices, faces, process=False)
    assert drawn.volume == pytest.approx(body.volume, rel=1e-4)
    assert np.quantile(np.einsum("ij,ij->i", drawn.face_normals, normals[faces].mean(axis=1)), 0.001) > 0.99


def test_bad_chord_and_tooth():
    with pytest.raises(InputError, match=r"chord: is 0 m \(give a positive length\)"):
        solid(PAIR, "drive", chord=0.0)
    with pytest.raises(InputError, match=r"tooth: is 91 \(the drive gear has 1 to 90\)"):
        profile(PAIR, "drive", tooth=91)
    with pytest.raises(InputError, match="which: is 'both'"):
        solid(PAIR, "both")


@pytest.mark.parametrize("chord", [8e-6, 1e-6, 0.1e-6])
@pytest.mark.parametrize("helix", [0.0, 25.0])
def test_triangles_are_counted_before_they_are_made(helix, chord):
    gear = Gear(2e-3, 24, helix_angle=radians(helix), face_width=12e-3)
    pair = Pair.from_backlash(gear, gear, 50e-6)
    assert triangles_at(pair, "drive", chord) == pytest.approx(len(solid(pair, "drive", chord).faces), rel=0.05)


def test_a_chord_too_fine_for_the_memory_is_refused_with_one_that_is_not():
    gear = Gear(2.75e-3, 37, helix_angle=radians(21.75), face_width=100e-3)
    pair = Pair.from_backlash(gear, gear, 50e-6)
    with pytest.raises(InputError, match=r"chord: is 1e-06 um: the drive gear would have .*e\+\d+ triangles") as told:
        solid(pair, "drive", 1e-12)
    least = float(told.value.faults[0].remedy.split()[3]) * 1e-6
    assert MOST_TRIANGLES / 2 < triangles_at(pair, "drive", least) <= MOST_TRIANGLES


def test_huge_gears_are_refused_at_coarse_chords_too():
    """Before anything of their size is made."""
    long = Gear(2.75e-3, 37, helix_angle=radians(21.75), face_width=200.0)
    with pytest.raises(InputError, match=r"chord: is 2 um: the drive gear would have .* \(give at least \d+ um\)"):
        solid(Pair.from_backlash(long, long, 50e-6), "drive", 2e-6)
    many = Gear(5e-3, 2000, helix_angle=radians(25), face_width=200.0)
    with pytest.raises(InputError, match="chord: is 20 um: the drive gear would have"):
        solid_arrays(Pair.from_backlash(many, many, 50e-6), "drive", 20e-6)


def test_helical_solids_mesh_in_every_section():
    """Hands are opposite: at both end faces the teeth stand as far apart as in the middle."""
    gear, mate = (Gear(2.75e-3, z, helix_angle=radians(28), face_width=16e-3) for z in (17, 43))
    pair = Pair.from_backlash(gear, mate, 200e-6)
    bodies = [solid(pair, which, chord=2e-6) for which in ("drive", "loose")]
    theta = 0.05
    theta_loose = (100e-6 + gear.base_radius * theta) / mate.base_radius
    for height in (-8e-3, 8e-3):
        sections = []
        for which, angle, body in zip(("drive", "loose"), (theta, theta_loose), bodies, strict=True):
            ring = body.vertices[np.abs(body.vertices[:, 2] - height) < 1e-12][:, :2]
            ring = posed(ring[np.hypot(*ring.T) > 1e-3], pair, which, angle)
            sections.append(ring)
        near = [np.abs(s[:, 0] - gear.reference_radius) < 8e-3 for s in sections]
        drive, loose = (s[n] for s, n in zip(sections, near, strict=True))
        assert polygon_distance(drive, loose) == pytest.approx(100e-6, abs=4e-6)
