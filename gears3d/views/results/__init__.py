"""Results of every kind as a folder, a page and a picture: the one way in which they leave gears3d."""

from __future__ import annotations

import json
from collections.abc import Iterable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gears3d.files import replacing, write_picture, write_text
from gears3d.provenance import provenance
from gears3d.runs.folder import refuse_foreign
from gears3d.views.results.contents import Contents as Contents
from gears3d.views.results.contents import Told as Told
from gears3d.views.results.contents import contents as contents

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save(
    result: Any, folder: Path, *, scenario: Any = None, command: str = "", inputs: Iterable[str | Path | None] = ()
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
    files = [f"{told.name}.json", *told.tables, *told.present, *(["scenario.toml"] if scenario is not None else [])]
    write_text(folder / "report.html", _page(told, made, tuple(files)))
    return folder


def report(result: Any, command: str = "") -> str:
    """Return the page of a result.

    Args:
        result: of any kind.
        command: for the provenance.
    """
    return _page(contents(result), provenance((), command), ())


def page(result: Any, made: dict[str, Any], files: tuple[str, ...]) -> str:
    """Return the page of a result with its provenance and links to files in the same folder."""
    return _page(contents(result), made, files)


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


MOST_VECTOR = 400_000
"""Bytes of a picture up to which a page has it as lines; a larger one becomes pixels."""


def _page(told: Contents, made: dict[str, Any], files: tuple[str, ...]) -> str:
    """Return the page: charts where the pictures are lines, points and bands, else the first picture itself."""
    from gears3d.views.pages import engine
    from gears3d.views.pages.charts import charts_of

    if told.page is not None:
        return told.page(made, files)
    head = engine.Head(told.about, told.title, told.question, told.answer, told.keys, told.tone, told.verdict,
                       told.source, [note[:1].upper() + note[1:] for note in told.notes if note])  # fmt: skip
    charts: dict[str, Any] = {}
    pictures = []
    for number, draw in enumerate([] if told.draw is None else [told.draw, *told.more]):
        figure = draw()
        if (found := charts_of(figure)) is None:
            pictures.append(engine.Picture(_saved(figure), told.words or told.question))
        else:
            charts |= {f"{number}-{name}": chart for name, chart in found.items()}
    return engine.render(
        "result.html.j2", head, made, files, charts=charts, pictures=pictures, words=told.words or told.question,
        rows=[(name, value) for name, value in told.rows if value],
        trust=[(name, value) for name, value in told.trust if value], snippet=told.snippet,
    )  # fmt: skip


def _saved(figure: Figure) -> str | bytes:
    """Return a figure as SVG text, or as PNG where that is large."""
    file = BytesIO()
    figure.savefig(file, format="svg")
    if len(file.getvalue()) <= MOST_VECTOR:
        return file.getvalue().decode()
    file = BytesIO()
    figure.savefig(file, format="png", dpi=130)
    return file.getvalue()
