"""``gears3d report``: the results of one recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gears3d.cli.options import to_picture


def report(
    run: Annotated[Path, typer.Argument(help="Run folder, or a folder with signals.parquet and impacts.parquet.")],
    lines: Annotated[int, typer.Option(min=1, help="Number of lines of each spectrum.")] = 5,
    out: Annotated[Path | None, typer.Option(help="Picture to write (.png, .svg, .pdf).", callback=to_picture)] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print all results as JSON.")] = False,
) -> None:
    """Report the results of a recording: regime, motion, impacts, energies, durations, lines of its spectra.

    Example: gears3d report runs/fig5-20rpm/twin --out sections.png
    """
    from gears3d.errors import Fault, InputError
    from gears3d.recording import describe as told
    from gears3d.recording import read

    recording = read(run)
    if "model" not in recording.meta and not len(recording.impacts["time_s"]):
        remedy = "name a folder with impacts.parquet"
        raise InputError(Fault("", "has angles, but not a table of impacts to describe", remedy, str(run)))
    found = {**told(recording), "spectra": _spectra(recording, lines)}
    if out is not None:
        from gears3d.views.signals import write_picture

        write_picture(out, recording)
    if as_json:
        from gears3d.cli.output import print_json

        print_json(found)
        return
    _show(found, str(run))
    typer.echo(f"picture written to {out}" if out is not None else "for a picture: --out sections.png")


def _spectra(recording: Any, count: int) -> dict[str, Any]:
    from gears3d.recording.told import spectra
    from gears3d.signals import lines

    out: dict[str, Any] = {}
    for name, one in spectra(recording).items():
        at = "frequency_Hz" if name == "frequency" else "order"
        out[name] = one and {
            "quantity": "displacement_m",
            f"resolution{'_Hz' if name == 'frequency' else ''}": one.resolution,
            "lines": [{at: where, "amplitude_m": high} for where, high in lines(one, count)],
        }
    return out


def _show(found: dict[str, Any], title: str) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=escape(title), title_justify="left", show_header=False, box=None, padding=(0, 2, 0, 0))
    for name, value in rows(found):
        table.add_row(name, escape(value))
    Console(highlight=False).print(table)


def rows(found: dict[str, Any]) -> list[tuple[str, str]]:
    """Return the table's lines as (name, value); unknown values are excluded.

    Args:
        found: what ``gears3d.describe`` returned, with ``spectra``.
    """
    from gears3d.cli.run_table import impacts_line, regime_line

    lines = [("regime", regime_line(found)), ("impacts after settling", impacts_line(found))]
    exponent, deviation = found["lyapunov_1_s"], found["lyapunov_std_1_s"]
    if exponent is not None:
        spread = f" ± {deviation:.2g}" if deviation is not None else ""
        lines.append(("largest Lyapunov exponent", f"{exponent:.3g}{spread} 1/s, of the {found['lyapunov_from']}"))
    for flank in ("active", "reverse"):
        lines += _flank(found, flank)
    if found["energy_J_s"] is not None:
        lines.append(("power dissipated by impacts", f"{found['energy_J_s'] * 1e3:.3g} mW"))
    if found["excitation"] is not None:
        lines.append(("excitation Λ", f"{found['excitation']:.3g}"))
    if found["flights"]:
        longest, high = found["flight_longest_s"] * 1e3, found["flight_height_max_m"]
        top = f", {high * 1e6:.4g} µm high" if high is not None else ""
        lines.append(("free flights", f"{found['flights']}, the longest {longest:.4g} ms{top}"))
    if found["flight_share"] is not None:
        parts = [f"{found[f'{one}_share']:.1%} {one}" for one in ("active", "reverse", "flight")]
        exact = "" if found["durations_from"] == "contacts" else " (from samples)"
        lines.append(("time", ", ".join(parts) + exact))
    return lines + _lines(found["spectra"])


def _flank(found: dict[str, Any], flank: str) -> list[tuple[str, str]]:
    speed = found[f"{flank}_velocity_mean_m_s"]
    if speed is None:
        return []
    square = found[f"{flank}_velocity_mean_square_m2_s2"]
    text = f"{abs(speed) * 1e3:.4g} mm/s mean, {square**0.5 * 1e3:.4g} mm/s rms"
    restitution, across = found[f"{flank}_restitution"], found[f"{flank}_crossing_mean_s"]
    if restitution is not None:
        text += f", restitution {restitution:.3g}"
    if across is not None:
        text += f"; crossings of the backlash last {across * 1e3:.4g} ms"
        hard = found[f"{flank}_crossing_velocity_mean_m_s"]
        text += f" and end with {abs(hard) * 1e3:.4g} mm/s" if hard is not None else ""
    return [(f"{flank} flank", text)]


def _lines(spectra: dict[str, Any]) -> list[tuple[str, str]]:
    names = {"frequency": "lines", "order_drive": "orders of the drive gear", "order_loose": "orders of the loose gear"}
    out = []
    for key, name in names.items():
        one = spectra[key]
        if one and one["lines"]:
            at, unit = ("frequency_Hz", " Hz") if key == "frequency" else ("order", "")
            shown = ", ".join(f"{line[at]:.4g}{unit} {line['amplitude_m'] * 1e6:.3g} µm" for line in one["lines"])
            out.append((name, shown))
    return out
