"""``gears3d diagnose``: causes of deviations between measured records and a rig, and the extended rig."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import (
    Begin,
    Correct,
    End,
    MapFile,
    Plot,
    Records,
    RequiredRig,
    RigOverrides,
    StatedMotion,
    command,
    span_of,
    to_folder,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from gears3d.diagnosis import Diagnosis
    from gears3d.diagnosis.verdict import Named
    from gears3d.measured.checks import Admitted


def diagnose(
    rig: RequiredRig,
    records: Records = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for report, diagnosis, extended rig and replay.", callback=to_folder)
    ] = None,
    plot: Plot = None,
    map_file: MapFile = None,
    correct: Correct = None,
    begin: Begin = "",
    to: End = "",
    stated_motion: StatedMotion = False,
    set_: RigOverrides = None,
    bodies: Annotated[
        bool, typer.Option("--3d/--no-3d", help="Measure the held-out error reduction in the 3D engine as well.")
    ] = True,
    experiments: Annotated[
        bool, typer.Option("--experiments/--no-experiments", help="Propose runs that separate competing hypotheses.")
    ] = True,
    effort: Annotated[
        float, typer.Option(help="Multiple of the usual budget of the search for causes.", min=0.1)
    ] = 1.0,
    film: Annotated[
        bool, typer.Option("--replay/--no-replay", help="Write replay.rrd: record, rig and extended rig.")
    ] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print the diagnosis as JSON.")] = False,
) -> None:
    """Find where measured records deviate from a rig, identify the cause, extend the rig, measure the error reduction.

    Example: gears3d diagnose blind/record.toml --rig blind/rig.toml --out found

    Records to practise on: gears3d challenge --seed 7 --out blind

    Several records at several speeds separate causes that one record cannot.
    """
    from gears3d.cli.output import show_repeated
    from gears3d.cli.progress import bars
    from gears3d.diagnosis import diagnose as examine
    from gears3d.errors import UsageError
    from gears3d.measured.checks import admit_each
    from gears3d.provenance import provenance
    from gears3d.scenario import load

    bench = load(rig, set_ or ())
    if not records and map_file is None:
        raise UsageError("name measured records, e.g. gears3d diagnose record.toml --rig rig.toml --out found")
    span = span_of(begin, to)
    admission = admit_each(records or [], bench, map_file, correct or (), stated_motion=stated_motion, span=span)
    admitted = admission.all()
    show_repeated(admission.repeated)
    with bars() as track:
        tick = track("diagnose", 1.0)
        found = examine(
            admitted, bench, lambda doing, part: tick(part, doing), bodies=bodies, runs=experiments, effort=effort
        )
    filmed = ""
    made = provenance([file for one in admitted for file in one.inputs], command())
    if out is not None:
        _write(found, out, made)
        filmed = _replay(found, admitted, out / "replay.rrd") if film else ""
    if plot is not None:
        found.plot(plot)
    if as_json:
        from gears3d.cli.output import print_json

        print_json({**found.to_dict(), "provenance": made})
        return
    print_diagnosis(found)
    if out is None:
        typer.echo("to write a report and the extended rig: --out DIR")
    else:
        typer.echo(f"report: {out / 'report.html'}")
        typer.echo(f"{'extended rig' if found.causes else 'rig unchanged'}: {out / 'extended.toml'}")
    if filmed:
        typer.echo(filmed)


def _write(found: Diagnosis, out: Path, made: dict[str, Any]) -> None:
    import json

    from gears3d.diagnosis import extended_text
    from gears3d.files import replacing
    from gears3d.provenance import comment
    from gears3d.views.pages.diagnosed import write

    out.mkdir(parents=True, exist_ok=True)
    with replacing(out / "diagnosis.json") as unfinished:
        unfinished.write_text(json.dumps({**found.to_dict(), "provenance": made}, indent=2) + "\n", encoding="utf-8")
    with replacing(out / "extended.toml") as unfinished:
        unfinished.write_text((comment(made) if found.causes else "") + extended_text(found), encoding="utf-8")
    write(out / "report.html", found, made, ("diagnosis.json", "extended.toml"))


def _replay(found: Diagnosis, admitted: Sequence[Admitted], file: Path) -> str:
    """Write the replay and return a line about it; where that fails, report the reason and remove an earlier replay."""
    from gears3d.cli.progress import bars
    from gears3d.diagnosis.validity import excerpt
    from gears3d.errors import GearsError
    from gears3d.views.replay.document import beside, off
    from gears3d.views.replay.scene import require_rerun

    with bars() as track:
        tick = track("replay", 2.0)
        try:
            require_rerun()
            made = excerpt(found, admitted)
            tick(1.0)
            beside(made, tuple(cause.kind for cause in found.causes), file)
            tick(2.0)
        except GearsError as error:
            file.unlink(missing_ok=True)
            typer.echo(f"no replay.rrd: {error}", err=True)
            return ""
    span = f"{Path(made.name).name}, {made.measured.time[0]:.4g} to {made.measured.time[-1]:.4g} s"
    return f"replay: {file} ({span}. {off(made)})"


def print_diagnosis(found: Diagnosis) -> None:
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
        chance = f"probability {cause.probability:.2f}"
        console.print(f"{k}. [bold]{escape(cause.kind)}[/] ({escape(cause.place)}), {chance}")
        for line in _cause_lines(cause):
            console.print(f"     {escape(line)}")
    for one in found.posterior:
        console.print(f"probability {one.probability:.3f}: {escape(one.text)}")
    for line in _limits(found, told):
        console.print(escape(line))


def _cause_lines(cause: Named) -> Iterator[str]:
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
    if not rows and found.causes:
        yield "residual: none beyond chance"
    limits = [f"{place} {limit.text if limit.value is not None else 'not detectable'}"
              for place, limit, _ in power_rows(found)]  # fmt: skip
    if limits:
        yield f"minimum detectable effects, relative to what they act on: {', '.join(limits)}"
