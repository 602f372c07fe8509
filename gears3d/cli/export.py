"""``gears3d export``: solids of both gears as files for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import Overrides, ScenarioName, choice, to_folder

if TYPE_CHECKING:
    from gears3d.gears import Pair
    from gears3d.scenario import Scenario


def export(
    scenario: ScenarioName,
    out: Annotated[Path, typer.Option(help="Folder for the files.", callback=to_folder)],
    format_: Annotated[
        str,
        typer.Option(
            "--format",
            help="A file for each gear: stl, obj, step (all in mm), glb (m). A model of the pair: urdf, mjcf (m). "
            "Several with commas.",
        ),
    ] = "stl",
    chord: Annotated[str, typer.Option(help="Largest distance between facets and flanks.")] = "0.5 um",
    gear: Annotated[str, choice("Gears to write.", "drive", "loose", "both")] = "both",
    set_: Overrides = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the metadata sidecars as JSON.")] = False,
) -> None:
    r"""Write the gears of a scenario as solids, or the pair for a multibody engine, with metadata sidecars.

    Flank effects of the scenario are in the files. The axis is z; the active flank of tooth 1 crosses +x at the working
    pitch radius. STEP has B-spline surfaces; it needs pip install "gears3d\[cad]". URDF (PyBullet) and MJCF (MuJoCo)
    have both gears with inertias, joints, drag, restitution and convex hulls of the teeth; the MJCF also moves its
    drive.

    Example: gears3d export rigaud-2020/fig5-20rpm --out meshes/mine --format glb,mjcf --chord "2 um"
    """
    from gears3d.errors import MissingExtraError, UsageError, did_you_mean
    from gears3d.gears.export import FORMATS, write_meshes
    from gears3d.gears.step import require_kernel
    from gears3d.scenario import load
    from gears3d.views.multibody import FORMATS as MULTIBODY
    from gears3d.views.multibody import write_multibody

    loaded = load(scenario, set_ or ())
    formats = [word.strip() for word in format_.split(",") if word.strip()]
    if not formats:
        raise UsageError("--format is empty: give stl, obj, glb, step, urdf, mjcf or several with commas")
    for word in formats:
        if word not in (*FORMATS, *MULTIBODY):
            raise UsageError(f"there is no format {word!r}; {did_you_mean(word, (*FORMATS, *MULTIBODY))}")
    solids, models = ([word for word in formats if word in known] for known in (FORMATS, MULTIBODY))
    if models and gear != "both":
        raise UsageError(f"--format {models[0]} holds both gears: leave --gear out, or write it alone")
    which = ("drive", "loose") if gear == "both" else (gear,)
    words = [str(scenario), f"--out {out}", f"--format {','.join(formats)}", f'--chord "{chord}"']
    words += [f"--gear {gear}"] * (gear != "both") + [f"--set '{each}'" for each in set_ or ()]
    command, length = f"gears3d export {' '.join(words)}", _length(chord)
    cards: dict[str, dict[str, Any]] = {}
    lacking = None
    if "step" in solids and len(formats) > 1:
        try:
            require_kernel()
        except MissingExtraError as why:  # the other formats do without
            lacking, solids = why, [word for word in solids if word != "step"]
    if models:
        cards["pair"] = write_multibody(loaded, out, models, command)
    if solids:
        cards |= write_meshes(
            _pair(loaded),
            out,
            solids,
            length,
            which=which,
            densities=(loaded.gears.drive.density, loaded.gears.loose.density),
            command=command,
            progress=lambda text: typer.echo(text, err=True),
        )
    if as_json and lacking is None:
        from gears3d.cli.output import print_json

        print_json(cards)
        return
    for name, card in cards.items():
        if name == "pair":
            _show_pair(out, card)
            continue
        for file in card["files"].values():
            typer.echo(f"{out / file['name']}: {_content(card, file)}, {file['bytes'] / 1e3:.0f} kB")
        typer.echo(f"{out / name}.json: {card['mass_properties']['mass_kg']:.6g} kg, {card['hash'][:23]}")
    if lacking is not None:
        raise lacking


def _show_pair(out: Path, card: dict[str, Any]) -> None:
    for name, file in card["files"].items():
        typer.echo(f"{out / name}: {file['bytes'] / 1e3:.0f} kB")
    hulls = card["hulls"]
    counts = f"{hulls['drive']} and {hulls['loose']} convex hulls, gaps within {hulls['gap_error_m'] * 1e6:.1f} um"
    typer.echo(f"{out / 'pair'}.json: {counts}")
    if card["effects_left_out"]:
        kinds = ", ".join(card["effects_left_out"])
        typer.echo(f"effects that these files cannot hold are left out: {kinds}", err=True)


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
    from gears3d.scenario.models import flank_deviations

    return loaded.pair().with_deviations(*flank_deviations(rows))
