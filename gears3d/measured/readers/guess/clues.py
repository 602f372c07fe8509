"""Features of a signal: its name, its unit, the course of its values."""

from __future__ import annotations

import re
from math import pi
from typing import NamedTuple

import numpy as np

from gears3d.errors import InputError
from gears3d.measured.readers.source import Signal, Source
from gears3d.measured.readers.unit import SAMPLES, is_counts, to_si
from gears3d.recording.columns import unit_of

# Values of all signals together that are examined.
VALUES = 8_000_000
# Rows of each signal that are examined.
ROWS = 200_000
# Share of rising steps in a time; a few may be damaged.
RISING = 0.98
# Net change over total variation, at least, of an angle; a speed returns.
STEADY = 0.5
_WORDS = {
    "time": r"^(t|time|zeit|timestamp|sec|seconds|sekunden|temps|tiempo|x)$|time|zeit|(^|_)t(_|$)",
    "loose": r"loose|driven|output|abtrieb|losrad|idle|wheel|slave|secondary|ausgang|(^|[_ .-])(out|ab|sek)($|[_ .-])"
    r"|(?<![0-9.])(?<!/-)2(?![0-9])",
    "drive": r"drive|driving|input|antrieb|pinion|ritzel|motor|master|primary|eingang|(^|[_ .-])(in|an|prim)($|[_ .-])"
    r"|(?<![0-9.])1(?![0-9])",
    "angle": r"theta|phi|angle|winkel|angular|pos|encoder|(^|[_ .-])enc|count|incr|inkrement|ticks|θ|φ|ϕ|rotation"
    r"|drehgeber",
    "speed": r"speed|rpm|omega|drehzahl|velocity|vel|geschw|ω|(^|_)n[_ ]?\d?$",
}
# Words for rotating parts; in, out, 1 and 2 are ambiguous.
_GEARS = (
    r"drive|driving|driven|loose|antrieb|abtrieb|pinion|ritzel|losrad|motor|gear|zahnrad"
    r"|shaft|welle|rotor|spindle|wheel"
)
# Words of quantities that are never a measured angle or speed of a gear: weather, geographic position, commands.
_NEVER = (
    r"temp|wind(?!el)|rain|regen|heading|azimuth|latitude|longitude|direction|target|command|soll(?!rad)|humid|feucht|error"
    r"|(?<![a-z])(lat|lon|lng|alt)(?![a-z])"
)
# Words of other quantities; a unit of rotation or a word for an angle outweighs them.
_OTHER = (
    r"druck|press|volt|spannung|curr|strom|power|leistung|energ|torque|moment|force|kraft|acc|beschl|oil|coolant"
    r"|level|volume|price|throttle|load|status|(?<![a-z])mode|frequency|noise|(?<![a-z])mic|sound|schall|strain|dms"
    r"|(?<![a-z])([xyzptuiva]|id|nr|no|run|trial|toss|day|year|hour|minute|month|date|kpa|mbar|psi)(?![a-z])"
)
_ROTATES = r"theta|phi|angle|winkel|(^|[_ .-])enc|rotation|drehzahl|omega|rpm|θ|φ|ϕ|ω"
_ENDINGS = {
    "rpm": "rpm",
    "deg": "deg",
    "deg_s": "deg/s",
    "dps": "deg/s",
    "rev": "rev",
    "revs": "rev",
    "counts": "counts",
    "ticks": "counts",
    "ms": "ms",
    "us": "us",
    "ns": "ns",
}
# Field names that structures use for samples, whatever the signal is called.
_NAMELESS = ("data", "values", "value", "y", "samples")
# Names that are nothing but a unit.
_WHOLE = {"rpm": "rpm", "u/min": "rpm", "deg": "deg", "rad": "rad", "rev": "rev", "revs": "rev"}
_ENDING = re.compile(r"(?<=[a-z0-9])[ _-](" + "|".join(sorted(_ENDINGS, key=len, reverse=True)) + ")$", re.IGNORECASE)


