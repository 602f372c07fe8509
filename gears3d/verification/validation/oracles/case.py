"""The numbers that every independent integration takes: nothing of the models' code."""

from __future__ import annotations

from math import cos, pi, sin
from typing import NamedTuple

from gears3d.scenario import Scenario


class Case(NamedTuple):
    """One degree of freedom on the line of action, driven by one sine."""

    mass: float  # of the loose gear [kg]
    force: float  # drag [N]
    speed: float  # amplitude of the drive's speed [m/s]
    omega: float  # its circular frequency [rad/s]
    backlash: float  # [m]
    restitution: float  # coefficient

    def push(self, time: float) -> float:
        """Return the relative acceleration of the free gear, s̈ = −F/m − ÿ [m/s²]; Rigaud & Perret-Liaudet 2020, (12).

        Units: ``time`` [s].
        """
        return -self.force / self.mass - self.speed * self.omega * cos(self.omega * time)

    def speed_of_drive(self, time: float) -> float:
        """Return the drive's speed less its mean, ẏ [m/s].

        Units: ``time`` [s].
        """
        return self.speed * sin(self.omega * time)


def case(scenario: Scenario) -> Case:
    """Return the numbers of a scenario with one harmonic and constant drag.

    >>> from gears3d.verification.validation.bench import fig5
    >>> round(case(fig5()).mass, 2)
    3.17
    """
    rig, harmonic = scenario.rig(), scenario.motion.harmonics[0]
    return Case(
        rig.inertia / rig.base_radius_loose**2,
        rig.drag_torque / rig.base_radius_loose,
        rig.base_radius_drive * harmonic.amplitude,
        2 * pi * harmonic.frequency,
        rig.backlash,
        rig.restitution,
    )
