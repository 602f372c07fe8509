"""What a signal may be: features of its name, unit and course; which signals are the gears, and which are pulses."""

from __future__ import annotations

import json
import re
from math import inf, log, pi
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.errors import Fault, InputError
from gears3d.measured.readers.source import Signal, Source
from gears3d.measured.readers.unit import SAMPLES, is_counts, to_si
from gears3d.recording.columns import unit_of
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

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
# Field names that structures use for samples, independent of the name of the signal.
_NAMELESS = ("data", "values", "value", "y", "samples")
# Names that are nothing but a unit.
_WHOLE = {"rpm": "rpm", "u/min": "rpm", "deg": "deg", "rad": "rad", "rev": "rev", "revs": "rev"}
_ENDING = re.compile(r"(?<=[a-z0-9])[ _-](" + "|".join(sorted(_ENDINGS, key=len, reverse=True)) + ")$", re.IGNORECASE)
# Part by which two travels may differ and still be those of two gears in mesh.
FITS = 0.02
# Ratio of a pair beyond which a unit is rejected.
RATIO = 12.0
# Relative deviation up to which a speed counts as that of the rig.
LIKE = 0.25
# Upper limit of speeds [rad/s]; a unit that gives a higher one is not proposed.
FASTEST = 30_000 * 2 * pi / 60
_ANGLES = ("rad", "deg", "rev")
_SPEEDS = ("rpm", "rad/s", "deg/s")
# Part of the range within which a reading is at one of both levels.
NEAR = 0.2
# Readings that are at a level; edges of analog pulses lie between.
SHARE = 0.9
# Share of its readings that each level has at least; an index mark may have fewer.
RARE = 0.02
# Edges that a channel of an encoder or a tacho shows.
FEWEST = 8
# Share of transitions in which both channels of a quadrature may change at once.
ILLEGAL = 0.02


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
        begun: whether the file has more values.
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
    begun: bool = False

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
    return [each._replace(begun=len(loaded[each.signal.name]) >= most) for each in found if each is not None]


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


class Choice(NamedTuple):
    """A signal taken for a gear.

    Args:
        clue: the signal.
        unit: it is taken to be in.
        counts: of its encoder a revolution, where the unit is counts.
        turned: by the gear over the rows that were looked at, with its sign [rad].
        whys: reasons, one sentence each.
        increments: whether it holds the counts since the last sample.
        sure: whether something gives the unit.
    """

    clue: Clue
    unit: str
    counts: float | None
    turned: float
    whys: tuple[str, ...]
    increments: bool = False
    sure: bool = True


class Bench(NamedTuple):
    """What is known of the rig: teeth, mean speed [rad/s] and counts of both gears; all may be missing."""

    teeth: tuple[int, int] | None = None
    mean: float | None = None
    counts: tuple[float | None, float | None] = (None, None)
    sample_rate: float | None = None


def bench_of(rig: Scenario | None) -> Bench:
    """Return the test rig of a scenario.

    >>> bench_of(None).teeth is None
    True
    """
    if rig is None:
        return Bench()
    counts = (rig.sensors.drive.counts_per_revolution, rig.sensors.loose.counts_per_revolution)
    mean = rig.motion.mean if rig.motion.record is None else None
    rate = rig.sensors.sample_rate if rig.sensors.stated else None  # a default states nothing about a file
    return Bench((rig.gears.drive.teeth, rig.gears.loose.teeth), mean, counts, rate)


def candidates(found: list[Clue], clock: Clue | None) -> list[Clue]:
    """Return the signals that may be the angle or speed of a gear."""
    rows = None if clock is None else clock.signal.rows
    return [
        each
        for each in found
        if each is not clock
        and each.family in ("angle", "speed", "counts", "")
        and not each.foreign
        and (each.signal.rows == rows or rows is None or each.signal.rows is None)
        and (each.shown or each.says("drive") or each.says("loose") or each.moves)
    ]


