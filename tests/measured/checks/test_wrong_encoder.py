"""Which encoder has a wrong count: named where patterns per revolution decide it, undecided where they do not."""

import numpy as np
import pytest

from gears3d.errors import InputError
from gears3d.measured.checks import admit, correct, examine
from gears3d.measured.readers import Channels
from gears3d.recording import Recording
from tests.measured.checks.clean import channels
from tests.measured.checks.encoder_rigs import DRIVE, LOOSE, draw, turned

COLUMN = {"drive": DRIVE, "loose": LOOSE}


def the_ratio(rig):
    findings = examine(channels(rig.columns), rig.scenario)
    (one,) = [each for each in findings if each.fatal]
    assert one.kind == "ratio"
    return one


@pytest.mark.parametrize("hopping", [False, True])
@pytest.mark.parametrize("cause", ["drive", "loose"])
@pytest.mark.parametrize("wrong", [1.024, 0.97, 1.004])
def test_the_encoder_and_its_count_are_named(cause, wrong, hopping):
    rig = turned(cause, wrong, revolutions=150, hopping=hopping)
    one = the_ratio(rig)
    assert (one.channel, one.correctable) == (COLUMN[cause], True)
    true = rig.declared / rig.counts
    assert one.parameters["factor"] == pytest.approx(true, abs=one.parameters["uncertainty"])
    assert one.parameters["uncertainty"] < 1e-3
    assert f"[{cause}] counts_per_revolution = " in one.remedy
    seen = float(one.remedy.split("= ")[1].split()[0])
    assert seen == pytest.approx(rig.counts, rel=1e-4)


@pytest.mark.parametrize("teeth", [(31, 43), (30, 44)])
def test_wrong_teeth_name_no_encoder(teeth):
    one = the_ratio(turned("teeth", revolutions=150, named=teeth))
    assert (one.channel, one.correctable) == ("", False)
    assert "tooth numbers are wrong" in one.evidence
    assert one.remedy == "correct gears.*.teeth (30:43)"


def test_few_revolutions_leave_it_undecided_and_say_how_many_decide():
    one = the_ratio(turned("drive", 1.004, revolutions=4, patterns=1e-7))
    assert (one.channel, one.correctable) == ("", False)
    assert "it takes about 2.5e+02" in one.evidence
    assert all(way in one.remedy for way in ("either", "[drive]", "[loose]", "gears.*.teeth"))


def test_enough_revolutions_without_patterns_ask_for_index_marks():
    one = the_ratio(turned("drive", 1.04, revolutions=60, patterns=0.0))
    assert (one.channel, one.correctable) == ("", False)
    assert "it takes about" not in one.evidence
    assert "record the index mark of both encoders" in one.evidence


@pytest.mark.parametrize("cause", ["drive", "loose", "teeth"])
def test_index_marks_decide_alone(cause):
    rig = turned(cause, 1.02, revolutions=20, patterns=0.0, named=(31, 43) if cause == "teeth" else (30, 43))
    marks = {}
    for gear, speed in (("drive", 1.0), ("loose", 30 / 43)):
        scale = rig.counts / rig.declared if cause == gear else 1.0
        marks[gear] = (2 * np.pi * scale * np.arange(int(20 * speed))).tolist()
    about = {"drive": ("drive",), "loose": ("loose",), "teeth": ("drive", "loose")}[cause]
    record = Channels(rig.columns, "r.csv", {"index_rad": {gear: marks[gear] for gear in about}})
    (one,) = [each for each in examine(record, rig.scenario) if each.fatal]
    assert (one.channel, one.correctable) == (COLUMN.get(cause, ""), cause != "teeth")
    assert "index marks" in one.evidence


def marked(rig, **scales):
    """Return the record with index marks once per revolution of the angle times a scale."""
    speeds = {"drive": 1.0, "loose": 30 / 43}
    marks = {gear: (2 * np.pi * scale * np.arange(int(20 * speeds[gear]))).tolist() for gear, scale in scales.items()}
    return Channels(rig.columns, "r.csv", {"index_rad": marks})


def test_index_marks_contradict_counts_that_are_wrong_of_both_encoders():
    rig = turned("nothing", revolutions=20)
    (one,) = [each for each in examine(marked(rig, drive=0.98, loose=1.0), rig.scenario) if each.fatal]
    assert (one.kind, one.channel, one.size) == ("counts", DRIVE, pytest.approx(0.98))
    assert f"[drive] counts_per_revolution = {0.98 * rig.declared:.6g} instead" in one.remedy
    assert not [each for each in examine(marked(rig, drive=1.0001, loose=0.9999), rig.scenario) if each.fatal]
    alone = Channels(
        {name: rig.columns[name] for name in ("time_s", LOOSE)}, "r.csv", {"index_rad": {"loose": [0, 6.2, 12.4, 18.6]}}
    )
    (one,) = [each for each in examine(alone, rig.scenario, needs=(LOOSE,)) if each.fatal]
    assert (one.kind, one.channel) == ("counts", LOOSE)


