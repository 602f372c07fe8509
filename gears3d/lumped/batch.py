"""Many points of a map in one call of compiled code: the rigid model over numbers that change from point to point.

A point is a run of whole periods from rest, or from where the point before it ended. It keeps its counts and a section
once a period, no tables. Points are independent, so that any division of a map among threads and machines
gives the same bits.
"""

from __future__ import annotations

from math import inf, nan
from typing import Any

import numpy as np

from gears3d.kernels import njit
from gears3d.lumped import closed_form, kernel, repeating, tally
from gears3d.lumped import layout as at
from gears3d.lumped.compile import borrowed, entry, inner

DONE, BROKEN, STANDSTILL, TOO_LONG = 0, 1, 2, 3  # how a point ended
ALL = -2  # value of ``stop`` that gives up the whole batch
# Impacts of either flank in a period, and altogether, that are kept to find whether the motion repeats.
ROOM, MOST = 64, 1 << 16
_AWAY = 1e-6  # smallest gap to either flank where a motion is continued, as a part of the backlash


@inner
def _carry(numbers, old, new):
    """Start a new run, within the gap, where an old one ended in flight."""
    shift = old[at.GAPS] - new[at.GAPS]
    room = new[at.GAPS] + new[at.GAPS + 1]
    low, high = _AWAY * room - new[at.GAPS], (1.0 - _AWAY) * room - new[at.GAPS]
    shift = min(max(shift, low), high)
    kick = old[at.RATES] - new[at.RATES]
    new[at.DISPLACEMENT] += shift
    new[at.GAPS] += shift
    new[at.GAPS + 1] -= shift
    new[at.ANGLE] += shift / numbers[at.RADIUS_LOOSE]
    new[at.RATES] += kick
    new[at.RATES + 1] -= kick
    new[at.SPEED] += kick / numbers[at.RADIUS_LOOSE]
    new[at.SIGN] = 1.0 if new[at.SPEED] >= 0.0 else -1.0
    new[at.LIFT], new[at.GUESS] = -1.0, inf


@inner
def _empty(numbers):
    for k in range(len(numbers)):
        numbers[k] = 0


@inner
def _reset(state, start, mode):
    """Set the initial state: on a flank or free, or as the run before it ended."""
    _empty(state)
    state[at.MODE], state[at.WITHIN] = at.BEFORE, -1.0
    state[at.DEPARTED] = start
    if mode != at.BEFORE:
        state[at.DEPARTED] = mode - at.STUCK if at.STUCK <= mode < at.PRESSED else 2.0


