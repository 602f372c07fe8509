"""The drawings of the papers' figures: each draws cases on an empty matplotlib figure."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d import palette
from gears3d.laws.noise import WHINE_30_RPM, rattle_level, total_level
from gears3d.verification.papers.bench import Case
from gears3d.verification.papers.measures import tooth_errors
from gears3d.verification.papers.measures.geometry import rolled
from gears3d.verification.papers.measures.oil import SOFT, coastdown, lubricated_index
from gears3d.verification.papers.measures.responses import (
    FRAMES,
    best_pictures,
    decades,
    double_sided,
    durations,
    impulses,
    phases,
    pictured,
    resolved,
    threshold,
)

if TYPE_CHECKING:
    from gears3d.gears import Pair
    from gears3d.recording import Recording

# colours of the active flank, the reverse flank, the loose gear, and of what the paper printed
ACTIVE, REVERSE, LINE, PUBLISHED = palette.ACTIVE, palette.REVERSE, palette.INK, palette.EXTENDED
RPM = pi / 30
MARKERS = ("+", "o", "x", "*")
MEETING = 300.0  # ω²·ΔΩ at which rattle is as loud as whine [rad³/s³]: chosen, the paper prints no constant of eq. (26)
SHOWN = 4  # periods of the excitation in a panel; 4/3 s without excitation

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
    curves = (tooth_errors.encoders(case)[0], tooth_errors.averaged_error(case), tooth_errors.recreated(case).at(angle))
    titles = ("(a) one revolution", "(b) mean of 25", "(c) 21 orders")
    for axes, curve, title in zip(sheet.subplots(1, 3, sharey=True), curves, titles, strict=True):
        axes.plot(angle / (2 * np.pi), 1e3 * (curve - curve.mean()), color=LINE, lw=0.7)
        axes.set(title=title, xlabel="revolution")
    sheet.axes[0].set_ylabel("error [mrad]")


def dynamic_error(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Return time [s] and x = θ1 − θ2 − e [rad], β on the driving flank."""
    run, radius = case.run, case.rig.base_radius_loose
    flank = -radius * tooth_errors.true_error(case, run.signals["theta_drive_rad"])
    return run.time, tooth_errors.HALF_BACKLASH - (run.signals["displacement_m"] - flank) / radius


@drawing
def dynamic_errors(cases: list[Case], sheet: Any, titles: list[str]) -> None:
    """Draw the dynamic transmission error between both flanks, one panel a case."""
    panels = sheet.subplots(len(cases), 1, sharex=True, sharey=True)
    for axes, case, title in zip(panels, cases, titles, strict=True):
        time, x = dynamic_error(case)
        axes.plot(time, 1e3 * x, color=LINE, lw=1)
        axes.axhline(1e3 * tooth_errors.HALF_BACKLASH, color=ACTIVE, ls="--", lw=0.8)
        axes.axhline(-1e3 * tooth_errors.HALF_BACKLASH, color=REVERSE, ls="--", lw=0.8)
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
    axes.axhline(1e3 * tooth_errors.HALF_BACKLASH, color=ACTIVE, ls="--", lw=0.8)
    axes.set(xlabel="revolutions", ylabel="x [mrad]")
    axes.legend(loc="lower right")


@drawing
def contours(cases: list[Case], sheet: Any, panels: list[dict[str, Any]]) -> None:
    """Draw disconnections over phase and amplitude; a panel has ``title``, and ``set`` or ``drags`` for changes."""
    drawn = None
    for axes, case, panel in zip(sheet.subplots(1, len(panels), squeeze=False)[0], cases, panels, strict=True):
        found = tooth_errors.contour(case.with_(panel.get("set", {})), panel.get("drags", ""))
        levels = np.linspace(0.0, 2e3 * tooth_errors.HALF_BACKLASH, 9)
        drawn = axes.contourf(
            tooth_errors.PHASES, tooth_errors.AMPLITUDES, 1e3 * found, levels=levels, cmap="viridis", extend="max"
        )
        axes.set(
            title=panel["title"], xlabel="phase relative to the eccentricity [rad]", ylabel="drive amplitude [rad]"
        )
    sheet.colorbar(drawn, ax=sheet.axes, label="disconnection [mrad]")


