"""``gears3d sweep``: runs over a grid as one dataset with figures."""

from __future__ import annotations

import platform
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.interrupts import exit_code
from gears3d.cli.options import MODELS, Overrides, Plot, ScenarioName, choice

if TYPE_CHECKING:
    from gears3d.sweep import Done, Plan


def sweep(
    scenario: ScenarioName,
    out: Annotated[Path, typer.Option(help="Folder; an unfinished sweep in it is continued.")],
    vary: Annotated[
        list[str],
        typer.Option(
            metavar="KEY=VALUES", help='"KEY=A..B UNIT lin N", "... log N", "KEY=a,b,c UNIT", "KEY=@file.csv UNIT".'
        ),
    ],
    model: Annotated[str, choice("Model of every point.", *MODELS)] = "rigid",
    measure: Annotated[
        str,
        typer.Option(
            metavar="threshold|regime|velocities|impulses|poincare|ri|level,...",
            help="Results, with commas; default: all of the model.",
        ),
    ] = "",
    follow: Annotated[
        str, typer.Option(metavar="KEY", help="Continue the motion from point to point along this axis, up and down.")
    ] = "",
    periods: Annotated[int | None, typer.Option(help="Periods of every point; default: those of run.duration.")] = None,
    settle: Annotated[int | None, typer.Option(help="Periods excluded at the start; default: run.settle.")] = None,
    keep: Annotated[int | None, typer.Option(help="Periods with Poincaré sections, at the end; default 32.")] = None,
    strobe: Annotated[float, typer.Option(help="Phase of the Poincaré sections, in cycles.")] = 0.0,
    workers: Annotated[int | None, typer.Option(help="Processes; default all cores. 0: in this process.")] = None,
    scheduler: Annotated[str, typer.Option(help="Scheduler of a dask cluster, e.g. tcp://127.0.0.1:8786.")] = "",
    point_limit: Annotated[str, typer.Option(help="Time limit of a point, e.g. '60 s'; default none.")] = "",
    longest: Annotated[str, typer.Option(help="A sweep with a longer estimated time is not started.")] = "86400 s",
    block: Annotated[int | None, typer.Option(help="Points of a block; default: a few seconds of work.")] = None,
    plot: Plot = None,
    set_: Overrides = None,
    estimate: Annotated[bool, typer.Option(help="Print the estimated time only.")] = False,
    pictures: Annotated[bool, typer.Option(help="Draw the figures of the dataset.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print a summary as JSON.")] = False,
) -> None:
    """Run a scenario over a grid of values and write one labelled dataset, sweep.nc, and its figures.

    The same command continues an interrupted sweep.

    Example: gears3d sweep rigaud-2020/fig5-20rpm --vary "drag.torque=0.1..1.5 N m lin 50" --out sweep
    """
    from gears3d.scenario import load
    from gears3d.sweep import make_plan
    from gears3d.sweep import sweep as run

    words = tuple(word.strip() for word in measure.split(",") if word.strip())
    question = load(scenario, set_ or ())
    plan = make_plan(question, vary, model, words, follow, periods, settle, keep, strobe)
    limit = _seconds(point_limit, "--point-limit") if point_limit else float("inf")
    if estimate:
        _tell_estimate(plan, workers, limit, as_json)
        return
    about = {
        "command": shlex.join(["gears3d", *sys.argv[1:]]),
        "machine": f"Python {platform.python_version()}, {platform.machine()}",
    }
    say = (lambda _: None) if as_json else lambda text: typer.echo(text, err=True)
    with _bar(plan.size) as track:
        try:
            done = run(plan, out, workers, scheduler, limit, _seconds(longest, "--longest"), block, about, say, track)
        except KeyboardInterrupt:
            typer.echo(f"interrupted: finished blocks are in {out}; the same command continues", err=True)
            raise typer.Exit(exit_code()) from None
    drawn = _draw(done.place) if pictures else []
    if pictures:
        done.save(done.place, command=about["command"], inputs=[question.path])
    if plot is not None:
        done.plot(plot)
    _report(done, drawn, as_json)


def _seconds(text: str, key: str) -> float:
    from gears3d.errors import Fault, InputError
    from gears3d.units import parse

    try:
        value = parse(text, "time")
    except InputError as why:
        raise InputError([Fault(key, fault.message, fault.remedy) for fault in why.faults]) from None
    if value <= 0.0:
        raise InputError(Fault(key, f"is {text}", "give a time above 0 s"))
    return value


def _bar(points: int) -> Any:
    """Give a function that takes the number of points that are done; it raises after Ctrl-C."""
    from contextlib import contextmanager

    from gears3d.cli.progress import bars

    @contextmanager
    def bar() -> Any:
        with bars() as track:
            yield track("points", points)

    return bar()


def _tell_estimate(plan: Plan, workers: int | None, limit: float, as_json: bool) -> None:
    from gears3d.sweep.run import cores, estimate

    found = estimate(plan, workers or cores(), limit)
    if as_json:
        from gears3d.cli.output import print_json

        print_json({"points": found.points, "point_s": found.point_s, "workers": found.workers, "s": found.total_s})
        return
    typer.echo(str(found))


def _draw(place: Path) -> list[Path]:
    from gears3d.sweep.drawing import draw

    return draw(place)


def _report(done: Done, drawn: list[Path], as_json: bool) -> None:
    files = [done.place / "sweep.nc", *drawn, *([done.place / "report.html"] if drawn else [])]
    if (done.place / "failed.csv").exists():
        files.append(done.place / "failed.csv")
    if as_json:
        from gears3d.cli.output import print_json

        print_json({
            "points": done.plan.size, **done.counts, "resumed": done.resumed,
            "wall_s": done.seconds, "processors_s": done.work_s, "dims": dict(done.plan.dims), "key": done.plan.key,
            "files": [str(path) for path in files],
        })  # fmt: skip
        return
    from gears3d.sweep.run import duration

    grid = " x ".join(f"{size} {name}" for name, size in done.plan.dims)
    typer.echo(f"{done.plan.size} points ({grid}) in {duration(done.seconds)}, {done.plan.periods} periods each")
    bad = {word: count for word, count in done.counts.items() if word != "done" and count}
    if bad:
        counts = ", ".join(f"{count} {word.replace('_', ' ')}" for word, count in bad.items())
        typer.echo(f"not done: {counts}; reasons in {done.place / 'failed.csv'}")
    for path in files:
        typer.echo(str(path))
