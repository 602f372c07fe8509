"""The channels of a measured record: flights, contact, impacts, contact losses, the drive's motion."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gears3d.identify.impact_pairs import lowest_rebound
from gears3d.measured.segmentation.displacement import kinks
from gears3d.measured.segmentation.flights import Shafts, clearance, shafts
from gears3d.measured.segmentation.parabolas import Parabolas, common_law, fit

if TYPE_CHECKING:
    from gears3d.measured.segmentation.segments import Segments

Array = np.ndarray
# Points of a flight.
BINS = 12
# Approximate number of points of a record in contact, and of its drive's motion.
POINTS = 4000
# Largest movement, in its noise, over this many blocks before and after, of a point off both flanks that counts as
# contact.
STILL, BLOCKS = 6.0, 4
# Ratio of the error that the contact-loss rates of a record have in common to their standard deviation.
COMMON_ERROR = 0.3
# Largest common rounding of velocity jumps, relative to the noise; blocks are as long as that allows.
COMMON_ROUNDING = 1.0
# Distance of a flight's points from its ends, in standard deviations of the ends, of at most that many seconds each.
CLEAR, LATEST = 4.0, 1e-3
# Minimum number of readings of a flight.
FEWEST_READINGS = 24
# Search range of the slowest opening of the gap, back from and into a flight, relative to its duration.
SEARCHED_BACK, SEARCHED_INTO = 0.75, 0.3
# Number of moments in the search range.
MOMENTS = 192
# Moments to either side for the derivative of rates.
STENCIL = 3
# Points of the flight from that moment on.
FLIGHT_POINTS = 65


class Flights(NamedTuple):
    """Angle of the loose gear in flight, each flight in bins of equal duration, (f, BINS).

    Args:
        time: [s].
        loose: [rad].
        sigma: standard deviation of ``loose`` [rad].
    """

    time: Array
    loose: Array
    sigma: Array


class Contacts(NamedTuple):
    """Displacement in contact, (c,).

    Args:
        time: [s].
        drive: angle [rad].
        loose: angle [rad].
        flank: 0 active, 1 reverse.
        place: displacement, with an arbitrary datum [m].
        sigma: standard deviation of ``place`` [m].
        width: averaging time of each [s].
    """

    time: Array
    drive: Array
    loose: Array
    flank: Array
    place: Array
    sigma: Array
    width: Array


class Impacts(NamedTuple):
    """Impacts with a rebound, (i,).

    Args:
        time: [s].
        drive: angle [rad].
        loose: angle [rad].
        flank: 0 active, 1 reverse.
        velocity: towards the flank, before [m/s].
        velocity_sigma: [m/s].
        rebound: after [m/s].
        rebound_sigma: [m/s].
        seen: whether the rebound was detected; otherwise it is the expected value under scatter of restitution.
    """

    time: Array
    drive: Array
    loose: Array
    flank: Array
    velocity: Array
    velocity_sigma: Array
    rebound: Array
    rebound_sigma: Array
    seen: Array


# Of scattering rebounds a record shows the strong ones; the weak ones appear as immediate contact. To take the strong
# ones for all makes restitution too large and its scatter too small.
class CensoredImpacts(NamedTuple):
    """Impacts of a record that end a free flight, (b,).

    Args:
        time: [s].
        drive: angle [rad].
        loose: angle [rad].
        flank: 0 active, 1 reverse.
        velocity: approach speed towards the flank, above 0 [m/s].
        velocity_sigma: [m/s].
        rebound: above 0; NaN where none above ``lowest`` was detected [m/s].
        rebound_sigma: [m/s]; 0 without a detected rebound.
        lowest: detection limit of rebounds [m/s].
    """

    time: Array
    drive: Array
    loose: Array
    flank: Array
    velocity: Array
    velocity_sigma: Array
    rebound: Array
    rebound_sigma: Array
    lowest: Array

    @property
    def seen(self) -> Array:
        """Whether the rebound was detected, (b,)."""
        return np.isfinite(self.rebound)


class Losses(NamedTuple):
    """Contact losses without an impact, (l,), by the flights that follow.

    Args:
        time: of the slowest opening of the gap of the back-extrapolated flight [s].
        drive: angle [rad].
        loose: angle [rad].
        flank: of the contact loss, 0 active, 1 reverse.
        rate: of the gap at that time, 0 where contact and flight have the same torques [m/s].
        sigma: of the rate [m/s].
        growth: the gap's acceleration τ after that time is g1·τ + g2·τ² + g3·τ³ [m/s³, m/s⁴, m/s⁵], (l, 3).
        span: τ until which this holds [s].
        after: τ from 0 to the last reading of the flight [s], (l, n).
        ahead: angle that the loose gear then has turned on its parabola [rad], (l, n).
        begun: τ of the first reading [s].
        curved: change of the deceleration with the loose gear's speed that the parabola has [1/s].
    """

    time: Array
    drive: Array
    loose: Array
    flank: Array
    rate: Array
    sigma: Array
    growth: Array
    span: Array
    after: Array
    ahead: Array
    begun: Array
    curved: Array


class Drive(NamedTuple):
    """Angle of the drive gear, averaged over equal times, (d,).

    Args:
        time: [s].
        angle: [rad].
        sigma: standard deviation of each [rad].
        width: averaging time of each [s].
    """

    time: Array
    angle: Array
    sigma: float
    width: float


class ContactEnds(NamedTuple):
    """Ends of contacts of any type, (p,).

    Args:
        drive: angle [rad].
        loose: angle [rad].
        flank: of the contact, 0 active, 1 reverse.
    """

    drive: Array
    loose: Array
    flank: Array


class VelocityJumps(NamedTuple):
    """Velocity jumps of the path that reverse it, at an estimated flank or not, (k,).

    Args:
        drive: angle [rad].
        loose: angle [rad].
        flank: at which it reverses, 0 active, 1 reverse.
        off: distance from the estimated flank [m].
        sigma: standard deviation of ``off`` [m].
    """

    drive: Array
    loose: Array
    flank: Array
    off: Array
    sigma: Array


class FlickerNoise(NamedTuple):
    """1/f noise of a record, each as the root of its power per unit of the logarithm of the frequency.

    Args:
        place: of the displacement [m].
        drive_angle: of the angle of the drive gear [rad].
        loose_angle: of the angle of the loose gear [rad].
    """

    place: float = 0.0
    drive_angle: float = 0.0
    loose_angle: float = 0.0


class Channels(NamedTuple):
    """The channels of one record.

    Args:
        flights: angles in flight.
        contacts: displacement in contact.
        impacts: speeds before and after.
        losses: contact losses without an impact.
        drive: its motion.
        left_out: number of excluded points by channel.
        censored_impacts: impacts with and without a detected rebound.
        contact_ends: ends of contacts of any type.
        velocity_jumps: of the path.
        flicker: 1/f noise, in addition to the standard deviations of the points.
    """

    flights: Flights
    contacts: Contacts
    impacts: Impacts
    losses: Losses
    drive: Drive
    left_out: dict[str, int]
    censored_impacts: CensoredImpacts = CensoredImpacts(*[np.zeros(0)] * len(CensoredImpacts._fields))
    contact_ends: ContactEnds = ContactEnds(np.zeros(0), np.zeros(0), np.zeros(0, int))
    velocity_jumps: VelocityJumps = VelocityJumps(np.zeros(0), np.zeros(0), np.zeros(0, int), np.zeros(0), np.zeros(0))
    flicker: FlickerNoise = FlickerNoise()


def channels(cut: Segments) -> Channels:
    """Return the channels of a measured record; points that fail their noise test are excluded and counted."""
    (flights, few), (losses, stray) = _flights(cut), _losses(cut)
    impacts, silent = _impacts(cut)
    contacts, moving = _contacts(cut)
    jumps, on_teeth = _velocity_jumps(cut)
    contacts = Contacts(*(np.append(one, more) for one, more in zip(contacts, on_teeth, strict=True)))
    left_out = {"flight": few, "loss": stray, "impact": silent, "contact": moving}
    ends = ContactEnds(*_angles(cut, cut.contacts["end_s"]), cut.contacts["flank"].astype(int))
    drive, loose = cut.track.models
    flicker = FlickerNoise(cut.track.model.flicker, drive.flicker, loose.flicker)
    return Channels(
        flights, contacts, impacts, losses, _drive(cut), left_out, _censored_impacts(cut), ends, jumps, flicker
    )


def no_channels() -> Channels:
    """Return channels without a point, of a record that could not be segmented."""
    none, bins = np.zeros(0), np.zeros((0, BINS))
    losses = Losses(none, none, none, none, none, none, np.zeros((0, 3)), none, bins, bins, none, none)
    contacts, impacts = Contacts(*[none] * len(Contacts._fields)), Impacts(*[none] * len(Impacts._fields))
    return Channels(Flights(bins, bins, bins), contacts, impacts, losses, Drive(none, none, 1.0, 0.0), {})


def _flights(cut: Segments) -> tuple[Flights, int]:
    known, table = cut.track, cut.flights
    begin, stop = _interior(cut)
    good = (table["testifies"] == 1) & (stop - begin >= 2 * BINS)
    columns = []
    for a, b in zip(begin[good], stop[good], strict=True):
        edges = np.linspace(0, b - a, BINS + 1).astype(int)
        size = np.diff(edges)
        time, loose, square = (
            np.add.reduceat(x[a:b], edges[:-1]) / size for x in (known.time, known.loose, known.sigma_loose**2)
        )
        columns.append((time, loose, np.sqrt(square / size)))
    shape = (len(columns), BINS)
    made = [np.array([row[k] for row in columns]).reshape(shape) for k in range(3)]
    return Flights(*made), int(np.count_nonzero(~good))


def _interior(cut: Segments) -> tuple[Array, Array]:
    """Return the first reading of each flight well after its start, and the first one too close to its end."""
    known, table = cut.track, cut.flights
    spacing = float(np.median(np.diff(known.time)))
    first = table["start_s"] + CLEAR * np.minimum(table["start_sigma_s"], LATEST) + spacing
    last = table["end_s"] - CLEAR * np.minimum(table["end_sigma_s"], LATEST) - spacing
    return np.searchsorted(known.time, first), np.searchsorted(known.time, last)


def _contacts(cut: Segments) -> tuple[Contacts, int]:
    """Return means over neighbouring blocks well within contacts, each of the nearer flank.

    A tooth with a positive thickness deviation holds the gear away from the estimated flanks unless they include it;
    flights that begin or end there are not detected as flights, but they move.
    """
    path, table = cut.path, cut.contacts
    lasts = table["end_s"] - table["start_s"]
    spare = np.minimum(np.maximum(0.15 * lasts, 2.0 * path.width), 0.4 * lasts)
    first = np.searchsorted(path.time, table["start_s"] + spare)
    stop = np.searchsorted(path.time, table["end_s"] - spare)
    total = int(np.sum(np.maximum(stop - first, 0)))
    few = max(total // POINTS, 1)
    spans = [a + np.arange(max(b - a, 0) // few * few) for a, b in zip(first, stop, strict=True)]
    at = np.concatenate([*spans, np.zeros(0, int)]).reshape(-1, few)
    time, drive, loose, place = (values[at].mean(axis=1) for values in (path.time, path.drive, path.loose, path.place))
    side = np.repeat(table["flank"].astype(int), [len(span) // few for span in spans])
    resting = np.ones(len(time), bool)
    if cut.flanks.gap is not None and len(time):
        flanks = np.stack(cut.flanks.places(time, drive, loose))
        off = np.abs(place - flanks)
        side = np.argmin(off, axis=0)
        ends = [path.place[np.clip(at[:, 0] + k * BLOCKS, 0, len(path.place) - 1)] for k in (-1, 1)]
        still = np.abs(ends[1] - ends[0]) < STILL * np.maximum(path.noise, path.slack)
        known = bool(path.shapes) and all(shape.known for shape in path.shapes)  # no other cause holds the gear away
        resting = (off.min(axis=0) < clearance(path, cut.flanks)) | (still & (not known))
    sigma = max(path.noise / np.sqrt(few), path.slack, 1e-12)
    width = path.time[at[:, -1]] - path.time[at[:, 0]] + path.width
    made = Contacts(time, drive, loose, side, place, np.full(len(time), sigma), width)
    return Contacts(*(column[resting] for column in made)), int(np.sum(~resting))


def _velocity_jumps(cut: Segments) -> tuple[VelocityJumps, Contacts]:
    """Return the velocity jumps of the path, and as contact those on a single tooth that the flank estimate includes.

    A tooth with a positive thickness deviation makes the gear bounce: only bounces are observed on it.
    """
    path = cut.path
    found = kinks(path)
    at, flank = found.at, (found.jump < 0.0).astype(int)
    time, drive, loose = path.time[at], path.drive[at], path.loose[at]
    drawn = cut.flanks.places(time, drive, loose)
    off = found.place - np.where(flank == 1, drawn[1], drawn[0])
    sigma = np.full(len(at), max(path.noise, path.slack, 1e-12))
    clear = clearance(path, cut.flanks)
    tooth = (np.abs(cut.flanks.lifted(drive, loose, flank)) > clear) & (np.abs(off) < clear)
    common = np.sqrt(1.0 + COMMON_ROUNDING**2 * np.count_nonzero(tooth))
    beside = Contacts(time, drive, loose, flank, found.place, sigma * common, np.full(len(at), path.width))
    return VelocityJumps(drive, loose, flank, off, sigma), Contacts(*(column[tooth] for column in beside))


def _impacts(cut: Segments) -> tuple[Impacts, int]:
    """Return impacts on flanks, without those on a deviating tooth: on its edges the rebound differs."""
    table = cut.impacts
    good = np.isfinite(table["rebound_m_s"]) & np.isfinite(table["rebound_sigma_m_s"]) & (table["testifies"] == 1)
    drive, loose = _angles(cut, table["time_s"])
    off = cut.flanks.lifted(drive, loose, table["flank"].astype(int)) if cut.path.shapes else np.zeros(len(drive))
    good &= np.abs(off) < max(cut.path.noise, cut.path.slack, 1e-12)
    time, drive, loose = table["time_s"][good], drive[good], loose[good]
    names = ("velocity_m_s", "velocity_sigma_m_s", "rebound_m_s", "rebound_sigma_m_s")
    before, before_sigma, after, after_sigma = (table[name][good] for name in names)
    flank, seen = table["flank"][good].astype(int), np.ones(len(time), bool)
    found = Impacts(time, drive, loose, flank, before, before_sigma, after, after_sigma, seen)
    return found, int(np.sum(~good))


def _losses(cut: Segments) -> tuple[Losses, int]:
    """Return the contact losses of flights that begin without an impact, ambiguous ones excluded and counted."""
    which = np.flatnonzero(cut.flights["blow"] == 0)
    paths, kept = _parabolas(cut, which)
    if not len(kept):
        none, later, flank = np.zeros(0), np.zeros((0, FLIGHT_POINTS)), np.zeros(0, int)
        return Losses(none, none, none, flank, none, none, np.zeros((0, 3)), none, later, later, none, none), len(which)
    where = shafts(cut.track, cut.path, cut.flanks)
    start, end = (cut.flights[name][which[kept]] for name in ("start_s", "end_s"))
    before, flank = np.append(-np.inf, cut.flights["end_s"])[which[kept]], cut.flights["left"][which[kept]].astype(int)
    since = np.maximum(start - SEARCHED_BACK * (end - start), before)
    grid = since[:, None] + (start + SEARCHED_INTO * (end - start) - since)[:, None] * np.linspace(0.0, 1.0, MOMENTS)
    rate = _gap_rate(paths, where, grid, flank)
    time, least, sigma, at = _slowest_opening(paths, where, grid, rate)
    growth = np.array([_acceleration_growth(*each) for each in zip(grid, rate, time, least, at, strict=True)])
    good = np.isfinite(time) & (growth[:, 0] > 0.0)
    span = grid[:, -1] - time
    paths, time, flank = paths.some(good), time[good], flank[good]
    since = time[:, None]
    after = (paths.middle + paths.half - time)[:, None] * np.linspace(0.0, 1.0, FLIGHT_POINTS)
    ahead, begun = paths.at(since + after) - paths.at(since), paths.middle - paths.half - time
    found = Losses(time, *_angles(cut, time), flank, least[good], _scattered(least[good], sigma[good], flank),
                   growth[good], span[good], after, ahead, begun, paths.slope)  # fmt: skip
    return found, len(which) - len(time)


def _scattered(value: Array, sigma: Array, flank: Array) -> Array:
    """Return standard deviations that include the scatter, and an error common to all losses of a flank."""
    wider = sigma.copy()
    for side in (0, 1):
        own = np.flatnonzero(flank == side)
        if len(own):
            usual = 1.4826 * float(np.median(np.abs(value[own] - np.median(value[own]))))
            wider[own] = np.maximum(sigma[own], usual) * np.sqrt(1.0 + COMMON_ERROR**2 * len(own))
    return wider


def _angles(cut: Segments, time: Array) -> tuple[Array, Array]:
    known = cut.track
    return np.interp(time, known.time, known.drive), np.interp(time, known.time, known.loose)


def _drive(cut: Segments) -> Drive:
    reading = cut.track.readings[0]
    few = max(len(reading.time) // POINTS, 1)
    count = len(reading.time) // few
    time, angle = (x[: count * few].reshape(count, few).mean(axis=1) for x in (reading.time, reading.angle))
    sigma = float(np.median(reading.sigma)) / np.sqrt(few)
    return Drive(time, angle, sigma, float(np.median(np.diff(time))) if count > 1 else 0.0)


def _censored_impacts(cut: Segments) -> CensoredImpacts:
    """Return the impacts of a record; none without a bounce, as its detection limit is then unknown."""
    hits, path = cut.impacts, cut.path
    time, flank = hits["time_s"], np.asarray(hits["flank"], dtype=int)
    if not len(time):
        return CensoredImpacts(*[np.zeros(0)] * len(CensoredImpacts._fields))
    velocity, rebound = np.abs(hits["velocity_m_s"]), np.abs(hits["rebound_m_s"])
    height = clearance(path, cut.flanks)
    lowest = lowest_rebound(time, flank, velocity, rebound, height, path.width)
    sane = hits["testifies"] == 1
    after = np.append(sane[1:], False)  # the flight after a rebound is described by the impact that ends it
    good = sane & (after | np.isnan(rebound)) & (velocity > 0.0) & (hits["velocity_sigma_m_s"] > 0.0)
    good &= np.isfinite(lowest)
    good[-1] = False  # the record ends within the motion after the last one
    rebound = np.where(rebound > lowest, rebound, np.nan)
    slack = np.where(np.isfinite(rebound), hits["rebound_sigma_m_s"], 0.0)
    drive, loose = (np.interp(time, cut.track.time, angle) for angle in (cut.track.drive, cut.track.loose))
    every = CensoredImpacts(time, drive, loose, flank, velocity, hits["velocity_sigma_m_s"], rebound, slack, lowest)
    return CensoredImpacts(*(column[good] for column in every))


# Contact is lost when the loose gear would have to be pulled. Where flight and contact have the same torques, the gap
# then opens from rest with the third power of time, and its time cannot be resolved. But the flight is a parabola that
# is known far better than its beginning. Back-extrapolated to the moment at which the gap's acceleration passes through
# zero, it meets the flank at rest; where the torques of contact decelerate the gear by Δa more than those of flight,
# contact is lost later, and the back-extrapolated parabola closes there at ½·Δa²/j, j being the rate at which the
# acceleration grows.


def _parabolas(cut: Segments, which: Array) -> tuple[Parabolas, Array]:
    """Return the parabolas of flights with the deceleration shared in a record, and which flights have one."""
    known, table = cut.track, cut.flights
    begin, stop = _interior(cut)
    sane = np.flatnonzero((table["testifies"] == 1) & (stop - begin >= FEWEST_READINGS))
    slope = float(np.median(table["slope_1_s"])) if len(sane) else 0.0
    law = common_law(fit(known, begin[sane], stop[sane] - 1, slope)) if len(sane) else None
    kept = np.flatnonzero(np.isin(which, sane))
    return fit(known, begin[which[kept]], stop[which[kept]] - 1, slope, law), kept


def _gap_rate(paths: Parabolas, where: Shafts, grid: Array, flank: Array) -> Array:
    """Return the gap rate of parabolas at times [m/s], (l, g)."""
    step = STENCIL * (grid[:, 1:2] - grid[:, :1])
    side = np.broadcast_to(flank[:, None], grid.shape)
    later, sooner = (where.gap(grid + k * step, paths.at(grid + k * step), side) for k in (1.0, -1.0))
    return (later - sooner) / (2.0 * step)


def _slowest_opening(paths: Parabolas, where: Shafts, grid: Array, rate: Array) -> tuple[Array, Array, Array, Array]:
    """Return the interior minima of rates: time (NaN without one), rate, its standard deviation, index, each (l,)."""
    each, step = np.arange(len(grid)), grid[:, 1] - grid[:, 0]
    least = np.argmin(rate, axis=1)
    reach = np.minimum(4 * STENCIL, np.minimum(least, MOMENTS - 1 - least))
    inner = reach > STENCIL
    best, reach = np.where(inner, least, MOMENTS // 2), np.where(inner, reach, STENCIL)
    at = np.linspace(-1.0, 1.0, 9)
    bow = np.array([np.polyfit(at * r * h, np.interp(b + at * r, np.arange(MOMENTS), row), 2)
                    for r, h, b, row in zip(reach, step, best, rate, strict=True)])  # fmt: skip
    good = inner & (bow[:, 0] > 0.0)
    ahead = np.where(good, -0.5 * bow[:, 1] / np.where(good, bow[:, 0], 1.0), 0.0)
    time = grid[each, best] + np.clip(ahead, -reach * step, reach * step)
    lowest = bow[:, 2] + 0.5 * bow[:, 1] * ahead - bow[:, 0] * (STENCIL * step) ** 2 / 3.0  # by the differences
    _, turning = paths.spread(time[:, None])
    sigma = np.hypot(where.radii[1] * turning[:, 0], where.radii[0] * where.drive.speed_sigma)
    return np.where(good, time, np.nan), lowest, sigma, best


def _acceleration_growth(grid: Array, rate: Array, time: float, least: float, best: int) -> Array:
    """Return the growth of the gap's acceleration after its slowest opening, (3,)."""
    after = grid[best:-STENCIL] - time
    if not np.isfinite(time) or len(after) < 4 * STENCIL or after[-1] <= 0.0:
        return np.full(3, np.nan)
    x = np.maximum(after, 0.0) / after[-1]
    rows = np.column_stack([x**2 / 2.0, x**3 / 3.0, x**4 / 4.0])
    return np.linalg.lstsq(rows, rate[best:-STENCIL] - least, rcond=None)[0] / after[-1] ** np.array([2.0, 3.0, 4.0])
