"""``gears3d bench drop``: the coefficient of restitution of both flanks."""

from __future__ import annotations

from typing import Annotated

import typer

from gears3d.cli.bench.shared import AsJson, OutFolder, Overrides, Plot, ScenarioName, finish, quantities, write


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
