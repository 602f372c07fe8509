"""Runs to measure: the precision of chosen causes, or the separation of sets of them, in possible records.

The rigid model simulates each run of a grid, and the encoders as they are, or could be, read it. Along its path, and in
its events, the Fisher information on the causes is computed like the precision in a diagnosis: starts of windows,
datums of records and of encoders without index marks are free. Information of runs is additive, so that sets of them
are chosen without another simulation. Source: Fedorov 1972, Theory of Optimal Experiments.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import EXCLUDED, SMALLEST, parameters, table
from gears3d.diagnosis.path_fit import SOFT
from gears3d.diagnosis.residual_patterns import sensor_of
from gears3d.diagnosis.run_information import (
    Encoder,
    Information,
    Look,
    Setting,
    Wanted,
    combined,
    keys_of,
    look_at,
    name_of,
    simulated,
)
from gears3d.diagnosis.shooting import MOST
from gears3d.errors import Fault, GearsError, InputError, UsageError
from gears3d.measured.checks import admit
from gears3d.results import Result
from gears3d.scenario import load
from gears3d.units import parse, show

if TYPE_CHECKING:
    from gears3d.identify import Parameter
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

Array = np.ndarray
# Standard deviations that a cause of the chosen size must have.
SIGMAS = 5.0
# Default mean speeds and fluctuations, relative to those of the rig.
SLOWER, SWINGS = (1.0 / 3.0, 1.0, 3.0), (0.7, 1.0, 2.0)
# Default durations [s].
LENGTHS = (5.0, 20.0, 60.0)
# Simulated part of a longer run: minimum seconds, periods of the fluctuation and revolutions of the slower gear, and
# maximum samples; beyond it information grows in proportion to the duration.
LEAST, PERIODS, TURNS, SAMPLES = 4.0, 16, 3, 400_000
# Largest ratio of fluctuations to the mean speed if those of the rig stay below it: the drive does not reverse.
BACK = 0.9
# Sizes of causes before a measurement, in units: the prior for the comparison of runs in which some numbers are not
# identifiable. Intervals do not use it.
WIDE = 3.0
# Standard deviations of a one-sided probability of 95 %.
SURE = 1.645
# Number of simulations of each chosen run, and fraction of a period by which their starts differ: the start of the
# windows of a periodic motion alone may change an interval by a factor of four, so that the median is reported.
TIMES, GOLDEN = 3, 0.618034
# Fraction of the requested values that runs must reach when they are chosen: information of a short record scatters.
MARGIN = 0.8
# Largest ratio of the criterion after and before a further run for which the run is added.
GROWS = 0.99
# Fraction of the information of a number, others known, below which it is not identifiable.
NOTHING = 1e-9
# Information of runs, and the multiplicity of each.
Parts = Sequence[tuple[Information, float]]


@dataclass(frozen=True)
class Run:
    """One possible run.

    Args:
        name: mean speed and fluctuation in words.
        keys: of the scenario that change, with their values.
        mean: speed of the drive [rad/s].
        amplitude: of its strongest harmonic [rad/s].
        frequency: of that [Hz].
        duration: [s].
        alone: 95 % intervals of each cause's parameters from this run, by kind and parameter.
        together: the same from this run and those before it; empty for runs that are not proposed.
        apart: standard deviations between the sets to be separated, of this run alone, by pair.
        reaches: values of all aims from this run and those before it, by name.
    """

    name: str
    keys: dict[str, Any]
    mean: float
    amplitude: float
    frequency: float
    duration: float
    alone: dict[str, dict[str, Parameter]]
    together: dict[str, dict[str, Parameter]] = field(default_factory=dict)
    apart: dict[str, float] = field(default_factory=dict)
    reaches: dict[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-compatible dictionary."""
        return {
            "name": self.name, "set": self.keys, "mean_rad_s": self.mean, "amplitude_rad_s": self.amplitude,
            "frequency_Hz": self.frequency, "duration_s": self.duration, "alone": _plain(self.alone),
            "together": _plain(self.together), "sigma_apart": self.apart, "reaches": _finite(self.reaches),
        }  # fmt: skip


