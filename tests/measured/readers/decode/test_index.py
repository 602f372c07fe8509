"""The index as zero and as witness: lost counts, extra counts, counts declared wrong."""

from math import pi

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.measured.readers.decode import indexed, levels, quadrature, switches
from gears3d.measured.readers.decode.switches import told

LINES = 64
QUARTER = 2 * pi / (4 * LINES)
PLACE = 40.0 * QUARTER
"""Edge after which the index is high for one quarter."""


def channels(angle, lines=LINES):
    index = np.mod(angle - PLACE, 2 * pi) < QUARTER
    return np.sin(lines * angle) > 0, np.sin(lines * angle - pi / 2) > 0, index


def decoded(angle, lines=LINES, declared=None, decoding=4):
    a, b, z = channels(angle, lines)
    return indexed(quadrature(a, b, declared or lines, decoding), switches(z, levels(z, "Z")))


@pytest.mark.parametrize("angle", [np.linspace(0.1, 30.0, 90_000), np.linspace(30.0, 0.1, 90_000)])
def test_zero_is_the_index_in_both_senses_and_no_count_is_missing(angle):
    found = decoded(angle)
    shown = found.angle().angle
    off = np.mod(shown - (angle - PLACE) + pi, 2 * pi) - pi
    assert off.min() > -QUARTER - 1e-9
    assert off.max() < 1e-9
    assert told(found.notes, "lost-counts") is None
    assert told(found.notes, "index").size == 5


def test_an_index_in_which_the_shaft_turns_back_is_left_out():
    time = np.linspace(0.0, 1.0, 200_000)
    angle = 0.2 + 20.0 * time
    back = PLACE + 0.5 * QUARTER + 2 * pi  # the second index: turn back amid it, go on later
    row = int(np.searchsorted(angle, back))
    angle = np.concatenate([angle[:row], angle[row : row - 3000 : -1], angle[row - 3000 :]])
    found = decoded(angle)
    assert told(found.notes, "lost-counts") is None
    assert "1 pulses in which it turned back" in told(found.notes, "index").text
    assert np.ptp(found.angle().angle - angle) <= QUARTER * (1 + 1e-6)


@pytest.mark.parametrize("lost", [-4, 4])
def test_lost_and_extra_counts_are_told_with_their_place(lost):
    """Four quarters less or more between the second and third index: one whole line."""
    angle = np.linspace(0.1, 30.0, 90_000)
    a, b, z = channels(angle)
    row = int(np.searchsorted(angle, 2.5 * 2 * pi))
    line = round(4 * QUARTER * 90_000 / 29.9)
    if lost < 0:
        a, b = (np.concatenate([x[:row], x[row + line :], x[-line:]]) for x in (a, b))
        z = np.concatenate([z[:row], z[row + line :], np.zeros(line, dtype=bool)])
    else:
        a, b = (np.concatenate([x[:row], x[row - line : row], x[row:]]) for x in (a, b))
        z = np.concatenate([z[:row], np.zeros(line, dtype=bool), z[row:]])
    found = indexed(quadrature(a, b, LINES), switches(z, levels(z, "Z")))
    note = told(found.notes, "lost-counts")
    assert note.size == 4
    assert not note.harmless
    assert f"1 of 4 stretches from index to index have lost or extra counts, {lost:+d} in sum" in note.text


@pytest.mark.parametrize(("declared", "decoding"), [(50, 4), (63, 4), (32, 4), (128, 4), (48, 2), (100, 1)])
def test_counts_declared_wrong_are_refused_with_the_right_number(declared, decoding):
    angle = np.linspace(0.1, 30.0, 90_000)
    counts = LINES * decoding
    with pytest.raises(InputError, match=f"Z: comes every {counts} counts, 4 times of 4, not {declared * decoding}"):
        decoded(angle, declared=declared, decoding=decoding)


def test_no_index_and_other_lengths_are_refused():
    a, b, _ = channels(np.linspace(0.1, 0.9, 5000))
    counts = quadrature(a, b, LINES)
    with pytest.raises(InputError, match="Z: has no whole pulse"):
        indexed(counts, switches(np.r_[np.zeros(4999), 1.0], levels(np.array([0.0, 1.0]), "Z")))
    with pytest.raises(InputError, match="Z: has 4 rows, A and B have 5000"):
        indexed(counts, switches(np.array([0.0, 1.0, 0.0, 0.0]), levels(np.array([0.0, 1.0]), "Z")))
