"""``gears3d identify threshold``: the excitation at which contact is lost."""

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


def threshold(
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
    """Identify the excitation at contact loss from sweeps up and down, and the drag that follows from it.

    In a file the speed-fluctuation amplitude rises, falls or both, slowly; or it is constant, files in order of time.

    Example: gears3d identify threshold sweep.parquet --rig rigaud-2020/fig5-20rpm --plot threshold.png
    """
    from gears3d import identify as ident

    sweeps = []
    records = admitted(
        files, rig, map_file, correct, stated_motion=stated_motion, span=span_of(begin, to), overrides=set_
    )
    for record in records:
        assert record.rig is not None
        sweeps.append(ident.Sweep(record.recording, record.rig, record.file))
    answer(ident.identify_threshold(sweeps), out, plot, as_json, inputs_of(records))
