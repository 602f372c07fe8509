"""Impulses, energies and durations, against closed forms and the published plastic orbit."""

import json
from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gears3d import load, simulate
from gears3d.signals import contacts, contacts_of, describe, flights, impact_values, mass, powers, shares, stroke

SCENARIO = "scenarios/rigaud-2020/fig5-20rpm.toml"


@pytest.fixture(scope="module")
def plastic():
    """Λ = 12.4716, e = 0: one impact a flank and period, roots known to 30 digits."""
    return simulate(load(SCENARIO).with_({"impact.restitution": 0.0, "gears.loose.inertia": "0.0695 kg m^2"}), "rigid")


def test_the_plastic_orbit_s_flights_and_contacts_are_exact(plastic):
    """Times of the plastic orbit, 20 rpm, 3 Hz, 250 µm, in ms: 87.59170, 111.6544, 245.7416, 269.6574."""
    found = describe(plastic.signals, plastic.impacts, plastic.meta)
    assert found["durations_from"] == "contacts"
    assert found["reverse_crossing_mean_s"] * 1e3 == pytest.approx(111.6544 - 87.59170, abs=2e-4)
    assert found["active_crossing_mean_s"] * 1e3 == pytest.approx(269.6574 - 245.7416, abs=2e-4)
    assert found["reverse_contact_mean_s"] * 1e3 == pytest.approx(245.7416 - 111.6544, abs=2e-4)
    assert found["active_contact_mean_s"] * 1e3 == pytest.approx(87.59170 + 1e3 / 3 - 269.6574, abs=2e-4)
    for flank in ("active", "reverse"):  # no bounces: every impact ends a flight across
        mean = found[f"{flank}_velocity_mean_m_s"]
        assert found[f"{flank}_crossing_velocity_mean_m_s"] == pytest.approx(mean, rel=1e-9)
    period = 1 / 3
    assert found["flight_share"] == pytest.approx(
        (found["reverse_crossing_mean_s"] + found["active_crossing_mean_s"]) / period, rel=1e-6
    )
    assert found["flight_height_max_m"] == pytest.approx(250e-6, rel=1e-9)
    assert found["excitation"] == pytest.approx(12.47159, rel=2e-5)


def test_the_plastic_orbit_s_impulses_and_energies(plastic):
    """Impact speeds 30.8581 and −31.2425 mm/s; e = 0, so the impulse is m·v and all of ½·m·v² is lost."""
    found = describe(plastic.signals, plastic.impacts, plastic.meta)
    m, speed = 0.0695 / 0.148**2, 0.148 * 20 * pi / 30
    assert found["active_impulse_dimensionless"] == pytest.approx(31.2425e-3 / speed, rel=2e-5)
    assert found["reverse_impulse_dimensionless"] == pytest.approx(-30.8581e-3 / speed, rel=2e-5)
    assert found["active_energy_J_s"] == pytest.approx(0.5 * m * 31.2425e-3**2 * 3, rel=1e-4)
    assert found["energy_J_s"] == pytest.approx(0.5 * m * (31.2425e-3**2 + 30.8581e-3**2) * 3, rel=1e-4)
    assert (found["active_restitution"], found["reverse_restitution"]) == (0.0, 0.0)


def test_energy_taken_by_impacts_is_the_energy_put_in():
    """Over a period of a 1T motion the drive's work on the relative motion is what impacts take.

    In the frame of the drive, m·s̈ = −F − m·ÿ + R, and R does no work on s at a standing flank: the energy lost is the
    work of −F − m·ÿ on the path, here by quadrature over the samples of whole periods.
    """
    recording = simulate(load(SCENARIO).with_({"run.output_rate": "200 kHz", "run.duration": "3 s"}), "rigid")
    found = describe(recording.signals, recording.impacts, recording.meta)
    table = recording.signals
    time, velocity = table["time_s"], table["velocity_m_s"]
    m, radius = found["mass_kg"], recording.meta["base_radius_drive_m"]
    some = (time >= 1.0) & (time <= 2.0)
    push = -0.22 / radius - m * radius * 20 * pi / 30 * 6 * pi * np.cos(6 * pi * time)
    work = np.trapezoid((push * velocity)[some], time[some])
    hits = (recording.impacts["time_s"] >= 1.0) & (recording.impacts["time_s"] <= 2.0)
    lost = np.nansum(impact_values(recording.impacts, m)["energy_J"][hits])
    assert lost == pytest.approx(work, rel=2e-4)
    assert found["energy_J_s"] == pytest.approx(lost, rel=2e-3)  # the last trembling is not counted


