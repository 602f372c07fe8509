"""What a run came to, as the contract's ``summary.json``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gears3d.recording import describe

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

FORMAT = 1  # Of summary.json


def summarise(scenario: Scenario, recording: Recording, comparison: dict[str, Any] | None = None) -> dict[str, Any]:
    """Return the summary of a run.

    Args:
        scenario: what was simulated.
        recording: of the run.
        comparison: with the twin, as the contract has it; ``None`` when no twin ran.

    Returns:
        A dictionary that JSON can hold: status, regime, impacts, comparison, error budget, expectations.
    """
    meta = recording.meta
    outcome = describe(recording)
    partial = bool(meta.get("interrupted"))
    if partial and float(meta["reached_s"]) - scenario.run.settle < scenario.period:
        outcome |= {"regime": None, "motion": None, "impacts_per_period": None}
        comparison = None
    return {
        "format": FORMAT,
        "status": "partial" if partial else "complete",
        "reached_s": float(meta["reached_s"]) if partial else scenario.run.duration,
        "stopped_by": meta.get("stopped_by"),
        **{key: meta.get(key) for key in ("title", "source", "model", "contact", "version", "seed")},
        "period_s": scenario.period,
        **outcome,
        "comparison": comparison,
        "error_budget": meta.get("error_budget"),
        "error_estimate": meta.get("error_estimate"),
        "expect": None if partial else judge(scenario, outcome),
    }


def judge(scenario: Scenario, outcome: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Hold the outcome against the scenario's ``[expect]``.

    Args:
        scenario: with its expectations.
        outcome: regime, motion and impacts after the settling time, of :func:`gears3d.recording.describe`.

    Returns:
        For each expectation ``{"expected", "found", "met"}``.
    """
    verdicts: dict[str, dict[str, Any]] = {}
    for key, expected in scenario.expect.items():
        found = outcome.get(key)
        if isinstance(expected, float) and isinstance(found, float | int):
            met = abs(found - expected) <= 0.02 * abs(expected)
        else:
            met = found == expected
        verdicts[key] = {"expected": expected, "found": found, "met": bool(met)}
    return verdicts
