"""Teeth together: the limits of slices, of spur teeth and of whole overlap, width, harmonics and the reverse flanks."""

from math import asin, pi, tan

import numpy as np
import pytest

from gears3d.gears import Gear, Pair
from gears3d.scenario import load
from gears3d.stiffness import contact_path, harmonics, iso_mesh_stiffness, mesh_stiffness, pair_stiffness


def pair(helix=0.0, width=16e-3, first=17, second=43):
    return Pair.from_backlash(*(Gear(2.75e-3, z, helix_angle=helix, face_width=width) for z in (first, second)), 1e-4)


HELICAL = pair(np.radians(28.0))
PITCH = 2 * pi / 17


def overlapping(overlap, width=30e-3, module=2.75e-3):
    """Width and module fix the helix of a whole overlap: b·sin β = overlap·π·mn."""
    return pair(asin(overlap * pi * module / width), width, 23, 43)


def test_spur_teeth_alternate_between_one_and_two_pairs():
    mesh = pair()
    angles = np.linspace(0.0, PITCH, 2000, endpoint=False)
    stiff = mesh_stiffness(mesh, angles)
    begin, end = contact_path(mesh)
    places = mesh.drive.base_radius * angles[:, None] - mesh.drive.base_pitch * np.arange(-2, 3)
    touching = ((places >= begin) & (places <= end)).sum(axis=1)
    assert set(touching) == {1, 2}
    assert np.mean(touching) == pytest.approx(mesh.contact_ratio, abs=2e-3)
    assert stiff[touching == 2].min() > 1.3 * stiff[touching == 1].max()
    single = pair_stiffness(mesh, places).max(axis=1) * 16e-3
    assert stiff[touching == 1] == pytest.approx(single[touching == 1], rel=1e-12)


def test_a_helix_that_goes_to_zero_is_a_spur_gear():
    angles = np.linspace(0.0, PITCH, 60)
    begin, end = contact_path(pair())
    places = pair().drive.base_radius * angles[:, None] - pair().drive.base_pitch * np.arange(-2, 3)
    clear = np.abs(np.stack([places - begin, places - end])).min(axis=(0, 2)) > 1e-4
    assert mesh_stiffness(pair(1e-4), angles)[clear] == pytest.approx(mesh_stiffness(pair(), angles)[clear], rel=1e-5)


def test_slices_converge_to_their_limit():
    angles = np.linspace(0.0, PITCH, 40)
    limit = mesh_stiffness(HELICAL, angles)
    errors = [np.sqrt(np.mean((mesh_stiffness(HELICAL, angles, slices=n) / limit - 1.0) ** 2)) for n in (8, 32, 128)]
    assert errors[2] < 4e-3
    assert errors[0] > 2.5 * errors[1] > 6.25 * errors[2]


@pytest.mark.parametrize("overlap", [1, 2])
def test_whole_overlap_leaves_no_ripple(overlap):
    mesh = overlapping(overlap)
    assert mesh.overlap_ratio == pytest.approx(overlap, rel=1e-9)
    stiff = mesh_stiffness(mesh, np.linspace(0.0, 2 * pi / 23, 100))
    assert np.ptp(stiff) < 1e-5 * stiff.mean()
    half = mesh_stiffness(overlapping(overlap - 0.5), np.linspace(0.0, 2 * pi / 23, 100))
    assert np.ptp(half) > 0.03 * half.mean()


def test_stiffness_grows_with_the_face_width():
    angles = np.linspace(0.0, PITCH, 50)
    widths = (4e-3, 8e-3, 12e-3, 16e-3, 24e-3)
    helical = [mesh_stiffness(pair(0.4, width), angles) for width in widths]
    assert (np.diff(helical, axis=0) > 0.0).all()
    means = [harmonics(pair(0.4, width)).mean / width for width in widths]
    assert means == pytest.approx([means[0]] * 5, rel=1e-12)


@pytest.mark.parametrize("flank", ["active", "reverse"])
def test_the_series_adds_up_to_the_sum_over_the_pairs(flank):
    angles = np.linspace(0.0, 2 * PITCH, 97)
    series = harmonics(HELICAL, 300, flank)
    assert series(angles) == pytest.approx(mesh_stiffness(HELICAL, angles, flank), rel=2e-3)
    around = mesh_stiffness(HELICAL, np.linspace(0.0, PITCH, 4000, endpoint=False), flank)
    assert series.mean == pytest.approx(around.mean(), rel=1e-5)
    few = harmonics(HELICAL, 3, flank)
    assert few.cosines == pytest.approx(series.cosines[:3], abs=1e-6 * series.mean)
    spectrum = np.fft.rfft(around) / len(around)
    assert 2.0 * spectrum[1:4].real == pytest.approx(few.cosines, abs=1e-4 * few.mean)
    assert -2.0 * spectrum[1:4].imag == pytest.approx(few.sines, abs=1e-4 * few.mean)


def test_reverse_flanks_are_the_active_ones_turned_backwards():
    # a gear and its mirror image: the reverse flanks meet as the active ones do, in the other sense of rotation
    lead = 2.0 * HELICAL.half_angle("drive") - 2.0 * (
        tan(HELICAL.working_pressure_angle) - HELICAL.working_pressure_angle
    )
    angles = np.linspace(0.0, PITCH, 37)
    assert mesh_stiffness(HELICAL, lead - angles, "reverse") == pytest.approx(mesh_stiffness(HELICAL, angles), rel=1e-9)
    assert harmonics(HELICAL, 4, "reverse").mean == pytest.approx(harmonics(HELICAL, 4).mean, rel=1e-12)


def test_the_representative_pair_is_as_stiff_as_iso_has_it():
    mesh = load("scenarios/base/helical-17-43.toml").pair()
    series = harmonics(mesh)
    assert series.mean == pytest.approx(iso_mesh_stiffness(mesh), rel=0.15)
    assert 0.02 < series.ripple < 0.12