@drawing
def transmission_errors(cases: list[Case], sheet: Any, backlash: float, printed: dict[str, float]) -> None:
    """Draw both transmission errors over a revolution and their spectra, and what is printed [µm]."""
    (case,) = cases
    found = rolled(case)
    time, spectrum = sheet.subplots(1, 2, width_ratios=(1.3, 1))
    angle = np.degrees(found.theta)
    curves = (found.phi_active, found.phi_active + found.backlash)
    for path, colour, name in zip(curves, (ACTIVE, REVERSE), ("active flanks", "reverse flanks"), strict=True):
        time.plot(angle, 1e6 * path, color=colour, linewidth=0.7, label=name)
        amplitude = 2 * np.abs(np.fft.rfft(path - path.mean())) / len(path)
        spectrum.vlines(np.arange(201), 0, 1e6 * amplitude[:201], color=colour, linewidth=1.6)
    time.annotate("", (20, backlash + 50), (20, 50), arrowprops={"arrowstyle": "<->", "color": PUBLISHED})
    time.text(25, 150, f"printed backlash {backlash:g} µm", color=PUBLISHED)
    time.set(xlabel="angle of the drive gear [deg]", ylabel="transmission error [µm]", xlim=(0, 360))
    time.legend(loc="center right")
    for level in printed.values():
        spectrum.axhline(level, color=PUBLISHED, linestyle=":", linewidth=1)
    for text, level in printed.items():
        spectrum.text(198, level * (1.03 if level > 10 else 1.08), text, ha="right", va="bottom", color=PUBLISHED)
    spectrum.set(
        xlabel="order of the revolution", ylabel="amplitude [µm]", xlim=(0, 200), yscale="log", ylim=(0.1, 100)
    )


def _swept(cases: list[Case], amplitudes: list[list[float]]) -> list[tuple[Case, int, str, list[float]]]:
    """Return each case with its mean speed [rpm], the marker of its drag torque, and the amplitudes [rpm]."""
    torques = sorted({case.rig.drag_torque for case in cases})
    means = sorted({round(case.scenario.motion.mean / RPM) for case in cases})
    found = []
    for case in sorted(cases, key=lambda each: each.scenario.motion.mean):
        mean = round(case.scenario.motion.mean / RPM)
        found.append((case, mean, MARKERS[torques.index(case.rig.drag_torque)], amplitudes[means.index(mean)]))
    return found


def _hollow(marker: str) -> dict[str, Any]:
    return {"markerfacecolor": "none"} if marker == "o" else {}


@drawing
def thresholds(cases: list[Case], sheet: Any, amplitudes: list[list[float]], published: float) -> None:
    """Draw the frequency at which rattle begins over the amplitude, one panel a mean speed, and the published Λ*."""
    each = _swept(cases, amplitudes)
    means = list(dict.fromkeys(mean for _, mean, _, _ in each))
    panels = dict(zip(means, sheet.subplots(1, len(means), sharex=True, sharey=True), strict=True))
    line = np.array([0.05, 5.0])
    for case, mean, marker, swept in each:
        axes, torque = panels[mean], case.rig.drag_torque
        found = [2 * pi * threshold(case, amplitude) for amplitude in swept]
        axes.loglog(RPM * np.array(swept), found, marker, color=LINE, label=f"{torque} N·m, ours", **_hollow(marker))
        words = f"printed Λ* = {published}" if marker == MARKERS[2] else None
        level = published * torque / case.rig.inertia / line
        axes.loglog(line, level, color=PUBLISHED, linewidth=0.9, zorder=1, label=words)
    for (mean, axes), letter in zip(panels.items(), "ab", strict=True):
        axes.set_title(f"({letter}) Ω0 = {mean} rpm", loc="left")
        axes.set(xlabel="ΔΩ [rad/s]", xlim=(0.04, 7), ylim=(0.3, 400))
        axes.grid(which="both", linewidth=0.3)
    panels[means[0]].set_ylabel("ω [rad/s]")
    panels[means[0]].legend(loc="lower left")


