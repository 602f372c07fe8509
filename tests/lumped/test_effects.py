"""Every normal form in the kernel: torques over flights and contacts, restitution, deviations."""

from math import cos, exp, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from gears3d.effects import Flank, Gate, Gear, Row
from gears3d.effects import rows as form
from gears3d.errors import InputError
from tests.lumped.rig import RPM, bench, simulate

J, RB, DRAG = 0.0695, 0.148, 0.22


def fall(rows, law, mean=30 * RPM, duration=0.5, drag=DRAG):
    """A long flight without drive harmonics, and the same from scipy; ``law(t, theta, w)`` is the torque."""
    done = simulate(duration, "free", duration / 100, amplitude=0.0, mean=mean, drag=drag, backlash=20.0, rows=rows)
    assert done.counters["impacts"] == 0
    start = done.samples[0, 2]
    theirs = solve_ivp(
        lambda t, y: [y[1], -law(t, y[0], y[1]) / J], (0, duration), [start, mean], "DOP853", done.samples[:, 0],
        rtol=1e-13, atol=1e-13, max_step=duration / 100,
    )  # fmt: skip
    return np.abs(done.samples[:, [2, 4]] - theirs.y.T).max()


@pytest.mark.parametrize(
    ("rows", "law"),
    [
        ([], lambda t, a, w: DRAG),
        ([form.torque_constant(0.1)], lambda t, a, w: DRAG + 0.1),
        ([form.torque_linear(0.05, 2.0)], lambda t, a, w: DRAG + 0.05 * (w - 2.0)),
        ([form.torque_power(0.03, 1.5)], lambda t, a, w: DRAG + 0.03 * w**1.5),
        ([form.torque_power(0.03, 0.59)], lambda t, a, w: DRAG + 0.03 * w**0.59),
        ([form.torque_power(0.02, 2.0)], lambda t, a, w: DRAG + 0.02 * w**2),
        ([form.torque_harmonic(90, 0.15, 0.4)], lambda t, a, w: DRAG + 0.15 * cos(90 * a + 0.4)),
        ([form.torque_relax(0.1, 0.2)], lambda t, a, w: DRAG + 0.1 * (1 - exp(-t / 0.2))),
        ([form.torque_constant(0.1, Gate.CONTACT)], lambda t, a, w: DRAG),
        ([form.torque_constant(0.1, Gate.REVERSE)], lambda t, a, w: DRAG),
        ([form.torque_linear(0.05, 0.0, Gate.FLIGHT)], lambda t, a, w: DRAG + 0.05 * w),
        (
            [form.torque_power(0.03, 1.5), form.torque_harmonic(3, 0.1, 0), form.torque_linear(0.02)],
            lambda t, a, w: DRAG + 0.03 * w**1.5 + 0.1 * cos(3 * a) + 0.02 * w,
        ),
    ],
)
def test_flights_follow_their_torques(rows, law):
    assert fall(rows, law) < 1e-10  # rad after half a second in the air


@settings(max_examples=25, deadline=None)
@given(
    power=st.floats(0.3, 3.0), c=st.floats(0.0, 0.05), order=st.integers(1, 180), amplitude=st.floats(0.0, 0.2),
    linear=st.floats(0.0, 0.1), phase=st.floats(-3.0, 3.0),
)  # fmt: skip
def test_flights_follow_any_torques(power, c, order, amplitude, linear, phase):
    rows = [form.torque_power(c, power), form.torque_harmonic(order, amplitude, phase), form.torque_linear(linear)]
    law = lambda t, a, w: DRAG + c * w**power + amplitude * cos(order * a + phase) + linear * w  # noqa: E731
    assert fall(rows, law, mean=10.0, duration=0.3) < 1e-10


