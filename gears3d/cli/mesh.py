"""``gears3d mesh``: solids of both gears as files for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import Overrides, ScenarioName, to_folder

if TYPE_CHECKING:
    from gears3d.gears import Pair
    from gears3d.scenario import Scenario


def mesh(
    scenario: ScenarioName,
    out: Annotated[Path, typer.Option(help="Folder for the files.", callback=to_folder)],
    format_: Annotated[
        str, typer.Option("--format", help="stl, obj, step (all in mm), glb (m), or several with commas.")
    ] = "stl",
    chord: Annotated[str, typer.Option(help="Largest distance between facets and flanks.")] = "0.5 um",
    gear: Annotated[str, typer.Option(help="drive, loose or both.")] = "both",
    set_: Overrides = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the metadata sidecars as JSON.")] = False,
) -> None:
    """Write the gears of a scenario as watertight solids, each with a metadata sidecar: data, mass, hash, command.

    Flank effects of the scenario are in the solids. The axis is z; the active flank of tooth 1 crosses +x at the
    working pitch radius. STEP has B-spline surfaces; needs pip install "gears3d[cad]".

    Example: gears3d mesh base/rigaud-2020 --out meshes/mine --format stl,glb --chord "2 um"
    """
    from gears3d.errors import UsageError
    from gears3d.gears.export import write_meshes
    from gears3d.scenario import load

    loaded = load(scenario, set_ or ())
    formats = [word.strip() for word in format_.split(",") if word.strip()]
    if not formats:
        raise UsageError("--format is empty: give stl, obj, glb, step or several with commas")
    which = ("drive", "loose") if gear == "both" else (gear,)
    words = [str(scenario), f"--out {out}", f"--format {','.join(formats)}", f'--chord "{chord}"']
    words += [f"--gear {gear}"] * (gear != "both") + [f"--set '{each}'" for each in set_ or ()]
    cards = write_meshes(
        _pair(loaded),
        out,
        formats,
        _length(chord),
        which=which,
        densities=(loaded.gears.drive.density, loaded.gears.loose.density),
        command=f"gears3d mesh {' '.join(words)}",
        progress=lambda text: typer.echo(text, err=True),
    )
    if as_json:
        from gears3d.cli.output import print_json

        print_json(cards)
        return
    for name, card in cards.items():
        for file in card["files"].values():
            typer.echo(f"{out / file['name']}: {_content(card, file)}, {file['bytes'] / 1e3:.0f} kB")
        typer.echo(f"{out / name}.json: {card['mass_properties']['mass_kg']:.6g} kg, {card['hash'][:23]}")


def _content(card: dict[str, Any], file: dict[str, Any]) -> str:
    if "flank_deviation_m" not in file:
        return f"{card['solid']['triangles']} triangles"
    return f"{file['faces']} faces, B-spline flanks within {file['flank_deviation_m'] * 1e9:.1g} nm of the true flanks"


def _length(text: str) -> float:
    from gears3d.errors import Fault, InputError
    from gears3d.units import parse

    try:
        length = parse(text, "length")
    except InputError as error:
        fault = error.faults[0]
        raise InputError(Fault("--chord", fault.message, fault.remedy)) from None
    if not length > 0.0:
        raise InputError(Fault("--chord", f"is {text}", 'give a positive length, e.g. "0.5 um"'))
    return length


def _pair(loaded: Scenario) -> Pair:
    """Return the pair with the deviations that the scenario's effects put on its flanks."""
    from gears3d.effects import Code

    flank_codes = (Code.FLANK_HARMONIC, Code.FLANK_TOOTH)
    rows = tuple(row for row in loaded.rows() if row.code in flank_codes)
    if not rows:
        return loaded.pair()
    from gears3d.scenario.flanks import flank_deviations

    return loaded.pair().with_deviations(*flank_deviations(rows))
