"""Figures 2, 3, 4, 7 and 13 of Rigaud & Perret-Liaudet 2020, drawn again."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.laws.noise import WHINE_30_RPM, rattle_level, total_level
from gears3d.verification.papers.figure import ACTIVE, LINE, PUBLISHED, REVERSE
from gears3d.verification.papers.rigaud_2020.energy import decades
from gears3d.verification.papers.rigaud_2020.flanks import rolled
from gears3d.verification.papers.rigaud_2020.points import AMPLITUDES, FREQUENCIES, SCATTER, crossing, plastic
from gears3d.verification.papers.rigaud_2020.threshold import AMPLITUDES as SWEPT
from gears3d.verification.papers.rigaud_2020.threshold import MEANS, TORQUES, threshold

if TYPE_CHECKING:
    from gears3d.verification.papers.bench import Bench

MARKERS = dict(zip(TORQUES, ("+", "o", "x"), strict=True))
RPM = pi / 30
MEETING = 300.0
"""ω²·ΔΩ at which rattle is as loud as whine [rad³/s³]: chosen, the constant of eq. (26) is not printed."""


def transmission_error(bench: Bench, sheet: Any) -> None:
    """Draw figure 2: both transmission errors over a revolution, and their spectra.

    Args:
        bench: of the papers.
        sheet: matplotlib figure.
    """
    found = rolled(bench)
    time, spectrum = sheet.subplots(1, 2, width_ratios=(1.3, 1))
    angle = np.degrees(found.theta)
    curves = (found.phi_active, found.phi_active + found.backlash)
    for path, colour, name in zip(curves, (ACTIVE, REVERSE), ("active flanks", "reverse flanks"), strict=True):
        time.plot(angle, 1e6 * path, color=colour, linewidth=0.7, label=name)
        amplitude = 2 * np.abs(np.fft.rfft(path - path.mean())) / len(path)
        spectrum.vlines(np.arange(201), 0, 1e6 * amplitude[:201], color=colour, linewidth=1.6)
    time.annotate("", (20, 250 + 50), (20, 50), arrowprops={"arrowstyle": "<->", "color": PUBLISHED})
    time.text(25, 150, "printed backlash 250 µm", color=PUBLISHED)
    time.set(xlabel="angle of the drive gear [deg]", ylabel="transmission error [µm]", xlim=(0, 360))
    time.legend(loc="center right")
    spectrum.axhline(50, color=PUBLISHED, linestyle=":", linewidth=1)
    spectrum.axhline(5, color=PUBLISHED, linestyle=":", linewidth=1)
    spectrum.text(198, 51.5, "half of 100 µm", ha="right", va="bottom", color=PUBLISHED)
    spectrum.text(198, 5.4, "half of 10 µm", ha="right", va="bottom", color=PUBLISHED)
    spectrum.set(
        xlabel="order of the revolution", ylabel="amplitude [µm]", xlim=(0, 200), yscale="log", ylim=(0.1, 100)
    )


def thresholds(bench: Bench, sheet: Any) -> None:
    """Draw figure 3: the frequency at which rattle begins over the amplitude, for three torques and two speeds.

    Args:
        bench: of the papers.
        sheet: matplotlib figure.
    """
    panels = sheet.subplots(1, 2, sharex=True, sharey=True)
    for axes, mean, letter in zip(panels, MEANS, "ab", strict=True):
        for torque, marker in MARKERS.items():
            speed = RPM * np.array(SWEPT[mean])
            found = [2 * pi * threshold(bench, torque, mean, each) for each in SWEPT[mean]]
            face: dict[str, Any] = {"markerfacecolor": "none"} if marker == "o" else {}
            axes.loglog(speed, found, marker, color=LINE, label=f"{torque} N·m, ours", **face)
            _published_line(bench, axes, torque, np.array([0.05, 5.0]))
        axes.set_title(f"({letter}) Ω0 = {mean} rpm", loc="left")
        axes.set(xlabel="ΔΩ [rad/s]", xlim=(0.04, 7), ylim=(0.3, 400))
        axes.grid(which="both", linewidth=0.3)
    panels[0].set_ylabel("ω [rad/s]")
    panels[0].legend(loc="lower left")


def _published_line(bench: Bench, axes: Any, torque: float, speed: np.ndarray) -> None:
    """Draw the line on which the paper's mean Λ* = 1.09 lies."""
    inertia = bench.scenario("base/rigaud-2020.toml").rig().inertia
    words = "printed Λ* = 1.09" if torque == TORQUES[-1] else None
    axes.loglog(speed, 1.09 * torque / inertia / speed, color=PUBLISHED, linewidth=0.9, zorder=1, label=words)


