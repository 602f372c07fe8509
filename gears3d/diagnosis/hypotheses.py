"""Competing hypotheses: causes that the data do not exclude, and further runs that separate them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import EXCLUDED, FREE, Candidate, Cause, Fit, begin, excluding, fit, score, table
from gears3d.diagnosis.evidence import Evidence, evidence
from gears3d.diagnosis.posterior import occam
from gears3d.diagnosis.prediction import CHANNELS, added, residuals
from gears3d.diagnosis.search import Search, directions
from gears3d.errors import GearsError
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.scenario import Scenario

Array = np.ndarray
# Number of hypotheses of other kinds that are fitted for each cause.
FITTED_RIVALS = 6
# Maximum number of pairs of a cause and a competing hypothesis for which runs are proposed.
PAIRS = 3
# Duration of a proposed run [s].
RUN_DURATION = 12.0
# Minimum simulated duration of it, in seconds and in periods of the drive.
SIMULATED, SIMULATED_PERIODS = 3.0, 8.0
# Duration ratio of the run that is only longer.
LONGER = 5


class Rival(NamedTuple):
    """One or two causes that replace another.

    Args:
        causes: of the hypothesis.
        worse: rise of chi-square against the cause.
        excluded: whether the data exclude it.
        deviance: twice the fall of the logarithm of the evidence: the rise over what a model may err by, with the price
            of additional parameters.
    """

    causes: tuple[Cause, ...]
    worse: float
    excluded: bool
    deviance: float

    @property
    def kinds(self) -> tuple[str, ...]:
        """Return the kinds of its causes."""
        return tuple(cause.candidate.kind for cause in self.causes)


def rivals(records: Sequence[Evidence], found: Search) -> list[list[Rival]]:
    """Return for each cause the hypotheses that could replace it, best first."""
    now, told, level = found.fit, [], _chi2_level(found)
    for k, cause in enumerate(now.causes):
        others = now.causes[:k] + now.causes[k + 1 :]
        less = fit(records, found.base, others)
        tried, own = _hypotheses(records, found, less, cause), []
        least = excluding((less.chi2 - now.chi2) / level)
        scale = level * least / EXCLUDED
        for causes, one in tried:
            worse = one.chi2 - now.chi2
            deviance = worse / scale + _price(one, scale) - _price(now, scale)
            own.append(Rival(causes, worse, worse > level * least, deviance))
        told.append(sorted(own, key=lambda one: one.worse))
    return told


def _price(one: Fit, scale: float) -> float:
    """Return the chi-square that the parameters of a fit cost, its covariance times a scale."""
    return occam(scale * one.covariance, np.concatenate([cause.units for cause in one.causes])) if one.causes else 0.0


def _hypotheses(
    records: Sequence[Evidence], found: Search, less: Fit, cause: Cause
) -> list[tuple[tuple[Cause, ...], Fit]]:
    tried, seen = [], set()
    count = len(less.causes)
    for one in score(found.known, less.rest, directions(records, less)):
        key = (one.candidate.kind, one.candidate.shape.get("gear"))
        if key in seen or (is_same(one.candidate, cause)):
            continue
        if len(tried) >= FITTED_RIVALS or one.gain < 0.2 * (less.chi2 - found.fit.chi2):
            break
        seen.add(key)
        rounds = 8 if one.candidate.kind in FREE else 3
        made = fit(records, found.base, [*less.causes, begin(one.candidate, one.units)], rounds)
        tried.append((made.causes[count:], made))
    if cause.candidate.kind == "drag_differential":
        plain = {one.kind: one for one in found.known.candidates if one.kind in ("drag_coulomb", "drag_viscous")}
        both = [begin(one, np.array([1e-3])) for one in plain.values()]
        made = fit(records, found.base, [*less.causes, *both], 3)
        tried.append((made.causes[count:], made))
    return tried


def is_same(candidate: Candidate, cause: Cause) -> bool:
    """Whether a candidate is the cause itself, except for refined parameters."""
    own = cause.candidate
    bends = FREE.get(own.kind, {})
    shapes = [{name: value for name, value in one.shape.items() if name not in bends} for one in (candidate, own)]
    return candidate.kind == own.kind and shapes[0] == shapes[1]


# The rigid twin simulates each proposed run with the found causes, encoders with the noise of the records read it, and
# it is segmented into channels. The causes' predictions replace its data; the competing hypothesis is fitted to them
# and to the existing records, with all its numbers free. The value of the run is the rise of chi-square.


@dataclass(frozen=True)
class Run:
    """One possible run.

    Args:
        change: difference from the record of middle speed, in words.
        keys: of the scenario that change, with their values.
        duration: [s].
        sigma: predicted standard deviations between the cause and the other hypothesis, over all records; ``None`` for
            a run that cannot be predicted.
    """

    change: str
    keys: dict[str, Any]
    duration: float
    sigma: float | None = None


@dataclass(frozen=True)
class Experiment:
    """Runs that separate a cause from a competing hypothesis.

    Args:
        cause: kind of the cause.
        rival: kinds of the competing hypothesis.
        now: standard deviations between the two in the existing records.
        runs: best first.
    """

    cause: str
    rival: str
    now: float
    runs: tuple[Run, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-compatible dictionary."""
        runs = [
            {"change": one.change, "set": one.keys, "duration_s": one.duration, "sigma": one.sigma} for one in self.runs
        ]
        return {"cause": self.cause, "rival": self.rival, "sigma_now": self.now, "runs": runs}


