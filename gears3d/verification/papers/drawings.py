"""The drawings of the papers' figures: each draws cases on an empty matplotlib figure."""

from __future__ import annotations

from collections.abc import Callable
from math import cos
from typing import Any

import numpy as np

from gears3d.verification.papers.bench import Case
from gears3d.verification.papers.figure import ACTIVE, LINE, PUBLISHED, REVERSE
from gears3d.verification.papers.measures import errors
from gears3d.verification.papers.measures.oil import SOFT, coastdown, lubricated_index
from gears3d.verification.papers.measures.responses import durations, impulses, resolved

DRAWINGS: dict[str, Callable[..., None]] = {}


def drawing(function: Callable[..., None]) -> Callable[..., None]:
    """Make a function available to figures by its name."""
    DRAWINGS[function.__name__] = function
    return function


@drawing
def rattle_indices(cases: list[Case], sheet: Any, panels: list[dict[str, Any]]) -> None:
    """Draw the rattle index over the values of one key of the scenario in each panel."""
    (base,) = cases
    for axes, panel in zip(sheet.subplots(2, 2).ravel(), panels, strict=True):
        index = [1e-6 * lubricated_index(base.with_({panel["key"]: value}), "rattle") for value in panel["values"]]
        axes.plot([float(value.split()[0]) for value in panel["values"]], index, "o-", color=LINE, ms=3, lw=0.9)
        axes.set(xlabel=panel["axis"], ylabel="RI [10⁶ N/(s kg m²)]", ylim=(0, None))


@drawing
def portraits(cases: list[Case], sheet: Any, titles: list[str]) -> None:
    """Draw rate over displacement along the normal, the last twenty periods."""
    for axes, title, case in zip(sheet.subplots(1, len(cases), squeeze=False)[0], titles, cases, strict=True):
        run, rig = case.run, case.rig
        later = run.time > run.time[-1] - 20.0 * case.scenario.period
        tilt = cos(rig.base_helix_angle)
        place = (0.5 * rig.backlash - run.signals["displacement_m"][later]) * tilt
        axes.plot(1e6 * place, -1e3 * tilt * run.signals["velocity_m_s"][later], color=LINE, lw=0.5)
        axes.set(title=title, xlabel="displacement [µm]")
    sheet.axes[0].set_ylabel("velocity [mm/s]")


@drawing
def impact_durations(cases: list[Case], sheet: Any, labels: list[str], printed: list[float]) -> None:
    """Draw the distribution of durations, and the printed mean and standard deviation as a normal one [ms]."""
    axes, (mean, deviation) = sheet.subplots(), printed
    bins = np.linspace(0.8, 1.6, 41)
    for case, colour, label in zip(cases, (LINE, ACTIVE), labels, strict=True):
        axes.hist(1e3 * durations(case, SOFT), bins=bins, density=True, color=colour, alpha=0.6, label=label)
    at = np.linspace(0.8, 1.6, 400)
    normal = np.exp(-0.5 * ((at - mean) / deviation) ** 2) / (deviation * np.sqrt(2 * np.pi))
    axes.plot(at, normal, color=PUBLISHED, label=f"printed: {mean} ± {deviation} ms")
    axes.set(xlabel="duration [ms]", ylabel="density [1/ms]")
    axes.legend()


@drawing
def coastdowns(cases: list[Case], sheet: Any, versions: list[str], temperatures: list[int]) -> None:
    """Draw speed over time for the assemblies, and the third assembly at several temperatures [°C]."""
    (case,) = cases
    left, right = sheet.subplots(1, 2, sharey=True)
    for version, label in enumerate(versions, 1):
        time, speed = coastdown(case, version)
        left.plot(time, speed * 30 / np.pi, label=label)
    for temperature in temperatures:
        time, speed = coastdown(case, 3, temperature)
        right.plot(time, speed * 30 / np.pi, label=f"{temperature} °C")
    left.set(xlabel="time [s]", ylabel="speed [rpm]", title="assembly versions")
    right.set(xlabel="time [s]", title="third version")
    left.legend()
    right.legend()


@drawing
def impulse_maps(cases: list[Case], sheet: Any, titles: list[str], run: str, published: float) -> None:
    """Draw dimensionless impulses over the excitation, and the published threshold."""
    for axes, title, case in zip(sheet.subplots(2, 2, sharex=True, sharey=True).ravel(), titles, cases, strict=True):
        for wanted in (round(0.2 + 0.2 * i, 1) for i in range(12)):
            hits = impulses(case, wanted, run)
            for sign, colour in ((1, ACTIVE), (-1, REVERSE)):
                mine = hits[np.sign(hits) == sign]
                axes.plot(np.full(len(mine), wanted), mine, ".", color=colour, ms=3)
        axes.axvline(published, color=PUBLISHED, ls="--", lw=0.9)
        axes.axhline(0.0, color=LINE, lw=0.5)
        axes.set(title=title, xlim=(0, 2.5))
    for axes in sheet.axes[2:]:
        axes.set_xlabel("excitation")
    for axes in sheet.axes[::2]:
        axes.set_ylabel("dimensionless impulse")


