"""Bounces: none made up, none missed, no gap violated, no energy made."""

from math import log

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gears3d.errors import InputError
from tests.lumped.rig import RPM, simulate

FALL = 0.22 * 0.148 / 0.0695  # acceleration towards the active flank under a steady drive [m/s²]


@pytest.mark.parametrize("stick", [1e-4, 1e-9])
@pytest.mark.parametrize("e", [0.3, 0.7, 0.95])
def test_bounces_under_a_steady_drive_are_geometric(e, stick):
    """Dropped from the middle of the gap: v_k = e^k·v_0, each flight 2·v_k/a long, until e·v falls below the limit."""
    done = simulate(10.0, start="free", amplitude=0.0, e=e, stick_velocity=stick)
    first = (FALL * 250e-6) ** 0.5
    count = int(np.floor(log(stick / first) / log(e))) + 1
    assert abs(log(stick / first) / log(e) % 1 - 0.5) < 0.499  # the last bounce is no matter of rounding
    speeds = first * e ** np.arange(count)
    assert len(done.impacts) == count
    assert np.abs(done.impacts[:, 2] / -speeds - 1).max() < 1e-9
    times = first / FALL + np.concatenate([[0], np.cumsum(2 * e * speeds[:-1] / FALL)])
    assert np.abs(done.impacts[:, 0] - times).max() < 1e-12
    assert np.abs(done.impacts[1:, 6] / (speeds[1:] ** 2 / (2 * FALL)) - 1).max() < 1e-9
    assert done.impacts[-1, 3] == 0.0
    assert done.contacts.tolist() == [[0, pytest.approx(times[-1], abs=1e-12), 10.0]]


def test_bounces_without_a_limit_velocity_are_cut_and_counted():
    done = simulate(3.0, start="free", amplitude=0.0, e=0.5, stick_velocity=0.0)
    assert done.counters["zeno"] == 1
    assert 30 <= done.counters["impacts"] <= 60
    assert done.contacts[-1, 1] == pytest.approx((250e-6 / FALL) ** 0.5 * 3, abs=1e-11)


def test_elastic_bounces_go_on_for_ever():
    done = simulate(20.0, start="free", amplitude=0.0, e=1.0, stick_velocity=0.0)
    first = (FALL * 250e-6) ** 0.5
    assert len(done.impacts) == int((20.0 * FALL / first - 1) / 2) + 1
    assert np.abs(done.impacts[:, 3] / first - 1).max() < 1e-9


@settings(max_examples=60, deadline=None)
@given(
    e=st.floats(0.0, 1.0),
    mean=st.floats(-50.0, 50.0),
    drag=st.floats(1e-3, 1.0),
    backlash=st.floats(1e-6, 1e-3),
    start=st.sampled_from(["active", "reverse", "free"]),
)
@example(e=1.0, mean=0.0, drag=0.22, backlash=250e-6, start="free")
def test_energy_never_rises_under_a_steady_drive(e, mean, drag, backlash, start):
    """In the frame that moves with the drive; the drag pulls towards the flank that drives."""
    done = simulate(1.0, start, 1e-3, amplitude=0.0, mean=mean, e=e, drag=drag, backlash=backlash)
    mass, side = 0.0695 / 0.148**2, np.sign(mean)
    energy = 0.5 * mass * done.samples[:, 6] ** 2 + side * drag / 0.148 * done.samples[:, 5]
    scale = drag / 0.148 * backlash
    assert np.diff(energy).max() <= 1e-9 * scale
    assert (np.abs(done.impacts[:, 3]) <= np.abs(done.impacts[:, 2])).all()


@settings(max_examples=60, deadline=None)
@given(
    e=st.floats(0.0, 1.0),
    rpm=st.floats(0.5, 60.0),
    mean=st.floats(-90.0, 90.0),
    frequency=st.floats(0.5, 40.0),
    backlash=st.floats(1e-6, 1e-3),
    stick=st.sampled_from([0.0, 1e-6, 1e-4, 1e-3]),
    start=st.sampled_from(["active", "reverse", "free"]),
)
@example(e=1.0, rpm=14.0, mean=0.0, frequency=1.0, backlash=1e-6, stick=0.0, start="active")  # turns while bouncing
def test_flanks_are_never_crossed_and_every_impact_obeys_the_law(e, rpm, mean, frequency, backlash, stick, start):
    done = simulate(
        5 / frequency, start, 5 / frequency / 3000, amplitude=rpm * RPM, frequency=frequency, mean=mean * RPM,
        backlash=backlash, e=e, stick_velocity=stick,
    )  # fmt: skip
    s, hits = done.samples[:, 5], done.impacts
    assert s.min() > -1e-12
    assert s.max() < backlash + 1e-12
    assert np.isfinite(done.samples).all()
    assert (np.sign(hits[:, 2]) == np.where(hits[:, 1] == 0, -1, 1)).all()
    stuck = hits[:, 3] == 0.0
    assert np.abs(hits[~stuck, 3] + e * hits[~stuck, 2]).max(initial=0.0) < 1e-15
    assert np.abs(e * hits[stuck, 2]).max(initial=0.0) <= max(stick, 1e-11)
    mass = 0.0695 / 0.148**2
    assert np.allclose(hits[:, 4], mass * (hits[:, 3] - hits[:, 2]), rtol=1e-6, atol=1e-12)
    assert (np.diff(hits[:, 0]) >= 0).all()
    assert (hits[:, 6] <= backlash * (1 + 1e-12)).all()
    assert len(done.samples) == 3001


def test_the_smaller_the_backlash_the_less_it_rattles():
    drops = [np.abs(simulate(1.0, backlash=b).impacts[:, 2]).max() for b in (250e-6, 250e-9, 250e-12)]
    # short flights: v = (6b)^(2/3) (w²·dV)^(1/3)/2, Rigaud & Perret-Liaudet 2020 with e = 0
    assert drops[1] / drops[2] == pytest.approx(1000 ** (2 / 3), rel=0.02)
    assert drops[0] / drops[1] == pytest.approx(1000 ** (2 / 3), rel=0.3)


def test_without_drag_the_loose_gear_flies_at_constant_speed():
    done = simulate(1.0, spacing=1e-3, drag=0.0, backlash=1.0, e=0.5)
    flying = done.samples[done.samples[:, 0] > 0.26]
    # leaves the active flank where the drive is fastest, at t = 1/12 s, with that speed
    assert done.contacts[0, 2] == pytest.approx(1 / 12, abs=1e-12)
    assert np.abs(flying[:, 4] - 50 * RPM).max() < 1e-12


def test_jammed_gears_are_refused():
    from gears3d.effects import Flank, Gear, flank_harmonic

    both = [flank_harmonic(Gear.DRIVE, flank, 1, 150e-6, 0.0) for flank in Flank]
    with pytest.raises(InputError, match=r"jammed at the start.* 0\.00025 m"):
        simulate(1.0, rows=both)
    with pytest.raises(InputError, match="did you mean 'active'"):
        simulate(1.0, start="activ")
