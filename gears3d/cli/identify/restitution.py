"""``gears3d identify restitution``: the coefficient of restitution."""

from __future__ import annotations

from gears3d.cli.identify.shared import (
    AsJson,
    Correct,
    Files,
    MapFile,
    Out,
    RequiredRig,
    StatedMotion,
    admitted,
    answer,
    inputs_of,
)


def restitution(
    files: Files,
    rig: RequiredRig,
    map_file: MapFile = None,
    correct: Correct = None,
    stated_motion: StatedMotion = False,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Identify the law of restitution from rattle records of one rig: constant or linear in speed, flanks, scatter.

    Example: gears3d identify restitution rattle.parquet --rig rigaud-2020/fig5-20rpm --out e.png
    """
    from gears3d.identify import identify_restitution, restitution_picture
    from gears3d.measured.segmentation import measure

    records = admitted(files, rig, map_file, correct, stated_motion=stated_motion)
    found = [measure(one.recording, one.rig, one.file, motion=one.motion) for one in records]
    bench = next(one.rig for one in records if one.rig is not None)
    law = identify_restitution(found, bench.rig())
    answer(law, restitution_picture, out, as_json, inputs_of(records))
