"""Which deviations the flanks of a pair can carry."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gears3d.errors import Fault, InputError
from gears3d.gears.deviation import GEARS, HarmonicDeviation

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair


def steepest(pair: Pair, which: str) -> float:
    """Return the largest sum of |amplitude|·order² that the flanks of a gear can carry [m].

    The flank must stay convex with a radius of curvature of at least a twentieth of the perfect one's at the lower
    end of its working part, and touch its mate in one point for every angle.

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.

    Returns:
        The bound [m]; with k = centre distance · sin(working pressure angle) and ρ the smallest radius of curvature
        of the perfect flank it is the smaller of 0.8·k and the A for which k·A/(k + A) = 0.95·ρ.
    """
    reach = pair.path_length
    radius = 0.95 * max(pair.start_roll(which), 0.0) * pair.gear(which).base_radius
    return min(0.8 * reach, radius * reach / (reach - radius))


def clearance(pair: Pair) -> float:
    """Return the least backlash that the deviations leave [m].

    Args:
        pair: the pair.

    Returns:
        Least width of the dead band over all angles; gears of unlike tooth counts meet in every position, those of
        equal counts always in the same.
    """
    orders = [d.order for d in pair.deviations if isinstance(d, HarmonicDeviation)]
    theta = np.linspace(0.0, 2.0 * np.pi, 64 * (max(orders, default=0) + 1))
    material = {which: _material(pair, which, theta) for which in GEARS}
    if pair.drive.teeth == pair.loose.teeth:
        most = float(np.max(material["drive"] + material["loose"]))
    else:
        most = float(material["drive"].max() + material["loose"].max())
    return pair.backlash - most


def _material(pair: Pair, which: str, theta: NDArray[np.float64]) -> NDArray[np.float64]:
    """Material of both flanks together over the gear's angle, single teeth at their thickest."""
    total = np.zeros_like(theta)
    teeth: dict[tuple[str, int], float] = {}
    for deviation in pair.deviations:
        if deviation.gear != which:
            continue
        if isinstance(deviation, HarmonicDeviation):
            total += deviation.amplitude * np.cos(deviation.order * theta + deviation.phase)
        else:
            key = (deviation.flank, deviation.tooth)
            teeth[key] = teeth.get(key, 0.0) + deviation.offset
    for flank in ("active", "reverse"):
        total += max((offset for (side, _), offset in teeth.items() if side == flank), default=0.0)
    return total


def check_deviations(pair: Pair) -> None:
    """Refuse deviations that make no regular flank.

    Args:
        pair: the pair.

    Raises:
        InputError: a tooth that is not there, a harmonic too steep, or material that uses up the
            backlash.
    """
    steepness: dict[tuple[str, str], float] = {}
    for deviation in pair.deviations:
        if isinstance(deviation, HarmonicDeviation):
            key = (deviation.gear, deviation.flank)
            steepness[key] = steepness.get(key, 0.0) + abs(deviation.amplitude) * deviation.order**2
        elif not 1 <= deviation.tooth <= pair.gear(deviation.gear).teeth:
            teeth = pair.gear(deviation.gear).teeth
            raise InputError(Fault("tooth", f"is {deviation.tooth}", f"the {deviation.gear} gear has 1 to {teeth}"))
    for (which, flank), steep in steepness.items():
        _check_steepness(pair, which, flank, steep)
    left = clearance(pair)
    if left < 0.0:
        raise InputError(
            Fault(
                "backlash",
                f"is {pair.backlash * 1e6:g} um and the deviations take {(pair.backlash - left) * 1e6:.4g} um where "
                "they are thickest: the gears would jam",
                "give more backlash or smaller deviations",
            )
        )


def _check_steepness(pair: Pair, which: str, flank: str, steep: float) -> None:
    most = steepest(pair, which)
    if steep > most:
        teeth = pair.gear(which).teeth
        raise InputError(
            Fault(
                "amplitude",
                f"of the {which} gear's {flank} flanks is too large for its order: amplitude·order² adds up to "
                f"{steep * 1e3:.4g} mm, no regular flank beyond {most * 1e3:.4g} mm",
                f"at order {teeth} give at most {most / teeth**2 * 1e6:.3g} um",
            )
        )
