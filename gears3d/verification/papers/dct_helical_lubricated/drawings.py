"""Figures of the lubricated dual-clutch transmission drawn again."""

from __future__ import annotations

from math import cos
from typing import Any

from gears3d.verification.papers.bench import Bench
from gears3d.verification.papers.dct_helical_lubricated.points import CASE, FOLDER, point
from gears3d.verification.papers.dct_helical_lubricated.trends import SWEEPS, indices
from gears3d.verification.papers.figure import LINE, Figure

AXES = {
    "frequency": "frequency [Hz]",
    "acceleration": "acceleration [rad/s²]",
    "drag": "drag [N m]",
    "viscosity": "viscosity [Pa s]",
}


def rattle_indices(bench: Bench, sheet: Any) -> None:
    """Draw the rattle index over all four parameters.

    Args:
        bench: of the papers.
        sheet: an empty figure.
    """
    for axes, (key, values) in zip(sheet.subplots(2, 2).ravel(), SWEEPS.items(), strict=True):
        axes.plot(values, [1e-6 * index for index in indices(bench, key)], "o-", color=LINE, ms=3, lw=0.9)
        axes.set(xlabel=AXES[key], ylabel="RI [10⁶ N/(s kg m²)]", ylim=(0, None))


def portraits(bench: Bench, sheet: Any, points: dict[str, dict[str, Any]]) -> None:
    """Draw rate over displacement along the normal, the last twenty periods.

    Args:
        bench: of the papers.
        sheet: an empty figure.
        points: titles, and what :func:`point` takes.
    """
    for axes, (title, where) in zip(sheet.subplots(1, len(points), squeeze=False)[0], points.items(), strict=True):
        run = bench.run(CASE, point(**where), "lubricated")
        rig = bench.scenario(CASE, point(**where)).rig()
        later = run.time > run.time[-1] - 20.0 / where.get("frequency", 50.0)
        tilt = cos(rig.base_helix_angle)
        place = (0.5 * rig.backlash - run.signals["displacement_m"][later]) * tilt
        axes.plot(1e6 * place, -1e3 * tilt * run.signals["velocity_m_s"][later], color=LINE, lw=0.5)
        axes.set(title=title, xlabel="displacement [µm]")
    sheet.axes[0].set_ylabel("velocity [mm/s]")


def _figure(name: str, title: str, points: dict[str, dict[str, Any]]) -> Figure:
    note = "On a representative pair; displacement from amid the backlash, active flank on the right."
    return Figure(FOLDER, name, title, lambda b, s: portraits(b, s, points), (10.0, 3.0), note)


FIGURES = (
    _figure(
        "fig. 11",
        "Phase portraits over the frequency, figs 11 to 14",
        {f"{f:g} Hz": {"frequency": f} for f in (10.0, 25.0, 50.0, 60.0)},
    ),
    _figure(
        "fig. 17",
        "Phase portraits over the acceleration, figs 17 to 20",
        {f"{a:g} rad/s²": {"acceleration": a} for a in (0.0, 100.0, 250.0, 320.0)},
    ),
    Figure(
        FOLDER, "fig. 15", "Rattle index, figs 15, 21, 26 and 32", rattle_indices, (9.0, 6.0),
        "After 40 periods, over 40; damping comes in with depth, so that the index has a limit.",
    ),
    _figure(
        "fig. 23",
        "Phase portraits over the drag, figs 23 to 25",
        {f"{d:g} N m": {"drag": d} for d in (0.1, 0.3, 0.44)},
    ),
    _figure(
        "fig. 28",
        "Phase portraits over the viscosity, figs 28 to 30",
        {f"{v:g} Pa s": {"viscosity": v} for v in (0.01, 0.024, 0.03)},
    ),
)  # fmt: skip
"""Figures 11 to 15, 17 to 21, 23 to 26, 28 to 30 and 32."""
