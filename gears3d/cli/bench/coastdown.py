"""``gears3d bench coastdown``: the drag on the loose gear from a coast-down."""

from __future__ import annotations

from typing import Annotated

import typer

from gears3d.cli.bench.shared import AsJson, OutFolder, Overrides, Plot, ScenarioName, Seed, finish, quantity, write


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
    finish(summary, as_json, [*lines, "", f"gears3d identify coastdown {out}/record.parquet --rig {out}/scenario.toml"])