@dataclass(frozen=True)
class Aim:
    """Result of a set of runs for one cause, or one pair of sets.

    Args:
        name: kind of the cause, or the pair, with a mark of the true one.
        reached: whether it meets the request.
        value: size detected at 5 standard deviations, in units; of a pair standard deviations between the two.
        asked: largest requested value; of a pair the smallest.
        possible: whether any run of the grid has information on it.
    """

    name: str
    reached: bool
    value: float
    asked: float
    possible: bool

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-compatible dictionary."""
        value = _finite({"": self.value})[""]
        return {"name": self.name, "reached": self.reached, "value": value, "asked": self.asked,
                "possible": self.possible}  # fmt: skip


@dataclass(frozen=True)
class Option:
    """Proposed runs for one kind of encoders.

    Args:
        encoder: both.
        runs: in the order of their value.
        aims: of all runs together.
        grid: all tried runs, each with the longest duration.
        excluded: runs that cannot be simulated or measured, with the reason.
        keys: of the scenario that describe the encoders.
        ended: reason for the end before all is reached; empty otherwise.
    """

    encoder: Encoder
    runs: tuple[Run, ...]
    aims: tuple[Aim, ...]
    grid: tuple[Run, ...]
    excluded: dict[str, str]
    keys: dict[str, Any]
    ended: str = ""

    @property
    def reached(self) -> bool:
        """Whether all requested values are reached."""
        return all(one.reached for one in self.aims)

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-compatible dictionary."""
        return {
            "counts_per_revolution": list(self.encoder.counts), "noise_rad": list(self.encoder.noise),
            "set": self.keys, "reached": self.reached, "ended": self.ended,
            "aims": [one.to_dict() for one in self.aims],
            "runs": [one.to_dict() for one in self.runs], "grid": [one.to_dict() for one in self.grid],
            "excluded": self.excluded,
        }  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class MeasurementPlan(Result):
    """Runs to measure, by kind of encoders, with their predicted precision.

    Args:
        rig: scenario of the test rig.
        causes: effects at the sizes for which intervals are predicted, as tables of a scenario.
        size: requested, in units.
        options: by kind of encoders.
    """

    rig: Scenario
    causes: tuple[dict[str, Any], ...]
    size: float
    options: tuple[Option, ...]

    def __repr__(self) -> str:
        parts = [f"{len(one.runs)} runs{'' if one.reached else ', not reached'}" for one in self.options]
        return f"MeasurementPlan({'; '.join(parts)})"

    def to_dict(self) -> dict[str, Any]:
        """Return a JSON-compatible dictionary."""
        return {"rig": self.rig.title, "causes": list(self.causes), "size": self.size, "sigmas": SIGMAS,
                "options": [one.to_dict() for one in self.options]}  # fmt: skip

    def scenarios(self) -> Iterator[tuple[str, Scenario]]:
        """Generate name and scenario of each run, with its encoders."""
        for number, option in enumerate(self.options, 1):
            for k, run in enumerate(option.runs, 1):
                stem = f"run-{k}" if len(self.options) == 1 else f"encoder-{number}-run-{k}"
                yield f"{stem}.toml", self.rig.with_({**option.keys, **run.keys, "title": run.name})


