"""A campaign of run-downs as a file: records, installed parts, rotating inertia, temperature."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.identify.assemblies import Run
from gears3d.identify.coastdown_record import GEARS, Track, read_tracks
from gears3d.identify.parts import Inertia, Share, terms_of
from gears3d.identify.trend import Oil
from gears3d.inputs import read_text
from gears3d.units import parse

KEYS = {
    "": ("format", "title", "source", "inertia", "run", "part", "oil"),
    "run": ("files", "parts", "inertia", "temperature", "shaft_speed", "gear"),
    "part": ("law", "temperature", "on_shaft"),
    "oil": ("kinematic_viscosity", "density"),
}
# Parts with friction on the shaft itself by default.
ON_SHAFT = ("shear",)


class Campaign(NamedTuple):
    """What a campaign file says, records read; the arguments of ``identify_assemblies``.

    Args:
        runs: of all assemblies.
        inertias: by name.
        laws: of parts that have one.
        each: whether a part changes with temperature, where told.
        oil: its viscosity.
    """

    runs: list[Run]
    inertias: dict[str, Inertia]
    laws: dict[str, str]
    each: dict[str, bool]
    oil: Oil | None


def read_campaign(path: str | Path, read: Callable[[Sequence[Path], str], list[Track]] = read_tracks) -> Campaign:
    """Read a campaign file and the records that it names.

    Args:
        path: TOML; files in it are relative to it.
        read: of files and the gear whose angle counts, the run-downs.

    Raises:
        InputError: the file or a record cannot be used.
    """
    return _Campaign(Path(path), read).read()


def is_campaign(path: str | Path) -> bool:
    """Return whether a TOML file is a campaign, not the map of a record; one that cannot be read counts as one.

    Args:
        path: the file.
    """
    try:
        document = tomllib.loads(read_text(Path(path)))
    except (OSError, ValueError, RecursionError):
        return True
    return not {"file", "record", "time", "loose", "drive"} & document.keys()


class _Campaign:
    """Reads a campaign; every fault names its key."""

    def __init__(self, path: Path, read: Callable[[Sequence[Path], str], list[Track]]) -> None:
        self.path = path
        self.tracks = read
        self.inertias: dict[str, Inertia] = {}

    def fault(self, key: str, message: str, remedy: str = "") -> InputError:
        return InputError(Fault(key, message, remedy, str(self.path)))

    def read(self) -> Campaign:
        try:
            document = tomllib.loads(read_text(self.path))
        except (OSError, UnicodeDecodeError) as error:
            raise self.fault("", f"cannot be read: {error}") from None
        except (ValueError, RecursionError) as error:
            raise self.fault("", f"is no TOML: {error}") from None
        self.known(document, "", "")
        if document.get("format") != 1:
            raise self.fault("format", f"is {document.get('format')!r}", "this version reads format = 1")
        parts = {
            name: self.known(table, f"part.{name}", "part") for name, table in self.table(document, "part").items()
        }
        on_shaft = {name for name in ON_SHAFT if parts.get(name, {}).get("on_shaft", True)}
        on_shaft |= {name for name, table in parts.items() if table.get("on_shaft")}
        tables = document.get("run")
        if not isinstance(tables, list) or not tables:
            raise self.fault("run", "is missing", "give a [[run]] for every assembly")
        runs = [run for at, table in enumerate(tables) for run in self.run(table, f"run[{at}]", document, on_shaft)]
        self.refuse_strangers(parts, runs)
        return Campaign(
            runs,
            self.inertias,
            {name: self.law(table["law"], f"part.{name}.law") for name, table in parts.items() if "law" in table},
            {name: self.each(table, name) for name, table in parts.items() if "temperature" in table},
            self.oil(document),
        )

    def run(self, table: Any, key: str, document: dict[str, Any], on_shaft: set[str]) -> list[Run]:
        table = self.known(table, key, "run")
        files, parts = self.texts(table, key, "files"), self.texts(table, key, "parts")
        if len(set(parts)) < len(parts) or any("@" in part or not part for part in parts):
            raise self.fault(f"{key}.parts", f"are {parts}", "name each part once, without @")
        inertia = self.inertia(table.get("inertia", document.get("inertia")), f"{key}.inertia")
        against = self.quantity(table["shaft_speed"], "speed", f"{key}.shaft_speed") if "shaft_speed" in table else 0.0
        warm = None
        if "temperature" in table:
            warm = self.quantity(table["temperature"], "temperature", f"{key}.temperature") - 273.15
        if (gear := table.get("gear", "loose")) not in GEARS:
            raise self.fault(f"{key}.gear", f"is {gear!r}", did_you_mean(str(gear), GEARS))
        shares = tuple(Share(part, 1.0, against if part in on_shaft else 0.0) for part in parts)
        runs = []
        for track in self.tracks([self.path.parent / file for file in files], gear):
            own = track.temperature if warm is None else warm
            runs.append(Run(track, shares, ((inertia, 1.0),), None if own is None else round(own, 1)))
        return runs

    def refuse_strangers(self, parts: dict[str, Any], runs: Sequence[Run]) -> None:
        seen = sorted({share.part for run in runs for share in run.shares})
        for name in parts:
            if name not in seen:
                raise self.fault(f"part.{name}", "is in no run", did_you_mean(name, seen))

    def inertia(self, written: Any, key: str) -> str:
        """Return the name of an inertia; equal texts are one inertia."""
        if written is None:
            raise self.fault(key, "is missing", 'e.g. inertia = "0.0695 kg m^2", for all runs or for each')
        value, spread = written, None
        if isinstance(written, dict):
            value, spread = written.get("value"), written.get("uncertainty")
            if value is None or set(written) - {"value", "uncertainty"}:
                raise self.fault(key, f"is {written}", 'e.g. { value = "0.07 kg m^2", uncertainty = "2 %" }')
        size, sigma = self.quantity(value, "inertia", key), 0.0
        if isinstance(spread, str) and spread.strip().endswith("%"):
            sigma = size * self.quantity(spread, "ratio", f"{key}.uncertainty")
        elif spread is not None:
            sigma = self.quantity(spread, "inertia", f"{key}.uncertainty")
        if size <= 0.0 or sigma < 0.0:
            raise self.fault(key, f"is {written}", "a body has mass: give a positive inertia")
        self.inertias[repr(written)] = Inertia(size, sigma)
        return repr(written)

    def oil(self, document: dict[str, Any]) -> Oil | None:
        if "oil" not in document:
            return None
        table = self.known(document["oil"], "oil", "oil")
        rows, key = table.get("kinematic_viscosity"), "oil.kinematic_viscosity"
        if not (isinstance(rows, list) and len(rows) == 2 and all(isinstance(r, list) and len(r) == 2 for r in rows)):
            raise self.fault(key, "is no pair of points", 'e.g. [["40 degC", "34 mm^2/s"], ["100 degC", "7 mm^2/s"]]')
        (one, two) = (
            (self.quantity(at, "temperature", key) - 273.15, self.quantity(nu, "kinematic_viscosity", key))
            for at, nu in rows
        )
        dense = self.quantity(table["density"], "density", "oil.density") if "density" in table else Oil((one, two))[1]
        try:
            from gears3d.laws.film import kinematic_viscosity

            kinematic_viscosity((one, two), one[0])
        except ValueError as error:
            raise self.fault(key, str(error)) from None
        return Oil((one, two), dense)

    def each(self, table: dict[str, Any], name: str) -> bool:
        if (word := table["temperature"]) not in ("each", "common"):
            remedy = '"each": numbers at every temperature; "common": the same'
            raise self.fault(f"part.{name}.temperature", f"is {word!r}", remedy)
        return word == "each"

    def law(self, word: Any, key: str) -> str:
        from gears3d.errors import UsageError

        try:
            terms_of(str(word))
        except UsageError as error:
            raise self.fault(key, str(error)) from None
        return word

    def quantity(self, text: Any, family: str, key: str) -> float:
        try:
            return parse(text, family)
        except InputError as error:
            raise InputError([Fault(key, f.message, f.remedy, str(self.path)) for f in error.faults]) from None

    def texts(self, table: dict[str, Any], key: str, name: str) -> list[str]:
        value = table.get(name)
        if not isinstance(value, list) or not value or not all(isinstance(one, str) for one in value):
            raise self.fault(f"{key}.{name}", f"is {value!r}", f'e.g. {name} = ["..."]')
        return value

    def table(self, document: dict[str, Any], name: str) -> dict[str, Any]:
        if not isinstance(value := document.get(name, {}), dict):
            raise self.fault(name, f"is {value!r}", f"write [{name}.NAME]")
        return value

    def known(self, table: Any, key: str, kind: str) -> dict[str, Any]:
        if not isinstance(table, dict):
            raise self.fault(key, f"is {table!r}", "give a table")
        for name in table:
            if name not in KEYS[kind]:
                where = f"{key}.{name}" if key else name
                raise self.fault(where, "is not known", did_you_mean(name, KEYS[kind]))
        return table
