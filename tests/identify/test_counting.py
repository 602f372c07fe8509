"""Counts read in step with the turning: their lines are left out with the reason, the backlash holds what they do."""

import numpy as np
import pytest

from gears3d.identify import read_contacts, roll, transmission_error
from gears3d.identify.transmission import backlash
from gears3d.measured.checks import Admitted
from gears3d.measured.readers import Channels
from gears3d.scenario import load
from gears3d.simulation import record
from tests.identify import campaigns

RIGAUD = "scenarios/base/rigaud-2020.toml"


def rolled(scenario, seed, turns=6):
    seen = record(scenario, "transmission-error", turns=turns, seed=seed)
    return roll(read_contacts([Admitted(Channels(seen.signals), load(RIGAUD), (), "")]))


@pytest.mark.parametrize("seed", [215, 216])
def test_lines_of_counting_are_left_out_with_the_reason(seed):
    scenario = campaigns.drawn("400 000 ppr", seed)
    found = transmission_error(rolled(scenario, seed))
    flanks, _ = campaigns.truth(scenario)
    told = {f"{one['flank']}_{one['gear']}_{one['order']}" for one in found.goodness["orders"]}
    assert told == {f"{flank}_{name}" for flank in ("active", "reverse") for name in flanks[flank]}
    left_out = found.goodness["counting"]
    assert {one["order"] for one in left_out} <= {116, 181}
    assert left_out
    assert all(one["amplitude_m"] < 15e-9 for one in left_out)
    assert any("commensurate with the sampling rate" in note for note in found.warnings)
    assert "order = 181" not in found.snippet


def test_a_real_order_as_small_as_a_line_of_counting_stays():
    wave = {"kind": "transmission_error", "order": 181, "amplitude": "0.05 um", "phase": "30 deg"}
    scenario = campaigns.drawn("400 000 ppr", 216).with_({"effect": [wave]})
    found = transmission_error(rolled(scenario, 216))
    assert found.parameters["active_drive_181_amplitude"].value == pytest.approx(50e-9, rel=0.3)


def turned_to_and_fro(random, width, step=2 * np.pi / 3600, turns=3):
    """Angles of an ideal pair, both ways, that counters of 1 600 000 read 3600 times a turn."""
    scenario = load(RIGAUD)
    rig, count = scenario.rig(), 2 * np.pi / 1_600_000
    rows = np.arange(3600 * turns + 300)
    forth = step * (rows + random.uniform())
    back = forth[-1] - step * (rows + random.uniform())
    drive = np.concatenate([forth, back])
    flank = np.repeat([0.0, width], len(rows)) + 2e-6 * np.cos(drive)
    loose = (rig.base_radius_drive * drive + flank) / rig.base_radius_loose
    angles = (np.floor(angle / count + random.uniform()) * count for angle in (drive, loose))
    columns = zip(("theta_drive_rad", "theta_loose_rad"), angles, strict=True)
    return Admitted(Channels({"time_s": np.arange(len(drive)) / 60.0, **dict(columns)}), scenario, (), "")


@pytest.mark.slow
def test_counts_in_step_are_in_the_interval_of_the_backlash():
    random, off, half, sizes = np.random.default_rng(8), [], [], []
    for _ in range(12):
        width = random.uniform(240e-6, 260e-6)
        found = backlash(roll(read_contacts([turned_to_and_fro(random, width)])))
        one = found.parameters["backlash"]
        off.append(one.value - width)
        half.append(0.5 * (one.high - one.low))
        sizes.append(found.goodness["counting_m"])
    # begins of the counts within one are the same for both ways; every ninth reading is alike
    assert np.mean(np.abs(off) < half) > 0.8
    assert np.std(off) > 0.3 * np.mean(half) / 1.96
    assert np.std(off) > 5e-9
    assert max(sizes) < 60e-9


def test_bins_that_are_off_by_part_of_a_count_are_on_the_flank():
    """Even flanks and encoders without noise: most bins read the same count, those that read two are no strays."""
    rig = load(RIGAUD)
    found = backlash(roll(read_contacts([Admitted(Channels(record(rig, "transmission-error").signals), rig, (), "")])))
    width = found.parameters["backlash"]
    assert width.low <= rig.mount.backlash <= width.high
    assert found.goodness["active"]["bins_left_out"] == found.goodness["reverse"]["bins_left_out"] == 0.0
