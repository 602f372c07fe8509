"""Pictures of results, as ``plot`` and ``--plot`` give them: recordings, records, regimes, verdicts, diagnoses."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d import palette, signals
from gears3d.laws.orbit import border, regions
from gears3d.palette import FLANKS as COLOURS
from gears3d.recording import FLANKS, Recording
from gears3d.recording.record import describe, spectra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gears3d.comparison import ModelVerdict
    from gears3d.diagnosis import Diagnosis, MeasurementPlan
    from gears3d.measured.segmentation import Measurement, Segments
    from gears3d.simulation.excitation import Assessment

PERIODS_SHOWN = 3.0  # Of the fluctuation, at the end: single impacts stay visible


def recording_picture(recording: Recording) -> Figure:
    """Draw a recording after settling: path, both Poincaré sections, return map, spectra."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 6.8), layout="constrained")
    FigureCanvasAgg(figure)
    path, strobe, hits, returns, frequency, order = figure.subplots(2, 3).ravel()
    start, end = signals.window(recording.signals, recording.meta)
    period = float(recording.meta.get("period_s") or 0.0)
    some = signals.counted(recording.impacts, start, end)
    _recorded_path(path, recording, max(start, end - PERIODS_SHOWN * period) if period else start, end)
    _strobe(strobe, recording, period, start, end)
    _section(hits, some)
    _returns(returns, some)
    found = spectra(recording)
    _spectrum(frequency, {"displacement": found["frequency"]}, "frequency [Hz]")
    _spectrum(order, {gear: found[f"order_{gear}"] for gear in ("drive", "loose")}, "order of the gear")
    for axes in figure.axes:
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=8)
    told = describe(recording)
    words = [str(told[key]).replace("_", " ") for key in ("regime", "motion") if told[key]]
    title = str(recording.meta.get("title") or "")
    figure.suptitle("\n".join(part for part in (title, ", ".join(words)) if part), fontsize=11, x=0.01, ha="left")
    return figure


def _recorded_path(axes: Axes, recording: Recording, begin: float, end: float) -> None:
    axes.set(xlabel="time [s]", ylabel="displacement [µm]")
    part = recording.between(begin, end)
    if "displacement_m" not in part.signals or not len(part.time):
        return _nothing(axes, "no displacement")
    axes.plot(part.time, 1e6 * part.signals["displacement_m"], color="black", linewidth=0.9)
    for code, name in enumerate(FLANKS):
        mine = part.impacts["flank"] == code
        at = part.impacts["time_s"][mine]
        place = 1e6 * np.interp(at, part.time, part.signals["displacement_m"])
        axes.plot(at, place, "os"[code], color=COLOURS[code], markersize=4, label=f"impact, {name} flank")
    axes.legend(fontsize=7, frameon=False, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.0))


def _strobe(axes: Axes, recording: Recording, period: float, start: float, end: float) -> None:
    axes.set(xlabel="displacement [µm]", ylabel="velocity [mm/s]")
    if not period or not {"displacement_m", "velocity_m_s"} <= recording.signals.keys():
        return _nothing(axes, "no period or no velocity")
    phase = signals.widest_phase(recording.signals, recording.impacts, period, start, end)
    points = signals.stroboscope(recording.signals, recording.impacts, period, phase, start, end)
    axes.plot(1e6 * points[:, 0], 1e3 * points[:, 1], ".", color="black", markersize=4)
    whole = recording.between(start, end).signals
    for limit, values in ((axes.set_xlim, 1e6 * whole["displacement_m"]), (axes.set_ylim, 1e3 * whole["velocity_m_s"])):
        margin = 0.05 * float(np.ptp(values)) or 1.0
        limit(float(values.min()) - margin, float(values.max()) + margin)
    axes.set_title(f"once per period, {phase:.2f} of it after t = 0", fontsize=9)


