"""A tooth off which the gear bounces where no flank is drawn is told with its size."""

from types import SimpleNamespace

import numpy as np
import pytest

from gears3d.diagnosis import VelocityJumps
from gears3d.diagnosis.pitch_error import protruding_tooth
from gears3d.diagnosis.prediction import NEGLIGIBLE, influence
from gears3d.gears import Gear, Pair

PAIR = Pair.from_backlash(Gear(3e-3, 31), Gear(3e-3, 53), 2e-4)
RATIO = 31 / 53
NOISE = 5e-7


def _angles(random, gear, tooth, pitches):
    """Angles of drive and loose gear at places about a tooth, in pitches of its gear, in turns anywhere."""
    teeth = PAIR.gear(gear).teeth
    own = 2.0 * np.pi * (random.integers(0, 40, len(pitches)) + (tooth - 1 + pitches) / teeth)
    return (own, own * RATIO) if gear == "drive" else (own / RATIO, own)


def _at(which, drive, loose):
    """What a tooth of unit size does there."""
    gear, tooth, flank, out = which
    teeth, own = PAIR.gear(gear).teeth, drive if gear == "drive" else loose
    angle, moved = influence(PAIR, gear, ("active", "reverse")[flank], NEGLIGIBLE if out else -NEGLIGIBLE)
    since = np.mod(own * teeth - 2.0 * np.pi * (tooth - 1) + np.pi * teeth, 2.0 * np.pi * teeth) - np.pi * teeth
    return np.interp(since, angle, moved / NEGLIGIBLE, left=0.0, right=0.0)


def _records(random, which=None, size=6e-5, count=3, sizes=None):
    """Records whose corners lie on the flanks, but on a tooth."""
    made = []
    for _ in range(count):
        drive = random.uniform(0.0, 1200.0, 400)
        loose, flank = drive * RATIO, random.integers(0, 2, 400)
        if which is not None:
            beside = _angles(random, which[0], which[1], random.uniform(-1.0, 1.5, 30))
            drive, loose = np.append(drive, beside[0]), np.append(loose, beside[1])
            flank = np.append(flank, np.full(30, which[2]))
        off = random.normal(0.0, NOISE, len(drive))
        if which is not None:
            on = flank == which[2]
            own = size if sizes is None else random.uniform(*sizes, np.count_nonzero(on))
            off[on] += own * _at(which, drive[on], loose[on])
        corners = VelocityJumps(drive, loose, flank, off, np.full(len(drive), NOISE))
        made.append(SimpleNamespace(pair=PAIR, channels=SimpleNamespace(velocity_jumps=corners)))
    return made


@pytest.mark.parametrize("out", [True, False])
@pytest.mark.parametrize(("gear", "tooth", "flank"), [("drive", 1, 0), ("drive", 17, 1), ("loose", 53, 0)])
def test_the_tooth_is_told_with_its_size_and_side(gear, tooth, flank, out):
    random = np.random.default_rng(tooth)
    (found,) = protruding_tooth(_records(random, (gear, tooth, flank, out)))
    assert (found.gear, found.tooth, found.flank) == (gear, tooth, ("active", "reverse")[flank])
    assert abs(found.offset) == pytest.approx(6e-5, rel=5e-3)
    assert (found.offset > 0.0) == (out == (flank == 0))  # displaced forwards it stands out on its active flank


def test_corners_on_the_flanks_tell_no_tooth():
    assert not any(protruding_tooth(_records(np.random.default_rng(seed))) for seed in range(10))


def test_corners_at_all_depths_are_no_tooth_that_was_struck():
    random = np.random.default_rng(5)
    assert protruding_tooth(_records(random, ("drive", 8, 0, True), sizes=(5e-6, 1e-4))) == ()
