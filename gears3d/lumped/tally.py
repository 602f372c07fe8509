"""Counting impacts during a run: speeds, impulses and energies of a point of a map, and whether its motion repeats.

The impacts that count, the regime and the repetition are those of :mod:`gears3d.signals`, compiled, so that a map of a
million points keeps numbers and no tables.
"""

from __future__ import annotations

from math import floor, nan, sqrt

from gears3d.lumped.compile import inner
from gears3d.signals.impacts import FLIGHT_HEIGHT_MIN
from gears3d.signals.motion import EASY, FAR, RECURRING, STRICT, TIME_TOLERANCE, VELOCITY_TOLERANCE

# numbers of a point; those of the active flank, one more is the reverse flank
COUNT, MEAN, SPREAD, LARGEST, IMPULSE, CYCLES, LAST = 0, 2, 4, 6, 8, 10, 12
ENERGY, OPENING, REPETITION, JERK = 14, 15, 16, 17
NUMBERS = 18

# a section once a period: displacement, velocity, and the speed of the first impact of either flank in the period
PLACE, RATE, FIRST = 0, 1, 2
SECTIONS = 4

LONGEST = 8  # largest number of periods after which a motion is reported to repeat
UNKNOWN = -1  # repetition of a motion that does not repeat


@inner
def clear(numbers, sections):
    """Clear the numbers (NUMBERS,) and sections (k, SECTIONS) of a point."""
    for i in range(NUMBERS):
        numbers[i] = 0.0
    numbers[LAST] = numbers[LAST + 1] = -1.0
    numbers[JERK] = nan
    for i in range(sections.shape[0]):
        for j in range(SECTIONS):
            sections[i, j] = nan


@inner
def take(rows, count, begin, end, period, first, numbers, sections, kept, mass):
    """Add the impacts from ``begin`` to ``end`` [s] to the numbers of a point.

    The first ``count`` of ``rows`` (n, 7) hold time [s], flank, velocity and rebound [m/s], impulse [N·s], displacement
    and flight height [m]. The speed of the first impact of each period [s] goes into ``sections``, the first of which
    is that of period ``first`` after ``begin``. ``kept`` (2, m, 2) takes time [s] and velocity [m/s] of the impacts of
    both flanks. ``mass`` [kg] is that of the loose gear on the line of action. Impacts after low flights count for the
    energy only.
    """
    for i in range(count):
        time, velocity, rebound, height = rows[i, 0], rows[i, 2], rows[i, 3], rows[i, 6]
        if time < begin or time > end:
            continue
        numbers[ENERGY] += 0.5 * mass * (velocity * velocity - rebound * rebound)
        if height <= FLIGHT_HEIGHT_MIN:
            continue
        flank = int(rows[i, 1])
        place = int(numbers[COUNT + flank])
        if place < kept.shape[1]:
            kept[flank, place, 0], kept[flank, place, 1] = time, velocity
        numbers[COUNT + flank] += 1.0
        away = velocity - numbers[MEAN + flank]
        numbers[MEAN + flank] += away / numbers[COUNT + flank]
        numbers[SPREAD + flank] += away * (velocity - numbers[MEAN + flank])
        numbers[LARGEST + flank] = max(numbers[LARGEST + flank], abs(velocity))
        numbers[IMPULSE + flank] += rows[i, 4]
        numbers[OPENING] = max(numbers[OPENING], height)
        cycle = floor((time - begin) / period)
        if cycle > numbers[LAST + flank]:
            numbers[CYCLES + flank] += 1.0
            numbers[LAST + flank] = cycle
            row = int(cycle) - first
            if 0 <= row < sections.shape[0]:
                sections[row, FIRST + flank] = velocity


@inner
def repetition(kept, numbers, begin, end, period):
    """Return the smallest number of periods after which the impacts from ``begin`` to ``end`` [s] repeat.

    ``kept`` (2, m, 2) holds time [s] and velocity [m/s] of the impacts of both flanks. 0 without impacts; -1 if they do
    not repeat, or are more than were kept.
    """
    total = numbers[COUNT] + numbers[COUNT + 1]
    if total == 0.0:
        return 0
    room = kept.shape[1]
    if numbers[COUNT] > room or numbers[COUNT + 1] > room:
        return UNKNOWN
    squares = 0.0
    for flank in range(2):
        for i in range(int(numbers[COUNT + flank])):
            squares += kept[flank, i, 1] ** 2
    slack = VELOCITY_TOLERANCE * sqrt(squares / total)
    periods = (end - begin) / period + 1e-9
    for n in range(1, min(LONGEST, int(periods / 3.0)) + 1):
        close = 1.0 if n <= EASY else STRICT
        margin = close * TIME_TOLERANCE * period
        good = _recurs(kept, numbers, n * period, begin, end, margin, close * slack)
        for part in FAR:
            if good:
                far = n * max(int(part * periods / n), 1) * period
                good = _recurs(kept, numbers, far, begin, end, margin, close * slack)
        if good:
            return n
    return UNKNOWN


@inner
def _recurs(kept, numbers, shift, begin, end, margin, slack):
    """Whether nearly every impact has an equal one ``shift`` later and earlier, as far as the span goes."""
    asked = found = 0
    for flank in range(2):
        count = int(numbers[COUNT + flank])
        for sense in (1.0, -1.0):
            place = 0
            for i in range(count):
                time, velocity = kept[flank, i, 0], kept[flank, i, 1]
                if sense > 0.0 and not time <= end - shift - margin:
                    continue
                if sense < 0.0 and not time >= begin + shift + margin:
                    continue
                wanted = time + sense * shift
                while place < count - 1 and kept[flank, place, 0] < wanted:
                    place += 1
                asked += 1
                near = False
                for other in (place, max(place - 1, 0)):
                    if abs(kept[flank, other, 0] - wanted) <= margin and abs(kept[flank, other, 1] - velocity) <= slack:
                        near = True
                found += near
    return asked > 0 and found >= RECURRING * asked
