"""Which further run would tell a cause from a rival that the data do not exclude, and by how much.

Each candidate run is made by the rigid twin with the causes as found, seen through encoders as noisy as those of the
records, and cut into channels. There the causes' predictions stand for the data; the rival is fitted to them and to the
records that there are, with all its numbers free. The rise of chi-square is what the run is worth.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from gears3d.diagnosis.cause import Cause, fit
from gears3d.diagnosis.evidence import Evidence, evidence
from gears3d.diagnosis.named import table
from gears3d.diagnosis.prediction import CHANNELS, added, residuals
from gears3d.errors import GearsError
from gears3d.units import show

if TYPE_CHECKING:
    from gears3d.diagnosis.rivals import Rival
    from gears3d.diagnosis.search import Search
    from gears3d.scenario import Scenario

Array = np.ndarray
PAIRS = 3
"""Pairs of a cause and a rival that runs are sought for."""
LASTS = 12.0
"""Duration of a proposed run [s]."""
TWIN, PERIODS = 3.0, 8.0
"""Duration that is simulated of it: so many seconds, and so many periods of the drive, at least."""
SWINGS = ((2.0, 1.0, "amplitude twice"), (0.7, 1.0, "amplitude 0.7 times"), (1.0, 1.6, "frequency 1.6 times"))
"""Factors of the drive's amplitude and frequency that are tried."""
LONG = 5
"""Times the duration of the run that is only longer."""


@dataclass(frozen=True)
class Run:
    """One run that could be made.

    Args:
        change: against the record of middle speed, in words.
        keys: of the scenario that change, with their values.
        duration: [s].
        sigma: predicted standard deviations between cause and rival, all records together; ``None`` where the run
            cannot be predicted.
    """

    change: str
    keys: dict[str, Any]
    duration: float
    sigma: float | None = None


@dataclass(frozen=True)
class Experiment:
    """What would tell a cause from a rival.

    Args:
        cause: kind of the cause.
        rival: kinds of the rival.
        now: standard deviations between the two in the records that there are.
        runs: best first.
    """

    cause: str
    rival: str
    now: float
    runs: tuple[Run, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold."""
        runs = [
            {"change": one.change, "set": one.keys, "duration_s": one.duration, "sigma": one.sigma} for one in self.runs
        ]
        return {"cause": self.cause, "rival": self.rival, "sigma_now": self.now, "runs": runs}


def experiments(
    found: Search, others: Sequence[Sequence[Rival]], progress: Callable[[float], None] | None = None
) -> tuple[Experiment, ...]:
    """Return for each cause and each rival that is not excluded what runs would tell them apart.

    Args:
        found: by the search.
        others: rivals of each cause.
        progress: called with the part that is done.
    """
    pairs = [(k, one) for k, each in enumerate(others) for one in each if not one.excluded][:PAIRS]
    if not pairs:
        return ()
    like = sorted(found.records, key=lambda one: abs(one.motion.mean))[len(found.records) // 2]
    effects = [cause.effect for cause in found.fit.causes if cause.effect is not None]
    planned = runs(like)
    seen: list[Evidence | None] = []
    for k, run in enumerate(planned):
        seen.append(twin(like, run, effects))
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
                None if one is None else apart(found, one, run.duration, effects, causes),
            )
            for run, one in zip(planned, seen, strict=True)
        ]
        made.sort(key=lambda run: -(run.sigma or 0.0))
        kinds = " + ".join(cause.candidate.kind for cause in rival.causes)
        now = float(np.sqrt(max(rival.worse, 0.0) / _level(found)))
        told.append(Experiment(found.fit.causes[k].candidate.kind, kinds, now, tuple(made)))
        if progress is not None:
            progress(0.7 + 0.3 * (at + 1) / len(pairs))
    return tuple(told)


def runs(like: Evidence) -> list[Run]:
    """Return the runs that are tried: another speed, swing, frequency or drag, or only longer.

    Args:
        like: record that they depart from.
    """
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
        *(Run(word, keys, LASTS) for word, keys in tried),
        Run(f"same settings, duration × {LONG}", {}, LONG * LASTS),
    ]


def _wave(one: Any, by: float, faster: float) -> dict[str, str]:
    amplitude, frequency = show(by * one.amplitude, "speed", 4), show(faster * one.frequency, "frequency", 4)
    return {"amplitude": amplitude, "frequency": frequency, "phase": show(one.phase, "angle", 4)}


def twin(like: Evidence, run: Run, effects: Sequence[Any]) -> Evidence | None:
    """Return a run as evidence, by the twin with some effects; ``None`` where it cannot be made or measured.

    Args:
        like: record that it departs from.
        run: that is tried.
        effects: of the rig.
    """
    from gears3d.measured.segmentation import measure
    from gears3d.simulation import record

    lasts = max(TWIN, PERIODS * like.scenario.period)
    changes = [("run.duration", f"{lasts:.6g} s"), ("run.settle", "0 s"), *_noise(like), *run.keys.items()]
    try:
        bench = like.scenario.with_(changes)
        truth: Scenario = bench.with_([("effect[+]", table(one)) for one in effects]) if effects else bench
        made = evidence(measure(record(truth, seed=1), bench, run.change), bench, run.change, stated=like.stated)
    except GearsError:
        return None
    return made if len(made.channels.flights.time) else None


def _noise(like: Evidence) -> list[tuple[str, str]]:
    """Return the noise that the record's encoders have, as keys of a scenario."""
    seen, rate = like.channels, like.scenario.sensors.sample_rate
    found = []
    if len(seen.flights.time):
        each = np.ptp(seen.flights.time, axis=1) / (seen.flights.time.shape[1] - 1)  # of one bin
        readings = np.maximum(np.median(each) * rate, 1.0)
        found.append(("sensors.loose.noise", f"{np.median(seen.flights.sigma) * np.sqrt(readings):.6g} rad"))
    sigma = seen.drive.sigma * np.sqrt(max(seen.drive.width * rate, 1.0))
    return [*found, ("sensors.drive.noise", f"{sigma:.6g} rad")]


def apart(found: Search, run: Evidence, duration: float, effects: Sequence[Any], rival: Sequence[Cause]) -> float:
    """Return by how many standard deviations a run would tell causes from a rival, all records together.

    Args:
        found: by the search.
        run: the run, by the twin with the causes.
        duration: that it would have [s]; what was simulated counts as often as it takes.
        effects: the causes.
        rival: all causes with a rival in the place of one.
    """
    times = max(round(duration / float(np.ptp(run.channels.drive.time))), 1)
    records = [*found.records, *[run] * times]
    old = [residuals(one) for one in found.records]
    new = {name: added(run, effects, name) for name in CHANNELS}
    data = np.concatenate([part[name] for name in CHANNELS for part in (*old, *[new] * times)])
    worse = fit(records, data, rival).chi2 - found.fit.chi2
    return float(np.sqrt(max(worse, 0.0) / _level(found)))


def _level(found: Search) -> float:
    return max(found.fit.chi2 / max(len(found.fit.rest), 1), 1.0)
