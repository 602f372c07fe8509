"""``gears3d bench TEST``: virtual tests, run in the 3D engine.

To add a test: write a typer-style function of its name (underscores for hyphens) and add the test to
``gears3d.virtual_tests``.
"""

from __future__ import annotations

import csv
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.groups import LazyGroup
from gears3d.cli.options import Overrides, Plot, ScenarioName
from gears3d.virtual_tests import IN_ENGINE, RENAMED

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

    from gears3d.recording import Recording
    from gears3d.results import Result
    from gears3d.scenario import Scenario

OutFolder = Annotated[Path, typer.Option("--out", help="Folder for report.html, records, table, picture and summary.")]
Seed = Annotated[int | None, typer.Option(help="Seed of the encoder noise; default: of the scenario.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print summary.json.")]


def quantity(text: str, family: str, key: str) -> float:
    """Return a positive quantity of the command line in SI units."""
    from gears3d.errors import Fault, InputError
    from gears3d.units import parse

    try:
        value = parse(text, family)
    except InputError as error:
        raise InputError([Fault(key, fault.message, fault.remedy) for fault in error.faults]) from None
    if value <= 0.0:
        raise InputError(Fault(key, f"is {text}", "give a quantity above 0"))
    return value


def quantities(text: str, family: str, key: str) -> list[float]:
    """Return positive quantities, separated by commas, in SI units; the last unit applies to those without.

    >>> quantities("1, 2 Hz", "frequency", "--frequencies")
    [1.0, 2.0]
    """
    parts = [part.strip() for part in text.split(",")]
    unit = parts[-1].lstrip("+-.0123456789eE").strip()
    bare = [part.replace(".", "", 1).isdigit() for part in parts]
    return [quantity(f"{part} {unit}" if one else part, family, key) for part, one in zip(parts, bare, strict=True)]


def write(
    place: Path,
    scenario: Scenario,
    summary: dict[str, Any],
    *,
    tables: Mapping[str, Mapping[str, np.ndarray]],
    pictures: Mapping[str, Callable[[], Figure]],
    records: Mapping[str, Recording] | None = None,
    result: Result,
    plot: Path | None,
) -> dict[str, Any]:
    """Write the folder of a test, whole or not at all; return the summary."""
    from gears3d import __version__
    from gears3d.files import write_text
    from gears3d.provenance import provenance
    from gears3d.runs import RunFolder
    from gears3d.views.results import page

    command, records = shlex.join(["gears3d", *sys.argv[1:]]), records or {}
    summary = {
        **summary,
        "title": scenario.title,
        "source": scenario.source,
        "files": {"scenario": "scenario.toml", **{kind: sorted(some) for kind, some in
                  (("records", records), ("tables", tables), ("pictures", pictures))}},
        "version": __version__,
        "command": command,
    }  # fmt: skip
    with RunFolder(place) as folder:
        folder.write_scenario(scenario, f"gears3d {__version__}\n{command}")
        for name, record in records.items():
            record.write(folder.path / name)
        for name, columns in tables.items():
            _write_table(folder.path / name, columns)
        for name, draw in pictures.items():
            draw().savefig(folder.path / name, dpi=130)
        folder.write_summary(summary)
        files = ["summary.json", *sorted(file.name for file in folder.path.iterdir())]
        made = provenance([scenario.path], command)
        write_text(folder.path / "report.html", page(result, made, tuple(files)))
        folder.commit()
    if plot is not None:
        result.plot(plot)
    return summary


def _write_table(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file)
        out.writerow(columns)
        out.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))


def finish(summary: dict[str, Any], as_json: bool, lines: Sequence[str]) -> None:
    """Print the results: the summary as JSON, or as lines of text."""
    if as_json:
        from gears3d.cli.output import print_json

        print_json(summary)
        return
    for line in lines:
        typer.echo(line)