def master_curve(bench: Bench, sheet: Any) -> None:
    """Draw figure 4: all thresholds on one line.

    Args:
        bench: of the papers.
        sheet: matplotlib figure.
    """
    axes = sheet.subplots()
    inertia = bench.scenario("base/rigaud-2020.toml").rig().inertia
    ratio = np.array([0.05, 40.0])
    axes.fill_between(
        ratio, 0.9 / inertia / ratio, 1.28 / inertia / ratio, color=PUBLISHED, alpha=0.18, linewidth=0,
        label="printed Λ* = 1.09 ± 0.19",
    )  # fmt: skip
    axes.loglog(ratio, 1.09 / inertia / ratio, color=PUBLISHED, linewidth=1)
    axes.loglog(ratio, 1 / inertia / ratio, color=LINE, linewidth=1.2, label="theory, Λ* = 1")
    for mean in MEANS:
        for torque, marker in MARKERS.items():
            speed = RPM * np.array(SWEPT[mean]) / torque
            found = [2 * pi * threshold(bench, torque, mean, each) for each in SWEPT[mean]]
            face: dict[str, Any] = {"markerfacecolor": "none"} if marker == "o" else {}
            colour, size = (ACTIVE, 9) if mean == 30 else (REVERSE, 5)
            axes.loglog(speed, found, marker, color=colour, markersize=size, **face)
    for torque, marker in MARKERS.items():
        axes.plot([], [], marker, color=LINE, markerfacecolor="none", label=f"{torque} N·m (large 30, small 90 rpm)")
    axes.set(xlabel="ΔΩ/Td [rad/(s N m)]", ylabel="ω [rad/s]", xlim=(0.05, 40), ylim=(0.3, 300))
    axes.grid(which="both", linewidth=0.3)
    axes.legend(loc="lower left")


def energies(bench: Bench, sheet: Any) -> None:
    """Draw figure 7: mean squared impact velocity over ω·ΔΩ.

    Args:
        bench: of the papers.
        sheet: matplotlib figure.
    """
    axes = sheet.subplots()
    points = crossing(bench)
    product = np.array([2 * pi * frequency * RPM * amplitude for amplitude, frequency in points])
    for flank, colour, marker in (("active", ACTIVE, "o"), ("reverse", REVERSE, "s")):
        squares = [1e6 * plastic(bench, *place)[f"{flank}_velocity_mean_square_m2_s2"] for place in points]
        axes.loglog(product, squares, marker, color=colour, markerfacecolor="none", label=f"ours, {flank} flank")
    line = np.array([3.0, 140.0])
    printed = 2 * pi * 3 * RPM * 20
    axes.loglog(line, 22.3**2 * line / printed, color=PUBLISHED, linewidth=1, label="printed slope, 10 dB per decade")
    for speed, marker in ((22.3, "o"), (19.9, "s")):
        bar = [[speed**2 * (1 - (1 - SCATTER) ** 2)], [speed**2 * ((1 + SCATTER) ** 2 - 1)]]
        axes.errorbar([printed], [speed**2], yerr=bar, fmt=marker, color=PUBLISHED, capsize=3)
    axes.plot([], [], "o", color=PUBLISHED, label="printed means at 20 rpm, 3 Hz")
    axes.set(xlabel="ω·ΔΩ [rad/s²]", ylabel="mean squared impact velocity [mm²/s²]", xlim=(3, 140))
    axes.grid(which="both", linewidth=0.3)
    axes.legend(loc="lower right")


def sound(bench: Bench, sheet: Any) -> None:
    """Draw figure 13: sound pressure level over ω²·ΔΩ.

    Args:
        bench: of the papers.
        sheet: matplotlib figure.
    """
    axes = sheet.subplots()
    abscissa, power = decades(bench, "energy_J_s", 2)
    scale = (2 * pi) ** 2 * RPM
    offset = WHINE_30_RPM - float(np.mean(power - 10 * abscissa)) - 10 * np.log10(MEETING / scale)
    product = np.logspace(0.5, 4.2, 100)
    rattle = rattle_level(np.sqrt(product), 1.0, 10 ** (WHINE_30_RPM / 10) / MEETING)
    axes.axhline(WHINE_30_RPM, color=PUBLISHED, linestyle="--", linewidth=1, label="whine, printed 78 dB, eq. (22)")
    axes.semilogx(product, rattle, color=PUBLISHED, linestyle=":", linewidth=1.2, label="rattle, eq. (26)")
    axes.semilogx(product, total_level(WHINE_30_RPM, rattle), color=PUBLISHED, linewidth=1.2, label="total, eq. (27)")
    for amplitude, marker in zip(AMPLITUDES, ("o", "+", "x", "*"), strict=True):
        places = [(amplitude, frequency) for frequency in FREQUENCIES]
        levels = [10 * np.log10(max(plastic(bench, *place)["energy_J_s"], 1e-30)) + offset for place in places]
        where = [scale * frequency**2 * amplitude for frequency in FREQUENCIES]
        axes.semilogx(
            where,
            total_level(WHINE_30_RPM, levels),
            marker,
            color=LINE,
            markerfacecolor="none",
            label=f"ours, {amplitude:g} rpm",
        )
    axes.set(xlabel="ω²·ΔΩ [rad³/s³]", ylabel="sound pressure level [dB]", ylim=(74, 102))
    axes.grid(which="both", linewidth=0.3)
    axes.legend(loc="upper left")