@drawing
def relative_velocities(cases: list[Case], sheet: Any, titles: list[str]) -> None:
    """Draw the relative velocity over time, 0.2 s from 1 s on."""
    for axes, case, title in zip(sheet.subplots(1, len(cases), squeeze=False)[0], cases, titles, strict=True):
        run = case.run
        shown = (run.time > 1.0) & (run.time < 1.2)
        axes.plot(1e3 * (run.time[shown] - 1.0), 1e3 * run.signals["velocity_m_s"][shown], color=LINE, lw=0.9)
        axes.set(title=title, xlabel="time [ms]", ylabel="relative velocity [mm/s]")


@drawing
def impulse_phases(cases: list[Case], sheet: Any, titles: list[str]) -> None:
    """Draw impulse over phase of the resolved impacts."""
    for axes, case, title in zip(sheet.subplots(1, len(cases), squeeze=False)[0], cases, titles, strict=True):
        hits = resolved(case)
        for flank, colour, label in ((0, ACTIVE, "active"), (1, REVERSE, "reverse")):
            mine = hits["flank"] == flank
            axes.plot(360 * hits["cycle"][mine], 1e3 * hits["impulse_N_s"][mine], ".", color=colour, label=label)
        axes.set(title=title, xlabel="phase [deg]", ylabel="impulse [mN s]", xlim=(0, 360))
        axes.legend()


@drawing
def error_synthesis(cases: list[Case], sheet: Any) -> None:
    """Draw one revolution of the error as the encoders read it, averaged over 25, and from its 21 strongest orders."""
    (case,) = cases
    angle = np.linspace(0.0, 2 * np.pi, 1000, endpoint=False)
    curves = (errors.encoders(case)[0], errors.averaged_error(case), errors.recreated(case).at(angle))
    titles = ("(a) one revolution", "(b) mean of 25", "(c) 21 orders")
    for axes, curve, title in zip(sheet.subplots(1, 3, sharey=True), curves, titles, strict=True):
        axes.plot(angle / (2 * np.pi), 1e3 * (curve - curve.mean()), color=LINE, lw=0.7)
        axes.set(title=title, xlabel="revolution")
    sheet.axes[0].set_ylabel("error [mrad]")


def dynamic_error(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Return time [s] and x = θ1 − θ2 − e [rad], β on the driving flank."""
    run, radius = case.run, case.rig.base_radius_loose
    flank = -radius * errors.true_error(case, run.signals["theta_drive_rad"])
    return run.time, errors.HALF_BACKLASH - (run.signals["displacement_m"] - flank) / radius


@drawing
def dynamic_errors(cases: list[Case], sheet: Any, titles: list[str]) -> None:
    """Draw the dynamic transmission error between both flanks, one panel a case."""
    panels = sheet.subplots(len(cases), 1, sharex=True, sharey=True)
    for axes, case, title in zip(panels, cases, titles, strict=True):
        time, x = dynamic_error(case)
        axes.plot(time, 1e3 * x, color=LINE, lw=1)
        axes.axhline(1e3 * errors.HALF_BACKLASH, color=ACTIVE, ls="--", lw=0.8)
        axes.axhline(-1e3 * errors.HALF_BACKLASH, color=REVERSE, ls="--", lw=0.8)
        axes.set(title=title, ylabel="x [mrad]")
    panels[-1].set_xlabel("revolutions")


@drawing
def dynamic_errors_together(cases: list[Case], sheet: Any, labels: list[str]) -> None:
    """Draw the dynamic transmission error of all cases in one panel, revolutions 1.5 to 3."""
    axes = sheet.subplots()
    for case, label, style in zip(cases, labels, ("-", "--", ":"), strict=True):
        time, x = dynamic_error(case)
        shown = (time >= 1.5) & (time <= 3.0)
        axes.plot(time[shown], 1e3 * x[shown], style, color=LINE, lw=1, label=label)
    axes.axhline(1e3 * errors.HALF_BACKLASH, color=ACTIVE, ls="--", lw=0.8)
    axes.set(xlabel="revolutions", ylabel="x [mrad]")
    axes.legend(loc="lower right")


@drawing
def contours(cases: list[Case], sheet: Any, panels: list[dict[str, Any]]) -> None:
    """Draw disconnections over phase and amplitude; a panel has ``title``, and ``set`` or ``drags`` for changes."""
    drawn = None
    for axes, case, panel in zip(sheet.subplots(1, len(panels), squeeze=False)[0], cases, panels, strict=True):
        found = errors.contour(case.with_(panel.get("set", {})), panel.get("drags", ""))
        levels = np.linspace(0.0, 2e3 * errors.HALF_BACKLASH, 9)
        drawn = axes.contourf(
            errors.PHASES, errors.AMPLITUDES, 1e3 * found, levels=levels, cmap="viridis", extend="max"
        )
        axes.set(
            title=panel["title"], xlabel="phase relative to the eccentricity [rad]", ylabel="drive amplitude [rad]"
        )
    sheet.colorbar(drawn, ax=sheet.axes, label="disconnection [mrad]")
