"""Figure 8 of Rigaud & Perret-Liaudet 2020, drawn again: the teeth in nine pictures of a period."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.verification.papers.figure import ACTIVE, PUBLISHED, REVERSE
from gears3d.verification.papers.rigaud_2020.camera import FILE, FRAMES, best, states
from gears3d.verification.papers.rigaud_2020.points import PLASTIC

if TYPE_CHECKING:
    from gears3d.gears import Pair
    from gears3d.verification.papers.bench import Bench

NUMBERS = ("1", "6-7", "12", "18", "24", "29-30", "35", "40-41", "46")
EIGHTHS = ("0", "T/8", "T/4", "3T/8", "T/2", "5T/8", "3T/4", "7T/8", "T")
COLOURS = {"active": ACTIVE, "reverse": REVERSE, "flight": "0.45"}
REACH = 7e-3
"""Half the width of a picture [m]."""


def pictures(bench: Bench, sheet: Any) -> None:
    """Draw figure 8: nine sections of the mesh, the drive gear on the right as in the paper.

    Args:
        bench: of the papers.
        sheet: matplotlib figure.
    """
    _, backlash, origin = best(bench)
    more = {**PLASTIC, "mount.backlash": f"{backlash} um"}
    scenario, run = bench.scenario(FILE, more), bench.run(FILE, more)
    pair, period = scenario.pair(), scenario.period
    shown = states(bench, backlash, origin)
    times = (4 + origin + np.arange(9) / 8) * period
    drive = np.interp(times, run.time, run.signals["theta_drive_rad"])
    path = np.interp(times, run.time, run.signals["displacement_m"])
    teeth = scenario.gears.drive.teeth
    for frame, axes in enumerate(sheet.subplots(3, 3).ravel()):
        _teeth(axes, pair, float(drive[frame]), float(path[frame]))
        number = 1 + (drive[frame] - drive[0]) * teeth / (2 * np.pi)
        agrees = shown[frame] == FRAMES[frame]
        axes.set_title(f"t = {EIGHTHS[frame]}: {shown[frame]} ({number:.1f})", color=COLOURS[shown[frame]], loc="left")
        axes.set_xlabel(
            f"printed: {FRAMES[frame]} ({NUMBERS[frame]})", color=PUBLISHED if agrees else "#b3261e", fontsize=9
        )
        axes.set(xticks=[], yticks=[], aspect="equal", xlim=(-REACH, REACH), ylim=(-REACH * 0.8, REACH * 0.8))
        axes.spines[["top", "right"]].set_visible(True)


def _teeth(axes: Any, pair: Pair, theta: float, displacement: float) -> None:
    """Draw both gears about the pitch point, turned by half a turn: the drive comes to the right."""
    from matplotlib.patches import Circle

    from gears3d.gears.outline import outline

    loose = (pair.drive.base_radius * theta + displacement) / pair.loose.base_radius
    pitch = np.array([pair.centre_distance * pair.drive.teeth / (pair.drive.teeth + pair.loose.teeth), 0.0])
    for which, angle, face in (("drive", theta, "#C9D6E3"), ("loose", loose, "#E6E0D4")):
        turn = pair.rotation(which, angle)
        c, s = cos(turn), sin(turn)
        points = outline(pair, which, chord=5e-6).points @ np.array([[c, s], [-s, c]])
        centre = np.array(pair.centre(which)[:2]) - pitch
        points = -(points + centre)
        axes.add_patch(Circle((-centre[0], -centre[1]), pair.gear(which).root_radius, color=face, linewidth=0))
        near = [tooth for tooth in points if np.hypot(*tooth.mean(axis=0)) < 3 * REACH]
        for tooth in near:
            axes.fill(*tooth.T, facecolor=face, edgecolor="none")
            axes.plot(*tooth.T, color="#333333", linewidth=0.7)
