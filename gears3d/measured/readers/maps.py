"""Reading ``record.toml``: which files it names, and the map of each."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.inputs import read_text

if TYPE_CHECKING:
    from gears3d.measured.readers.map_model import RecordMap


def files_of(paths: Sequence[str | Path], map_file: str | Path | None = None) -> list[tuple[Path, Path | None]]:
    """Return the measured files that the arguments name, each with its map.

    Args:
        paths: measured files, and maps that name files.
        map_file: map of those that are no maps.

    Returns:
        Pairs for :func:`gears3d.measured.readers.read`.

    Raises:
        InputError: a map cannot be used, or names no file.
        UsageError: maps are given twice.

    >>> files_of(["a.csv"], "record.toml")
    [(PosixPath('a.csv'), PosixPath('record.toml'))]
    """
    pairs: list[tuple[Path, Path | None]] = []
    for path in map(Path, paths):
        if path.suffix.lower() != ".toml":
            pairs.append((path, None if map_file is None else Path(map_file)))
            continue
        if map_file is not None:
            raise UsageError(f"{path}: is a map itself: leave --map out")
        pairs += [(file, path) for file in named_files(path)]
    if not pairs and map_file is not None:
        pairs = [(file, Path(map_file)) for file in named_files(Path(map_file))]
    return pairs


def named_files(map_file: Path) -> list[Path]:
    """Return the files that a map names, relative to the map.

    Raises InputError when it is not valid, or names no file.
    """
    files = [map_file.parent / str(each["file"]) for each in _records(map_file) if each.get("file")]
    if not files:
        remedy = 'write file = "..." into it, or give the files and --map'
        raise InputError(Fault("file", "is missing", remedy, str(map_file)))
    return files


def load_map(map_file: Path, path: Path) -> RecordMap:
    """Return the map of one measured file.

    ``map_file``: ``record.toml``; keys of the ``[[record]]`` that names the file override the common ones. Raises
    InputError with every fault when the map is not valid, or has records of other files only.
    """
    records = _records(map_file)
    own = [each for each in records if "file" not in each or _same(map_file.parent / str(each["file"]), path)]
    if not own:
        names = [str(each["file"]) for each in records]
        remedy = did_you_mean(path.name, names)
        raise InputError(Fault("file", f"{path} is not among the files that it names", remedy, str(map_file)))
    from gears3d.measured.readers.map_model import checked

    return checked(own[0], str(map_file))


def flat(condition: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the keys of the rig that a condition overrides, dotted.

    >>> flat({"motion": {"mean": "180 rpm"}, "drag.torque": {"value": "0.2 N m", "uncertainty": "5 %"}})
    {'motion.mean': '180 rpm', 'drag.torque': {'value': '0.2 N m', 'uncertainty': '5 %'}}
    """
    keys: dict[str, Any] = {}
    for name, value in condition.items():
        if isinstance(value, dict) and value and "value" not in value:
            keys |= flat(value, f"{prefix}{name}.")
        else:
            keys[prefix + name] = value
    return keys


def _records(map_file: Path) -> list[dict[str, Any]]:
    """Return the maps of a document, one a file, the common keys in each."""
    document = _document(map_file)
    records = document.pop("record", None)
    if records is None:
        return [document]
    if not isinstance(records, list) or not records or not all(isinstance(each, dict) for each in records):
        raise InputError(Fault("record", "is no list of tables", "write [[record]]", str(map_file)))
    if "file" in document:
        remedy = "one file at the top, or one in each [[record]]"
        raise InputError(Fault("file", "stands beside [[record]]", remedy, str(map_file)))
    faults = [
        Fault(f"record[{at}].file", "is missing", 'write file = "..."', str(map_file))
        for at, each in enumerate(records)
        if not isinstance(each.get("file"), str)
    ]
    if faults:
        raise InputError(faults)
    return [_merged(document, each) for each in records]


def _document(map_file: Path) -> dict[str, Any]:
    file = str(map_file)
    try:
        document = tomllib.loads(read_text(map_file).removeprefix("\ufeff"))
    except FileNotFoundError as error:
        raise InputError(Fault("", "is not there", "gears3d inspect FILE --guess proposes a map", file)) from error
    except OSError as error:
        raise InputError(Fault("", f"cannot be read: {error.strerror}", "name a record.toml", file)) from error
    except (ValueError, RecursionError) as error:
        why = " ".join(str(error).split())[:200]
        raise InputError(Fault("", f"is no TOML: {why}", "text in quotes, tables as [drive]", file)) from error
    if "format" not in document:
        raise InputError(Fault("format", "is missing", "write format = 1", file))
    return document


def _merged(common: dict[str, Any], own: dict[str, Any]) -> dict[str, Any]:
    merged = dict(common)
    for key, value in own.items():
        old = merged.get(key)
        merged[key] = _merged(old, value) if isinstance(old, dict) and isinstance(value, dict) else value
    return merged


def _same(one: Path, other: Path) -> bool:
    try:
        return one.resolve() == other.resolve()
    except (OSError, ValueError, RuntimeError):
        return False
