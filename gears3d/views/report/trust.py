"""How far the result is to be trusted: every number of the comparison and of the error budget with its meaning."""

from __future__ import annotations

from typing import Any, NamedTuple

from gears3d.views.report.figures import Figure, figure, kind_of


class Claim(NamedTuple):
    """One line of a table: a name, a number, and what it means.

    Args:
        key: name in ``summary.json``.
        name: in words.
        figure: the number as shown.
        meaning: what it says.
    """

    key: str
    name: str
    figure: Figure
    meaning: str


COMPARISON = {
    "mode": (
        "compared as",
        "trajectory: impact by impact. distribution: the motion is chaotic, two correct simulations part after a few "
        "impacts, so only the statistics of the impacts are compared.",
    ),
    "impacts_compared": ("impacts compared", "impacts of the twin after flights higher than the limit below"),
    "impacts_matched": ("matched", "of these, found in the run too: same flank, same moment"),
    "impacts_missed": ("missed", "in the twin but not in the run; 0 is right"),
    "impacts_invented": ("invented", "in the run but not in the twin; 0 is right"),
    "velocity_error_median": ("impact speed, median error", "half of the impact speeds are closer to the twin's"),
    "velocity_error_p95": ("impact speed, 95 % below", "only one impact in twenty is further off"),
    "velocity_bias": ("impact speed, bias", "mean error with its sign: above 0 the run hits harder than the twin"),
    "phase_error_median_cycles": ("moment of impact, median error", "in periods of the drive's fluctuation"),
    "flight_height_min_m": ("flights counted from", "bounces lower than this are too small to be told apart"),
    "regime_equal": ("same regime", "run and twin move in the same pattern"),
}
"""Name and meaning of each number of the comparison."""

DISTRIBUTION = {
    "impacts_compared": ("impacts in the twin", "not paired: after flights higher than the limit below"),
    "velocity_error_median": ("impact speed, its median", "how far the run's median is from the twin's, worse flank"),
    "velocity_error_p95": ("impact speed, its 95th percentile", "how far the run's is from the twin's, worse flank"),
    "velocity_bias": ("impact speed, its mean", "above 0 the run hits harder than the twin, worse flank"),
    "phase_error_median_cycles": ("mean phase of the impacts", "how far the run's is from the twin's, worse flank"),
}
"""Name and meaning where distributions are compared and not impact by impact."""

RATIOS = ("velocity_error_median", "velocity_error_p95", "velocity_bias")

BUDGET = {
    "facet": "flat facets in place of the involute, hulls only",
    "hull_quantisation": "step in which Bullet stores the vertices of a hull",
    "hull_margins": "Bullet's collision margins, one a body",
    "raw_minus_refined": "gap that Bullet reports for the hulls less the gap of the true flanks",
    "raw_allowed": "more than this between the two would have stopped the run",
    "location": "largest gap that was left where an impact was placed on the true flanks",
    "step": "finite time step",
    "total": "what a gap in this run can be wrong by: hulls only find the teeth, the true flanks are measured",
}
"""What the parts of the error budget come from, by how their names begin."""

NATIVE = {
    "facet": "flat facets in place of the involute: they touch, and tilt the normal of the rebound once the gears turn",
    "raw_minus_refined": "gap of the hulls that touch less the gap of the true flanks",
    "total": "what a gap in this run can be wrong by: the hulls themselves touch; the error of a rebound's direction "
    "is not in it",
}
"""The same for Bullet's own contact, where no impact is placed on the true flanks."""
NATIVE_WITHOUT = ("location", "step")
"""Parts that Bullet's own contact has not."""


