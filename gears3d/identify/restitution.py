"""The law of restitution from measured impacts: coefficient over approach speed, by flank, with scatter."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import t

from gears3d.errors import Fault, InputError
from gears3d.identify.impact_pairs import Measured, Pairs, blind, impact_durations, misplaced, pairs_of
from gears3d.identify.law import Identified, Parameter
from gears3d.identify.restitution_fit import LEAST, NARROW, Fit, choose, fit, scatter_interval, unseen
from gears3d.recording import FLANKS

if TYPE_CHECKING:
    from gears3d.effects import Rig
    from gears3d.identify.impact_pairs import Pairs
    from gears3d.identify.law import Parameter
    from gears3d.identify.restitution_fit import Fit

NARROWEST = 0.05  # Range of sliding speeds over their mean, below which nothing is tested


def sliding_test(pairs: Pairs, best: Fit) -> dict[str, Any]:
    """Return the slope of restitution with the sliding speed, in addition to the selected law.

    The law keeps its other terms, so that what is due to the approach or the flank is not taken for sliding.

    Source: Kadmiri et al. 2012, section 3.1: no influence of the sliding velocity.
    """
    low, high = (float(x) for x in np.quantile(pairs.sliding, (0.05, 0.95)))
    middle = float(np.mean(pairs.sliding))
    if not high - low > NARROWEST * middle or len(pairs.time) < 5 + len(best.numbers):
        why = f"sliding speeds lie between {low:.3g} and {high:.3g} m/s only: record at several speeds of the drive"
        return {"tested": False, "why": why, "range_m_s": [low, high]}
    found = fit(pairs, best.terms._replace(sliding=True))
    slope = float(found.numbers[-1]) / middle
    error = float(np.sqrt(max(found.covariance[-1, -1], 0.0))) / middle
    freedom = max(found.count - len(found.numbers) - 1, 1)
    half = found.quantile * error
    return {
        "tested": True,
        "slope": {"value": slope, "unit": "s/m", "ci95": [slope - half, slope + half]},
        "p_value": float(2.0 * t.sf(abs(slope) / max(error, 1e-300), freedom)),
        "range_m_s": [low, high],
        "change": slope * (high - low),
        "change_bound": (abs(slope) + half) * (high - low),
    }


POINTS = 60  # Of the curves


def snippet(parameters: dict[str, Parameter]) -> str:
    """Return the law as TOML of a scenario; a scatter that may be zero is omitted."""
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
    """Return the warnings about the law."""
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
            " the law says nothing of others, record other fluctuation amplitudes as well"
        )
    if len(goodness["flanks"]) == 1:
        found.append(f"only the {next(iter(goodness['flanks']))} flank tells its law: an asymmetry would not show")
    if parameters["restitution"].high > 1.0 and "slope" not in parameters:
        found.append("the interval of restitution reaches beyond 1, where impacts would make energy")
    return tuple(found)


# Name in the curves of impacts of no gear, which are on no flank.
IMPACTS = "impacts of the list"


def curves(pairs: Pairs, best: Fit) -> dict[str, Any]:
    """Return arrays for the picture: pairs with errors, and the law with its 95 % band, by flank."""
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


FEWEST = 12  # Pairs of speeds that a law needs
REACH = 0.8  # Part of a typical coefficient at which an impact's threshold of sight may lie; weaker impacts tell little
STILL = 8  # Impacts without any rebound that show a plastic one


def identify_restitution(measured: Sequence[Measured], rig: Rig) -> Identified:
    """Identify the law of restitution from measured rattle records.

    A rebound is seen only where the flight after it rises high enough. Rebounds below the threshold above which all are
    seen are excluded, and the likelihood is that of the rest; errors of both speeds, scatter beyond them and a
    coefficient held within 0 and 1 are part of it.

    Args:
        measured: records of one bench, as ``gears3d.measured.segmentation.measure`` gives them.
        rig: gears of the bench.

    Returns:
        ``restitution`` (at rest, where it falls with the speed), ``slope`` [s/m], ``asymmetry`` and
        ``standard_deviation``, those that the law has.

    Raises:
        InputError: the records show too few rebounds.

    Source: Kadmiri et al. 2012, eq. (3) and fig. 7; Rigaud & Perret-Liaudet 2020, eq. (16).
    Theory: docs/theory/identification.md, equation (2).
    """
    every, left_out = _believed(measured, pairs_of(measured, rig))
    chosen = within_sight(every)
    if (dark := blind(chosen)) is not None:
        left_out += (f"rebounds from the {FLANKS[dark]} flank are missed: its speeds are excluded",)
        chosen = chosen.only(chosen.flank != dark)
    pairs = chosen.only(chosen.seen)
    if len(pairs.time) < FEWEST:
        if (still := _plastic(every)) is not None:
            return still
        raise InputError(_too_few(every, pairs, left_out))
    best, fits, scores = choose(pairs)
    parameters = _parameters(best, pairs)
    goodness: dict[str, Any] = {
        "held_out": {name: -2.0 * float(score.mean()) for name, score in scores.items()},
        "pairs": len(pairs.time),
        "flanks": _flanks(pairs, best),
        "approach_m_s": [float(np.min(pairs.approach)), float(np.max(pairs.approach))],
        "unseen": _unseen(chosen, best),
        "errors_over_stated": float(np.hypot(*best.errors)),
        "errors_repeated": best.repeats,
        "tested": _tested(pairs, best, fits),
        "sliding": sliding_test(pairs, best),
        "impact_duration": impact_durations(measured),
    }
    return Identified(
        best.terms.name,
        parameters,
        goodness,
        snippet(parameters),
        curves(pairs, best),
        left_out + warnings(parameters, goodness),
    )


def _believed(measured: Sequence[Measured], every: Pairs) -> tuple[Pairs, tuple[str, ...]]:
    """Return the impacts on flanks whose place is consistent with them, and what was excluded."""
    notes, good = [], np.ones(len(every.time), bool)
    for index, one in enumerate(measured):
        for flank, depth in misplaced(one.segments.flights).items():
            own = (every.record == index) & (every.flank == flank)
            good &= ~own
            where = f" of record {index + 1}" if len(measured) > 1 else ""
            what = f"the {FLANKS[flank]} flank{where} is misplaced by {1e6 * depth:.3g} um, according to its impacts"
            notes.append(f"{what}: its speeds are excluded")
    return every.only(good), tuple(notes)


def within_sight(every: Pairs) -> Pairs:
    """Return the impacts whose approach is fast enough for a typical rebound to be seen.

    They are chosen by their approach alone, so that no rebound is preferred.
    """
    cut = every.lowest / every.approach
    seen = every.seen
    if not seen.any():
        return every.only(np.zeros(len(cut), bool))
    clear = seen & (cut <= np.quantile(cut[seen], 0.3))
    typical = float(np.median(every.rebound[clear] / every.approach[clear]))
    return every.only(cut < REACH * typical)


def _too_few(every: Pairs, pairs: Pairs, left_out: tuple[str, ...]) -> Fault:
    lowest = float(np.min(every.lowest, initial=np.inf))
    fastest = float(np.max(every.approach, initial=0.0))
    if np.isfinite(lowest) and fastest > 0.0 and lowest >= fastest:
        what = f"has {len(every.time)} impacts, but no impact is fast enough for its rebound to be seen"
        what += f": they approach with {1e3 * float(np.min(every.approach)):.3g} to {1e3 * fastest:.3g} mm/s, and only "
        what += f"rebounds above {1e3 * lowest:.3g} mm/s rise above the noise; {FEWEST} are needed"
    else:
        above = f"above {1e3 * lowest:.3g} mm/s, where none is overlooked" if np.isfinite(lowest) else "in a row"
        what = f"shows {len(pairs.time)} of {len(every.time)} impacts with a rebound {above}; {FEWEST} are needed"
    what = "; ".join([what, *left_out])
    remedy = (
        "record longer, with a larger fluctuation amplitude, or with more counts; or `gears3d diagnose`, which fits "
    )
    return Fault("restitution", what, remedy + "deviations of the restitution from the whole path, bounces included")


def _plastic(every: Pairs) -> Identified | None:
    """Return the law of records that show impacts but no rebounds at all."""
    if len(every.time) < STILL or np.isfinite(every.rebound).any():
        return None
    bound = float(np.sort(every.lowest / every.approach)[STILL - 1])
    if bound > 1.0:
        return None
    parameters = {"restitution": Parameter(0.0, "", 0.0, min(bound, 1.0))}
    goodness = {"pairs": 0, "impacts": len(every.time)}
    note = f"no rebound was seen: restitution is below {bound:.2g}, and nothing is known of its law"
    return Identified("constant", parameters, goodness, snippet(parameters), {}, (note,))


def _parameters(best: Fit, pairs: Pairs) -> dict[str, Parameter]:
    rows = {"restitution": (np.eye(1, len(best.numbers))[0], "")}
    place = 1
    if best.terms.slope:
        rows["restitution"][0][place] = -1.0
        rows["slope"] = (np.eye(1, len(best.numbers), place)[0] / best.middle[0], "s/m")
        place += 1
    if best.terms.asymmetry:
        rows["asymmetry"] = (np.eye(1, len(best.numbers), place)[0], "")
    parameters = {}
    for name, (row, unit) in rows.items():
        value = float(row @ best.numbers)
        half = best.quantile * float(np.sqrt(max(row @ best.covariance @ row, 0.0)))
        parameters[name] = Parameter(value, unit, value - half, value + half)
    low, high = scatter_interval(pairs, best)
    parameters["standard_deviation"] = Parameter(best.deviation, "", low, high)
    return parameters


def _tested(pairs: Pairs, best: Fit, fits: dict[str, Fit]) -> dict[str, Any]:
    """Return the estimates of the terms that were not selected, from the next richer law."""
    spared = {}
    for name in ("slope", "asymmetry"):
        richer = fits.get(best.terms._replace(**{name: True}).name)
        if getattr(best.terms, name) or richer is None:
            continue
        spared[name] = _parameters_of_term(richer, name).to_dict()
    return spared


def _parameters_of_term(richer: Fit, name: str) -> Parameter:
    place = 1 if name == "slope" else 1 + int(richer.terms.slope)
    scale, unit = (richer.middle[0], "s/m") if name == "slope" else (1.0, "")
    value = float(richer.numbers[place]) / scale
    half = richer.quantile * float(np.sqrt(max(richer.covariance[place, place], 0.0))) / scale
    return Parameter(value, unit, value - half, value + half)


def _flanks(pairs: Pairs, best: Fit) -> dict[str, Any]:
    """Return each flank's own pairs, median coefficient and approach."""
    told = {}
    for code, name in enumerate(FLANKS):
        own = pairs.only(pairs.flank == code)
        if len(own.time):
            told[name] = {
                "pairs": len(own.time),
                "ratio_median": float(np.median(own.rebound / own.approach)),
                "approach_median_m_s": float(np.median(own.approach)),
                "lowest_rebound_m_s": float(np.max(own.lowest)),
            }
    return told


def _unseen(chosen: Pairs, best: Fit) -> dict[str, Any]:
    chance = unseen(chosen, best.mean(chosen), best.deviation)
    return {"impacts": int(np.sum(~chosen.seen)), "expected": float(chance.sum()), "of": len(chosen.time)}
