"""What a model does not take of a scenario: its gears, its effects, and what its own assumptions exclude."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from gears3d.errors import Fault, InputError
from gears3d.gears.deviation import GEARS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gears3d.gears import Pair
    from gears3d.scenario import Scenario

_TAKEN = "gears3d show, mesh and gears.quasi_static take it"


def refuse_unseen(scenario: Scenario, model: str) -> None:
    """Refuse mountings and deviations of gears that a model does not see.

    Args:
        scenario: what is simulated.
        model: its name.

    Raises:
        InputError: carries one fault for each.
    """
    file = "" if scenario.path is None else str(scenario.path)
    faults = [
        Fault(key, f"is not in the {model} model yet", f"leave it out{remedy}; {_TAKEN}", file)
        for key, remedy in (_UNSEEN[model](scenario) if model in _UNSEEN else ())
    ]
    if faults:
        raise InputError(faults)


def refusals(scenario: Scenario, model: str) -> list[Fault]:
    """Return a fault for everything in a scenario that a model does not take, without running it.

    Args:
        scenario: as loaded.
        model: its name.
    """
    faults: list[Fault] = []
    for check in (partial(refuse_unseen, model=model), _ASSUMPTIONS.get(model, lambda _: None)):
        try:
            check(scenario)
        except InputError as error:
            faults += error.faults
    return faults


def _of_plastic(scenario: Scenario) -> None:
    from gears3d.lumped.plastic import assumed

    assumed(scenario)


def _of_lubricated(scenario: Scenario) -> None:
    from gears3d.lumped.lubricated.model import refusals as own

    if faults := own(scenario):
        raise InputError(faults)


def _off_axis(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """Yield what needs more than one transverse section."""
    from gears3d.gears.mounting import Wobble

    for which in GEARS:
        if any(isinstance(item, Wobble) for item in getattr(scenario.gears, which).mounting):
            yield f"gears.{which}.wobble", ""
    if scenario.mount.misalignment is not None:
        yield "mount.misalignment", ""


def _beyond_perfect(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """Yield what moves the flanks of a model that takes them as perfect but for the scenario's effects."""
    from gears3d.gears.deviation import ProfileSlope
    from gears3d.gears.mounting import Eccentricity

    for which in GEARS:
        gear = getattr(scenario.gears, which)
        if any(isinstance(item, Eccentricity) for item in gear.mounting):
            yield f"gears.{which}.eccentricity", ", or give an effect of kind eccentricity"
        for kind in sorted({isinstance(item, ProfileSlope) for item in gear.deviations}):
            yield f"gears.{which}.profile_{'slope' if kind else 'wave'}", " or run --model bullet --twin none"
        if gear.helix_slope != 0.0:
            yield f"gears.{which}.helix_slope", ""
    reliefs = [
        f"gears.{which}.{name}"
        for which in GEARS
        for name in ("tip_relief", "root_relief")
        if getattr(scenario.pair().gear(which), name) is not None
    ]
    if reliefs and not _touching(scenario.pair()):
        yield reliefs[0], ", or shorten it until flanks without relief touch all along"
    yield from _off_axis(scenario)


def _touching(pair: Pair) -> bool:
    """Whether some flanks always touch where no relief takes anything off them."""
    from gears3d.gears.sheet_flanks import touching_ratio

    return touching_ratio(pair, 1e-9) + pair.overlap_ratio >= 1.0


_UNSEEN = {"plastic": _beyond_perfect}
"""What a model does not see; others take their flanks from the surfaces, the bullet one is made of them."""
_ASSUMPTIONS = {"plastic": _of_plastic, "lubricated": _of_lubricated}
"""What a model's own assumptions exclude; bullet and rigid take every effect and every motion."""