def test_coulomb_drag_stops_the_gear_and_holds_it():
    done = simulate(2.0, "free", 1e-2, amplitude=0.0, backlash=20.0)
    time, speed = done.samples[:, 0], done.samples[:, 4]
    assert np.abs(speed - np.maximum(0.0, 30 * RPM - DRAG / J * time)).max() < 1e-12
    assert (speed[time > 30 * RPM * J / DRAG + 1e-9] == 0.0).all()


def test_a_gear_at_rest_breaks_loose_where_dry_drag_no_longer_holds_it():
    """Dry drag fades below what a constant pull needs: DRAG − 0.2·(1 − exp(−t/0.5)) = 0.1."""
    rows = [form.torque_relax(-0.2, 0.5), form.torque_linear(1e-3, -100.0)]
    done = simulate(1.0, "free", 1e-3, amplitude=0.0, mean=0.0, backlash=20.0, rows=rows)
    time, speed = done.samples[:, 0], done.samples[:, 4]
    loose = -0.5 * np.log(1 - (DRAG - 0.1) / 0.2)
    assert (speed[time < loose] == 0.0).all()
    assert (np.diff(speed[time > loose]) < 0.0).all()


def test_drag_turns_with_the_drive_in_contact():
    """Drive swings about zero: contact on one flank ends where drag changes sign, if inertia does not hold it."""
    done = simulate(3.0, amplitude=0.5 * RPM, frequency=1.0, mean=0.0, spacing=1e-3)
    # inertia alone is too weak, so each flank is left where the speed is zero: t = 1/2, 1, ...
    left = done.contacts[:-1, 2]
    assert np.abs(left * 2 - np.round(left * 2)).max() < 1e-12
    assert set(done.contacts[:, 0]) == {0.0, 1.0}


@pytest.mark.parametrize(("gate", "flank"), [(Gate.ACTIVE, 0), (Gate.REVERSE, 1), (Gate.CONTACT, 0), (Gate.CONTACT, 1)])
def test_torques_of_contact_shift_the_loss_of_contact(gate, flank):
    """The flank is left where the torques of contact *and* those of flight let go; drag pulls off the reverse flank."""
    extra = 0.11
    done = simulate(1 / 3, rows=[form.torque_constant(extra, gate)])
    omega, peak = 6 * pi, J * 6 * pi * 20 * RPM
    lost = np.arccos(-(DRAG + extra) / peak) / omega if flank == 0 else 1 / 3 - np.arccos(-DRAG / peak) / omega
    row = done.contacts[done.contacts[:, 0] == flank][0]
    assert row[2] == pytest.approx(lost, abs=1e-13)


def test_drag_of_flight_alone_keeps_the_gear_on_the_flank():
    """Where contact would end but the drag of flight presses the gear back at once, contact goes on."""
    done = simulate(1 / 3, rows=[form.torque_constant(0.11, Gate.FLIGHT)])
    lost = np.arccos(-(DRAG + 0.11) / (J * 6 * pi * 20 * RPM)) / (6 * pi)
    assert done.contacts[0, 2] == pytest.approx(lost, abs=1e-13)


@pytest.mark.parametrize(
    ("rows", "law"),
    [
        ([form.impact_offset(0.1)], lambda v, active: 0.5 + 0 * v),
        ([form.impact_slope(-6.0)], lambda v, active: 0.4 - 6.0 * v),
        ([form.impact_slope(30.0)], lambda v, active: np.minimum(1.0, 0.4 + 30.0 * v)),
        ([form.impact_flank(0.3)], lambda v, active: np.where(active, 0.55, 0.25)),
        ([form.impact_offset(-0.9)], lambda v, active: 0.0 * v),
    ],
)
def test_restitution_laws(rows, law):
    hits = simulate(3.0, e=0.4, rows=rows).impacts
    speed, rebound = np.abs(hits[:, 2]), np.abs(hits[:, 3])
    free = rebound > 0.0
    expected = law(speed, hits[:, 1] == 0)
    assert np.abs(rebound - expected * speed)[free].max(initial=0.0) < 1e-15
    assert (expected * speed)[~free].max() < 1e-4
    assert len(hits) > 15


