"""A result folder as one archive that somebody else can open and check."""

from __future__ import annotations

import hashlib
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gears3d.errors import Fault, InputError
from gears3d.files import refuse_file, replacing
from gears3d.inputs import is_folder
from gears3d.version import __version__

# Files of which a result folder has at least one
MARKS = ("report.html", "summary.json", "diagnosis.json", "papers.html")
MANIFEST = "MANIFEST.json"
REPLAY = ".rrd"  # Ending of replays, which are large and follow from the data
EPOCH = (1980, 1, 1, 0, 0, 0)  # Time of every file in the archive, so that the same folder gives the same bytes


@dataclass(frozen=True)
class Bundle:
    """An archive that was written.

    Args:
        path: of the archive.
        bytes: its size.
        files: name in the archive, ``bytes`` and ``sha256`` of each file.
        excluded: names of files in the folder that are not in the archive.
        made_with: ``version``, ``command`` and ``inputs`` of the result, as far as its JSON states them.
    """

    path: Path
    bytes: int
    files: tuple[dict[str, Any], ...]
    excluded: tuple[str, ...]
    made_with: dict[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        return {
            "bundle": str(self.path),
            "bytes": self.bytes,
            "files": list(self.files),
            "excluded": list(self.excluded),
            "made_with": self.made_with,
        }


def bundle(folder: str | Path, out: str | Path | None = None, replay: bool = False) -> Bundle:
    """Write a result folder into one zip archive with a manifest of hashes, version and command.

    Args:
        folder: that a verb wrote with ``--out``, or ``save`` of a result.
        out: the archive; the folder's name with ``.zip`` in the current folder by default.
        replay: whether replays (``.rrd``) are put in as well.

    Returns:
        What the archive holds.

    Raises:
        InputError: it is not a result folder, or the archive cannot be written.
        UsageError: the name of the archive does not end in ``.zip``.
    """
    place = Path(folder)
    _refuse_foreign(place)
    path = Path(f"{place.resolve().name}.zip") if out is None else Path(out)
    refuse_file(path, (".zip",))
    every = sorted(one for one in place.rglob("*") if one.is_file() and not _hidden(one.relative_to(place)))
    taken = [one for one in every if _wanted(one, path, replay)]
    made_with = _made_with(place)
    sources = {one.relative_to(place).as_posix(): one for one in taken}
    sources |= {f"inputs/{file.name}": file for file in _texts(made_with, set(sources))}
    listed = [{"file": name, "bytes": one.stat().st_size, "sha256": _hash(one)} for name, one in sources.items()]
    manifest = {"result": place.resolve().name, "gears3d": __version__, "made_with": made_with, "files": listed}
    root = path.stem
    with replacing(path) as unfinished, zipfile.ZipFile(unfinished, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as out_:
        _put(out_, f"{root}/{MANIFEST}", (json.dumps(manifest, indent=2, ensure_ascii=False) + "\n").encode())
        for name, one in sources.items():
            _put(out_, f"{root}/{name}", one)
    left = tuple(
        one.relative_to(place).as_posix() for one in every if one not in taken and one.resolve() != path.resolve()
    )
    return Bundle(path, path.stat().st_size, tuple(listed), left, made_with)


def _refuse_foreign(place: Path) -> None:
    if not is_folder(place):
        raise InputError(Fault("", "is not a folder", "name a result folder, which --out DIR wrote", str(place)))
    if not any((place / mark).is_file() for mark in MARKS):
        remedy = "name a folder that --out DIR wrote"
        raise InputError(Fault("", "is not a result folder: it has no report.html or summary.json", remedy, str(place)))


def _hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)


def _wanted(file: Path, archive: Path, replay: bool) -> bool:
    if file.is_symlink() or file.name == MANIFEST or file.suffix.lower() == ".zip":
        return False
    return (replay or file.suffix.lower() != REPLAY) and file.resolve() != archive.resolve()


def _made_with(place: Path) -> dict[str, Any]:
    """Return version, command and inputs, as the JSON of the result states them."""
    for file in sorted(place.glob("*.json")):
        try:
            told = json.loads(file.read_text(encoding="utf-8"))
        except (ValueError, OSError):
            continue
        if not isinstance(told, dict):
            continue
        if isinstance(made := told.get("provenance"), dict):
            return {key: made.get(key) for key in ("version", "command", "inputs")}
        if "version" in told and "command" in told:
            return {"version": told["version"], "command": told["command"], "inputs": []}
    return {"version": None, "command": None, "inputs": []}


def _texts(made_with: dict[str, Any], names: set[str]) -> list[Path]:
    """Return scenarios and maps that the result was made from and that are unchanged since."""
    found: dict[str, Path] = {}
    for one in made_with["inputs"] or []:
        file = Path(str(one.get("file", "")))
        name = f"inputs/{file.name}"
        fits = file.suffix == ".toml" and file.is_file() and name not in names | set(found)
        if fits and _hash(file) == one.get("sha256"):
            found[name] = file
    return [*found.values()]


def _hash(file: Path) -> str:
    with file.open("rb") as data:
        return hashlib.file_digest(data, "sha256").hexdigest()


def _put(archive: zipfile.ZipFile, name: str, content: bytes | Path) -> None:
    about = zipfile.ZipInfo(name, EPOCH)
    about.compress_type, about.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
    with archive.open(about, "w", force_zip64=True) as target:
        if isinstance(content, bytes):
            target.write(content)
            return
        with content.open("rb") as data:
            while block := data.read(1 << 20):
                target.write(block)
