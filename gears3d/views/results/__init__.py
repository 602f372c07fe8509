"""Results of every kind as a folder, a page and a picture: the one way in which they leave gears3d."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gears3d.files import replacing, write_picture, write_text
from gears3d.provenance import provenance
from gears3d.runs.folder import refuse_foreign
from gears3d.views.results.contents import Contents as Contents
from gears3d.views.results.contents import Told as Told
from gears3d.views.results.contents import contents as contents
from gears3d.views.results.page import render as render

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save(
    result: Any,
    folder: Path,
    *,
    scenario: Any = None,
    command: str = "",
    inputs: Iterable[str | Path | None] = (),
) -> Path:
    """Write a folder with the page, the numbers, the data and a picture.

    Args:
        result: of any kind.
        folder: created if missing; files of these names in it are replaced.
        scenario: written as ``scenario.toml`` if given.
        command: for the provenance.
        inputs: files that went in, for the provenance.

    Returns:
        The folder.

    Raises:
        InputError: it cannot be written.
    """
    told = contents(result)
    if told.name == "summary" and folder.exists():
        refuse_foreign(folder)  # summary.json marks a folder that a later run may replace
    made = provenance(inputs, command)
    for name, write in told.tables.items():
        with replacing(folder / name) as unfinished:
            write(unfinished)
    if scenario is not None:
        write_text(folder / "scenario.toml", scenario.document)
    if told.draw is not None:
        write_picture(folder / (told.picture or f"{told.name}.png"), told.draw)
    text = json.dumps({**told.data, "provenance": made}, indent=2, ensure_ascii=False, allow_nan=False)
    write_text(folder / f"{told.name}.json", text + "\n")
    files = [f"{told.name}.json", *told.tables, *(["scenario.toml"] if scenario is not None else [])]
    write_text(folder / "report.html", _page(told, made, tuple(files)))
    return folder


def report(result: Any, command: str = "") -> str:
    """Return the page of a result.

    Args:
        result: of any kind.
        command: for the provenance.
    """
    return _page(contents(result), provenance((), command), ())


def plot(result: Any, file: Path | None = None) -> Figure:
    """Return a result as a picture, and write it if a file is named.

    Args:
        result: of any kind.
        file: ends in ``.png``, ``.svg`` or ``.pdf``.

    Raises:
        UsageError: there is nothing to draw, or the ending is another.
        InputError: the file cannot be written.
    """
    from gears3d.errors import UsageError

    draw = contents(result).draw
    if draw is None:
        raise UsageError(f"{type(result).__name__}: there is nothing to draw")
    figure = draw()
    if file is not None:
        write_picture(file, lambda: figure)
    return figure


def _page(told: Contents, made: dict[str, Any], files: tuple[str, ...]) -> str:
    return told.page(made, files) if told.page is not None else render(told, made, files)