def pick(able: list[Clue], bench: Bench, lasts: float) -> dict[str, Choice]:
    """Return the signals of the gears: the pair with the most evidence.

    ``lasts``: duration of the examined samples [s].
    """
    if not able:
        return {}
    if len(able) == 1:
        gear = "drive" if able[0].says("drive") else "loose"
        return {gear: resolve(able[0], gear, bench, lasts, None)}
    pairs = [
        (_score(one, other, at, to), at, to)
        for at, one in enumerate(able)
        for to, other in enumerate(able)
        if at != to and one.signal.rows == other.signal.rows
    ]
    if not pairs:
        return {"loose": resolve(able[0], "loose", bench, lasts, None)}
    _, at, to = max(pairs, key=lambda each: (each[0], -each[1], -each[2]))
    one, other = able[at], able[to]
    first = resolve(one, "drive", bench, lasts, None)
    second = resolve(other, "loose", bench, lasts, first)
    if not one.unit and other.unit:
        first = resolve(one, "drive", bench, lasts, second)
    return {"drive": first, "loose": second}


def resolve(clue: Clue, gear: str, bench: Bench, lasts: float, mate: Choice | None) -> Choice:
    """Return a signal with its unit: stated, or the one consistent with what else is known.

    ``lasts``: duration of the examined samples [s].
    """
    which = 0 if gear == "drive" else 1
    counts, why = _counts(clue, bench.counts[which])
    if clue.unit and not (clue.differences and _adds_up(clue, counts, _expected(which, bench, lasts, mate)[0])):
        return _choice(clue, clue.unit, counts, lasts, (f"{clue.unit}: {clue.told_by}", *why))
    if clue.differences:
        told = f"{clue.unit}: {clue.told_by}; " if clue.unit else ""
        whys = (told + "whole numbers about one value: counts since the last sample", *why)
        turned = 0.0 if counts is None else 2.0 * pi / counts * float(clue.values.sum())
        return Choice(clue, "counts", counts, turned, whys, True)
    if clue.whole and abs(clue.travel) > 100.0 and not clue.says("speed"):
        return _choice(clue, "counts", counts, lasts, ("whole numbers that keep on: counts of an encoder", *why))
    called = clue.says("angle") and not clue.says("speed")
    angle = called or (clue.moves and not (clue.says("speed") and not clue.says("angle")))
    units = _ANGLES if angle else _SPEEDS
    goes = "it keeps on rising or falling: an angle" if angle else "it stays about one value: a speed"
    goes = "it is called an angle" if angle and not clue.moves else goes
    if clue.period is not None:
        unit = {360.0: "deg", 1.0: "rev"}.get(clue.period, "rad")
        return _choice(clue, unit, None, lasts, (f"starts again every {clue.period:.6g}: {unit}",))
    wanted, source = _expected(which, bench, lasts, mate)
    sizes = {unit: _choice(clue, unit, None, lasts, ()).turned for unit in units}
    sizes = {unit: size for unit, size in sizes.items() if abs(size) < FASTEST * lasts} or sizes
    units = tuple(sizes)
    if wanted:
        near = min(units, key=lambda unit: abs(abs(sizes[unit]) / wanted - 1.0))
        if abs(abs(sizes[near]) / wanted - 1.0) < LIKE:
            why = f"{near} fits {source}: {show(abs(sizes[near]) / lasts, 'speed', 4)} against "
            found = _choice(clue, near, None, lasts, (goes, why + show(wanted / lasts, "speed", 4)))
            return found._replace(sure=mate is None or mate.sure)
        if mate is not None and bench.teeth is None:
            near = min(units, key=lambda unit: abs(log(abs(sizes[unit]) / wanted)) if sizes[unit] else inf)
            parts = {unit: abs(size) / wanted for unit, size in sizes.items()}
            parts = {unit: part for unit, part in parts.items() if RATIO > part > 1.0 / RATIO}
            if near in parts:
                why = ", ".join(f"{part:.4g} times the other gear's if in {unit}" for unit, part in parts.items())
                unsure = _choice(clue, near, None, lasts, (goes, f"NOT SURE of the unit, its travel is {why}"))
                return unsure._replace(sure=False)
    told = ", ".join(f"{show(abs(size) / lasts, 'speed', 3)} if in {unit}" for unit, size in sizes.items())
    unsure = f"NOT SURE of the unit, nothing gives it: {told}"
    return _choice(clue, units[0], None, lasts, (goes, unsure))._replace(sure=False)


