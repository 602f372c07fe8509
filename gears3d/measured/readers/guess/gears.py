"""Which signals are the two gears, in which unit, and which way they turn."""

from __future__ import annotations

from math import inf, log, pi
from typing import TYPE_CHECKING, NamedTuple

from gears3d.measured.readers.guess.clues import Clue
from gears3d.measured.readers.unit import to_si
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

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
    text = f"the gears turn by {turns[0]:.6g} and {turns[1]:.6g} revolutions"
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
