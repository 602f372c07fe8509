"""Angles drawn as voltages of two channels and decoded again: within an edge, whatever the shaft does."""

from math import pi

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gears3d.errors import InputError
from gears3d.measured.readers.decode import Even, Levels, counted, levels, quadrature, switches
from gears3d.measured.readers.decode.switches import told

LINES = 100
QUARTER = 2 * pi / (4 * LINES)


def logic(angle, lines=LINES):
    quarter = np.mod(np.floor(angle * (4 * lines / (2 * pi))), 4)
    return quarter < 2, (quarter == 1) | (quarter == 2)


def volts(angle, rng, noise=0.1, lines=LINES):
    """Rise over some samples: a third of a quarter from level to level."""
    wave = [2.5 + 2.5 * np.tanh(6.0 * np.sin(lines * angle - shift)) for shift in (0.0, pi / 2)]
    return [values + noise * rng.normal(size=len(angle)) for values in wave]


def same_but_for_zero(angle, true, within):
    off = angle - true
    return np.ptp(off) <= within


MOTIONS = st.tuples(
    st.floats(-3.0, 3.0),  # rad/s
    st.floats(0.0, 0.5),  # rad, of the swing
    st.floats(1.0, 8.0),  # Hz
    st.floats(0.001, 6.0),  # rad, where it begins
    st.integers(0, 2**31),
)


def motion(drawn, samples=20_000, step=5e-5):
    speed, swing, rate, begin, _ = drawn
    time = step * np.arange(samples)
    return time, begin + speed * time + swing * np.sin(2 * pi * rate * time)


@settings(max_examples=60, deadline=None)
@given(MOTIONS)
def test_logic_counts_are_the_angle_rounded_down(drawn):
    _, angle = motion(drawn)
    assume(np.ptp(angle) > 5 * QUARTER)
    found = quadrature(*logic(angle), LINES)
    true = np.floor(angle * (4 * LINES / (2 * pi)))
    steps = found.angle().angle / QUARTER
    assert np.array_equal(np.round(steps - steps[0]), true - true[0])
    assert told(found.notes, "illegal-transitions") is None


@settings(max_examples=60, deadline=None)
@given(MOTIONS)
def test_noisy_voltages_come_back_within_an_edge(drawn):
    time, angle = motion(drawn)
    assume(np.ptp(angle) > 5 * QUARTER)
    a, b = volts(angle, np.random.default_rng(drawn[-1]))
    found = quadrature(a, b, LINES)
    counts = found.angle().angle
    reach = QUARTER / 3  # the hysteresis is passed within a sixth of a quarter either side of the edge
    assert len(counts) == len(angle)
    assert same_but_for_zero(counts, angle, QUARTER + reach)
    edges = found.edges(Even(time[1]))
    assert np.all(np.diff(edges.time) > 0.0)
    assert same_but_for_zero(edges.angle, np.interp(edges.time, time, angle), reach)


def test_edges_are_met_in_the_same_place_both_ways():
    """A ramp there and back: straight flanks make the interpolation exact, whichever sense an edge has."""
    there = np.linspace(0.0, 0.5, 4001)
    angle = np.concatenate([there, there[-2::-1]])
    a, b = (np.clip(20.0 * np.sin(LINES * angle - shift), -1.0, 1.0) for shift in (0.0, pi / 2))
    found = quadrature(a, b, LINES, threshold=0.0)
    edges = found.edges(Even(1.0))
    off = edges.angle - np.interp(edges.time, np.arange(len(angle)), angle)
    assert np.ptp(off) < 1e-5 * QUARTER
    half = len(edges.angle) // 2
    np.testing.assert_allclose(edges.angle[:half], edges.angle[: -half - 1 : -1])
    assert found.count[-1] == found.first


