"""``gears3d plan``: runs to measure next, with the intervals that they will give."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gears3d.cli.options import Overrides, Plot, ScenarioName, keep, to_results

if TYPE_CHECKING:
    from gears3d.cli.progress import Tick
    from gears3d.diagnosis.planner import Option


def plan(
    scenario: ScenarioName,
    causes: Annotated[
        str,
        typer.Option(
            metavar="KIND[:KEY=VALUE],...",
            help="Causes to be known (gears3d list effects). Default: drag, restitution and backlash.",
        ),
    ] = "",
    separate: Annotated[
        str, typer.Option(metavar="SET,SET", help="Sets of causes to be separated, members joined by +.")
    ] = "",
    nuisances: Annotated[
        str, typer.Option(metavar="KIND,...", help="Causes that are free as well, whose size is not asked for.")
    ] = "",
    size: Annotated[str, typer.Option(help="Size that must show at 5 sigma, of each cause's unit size.")] = "1 %",
    at: Annotated[str, typer.Option(help="Size at which intervals are predicted. Default: --size.")] = "",
    speeds: Annotated[
        str, typer.Option(help='Mean speeds, "300 rpm, 900 rpm". Default: 1/3, 1, 3 times the rig\'s.')
    ] = "",
    amplitudes: Annotated[
        str, typer.Option(help="Amplitudes of the speed fluctuation. Default: 0.7, 1, 2 times the rig's.")
    ] = "",
    lengths: Annotated[str, typer.Option(help="Durations of a record.")] = "5 s, 20 s, 60 s",
    counts: Annotated[str, typer.Option(help="Counts per revolution of both encoders, a plan for each.")] = "",
    noise: Annotated[str, typer.Option(help='Noise of both encoders, e.g. "5 urad". Default: that of the rig.')] = "",
    like: Annotated[
        Path | None, typer.Option(metavar="RECORD", help="Measured record whose counts and noise the encoders have.")
    ] = None,
    most: Annotated[int, typer.Option(help="Runs at most.", min=1, max=12)] = 4,
    marks: Annotated[bool, typer.Option("--marks/--no-marks", help="Whether encoders have index marks.")] = True,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for report, plan.json and a scenario of each run.", callback=to_results()),
    ] = None,
    plot: Plot = None,
    set_: Overrides = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the plan as JSON.")] = False,
) -> None:
    """Plan runs that make causes known to a size, or separate sets of causes, and predict their intervals.

    Example: gears3d plan rigaud-2020/fig5-20rpm --causes drag_coulomb,restitution_offset --counts 512,8192

    Sets that records do not distinguish: gears3d plan mine.toml --separate drag_viscous,drag_coulomb --out next
    """
    from gears3d.cli.progress import bars
    from gears3d.diagnosis import plan as make
    from gears3d.diagnosis.planner import amounts
    from gears3d.scenario import load

    rig = load(scenario, set_ or ())
    wanted = {name: [one.strip() for one in text.split(",") if one.strip()]
              for name, text in (("causes", causes), ("separate", separate), ("nuisances", nuisances))}  # fmt: skip
    share = {name: amounts(text, "ratio", f"--{name}") for name, text in (("size", size), ("at", at))}
    quiet = amounts(noise, "angle", "--noise")
    with bars() as track:
        ticks: dict[str, Tick] = {}

        def tell(doing: str, part: float) -> None:
            stage, _, what = doing.partition(" ")
            if stage not in ticks:
                ticks[stage] = track(stage, 1.0)
            ticks[stage](part, what)

        found = make(
            rig, **wanted, size=share["size"][0], at=(share["at"] or [None])[0],
            speeds=amounts(speeds, "speed", "--speeds"), amplitudes=amounts(amplitudes, "speed", "--amplitudes"),
            lengths=amounts(lengths, "time", "--lengths"),
            counts=[round(one) for one in amounts(counts, "count", "--counts")], noise=(quiet or [None])[0],
            like=like, most=most, marks=marks, progress=tell,
        )  # fmt: skip
    kept = keep(found, out, plot, [rig.path, like])
    if as_json:
        from gears3d.cli.output import print_json

        print_json(found.to_dict())
        return
    for option in found.options:
        _print(option)
    typer.echo("\n".join(kept))
    if out is not None:
        typer.echo("\n".join(f"run: {out / name}" for name, _ in found.scenarios()))


def _print(option: Option) -> None:
    """Print the runs for one kind of encoders."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    from gears3d.views.plots.numbers import figure
    from gears3d.views.rows import aim_row, interval_rows

    console = Console(highlight=False, width=None if sys.stdout.isatty() else 120)
    columns = ("run", "speed", "length", "parameter", "95 %, alone", "95 %, with those before")
    tried = option.runs or option.grid
    title = f"{option.encoder}" + ("" if option.runs else ": runs that were tried")
    table = Table(*columns, title=escape(title), title_justify="left", box=None, padding=(0, 2, 0, 0))
    for k, run in enumerate(tried, 1):
        lines = [*interval_rows(run), *((name, f"{value:.3g} sigma apart", "") for name, value in run.apart.items())]
        for number, line in enumerate(lines):
            first = (str(k), run.name, figure(run.duration, "time").text) if number == 0 else ("", "", "")
            table.add_row(*map(escape, (*first, *line)))
    console.print(table)
    for one in option.aims:
        console.print(escape(": ".join(aim_row(one))))
    if option.ended:
        console.print(escape(f"no further run: {option.ended}"))
    for name, why in option.excluded.items():
        console.print(escape(f"excluded: {name}: {why}"))
