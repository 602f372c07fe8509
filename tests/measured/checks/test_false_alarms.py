"""How often the gate finds faults where there are none, and that it finds those that it claims to find."""

import sys

import pytest

from gears3d.measured.checks import examine
from tests.measured.checks.clean import channels
from tests.measured.checks.drawn import draw
from tests.measured.checks.limits import FAULTS, interval, tried

FIRST, RECORDS = 20_000, 300
"""Seeds from which nothing was tuned."""


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(91036, id="the drive's noise is in place and acceleration"),
        pytest.param(91043, id="the same on the helical bench"),
        pytest.param(91199, id="the same where it is large"),
        pytest.param(91296, id="the backlash varies"),
        pytest.param(91299, id="bounces that the noise hides"),
        pytest.param(80015, id="bounces that die out in it"),
        pytest.param(80235, id="gears that lift off in it"),
    ],
)
def test_no_delay_is_seen_in_what_noise_and_flanks_do(seed):
    scenario, columns, _ = draw(seed)
    assert [one.evidence for one in examine(channels(columns), scenario) if one.kind == "skew"] == []


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_false_alarms_are_rare_over_all_regimes(capsys):
    alarms, waves = [], 0
    for seed in range(FIRST, FIRST + RECORDS):
        scenario, columns, what = draw(seed)
        found = examine(channels(columns), scenario)
        waves += any(one.kind == "wave" for one in found)
        alarms += [(seed, what, one.kind, one.evidence) for one in found if one.kind != "wave"]
    records = len({alarm[0] for alarm in alarms})
    low, high = interval(records, RECORDS)
    told = f"{records} false alarms in {RECORDS} clean records (95 %: {low:.1%} to {high:.1%}), {waves} waves told"
    with capsys.disabled():
        sys.stdout.write("\n".join(["", told, *map(str, alarms), ""]))
    assert records <= 0.02 * RECORDS


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_largest_fault_of_each_ladder_is_found(fault):
    hits, errors = tried(fault, fault.sizes[-1], range(300, 310))
    assert hits >= 9 or not fault.sure
    assert abs(errors).max() < 0.2
