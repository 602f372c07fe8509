"""Verification of a result: numbers of the comparison with the rigid model and of the error budget, with meanings."""

from __future__ import annotations

from typing import Any, NamedTuple

from gears3d.views.plots.numbers import Figure, figure, kind_of


class Claim(NamedTuple):
    """One line of a table: a name, a number, and what it means.

    Args:
        key: name in ``summary.json``.
        name: in words.
        figure: the number as shown.
        meaning: explanation of the number.
    """

    key: str
    name: str
    figure: Figure
    meaning: str


COMPARISON = {
    "mode": (
        "compared as",
        "trajectory: impact by impact. distribution: only statistics of the impacts are compared, because the motion "
        "is chaotic and two correct simulations diverge after a few impacts.",
    ),
    "impacts_compared": ("impacts compared", "impacts of the rigid model after flights higher than the limit below"),
    "impacts_matched": ("matched", "of these, also found in the run, on the same flank at the same time"),
    "impacts_missed": ("missed", "in the rigid model but not in the run; 0 is ideal"),
    "impacts_invented": ("spurious", "in the run but not in the rigid model; 0 is ideal"),
    "velocity_error_median": ("impact speed, median error", "50 % of the impact speeds have a smaller error"),
    "velocity_error_p95": (
        "impact speed, 95th percentile of the error",
        "5 % of the impact speeds have a larger error",
    ),
    "velocity_bias": (
        "impact speed, bias",
        "mean error with its sign; positive: the run has faster impacts than the rigid model",
    ),
    "phase_error_median_cycles": ("time of impact, median error", "in periods of the drive's fluctuation"),
    "flight_height_min_m": ("minimum flight height", "lower bounces are not compared"),
    "regime_equal": ("same regime", "run and rigid model have the same pattern of motion"),
}
"""Name and meaning of each number of the comparison."""

DISTRIBUTION = {
    "impacts_compared": (
        "impacts in the rigid model",
        "not matched one by one; after flights higher than the limit below",
    ),
    "velocity_error_median": (
        "impact speed, median",
        "difference of the medians of run and rigid model, larger value of both flanks",
    ),
    "velocity_error_p95": (
        "impact speed, 95th percentile",
        "difference of run and rigid model, larger value of both flanks",
    ),
    "velocity_bias": (
        "impact speed, mean",
        "difference; positive: faster impacts in the run, larger value of both flanks",
    ),
    "phase_error_median_cycles": (
        "mean phase of the impacts",
        "difference of run and rigid model, larger value of both flanks",
    ),
}
"""Name and meaning of the numbers where distributions are compared, not single impacts."""

RATIOS = ("velocity_error_median", "velocity_error_p95", "velocity_bias")

BUDGET = {
    "facet": "flat facets in place of the involute, for collision hulls only",
    "hull_quantisation": "resolution at which Bullet stores the vertices of a hull",
    "hull_margins": "Bullet's collision margins, one per body",
    "raw_minus_refined": "gap that Bullet reports for the hulls minus the gap of the true flanks",
    "raw_allowed": "limit of this difference; a larger one stops the run",
    "location": "largest residual gap at an impact located on the true flanks",
    "step": "finite time step: none, as events end steps",
    "total": "largest error of a gap in this run: hulls only select the teeth, gaps are evaluated on the true flanks",
}
"""What the parts of the error budget come from, by how their names begin."""

NATIVE = {
    "facet": "flat facets in place of the involute: they are the contact surface and tilt the contact normal",
    "raw_minus_refined": "gap of the hulls in contact minus the gap of the true flanks",
    "total": "largest error of a gap in this run: the hulls are the contact surface; errors of rebound direction are "
    "not included",
}
"""The same for Bullet's own contact, where no impact is placed on the true flanks."""
NATIVE_WITHOUT = ("location", "step")
"""Parts that do not apply to Bullet's own contact."""


def comparison_lines(comparison: dict[str, Any] | None) -> list[Claim]:
    r"""Return the comparison with the twin as lines of a table.

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
    """Return in a few sentences what run and rigid model have in common, and what their agreement proves."""
    parts = [
        "The rigid model is independent code: it integrates one equation of motion between two walls, without solids."
    ]
    if summary.get("model") == "bullet" and summary.get("contact") == "native":
        parts.append(
            "The run moved rigid bodies in PyBullet with the contact of Bullet: flat facets and quantised hulls touch "
            "and tilt the contact normals as the gears rotate, so rebounds scatter. This causes most of the "
            "differences below; located contact avoids it."
        )
    elif summary.get("model") == "bullet":
        parts.append(
            "The run moved rigid bodies in PyBullet and located every contact on the true flank surfaces. Agreement of "
            "both verifies the location of contacts."
        )
    parts.append(
        "Both use the drag and the restitution of the scenario: agreement does not validate these for a test rig."
    )
    return " ".join(parts)


def verdict(comparison: dict[str, Any] | None) -> str:
    """Return in one sentence how well run and rigid model agree."""
    if not comparison:
        return (
            "The result is not verified: no second model was run "
            "(runs with --model bullet are compared with the rigid model)."
        )
    missed, invented = comparison.get("impacts_missed"), comparison.get("impacts_invented")
    count, median = comparison.get("impacts_compared"), comparison.get("velocity_error_median")
    if comparison.get("mode") == "distribution":
        return (
            "The motion is chaotic: run and rigid model are compared by the statistics of their impacts, not impact by "
            "impact."
        )
    matched = comparison.get("impacts_matched")
    text = f"Verification: the run reproduces {matched} of {count} impacts of the independent rigid model"
    text += f" ({missed} missed, {invented} spurious)"
    if median is not None:
        p95 = figure(comparison.get("velocity_error_p95"), "ratio", 3).text
        text += f"; impact speeds differ by {figure(median, 'ratio', 3).text} (median) and {p95} (95th percentile)"
    return text + "."
