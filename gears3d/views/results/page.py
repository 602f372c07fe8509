"""The page of a result that has no page of its own: question, answer, numbers, picture, how to repeat, data."""

from __future__ import annotations

from base64 import b64encode
from io import BytesIO
from typing import TYPE_CHECKING, Any

from gears3d.views.report.page import asset, environment

if TYPE_CHECKING:
    from gears3d.views.results.contents import Contents

MOST_VECTOR = 400_000
"""Bytes of a picture up to which it is drawn as lines; a larger one becomes pixels."""


def render(told: Contents, made: dict[str, Any], files: tuple[str, ...] = ()) -> str:
    """Return the page as HTML that opens without a network."""
    context = {
        "title": told.title,
        "source": told.source,
        "version": made["version"],
        "what_it_is": told.about,
        "question": told.question,
        "answer": told.answer,
        "rows": [(name, value) for name, value in told.rows if value],
        "notes": [note for note in told.notes if note],
        "picture": _address(told),
        "words": told.words or told.question,
        "snippet": told.snippet,
        "command": made["command"],
        "inputs": made["inputs"],
        "files": files,
        "blocks": {},
        "asset": asset,
    }
    return environment().get_template("result.html.j2").render(context)


def _address(told: Contents) -> str:
    """Return the picture as an address that needs no network; empty without one."""
    if told.draw is None:
        return ""
    figure, kind = told.draw(), "svg"
    data = _saved(figure, kind)
    if len(data) > MOST_VECTOR:
        kind = "png"
        data = _saved(figure, kind)
    mime = "svg+xml" if kind == "svg" else "png"
    return f"data:image/{mime};base64,{b64encode(data).decode('ascii')}"


def _saved(figure: Any, kind: str) -> bytes:
    file = BytesIO()
    figure.savefig(file, format=kind, dpi=130)
    return file.getvalue()
