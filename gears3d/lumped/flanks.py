"""Tables of the displacement that the flanks impose, over the drive's angle, from the gears' own surfaces."""

from __future__ import annotations

from math import lcm, pi
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gears3d.errors import Fault, InputError
from gears3d.gears import HarmonicDeviation, Misalignment, ToothDeviation
from gears3d.gears.rolling import rolled
from gears3d.gears.surface import compile_surfaces
from gears3d.lumped import layout
from gears3d.lumped.fitting import fit
from gears3d.lumped.tables import Table

if TYPE_CHECKING:
    from gears3d.gears import Pair
    from gears3d.gears.deviation import Deviation

Array = NDArray[np.float64]
ACCURACY = 1e-13  # of the polynomials, at the places tried [m]
NARROW = 1e-9  # shortest piece, in pitches


def flank_tables(pair: Pair, low: float, high: float) -> tuple[Table, Table]:
    """Return the displacement of the contact on the active and reverse flanks by deviations, reliefs and mounting.

    Both are tables over the drive's angle from ``low`` to ``high`` [rad], degree 7, in m: φ(θ) of the active flanks,
    −φ(θ) of the reverse ones. Where the period is shorter, tables repeat. Teeth out of mesh are an InputError.

    >>> from gears3d.gears import Gear, Pair, ToothDeviation
    >>> gear = Gear(3.5e-3, 30)
    >>> thick = Pair.from_backlash(gear, gear, 1e-4).with_deviations(ToothDeviation("drive", "active", 3, 1e-5))
    >>> active, reverse = flank_tables(thick, 0.0, 10.0)
    >>> active(np.array([0.0, 4 * np.pi / 30])).round(9).tolist(), len(reverse.pieces)
    ([0.0, 1e-05], 1)
    """
    pitch, period = 2.0 * pi / pair.drive.teeth, table_period(pair)
    repeats = period <= 1.02 * (high - low)
    first, last = (0, round(period / pitch)) if repeats else (np.floor(low / pitch) - 1, np.ceil(high / pitch) + 1)
    edges = pitch * np.arange(first, last + 1, dtype=np.float64)
    if repeats:
        edges[-1] = period
    surfaces = compile_surfaces(pair)

    def displacement(flank: int, theta: Array) -> Array:
        places = rolled(pair, surfaces, theta, flank)[0]
        return pair.backlash - places if flank else places

    tables = []
    for flank in (0, 1):
        try:
            knots, pieces = fit(lambda theta, flank=flank: displacement(flank, theta), edges, ACCURACY, NARROW * pitch)
        except ValueError as why:
            fault = Fault("gears", f"have flanks whose place jumps at {why} rad of the drive", "deviate less from true")
            raise InputError(fault) from why
        tables.append(Table(layout.THETA1, knots, pieces, period if repeats else 0.0))
    return tables[0], tables[1]


def table_period(pair: Pair) -> float:
    """Return the angle of the drive gear after which the flanks' displacements repeat [rad].

    It is one pitch when all teeth of both gears are the same and run true, a turn of the gear whose teeth do not, or
    the hunting period.

    >>> from gears3d.gears import Gear, Pair
    >>> table_period(Pair.from_backlash(Gear(2e-3, 20), Gear(2e-3, 30), 1e-4)) * 20 / (2 * pi)
    1.0
    """
    uneven = {one.gear for one in pair.deviations if not _same_on_all_teeth(pair, one)}
    uneven |= {one.gear for one in pair.mounting if not isinstance(one, Misalignment)}
    turns = [pair.gear(which).teeth for which in uneven]
    return 2.0 * pi * lcm(*turns) / pair.drive.teeth if turns else 2.0 * pi / pair.drive.teeth


def _same_on_all_teeth(pair: Pair, one: Deviation) -> bool:
    if isinstance(one, HarmonicDeviation):
        return one.order % pair.gear(one.gear).teeth == 0
    return not isinstance(one, ToothDeviation)


def perfect(pair: Pair) -> bool:
    """Whether a pair's flanks are perfect involutes on true axes, which need no table.

    >>> from gears3d.gears import Gear, Pair
    >>> perfect(Pair.from_backlash(Gear(2e-3, 20), Gear(2e-3, 30), 1e-4))
    True
    """
    shaped = ("tip_relief", "root_relief", "lead_crowning", "helix_slope")
    gears = (pair.drive, pair.loose)
    return not (pair.mounting or pair.deviations or any(getattr(gear, name) for gear in gears for name in shaped))
