"""Which deviations the flanks of a pair can carry."""

from __future__ import annotations

from collections.abc import Sequence
from math import acos
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gears3d.errors import Fault, InputError
from gears3d.gears.deviation import (
    FLANKS,
    GEARS,
    Deviation,
    HarmonicDeviation,
    HelixSlope,
    ProfileSlope,
    ProfileWave,
    ToothDeviation,
)
from gears3d.gears.involute import inv

if TYPE_CHECKING:
    from gears3d.gears.arrays import Flanks
    from gears3d.gears.pair import Pair


CONVEX = 0.05
"""Part of the perfect flank's radius of curvature at the lower end of its working part that must be left everywhere."""
PARALLEL = 0.8
"""Part of centre distance · sin(working pressure angle) up to which a flank touches its mate in one point only."""
SAMPLES = 40
"""In a radian of the highest order, over which the bending of a flank is looked at."""


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
    radius = (1.0 - CONVEX) * max(pair.start_roll(which), 0.0) * pair.gear(which).base_radius
    return min(PARALLEL * reach, radius * reach / (reach - radius))


def clearance(pair: Pair, more: Sequence[Deviation] = ()) -> float:
    """Return the least backlash that the deviations leave [m].

    Args:
        pair: the pair.
        more: deviations besides those of the pair.

    Returns:
        Least width of the dead band over all angles; gears of unlike tooth counts meet in every position, those of
        equal counts always in the same.
    """
    deviations = (*pair.deviations, *more)
    orders = [d.order for d in deviations if isinstance(d, HarmonicDeviation)]
    theta = np.linspace(0.0, 2.0 * np.pi, 64 * (max(orders, default=0) + 1) + 1)
    material = {which: _material(pair, which, theta, deviations) for which in GEARS}
    if pair.drive.teeth == pair.loose.teeth:
        most = float(np.max(material["drive"] + material["loose"]))
    else:
        most = float(material["drive"].max() + material["loose"].max())
    return pair.backlash - most


def _material(
    pair: Pair, which: str, theta: NDArray[np.float64], deviations: Sequence[Deviation]
) -> NDArray[np.float64]:
    """Material of both flanks together over the gear's angle, single teeth at their thickest."""
    total = np.zeros_like(theta)
    teeth = np.zeros((2, pair.gear(which).teeth))
    for deviation in deviations:
        if deviation.gear != which:
            continue
        if isinstance(deviation, HarmonicDeviation):
            total += deviation.amplitude * np.cos(deviation.order * theta + deviation.phase)
        else:
            tooth = slice(None) if deviation.tooth is None else deviation.tooth - 1
            teeth[FLANKS.index(deviation.flank), tooth] += _thickest(deviation)
    return total + float(teeth.max(axis=1).sum())


def _thickest(deviation: ToothDeviation | ProfileSlope | ProfileWave | HelixSlope) -> float:
    if isinstance(deviation, ToothDeviation):
        return deviation.offset
    return abs(deviation.amplitude) if isinstance(deviation, ProfileWave) else 0.5 * abs(deviation.amount)


def check_deviations(pair: Pair) -> None:
    """Refuse deviations that make no regular flank.

    Args:
        pair: the pair.

    Raises:
        InputError: a tooth that is not there, a harmonic too steep, or material that uses up the backlash.
    """
    steep: dict[tuple[str, str], float] = {}
    for deviation in pair.deviations:
        if isinstance(deviation, HarmonicDeviation):
            key = (deviation.gear, deviation.flank)
            steep[key] = steep.get(key, 0.0) + abs(deviation.amplitude) * deviation.order**2
        elif deviation.tooth is not None and not 1 <= deviation.tooth <= pair.gear(deviation.gear).teeth:
            teeth = pair.gear(deviation.gear).teeth
            raise InputError(Fault("tooth", f"is {deviation.tooth}", f"the {deviation.gear} gear has 1 to {teeth}"))
    for (which, flank), size in steep.items():
        if size > steepest(pair, which) and not _stays_convex(pair, which, flank):
            _refuse_steepness(pair, which, flank, size)
    _check_profiles(pair, steep)
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


