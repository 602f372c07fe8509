"""The bench that the checks are measured on: Rigaud & Perret-Liaudet 2020, table 1 and figure 5."""

from __future__ import annotations

from math import pi
from typing import Any

from gears3d.laws import SineDrive
from gears3d.scenario import Scenario, load

FIG5 = """
format = 1
title = "Rigaud & Perret-Liaudet 2020, fig. 5, 20 rpm"
[gears]
module = "3.5 mm"
pressure_angle = "20 deg"
face_width = "7.5 mm"
drive = { teeth = 90 }
loose = { teeth = 90, inertia = "0.0695 kg m^2" }
[mount]
backlash = "250 um"
[motion]
mean = "30 rpm"
harmonics = [ { amplitude = "20 rpm", frequency = "3 Hz" } ]
[drag]
torque = "0.22 N m"
[impact]
restitution = 0.3
[run]
duration = "2 s"
settle = "0 s"
"""


def fig5(**overrides: Any) -> Scenario:
    """Return figure 5 at 20 rpm, changed.

    Args:
        overrides: dotted keys with ``__`` for the dot, e.g. ``impact__restitution=0.5``.

    >>> fig5(impact__restitution=0.5).impact.restitution
    0.5
    """
    return load(FIG5, overrides=[(key.replace("__", "."), value) for key, value in overrides.items()])


def swing(scenario: Scenario) -> SineDrive:
    """Return speed, frequency and pull of a scenario with one harmonic and Coulomb drag.

    Args:
        scenario: the scenario.

    >>> round(swing(fig5()).excitation, 2)
    12.47
    """
    rig, harmonic = scenario.rig(), scenario.motion.harmonics[0]
    pull = rig.drag_torque * rig.base_radius_loose / rig.inertia
    return SineDrive(rig.base_radius_drive * harmonic.amplitude, 2 * pi * harmonic.frequency, pull)
