"""Motions that repeat because contact lasts: what one cycle does stands for all that follow.

A gear that rides on its flank remembers nothing: perfect flanks, one harmonic and a constant torque let it go at the
same phase and speed whatever came before. Two such moments whole periods apart begin the same motion, to rounding.

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
# impacts of it so far, when it began, and whether one is looked for
REACHED, SAMPLED, LENGTH, HITS, BEGUN, LOOKING, TURN = range(7)


@inner
def forgets(m):
    """Return whether nothing outlasts a contact: neither the place on the flanks nor the number of the impact.

    Args:
        m: the packed model, flat.
    """
    rigid = m[at.STIFFNESS] == 0.0 and m[at.FLOOR] == 0.0
    return m[at.SIMPLE] != 0.0 and rigid and m[at.RESTITUTION + 3] == 0.0


@njit(cache=True, error_model="numpy")
def cycle_of(contacts, count, period):
    """Return after how many periods the motion repeats, 0 where contact on the active flank has not shown it yet.

    Args:
        contacts: flank, start [s], end [s], in order of time, (n, 3).
        count: how many of the rows.
        period: of the excitation [s].
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
    """Return how many periods are run through next, 0 up to a section, and until when.

    Args:
        turn: how far the run has come.
        quiet: periods that are left before the sections.
        strobe: when in the period sections are taken, in cycles.
        period: of the excitation [s].
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
    """Keep the impacts of a cycle that runs, or look whether one has shown itself.

    Args:
        turn: how far the run has come; changed.
        stride: periods that are run through.
        total: periods of the run.
        impacts: since the last call, (n, 7).
        hits: how many there are.
        contacts: flank, start [s], end [s], (n, 3).
        touched: how many there are.
        period: of the excitation [s].
        cycle: filled, (ROOM, 7).
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
    """Move on to where a run has come to; True once a whole cycle has been run and kept.

    Args:
        turn: changed.
        stride: periods that were run through, 0 up to a section.
        state: of the kernel.
        row: of the section, below 0 where it is not kept.
        section: of the point, filled.
        marks: displacement [m] and velocity [m/s] once a period of the cycle, filled.
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
    """Count what a cycle does again and again, up to the end of the run; False when that was stopped.

    Args:
        turn: how far the run has come; moved to its end.
        cycle: impacts of the cycle, their times are changed, (n, 7).
        marks: displacement [m] and velocity [m/s] once a period of the cycle, (n, 2).
        total: whole periods of the run.
        settle: those left out at its begin.
        period: of the excitation [s].
        numbers: of the point, added to.
        section: of the point, filled.
        kept: room for impacts, (2, m, 2).
        mass: of the loose gear on the line of action [kg].
        stop: set by another thread, (1,).
        point: value of ``stop`` that gives up this point.
        everything: value of ``stop`` that gives up the batch.
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
