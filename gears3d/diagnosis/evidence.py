"""One record as evidence: its path, its channels, the states of predictions, and whitened values without nuisances.

Residuals and predictions are compared in standard deviations of independent noise, after projection of the nuisances of
a record: start angle and speed of each flight, datum of the displacement, mean speed and phase of the drive.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import csr_matrix

from gears3d.diagnosis.channels import BINS, Channels, Drive, Losses, channels, no_channels
from gears3d.diagnosis.shooting_kernels import LEAVES, SETTLES, body_of, film_of, flank_at
from gears3d.effects import Code
from gears3d.kernels import njit
from gears3d.lumped.compile import tight
from gears3d.lumped.flanks import perfect
from gears3d.measured.segmentation import Track, doubtful, path_of
from gears3d.recording import Recording
from gears3d.signals.whitening import Filter, coloured, filter_of, roots_of, whitened

if TYPE_CHECKING:
    from gears3d.effects import Rig, Row
    from gears3d.gears import Pair
    from gears3d.measured.checks import Admitted
    from gears3d.measured.segmentation import Measurement
    from gears3d.measured.segmentation.flanks import Flanks
    from gears3d.measured.segmentation.segments import Segments
    from gears3d.scenario import Scenario

Array = np.ndarray
# Largest ratio of the jerk of a gap at contact loss to the largest jerk of the drive.
STEEPEST_LOSS = 4.0
# Integration steps per bin of a flight.
FINE = 4
# Rows above which a path is not cached, because of its memory.
LONGEST_CACHED = 1 << 20
# Blocks, of a 40th of a fall, over which a gear must fly after a window begins; residual from a parabola up to which it
# does, in backlashes and in multiples of the least one: an impact at 10 % of the speed after a fall has 5e-4 to 9e-4.
FLIGHT, PARABOLA = 8, (1e-3, 3.0)
# Smallest distance from a flank of readings in flight, in backlashes; smallest number of readings of a flight, and
# largest number of flights; lowest frequency in periods per median flight, highest in readings per period, and ratio of
# neighbouring frequencies of their periodogram; part of the deviation of flights from a parabola that an oscillation
# must explain, and its least size in variances of the noise.
BETWEEN, FLIGHT_READINGS, FLIGHTS = 0.06, 16, 200
CYCLES, PER_CYCLE, RATIO = 0.8, 6.0, 1.02
SHARE, LEVEL = 0.4, 1.5
# Largest number of readings of a mean at which a trajectory is read.
MEANS = 8


@dataclass(frozen=True, eq=False)
class Motion:
    """The drive's motion of a record: mean speed and harmonics, measured at the nominal frequencies.

    Args:
        mean: [rad/s].
        harmonics: cosine and sine part of the angle [rad], angular frequency [rad/s], each (h, 3).
    """

    mean: float
    harmonics: Array

    def speed(self, time: Array) -> Array:
        """Return the drive's speed [rad/s] at times (n,) [s]."""
        total = np.full_like(time, self.mean)
        for cosine, sine, turn in self.harmonics:
            total += turn * (sine * np.cos(turn * time) - cosine * np.sin(turn * time))
        return total


@dataclass(frozen=True, eq=False)
class Evidence:
    """One record, prepared for the comparison with predictions.

    Args:
        name: of the record.
        scenario: of the test rig under this record's conditions.
        rig: its constants.
        pair: its nominal gears.
        rows: rows of the effects that the rig has already.
        channels: of the record.
        motion: of the drive.
        fine: time [s], angle [rad] and speed [rad/s] of the loose gear in flight, each (f, FINE*(BINS-1)+1).
        at: indices of the points of flights among the fine ones, (f, BINS).
        spared: sensor effects that were removed from the readings before segmentation; predictions omit them.
        unmarked: gears whose encoders have an unknown angular datum in this record.
        turned: added to the angles of drive and loose gear as read [rad].
        flanks: used in its segmentation, over the angles as read.
        doubt: fraction of the record that its segmentation does not explain.
        stated: whether the harmonics of the drive's motion are specified for it, so that the drive can deviate from
            them.
        cache: cache of derived values; a record with other points starts with an empty one.
    """

    name: str
    scenario: Scenario
    rig: Rig
    pair: Pair
    rows: tuple[Row, ...]
    channels: Channels
    motion: Motion
    fine: tuple[Array, Array, Array]
    at: Array
    spared: tuple[Any, ...] = ()
    unmarked: tuple[str, ...] = ()
    turned: tuple[float, float] = (0.0, 0.0)
    flanks: Flanks | None = None
    doubt: float = 0.0
    stated: bool = True
    cache: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    @property
    def radii(self) -> tuple[float, float]:
        """Base radii of drive and loose gear [m]."""
        return self.rig.base_radius_drive, self.rig.base_radius_loose

    @property
    def drive(self) -> Drive:
        """Points of the drive's motion that are compared with a specified one; empty without one."""
        seen = self.channels.drive
        return seen if self.stated else seen._replace(time=seen.time[:0], angle=seen.angle[:0])


