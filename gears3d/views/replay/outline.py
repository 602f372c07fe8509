"""Outlines of the gears as meshes and lines, in the gear's own frame with the active flank of tooth 1 on +x."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.gears.involute import inv

if TYPE_CHECKING:
    from gears3d.views.plots.teeth import Section

POINTS = 9
"""Points on each involute."""


def tooth(section: Section, which: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return tooth 1 in polar form, from root to tip."""
    gear = (section.pair.drive, section.pair.loose)[which]
    base, alpha, root = section.base_radii[which], section.pair.working_pressure_angle, gear.root_radius * 1e3
    foot = max(base, root)
    roll = np.linspace(np.sqrt((foot / base) ** 2 - 1.0), gear.tip_roll, POINTS)
    lean = inv(alpha) - (roll - np.arctan(roll))
    radius, lean = np.r_[root, base * np.sqrt(1.0 + roll**2)], np.r_[lean[0], lean]
    return radius, lean, -(section.thickness[which] + lean)


def tooth_angles(section: Section, which: int) -> np.ndarray:
    """Return the angles about +z at which the teeth stand, in order of meshing [rad], (teeth,)."""
    teeth = (section.pair.drive, section.pair.loose)[which].teeth
    return (-1.0 if which == 0 else 1.0) * 2.0 * pi / teeth * np.arange(teeth)


def flank_lines(section: Section, which: int, flank: int) -> np.ndarray:
    """Return one kind of flank of all teeth as lines a little above the plane."""
    radius, active, reverse = tooth(section, which)
    angle = (active, reverse)[flank][1:] + tooth_angles(section, which)[:, None]
    x, y = radius[1:] * np.cos(angle), radius[1:] * np.sin(angle)
    return np.stack([x, y, np.full_like(x, 0.15)], axis=-1).astype(np.float32)


def ring(section: Section, which: int, depth: float = 7.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the toothed ring as a flat mesh."""
    gear = (section.pair.drive, section.pair.loose)[which]
    radius, active, reverse = tooth(section, which)
    angle = (np.r_[reverse, active[::-1]] + np.sort(tooth_angles(section, which) % (2.0 * pi))[:, None]).ravel()
    outline = np.tile(np.r_[radius, radius[::-1]], gear.teeth)
    inner = max(radius[0] - depth * gear.module * 1e3, 0.3 * radius[0])
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    i = np.arange(len(outline))
    j, k = np.roll(i, -1), len(outline)
    return np.r_[outline[:, None] * circle, inner * circle], np.r_[np.c_[i, j, i + k], np.c_[j, j + k, i + k]]
