"""An encoder that is eccentric to its shaft: its reading deviates once (or n times) per revolution."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING, ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Row

if TYPE_CHECKING:
    import numpy as np


@register
@dataclass(frozen=True)
class EncoderEccentricity:
    """Reading θ + amplitude·cos(order·θ + phase) in place of θ; the gears' motion is unchanged.

    Source: geometry; a ring of radius r with its centre e off the axis deviates by e/r, once per revolution.

    Args:
        amplitude: rad.
        order: cycles per revolution of the shaft.
        phase: rad.
        gear: the encoder's gear.

    >>> import numpy as np
    >>> error = EncoderEccentricity(amplitude=1e-3, gear="loose")
    >>> error.observe({"drive": np.zeros(1), "loose": np.zeros(1)}, np.zeros(1))["loose"].tolist()
    [0.001]
    """

    amplitude: float
    order: int = 1
    phase: float = 0.0
    gear: str = "loose"

    kind: ClassVar[str] = "encoder_eccentricity"
    place: ClassVar[Place] = "sensor"
    params: ClassVar[dict[str, Param]] = {
        "amplitude": Param("angle", -0.1, 0.1),
        "order": Param("count", 1, 1000, default=1, linear=False),
        "phase": Param("angle", -2 * pi, 2 * pi, default=0.0, linear=False, of="gear"),
        "gear": Param("choice", default="loose", choices=("drive", "loose")),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """None: it acts on the recording."""
        return []

    def unit_size(self, rig: Rig) -> float:
        """The angle of the loose gear that corresponds to the backlash."""
        return rig.backlash / rig.base_radius_loose

    def observe(self, gear_angles: dict[str, np.ndarray], time: np.ndarray) -> dict[str, np.ndarray]:
        """Add the deviation to the encoder's own gear."""
        import numpy as np

        angle = gear_angles[self.gear]
        return {**gear_angles, self.gear: angle + self.amplitude * np.cos(self.order * angle + self.phase)}
