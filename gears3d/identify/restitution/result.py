"""What an identified law of restitution says: snippet for a scenario, warnings, arrays for its picture."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.identify.restitution.choosing import LEAST

if TYPE_CHECKING:
    from gears3d.identify.law import Parameter
    from gears3d.identify.restitution.fitting import Fit
    from gears3d.identify.restitution.pairs import Pairs

NARROW = 1.5
"""Ratio of fastest to slowest approach below which a slope does not show."""
POINTS = 60
"""Of the curves."""


def snippet(parameters: dict[str, Parameter]) -> str:
    """Return the law as TOML of a scenario; a scatter that may be none is left out.

    Args:
        parameters: of the law.
    """
    base = parameters["restitution"].value
    lines = ["[impact]", f"restitution = {min(max(base, 0.0), 1.0):.6g}"]
    effects = [("restitution_offset", "offset", "", base - min(max(base, 0.0), 1.0))]
    if "slope" in parameters:
        effects.append(("restitution_speed", "slope", "s/m", parameters["slope"].value))
    if "asymmetry" in parameters:
        effects.append(("restitution_asymmetry", "asymmetry", "", parameters["asymmetry"].value))
    if (spread := parameters.get("standard_deviation")) is not None and spread.low > 0.0:
        effects.append(("restitution_scatter", "standard_deviation", "", spread.value))
    for kind, key, unit, value in effects:
        if value:
            written = f'"{value:.6g} {unit}"' if unit else f"{value:.6g}"
            lines += ["[[effect]]", f'kind = "{kind}"', f"{key} = {written}"]
    return "\n".join(lines) + "\n"


def warnings(parameters: dict[str, Parameter], goodness: dict[str, Any]) -> tuple[str, ...]:
    """Return what the reader should know before relying on the law.

    Args:
        parameters: of the law.
        goodness: of it.
    """
    found = []
    missed, tested = goodness["unseen"], goodness["sliding"]
    if missed["impacts"] > missed["expected"] + 3.0 * np.sqrt(missed["expected"]) + 0.02 * missed["of"] + 2.0:
        found.append(
            f"{missed['impacts']} of {missed['of']} impacts show no rebound where the law expects"
            f" {missed['expected']:.1f}: some are plastic, or rebounds were overlooked"
        )
    if goodness["errors_over_stated"] > 2.0:
        found.append(f"speeds are {goodness['errors_over_stated']:.1f} times less certain than stated")
    if (
        tested["tested"]
        and tested["p_value"] < 0.01
        and abs(tested["change"]) > LEAST * parameters["restitution"].value
    ):
        found.append(f"restitution changes with the sliding speed (p = {tested['p_value']:.1g}): the law leaves it out")
    slow, fast = goodness["approach_m_s"]
    if fast < NARROW * slow:
        found.append(
            f"speeds of approach lie between {1e3 * slow:.3g} and {1e3 * fast:.3g} mm/s only:"
            " the law says nothing of others, record with other swings of the drive too"
        )
    if len(goodness["flanks"]) == 1:
        found.append(f"only the {next(iter(goodness['flanks']))} flank tells its law: an asymmetry would not show")
    if parameters["restitution"].high > 1.0 and "slope" not in parameters:
        found.append("the interval of restitution reaches beyond 1, where impacts would make energy")
    return tuple(found)


def curves(pairs: Pairs, best: Fit) -> dict[str, Any]:
    """Return arrays for the picture: pairs with errors, and the law with its 95 % band, by flank.

    Args:
        pairs: with rebounds that were seen.
        best: the law taken.
    """
    told: dict[str, Any] = {"deviation": best.deviation, "flanks": {}}
    for flank, name in enumerate(("active", "reverse")):
        own = pairs.only(pairs.flank == flank)
        if not len(own.time):
            continue
        speed = np.linspace(0.0, float(pairs.approach.max()), POINTS)
        filled = own.only(np.zeros(POINTS, int))._replace(approach=speed, sliding=np.full(POINTS, best.middle[1]))
        columns = best.terms.columns(filled, best.middle)
        mean = columns @ best.numbers
        half = best.quantile * np.sqrt(np.maximum(np.einsum("ki,ij,kj->k", columns, best.covariance, columns), 0.0))
        told["flanks"][name] = {
            "approach_m_s": own.approach,
            "rebound_m_s": own.rebound,
            "approach_sigma_m_s": own.approach_sigma,
            "rebound_sigma_m_s": own.rebound_sigma,
            "lowest_m_s": float(np.max(own.lowest)),
            "speed_m_s": speed,
            "mean": mean,
            "low": mean - half,
            "high": mean + half,
        }
    return told
