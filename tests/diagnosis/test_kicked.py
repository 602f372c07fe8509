"""A tooth that throws the loose gear off whenever it comes by is suspected; ends of contact anywhere suspect none."""

from types import SimpleNamespace

import numpy as np
import pytest

from gears3d.diagnosis import ContactEnds
from gears3d.diagnosis.pitch_error import tooth_synchronous_contact_loss
from gears3d.diagnosis.prediction import NEGLIGIBLE, influence
from gears3d.gears import Gear, Pair

PAIR = Pair.from_backlash(Gear(3e-3, 31), Gear(3e-3, 53), 2e-4)


def _records(random, gear="loose", tooth=None, count=3, flank=0):
    """Records whose contacts end anywhere, and in which those of one flank end where a tooth begins to stand out."""
    made = []
    for _ in range(count):
        drive = random.uniform(0.0, 300.0, 60)
        loose, flanks = drive * 31 / 53 + random.normal(0.0, 1e-3, 60), random.integers(0, 2, 60)
        if tooth is not None:
            teeth = PAIR.gear(gear).teeth
            at, moved = influence(PAIR, gear, ("active", "reverse")[flank], NEGLIGIBLE)
            begins = at[np.argmax(np.abs(moved) > 0.02 * NEGLIGIBLE)] / teeth
            turns = 2.0 * np.pi * random.integers(0, 40, 20) + (tooth - 1) * 2.0 * np.pi / teeth + begins
            other = turns * (53 / 31 if gear == "loose" else 31 / 53)
            ends = (turns, other) if gear == "drive" else (other, turns)
            drive, loose = np.r_[drive, ends[0]], np.r_[loose, ends[1]]
            flanks = np.r_[flanks, np.full(20, flank)]
        channels = SimpleNamespace(contact_ends=ContactEnds(drive, loose, flanks))
        motion = SimpleNamespace(mean=100.0, harmonics=np.zeros((0, 3)))
        made.append(SimpleNamespace(pair=PAIR, channels=channels, motion=motion, radii=(31.0, 53.0)))
    return made


@pytest.mark.parametrize(("gear", "tooth", "flank"), [("loose", 34, 0), ("drive", 11, 0), ("drive", 1, 1)])
def test_the_tooth_that_throws_is_suspected(gear, tooth, flank):
    (found,) = tooth_synchronous_contact_loss(_records(np.random.default_rng(tooth), gear, tooth, flank=flank), ())
    assert (found.name, found.where) == (f"contact.tooth_{gear}", tooth)


def test_ends_of_contact_anywhere_suspect_no_tooth():
    random = np.random.default_rng(3)
    assert not any(tooth_synchronous_contact_loss(_records(random), ()) for _ in range(50))


@pytest.mark.parametrize("order", [2, 7])
def test_an_order_that_throws_at_several_places_is_no_tooth(order):
    """A wave of the flank ends contact at each of its crests."""
    random = np.random.default_rng(order)
    made = _records(random)
    for one in made:
        ends = one.channels.contact_ends
        crest = 2.0 * np.pi * (random.integers(0, 40 * order, 120) / order) + 0.3 + random.normal(0.0, 0.02, 120)
        one.channels.contact_ends = ContactEnds(np.append(ends.drive, crest), np.append(ends.loose, crest * 31 / 53),
                                         np.append(ends.flank, np.zeros(120, int)))  # fmt: skip
    assert tooth_synchronous_contact_loss(made, ()) == []


def test_a_place_in_one_record_alone_is_that_of_its_speed():
    random = np.random.default_rng(4)
    assert not tooth_synchronous_contact_loss([*_records(random, count=2), *_records(random, tooth=7, count=1)], ())


@pytest.mark.parametrize("order", [0.5, 1.0])
def test_a_motion_that_repeats_with_the_drive_suspects_no_tooth(order):
    """In each record contact ends at one place; that of two among five is the same tooth by chance (space, 1485)."""
    random, made = np.random.default_rng(6), []
    for place in (16.2, 24.8, 15.8, 16.4, 9.1):
        one = _records(random, count=1)[0]
        turns = 2.0 * np.pi * (np.arange(30) / order + place / 31) + random.normal(0.0, 1e-3, 30)
        one.channels.contact_ends = ContactEnds(turns, turns * 31 / 53, np.zeros(30, int))
        one.motion.harmonics = np.array([[1e-3, 0.0, 100.0 * order]])
        made.append(one)
    assert tooth_synchronous_contact_loss(made, ()) == []
    for one in made:
        one.motion.harmonics = np.zeros((0, 3))
    assert len(tooth_synchronous_contact_loss(made, ())) == 1
