"""A map proposed from what a file shows, as TOML, with the reason for every choice."""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Sequence
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from gears3d.errors import Fault, InputError
from gears3d.measured.readers.channels import Mapper
from gears3d.measured.readers.clues import (
    FASTEST,
    RATIO,
    Bench,
    Choice,
    Clue,
    Pulses,
    bench_of,
    candidates,
    clues,
    fit,
    in_mesh,
    mesh_note,
    pick,
    pulses,
    supported,
    two_level,
)
from gears3d.measured.readers.formats import open_source
from gears3d.measured.readers.maps import RecordMap
from gears3d.measured.readers.source import Source
from gears3d.measured.readers.unit import stated_rate, to_si
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

# Rates at which gears are recorded [Hz]: loggers of coast-downs to counters of edges.
LOWEST_RATE, HIGHEST_RATE = 1.0, 2e6


# Part by which two stated rates may differ.
CONTRADICTS = 0.1


# Names of a time.
_TIME = re.compile(r"t|time|zeit|timestamp|time_s")
# Meaning of a speed by its ratio to that of the rig.
MEANT = {
    "rad were meant where it says deg": pi / 180.0,
    "deg were meant where it says rad": 180.0 / pi,
    "rad/s were meant where it says deg/s": pi / 180.0,
    "revolutions were meant where it says deg": 1.0 / 360.0,
    "time were in ms and not in s": 1e-3,
    "time were in s and not in ms": 1e3,
}
# The same of signals that are speeds.
MEANT_SPEED = {
    "rpm were meant where it says rad/s": 30.0 / pi,
    "rad/s were meant where it says rpm": pi / 30.0,
}
# Relative deviation of such a ratio: the speed of a run is rarely set better.
CLOSE = 0.02


class Clock(NamedTuple):
    """Where the time comes from.

    Args:
        clue: its signal, or nothing.
        unit: of the signal.
        rate: of the samples [Hz], without a time signal.
        step: between two samples [s].
        whys: reasons, one sentence each.
        sure: whether something gives the unit.
    """

    clue: Clue | None
    unit: str
    rate: float | None
    step: float
    whys: tuple[str, ...]
    sure: bool = True


def find_clock(source: Source, found: list[Clue], rate: float | None) -> Clock:
    """Return the time of a file.

    ``rate``: of the rig's sensors [Hz], where it is known. Raises InputError when nothing gives it.
    """
    rising = [each for each in found if each.rising and each.family in ("time", "samples", "")]
    named = [each for each in rising if each.family in ("time", "samples") or each.says("time")]
    alone = [each for each in rising if each.step is not None and not each.says("angle") and not each.says("drive")]
    own = next((each.signal for each in found if each.signal.clock or each.signal.axis), None)
    noted = stated_rate(source.notes)
    told = 1.0 / own.clock[1] if own is not None and own.clock is not None else noted
    if own is not None and own.clock is not None:  # a column of a matrix may be the time that the rate makes, too
        alone = [each for each in alone if each.step is not None and _steps_at(each.step, told)]
    for each in named + [one for one in alone if not one.says("loose")]:
        taken = _of_signal(each, told or rate, named)
        if taken is not None:
            return taken
    if own is not None and own.clock is not None:
        return Clock(None, "", None, own.clock[1], (f"declared by the file: a sample every {own.clock[1]:g} s",))
    for value, why in ((noted, "the file states the rate in words"), (rate, "rate of the rig's sensors")):
        if value:
            named = next(
                (each.name for each in source.signals if each.numeric and _TIME.fullmatch(each.bare.lower())), ""
            )
            still = bool(named) and not any(each.signal.name == named for each in found)
            stands = f"NOT SURE: {named!r} is called a time and does not change" if still else "no signal is a time"
            return Clock(None, "", value, 1.0 / value, (f"{stands}; {why}",))
    remedy = "write a record.toml with [time] sample_rate, or give --rig with sensors.sample_rate; " + source.listing()
    gears = [each for each in found if each.says("drive") or each.says("loose") or each.says("angle")]
    other = [each for each in found if not each.rising and not two_level(each)]  # stamps have a direction only
    uneven = [each.signal.name for each in rising if each.step is None and not gears and not other and len(found) < 3]
    stamps = uneven[0] if uneven else None
    if stamps is not None:
        what = f"{stamps!r} rises unevenly: it may be the times of edges, and of which encoder is not to be guessed"
        remedy = f'write [loose] with channel = {stamps!r}, counts_per_revolution and decode = {{ kind = "stamps" }}'
        raise InputError(Fault("time", what, remedy, source.file))
    raise InputError(
        Fault("time", "is not to be guessed: no signal rises evenly, no rate is stated", remedy, source.file)
    )


