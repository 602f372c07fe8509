"""An encoder that reads later than the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Row

if TYPE_CHECKING:
    import numpy as np


@register
@dataclass(frozen=True)
class EncoderSkew:
    """Reading θ(t - delay) in place of θ(t); the gears' motion is unchanged.

    Source: channels sampled one after the other; at constant speed it is an angle of ω·delay.

    Args:
        delay: s, negative when it reads earlier.
        gear: the encoder's gear.

    >>> import numpy as np
    >>> time = np.arange(4.0)
    >>> EncoderSkew(delay=1.0).observe({"drive": time, "loose": 2 * time}, time)["loose"].tolist()
    [-2.0, 0.0, 2.0, 4.0]
    """

    delay: float
    gear: str = "loose"

    kind: ClassVar[str] = "encoder_skew"
    place: ClassVar[Place] = "sensor"
    params: ClassVar[dict[str, Param]] = {
        "delay": Param("time", -0.1, 0.1),
        "gear": Param("choice", default="loose", choices=("drive", "loose"), tried=("loose",)),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """None: it acts on the recording."""
        return []

    def unit_size(self, rig: Rig) -> float:
        """The delay in which the loose gear turns by the backlash at its mean speed."""
        return rig.backlash / (rig.base_radius_loose * max(rig.mean_speed_loose, 1e-9))

    def observe(self, gear_angles: dict[str, np.ndarray], time: np.ndarray) -> dict[str, np.ndarray]:
        """Read the encoder's own gear at its angle ``delay`` earlier; beyond the recording at the speed of its end."""
        import numpy as np

        angle = gear_angles[self.gear]
        if len(time) < 2:
            return gear_angles
        asked = time - self.delay
        read = np.interp(asked, time, angle)
        for beyond, at, beside in ((asked < time[0], 0, 1), (asked > time[-1], -1, -2)):
            speed = (angle[at] - angle[beside]) / (time[at] - time[beside])
            read = np.where(beyond, angle[at] + speed * (asked - time[at]), read)
        return {**gear_angles, self.gear: read}