def plan(
    rig: Scenario | str | Path,
    causes: Sequence[str] = (),
    separate: Sequence[str] = (),
    *,
    nuisances: Sequence[str] = (),
    size: float = SMALLEST,
    at: float | None = None,
    speeds: Sequence[float] = (),
    amplitudes: Sequence[float] = (),
    lengths: Sequence[float] = (),
    counts: Sequence[int] = (),
    noise: float | None = None,
    like: str | Path | None = None,
    most: int = 4,
    marks: bool = True,
    progress: Callable[[str, float], None] | None = None,
) -> MeasurementPlan:
    """Return the runs that determine chosen causes to a size, or separate sets of causes, with predicted intervals.

    Args:
        rig: scenario of the test rig, or its file; its effects act in all runs.
        causes: to be determined: kinds of effects, each with required shapes: ``"drag_viscous"``,
            ``"transmission_error:order=2:gear=loose"``. Without any, and without ``separate``, these are drag,
            restitution and backlash.
        separate: sets of causes to be separated, members joined by +: ``("drag_viscous", "drag_power")``.
        nuisances: kinds that are free as well, without a requested size.
        size: of each cause that must be detected at 5 standard deviations, relative to its unit size.
        at: size at which intervals are predicted, in the same units; that size unless given.
        speeds: possible mean speeds of the drive [rad/s].
        amplitudes: of the strongest harmonic of its speed [rad/s].
        lengths: durations of a record [s].
        counts: per revolution of both encoders, one plan for each.
        noise: of both encoders [rad]; that of the rig unless given.
        like: measured record with the counts and noise of the encoders.
        most: maximum number of runs.
        marks: whether encoders have index marks; otherwise the angular datum of each record is unknown.
        progress: called with the current task and the completed part of the whole.

    Raises:
        InputError: the rig cannot be planned for.
        UsageError: a kind is not known.
    """
    bench = load(rig) if isinstance(rig, str | Path) else rig
    tell = progress or (lambda doing, part: None)
    _check(bench, speeds, amplitudes, lengths, counts, noise, most, size)
    lengths = sorted(lengths or LENGTHS)
    asked = Wanted(bench, causes, separate, nuisances, size, size if at is None else at, lengths[-1])
    encoders = _encoders(bench, counts, noise, like)
    settings = list(_settings(bench, speeds, amplitudes))
    excluded: list[dict[str, str]] = [{} for _ in encoders]
    grids: list[dict[tuple[str, float], _Slot]] = [{} for _ in encoders]
    ways = (False,) if marks else (False, True)

    def looks(setting: Setting, made: Sequence[Recording], encoder: Encoder, number: int) -> list[list[Look]]:
        return [[look_at(run, setting, encoder, one, free, number) for free in ways]
                for run, one in zip(made, asked.truths, strict=True)]  # fmt: skip

    for k, setting in enumerate(settings):
        spans = {lasts: _lasts(asked, setting, lasts) for lasts in lengths}
        for number, span in enumerate(sorted({*spans.values()})):
            tell(f"simulating {setting.name}", (k + number / len(lengths)) / len(settings))
            made: list[Recording] = []
            for grid, bad, encoder in zip(grids, excluded, encoders, strict=True):
                try:
                    made = made or [simulated(setting, one, span) for one in asked.truths]
                    own = looks(setting, made, encoder, 0)
                except GearsError as error:
                    bad[setting.name] = _reason(error)
                    continue
                of_span = (lasts for lasts in lengths if spans[lasts] == span)
                grid.update({(setting.name, lasts): _Slot(setting, lasts, span, own) for lasts in of_span})
    options = []
    for number, (grid, bad, encoder) in enumerate(zip(grids, excluded, encoders, strict=True)):
        tell("confirming runs", number / len(encoders))

        def again(one: _Slot, turn: int, encoder: Encoder = encoder) -> _Slot:
            setting = one.setting._replace(rig=_later(one.setting.rig, turn + 1))
            try:
                made = [simulated(setting, each, one.span) for each in asked.truths]
                return one._replace(looks=looks(setting, made, encoder, turn + 1))
            except GearsError:
                return one

        whole = {name: one for name, one in grid.items() if all((name[0], lasts) in grid for lasts in lengths)}
        options.append(_Choice(asked, whole, encoder).option(most, bad, again))
    tell("confirming runs", 1.0)
    effects = [one.effect for one in asked.truths[0].causes if one.effect is not None]
    return MeasurementPlan(bench, tuple(table(one) for one in effects), size, tuple(options))


def _lasts(asked: Wanted, setting: Setting, lasts: float) -> float:
    """Return the simulated duration of a run [s]: the full one if a cause changes with time."""
    if asked.in_time:
        return lasts
    rig = setting.rig
    slower = min(abs(rig.motion.mean), rig.rig().mean_speed_loose) / (2.0 * pi)
    least = max(LEAST, PERIODS * rig.period, TURNS / slower if slower else 0.0)
    return min(asked.longest, max(min(least, SAMPLES / rig.sensors.sample_rate), PERIODS * rig.period))


def _later(rig: Scenario, number: int) -> Scenario:
    """Return a rig whose fluctuation begins at another phase, by number."""
    waves = rig.motion.harmonics
    shifts = [2.0 * pi * (one.frequency / waves[0].frequency) * GOLDEN * number for one in waves]
    tables = [{**_wave(one, 1.0), "phase": f"{one.phase + by!r} rad"} for one, by in zip(waves, shifts, strict=True)]
    return rig.with_({"motion.harmonics": tables}) if waves else rig


def _reason(error: GearsError) -> str:
    return str(error).splitlines()[0]