@drawing
def master_curve(cases: list[Case], sheet: Any, amplitudes: list[list[float]], published: list[float]) -> None:
    """Draw all thresholds on one line, and the published mean and standard deviation of Λ*."""
    axes, inertia, (level, deviation) = sheet.subplots(), cases[0].rig.inertia, published
    ratio = np.array([0.05, 40.0])
    axes.fill_between(
        ratio, (level - deviation) / inertia / ratio, (level + deviation) / inertia / ratio, color=PUBLISHED,
        alpha=0.18, linewidth=0, label=f"printed Λ* = {level} ± {deviation}",
    )  # fmt: skip
    axes.loglog(ratio, level / inertia / ratio, color=PUBLISHED, linewidth=1)
    axes.loglog(ratio, 1 / inertia / ratio, color=LINE, linewidth=1.2, label="theory, Λ* = 1")
    each = _swept(cases, amplitudes)
    for case, mean, marker, swept in each:
        found = [2 * pi * threshold(case, amplitude) for amplitude in swept]
        colour, size = (ACTIVE, 9) if mean == each[0][1] else (REVERSE, 5)
        speed = RPM * np.array(swept) / case.rig.drag_torque
        axes.loglog(speed, found, marker, color=colour, markersize=size, **_hollow(marker))
    for torque, marker in sorted({(case.rig.drag_torque, marker) for case, _, marker, _ in each}):
        label = f"{torque} N·m (large {each[0][1]}, small {each[-1][1]} rpm)"
        axes.plot([], [], marker, color=LINE, markerfacecolor="none", label=label)
    axes.set(xlabel="ΔΩ/Td [rad/(s N m)]", ylabel="ω [rad/s]", xlim=(0.05, 40), ylim=(0.3, 300))
    axes.grid(which="both", linewidth=0.3)
    axes.legend(loc="lower left")


@drawing
def squared_velocities(cases: list[Case], sheet: Any, at: list[float], published: list[float], scatter: float) -> None:
    """Draw mean squared impact velocity over ω·ΔΩ, and the published means [mm/s] at an amplitude [rpm] and Hz."""
    axes, chosen = sheet.subplots(), double_sided(cases)
    harmonics = [case.scenario.motion.harmonics[0] for case in chosen]
    product = np.array([2 * pi * each.frequency * each.amplitude for each in harmonics])
    for flank, colour, marker in (("active", ACTIVE, "o"), ("reverse", REVERSE, "s")):
        squares = [1e6 * case.outcome[f"{flank}_velocity_mean_square_m2_s2"] for case in chosen]
        axes.loglog(product, squares, marker, color=colour, markerfacecolor="none", label=f"ours, {flank} flank")
    line, place = np.array([3.0, 140.0]), 2 * pi * at[1] * RPM * at[0]
    axes.loglog(line, published[0] ** 2 * line / place, color=PUBLISHED, linewidth=1,
                label="printed slope, 10 dB per decade")  # fmt: skip
    for speed, marker in zip(published, ("o", "s"), strict=True):
        bar = [[speed**2 * (1 - (1 - scatter) ** 2)], [speed**2 * ((1 + scatter) ** 2 - 1)]]
        axes.errorbar([place], [speed**2], yerr=bar, fmt=marker, color=PUBLISHED, capsize=3)
    axes.plot([], [], "o", color=PUBLISHED, label=f"printed means at {at[0]:g} rpm, {at[1]:g} Hz")
    axes.set(xlabel="ω·ΔΩ [rad/s²]", ylabel="mean squared impact velocity [mm²/s²]", xlim=(3, 140))
    axes.grid(which="both", linewidth=0.3)
    axes.legend(loc="lower right")


