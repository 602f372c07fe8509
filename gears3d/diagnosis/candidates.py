"""All candidate causes of a rig: an effect with a fixed shape and a free size."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from gears3d.effects import Rig, catalogue

Array = np.ndarray

# Channels in which effects show, by their place.
SHOWS = {
    "geometry": ("contact",),
    "torque": ("flight",),
    "impact": ("impact",),
    "motion": ("drive",),
    "sensor": ("contact", "flight", "drive"),
}


# Sizes in units at which regressors are computed: of most effects, and of effects that delay contact loss, whose
# response is quadratic.
SMALL, LATE = 0.01, 0.2


class Bend(NamedTuple):
    """A shape parameter that is refined once the cause is accepted.

    Args:
        low: smallest value.
        high: largest value.
        log: whether its logarithm is refined.
    """

    low: float
    high: float
    log: bool = True


# By kind and parameter; ``mesh_drag`` has none, but its response is quadratic and needs as many rounds.
FREE: dict[str, dict[str, Bend]] = {
    "drag_power": {"exponent": Bend(0.2, 4.0)},
    "drag_drift": {"time_constant": Bend(0.1, 1e4)},
    "drag_differential": {"shaft_speed": Bend(-1e5, 1e5, False)},
    "mesh_drag": {},
    "tooth_compliance": {"damping": Bend(1e-9, 1e9)},
    "drive_motion": {"frequency": Bend(1e-2, 1e5), "order": Bend(1e-3, 1e4)},
}
EXPONENTS = (0.5, 1.5, 2.0, 2.5, 3.0)
# Tried speeds of a shaft, in mean speeds of the loose gear.
SHAFTS = (-1.0, 0.5, 2.0)
# Tried time constants of a drift, in durations of a record.
TIMES = (0.03, 0.1, 0.3, 1.0, 3.0)


class Candidate(NamedTuple):
    """One cause with a fixed shape and a free size.

    Args:
        kind: of the effect.
        shape: fixed parameters.
        size: name of the free parameter.
        unit: size that changes its channel by 100 %.
        phased: whether its phase is free, too; it then has two numbers, a cosine's and minus a sine's.
        channels: in which it shows.
        tried: size in units at which its regressor is computed.
    """

    kind: str
    shape: dict[str, Any]
    size: str
    unit: float
    phased: bool
    channels: tuple[str, ...]
    tried: float = SMALL

    def effect(self, numbers: Array) -> Any | None:
        """Return the effect of given numbers; ``None`` for numbers of no effect.

        Args:
            numbers: size, or cosine and minus sine, [SI].
        """
        size = float(np.hypot(*numbers)) if self.phased else float(numbers[0])
        if size == 0.0:
            return None
        phase = {"phase": float(np.arctan2(-numbers[1], numbers[0]))} if self.phased else {}
        return catalogue()[self.kind](**self.shape, **phase, **{self.size: size})


def candidates(
    rig: Rig, duration: float, highest: int, frequencies: tuple[float, ...] = (), orders: tuple[float, ...] = ()
) -> list[Candidate]:
    """Return all candidate causes of a rig.

    duration: of a record [s]; frequencies: tried, of the drive's motion [Hz].
    """
    return [*_geometry(rig, highest), *_torques(rig, duration, highest), *_impacts(rig), *_sensors(rig, highest),
            *_motions(rig, frequencies, orders)]  # fmt: skip


def _geometry(rig: Rig, highest: int) -> Iterator[Candidate]:
    shows, b = SHOWS["geometry"], rig.backlash
    yield Candidate("backlash_offset", {}, "offset", b, False, shows)
    for order in range(1, highest + 1):
        yield Candidate("backlash_variation", {"order": order}, "amplitude", b, True, shows)
    for gear, teeth in (("drive", rig.teeth_drive), ("loose", rig.teeth_loose)):
        yield Candidate("eccentricity", {"gear": gear}, "offset", b, True, shows)
        for order in range(1, highest + 1):
            for flank in ("both", "active"):
                shape = {"gear": gear, "order": order, "flank": flank}
                yield Candidate("transmission_error", shape, "amplitude", b, True, shows)
        for tooth in range(1, teeth + 1):
            for flank in ("both", "active", "reverse"):
                shape = {"gear": gear, "tooth": tooth, "flank": flank}
                yield Candidate("pitch_error", shape, "offset", b, False, shows)


def _torques(rig: Rig, duration: float, highest: int) -> Iterator[Candidate]:
    shows, drag = SHOWS["torque"], rig.drag_torque or 1e-3 * rig.inertia
    speed = max(rig.mean_speed_loose, 1e-9)
    yield Candidate("drag_coulomb", {}, "torque", drag, False, shows)
    yield Candidate("drag_viscous", {}, "coefficient", drag / speed, False, shows)
    yield Candidate("mesh_drag", {}, "coefficient", drag / speed, False, ("loss",), LATE)
    for exponent in EXPONENTS:
        yield Candidate("drag_power", {"exponent": exponent}, "coefficient", drag / speed**exponent, False, shows)
    for part in TIMES if rig.drag_torque else ():
        yield Candidate("drag_drift", {"time_constant": part * duration}, "relative_change", 1.0, False, shows)
    for part in SHAFTS:
        shape = {"shaft_speed": part * speed}
        yield Candidate("drag_differential", shape, "coefficient", drag / speed, False, shows)
    for order in range(1, highest + 1):
        yield Candidate("drag_position", {"order": order}, "amplitude", drag, True, shows)


def _impacts(rig: Rig) -> Iterator[Candidate]:
    shows, e = SHOWS["impact"], max(rig.restitution, 0.1)
    fall = max((2.0 * rig.drag_torque * rig.base_radius_loose / rig.inertia * rig.backlash) ** 0.5, 1e-9)
    yield Candidate("restitution_offset", {}, "offset", e, False, shows)
    yield Candidate("restitution_speed", {}, "slope", e / fall, False, shows)
    yield Candidate("restitution_asymmetry", {}, "asymmetry", e, False, shows)


def _sensors(rig: Rig, highest: int) -> Iterator[Candidate]:
    angle = rig.backlash / rig.base_radius_loose
    for gear, shows in (("drive", ("contact", "drive")), ("loose", ("contact", "flight"))):
        for order in range(1, highest + 1):
            shape = {"gear": gear, "order": order}
            yield Candidate("encoder_eccentricity", shape, "amplitude", angle, True, shows)
    late = angle / max(rig.mean_speed_loose, 1e-9)
    yield Candidate("encoder_skew", {"gear": "loose"}, "delay", late, False, ("contact",))


def _motions(rig: Rig, frequencies: tuple[float, ...], orders: tuple[float, ...]) -> Iterator[Candidate]:
    drag, ratio = max(rig.drag_torque, 1e-3 * rig.inertia), rig.base_radius_drive / rig.base_radius_loose
    tried = [("frequency", x, x) for x in frequencies]
    tried += [("order", x, x * abs(rig.mean_speed) / (2.0 * np.pi)) for x in orders if rig.mean_speed]
    for name, value, frequency in tried:
        unit = drag / (rig.inertia * ratio * 2.0 * np.pi * frequency)
        yield Candidate("drive_motion", {name: value}, "amplitude", unit, True, SHOWS["motion"])