def _check(
    rig: Scenario, speeds: Sequence[float], amplitudes: Sequence[float], lengths: Sequence[float],
    counts: Sequence[int], noise: float | None, most: int, size: float,
) -> None:  # fmt: skip
    """Reject values that no run can have."""
    for name, values, low in (
        ("--speeds", speeds, None), ("--amplitudes", amplitudes, 0.0), ("--lengths", lengths, 0.0),
        ("--counts", counts, 3.0), ("--noise", [] if noise is None else [noise], -1e-300), ("--most", [most], 0.0),
        ("--size", [size], 0.0),
    ):  # fmt: skip
        for value in values:
            if not np.isfinite(value) or (low is not None and value <= low):
                raise UsageError(f"{name} has {value:g}; give more than {max(low or 0.0, 0.0):g}")
    if rig.motion.record is not None:
        text = "is a measured motion, which a plan cannot change"
        raise InputError(Fault("motion.record", text, "state motion.mean and motion.harmonics", str(rig.path or "")))


def _encoders(rig: Scenario, counts: Sequence[int], noise: float | None, like: str | Path | None) -> list[Encoder]:
    """Return the encoders of the plan."""
    own = [rig.sensors.drive, rig.sensors.loose]
    if like is not None:
        columns = admit(like, rig).channels.columns
        own = [sensor_of(columns["time_s"], columns[f"theta_{gear}_rad"]) for gear in ("drive", "loose")]
    quiet = tuple(one.noise if noise is None else noise for one in own)
    each = [(count, count) for count in counts] or [tuple(one.counts_per_revolution for one in own)]
    made = [Encoder((one[0], one[1]), (quiet[0], quiet[1])) for one in each]
    if any(not one.noise[k] and one.counts[k] is None for one in made for k in (0, 1)):
        text = "state neither counts nor noise: readings without error know everything"
        remedy = "give --counts, --noise or --like RECORD, or sensors.counts_per_revolution in the file"
        raise InputError(Fault("sensors", text, remedy, str(rig.path or "")))
    return made


def _settings(rig: Scenario, speeds: Sequence[float], amplitudes: Sequence[float]) -> Iterator[Setting]:
    """Generate the tried mean speeds and fluctuations; a drive that does not reverse on the rig does not in a run."""
    motion = rig.motion
    mean, waves = motion.mean, motion.harmonics
    largest = max((one.amplitude for one in waves), default=0.0)
    if amplitudes and not waves:
        text = "has no fluctuation whose amplitude could be changed"
        raise InputError(Fault("motion.harmonics", text, "state one, or leave out --amplitudes", str(rig.path or "")))
    factors = [one / largest for one in amplitudes] or (list(SWINGS) if waves else [1.0])
    reach = sum(one.amplitude for one in waves)
    found = False
    for speed in speeds or [by * mean for by in SLOWER] if mean else speeds or [mean]:
        for factor in factors:
            if mean and reach < abs(mean) and factor * reach > BACK * abs(speed):
                continue
            found = True
            tables = [_wave(one, factor) for one in waves]
            keys = {"motion.mean": show(speed, "speed", 5)} | ({"motion.harmonics": tables} if waves else {})
            name = show(speed, "speed", 4) + (f" ± {show(factor * largest, 'speed', 3)}" if waves else "")
            yield Setting(name, keys, rig.with_(keys))
    if not found:
        text = f"the fluctuation reaches {show(reach, 'speed', 3)}: the drive would turn back at all of the speeds"
        raise InputError(Fault("motion", text, "give faster --speeds or smaller --amplitudes", str(rig.path or "")))


def _wave(one: Any, factor: float) -> dict[str, Any]:
    """Return a harmonic with another amplitude; one with an order keeps the order."""
    at = {"order": one.order} if one.order else {"frequency": show(one.frequency, "frequency", 8)}
    return {"amplitude": show(factor * one.amplitude, "speed", 6), **at, "phase": show(one.phase, "angle", 6)}


class _Slot(NamedTuple):
    """A possible run.

    Args:
        setting: of it.
        lasts: its duration [s].
        span: simulated part of that [s].
        looks: information of the simulated run, by truth, then as the first run and as another one.
    """

    setting: Setting
    lasts: float
    span: float
    looks: list[list[Look]]


