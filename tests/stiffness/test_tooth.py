"""One tooth: closed forms of beams, the published integrals of involute teeth, the published fit of the body."""

from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest

from gears3d.gears import Gear, Pair, inv
from gears3d.stiffness import (
    STEEL,
    Beam,
    Material,
    bend,
    contact_path,
    foundation,
    iso_single_stiffness,
    pair_stiffness,
    tooth_compliance,
)
from gears3d.stiffness.tooth import BODY_RATIO, COEFFICIENTS, ROOT_ANGLE


def pair(first=19, second=48, module=3.175e-3, width=16e-3, backlash=1e-9, **rack):
    return Pair.from_backlash(*(Gear(module, z, face_width=width, **rack) for z in (first, second)), backlash)


def test_a_slab_bends_shears_and_shortens_as_in_closed_form():
    length, half, angle, offset = 0.03, 2e-3, 0.4, 1.5e-3
    x = np.linspace(0.0, 0.05, 8001)
    bending, shear, axial = bend(Beam(x + 0.02, np.full_like(x, half)), length + 0.02, offset, angle)
    inertia, area, c, s = 2.0 * half**3 / 3.0, 2.0 * half, cos(angle), sin(angle)
    moments = c * c * length**3 / 3.0 - c * s * offset * length**2 + s * s * offset**2 * length
    assert bending == pytest.approx(moments / (STEEL.young * inertia), rel=1e-6)
    assert shear == pytest.approx(1.2 * c * c * length / (STEEL.shear * area), rel=1e-9)
    assert axial == pytest.approx(s * s * length / (STEEL.young * area), rel=1e-9)


def test_a_wedge_bends_as_in_closed_form():
    length, root = 0.02, 4e-3
    x = np.linspace(0.0, 0.9 * length, 20001)
    beam = Beam(x, root * (length - x) / length)
    at = np.array([0.9 * length])
    # ∫(u − a)²/u³ du with u = L − x from a = 0.1·L, where the force acts, to L
    a, low, high = 0.1 * length, 0.1 * length, length
    whole = np.log(high / low) + 2.0 * a * (1.0 / high - 1.0 / low) - 0.5 * a * a * (1.0 / high**2 - 1.0 / low**2)
    assert bend(beam, at, 0.0, 0.0)[0][0] == pytest.approx(1.5 * length**3 / (STEEL.young * root**3) * whole, rel=1e-6)


@pytest.mark.parametrize("teeth", [19, 30, 48])
def test_involute_teeth_have_the_compliance_of_the_published_integrals(teeth):
    """Yang & Lin 1987 integrate over the angle, from the base circle on; no fillet, no body."""
    alpha0, base, young, poisson = np.radians(20.0), 0.03, STEEL.young, STEEL.poisson
    alpha2 = pi / (2 * teeth) + inv(alpha0)
    alpha1 = 0.32
    angle = np.linspace(-alpha1, alpha2, 40001)
    half = np.sin(angle) + (alpha2 - angle) * np.cos(angle)
    step = (alpha2 - angle) * np.cos(angle)
    lever = 1.0 + cos(alpha1) * ((alpha2 - angle) * np.sin(angle) - np.cos(angle))
    published = [
        np.trapezoid(3.0 * lever**2 * step / (2.0 * young * half**3), angle),
        np.trapezoid(1.2 * (1.0 + poisson) * step * cos(alpha1) ** 2 / (young * half), angle),
        np.trapezoid(step * sin(alpha1) ** 2 / (2.0 * young * half), angle),
    ]
    roll = np.linspace(0.0, 1.0, 20001)
    radius, polar = base * np.hypot(1.0, roll), alpha2 - (roll - np.arctan(roll))
    beam = Beam(radius * np.cos(polar), radius * np.sin(polar))
    at = alpha1 + alpha2
    height, offset = (np.interp(at, roll, column) for column in beam)
    assert bend(beam, height, offset, alpha1) == pytest.approx(published, rel=1e-5)


