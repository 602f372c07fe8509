"""Figures 5, 6, 10, 11 and 12 of Rigaud & Perret-Liaudet 2020, drawn again.

Impact velocities are signed as in the paper: positive on the active, negative on the reverse flank.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.verification.papers.figure import ACTIVE, LINE, PUBLISHED, REVERSE
from gears3d.verification.papers.rigaud_2020.points import phases
from gears3d.verification.papers.rigaud_2020.regimes import FIG5, FIG6
from gears3d.verification.papers.rigaud_2020.theory import FIG10, FIG11, name

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.verification.papers.bench import Bench

SHOWN = 4
"""Periods of the excitation in a panel; 4/3 s without excitation."""
PUBLISHED_FIG5 = {20: (22.3, -19.9, 2.1)}
"""Printed mean impact velocities and their standard deviation [mm/s], by amplitude [rpm]."""
GREY = {0: "rigaud-2020/fig12-0rpm.toml", 1.6: name(1.6, 3)}
"""Shown in grey, by amplitude [rpm]: where the transmission error changes the response."""
ROWS12 = ((5, 1), (1.6, 3), (5, 3), (20, 3), (5, 5), (5, 10))


def amplitudes(bench: Bench, sheet: Any) -> None:
    """Draw figure 5: four amplitudes at 3 Hz; displacement, velocity and Poincaré section.

    Args:
        bench: of the papers.
        sheet: matplotlib figure.
    """
    runs = [(f"ΔΩ = {amplitude:g} rpm", bench.run(f"rigaud-2020/{each}.toml")) for amplitude, each in FIG5.items()]
    panels = _three_columns(sheet, runs, 35)
    for line, amplitude in zip(panels, FIG5, strict=True):
        if amplitude in GREY:
            _grey(bench, line, GREY[amplitude])
        if amplitude in PUBLISHED_FIG5:
            active, reverse, deviation = PUBLISHED_FIG5[amplitude]
            for speed in (active, reverse):
                line[2].axhspan(speed - deviation, speed + deviation, color=PUBLISHED, alpha=0.2, linewidth=0)
                line[2].axhline(speed, color=PUBLISHED, linewidth=1)
                line[2].text(0.02, speed, f"printed {speed:+.1f}", color=PUBLISHED, fontsize=7, va="bottom")


def frequencies(bench: Bench, sheet: Any) -> None:
    """Draw figure 6: four frequencies at 5 rpm.

    Args:
        bench: of the papers.
        sheet: matplotlib figure.
    """
    kept = {frequency: each for frequency, each in FIG6.items() if frequency >= 1}
    runs = [(f"{frequency:g} Hz", bench.run(f"rigaud-2020/{each}.toml")) for frequency, each in kept.items()]
    _three_columns(sheet, runs, 50)


def with_flanks(bench: Bench, sheet: Any) -> None:
    """Draw figure 12: the responses with the transmission error of eq. (21), relative to the flanks.

    Args:
        bench: of the papers.
        sheet: matplotlib figure.
    """
    panels = sheet.subplots(len(ROWS12), 2, width_ratios=(2.6, 1), squeeze=False)
    for line, place in zip(panels, ROWS12, strict=True):
        run = bench.run(name(*place))
        since, relative = _relative(bench, run, name(*place))
        line[0].plot(since, relative, color=LINE, linewidth=0.7)
        _frontiers(line[0], run)
        line[0].set(ylabel=f"{place[0]:g} rpm, {place[1]:g} Hz\n[µm]", xlim=(since[0], since[-1]))
        _section(line[1], run, 55)
    panels[0][0].set_title("displacement between the flanks", loc="left")
    panels[0][1].set_title("impact velocity [mm/s]", loc="left")
    panels[-1][0].set_xlabel("time [s]")
    panels[-1][1].set_xlabel("phase [cycles]")


def orbit(bench: Bench, sheet: Any) -> None:
    """Draw figure 10: displacements of the flanks and of the loose gear, and the Poincaré section.

    Args:
        bench: of the papers.
        sheet: matplotlib figure.
    """
    from gears3d.signals import flights

    run, scenario = bench.run(FIG10), bench.scenario(FIG10)
    time, window = _window(run, 2)
    rig = scenario.rig()
    swing = 1e6 * rig.base_radius_drive * (run.signals["theta_drive_rad"][window] - rig.mean_speed * run.time[window])
    swing -= swing.mean()
    left, right = sheet.subplots(1, 2, width_ratios=(1.6, 1))
    for flank, shift, colour in (("active", 0.0, ACTIVE), ("reverse", 1e6 * rig.backlash, REVERSE)):
        left.plot(time, swing + shift, "--", color=colour, linewidth=0.9, label=f"{flank} flank of the drive gear")
    path = swing + 1e6 * run.signals["displacement_m"][window]
    left.plot(time, path, color=LINE, linewidth=1.1, label="loose gear")
    hits = run.impacts
    found = flights(hits["time_s"], hits["flank"], run.meta["contacts"])
    start = run.time[window][0]
    for moments, colour in ((hits["time_s"], "black"), (found.start, "0.6")):
        inside = (moments >= start) & (moments <= start + time[-1])
        left.plot(moments[inside] - start, np.interp(moments[inside] - start, time, path), "o", color=colour, zorder=3)
    left.set(xlabel="time [s]", ylabel="displacement [µm]", xlim=(0, time[-1]))
    left.set_title("(a)", loc="left")
    left.set_ylim(top=left.get_ylim()[1] * 1.5)
    left.legend(loc="upper right", ncols=2, fontsize=8)
    settled = hits["time_s"] > run.meta["settle_s"]
    right.plot(phases(run, hits["time_s"][settled]), -1e3 * hits["velocity_m_s"][settled], "o", color="black")
    right.plot(phases(run, found.start), np.zeros(len(found.start)), "o", color="0.6")
    right.set(xlabel="phase [cycles]", ylabel="impact velocity [mm/s]", xlim=(0, 1), ylim=(-40, 40))
    right.set_title("(b)", loc="left")


def restitution(bench: Bench, sheet: Any) -> None:
    """Draw figure 11: restitution 0 (grey) and 0.3 (black).

    Args:
        bench: of the papers.
        sheet: matplotlib figure.
    """
    axes = sheet.subplots()
    for each, colour, width, words in ((FIG10, "0.65", 2.4, "e = 0"), (FIG11, "black", 0.9, "e = 0.3")):
        run = bench.run(each)
        since, window = _window(run, 2)
        axes.plot(since, 1e6 * run.signals["displacement_m"][window], color=colour, linewidth=width, label=words)
        _frontiers(axes, run)
    axes.set(xlabel="time [s]", ylabel="displacement between the flanks [µm]", xlim=(0, since[-1]))
    axes.legend(loc="upper right")


def _three_columns(sheet: Any, runs: list[tuple[str, Recording]], speed: float) -> Any:
    panels = sheet.subplots(len(runs), 3, width_ratios=(1.3, 1.3, 1), squeeze=False)
    for line, (words, run) in zip(panels, runs, strict=True):
        since, window = _window(run, SHOWN)
        line[0].plot(since, 1e6 * run.signals["displacement_m"][window], color=LINE, linewidth=0.8)
        _frontiers(line[0], run)
        line[1].plot(since, -1e3 * run.signals["velocity_m_s"][window], color=LINE, linewidth=0.8)
        line[0].set(ylabel=f"{words}\n[µm]", xlim=(0, since[-1]), ylim=(-40, 290))
        line[1].set(xlim=(0, since[-1]), ylim=(-speed * 1.5, speed * 1.5))
        _section(line[2], run, speed)
    panels[0][0].set_title("Rb(θ2 − θ1) [µm]", loc="left")
    panels[0][1].set_title("Rb(θ̇1 − θ̇2) [mm/s]", loc="left")
    panels[0][2].set_title("impact velocity [mm/s]", loc="left")
    for axes, words in zip(panels[-1], ("time [s]", "time [s]", "phase [cycles]"), strict=True):
        axes.set_xlabel(words)
    return panels


def _grey(bench: Bench, line: Any, scenario: str) -> None:
    run = bench.run(scenario)
    since, relative = _relative(bench, run, scenario)
    line[0].plot(since, relative, color="0.6", linewidth=0.8, zorder=1)
    line[1].plot(since, -1e3 * np.gradient(1e-6 * relative, since), color="0.6", linewidth=0.6, zorder=1)
    hits = run.impacts
    settled = (hits["time_s"] > run.meta["settle_s"]) & (hits["flight_height_m"] > 5e-8)
    line[2].plot(phases(run, hits["time_s"][settled]), -1e3 * hits["velocity_m_s"][settled], ".", color="0.6")


def _window(run: Recording, periods: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the time since the window's begin [s], and which samples are in it."""
    period = run.meta["period_s"] if run.meta["period_s"] < 1.5 else 1 / 3
    begin = np.ceil(run.meta["settle_s"] / period) * period
    inside = (run.time >= begin - 1e-9) & (run.time <= begin + periods * period)
    return run.time[inside] - run.time[inside][0], inside


