"""What blind tests came to, as tables in Markdown: every rate with its count and its 95 % interval (Wilson)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.stats import binomtest, chisquare

from gears3d.effects import catalogue
from gears3d.verification.challenge import ASKED, KINDS
from tests.diagnosis.blind import FINE, NULLS
from tests.diagnosis.observer import SEES

NAMED = (*KINDS, *ASKED)
"""Kinds that a diagnosis can name."""

WITHIN = {FINE: 0.03, 0.015: 0.10}
"""Part by which parameters may be off, by noise."""


def rate(hits: int, count: int) -> str:
    """Return a rate with count and interval.

    >>> rate(19, 20)
    '19/20 = 95 % (76.4 to 99.1)'
    """
    if not count:
        return "–"
    low, high = binomtest(hits, count).proportion_ci(method="wilson")
    return f"{hits}/{count} = {100 * hits / count:.3g} % ({100 * low:.3g} to {100 * high:.3g})"


def tables(rows: list[dict[str, Any]]) -> Iterable[str]:
    """Return the lines of all tables for which there are tests."""
    if less := [row for row in rows if row["part"] == "ablation"]:
        yield from [*_ablation(less), ""]
        rows = [row for row in rows if not row.get("without")]
    every = [row for row in rows if _part(row) == "kinds"]
    if known := [row for row in every if row["visible"]]:
        yield from _known(known)
        yield from ["", *_errors(known)]
        yield from ["", *_confusion(known)]
    if unseen := [row for row in every if not row["visible"]]:
        yield from ["", "hidden where it leaves no trace, and nothing named: " + _count(unseen, _right)]
    if nulls := [row for row in rows if _part(row) in NULLS]:
        yield from ["", *_nulls(nulls)]
    if dirty := [row for row in rows if row["part"] == "dirt"]:
        yield from ["", *_dirty(dirty)]
    if strange := [row for row in rows if _part(row) == "unknown"]:
        yield from ["", *_strange(strange)]
    if two := [row for row in rows if row["part"] == "two"]:
        yield from ["", "two causes at once, both named: " + _count(two, _both)]
    if alike := [row for row in rows if row["part"] == "sets"]:
        yield from ["", *_sets(alike)]
    if limits := [row for row in rows if row["part"] == "limits"]:
        yield from ["", *_limits(limits)]
    for part in sorted({row["part"] for row in rows if row.get("facts")}):
        yield from ["", *_map([row for row in rows if row["part"] == part], part)]
    if stated := [row for row in rows if row.get("posterior")]:
        yield from ["", *_calibrated(stated)]
    if ranks := [one["rank"] for row in rows for one in row["parameters"] if one.get("rank") is not None]:
        yield from ["", *_ranked(np.array(ranks))]
    gains = [row["gain"] for row in rows if row["causes"] and (row["gain"] is not None or row.get("splits"))]
    good = sum(gain is not None and gain > 0.0 for gain in gains)
    yield from ["", "held-out gain of extensions above 0: " + rate(good, len(gains))]
    yield f"{np.mean([row['seconds'] for row in rows]):.1f} s of one core a diagnosis, with reading its records"


def outcome(row: dict[str, Any]) -> str:
    """Return right, missed, silent or wrong: what a diagnosis of a rig of the operating space came to.

    Right are all hidden causes that the records show, first or in their sets, and no wrong name; missed are some of
    them. Where the records show none, right is to name none.
    """
    if row["wrong_names"] or (row["causes"] and not row["hidden"]):
        return "wrong, explained" if row["verdict"] == "explained" else "wrong"
    shown = _shown(row)
    if not row["hidden"]:
        return "right" if row["verdict"] == "nothing_to_add" else "silent"
    if set(shown) <= set(row["kinds_right"]):
        return "right"
    return "missed" if row["causes"] else "silent"


def _shown(row: dict[str, Any]) -> list[str]:
    """Return the hidden causes that an observer who knows them sees, and those that it cannot judge."""
    sees = row.get("sees") or {}
    return [kind for kind in row["hidden"] if row["visible"] and (sees.get(kind) is None or sees[kind] >= SEES)]


OUTCOMES = ("right", "missed", "silent", "wrong", "wrong, explained")
"""Of diagnoses; a wrong cause in a verdict of explained is the worst."""


def _map(rows: list[dict[str, Any]], part: str) -> Iterable[str]:
    """Return a table of outcomes over each factor of the rigs: thirds of its values, or each of a few."""
    yield f"{part}: " + ", ".join(f"{name} {rate(_of(rows, name), len(rows))}" for name in OUTCOMES)
    yield ""
    yield from _observed(rows)
    yield "| factor | from | to | " + " | ".join(OUTCOMES) + " |"
    yield "|---" * (3 + len(OUTCOMES)) + "|"
    for factor in rows[0]["facts"]:
        values = np.array([row["facts"][factor] for row in rows])
        few = np.unique(values)
        edges = np.unique(np.quantile(values, [0.0, 1 / 3, 2 / 3, 1.0])) if len(few) > 4 else np.r_[few, few[-1]]
        at = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
        for k in range(len(edges) - 1):
            own = [row for row, where in zip(rows, at, strict=True) if where == k]
            cells = [f"{_of(own, name)}" for name in OUTCOMES]
            yield f"| {factor} | {edges[k]:.3g} | {edges[k + 1]:.3g} | " + " | ".join(cells) + " |"


def _observed(rows: list[dict[str, Any]]) -> Iterable[str]:
    """Return how many causes were found, by what an observer who knows the causes sees of them."""
    yield "| size over its standard deviation, for an observer who knows the causes | found | not found |"
    yield "|---|---|---|"
    edges = (0.0, SEES, 2.0 * SEES, 4.0 * SEES, np.inf)
    pairs = [(row, k, (row.get("sees") or {}).get(k)) for row in rows for k in row["hidden"]]
    groups = [(f"{a:g} to {b:g}", [(r, k) for r, k, x in pairs if x is not None and a <= x < b])
              for a, b in pairwise(edges)]  # fmt: skip
    for name, own in [*groups, ("not judged", [(r, k) for r, k, x in pairs if x is None])]:
        found = sum(k in row["kinds_right"] for row, k in own)
        yield f"| {name} | {rate(found, len(own))} | {len(own) - found} |"
    yield ""


STATEMENTS = (0.0, 0.1, 0.5, 0.9, 0.95, 1.0)
"""Bounds of stated probabilities over which their calibration is counted."""


def _calibrated(rows: list[dict[str, Any]]) -> Iterable[str]:
    """Return how many of the sets of causes that a probability is stated for are what is hidden and shows."""
    yield "| stated probability of a set of causes | mean | true |"
    yield "|---|---|---|"
    pairs = [(one["probability"], sorted(one["causes"]) == sorted(_shown(row)))
             for row in rows for one in row["posterior"] if one["causes"] is not None]  # fmt: skip
    for a, b in pairwise(STATEMENTS):
        own = [(stated, true) for stated, true in pairs if a <= stated < b]
        mean = f"{np.mean([stated for stated, _ in own]):.3f}" if own else "–"
        yield f"| {a:g} to {b:g} | {mean} | {rate(sum(true for _, true in own), len(own))} |"


RANKS = 10
"""Classes of a rank histogram: 100 sizes then have ten in each, with a standard deviation of three."""


def _ranked(ranks: np.ndarray) -> Iterable[str]:
    """Return the rank histogram of the true sizes in their intervals; calibrated intervals fill all classes equally."""
    counts = np.histogram(ranks, RANKS, (0.0, 1.0))[0]
    yield "| true size's quantile in the stated interval | " + " | ".join(f"{k / RANKS:g}" for k in range(RANKS)) + " |"
    yield "|---" * (1 + RANKS) + "|"
    yield "| sizes | " + " | ".join(str(count) for count in counts) + " |"
    yield ""
    yield f"{len(ranks)} sizes; equally filled: p = {chisquare(counts).pvalue:.2g}"


def _of(rows: list[dict[str, Any]], name: str) -> int:
    return sum(outcome(row) == name for row in rows)


def _part(row: dict[str, Any]) -> str:
    """Return the sort of a test; where the seed decided, by what it hid."""
    if row["part"] != "drawn":
        return row["part"]
    return "nothing" if not row["hidden"] else "kinds" if row["hidden"][0] in NAMED else "unknown"


def _count(rows: list[dict[str, Any]], what: Any) -> str:
    return rate(sum(bool(what(row)) for row in rows), len(rows))


def _both(row: dict[str, Any]) -> bool:
    return set(row["hidden"]) <= {one["kind"] for one in row["causes"]}


def _right(row: dict[str, Any]) -> bool:
    return bool(row["set_right"]) if row["visible"] else not row["causes"]


def _close(row: dict[str, Any]) -> bool:
    """Whether order and teeth are exact and sizes near."""
    bound = WITHIN.get(row["noise"], 0.10)
    return all(one["right"] is not False and (one["error"] is None or abs(one["error"]) <= bound)
               for one in row["parameters"])  # fmt: skip


def _known(rows: list[dict[str, Any]]) -> Iterable[str]:
    yield "Near: order and teeth exact, sizes within 3 % at 0.3 % noise and within 10 % at 1.5 %.\n"
    yield "| hidden | right first, or its set | with a wrong name beside | near, where right | intervals that cover |"
    yield "|---|---|---|---|---|"
    groups = [("all, 0.3 % noise", [r for r in rows if r["noise"] <= FINE])]
    groups += [("all, 1.5 % noise", [r for r in rows if r["noise"] > FINE])]
    groups += [(kind, [r for r in rows if r["hidden"] == [kind]]) for kind in sorted({r["hidden"][0] for r in rows})]
    for name, own in groups:
        right = [row for row in own if row["set_right"]]
        sure = [one["covered"] for row in right for one in row["parameters"] if one["covered"] is not None]
        cells = (name, _count(own, _right), _count(own, lambda r: r["wrong_names"]), _count(right, _close))
        yield "| " + " | ".join([*cells, rate(sum(sure), len(sure))]) + " |"


def _errors(rows: list[dict[str, Any]]) -> Iterable[str]:
    """Return how far numbers are off, where the cause is right and more is known than that they are as large."""
    yield "| number | middle and largest error, 0.3 % noise | middle and largest error, 1.5 % noise |"
    yield "|---|---|---|"
    right = [(row["noise"] <= FINE, one) for row in rows if row["set_right"] for one in row["parameters"]
             if one["error"] is not None and one["covered"] is not None]  # fmt: skip
    for kind, name in sorted({(one["kind"], one["name"]) for _, one in right}):
        own = [(low, abs(one["error"])) for low, one in right if (one["kind"], one["name"]) == (kind, name)]
        cells = [_off([error for low, error in own if low is fine], name) for fine in (True, False)]
        yield f"| {kind}, {name.replace('_', ' ')} | " + " | ".join(cells) + " |"


def _off(errors: list[float], name: str) -> str:
    """Return the middle and the largest of some errors, of angles in degrees, of others in per cent."""
    if not errors:
        return "–"
    factor, unit = (np.degrees(1.0), "deg") if name == "phase" else (100.0, "%")
    middle, most = factor * float(np.median(errors)), factor * max(errors)
    return f"{middle:.2g}, {most:.2g} {unit} ({len(errors)})"


def _confusion(rows: list[dict[str, Any]]) -> Iterable[str]:
    yield "| hidden | named first, or verdict without a name |"
    yield "|---|---|"
    for kind in sorted({row["hidden"][0] for row in rows}):
        told = Counter(row["causes"][0]["kind"] if row["causes"] else f"*{row['verdict']}*"
                       for row in rows if row["hidden"] == [kind])  # fmt: skip
        yield f"| {kind} | " + ", ".join(f"{name} {n}" for name, n in told.most_common()) + " |"


def _nulls(rows: list[dict[str, Any]]) -> Iterable[str]:
    yield "| nothing hidden | diagnoses (records) | something named | unexplained | not decidable |"
    yield "|---|---|---|---|---|"
    for part in [name for name in NULLS if any(_part(row) == name for row in rows)]:
        own = [row for row in rows if _part(row) == part]
        cells = [part, f"{len(own)} ({sum(row['records'] for row in own)})", _count(own, lambda r: r["causes"])]
        cells += [_count(own, lambda r, v=v: r["verdict"] == v) for v in ("unexplained", "not_decidable")]
        yield "| " + " | ".join(cells) + " |"


def _dirty(rows: list[dict[str, Any]]) -> Iterable[str]:
    """Return what was named of dirty records of rigs with nothing hidden; a harmonic of the drive is really there."""
    yield "| nothing hidden, dirt | named, but a harmonic of the drive | unexplained | not decidable | records used |"
    yield "|---|---|---|---|---|"
    groups = [("all", rows), *((f"{100 * x:.2g} % noise", [r for r in rows if r["noise"] == x]) for x in (FINE, 0.015))]
    for name, own in groups:
        cells = [name, _count(own, lambda r: any(one["kind"] != "drive_motion" for one in r["causes"]))]
        cells += [_count(own, lambda r, v=v: r["verdict"] == v) for v in ("unexplained", "not_decidable")]
        cells.append(rate(sum(row["used"] for row in own), sum(row["records"] for row in own)))
        yield "| " + " | ".join(cells) + " |"


def _strange(rows: list[dict[str, Any]]) -> Iterable[str]:
    yield "| outside the catalogue | unexplained or partly | right coordinate | explained by a wrong name |"
    yield "|---|---|---|---|"
    hedged = ("unexplained", "partly_explained")
    for name in ["all", *sorted({row["hidden"][0] for row in rows})]:
        own = [row for row in rows if name in ("all", row["hidden"][0])]
        cells = [name, _count(own, lambda r: r["verdict"] in hedged), _count(own, lambda r: r["coordinate_right"])]
        yield "| " + " | ".join([*cells, _count(own, lambda r: r["verdict"] == "explained")]) + " |"


def _sets(rows: list[dict[str, Any]]) -> Iterable[str]:
    """Return how often what cannot be told apart was told as such: what is hidden stands among what is named."""
    yield "| what may not be told apart | among what is named | alone, and right | first | named without it |"
    yield "|---|---|---|---|---|"
    for name in ["all", *dict.fromkeys(row["setting"] for row in rows)]:
        own = [row for row in rows if name in ("all", row["setting"])]
        cells = [_count(own, _among), _count(own, lambda r: _among(r) and not any(c["or"] for c in r["causes"]))]
        cells += [_count(own, lambda r: r["kinds_first"]), _count(own, lambda r: r["causes"] and not _among(r))]
        yield "| " + " | ".join([name, *cells]) + " |"


def _among(row: dict[str, Any]) -> bool:
    """Whether what is hidden stands among causes and their rivals."""
    return set(row["hidden"]) <= {kind for one in row["causes"] for kind in (one["kind"], *one["or"])}


def _ablation(rows: list[dict[str, Any]]) -> Iterable[str]:
    heads = ("without", "right first, or its set", "with a wrong name beside", "near, where right", "nulls with a name",
             "outside the catalogue, a cause named", "wrong now")  # fmt: skip
    yield f"| {' | '.join(heads)} |"
    yield "|---" * len(heads) + "|"
    sets: dict[str, set[str]] = {}
    for stage in sorted({row["without"] for row in rows}):
        own = [row for row in rows if row["without"] == stage]
        none, strange = (
            [r for r in own if not r["hidden"]],
            [r for r in own if r["hidden"] and r["hidden"][0] not in NAMED],
        )
        some = [row for row in own if row["hidden"] and row["hidden"][0] in NAMED]
        sets[stage] = {f"{row['hidden'][0]} at {100 * row['noise']:g} %" for row in some if not _right(row)}
        cells = [stage or "nothing: all stages", _count(some, _right), _count(some, lambda r: r["wrong_names"])]
        cells += [_count([row for row in some if row["set_right"]], _close), _count(none, lambda r: r["causes"])]
        cells.append(_count(strange, lambda r: r["causes"]))
        lost = ", ".join(sorted(sets[stage] - sets.get("", set()))) if stage else ""
        yield "| " + " | ".join([*cells, lost or "–"]) + " |"


def _limits(rows: list[dict[str, Any]]) -> Iterable[str]:
    settings = list(dict.fromkeys(row["setting"] for row in rows))
    base = [row for row in rows if row["setting"] == settings[0]]
    yield from _limits_by(base, "hidden", {kind: [kind] for kind in sorted({row["hidden"][0] for row in base})})
    if len(settings) > 1:
        both = {row["seed"] for row in rows if row["setting"] != settings[0]}
        rows = [row for row in rows if row["seed"] in both]
        places: dict[str, list[str]] = {}
        for kind in sorted({row["hidden"][0] for row in rows}):
            places.setdefault(catalogue()[kind].place, []).append(kind)
        yield from [
            "",
            f"| right first; 50 %, 90 % limit | {' | '.join(settings)} |",
            "|---" * (len(settings) + 1) + "|",
        ]
        for place, kinds in places.items():
            own = [row for row in rows if row["hidden"][0] in kinds]
            cells = [_limit([row for row in own if row["setting"] == setting]) for setting in settings]
            yield f"| {place} | {' | '.join(cells)} |"


def _limit(rows: list[dict[str, Any]]) -> str:
    """Return how many are right, and both limits."""
    sizes = np.array([row["size"] for row in rows])
    right = np.array([_right(row) for row in rows])
    half, most = (_within(one, sizes.min(), sizes.max()) for one in limits(sizes, right))
    return f"{right.sum()}/{len(rows)}; {half}, {most}"


def _limits_by(rows: list[dict[str, Any]], title: str, groups: dict[str, list[str]]) -> Iterable[str]:
    """Return limits of detection, by groups of kinds."""
    yield f"| {title} | right first by size (shares of unit_size) | 50 % limit | 90 % limit |"
    yield "|---|---|---|---|"
    for kind, kinds in groups.items():
        own = [row for row in rows if row["hidden"][0] in kinds]
        sizes = sorted({row["size"] for row in own})
        told = [f"{size:g}: {sum(_right(r) for r in own if r['size'] == size)}/{sum(r['size'] == size for r in own)}"
                for size in sizes]  # fmt: skip
        found = limits(np.array([r["size"] for r in own]), np.array([_right(r) for r in own]))
        half, most = (_within(one, sizes[0], sizes[-1]) for one in found)
        yield f"| {kind} | {', '.join(told)} | {half} | {most} |"


def _within(limit: float, low: float, high: float) -> str:
    """Return a limit, or that it lies below or beyond what was tried."""
    return f"< {low:g}" if limit < low else f"> {high:g}" if limit > high else f"{limit:.2g}"


def limits(size: np.ndarray, right: np.ndarray) -> tuple[float, float]:
    """Return the sizes at which 50 and 90 % are right, by a logistic curve over the logarithm of the size.

    They are 0 where all are right, and infinite where none is.

    Args:
        size: of the hidden effects, (n,).
        right: whether each was named, (n,).

    >>> size = np.repeat([0.01, 0.02, 0.04], 50)
    >>> half, most = limits(size, np.r_[np.zeros(50), np.tile([0, 1], 25), np.ones(50)] > 0)
    >>> round(half, 3), 0.02 < most < 0.04
    (0.02, True)
    """
    if not right.any():
        return float("inf"), float("inf")
    if right.all():
        return 0.0, 0.0
    x = np.log(size)

    def cost(p: np.ndarray) -> float:
        z = (x - p[0]) * np.exp(p[1])
        return float(np.sum(np.logaddexp(0.0, np.where(right, -z, z)))) + 0.02 * float(p[1] - 1.0) ** 2

    found = minimize(cost, [x.mean(), 1.0], method="Nelder-Mead", options={"xatol": 1e-4, "fatol": 1e-6}).x
    return float(np.exp(found[0])), float(np.exp(found[0] + np.log(9.0) * np.exp(-found[1])))