class _Choice:
    """The choice of runs for one kind of encoders.

    Args:
        asked: the request.
        grid: tried runs, by setting and duration.
        encoder: both.
    """

    def __init__(self, asked: Wanted, grid: dict[tuple[str, float], _Slot], encoder: Encoder) -> None:
        self.asked, self.grid, self.encoder = asked, grid, encoder
        self.lengths = sorted({lasts for _, lasts in grid})
        self.longest = [one for one in grid.values() if one.lasts == max(self.lengths)]
        self.possible = [one < 1.0 for one in self._sizes(self.longest)]
        self.separable = {name: one >= needed() for name, one in self._apart(self.longest).items()}

    def option(self, most: int, excluded: dict[str, str], again: Callable[[_Slot, int], _Slot]) -> Option:
        """Return the best runs up to a maximum number, each no longer than needed."""
        chosen = self._shortened(self._chosen(most))
        # the chosen run is favoured by chance: its value is taken from others of the same kind
        fresh = [[again(one, k + most * turn) for k, one in enumerate(chosen)] for turn in range(TIMES)]
        runs = []
        for k, one in enumerate(chosen):
            alone = _median([self._intervals([own[k]]) for own in fresh])
            both = _median([self._intervals(own[: k + 1]) for own in fresh])
            apart = {name: float(np.median([self._apart([own[k]])[name] for own in fresh])) for name in self.separable}
            reaches = {aim.name: aim.value for aim in self._aims([own[: k + 1] for own in fresh])}
            runs.append(replace(self._run(one), alone=alone, together=both, apart=apart, reaches=reaches))
        tried = tuple(
            replace(self._run(one), alone=self._intervals([one]), apart=self._apart([one])) for one in self.longest
        )
        aims = tuple(self._aims(fresh if chosen else []))
        short = bool(chosen) and not all(one.reached for one in aims)
        more = f"a further run brings less than 1 %; a diagnosis reads {MOST} windows of all records"
        ended = (more if len(chosen) < most else f"--most {most}") if short else ""
        return Option(self.encoder, tuple(runs), aims, tried, excluded, keys_of(self.encoder), ended)

    def _chosen(self, most: int) -> list[_Slot]:
        """Return runs in greedy order, each the best addition to those before."""
        chosen: list[_Slot] = []
        able = self.longest if any((*self.possible, *self.separable.values())) else []
        while len(chosen) < most and able:
            best = min(([*chosen, one] for one in able), key=self._criterion)
            missing = self._criterion(best)[0]
            if chosen and GROWS * self._criterion(chosen)[0] < missing < np.inf:
                break
            chosen = best
            if missing <= MARGIN:
                break
        return chosen

    def _shortened(self, chosen: list[_Slot]) -> list[_Slot]:
        """Return the runs with the shortest durations that still reach all, the last ones first."""
        for k in reversed(range(len(chosen))):
            for lasts in self.lengths:
                tried = [*chosen[:k], self.grid[chosen[k].setting.name, lasts], *chosen[k + 1 :]]
                if self._criterion(tried)[0] <= MARGIN:
                    chosen = tried
                    break
        return chosen

    def _parts(self, chosen: Sequence[_Slot], truth: int, driven: bool = False) -> tuple[Parts, Parts]:
        """Return the information of runs along their paths and in their events, and the multiplicity of each."""
        path, events = [], []
        for number, one in enumerate(chosen):
            look = one.looks[truth][-1 if number else 0]
            if (own := look.driven if driven else look.path) is not None:
                count = min(MOST // len(chosen), look.dense * one.lasts)
                path.append((own, count / max(look.windows, 1)))
            if look.events is not None:
                events.append((look.events, one.lasts / one.span))
        return path, events

    def _covariances(self, chosen: Sequence[_Slot]) -> list[Array]:
        """Return the covariance of the causes' numbers, each from the more precise of path and events."""
        if not self.asked.wanted:
            return []
        causes = self.asked.truths[0].causes
        size = sum(len(one.numbers) for one in causes)
        path, events = self._parts(chosen, 0)
        runs = max((one.looks[0][0].runs for one in chosen), default=1.0)
        each = [_spread_of(path, size, lambda parts: _of_windows(parts, runs)), _spread_of(events, size, _of_events)]
        made, at = [], 0
        for cause in causes[: self.asked.wanted]:
            own = slice(at, at + len(cause.numbers))
            at = own.stop
            made.append(min((one[own, own] for one in each), key=lambda one: float(np.max(np.diag(one)))))
        return made

    def _intervals(self, chosen: Sequence[_Slot]) -> dict[str, dict[str, Parameter]]:
        """Return 95 % intervals of all parameters of the causes."""
        made = {}
        for cause, own in zip(self.asked.truths[0].causes, self._covariances(chosen), strict=False):
            spread = np.where(np.isfinite(own), own, 0.0) * np.outer(cause.units, cause.units)
            known = parameters(cause, spread)
            good = bool(np.all(np.isfinite(np.diag(own))))
            made[name_of(cause)] = {
                name: one if good else replace(one, low=-np.inf, high=np.inf) for name, one in known.items()
            }
        return made

    def _sizes(self, chosen: Sequence[_Slot]) -> list[float]:
        """Return the size of each cause that is detected at 5 standard deviations, in units."""
        made = []
        for cause, own in zip(self.asked.truths[0].causes, self._covariances(chosen), strict=False):
            numbers = 2 if cause.candidate.phased else 1
            wide = own[:numbers, :numbers]
            sigma = float(np.sqrt(np.linalg.eigvalsh(wide)[-1])) if np.all(np.isfinite(wide)) else np.inf
            made.append(SIGMAS * (self.asked.at**2 * sigma if cause.candidate.kind == SOFT else sigma))
        return made

    def _apart(self, chosen: Sequence[_Slot]) -> dict[str, float]:
        """Return the standard deviations between each true set and the best fit of another."""
        made = {}
        for number, truth in enumerate(self.asked.truths):
            for name, true, ways in truth.pairs:
                path, events = self._parts(chosen, number, driven=True)
                alike = max((one.looks[number][0].runs for one in chosen), default=1.0)
                worth = _separation_of(path, true, ways) / alike, _separation_of(events, true, ways)
                made[name] = float(np.sqrt(max(worth)))
        return made

    def _criterion(self, chosen: Sequence[_Slot]) -> tuple[float, float]:
        """Return the largest missing fraction of the possible values, 1 if all is reached, and the median one.

        If some numbers are not identifiable, the second is minus the information of all, with a wide prior.
        """
        parts = [one / self.asked.size for one, able in zip(self._sizes(chosen), self.possible, strict=True) if able]
        parts += [needed() / max(one, 1e-9) for name, one in self._apart(chosen).items() if self.separable[name]]
        if np.all(np.isfinite(parts)):
            return max(parts), float(np.mean(np.log(parts)))
        known = []
        for own in self._parts(chosen, 0):
            normal = sum((times * one.normal for one, times in own), np.zeros((1, 1)))
            known.append(float(np.linalg.slogdet(normal + np.eye(len(normal)) / WIDE**2)[1]))
        return np.inf, -max(known)

    def _aims(self, fresh: Sequence[Sequence[_Slot]]) -> Iterator[Aim]:
        """Generate the results of repeated runs; a cause that the grid does not show at 100 % is not possible."""
        sizes = np.median([self._sizes(own) for own in fresh] or [[np.inf] * self.asked.wanted], axis=0).tolist()
        for cause, value, able in zip(self.asked.truths[0].causes, sizes, self.possible, strict=False):
            yield Aim(name_of(cause), value <= self.asked.size, value, self.asked.size, able)
        each = [self._apart(own) for own in fresh] or [dict.fromkeys(self.separable, 0.0)]
        for name, able in self.separable.items():
            value = float(np.median([one[name] for one in each]))
            yield Aim(name, value >= needed(), value, needed(), able)

    def _run(self, one: _Slot) -> Run:
        """Return a run without its information."""
        name, keys, rig = one.setting
        waves = rig.motion.harmonics
        largest = max(waves, key=lambda each: each.amplitude) if waves else None
        lasts = {"run.duration": show(one.lasts, "time", 4)}
        return Run(name, {**keys, **lasts}, rig.motion.mean, largest.amplitude if largest else 0.0,
                   largest.frequency if largest else 0.0, one.lasts, {})  # fmt: skip


def _median(known: Sequence[dict[str, dict[str, Parameter]]]) -> dict[str, dict[str, Parameter]]:
    """Return intervals of the median width."""
    made = {}
    for kind, own in known[0].items():
        halves = {name: float(np.median([0.5 * (one[kind][name].high - one[kind][name].low) for one in known]))
                  for name in own}  # fmt: skip
        made[kind] = {
            name: replace(one, low=one.value - halves[name], high=one.value + halves[name]) for name, one in own.items()
        }
    return made


def needed() -> float:
    """Return the standard deviations between two sets at which the wrong one is excluded with a probability of 95 %.

    The fall of chi-square scatters about its expectation by twice its root.

    >>> round(needed(), 2), round((needed() ** 2 - EXCLUDED) / (2.0 * needed()), 3) == SURE
    (5.97, True)
    """
    return SURE + float(np.sqrt(SURE**2 + EXCLUDED))


def amounts(texts: str, family: str, option: str) -> list[float]:
    """Return quantities separated by commas, in SI units.

    Raises:
        UsageError: one is not such a quantity.

    >>> amounts("2 s, 500 ms", "time", "--lengths")
    [2.0, 0.5]
    """
    try:
        return [parse(one.strip(), family) for one in texts.split(",") if one.strip()]
    except InputError as error:
        raise UsageError(f"{option} {error.faults[0].message}") from None


def _finite(values: dict[str, float]) -> dict[str, float | None]:
    """Return numbers in JSON-compatible form."""
    return {name: value if np.isfinite(value) else None for name, value in values.items()}


def _plain(known: dict[str, dict[str, Parameter]]) -> dict[str, Any]:
    """Return intervals in JSON-compatible form."""

    def one(each: Parameter) -> dict[str, Any]:
        good = np.isfinite(each.low) and np.isfinite(each.high)
        return {"value": each.value, "unit": each.unit, "ci95": [each.low, each.high] if good else None}

    return {kind: {name: one(each) for name, each in own.items()} for kind, own in known.items()}


def _total(parts: Parts) -> tuple[Array, float]:
    """Return the products of the slopes of all runs, and the level of their residuals, at least 1."""
    normal = np.sum([times * one.normal for one, times in parts], axis=0)
    chi2, count = (sum(times * getattr(one, name) for one, times in parts) for name in ("chi2", "count"))
    return normal, max(chi2 / max(count, 1.0), 1.0)


def _spread_of(parts: Parts, size: int, of: Callable[[Parts], Array]) -> Array:
    """Return a covariance in units, infinite for numbers that are not identifiable, (size, size)."""
    made = np.diag(np.full(size, np.inf))
    if not parts:
        return made
    normal = _total(parts)[0]
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    value, vector = np.linalg.eigh(normal / np.outer(scale, scale))
    lost = np.sum(vector[:, value < NOTHING * value[-1]] ** 2, axis=1) > 1e-6
    known = ~(lost | (np.diag(normal) <= 0.0))
    if np.any(known):
        made[np.ix_(known, known)] = of(parts)[np.ix_(known, known)]
    return made


def _of_events(parts: Parts) -> Array:
    """Return the covariance from events: a longer run repeats the simulated part."""
    return combined([
        Information(times * one.normal, np.sqrt(times) * one.scores, times * one.chi2, max(round(times * one.count), 1))
        for one, times in parts
    ])  # fmt: skip


def _of_windows(parts: Parts, runs: float = 1.0) -> Array:
    """Return the covariance along the path, at least as wide as the scatter of windows, as in the diagnosis.

    runs: number of consecutive readings whose residuals have the same sign.
    """
    normal, level = _total(parts)
    scatter = np.sum([times * one.scores.T @ one.scores for one, times in parts], axis=0)
    inverse = np.linalg.pinv(normal)
    wide = np.diag(inverse @ scatter @ inverse) / np.maximum(level * np.diag(inverse), 1e-300)
    wide = np.sqrt(np.maximum(wide, runs))
    return level * inverse * np.outer(wide, wide)


def _separation_of(parts: Parts, true: Array, ways: Sequence[Array]) -> float:
    """Return the expected chi-square, over its level, of the best fit of another set to data of the true one.

    true: numbers of the set in units, (p,); ways: free directions of the other set, (p, k) each.
    """
    if not parts:
        return 0.0
    normal, level = _total(parts)
    least = np.inf
    for free in ways:
        across = free.T @ normal @ true
        inner = np.linalg.pinv(free.T @ normal @ free, rcond=NOTHING, hermitian=True)
        least = min(least, float(true @ normal @ true - across @ inner @ across))
    return max(least, 0.0) / level
