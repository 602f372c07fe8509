"""What a notebook shows of an object: a heading and a small table, in the colours of its page."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape


def table(heading: str, rows: Iterable[tuple[str, str]]) -> str:
    """Return an object's numbers as HTML.

    Args:
        heading: above them, e.g. the name of its class and what it is called.
        rows: name and value, text; those without a value are left out.

    >>> table("Run", [("impacts", "150"), ("note", "")])
    '<table><caption><b>Run</b></caption><tbody><tr><th scope="row">impacts</th><td>150</td></tr></tbody></table>'
    """
    shown = "".join(
        f'<tr><th scope="row">{escape(name)}</th><td>{escape(value)}</td></tr>' for name, value in rows if value
    )
    return f"<table><caption><b>{escape(heading)}</b></caption><tbody>{shown}</tbody></table>"
