"""Faults of the encoders: each found with its size, undone where that is asked for, and none where there is none."""

from functools import lru_cache

import numpy as np
import pytest

from gears3d.measured.checks import correct, examine
from gears3d.scenario import load
from tests.measured.checks import faults
from tests.measured.checks.clean import HELICAL, KADMIRI, RIGAUD, channels, happened, rattling, seen, turning
from tests.measured.checks.drawn import draw

LOOSE, DRIVE = faults.LOOSE, faults.DRIVE
SEED = 41


@lru_cache(maxsize=4)
def record(kind, noise=0.005):
    make = {"rattle": rattling, "contact": turning}
    if kind in make:
        return make[kind](noise=noise, seed=SEED, duration="8 s")
    return seen(*happened({"kadmiri": KADMIRI, "helical": HELICAL}[kind], (("run.duration", "2 s"),)), noise, SEED)


def found(scenario, columns, *kinds, stated=False):
    return [one for one in examine(channels(columns), scenario, stated_motion=stated) if not kinds or one.kind in kinds]


@pytest.mark.parametrize("kind", ["rattle", "contact", "kadmiri", "helical"])
def test_nothing_is_found_in_clean_records(kind):
    assert [one.kind for one in found(*record(kind)) if one.kind != "wave"] == []


@pytest.mark.parametrize("kind", ["rattle", "kadmiri"])
@pytest.mark.parametrize(
    ("name", "factor"), [(LOOSE, 180 / np.pi), (DRIVE, 180 / np.pi), (LOOSE, 0.5 / np.pi), (DRIVE, 4.0), (LOOSE, 0.5)]
)
def test_one_channel_in_another_unit(kind, name, factor):
    scenario, columns = record(kind)
    bad = faults.scaled(columns, **{name: factor})
    (one,) = found(scenario, bad, "angle-unit", "ratio", "swapped", stated=True)
    assert (one.kind, one.channel, one.fatal) == ("angle-unit", name, True)
    assert one.size == pytest.approx(factor)
    mended = correct(channels(bad), [one], ["angle-unit"]).columns
    assert np.allclose(mended[name], columns[name], rtol=1e-12)


@pytest.mark.parametrize("factor", [180 / np.pi, 0.5 / np.pi, 1_600_000 / (2 * np.pi)])
def test_both_channels_in_another_unit_show_in_the_mean_speed(factor):
    scenario, columns = record("rattle")
    bad = faults.scaled(columns, **{LOOSE: factor, DRIVE: factor})
    (one,) = found(scenario, bad, "angle-unit", stated=True)
    assert (one.channel, one.size) == ("", pytest.approx(factor))
    assert not found(scenario, bad, "angle-unit")


def test_a_speed_that_is_off_by_a_unit_is_a_hint_where_none_is_stated():
    scenario, columns = record("rattle")
    bad = faults.scaled(columns, **{LOOSE: 180.0 / np.pi, DRIVE: 180.0 / np.pi})
    (one,) = found(scenario, bad, "other-speed")
    assert not one.fatal
    assert "degrees" in one.evidence
    for speed in ("20 rpm", "50 rpm", "600 rpm"):
        assert not found(scenario.with_({"motion.mean": speed}), columns, "other-speed")


@pytest.mark.parametrize("kind", ["rattle", "contact", "kadmiri"])
def test_a_gear_that_turns_backwards(kind):
    scenario, columns = record(kind)
    (one,) = found(scenario, faults.scaled(columns, **{DRIVE: -1.0}), "sense", "ratio", stated=True)
    assert (one.kind, one.channel, one.fatal) == ("sense", DRIVE, True)
    (one,) = found(scenario, faults.scaled(columns, **{DRIVE: -1.0, LOOSE: -1.0}), "sense", stated=True)
    assert (one.channel, one.fatal) == ("", False)


@pytest.mark.parametrize("kind", ["kadmiri", "helical"])
def test_channels_that_changed_places(kind):
    scenario, columns = record(kind)
    bad = {"time_s": columns["time_s"], DRIVE: columns[LOOSE], LOOSE: columns[DRIVE]}
    findings = found(scenario, bad)
    assert findings[0].kind == "swapped"
    mended = correct(channels(bad), findings, ["swapped"]).columns
    assert all(np.array_equal(mended[name], columns[name]) for name in columns)