def test_edge_times_of_voltages_are_finer_than_samples():
    rng = np.random.default_rng(3)
    time = 1e-4 * np.arange(40_000)
    angle = 0.9 * time + 0.01 * np.sin(2 * pi * time)
    edges = quadrature(*volts(angle, rng, noise=0.02), LINES).edges(time)
    off = edges.angle - np.interp(edges.time, time, angle)
    assert np.std(off) < 0.02 * QUARTER


def test_noise_within_the_hysteresis_makes_no_count():
    """A shaft that stands on an edge of A: any noise between the thresholds is silence."""
    rng = np.random.default_rng(1)
    rest = Levels(2.0, 3.0, "A")
    still = 2.5 + rng.uniform(-0.4999, 0.4999, 100_000)
    a = switches(np.concatenate([[0.0], still, [5.0], still, [0.0]]), rest)
    assert a.rises.tolist() == [True, False]
    wider = 2.5 + rng.uniform(-0.51, 0.51, 100_000)
    assert len(switches(wider, rest).row) > 10


def test_noise_of_a_third_of_the_swing_makes_no_false_counts():
    rng = np.random.default_rng(5)
    angle = np.linspace(0.0, 1.0, 200_000)
    a, b = logic(angle)
    noisy = [5.0 * x + rng.uniform(-0.95, 0.95, len(x)) for x in (a, b)]  # hysteresis 2 V of 5 V
    assert np.array_equal(quadrature(*noisy, LINES).count, quadrature(a, b, LINES).count)


@pytest.mark.parametrize("decoding", [1, 2, 4])
def test_decodings_count_whole_lines_alike_and_do_not_creep_when_rattling(decoding):
    time = np.linspace(0.0, 1.0, 50_000)
    angle = 0.01 + 3.0 * pi / LINES * np.sin(2 * pi * 25 * time) + 0.4 * time
    found = quadrature(*logic(angle), LINES, decoding)
    count = 2 * pi / (decoding * LINES)
    assert found.counts_per_revolution == decoding * LINES
    assert same_but_for_zero(found.angle().angle, angle, count * (1 + 1e-9))
    assert set(np.abs(np.diff(found.count))) == {1}
    edges = found.edges(time)
    off = edges.angle - np.interp(edges.time, time, angle)
    assert np.ptp(off) < 0.05 * count


def test_reduced_decodings_take_edges_of_a_alone():
    angle = np.linspace(0.0, 1.0, 10_000)
    a, b = logic(angle)
    one, two = (quadrature(a, b, LINES, n) for n in (1, 2))
    edges_a = np.flatnonzero(np.diff(a.astype(int))) + 0.5
    rising = np.flatnonzero(np.diff(a.astype(int)) > 0) + 0.5
    assert np.array_equal(two.row, edges_a)
    assert np.array_equal(one.row, rising)


def test_sense_follows_which_channel_leads():
    a, b = logic(np.linspace(0.0, 0.5, 5000))
    forward, back = quadrature(a, b, LINES).count, quadrature(b, a, LINES).count
    assert forward[-1] > 0 > back[-1]
    assert abs(abs(np.ptp(forward)) - abs(np.ptp(back))) == 0


def test_illegal_transitions_are_counted_on_and_told():
    angle = np.linspace(0.0, 1.0, 8000)
    a, b = logic(angle)
    whole = quadrature(a, b, LINES)
    gone = np.ones(len(a), dtype=bool)
    lost = whole.row[[5, 20, 33]].astype(int)
    for row in lost:  # a hole of a little more than a quarter: two edges fall between two samples
        gone[row - 2 : row + int(1.05 * QUARTER * 8000)] = False
    found = quadrature(a[gone], b[gone], LINES)
    note = told(found.notes, "illegal-transitions")
    assert note is not None
    assert note.size == 3
    assert not note.harmless
    assert found.count[-1] == whole.count[-1]
    angles = found.angle().angle
    assert same_but_for_zero(angles, angle[gone], QUARTER * 1.001)


