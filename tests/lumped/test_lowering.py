"""Effects whose normal form is lowered once more for the twin: drive motion, teeth off their axis, constant flanks."""

import numpy as np
import pytest

from gears3d.effects import Flank, Gear, Rig
from gears3d.effects import rows as form
from gears3d.gears import Eccentricity, Pair, quasi_static
from gears3d.gears import Gear as Wheel
from gears3d.lumped.lower import eccentric
from tests.lumped.rig import RPM, bench, model, run, simulate

SPUR = Pair.from_backlash(Wheel(3.5e-3, 30, profile_shift=0.4), Wheel(3.5e-3, 40, profile_shift=0.3), 2e-4)


def remainder(which, offset):
    """Largest difference of the lowered waves from the surfaces' own displacements [m]."""
    turn = np.linspace(0.0, 7.0, 101)
    ratio = SPUR.drive.base_radius / SPUR.loose.base_radius
    rig = Rig(
        SPUR.drive.base_radius, SPUR.loose.base_radius, 0.1, 0.0, 2e-4, 0.0, 1.0, 30, 40,
        working_pressure_angle=SPUR.working_pressure_angle,
    )  # fmt: skip
    found = quasi_static(SPUR.with_mounting(Eccentricity(which, offset, 0.7)), turn)
    waves = eccentric(rig, form.flank_eccentric(Gear[which.upper()], offset, 0.7))
    off = []
    for wave, place, side in zip(waves, (found.phi_active, found.phi_reverse + SPUR.backlash), (1, -1), strict=True):
        angle = turn if which == "drive" else ratio * turn + place / SPUR.loose.base_radius
        perfect = 0.0 if side == 1 else SPUR.backlash
        off.append(place - perfect - side * wave.p[3] * np.cos(angle + wave.p[4]))
    return np.abs(off).max()


@pytest.mark.parametrize("which", ["drive", "loose"])
def test_teeth_off_their_axis_are_right_to_first_order(which):
    assert SPUR.working_pressure_angle > np.radians(21)
    coarse, fine = remainder(which, 40e-6), remainder(which, 20e-6)
    assert fine < 12 * 20e-6**2  # of the size of offset²/2a
    assert coarse / fine == pytest.approx(4.0, rel=1e-3)


def test_teeth_off_their_axis_move_both_flanks():
    offset, phase = 20e-6, 0.4
    for start, mean, away in (("active", 30 * RPM, 0.0), ("reverse", -30 * RPM, 250e-6)):
        row = form.flank_eccentric(Gear.DRIVE, offset, phase)
        done = simulate(1.9, start, 1e-2, amplitude=0.0, mean=mean, rows=[row])
        angle, side = done.samples[:, 1], 1 if start == "active" else -1
        expected = offset * np.sin(angle + phase + side * np.radians(20))
        assert np.abs(done.samples[:, 5] - away - expected).max() < 1e-17


def test_motion_of_effects_is_the_drive_s_own():
    rows = [form.motion_harmonic(5 * RPM, 7.0, 0.3), form.motion_harmonic(2.0, 0.0, np.pi / 6)]
    rig = Rig(0.148, 0.148, 0.0695, 0.22, 250e-6, 0.4, 30 * RPM, 90, 90)
    mine = run(bench(e=0.4, rows=rows), 3.0)
    theirs = run(model(rig, [(20 * RPM, 3.0, 0.0), (5 * RPM, 7.0, 0.3), (2.0, 0.0, np.pi / 6)]), 3.0)
    assert len(mine.impacts) > 20
    assert np.array_equal(mine.impacts, theirs.impacts)


@pytest.mark.parametrize("gear", list(Gear))
def test_material_all_over_the_reverse_flanks_is_less_backlash_and_keeps_the_closed_form(gear):
    row = form.flank_harmonic(gear, Flank.REVERSE, 0, 60e-6, np.pi / 3)
    thick = bench(e=0.4, rows=[row])
    assert thick.backlash == pytest.approx(220e-6, abs=1e-18)
    assert len(thick.flanks) == 0
    found, plain = run(thick, 3.0).impacts, simulate(3.0, e=0.4, backlash=thick.backlash).impacts
    assert np.array_equal(found, plain)


def test_material_all_over_the_active_flanks_moves_them():
    row = form.flank_harmonic(Gear.LOOSE, Flank.ACTIVE, 0, 30e-6, 0.0)
    found, plain = simulate(3.0, e=0.4, rows=[row]).impacts, simulate(3.0, e=0.4, backlash=220e-6).impacts
    assert np.abs(found[:, 0] - plain[:, 0]).max() < 1e-11
    assert np.abs(found[:, 5] - plain[:, 5] - 30e-6).max() < 1e-15