def _steps_at(step: float, rate: float | None) -> bool:
    """Return whether a signal rises by one sample, or by the time of one in s, ms or us."""
    return step == 1.0 or (rate is not None and any(abs(step * rate / unit - 1.0) < 1e-3 for unit in (1.0, 1e3, 1e6)))


def refuse_contradiction(clock: Clock, rig: float | None, file: str) -> None:
    """Refuse a file whose own rate, stated or made by its time, is not that of the rig.

    ``rig``: rate of the rig's sensors [Hz], where it is stated. Raises InputError when they differ by more than 10 %.
    """
    rate = 1.0 / clock.step
    uneven = clock.clue is not None and (clock.clue.family != "time" or clock.clue.step is None)  # times of edges
    if not rig or abs(rate / rig - 1.0) <= CONTRADICTS or uneven:
        return
    what = "the file states" if clock.clue is None else f"{clock.clue.signal.name} in {clock.unit} makes"
    remedy = f'correct the rig, or write sensors.sample_rate = "{rate:.6g} Hz" below [condition] of a map'
    raise InputError(Fault("time", f"{what} {rate:.6g} Hz, the rig sensors.sample_rate = {rig:g} Hz", remedy, file))


def _of_signal(clue: Clue, rate: float | None, named: list[Clue]) -> Clock | None:
    """Return a signal as the time with its unit; nothing where it makes no time."""
    step = clue.step or float(clue.values[-1] - clue.values[0]) / (len(clue.values) - 1)
    how = "rises evenly" if clue.step is not None else "rises"
    first = f"{clue.signal.bare!r} " + ("is called a time and " if clue in named else "") + how
    if clue.family == "time":
        seconds = step * to_si(clue.unit, ("time",))[0]
        return Clock(clue, clue.unit, None, seconds, (first, f"{clue.unit}: {clue.told_by}"))
    numbers = clue.family == "samples" or (step == 1.0 and clue.whole)
    if numbers:
        return Clock(clue, "samples", rate, 1.0 / rate, (first + ", one a sample",)) if rate else None
    sizes = {unit: step * to_si(unit, ("time",))[0] for unit in ("s", "ms", "us", "ns")}
    if rate:
        unit = min(sizes, key=lambda each: abs(sizes[each] * rate - 1.0))
        if abs(sizes[unit] * rate - 1.0) < 0.05:
            return Clock(clue, unit, None, sizes[unit], (first, f"{unit} makes {1 / sizes[unit]:g} Hz, as stated"))
    able = [unit for unit, size in sizes.items() if size > 0.0 and LOWEST_RATE <= 1.0 / size <= HIGHEST_RATE]
    if not able:
        return None
    told = ", ".join(f"{1.0 / sizes[unit]:g} Hz if in {unit}" for unit in able)
    sure = f"{able[0]} makes {1 / sizes[able[0]]:g} Hz" if len(able) == 1 else f"NOT SURE of the unit: {told}"
    return Clock(clue, able[0], None, sizes[able[0]], (first, sure), len(able) == 1)


def propose(
    path: str | Path | Sequence[str | Path], rig: Scenario | None = None, beside: str | Path | None = None
) -> str:
    """Propose a map for a measured file, or one map for several files of one rig.

    Args:
        path: the file, or several: what they have in common is at the top of the map, the rest below ``[[record]]``.
        rig: scenario of the bench: its teeth, mean speed, counts and rate decide what the file leaves open.
        beside: folder in which the map will lie; the working folder when not given.

    Returns:
        ``record.toml`` with a comment for every choice; it reads the file.

    Raises:
        InputError: the file cannot be read, or time, gears or counts are not to be guessed.
    """
    if isinstance(path, str | Path):
        form, lines = _proposed(path, rig, beside)
        return _headed(f"{_quiet(Path(path).name)} ({form})", lines)
    return _headed(f"{len(path)} files", _together([_proposed(one, rig, beside)[1] for one in path]))


def _headed(of: str, lines: Sequence[str]) -> str:
    text = "\n".join(lines)
    doubts = text.count("NOT SURE") + text.count(": NOT as ") + text.count("# NOT taken")
    points = f": DOUBTFUL in {doubts} point{'s' if doubts > 1 else ''}, marked NOT" if doubts else ""
    return f"# Proposed from {of}{points}; check what is said here before trusting it.\n{text}\n"


