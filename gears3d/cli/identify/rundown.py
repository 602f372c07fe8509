"""``gears3d identify rundown``: the drag on a gear that runs down."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gears3d.cli.identify.shared import AsJson, Files, Out, Rig, answer


def rundown(
    files: Files,
    inertia: Annotated[str, typer.Option(help='Of what runs down, e.g. "0.0695 kg m^2".')] = "",
    inertia_uncertainty: Annotated[str, typer.Option(help='Its standard deviation, e.g. "0.002 kg m^2".')] = "",
    rig: Rig = None,
    out: Out = None,
    as_json: AsJson = False,
) -> None:
    """Identify the drag on a gear that runs down freely, out of mesh.

    Example: gears3d identify rundown rundown.parquet --inertia "0.0695 kg m^2" --out drag.png
    """
    from gears3d import identification

    found = identification.identify_rundown(files, *_inertia(inertia, inertia_uncertainty, rig))
    answer(found, identification.write_picture, out, as_json)


def _inertia(inertia: str, uncertainty: str, rig: Path | None) -> tuple[float, float]:
    from gears3d.errors import Fault, InputError
    from gears3d.scenario import load
    from gears3d.units import parse

    def quantity(text: str, key: str) -> float:
        try:
            value = parse(text, "inertia")
        except InputError as error:
            raise InputError([Fault(key, fault.message, fault.remedy) for fault in error.faults]) from None
        if value < 0.0 or (value == 0.0 and key == "--inertia"):
            raise InputError(Fault(key, f"is {text!r}; a body has mass", "give a positive inertia"))
        return value

    spread = quantity(uncertainty, "--inertia-uncertainty") if uncertainty else 0.0
    if inertia:
        return quantity(inertia, "--inertia"), spread
    if rig is None:
        remedy = 'give --inertia "0.0695 kg m^2" or --rig SCENARIO: a run-down knows only the ratio of drag and inertia'
        raise InputError(Fault("--inertia", "is missing", remedy))
    scenario = load(rig)
    return scenario.rig().inertia, spread or scenario.uncertainty.get("gears.loose.inertia", 0.0)
