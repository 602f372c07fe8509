"""Tables of a gear that are more than one value: reliefs, deviations of profiles, how the teeth sit on their axis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gears3d.scenario import keys
from gears3d.scenario.reader import Reader

if TYPE_CHECKING:
    from gears3d.gears.deviation import Deviation, Misalignment, Mounting
    from gears3d.gears.gear import Relief


def relief(reader: Reader, written: Any, place: str) -> Relief | None:
    """Read a relief; one that takes nothing off is none.

    Args:
        reader: takes the faults.
        written: the table.
        place: its key path.
    """
    from gears3d.gears.gear import STARTS, Relief

    table = reader.table(written, place)
    if not isinstance(written, Mapping):
        return None
    values = reader.keys(table, place, keys.RELIEF)
    given = [name for name in STARTS if name in table]
    if len(given) != 1:
        held = f"has {' and '.join(given)}" if given else "has no start"
        reader.fault(f"{place}.{given[-1]}" if given else place, held, f"give one of {', '.join(STARTS)}")
        return None
    if values["amount"] is None or values["shape"] is None or values[given[0]] is None:
        return None
    return Relief(**values) if values["amount"] > 0.0 else None


Tables = dict[str, dict[str, Any]]


def tables(reader: Reader, written: Mapping[str, Any], place: str, known: Mapping[str, Any]) -> Tables:
    """Read those of some tables that are there and whole.

    Args:
        reader: takes the faults.
        written: the table that holds them.
        place: its key path.
        known: their keys, by name.
    """
    found = {}
    for name in known:
        if isinstance(written.get(name, ""), Mapping):
            values = reader.keys(written[name], f"{place}.{name}", known[name])
            if all(value is not None for value in values.values()):
                found[name] = values
        elif name in written:
            reader.table(written[name], f"{place}.{name}")
    return found


def deviations(which: Any, values: Tables) -> tuple[Deviation, ...]:
    """Return the deviations of a gear's profiles.

    Args:
        which: ``"drive"`` or ``"loose"``.
        values: as read, by name.
    """
    from gears3d.gears.deviation import FLANKS, ProfileSlope, ProfileWave

    kinds = {"profile_slope": ProfileSlope, "profile_wave": ProfileWave}
    return tuple(
        kinds[name](which, side, **{key: value for key, value in table.items() if key != "flank"})
        for name, table in values.items()
        for side in FLANKS
        if table["flank"] in ("both", side)
    )


def mounting(which: Any, values: Tables) -> tuple[Mounting, ...]:
    """Return how a gear's teeth sit on their axis.

    Args:
        which: ``"drive"`` or ``"loose"``.
        values: as read, by name.
    """
    from gears3d.gears.deviation import Eccentricity, Wobble

    kinds = {"eccentricity": Eccentricity, "wobble": Wobble}
    return tuple(kinds[name](which, **table) for name, table in values.items())


def misalignment(reader: Reader, section: Mapping[str, Any]) -> Misalignment | None:
    """Read the misalignment of the axes; none where it is not given.

    Args:
        reader: takes the faults.
        section: the table of the mount.
    """
    from gears3d.gears.deviation import Misalignment

    found = tables(reader, section, "mount", {"misalignment": keys.MISALIGNMENT})
    return Misalignment(**found["misalignment"]) if found else None
