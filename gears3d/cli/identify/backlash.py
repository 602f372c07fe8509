"""``gears3d identify backlash``: the distance of both flanks."""

from __future__ import annotations

from gears3d.cli.identify.shared import (
    AsJson,
    Begin,
    Correct,
    End,
    Files,
    MapFile,
    OutFolder,
    Plot,
    RequiredRig,
    RigOverrides,
    StatedMotion,
    admitted,
    answer,
    inputs_of,
    span_of,
)


def backlash(
    files: Files,
    rig: RequiredRig,
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
    """Identify the mean backlash and its orders from slow revolutions forward and back.

    Example: gears3d identify backlash slow.parquet --rig rigaud-2020/fig2 --plot backlash.png
    """
    from gears3d.identify import identify_backlash

    records = admitted(
        files, rig, map_file, correct, stated_motion=stated_motion, span=span_of(begin, to), overrides=set_
    )
    answer(identify_backlash(records), out, plot, as_json, inputs_of(records))
