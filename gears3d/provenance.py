"""Provenance of results: version, command and the hashes of the files that went in."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from gears3d.version import __version__


def provenance(files: Iterable[str | Path | None], command: str = "") -> dict[str, Any]:
    """Return what a result was made with, as JSON can hold it.

    Args:
        files: that were read, each once; ``None`` and what is not a file (any more) is passed over.
        command: as it was typed.

    >>> provenance([None], "gears3d segment r.csv")["inputs"]
    []
    """
    paths = dict.fromkeys(str(one) for one in files if one is not None and Path(one).is_file())
    return {
        "version": __version__,
        "command": command,
        "inputs": [{"file": one, "sha256": _hash(Path(one))} for one in paths],
    }


def comment(made: dict[str, Any]) -> str:
    r"""Return provenance as comment lines of TOML.

    Args:
        made: of :func:`provenance`.

    >>> comment({"version": "1.0", "command": "gears3d segment r.csv", "inputs": []})
    '# gears3d 1.0: gears3d segment r.csv\n'
    """
    lines = [f"gears3d {made['version']}: {made['command']}"]
    lines += [f"{one['file']} SHA-256 {one['sha256']}" for one in made["inputs"]]
    return "".join(f"# {_plain(line)}\n" for line in lines)


def _plain(text: str) -> str:
    """Return text without what ends a comment or may not stand in one."""
    return "".join(each if each.isprintable() else " " for each in text)


def _hash(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
