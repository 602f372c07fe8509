"""Figures of Ottewill et al. 2010 drawn again."""

from __future__ import annotations

from typing import Any

import numpy as np

from gears3d.laws.error_function import averaged
from gears3d.verification.papers.bench import Bench
from gears3d.verification.papers.figure import ACTIVE, LINE, REVERSE, Figure
from gears3d.verification.papers.ottewill_2010.measured import encoders, recreated
from gears3d.verification.papers.ottewill_2010.rattle import speed_dependent, wandering
from gears3d.verification.papers.ottewill_2010.runs import AMPLITUDES, FOLDER, HALF_BACKLASH, PHASES, contour


def errors(bench: Bench, sheet: Any) -> None:
    """Draw fig. 3: one revolution as the encoders see it, averaged over 25, and from its 21 strongest orders.

    Args:
        bench: of the papers.
        sheet: an empty figure.
    """
    read = encoders(bench)
    angle = np.linspace(0.0, 2 * np.pi, 1000, endpoint=False)
    curves = (read[0], averaged(read.ravel(), 25), recreated(bench).at(angle))
    for axes, curve, title in zip(
        sheet.subplots(1, 3, sharey=True),
        curves,
        ("(a) one revolution", "(b) mean of 25", "(c) 21 orders"),
        strict=True,
    ):
        axes.plot(angle / (2 * np.pi), 1e3 * (curve - curve.mean()), color=LINE, lw=0.7)
        axes.set(title=title, xlabel="revolution")
    sheet.axes[0].set_ylabel("error [mrad]")


def dynamic_error(bench: Bench, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return revolutions and x = θ1 − θ2 − e of a shipped scenario [rad], β on the driving flank.

    Args:
        bench: of the papers.
        name: of its file.
    """
    run = bench.run(f"{FOLDER}/{name}")
    radius = bench.scenario(f"{FOLDER}/{name}").rig().base_radius_loose
    waves = [e for e in bench.scenario(f"{FOLDER}/{name}").effects if e.kind == "transmission_error"]
    theta = run.signals["theta_drive_rad"]
    flank = sum(w.amplitude * np.cos(w.order * theta + w.phase) for w in waves)
    return run.time, HALF_BACKLASH - (run.signals["displacement_m"] - flank) / radius


def trajectories(bench: Bench, sheet: Any) -> None:
    """Draw fig. 5: the three phases.

    Args:
        bench: of the papers.
        sheet: an empty figure.
    """
    panels = sheet.subplots(3, 1, sharex=True, sharey=True)
    titles = ("(a) 2.60 rad, small on the rig", "(b) 5.14 rad, medium", "(c) 0.25 rad, large")
    for axes, name, title in zip(panels, ("fig5a", "fig5b", "fig5c"), titles, strict=True):
        time, x = dynamic_error(bench, f"{name}.toml")
        axes.plot(time, 1e3 * x, color=LINE, lw=1)
        axes.axhline(1e3 * HALF_BACKLASH, color=ACTIVE, ls="--", lw=0.8)
        axes.axhline(-1e3 * HALF_BACKLASH, color=REVERSE, ls="--", lw=0.8)
        axes.set(title=title, ylabel="x [mrad]")
    panels[-1].set_xlabel("revolutions")


def small_phase(bench: Bench, sheet: Any) -> None:
    """Draw fig. 6: fig. 5 (b) and 0.035 rad of phase to either side.

    Args:
        bench: of the papers.
        sheet: an empty figure.
    """
    axes = sheet.subplots()
    for name, label, style in (("fig5b", "5.14 rad", "-"), ("fig6-lead", "leads", "--"), ("fig6-lag", "lags", ":")):
        time, x = dynamic_error(bench, f"{name}.toml")
        shown = (time >= 1.5) & (time <= 3.0)
        axes.plot(time[shown], 1e3 * x[shown], style, color=LINE, lw=1, label=label)
    axes.axhline(1e3 * HALF_BACKLASH, color=ACTIVE, ls="--", lw=0.8)
    axes.set(xlabel="revolutions", ylabel="x [mrad]")
    axes.legend(loc="lower right")


def contours(sheet: Any, titled: list[tuple[str, np.ndarray]]) -> None:
    """Draw disconnections over phase and amplitude side by side.

    Args:
        sheet: an empty figure.
        titled: titles and disconnections [rad], (8, 30).
    """
    drawn = None
    for axes, (title, found) in zip(sheet.subplots(1, len(titled), squeeze=False)[0], titled, strict=True):
        levels = np.linspace(0.0, 2e3 * HALF_BACKLASH, 9)
        drawn = axes.contourf(PHASES, AMPLITUDES, 1e3 * found, levels=levels, cmap="viridis", extend="max")
        axes.set(title=title, xlabel="phase relative to the eccentricity [rad]", ylabel="drive amplitude [rad]")
    sheet.colorbar(drawn, ax=sheet.axes, label="disconnection [mrad]")


def _case(bench: Bench, case: str) -> tuple[str, np.ndarray]:
    return f"case {case}", contour(bench, f"case-{case}.toml", case)


ASSUMED = "The error's orders are not printed but assumed, so band and shape need not be those of the paper."
FIGURES = (
    Figure(FOLDER, "fig. 3", "Synthesis of an error function", errors, (9.0, 3.0), ASSUMED),
    Figure(FOLDER, "fig. 5", "Three phases of the drive at 0.43 rad", trajectories, (9.0, 6.0), ASSUMED),
    Figure(FOLDER, "fig. 6", "0.035 rad of phase", small_phase, (9.0, 3.0), ASSUMED),
    Figure(
        FOLDER, "fig. 7", "Disconnection, cases i and ii",
        lambda bench, sheet: contours(sheet, [_case(bench, "i"), _case(bench, "ii")]), (9.0, 3.4), ASSUMED,
    ),
    Figure(
        FOLDER, "fig. 8", "Disconnection, case iii",
        lambda bench, sheet: contours(sheet, [_case(bench, "iii")]), (6.0, 3.4), ASSUMED,
    ),
    Figure(
        FOLDER, "fig. 9", "Disconnection, case iv",
        lambda bench, sheet: contours(sheet, [_case(bench, "iv"), ("drag that wanders", wandering(bench))]), (9.0, 3.4),
        ASSUMED + " The rig's contours lie about pi beside the authors' model; right what a wandering drag does.",
    ),
    Figure(
        FOLDER, "fig. 10", "Case i with damping that depends on speed",
        lambda bench, sheet: contours(sheet, [("case i, fig. 10", speed_dependent(bench)), _case(bench, "i")]),
        (9.0, 3.4), "Left as fig. 10, right as fig. 7 (a), for comparison.",
    ),
)  # fmt: skip
"""Figures 3 and 5 to 10."""