def coastdown(
    scenario: ScenarioName,
    out: OutFolder,
    speed: Annotated[
        str | None, typer.Option(help="Initial speed of the loose gear; default: that of its drive.")
    ] = None,
    seed: Seed = None,
    plot: Plot = None,
    set_: Overrides = None,
    as_json: AsJson = False,
) -> None:
    """Let the loose gear coast down out of mesh, by its drag alone, and identify the drag from the record.

    Example: gears3d bench coastdown base/rigaud-2020 --speed "60 rpm" --out rundown
    """
    from gears3d.bench import rundown as run
    from gears3d.cli.output import print_warnings, residual_line
    from gears3d.cli.progress import bars
    from gears3d.identify import rundown_picture
    from gears3d.runs.folder import refuse_foreign
    from gears3d.scenario import load

    refuse_foreign(out)
    rig = load(scenario, overrides=set_ or [])
    with bars() as track:
        found = run(
            rig, None if speed is None else quantity(speed, "speed", "--speed"), seed, track("coast-down", 60.0)
        )
    summary = write(
        out,
        rig,
        found.to_dict(),
        records={"record.parquet": found.record},
        tables={
            "rundown.csv": {"time_s": found.time, "theta_loose_rad": found.theta, "omega_loose_rad_s": found.omega}
        },
        result=found,
        plot=plot,
        pictures={"rundown.png": lambda: rundown_picture(found.found)},
    )
    lines = [f"standstill after {found.to_dict()['stands_after_s']:.4g} s; drag: {found.found.law}"]
    lines += [f"  {name:12} {p.value:.6g} {p.unit}" for name, p in found.found.parameters.items()]
    lines += [residual_line(found.found.goodness)]
    if not as_json:
        print_warnings(found.found.warnings)
    finish(summary, as_json, [*lines, "", f"gears3d identify coastdown {out}/record.parquet --rig {out}/scenario.toml"])


def drop(
    scenario: ScenarioName,
    out: OutFolder,
    speeds: Annotated[str, typer.Option(help="Impact velocities.")] = "5, 10, 20, 50, 100 mm/s",
    repeat: Annotated[int, typer.Option(help="Drops at each velocity, at different mesh positions.")] = 4,
    plot: Plot = None,
    set_: Overrides = None,
    as_json: AsJson = False,
) -> None:
    """Drop the loose gear on both flanks at several velocities and find the coefficient of restitution.

    Example: gears3d bench drop base/rigaud-2020 --speeds "5, 20, 100 mm/s" --out drop
    """
    from gears3d.bench import drop_picture, drops
    from gears3d.cli.progress import bars
    from gears3d.errors import Fault, InputError
    from gears3d.runs.folder import refuse_foreign
    from gears3d.scenario import load

    if repeat < 1:
        raise InputError(Fault("--repeat", f"is {repeat}", "give 1 or more"))
    refuse_foreign(out)
    rig, wanted = load(scenario, overrides=set_ or []), quantities(speeds, "velocity", "--speeds")
    with bars() as track:
        found = drops(rig, wanted, repeat, track("drop", 2.0 * repeat * len(wanted)))
    names = ("asked_m_s", "flank", "velocity_m_s", "rebound_m_s", "impulse_N_s", "tooth_drive", "tooth_loose")
    table = {**{name: found.table[name] for name in names}, "restitution": found.restitution}
    summary = write(
        out,
        rig,
        found.to_dict(),
        tables={"drop.csv": table},
        result=found,
        plot=plot,
        pictures={"drop.png": lambda: drop_picture(found)},
    )
    laws = [
        f"{flank:8} e = {law[0]:.4f} {law[1]:+.4g} s/m · v, scatter {law[2]:.2g}" for flank, law in found.laws.items()
    ]
    finish(summary, as_json, laws)


def threshold(
    scenario: ScenarioName,
    out: OutFolder,
    frequencies: Annotated[
        str | None, typer.Option(help='Frequencies of the speed fluctuation, e.g. "0.75, 1.5, 3 Hz".')
    ] = None,
    span: Annotated[
        str, typer.Option(help="Range of the speed-fluctuation amplitude, relative to the predicted threshold.")
    ] = "0.9..1.1",
    periods: Annotated[float, typer.Option(help="Periods of each sweep, half of them rising.")] = 80.0,
    seed: Seed = None,
    plot: Plot = None,
    set_: Overrides = None,
    as_json: AsJson = False,
) -> None:
    """Sweep the speed-fluctuation amplitude up and down; Λ* is where the gap first (last) opens by more than 0.1 µm.

    Example: gears3d bench threshold rigaud-2020/fig5-5rpm --frequencies "1.5, 3 Hz" --out threshold

    Identify from its record: gears3d identify threshold threshold/record-3Hz.parquet --rig threshold/scenario.toml
    """
    from math import isnan

    from gears3d.bench import threshold_picture, thresholds
    from gears3d.cli.progress import bars
    from gears3d.runs.folder import refuse_foreign
    from gears3d.scenario import load

    refuse_foreign(out)
    rig = load(scenario, overrides=set_ or [])
    wanted = [] if frequencies is None else quantities(frequencies, "frequency", "--frequencies")
    with bars() as track:
        lasts = sum(periods / each for each in wanted or [1.0 / rig.period])
        found = thresholds(rig, wanted, _span(span), periods, seed, track("sweeps", lasts))
    names = [f"record-{one.frequency:g}Hz.parquet" for one in found.sweeps]
    summary = write(
        out,
        rig,
        found.to_dict(),
        records=dict(zip(names, (one.record for one in found.sweeps), strict=True)),
        tables={
            f"losses-{one.frequency:g}Hz.csv": dict(
                zip(("time_s", "excitation", "opening_m"), one.losses.T, strict=True)
            )
            for one in found.sweeps
        },
        result=found,
        plot=plot,
        pictures={"threshold.png": lambda: threshold_picture(found)},
    )
    lines = [f"{'Hz':>8} {'Λ* up':>8} {'Λ* down':>8} {'predicted':>10}"]
    for one in found.sweeps:
        seen = ["    none" if isnan(level) else f"{level:8.4f}" for level in (one.up, one.down)]
        lines.append(f"{one.frequency:8g} {seen[0]} {seen[1]} {one.predicted:10.4f}")
    if summary["slope"] is not None:
        lines.append(f"slope of log ω over log(ΔΩ/Td): {summary['slope']:.4f}")
    finish(summary, as_json, lines)


