"""Records of edges: edges that ran together or were stamped twice are found, told with their size, and given back."""

import numpy as np
import pytest

from gears3d.measured.checks import correct, examine
from gears3d.measured.readers import Channels
from gears3d.measured.readers.decode import Edges, common_axis, stamped
from tests.measured.checks.clean import KADMIRI, OTTEWILL, RIGAUD, happened

COUNT = 2 * np.pi / 720


def edges(time, angle, spoilt=lambda stamps: stamps, tick=1e-7):
    """The edges of a gear of 720 counts, stamped by a clock of 10 MHz."""
    level = np.arange(np.ceil(angle[0] / COUNT) + 1, np.floor(angle[-1] / COUNT))
    stamps = np.interp(level * COUNT, np.maximum.accumulate(angle), time)
    return stamped(spoilt(np.round(stamps / tick) * tick), 720)


def bench(file=RIGAUD, spoilt=lambda stamps: stamps, axis="counters", **changes):
    changes = {"run.duration": "10 s", "sensors.sample_rate": "20 kHz", **changes}
    scenario, truth = happened(file, tuple(changes.items()))
    drive, loose = (truth.signals[f"theta_{gear}_rad"] for gear in ("drive", "loose"))
    joined = common_axis(edges(truth.time, drive), edges(truth.time, loose, spoilt), axis)
    columns = {"time_s": joined.time, "theta_drive_rad": joined.drive, "theta_loose_rad": joined.loose}
    return scenario, Channels(columns)


def lost(stamps):
    return np.delete(stamps, [700, 1500, 1501])


def bounced(stamps):
    return np.sort(np.append(stamps, stamps[[700, 1500]] + 30e-6))


def kinds(found):
    return {one.kind: one for one in found if "edges" in one.kind}


@pytest.mark.parametrize("axis", ["counters", "loose"])
@pytest.mark.parametrize(("spoilt", "kind", "counts"), [(lost, "merged-edges", 3), (bounced, "doubled-edges", 2)])
def test_edges_that_are_lost_or_doubled_are_told_and_given_back(spoilt, kind, counts, axis):
    scenario, clean = bench(axis=axis)
    scenario, channels = bench(spoilt=spoilt, axis=axis)
    found = kinds(examine(channels, scenario))
    assert list(found) == [kind]
    assert found[kind].channel == "theta_loose_rad"
    assert found[kind].size == pytest.approx(counts * COUNT, rel=1e-6)
    assert found[kind].fatal
    assert len(found[kind].rows) == 2
    mended = correct(channels, tuple(found.values()), [kind]).columns
    off = np.interp(mended["time_s"], clean.columns["time_s"], clean.columns["theta_loose_rad"])
    off = np.abs(mended["theta_loose_rad"] - off)
    assert np.mean(off > 0.5 * COUNT) < 0.01
    assert off[-1] < 1e-9


@pytest.mark.parametrize("file", [RIGAUD, KADMIRI, OTTEWILL])
@pytest.mark.parametrize("axis", ["counters", "loose"])
def test_rattle_and_swing_are_no_lost_edges(file, axis):
    scenario, channels = bench(file, axis=axis)
    assert not kinds(examine(channels, scenario))


def test_a_gear_that_slows_down_to_rest_loses_no_edges():
    time = np.linspace(0.0, 9.99, 200_000)
    angle = 20.0 * (time - 0.05 * time**2)
    stamps = edges(time, angle).time
    columns = {"time_s": stamps, "theta_loose_rad": COUNT * np.arange(len(stamps))}
    needs = (("theta_loose_rad",),)
    assert not kinds(examine(Channels(columns), needs=needs))
    fewer = {"time_s": np.delete(stamps, 5000), "theta_loose_rad": COUNT * np.arange(len(stamps) - 1)}
    (found,) = kinds(examine(Channels(fewer), needs=needs)).values()
    assert found.size == pytest.approx(COUNT)
    assert not found.fatal


def test_stamps_are_edges():
    assert isinstance(edges(np.linspace(0.0, 1.0, 1000), np.linspace(0.0, 6.0, 1000)), Edges)
