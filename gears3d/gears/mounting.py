"""How gears sit off their ideal axes, as data."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees
from typing import Literal

from gears3d.errors import Fault, InputError
from gears3d.gears.deviation import GEARS, index_of

_STEEPEST = 0.02
"""Largest tilt [rad]; sections are taken across the ideal axis, which is wrong by half the square of it."""


@dataclass(frozen=True)
class Eccentricity:
    """The teeth's own axis stands off the axis of rotation, and turns about it with the gear.

    Args:
        gear: ``"drive"`` or ``"loose"``.
        offset: distance of the axes [m].
        phase: direction of the offset when the gear's angle is 0, from the mate's axis in the gear's own sense of
            rotation [rad].

    Raises:
        InputError: unknown gear.

    >>> Eccentricity("loose", 20e-6).phase
    0.0
    """

    gear: Literal["drive", "loose"]
    offset: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        index_of(self.gear, GEARS, "gear")


@dataclass(frozen=True)
class Wobble:
    """The teeth's own axis is tilted against the axis of rotation, which it crosses in the middle of the face.

    Args:
        gear: ``"drive"`` or ``"loose"``.
        angle: between the axes [rad].
        phase: direction in which the end at +z leans when the gear's angle is 0, from the mate's axis in the gear's
            own sense of rotation [rad].

    Raises:
        InputError: unknown gear, or a tilt that is no small angle.
    """

    gear: Literal["drive", "loose"]
    angle: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        index_of(self.gear, GEARS, "gear")
        _small("angle", self.angle)


@dataclass(frozen=True)
class Misalignment:
    """The axes of rotation are not parallel; in the middle of the face they keep the centre distance.

    Args:
        in_plane: the loose gear's axis leans away from the drive's towards +z, in the plane of both [rad].
        out_of_plane: it leans along the drive's motion at the pitch point towards +z, across that plane [rad].

    Raises:
        InputError: a tilt that is no small angle.

    Source: ISO/TR 10064-3:1996, parallelism of axes, f_Σδ and f_Σβ over the face width.
    """

    in_plane: float = 0.0
    out_of_plane: float = 0.0

    def __post_init__(self) -> None:
        _small("in_plane", self.in_plane)
        _small("out_of_plane", self.out_of_plane)


Mounting = Eccentricity | Wobble | Misalignment


def _small(key: str, angle: float) -> None:
    if not abs(angle) <= _STEEPEST:
        most = degrees(_STEEPEST)
        raise InputError(Fault(key, f"is {degrees(angle):.4g} deg", f"give -{most:.3g} to {most:.3g} deg"))
