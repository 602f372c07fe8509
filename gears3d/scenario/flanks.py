"""What a scenario's effects do to the gears: rows of the geometry as deviations and mountings of a pair."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from gears3d.effects import Code, Flank, Gear, Row

if TYPE_CHECKING:
    from gears3d.gears import Eccentricity, HarmonicDeviation, ToothDeviation


def flank_deviations(rows: Iterable[Row]) -> list[HarmonicDeviation | ToothDeviation]:
    """Return the flank rows of a scenario as deviations of the gears' surfaces.

    Args:
        rows: of all effects; those of other forms are left out.

    >>> from gears3d.effects.rows import flank_tooth
    >>> flank_deviations((flank_tooth(Gear.LOOSE, Flank.ACTIVE, 3, 1e-5),))
    [ToothDeviation(gear='loose', flank='active', tooth=3, offset=1e-05)]
    """
    from gears3d.gears import HarmonicDeviation, ToothDeviation

    found: list[HarmonicDeviation | ToothDeviation] = []
    for row in rows:
        if row.code not in (Code.FLANK_HARMONIC, Code.FLANK_TOOTH):
            continue
        gear: Any = Gear(int(row.p[0])).name.lower()
        flank: Any = Flank(int(row.p[1])).name.lower()
        if row.code == Code.FLANK_HARMONIC:
            found.append(HarmonicDeviation(gear, flank, int(row.p[2]), row.p[3], row.p[4]))
        else:
            found.append(ToothDeviation(gear, flank, int(row.p[2]), row.p[3]))
    return found


def eccentricities(rows: Iterable[Row]) -> list[Eccentricity]:
    """Return the eccentric teeth of a scenario as mountings of its gears.

    Args:
        rows: of all effects; those of other forms are left out.

    >>> from gears3d.effects.rows import flank_eccentric
    >>> eccentricities((flank_eccentric(Gear.LOOSE, 2e-5, 0.5),))
    [Eccentricity(gear='loose', offset=2e-05, phase=0.5)]
    """
    from gears3d.gears import Eccentricity

    found = []
    for row in rows:
        if row.code == Code.FLANK_ECCENTRIC:
            gear: Any = Gear(int(row.p[0])).name.lower()
            found.append(Eccentricity(gear, row.p[1], row.p[2]))
    return found
