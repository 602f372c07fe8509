"""From gears and mounting to a meshing pair."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gears3d.gears.pair import Pair
    from gears3d.scenario.model import Gears, Mount


def mesh(gears: Gears, mount: Mount) -> Pair:
    """Return the pair of two gears, mounted.

    Args:
        gears: both gears.
        mount: backlash, centre distance, or both (then the teeth are thinned to fit).

    Raises:
        InputError: they do not mesh.
    """
    from gears3d.gears.pair import Pair

    drive, loose = gears.drive.gear(), gears.loose.gear()
    if mount.centre_distance is None:
        assert mount.backlash is not None
        return Pair.from_backlash(drive, loose, mount.backlash)
    if mount.backlash is None:
        return Pair.from_centre_distance(drive, loose, mount.centre_distance)
    return Pair.from_both(drive, loose, mount.centre_distance, mount.backlash)