@drawing
def sound_levels(cases: list[Case], sheet: Any) -> None:
    """Draw the sound pressure level over ω²·ΔΩ: whine and the energy of the impacts, with eqs (22), (26), (27)."""
    axes = sheet.subplots()
    abscissa, power = decades(cases, "energy_J_s", 2)
    scale = (2 * pi) ** 2 * RPM
    offset = WHINE_30_RPM - float(np.mean(power - 10 * abscissa)) - 10 * np.log10(MEETING / scale)
    product = np.logspace(0.5, 4.2, 100)
    rattle = rattle_level(np.sqrt(product), 1.0, 10 ** (WHINE_30_RPM / 10) / MEETING)
    axes.axhline(WHINE_30_RPM, color=PUBLISHED, linestyle="--", linewidth=1, label="whine, printed 78 dB, eq. (22)")
    axes.semilogx(product, rattle, color=PUBLISHED, linestyle=":", linewidth=1.2, label="rattle, eq. (26)")
    axes.semilogx(product, total_level(WHINE_30_RPM, rattle), color=PUBLISHED, linewidth=1.2, label="total, eq. (27)")
    amplitudes = sorted({case.scenario.motion.harmonics[0].amplitude for case in cases})
    for amplitude, marker in zip(amplitudes, ("o", "+", "x", "*"), strict=True):
        mine = [case for case in cases if case.scenario.motion.harmonics[0].amplitude == amplitude]
        levels = total_level(
            WHINE_30_RPM, [10 * np.log10(max(case.outcome["energy_J_s"], 1e-30)) + offset for case in mine]
        )
        where = [scale * case.scenario.motion.harmonics[0].frequency ** 2 * amplitude / RPM for case in mine]
        label = f"ours, {amplitude / RPM:g} rpm"
        axes.semilogx(where, levels, marker, color=LINE, markerfacecolor="none", label=label)
    axes.set(xlabel="ω²·ΔΩ [rad³/s³]", ylabel="sound pressure level [dB]", ylim=(74, 102))
    axes.grid(which="both", linewidth=0.3)
    axes.legend(loc="upper left")


# Impact velocities are signed as in the paper from here on: positive on the active, negative on the reverse flank.