def _compiled(plain: bool, compliant: bool) -> Any:
    @entry
    def batch(
        table, start, periods, follow, total, settle, strobe, work, impacts, contacts, samples, kept, state, before,
        count, turn, cycle, marks, stop, cursor, status, found, sections,
    ):  # fmt: skip
        """Run the points of a table, and return how many were run; see :class:`Batch`."""
        table, work, impacts, contacts = borrowed(table), borrowed(work), borrowed(impacts), borrowed(contacts)
        samples, kept, state, before = borrowed(samples), borrowed(kept), borrowed(state), borrowed(before)
        carried = False
        for i in range(table.shape[0]):
            cursor[0] = i
            m, period, section, numbers = table[i], periods[i], sections[i], found[i]
            mass = m[at.INERTIA] / (m[at.RADIUS_LOOSE] * m[at.RADIUS_LOOSE])
            keep = section.shape[0]
            begin, end = settle * period, total * period
            first = total - settle - keep
            tally.clear(numbers, section)
            _empty(count)
            if not plain:
                for row in range(work.shape[0]):  # values of an earlier point would change the last digit
                    _empty(work[row])
            mode = before[at.MODE]
            _reset(state, start[i], mode if follow and carried else at.BEFORE)
            if plain:  # known when it is compiled; a kernel in the closure is never found in the cache
                closed_form.advance(m, state, count, impacts, contacts, samples, inf, 0.0)
            elif compliant:
                kernel.compliant(m, state, count, work, impacts, contacts, samples, inf, 0.0)
            else:
                kernel.dry(m, state, count, work, impacts, contacts, samples, inf, 0.0)
            if follow and carried and mode == at.FREE:
                _carry(m, before, state)
            status[i] = DONE
            _empty(turn)
            turn[repeating.LOOKING] = 1 if repeating.forgets(m) and not follow else 0
            while turn[repeating.REACHED] < total and status[i] == DONE:
                reached = turn[repeating.REACHED]
                stride, until = repeating.next_stop(turn, total - keep - reached, strobe, period)
                while status[i] == DONE:
                    if plain:
                        ended = closed_form.advance(m, state, count, impacts, contacts, samples, inf, until)
                    elif compliant:
                        ended = kernel.compliant(m, state, count, work, impacts, contacts, samples, inf, until)
                    else:
                        ended = kernel.dry(m, state, count, work, impacts, contacts, samples, inf, until)
                    hits, touched = count[at.N_IMPACTS], count[at.N_CONTACTS]
                    tally.take(impacts, hits, begin, end, period, first, numbers, section, kept, mass)
                    run_through = stride if ended == at.DONE else 0
                    repeating.note(turn, run_through, total, impacts, hits, contacts, touched, period, cycle)
                    count[at.N_IMPACTS] = count[at.N_CONTACTS] = 0
                    if ended == at.BROKEN:
                        status[i] = BROKEN
                    elif ended == at.STANDSTILL:
                        status[i] = STANDSTILL
                    elif stop[0] == i or stop[0] == ALL:
                        status[i] = TOO_LONG
                    elif ended == at.DONE:
                        break
                if status[i] == DONE and repeating.arrive(
                    turn, stride, state, reached - settle - first, section, marks
                ):
                    whole = repeating.repeat(
                        turn, cycle, marks, total, settle, period, numbers, section, kept, mass, stop, i, ALL
                    )
                    status[i] = DONE if whole else TOO_LONG
            numbers[tally.REPETITION] = tally.repetition(kept, numbers, begin, end, period)
            carried = status[i] == DONE
            for k in range(at.STATE):
                before[k] = state[k]
            if stop[0] == ALL:
                return i
            cursor[1] = i + 1
        return table.shape[0]

    return batch


_closed, _dry, _compliant = _compiled(True, False), _compiled(False, False), _compiled(False, True)


@njit(cache=True, error_model="numpy")
def count_impacts(rows, begin, end, period, first, numbers, sections, kept, mass):
    """Count impacts of one run, ``rows`` (n, 7), into ``numbers`` (NUMBERS,); see :func:`gears3d.lumped.tally.take`.

    The first impacts' speeds go into ``sections`` (k, SECTIONS); ``kept`` (2, m, 2) is scratch. Times in s, mass in kg.
    """
    tally.clear(numbers, sections)
    tally.take(rows, len(rows), begin, end, period, first, numbers, sections, kept, mass)
    numbers[tally.REPETITION] = tally.repetition(kept, numbers, begin, end, period)


def room(periods: int) -> np.ndarray:
    """Return zeroed arrays for the impacts of a point over so many counted periods, (2, m, 2).

    >>> room(2).shape
    (2, 128, 2)
    """
    return np.zeros((2, min(ROOM * max(periods, 1), MOST), 2))