def evidence(
    found: Measurement, scenario: Scenario, name: str = "", spared: tuple[Any, ...] = (), *, stated: bool = True
) -> Evidence:
    """Return a measured record as evidence."""
    return of_cut(found.segments, scenario, name, spared, stated=stated)


def of_cut(
    cut: Segments, scenario: Scenario, name: str = "", spared: tuple[Any, ...] = (), *, stated: bool = True
) -> Evidence:
    """Return a segmented record as evidence."""
    seen = channels(cut)
    fine, at = _fine_grid(seen)
    motion = _drive_motion(seen, scenario)
    seen = _clear_losses(seen, motion, scenario.rig().base_radius_drive)
    return Evidence(name, scenario, scenario.rig(), scenario.pair(), scenario.rows(), seen, motion, fine, at,
                    spared, flanks=cut.flanks, doubt=doubtful(cut), stated=stated)  # fmt: skip


def has_compliance(rig: Scenario) -> bool:
    """Whether a rig has a law of contact already, so that segmentation by rigid flanks is invalid."""
    return any(row.code in (Code.GAP_SPRING, Code.GAP_FILM) for row in rig.rows())


def shootable(rig: Scenario) -> bool:
    """Return whether the model of windows covers a rig: no table of flank deviations, torques by a formula.

    A second body on the loose gear is covered between rigid dry flanks.
    """
    rows = rig.rows()
    able = perfect(rig.pair()) and all(row.code != Code.TORQUE_TABLE for row in rows)
    return able and (not len(film_of(rows)) or not len(body_of(rows)))


def _clear_losses(seen: Channels, motion: Motion, radius: float) -> Channels:
    """Return channels without losses whose gap opens faster than the drive's motion explains: peaks of bounces."""
    if not len(motion.harmonics):
        return seen
    cosine, sine, turn = motion.harmonics.T
    good = seen.losses.growth[:, 0] < STEEPEST_LOSS * radius * float(np.sum(turn**3 * np.hypot(cosine, sine)))
    left_out = {**seen.left_out, "loss": seen.left_out["loss"] + int(np.sum(~good))}
    return seen._replace(losses=Losses(*(column[good] for column in seen.losses)), left_out=left_out)


def uncut(scenario: Scenario, name: str = "") -> Evidence:
    """Return a record that could not be segmented: no channel has a point.

    Args:
        scenario: of the test rig under this record's conditions.
        name: of the record.
    """
    seen = no_channels()
    fine, at = _fine_grid(seen)
    none = Motion(scenario.motion.mean, np.zeros((0, 3)))
    return Evidence(name, scenario, scenario.rig(), scenario.pair(), scenario.rows(), seen, none, fine, at)


def _drive_motion(seen: Channels, scenario: Any) -> Motion:
    drive = seen.drive
    turns = sorted({2.0 * pi * one.frequency for one in scenario.motion.harmonics})
    middle = float(drive.time.mean()) if len(drive.time) else 0.0
    columns = [np.ones_like(drive.time), drive.time - middle]
    for turn in turns:
        shrunk = np.sinc(turn * drive.width / (2.0 * pi))  # a mean over time flattens a sine
        columns += [shrunk * np.cos(turn * drive.time), shrunk * np.sin(turn * drive.time)]
    found = np.linalg.lstsq(np.column_stack(columns), drive.angle, rcond=None)[0]
    pairs = found[2:].reshape(-1, 2)
    return Motion(float(found[1]), np.column_stack([pairs, turns]) if turns else np.zeros((0, 3)))