def _relative(bench: Bench, run: Recording, scenario: str) -> tuple[np.ndarray, np.ndarray]:
    """Return time [s] and the distance from the active flank [µm]."""
    since, window = _window(run, SHOWN)
    angle = run.signals["theta_drive_rad"][window]
    flank = sum(e.amplitude * np.cos(e.order * angle + e.phase) for e in bench.scenario(scenario).effects)
    return since, 1e6 * (run.signals["displacement_m"][window] - flank)


def _frontiers(axes: Any, run: Recording) -> None:
    for place, colour in ((0.0, ACTIVE), (1e6 * run.meta["backlash_m"], REVERSE)):
        axes.axhline(place, color=colour, linestyle="--", linewidth=0.8, zorder=0)


def _section(axes: Any, run: Recording, speed: float) -> None:
    hits = run.impacts
    settled = (hits["time_s"] > run.meta["settle_s"]) & (hits["flight_height_m"] > 5e-8)
    for flank, colour in ((0, ACTIVE), (1, REVERSE)):
        mine = settled & (hits["flank"] == flank)
        axes.plot(phases(run, hits["time_s"][mine]), -1e3 * hits["velocity_m_s"][mine], ".", color=colour, markersize=4)
    axes.axhline(0, color="0.7", linewidth=0.6, zorder=0)
    axes.set(xlim=(0, 1), ylim=(-speed, speed))