def test_a_corrected_count_is_not_compared_with_the_marks_again():
    rig = turned("drive", 1.02, revolutions=20)
    found = examine(marked(rig, drive=rig.counts / rig.declared), rig.scenario)
    assert [one.kind for one in found if one.fatal] == ["ratio"]


def test_counts_of_the_record_that_are_not_those_of_the_rig_are_reported():
    rig = turned("loose", 1.02, revolutions=20)
    other = rig.scenario.with_({"sensors.loose.counts_per_revolution": int(rig.counts)})
    (one,) = [each for each in examine(channels(rig.columns), other) if each.fatal]
    assert (
        f"{LOOSE} was made with {rig.declared} counts per revolution, the rig declares {rig.counts:.0f}" in one.evidence
    )


@pytest.mark.parametrize("patterns", [0.0, 10e-6])
def test_rattle_of_gears_declared_to_turn_equally_fast_names_no_encoder(patterns):
    """Lines of both angles then coincide in a hypothesis, but for the displacement, which they must not explain."""
    one = the_ratio(turned("teeth", 1.0, 40, True, patterns, named=(31, 31), order=2.0, teeth=(30, 31)))
    assert one.channel == ""
    assert "gears.*.teeth (30:31)" in one.remedy


def test_without_patterns_nothing_is_decided_however_long_the_record():
    one = the_ratio(turned("loose", 1.02, revolutions=150, patterns=0.0))
    assert one.channel == ""


def test_a_free_fluctuation_at_the_order_of_a_hypothesis_is_no_pattern():
    """The drive fluctuates freely with 1.02 times its revolutions; only that would point to the drive's encoder."""
    for cause in ("drive", "loose"):
        rig = turned(cause, 1.02, revolutions=100, patterns=0.0, hopping=True, order=1.02 if cause == "loose" else 1.0)
        assert the_ratio(rig).channel in ("", COLUMN[cause])


@pytest.mark.parametrize("cause", ["drive", "loose"])
def test_a_named_count_is_corrected_on_demand(cause, tmp_path):
    rig = turned(cause, 1.024, revolutions=150)
    path = tmp_path / "r.parquet"
    Recording(rig.columns).write(path)
    with pytest.raises(InputError, match=r"--correct ratio, .*counts_per_revolution"):
        admit(path, rig.scenario)
    own = admit(path, rig.scenario, correct=["ratio"])
    assert [one.kind for one in own.findings if one.kind not in ("wave", "encoder-wave")] == ["ratio"]
    name = COLUMN[cause]
    scale = np.polyfit(rig.columns[name], own.channels.columns[name], 1)[0]
    assert scale == pytest.approx(rig.declared / rig.counts, rel=1e-4)
    assert [one.kind for one in examine(channels(own.channels.columns), rig.scenario) if one.fatal] == []
    assert correct(channels(rig.columns), own.findings, []).columns[name] is rig.columns[name]


def test_short_flights_between_few_rows_are_no_jumps_of_the_encoder():
    rig = draw(10162)
    (one,) = [each for each in examine(channels(rig.columns), rig.scenario) if each.kind == "jumps"]
    assert (one.channel, one.fatal) == (LOOSE, False)
    lost = {**rig.columns, LOOSE: rig.columns[LOOSE] + 2e-3 * (np.arange(len(rig.columns[LOOSE])) // 1000 % 7)}
    assert any(each.kind == "jumps" and each.fatal for each in examine(channels(lost), rig.scenario))


@pytest.mark.parametrize("seed", [70002, *range(500, 504)])
def test_noise_that_is_not_white_is_no_fatal_finding(seed):
    """With seed 70002 contacts are so short that changes of speed within a row look like lost counts."""
    rig = draw(seed, "nothing", dirty=True)
    assert [one.evidence for one in examine(channels(rig.columns), rig.scenario) if one.fatal] == []


@pytest.mark.parametrize("backlashes", [2.0, -2.5])
def test_a_count_by_which_gears_part_by_few_backlashes_is_noticed(backlashes):
    way = 2 * np.pi * 40 * 0.5 * 2e-3 * 30 * np.cos(np.deg2rad(20))
    one = the_ratio(turned("loose", 1.0 + backlashes * 150e-6 / way, revolutions=40))
    assert one.size * way == pytest.approx(backlashes * 150e-6, rel=0.1)


@pytest.mark.slow
def test_no_rig_at_random_has_the_wrong_encoder_named():
    for seed in range(5000, 5060):
        rig = draw(seed)
        ratio = [one for one in examine(channels(rig.columns), rig.scenario) if one.kind == "ratio"]
        if rig.cause == "nothing":
            assert ratio == []
        elif ratio and ratio[0].channel:
            assert ratio[0].channel == COLUMN.get(rig.cause), rig.about
