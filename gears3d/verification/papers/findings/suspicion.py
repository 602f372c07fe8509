"""What the suspects of several questions have in common."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import TYPE_CHECKING, Any

from gears3d.effects import catalogue
from gears3d.verification.papers.findings.question import Suspect

if TYPE_CHECKING:
    from gears3d.effects import Rig

Harmonic = tuple[float, float, float]


def of(kind: str, **parameters: Any) -> tuple[Any, ...]:
    """Return one effect of the catalogue, as suspects have them.

    Args:
        kind: of the effect.
        parameters: SI.
    """
    return (catalogue()[kind](**parameters),)


def multiple(suspect: Suspect) -> int:
    """Return which multiple of the excitation a suspect adds to the drive, 0 for others.

    Args:
        suspect: any.

    >>> multiple(Suspect("drive_motion, 12x", "", 1.0, "")), multiple(Suspect("mesh_drag", "", 1.0, ""))
    (12, 0)
    """
    return int(suspect.name.split()[-1][:-1]) if suspect.name.startswith("drive_motion") else 0


def added(drive: Sequence[Harmonic], suspect: Suspect, size: float, phase: float) -> list[Harmonic]:
    """Return the drive's harmonics with a suspect's, whose size is relative to the first.

    Args:
        drive: amplitude [rad/s], frequency [Hz], phase [rad] of each.
        suspect: any.
        size: of it.
        phase: of it [rad].
    """
    speed, frequency, _ = drive[0]
    n = multiple(suspect)
    return [*drive, (size * speed, n * frequency, pi / 2 + phase)] if n and size else list(drive)


def viscous(rig: Rig) -> float:
    """Return the coefficient whose drag at the mean speed is the rig's [N·m·s/rad].

    Args:
        rig: of the bench.
    """
    return rig.drag_torque / rig.mean_speed_loose


ALIKE = (
    *(
        Suspect(kind, "of each speed's drag, more", 1.0, "unit size, twice the drag",
                lambda rig, size, phase, kind=kind: of(kind, coefficient=size * viscous(rig)))
        for kind in ("mesh_drag", "drag_viscous")
    ),
    Suspect("drag_power, exponent 2", "of each speed's drag, more", 1.0, "unit size, twice the drag",
            lambda rig, size, phase: of("drag_power", coefficient=size * viscous(rig) / rig.mean_speed_loose,
                                        exponent=2.0)),
    Suspect("mesh_friction", "coefficient", 0.3, "dry steel",
            lambda rig, size, phase: of("mesh_friction", coefficient=size)),
)  # fmt: skip
"""Drags that any rig may have."""
