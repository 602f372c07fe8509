"""A frequency that stays where it is at every speed, in closed form: lines of the drive and of angles are none."""

from types import SimpleNamespace

import numpy as np
import pytest

from gears3d.diagnosis.residual_patterns import resonance

RATE, LASTS, BACKLASH = 5000.0, 4.0, 3e-4
SPEEDS = (5.0, 9.0, 21.0)


def _bench(place, speeds=SPEEDS, fluctuation=4.0, few=0, like=None):
    """Records with a displacement of ``place(time, speed)`` [m], and the rig that would have shown ``like``."""
    time = np.arange(0.0, LASTS, 1.0 / RATE)
    rig = SimpleNamespace(backlash=BACKLASH)
    records, tracks, expected = [], {}, {}
    for speed in speeds:
        strong = SimpleNamespace(frequency=fluctuation, amplitude=0.1 * speed)
        weak = [SimpleNamespace(frequency=speed / (2.0 * np.pi), amplitude=0.005 * speed)] * few
        motion = SimpleNamespace(mean=speed, harmonics=[strong, *weak])
        one = SimpleNamespace(rig=SimpleNamespace(motion=motion, rig=lambda: rig))
        for paths, shown in ((tracks, place), (expected, like or _rattle)):
            paths[id(one)] = SimpleNamespace(
                radii=(1.0, 1.0), drive=shown(time, speed), loose=np.zeros_like(time), step=1.0 / RATE
            )
        records.append(one)
    return records, SimpleNamespace(of=lambda one: tracks[id(one)]), lambda one: expected[id(one)]


def _rattle(time, speed):
    """Triangles across the gap with the drive's fluctuation: lines that fall with the square of their frequency."""
    random = np.random.default_rng(int(10 * speed))
    return BACKLASH * np.abs(np.mod(4.0 * time, 1.0) - 0.5) + 1e-7 * random.normal(size=len(time))


def _swayed(damping):
    def place(time, speed):
        blows = np.arange(0.03, LASTS, 0.125)
        since = time[:, None] - blows
        turn = 2.0 * np.pi * 92.0
        ring = np.where(since > 0.0, np.exp(-damping * turn * np.maximum(since, 0.0)) * np.sin(turn * since), 0.0)
        return _rattle(time, speed) + 3e-5 * ring @ np.where(np.arange(len(blows)) % 2, 1.0, -1.0)

    return place


@pytest.mark.parametrize("damping", [0.01, 0.03])
def test_what_rings_at_every_speed_is_told_with_its_frequency(damping):
    found = resonance(*_bench(_swayed(damping)))
    assert found is not None
    assert found.structure.where == pytest.approx(92.0, rel=0.05)
    assert found.structure.name == "impact.duration"
    assert 3e-6 < found.structure.size < 3e-5
    assert found.power.shape == (len(SPEEDS), len(found.frequency))


def test_lines_of_the_rattle_are_none_though_the_drive_has_a_weak_and_slow_harmonic():
    def place(time, speed):
        """One fall across the gap and back in each period of 1/7 s: lines at all multiples of 7 Hz."""
        part = np.mod(7.0 * time, 1.0)
        return 1e-7 * np.random.default_rng(int(10 * speed)).normal(size=len(time)) + 4.0 * BACKLASH * part * (
            1.0 - part
        )

    assert resonance(*_bench(place, fluctuation=7.0, few=0)) is None
    assert resonance(*_bench(place, fluctuation=7.0, few=1)) is None


def test_rattle_alone_and_an_order_that_moves_with_the_speed_are_none():
    assert resonance(*_bench(_rattle)) is None
    assert resonance(*_bench(lambda time, speed: _rattle(time, speed) + 3e-5 * np.cos(25.3 * speed * time))) is None


def test_of_one_speed_alone_nothing_is_told():
    assert resonance(*_bench(_swayed(0.02), (9.0, 9.1, 9.2))) is None


def test_what_spoils_nothing_is_not_told():
    def small(time, speed):
        return _rattle(time, speed) + 0.03 * (_swayed(0.02)(time, speed) - _rattle(time, speed))

    assert resonance(*_bench(small)) is None


def test_the_same_fluctuation_at_every_speed_tells_none():
    records, tracks, expected = _bench(_swayed(0.01))
    for one in records:
        one.rig.motion.harmonics[0].amplitude = 1.0
    assert resonance(records, tracks, expected) is None


def test_what_the_rig_itself_would_show_is_none():
    assert resonance(*_bench(_swayed(0.01), like=_swayed(0.01))) is None