def refuse_crossed(pair: Pair) -> None:
    """Refuse teeth whose flanks cross below the tip circle, of which solids and hulls would be turned inside out.

    Args:
        pair: the pair, deviations included.

    Raises:
        InputError: the backlash or deviations take so much off that no tip is left.
    """
    for index, which in enumerate(GEARS):
        land, mine = tip_land(pair, which), [each for each in pair.deviations if each.gear == which]
        if land <= 0.0:
            raise InputError(
                Fault(
                    "backlash",
                    f"is {pair.backlash * 1e6:.6g} um at a centre distance of {pair.centre_distance * 1e3:.6g} mm: "
                    f"teeth of the {which} gear are thinned until their flanks cross below the tip, by "
                    f"{-land * 1e6:.4g} um",
                    "give less backlash, more centre distance or shorter teeth",
                )
            )
        # twice the sum: flanks that lean, as those of harmonics do, move their tips by more than the material there
        if 2.0 * sum(abs(_size(each)) for each in mine) < land:
            continue
        from gears3d.gears.flank import (  # most rigs are checked without kernels
            compile_pair,
            flank_point,
            roll_at_radius,
        )

        flanks, gear = compile_pair(pair), pair.gear(which)
        for tooth in range(1, gear.teeth + 1):
            at = []
            for side in range(2):
                x, y, *_ = flank_point(
                    flanks, index, side, tooth, roll_at_radius(flanks, index, side, tooth, gear.tip_radius)
                )
                at.append(np.arctan2(y, x))
            active, reverse = at
            left = gear.tip_radius * (np.mod(active - reverse + np.pi, 2.0 * np.pi) - np.pi)
            if not left > 0.0:
                raise InputError(
                    Fault(
                        f"{which}.deviations",
                        f"take more off tooth {tooth} than it has: a perfect tooth is {land * 1e6:.4g} um thick at its "
                        f"tip, with them the flanks overlap there by {-left * 1e6:.4g} um",
                        "give smaller deviations or backlash, or shorter teeth",
                    )
                )


def tip_land(pair: Pair, which: str) -> float:
    """Return how thick a perfect tooth of a gear is along its tip circle, thinning included [m].

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.
    """
    gear = pair.gear(which)
    return 2.0 * gear.tip_radius * (pair.half_angle(which) - inv(acos(gear.base_radius / gear.tip_radius)))


def _size(deviation: Deviation) -> float:
    if isinstance(deviation, ToothDeviation):
        return deviation.offset
    return deviation.amount if isinstance(deviation, ProfileSlope | HelixSlope) else deviation.amplitude


def _stays_convex(pair: Pair, which: str, flank: str) -> bool:
    """Return whether harmonics that add up to too much never do so where a tooth's working flank would be bent too far.

    The same that :func:`steepest` asks of any phases, asked of these.
    """
    from gears3d.gears.arrays import ACTIVE_START, PITCH
    from gears3d.gears.flank import compile_pair  # compiled kernels: most rigs do without them
    from gears3d.gears.support import full_support

    waves = [d for d in pair.deviations if isinstance(d, HarmonicDeviation) and (d.gear, d.flank) == (which, flank)]
    highest = max(wave.order for wave in waves)
    theta = np.linspace(0.0, 2.0 * np.pi, SAMPLES * highest + 1)
    bent = np.zeros_like(theta)
    for wave in waves:
        bent += wave.amplitude * wave.order**2 * np.cos(wave.order * theta + wave.phase)
    if np.abs(bent).max() > PARALLEL * pair.path_length:
        return False
    flanks, gear = compile_pair(pair), pair.gear(which)
    index, at = GEARS.index(which), FLANKS.index(flank)
    side, start = 1.0 - 2.0 * at, pair.start_roll(which)
    rolls = np.linspace(start, gear.tip_roll, max(int(SAMPLES * highest * (gear.tip_roll - start)), 2))
    least = CONVEX * start * gear.base_radius
    for tooth in range(1, gear.teeth + 1):
        for roll in rolls:
            u = flanks.gears[index, ACTIVE_START + at] - flanks.gears[index, PITCH] * (tooth - 1) - side * roll
            height, _, bend = full_support(flanks, index, at, tooth, u)
            if height + bend < least:
                return False
    return True


