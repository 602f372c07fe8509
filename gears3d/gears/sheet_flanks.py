"""Lines of the data sheet on what makes flanks and axes differ from perfect ones; only what there is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import hypot, tan
from typing import TYPE_CHECKING

import numpy as np

from gears3d.gears.arrays import steepness
from gears3d.gears.clearance import mounted_band
from gears3d.gears.deviation import FLANKS, GEARS, HelixSlope, ProfileSlope
from gears3d.gears.flank import compile_pair
from gears3d.gears.limits import clearance
from gears3d.gears.mounting import Eccentricity, Misalignment, Wobble
from gears3d.gears.rack import form
from gears3d.gears.support import relieved

if TYPE_CHECKING:
    from gears3d.gears.gear import Gear
    from gears3d.gears.pair import Pair

Line = tuple[str, str, str, str, tuple[float | None, ...], str]
"""Group, name, symbol, unit family, values and source of a line of a data sheet."""
WITHIN = 1e-6
"""How far apart flanks may stand without load to count as touching [m]."""


def flank_lines(pair: Pair) -> Iterator[Line]:
    """Yield what is taken off the flanks on purpose, how they deviate and how they are mounted.

    Args:
        pair: the pair.

    Source: ISO 21771:2007, flank modifications; ISO 1328-1:2013, flank deviations; ISO/TR 10064-3:1996, axes.
    """
    yield from _modifications(pair)
    yield from _deviations(pair)
    yield from _mounting(pair)


def touching_ratio(pair: Pair, within: float = WITHIN) -> float:
    """Return the transverse contact ratio of the stretch of the path where reliefs leave the flanks almost in contact.

    Args:
        pair: the pair; deviations and mounting do not enter.
        within: how far apart the flanks may stand without load [m].

    Returns:
        Length of that stretch over the base pitch; the transverse contact ratio where nothing is relieved.

    >>> from gears3d.gears import Gear, Pair, Relief
    >>> gear = Gear(3.5e-3, 90, tip_relief=Relief(20e-6, length=4e-3))
    >>> pair = Pair.from_backlash(gear, gear, 250e-6)
    >>> round(pair.contact_ratio, 3), round(touching_ratio(pair), 3)
    (1.738, 1.002)
    """
    flanks, drive, loose = compile_pair(pair), pair.drive, pair.loose
    start = pair.path_length - loose.base_radius * loose.tip_roll
    places = np.linspace(start, drive.base_radius * drive.tip_roll, 20001)
    apart = np.array(
        [
            relieved(flanks, 0, place / drive.base_radius)[0]
            + relieved(flanks, 1, (pair.path_length - place) / loose.base_radius)[0]
            for place in places
        ]
    )
    return float(np.mean(apart <= within)) * pair.contact_ratio


def _modifications(pair: Pair) -> Iterator[Line]:
    group, gears = "flank modifications", (pair.drive, pair.loose)

    def lines(name: str, symbol: str, value: Callable[[str, Gear], float | None], source: str) -> Iterator[Line]:
        values = tuple(value(which, gear) for which, gear in zip(GEARS, gears, strict=True))
        if any(values):
            yield group, name, symbol, "length", values, source

    yield from lines("tip relief", "C_αa", lambda _, gear: _amount(gear, "tip_relief"), "ISO 21771:2007")
    yield from lines(
        "diameter at the start of the tip relief", "d_Ca", lambda which, gear: _start(pair, which, "tip_relief"), ""
    )
    yield from lines("root relief", "C_αf", lambda _, gear: _amount(gear, "root_relief"), "ISO 21771:2007")
    yield from lines(
        "diameter at the start of the root relief", "d_Cf", lambda which, gear: _start(pair, which, "root_relief"), ""
    )
    if any(gear.tip_relief or gear.root_relief for gear in gears):
        name = "transverse contact ratio within 1 um without load"
        yield group, name, "ε_α,1", "ratio", (touching_ratio(pair),), "relief counted; (90) does not"
    yield from lines("lead crowning", "C_β", lambda _, gear: gear.lead_crowning or None, "ISO 21771:2007")


def _amount(gear: Gear, key: str) -> float | None:
    relief = getattr(gear, key)
    return relief.amount if relief is not None else None


def _start(pair: Pair, which: str, key: str) -> float | None:
    gear, relief = pair.gear(which), getattr(pair.gear(which), key)
    if relief is None:
        return None
    lowest = form(gear, pair.half_angle(which))[0]
    inwards = 1.0 if key == "tip_relief" else -1.0
    return 2.0 * gear.base_radius * hypot(1.0, relief.start(gear, gear.tip_roll if inwards > 0 else lowest, inwards))


def _deviations(pair: Pair) -> Iterator[Line]:
    """Largest of all teeth where single ones deviate."""
    group, flanks = "flank deviations", compile_pair(pair)
    helix = np.zeros((2, 2, max(pair.drive.teeth, pair.loose.teeth)))
    for gear, which in enumerate(GEARS):
        helix[gear] += pair.gear(which).helix_slope * np.array([[1.0], [-1.0]])
    slope = np.zeros_like(helix)
    for each in pair.deviations:
        if isinstance(each, HelixSlope | ProfileSlope):
            table = helix if isinstance(each, HelixSlope) else slope
            teeth = slice(None) if each.tooth is None else each.tooth - 1
            table[GEARS.index(each.gear), FLANKS.index(each.flank), teeth] += each.amount
    form_of = np.zeros((2, 2, 1))
    for gear in (0, 1):
        for side in (0, 1):
            form_of[gear, side] = 2.0 * steepness(np.zeros(1), flanks.waves[gear, side], 1.0)[2]
    tables = (("profile slope deviation", "f_Hα", slope), ("profile form deviation", "f_fα", form_of))
    for name, symbol, table in (*tables, ("helix slope deviation", "f_Hβ", helix)):
        for side, flank in enumerate(FLANKS):
            rows = table[:, side]
            values = tuple(float(row[np.argmax(np.abs(row))]) for row in rows)
            if any(values):
                yield group, f"{name}, {flank} flanks", f"{symbol},{flank}", "length", values, "ISO 1328-1:2013"


def _mounting(pair: Pair) -> Iterator[Line]:
    group = "mounting"
    for name, symbol, family, kind in (
        ("eccentricity of the teeth", "e", "length", Eccentricity),
        ("wobble of the teeth", "γ", "angle", Wobble),
    ):
        sums = [0j, 0j]
        for item in pair.mounting:
            if isinstance(item, kind):
                size = item.offset if isinstance(item, Eccentricity) else item.angle
                sums[GEARS.index(item.gear)] += size * np.exp(1j * item.phase)
        if any(sums):
            yield group, name, symbol, family, (float(abs(sums[0])), float(abs(sums[1]))), ""
    width = min(pair.drive.face_width, pair.loose.face_width)
    axes = [item for item in pair.mounting if isinstance(item, Misalignment)]
    for name, symbol, angles in (
        ("misalignment of the axes in their plane", "f_Σδ", [item.in_plane for item in axes]),
        ("misalignment of the axes across it", "f_Σβ", [item.out_of_plane for item in axes]),
    ):
        if any(angles):
            leaning = width * sum(tan(angle) for angle in angles)
            yield group, name, symbol, "length", (leaning,), "ISO/TR 10064-3:1996, over the face width"
    sloped = any(gear.helix_slope for gear in (pair.drive, pair.loose))
    if pair.mounting or pair.deviations or sloped:
        least = mounted_band(pair)[0] - (pair.backlash - clearance(pair))
        yield (
            group,
            "least backlash, with mounting and deviations",
            "j_bt,min",
            "length",
            (least,),
            "over all positions",
        )