def supported(chosen: dict[str, Choice], bench: Bench, lasts: float) -> dict[str, Choice]:
    """Return the signals with evidence from the file or the rig that they belong to a gear.

    ``lasts``: duration of the examined samples [s].
    """
    sure = bench.mean and in_mesh(chosen, bench) and all(each.sure for each in chosen.values())
    if sure and bench.mean and abs(abs(chosen["drive"].turned) / (abs(bench.mean) * lasts) - 1.0) < LIKE:
        return chosen
    return {gear: choice for gear, choice in chosen.items() if choice.clue.shown}


def _part(chosen: dict[str, Choice], bench: Bench) -> float | None:
    """Return the travel of the loose gear over that which the teeth make of the drive's."""
    if len(chosen) < 2 or not chosen["drive"].turned or bench.teeth is None:
        return None
    drive, loose = bench.teeth
    return abs(chosen["loose"].turned * loose) / abs(chosen["drive"].turned * drive)


def in_mesh(chosen: dict[str, Choice], bench: Bench) -> bool | None:
    """Return whether both gears turn in the ratio of their teeth; ``None`` where that is not known."""
    part = _part(chosen, bench)
    return None if part is None else abs(part - 1.0) < FITS


def mesh_note(chosen: dict[str, Choice], bench: Bench) -> str:
    """Return one sentence that compares the travels of both gears with the ratio of the teeth."""
    if len(chosen) < 2 or not chosen["drive"].turned:
        return ""
    turns = [abs(each.turned) / (2 * pi) for each in (chosen["drive"], chosen["loose"])]
    looked = chosen["drive"].clue
    part = f" in the first {len(looked.values)} samples" if looked.begun else ""
    text = f"the gears turn by {turns[0]:.6g} and {turns[1]:.6g} revolutions{part}"
    if bench.teeth is None:
        return f"{text}; give --rig to hold that against the teeth"
    drive, loose = bench.teeth
    part = turns[1] * loose / (turns[0] * drive)
    if in_mesh(chosen, bench):
        return f"{text}, as {drive} and {loose} teeth in mesh do"
    return (
        f"{text}: NOT as {drive} and {loose} teeth in mesh do, {part:.4g} times as much of the loose gear; look at "
        "units, counts_per_revolution (edges: four times the lines), whether an encoder sits on another shaft (ratio)"
    )


def fit(chosen: dict[str, Choice], bench: Bench) -> dict[str, Choice]:
    """Interchange the gears where only that agrees with the ratio of the teeth."""
    if len(chosen) < 2 or bench.teeth is None or bench.teeth[0] == bench.teeth[1]:
        return chosen
    one, other = chosen["drive"], chosen["loose"]
    if not one.turned or not other.turned:
        return chosen
    part = abs(other.turned / one.turned)
    drive, loose = bench.teeth
    if abs(part * loose / drive - 1.0) < FITS or abs(part * drive / loose - 1.0) >= FITS:
        return chosen
    why = f"taken for the other gear, because only so it fits {drive} and {loose} teeth"
    return {"drive": other._replace(whys=(*other.whys, why)), "loose": one._replace(whys=(*one.whys, why))}


def _score(one: Clue, other: Clue, at: int, to: int) -> float:
    """Return the score of a pair as drive and loose gear."""
    score = 4.0 * one.says("drive") + 4.0 * other.says("loose")
    score -= 4.0 * one.says("loose") + 4.0 * other.says("drive")
    for each in (one, other):
        score += 3.0 * (each.family in ("angle", "counts") or (not each.family and each.moves))
        score += 1.0 * bool(each.family) + 1.0 * (each.says("angle") or each.says("speed"))
    return score + 2.0 * (one.family == other.family) + 1.0 * (at < to)


def _adds_up(clue: Clue, counts: float | None, wanted: float) -> bool:
    """Return whether the sum of the values is what the gear should turn by, within what the mean speed tells."""
    if counts is None or not wanted:
        return False
    return abs(abs(2.0 * pi / counts * float(clue.values.sum())) / wanted - 1.0) < LIKE


