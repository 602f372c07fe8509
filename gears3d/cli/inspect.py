"""``gears3d inspect``: the sensors of measured records, and a map of their channels."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gears3d.cli.options import (
    Begin,
    Correct,
    End,
    MapFile,
    Records,
    Rig,
    RigOverrides,
    StatedMotion,
    command,
    load_rig,
    span_of,
    to_results,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np

    from gears3d.measured.checks import Finding
    from gears3d.results import Result
    from gears3d.scenario import Scenario


def inspect(
    records: Records = None,
    rig: Rig = None,
    map_file: MapFile = None,
    guess: Annotated[
        bool, typer.Option("--guess", help="Propose one record.toml for all files, with reasons; nothing is examined.")
    ] = False,
    correct: Correct = None,
    begin: Begin = "",
    to: End = "",
    stated_motion: StatedMotion = False,
    set_: RigOverrides = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for report.html and findings.json; with --guess the file of the map.",
            callback=to_results(".toml"),
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the findings of each record as JSON.")] = False,
) -> None:
    """Examine the sensors of measured records: what is wrong, where, and how to correct it. Nothing is segmented.

    Example: gears3d inspect rattle.parquet --rig rigaud-2020/fig5-20rpm

    Propose a map of the channels: gears3d inspect rattle.parquet --guess --rig rigaud-2020/fig5-20rpm --out record.toml
    """
    from gears3d.cli.output import print_json, show_findings, show_repeated
    from gears3d.errors import UsageError
    from gears3d.measured.checks import admit_each, told

    bench = load_rig(rig, set_)
    if guess:
        propose_map(records or [], bench, map_file, out, rig)
        return
    if out is not None and out.suffix == ".toml":
        raise UsageError(f"{out}: --out names a folder; it names the file of a map with --guess")
    if not records and map_file is None:
        raise UsageError("name a measured record, e.g. gears3d inspect rattle.parquet --rig SCENARIO")
    span = span_of(begin, to)
    admission = admit_each(records or [], bench, map_file, correct or (), stated_motion=stated_motion, span=span)
    show_repeated(admission.repeated)
    admitted = admission.all()
    found = [_found(one.file, one.channels.columns["time_s"], one.findings) for one in admitted]
    if out is not None:
        lines = [(one.file, told(finding)) for one in admitted for finding in one.findings]
        result = _result([one.file for one in admitted], lines, found)
        result.save(out, command=command(), inputs=[file for one in admitted for file in one.inputs])
    if as_json:
        print_json(found)
        return
    for one in admitted:
        show_findings(one.findings, one.file)
        time = one.channels.columns["time_s"]
        names = ", ".join(name for name in one.channels.columns if name != "time_s")
        typer.echo(f"{one.file}: {len(time)} samples, {time[0]:.6g} to {time[-1]:.6g} s: {names}")
    typer.echo("to keep it: --out DIR (report, JSON)" if out is None else f"report: {out / 'report.html'}")


def _found(file: str, time: np.ndarray, findings: Sequence[Finding]) -> dict[str, Any]:
    return {
        "file": file,
        "samples": len(time),
        "from_s": float(time[0]),
        "to_s": float(time[-1]),
        "findings": [finding.to_dict() for finding in findings],
    }


def _result(files: Sequence[str], lines: Sequence[tuple[str, str]], found: list[dict[str, Any]]) -> Result:
    from gears3d.views.results import Contents, Told

    answer = f"{len(lines)} findings in {len(files)} records." if lines else "No findings: all checks are passed."
    rows = [*((f"{file}", "no findings") for file in files if file not in dict(lines)), *lines]
    question = "Are clock, counts, units, signs and sensors of the records sound?"
    return Told(Contents("findings", "examination", "Sensors", question, answer, rows, {"records": found}))


def propose_map(
    records: list[Path], bench: Scenario | None, map_file: Path | None, out: Path | None, rig: Path | None
) -> None:
    """Print or write the map proposed for one file, or for several of one rig."""
    from gears3d.errors import UsageError
    from gears3d.files import write_text
    from gears3d.measured.readers import propose

    if not records or map_file is not None:
        raise UsageError("--guess proposes the map of measured files: name one or several of one rig, without --map")
    for record in records:
        if record.suffix.lower() == ".toml":
            raise UsageError(f"{record}: is already a map: name the measured file")
    text = propose(records if len(records) > 1 else records[0], bench, None if out is None else out.parent)
    if out is None:
        typer.echo(text, nl=False)
        return
    write_text(out, text)
    then = shlex.join(["gears3d", "segment", str(out), "--rig", "SCENARIO" if rig is None else str(rig)])
    if not all(f"[{gear}]" in text.splitlines() for gear in ("drive", "loose")):
        then = shlex.join(["gears3d", "identify", "coastdown", str(out), "--inertia", "INERTIA"])
    typer.echo(f"written to {out}; check it, then: {then}")