def experiments(
    found: Search, others: Sequence[Sequence[Rival]], progress: Callable[[float], None] | None = None
) -> tuple[Experiment, ...]:
    """Return, for each pair of a cause and a hypothesis that is not excluded, the runs that separate them."""
    pairs = [(k, one) for k, each in enumerate(others) for one in each if not one.excluded][:PAIRS]
    if not pairs:
        return ()
    like = sorted(found.records, key=lambda one: abs(one.motion.mean))[len(found.records) // 2]
    effects = [cause.effect for cause in found.fit.causes if cause.effect is not None]
    planned = runs(like)
    seen: list[Evidence | None] = []
    for k, run in enumerate(planned):
        seen.append(simulated_run(like, run, effects))
        if progress is not None:
            progress(0.7 * (k + 1) / len(planned))
    told = []
    for at, (k, rival) in enumerate(pairs):
        causes = (*found.fit.causes[:k], *rival.causes, *found.fit.causes[k + 1 :])
        made = [
            Run(
                run.change,
                run.keys,
                run.duration,
                None if one is None else separation(found, one, run.duration, effects, causes),
            )
            for run, one in zip(planned, seen, strict=True)
        ]
        made.sort(key=lambda run: -(run.sigma or 0.0))
        kinds = " + ".join(rival.kinds)
        now = float(np.sqrt(max(rival.worse, 0.0) / _chi2_level(found)))
        told.append(Experiment(found.fit.causes[k].candidate.kind, kinds, now, tuple(made)))
        if progress is not None:
            progress(0.7 + 0.3 * (at + 1) / len(pairs))
    return tuple(told)


def runs(like: Evidence) -> list[Run]:
    """Return the tried runs: another speed, fluctuation amplitude, frequency or drag, or only a longer one."""
    mean, drag, waves = like.motion.mean, like.scenario.drag.torque, like.scenario.motion.harmonics
    tried: list[tuple[str, dict[str, Any]]] = [
        (f"mean speed {word}", {"motion.mean": show(by * mean, "speed", 4)})
        for by, word in ((1.0 / 3.0, "× 1/3"), (3.0, "× 3"))
        if mean
    ]
    for by, faster, word in (
        (2.0, 1.0, "amplitude × 2"),
        (0.7, 1.0, "amplitude × 0.7"),
        (1.0, 1.6, "frequency × 1.6"),
    ):
        if waves:
            tried.append((word, {"motion.harmonics": [_wave(one, by, faster) for one in waves]}))
    if drag:
        tried.append(("drag × 2 by a known brake", {"drag.torque": show(2.0 * drag, "torque", 4)}))
    return [
        *(Run(word, keys, RUN_DURATION) for word, keys in tried),
        Run(f"same settings, duration × {LONGER}", {}, LONGER * RUN_DURATION),
    ]


def _wave(one: Any, by: float, faster: float) -> dict[str, str]:
    amplitude, frequency = show(by * one.amplitude, "speed", 4), show(faster * one.frequency, "frequency", 4)
    return {"amplitude": amplitude, "frequency": frequency, "phase": show(one.phase, "angle", 4)}


def simulated_run(like: Evidence, run: Run, effects: Sequence[Any]) -> Evidence | None:
    """Return a run as evidence from the twin with effects; ``None`` if it cannot be simulated or measured."""
    from gears3d.measured.segmentation import measure
    from gears3d.simulation import record

    lasts = max(SIMULATED, SIMULATED_PERIODS * like.scenario.period)
    changes = [("run.duration", f"{lasts:.6g} s"), ("run.settle", "0 s"), *_noise(like), *run.keys.items()]
    try:
        bench = like.scenario.with_(changes)
        truth: Scenario = bench.with_([("effect[+]", table(one)) for one in effects]) if effects else bench
        made = evidence(measure(record(truth, seed=1), bench, run.change), bench, run.change, stated=like.stated)
    except GearsError:
        return None
    return made if len(made.channels.flights.time) else None


def _noise(like: Evidence) -> list[tuple[str, str]]:
    """Return the noise of the record's encoders as keys of a scenario."""
    seen, rate = like.channels, like.scenario.sensors.sample_rate
    found = []
    if len(seen.flights.time):
        each = np.ptp(seen.flights.time, axis=1) / (seen.flights.time.shape[1] - 1)  # of one bin
        readings = np.maximum(np.median(each) * rate, 1.0)
        found.append(("sensors.loose.noise", f"{np.median(seen.flights.sigma) * np.sqrt(readings):.6g} rad"))
    sigma = seen.drive.sigma * np.sqrt(max(seen.drive.width * rate, 1.0))
    return [*found, ("sensors.drive.noise", f"{sigma:.6g} rad")]


def separation(found: Search, run: Evidence, duration: float, effects: Sequence[Any], rival: Sequence[Cause]) -> float:
    """Return the standard deviations between causes and another hypothesis with a further run, over all records.

    The run is evidence from the twin with the causes; what was simulated is repeated to the duration [s].
    """
    times = max(round(duration / float(np.ptp(run.channels.drive.time))), 1)
    records = [*found.records, *[run] * times]
    old = [residuals(one) for one in found.records]
    new = {name: added(run, effects, name) for name in CHANNELS}
    data = np.concatenate([part[name] for name in CHANNELS for part in (*old, *[new] * times)])
    worse = fit(records, data, rival).chi2 - found.fit.chi2
    return float(np.sqrt(max(worse, 0.0) / _chi2_level(found)))


def _chi2_level(found: Search) -> float:
    return max(found.fit.chi2 / max(len(found.fit.rest), 1), 1.0)
