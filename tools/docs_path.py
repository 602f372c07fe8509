"""Draws docs/pictures/path.png: one period of the displacement, with contacts, free flights and impacts.

python tools/docs_path.py
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from docs_drawing import BLUE, ORANGE
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from gears3d import load, simulate

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "pictures" / "path.png"
LABEL = {"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.85}
UM = 1e6


def label(axes: Axes, words: str, point: tuple[float, float], place: tuple[float, float]) -> None:
    """Write words with a line to a point."""
    axes.annotate(words, point, place, fontsize=9, ha="center", bbox=LABEL, arrowprops={"arrowstyle": "-"})


def main() -> None:
    """Simulate, draw and write the picture."""
    scenario = load("rigaud-2020/fig5-20rpm", {"run.duration": "2 s"})
    run = simulate(scenario, "rigid")
    backlash, period = UM * scenario.rig().backlash, scenario.period
    begin = 4.0 * period
    part = run.between(begin, begin + period)
    phase = np.asarray((part.time - begin) / period, dtype=float)
    place = np.asarray(UM * part.signals["displacement_m"], dtype=float)
    figure = Figure(figsize=(9.2, 4.2), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    for level, words, colour, side in ((0.0, "working flank", BLUE, -1), (backlash, "non-working flank", ORANGE, 1)):
        axes.axhspan(level, level + side * 30.0, color=colour, alpha=0.3, lw=0)
        axes.axhline(level, color=colour)
        axes.text(0.005, level + side * 15.0, words, color=colour, va="center", fontsize=9)
    axes.plot(phase, place, color="k", lw=1.4)
    times = (part.impacts["time_s"] - begin) / period
    lower, upper = (float(times[part.impacts["flank"] == flank][0]) for flank in (0, 1))
    for at, level, colour in ((lower, 0.0, BLUE), (upper, backlash, ORANGE)):
        axes.plot(at, level, "o", color=colour, ms=7, zorder=3)
    left = float(phase[place > 1.0][0])
    label(axes, "contact loss", (left, 0.0), (left - 0.1, 70.0))
    middle = 0.5 * (left + upper)
    label(axes, "free flight", (middle, float(np.interp(middle, phase, place))), (middle - 0.1, 150.0))
    label(axes, "impact, approach speed v⁻,\nrebound speed v⁺ = −e·v⁻", (upper, backlash), (upper + 0.16, 180.0))
    label(axes, "impact", (lower, 0.0), (lower - 0.08, 50.0))
    label(axes, "rebounds, then\nsustained contact", (lower + 0.02, 8.0), (lower + 0.08, 70.0))
    axes.annotate("", (0.97, 0.0), (0.97, backlash), arrowprops={"arrowstyle": "<->"})
    axes.text(0.975, 0.5 * backlash, "b", va="center")
    axes.set(
        xlim=(0, 1),
        ylim=(-32, backlash + 32),
        xlabel="time / period of the fluctuation",
        ylabel="displacement s [µm]",
    )
    figure.savefig(PICTURE, dpi=110)
    print(PICTURE)


if __name__ == "__main__":
    main()
