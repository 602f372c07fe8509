"""What the flanks do to the motion when the gears roll on them without load: the excitation of a lumped model."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, lcm, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gears3d.errors import EngineError, Fault, InputError
from gears3d.gears.deviation import FLANKS
from gears3d.gears.surface import Surfaces, compile_surfaces, mates, surface_gap
from gears3d.kernels import inner, njit

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair

Array = NDArray[np.float64]
# A step that makes a place count as found [m], as rounding allows: times of parting at zero curvature depend on it.
_SETTLED = 1e-15
_ROUNDING = 2.3e-16
_OFF = 1e-12  # Gap that may be left at a place [m]
_STRIDE = 0.25  # Longest step, in base pitches
_AT_ONCE = 256  # Angles after which a search may be interrupted
_NEWTON = 20  # So many steps Newton may take before the bracket is halved every other time


class QuasiStatic(NamedTuple):
    """Where the loose gear stands when it rests on one flank or the other, by the angle of the drive gear.

    Args:
        theta: angle of the drive gear [rad], (n,).
        phi_active: displacement along the line of action when the active flanks touch [m], (n,).
        phi_reverse: displacement when the reverse flanks touch, less the backlash of the perfect pair [m], (n,).
        backlash: distance of both positions, the dead band b(theta) [m], (n,).
        teeth: numbers of the teeth that touch: drive and loose on the active, drive and loose on the reverse flank,
            (n, 4).
        heights: where on the face they touch, active and reverse [m], (n, 2).
    """

    theta: Array
    phi_active: Array
    phi_reverse: Array
    backlash: Array
    teeth: NDArray[np.int64]
    heights: Array


def hunting_period(pair: Pair) -> float:
    """Return the angle of the drive gear after which the same teeth meet again [rad].

    Args:
        pair: the pair.

    >>> from gears3d.gears import Gear, Pair
    >>> round(hunting_period(Pair.from_backlash(Gear(2e-3, 20), Gear(2e-3, 30), 1e-4)) / (2 * pi), 12)
    3.0
    """
    return 2.0 * pi * lcm(pair.drive.teeth, pair.loose.teeth) / pair.drive.teeth


def quasi_static(pair: Pair, theta: ArrayLike | None = None, samples: int = 32) -> QuasiStatic:
    """Roll the gears on each flank under a vanishing load and return the displacement that the surfaces impose.

    Args:
        pair: the pair, spur or helical, with deviations, relief and mounting.
        theta: angles of the drive gear [rad], (n,); over one hunting period when not given.
        samples: number of angles a tooth pitch when ``theta`` is not given.

    Returns:
        The displacements; tips meet flanks with their edges where that comes first.

    Raises:
        InputError: angles that are not numbers, or teeth that come out of mesh.
        EngineError: a place that does not settle.
    """
    if theta is None:
        count = round(hunting_period(pair) / (2.0 * pi) * pair.drive.teeth) * samples
        angles = np.linspace(0.0, hunting_period(pair), count, endpoint=False)
    else:
        angles = np.atleast_1d(np.asarray(theta, float)).ravel()
    if not np.isfinite(angles).all():
        raise InputError(Fault("theta", "holds angles that are not numbers", "give finite angles"))
    surfaces = compile_surfaces(pair)
    found = [rolled(pair, surfaces, angles, flank) for flank in (0, 1)]
    (active, teeth, height), (reverse, teeth_reverse, height_reverse) = found
    return QuasiStatic(
        angles,
        active,
        reverse - pair.backlash,
        reverse - active,
        np.c_[teeth, teeth_reverse],
        np.c_[height, height_reverse],
    )


def rolled(
    pair: Pair, surfaces: Surfaces, angles: Array, flank: int, ticks: Callable[[], None] | None = None
) -> tuple[Array, NDArray[np.int64], Array]:
    """Return where the gears touch on one flank, or say at which angle they do not.

    Args:
        pair: the pair.
        surfaces: its surfaces, compiled.
        angles: of the drive gear [rad], (n,).
        flank: 0 active, 1 reverse.
        ticks: called now and then, to end early by an exception.

    Returns:
        As :func:`roll`.

    Raises:
        InputError: teeth that come out of mesh.
        EngineError: a place that does not settle.
    """
    parts = []
    for begin in range(0, max(angles.size, 1), _AT_ONCE):
        parts.append(roll(surfaces, angles[begin : begin + _AT_ONCE], flank, flank * pair.backlash))
        if ticks is not None:
            ticks()
    places, teeth, heights = (np.concatenate(each) for each in zip(*parts, strict=True))
    side = FLANKS[flank]
    if np.isnan(places).any():
        lost = float(angles[np.isnan(places)][0])
        raise InputError(Fault("theta", f"= {lost:.6g} rad finds no {side} flanks in mesh", "bring the gears closer"))
    if np.isinf(places).any():
        lost = float(angles[np.isinf(places)][0])
        raise EngineError(f"the {side} flanks do not come to rest at theta = {lost:.12g} rad: their gap jumps there")
    return places, teeth, heights


@njit(cache=True)
def roll(surfaces, angles, flank, start):
    """Find the displacement at which the smallest gap vanishes, by Newton within brackets from that before.

    The smallest gap of all pairs of teeth rises with the displacement on active flanks and falls on reverse ones.

    Returns:
        Displacements [m], NaN where no flanks are in mesh, infinite where the gap does not vanish where it changes its
        sign, (n,); numbers of the teeth that touch, drive and loose, (n, 2); where on the face [m], (n,).
    """
    base1, base2 = surfaces.shape.flanks.gears[0, 0], surfaces.shape.flanks.gears[1, 0]
    side, most = 1.0 - 2.0 * flank, _STRIDE * base1 * abs(surfaces.shape.flanks.gears[0, 1])
    places, heights = np.full(angles.size, np.nan), np.zeros(angles.size)
    teeth = np.zeros((angles.size, 2), np.int64)
    place, drift = start, 0.0
    for i in range(angles.size):
        low, high, least, by_drive, slope = -inf, inf, inf, 0.0, 0.0
        if i > 0:
            place += min(max(drift * (angles[i] - angles[i - 1]), -most), most)
        fine = max(_SETTLED, 4.0 * _ROUNDING * base1 * abs(angles[i]))
        for turn in range(200):
            theta = (place + base1 * angles[i]) / base2
            least, by_drive, slope, teeth[i, 0], teeth[i, 1], heights[i] = _smallest(surfaces, angles[i], theta, flank)
            if least == inf:
                break
            if least * side > 0.0:
                high = place
            else:
                low = place
            step = least * base2 / slope if slope != 0.0 else inf
            if abs(step) < fine or high - low < fine:
                if abs(step) < fine:
                    place, least = place - step, 0.0
                break
            step = min(max(step, -most), most)
            inside = low < place - step < high
            if not inside or (turn > _NEWTON and turn % 2 and high - low < inf):
                step = place - 0.5 * (low + high)
            place -= step
        if least == inf:
            place, drift = start, 0.0
        elif abs(least) < max(_OFF, 10.0 * fine):
            places[i], drift = place, -(base2 * by_drive / slope + base1)
        else:
            places[i], place, drift = inf, start, 0.0
    return places, teeth, heights


@inner
def _smallest(surfaces, theta_drive, theta_loose, flank):
    """Smallest gap of all pairs of teeth, its derivatives by both angles, tooth numbers and height."""
    pairs = mates(surfaces, theta_drive, theta_loose, flank)
    least, by_drive, by_loose, drive, loose, height = inf, 0.0, 0.0, 0, 0, 0.0
    for k in range(pairs.shape[0]):
        found = surface_gap(surfaces, theta_drive, theta_loose, pairs[k, 0], pairs[k, 1], flank)
        if found[0] < least:
            least, by_drive, by_loose, height = found[0], found[1], found[2], found[8]
            drive, loose = pairs[k, 0], pairs[k, 1]
    return least, by_drive, by_loose, drive, loose, height
