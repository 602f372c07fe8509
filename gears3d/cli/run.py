"""``gears3d run``: simulate a scenario into a run folder."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.interrupts import exit_code, interrupted
from gears3d.cli.options import MODELS, Overrides, Plot, ScenarioName, choice
from gears3d.errors import EngineError, GearsError, InputError, UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gears3d.cli.progress import Track
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

    Example: gears3d run rigaud-2020/fig5-20rpm --set impact.restitution=0.5 --out runs/e05
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
            print_summary(summary, place)
        raise type(stopped)(f"{stopped}; the run until then is in {place}")
    if as_json:
        from gears3d.cli.output import print_json

        print_json(summary)
    else:
        print_summary(summary, place)
    if summary["status"] == "partial" or interrupted():
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
                other = _twin(_until(scenario, recording), twin, track)
                comparison = None if other is None else _comparison(recording, other)
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


def _twin(scenario: Scenario, twin: str, track: Track) -> Recording | None:
    """Return the recording of the twin, ``None`` after an interrupt: the run itself is kept."""
    from gears3d.simulation import simulate

    try:
        other = simulate(scenario, twin, progress=track("twin", scenario.run.duration))
    except KeyboardInterrupt:
        other = None
    if other is None or other.meta["interrupted"]:
        typer.echo("the twin was interrupted: no comparison", err=True)
        return None
    return other


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


def refuse_with_stream(model: str, twin: str, error_estimate: bool) -> None:
    """Refuse options that need a whole recording in memory."""
    if model != "bullet":
        raise UsageError(f"model {model!r} is not streamed: --stream goes with the bullet model")
    if twin not in ("", "none"):
        raise UsageError(f"--twin {twin} needs the whole recording: omit it or --stream")
    if error_estimate:
        raise UsageError("--error-estimate needs the whole recording: omit it or --stream")


def streamed(
    folder: RunFolder, scenario: Scenario, contact: str | None, about: dict[str, Any], header: Any
) -> tuple[dict[str, Any], GearsError | None]:
    """Simulate into the folder; return the summary, and the error that ended the run early."""
    from gears3d.cli.progress import bars
    from gears3d.kernels import compiled
    from gears3d.recording.streaming import SIGNALS, excerpt
    from gears3d.runs import summarise
    from gears3d.simulation import stream

    begin = time.perf_counter()
    stopped: GearsError | None = None
    with bars() as track:
        try:
            stream(scenario, folder.path, contact=contact, progress=track("bullet", scenario.run.duration))
        except (EngineError, InputError) as error:
            if not (folder.path / SIGNALS).exists():
                raise
            stopped = error
    summary = {**summarise(scenario, excerpt(folder.path)), **about, "kernels_compiled": bool(compiled)}
    folder.write_scenario(scenario, header(summary))
    wall = time.perf_counter() - begin
    summary["wall_s"] = {"bullet": wall, "total": wall}
    folder.write_summary(summary)
    return summary, stopped


def print_summary(summary: dict[str, Any], place: Path) -> None:
    """Print the results of a run and its folder."""
    from rich.console import Console
    from rich.markup import escape

    from gears3d.cli.output import print_rows

    print_rows(summary_rows(summary), summary["title"])
    console = Console()
    for key, verdict in (summary["expect"] or {}).items():
        word = "[green]met[/]" if verdict["met"] else "[red]missed[/]"
        expected, found = escape(str(verdict["expected"])), escape(str(verdict["found"]))
        console.print(f"expected {escape(key)} = {expected}: {word} (found {found})")
    console.print(f"written to [bold]{escape(str(place))}[/]", soft_wrap=True)


def summary_rows(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the table's lines as (name, value)."""
    from gears3d.views.rows import impacts_line, regime_line

    out = []
    if summary["status"] == "partial":
        out.append(("status", f"partial: ended at {summary['reached_s']:.6g} s"))
    out += [("regime", regime_line(summary)), ("impacts after settling", impacts_line(summary))]
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
        out.append(("excitation Λ, base drag", f"{excitation:.3g} (contact loss of rigid teeth above 1)"))
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
    return out


def _agreement(comparison: dict[str, Any]) -> list[tuple[str, str]]:
    if comparison["mode"] == "distribution":
        verdict = "the twin is chaotic: compared as distributions, see report.html"
    elif not (comparison["impacts_compared"] or comparison["impacts_invented"]):
        verdict = "no impacts in either"
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
