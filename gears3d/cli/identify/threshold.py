"""``gears3d identify threshold``: the excitation at which contact is lost."""

from __future__ import annotations

from gears3d.cli.identify.shared import AsJson, Correct, Files, MapFile, Out, RequiredRig, admitted, answer


def threshold(
    files: Files,
    rig: RequiredRig,
    map_file: MapFile = None,
    correct: Correct = None,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Identify the excitation at which contact is lost, from sweeps up and down, and the drag that it stands for.

    A file holds a swing that slowly grows, falls or both; or one swing, files in the order of recording.

    Example: gears3d identify threshold sweep.parquet --rig rigaud-2020/fig5-20rpm --out threshold.png
    """
    from gears3d import identification as ident

    sweeps = []
    for record in admitted(files, rig, map_file, correct):
        assert record.rig is not None
        sweeps.append(ident.Sweep(record.recording, record.rig, record.file))
    answer(ident.identify_threshold(sweeps), ident.threshold_picture, out, as_json)