def _window(run: Recording, periods: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the time since the begin of the window [s], and which samples are in it."""
    period = run.meta["period_s"] if run.meta["period_s"] < 1.5 else 1 / 3
    begin = np.ceil(run.meta["settle_s"] / period) * period
    inside = (run.time >= begin - 1e-9) & (run.time <= begin + periods * period)
    return run.time[inside] - run.time[inside][0], inside


def _relative(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """Return time [s] and the distance from the active flank [µm]."""
    run = case.run
    since, window = _window(run, SHOWN)
    angle = run.signals["theta_drive_rad"][window]
    flank = sum(e.amplitude * np.cos(e.order * angle + e.phase) for e in case.scenario.effects)
    return since, 1e6 * (run.signals["displacement_m"][window] - flank)


def _flanks(axes: Any, run: Recording) -> None:
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


def _grey(case: Case, line: Any) -> None:
    run = case.run
    since, relative = _relative(case)
    line[0].plot(since, relative, color="0.6", linewidth=0.8, zorder=1)
    line[1].plot(since, -1e3 * np.gradient(1e-6 * relative, since), color="0.6", linewidth=0.6, zorder=1)
    hits = run.impacts
    settled = (hits["time_s"] > run.meta["settle_s"]) & (hits["flight_height_m"] > 5e-8)
    line[2].plot(phases(run, hits["time_s"][settled]), -1e3 * hits["velocity_m_s"][settled], ".", color="0.6")


@drawing
def responses(
    cases: list[Case],
    sheet: Any,
    labels: list[str],
    speed: float,
    grey: list[str] | None = None,
    published: list[list[float]] | None = None,
) -> None:
    """Draw displacement, velocity and Poincaré section, one line a case; another scenario in grey where one is named.

    ``published`` has mean impact velocities and their standard deviation [mm/s] for each case, or nothing.
    """
    panels = sheet.subplots(len(cases), 3, width_ratios=(1.3, 1.3, 1), squeeze=False)
    for line, label, case in zip(panels, labels, cases, strict=True):
        run = case.run
        since, window = _window(run, SHOWN)
        line[0].plot(since, 1e6 * run.signals["displacement_m"][window], color=LINE, linewidth=0.8)
        _flanks(line[0], run)
        line[1].plot(since, -1e3 * run.signals["velocity_m_s"][window], color=LINE, linewidth=0.8)
        line[0].set(ylabel=f"{label}\n[µm]", xlim=(0, since[-1]), ylim=(-40, 290))
        line[1].set(xlim=(0, since[-1]), ylim=(-speed * 1.5, speed * 1.5))
        _section(line[2], run, speed)
    panels[0][0].set_title("Rb(θ2 − θ1) [µm]", loc="left")
    panels[0][1].set_title("Rb(θ̇1 − θ̇2) [mm/s]", loc="left")
    panels[0][2].set_title("impact velocity [mm/s]", loc="left")
    for axes, label in zip(panels[-1], ("time [s]", "time [s]", "phase [cycles]"), strict=True):
        axes.set_xlabel(label)
    for line, name in zip(panels, grey or [], strict=False):
        if name:
            _grey(cases[0].bench.case(name), line)
    for line, means in zip(panels, published or [], strict=False):
        for velocity in means[:-1]:
            line[2].axhspan(velocity - means[-1], velocity + means[-1], color=PUBLISHED, alpha=0.2, linewidth=0)
            line[2].axhline(velocity, color=PUBLISHED, linewidth=1)
            line[2].text(0.02, velocity, f"printed {velocity:+.1f}", color=PUBLISHED, fontsize=7, va="bottom")


@drawing
def relative_responses(cases: list[Case], sheet: Any, labels: list[str]) -> None:
    """Draw the displacement relative to the flanks and the Poincaré section, one line a case."""
    panels = sheet.subplots(len(cases), 2, width_ratios=(2.6, 1), squeeze=False)
    for line, case, label in zip(panels, cases, labels, strict=True):
        since, relative = _relative(case)
        line[0].plot(since, relative, color=LINE, linewidth=0.7)
        _flanks(line[0], case.run)
        line[0].set(ylabel=f"{label}\n[µm]", xlim=(since[0], since[-1]))
        _section(line[1], case.run, 55)
    panels[0][0].set_title("displacement between the flanks", loc="left")
    panels[0][1].set_title("impact velocity [mm/s]", loc="left")
    panels[-1][0].set_xlabel("time [s]")
    panels[-1][1].set_xlabel("phase [cycles]")


@drawing
def orbit(cases: list[Case], sheet: Any) -> None:
    """Draw displacements of the flanks and of the loose gear over two periods, and the Poincaré section."""
    from gears3d.signals import flights

    (case,) = cases
    run, rig = case.run, case.rig
    time, window = _window(run, 2)
    drive = 1e6 * rig.base_radius_drive * (run.signals["theta_drive_rad"][window] - rig.mean_speed * run.time[window])
    drive -= drive.mean()
    left, right = sheet.subplots(1, 2, width_ratios=(1.6, 1))
    for flank, shift, colour in (("active", 0.0, ACTIVE), ("reverse", 1e6 * rig.backlash, REVERSE)):
        left.plot(time, drive + shift, "--", color=colour, linewidth=0.9, label=f"{flank} flank of the drive gear")
    path = drive + 1e6 * run.signals["displacement_m"][window]
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


@drawing
def displacements_together(cases: list[Case], sheet: Any, labels: list[str]) -> None:
    """Draw the displacements of two cases over two periods, the first in grey."""
    axes = sheet.subplots()
    for case, colour, width, label in zip(cases, ("0.65", "black"), (2.4, 0.9), labels, strict=True):
        since, window = _window(case.run, 2)
        path = 1e6 * case.run.signals["displacement_m"][window]
        axes.plot(since, path, color=colour, linewidth=width, label=label)
        _flanks(axes, case.run)
        axes.set_xlim(0, since[-1])
    axes.set(xlabel="time [s]", ylabel="displacement between the flanks [µm]")
    axes.legend(loc="upper right")


@drawing
def pictures(cases: list[Case], sheet: Any, pairs: list[str]) -> None:
    """Draw nine sections of the mesh in a period, the drive gear on the right, with the printed tooth pairs."""
    (case,) = cases
    _, backlash, origin = best_pictures(case)
    case = case.with_({"mount.backlash": f"{backlash} um"})
    scenario, run = case.scenario, case.run
    shown, colours = pictured(case, origin), {"active": ACTIVE, "reverse": REVERSE, "flight": "0.45"}
    times = (4 + origin + np.arange(9) / 8) * scenario.period
    drive = np.interp(times, run.time, run.signals["theta_drive_rad"])
    path = np.interp(times, run.time, run.signals["displacement_m"])
    eighths, reach = ("0", "T/8", "T/4", "3T/8", "T/2", "5T/8", "3T/4", "7T/8", "T"), 7e-3
    for frame, axes in enumerate(sheet.subplots(3, 3).ravel()):
        _teeth(axes, scenario.pair(), float(drive[frame]), float(path[frame]), reach)
        number = 1 + (drive[frame] - drive[0]) * scenario.gears.drive.teeth / (2 * np.pi)
        agrees = shown[frame] == FRAMES[frame]
        axes.set_title(f"t = {eighths[frame]}: {shown[frame]} ({number:.1f})", color=colours[shown[frame]], loc="left")
        printed = f"printed: {FRAMES[frame]} ({pairs[frame]})"
        axes.set_xlabel(printed, color=PUBLISHED if agrees else "#b3261e", fontsize=9)
        axes.set(xticks=[], yticks=[], aspect="equal", xlim=(-reach, reach), ylim=(-reach * 0.8, reach * 0.8))
        axes.spines[["top", "right"]].set_visible(True)


def _teeth(axes: Any, pair: Pair, theta: float, displacement: float, reach: float) -> None:
    """Draw both gears around the pitch point, rotated by half a revolution: the drive gear is on the right."""
    from matplotlib.patches import Circle

    from gears3d.gears.outline import outline

    loose = (pair.drive.base_radius * theta + displacement) / pair.loose.base_radius
    pitch = np.array([pair.centre_distance * pair.drive.teeth / (pair.drive.teeth + pair.loose.teeth), 0.0])
    for which, angle, face in (("drive", theta, "#C9D6E3"), ("loose", loose, "#E6E0D4")):
        rotation = pair.rotation(which, angle)
        c, s = cos(rotation), sin(rotation)
        centre = np.array(pair.centre(which)[:2]) - pitch
        points = -(outline(pair, which, chord=5e-6).points @ np.array([[c, s], [-s, c]]) + centre)
        axes.add_patch(Circle((-centre[0], -centre[1]), pair.gear(which).root_radius, color=face, linewidth=0))
        for tooth in (each for each in points if np.hypot(*each.mean(axis=0)) < 3 * reach):
            axes.fill(*tooth.T, facecolor=face, edgecolor="none")
            axes.plot(*tooth.T, color="#333333", linewidth=0.7)
