"""``gears3d identify transmission-error``: orders of both flanks from contact."""

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


def transmission_error(
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
    """Identify the transmission error of both flanks, order by order, from slow revolutions forward and back.

    Example: gears3d identify transmission-error slow.parquet --rig rigaud-2020/fig2 --plot ste.png
    """
    from gears3d.identify import identify_transmission_error

    records = admitted(
        files, rig, map_file, correct, stated_motion=stated_motion, span=span_of(begin, to), overrides=set_
    )
    answer(identify_transmission_error(records), out, plot, as_json, inputs_of(records))
