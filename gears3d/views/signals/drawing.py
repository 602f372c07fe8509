"""Path, sections, return map and spectra of one recording as one picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gears3d import files, signals
from gears3d.recording import FLANKS, Recording
from gears3d.recording.told import describe, spectra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = ("#0072B2", "#D55E00")
"""Of the active and the reverse flank, safe for colour-blind readers."""
PERIODS_SHOWN = 3.0


def picture(recording: Recording) -> Figure:
    """Draw a recording after settling: path, both Poincaré sections, return map, spectra."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12.0, 6.8), layout="constrained")
    FigureCanvasAgg(figure)
    path, strobe, hits, returns, frequency, order = figure.subplots(2, 3).ravel()
    start, end = signals.window(recording.signals, recording.meta)
    period = float(recording.meta.get("period_s") or 0.0)
    some = signals.counted(recording.impacts, start, end)
    _path(path, recording, max(start, end - PERIODS_SHOWN * period) if period else start, end)
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


def write_picture(path: Path, recording: Recording) -> Path:
    """Draw a recording into a file, under a temporary name that is renamed."""
    return files.write_picture(path, lambda: picture(recording))


def _path(axes: Axes, recording: Recording, begin: float, end: float) -> None:
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


def _nothing(axes: Axes, text: str) -> None:
    axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", color="#777777", fontsize=9)
