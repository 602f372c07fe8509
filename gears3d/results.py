"""What every result can do: be saved as a folder, reported as a page, drawn as a picture."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Result:
    """A result: saved, reported and drawn in the same way for every kind of result.

    Pages and pictures know every kind of result, so their package is loaded by name, and only when it is needed.
    """

    def save(
        self, folder: str | Path, *, scenario: Any = None, command: str = "", inputs: Iterable[str | Path | None] = ()
    ) -> Path:
        """Write a folder with ``report.html``, the numbers as JSON, the data and a picture; files in it are replaced.

        Args:
            folder: created if missing.
            scenario: written as ``scenario.toml`` if given.
            command: that made the result, for its provenance.
            inputs: files that the result was made from; their hashes go into its provenance.

        Returns:
            The folder.

        Raises:
            InputError: it cannot be written.
        """
        return _views().save(self, Path(folder), scenario=scenario, command=command, inputs=inputs)

    def report(self, *, command: str = "") -> str:
        """Return the report: one HTML page that needs no network.

        Args:
            command: that made the result.
        """
        return _views().report(self, command)

    def plot(self, file: str | Path | None = None) -> Figure:
        """Return the result as a picture, and write it if a file is named.

        Args:
            file: ends in ``.png``, ``.svg`` or ``.pdf``.

        Raises:
            UsageError: the ending is another, or there is nothing to draw.
            InputError: the file cannot be written.
        """
        return _views().plot(self, None if file is None else Path(file))


def _views() -> Any:
    return import_module("gears3d.views.results")
