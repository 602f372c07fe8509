"""Figures of Kadmiri et al. 2012 drawn again."""

from __future__ import annotations

from typing import Any

import numpy as np

from gears3d.verification.papers.bench import Bench
from gears3d.verification.papers.figure import ACTIVE, LINE, PUBLISHED, REVERSE, Figure
from gears3d.verification.papers.kadmiri_2012.impacts import durations
from gears3d.verification.papers.kadmiri_2012.rattle import FOLDER, SWEEP, impulses, seen
from gears3d.verification.papers.kadmiri_2012.rundowns import TEMPERATURES, curve

EXCITATIONS = tuple(round(0.2 + 0.2 * i, 1) for i in range(12))
"""Λ at which fig. 12 is drawn."""


def impact_durations(bench: Bench, sheet: Any) -> None:
    """Draw fig. 6: durations with the measured and with the fitted drag beside the printed normal distribution.

    Args:
        bench: of the papers.
        sheet: an empty figure.
    """
    axes = sheet.subplots()
    bins = np.linspace(0.8, 1.6, 41)
    for drag, colour, label in (
        ("0.893 N m", LINE, "measured drag"),
        ("0.3126 N m", ACTIVE, "drag fitted to the threshold"),
    ):
        axes.hist(durations(bench, drag=drag), bins=bins, density=True, color=colour, alpha=0.6, label=label)
    at = np.linspace(0.8, 1.6, 400)
    printed = np.exp(-0.5 * ((at - 1.2) / 0.06) ** 2) / (0.06 * np.sqrt(2 * np.pi))
    axes.plot(at, printed, color=PUBLISHED, label="printed: 1.2 ± 0.06 ms")
    axes.set(xlabel="duration [ms]", ylabel="density [1/ms]")
    axes.legend()


def run_downs(bench: Bench, sheet: Any) -> None:
    """Draw figs 8 to 10: speed over time for the three assemblies, the third at four temperatures.

    Args:
        bench: of the papers.
        sheet: an empty figure.
    """
    left, right = sheet.subplots(1, 2, sharey=True)
    for version, label in ((1, "1: bearings, encoder"), (2, "2: and shear"), (3, "3: and churning, 50 °C")):
        time, speed = curve(bench, version)
        left.plot(time, speed * 30 / np.pi, label=label)
    for temperature in TEMPERATURES:
        time, speed = curve(bench, 3, temperature)
        right.plot(time, speed * 30 / np.pi, label=f"{temperature} °C")
    left.set(xlabel="time [s]", ylabel="speed [rpm]", title="assembly versions")
    right.set(xlabel="time [s]", title="third version")
    left.legend()
    right.legend()


def impulse_maps(bench: Bench, sheet: Any) -> None:
    """Draw fig. 12: dimensionless impulses over the excitation for four speeds.

    Args:
        bench: of the papers.
        sheet: an empty figure.
    """
    for axes, speed, letter in zip(sheet.subplots(2, 2, sharex=True, sharey=True).ravel(), SWEEP, "abcd", strict=True):
        for wanted in EXCITATIONS:
            hits = impulses(bench, speed, wanted)
            for sign, colour in ((1, ACTIVE), (-1, REVERSE)):
                mine = hits[np.sign(hits) == sign]
                axes.plot(np.full(len(mine), wanted), mine, ".", color=colour, ms=3)
        axes.axvline(0.35, color=PUBLISHED, ls="--", lw=0.9)
        axes.axhline(0.0, color=LINE, lw=0.5)
        axes.set(title=f"({letter}) {speed} rpm", xlim=(0, 2.5))
    for axes in sheet.axes[2:]:
        axes.set_xlabel("excitation")
    for axes in sheet.axes[::2]:
        axes.set_ylabel("dimensionless impulse")


def histories(bench: Bench, sheet: Any, names: dict[str, str]) -> None:
    """Draw the relative velocity of scenarios over time.

    Args:
        bench: of the papers.
        sheet: an empty figure.
        names: of the scenarios' files, with titles.
    """
    for axes, (name, title) in zip(sheet.subplots(1, len(names), squeeze=False)[0], names.items(), strict=True):
        run = bench.run(f"{FOLDER}/{name}")
        shown = (run.time > 1.0) & (run.time < 1.2)
        axes.plot(1e3 * (run.time[shown] - 1.0), 1e3 * run.signals["velocity_m_s"][shown], color=LINE, lw=0.9)
        axes.set(title=title, xlabel="time [ms]", ylabel="relative velocity [mm/s]")


def maps(bench: Bench, sheet: Any, names: dict[str, str]) -> None:
    """Draw impulse over phase of the impacts of scenarios.

    Args:
        bench: of the papers.
        sheet: an empty figure.
        names: of the scenarios' files, with titles.
    """
    for axes, (name, title) in zip(sheet.subplots(1, len(names), squeeze=False)[0], names.items(), strict=True):
        hits = seen(bench, name)
        for flank, colour, label in ((0, ACTIVE, "active"), (1, REVERSE, "reverse")):
            mine = hits["flank"] == flank
            axes.plot(360 * hits["cycle"][mine], 1e3 * hits["impulse_N_s"][mine], ".", color=colour, label=label)
        axes.set(title=title, xlabel="phase [deg]", ylabel="impulse [mN s]", xlim=(0, 360))
        axes.legend()


NEUTRAL = {"fig13-100rpm-fitted.toml": "neutral, 100 rpm, fitted drag", "fig13-150rpm.toml": "neutral, 150 rpm"}
THIRD = {"fig15-100rpm.toml": "third ratio, 100 rpm"}
NOTE = "With the measured drag nothing rattles at 100 rpm in neutral; left with 0.35 of it."
FIGURES = (
    Figure(
        FOLDER, "fig. 6", "Duration of the impacts", impact_durations, (7.0, 3.4),
        "Active impacts last longer than reverse ones by what the drag does in the meantime.",
    ),
    Figure(
        FOLDER, "fig. 10", "Run-downs of figs 8 to 10", run_downs, (9.0, 3.4),
        "Sizes assumed, so the times are not those of the paper; the order of the curves is.",
    ),
    Figure(
        FOLDER, "fig. 12", "Dimensionless impulse over excitation", impulse_maps, (9.0, 6.0),
        "Impacts after flights across half of the backlash. The gearbox rattled from the green line on, and its maps "
        "lie on each other; the rigid ones begin at 1, and each speed has its own dimensionless backlash.",
    ),
    Figure(FOLDER, "fig. 13", "Relative velocity", lambda b, s: histories(b, s, NEUTRAL), (9.0, 3.4), NOTE),
    Figure(FOLDER, "fig. 14", "Impulse over phase", lambda b, s: maps(b, s, NEUTRAL), (9.0, 3.4), NOTE),
    Figure(FOLDER, "fig. 15", "Relative velocity", lambda b, s: histories(b, s, THIRD), (6.0, 3.4)),
    Figure(FOLDER, "fig. 16", "Impulse over phase", lambda b, s: maps(b, s, THIRD), (6.0, 3.4)),
)  # fmt: skip
"""Figures 6, 10 and 12 to 16."""
