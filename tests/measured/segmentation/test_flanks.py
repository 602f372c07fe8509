"""How well flanks are known, and their speeds with them."""

import numpy as np
import pytest

from gears3d.measured.segmentation import Flanks, Terms, measure
from gears3d.verification.challenge.space import draw
from gears3d.verification.challenge.taking import take
from tests.measured.segmentation.truth import cut, happened, seen
from tests.verification.challenge.judged import compared

KINDS = (("offset", 0), ("drive", 3), ("drive", 47))


def flanks(covariance, gap):
    terms = Terms(KINDS, np.ones(5), 0.0, 10.0)
    return Flanks(terms, np.zeros(5), gap, covariance, 0.0, 0.5)


@pytest.mark.parametrize("flank", [0, 1])
def test_place_and_speed_are_as_uncertain_as_flanks_drawn_from_their_covariance(flank):
    source = np.random.default_rng(4)
    root = 1e-6 * source.normal(size=(10, 10))
    found = flanks(root @ root.T, np.full(5, 1e-4))
    time, speed, near = np.linspace(1.0, 1.3, 7), 20.0, 1e-5
    drive = speed * time
    side = np.full(7, flank)
    drawn = root @ source.normal(size=(10, 20_000))
    own = drawn[:5] + (drawn[5:] if flank else 0.0)
    turn = np.array([3.0, 47.0]) * drive[:, None]
    waves = np.stack([np.cos(turn), np.sin(turn)], axis=2).reshape(7, 4)
    rates = np.stack([-np.sin(turn), np.cos(turn)], axis=2) * (np.array([3.0, 47.0]) * speed)[None, :, None]
    place = np.column_stack([np.ones(7), waves]) @ own
    assert np.allclose(found.sigma(time, drive, drive, side), place.std(axis=1), rtol=0.03)
    times = time + 0.5 * near * np.array([[-1.0], [1.0]])
    told = found.rate_sigma(times, speed * times, speed * times, side)
    assert np.allclose(told, (rates.reshape(7, 4) @ own[1:]).std(axis=1), rtol=0.03)


def test_speeds_of_impacts_know_how_well_the_speed_of_their_flank_is_known(monkeypatch):
    scenario, truth = happened(swing="14 rpm", duration="4 s")
    record = seen(scenario, truth, 0.01, 1)
    found = cut(scenario, record)
    hits, path = found.impacts, found.path
    monkeypatch.setattr(Flanks, "rate_sigma", lambda *_: 0.0)
    less = cut(scenario, record).impacts
    monkeypatch.undo()
    assert np.array_equal(hits["velocity_m_s"], less["velocity_m_s"])
    ends = found.flights["end_s"]
    times = ends + 0.5 * path.width * np.array([[-1.0], [1.0]])
    moves = found.flanks.rate_sigma(
        times, found.track.steady.curve(times), np.interp(times, path.time, path.loose), hits["flank"]
    )
    assert np.allclose(hits["velocity_sigma_m_s"] ** 2 - less["velocity_sigma_m_s"] ** 2, moves**2, rtol=1e-6, atol=0.0)
    back = np.isfinite(hits["rebound_sigma_m_s"])
    assert back.sum() > 20
    assert np.all(hits["rebound_sigma_m_s"][back] > less["rebound_sigma_m_s"][back])


@pytest.mark.parametrize(
    "index",
    [
        pytest.param(5, id="runout in step with the fluctuation, which the record cannot show"),
        pytest.param(8, id="low bounces instead of contact, at three angles"),
        pytest.param(13, id="impacts alone, each flank at four angles"),
        pytest.param(26, id="low bounces at any angle"),
    ],
)
def test_wavy_flanks_that_are_struck_but_hardly_rested_on(index):
    taken = take(draw(index + 1, 22)[index], dirt=False, waves=True, samples=300_000)
    row = compared(taken.truth, measure(taken.record, taken.scenario))
    assert row["verdict"] == "right", row
    assert row["backlash"] == "right", row
