"""Rigaud & Perret-Liaudet 2020: what the notes of rows that disagree state is so, and closed forms of the measures."""

import numpy as np
import pytest

from gears3d.verification.papers import Bench, hold, paper
from gears3d.verification.papers.measures import geometry, responses

BENCH = Bench()
ROWS = {(claim.figure, claim.quantity): claim for claim in paper("rigaud-2020").claims}
PLASTIC = {"impact.restitution": 0}
STEADY = {**PLASTIC, "run.duration": "20 periods"}
QUICK = {
    "table 1": "contact ratio at 318 mm",
    "fig. 3": "half the threshold at 90 rpm, rigid teeth with the transmission error of fig. 2",
    "fig. 5": "mean impact velocity on the active flank, 20 rpm, 3 Hz",
    "fig. 6": "regime at 1 Hz, 5 rpm",
    "fig. 8": "order of the states in a period",
    "fig. 10": "response at restitution 0",
    "fig. 11": "loss of the active flank, restitution 0.3 against 0",
    "fig. 12": "regime at 1.6 rpm, 3 Hz with the transmission error",
}


@pytest.mark.parametrize("figure", QUICK)
def test_a_row_of_the_figure_keeps_its_verdict(figure):
    result = hold(ROWS[figure, QUICK[figure]], BENCH)
    assert not result.changed, result


def test_there_are_rows_enough_and_the_red_ones_are_findings():
    assert len(ROWS) >= 25
    assert sum(claim.recorded == "disagrees" for claim in ROWS.values()) <= len(ROWS) / 5


def test_the_closed_orbit_comes_out_of_the_bench():
    """Roots of eqs (17) to (19) with ẏ = ΔV sin ωt, found to 30 digits elsewhere."""
    for name, expected, off in (("20rpm", (31.2425, -30.8581), 5e-4), ("5rpm", (19.6954, -18.0340), 2e-4)):
        found = BENCH.outcome(f"rigaud-2020/fig5-{name}", STEADY)
        speeds = [-1e3 * found[f"{flank}_velocity_mean_m_s"] for flank in ("active", "reverse")]
        assert speeds == pytest.approx(expected, abs=off)
    losses = responses.losses(BENCH.case("rigaud-2020/fig10"))
    assert losses * 2 * np.pi == pytest.approx(1.691362, abs=1e-5)


def test_the_threshold_is_where_the_excitation_is_one():
    found = responses.swept_excitation(BENCH.case("rigaud-2020/fig3-0.46Nm-90rpm"), 5.0)
    assert found == pytest.approx(1.0, abs=0.01)


def test_backlash_alone_does_not_explain_the_speeds():
    """The note on 22.3 and -19.9 mm/s."""
    found = BENCH.outcome("rigaud-2020/fig5-20rpm", {**PLASTIC, "mount.backlash": "150 um"})
    assert -1e3 * found["active_velocity_mean_m_s"] == pytest.approx(22.3, abs=0.05)
    assert -1e3 * found["reverse_velocity_mean_m_s"] == pytest.approx(-22.0, abs=0.05)


def test_a_second_mesh_order_brings_the_light_losses():
    """The note on the losses at 0 rpm."""
    second = {"kind": "transmission_error", "order": 180, "amplitude": "0.3 um"}
    found = BENCH.outcome("rigaud-2020/fig12-0rpm", {"effect[+]": second, "expect": {}})
    assert found["impacts"] > 0
    assert found["active_share"] > 0.8


def test_a_larger_inertia_brings_the_ninth_picture():
    """The note on the camera."""
    more = {"mount.backlash": "1900 um", "gears.loose.inertia": "0.074 kg m^2", **PLASTIC}
    assert tuple(responses.pictured(BENCH.case("rigaud-2020/fig8", more), 0.05)) == responses.FRAMES


@pytest.mark.slow
def test_the_energy_goes_with_the_powers_of_the_note():
    (row,) = (claim for claim in ROWS.values() if claim.quantity.startswith("energy that"))
    chosen = responses.double_sided([BENCH.case(name, STEADY) for name in row.compute.keywords["row"]["scenario"]])
    harmonics = [case.scenario.motion.harmonics[0] for case in chosen]
    table = np.array([[np.log10(each.amplitude), np.log10(each.frequency), 1.0] for each in harmonics])
    powers = np.log10([case.outcome["energy_J_s"] for case in chosen])
    found = np.linalg.lstsq(table, powers, rcond=None)[0]
    assert found[:2] == pytest.approx((0.79, 2.33), abs=0.01)
    assert np.std(table @ found - powers) * 10 < 0.3


@pytest.mark.slow
def test_rolling_separates_revolution_and_mesh():
    slow, mesh = geometry.parts(geometry.rolled(BENCH.case("rigaud-2020/fig2")).phi_reverse)
    assert np.ptp(slow) == pytest.approx(100e-6, rel=1e-6)
    assert np.ptp(mesh) == pytest.approx(10e-6, rel=1e-6)


@pytest.mark.parametrize("name", ["fig. 10", "fig. 8"])
def test_a_figure_is_drawn(name):
    assert_drawn(next(figure for figure in paper("rigaud-2020").figures if figure.name == name))


@pytest.mark.slow
@pytest.mark.parametrize("figure", paper("rigaud-2020").figures, ids=lambda figure: figure.name)
def test_every_figure_is_drawn(figure):
    assert_drawn(figure)


def assert_drawn(figure):
    """A picture of the size asked for with ink in it, whose commands are known."""
    from io import BytesIO

    from matplotlib.image import imread

    picture = imread(BytesIO(figure.png(BENCH, dpi=40)))
    assert picture.shape[:2] == (round(figure.size[1] * 40), round(figure.size[0] * 40))
    assert 0.005 < (picture[..., :3].min(axis=2) < 0.5).mean() < 0.5
    if figure.name != "fig. 2":
        assert BENCH.commands[f"rigaud-2020 {figure.name}"]


def test_backlash_and_mesh_order_explain_both_speeds():
    """The backlash is fitted to the active flank's 22.3 mm/s: that fit holds, and a row has the reverse flank."""
    settings = {"mount.backlash": "150 um", "run.output_rate": "2 kHz"}
    each = [settings | {"effect[1].phase": f"{phase} deg"} for phase in range(0, 360, 45)]
    cases = [BENCH.case("rigaud-2020/fig12-20rpm-3Hz", one) for one in each]
    assert 1e3 * responses.crossing_velocities(cases, "active").mean() == pytest.approx(22.3, abs=0.1)


def test_the_inertia_is_that_of_the_threshold_at_3_hz():
    """So this threshold is no row."""
    assert responses.excitation(BENCH.case("rigaud-2020/fig5-1.6rpm")) == pytest.approx(1.0, abs=0.003)
