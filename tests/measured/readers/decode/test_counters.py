"""Counters of every depth, both ways, wrapped angles, time stamps and integrated speeds."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gears3d.errors import InputError
from gears3d.measured.readers.decode import Edges, common_axis, counter, integrated, stamped, wrapped_angle
from gears3d.measured.readers.decode.switches import told


@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("signed", [False, True])
@pytest.mark.parametrize(("bits", "kind"), [(8, "8"), (16, "16"), (24, "32"), (32, "32")])
@pytest.mark.parametrize("dtype", ["whole", "float"])
def test_counters_of_every_depth_wrap_both_ways(bits, kind, signed, sense, dtype):
    span = 2**bits
    true = sense * np.arange(60, dtype=np.int64) * (span // 7) + 5
    raw = np.mod(true + span // 2, span) - span // 2 if signed else np.mod(true, span)
    raw = raw.astype(float if dtype == "float" else f"{'' if signed else 'u'}int{kind}")
    found = counter(raw, 1000, bits, signed)
    counts = np.round(found.angle * 1000 / (2 * pi)).astype(np.int64)
    assert np.array_equal(counts - counts[0], true - true[0])
    assert told(found.notes, "wraps").size == np.sum(np.abs(np.diff(raw.astype(float))) > span / 2)
    assert told(found.notes, "large-steps") is None


@settings(max_examples=100, deadline=None)
@given(st.lists(st.integers(-60, 60), min_size=1, max_size=60), st.integers(0, 255))
def test_any_walk_of_an_eight_bit_counter_comes_back(steps, begin):
    """Steps of less than a quarter of the range are never ambiguous, reversals included."""
    true = begin + np.concatenate([[0], np.cumsum(steps)])
    found = counter(np.mod(true, 256).astype(np.uint8), 256, bits=8)
    counts = np.round(found.angle * 256 / (2 * pi))
    assert np.array_equal(counts - counts[0], true - true[0])


def test_a_counter_that_the_index_resets():
    found = counter(np.array([8190, 8191, 0, 1, 0, 8191]), 8192, period=8192)
    assert np.diff(found.angle * 8192 / (2 * pi)) == pytest.approx([1, 1, 1, -1, -1])


@pytest.mark.parametrize(
    ("values", "row"),
    [([0, 128, 0], 1), ([0, 10, 20, 148, 160], 3), ([0, 100, 200, 44, 144, 30, 170], 5), ([0, 120, 241, 115], 3)],
)
def test_ambiguous_steps_are_refused_with_their_row(values, row):
    with pytest.raises(InputError, match=f"n: goes from {values[row - 1]} to {values[row]} at row {row}: forwards or"):
        counter(np.array(values, dtype=np.uint8), 100, bits=8, channel="n")


def test_large_steps_are_told():
    note = told(counter(np.mod(np.arange(9) * 100, 256), 100, bits=8).notes, "large-steps")
    assert note.size == pytest.approx(100 / 256)
    assert not note.harmless


@pytest.mark.parametrize(
    ("values", "options", "message"),
    [
        ([0, 300], {"bits": 8}, "n: is 300 at row 1, outside 0 to 255"),
        ([0, 200], {"bits": 8, "signed": True}, "outside -128 to 127"),
        ([0.0, 1.5], {"bits": 8}, "is 1.5 at row 1, no whole count"),
        ([0.0, np.nan], {"bits": 8}, "is not a number at row 1"),
        ([0, 1], {}, "give either bits or period"),
        ([0, 1], {"bits": 8, "period": 100}, "give either bits or period"),
        ([0, 1], {"bits": 64}, "a counter has 2 to 53 bits"),
        (["a", "b"], {"bits": 8}, "is not a column of numbers"),
        ([], {"bits": 8}, "has 0 rows"),
    ],
)
def test_counters_that_are_none_are_refused(values, options, message):
    with pytest.raises(InputError, match=message):
        counter(np.array(values), 100, channel="n", **options)


@pytest.mark.parametrize("period", [2 * pi, 360.0])
@pytest.mark.parametrize("begin", [0.0, -0.5])
def test_wrapped_angles_come_back(period, begin):
    time = np.linspace(0.0, 5.0, 5000)
    true = period * (1.3 * time - 0.4 * time**2 + 0.05 * np.sin(20 * time))
    raw = np.mod(true - begin * period, period) + begin * period
    found = wrapped_angle(raw, period).angle
    np.testing.assert_allclose(found - found[0], true - true[0], atol=1e-11 * period)


def test_an_angle_that_goes_on_is_refused_as_wrapped():
    with pytest.raises(InputError, match=r"goes from 0 to 20: it does not restart every 6\.28319"):
        wrapped_angle(np.linspace(0.0, 20.0, 50), channel="theta")


@pytest.mark.parametrize("bits", [16, 24, 32])
def test_time_stamps_of_a_timer_that_wraps(bits):
    clock, rng = 2.0**bits / 0.7, np.random.default_rng(bits)
    true = np.cumsum(rng.uniform(0.0, 0.3, 200))
    ticks = np.floor(true * clock).astype(np.int64)
    found = stamped(np.mod(ticks, 2**bits), 1024, "edges", clock, bits)
    np.testing.assert_allclose(found.time - found.time[0], (ticks - ticks[0]) / clock, atol=1e-12)
    assert told(found.notes, "timer-wrap").size == ticks[-1] // 2**bits - ticks[0] // 2**bits
    with pytest.raises(InputError, match=r"edges: goes back by .* s at row \d+ \(tell clock and bits"):
        stamped(np.mod(ticks, 2**bits), 1024, "edges", clock)


def test_stamps_with_a_sense_of_each_edge():
    """An edge passed to and fro is one angle."""
    found = stamped(np.arange(6.0), 8, direction=np.array([1, 1, -1, -1, 1, 1]))
    assert (found.angle * 4 / pi).round(9).tolist() == [0.0, 1.0, 1.0, 0.0, 0.0, 1.0]
    assert (found.shown * 4 / pi).round(9).tolist() == [0.0, 1.0, 0.0, -1.0, 0.0, 1.0]
    assert told(found.notes, "one-way") is None


@pytest.mark.parametrize(
    ("stamps", "options", "message"),
    [
        ([0.0, 1.0, 0.5], {}, "e: goes back by 0.5 s at row 2"),
        ([0.0, np.nan, 0.5], {}, "e: is not a number at row 1"),
        ([np.nan, np.nan], {}, "e: has no stamps"),
        ([1.0, np.nan], {}, "e: has 1 rows"),
        ([0, 1], {"bits": 8}, "of an unknown clock"),
        ([0, 300], {"bits": 8, "clock": 1.0}, "has 300 at row 1, more than a timer of 8 bits"),
        ([0, 100, 97], {"bits": 8, "clock": 1.0}, "goes back by 3 ticks at row 2, too little for a wrap"),
        ([0.0, 1.0], {"direction": np.array([1])}, "2 edges but 1 directions"),
        ([0.0, 1.0], {"direction": np.array([1, 0])}, "no direction at row 1"),
    ],
)
def test_stamps_that_cannot_be_are_refused(stamps, options, message):
    with pytest.raises(InputError, match=message):
        stamped(np.array(stamps), 100, "e", **options)


@pytest.mark.parametrize("axis", ["loose", "drive", "union"])
def test_both_gears_on_one_axis(axis):
    time = np.linspace(0.0, 3.0, 300_001)
    drive, loose = 20.0 * time, 31.0 * time + 0.01 * np.sin(12 * time)
    edges = []
    for angle, begin, per_turn in ((drive, 0.2, 2048), (loose, 0.0, 3600)):
        count = 2 * pi / per_turn
        own = np.arange(np.ceil((angle[0] + 20.0 * begin) / count), angle[-1] / count) * count
        edges.append(Edges(np.interp(own, angle, time), own))
    found = common_axis(*edges, axis=axis)
    assert np.all(np.diff(found.time) > 0.0)
    assert found.time[0] >= 0.2
    assert told(found.notes, "common-time").size > 1000
    np.testing.assert_allclose(found.drive, np.interp(found.time, time, drive), atol=1e-9)
    np.testing.assert_allclose(found.loose, np.interp(found.time, time, loose), atol=1e-8)
    with pytest.raises(InputError, match="no time in common"):
        common_axis(edges[0], edges[1]._replace(time=edges[1].time + 10.0), axis)


def test_integration_of_a_speed_meets_its_closed_form_and_tells_its_errors():
    time = np.linspace(0.0, 10.0, 20_001)
    speed = 3.0 + 2.0 * np.cos(30 * time)
    true = 3.0 * time + 2.0 / 30 * np.sin(30 * time)
    found = integrated(time, speed)
    off = np.max(np.abs(found.angle - true))
    assert told(found.notes, "integration").size == pytest.approx(off, rel=0.05)
    rng = np.random.default_rng(0)
    ends = [integrated(time, speed + rng.normal(0, 0.1, len(time))) for _ in range(60)]
    walked = np.std([end.angle[-1] for end in ends])
    assert told(ends[0].notes, "drift").size == pytest.approx(walked, rel=0.25)
    with pytest.raises(InputError, match="time_s: does not rise at row 2"):
        integrated(np.array([0.0, 1.0, 1.0]), np.zeros(3))
    with pytest.raises(InputError, match="has 3 rows, time has 2"):
        integrated(np.array([0.0, 1.0]), np.zeros(3))


def test_an_edge_stamped_again_at_the_same_time_is_one_edge():
    even = np.cumsum(np.linspace(4e-3, 6e-3, 500)).round(7)
    found = stamped(np.sort(np.r_[even, even[[0, 7, 7, 250, 499]]]), 24, "edges")
    assert found.time.tolist() == even.tolist()
    assert found.angle[-1] == pytest.approx(2 * np.pi / 24 * 499)
    (note,) = (one for one in found.notes if one.kind == "repeated-stamps")
    assert (note.size, note.harmless) == (5, False)
    assert f"first at {even[0]:.9g} s" in note.text


def test_stamps_too_coarse_to_tell_two_edges_are_not_merged():
    fast = np.round(np.cumsum(np.linspace(0.4e-3, 1.6e-3, 2000)), 3)  # edges faster than a tick
    found = stamped(fast, 24, "edges")
    assert len(found.time) == len(fast)
    assert len(stamped(np.round(fast / 1e-3), 24, "edges", clock=1e3).time) == len(fast)
