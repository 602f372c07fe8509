"""The drawings of the papers' figures: each draws cases on an empty matplotlib figure."""

from __future__ import annotations

from collections.abc import Callable
from math import cos
from typing import Any

from gears3d.verification.papers.bench import Case
from gears3d.verification.papers.figure import LINE
from gears3d.verification.papers.measures import lubricated_index

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
