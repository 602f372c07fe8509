"""``gears3d run``: simulate a scenario into a run folder."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.interrupts import exit_code
from gears3d.cli.options import MODELS, Overrides, Plot, ScenarioName, choice
from gears3d.cli.run_stream import refuse_with_stream, streamed
from gears3d.errors import EngineError, GearsError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gears3d.recording import Recording
    from gears3d.runs import RunFolder
    from gears3d.scenario import Scenario


def run(
    scenario: ScenarioName,
    model: Annotated[
        str, choice("bullet: rigid bodies in PyBullet; rigid: 1-DOF; plastic: closed form.", *MODELS)
    ] = "bullet",
    contact: Annotated[str | None, choice("Contact of the bullet model; default located.", "located", "native")] = None,
    twin: Annotated[str, choice("Model to compare with; default rigid for bullet, else none.", *MODELS, "none")] = "",
    out: Annotated[Path | None, typer.Option(help="Run folder; default runs/<name of the scenario>.")] = None,
    plot: Plot = None,
    set_: Overrides = None,
    views: Annotated[bool, typer.Option(help="Write replay.rrd and report.html.")] = True,
    error_estimate: Annotated[
        bool,
        typer.Option("--error-estimate", help="Repeat the bullet model with half the step; report the difference."),
    ] = False,
    stream: Annotated[
        bool, typer.Option("--stream", help="Write samples as they are computed: constant memory, no twin, no views.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print summary.json instead of the table.")] = False,
) -> None:
    """Simulate a scenario, compare it with its twin, and write the run folder.

    Example: gears3d run rigaud-2020/fig5-20rpm --set impact.restitution=0.5
    """
    from gears3d.runs import RunFolder, default_folder
    from gears3d.scenario import load

    begin = time.perf_counter()
    if stream:
        refuse_with_stream(model, twin, error_estimate)
    question = load(scenario, overrides=set_ or [])
    twin = twin or ("rigid" if model == "bullet" else "none")
    if twin != "none":
        _refuse_twin(question, twin)
    place = out or default_folder(question)
    with RunFolder(place) as folder:
        how = {"contact": contact, "error_estimate": error_estimate}
        if stream:
            about = {"command": _command()}
            summary, stopped = streamed(folder, question, contact, about, _header)
        else:
            summary, stopped = _fill(folder, question, model, how, twin, views, begin)
        folder.commit()
    if plot is not None:
        from gears3d.runs import read_run

        read_run(place).recording.plot(plot)
    if stopped is not None:
        if not as_json:
            from gears3d.cli.run_table import show

            show(summary, place)
        raise type(stopped)(f"{stopped}; the run until then is in {place}")
    if as_json:
        from gears3d.cli.output import print_json

        print_json(summary)
    else:
        from gears3d.cli.run_table import show

        show(summary, place)
    if summary["status"] == "partial":
        raise typer.Exit(exit_code())
    if any(not verdict["met"] for verdict in summary["expect"].values()):
        raise typer.Exit(1)


def _refuse_twin(scenario: Scenario, twin: str) -> None:
    """Refuse a twin that does not support the scenario, before the run."""
    from gears3d.errors import InputError
    from gears3d.simulation import refusals

    if faults := refusals(scenario, twin):
        raise InputError([replace(fault, remedy=f"{fault.remedy}; or --twin none") for fault in faults])


def _fill(
    folder: RunFolder, scenario: Scenario, model: str, how: dict[str, Any], twin: str, views: bool, begin: float
) -> tuple[dict[str, Any], EngineError | None]:
    """Simulate and write everything into the folder; return the summary, and the error that ended the run early."""
    from gears3d.cli.progress import bars
    from gears3d.runs import summarise
    from gears3d.simulation import simulate

    wall: dict[str, float] = {}
    about = {"command": _command()}
    stopped: EngineError | None = None
    with bars() as track:
        with _clock(wall, model):
            try:
                whole = scenario.run.duration * (2.0 if how["error_estimate"] else 1.0)
                recording = simulate(scenario, model, **how, progress=track(model, whole))
            except EngineError as error:
                if error.partial is None:
                    raise
                recording, stopped = error.partial, error
        other, comparison = None, None
        # an error of twin or views must not lose the data of an interrupted run
        spared = suppress(GearsError) if stopped else nullcontext()
        if twin != "none":
            with _clock(wall, "twin"), spared:
                other = simulate(_until(scenario, recording), twin)
                comparison = _comparison(recording, other)
        summary = {**summarise(scenario, recording, comparison), **about}
        with _clock(wall, "files"):
            folder.write_scenario(scenario, _header(summary))
            folder.write_recording(recording)
            if other is not None:
                folder.write_recording(other, "twin")
        if views:
            with _clock(wall, "replay"):
                _replay(folder, scenario, recording, other)
            summary |= _costs(wall, begin)
            with _clock(wall, "report"):
                _report(folder, scenario, recording, other, summary)
    summary |= _costs(wall, begin)
    folder.write_summary(summary)
    return summary, stopped


def _costs(wall: dict[str, float], begin: float) -> dict[str, Any]:
    """Return the wall times of the stages, and whether kernels had to be compiled for this machine."""
    from gears3d.kernels import compiled

    return {"wall_s": {**wall, "total": time.perf_counter() - begin}, "kernels_compiled": bool(compiled)}


def _until(scenario: Scenario, recording: Recording) -> Scenario:
    """Return the scenario as far as the recording got: an interrupted run has a twin of its own length."""
    if not recording.meta.get("interrupted"):
        return scenario
    reached = recording.meta["reached_s"]
    settle = min(scenario.run.settle, reached / 2)
    return scenario.with_({"run.duration": f"{reached!r} s", "run.settle": f"{settle!r} s"})


def _comparison(recording: Recording, twin: Recording) -> dict[str, Any]:
    from gears3d.comparison import compare

    return compare(recording, twin).to_dict()


def _replay(folder: RunFolder, scenario: Scenario, recording: Recording, twin: Recording | None) -> None:
    from gears3d.errors import MissingExtraError
    from gears3d.views.replay import replay

    try:
        replay(recording, scenario=scenario, twin=twin, out=folder.path / "replay.rrd")
    except MissingExtraError as error:
        typer.echo(f"no replay.rrd: {error}", err=True)


def _report(
    folder: RunFolder, scenario: Scenario, recording: Recording, twin: Recording | None, summary: dict[str, Any]
) -> None:
    from gears3d.views.pages.run import over_a_period, write

    about = {"scenario": scenario, "recording": recording, "twin": twin, "summary": summary}
    files = sorted({file.name for file in folder.path.iterdir() if file.is_file()} | {"summary.json"})
    write(folder.path / "report.html", **about, strip=over_a_period(recording, scenario), files=tuple(files))


def _command() -> str:
    """Return the command line."""
    import shlex

    return shlex.join(["gears3d", *sys.argv[1:]])


def _header(summary: dict[str, Any]) -> str:
    import platform

    return (
        f"{summary['command']}\ngears3d {summary['version']}, Python {platform.python_version()}, "
        f"{platform.machine()}, seed {summary['seed']}"
    )


@contextmanager
def _clock(wall: dict[str, float], name: str) -> Iterator[None]:
    begin = time.perf_counter()
    yield
    wall[name] = time.perf_counter() - begin
