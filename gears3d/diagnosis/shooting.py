"""Multiple shooting: the rigid model in windows of the records, each with an initial state of its own.

Input: rig, records, and effects. A window starts with the place and speed fitted to its readings; the model follows the
measured motion of the drive, whose harmonics have an uncertainty, over impacts, bounces and contact, without
segmentation. Result: trajectory residuals, and their sensitivities to effects, starts, datums and harmonics of the
drive. Source: Bock and Plitt 1984, multiple shooting.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.evidence import MEANS, begin_of_flight, interpolated, lagged, means_of, read, reader_of, straight
from gears3d.diagnosis.prediction import GEARS, Rounding, Unfollowed, deviation, errors_of, reading_error
from gears3d.diagnosis.shooting_kernels import (
    body_of,
    carried,
    film_of,
    follow,
    impacts_of,
    shoot,
    slowing,
    spend,
    swayed,
    swing,
    torques_of,
)
from gears3d.effects import Code
from gears3d.measured.noise import SURE
from gears3d.signals.whitening import likely_root, roots_of

if TYPE_CHECKING:
    from gears3d.effects import Row
    from gears3d.measured.segmentation import Track
    from gears3d.scenario import Scenario

Array = np.ndarray
# Points of integration of a window, 64 in a fall across the backlash of the longest one; most means of readings in it.
NODES, BINS = 384, 256
# Largest number of windows of all records: numbers of causes are then known to 10 % of their smallest size.
MOST = 96
# Shortest and longest window, in falls across the backlash, a period of the drive in between; shortest that is long.
FALLS, LONG = (1.0, 6.0), 3.0
# Numbers of means of readings to which a free flight is fitted for an initial start.
TAKEN = (3, 5, 8, 12, 18, 27, 40, 60, 90, 130)
# Error of the trajectory by nodes and by the drive's curve, in backlashes: that of records without noise.
ROUNDED = 3e-4
# Smallest root of 1/f noise per unit of ln f, over the noise of a mean, that is whitened: motion alone had up to 0.26.
COLOURED = 0.3
# Values of the same that are tried on residuals where 1/f noise cannot be estimated from a record.
COLOURS = tuple(0.3 * 2.0 ** (0.5 * k) for k in range(-1, 9))
# Means of readings over which residuals may keep their sign: half a flight.
RUN = 16
# Largest part of its chi-square that another start may leave to replace one, and of theirs that readings without
# rounding may leave to replace readings.
BETTER, FALLEN = 0.98, 0.9
# Mean square of residuals of a window, in variances of the noise, up to which they are noise: no other start is tried.
NOISE = 1.5
# Step of starts between oil films, in units, for sensitivities; unit of the rate of a twist, in units of the rate of a
# start: an impact after a fall across the backlash has 2.
NEXT, FLUNG = 1e-3, 4.0
# First impacts of a window that have a restitution of their own (random effect) where it scatters; its largest step in
# a round, in standard deviations of the scatter.
KICKS, FARTHEST_KICK = 16, 2.0
# Largest number of impacts and contact losses of a window that are known.
EVENTS = 512


class Starts(NamedTuple):
    """Initial states of windows.

    Args:
        place: displacement [m], (w,).
        rate: of the same [m/s], (w,).
        mode: 0 in flight, 1 on the active, 2 on the reverse flank, (w,).
        kicks: deviations of the restitution of the first impacts, (w, KICKS).
        twist: angle of a second body ahead of the loose gear, and its rate [rad, rad/s], (w, 2).
    """

    place: Array
    rate: Array
    mode: Array
    kicks: Array
    twist: Array

    def where(self, better: Array, other: Starts) -> Starts:
        """Return these where they are better, and others elsewhere."""
        pairs = zip(self, other, strict=True)
        return Starts(*(np.where(better[:, None] if a.ndim > 1 else better, a, b) for a, b in pairs))

    def only(self, picked: Array) -> Starts:
        """Return those of some windows, by their numbers, (k,)."""
        return Starts(*(one[picked] for one in self))

    def put(self, picked: Array, other: Starts) -> Starts:
        """Return these with those of some windows replaced."""
        made = [one.copy() for one in self]
        for own, new in zip(made, other, strict=True):
            own[picked] = new
        return Starts(*made)


def at_rest(place: Array, rate: Array, mode: Array | int = 0) -> Starts:
    """Return starts without kicks and without twist."""
    return Starts(place, rate, np.full(len(place), mode), np.zeros((len(place), KICKS)), np.zeros((len(place), 2)))


class Windows:
    """Windows of the records of one rig, with their starts, and the datums and the drive's motion of each record.

    Datums are of displacement and angles; the motion is corrected in the parameters of its harmonics, in standard
    deviations of each.

    Args:
        rig: scenario of the bench.
        tracks: trajectories of the records.
        periods: of the drive's fluctuation in each record [s].
        unmarked: gears of each record without an index mark.
        least: shortest window, in falls across the backlash.
    """

    def __init__(
        self, rig: Scenario, tracks: Sequence[Track], periods: Sequence[float],
        unmarked: Sequence[Sequence[str]] = (), least: float = FALLS[0],
    ) -> None:  # fmt: skip
        self.rig, self.pair, self.values, self.periods = rig, rig.pair(), rig.rig(), periods
        self.radii = self.values.base_radius_drive, self.values.base_radius_loose
        self.backlash, self.lever = self.values.backlash, self.radii[1] / self.values.inertia
        slowing = self.lever * max(self.values.drag_torque, 1e-12)
        self.fall = float(np.sqrt(2.0 * self.backlash / slowing))
        self.base, self.effects = rig.rows(), rig.effects
        self.origins = np.array([self.radii[1] * one.origin[1] - self.radii[0] * one.origin[0] for one in tracks])
        self._last: tuple[Any, ...] | None = None
        self.work = np.full(1, np.inf)  # that trajectories of these windows and their parts may still take
        self.zeros, self.turned = np.zeros(len(tracks)), np.zeros((len(tracks), 2))
        self.lost = np.array([[gear in own for gear in GEARS] for own in unmarked or [()] * len(tracks)])
        rows, seen = [], []
        for k, (known, period) in enumerate(zip(tracks, periods, strict=True)):
            for at, span in self._spans(k, known, period, max(MOST // len(tracks), 1), least):
                rows.append((k, at, span))
                size, *means, single = means_of(*self._place(k, known, at, at + span), BINS)
                sigma = float(np.hypot(known.white / np.sqrt(size), ROUNDED * self.backlash))
                seen.append((*means, sigma, (single - at) * (NODES - 1) / span))
        self.guessed, self.weight = self.zeros.copy(), np.ones(len(rows))
        self.record = np.array([row[0] for row in rows], dtype=int)
        self.begin, span = np.array([row[1:] for row in rows]).reshape(-1, 2).T
        self.step, self.long = span / (NODES - 1), bool(np.all(span > 0.99 * LONG * self.fall))
        time = self.begin[:, None] + np.linspace(0.0, 1.0, NODES) * span[:, None]
        along = [(tracks[k].steady.curve, at) for k, at in zip(self.record, time, strict=True)]
        self.drive = tuple(np.array([one(at, n) for one, at in along]).reshape(-1, NODES) for n in range(3))
        self.drive_errors: tuple[Array, ...] = errors_of(tracks, self.record, time)
        self.unfollowed = Unfollowed(tracks, self.record, time, self.drive)
        self.motion = np.zeros((len(tracks), len(self.drive_errors[0])))
        self.sampled = np.ones(len(tracks))  # part of each record's windows, by which priors of its motion count
        self.window = np.repeat(np.arange(len(rows)), [len(one[0]) for one in seen])
        self.time, self.read = (np.concatenate([np.zeros(0), *(one[k] for one in seen)]) for k in (0, 1))
        self.sigma = np.array([one[2] for one in seen])[self.window]
        rounds = [one.readings[1].kind == "counts" for one in tracks]
        cut = ((n, *self._place(k, tracks[k], at, at + span)) for n, (k, at, span) in enumerate(rows) if rounds[k])
        self.rounding = Rounding(tracks, cut, self.radii[1], self.window, self.time, self.read)
        share = (self.time - self.begin[self.window]) / self.step[self.window] if rows else self.time
        self.node = np.clip(share.astype(int), 0, NODES - 2)
        self.beyond = share - self.node
        self.single = np.concatenate([np.zeros((0, MEANS)), *(one[3] for one in seen)])
        self.models, self.lasts = [one.model for one in tracks], [float(np.ptp(one.time[[0, -1]])) for one in tracks]
        self.smooth, self.apart = [one.smooth for one in tracks], np.array([1.0 - one.shared for one in tracks])
        self.roots = [
            self._root(k, slow) if max(slow := one.flicker / self._white(k), self._drift(k)) > COLOURED else None
            for k, one in enumerate(self.models)
        ]
        self.every, self.order = self._numbered()
        self.starts = at_rest(np.zeros(len(rows)), np.zeros(len(rows)))
        self.picked = self.whole = np.arange(len(rows))  # numbers among those that windows were taken from, and of all

    def __len__(self) -> int:
        return len(self.begin)

    @property
    def means(self) -> tuple[Array, Array, Array, Array]:
        """Window, node, part of the step, and places of single readings in steps, of the means."""
        return self.window, self.node, self.beyond, self.single

    def _numbered(self) -> tuple[Array, Array]:
        """Return the window of each reading, and of each kick, and their places in it, (n + KICKS w,)."""
        kicked = np.repeat(np.arange(len(self)), KICKS)
        order = np.arange(len(self.window)) - np.searchsorted(self.window, self.window)
        most = int(order.max(initial=-1)) + 1
        order = np.concatenate([order, np.tile(most + np.arange(KICKS), len(self))])
        return np.concatenate([self.window, kicked]), order

    def _place(self, k: int, known: Track, first: float, last: float) -> tuple[Array, Array]:
        """Return times and displacements of the readings of a stretch, with an arbitrary datum."""
        rows = slice(*np.searchsorted(known.time, [first, last]).tolist())
        time, loose = known.time[rows], known.shown[rows] + known.lift
        return time, self.radii[1] * loose - self.radii[0] * known.steady.curve(time) - self.origins[k]

    def _spans(self, k: int, known: Track, period: float, most: int, least: float) -> list[tuple[float, float]]:
        """Return beginnings and durations of the windows of a record, and set the record's datum.

        A window begins early in the longest flight of its period, where readings determine place and speed best.
        """
        first, last = float(known.time[0]), float(known.time[-1])
        span = float(np.clip(period, least * self.fall, FALLS[1] * self.fall))
        margin = 0.02 * (last - first)
        look = min(max(period, span), 0.5 * (last - first - 2.0 * margin))
        count = max(min(most, int((last - first - 2.0 * margin) / max(look, span))), 0)
        size, stretches = max(int(min(self.fall, period) / (40.0 * known.spacing)), 1), []
        for at in np.linspace(first + margin, last - margin - max(look, span), count).tolist():
            time, place = self._place(k, known, at, at + look)
            if (blocks := len(time) // size) > 8:
                own = time, place, place + self.radii[0] * known.steady.curve(time)
                stretches.append((at, *(x[: blocks * size].reshape(blocks, size).mean(axis=1) for x in own)))
        if not stretches:
            return []
        low, high = np.quantile(np.concatenate([one[2] for one in stretches]), [0.005, 0.995])
        crosses = high - low > 0.8 * self.backlash
        self.zeros[k] = 0.5 * (low + high - self.backlash) if crosses else low
        found, free = [], first
        for _, time, place, loose in stretches:
            gap = place - self.zeros[k]
            gap = np.minimum(gap, self.backlash - gap) if crosses else gap
            amid = np.concatenate([[0], gap > 0.25 * np.quantile(gap, 0.95), [0]]).astype(int)
            begins, ends = np.flatnonzero(np.diff(amid) > 0), np.flatnonzero(np.diff(amid) < 0)
            longest = int(np.argmax(ends - begins)) if len(begins) else -1
            early = int(begins[longest] + 0.2 * (ends - begins)[longest]) if len(begins) else 0
            early += begin_of_flight(loose[early : int(ends[longest])] / self.backlash) if len(begins) else 0
            at = float(time[early])
            if at >= free and at + span < last - 0.5 * margin:
                found.append((at, span))
                free = at + span
        return found

    def _white(self, k: int) -> float:
        """Return the standard deviation of a reading of a record [m]."""
        return float(np.min(self.sigma[self.record[self.window] == k], initial=np.inf))

    def _drift(self, k: int) -> float:
        """Return the smooth error of the drive's curve in a record, in standard deviations of a reading."""
        return self.smooth[k][0] / self._white(k)

    def _root(self, k: int, slow: float) -> Array:
        """Return the whitening transform of a record's windows, for 1/f noise in standard deviations of one."""
        longest = np.flatnonzero(self.record == k)[np.argmax(np.bincount(self.window)[self.record == k])]
        time = self.time[self.window == longest]
        smooth = self._drift(k), self.smooth[k][1]
        return roots_of(time[None], np.ones((1, len(time))), slow, self.lasts[k], smooth)[0]

    def coloured(self, effects: Sequence[Any]) -> bool:
        """Estimate 1/f noise that a record does not determine from residuals of its quieter windows.

        Returns whether the noise model changed.
        """
        rest = self.missed(effects) / self.sigma
        usual, before = self.level(rest), [one is None or one.tobytes() for one in self.roots]
        for k, model in enumerate(self.models):
            own = np.flatnonzero(self.record == k)
            unsure = model.sigmas["flicker"]
            if (model.flicker > 0.0 and not model.flicker < SURE * unsure) or not len(own):
                continue
            rows = [rest[self.window == one] for one in own[usual[own] <= np.median(usual[own])]]
            most = (model.flicker + 2.0 * unsure) / self._white(k)
            plain = () if self._drift(k) > COLOURED else (None,)
            slows = [slow for slow in (*([] if plain else [0.0]), *COLOURS) if slow < most]
            self.roots[k] = likely_root(rows, [*plain, *(self._root(k, slow) for slow in slows)])
        return before != [one is None or one.tobytes() for one in self.roots]

    def whitened(self, columns: Array) -> Array:
        """Return readings, in their standard deviations, whitened for 1/f noise."""
        if all(root is None for root in self.roots):
            return columns
        dense = self.dense(np.atleast_2d(columns))
        for k, root in enumerate(self.roots):
            if root is not None and np.any(own := self.record == k):
                most = min(len(root), dense.shape[2])
                dense[own, :, :most] = np.tensordot(dense[own, :, :most], root[:most, :most].T, 1)
        return self.gathered(dense, columns)

    def some(self, most: int) -> tuple[Windows, Array]:
        """Return a sample of at most so many windows, and which readings and kicks are theirs, (n + KICKS w,)."""
        if len(self) <= most:
            return self, np.ones(len(self.every), dtype=bool)
        return self.only(np.unique(np.linspace(0, len(self) - 1, most).round().astype(int)))

    def only(self, picked: Array) -> tuple[Windows, Array]:
        """Return windows by their numbers, and which readings and kicks are theirs, (n + KICKS w,)."""
        number = np.full(len(self), -1)
        number[picked] = np.arange(len(picked))
        mine = number[self.window] >= 0
        few = copy(self)
        for name in ("record", "begin", "step", "weight"):
            setattr(few, name, getattr(self, name)[picked])
        few.drive = tuple(one[picked] for one in self.drive)
        few.drive_errors = tuple(one[:, picked] for one in self.drive_errors)
        few.starts, few.picked, few.whole = self.starts.only(picked), picked, self.whole[picked]
        for name in ("time", "read", "sigma", "node", "beyond", "single"):
            setattr(few, name, getattr(self, name)[mine])
        few.window = number[self.window][mine]
        few.every, few.order = few._numbered()
        return few, number[self.every] >= 0

    def part_of(self, few: Windows) -> Array:
        """Return the part of each record's windows that are among few of them, 1 without any, (r,)."""
        own, every = (np.bincount(one.record, minlength=len(self.zeros)) for one in (few, self))
        return np.where(own > 0, own / np.maximum(every, 1), 1.0)

    def until(self, part: float) -> Windows:
        """Return the windows shortened to a part of their length, with starts, datums and weights of their own."""
        nodes = max(round(part * (self.drive[0].shape[1] - 1)) + 1, 3)
        mine = self.node + self.beyond <= nodes - 1
        few = copy(self)
        few.drive = tuple(np.ascontiguousarray(one[:, :nodes]) for one in self.drive)
        few.drive_errors = tuple(np.ascontiguousarray(one[..., :nodes]) for one in self.drive_errors)
        for name in ("time", "read", "sigma", "window", "single"):
            setattr(few, name, getattr(self, name)[mine])
        few.node = np.minimum(self.node[mine], nodes - 2)
        few.beyond = (self.node + self.beyond)[mine] - few.node
        few.every, few.order = few._numbered()
        return few

    def residuals(self, effects: Sequence[Any], starts: Starts | None = None) -> Array:
        """Return trajectory residuals of the rig with more effects, in standard deviations, (n,).

        Where restitution scatters, minus the kicks in standard deviations of the scatter follow, (n + KICKS w,).
        """
        starts = starts or self.starts
        return self.rest(self._run(effects, starts).made, starts, self.spread(effects))

    def missed(self, effects: Sequence[Any]) -> Array:
        """Return trajectory residuals of the rig with more effects [m], (n,)."""
        return self.read - self._run(effects, self.starts).made

    def unrounded(self, effects: Sequence[Any]) -> bool:
        """Remove the rounding of readings to counts that the trajectory explains; return whether residuals fell."""
        made = self._run(effects, self.starts).made
        read = self.rounding.removed(made, self.record[self.window])
        fell = float(np.sum((read - made) ** 2)) < FALLEN * float(np.sum((self.read - made) ** 2))
        self.read = read if fell else self.read
        return fell

    def rest(self, made: Array, starts: Starts, spread: float) -> Array:
        """Return readings less predictions, and minus the kicks, in standard deviations."""
        rest = self.whitened((self.read - made) / self.sigma)
        return np.concatenate([rest, -starts.kicks.ravel() / spread]) if spread else rest

    def spread(self, effects: Sequence[Any]) -> float:
        """Return the standard deviation of the restitution, for which windows have kicks; of oil, 0."""
        rows = [*self.base, *(row for effect in effects for row in effect.rows(self.values))]
        own = [row.p[0] for row in rows if row.code == Code.IMPACT_SCATTER]
        return float(np.hypot.reduce(own)) if own and not len(film_of(rows)) else 0.0

    def along(self, effects: Sequence[Any]) -> Linearised:
        """Return the trajectory of the rig with more effects from the present starts, with its sensitivities."""
        return Linearised(self, effects, self._run(effects, self.starts, flows=True))

    def _run(self, effects: Sequence[Any], starts: Starts, *, flows: bool = False) -> _Run:
        """Return the trajectory of the rig with more effects, with transition matrices on request."""
        rows, sensors, seen, loose, ahead, wrong, (angle, speed, rate), flanks, runs = self._shared(effects)
        if (own := (flows, *(x.tobytes() for x in starts))) in runs:
            return runs[own]
        laws = np.array([self.values.restitution, 0.0, 0.0])
        for row in rows:
            if Code.IMPACT_OFFSET <= row.code <= Code.IMPACT_FLANK:
                laws[row.code - Code.IMPACT_OFFSET] += row.p[0]
        path, pace = np.empty_like(angle), np.empty_like(angle)
        events, counts = np.zeros((len(self), EVENTS, 7)), np.zeros(len(self), dtype=np.int64)
        torques, about = torques_of(rows, self.values.drag_torque), np.array([*self.radii, self.lever])
        film, body = film_of(rows), body_of(rows)
        spend(self.work, angle.size, contacts=len(film) + len(body) > 0)
        twist = np.zeros_like(angle if len(body) else angle[:, :0])
        kicks = starts.kicks if self.spread(effects) else starts.kicks[:, :0]
        flow = np.zeros((len(self), angle.shape[1] - 1 if flows and len(film) else 0, 4))
        bends = any(200 < row.code < 300 for row in rows) and any(row.code == Code.GAP_SPRING for row in rows)
        for again in (False, True) if bends else (False,):  # compliant teeth: the gear is far behind its flank
            if again:
                flanks = self.flanks(rows, angle + self.turned[self.record, :1], loose, places=(path, path))
                flanks = flanks[0], flanks[1] + self.backlash
            if len(body):
                swing(self.begin, self.step, angle, speed, rate, *flanks, about, ahead, torques, laws, body,
                      *starts[:3], starts.twist, kicks, path, pace, twist, events, counts)  # fmt: skip
                continue
            shoot(self.begin, self.step, angle, speed, rate, *flanks, about, ahead, torques, laws, film, *starts[:3],
                  kicks, path, pace, events, counts, flow)  # fmt: skip
        made = np.zeros(len(self.window))
        read(path, pace, flanks, events, counts, self.step, *self.means, made)
        made += self.zeros[self.record[self.window]]
        made += self.shown(sensors, wrong, loose, (path, pace, flanks, events, counts))
        about = made, path, pace, starts, (seen, loose), (angle, speed, rate), ahead, events, counts, flanks, flow
        runs.clear()
        return runs.setdefault(own, _Run(*about, twist, body))

    def _shared(self, effects: Sequence[Any]) -> tuple[Any, ...]:
        """Return what all starts share: rows, sensors, angles, drive's reading errors and motion, flanks, last run."""
        key = (id(self.drive[0]), *map(id, effects)), *(x.tobytes() for x in (self.zeros, self.turned, self.motion))
        if self._last is not None and self._last[0] == key:  # several starts are tried with the same effects
            return self._last[2]
        rows = [*self.base, *(row for effect in effects for row in effect.rows(self.values))]
        sensors = [one for one in (*self.effects, *effects) if hasattr(one, "observe")]
        zero, turned = (self.origins + self.zeros)[self.record][:, None], self.turned[self.record]
        seen = self.drive[0] + turned[:, :1]
        wrong = self.off(sensors, seen)
        drive = [own - off for own, off in zip(self.drive, wrong[1:], strict=True)] if wrong else self.drive
        loose = (self.radii[0] * drive[0] + zero) / self.radii[1] + turned[:, 1:]
        active, reverse = self.flanks(rows, drive[0] + turned[:, :1], loose)
        ahead, flanks = zero[:, 0] / self.radii[1] + turned[:, 1], (active, reverse + self.backlash)
        self._last = key, (self.drive, *effects), (rows, sensors, seen, loose, ahead, wrong, drive, flanks, {})
        return self._last[2]

    def off(self, sensors: Sequence[Any], seen: Array) -> list[Array] | None:
        """Return errors of the drive at the nodes: of the displacement's readings, of its motion, and two derivatives.

        Where the drive's readings less its curve are removed from the displacement, the curve's error is not in it, and
        what the curve does not follow of its encoder's errors is. These are at true angles: to second order here.
        """
        wrong, apart = self.misread(sensors, seen), self.apart[self.record, None]
        if wrong is None and not np.any(self.motion):
            return None
        made = [wrong[0], *wrong] if wrong else [np.zeros_like(seen)] * 4
        by = [np.einsum("wm,mwn->wn", self.motion[self.record], one) for one in self.drive_errors]
        for one in (each for each in sensors if each.gear == "drive" and not hasattr(each, "delay")):
            turn = one.amplitude * np.exp(1j * (one.phase + one.order * (seen - self.drive[0])[:, :1]))
            first, second = (self.unfollowed.of(n * one.order)[:, self.whole, : seen.shape[1]] for n in (1, 2))
            lacks = (turn * first).real + 0.5 * one.order * (turn * turn * second).imag
            by = [own - each for own, each in zip(by, lacks, strict=True)]
        return [own + each for own, each in zip(made, (apart * by[0], *by), strict=True)]

    def misread(self, sensors: Sequence[Any], seen: Array) -> tuple[Array, Array, Array] | None:
        """Return reading errors of the drive at the nodes, and their derivatives; ``None`` without any."""
        if not (own := [one for one in sensors if one.gear == "drive"]):
            return None
        wrong = reading_error(own, "drive", seen.ravel(), self.drive[1].ravel()).reshape(seen.shape)
        slope = np.gradient(wrong, axis=1) / self.step[:, None]
        return wrong, slope, np.gradient(slope, axis=1) / self.step[:, None]

    def shown(self, sensors: Sequence[Any], wrong: tuple[Array, ...] | None, loose: Array, course: Any) -> Array:
        """Return reading errors of the displacement [m], (n,).

        wrong: of :meth:`misread`; loose: angles at rest on the flank [rad]; course: of the trajectory.
        """
        made = np.zeros(len(self.window))
        if own := [one for one in sensors if one.gear == "loose"]:
            turn, waves = self.between(loose + course[0] / self.radii[1]), [x for x in own if not hasattr(x, "delay")]
            made = self.radii[1] * reading_error(waves, "loose", turn, turn, true=True)
            made += sum(lagged(self, course, loose, one.delay) for one in own if hasattr(one, "delay"))
        return made if wrong is None else made - self.radii[0] * self.between(wrong[0])

    def between(self, nodes: Array) -> Array:
        """Return values at the readings, interpolated linearly between the nodes, (n,)."""
        made = np.zeros(len(self.window))
        interpolated(nodes, self.window, self.node, self.beyond, made)
        return made

    def flanks(
        self, rows: Sequence[Row], drive: Array, loose: Array, known: tuple[Any, Any] = (None, None),
        places: tuple[Array, Array] | None = None,
    ) -> tuple[Array, Array]:  # fmt: skip
        """Return the shifts of the active and the reverse flank by effects at the nodes [m], (w, n) each.

        known: waves over the angles of each flank; places: displacement there, else where it is touched [m], (w, n).
        """
        rows = [row for row in rows if 200 < row.code < 300]
        if not rows:
            return np.zeros_like(drive), np.zeros_like(drive)
        made = []
        for flank, kept in enumerate(known):
            which = np.full(drive.size, flank)
            turn = (loose + (places[flank] if places else flank * self.backlash) / self.radii[1]).ravel()
            own = deviation(rows, self.pair, drive.ravel(), turn, which, kept)
            if not places and any(row.p[0] for row in rows):
                own = deviation(rows, self.pair, drive.ravel(), turn + own / self.radii[1], which)
            made.append(own.reshape(drive.shape))
        return made[0], made[1]

    def level(self, rest: Array) -> Array:
        """Return the mean square of residuals in each window, (w,); kicks count as readings."""
        count = np.maximum(np.bincount(self.window, minlength=len(self)), 1)
        return np.bincount(self.every[: len(rest)], rest * rest, len(self)) / count

    def weights(self, rest: Array) -> Array:
        """Return the weight of each residual by its window."""
        return self.weight[self.every[: len(rest)]]

    def usual(self, rest: Array) -> float:
        """Return the median mean square of residuals, less where these alternate, as counts do and no motion does."""
        return float(np.median(self.level(rest))) * min(self._together(rest), 1.0)

    def runs(self, rest: Array) -> float:
        """Return the number of consecutive readings with about the same residual, at least 1: that of white noise.

        Where model errors prevail, it is the same over 25 % of a window.
        """
        model = float(np.median((ROUNDED * self.backlash / self.sigma) ** 2))
        return max(self._together(rest), 0.25 * BINS * model, 1.0)

    def _together(self, rest: Array) -> float:
        """Return the mean square of sums over half a flight, over the sum of squares: 1 for white noise."""
        usual, rest = self.level(rest), rest[: len(self.window)]
        block = np.unique(self.window * BINS + self.order[: len(rest)] // RUN, return_inverse=True)[1]
        count = np.bincount(block)
        good = (usual <= 4.0 * np.median(usual))[self.window] & (count[block] == RUN)
        sums = np.bincount(block, np.where(good, rest, 0.0))
        return float(np.sum(sums**2) / np.sum(rest[good] ** 2)) if np.any(good) else 1.0

    def early(self, until: float, count: int) -> Array:
        """Return 1 for readings in the first part of their window, and for kicks, else 0, (count,)."""
        kept = (self.node + self.beyond) / (self.drive[0].shape[1] - 1) <= until
        return np.concatenate([kept, np.ones(count - len(kept), dtype=bool)]).astype(float)

    def restart(self, effects: Sequence[Any], *, anew: bool = False, until: float = 1.0) -> None:
        """Choose the start of each window among flights through its first readings and rest on either flank."""
        poor = np.arange(len(self)) if anew else self.poor(effects, self.residuals(effects))
        if not len(poor):
            return
        part = self if len(poor) == len(self) else self.only(poor)[0]
        best, kept = np.full(len(part), np.inf), part.starts
        for one in [*([] if anew else [kept]), *part.beginnings(effects)]:
            left = part.residuals(effects, one)
            left = part.level(left * part.early(until, len(left)))
            better = left < BETTER * best
            best = np.where(better, left, best)
            kept = one.where(better, kept)
        if len(film_of([row for effect in (*self.effects, *effects) for row in effect.rows(self.values)])):
            run = part._run(effects, kept)  # starts on a film are free as well
            kept = at_rest(run.path[:, 0].copy(), run.pace[:, 0].copy())
        self.starts = self.starts.put(poor, kept)

    def poor(self, effects: Sequence[Any], rest: Array) -> Array:
        """Return the windows whose residuals exceed noise, (k,); all where impacts have kicks."""
        return np.flatnonzero((self.level(rest) > NOISE) | (self.spread(effects) > 0.0))

    def beginnings(self, effects: Sequence[Any]) -> list[Starts]:
        """Return initial starts of all windows: at rest on either flank, and flights through the first readings."""
        none = np.zeros(len(self))
        tried = [at_rest(none, none, mode) for mode in (1, 2)]
        now = self._run(effects, self.starts)
        fall = -self.lever * self.values.drag_torque - self.radii[0] * now.drive[2]
        step = self.step[:, None]
        rate = np.concatenate([none[:, None], np.cumsum(0.5 * (fall[:, 1:] + fall[:, :-1]), axis=1) * step], axis=1)
        pulled = np.concatenate([none[:, None], np.cumsum(0.5 * (rate[:, 1:] + rate[:, :-1]), axis=1) * step], axis=1)
        bare = self.read - (now.made - self.between(now.path)) - self.between(pulled)
        return tried + [at_rest(*self._line(bare, taken)) for taken in TAKEN]

    def _line(self, values: Array, taken: int) -> tuple[Array, Array]:
        """Return beginning and slope of a straight line through the first values of each window, (w,) each."""
        near = self.order[: len(values)] < taken
        return straight((self.time - self.begin[self.window])[near], values[near], self.window[near], len(self))

    def keep_readings(self, before: Sequence[Any], effects: Sequence[Any]) -> None:
        """Move starts, and datums where that fits better, by what sensors read differently with other effects."""
        run, zeros, errors, tries = self._run(before, self.starts), self.zeros, [], []
        for sensed in (before, effects):
            _, sensors, _, loose, _, wrong, *_ = self._shared(sensed)
            errors.append(self.shown(sensors, wrong, loose, run.course))
        own, more = self.record[self.window], errors[1] - errors[0]
        mean = np.bincount(own, more, len(zeros)) / np.maximum(np.bincount(own, minlength=len(zeros)), 1.0)
        for shift in (0.0 * mean, mean):  # a delay is read as a shift of the datum
            place, rate = self._line(more - shift[own], TAKEN[0])
            starts = self.starts._replace(place=self.starts.place - place, rate=self.starts.rate - rate)
            self.zeros = zeros - shift
            tries.append((self.usual(self.residuals(effects, starts)), self.zeros, starts))
        _, self.zeros, self.starts = min(tries, key=lambda one: one[0])

    @property
    def pivot(self) -> float:
        """Mean speed of the loose gear [rad/s]."""
        return max(float(np.mean(np.abs(self.drive[1]))) * self.radii[0] / self.radii[1], 1e-9)

    def units(self) -> tuple[float, float]:
        """Return the unit of a start's place [m] and rate [m/s]."""
        return self.backlash, self.backlash / self.fall

    def turns(self) -> tuple[float, float]:
        """Return the unit of a twist [rad] and its rate [rad/s]."""
        return self.backlash / self.radii[1], FLUNG * self.backlash / self.fall / self.radii[1]

    def moved(self, columns: Sequence[Array], rest: Array, spread: float, most: float = np.inf) -> Starts:
        """Return the starts of least residuals, by linear least squares within each window.

        Args:
            columns: of :meth:`Linearised.starts`.
            rest: residuals.
            spread: standard deviation of the restitution, the unit of the kicks.
            most: largest step of place and rate of a start, in units.
        """
        own, left = self.dense(columns), self.dense([rest])[:, 0, :, None]
        size = np.sqrt(np.sum(own * own, axis=2))
        own = own / np.where(size > 0.0, size, 1.0)[:, :, None]
        inverse = np.linalg.pinv(own @ own.transpose(0, 2, 1), rcond=1e-9, hermitian=True)
        step = (inverse @ (own @ left))[:, :, 0] / np.where(size > 0.0, size, 1.0)
        own, now = len(columns) - (KICKS if spread else 0), self.starts
        by, units = np.clip(step[:, :own], -most, most), self.units()
        kicks = now.kicks + spread * np.clip(step[:, own:], -FARTHEST_KICK, FARTHEST_KICK) if spread else now.kicks
        twist = now.twist + by[:, 2:] * self.turns() if own > 2 else now.twist
        return Starts(now.place + by[:, 0] * units[0], now.rate + by[:, 1] * units[1], now.mode, kicks, twist)

    def dense(self, columns: Sequence[Array] | Array) -> Array:
        """Return columns by window, padded with zeros, (w, p, most readings + kicks)."""
        count = len(columns[0])
        at, most = self._at(count)
        made = np.zeros((len(columns), len(self) * most))
        for row, column in zip(made, columns, strict=True):
            row[at] = column
        return made.reshape(len(columns), len(self), most).transpose(1, 0, 2)

    def _at(self, count: int) -> tuple[Array, int]:
        """Return the positions of readings, and kicks, in an array padded to the longest window, and its length."""
        most = int(self.order[:count].max(initial=-1)) + 1
        return self.every[:count] * most + self.order[:count], most

    def gathered(self, dense: Array, like: Array) -> Array:
        """Return columns, (n,) or (k, n), from padded ones, (w, k, most)."""
        rows = dense.transpose(1, 0, 2).reshape(dense.shape[1], -1)
        return rows[:, self._at(like.shape[-1])[0]].reshape(like.shape)


class _Run(NamedTuple):
    """Trajectories of a rig in all windows.

    Args:
        made: predicted readings of the displacement [m], (n,).
        path: at the nodes [m], (w, nodes).
        pace: rate there [m/s], (w, nodes).
        starts: from which.
        seen: angles of the drive as read and of the loose gear on its flank at the nodes, for effects [rad].
        drive: true angle of the drive at the nodes [rad], and two derivatives.
        ahead: loose gear's angle, as argument of effects, at the model's 0 [rad], (w,).
        events: of the windows, (w, most, 7).
        counts: how many, (w,).
        flanks: displacement on the active and on the reverse flank at the nodes [m], (w, nodes) each.
        flow: transition matrices between nodes with oil films, (w, nodes - 1, 4); empty without.
        twist: of a second body at the nodes [rad], (w, nodes); empty without.
        body: its inertia, stiffness, damping and half of its play, (4,); empty without.
    """

    made: Array
    path: Array
    pace: Array
    starts: Starts
    seen: tuple[Array, Array]
    drive: tuple[Array, Array, Array]
    ahead: Array
    events: Array
    counts: Array
    flanks: tuple[Array, Array]
    flow: Array
    twist: Array
    body: Array

    @property
    def course(self) -> tuple[Any, ...]:
        """What readings follow from."""
        return self.path, self.pace, self.flanks, self.events, self.counts


class Linearised:
    """Trajectories of a rig with effects, and their sensitivities to starts and effects.

    Args:
        windows: of the trajectories.
        effects: in addition to those of the rig.
        run: trajectories.
    """

    def __init__(self, windows: Windows, effects: Sequence[Any], run: _Run) -> None:
        self.windows, self.effects, self.run = windows, effects, run
        self.spread = windows.spread(effects)
        rows = [row for effect in (*windows.effects, *effects) for row in effect.rows(windows.values)]
        self.oiled = any(row.code == Code.GAP_FILM for row in rows)
        self.places = (run.path, run.path) if any(row.code == Code.GAP_SPRING for row in rows) else run.flanks
        self.rest = windows.rest(run.made, run.starts, self.spread)
        self.none = np.zeros(windows.drive[0].shape)
        self.waves: tuple[dict[Any, Any], dict[Any, Any]] = {}, {}
        self.reader = reader_of(run.path, run.pace, run.flanks, run.events, run.counts, windows.step, *windows.means)

    def starts(self) -> list[Array]:
        """Return sensitivities of predictions to place and rate of their window's start, and to kicks, per unit.

        Starts on a flank are fixed; with a second body, twist and its rate are free.
        """
        free = (self.run.starts.mode == 0).astype(float)  # fixed on a flank
        windows, still = self.windows, np.zeros(self.run.events.shape[:2])
        units = windows.units()
        if self.oiled:  # in a thin film the motion changes within a step
            columns = []
            for k in (0, 1):
                moved = list(self.run.starts)
                moved[k] = moved[k] + NEXT * units[k] * free
                columns.append((self.rest - windows.residuals(self.effects, Starts(*moved))) / NEXT)
            return columns
        none, flanks = np.zeros(len(free)), (self.none, self.none, self.none)
        starts = (free * units[0], none), (none, free * units[1])
        made = [self.extended(self._followed(flanks, still, one) / windows.sigma) for one in starts]
        for unit in np.diag(windows.turns()) if len(self.run.body) else ():
            twist = np.tile(unit, (len(free), 1))
            made.append(self.extended(self._followed(flanks, still, (none, none), twist) / windows.sigma))
        if not self.spread:
            return made
        window, place, number = impacts_of(self.run.events)
        for k in range(KICKS):
            own = np.zeros(self.run.events.shape[:2])
            own[window[number == k], place[number == k]] = self.spread
            column = self.extended(self._followed(flanks, own, (none, none)) / windows.sigma)
            column[len(windows.time) + k :: KICKS] = 1.0
            made.append(column)
        return made

    def extended(self, columns: Array) -> Array:
        """Return columns, (n,) or (k, n), in standard deviations, whitened, with zeros for kicks if any."""
        kicks = np.zeros((*columns.shape[:-1], len(self.rest) - columns.shape[-1]))
        return np.concatenate([self.windows.whitened(columns), kicks], axis=-1)

    def column(self, effect: Any, before: Any = None, turned: tuple[float, float] = (0.0, 0.0)) -> Array:
        """Return the sensitivity of predictions to another effect, in standard deviations, (n,)."""
        return self.extended(self.change(effect, before, turned))

    def change(self, effect: Any, before: Any = None, turned: tuple[float, float] = (0.0, 0.0)) -> Array:
        """Return the change of displacements at the readings by another effect, in standard deviations, (n,).

        Args:
            effect: in addition to those of the run.
            before: one of those, which it replaces.
            turned: shifts of the angular datums of drive and loose gear for it [rad].
        """
        windows, run = self.windows, self.run
        pushed, active, reverse, driven = self.none, self.none, self.none, self.none
        rebound, shown = np.zeros(run.events.shape[:2]), 0.0
        for sign, one, by in ((1.0, effect, turned), (-1.0, before, (0.0, 0.0))):
            if one is None:
                continue
            rows = one.rows(windows.values)
            seen, loose = (own + more if more else own for own, more in zip(run.seen, by, strict=True))
            if any(100 < row.code < 200 for row in rows):
                made, about = np.empty_like(self.none), np.array([*windows.radii, windows.lever])
                slowing(windows.begin, windows.step, *run.drive[:2], about, run.ahead + by[1], torques_of(rows),
                        run.path, run.pace, made)  # fmt: skip
                pushed = pushed + sign * made
            if any(200 < row.code < 300 for row in rows):
                keep = not any(by) and not any(row.code == Code.FLANK_TOOTH for row in rows)
                angle, known = seen - windows.drive[0] + run.drive[0], self.waves if keep else (None, None)
                moved = windows.flanks(rows, angle, loose, known, self.places)
                active, reverse = active + sign * moved[0], reverse + sign * moved[1]
            for row in rows:
                if Code.IMPACT_OFFSET <= row.code <= Code.IMPACT_FLANK:
                    form = (1.0, np.abs(run.events[:, :, 4]), 0.5 * run.events[:, :, 3])[row.code - Code.IMPACT_OFFSET]
                    rebound = rebound + sign * row.p[0] * form
            if hasattr(one, "observe"):
                wrong = windows.misread([one], seen)
                if wrong is not None:
                    pushed = pushed + sign * windows.radii[0] * wrong[2]
                    driven = driven + sign * windows.radii[0] * wrong[2]
                shown = shown + sign * windows.shown([one], wrong, loose, run.course)
        none = np.zeros(len(windows))
        made = self._followed((pushed, active, reverse), rebound, (none, none), driven=driven) + shown
        return made / windows.sigma

    def driven(self) -> Array:
        """Return sensitivities of predictions to harmonics of their record's drive, per standard deviation, (m, n)."""
        windows, none, made = self.windows, np.zeros(len(self.windows)), []
        still, radius = np.zeros(self.run.events.shape[:2]), windows.radii[0]
        for wrong, pushed in zip(radius * windows.drive_errors[0], radius * windows.drive_errors[2], strict=True):
            own = self._followed((pushed, self.none, self.none), still, (none, none), driven=pushed)
            made.append(own - windows.between(windows.apart[windows.record, None] * wrong))
        return self.extended(np.array(made).reshape(-1, len(windows.time)) / windows.sigma)

    def corrected(self, motion: Array, driven: Array | None = None) -> Array:
        """Return changes of predictions by corrections of the drive's motion, (r, m), given its sensitivities, (n,)."""
        record = self.windows.record[self.windows.every[: len(self.rest)]]
        return np.sum(motion.T[:, record] * (self.driven() if driven is None else driven), axis=0)

    def _followed(
        self, pushed: tuple[Array, Array, Array], rebound: Array, starts: tuple[Array, Array],
        twist: Array | None = None, driven: Array | None = None,
    ) -> Array:  # fmt: skip
        """Return the change of the displacement at the readings [m], (n,).

        Args:
            pushed: changes of the acceleration, and of both flanks, at the nodes.
            rebound: of restitution at the events.
            starts: of place and rate.
            twist: of a body's twist and its rate, (w, 2).
            driven: part of the change of the acceleration by the drive.
        """
        windows, run = self.windows, self.run
        made = np.zeros((*self.none.shape, 2))
        if len(run.body):
            about = np.array([*windows.radii, windows.lever])
            twist = np.zeros((len(windows), 2)) if twist is None else twist
            driven = self.none if driven is None else driven
            swayed(windows.step, run.starts.mode, run.events, run.counts, run.twist, about, run.body, pushed[0], driven,
                   *pushed[1:], rebound, *starts, twist, made)  # fmt: skip
        elif run.flow.size:
            carried(windows.step, run.flow, run.path, run.flanks, *pushed, *starts, made)
        else:
            follow(windows.step, run.starts.mode, run.events, run.counts, *pushed, rebound, *starts, made)
        return self.reader @ made.ravel()
