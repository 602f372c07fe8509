import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gears3d.comparison.matching import REACH, match, reach

PERIOD = 1 / 3


def bursts(periods, restitution, count, lag=0.0, rng=None):
    """Two bursts of bounces a period, each a geometric series of speeds and of spacings."""
    rng = rng or np.random.default_rng(0)
    rows = []
    for k in range(periods):
        for flank, phase in ((1, 0.37), (0, 0.87)):
            time, speed = (k + phase + lag) * PERIOD, 0.03 * rng.uniform(0.8, 1.2)
            for _ in range(count):
                rows.append((time, flank, speed if flank else -speed))
                speed *= restitution
                time += 2 * speed / 4.0
    rows.sort()
    time, flank, velocity = np.array(rows).T
    return {"time_s": time, "flank": flank.astype(np.int8), "velocity_m_s": velocity}


def take(impacts, which):
    return {name: values[which] for name, values in impacts.items()}


def sorted_by_time(impacts):
    return take(impacts, np.argsort(impacts["time_s"], kind="stable"))


def spacing(impacts):
    far = np.zeros(len(impacts["time_s"]))
    for flank in (0, 1):
        which = np.flatnonzero(impacts["flank"] == flank)
        far[which] = reach(impacts["time_s"][which], PERIOD) / 2
    return far


restitutions = st.floats(0.3, 0.85)


@settings(max_examples=150, deadline=None)
@given(restitutions, st.integers(1, 8), st.integers(0, 2**31), st.floats(0.0, 0.9))
def test_dropped_impacts_are_counted_exactly_and_the_rest_find_their_own(restitution, count, seed, rate):
    rng = np.random.default_rng(seed)
    reference = bursts(6, restitution, count, rng=rng)
    kept = np.flatnonzero(rng.random(len(reference["time_s"])) >= rate)
    tested = take(reference, kept)
    tested["time_s"] = tested["time_s"] + rng.uniform(-0.1, 0.1, len(kept)) * spacing(reference)[kept]
    tested["velocity_m_s"] = tested["velocity_m_s"] * rng.uniform(0.98, 1.02, len(kept))
    mine, theirs = match(tested, reference, PERIOD)
    np.testing.assert_array_equal(theirs, kept)
    np.testing.assert_array_equal(mine, np.arange(len(kept)))


@settings(max_examples=150, deadline=None)
@given(restitutions, st.integers(1, 8), st.integers(0, 2**31), st.integers(0, 20))
def test_inserted_impacts_never_take_a_place_from_the_others(restitution, count, seed, more):
    rng = np.random.default_rng(seed)
    reference = bursts(6, restitution, count, rng=rng)
    extra = {
        "time_s": rng.uniform(0, 6 * PERIOD, more),
        "flank": rng.integers(0, 2, more).astype(np.int8),
        "velocity_m_s": rng.uniform(-0.03, 0.03, more),
    }
    tested = sorted_by_time({name: np.concatenate([reference[name], extra[name]]) for name in reference})
    tested["time_s"] = tested["time_s"] + 1e-4 * spacing(tested) * rng.uniform(-1, 1, len(tested["time_s"]))
    mine, theirs = match(tested, reference, PERIOD)
    assert len(mine) == len(reference["time_s"])
    assert len(set(mine.tolist())) == len(mine)
    assert np.array_equal(theirs, np.arange(len(theirs)))
    back, forth = match(reference, tested, PERIOD)
    assert len(back) == len(forth) <= len(mine)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**31), st.integers(0, 60), st.integers(0, 60))
def test_pairs_are_one_to_one_in_order_on_one_flank_and_within_reach(seed, k, m):
    rng = np.random.default_rng(seed)

    def random(n):
        flank = rng.integers(0, 2, n).astype(np.int8)
        return {"time_s": np.sort(rng.uniform(0, 1, n)), "flank": flank, "velocity_m_s": rng.normal(0, 0.02, n)}

    tested, reference = random(k), random(m)
    mine, theirs = match(tested, reference, PERIOD)
    assert np.array_equal(tested["flank"][mine], reference["flank"][theirs])
    assert (np.abs(tested["time_s"][mine] - reference["time_s"][theirs]) <= REACH * PERIOD).all()
    for flank in (0, 1):
        on = reference["flank"][theirs] == flank
        assert (np.diff(mine[on]) > 0).all()
        assert (np.diff(theirs[on]) > 0).all()


def test_a_burst_that_drifts_by_more_than_its_spacing_is_matched_in_order():
    reference, tested = bursts(3, 0.5, 6), bursts(3, 0.49, 6)
    drift = np.abs(tested["time_s"] - reference["time_s"])
    gap = np.minimum.reduce(
        [np.abs(np.diff(reference["time_s"], prepend=-9)), np.abs(np.diff(reference["time_s"], append=9))]
    )
    assert (drift / gap).max() > 0.6
    mine, theirs = match(tested, reference, PERIOD)
    np.testing.assert_array_equal(mine, theirs)
    assert len(mine) == 36


def test_a_wide_reach_behind_narrow_ones_shares_no_partner():
    def flank0(*times):
        return {"time_s": np.array(times), "flank": np.zeros(len(times)), "velocity_m_s": np.full(len(times), -0.02)}

    reference = flank0(0.1000, 0.1001, 0.1200)
    tested = flank0(0.1000, 0.1001)
    mine, theirs = match(tested, reference, 1.0)
    assert (mine.tolist(), theirs.tolist()) == ([0, 1], [0, 1])


def test_impacts_on_the_other_flank_are_no_partners():
    reference = bursts(3, 0.5, 3)
    mine, theirs = match({**reference, "flank": 1 - reference["flank"]}, reference, PERIOD)
    assert mine.size == theirs.size == 0
