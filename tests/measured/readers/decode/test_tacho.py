"""Toothed wheels: every tooth at its angle, gaps found, lost pulses told, uneven teeth put right on demand."""

from math import pi

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.measured.readers.decode import Even, common_axis, evened, on_grid, spacing, tacho
from gears3d.measured.readers.decode.switches import told


def wheel(angle, positions, missing=0, offset=None):
    """Voltage of a wheel: teeth a third of a pitch wide, the last ones of each revolution missing."""
    pitch = 2 * pi / positions
    place = np.floor(angle / pitch).astype(int)
    late = np.zeros(positions) if offset is None else offset
    inside = angle - place * pitch - late[place % positions]
    return 5.0 * ((inside >= 0) & (inside < pitch / 3) & (place % positions < positions - missing))


def motion(time):
    return 0.3 + 40.0 * time + 12.0 * time**2 + 0.02 * np.sin(2 * pi * 9 * time)


@pytest.mark.parametrize(("positions", "missing"), [(60, 2), (36, 1), (60, 0), (12, 3)])
@pytest.mark.parametrize("declared", ["declared", "find"])
def test_teeth_are_where_they_pass(positions, missing, declared):
    time = np.linspace(0.0, 1.5, 600_000)
    angle = motion(time)
    found = tacho(time, wheel(angle, positions, missing), positions, missing if declared == "declared" else "find")
    true = np.interp(found.time, time, angle)
    off = found.angle - true
    assert np.ptp(off) <= np.diff(angle).max()  # what turns between two samples
    turns = off[0] / (2 * pi)
    if missing:  # zero is the first tooth after a gap, which stands at angle 0 of the wheel
        assert abs(turns - round(turns)) < 1e-4
    assert told(found.notes, "lost-pulses") is None
    if declared == "find":
        assert told(found.notes, "missing-teeth").size == missing
    assert "known there only" in told(found.notes, "pulses").text


def test_a_lost_pulse_and_an_extra_one_are_told():
    time = np.linspace(0.0, 1.5, 600_000)
    volts = wheel(motion(time), 60, 2)
    starts = np.flatnonzero(np.diff(volts) > 0)
    one = volts.copy()
    one[starts[100] : starts[100] + 400] = 0.0
    note = told(tacho(time, one, 60, 2).notes, "lost-pulses")
    assert note.size == 1
    assert not note.harmless
    assert "the first 57 after" in note.text
    two = volts.copy()
    two[(starts[100] + starts[101]) // 2 + 60] = 5.0
    assert "the first 59 after" in told(tacho(time, two, 60, 2).notes, "lost-pulses").text


def test_a_declared_gap_that_is_not_there_is_refused():
    time = np.linspace(0.0, 1.5, 300_000)
    with pytest.raises(InputError, match=r"tacho: shows no gap of 2 teeth in .* pulses"):
        tacho(time, wheel(motion(time), 60), 60, 2)
    with pytest.raises(InputError, match="no gap of 1 teeth"):
        tacho(time, wheel(motion(time), 60, 3), 60, 1)


def test_uneven_teeth_are_found_and_put_right_only_when_asked():
    positions, missing = 60, 2
    late = 0.02 * 2 * pi / positions * np.random.default_rng(7).normal(size=positions)
    late[0] = abs(late[0])
    time = np.linspace(0.0, 4.0, 2_000_000)
    angle = 0.3 + 40.0 * time + 0.01 * np.sin(2 * pi * 1.3 * time)
    edges = tacho(time, wheel(angle, positions, missing, np.abs(late)), positions, missing)
    true = np.interp(edges.time, time, angle)
    found = spacing(edges, positions)
    late = np.abs(late[: positions - missing])
    np.testing.assert_allclose(-found.error[: positions - missing], late - late.mean(), atol=0.1 * late.std())
    before, after = np.std(edges.angle - true), np.std(evened(edges, found).angle - true)
    assert before == pytest.approx(late.std(), rel=0.05)
    assert after < 0.1 * before
    assert told(edges.notes, "spacing-corrected") is None
    assert told(evened(edges, found).notes, "spacing-corrected") is not None
    with pytest.raises(InputError, match=r"turned by 1\.\d+ revolutions"):
        spacing(edges._replace(time=edges.time[:100], angle=edges.angle[:100]), positions)


def test_grid_lies_within_the_pulses_or_is_refused():
    time = np.linspace(0.0, 1.5, 600_000)
    edges = tacho(Even(time[1]), wheel(motion(time), 60), 60)
    grid = np.linspace(edges.time[0], edges.time[-1], 5000)
    off = on_grid(edges, grid).angle - motion(grid)
    bend = (2 * pi / 60) ** 2 / 8 * (24.0 + 0.02 * (18 * pi) ** 2) / 40.0**2  # of the true path between two pulses
    assert np.ptp(off) < 2 * bend + 1e-4
    with pytest.raises(InputError, match=r"loose: is known from .* s, not from 0 s to 1\.5 s \(cut the record"):
        on_grid(edges, time, "loose")
    both = common_axis(edges, edges, "union")
    assert np.array_equal(both.drive, both.loose)


def test_other_words_and_still_wheels_are_refused():
    still = np.r_[np.zeros(50), np.ones(50)]
    with pytest.raises(InputError, match="tacho: has 1 pulses"):
        tacho(Even(1e-3), still, 60)
    with pytest.raises(InputError, match="takes the 'top' edges"):
        tacho(Even(1e-3), still, 60, edge="top")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="has 0 positions"):
        tacho(Even(1e-3), still, 0)
