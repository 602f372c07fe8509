"""A tooth that stands back is told by the corners of paths on it, and by no others; so is one that is out of step."""

from types import SimpleNamespace

import numpy as np
import pytest

from gears3d.diagnosis import VelocityJumps
from gears3d.diagnosis.pitch_error import SHORT_GAIN, _short_teeth, on_both, short_tooth
from gears3d.diagnosis.prediction import over_tooth
from gears3d.effects import catalogue
from gears3d.gears import Gear, Pair, ToothDeviation, quasi_static

PAIR = Pair.from_backlash(Gear(3e-3, 31), Gear(3e-3, 53), 2e-4)
RIG = SimpleNamespace(backlash=PAIR.backlash)
NOISE = 5e-7
OTHER = {"drive": 31, "loose": 53}


def _records(random, gear="drive", tooth=1, flank=1, thickness=0.0, count=3, rounded=0.0, nominal=PAIR):
    """Records whose corners lie where gears with one tooth out of step touch, some rounded off by a part of it."""
    side = ("active", "reverse")[flank]
    pair = nominal.with_deviations(ToothDeviation(gear, side, tooth, thickness)) if thickness else nominal
    made = []
    for _ in range(count):
        teeth = random.uniform(-0.5, 52.5, 500)  # of the drive, from tooth 1, in a mesh that both begin at 0
        near = (tooth - 1) + random.uniform(-1.5, 1.5, 40)
        theta = np.append(teeth, near) * 2.0 * np.pi / nominal.drive.teeth
        found = quasi_static(pair, theta)
        side_of = np.append(random.integers(0, 2, 500), np.full(40, flank))
        phi = np.where(side_of == 1, found.phi_reverse, found.phi_active)
        loose = (theta * nominal.drive.base_radius + phi + nominal.backlash * side_of) / nominal.loose.base_radius
        off = phi * (1.0 - rounded * random.uniform(0.0, 1.0, len(phi))) + random.normal(0.0, NOISE, len(phi))
        corners = VelocityJumps(theta, loose, side_of, off, np.full(len(theta), NOISE))
        made.append(SimpleNamespace(pair=nominal, rig=RIG, channels=SimpleNamespace(velocity_jumps=corners)))
    return made


@pytest.mark.parametrize("rounded", [0.0, 0.3])
@pytest.mark.parametrize(("gear", "tooth", "flank", "depth"), [
    ("drive", 5, 1, 1.2e-4), ("loose", 7, 1, 1e-5), ("loose", 9, 0, 1.2e-4), ("drive", 31, 0, 8e-6),
])  # fmt: skip
def test_the_tooth_is_told_no_deeper_than_it_is(gear, tooth, flank, depth, rounded):
    found = short_tooth(_records(np.random.default_rng(tooth), gear, tooth, flank, -depth, rounded=rounded))
    assert found is not None
    assert (found.effect.gear, found.effect.tooth) == (gear, tooth)
    assert found.effect.flank == ("active", "reverse")[flank]
    assert (found.effect.offset > 0.0) == (flank == 1)  # displaced forwards it stands back on its reverse flank
    assert 0.3 * min(depth, 3e-5) < abs(found.effect.offset) < 1.02 * depth


def test_the_tooth_that_it_always_meets_is_not_excluded():
    """At a ratio of 1 two teeth are always together, and no corner tells which of them stands back."""
    equal = Pair.from_backlash(Gear(3e-3, 31), Gear(3e-3, 31), 2e-4)
    found = short_tooth(_records(np.random.default_rng(5), "drive", 5, 1, -1e-4, nominal=equal))
    assert found is not None
    (other,) = found.others
    told = {(one.gear, one.tooth) for one in (found.effect, other.causes[0].effect)}
    assert ("drive", 5) in told
    assert {gear for gear, _ in told} == {"drive", "loose"}
    assert short_tooth(_records(np.random.default_rng(5), "drive", 5, 1, -1e-4)).others == ()


def test_corners_on_the_flanks_tell_no_tooth():
    for seed in range(10):
        records = _records(np.random.default_rng(seed))
        assert short_tooth(records) is None
        assert max(one.gain for one in _short_teeth(records)) < 0.25 * SHORT_GAIN  # not by a narrow margin


def test_corners_cut_wrongly_here_and_there_tell_no_tooth():
    for seed in range(10):
        random = np.random.default_rng(seed)
        records = _records(random)
        for one in records:
            far = random.integers(0, 540, 12)
            one.channels.velocity_jumps.off[far] += random.uniform(-6e-5, 6e-5, 12)
        assert short_tooth(records) is None


def _without(records, gear, tooth, flank):
    """Records of which no corner lies where a tooth carries alone."""
    for one in records:
        seen = one.channels.velocity_jumps
        own = seen.drive if gear == "drive" else seen.loose
        keep = over_tooth(PAIR, gear, tooth, ("active", "reverse")[flank], -1.0, own) == 0.0
        one.channels.velocity_jumps = VelocityJumps(*(column[keep] for column in seen))
    return records


def test_one_record_alone_tells_no_tooth():
    random = np.random.default_rng(6)
    others = _without(_records(random, count=2), "drive", 5, 1)
    assert short_tooth([*others, *_records(random, "drive", 5, 1, -1e-4, count=1)]) is None
    assert short_tooth([*others, *_records(random, "drive", 5, 1, -1e-4, count=2)]) is not None


def test_records_whose_flank_was_drawn_wrongly_tell_no_tooth():
    """All corners are off, those about one tooth as far as if it stood back, and nobody else has seen that tooth."""
    random = np.random.default_rng(7)
    others, wrong = _without(_records(random), "loose", 2, 1), _records(random, "loose", 2, 1, -2e-5, count=2)
    assert short_tooth([*others, *wrong]) is not None
    for one in wrong:
        seen = one.channels.velocity_jumps
        far = (seen.flank == 1) & (over_tooth(PAIR, "loose", 2, "reverse", -1.0, seen.loose) == 0.0)
        seen.off[far] += random.uniform(-5e-5, 5e-5, np.count_nonzero(far))
    assert short_tooth([*others, *wrong]) is None


def test_teeth_that_all_stand_back_are_no_single_one():
    random = np.random.default_rng(3)
    records = _records(random)
    for one in records:
        one.channels.velocity_jumps.off[:] += 1e-5 * np.cos(3.0 * one.channels.velocity_jumps.drive)
    assert short_tooth(records) is None


def test_a_tooth_out_of_step_is_back_on_its_other_flank_where_corners_say_so():
    out = catalogue()["pitch_error"](offset=1.2e-4, tooth=5, gear="drive", flank="active")
    back = _records(np.random.default_rng(4), "drive", 5, 1, -1.2e-4)
    assert on_both(back, out).flank == "both"
    assert on_both(_records(np.random.default_rng(4)), out) == out


def test_one_that_stands_back_is_not_held_for_out_on_its_other_flank():
    back = catalogue()["pitch_error"](offset=-3e-5, tooth=5, gear="drive", flank="active")
    assert on_both(_records(np.random.default_rng(4), "drive", 5, 1, -3e-5), back) == back
