"""Structure over an angle: orders of neither gear are found where they are, and noise is no structure."""

from types import SimpleNamespace

import numpy as np
import pytest

from gears3d.diagnosis import BINS, project_out
from gears3d.diagnosis.channels import FlickerNoise
from gears3d.diagnosis.residual_patterns import bin_pattern, flank_contrast, order_pattern, post_impact_ringing
from gears3d.diagnosis.residual_tests import channel_chi2
from tests.diagnosis.blind_tables import rate

TURNS = (10, 20, 30)
POINTS = 400


def _scan(random, size=0.0, order=5.43):
    angles = [np.sort(random.uniform(0.0, 2.0 * np.pi * turns, POINTS)) for turns in TURNS]
    waves = [size * np.cos(order * angle + random.uniform(0.0, 2.0 * np.pi)) for angle in angles]
    value = random.normal(size=POINTS * len(TURNS)) + np.concatenate(waves)
    return next(iter(order_pattern("flight.angle_loose", value, np.ones(len(value)), angles, 40, "rad/s^2")))


def test_noise_is_as_seldom_structure_as_its_chance_says():
    random = np.random.default_rng(4)
    chances = np.array([_scan(random).chance for _ in range(200)])
    assert np.sum(chances < 0.01) <= 6, rate(int(np.sum(chances < 0.01)), 200)
    assert 0.35 < np.mean(chances < 0.5) < 0.65


@pytest.mark.parametrize("order", [0.7, 5.43, 17.0, 38.62])
def test_an_order_of_no_gear_is_found_whatever_its_phase_in_each_record(order):
    found = _scan(np.random.default_rng(5), 0.5, order)
    assert found.chance < 1e-9
    assert found.where == pytest.approx(order, abs=0.5 / max(TURNS))
    assert found.size == pytest.approx(0.5 / np.sqrt(2.0), rel=0.15)


def test_what_comes_back_with_the_drive_is_no_order():
    random = np.random.default_rng(7)
    angles = [np.sort(random.uniform(0.0, 2.0 * np.pi * turns, POINTS)) for turns in TURNS]
    locked = [3.1, 1.55, 0.775]
    waves = [np.cos(6.2 * angle) for angle in angles]
    value = 0.3 * random.normal(size=POINTS * len(TURNS)) + np.concatenate(waves)
    told = [
        next(iter(order_pattern("flight.angle_loose", value, np.ones(len(value)), angles, 40, "rad/s^2", known))).gain
        for known in ((), locked)
    ]
    assert told[1] < 0.1 * told[0]


def test_flanks_that_part_with_time_are_told_from_a_reading_that_drifts():
    random = np.random.default_rng(8)
    time, flank = random.uniform(0.0, 12.0, 4000), random.integers(0, 2, 4000)
    sure, noise = np.ones(4000), random.normal(size=4000)
    parting = next(iter(flank_contrast("contact.time", noise + 0.3 * time * flank, sure, time, flank)))
    drifting = next(iter(flank_contrast("contact.time", noise + 0.3 * time, sure, time, flank)))
    assert parting.chance < 1e-12
    assert parting.size == pytest.approx(0.3 * 12.0 / np.sqrt(12.0), rel=0.1)
    assert drifting.chance > 1e-4
    active = flank == 0
    alone = next(iter(bin_pattern("sensor.ratio", (noise + 0.3 * time)[active], sure[active], time[active], "m")))
    assert alone.chance < 1e-12


@pytest.mark.parametrize("damping", [0.01, 0.04])
def test_what_rings_after_blows_is_told_with_its_frequency_and_noise_rings_not(damping):
    random = np.random.default_rng(9)
    struck = np.sort(random.uniform(0.0, 12.0, 150))
    side = np.where(random.uniform(size=150) < 0.5, 1.0, -1.0)
    speed = side * random.uniform(0.01, 0.03, 150)
    begin = struck[:-1][np.diff(struck) > 0.03] + 0.004
    time = begin[:, None] + np.linspace(0.0, 0.024, BINS)
    pole = 2.0 * np.pi * 87.0 * (1j - damping)
    since = time[..., None] - struck
    ring = np.where(since > 0.0, np.exp(pole * np.maximum(since, 0.0)) * 1.4 * -speed, 0.0).sum(axis=-1).real
    sigma = np.full(time.shape, 0.01)
    x = time - time.mean(axis=1, keepdims=True)
    free = (1.0 / sigma, x / sigma)
    impacts = SimpleNamespace(time=struck, velocity=speed, rebound=-0.4 * speed)
    flights = SimpleNamespace(time=time, sigma=sigma)
    record = SimpleNamespace(
        channels=SimpleNamespace(impacts=impacts, flights=flights, flicker=FlickerNoise()), cache={}
    )
    noise = random.normal(size=time.shape)
    sure = np.ones(len(time))
    (found,) = post_impact_ringing([record] * 2, [project_out(ring / sigma + noise, free).ravel()] * 2, sure)
    assert found.chance < 1e-12
    assert found.where == pytest.approx(87.0, rel=0.01)
    assert not list(post_impact_ringing([record], [project_out(ring / sigma + noise, free).ravel()], sure))
    (found,) = post_impact_ringing([record] * 2, [project_out(noise, free).ravel()] * 2, sure)
    assert found.chance > 1e-4


OFF = ["contact.all"]


@pytest.mark.parametrize(("share", "size", "told"), [(0.01, 500.0, []), (0.3, 20.0, OFF), (1.0, 6.0, OFF)])
def test_a_channel_is_off_as_a_whole_and_not_by_a_few_strays(share, size, told):
    rest = np.random.default_rng(6).normal(size=4000)
    rest[: int(share * len(rest))] += size
    none, few = SimpleNamespace(time=np.zeros(0)), np.zeros((0, BINS))
    channels = SimpleNamespace(
        flights=SimpleNamespace(time=few, sigma=few), impacts=none, losses=none, drive=none,
        contacts=SimpleNamespace(time=rest, sigma=np.full(len(rest), 1e-6)),
    )  # fmt: skip
    record = SimpleNamespace(name="only", channels=channels, drive=none)
    assert [one.name for one in channel_chi2([record], rest)] == told