def _together(maps: Sequence[list[str]]) -> list[str]:
    """Return the lines of one map of several files, from those of the map of each."""
    files = [next(line for line in one if line.startswith("file = ")) for one in maps]
    parts = [_parts([line for line in one if line not in ("format = 1", file)])
             for one, file in zip(maps, files, strict=True)]  # fmt: skip
    held = [{part.held for part in own} for own in parts]
    common = {part.held for part in parts[0] if part.table != "condition" and all(part.held in own for own in held)}
    lines = ["format = 1"]
    lines += [line for part in parts[0] if part.held in common for line in ("", *part.reasons, *part.lines)]
    for file, own in zip(files, parts, strict=True):
        lines += ["", "[[record]]", file]
        for part in own:
            if part.held not in common:
                lines += [
                    *part.reasons,
                    *(line.replace("[", "[record.", 1) for line in part.lines[:1]),
                    *part.lines[1:],
                ]
    return lines


class _Part(NamedTuple):
    """A part of a map between empty lines.

    Args:
        table: its name; empty where the part is comments alone.
        reasons: comments above it.
        lines: the table.
    """

    table: str
    reasons: tuple[str, ...]
    lines: tuple[str, ...]

    @property
    def held(self) -> tuple[str, ...]:
        """What makes the part equal to one of another map: its table without the reasons, else its comments."""
        return self.lines or self.reasons


def _parts(lines: list[str]) -> list[_Part]:
    found = []
    for text in re.split(r"\n{2,}", "\n".join(lines).strip("\n")):
        each = text.split("\n")
        at = next((k for k, line in enumerate(each) if line.startswith("[")), len(each))
        found.append(_Part(each[at].strip("[]") if at < len(each) else "", tuple(each[:at]), tuple(each[at:])))
    return found


def _proposed(path: str | Path, rig: Scenario | None, beside: str | Path | None) -> tuple[str, list[str]]:
    """Return the format of a file and the lines of its map, below the heading."""
    source = open_source(path)
    found = clues(source)
    bench = bench_of(rig)
    clock = find_clock(source, found, bench.sample_rate)
    rows = max((len(each.values) for each in found), default=0)
    flat = [each for each in found if each is not clock.clue and two_level(each)]
    able = [each for each in candidates(found, clock.clue) if not any(each is one for one in flat)]
    raw = pulses(flat, bench, clock.step * rows, source.file) if len(able) < 2 else {}
    taken = {} if raw else fit(pick(able, bench, clock.step * rows), bench)
    chosen = supported(taken, bench, clock.step * rows)
    if not chosen and not raw:
        remedy = "raw channels need decode = { kind = ... } in a record.toml; " + source.listing()
        what = "no signal looks like the angle or speed of a gear"
        if taken:
            names = " and ".join(repr(each.clue.signal.name) for each in taken.values())
            what += f": {names} might, but no unit, no name" + (", nor the rig's teeth and speed" if rig else "")
            what += " shows it" + ("" if rig else "; a --rig with teeth and speed may")
            remedy = "write a record.toml where they are; " + source.listing()
        raise InputError(Fault("drive", what, remedy, source.file))
    refuse_contradiction(clock, bench.sample_rate, source.file)
    for gear, choice in chosen.items():
        if choice.unit == "counts" and choice.counts is None:
            remedy = f"give --rig with sensors.{gear}.counts_per_revolution"
            what = f"{choice.clue.signal.name} is in counts, and how many are a revolution is not to be guessed"
            raise InputError(Fault(f"{gear}.counts_per_revolution", what, remedy, source.file))
    text = _written(source, path, beside, clock, chosen, raw, bench, found)
    Mapper(source, RecordMap.model_validate(tomllib.loads(text)), "the proposed map").columns()
    unsure = [gear for gear, choice in chosen.items() if not choice.sure]
    return source.form, _without_units(text, [*unsure, *([] if clock.sure else ["time"])]).split("\n")


def _without_units(text: str, unsure: list[str]) -> str:
    """Return a map with unknown units as comments: they are reported as missing when it is read."""
    for table in unsure:
        form = rf'(?m)^(\[{table}\]\nchannel = .*\n)unit = (".*")$'
        text = re.sub(form, r"\1# unit = \2  # write the right one: nothing gives it", text)
    return text