def _fine_grid(seen: Channels) -> tuple[tuple[Array, Array, Array], Array]:
    """Return the paths of flights as parabolas on a fine grid."""
    flights, count = seen.flights, FINE * (BINS - 1) + 1
    if not len(flights.time):
        none = np.zeros((0, count))
        return (none, none, none), np.zeros((0, BINS))
    middle = flights.time.mean(axis=1, keepdims=True)
    half = np.abs(flights.time - middle).max(axis=1, keepdims=True)
    x = (flights.time - middle) / half
    powers = np.stack([np.ones_like(x), x, x * x], axis=-1)
    normal = np.einsum("fka,fkb->fab", powers, powers)
    numbers = np.linalg.solve(normal, np.einsum("fka,fk->fa", powers, flights.loose)[..., None])[..., 0]
    first, last = flights.time[:, :1], flights.time[:, -1:]
    time = first + np.linspace(0.0, 1.0, count) * (last - first)
    y = (time - middle) / half
    angle = numbers[:, :1] + y * (numbers[:, 1:2] + y * numbers[:, 2:])
    speed = (numbers[:, 1:2] + 2.0 * y * numbers[:, 2:]) / half
    return (time, angle, speed), (flights.time - first) / (last - first) * (count - 1)


class Paths:
    """Paths of the records of one diagnosis."""

    def __init__(self) -> None:
        self._known: dict[tuple[int, float], tuple[Admitted, Track]] = {}

    def of(self, one: Admitted, delay: float = 0.0) -> Track:
        """Return displacement and angles of a record without a delay [s] of the loose gear's readings.

        delay: [s].

        Raises:
            InputError: there are too few readings, or a gear stands still.
        """
        key = (id(one), delay)
        if key in self._known:
            return self._known[key][1]
        record = one.recording if delay == 0.0 else _without_delay(one.recording, delay)
        known = path_of(record, one.rig, one.file)
        if len(record.time) <= LONGEST_CACHED:
            self._known[key] = (one, known)  # with the record: while it is held, no other has its id
        return known


def _without_delay(record: Recording, delay: float) -> Recording:
    """Return a record without a delay of the loose gear's readings, shortened by it.

    The loose gear is shifted by whole rows, so that its noise is unchanged; fractions of a row shift the drive, which
    moves smoothly.
    """
    time = record.time
    spacing = float(np.median(np.diff(time)))
    rows = round(delay / spacing)
    kept = np.arange(max(-rows, 0) + 1, len(time) - max(rows, 0) - 1)
    drive = np.interp(time[kept] - (delay - rows * spacing), time, record.signals["theta_drive_rad"])
    signals = {name: values[kept] for name, values in record.signals.items()}
    signals |= {"theta_drive_rad": drive, "theta_loose_rad": record.signals["theta_loose_rad"][kept + rows]}
    return Recording(signals, meta=record.meta)


def begin_of_flight(place: Array) -> int:
    """Return the first of consecutive blocks of a gear's displacement from which on it follows a parabola for a while.

    A flank that moves may have been taken for a flight, and a window that begins at an impact has no start that fits.

    Args:
        place: in backlashes, (n,).
    """
    if len(place) < 2 * FLIGHT:
        return 0
    own = np.lib.stride_tricks.sliding_window_view(place, FLIGHT)
    along = np.linalg.qr(np.vander(np.arange(FLIGHT) - 0.5 * (FLIGHT - 1), 3))[0]
    own = own - own[:, :1]
    left = np.sqrt(np.mean((own - own @ along @ along.T) ** 2, axis=1))
    return int(np.argmax(left <= max(PARABOLA[0], PARABOLA[1] * float(np.min(left)))))


