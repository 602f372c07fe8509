"""Rigaud & Perret-Liaudet 2020: every row keeps its verdict, and what the notes say of the red ones is so."""

from functools import cache

import numpy as np
import pytest

from gears3d.verification.papers import Bench, hold, paper
from gears3d.verification.papers.rigaud_2020 import camera, energy, flanks, regimes, theory, threshold
from gears3d.verification.papers.rigaud_2020.points import PLASTIC, excitation, plastic

BENCH = Bench()


@cache
def rows():
    return {(claim.figure, claim.quantity): claim for claim in paper("rigaud-2020").claims}


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
    result = hold(rows()[figure, QUICK[figure]], BENCH)
    assert not result.changed, result


@pytest.mark.slow
@pytest.mark.parametrize("where", [(c.figure, c.quantity) for c in paper("rigaud-2020").claims], ids=" ".join)
def test_every_row_keeps_its_verdict(where):
    result = hold(rows()[where], BENCH)
    assert not result.changed, result


def test_there_are_rows_enough_and_the_red_ones_are_findings():
    assert len(rows()) >= 25
    assert sum(claim.recorded == "disagrees" for claim in rows().values()) <= len(rows()) / 5


def test_the_closed_orbit_comes_out_of_the_bench():
    """Roots of eqs (17) to (19) with ẏ = ΔV sin ωt, found to 30 digits elsewhere."""
    assert regimes.speeds(BENCH, 20, 3) == pytest.approx((31.2425, -30.8581), abs=5e-4)
    assert regimes.speeds(BENCH, 5, 3) == pytest.approx((19.6954, -18.0340), abs=2e-4)
    assert theory.losses(BENCH.run(theory.FIG10)) * 2 * np.pi == pytest.approx(1.691362, abs=1e-5)


def test_the_threshold_is_where_the_excitation_is_one():
    assert threshold.excitation(BENCH, 0.46, 90, 5.0) == pytest.approx(1.0, abs=0.01)


def test_backlash_alone_does_not_explain_the_speeds():
    """The note on 22.3 and -19.9 mm/s."""
    found = BENCH.outcome("rigaud-2020/fig5-20rpm.toml", {**PLASTIC, "mount.backlash": "150 um"})
    assert -1e3 * found["active_velocity_mean_m_s"] == pytest.approx(22.3, abs=0.05)
    assert -1e3 * found["reverse_velocity_mean_m_s"] == pytest.approx(-22.0, abs=0.05)


def test_a_second_mesh_order_brings_the_light_losses():
    """The note on the losses at 0 rpm."""
    second = {"kind": "transmission_error", "order": 180, "amplitude": "0.3 um"}
    found = BENCH.outcome("rigaud-2020/fig12-0rpm.toml", {"effect[+]": second, "expect": {}})
    assert found["impacts"] > 0
    assert found["active_share"] > 0.8


def test_a_larger_inertia_brings_the_ninth_picture():
    """The note on the camera."""
    more = {"mount.backlash": "1900 um", "gears.loose.inertia": "0.074 kg m^2", "run.duration": "7 periods", **PLASTIC}
    meta = BENCH.run(camera.FILE, more).meta
    contacts = np.array(meta["contacts"])
    shown = []
    for frame in range(9):
        time = meta["period_s"] * (4.05 + frame / 8)
        there = contacts[(contacts[:, 1] <= time) & (time <= contacts[:, 2]), 0]
        shown.append(("active", "reverse")[int(there[0])] if there.size else "flight")
    assert tuple(shown) == camera.FRAMES


@pytest.mark.slow
def test_the_energy_goes_with_the_powers_of_the_note():
    points = energy.crossing(BENCH)
    table = np.c_[np.log10(points), np.ones(len(points))]
    powers = [np.log10(plastic(BENCH, *place)["energy_J_s"]) for place in points]
    found = np.linalg.lstsq(table, powers, rcond=None)[0]
    assert found[:2] == pytest.approx((0.79, 2.33), abs=0.01)
    assert np.std(table @ found - powers) * 10 < 0.3


@pytest.mark.slow
def test_rolling_separates_revolution_and_mesh():
    slow, mesh = flanks.parts(flanks.rolled(BENCH).phi_reverse)
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
    assert regimes.with_flanks(BENCH, "active") == pytest.approx(22.3, abs=0.1)


def test_the_inertia_is_that_of_the_threshold_at_3_hz():
    """So this threshold is no row."""
    assert excitation(BENCH, "rigaud-2020/fig5-1.6rpm.toml") == pytest.approx(1.0, abs=0.003)
