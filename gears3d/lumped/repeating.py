"""Motions that repeat because contact lasts: one cycle is representative of all that follow.

Contact erases the past of the motion: with perfect flanks, one harmonic and a constant torque it is lost at the
same phase and speed after any history. Two such moments whole periods apart begin the same motion, to rounding.

Source: Rigaud & Perret-Liaudet 2020, eqs (17)-(19), as in :mod:`gears3d.laws.orbit`.
"""

from __future__ import annotations

from gears3d.kernels import njit
from gears3d.lumped import layout as at
from gears3d.lumped import tally
from gears3d.lumped.compile import inner

SAME = 1e-9  # part of a period by which the time between two losses of contact may deviate from whole periods
LOOK = 3  # periods before the first test
AT_ONCE = 16  # periods that run without a check of the signals that stop them
ROOM = 1024  # impacts of a cycle that are kept

# how far a run has come: whole periods, whether the section within the next was taken, length of the cycle in periods,
# impacts of it so far, when it began, and whether one is searched for
REACHED, SAMPLED, LENGTH, HITS, BEGUN, LOOKING, TURN = range(7)


@inner
def forgets(m):
    """Return whether contact erases the past: neither the place on the flanks nor the number of the impact matters."""
    rigid = m[at.STIFFNESS] == 0.0 and m[at.FLOOR] == 0.0
    return m[at.SIMPLE] != 0.0 and rigid and m[at.RESTITUTION + 3] == 0.0


@njit(cache=True, error_model="numpy")
def cycle_of(contacts, count, period):
    """Return after how many periods the motion repeats, 0 while contact on the active flank has not shown it.

    The first ``count`` rows of ``contacts`` (n, 3) hold flank, start [s] and end [s] in order of time.
    """
    later = -1.0
    for k in range(count - 1, -1, -1):
        if contacts[k, 0] != 0.0:
            continue
        if later < 0.0:
            later = contacts[k, 2]
            continue
        apart = (later - contacts[k, 2]) / period
        whole = round(apart)
        return int(whole) if 1 <= whole <= tally.LONGEST and abs(apart - whole) <= SAME else 0
    return 0


@inner
def next_stop(turn, quiet, strobe, period):
    """Return how many periods are run through next, 0 up to a section, and until when [s].

    ``quiet`` periods are left before the sections, which are taken at ``strobe`` in the period, in cycles.
    """
    reached = turn[REACHED]
    if quiet > 0 and turn[LENGTH] == 0:
        stride = min(LOOK if turn[LOOKING] == 1 and reached == 0 else AT_ONCE, quiet)
        return stride, (reached + stride) * period
    if turn[SAMPLED] == 1:
        return 1, (reached + 1) * period
    return 0, (reached + strobe) * period


@inner
def note(turn, stride, total, impacts, hits, contacts, touched, period, cycle):
    """Keep the impacts of a running cycle, or test whether a cycle has begun.

    The first ``hits`` rows of ``impacts`` (n, 7) and ``touched`` rows of ``contacts`` (n, 3), flank, start [s] and end
    [s], are those since the last call, over ``stride`` of ``total`` periods; ``turn`` and ``cycle`` (``ROOM``, 7) are
    changed.
    """
    if turn[LENGTH] > 0:
        for k in range(hits):
            if turn[HITS] < ROOM:
                for i in range(impacts.shape[1]):
                    cycle[turn[HITS], i] = impacts[k, i]
            turn[HITS] += 1
    elif turn[LOOKING] == 1 and stride > 0:
        length = cycle_of(contacts, touched, period)
        if length > 0 and turn[REACHED] + stride + 2 * length <= total:
            turn[LENGTH], turn[HITS], turn[BEGUN] = length, 0, turn[REACHED] + stride


@inner
def arrive(turn, stride, state, row, section, marks):
    """Record where a run has come to after ``stride`` periods, 0 up to a section; True once a whole cycle is kept.

    ``turn`` is changed, row ``row`` of ``section`` filled unless it is below 0, and ``marks`` filled with displacement
    [m] and velocity [m/s] once a period of the cycle.
    """
    if stride == 0:
        if row >= 0:
            section[row, tally.PLACE], section[row, tally.RATE] = state[at.DISPLACEMENT], state[at.RATES]
        if turn[LENGTH] > 0:
            k = turn[REACHED] - turn[BEGUN]
            marks[k, 0], marks[k, 1] = state[at.DISPLACEMENT], state[at.RATES]
        turn[SAMPLED] = 1
        return False
    turn[REACHED] += stride
    turn[SAMPLED] = 0
    if turn[LENGTH] == 0 or turn[REACHED] - turn[BEGUN] < turn[LENGTH]:
        return False
    if turn[HITS] <= ROOM:
        return True
    turn[LENGTH] = turn[LOOKING] = 0
    return False


@inner
def repeat(turn, cycle, marks, total, settle, period, numbers, section, kept, mass, stop, point, everything):
    """Count a cycle repeatedly up to the end of the run, ``total`` periods; False when that was stopped.

    ``cycle`` (n, 7) holds its impacts, whose times are changed, ``marks`` (n, 2) displacement [m] and velocity [m/s]
    once a period. ``turn`` moves to the end, ``numbers`` are added to, ``section`` filled; ``kept`` (2, m, 2) takes
    impacts. Another thread sets ``stop`` (1,) to ``point`` to give up this point, or to ``everything``.
    """
    length, hits, done = turn[LENGTH], turn[HITS], turn[REACHED]
    first = total - settle - section.shape[0]
    begin, end = settle * period, total * period
    for reached in range(done, total, length):
        if stop[0] == point or stop[0] == everything:
            return False
        for k in range(hits):
            cycle[k, 0] += length * period
        tally.take(cycle, hits, begin, end, period, first, numbers, section, kept, mass)
        for k in range(min(length, total - reached)):
            row = reached + k - settle - first
            if row >= 0:
                section[row, tally.PLACE], section[row, tally.RATE] = marks[k, 0], marks[k, 1]
    turn[REACHED] = total
    return True