@pytest.mark.parametrize("gear", ["drive", "loose"])
def test_a_wrong_count_that_imitates_interchanged_channels_is_not_taken_for_them(gear):
    """Gears of 50 and 51 teeth have the inverse ratio, 4 % from their own, at a wrong count as well."""
    teeth = (("gears.drive.teeth", 50), ("gears.loose.teeth", 51), ("run.duration", "2 s"))
    scenario, columns = seen(*happened(RIGAUD, teeth), 0.005, SEED)
    name, wrong = f"theta_{gear}_rad", (51 / 50) ** (2 if gear == "loose" else -2)
    (one,) = found(scenario, faults.scaled(columns, **{name: wrong}), "swapped", "ratio")
    assert (one.kind, one.channel) == ("ratio", "")
    assert f"[{gear}] counts_per_revolution = " in one.remedy
    assert "exchange the channels" in one.remedy
    interchanged = {"time_s": columns["time_s"], DRIVE: columns[LOOSE], LOOSE: columns[DRIVE]}
    (one,) = found(scenario, interchanged, "swapped", "ratio")
    assert (one.kind, one.channel) == ("ratio", "")
    assert "exchange the channels" in one.remedy


@pytest.mark.parametrize(("teeth", "off"), [((89, 90), 90 / 89), ((90, 91), 91 / 90), ((91, 90), 90 / 91)])
def test_other_teeth_than_declared(teeth, off):
    _, columns = record("rattle")
    wrong = load(RIGAUD, {"gears.drive.teeth": teeth[0], "gears.loose.teeth": teeth[1]})
    (one,) = found(wrong, columns, "ratio")
    assert one.fatal
    assert one.size == pytest.approx(off - 1.0, rel=0.05)
    assert "90:90" in one.evidence


@pytest.mark.parametrize("kind", ["rattle", "contact"])
@pytest.mark.parametrize(("name", "counts"), [(LOOSE, -40), (DRIVE, 60), (LOOSE, 2000)])
def test_lost_and_extra_counts(kind, name, counts):
    scenario, columns = record(kind)
    size = counts * 2 * np.pi / 1_600_000
    bad = faults.lost(columns, name, 123_456, size)
    (one,) = found(scenario, bad, "lost-counts", "offset", "drift", "jumps", "spikes")
    assert (one.kind, one.channel, one.rows) == ("lost-counts", name, (123_456,))
    assert abs(one.size - size) < 10 * 2 * np.pi / 1_600_000
    mended = correct(channels(bad), [one], ["lost-counts"])
    assert found(scenario, mended.columns, "lost-counts", "offset", "drift") == []


@pytest.mark.parametrize("kind", ["rattle", "contact"])
def test_an_encoder_that_loses_counts_again_and_again_cannot_be_used(kind):
    scenario, columns = record(kind)
    random = np.random.default_rng(SEED)
    for row in np.sort(random.choice(np.arange(1000, len(columns[LOOSE]) - 1000), 40, replace=False)):
        columns = faults.lost(columns, LOOSE, row, random.choice([-1.0, 1.0]) * 1000 * 2 * np.pi / 1_600_000)
    (one,) = found(scenario, columns, "jumps", "lost-counts")
    assert (one.kind, one.channel, one.fatal) == ("jumps", LOOSE, True)


def test_counts_lost_over_a_while_and_all_along():
    for kind in ("rattle", "contact"):
        scenario, columns = record(kind)
        time = columns["time_s"]
        radius = scenario.rig().base_radius_loose
        slipped = {**columns, LOOSE: columns[LOOSE] - 30e-6 / radius * np.clip((time - 5.0) / 0.1, 0.0, 1.0)}
        (one,) = found(scenario, slipped, "offset", "drift", "lost-counts")
        assert (one.kind, one.size) == ("offset", pytest.approx(-30e-6, rel=0.1))
        drifting = {**columns, LOOSE: columns[LOOSE] + 40e-6 / radius * time / time[-1]}
        (one,) = found(scenario, drifting, "offset", "drift", "lost-counts")
        assert (one.kind, one.size) == ("drift", pytest.approx(40e-6, rel=0.05))