@given(st.floats(0.1, 10.0), st.floats(0.0, 0.99), st.integers(1, 40), st.integers(0, 2**31))
def test_mass_restitution_and_energy_come_back_from_made_up_impacts(m, e, count, seed):
    rng = np.random.default_rng(seed)
    flank = rng.integers(0, 2, count)
    before = rng.uniform(1e-3, 1.0, count) * np.where(flank, 1.0, -1.0)
    after = -e * before
    hits = {
        "time_s": np.arange(count),
        "velocity_m_s": before,
        "rebound_m_s": after,
        "impulse_N_s": m * (after - before),
    }
    assert not after.any() or mass(hits) == pytest.approx(m)
    ones = impact_values(hits, m, speed=2.0)
    np.testing.assert_allclose(ones["restitution"], e, atol=1e-12)
    np.testing.assert_allclose(ones["impulse_dimensionless"], -(1 + e) * before / 2.0)
    np.testing.assert_allclose(
        ones["impulse_N_s"], impact_values({**hits, "impulse_N_s": np.nan * before}, m)["impulse_N_s"]
    )
    found = powers(before, after, flank, m, 5.0)
    assert found["energy_J_s"] == pytest.approx(0.5 * m * (1 - e**2) * np.sum(before**2) / 5.0, rel=1e-9, abs=1e-15)
    assert np.isnan(ones["interval_s"][0])
    assert (ones["interval_s"][1:] == 1.0).all()


def test_unknown_rebounds_give_unknown_energies():
    found = powers(np.array([-0.02, 0.01]), np.array([np.nan, -0.001]), np.array([0, 1]), 3.0, 1.0)
    assert found["active_restitution"] is found["energy_J_s"] is found["active_energy_J_s"] is None
    assert found["reverse_restitution"] == pytest.approx(0.1)
    assert mass({"velocity_m_s": np.array([-0.02]), "rebound_m_s": np.array([np.nan])}) is None


@given(st.lists(st.tuples(st.booleans(), st.booleans(), st.floats(0.01, 1.0), st.floats(0.01, 1.0)), min_size=1))
def test_flights_are_what_lies_between_touches(history):
    """Each touch: an impact on a flank, perhaps a contact after it; then a flight of known length."""
    now, times, flanks, table, ends, begins = 0.0, [], [], [], [], []
    for reverse, stays, rest, flight in history:
        times.append(now)
        flanks.append(int(reverse))
        begins.append(now)
        if stays:
            table.append([float(reverse), now, now + rest])
            now += rest
        ends.append(now)
        now += flight
    found = flights(np.array(times), np.array(flanks), np.array(table).reshape(-1, 3))
    np.testing.assert_array_equal(found.start, ends[:-1])
    np.testing.assert_array_equal(found.end, begins[1:])
    np.testing.assert_array_equal(found.left, flanks[:-1])
    np.testing.assert_array_equal(found.struck, flanks[1:])
    part = shares(table, 0.0, now)
    assert sum(part.values()) == pytest.approx(1.0)
    assert part["flight_share"] * now == pytest.approx(sum(one[3] for one in history), abs=1e-9)


def test_contacts_read_off_samples_are_within_the_sampling_of_those_written_down():
    recording = simulate(load(SCENARIO), "rigid")
    bare = {key: value for key, value in recording.meta.items() if key != "contacts"}
    found, source = contacts_of(recording.signals, recording.impacts, bare)
    written = np.array(recording.meta["contacts"])
    assert source == "samples"
    np.testing.assert_array_equal(found[:, 0], written[:, 0])
    np.testing.assert_allclose(found[:, 1:], written[:, 1:], atol=1e-5)  # the tolerance alone would give 2e-3
    assert contacts_of(recording.signals, recording.impacts, {**bare, "effects": ["transmission_error"]})[0] is None


@pytest.mark.parametrize("power", [1, 2, 3])
def test_the_moment_of_leaving_is_found_for_jumps_of_speed_force_and_jerk(power):
    time = np.linspace(0.0, 1.0, 20001)
    place = 3e-6 * (np.maximum(time - 0.51234567, 0.0) / 0.01) ** power
    none = {"time_s": np.zeros(0), "flank": np.zeros(0)}
    assert contacts(time, place, 0.0, 1.0, none)[0, 2] == pytest.approx(0.51234567, abs=1e-9)


@given(st.floats(1e-4, 1.0), st.floats(-3.0, 3.0), st.floats(0.05, 0.6), st.floats(-3.0, 3.0))
def test_the_drive_s_swing_comes_back_beside_its_rotation(size, phase, period, speed):
    time = np.linspace(0.0, 3.0, 3001)
    angle = 7.0 + speed * time + size * np.cos(2 * pi / period * time + phase)
    assert stroke(time, angle, period) == pytest.approx(size, rel=1e-7)
    assert stroke(time, speed * time, period) is None
    assert stroke(time[:9], angle[:9], period) is None


@settings(deadline=None)
@given(st.integers(0, 60), st.integers(0, 40), st.integers(0, 2**31), st.booleans())
def test_describe_of_anything_is_plain_json(samples, count, seed, known):
    """Short, empty and senseless recordings have a description too, without NaN and infinities."""
    rng = np.random.default_rng(seed)
    time = np.arange(samples) * 0.1
    signals = {"time_s": time, "theta_drive_rad": rng.normal(size=samples), "theta_loose_rad": time}
    if known:
        signals |= {"displacement_m": rng.normal(0, 1e-4, samples), "velocity_m_s": rng.normal(size=samples)}
    hits = {"time_s": np.sort(rng.uniform(0, 6, count)), "flank": rng.integers(0, 2, count)}
    hits["velocity_m_s"] = rng.normal(size=count)
    meta = {"period_s": 0.05, "backlash_m": 1e-4, "base_radius_drive_m": 0.1, "base_radius_loose_m": 0.1}
    json.dumps(describe(signals, hits, meta if known else {}), allow_nan=False)