def _span(text: str) -> tuple[float, float]:
    from gears3d.errors import Fault, InputError

    low, _, high = text.partition("..")
    try:
        span = float(low), float(high)
    except ValueError:
        span = (0.0, 0.0)
    if not 0.0 < span[0] < span[1]:
        raise InputError(Fault("--span", f"is {text!r}", "give two numbers above 0, e.g. 0.9..1.1"))
    return span


def transmission_error(
    scenario: ScenarioName,
    out: OutFolder,
    speed: Annotated[str, typer.Option(help="Speed of the drive gear, each way.")] = "1 rpm",
    turns: Annotated[
        float | None, typer.Option(help="Revolutions of the drive gear, each way; default: whole hunting cycles.")
    ] = None,
    seed: Seed = None,
    plot: Plot = None,
    set_: Overrides = None,
    as_json: AsJson = False,
) -> None:
    """Turn the rig slowly forward on its active and back on its reverse flanks: transmission errors φ, ψ, backlash.

    Example: gears3d bench transmission-error rigaud-2020/fig2 --out ste

    Identify from its record: gears3d identify transmission-error ste/record.parquet --rig ste/scenario.toml
    """
    from math import pi

    from gears3d.bench import static_error, static_picture
    from gears3d.bench.ste import cycles
    from gears3d.cli.progress import bars
    from gears3d.runs.folder import refuse_foreign
    from gears3d.scenario import load

    refuse_foreign(out)
    rig = load(scenario, overrides=set_ or [])
    pace = quantity(speed, "speed", "--speed")
    with bars() as track:
        lasts = 4.0 * pi * (cycles(rig) if turns is None else turns) / pace
        found = static_error(rig, pace, turns, seed, track("slow revolutions", lasts))
    table = {"theta_drive_rad": found.theta, **{f"{name}_m": curve for name, curve in found.curves().items()}}
    summary = {**found.to_dict(), "error_budget": found.meta["error_budget"], "wall_s": found.meta["wall_s"]}
    summary = write(
        out,
        rig,
        summary,
        records={"record.parquet": found.record},
        tables={"ste.csv": table},
        result=found,
        plot=plot,
        pictures={"ste.png": lambda: static_picture(found)},
    )
    lines = []
    for name, about in (("phi", "active flank φ"), ("psi", "reverse flank ψ"), ("backlash", "backlash b")):
        curve = summary[name]
        reach = 1e6 * (curve["largest_m"] - curve["smallest_m"])
        lines.append(f"{about:16} mean {1e6 * curve['mean_m']:9.3f} µm, peak to peak {reach:8.3f} µm")
    then = f"gears3d identify transmission-error {out}/record.parquet --rig {out}/scenario.toml"
    finish(summary, as_json, [*lines, "", then])


class _Tests(LazyGroup):
    package, line, noun, single = "gears3d.cli.bench", "gears3d bench", "test", True
    renamed = RENAMED
    panels = {"Tests": IN_ENGINE}  # noqa: RUF012


app = typer.Typer(cls=_Tests, name="bench", add_completion=False, no_args_is_help=True)


@app.callback()
def bench() -> None:
    """Run a virtual test of a rig in the 3D engine; write its records as a test rig would, and its results.

    Every test has a --help of its own and takes --out DIR and --json.

    Example: gears3d bench transmission-error rigaud-2020/fig2 --out ste
    """
