"""An identified drag law as a picture: the torque over the speed, and what the law leaves over."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from gears3d.files import replacing

if TYPE_CHECKING:
    from gears3d.identification.law import Identified

LINE, BAND, POINTS = "#0072B2", "#9ecae1", "#777777"


def write_picture(path: str | Path, found: Identified) -> Path:
    """Draw torque over speed with its 95 % band, and the residual of the angle over time.

    Args:
        path: .png, .svg or .pdf, written whole or not at all.
        found: what ``identify_rundown`` gave.

    Returns:
        The path.
    """
    from math import pi

    from matplotlib.figure import Figure

    target, curves = Path(path), found.curves
    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    upper, lower = figure.subplots(2, 1)
    rpm = curves["speed_rad_s"] * 30.0 / pi
    upper.fill_between(rpm, curves["low_N_m"], curves["high_N_m"], color=BAND, label="95 %")
    upper.plot(rpm, curves["torque_N_m"], color=LINE, label=found.law)
    upper.set(xlabel="speed [rpm]", ylabel="drag torque [N·m]", title=_title(found))
    upper.set_ylim(0.0, 1.1 * float(max(curves["high_N_m"].max(), curves["torque_N_m"].max())))
    upper.legend(frameon=False)
    for time, rest in curves["residuals"]:
        lower.plot(time, rest * 1e6, ".", color=POINTS, markersize=2)
    lower.axhline(0.0, color=LINE, linewidth=1)
    lower.set(xlabel="time since the release [s]", ylabel="measured − law [µrad]")
    with replacing(target) as unfinished:
        figure.savefig(unfinished, format=target.suffix[1:], dpi=150)
    return target


def _title(found: Identified) -> str:
    parts = [
        f"{name} {p.value:.4g} ± {0.5 * (p.high - p.low):.1g} {p.unit}".rstrip() for name, p in found.parameters.items()
    ]
    return ", ".join(parts)