def test_the_fit_of_the_body_keeps_to_its_published_ranges():
    """Sainsot, Velex & Duverger 2004, table: L* 6.82 to 6.94, M* 1.08 to 3.29, P* 2.56 to 13.47, Q* 0.141 to 0.62."""
    theta, ratio = np.meshgrid(np.linspace(0.03, ROOT_ANGLE[1], 100), np.linspace(*BODY_RATIO, 100))
    terms = np.stack([theta**-2.0, ratio**2, ratio / theta, 1.0 / theta, ratio, np.ones_like(theta)])
    values = np.einsum("ij,jkl->ikl", COEFFICIENTS, terms)
    published = [(6.82, 6.94), (1.08, 3.29), (2.56, 13.47), (0.141, 0.62)]
    for found, (low, high) in zip(values, published, strict=True):
        assert 0.8 * low < found.min() < 1.5 * low
        assert 0.85 * high < found.max() < 1.1 * high  # the corners of the fit are not those of the table


def test_a_body_on_a_thin_shaft_gives_way_further():
    arms = np.array([1e-3, 3e-3])
    assert (foundation(arms, 0.3, 5e-3, 0.06, 4.0) > foundation(arms, 0.3, 5e-3, 0.06, 1.5)).all()


@pytest.mark.parametrize(
    "mesh",
    [
        pair(),
        pair(30, 30),
        pair(25, 75, 2e-3),
        pair(62, 62, 2e-3),
        pair(40, 80, 1e-3, pressure_angle=np.radians(22.5)),
        pair(17, 43, 2.75e-3, helix_angle=np.radians(28.0)),
        pair(30, 50, 2.5e-3, helix_angle=np.radians(15.0)),
    ],
    ids=lambda mesh: f"{mesh.drive.teeth}-{mesh.loose.teeth}",
)
def test_the_largest_single_stiffness_is_that_of_iso(mesh):
    """ISO 6336-1 in theory (C_M = 1); there the contact depends on the load, in the method here it does not."""
    largest = pair_stiffness(mesh, np.linspace(*contact_path(mesh), 400)).max() * cos(mesh.drive.base_helix_angle)
    assert largest == pytest.approx(iso_single_stiffness(mesh, 1.0), rel=0.15)


def test_helical_teeth_are_as_stiff_as_the_spur_teeth_of_their_normal_section():
    # 30 virtual teeth of a helix of 25 deg, once as spur teeth and once as 22 or 23 helical teeth
    beta = np.radians(25.0)
    stiff = []
    for teeth in (22, 23):
        helical = pair(teeth, teeth, 2e-3, helix_angle=beta)
        virtual = teeth / (cos(helical.drive.base_helix_angle) ** 2 * cos(beta))
        stiff.append((virtual, float(pair_stiffness(helical, 0.0))))
    spur = [(z, float(pair_stiffness(pair(z, z, 2e-3), 0.0))) for z in range(27, 33)]
    for virtual, found in stiff:
        assert found == pytest.approx(np.interp(virtual, *np.array(spur).T), rel=0.03)


def test_stiffness_per_width_depends_on_shape_alone_and_goes_with_youngs_modulus():
    place = 0.3
    small, large = (pair_stiffness(pair(module=m, backlash=1e-3 * m), place * m) for m in (1e-3, 5e-3))
    assert small == pytest.approx(large, rel=1e-10)
    twice = Material(2.0 * STEEL.young, STEEL.poisson)
    assert pair_stiffness(pair(), 1e-3, twice) == pytest.approx(2.0 * pair_stiffness(pair(), 1e-3), rel=1e-12)


def test_gears_that_change_places_change_the_sense_of_the_path():
    one, other = pair(19, 48), pair(48, 19)
    place = np.linspace(*contact_path(one), 50)
    assert pair_stiffness(one, place) == pytest.approx(pair_stiffness(other, -place), rel=1e-9)


def test_a_tooth_gives_way_more_towards_its_tip_and_when_it_is_thinned():
    mesh = pair(30, 30, 2e-3)
    rolls = np.linspace(mesh.start_roll("drive"), mesh.drive.tip_roll, 60)
    thick = tooth_compliance(mesh, "drive", rolls)
    assert (np.diff(thick.bending) > 0.0).all()
    assert (np.diff(thick.shear) > 0.0).all()
    assert (tooth_compliance(replace(mesh, thinning=2e-4), "drive", rolls).total > thick.total).all()


def test_the_angle_of_the_force_is_that_of_the_flank():
    # the compression vanishes where the force is square to the middle of the tooth: roll = half the base angle
    mesh = pair(60, 60, 2e-3)
    square = mesh.half_angle("drive")
    assert tooth_compliance(mesh, "drive", square).axial == pytest.approx(0.0, abs=1e-30)