def test_scatter_is_normal_and_repeats_with_its_seed():
    def rebounds(seed):
        hits = simulate(400.0, e=0.5, rows=[form.impact_scatter(0.05)], seed=seed).impacts
        free = hits[:, 3] != 0.0
        return -hits[free, 3] / hits[free, 2]

    one, again, other = rebounds(1), rebounds(1), rebounds(2)
    assert np.array_equal(one, again)
    assert not np.array_equal(one[:50], other[:50])
    hard = one[: len(one)]
    assert len(hard) > 5000
    assert abs(hard.std() - 0.05) < 4 * 0.05 / sqrt(2 * len(hard))
    assert abs(hard.mean() - 0.5) < 4 * 0.05 / sqrt(len(hard))
    assert abs(np.corrcoef(hard[1:], hard[:-1])[0, 1]) < 4 / sqrt(len(hard))


@pytest.mark.parametrize("gear", list(Gear))
@pytest.mark.parametrize("flank", list(Flank))
@pytest.mark.parametrize("sign", [-1, 1])
def test_deviations_move_their_own_flank_the_right_way(gear, flank, sign):
    """Order 0: a constant; material on the active flank moves its contact up, on the reverse one down."""
    start = "active" if flank == Flank.ACTIVE else "reverse"
    row = form.flank_harmonic(gear, flank, 0, sign * 10e-6, 0.0)
    done = simulate(0.05, start, 1e-3, mean=-30 * RPM if flank else 30 * RPM, amplitude=0.0, rows=[row])
    there = sign * 10e-6 if flank == Flank.ACTIVE else 250e-6 - sign * 10e-6
    assert np.abs(done.samples[:, 5] - there).max() < 1e-18


def test_contact_rides_on_the_deviation_of_both_gears():
    rows = [form.flank_harmonic(Gear.DRIVE, Flank.ACTIVE, 2, 10e-6, 0.3)]
    rows.append(form.flank_harmonic(Gear.LOOSE, Flank.ACTIVE, 5, 3e-6, 0.9))
    done = simulate(2.0, amplitude=0.0, spacing=1e-3, rows=rows)
    drive, loose, s = done.samples[:, 1], done.samples[:, 2], done.samples[:, 5]
    assert np.abs(s - 10e-6 * np.cos(2 * drive + 0.3) - 3e-6 * np.cos(5 * loose + 0.9)).max() < 1e-16
    assert np.abs(RB * (loose - drive) - s).max() < 1e-14
    assert np.abs(np.gradient(loose, 1e-3) - done.samples[:, 4])[1:-1].max() < 1e-6


def test_a_deviation_steep_enough_throws_the_gear_off():
    """Contact is lost where φ''·Ω² falls below −Td/J·Rb: a loss without any fluctuation of the drive."""
    row = form.flank_harmonic(Gear.DRIVE, Flank.ACTIVE, 90, 5e-6, 0.0)
    slow = simulate(2.0, amplitude=0.0, mean=32 * RPM, rows=[row])
    fast = simulate(2.0, amplitude=0.0, mean=33 * RPM, rows=[row])
    critical = sqrt(DRAG / J * RB / 5e-6) / 90 / RPM
    assert 32 < critical < 33
    assert slow.counters["impacts"] == 0
    assert fast.counters["impacts"] > 0


def test_forms_that_the_model_does_not_have_are_refused():
    tooth = form.flank_tooth(Gear.DRIVE, Flank.ACTIVE, 3, 1e-5)
    with pytest.raises(InputError, match=r"single tooth.*lumped.flanks"):
        bench(rows=[tooth])
    with pytest.raises(InputError, match="unknown to the rigid model"):
        bench(rows=[Row(999, Gate.ALWAYS, (1.0,))])  # type: ignore[arg-type]
