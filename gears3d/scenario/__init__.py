"""The question: a scenario file, checked once, as frozen SI data."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gears3d.scenario.build import Scenario as Scenario
from gears3d.scenario.build import build
from gears3d.scenario.document import Overrides, apply, read
from gears3d.scenario.models import GearSpec as GearSpec
from gears3d.scenario.models import Harmonic as Harmonic
from gears3d.scenario.models import Sensor as Sensor
from gears3d.scenario.models import Sensors as Sensors
from gears3d.scenario.models import eccentricities as eccentricities
from gears3d.scenario.models import flank_deviations as flank_deviations
from gears3d.scenario.models import solid_inertia as solid_inertia
from gears3d.scenario.starting import STARTERS as STARTERS


def load(path_or_text: str | Path | Mapping[str, Any], overrides: Overrides = ()) -> Scenario:
    """Read a scenario (format 1).

    Args:
        path_or_text: a file, the name of a shipped scenario (``gears3d list scenarios``), TOML text (anything with
            a line break or ``=``), or a mapping. An existing file wins over a name.
        overrides: ``{"motion.mean": "90 rpm"}``, pairs, or ``"KEY=VALUE"`` texts; keys dotted with [i].

    Returns:
        The scenario in SI units.

    Raises:
        InputError: carries *all* faults, each with file, key path and remedy.
        UsageError: neither file nor name nor text nor mapping, an override without ``=`` or with a malformed key.

    >>> load("base/rigaud-2020", ["drag.torque=0.46 N m"]).drag
    Drag(torque=0.46)
    """
    document = read(path_or_text)
    apply(document, overrides)
    return build(document)


def schema() -> dict[str, Any]:
    """Return the JSON Schema of format 1, effect kinds and their parameters included."""
    from gears3d.scenario.keys import schema as make

    return make()