def _counts(clue: Clue, told: float | None) -> tuple[float | None, tuple[str, ...]]:
    if clue.family not in ("counts", "") or (clue.whole and clue.says("speed") and not clue.unit):
        return None, ()
    if told:
        return told, (f"{told:g} counts a revolution: of the rig",)
    if clue.period is not None:
        return clue.period, (f"it starts again every {clue.period:g} counts: taken for a revolution",)
    return None, ()


def _expected(which: int, bench: Bench, lasts: float, mate: Choice | None) -> tuple[float, str]:
    """Return the expected travel of a gear [rad], and its source."""
    other = 1 - which
    if mate is not None and mate.turned:
        ratio = 1.0 if bench.teeth is None else bench.teeth[other] / bench.teeth[which]
        return abs(mate.turned) * ratio, "the other gear" + ("" if bench.teeth is None else " and the teeth")
    if bench.mean:
        ratio = 1.0 if which == 0 or bench.teeth is None else bench.teeth[0] / bench.teeth[1]
        return abs(bench.mean) * lasts * ratio, "the mean speed of the rig"
    return 0.0, ""


def _choice(clue: Clue, unit: str, counts: float | None, lasts: float, whys: tuple[str, ...]) -> Choice:
    if counts is None and unit == "counts":
        return Choice(clue, unit, None, 0.0, whys)
    factor, family = to_si(unit, ("angle", "speed"), counts)
    size = float(clue.values.mean()) * lasts if family == "speed" else clue.travel
    return Choice(clue, unit, counts, factor * size, whys)


class Pulses(NamedTuple):
    """Two-level signals taken for one gear.

    Args:
        lines: of its table in the map.
        whys: reasons, one sentence each.
        used: names of the signals.
    """

    lines: tuple[str, ...]
    whys: tuple[str, ...]
    used: tuple[str, ...]


def two_level(clue: Clue) -> bool:
    """Return whether a signal is at one of two levels nearly always."""
    low, high = float(clue.values.min()), float(clue.values.max())
    if clue.family in ("time", "angle", "speed", "counts") or high <= low:
        return False
    other = clue.foreign or clue.says("angle") or clue.says("speed")  # "encoder A" is logic, "pos" a position at stops
    if other and np.any((clue.values != low) & (clue.values != high)):
        return False
    place = (clue.values - low) / (high - low)
    up, down = float(np.mean(place > 1.0 - NEAR)), float(np.mean(place < NEAR))
    return up + down > SHARE and min(up, down) > 0.0 and len(np.flatnonzero(np.diff(place > 0.5))) > 1


def pulses(found: list[Clue], bench: Bench, lasts: float, file: str) -> dict[str, Pulses]:
    """Return the gears that two-level signals show: quadrature first, else pulses of a tacho.

    ``lasts``: duration of the examined samples [s]. Raises InputError when the lines of an encoder or the pulses per
    revolution are not known.
    """
    pairs: list[tuple[Clue, Clue, Clue | None, int]] = []
    at = 0
    while at + 1 < len(found):
        turned = _quadrature(found[at], found[at + 1])
        if not turned:
            at += 1
            continue
        after = found[at + 2] if at + 2 < len(found) and _is_index(found[at + 2], found[at]) else None
        pairs.append((found[at], found[at + 1], after, turned))
        at += 2 if after is None else 3
    if pairs:
        return {
            gear: _encoder(gear, *pair, bench, file)
            for gear, pair in zip(_gears([pair[0] for pair in pairs]), pairs[:2], strict=False)
        }
    able = [each for each in found if len(_edges(each)) >= FEWEST and min(_shares(each)) > RARE]
    return {gear: _tacho(gear, clue, bench, lasts, file) for gear, clue in zip(_gears(able), able[:2], strict=False)}


def _gears(found: list[Clue]) -> tuple[str, ...]:
    """Return which gears signals belong to: by their names, else in the order of the file."""
    if len(found) == 1:
        return ("drive",) if found[0].says("drive") else ("loose",)
    turned = len(found) > 1 and (found[0].says("loose") or found[1].says("drive"))
    return ("loose", "drive") if turned else ("drive", "loose")


