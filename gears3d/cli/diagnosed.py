"""The terminal output of ``gears3d diagnose``: the report in short."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gears3d.diagnosis import Diagnosis
    from gears3d.diagnosis.verdict import Named


def show(found: Diagnosis) -> None:
    """Print a diagnosis."""
    from rich.console import Console
    from rich.markup import escape

    from gears3d.views.pages.diagnosed import sentence

    told = found.to_dict()
    console = Console(highlight=False, soft_wrap=True)
    console.print(f"[bold]{found.verdict.replace('_', ' ')}[/]  {escape(sentence(found, told))}")
    for name, motion in found.motions.items():
        console.print(escape(f"drive, {name}: {motion}"))
    for note in found.notes:
        place = f"{note.record}: " if note.record else ""
        console.print(escape(f"note: {place}{note.text} ({note.remedy})"))
    if found.suspects:
        kinds = ", ".join(one.kind for one in found.suspects)
        console.print(f"candidate causes with insufficient data: {kinds}")
    for k, cause in enumerate(found.causes, 1):
        console.print(f"{k}. [bold]{escape(cause.kind)}[/] ({escape(cause.place)})")
        for line in _cause(cause):
            console.print(f"     {escape(line)}")
    for line in _limits(found, told):
        console.print(escape(line))


def _cause(cause: Named) -> Iterator[str]:
    from gears3d.views.pages.diagnosed import numbers

    for row in numbers(cause):
        yield f"{row.name} {row.value}" + (f" (95 %: {row.low} to {row.high})" if row.low else "")
    yield cause.evidence
    for word, others in (("not excluded", cause.alternatives), ("excluded", cause.excluded)):
        for other in others:
            yield f"{word}: {other['kind']}: {other['why']}"


def _limits(found: Diagnosis, told: dict[str, Any]) -> Iterator[str]:
    """Return lines on error reduction, runs that separate hypotheses, residuals and minimum detectable effects."""
    from gears3d.views.pages.diagnosed import power_rows, remains, solid
    from gears3d.views.plots.numbers import percent

    held = told["heldout"]
    if held["gain"] is not None:
        low, high = (percent(each).text for each in held["gain_range"])
        many = len(held["splits"])
        over = f"in each of {many} splits" if low == high else f"{low} to {high} over {many} splits"
        yield f"error reduction: {percent(held['gain']).text} of the held-out error beyond noise ({over})"
    if line := solid(told["heldout_3d"]):
        yield line
    for one in found.runs:
        best = one.runs[0]
        if best.sigma:
            yield (f"{one.cause} or {one.rival} ({one.now:.2g} sigma apart now): {best.change} would separate them"
                   f" by {best.sigma:.3g} sigma")  # fmt: skip
    rows = remains(told)
    for row in rows:
        yield f"residual: {row['name']} ({row['raw']}): {row['size'].text}, {row['where']}"
    if not rows and found.causes and not found.law:
        yield "residual: none beyond chance"
    limits = [f"{place} {limit.text if limit.value is not None else 'not detectable'}"
              for place, limit, _ in power_rows(found)]  # fmt: skip
    if limits:
        yield f"minimum detectable effects, relative to what they act on: {', '.join(limits)}"
