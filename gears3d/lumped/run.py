"""One run of the compiled rigid model on bare arrays: buffers that grow, progress, the Lyapunov exponent.

The largest Lyapunov exponent comes from a copy that is disturbed again every period.

Source: Benettin et al. 1980, Meccanica 15, part 2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot, inf, log, pi

import numpy as np

from gears3d.errors import EngineError
from gears3d.lumped import layout as at
from gears3d.lumped.kernel import advance, refuse_jammed, start_state
from gears3d.lumped.model import Model

# Size of a disturbance in tolerances of the integrator, times the backlash: far above the error of its steps.
DISTURBANCE = 1e3
# A disturbance that shrinks by more than this within a period is rounding noise: contact has erased it. Such a period
# counts as this much and the copy is disturbed again, as all differences of two runs disturb them repeatedly: a motion
# that diverges for many periods and sticks once is chaotic. Only where every period erases the disturbance is the
# exponent minus infinity.
WIPED = 1e-6
COUNTED = ("BOUNCES", "CONTACTS", "GRAZING", "ZENO", "STEPS", "TOUCHES")
LONGEST_TABLE = 50_000_000


class Shadow:
    """A copy of the motion with a small disturbance, which is integrated over the same periods.

    Args:
        m: the packed model.
        period: between two renormalisations [s].
        duration: of the run [s]; its first 10 %, and at least two periods if there are more than four, are excluded.
    """

    def __init__(self, m: Model, period: float, duration: float) -> None:
        self._model, self._numbers = m, m.flat()
        self._size = DISTURBANCE * m.tolerance * m.backlash
        self._omega = 2 * pi / period
        self._from = 0.0 if duration < 4.5 * period else max(2 * period, 0.1 * duration)
        self._buffers = at.buffers(len(m.torques) + len(m.flanks), 4096, 1024, 0, inf)
        self._direction = (1.0, 0.0)
        self._growth = 0.0
        self._lasts = False
        self._time = 0.0

    def follow(self, before: np.ndarray, after: np.ndarray, total: int, end: float) -> None:
        """Advance the copy over one period that ends at ``end`` [s], between the run's states ``before`` and ``after``.

        The scatter continues after ``total`` impacts.
        """
        start = before[at.TIME]
        if start < self._from * (1 - 1e-12) or end <= start:
            return
        copy = self._disturbed(before)
        own = np.zeros(at.COUNTERS, dtype=np.int64)
        own[at.TOTAL] = total
        while advance(self._numbers, copy, own, self._buffers, end) in (at.IMPACTS_FULL, at.CONTACTS_FULL):
            own[at.N_IMPACTS] = own[at.N_CONTACTS] = 0
        apart = (copy[at.DISPLACEMENT] - after[at.DISPLACEMENT], self._speed(copy) - self._speed(after))
        distance = hypot(*apart)
        self._time += end - start
        if not distance > WIPED * self._size:
            self._growth += log(WIPED)
            self._direction = (1.0, 0.0)
            return
        self._lasts = True
        self._growth += log(distance / self._size)
        self._direction = (apart[0] / distance, apart[1] / distance)

    def exponent(self) -> float:
        """Return the exponent [1/s]; NaN when no period was followed."""
        if self._time == 0.0:
            return float("nan")
        return self._growth / self._time if self._lasts else -inf

    def _speed(self, state: np.ndarray) -> float:
        return float(state[at.SPEED]) * self._model.radius_loose / self._omega

    def _disturbed(self, state: np.ndarray) -> np.ndarray:
        copy = state.copy()
        shift, kick = (part * self._size for part in self._direction)
        mode = int(state[at.MODE])
        if at.STUCK <= mode < at.PRESSED:
            flank = mode - at.STUCK
            copy[at.MODE], copy[at.DEPARTED] = at.FREE, flank
            copy[at.SIGN] = np.sign(state[at.SPEED]) or 1.0
            kick, shift = 0.0, self._size if flank == 0 else -self._size
        elif mode == at.FREE and min(state[at.GAPS] + shift, state[at.GAPS + 1] - shift) <= 0.0:
            kick, shift = -kick, -shift
        copy[at.DISPLACEMENT] += shift
        copy[at.GAPS] += shift
        copy[at.GAPS + 1] -= shift
        copy[at.ANGLE] += shift / self._model.radius_loose
        copy[at.SPEED] += kick * self._omega / self._model.radius_loose
        copy[at.RATES] += kick * self._omega
        copy[at.RATES + 1] -= kick * self._omega
        copy[at.LIFT], copy[at.GUESS] = -1.0, inf
        return copy


@dataclass(frozen=True)
class Outcome:
    """Result of a run.

    Args:
        impacts: time [s], flank, velocity [m/s], rebound [m/s], impulse [N·s], displacement [m], flight height [m];
            (n, 7).
        contacts: flank, start [s], end [s]; (n, 3).
        samples: time [s], both angles [rad], both speeds [rad/s], displacement [m], velocity [m/s]; (n, 7).
        counters: impacts, bounces, contacts, grazing, zeno, steps, touches of the flanks under oil.
        lyapunov: largest exponent [1/s], minus infinity where contact erases the memory, NaN if not requested.
        reached: end of the run [s].
        interrupted: whether it was interrupted from the keyboard.
        works: done since the start if the model sums them [J]: of the flanks on the loose gear, of drag, of friction;
            of springs, dampers, squeeze and wedge on the gaps; of the drive's flanks on the mesh; (8,).
        jerk: mean square of the rate of the mesh force after settling [N²/s²], NaN where the model does not settle.
        forces: of active and reverse flank at the samples, zeros on rigid flanks without oil [N]; (n, 2).
        state: at the end.
    """

    impacts: np.ndarray
    contacts: np.ndarray
    samples: np.ndarray
    counters: dict[str, int]
    lyapunov: float
    reached: float
    interrupted: bool
    works: np.ndarray
    jerk: float
    forces: np.ndarray
    state: np.ndarray


def run(
    m: Model,
    duration: float,
    spacing: float = inf,
    start: str = "active",
    progress: Callable[[float], None] | None = None,
    lyapunov: bool = False,
    chunk: float | None = None,
    put: Callable[[np.ndarray], None] | None = None,
) -> Outcome:
    """Simulate the rigid model from rest on a flank or free in the middle of the backlash, for ``duration`` [s].

    Samples are ``spacing`` [s] apart, none if it is infinite; ``start`` is ``"active"``, ``"reverse"`` or ``"free"``.
    ``progress`` is called with the time reached [s]; ``lyapunov`` follows a disturbed copy, too. ``chunk`` [s] is the
    time between two calls of ``progress`` and two renewed disturbances, the slowest harmonic's period unless given.
    ``put`` changes the state at time 0, as :func:`gears3d.lumped.pickup.pick_up` does. A motion that makes no progress
    in time, is not finite, or has more impacts than fit into memory is an EngineError.

    >>> from gears3d.effects import Rig
    >>> from gears3d.lumped.model import model
    >>> rig = Rig(0.148, 0.148, 0.0695, 0.22, 250e-6, 0.0, 30 * pi / 30, 90, 90)
    >>> outcome = run(model(rig, [(20 * pi / 30, 3.0, 0.0)]), duration=1 / 3)
    >>> outcome.impacts[:, 2].round(6).tolist()
    [0.030858, -0.031242]
    """
    samples = int(np.floor(duration / spacing * (1 + 1e-12))) + 1 if spacing < inf else 0
    out = at.buffers(len(m.torques) + len(m.flanks), 4096, 1024, samples, spacing)
    state, count = start_state(start, len(m.tables)), np.zeros(at.COUNTERS, dtype=np.int64)
    numbers = m.flat()
    advance(numbers, state, count, out, 0.0)
    refuse_jammed(m, state)
    if put is not None:
        put(state)
    period = chunk or (2 * pi / m.harmonics[:, 1].min() if len(m.harmonics) else 1.0)
    shadow = Shadow(m, period, duration) if lyapunov else None
    impacts: list[np.ndarray] = []
    contacts: list[np.ndarray] = []
    interrupted = False
    try:
        for turn in range(1, int(np.ceil(duration / period)) + 1):
            end = min(turn * period, duration)
            before, total = state.copy(), int(count[at.TOTAL])
            stretch(numbers, state, count, out, end, impacts, contacts)
            if shadow is not None:
                shadow.follow(before, state, total, end)
            if progress is not None:
                progress(end)
    except KeyboardInterrupt:
        interrupted = True
    _empty(count, out, impacts, contacts)
    return Outcome(
        np.concatenate(impacts),
        _with_open_contact(np.concatenate(contacts), state),
        out.samples[: count[at.N_SAMPLES], : at.FORCES],
        {name.lower(): int(count[getattr(at, name)]) for name in COUNTED} | {"impacts": int(count[at.TOTAL])},
        shadow.exponent() if shadow is not None else np.nan,
        float(state[at.TIME]),
        interrupted,
        state[at.WORKS : at.WORKS + at.N_WORKS].copy(),
        float(state[at.JERK] / state[at.RISING]) if state[at.RISING] > 0.0 else np.nan,
        out.samples[: count[at.N_SAMPLES], at.FORCES :],
        state,
    )


def stretch(
    numbers: np.ndarray,
    state: np.ndarray,
    count: np.ndarray,
    out: at.Buffers,
    end: float,
    impacts: list[np.ndarray],
    contacts: list[np.ndarray],
) -> None:
    """Advance to ``end`` [s], emptying full tables into the lists ``impacts`` and ``contacts``.

    A motion that makes no progress in time, is not finite, or has more impacts than fit into memory is an EngineError.
    """
    while True:
        status = advance(numbers, state, count, out, end)
        where = f"the rigid model stopped at {state[at.TIME]:.9g} s after {count[at.TOTAL]} impacts: "
        if status == at.DONE:
            return
        if status == at.BROKEN:
            raise EngineError(where + "the motion is no longer finite; check the effects' sizes")
        if status == at.STANDSTILL:
            raise EngineError(where + "time stands still; give a larger impact.stick_velocity")
        if count[at.TOTAL] > LONGEST_TABLE:
            raise EngineError(where + "too many to keep; give a larger impact.stick_velocity or a shorter run")
        _empty(count, out, impacts, contacts)


def _empty(count: np.ndarray, out: at.Buffers, impacts: list[np.ndarray], contacts: list[np.ndarray]) -> None:
    impacts.append(out.impacts[: count[at.N_IMPACTS]].copy())
    contacts.append(out.contacts[: count[at.N_CONTACTS]].copy())
    count[at.N_IMPACTS] = count[at.N_CONTACTS] = 0


def _with_open_contact(contacts: np.ndarray, state: np.ndarray) -> np.ndarray:
    if state[at.WITHIN] >= 0.0:
        open_one = [[state[at.WITHIN], state[at.ENTRY], state[at.TIME]]]
        return np.vstack([contacts, open_one]) if state[at.PASSED] == 1.0 else contacts
    mode = state[at.MODE]
    stuck = at.STUCK <= mode < at.PRESSED
    if not stuck and not (mode >= at.PRESSED and state[at.PASSED] == 1.0):
        return contacts
    flank = mode - (at.STUCK if stuck else at.PRESSED)
    return np.vstack([contacts, [flank, state[at.CONTACT_SINCE], state[at.TIME]]])