def test_the_same_signal_twice_is_refused():
    a, _ = logic(np.linspace(0.0, 1.0, 5000))
    with pytest.raises(InputError, match=r"A: changes in the same sample as B 31 times of 31 \(sample faster"):
        quadrature(a, a, LINES)


def test_blocks_give_what_the_whole_gives():
    rng = np.random.default_rng(2)
    angle = 0.3 * np.sin(np.linspace(0.0, 3.0, 5_000))
    a, b = volts(angle, rng, noise=0.5)
    rest = [levels(a, "A"), levels(b, "B")]
    whole = counted(switches(a, rest[0]), switches(b, rest[1]), LINES)
    for cuts in (np.arange(1, len(a)), np.sort(rng.integers(0, len(a), 50))):
        parts = counted(switches(np.split(a, cuts), rest[0]), switches(iter(np.split(b, cuts)), rest[1]), LINES)
        np.testing.assert_allclose(parts.row, whole.row, atol=1e-9)
        assert np.array_equal(parts.count, whole.count)
        assert (parts.first, parts.samples) == (whole.first, whole.samples)


def test_unequal_quarters_are_told():
    angle = np.linspace(0.0, 2.0, 100_000)
    b = np.sin(LINES * angle - pi / 2 - 0.2 * pi / 2) > 0
    note = told(quadrature(np.sin(LINES * angle) > 0, b, LINES).notes, "phase")
    assert note is not None
    assert note.size == pytest.approx(0.05, abs=2e-3)
    assert "both low 20 %, A high 30 %, both high 20 %, B high 30 %" in note.text


@pytest.mark.parametrize(
    ("voltage", "message"),
    [
        (np.full(100, 5.0), "A: stays at 5 V"),
        (np.random.default_rng(0).normal(size=100_000), "A: has no two levels"),
        (np.array([0.0, 5.0, np.nan, 0.0]), "A: has values that are no numbers"),
        (np.zeros(1), "A: has 1 rows"),
    ],
)
def test_channels_without_levels_are_refused(voltage, message):
    with pytest.raises(InputError, match=message):
        levels(voltage, "A")


def test_a_row_that_is_no_number_is_named():
    values = np.tile([0.0, 5.0], 500_000)
    values[700_001] = np.nan
    with pytest.raises(InputError, match="A: is not a number at row 700001"):
        switches(values, Levels(1.0, 4.0, "A"))


@pytest.mark.parametrize("wave", [np.sin, lambda x: 2 / pi * np.arcsin(np.sin(x)), lambda x: np.sign(np.sin(x))])
def test_levels_are_found_of_any_wave_and_spikes_are_none(wave):
    values = 1.0 + wave(np.linspace(0.0, 50.0, 30_000) * pi)
    plain = levels(values, "A")
    assert plain.middle == pytest.approx(1.0, abs=0.01)
    values[777] = 60.0
    assert levels(values, "A").middle == pytest.approx(1.0, abs=0.02)


def test_rare_pulses_have_levels_too():
    values = 0.1 * np.random.default_rng(4).normal(size=3_000_000)
    values[1_234_567:1_234_570] += 5.0
    rest = levels(values, "Z")
    assert 1.0 < rest.low < rest.high < 4.5
    assert switches(values, rest).row == pytest.approx([1_234_566.5, 1_234_569.5], abs=0.2)


def test_thresholds_as_declared_and_such_as_no_level_reaches():
    a, b = logic(np.linspace(0.0, 0.5, 5000))
    assert levels(a, "A", threshold=0.6, hysteresis=0.2)[:2] == pytest.approx((0.5, 0.7))
    with pytest.raises(InputError, match="not on both sides of 2 V"):
        quadrature(a, b, LINES, threshold=2.0)
    with pytest.raises(InputError, match=r"B: has 4999 rows, A has 5000"):
        quadrature(a, b[1:], LINES)
    with pytest.raises(InputError, match="decoding: is 3"):
        quadrature(a, b, LINES, 3)
    with pytest.raises(InputError, match="lines: is 0"):
        quadrature(a, b, 0)