def means_of(time: Array, place: Array, most: int) -> tuple[int, Array, Array, Array]:
    """Return the number of readings in at most about so many means, their times and places, and times of readings.

    The last are (n, MEANS), NaN where a mean has fewer.
    """
    size = max(len(time) // most, 1)
    bins, many = len(time) // size, min(size, MEANS)
    time, place = (column[: bins * size].reshape(bins, size) for column in (time, place))
    single = np.full((bins, MEANS), np.nan)
    single[:, :many] = time[:, ((np.arange(many) + 0.5) / many * size).astype(int)]
    return size, time.mean(axis=1), place.mean(axis=1), single


@njit(cache=True, error_model="numpy")
def read(
    path: Array, pace: Array, flanks: tuple[Array, Array], events: Array, counts: Array, step: Array, window: Array,
    node: Array, share: Array, single: Array, made: Array,
) -> None:  # fmt: skip
    """Interpolate displacements between nodes and events at means of readings.

    Without an event between these, by place and curvature at the mean time; else at each reading. Arguments but the
    means', (n,), are those of trajectories, (w, ...); single: places of readings in steps, (n, MEANS), else NaN.
    """
    first, before = 0, -1
    for k in range(len(window)):
        w, total, square = window[k], 0.0, 0.0
        first, before = (first if w == before else 0), w
        one = (path[w], pace[w], flanks[0][w], flanks[1][w], events[w, : counts[w]], step[w])
        first, many, bent = _span(one, single[k], first)
        for n in range(many if bent else 0):
            total += _between(one, single[k, n], first)
        if bent:
            made[k] = total / many
            continue
        for n in range(many):
            square += (single[k, n] - node[k] - share[k]) ** 2
        made[k] = _between(one, node[k] + share[k], first)
        made[k] += 0.5 * step[w] * (pace[w, node[k] + 1] - pace[w, node[k]]) * square / many


def reader_of(
    path: Array, pace: Array, flanks: tuple[Array, Array], events: Array, counts: Array, step: Array, window: Array,
    node: Array, share: Array, single: Array,
) -> csr_matrix:  # fmt: skip
    """Return the sensitivities of means of readings to changes of places and rates at nodes, (n, 2 w nodes)."""
    most = len(window) * 4 * MEANS
    columns, parts, ends = np.zeros(most, dtype=np.int32), np.zeros(most), np.zeros(len(window) + 1, dtype=np.int32)
    _weigh(path, pace, flanks, events, counts, step, window, node, share, single, columns, parts, ends)
    return csr_matrix((parts[: ends[-1]], columns[: ends[-1]], ends), shape=(len(window), 2 * path.size))


@njit(cache=True, error_model="numpy")
def _weigh(
    path: Array, pace: Array, flanks: tuple[Array, Array], events: Array, counts: Array, step: Array, window: Array,
    node: Array, share: Array, single: Array, columns: Array, parts: Array, ends: Array,
) -> None:  # fmt: skip
    """Write columns and values of a sparse matrix of sensitivities of means, and the end of each row."""
    first, before, count, last = 0, -1, 0, path.shape[1] - 2
    by = np.zeros(4)
    for k in range(len(window)):
        w, square = window[k], 0.0
        first, before = (first if w == before else 0), w
        one = (path[w], pace[w], flanks[0][w], flanks[1][w], events[w, : counts[w]], step[w])
        first, many, bent = _span(one, single[k], first)
        for n in range(0 if bent else many):
            square += (single[k, n] - node[k] - share[k]) ** 2 / many
        many = many if bent else 1
        for n in range(many):
            place = single[k, n] if bent else node[k] + share[k]
            i = min(max(int(place), 0), last)
            _weights(one, i, place - i, square, first, by)
            for m in range(4):
                if by[m] != 0.0:
                    columns[count], parts[count] = 2 * (w * (last + 2) + i) + m, by[m] / many
                    count += 1
        ends[k + 1] = count


@tight
def _weights(one: tuple[Array, ...], i: int, f: float, square: float, first: int, by: Array) -> None:
    """Write the weights of place and rate of both nodes of a step for a change at a part of it.

    A change is cubic, or linear from both nodes to an event, and linear between two events, as the place is where it
    does not change by the mean rate. square: mean square of the readings' places about their mean.
    """
    path, pace, _, _, events, h = one
    by[:] = 0.0
    while first < len(events) and events[first, 0] < i:
        first += 1
    last, r = first, 1.0 - f
    while last < len(events) and events[last, 0] == i:
        last += 1
    if first == last and _is_smooth(path, pace, i, h):
        by[0], by[2] = (1.0 + 2.0 * f) * r * r, f * f * (3.0 - 2.0 * f)
        by[1], by[3] = f * r * r - 0.5 * square, 0.5 * square - f * f * r
    elif first < last and f < events[first, 1]:
        by[0], by[1] = 1.0, f
    elif first < last and f >= events[last - 1, 1]:
        by[2], by[3] = 1.0, -r
    else:
        by[0], by[2] = r, f


@tight
def _span(one: tuple[Array, ...], single: Array, first: int) -> tuple[int, int, bool]:
    """Return the first event from the step of a mean on, its number of readings, and whether an event lies between.

    A step whose place does not change by the mean rate, as in a film, counts as well.
    """
    path, pace, _, _, events, h = one
    many, last = 0, len(path) - 2
    while many < len(single) and not np.isnan(single[many]):
        many += 1
    low, high = min(max(int(single[0]), 0), last), min(int(single[many - 1]), last)
    while first < len(events) and events[first, 0] < low:
        first += 1
    if first < len(events) and events[first, 0] <= high:
        return first, many, True
    for i in range(low, high + 1):
        if not _is_smooth(path, pace, i, h):
            return first, many, True
    return first, many, False


@tight
def _is_smooth(path: Array, pace: Array, i: int, h: float) -> bool:
    """Return whether the place changes by the mean rate from a node to the next."""
    off = path[i + 1] - path[i] - 0.5 * h * (pace[i] + pace[i + 1])
    return abs(off) < 0.2 * h * abs(pace[i + 1] - pace[i]) + 1e-12


@tight
def _between(one: tuple[Array, ...], place: float, first: int) -> float:
    """Return the displacement of a trajectory at a place in steps: a cubic, or parabolas between its events.

    Without events in a step where the place does not change by the mean rate: linear. first: number of an event before.
    """
    path, pace, active, reverse, events, h = one
    i = min(max(int(place), 0), len(path) - 2)
    f = place - i
    while first < len(events) and events[first, 0] < i:
        first += 1
    if first == len(events) or events[first, 0] > i:
        r = 1.0 - f
        if not _is_smooth(path, pace, i, h):
            return r * path[i] + f * path[i + 1]
        cubic = path[i] * (1.0 + 2.0 * f) * r * r + path[i + 1] * f * f * (3.0 - 2.0 * f)
        return cubic + h * f * r * (pace[i] * r - pace[i + 1] * f)
    begin, s, v, settled, own = 0.0, path[i], pace[i], False, active
    while first < len(events) and events[first, 0] == i:
        at, leaves = events[first, 1], events[first, 2] == LEAVES
        own = active if events[first, 3] > 0.0 else reverse
        here, lean = flank_at(own, i, at, h)
        if f < at:
            if leaves:
                return flank_at(own, i, f, h)[0]
            x = (f - begin) * h
            return s + v * x + (here - s - v * (at - begin) * h) * ((f - begin) / (at - begin)) ** 2
        settled = events[first, 2] == SETTLES
        begin, s, v = at, here, (lean if leaves else lean - events[first, 5] * events[first, 4])
        first += 1
    if settled:
        return flank_at(own, i, f, h)[0]
    r, end = 1.0 - f, pace[i + 1] * h
    back = (r / (1.0 - begin)) ** 2 if begin < 1.0 else 0.0
    return path[i + 1] - r * end + (s - path[i + 1] + (1.0 - begin) * end) * back


def lagged(windows: Any, course: tuple[Any, ...], loose: Array, late: float) -> Array:
    """Return how displacements change where the loose gear is read later [m], (n,); its speed jumps at impacts.

    course: of the trajectory; loose: angles at rest on the flank [rad], (w, nodes); late: delay [s].
    """
    window, node, share, single = windows.means
    step, made, last = windows.step[window], [], loose.shape[1] - 1
    turn = windows.radii[1] * (loose - loose[:, :1])
    speed, rise = (windows.radii[0] * own for own in windows.drive[1:])
    for by in (np.zeros(len(window)), late / step):
        at = node + share - by
        inside, edge = np.clip(at, 0.0, last), np.where(at < 0.0, 0, last)
        whole = np.clip(np.floor(inside).astype(node.dtype), 0, last - 1)
        f, beyond, own = inside - whole, (at - inside) * step, np.zeros(len(window))
        read(*course, windows.step, window, whole, f, np.clip(single - by[:, None], 0.0, last), own)
        x, y = (turn[window, whole + k] for k in (0, 1))
        v, u = (speed[window, whole + k] * step for k in (0, 1))
        own += x + f * (v + f * (3.0 * (y - x) - 2.0 * v - u + f * (2.0 * (x - y) + v + u)))
        own += beyond * (course[1] + speed)[window, edge] + 0.5 * beyond**2 * rise[window, edge]  # outside the window
        made.append(own)
    return made[1] - made[0]


@njit(cache=True, error_model="numpy")
def interpolated(nodes: Array, window: Array, node: Array, share: Array, made: Array) -> None:
    """Interpolate values at nodes, (w, nodes), linearly at readings, (n,)."""
    for k in range(len(window)):
        first = nodes[window[k], node[k]]
        made[k] = first + share[k] * (nodes[window[k], node[k] + 1] - first)


def straight(x: Array, y: Array, window: Array, count: int) -> tuple[Array, Array]:
    """Return value at 0 and slope of a straight line through the values of each window, (count,) each."""
    n, sx, sy, sxx, sxy = (np.bincount(window, each, count) for each in (x**0, x, y, x * x, x * y))
    spread = n * sxx - sx**2
    slope = np.where(spread > 0.0, (n * sxy - sx * sy) / np.where(spread > 0.0, spread, 1.0), 0.0)
    return (sy - slope * sx) / np.maximum(n, 1), slope


def flights(windows: Any) -> list[tuple[Array, Array]]:
    """Return times and displacements of free flights, less the drive's motion and with its noise.

    Args:
        windows: of multiple shooting.
    """
    turned = windows.read + windows.radii[0] * windows.between(windows.drive[0])
    amid = in_gap(windows)
    cut = np.flatnonzero(np.diff(amid.astype(int)) | np.diff(windows.window)) + 1
    made = []
    for rows in np.split(np.arange(len(amid)), cut):
        if amid[rows[0]] and len(rows) >= FLIGHT_READINGS:
            made.append((windows.time[rows], turned[rows] / windows.sigma[rows]))
    every = np.linspace(0, len(made) - 1, min(len(made), FLIGHTS)).round().astype(int)
    return [made[k] for k in every]


def frequencies(windows: Any) -> list[float]:
    """Return frequencies [rad/s] at which flights oscillate about their parabolas, if significant.

    Args:
        windows: of multiple shooting.
    """
    seen = flights(windows)
    if not seen:
        return []
    lasts = float(np.median([time[-1] - time[0] for time, _ in seen]))
    spacing = float(np.median([(time[-1] - time[0]) / (len(time) - 1) for time, _ in seen]))
    low, high = 2.0 * pi * CYCLES / lasts, 2.0 * pi / (PER_CYCLE * spacing)
    if high <= low:
        return []
    turns = low * RATIO ** np.arange(int(np.log(high / low) / np.log(RATIO)) + 1)
    off, gains = np.zeros(len(seen)), np.zeros((len(seen), len(turns)))
    for k, (time, place) in enumerate(seen):
        since = (time - time.mean()) / (time[-1] - time[0])
        base = np.linalg.qr(np.stack([np.ones_like(since), since, since**2], axis=1))[0]
        rest = place - base @ (base.T @ place)
        off[k] = float(rest @ rest) / (len(rest) - 3)
        wave = np.exp(1j * np.outer(turns, time - time.mean()))
        own = np.stack([wave.real, wave.imag], axis=1)
        own = own - (own @ base) @ base.T
        normal, right = own @ own.transpose(0, 2, 1), own @ rest
        sizes = np.linalg.solve(normal + 1e-9 * np.trace(normal[0]) * np.eye(2), right[:, :, None])[:, :, 0]
        gains[k] = np.sum(sizes * right, axis=1) / (len(rest) - 3)
    if np.median(off) < LEVEL:
        return []
    most = 4.0 * float(np.median(off))
    share = np.mean(gains * (np.minimum(off, most) / off)[:, None], axis=0) / np.mean(np.minimum(off, most))
    best = int(np.argmax(share))
    if share[best] < SHARE or not 0 < best < len(turns) - 1:
        return []
    left, here, right_ = share[best - 1 : best + 2]
    shift = 0.5 * (left - right_) / (left - 2.0 * here + right_)
    return [float(turns[best] * RATIO**shift)]


def fluctuation_orders(windows: Any) -> Array:
    """Return the orders of the drive's fluctuation by record, to the drive and to the loose gear, 0 without, (r, 2)."""
    speeds, last = np.full(len(windows.zeros), np.inf), windows.drive[0].shape[1] - 1
    time = windows.begin[:, None] + windows.step[:, None] * [0, last]
    for k in np.unique(windows.record).tolist():  # windows begin in flights, where the drive is slower than its mean
        own = np.flatnonzero(windows.record == k)
        ends = slice(0, 1) if len(own) > 1 else slice(0, 2)
        speeds[k] = np.ptp(windows.drive[0][own][:, [0, -1]][:, ends]) / np.ptp(time[own, ends])
    orders = 2.0 * np.pi / (np.asarray(windows.periods) * speeds)
    return np.column_stack([orders, orders * windows.radii[1] / windows.radii[0]])


def in_gap(windows: Any) -> Array:
    """Return whether readings are in the gap between the flanks, (n,)."""
    place, edge = windows.read - windows.guessed[windows.record[windows.window]], BETWEEN * windows.backlash
    return (place > edge) & (place < windows.backlash - edge)


def project_out(rest: Array, free: tuple[Array, ...]) -> Array:
    """Return residuals with columns projected out of each row by least squares.

    Args:
        rest: (m, n).
        free: columns in the same weights, each (m, n); linearly dependent ones are skipped.

    >>> project_out(np.array([[1.0, 2.0, 4.0]]), (np.ones((1, 3)), np.array([[0.0, 1.0, 2.0]]))).round(6).tolist()
    [[0.166667, -0.333333, 0.166667]]
    """
    return project_out_nuisances(rest, orthonormal(free))


def orthonormal(free: tuple[Array, ...], least: float = 1e-16) -> list[Array]:
    """Return columns orthonormalised row by row; linearly dependent ones become zero.

    free: (m, n); least: fraction of its square that an independent column has in addition to the others.
    """
    taken: list[Array] = []
    for column in free:
        whole, own = np.sum(column * column, axis=1, keepdims=True), column
        for _ in range(2):  # two passes are sufficient
            for other in taken:
                own = own - other * np.sum(other * own, axis=1, keepdims=True)
        size = np.sum(own * own, axis=1, keepdims=True)
        taken.append(np.where(size > least * whole, own / np.sqrt(np.where(size > 0.0, size, 1.0)), 0.0))
    return taken


def project_out_nuisances(rest: Array, columns: list[Array]) -> Array:
    """Return residuals with orthonormal columns projected out of each row.

    rest: (m, n); columns: (m, n).
    """
    for own in columns:
        rest = rest - own * np.einsum("ij,ij->i", own, rest)[:, None]
    return rest


def standardised_flight(one: Evidence, path: Array) -> Array:
    """Return angles of flights in standard deviations, without start angle and speed, (f * BINS,).

    path: angle at the points of its flights, real or complex [rad], (f, BINS).
    """
    if not len(path):
        return np.zeros(0)
    return project_out_nuisances(_weighted(one, path), _flight_nuisances(one)).ravel()


def standardised_flight_transpose(one: Evidence, rest: Array) -> Array:
    """Return the transpose of :func:`standardised_flight`, applied to residuals of flights, (f, BINS).

    rest: in standard deviations, (f * BINS,).
    """
    flights = one.channels.flights
    value = project_out_nuisances(rest.reshape(flights.time.shape), _flight_nuisances(one))
    roots = _flight_roots(one)
    return value / flights.sigma if roots is None else np.einsum("fji,fj->fi", roots, value)


def _weighted(one: Evidence, path: Array) -> Array:
    roots = _flight_roots(one)
    return path / one.channels.flights.sigma if roots is None else np.einsum("fij,fj->fi", roots, path)


def _flight_roots(one: Evidence) -> Array | None:
    """Return the whitening matrices of flights; ``None`` with white noise only."""
    flights, slow = one.channels.flights, one.channels.flicker.loose_angle
    if slow <= 0.0 or not len(flights.time):
        return None
    if "roots" not in one.cache:
        one.cache["roots"] = roots_of(flights.time, flights.sigma, slow)
    return one.cache["roots"]


def _flight_nuisances(one: Evidence) -> list[Array]:
    """Return start angle and speed of each flight, orthonormal, each (f, BINS)."""
    if "flight" not in one.cache:
        time = one.channels.flights.time
        x = time - time.mean(axis=1, keepdims=True)
        one.cache["flight"] = orthonormal((_weighted(one, np.ones_like(x)), _weighted(one, x)))
    return one.cache["flight"]


def standardised_contact(one: Evidence, place: Array) -> Array:
    """Return displacements in contact in standard deviations, without the record's datum, (c,).

    place: [m], (c,).
    """
    return _standardised(one, "contact", place, (np.ones_like(place),)) if len(place) else place


def standardised_drive(one: Evidence, angle: Array) -> Array:
    """Return angles of the drive in standard deviations, without its datum, mean speed and phase, (d,).

    angle: [rad], (d,).
    """
    seen = one.channels.drive
    swing = one.motion.speed(seen.time) - one.motion.mean
    return _standardised(one, "drive", angle, (np.ones_like(angle), seen.time - seen.time.mean(), swing))


def in_units(one: Evidence, name: str, rest: Array) -> Array:
    """Return residuals of contact [m] or of the drive [rad] as readings, (n,).

    Args:
        one: the record.
        name: ``"contact"`` or ``"drive"``.
        rest: in standard deviations, in the form of :func:`standardised_contact` or :func:`standardised_drive`, (n,).
    """
    if not len(rest):
        return rest
    by = _filter(one, name)
    sigma = one.channels.contacts.sigma if name == "contact" else one.channels.drive.sigma
    return rest * sigma if by is None else coloured(rest, by)


def _filter(one: Evidence, name: str) -> Filter | None:
    """Return the whitening filter of contact or of the drive; ``None`` with white noise only."""
    seen, slow = one.channels, one.channels.flicker
    size = slow.place if name == "contact" else slow.drive_angle
    if (key := ("white", name)) not in one.cache:
        if name == "contact":
            one.cache[key] = filter_of(seen.contacts.time, seen.contacts.sigma, size) if size > 0.0 else None
        else:
            sigma = np.full(len(seen.drive.time), seen.drive.sigma)
            one.cache[key] = filter_of(seen.drive.time, sigma, size) if size > 0.0 else None
    return one.cache[key]


def _standardised(one: Evidence, name: str, values: Array, free: tuple[Array, ...]) -> Array:
    """Return whitened readings of contact or of the drive with columns projected out."""
    by = _filter(one, name)
    sigma = one.channels.contacts.sigma if name == "contact" else one.channels.drive.sigma

    def white(column: Array) -> Array:
        return column / sigma if by is None else whitened(column, by)

    if name not in one.cache:
        one.cache[name] = orthonormal(tuple(white(column)[None] for column in free))
    return project_out_nuisances(white(values)[None], one.cache[name])[0]


def drive_speed(one: Evidence, channel: str) -> Array:
    """Return the drive's speed at the points of ``"contacts"`` or ``"drive"`` [rad/s]."""
    if (key := ("speed", channel)) not in one.cache:
        one.cache[key] = one.motion.speed(getattr(one.channels, channel).time)
    return one.cache[key]