def _high(clue: Clue) -> np.ndarray:
    return clue.values > 0.5 * (float(clue.values.min()) + float(clue.values.max()))


def _edges(clue: Clue) -> np.ndarray:
    return np.flatnonzero(np.diff(_high(clue)))


def _shares(clue: Clue) -> tuple[float, float]:
    up = float(np.mean(_high(clue)))
    return up, 1.0 - up


def _quadrature(a: Clue, b: Clue) -> int:
    """Return the sense of rotation of two channels in quadrature, 0 where they are not in quadrature."""
    if len(a.values) != len(b.values) or min(len(_edges(a)), len(_edges(b))) < FEWEST:
        return 0
    state = np.array([0, 1, 3, 2])[2 * _high(a).astype(int) + _high(b)]  # the order of states when b leads
    steps = np.diff(state) % 4
    moved = steps[steps != 0]
    if np.mean(moved == 2) > ILLEGAL or min(np.bincount(state, minlength=4)) < RARE * len(state):
        return 0
    return 1 if np.sum(moved == 3) > np.sum(moved == 1) else -1


def _is_index(clue: Clue, a: Clue) -> bool:
    return len(_edges(clue)) < 0.25 * len(_edges(a)) and min(_shares(clue)) < 0.25


def _encoder(gear: str, a: Clue, b: Clue, index: Clue | None, turned: int, bench: Bench, file: str) -> Pulses:
    counts = bench.counts[0 if gear == "drive" else 1]
    if not counts:
        what = f"{a.signal.name} and {b.signal.name} are raw quadrature, and the lines of its encoder are not known"
        remedy = f'give --rig with sensors.{gear}.counts_per_revolution, or write decode = {{ kind = "quadrature" }}'
        raise InputError(Fault(f"{gear}.decode.lines", what, remedy, file))
    decode = f'kind = "quadrature", a = {_text(a)}, b = {_text(b)}, lines = {counts / 4:.12g}'
    lines = [f"[{gear}]", f"decode = {{ {decode} }}"]
    whys = ["two levels each, a quarter of a period apart: raw quadrature", f"{counts / 4:g} lines: of the rig"]
    if turned < 0:
        lines.append("sign = -1")
        whys.append("b leads a, and angles are positive in the gear's own sense of rotation")
    if index is not None:
        lines.append(f"index = {{ channel = {_text(index)} }}")
        whys.append(f"{index.signal.bare!r} has few pulses: the index mark")
    used = (a.signal.name, b.signal.name, *([index.signal.name] if index else []))
    return Pulses(tuple(lines), tuple(whys), used)


def _tacho(gear: str, clue: Clue, bench: Bench, lasts: float, file: str) -> Pulses:
    which = 0 if gear == "drive" else 1
    rate = 0.5 * len(_edges(clue)) / lasts
    teeth = None if bench.teeth is None else bench.teeth[which]
    if teeth is None or not bench.mean:
        what = f"{clue.signal.name} has {rate:.4g} pulses a second, and how many are a revolution is not known"
        remedy = f'write channel and decode = {{ kind = "tacho", positions = ... }} below [{gear}], or give --rig'
        raise InputError(Fault(f"{gear}.decode.positions", what, remedy, file))
    mean = abs(bench.mean) * (1.0 if which == 0 else bench.teeth[0] / bench.teeth[1] if bench.teeth else 1.0)
    positions = rate / (mean / (2.0 * np.pi))
    near = next((one for one in (teeth, round(positions)) if one > 0 and abs(positions / one - 1.0) < 0.1), None)
    if near is None:
        what = f"{clue.signal.name} has {positions:.3g} pulses a revolution at the mean speed of the rig"
        raise InputError(Fault(f"{gear}.decode.positions", what, "check motion.mean, or write the map", file))
    whys = ("two levels, one pulse after the other: a tacho", f"{positions:.4g} pulses a revolution at the rig's speed")
    table = (f"[{gear}]", f"channel = {_text(clue)}", f'decode = {{ kind = "tacho", positions = {near} }}')
    return Pulses(table, whys, (clue.signal.name,))


def _text(clue: Clue) -> str:
    return json.dumps(clue.signal.name, ensure_ascii=False).replace("\x7f", "\\u007f")