def _written(
    source: Source,
    path: str | Path,
    beside: str | Path | None,
    clock: Clock,
    chosen: dict[str, Choice],
    raw: dict[str, Pulses],
    bench: Bench,
    found: list[Clue],
) -> str:
    lines = ["format = 1", f"file = {_text(os.path.relpath(path, beside or '.'))}", ""]
    lines += [*_comments(clock.whys), *_clock_lines(clock, chosen)]
    for gear, choice in chosen.items():
        lines += ["", *_gear_lines(gear, choice)]
    for each in raw.values():
        lines += ["", *_comments(each.whys), *each.lines]
    note = mesh_note(chosen, bench)
    lines += ["", f"# {note}"] if note else []
    lines += _condition(chosen, bench, clock)
    used = {choice.clue.signal.name for choice in chosen.values()}
    used |= {name for each in raw.values() for name in each.used}
    used |= {clock.clue.signal.name} if clock.clue else set()
    rest = [each for each in found if each.signal.name not in used]
    others = [each for each in rest if len(chosen) == 1 and _of_other_rate(each, next(iter(chosen.values())).clue)]
    lines += [
        f"# NOT taken: {_quiet(repr(each.signal.name))} has another rate or number of samples: resample it to one time"
        for each in others[:3]
    ]
    left = [each.signal.name for each in rest]
    lines += ["", f"# not used: {_quiet(', '.join(left[:20]))}" + (" ..." if len(left) > 20 else "")] if left else []
    return "\n".join(lines)


def _of_other_rate(clue: Clue, taken: Clue) -> bool:
    """Return whether a signal may be the other gear, but for its samples."""
    turns = clue.shown and not clue.foreign and clue.family not in ("time", "samples", "other")
    return turns and (clue.signal.rows, clue.signal.clock) != (taken.signal.rows, taken.signal.clock)


def _clock_lines(clock: Clock, chosen: dict[str, Choice]) -> list[str]:
    if clock.clue is not None:
        lines = ["[time]", f"channel = {_text(clock.clue.signal.name)}", f"unit = {_text(clock.unit)}"]
        return lines + ([f'sample_rate = "{clock.rate:.12g} Hz"'] if clock.rate else [])
    if clock.rate is not None:
        return ["[time]", f'sample_rate = "{clock.rate:.12g} Hz"']
    return []


def _gear_lines(gear: str, choice: Choice) -> list[str]:
    clue = choice.clue
    name = clue.signal.bare
    whys = [f"{name!r} names the {gear} gear" if clue.says(gear) else "taken in the order of the file"]
    lines = [f"[{gear}]", f"channel = {_text(clue.signal.name)}", f"unit = {_text(choice.unit)}"]
    if choice.increments:
        lines.append("increments = true")
    if choice.counts is not None:
        lines.append(f"counts_per_revolution = {choice.counts:.12g}")
    if clue.period is not None:
        unit = "rev" if choice.unit == "rad" else choice.unit
        lines.append(f'wraps_at = "{1.0 if choice.unit == "rad" else clue.period:.12g} {unit}"')
        whys.append(f"it starts again every {clue.period:.6g}")
    if choice.turned < 0.0:
        lines.append("sign = -1")
        whys.append("it runs backwards, and angles are positive in the gear's own sense of rotation")
    return [*_comments((*whys, *choice.whys)), *lines]


def _condition(chosen: dict[str, Choice], bench: Bench, clock: Clock) -> list[str]:
    """Return the mean speed as a condition, where it is not the rig's."""
    drive = chosen.get("drive")
    if drive is None or not bench.mean:
        return []
    speed = abs(drive.turned) / (clock.step * len(drive.clue.values))
    if abs(speed / bench.mean - 1.0) < 0.02 or not speed:
        return []
    if not drive.sure or not clock.sure:
        return []
    told, own = show(speed, "speed", 4), show(bench.mean, "speed", 4)
    ratio, is_speed = speed / abs(bench.mean), drive.clue.family == "speed"
    units = MEANT_SPEED | MEANT if is_speed else MEANT
    meant = next((what for what, part in units.items() if abs(ratio / part - 1.0) < CLOSE), "")
    if speed > FASTEST or not 1.0 / RATIO < ratio < RATIO or meant in MEANT_SPEED:
        why = f"# NOT SURE: the drive would turn at {told}, the rig at {own}" + (f", as if {meant}" if meant else "")
        alone = in_mesh(chosen, bench) is False
        return [
            "",
            why + (", and the loose gear does not fit: it may be another rig, or no rig at all" if alone else ""),
        ]
    part = f" in the first {len(drive.clue.values)} samples" if drive.clue.begun else ""
    why = f"# the drive turns at {told}{part} and not at the rig's {own}"
    return ["", why, "[condition]", f'motion.mean = "{told}"']


def _comments(whys: tuple[str, ...] | list[str]) -> list[str]:
    return [f"# {_quiet(why)}" for why in whys]


def _text(value: str) -> str:
    """Return a TOML string."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _quiet(text: str) -> str:
    return "".join(sign if sign.isprintable() else " " for sign in text)
