"""``gears3d identify restitution``: the coefficient of restitution."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from gears3d.cli.identify.shared import (
    AsJson,
    Begin,
    Correct,
    End,
    Files,
    MapFile,
    OutFolder,
    Plot,
    StatedMotion,
    admitted,
    answer,
    inputs_of,
    span_of,
)
from gears3d.cli.options import Rig, RigOverrides, load_rig

_REPEATED = re.compile(r"\s*\((\d+)\)$")
"""A column whose name occurs again, as readers number it: another drop in the same table."""
if TYPE_CHECKING:
    from gears3d.identify.restitution_list import ImpactList
    from gears3d.measured.readers import Signal, Source


def restitution(
    files: Files,
    rig: Rig = None,
    map_file: MapFile = None,
    correct: Correct = None,
    begin: Begin = "",
    to: End = "",
    stated_motion: StatedMotion = False,
    set_: RigOverrides = None,
    out: OutFolder = None,
    plot: Plot = None,
    as_json: AsJson = False,
) -> None:
    """Identify the law of restitution from rattle records of one rig: constant or linear in speed, flanks, scatter.

    Without --rig from lists of impacts: speeds before and after, times of bounces or heights of bounces.

    Example: gears3d identify restitution rattle.parquet --rig rigaud-2020/fig5-20rpm --plot e.png

    From a list: gears3d identify restitution bounces.csv
    """
    from gears3d.errors import UsageError
    from gears3d.identify import identify_restitution
    from gears3d.identify.restitution_list import identify_restitution_list
    from gears3d.measured.segmentation import measure

    if rig is None:
        load_rig(rig, set_)  # refuses --set alone
    if rig is None and map_file is None and (lists := _lists(files)):
        answer(identify_restitution_list(lists), out, plot, as_json, files)
        return
    if rig is None:
        from gears3d.identify.restitution_list import EXPECTED

        raise UsageError(f"Missing option '--rig' for rattle records; a list of impacts needs none, but {EXPECTED}")
    records = admitted(
        files, rig, map_file, correct, stated_motion=stated_motion, span=span_of(begin, to), overrides=set_
    )
    found = [measure(one.recording, one.rig, one.file, motion=one.motion) for one in records]
    bench = next(one.rig for one in records if one.rig is not None)
    law = identify_restitution(found, bench.rig())
    answer(law, out, plot, as_json, inputs_of(records))


def _lists(files: Sequence[Path]) -> list[ImpactList]:
    """Return the lists of impacts that the files are; none where one of them is a record."""
    from gears3d.measured.readers import open_source

    found: list[ImpactList] = []
    for path in files:
        if path.suffix.lower() == ".toml" or path.is_dir():
            return []
        source = open_source(path)
        groups: dict[tuple[str, str], list[Signal]] = {}
        for each in source.signals:
            if each.numeric:
                repeat = _REPEATED.search(each.bare)
                groups.setdefault((each.label.rpartition("/")[0], repeat[1] if repeat else ""), []).append(each)
        lists = [one for signals in groups.values() if (one := _list(source, signals)) is not None]
        if not lists:
            return []
        found += lists
    return found


def _list(source: Source, signals: Sequence[Signal]) -> ImpactList | None:
    """Return the list of impacts that the signals of a group are, in SI units."""
    from gears3d.errors import Fault, InputError
    from gears3d.identify.restitution_list import FAMILIES, list_of, roles_of
    from gears3d.measured.readers.unit import to_si
    from gears3d.recording.columns import unit_of
    from gears3d.units import parse_any

    names = [_REPEATED.sub("", each.bare) for each in signals]
    own = {role: signals[place] for role, place in roles_of(names).items()}
    if not own:
        return None
    columns, linear = {}, True
    loaded = source.load([each.name for each in own.values()], None)
    for role, signal in own.items():
        unit = signal.told_unit or _ending(signal.label) or unit_of(signal.label)
        factor = 1.0
        if unit and role in FAMILIES:
            try:
                if FAMILIES[role] == "time":
                    factor = to_si(unit, ("time",))[0]
                else:
                    families = ("speed", "velocity") if FAMILIES[role] == "speed" else ("length",)
                    factor, family = parse_any(f"1 {unit}", families)
                    linear = linear and family != "speed"
            except InputError as error:
                faults = [Fault(signal.name, one.message, one.remedy, source.file) for one in error.faults]
                raise InputError(faults) from error
        columns[role] = loaded[signal.name] * factor
    return list_of(columns, linear, source.file)


def _ending(name: str) -> str:
    """Return a unit that ends a name and that the contract does not have."""
    endings = {"_mm_s": "mm/s", "_mm": "mm", "_cm": "cm", "_ms": "ms"}
    return next((unit for end, unit in endings.items() if name.endswith(end)), "")
