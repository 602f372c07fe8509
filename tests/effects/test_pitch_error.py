"""One tooth out of step: the impact on it comes earlier or later by the closed form, on others as before."""

import pytest

from gears3d.simulation import simulate
from gears3d.verification.validation import closed_form
from tests.effects.bench import bench

TOOTH = 18
"""Of both gears at the first reverse impact: the drive has turned by 70 degrees."""


@pytest.mark.parametrize("gear", ["drive", "loose"])
@pytest.mark.parametrize(("flank", "sign"), [("reverse", 1), ("both", 1), ("reverse", -1), ("active", 1)])
def test_the_first_reverse_impact(gear, flank, sign):
    sound = simulate(bench()).impacts
    tooth = int(sound[f"tooth_{gear}"][0])
    effect = {"kind": "pitch_error", "gear": gear, "tooth": tooth, "offset": f"{-sign * 10e-6} m", "flank": flank}
    hits = simulate(bench(effect)).impacts
    moved = hits["time_s"][0] - sound["time_s"][0], hits["velocity_m_s"][0] - sound["velocity_m_s"][0]
    if flank == "active":
        assert moved == pytest.approx((0.0, 0.0), abs=1e-9)
    elif sign > 0:  # material on the reverse flank
        assert moved == pytest.approx(closed_form(10e-6), rel=1e-3)
        assert hits[f"tooth_{gear}"][0] == tooth
    else:  # the flank stands back, but the edge of the next tooth hits before the gap is 10 µm wider
        assert 0.0 < moved[0] < 0.5 * closed_form(-10e-6)[0]
        assert hits[f"tooth_{gear}"][0] != tooth


def test_the_active_flank_carries_the_other_sign():
    rows = {flank: bench(effect(flank)).rows() for flank in ("active", "reverse", "both")}
    assert [row.p[3] for row in rows["both"]] == [10e-6, -10e-6]
    assert rows["both"] == rows["active"] + rows["reverse"]


def effect(flank):
    return {"kind": "pitch_error", "tooth": TOOTH, "offset": "10 um", "flank": flank}
