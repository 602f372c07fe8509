"""One run of the lubricated model: start, stretches, a disturbed copy, the recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import log, pi

import numpy as np

from gears3d.errors import EngineError
from gears3d.lumped.lubricated import layout as at
from gears3d.lumped.lubricated.forces import act
from gears3d.lumped.lubricated.model import Model
from gears3d.lumped.lubricated.steps import advance, set_flags, whole

DISTURBANCE = 1e-8
"""Of the place of the disturbed copy [m], far above what the steps are off by."""


@dataclass(frozen=True)
class Outcome:
    """What a run gave.

    Args:
        samples: time [s], displacement [m], its rate [m/s], forces of active and reverse flank [N]; (n, 5).
        impacts: time [s], flank, speed in and out [m/s], impulse [N·s], displacement [m], height before [m]; (n, 7).
        contacts: flank, begin [s], end [s]; (n, 3).
        books: works done since the start [J]: of the mesh on the loose gear, of drag, of friction; of spring, damping,
            squeeze and wedge on the gap; of the drive's flanks on the mesh; (8,).
        jerk: mean square of the rate of the mesh force after settling [N²/s²].
        counters: steps, rejected, events, touches, impacts.
        exponent: largest Lyapunov exponent [1/s], NaN when not asked for.
        state: at the end.
        reached: [s].
        interrupted: whether it was broken off by the keyboard.
    """

    samples: np.ndarray
    impacts: np.ndarray
    contacts: np.ndarray
    books: np.ndarray
    jerk: float
    counters: dict[str, int]
    exponent: float
    state: np.ndarray
    reached: float
    interrupted: bool


@whole
def _acceleration(p, sines, waves, powers, table, t, s, v):
    """Return the acceleration at a state, flags as the state has them."""
    flags = np.zeros(at.FLAGS, dtype=np.int64)
    set_flags(p, sines, waves, flags, t, s, v)
    return act(p, sines, waves, powers, table, flags, t, s, v, np.zeros(at.PARTS))


def begin(m: Model, start: str) -> np.ndarray:
    """Return the state at time 0: at rest where oil and teeth bear the load, or free amid the backlash.

    Args:
        m: the packed model.
        start: ``"active"``, ``"reverse"`` or ``"free"``.
    """
    state = np.zeros(at.STATE)
    backlash = m.numbers[at.BACKLASH]
    state[at.PLACE], state[at.LEFT] = 0.5 * backlash, -1.0
    if start != "free":
        ends = (-0.5 * backlash, 0.5 * backlash) if start == "active" else (0.5 * backlash, 1.5 * backlash)
        low, high = ends
        if _acceleration(*m.arguments(), 0.0, low, 0.0) > 0.0 > _acceleration(*m.arguments(), 0.0, high, 0.0):
            for _ in range(80):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if _acceleration(*m.arguments(), 0.0, middle, 0.0) > 0.0 else (low, middle)
            state[at.PLACE] = 0.5 * (low + high)
        else:
            state[at.PLACE] = m.numbers[at.FLOOR] if start == "active" else backlash - m.numbers[at.FLOOR]
        state[at.STAYS] = state[at.TURNED] = 1.0
    return state


def run(
    m: Model,
    duration: float,
    start: str = "active",
    spacing: float = 0.0,
    settle: float = 0.0,
    tolerance: float = 1e-7,
    books: bool = True,
    lyapunov: bool = False,
    progress: Callable[[float], None] | None = None,
    state: np.ndarray | None = None,
) -> Outcome:
    """Simulate the lubricated model.

    Args:
        m: the packed model.
        duration: [s].
        start: ``"active"``, ``"reverse"`` or ``"free"``.
        spacing: time between samples [s]; 0 for none.
        settle: time after which the jerk counts [s].
        tolerance: relative, of a step.
        books: whether works and jerk are summed up.
        lyapunov: whether a disturbed copy is followed, too.
        progress: called with the time reached [s].
        state: to go on from, in place of ``start``.

    Returns:
        Samples, impacts, contacts, works, jerk and counters.

    Raises:
        EngineError: the motion is not finite or stands still.
    """
    state = begin(m, start) if state is None else state.copy()
    flags, count = np.zeros(at.FLAGS, dtype=np.int64), np.zeros(at.COUNTERS, dtype=np.int64)
    samples = np.zeros((int(np.floor(duration / spacing * (1 + 1e-12))) + 1 if spacing > 0.0 else 0, 5))
    control = np.array([tolerance, m.longest, spacing, float(books)])
    impacts, contacts = [], []
    grown, renewed, interrupted = 0.0, 0, False
    marks = np.append(np.arange(m.period, duration, m.period), duration)
    marks = np.unique(np.append(marks, settle)[np.append(marks, settle) > 0.0])
    twin = None
    try:
        for mark in marks[marks <= duration]:
            if lyapunov and state[at.TIME] >= settle:
                twin = (state.copy(), flags.copy())
                twin[0][at.PLACE] += DISTURBANCE
                _set(m.numbers, m.sines, m.waves, twin[1], *twin[0][: at.CHANGE])
            _stretch(m, state, flags, count, mark, control, samples, impacts, contacts)
            if twin is not None and lyapunov:
                grown += _apart(m, state, *twin, mark, control)
                renewed += 1
            if mark == settle:
                state[at.JERK] = state[at.RISING] = 0.0
            if progress is not None:
                progress(float(mark))
    except KeyboardInterrupt:
        interrupted = True
    span = renewed * m.period
    names = ("STEPS", "REJECTED", "EVENTS", "TOUCHES")
    hits = np.concatenate(impacts) if impacts else np.zeros((0, 7))
    if state[at.STAYS] == 1.0 and (near := _near(m, state)) >= 0:
        contacts.append(np.array([[near, state[at.ENTRY], state[at.TIME]]]))
    return Outcome(
        samples[: count[at.SAMPLES]],
        hits,
        np.concatenate(contacts) if contacts else np.zeros((0, 3)),
        state[at.BOOKS : at.BOOKS + 8].copy(),
        float(state[at.JERK] / state[at.RISING]) if state[at.RISING] > 0.0 else np.nan,
        {name.lower(): int(count[getattr(at, name)]) for name in names} | {"impacts": len(hits)},
        grown / span if span > 0.0 else np.nan,
        state,
        float(state[at.TIME]),
        interrupted,
    )


@whole
def _set(p, sines, waves, flags, t, s, v):
    set_flags(p, sines, waves, flags, t, s, v)


def _near(m: Model, state: np.ndarray) -> int:
    """The flank that the gear is within the felt height of, -1 for none."""
    flags = np.zeros(at.FLAGS, dtype=np.int64)
    _set(m.numbers, m.sines, m.waves, flags, state[at.TIME], state[at.PLACE], state[at.RATE])
    return 0 if flags[at.NEAR] else 1 if flags[at.NEAR + 1] else -1


def _apart(
    m: Model, state: np.ndarray, other: np.ndarray, flags: np.ndarray, mark: float, control: np.ndarray
) -> float:
    """Follow the disturbed copy over a stretch and return the logarithm of how far it has parted."""
    quiet = np.array([control[0], control[1], 0.0, 0.0])
    count = np.zeros(at.COUNTERS, dtype=np.int64)
    _stretch(m, other, flags, count, mark, quiet, np.zeros((0, 5)), [], [])
    speed = 2.0 * pi / m.period
    distance = np.hypot(other[at.PLACE] - state[at.PLACE], (other[at.RATE] - state[at.RATE]) / speed)
    return log(max(float(distance), 1e-4 * DISTURBANCE) / DISTURBANCE)


def _stretch(m, state, flags, count, mark, control, samples, impacts, contacts) -> None:
    """Advance to a time, emptying full tables into the lists."""
    while True:
        hits, stays = np.zeros((1024, 7)), np.zeros((256, 3))
        count[at.IMPACTS] = count[at.CONTACTS] = 0
        status = advance(*m.arguments(), state, flags, count, mark, control, samples, hits, stays)
        if count[at.IMPACTS]:
            impacts.append(hits[: count[at.IMPACTS]].copy())
        if count[at.CONTACTS]:
            contacts.append(stays[: count[at.CONTACTS]].copy())
        if status == at.DONE:
            return
        where = f"the lubricated model stopped at {state[at.TIME]:.9g} s: "
        if status == at.BROKEN:
            raise EngineError(where + "the motion is no longer finite; check the effects' sizes")
        if status == at.STANDSTILL:
            raise EngineError(where + "time stands still; give a larger minimum_thickness")
