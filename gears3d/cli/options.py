"""Arguments and options that several verbs share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

ScenarioName = Annotated[
    Path, typer.Argument(metavar="SCENARIO", help="Shipped scenario (gears3d list scenarios), or a TOML file.")
]
Rig = Annotated[
    Path | None,
    typer.Option(metavar="SCENARIO", help="Scenario of the test rig; required for measured records."),
]
RequiredRig = Annotated[
    Path, typer.Option("--rig", metavar="SCENARIO", help="Scenario of the test rig: shipped one, or a TOML file.")
]
MapFile = Annotated[Path | None, typer.Option("--map", help="record.toml that defines the channels.")]
Correct = Annotated[
    list[str] | None, typer.Option(metavar="KIND,...", help="Findings of the sensor gate to correct; repeatable.")
]
Overrides = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Override a value; repeatable.")
]
