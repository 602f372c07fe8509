"""The data sheet of a scenario's pair as a result."""

from __future__ import annotations

from dataclasses import dataclass

from gears3d.gears import Pair
from gears3d.gears.sheet import Quantity, data_sheet
from gears3d.results import Result
from gears3d.scenario import Scenario


@dataclass(frozen=True)
class DataSheet(Result):
    """The data sheet of a pair.

    Args:
        pair: the pair.
        quantities: its lines.
        speed: mean speed of the drive gear [rad/s].
        title: of the scenario.
        source: of the scenario.
    """

    pair: Pair
    quantities: tuple[Quantity, ...]
    speed: float = 0.0
    title: str = ""
    source: str = ""


def data_sheet_of(scenario: Scenario) -> DataSheet:
    """Return the data sheet of a scenario's pair, in the terms of ISO 21771."""
    pair, gears = scenario.pair(), scenario.gears
    quantities = data_sheet(pair, scenario.motion.mean, (gears.drive.density, gears.loose.density))
    return DataSheet(pair, tuple(quantities), scenario.motion.mean, scenario.title, scenario.source)
