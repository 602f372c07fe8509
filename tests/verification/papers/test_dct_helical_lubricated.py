"""The lubricated dual-clutch transmission: every row as recorded; the tools of the rows."""

import pytest

from gears3d.verification.papers import Bench, hold, paper
from gears3d.verification.papers.dct_helical_lubricated.points import point, trend

PAPER = paper("dct-helical-lubricated")


@pytest.fixture(scope="module")
def bench():
    return Bench()


@pytest.mark.slow
@pytest.mark.parametrize("claim", PAPER.claims, ids=lambda c: f"{c.figure} {c.quantity}"[:60])
def test_every_row_has_the_verdict_on_record(claim, bench):
    result = hold(claim, bench)
    assert result.verdict == claim.recorded, result.computed


def test_the_base_case_is_double_sided_and_repeats_every_two_periods(bench):
    rows = [claim for claim in PAPER.claims if claim.figure == "fig. 13"]
    assert [hold(claim, bench).computed for claim in rows] == ["double_sided", "2T"]


def test_every_figure_has_a_row_or_a_reason_and_every_red_row_a_note():
    assert PAPER.forgotten == []
    red = [claim for claim in PAPER.claims if claim.recorded == "disagrees"]
    assert len(PAPER.claims) - len(red) >= 15
    assert all(len(claim.note) > 40 for claim in red)


def test_trends_are_told_apart():
    assert [trend(v) for v in ([1, 2, 3], [3, 2, 1], [1, 5, 4, 9], [1, 2, 1])] == [
        "rises", "falls", "rises on the whole", "neither",
    ]  # fmt: skip


def test_a_point_changes_what_it_says_and_nothing_else(bench):
    changed = bench.scenario("dct-helical-lubricated/fig13.toml", point(drag=0.3))
    base = bench.scenario("dct-helical-lubricated/fig13.toml", point())
    assert changed.rig().drag_torque == pytest.approx(0.3)
    assert changed.motion.harmonics[0].amplitude == pytest.approx(300.0 / (2 * 3.141592653589793 * 50.0))
    assert changed.pair().backlash == base.pair().backlash
    assert base.run.duration == pytest.approx(3.0)