def _section(axes: Axes, some: dict[str, np.ndarray]) -> None:
    axes.set(xlabel="phase of the fluctuation [°]", ylabel="impact velocity [mm/s]", xlim=(0, 360))
    axes.set_title("at the impacts", fontsize=9)
    phase = np.degrees(np.mod(some.get("phase_rad", np.full(len(some["time_s"]), np.nan)), 2 * np.pi))
    for code, name in enumerate(FLANKS):
        mine = some["flank"] == code
        axes.plot(phase[mine], 1e3 * some["velocity_m_s"][mine], ".", color=COLOURS[code], markersize=4, label=name)
    axes.legend(fontsize=7, frameon=False)


def _returns(axes: Axes, some: dict[str, np.ndarray]) -> None:
    axes.set(xlabel="impact speed [mm/s]", ylabel="next on that flank [mm/s]")
    axes.set_title("return map", fontsize=9)
    for code, name in enumerate(FLANKS):
        pairs = 1e3 * signals.return_map(np.abs(some["velocity_m_s"][some["flank"] == code]))
        axes.plot(pairs[:, 0], pairs[:, 1], ".", color=COLOURS[code], markersize=4, label=name)


def _spectrum(axes: Axes, found: dict[str, signals.Spectrum | None], label: str) -> None:
    axes.set(xlabel=label, ylabel="displacement, amplitude [µm]")
    shown = {name: one for name, one in found.items() if one is not None and float(one.amplitude[1:].max()) > 0.0}
    if not shown:
        return _nothing(axes, "no spectrum")
    for code, (name, one) in enumerate(shown.items()):
        high = 1e6 * one.amplitude[1:]
        axes.loglog(one.at[1:], high, color=COLOURS[code], linewidth=0.8, alpha=0.85, label=name)
    top = max(1e6 * float(one.amplitude[1:].max()) for one in shown.values())
    axes.set_ylim(1e-6 * top, 2.0 * top)
    if len(shown) > 1:
        axes.legend(fontsize=7, frameon=False)
    return None


# Flights in the left picture.
SHOWN = 20
# Readings drawn at most.
POINTS = 8000
STATES = ((0, COLOURS[0], "active contact"), (1, COLOURS[1], "reverse contact"), (2, palette.SOFT, "flight"))


