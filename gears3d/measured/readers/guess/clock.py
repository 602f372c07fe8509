"""Which signal is the time, in which unit, or at which rate the file was sampled."""

from __future__ import annotations

import re
from typing import NamedTuple

from gears3d.errors import Fault, InputError
from gears3d.measured.readers.guess.clues import Clue
from gears3d.measured.readers.guess.pulses import two_level
from gears3d.measured.readers.source import Source
from gears3d.measured.readers.stated import stated_rate
from gears3d.measured.readers.unit import to_si

# Rates at which gears are recorded [Hz]: loggers of coast-downs to counters of edges.
SLOWEST, FASTEST = 1.0, 2e6


# Part by which two stated rates may differ.
CONTRADICTS = 0.1


# Names of a time.
_TIME = re.compile(r"t|time|zeit|timestamp|time_s")


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
    able = [unit for unit, size in sizes.items() if size > 0.0 and SLOWEST <= 1.0 / size <= FASTEST]
    if not able:
        return None
    told = ", ".join(f"{1.0 / sizes[unit]:g} Hz if in {unit}" for unit in able)
    sure = f"{able[0]} makes {1 / sizes[able[0]]:g} Hz" if len(able) == 1 else f"NOT SURE of the unit: {told}"
    return Clock(clue, able[0], None, sizes[able[0]], (first, sure), len(able) == 1)