def _refuse_steepness(pair: Pair, which: str, flank: str, steep: float) -> None:
    most, teeth = steepest(pair, which), pair.gear(which).teeth
    raise InputError(
        Fault(
            "amplitude",
            f"of the {which} gear's {flank} flanks is too large for its order: amplitude·order² adds up to "
            f"{steep * 1e3:.4g} mm, no regular flank beyond {most * 1e3:.4g} mm",
            f"at order {teeth} give at most {most / teeth**2 * 1e6:.3g} um",
        )
    )


def _check_profiles(pair: Pair, steep: dict[tuple[str, str], float]) -> None:
    """Refuse deviations of profiles with which a flank would fold between the start of its active profile and tip."""
    if not any(isinstance(each, ProfileSlope | ProfileWave) for each in pair.deviations):
        return
    from gears3d.gears.arrays import LEAST_TURN
    from gears3d.gears.flank import compile_pair  # compiled kernels: most rigs are checked without them

    flanks = compile_pair(pair)
    for gear, which in enumerate(GEARS):
        for side, flank in enumerate(FLANKS):
            bent = steep.get((which, flank), 0.0)
            bent *= pair.path_length / (pair.path_length + bent)
            if _least_turn(flanks, gear, side, (1.0, bent)) >= LEAST_TURN:
                continue
            low, high = 0.0, 1.0
            for _ in range(30):
                middle = 0.5 * (low + high)
                fits = _least_turn(flanks, gear, side, (middle, bent)) >= LEAST_TURN
                low, high = (middle, high) if fits else (low, middle)
            name = "profile_wave" if flanks.waves[gear, side].any() else "profile_slope"
            raise InputError(
                Fault(
                    f"{which}.{name}",
                    f"bends the {flank} flanks back on themselves, with what else deviates there: no regular flank",
                    f"give at most {low:.2g} of these amounts" if low else "leave it out",
                )
            )


def _least_turn(flanks: Flanks, gear: int, flank: int, sizes: tuple[float, float]) -> float:
    """Return the least turning of a flank's normal by the roll angle at a share of its profile deviations, at worst.

    Args:
        flanks: the arrays of a pair.
        gear: 0 drive, 1 loose.
        flank: 0 active, 1 reverse.
        sizes: share of the deviations, and by how much harmonics may shorten the radius of curvature [m].
    """
    from gears3d.gears.arrays import ACTIVE_PROFILE, FLOOR, FORM_ROLL, PROFILE_REACH, steepness
    from gears3d.gears.support import relieved

    share, bent = sizes
    row, base = flanks.gears[gear], flanks.gears[gear, 0]
    rise, bend, most = (
        share * each for each in steepness(flanks.slopes[gear, flank], flanks.waves[gear, flank], row[PROFILE_REACH])
    )
    if row[FLOOR + flank] > max(row[ACTIVE_PROFILE], row[FORM_ROLL]) and share == 1.0:
        return 0.0
    least = 1.0
    for roll in np.linspace(row[ACTIVE_PROFILE], row[ACTIVE_PROFILE] + row[PROFILE_REACH], 129):
        taken, fall, curl = relieved(flanks, gear, float(roll))
        radius, slope = base * roll - taken - most - bent, fall + rise
        if radius <= 0.0:
            return 0.0
        least = min(least, 1.0 + ((curl - bend) * radius - abs(slope) * base) / (radius**2 + slope**2))
    return least
