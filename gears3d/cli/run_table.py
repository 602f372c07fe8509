"""The short table that ``gears3d run`` prints."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from gears3d.views.results.rows import impacts_line, regime_line


def show(summary: dict[str, Any], place: Path) -> None:
    """Print the results of a run and its folder."""
    console = Console()
    title = escape(summary["title"])
    table = Table(title=title, title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, value in rows(summary):
        table.add_row(name, escape(value))
    console.print(table)
    for key, verdict in (summary["expect"] or {}).items():
        word = "[green]met[/]" if verdict["met"] else "[red]missed[/]"
        expected, found = escape(str(verdict["expected"])), escape(str(verdict["found"]))
        console.print(f"expected {escape(key)} = {expected}: {word} (found {found})")
    console.print(f"written to [bold]{escape(str(place))}[/]", soft_wrap=True)


def rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the table's lines as (name, value)."""
    out = [("regime", regime_line(summary)), ("impacts after settling", impacts_line(summary))]
    for flank in ("active", "reverse"):
        speed = summary.get(f"{flank}_velocity_mean_m_s")
        if speed is not None:
            hard = summary.get(f"{flank}_crossing_velocity_mean_m_s")
            first = "" if hard is None else f"; {abs(hard) * 1e3:.2f} mm/s without bounces"
            out.append((f"mean impact speed, {flank}", f"{abs(speed) * 1e3:.2f} mm/s{first}"))
    power = summary.get("energy_J_s")
    if power:
        out.append(("power dissipated by impacts", f"{power * 1e3:.3g} mW"))
    excitation = summary.get("excitation")
    if excitation is not None:
        out.append(("excitation Λ", f"{excitation:.3g} (contact loss of rigid teeth above 1)"))
    if summary["comparison"]:
        out += _agreement(summary["comparison"])
    budget = summary["error_budget"]
    if summary["contact"] == "native":
        out.append(("note", "native contact: facets tilt the normals of rotating gears; located is exact"))
    elif budget:
        out.append(("error budget of the gap", f"{budget['total'] * 1e9:.2g} nm"))
    if summary.get("error_estimate"):
        out.append(("error by half the step", _estimate(summary["error_estimate"])))
    out.append(("speed", _speed(summary)))
    if summary["status"] == "partial":
        out.append(("status", f"partial: ended at {summary['reached_s']:.6g} s"))
    return out


def _agreement(comparison: dict[str, Any]) -> list[tuple[str, str]]:
    if comparison["mode"] == "distribution":
        verdict = "the twin is chaotic: compared as distributions, see report.html"
    else:
        missed, invented = comparison["impacts_missed"], comparison["impacts_invented"]
        matched = f"{comparison['impacts_matched']} of {comparison['impacts_compared']} impacts matched"
        verdict = f"{matched}, {missed} missed, {invented} invented"
    lines = [("compared with the twin", verdict)]
    median, p95 = comparison["velocity_error_median"], comparison["velocity_error_p95"]
    if median is not None and comparison["mode"] == "distribution":
        lines.append(("impact speed", f"median deviates by {_percent(median)}, 95th percentile by {_percent(p95)}"))
    elif median is not None:
        lines.append(("speed error of the matched", f"median {_percent(median)}, 95 % below {_percent(p95)}"))
    return lines


def _estimate(found: dict[str, Any]) -> str:
    place, speed = found["displacement_m"] * 1e9, found["impact_velocity_m_s"] * 1e3
    until = f" until the motions separate at {found['until_s']:.3g} s" if found["parted"] else ""
    return f"{place:.2g} nm, impact speeds {speed:.2g} mm/s{until}"


def _percent(ratio: float) -> str:
    return f"{100 * ratio:.2g} %"


def _speed(summary: dict[str, Any]) -> str:
    wall = summary["wall_s"]
    total = wall["total"]
    engine = wall.get(summary["model"])
    done = summary["reached_s"]
    alone = f" (model {done / engine:.2g} x)" if engine else ""
    first = ", kernels compiled" if summary["kernels_compiled"] else ""
    return f"{done:.3g} s in {total:.2f} s{first}: {done / total:.2g} x real time{alone}"