def measurement_picture(found: Measurement) -> Figure:
    """Draw displacement, flanks and labels over some flights, and the highest of them close up."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 4.6), layout="constrained")
    FigureCanvasAgg(figure)
    wide, close = figure.subplots(1, 2, width_ratios=(2, 1))
    cut = found.segments
    start, end = cut.flights["start_s"], cut.flights["end_s"]
    count = len(start)
    if not count:
        _measured_path(wide, cut, float(cut.path.time[0]), float(cut.path.time[-1]))
        close.set_axis_off()
    else:
        first = max(count // 2 - SHOWN // 2, 0)
        last = min(first + SHOWN, count) - 1
        _measured_path(wide, cut, float(start[first]), float(end[last]))
        one = first + int(np.argmax(cut.flights["height_m"][first : last + 1]))
        margin = 0.25 * float(end[one] - start[one])
        _measured_path(close, cut, float(start[one]) - margin, float(end[one]) + margin)
        close.set_title(f"one flight, chi-square {cut.flights['chi2'][one]:.2g} per degree of freedom", fontsize=9)
    wide.legend(fontsize=8, frameon=False, ncols=5, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


def _measured_path(axes: Axes, cut: Segments, begin: float, end: float) -> None:
    known, shift = cut.track, cut.flanks.active[0]
    some = np.flatnonzero((known.time >= begin) & (known.time <= end))
    some = some[:: max(len(some) // POINTS, 1)]
    time, state = known.time[some], cut.states(known.time[some])
    drive, loose, place = known.part(some)
    for code, colour, name in STATES:
        mine = state == code
        axes.plot(time[mine], 1e6 * (place[mine] - shift), ".", color=colour, markersize=2, label=name)
    low, high = cut.flanks.places(time, drive, loose)
    axes.plot(time, 1e6 * (low - shift), color=COLOURS[0], linewidth=0.8)
    if np.isfinite(high).all():
        axes.plot(time, 1e6 * (high - shift), color=COLOURS[1], linewidth=0.8)
    hits = cut.impacts["time_s"]
    for hit in hits[(hits >= begin) & (hits <= end)]:
        axes.axvline(hit, color="#bbbbbb", linewidth=0.6, zorder=0)
    axes.set(xlabel="time [s]", ylabel="displacement [µm]")
    axes.spines[["top", "right"]].set_visible(False)


REGIMES = ("contact", "single-sided", "double-sided", "no plastic orbit")


def regime_map(found: Assessment, title: str = "") -> Figure:
    """Return the map of regimes for e = 0: contact, single-sided and double-sided, with the operating point.

    Source: borders by Rigaud & Perret-Liaudet 2020, eqs (7), (17)-(19); axes by Kadmiri et al. 2012, eqs (23), (24).
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    point = operating_point(found)
    wide, tall = span(point)
    figure = Figure(figsize=(7.5, 5.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    codes = regions(wide, tall)
    norm = BoundaryNorm(np.arange(-0.5, 4.0), 4)
    axes.pcolormesh(
        wide, tall, codes.T, cmap=ListedColormap(palette.REGIMES), norm=norm, shading="nearest", rasterized=True
    )
    above = wide[wide > 1.0]
    axes.plot(above, border(above), color="black", lw=1.2)
    axes.axvline(1.0, color="black", lw=1.2)
    handles = [Patch(color=colour, label=name) for colour, name in zip(palette.REGIMES, REGIMES, strict=True)]
    if point is not None:
        label = f"Λ = {point[0]:.3g}, j/H = {point[1]:.3g}"
        handles += axes.plot(*point, "o", color=palette.REVERSE, mec="black", ms=9, label=label)
    axes.set(xscale="log", yscale="log", xlim=(wide[0], wide[-1]), ylim=(tall[0], tall[-1]))
    axes.set_xlabel("excitation Λ")
    axes.set_ylabel("dimensionless backlash j/H")
    axes.set_title(f"{title}\nregimes of perfectly plastic impacts (e = 0)".strip(), fontsize=10, loc="left")
    axes.legend(handles=handles, fontsize=8, loc="lower left", framealpha=0.9)
    return figure


def plan_picture(found: MeasurementPlan) -> Figure:
    """Return what runs come to over their number: sizes that show, and standard deviations between sets."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    aims = [one for option in found.options for one in option.aims if one.possible]
    kinds = [pair for pair in (False, True) if any((" or " in one.name) == pair for one in aims)]
    figure = Figure(figsize=(7.5, 3.6 * max(len(kinds), 1)), layout="constrained")
    FigureCanvasAgg(figure)
    marks = "os^Dv"
    for place, pair in enumerate(kinds, 1):
        axes = figure.add_subplot(len(kinds), 1, place)
        scale = 1.0 if pair else 100.0
        for number, option in enumerate(found.options):
            for one in option.aims:
                if one.possible and (" or " in one.name) == pair:
                    values = [scale * run.reaches[one.name] for run in option.runs]
                    label = one.name if len(found.options) == 1 else f"{one.name}, {option.encoder}"
                    line = "-" if len(values) > 1 else ""
                    mark = marks[number % len(marks)]
                    axes.plot(range(1, len(values) + 1), values, marker=mark, linestyle=line, label=label)
        asked = next(one.asked for one in aims if (" or " in one.name) == pair)
        axes.axhline(scale * asked, color="black", lw=1.0, ls="--", label="asked for")
        most = max(len(option.runs) for option in found.options)
        axes.set(yscale="log", xlabel="runs", xlim=(0.5, most + 0.5))
        axes.set_xticks(range(1, most + 1))
        axes.set_ylabel("separation, sigma" if pair else "size seen at 5 sigma, %")
        axes.legend(fontsize=8)
    return figure


def operating_point(found: Assessment) -> tuple[float, float] | None:
    """Return Λ and j/H of the strongest harmonic; ``None`` without a harmonic or without drag."""
    finite = [
        (wave.excitation, wave.backlash_dimensionless)
        for wave in found.harmonics
        if isfinite(wave.excitation) and isfinite(wave.backlash_dimensionless) and wave.excitation > 0.0
    ]
    return max(finite, default=None)


def span(point: tuple[float, float] | None, columns: int = 160, rows: int = 320) -> tuple[np.ndarray, np.ndarray]:
    """Return Λ and j/H of the map, equally spaced in logarithm, wide enough for the operating point.

    >>> wide, tall = span((0.05, 2.0))
    >>> bool(wide[0] < 0.05), bool(tall[-1] > 2.0)
    (True, True)
    """
    size, gap = point or (1.0, 0.1)
    wide = np.geomspace(min(0.3, size / 2), max(30.0, 2 * size), columns)
    tall = np.geomspace(min(1e-3, gap / 2), max(10.0, 2 * gap), rows)
    return wide, tall


# Times its tolerance from which and up to which a difference is drawn where it is.
LEAST_SHOWN, MOST_SHOWN = 1e-3, 100.0


def verdict_picture(found: ModelVerdict) -> Figure:
    """Draw the displacement of a user's model and of the rigid model, and the differences over their tolerances."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 4.6), layout="constrained")
    path, bars = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    lasts = PERIODS_SHOWN * float(found.tested.meta.get("period_s") or found.tested.time[-1] / 4.0)
    for one, name, colour, wide in (
        (found.reference, "rigid model", "#bbbbbb", 3.5),
        (found.tested, "model", palette.ACTIVE, 1.0),
    ):
        shown = one.between(0.0, float(one.time[0]) + lasts)
        path.plot(shown.time, 1e6 * shown.signals["displacement_m"], color=colour, linewidth=wide, label=name)
    path.set(xlabel="time [s]", ylabel="displacement [µm]")
    path.legend(frameon=False, fontsize=8, ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    known = [one for one in found.findings if one.difference is not None]
    sizes = [min(abs(one.difference or 0.0) / one.tolerance, MOST_SHOWN) for one in known]
    colours = [palette.REVERSE if one.deviates else palette.ACTIVE for one in known]
    bars.scatter([max(size, LEAST_SHOWN) for size in sizes], [one.quantity for one in known], color=colours)
    bars.axvline(1.0, color="k", linewidth=0.8, linestyle="--")
    bars.set(xscale="log", xlim=(0.5 * LEAST_SHOWN, 2.0 * MOST_SHOWN), xlabel="difference / tolerance")
    bars.tick_params(axis="y", labelsize=8)
    bars.invert_yaxis()
    figure.suptitle(found.sentence, fontsize=10, wrap=True)
    return figure


def diagnosis_picture(found: Diagnosis) -> Figure:
    """Draw the held-out error of rig and extended rig, and the minimum detectable effects."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 4.6), layout="constrained")
    held, limits = figure.subplots(1, 2)
    _held(held, found)
    places = [(place, limit) for place, limit in found.power.items() if isfinite(limit)]
    limits.barh([place for place, _ in places], [100.0 * limit for _, limit in places], color=palette.ACTIVE)
    limits.set(xlabel="minimum detectable effect [% of what it acts on]")
    if not places:
        _nothing(limits, "no minimum detectable effect")
    kinds = " + ".join(cause.kind for cause in found.causes)
    figure.suptitle(": ".join(part for part in (found.verdict.replace("_", " "), kinds) if part))
    return figure


def _held(axes: Axes, found: Diagnosis) -> None:
    if not found.held:
        return _nothing(axes, "no cause, hence no held-out error")
    at = np.arange(len(found.held))
    for shift, name, key, colour in (
        (-0.2, "rig", "base", palette.NEUTRAL),
        (0.2, "extended rig", "extended", palette.ACTIVE),
    ):
        excess: list[Any] = [max(getattr(one, key) / one.noise, 1e-3) for one in found.held]
        axes.barh(at + shift, excess, height=0.36, color=colour, label=name)
    axes.axvline(1.0, color="k", linewidth=0.8, linestyle="--", label="noise")
    axes.set(xscale="log", xlabel="held-out mean squared error / noise", yticks=at)
    axes.set_yticklabels([", ".join(one.held)[-28:] for one in found.held], fontsize=8)
    axes.legend(frameon=False, fontsize=8)
    return None


def _nothing(axes: Axes, text: str) -> None:
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=palette.NEUTRAL)
    axes.set_axis_off()