class Batch:
    """The buffers of a batch, and the flag that stops it from another thread.

    Args:
        table: the packed model of every point, flat, (n, m).
        periods: of the excitation [s], (n,).
        times: whole periods of a run, those excluded at its beginning, and those at its end of which sections are kept.
        start: 0 on the active, 1 on the reverse flank, 2 free within the gap, (n,).
        follow: whether a point begins where the one before it ended.
        strobe: when in the period the sections are taken, in cycles, 0 to below 1.

    Attributes:
        stop: a point's place makes the batch give up that point, ``ALL`` everything; (1,).
        cursor: place of the point that runs, and how many are done; (2,).
        status: DONE, BROKEN, STANDSTILL or TOO_LONG, (n,).
        found: numbers of the points as :mod:`gears3d.lumped.tally` has them, (n, NUMBERS).
        sections: once a period, (n, keep, SECTIONS).
    """

    def __init__(
        self,
        table: np.ndarray,
        periods: np.ndarray,
        times: tuple[int, int, int],
        start: np.ndarray,
        follow: bool = False,
        strobe: float = 0.0,
    ) -> None:
        total, settle, keep = times
        self._arguments = (
            np.ascontiguousarray(table), start.astype(np.int64), np.ascontiguousarray(periods), follow, total, settle,
            strobe,
        )  # fmt: skip
        rows = int(table[:, at.N_TORQUES].max() + table[:, at.N_FLANKS].max()) if len(table) else 0
        self._buffers = at.buffers(rows, 1024, 1024, 0, inf)
        self._kept = room(total - settle)
        self.stop = np.full(1, -1, dtype=np.int64)
        self.cursor = np.zeros(2, dtype=np.int64)
        self.status = np.full(len(table), TOO_LONG, dtype=np.int8)
        self.found = np.full((len(table), tally.NUMBERS), nan)
        self.sections = np.full((len(table), keep, tally.SECTIONS), nan)

    def run(self) -> int:
        """Run the points one after the other, without Python's lock, and return how many were run."""
        table = self._arguments[0]
        if not len(table):
            return 0
        compiled = _compliant if kernel.integrated(table[0]) else _closed if (table[:, at.SIMPLE] > 0.0).all() else _dry
        tables = int(table[:, at.N_TABLES].max())
        room_for = (
            np.zeros(at.STATE + 2 * tables), np.zeros(at.STATE), np.zeros(at.COUNTERS, dtype=np.int64),
            np.zeros(repeating.TURN, dtype=np.int64), np.zeros((repeating.ROOM, 7)), np.zeros((tally.LONGEST, 2)),
        )  # fmt: skip
        results = (self.stop, self.cursor, self.status, self.found, self.sections)
        return compiled(*self._arguments, *self._buffers[:4], self._kept, *room_for, *results)


def pack_points(base: np.ndarray, quantities: dict[str, np.ndarray]) -> np.ndarray:
    """Return packed models (n, m) that differ from ``base`` (m,) in the numbers of the rig and of one harmonic alone.

    ``base`` has one harmonic and no effects. ``quantities`` (n,) each: ``mean`` and ``amplitude`` [rad/s],
    ``frequency`` [Hz], ``phase`` [rad], ``torque`` [N·m], ``restitution``, ``stick_velocity`` [m/s], ``backlash`` [m],
    ``inertia`` [kg·m²], ``seed``.

    >>> from gears3d.effects import Rig
    >>> from gears3d.lumped.model import model
    >>> rig = Rig(0.148, 0.148, 0.0695, 0.22, 250e-6, 0.0, 3.1, 90, 90)
    >>> plain = model(rig, [(2.0, 3.0, 0.1)]).flat()
    >>> names = ("mean", "amplitude", "frequency", "phase", "torque", "restitution", "stick_velocity", "backlash")
    >>> values = dict(zip(names, (3.1, 2.0, 3.0, 0.1, 0.22, 0.0, 1e-4, 250e-6))) | {"inertia": 0.0695, "seed": 0}
    >>> bool(np.all(pack_points(plain, {name: np.array([value]) for name, value in values.items()}) == plain))
    True
    """
    q = quantities
    table = np.repeat(base[None, :], len(q["mean"]), axis=0)
    omega = 2 * np.pi * q["frequency"]
    fastest = np.abs(q["mean"]) + np.abs(q["amplitude"])
    rate = np.maximum(omega, 1e-3)
    heaviest = np.abs(q["torque"]) * base[at.RADIUS_LOOSE] / q["inertia"]
    columns = {
        at.INERTIA: q["inertia"],
        at.BACKLASH: q["backlash"],
        at.MEAN: q["mean"],
        at.STICK_VELOCITY: q["stick_velocity"],
        at.REST: np.maximum(1e-13 * fastest, 1e-300),
        at.UNFELT: 1e-12 * (base[at.RADIUS_DRIVE] * fastest * rate + heaviest),
        at.SEED: q["seed"],
        at.SIMPLE: q["amplitude"] >= 0.0,
        at.RATE: rate,
        at.RATE + 1: rate,
        at.RATE + 2: rate,
        at.RESTITUTION: q["restitution"],
        at.BASE: q["torque"],
        at.BASE + 3: q["torque"],
        at.BASE + 6: q["torque"],
        at.HARMONICS: q["amplitude"],
        at.HARMONICS + 1: omega,
        at.HARMONICS + 2: q["phase"],
        at.HARMONICS + 3: np.cos(q["phase"]),
    }
    for column, values in columns.items():
        table[:, column] = values
    return table
