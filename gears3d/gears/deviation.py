"""Deviations of flanks, and mounting of gears off their ideal axes."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees
from typing import Literal

from gears3d.errors import Fault, InputError, did_you_mean

GEARS = ("drive", "loose")
FLANKS = ("active", "reverse")
_MOST_WAVES = 100.0  # Of a profile: shorter ones are roughness
# Largest tilt [rad]; sections are taken across the ideal axis, which is wrong by half the square of it
_STEEPEST = 0.02


def index_of(word: str, words: tuple[str, ...], key: str) -> int:
    """Return the place of a word among the known words.

    >>> index_of("loose", GEARS, "gear")
    1
    """
    if word not in words:
        raise InputError(Fault(key, f"is {word!r}", did_you_mean(str(word), words)))
    return words.index(word)


@dataclass(frozen=True)
class HarmonicDeviation:
    """Material amplitude·cos(order·θ + phase) along the outward normal, θ the gear's own angle when it touches.

    The flank is shaped so that against a perfect mate it touches displaced by exactly this amount along the
    transverse line of action.

    Args:
        gear: ``"drive"`` or ``"loose"``.
        flank: ``"active"`` or ``"reverse"``.
        order: whole cycles per revolution of the gear.
        amplitude: [m].
        phase: [rad].

    Raises:
        InputError: unknown words, or an order that does not close after a revolution.

    >>> HarmonicDeviation("drive", "active", 90, 5e-6).phase
    0.0
    """

    gear: Literal["drive", "loose"]
    flank: Literal["active", "reverse"]
    order: int
    amplitude: float
    phase: float = 0.0

    def __post_init__(self) -> None:
        index_of(self.gear, GEARS, "gear")
        index_of(self.flank, FLANKS, "flank")
        if self.order < 0 or self.order != int(self.order):
            raise InputError(Fault("order", f"is {self.order:g}", "a flank is closed: give a whole number"))


@dataclass(frozen=True)
class ToothDeviation:
    """Material of constant thickness on one flank of one tooth.

    Args:
        gear: ``"drive"`` or ``"loose"``.
        flank: ``"active"`` or ``"reverse"``.
        tooth: number of the tooth in order of meshing, 1 = at the pitch point when the gear's angle is 0.
        offset: thickness along the outward normal [m].

    Raises:
        InputError: unknown words.

    >>> ToothDeviation("loose", "reverse", 12, 20e-6).tooth
    12
    """

    gear: Literal["drive", "loose"]
    flank: Literal["active", "reverse"]
    tooth: int
    offset: float

    def __post_init__(self) -> None:
        index_of(self.gear, GEARS, "gear")
        index_of(self.flank, FLANKS, "flank")


@dataclass(frozen=True)
class ProfileSlope:
    """Material that grows in proportion to the roll angle from the start of the active profile to the tip.

    It is measured along the normal of the involute and is 0 in the middle of that range, below which it continues
    straight to the root form circle. A positive slope is a smaller pressure angle of the flank.

    Args:
        gear: ``"drive"`` or ``"loose"``.
        flank: ``"active"`` or ``"reverse"``.
        amount: profile slope deviation f_Hα: material at the tip less that at the start of the active profile [m].
        tooth: number of the one tooth that has it; ``None``: all of them.

    Raises:
        InputError: unknown words.

    Source: ISO 1328-1:2013, profile slope deviation, positive when there is more material towards the tip.

    >>> ProfileSlope("drive", "active", 6e-6).tooth is None
    True
    """

    gear: Literal["drive", "loose"]
    flank: Literal["active", "reverse"]
    amount: float
    tooth: int | None = None

    def __post_init__(self) -> None:
        _flank_words(self)


@dataclass(frozen=True)
class ProfileWave:
    """Material amplitude·cos(2π·waves·x + phase), x from 0 at the start of the active profile to 1 at the tip.

    x is the share of the roll angle, the material is measured along the normal of the involute; below the start the
    flank continues straight.

    Args:
        gear: ``"drive"`` or ``"loose"``.
        flank: ``"active"`` or ``"reverse"``.
        amplitude: half the profile form deviation f_fα of a whole wave [m].
        waves: on the range, any positive number.
        phase: at the start of the active profile [rad].
        tooth: number of the one tooth that has it; ``None``: all of them.

    Raises:
        InputError: unknown words, or a number of waves that is not positive.

    Source: ISO 1328-1:2013, profile form deviation over the profile evaluation range.
    """

    gear: Literal["drive", "loose"]
    flank: Literal["active", "reverse"]
    amplitude: float
    waves: float
    phase: float = 0.0
    tooth: int | None = None

    def __post_init__(self) -> None:
        _flank_words(self)
        if not 0.0 < self.waves <= _MOST_WAVES:
            raise InputError(Fault("waves", f"is {self.waves:g}", f"give more than 0 and at most {_MOST_WAVES:g}"))


@dataclass(frozen=True)
class HelixSlope:
    """Material that grows in proportion to the height over the face width, 0 in its middle.

    Args:
        gear: ``"drive"`` or ``"loose"``.
        flank: ``"active"`` or ``"reverse"``.
        amount: helix slope deviation f_Hβ of this flank: material at +z less that at -z, along the transverse line of
            action [m]. The helix is steeper than it should where that turns the flank the way the hand does.
        tooth: number of the one tooth that has it; ``None``: all of them.

    Raises:
        InputError: unknown words.

    Source: ISO 1328-1:2013, helix slope deviation; its sign there is that of the change of ``|β|``.
    """

    gear: Literal["drive", "loose"]
    flank: Literal["active", "reverse"]
    amount: float
    tooth: int | None = None

    def __post_init__(self) -> None:
        _flank_words(self)


Deviation = HarmonicDeviation | ToothDeviation | ProfileSlope | ProfileWave | HelixSlope


def _flank_words(deviation: ProfileSlope | ProfileWave | HelixSlope) -> None:
    index_of(deviation.gear, GEARS, "gear")
    index_of(deviation.flank, FLANKS, "flank")


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
        InputError: unknown gear, or a tilt that is not a small angle.
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
        InputError: a tilt that is not a small angle.

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
