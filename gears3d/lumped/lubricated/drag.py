"""The drag of a loose gear from its parts, which is one torque in the lubricated model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from gears3d.laws.drag import couette, end_faces, periphery, rolling_bearing
from gears3d.lumped.lubricated.squeezing import squeezing_torque

if TYPE_CHECKING:
    from gears3d.gears import Pair


@dataclass(frozen=True)
class Bath:
    """The oil that the loose gear dips into.

    Args:
        density: [kg/m³].
        viscosity: dynamic [Pa·s].
        depth: how deep the reference circle dips [m].
    """

    density: float
    viscosity: float
    depth: float


@dataclass(frozen=True)
class Bearing:
    """The bearing of the loose gear on its shaft: ``factor`` f0 and mean ``diameter`` dm [m]."""

    factor: float
    diameter: float


@dataclass(frozen=True)
class Synchroniser:
    """The open cone of a synchroniser: ``length`` L, mean ``radius`` R and ``clearance`` jc [m]."""

    length: float
    radius: float
    clearance: float


def drag_parts(
    pair: Pair,
    speed: float,
    bath: Bath,
    bearing: Bearing | None = None,
    synchroniser: Synchroniser | None = None,
    shaft_speed: float = 0.0,
) -> dict[str, float]:
    """Return the resisting torques on a loose gear, part by part, and the sum.

    Args:
        pair: the pair.
        speed: of the loose gear [rad/s].
        bath: the oil.
        bearing: ``None`` for none.
        synchroniser: ``None`` for none.
        shaft_speed: of the shaft under bearing and synchroniser [rad/s].

    Returns:
        ``end_faces``, ``periphery``, ``squeezing``, ``bearing``, ``synchroniser`` and ``total`` [N·m].

    Raises:
        ValueError: the gear does not dip into the oil.

    Source: the lubricated dual-clutch transmission, eqs (15) to (26); in (25) as restored, half of what is printed.

    >>> from gears3d.scenario import load
    >>> pair = load("scenarios/base/helical-17-43.toml").pair()
    >>> parts = drag_parts(pair, 62.1, Bath(816.0, 0.0098, 0.02), Bearing(12, 45e-3), Synchroniser(8e-3, 37.5e-3, 2e-4))
    >>> [round(parts[name], 4) for name in ("bearing", "synchroniser")]
    [0.0405, 0.0081]
    """
    radius, kinematic = pair.loose.reference_radius, bath.viscosity / bath.density
    height, against = radius - bath.depth, speed - shaft_speed
    oil = (bath.density, kinematic, speed)
    parts = {
        "end_faces": float(end_faces(radius, height, *oil)),
        "periphery": float(periphery(radius, pair.loose.face_width, height, *oil)),
        "squeezing": squeezing_torque(pair, bath.density, speed),
        "bearing": float(rolling_bearing(bearing.factor, bearing.diameter, kinematic, against)) if bearing else 0.0,
        "synchroniser": 0.0,
    }
    if synchroniser is not None:
        cone = (synchroniser.length, synchroniser.radius, synchroniser.clearance)
        parts["synchroniser"] = float(couette(bath.viscosity, *cone, against))
    return parts | {"total": sum(parts.values())}
