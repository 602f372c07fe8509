import subprocess
import sys

import matplotlib.image
import numpy as np
import pytest
from matplotlib.colors import to_hex

from gears3d.comparison import compare, picture, write_picture
from gears3d.errors import InputError, UsageError
from gears3d.recording import Recording

PERIOD = 1 / 3


def rattle(scale=1.0, drop=(), **meta):
    time = np.linspace(0, 5, 2001)
    hits = {
        "time_s": np.ravel([[(k + 0.37) * PERIOD, (k + 0.87) * PERIOD] for k in range(15)]),
        "flank": np.array([1, 0] * 15),
        "velocity_m_s": scale * np.array([0.03, -0.03] * 15),
    }
    hits = {name: np.delete(values, drop) for name, values in hits.items()}
    path = 125e-6 * (1 - np.cos(2 * np.pi * time / PERIOD))
    signals = {"time_s": time, "theta_drive_rad": time, "theta_loose_rad": time, "displacement_m": path}
    return Recording(signals, hits, {"period_s": PERIOD, "backlash_m": 250e-6, **meta})


def drawn(a, b, **options):
    return picture(compare(a, b, **options), a, b)


def points(axes, colour):
    return sum(len(line.get_xdata()) for line in axes.lines if to_hex(line.get_color()) == colour.lower())


def test_every_matched_impact_is_a_point_in_the_colour_of_its_flank():
    _, speeds, errors = drawn(rattle(1.01, [4]), rattle()).axes
    for axes in (speeds, errors):
        plotted = [line for line in axes.lines if line.get_marker() in ("o", "s")]
        assert [to_hex(line.get_color()) for line in plotted] == ["#0072b2", "#d55e00"]
        assert [len(line.get_xdata()) for line in plotted] == [15, 14]
    np.testing.assert_allclose(errors.lines[0].get_ydata(), 1.0)
    assert "%" in errors.get_ylabel()


def test_impacts_without_counterpart_are_crossed():
    speeds = drawn(rattle(drop=[4, 6]), rattle(drop=[9])).axes[1]
    crosses = [line for line in speeds.lines if line.get_marker() == "x"]
    assert [len(line.get_xdata()) for line in crosses] == [2, 1]
    np.testing.assert_allclose(crosses[0].get_xdata(), 30.0)
    np.testing.assert_allclose(crosses[1].get_ydata(), 30.0)


def test_the_top_shows_the_last_three_periods_of_both():
    top = drawn(rattle(model="bullet"), rattle(model="rigid")).axes[0]
    lines = {line.get_label(): line for line in top.lines}
    for name in ("bullet", "rigid"):
        time = lines[name].get_xdata()
        assert time[-1] == 5.0
        assert time[-1] - time[0] == pytest.approx(3 * PERIOD, abs=0.003)


def test_small_errors_get_a_unit_that_fits():
    errors = drawn(rattle(1 + 2e-7), rattle()).axes[2]
    assert "ppb" in errors.get_ylabel()
    np.testing.assert_allclose(errors.lines[0].get_ydata(), 200.0, rtol=1e-6)


def test_a_distribution_is_drawn_as_one():
    _, shares, section = drawn(rattle(), rattle(), mode="distribution").axes
    assert shares.get_ylabel() == "share of the impacts below"
    assert section.get_xlim() == (0, 1)


@pytest.mark.parametrize("mode", ["trajectory", "distribution"])
def test_records_of_nothing_can_be_drawn(mode):
    bare = Recording({name: [0.0, 1.0] for name in ("time_s", "theta_drive_rad", "theta_loose_rad")})
    drawn(bare, bare, mode=mode).canvas.draw()


def test_pictures_are_written_whole(tmp_path):
    a, b = rattle(), rattle()
    found = compare(a, b)
    image = matplotlib.image.imread(write_picture(tmp_path / "c.png", found, a, b))
    assert image.shape[:2] == (845, 1300)
    assert "<svg" in write_picture(tmp_path / "c.svg", found, a, b).read_text()
    assert len(list(tmp_path.iterdir())) == 2
    with pytest.raises(UsageError, match=r"ends in .png, .svg, .pdf"):
        write_picture(tmp_path / "c.gif", found, a, b)
    with pytest.raises(InputError, match=r"c.png: cannot be written: Not a directory"):
        write_picture(tmp_path / "c.svg" / "c.png", found, a, b)


def test_comparing_loads_neither_matplotlib_nor_scipy():
    code = "import sys, gears3d.comparison; print(*(m for m in ('scipy', 'matplotlib', 'pyarrow') if m in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
