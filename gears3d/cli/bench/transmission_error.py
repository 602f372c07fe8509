"""``gears3d bench transmission-error``: the transmission error of both flanks from slow revolutions."""

from __future__ import annotations

from typing import Annotated

import typer

from gears3d.cli.bench.shared import AsJson, OutFolder, Overrides, Plot, ScenarioName, Seed, finish, quantity, write


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
