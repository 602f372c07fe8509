"""What the flanks do to the motion when the gears roll on them without load: the excitation of a lumped model."""

from __future__ import annotations

from math import inf, lcm, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gears3d.errors import Fault, InputError
from gears3d.gears.surface import compile_surfaces, mates, surface_gap
from gears3d.kernels import njit

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair

Array = NDArray[np.float64]


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
    """
    if theta is None:
        count = round(hunting_period(pair) / (2.0 * pi) * pair.drive.teeth) * samples
        angles = np.linspace(0.0, hunting_period(pair), count, endpoint=False)
    else:
        angles = np.atleast_1d(np.asarray(theta, float)).ravel()
    if not np.isfinite(angles).all():
        raise InputError(Fault("theta", "holds angles that are not numbers", "give finite angles"))
    surfaces = compile_surfaces(pair)
    found = [roll(surfaces, angles, flank, flank * pair.backlash) for flank in (0, 1)]
    for name, (places, _, _) in zip(("active", "reverse"), found, strict=True):
        if not np.isfinite(places).all():
            lost = float(angles[~np.isfinite(places)][0])
            raise InputError(
                Fault("theta", f"= {lost:.6g} rad finds no {name} flanks in mesh", "bring the gears closer")
            )
    (active, teeth, height), (reverse, teeth_reverse, height_reverse) = found
    return QuasiStatic(
        angles,
        active,
        reverse - pair.backlash,
        reverse - active,
        np.c_[teeth, teeth_reverse],
        np.c_[height, height_reverse],
    )


@njit(cache=True)
def roll(surfaces, angles, flank, start):
    """Find the displacement at which the smallest gap vanishes, by Newton from that of the angle before.

    Args:
        surfaces: of the pair, compiled.
        angles: of the drive gear [rad], (n,).
        flank: 0 active, 1 reverse.
        start: displacement near that at the first angle [m].

    Returns:
        Displacements [m], NaN where no flanks are in mesh, (n,); numbers of the teeth that touch, drive and loose,
        (n, 2); where on the face [m], (n,).
    """
    base1, base2 = surfaces.shape.flanks.gears[0, 0], surfaces.shape.flanks.gears[1, 0]
    places, heights = np.full(angles.size, np.nan), np.zeros(angles.size)
    teeth = np.zeros((angles.size, 2), np.int64)
    place = start
    for i in range(angles.size):
        for _ in range(50):
            theta = (place + base1 * angles[i]) / base2
            pairs = mates(surfaces, angles[i], theta, flank)
            least, slope = inf, 1.0
            for k in range(pairs.shape[0]):
                found = surface_gap(surfaces, angles[i], theta, pairs[k, 0], pairs[k, 1], flank)
                if found[0] < least:
                    least, slope, heights[i] = found[0], found[2] / base2, found[8]
                    teeth[i, 0], teeth[i, 1] = pairs[k, 0], pairs[k, 1]
            if least == inf:
                place = start
                break
            step = least / slope
            place -= step
            if abs(step) < 1e-14:
                break
        if least < inf:
            places[i] = place
    return places, teeth, heights
