"""The law of restitution from lists of impacts: speeds before and after, times of bounces, or heights of bounces."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import f_oneway, linregress, shapiro, t

from gears3d.errors import Fault, InputError
from gears3d.identify.impact_pairs import Pairs
from gears3d.identify.law import Identified, Parameter
from gears3d.identify.restitution import IMPACTS, curves, snippet
from gears3d.identify.restitution_fit import choose, scatter_interval

# Ratios from which a coefficient has an interval.
FEWEST = 3
# Impacts from which laws can compete; each of the groups that are held out has one.
ENOUGH = 12
# Relative error of a speed of which the list states none; larger errors show as scatter.
READ = 1e-3
# Share of impacts whose rebound has another sense than the rest; more are a mix of conventions.
WITHOUT_REBOUND = 0.1
# Significance level of a trend.
LEVEL = 0.01
_ROLES = (
    ("before", r"(velocity|speed|v|geschwindigkeit|omega)[\s_-]*(before|approach|incoming|impact|vor|pre)"),
    ("after", r"(velocity|speed|v|geschwindigkeit|omega)[\s_-]*(after|rebound|outgoing|nach|post)"),
    ("before", r"(approach|impact|incoming|inbound)[\s_-]*(velocity|speed)"),
    ("after", r"(rebound|outgoing|outbound)[\s_-]*(velocity|speed)"),
    ("heights", r"(bounce|rebound|apex|peak|sprung)[\s_-]*(height|hoehe|höhe)s?|(sprung)?(hoehe|höhe)|heights?"),
    ("dropped", r"(drop|release|initial|start|fall)[\s_-]*(height|hoehe|höhe)"),
    (
        "times",
        r"(bounce|impact|hit|contact|event)[\s_-]*times?|times?[\s_-]*of[\s_-]*(bounces?|impacts?)|t_(bounce|impact)",
    ),
    ("lasted", r"((flight|bounce)[\s_-]*)?(durations?|intervals?)|flugdauer"),
    ("drop", r"drop|trial|run|series|test|versuch|nr|toss"),
)
# Family of the unit of each role.
FAMILIES = {
    "before": "speed",
    "after": "speed",
    "heights": "length",
    "dropped": "length",
    "times": "time",
    "lasted": "time",
}
EXPECTED = (
    "columns velocity_before and velocity_after, bounce_time, flight_duration, bounce_height, or drop_height and "
    "bounce_height; a column drop numbers the drops"
)


class ImpactList(NamedTuple):
    """Impacts as a list gives them.

    Args:
        kind: ``"speeds"``, ``"durations"`` of successive flights, or ``"heights"`` of successive bounces.
        before: speed, duration or height before an impact, SI, (n,).
        after: the same after it, (n,).
        drop: number of the drop, (n,).
        linear: whether speeds are in m/s, so that a slope means something.
        file: where it is from.
        notes: what was excluded, one sentence each.
    """

    kind: str
    before: np.ndarray
    after: np.ndarray
    drop: np.ndarray
    linear: bool
    file: str
    notes: tuple[str, ...] = ()


def roles_of(names: Sequence[str]) -> dict[str, int]:
    """Return which columns of a table make it a list of impacts, by role; empty where they make none.

    >>> roles_of(["trial", "velocity_before", "velocity_after"])
    {'drop': 0, 'before': 1, 'after': 2}
    >>> roles_of(["time_s", "theta_loose_rad"]), roles_of(["t", "speed_in", "speed_out"])
    ({}, {})
    """
    found: dict[str, int] = {}
    for place, name in enumerate(names):
        plain = re.sub(r"_(m_s|mm_s|rad_s|ms|s|mm|cm|m)$", "", name.strip().lower())
        role = next((role for role, form in _ROLES if re.fullmatch(form, plain)), None)
        if role is not None:
            found.setdefault(role, place)
    enough = {"before", "after"} <= set(found) or set(found) & {"heights", "times", "lasted"}
    return found if enough else {}


def list_of(columns: dict[str, np.ndarray], linear: bool, file: str) -> ImpactList:
    """Return the impacts of a table.

    ``columns``: SI values by role, each (n,). Raises InputError when values are not positive or rise from bounce to
    bounce.
    """
    rows = len(next(iter(columns.values())))
    drop = columns.get("drop", np.zeros(rows))
    if {"before", "after"} <= set(columns):
        return _of_speeds(columns["before"], columns["after"], drop, linear, file)
    if {"dropped", "heights"} <= set(columns):
        return _checked("heights", columns["dropped"], columns["heights"], drop, False, file)
    kind = "heights" if "heights" in columns else "durations"
    before, after, own = [], [], []
    for number in dict.fromkeys(drop[np.isfinite(drop)].tolist()):
        mine = drop == number
        values = columns.get("heights", columns.get("lasted"))
        series = np.diff(columns["times"][mine]) if values is None else values[mine]
        series = series[np.isfinite(series)]
        series = series[: len(series) - int(np.argmax(series[::-1] > 0.0))]  # zeros where a logger saw no more bounces
        before.append(series[:-1])
        after.append(series[1:])
        own.append(np.full(max(len(series) - 1, 0), number))
    made = [np.concatenate(parts) if parts else np.zeros(0) for parts in (before, after, own)]
    rising = np.flatnonzero(made[1] > made[0])
    if rising.size > 0.5 * len(made[0]) or (rising.size and "drop" not in columns):
        at = int(rising[0])
        what = f"the {kind} rise from {made[0][at]:.4g} to {made[1][at]:.4g} at bounce {at + 1}"
        raise InputError(Fault("", what, "number the drops in a column 'drop', or leave rows out", file))
    return _checked(kind, made[0], made[1], made[2], False, file)


def _of_speeds(before: np.ndarray, after: np.ndarray, drop: np.ndarray, linear: bool, file: str) -> ImpactList:
    """Return the list of speeds with any signs; rows whose rebound has the sense of the approach are excluded."""
    sense = np.sign(before * after)
    usual = 1.0 if np.sum(sense > 0.0) >= np.sum(sense < 0.0) else -1.0  # a list has signs or magnitudes
    bad = np.flatnonzero(sense == -usual)
    if bad.size > WITHOUT_REBOUND * len(before):
        what = f"{bad.size} of {len(before)} rebounds have another sense than the rest, the first in row {bad[0] + 1}"
        remedy = "give all speeds after with the opposite sign, or all as magnitudes; leave impacts without rebound out"
        raise InputError(Fault("", what, remedy, file))
    rest = sense != -usual
    made = _checked("speeds", np.abs(before[rest]), np.abs(after[rest]), drop[rest], linear, file)
    if not bad.size:
        return made
    note = f"{bad.size} of {len(before)} impacts excluded, the first in row {bad[0] + 1}: no rebound, it moves on"
    return made._replace(notes=(f"{file}: {note}",))


def _checked(kind: str, before: np.ndarray, after: np.ndarray, drop: np.ndarray, linear: bool, file: str) -> ImpactList:
    known = np.isfinite(before) & np.isfinite(after)
    before, after, drop = before[known], after[known], drop[known]
    bad = np.flatnonzero((before <= 0.0) | (after < 0.0) | ((after == 0.0) & (kind != "speeds")))
    if bad.size:
        what = f"row {bad[0] + 1} has {before[bad[0]]:.4g} before and {after[bad[0]]:.4g} after the impact"
        raise InputError(Fault("", what, "both are above 0; leave the row out", file))
    if len(before) < FEWEST:
        raise InputError(Fault("", f"shows {len(before)} impacts, {FEWEST} are needed", "record more bounces", file))
    return ImpactList(kind, before, after, drop, linear, file)


def identify_restitution_list(lists: Sequence[ImpactList]) -> Identified:
    """Identify the law of restitution from lists of impacts.

    Speeds in m/s are fitted as those of rattle records are: a constant or linear law with scatter, the richer one where
    it predicts better. Of durations and heights e is the geometric mean of the ratios of successive flights, and of the
    roots of the ratios of successive heights, with the interval of their scatter.

    Args:
        lists: of one kind.

    Returns:
        ``restitution``, ``standard_deviation``, and ``slope`` [s/m] where the law has one.

    Raises:
        InputError: kinds differ, or a coefficient beyond 1 results.

    Source: Stronge 2000, Impact Mechanics, on the kinematic coefficient; Bernstein 1977 for times of bounces.

    >>> before = np.array([1.0, 0.5, 0.25, 0.126])
    >>> one = ImpactList("durations", before[:-1], before[1:], np.zeros(3), False, "a.csv")
    >>> round(identify_restitution_list([one]).parameters["restitution"].value, 3)
    0.501
    """
    kinds = sorted({one.kind for one in lists})
    if len(kinds) > 1:
        raise InputError(Fault("", f"lists hold {' and '.join(kinds)}", "give lists of one kind", lists[0].file))
    before, after = (np.concatenate([getattr(one, name) for one in lists]) for name in ("before", "after"))
    drops = [np.unique(one.drop, return_inverse=True)[1] for one in lists]
    first = np.cumsum([0, *(int(own.max(initial=-1)) + 1 for own in drops)])
    drop = np.concatenate([own + at for own, at in zip(drops, first, strict=False)])
    linear, notes = all(one.linear for one in lists), tuple(note for one in lists for note in one.notes)
    whole = ImpactList(kinds[0], before, after, drop, linear, lists[0].file, notes)
    if whole.kind == "speeds" and whole.linear and len(before) >= ENOUGH and np.ptp(before) > 0.0:
        return _fitted(whole)
    return _mean(whole)


def _fitted(whole: ImpactList) -> Identified:
    """Return the law of speeds that are known."""
    rows = len(whole.before)
    pairs = Pairs(
        np.zeros(rows, int),
        np.arange(rows, dtype=float),
        np.zeros(rows, int),
        whole.before,
        whole.after,
        READ * whole.before,
        READ * np.maximum(whole.after, READ * whole.before),
        np.full(rows, -1.0),
        np.ones(rows),
        np.zeros(rows, int),
    )
    best, _, scores = choose(pairs)
    base, place = np.eye(1, len(best.numbers))[0], {}
    if best.terms.slope:
        base[1] = -1.0
        place["slope"] = (np.eye(1, len(best.numbers), 1)[0] / best.middle[0], "s/m")
    parameters = {}
    for name, (row, unit) in ({"restitution": (base, "")} | place).items():
        half = best.quantile * float(np.sqrt(max(row @ best.covariance @ row, 0.0)))
        value = float(row @ best.numbers)
        parameters[name] = Parameter(value, unit, value - half, value + half)
    rest = whole.after / whole.before - best.mean(pairs)
    chance, notes = float(shapiro(rest).pvalue), list(whole.notes)
    if chance < LEVEL:
        one, ends = parameters["restitution"], (float(rest.mean()), float(np.median(rest)))
        half = max(one.high - one.value, *(abs(end) for end in ends))
        parameters["restitution"] = Parameter(one.value, "", one.value - half, one.value + half)
        notes.append(
            f"the scatter of e is not normal (p = {chance:.1g}): e is {one.value + ends[0]:.4g} in the mean and "
            f"{one.value + ends[1]:.4g} at the median; the interval includes both"
        )
    parameters["standard_deviation"] = Parameter(best.deviation, "", *scatter_interval(pairs, best))
    goodness: dict[str, Any] = {
        "held_out": {name: -2.0 * float(score.mean()) for name, score in scores.items()},
        "pairs": rows,
        "from": whole.kind,
        "approach_m_s": [float(whole.before.min()), float(whole.before.max())],
    }
    told = curves(pairs, best)
    (only,) = told["flanks"].values()
    told["flanks"] = {IMPACTS: {**only, "lowest_m_s": 0.0}}
    return Identified(
        best.terms.name, parameters, goodness, snippet(parameters), told, _warned(parameters, tuple(notes))
    )


def _mean(whole: ImpactList) -> Identified:
    """Return a constant coefficient from ratios: the geometric mean, with the interval of their scatter."""
    ratio = whole.after / whole.before
    power = 0.5 if whole.kind == "heights" else 1.0
    if whole.kind == "speeds":
        values, back = ratio, float
    else:
        values, back = power * np.log(ratio), lambda x: float(np.exp(x))
    count, middle, spread = len(values), float(values.mean()), float(values.std(ddof=1))
    half = float(t.ppf(0.975, count - 1)) * spread / np.sqrt(count)
    drops, half_of_drops, p_drops = _drops(values, whole.drop)
    half = max(half, half_of_drops)
    value = back(middle)
    deviation = spread if whole.kind == "speeds" else value * spread
    low, high = _spread_interval(deviation, count)
    parameters = {
        "restitution": Parameter(value, "", back(middle - half), back(middle + half)),
        "standard_deviation": Parameter(deviation, "", low, high),
    }
    notes = [*whole.notes, *(["the law is taken as constant"] if whole.kind == "speeds" else [])]
    trend: Any = linregress(np.log(whole.before), values) if np.ptp(whole.before) > 0.0 and count > 3 else None
    if trend is not None and trend.pvalue < LEVEL and spread > 0.0:
        notes.append(f"e changes with the {whole.kind} before the impact (p = {trend.pvalue:.1g}): it is not constant")
    if p_drops < LEVEL:
        notes.append(f"e differs between the {drops} drops (p = {p_drops:.1g}): the interval is that of their scatter")
    goodness = {
        "pairs": count,
        "drops": drops,
        "from": whole.kind,
        "trend_p_value": None if trend is None else float(trend.pvalue),
    }
    text = snippet(parameters if low > 0.0 else {"restitution": parameters["restitution"]})
    return Identified("constant", parameters, goodness, text, {}, _warned(parameters, tuple(notes)))


def _drops(values: np.ndarray, drop: np.ndarray) -> tuple[int, float, float]:
    """Return the number of drops, the 95 % half width by their scatter, and the p-value if all drops were equal.

    Ratios within a drop share its height, ball and reading, so that they are not independent; the standard error
    of clusters counts each drop once.
    """
    groups = [values[drop == one] for one in np.unique(drop)]
    count = len(groups)
    if count < FEWEST or count == len(values):
        return count, 0.0, 1.0
    sums = np.array([float(np.sum(own - values.mean())) for own in groups])
    error = float(np.sqrt(np.sum(sums**2) * count / (count - 1))) / len(values)
    several = [own for own in groups if len(own) > 1]
    within = sum(float(np.sum((own - own.mean()) ** 2)) for own in several)
    p = float(f_oneway(*several).pvalue) if len(several) > 1 and within > 0.0 else 1.0
    return count, float(t.ppf(0.975, count - 1)) * error, p if np.isfinite(p) else 1.0


def _spread_interval(deviation: float, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a standard deviation of normal values."""
    from scipy.stats import chi2

    low, high = (float(np.sqrt((count - 1) / chi2.ppf(p, count - 1))) for p in (0.975, 0.025))
    return deviation * low, deviation * high


def _warned(parameters: dict[str, Parameter], notes: tuple[str, ...]) -> tuple[str, ...]:
    one = parameters["restitution"]
    if "slope" not in parameters and one.low > 1.0:
        return (*notes, "restitution is above 1, where impacts would add energy: columns or drops are mixed up")
    return notes