def comparison_lines(comparison: dict[str, Any] | None) -> list[Claim]:
    r"""Return the comparison with the twin as lines of a table.

    Args:
        comparison: that of ``summary.json``, or ``None``.

    Returns:
        One line for every number, known ones first in the order of :data:`COMPARISON`.

    >>> comparison_lines({"velocity_bias": -0.00021})[0].figure
    Figure(text='−0.021\xa0%', value=-0.00021)
    """
    given = comparison or {}
    known = {**COMPARISON, **DISTRIBUTION} if given.get("mode") == "distribution" else COMPARISON
    keys = [key for key in COMPARISON if key in given] + [key for key in given if key not in COMPARISON]
    lines = []
    for key in keys:
        name, meaning = known.get(key, (key.replace("_", " "), ""))
        if not isinstance(given[key], dict | list) and (given[key] is not None or known is COMPARISON):
            lines.append(Claim(key, name, figure(given[key], "ratio" if key in RATIOS else kind_of(key)), meaning))
    return lines


def budget_lines(budget: dict[str, Any] | None, native: bool = False) -> list[Claim]:
    r"""Return the error budget as lines of a table, all in lengths along the line of action.

    Args:
        budget: that of ``summary.json``: name to length [m] (or to a table of such), or ``None``.
        native: whether Bullet's own contact made the impacts.

    >>> budget_lines({"facets": 1.2e-7})[0].figure.text
    '120\xa0nm'
    """
    lines = []
    meanings = {**BUDGET, **NATIVE} if native else BUDGET
    for key, value in (budget or {}).items():
        if native and key in NATIVE_WITHOUT:
            continue
        if isinstance(value, dict):
            inner = budget_lines(value, native)
            lines += [one._replace(key=f"{key}.{one.key}", name=f"{key}: {one.name}") for one in inner]
            continue
        meaning = next((text for begin, text in meanings.items() if key.startswith(begin)), "")
        is_length = isinstance(value, float) and not key.endswith(("_count", "_ratio", "_s"))
        name = key.removesuffix("_m").replace("_", " ")
        lines.append(Claim(key, name, figure(value, "length" if is_length else "", 3), meaning))
    return lines


def source(summary: dict[str, Any]) -> str:
    """Return in a few sentences what run and twin are to each other, and what their agreement says.

    Args:
        summary: content of ``summary.json``.
    """
    parts = [
        "The twin is a separate program: it integrates one equation of motion between two walls and knows nothing of "
        "solids."
    ]
    if summary.get("model") == "bullet" and summary.get("contact") == "native":
        parts.append(
            "The run moved rigid bodies in PyBullet and left the contact to Bullet: flat facets and quantised hulls "
            "touch and tilt the normals once the gears turn, so rebounds scatter. Differences below are mostly of that "
            "making; located contact has none of it."
        )
    elif summary.get("model") == "bullet":
        parts.append(
            "The run moved rigid bodies in PyBullet and found every contact on the flanks themselves. Where both "
            "agree, the contact was found where it is."
        )
    parts.append("They share the scenario, its drag and its restitution: agreement does not say that a rig has these.")
    return " ".join(parts)


def verdict(comparison: dict[str, Any] | None) -> str:
    """Return in one sentence how well run and twin agree.

    Args:
        comparison: that of ``summary.json``, or ``None``.
    """
    if not comparison:
        return "No second model was run, so nothing here says how far to trust the result."
    missed, invented = comparison.get("impacts_missed"), comparison.get("impacts_invented")
    count, median = comparison.get("impacts_compared"), comparison.get("velocity_error_median")
    if comparison.get("mode") == "distribution":
        return (
            "The motion is chaotic: run and twin are compared by the statistics of their impacts, not impact by impact."
        )
    matched = comparison.get("impacts_matched")
    text = f"Of {count} impacts of the independent one-degree-of-freedom twin the run has {matched}"
    text += f" ({missed} missed, {invented} invented)"
    if median is not None:
        p95 = figure(comparison.get("velocity_error_p95"), "ratio", 3).text
        text += f"; impact speeds differ by {figure(median, 'ratio', 3).text} (median), 95 % of them by less than {p95}"
    return text + "."