def test_single_readings_that_are_off():
    scenario, columns = record("rattle")
    (one,) = found(scenario, faults.spike(columns, LOOSE, 99_000, 1e-3), "spikes", "lost-counts")
    assert (one.kind, one.rows, one.size) == ("spikes", (99_000,), pytest.approx(1e-3, rel=0.05))


@pytest.mark.parametrize("delay", [20e-6, -20e-6, 200e-6, -1e-3])
@pytest.mark.parametrize("noise", [0.001, 0.02])
def test_a_channel_that_is_read_later(delay, noise):
    scenario, columns = record("rattle", noise)
    bad = faults.late(columns, LOOSE, delay)
    (one,) = found(scenario, bad, "skew")
    assert one.size == pytest.approx(delay, abs=max(3e-6, 0.01 * abs(delay)))
    assert found(scenario, correct(channels(bad), [one], ["skew"]).columns, "skew") == []
    (one,) = found(scenario, faults.late(columns, DRIVE, delay), "skew")
    assert one.size == pytest.approx(-delay, abs=max(3e-6, 0.01 * abs(delay)))


def test_a_delay_that_flanks_could_imitate_is_not_told():
    """The drive fluctuates at its order 6 by little: a flank of order 6 looks like a delay."""
    scenario, columns = record("contact")
    assert found(scenario, faults.late(columns, LOOSE, 2e-4), "skew") == []


def test_counts_other_than_declared_and_counts_that_are_gone():
    scenario, columns = rattling(seed=SEED, counts=400_000)
    wrong = scenario.with_({"sensors.loose.counts_per_revolution": 1_600_000})
    (one,) = found(wrong, columns, "counts")
    assert (one.channel, one.size) == (LOOSE, pytest.approx(400_000, rel=1e-6))
    assert "one in 4" in one.evidence
    smooth = {**columns, DRIVE: columns[DRIVE] + np.random.default_rng(SEED).normal(0.0, 1e-6, len(columns[DRIVE]))}
    (one,) = found(scenario, smooth, "counts")
    assert (one.channel, one.size) == (DRIVE, 0.0)


def test_noise_that_fills_the_backlash():
    scenario, columns = rattling(seed=SEED, noise=0.1)
    (one,) = found(scenario, columns, "noise")
    b = scenario.rig().backlash
    assert one.size == pytest.approx(np.sqrt(2.0) * 0.1 * b, rel=0.05)


def test_an_eccentric_encoder_of_the_drive_is_told_from_the_gears():
    """The loose gear does not follow what only the drive's encoder says; a transmission error it does follow."""
    scenario, columns = rattling(seed=SEED, duration="8 s", change=lambda c: faults.eccentric(c, DRIVE, 3e-4))
    findings = found(scenario, columns, "encoder-wave", "wave")
    assert [(one.kind, one.channel) for one in findings] == [("encoder-wave", DRIVE)]
    assert findings[0].size == pytest.approx(3e-4, rel=0.03)
    mended = correct(channels(columns), findings, ["encoder-wave"])
    assert found(scenario, mended.columns, "encoder-wave", "wave") == []


def test_an_eccentric_encoder_of_the_loose_gear_shows_in_flight():
    """A gear that flies slows down evenly; with 300 rpm a wave of its encoder bends the flights enough."""
    fast = (("run.duration", "16 s"), ("motion.mean", "300 rpm"))
    bench = happened(RIGAUD, fast)
    scenario, columns = seen(*bench, 0.0005, SEED, change=lambda c: faults.eccentric(c, LOOSE, 2e-4))
    (one,) = found(scenario, columns, "encoder-wave", "wave")
    assert (one.kind, one.channel) == ("encoder-wave", LOOSE)
    assert one.size == pytest.approx(2e-4, rel=0.1)


def test_without_flights_an_eccentric_encoder_cannot_be_told_from_the_gears():
    scenario, columns = turning(seed=SEED, duration="8 s", change=lambda c: faults.eccentric(c, LOOSE, 3e-4))
    (one,) = found(scenario, columns, "encoder-wave", "wave")
    assert one.kind == "wave"
    assert not one.fatal
    assert "either an eccentric encoder or the gears" in one.evidence


@pytest.mark.parametrize("seed", range(900, 908))
def test_clean_records_drawn_at_random(seed):
    scenario, columns, what = draw(seed)
    assert [(what, one.kind, one.evidence) for one in found(scenario, columns) if one.kind != "wave"] == []
