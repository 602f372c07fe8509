"""``record.toml``, format 1: which files it names, and the map of each as data."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.inputs import read_text


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


def _ratio(value: Any) -> Any:
    """Return a ratio written as a number or as teeth over teeth."""
    if isinstance(value, str) and (match := re.fullmatch(r"\s*([\d.eE+-]+)\s*/\s*([\d.eE+-]+)\s*", value)):
        try:
            return float(match[1]) / float(match[2])
        except (ValueError, ZeroDivisionError) as error:
            raise ValueError(f"{value!r} is not a ratio") from error
    if isinstance(value, bool):
        raise ValueError("is not a number")
    return value


Ratio = Annotated[float, BeforeValidator(_ratio), Field(gt=0, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class TimeMap(_Part):
    """Where the time comes from: a signal, a rate, or what the file declares when neither is given.

    ``axis`` says whose edges are the moments of the record where both gears are known at edges only; ``from`` and
    ``to`` are the times between which the record is used.
    """

    begin: str | None = Field(default=None, alias="from")
    to: str | None = None
    channel: str | None = None
    unit: str = ""
    sample_rate: str | None = None
    axis: Literal["counters", "loose", "drive", "union"] = "counters"


class IndexMap(_Part):
    """Pulse of an encoder's index mark; its threshold in the unit of the file, found when not given."""

    channel: str
    threshold: Finite | None = None


class Quadrature(_Part):
    """Two channels in quadrature."""

    kind: Literal["quadrature"]
    a: str
    b: str
    lines: Positive
    decoding: Literal[1, 2, 4] = 4
    threshold: Finite | None = None
    hysteresis: Finite | None = None
    at: Literal["samples", "edges"] = "samples"


class Tacho(_Part):
    """One pulse a tooth of a wheel; ``positions`` counts missing teeth, too."""

    kind: Literal["tacho"]
    positions: Annotated[int, Field(gt=0)]
    missing: Annotated[int, Field(ge=0)] | Literal["find"] = 0
    edge: Literal["rising", "falling"] = "rising"
    threshold: Finite | None = None
    hysteresis: Finite | None = None
    evened: bool = False


class Stamps(_Part):
    """Times at which edges happened, or ticks of a clock."""

    kind: Literal["stamps"]
    clock: str | None = None
    bits: Annotated[int, Field(gt=1, le=53)] | None = None
    direction: str | None = None


class Counter(_Part):
    """A counter that wraps after some bits or counts."""

    kind: Literal["counter"]
    bits: Annotated[int, Field(gt=1, le=53)] | None = None
    signed: bool = False
    period: Annotated[int, Field(gt=3)] | None = None


Decode = Annotated[Quadrature | Tacho | Stamps | Counter, Field(discriminator="kind")]
DECODERS: dict[str, type[_Part]] = {
    "quadrature": Quadrature,
    "tacho": Tacho,
    "stamps": Stamps,
    "counter": Counter,
}


class GearMap(_Part):
    """How the angle of a gear comes from a signal."""

    channel: str | None = None
    unit: str = ""
    counts_per_revolution: Positive | None = None
    sign: Literal[1, -1] = 1
    ratio: Ratio = 1.0
    wraps_at: str | None = None
    increments: bool = False
    zero: Literal["index", "arbitrary"] | None = None
    index: IndexMap | None = None
    decode: Decode | None = None

    def roles(self) -> dict[str, str]:
        """Return the signals that are needed, by key."""
        names = {"channel": self.channel, "index.channel": self.index.channel if self.index else None}
        if isinstance(self.decode, Quadrature):
            names |= {"decode.a": self.decode.a, "decode.b": self.decode.b}
        elif isinstance(self.decode, Stamps):
            names["decode.direction"] = self.decode.direction
        return {key: name for key, name in names.items() if name is not None}

    @property
    def sampled(self) -> bool:
        """Whether its signals have a value at every sample of the time."""
        return not isinstance(self.decode, Stamps)


class ExtraMap(_Part):
    """A further signal that is kept, under a name of one's own."""

    channel: str
    unit: str = ""


class RecordMap(_Part):
    """The map of one file."""

    format: Literal[1]
    file: str | None = None
    title: str = ""
    group: str = ""
    time: TimeMap = TimeMap()
    drive: GearMap | None = None
    loose: GearMap | None = None
    extra: dict[str, ExtraMap] = Field(default_factory=dict)
    condition: dict[str, Any] = Field(default_factory=dict)


_MODELS: dict[str, type[BaseModel]] = {
    "time": TimeMap,
    "drive": GearMap,
    "loose": GearMap,
    "index": IndexMap,
    "extra": ExtraMap,
    "": RecordMap,
}
_MENDED = {
    "literal_error": "is {input!r}, not {expected}",
    "string_type": "is {input!r}, no text",
    "missing": "is missing",
    "model_type": "is {input!r}, no table",
    "dict_type": "is {input!r}, no table",
    "greater_than": "is {input!r}, not positive",
    "float_type": "is {input!r}, no number",
    "float_parsing": "is {input!r}, no number",
    "finite_number": "is {input!r}, not finite",
}


def checked(table: dict[str, Any], map_file: str) -> RecordMap:
    """Return the map in a table of a document.

    Raises InputError with every fault when it is not valid.
    """
    try:
        return RecordMap.model_validate(table)
    except ValidationError as error:
        raise InputError([_fault(each, map_file) for each in error.errors()]) from error
    except RecursionError as error:
        raise InputError(Fault("", "is nested too deep", "", map_file)) from error


def _fault(error: Any, file: str) -> Fault:
    """Return a fault of pydantic as ours."""
    place = [str(step) for step in error["loc"]]
    decoder = place[2] if len(place) > 2 and place[1] == "decode" else ""
    if decoder:
        place = [*place[:2], *place[3:]]
    key, kind = ".".join(place), error["type"]
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        given = error.get("ctx", {}).get("tag", "")
        return Fault(f"{key}.kind", f"is {given!r}", did_you_mean(given, list(DECODERS)), file)
    if kind == "extra_forbidden":
        table = place[0] if len(place) > 1 else ""
        model = IndexMap if len(place) > 2 and place[1] == "index" else _MODELS.get(table, RecordMap)
        model = DECODERS.get(decoder, model)
        known = [field.alias or name for name, field in model.model_fields.items()] + (
            ["record"] if model is RecordMap else []
        )
        beside = decoder and place[-1] in GearMap.model_fields
        remedy = f"it stands in [{table}], next to decode" if beside else did_you_mean(place[-1], known)
        return Fault(key, "is not a key of a map", remedy, file)
    context = error.get("ctx", {})
    told = _MENDED.get(kind)
    if told is None:
        return Fault(key, f"is {error['input']!r}: {error['msg']}"[:300], "", file)
    return Fault(key, told.format(input=error["input"], expected=context.get("expected", "")), "", file)


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
        raise InputError(Fault("record", "is not a list of tables", "write [[record]]", str(map_file)))
    if "file" in document:
        remedy = "one file at the top, or one in each [[record]]"
        raise InputError(Fault("file", "stands in addition to [[record]]", remedy, str(map_file)))
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
        raise InputError(Fault("", f"is not TOML: {why}", "text in quotes, tables as [drive]", file)) from error
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
