"""Pictures of the virtual bench's tests."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gears3d.bench.ste import StaticError

COLOURS = {"phi": "#0072B2", "psi": "#D55E00", "backlash": "#444444"}
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
        seen = size > 1e-4  # µm: below is rounding
        lines.plot(order[seen], size[seen], ".", color=COLOURS[name], markersize=4, label=NAMES[name])
    flanks.set(ylabel="flank about its mean [µm]")
    gap.set(xlabel="turns of the drive", ylabel="backlash [µm]")
    gap.ticklabel_format(useOffset=False)
    lines.set(xlabel="cycles a turn of the drive", ylabel="amplitude [µm]", yscale="log", xscale="log")
    for axis in (flanks, gap, lines):
        axis.legend(frameon=False, fontsize=8)
    return figure