class Clue(NamedTuple):
    """Features of a signal.

    Args:
        signal: as the file has it.
        values: the first ones, (n,).
        unit: as told, empty where it is not.
        told_by: where the unit is from.
        family: ``time``, ``angle``, ``speed``, ``counts``, ``samples``, ``other``, or empty where nothing tells.
        rising: whether nearly all steps go up.
        step: of an even rise, else ``None``.
        moves: whether it increases like an angle rather than staying near a level like a speed.
        period: after which it wraps, in its own unit, else ``None``.
    """

    signal: Signal
    values: np.ndarray
    unit: str
    told_by: str
    family: str
    rising: bool
    step: float | None
    moves: bool
    period: float | None

    @property
    def word(self) -> str:
        """Its name, or that of its group where it is merely called data or values."""
        group, _, name = self.signal.label.lower().rpartition("/")
        if group and name in _NAMELESS:
            return group.rpartition("/")[2]
        bare = self.signal.bare.lower()
        return bare if re.search(r"[^\W\d_]{2}|^[^\W\d_]", bare) else self.signal.label.lower()  # "Rpm/4" has no group

    def says(self, word: str) -> bool:
        """Return whether its name contains a word for: ``time``, ``drive``, ``loose``, ``angle``, ``speed``."""
        name = self.word
        if re.fullmatch(r"(.* )?column \d+", name):
            return False
        if word == "drive" and re.search(_WORDS["loose"], name):
            return False
        return re.search(_WORDS[word], name) is not None

    @property
    def foreign(self) -> bool:
        """Whether its name is that of another quantity, as temperatures, positions on earth, or commands are."""
        name = self.word
        if re.search(_NEVER, name):
            return True
        rotates = self.family in ("angle", "speed", "counts") or re.search(_ROTATES, name)
        return not rotates and re.search(_OTHER, name) is not None

    @property
    def shown(self) -> bool:
        """Whether the file shows that it is of a gear: by a unit of rotation, or by a word for it."""
        if self.family in ("angle", "speed", "counts") or self.says("angle") or self.says("speed"):
            return True
        return re.search(_GEARS, self.word) is not None

    @property
    def whole(self) -> bool:
        """Whether all values are whole numbers."""
        return bool(np.array_equal(self.values, np.round(self.values)))

    @property
    def differences(self) -> bool:
        """Whether it holds counts since the last sample: whole numbers that stay about one value and are no speed."""
        plain = self.family in ("", "counts") and not self.unit.lower().endswith("/s") and self.whole
        plain = plain and self.period is None and not self.moves and not self.rising
        called = self.family == "counts" or (self.says("angle") and not self.says("speed"))
        return plain and called and len(np.unique(self.values[:1000])) > 1

    @property
    def travel(self) -> float:
        """How far it goes from the first value to the last, steps back to the start of a period taken out."""
        steps = np.diff(self.values)
        if self.period is not None:
            steps = steps - self.period * np.round(steps / self.period)
        return float(np.sum(steps))


def clues(source: Source) -> list[Clue]:
    """Return the features of every signal that has numbers that change.

    Raises InputError when it cannot be read.
    """
    numeric = [each for each in source.signals if each.numeric and (each.rows is None or each.rows > 1)]
    if not numeric:
        return []
    most = min(ROWS, max(VALUES // len(numeric), 1000))
    loaded = source.load([each.name for each in numeric], most)
    found = (_clue(each, loaded[each.name]) for each in numeric)
    return [each for each in found if each is not None]


def _clue(signal: Signal, values: np.ndarray) -> Clue | None:
    values = values[np.isfinite(values)]
    steps = np.diff(values)
    if len(values) < 3 or not np.any(steps):
        return None
    unit, told_by = _unit(signal)
    rising = float(np.mean(steps > 0.0)) > RISING
    middle = float(np.median(steps))
    even = rising and float(np.mean(np.abs(steps - middle) < 0.01 * middle)) > RISING
    period = _period(values, steps)
    way = np.abs(steps if period is None else steps - period * np.round(steps / period))
    total = float(np.sum(steps if period is None else steps - period * np.round(steps / period)))
    moves = abs(total) > STEADY * float(np.sum(way)) and abs(total) > 2.0 * float(np.std(steps)) * len(steps) ** 0.5
    return Clue(signal, values, unit, told_by, _family(unit), rising, middle if even else None, moves, period)


def _unit(signal: Signal) -> tuple[str, str]:
    """Return the unit of a signal and its origin."""
    if signal.unit:
        return signal.unit, "unit stated by the file"
    if signal.told_unit:
        return signal.told_unit, "unit behind the name"
    if signal.bare.lower() in _WHOLE:
        return _WHOLE[signal.bare.lower()], "the name is a unit"
    if match := _ENDING.search(signal.label):
        return _ENDINGS[match[1].lower()], "unit at the end of the name"
    if unit_of(signal.label):
        return unit_of(signal.label), "unit at the end of the name"
    return "", ""


def _family(unit: str) -> str:
    if not unit:
        return ""
    if is_counts(unit):
        return "counts"
    if unit.lower() in SAMPLES:
        return "samples"
    try:
        return to_si(unit, ("time", "angle", "speed"))[1]
    except InputError:
        return "other"


def _period(values: np.ndarray, steps: np.ndarray) -> float | None:
    """Return the period of a sawtooth: the likeliest of those that angles and counters have."""
    spread = float(np.ptp(values))
    jumps = np.abs(steps) > 0.5 * spread
    usual = float(np.median(steps))
    if not jumps.any() or np.mean(jumps) > 0.4 or (usual == 0.0 and np.mean(steps == 0.0) < 0.5):
        return None
    away = steps[jumps]
    if ((away > 0.0).any() and (away < 0.0).any()) or spread == 0.0:
        return None
    rest = steps[~jumps]
    if abs(float(np.sum(rest))) < STEADY * float(np.sum(np.abs(rest))):  # between its falls a sawtooth moves on
        return None
    known = [360.0, 2 * pi, 1.0, *(2.0**bits for bits in range(2, 33))]
    near = [period for period in known if spread * (1 - 1e-9) <= period <= spread * 1.05 + 1.0e-9]
    if near:
        return near[0]
    moved = float(np.median(np.abs(steps[~jumps]))) if (~jumps).any() else 0.0
    return float(np.round(spread + moved)) if np.array_equal(values, np.round(values)) else None
