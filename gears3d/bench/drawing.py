"""Pictures of the virtual bench's tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gears3d.palette import ACTIVE, REVERSE, SOFT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.bench.drop import Drops
    from gears3d.bench.ste import StaticError
    from gears3d.bench.threshold import Thresholds

COLOURS = {"phi": ACTIVE, "psi": REVERSE, "backlash": SOFT}
ROUNDING = 1e-4  # Amplitudes and deviations that are rounding [µm]
NAMES = {"phi": "active flank, φ", "psi": "reverse flank, ψ", "backlash": "backlash, b"}


def static_picture(found: StaticError) -> Figure:
    """Draw both flanks about their means, the backlash, and the spectra of all three over the drive's angle.

    Args:
        found: what :func:`gears3d.bench.static_error` gave.

    Returns:
        A figure that belongs to no window.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.5, 8.0), layout="constrained")
    flanks, gap, lines = figure.subplots(3, 1)
    turn = found.theta / (2.0 * np.pi)
    for name, curve in found.curves().items():
        axis = gap if name == "backlash" else flanks
        shift = 0.0 if name == "backlash" else curve.mean()
        label = NAMES[name] if name == "backlash" else f"{NAMES[name]}, mean {1e6 * shift:.3f} µm"
        style = "--" if name == "psi" else "-"
        axis.plot(turn, 1e6 * (curve - shift), style, color=COLOURS[name], linewidth=1, label=label)
        size = 2e6 * np.abs(np.fft.rfft(curve)[1:]) / len(curve)
        order = np.arange(1, len(size) + 1) / found.turns
        seen = size > ROUNDING
        lines.plot(order[seen], size[seen], ".", color=COLOURS[name], markersize=4, label=NAMES[name])
    flanks.set(ylabel="flank about its mean [µm]")
    gap.set(xlabel="turns of the drive", ylabel="backlash [µm]")
    for axis in (flanks, gap):
        axis.ticklabel_format(useOffset=False)
        middle, half = np.mean(axis.get_ylim()), 0.5 * np.ptp(axis.get_ylim())
        axis.set_ylim(middle - max(half, 10.0 * ROUNDING), middle + max(half, 10.0 * ROUNDING))
    lines.set(xlabel="cycles per revolution of the drive", ylabel="amplitude [µm]")
    if any(np.any(line.get_ydata()) for line in lines.lines):
        lines.set(xscale="log", yscale="log")
    else:
        lines.set_title("no order above 0.1 nm", fontsize=9)
        lines.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0), xticks=(), yticks=())
    for axis in (flanks, gap, lines):
        axis.legend(frameon=False, fontsize=8)
    return figure


def drop_picture(found: Drops) -> Figure:
    """Draw what each drop gave back over its speed, and the line of each flank.

    Args:
        found: what :func:`gears3d.bench.drops` gave.

    Returns:
        A figure that belongs to no window.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    axis = figure.subplots()
    speed = np.abs(found.table["velocity_m_s"])
    far = np.linspace(0.0, 1.05 * speed.max(), 50)
    for flank, (name, law) in enumerate(found.laws.items()):
        own, colour = found.table["flank"] == flank, COLOURS[("phi", "psi")[flank]]
        label = f"{name}: {law[0]:.3f} {law[1]:+.3g} s/m · v"
        axis.plot(1e3 * speed[own], found.restitution[own], "os"[flank], color=colour, label=label, markersize=5)
        axis.plot(1e3 * far, law[0] + law[1] * far, color=colour, linewidth=1)
    axis.set(xlabel="approach [mm/s]", ylabel="restitution", ylim=(0.0, 1.0))
    axis.legend(frameon=False)
    return figure


def threshold_picture(found: Thresholds) -> Figure:
    """Draw how far the gap opened over Λ, up and down, for each frequency.

    Args:
        found: what :func:`gears3d.bench.thresholds` gave.

    Returns:
        A figure that belongs to no window.
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.5, 2.8 * len(found.sweeps)), layout="constrained")
    for axis, one in zip(np.atleast_1d(figure.subplots(len(found.sweeps), 1)), found.sweeps, strict=True):
        time, level, opening = one.losses.T
        rising = time < time[np.argmax(level)] if len(time) else np.zeros(0, bool)
        for part, mark, name in ((rising, "^", "up"), (~rising, "v", "down")):
            colour = COLOURS["phi" if name == "up" else "psi"]
            at = one.up if name == "up" else one.down
            label = f"{name}: none" if np.isnan(at) else f"{name}: Λ* = {at:.3f}"
            axis.plot(level[part], 1e6 * opening[part], mark, color=colour, markersize=4, label=label)
        label = f"riding asks for a pull: Λ = {one.predicted:.3f}"
        axis.axvline(one.predicted, color=COLOURS["backlash"], linewidth=1, label=label)
        axis.set(xlabel="Λ", ylabel="gap opens to [µm]", title=f"{one.frequency:g} Hz")
        if len(time):
            axis.set_yscale("log")
        axis.legend(frameon=False, fontsize=8)
    return figure
