"""``gears3d bench threshold``: contact loss in sweeps up and down."""

from __future__ import annotations

from typing import Annotated

import typer

from gears3d.cli.bench.shared import AsJson, OutFolder, Overrides, Plot, ScenarioName, Seed, finish, quantities, write


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
