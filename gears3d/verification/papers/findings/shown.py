"""In which channel of a diagnosis an effect shows, and how large it is there."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.effects.rows import Code, Gate

if TYPE_CHECKING:
    from gears3d.effects import Rig

ROUND = np.linspace(0.0, 2 * pi, 361)


def shown(rig: Rig, effects: Sequence[Any]) -> str:
    """Return channel and size of effects of one cause at the rig's mean speed.

    Args:
        rig: claimed.
        effects: of one cause.

    >>> from gears3d.effects import Rig, catalogue
    >>> rig = Rig(0.148, 0.148, 0.0695, 0.22, 250e-6, 0.0, 3.14159, 90, 90)
    >>> shown(rig, [catalogue()["drag_coulomb"](torque=-0.0695)])
    'flight: deceleration −1 rad/s² (rig: 3.17)'
    >>> shown(rig, [catalogue()["transmission_error"](amplitude=5e-6)])
    'contact: 5 µm at order 1'
    """
    return "; ".join(filter(None, (_one(rig, effect) for effect in effects))) or "nothing"


def _one(rig: Rig, effect: Any) -> str:
    if effect.place == "torque":
        return _torque(rig, effect)
    if effect.place == "motion":
        speed, frequency, _ = effect.rows(rig)[0].p
        angle = abs(speed) / (2 * pi * frequency)
        return f"drive: {1e3 * angle:.3g} mrad at {frequency:.3g} Hz, {1e6 * angle * rig.base_radius_drive:.3g} µm"
    if effect.place == "geometry":
        size = next(getattr(effect, name) for name in ("amplitude", "offset") if hasattr(effect, name))
        order = f" at order {effect.order}" if hasattr(effect, "order") else ""
        return f"contact: {1e6 * abs(size):.3g} µm{order}" if size else "contact: the backlash"
    if effect.place == "sensor":
        if hasattr(effect, "delay"):
            return f"contact: {1e3 * effect.delay:.3g} ms of delay"
        return f"contact: {1e3 * effect.amplitude:.3g} mrad at order {effect.order}"
    if effect.place == "impact":
        names = ("offset", "asymmetry", "standard_deviation", "slope")
        name = next(each for each in names if hasattr(effect, each))
        return f"impact: restitution, {name.replace('_', ' ')} {getattr(effect, name):.2g}"
    return "flight and impact: paths beside a flank"


def _torque(rig: Rig, effect: Any) -> str:
    from gears3d.simulation.excitation import resisting

    row = effect.rows(rig)[0]
    if row.code == Code.TORQUE_FRICTION:
        return "loss: nothing where the flank force is zero"
    torque = np.broadcast_to(resisting(row, rig.mean_speed_loose, ROUND), ROUND.shape)
    largest = float(torque[np.argmax(np.abs(torque))]) / rig.inertia
    if row.gate == Gate.CONTACT:
        return f"loss: contact holds back by {largest * rig.base_radius_loose:.3g} m/s² more than flight"
    over = f" at order {effect.order} of the loose gear" if hasattr(effect, "order") else ""
    claimed = f" (rig: {rig.drag_torque / rig.inertia:.3g})" if rig.drag_torque else ""
    text = f"flight: deceleration {largest:.3g} rad/s²{over}{claimed}"
    return text.replace("-", "−")
