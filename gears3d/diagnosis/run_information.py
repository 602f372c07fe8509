"""Fisher information on causes: in records at hand, and predicted for runs that could be measured.

Noise of readings is independent from point to point, but errors of segmentation are not: a slightly wrong flank, or a
late contact, moves all points about it. So the covariance of records at hand is also estimated by the scatter of block
estimates over stretches. A measurement plan chooses among runs by the information that each adds on the causes asked.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import (
    ACCEPT_PATH,
    EXCLUDED,
    FREE,
    LARGEST,
    SLOPE_STEP,
    Candidate,
    Cause,
    begin,
    candidates,
    contribution,
    excluding,
    goes_by,
    moved,
    slopes_of,
    table,
    within_bounds,
)
from gears3d.diagnosis.evidence import Evidence, Paths, fluctuation_orders, has_compliance, shootable
from gears3d.diagnosis.path_candidates import Scatter, scores_of
from gears3d.diagnosis.path_fit import (
    ACCOUNTS,
    LAWS,
    OIL,
    SCATTER,
    SOFT,
    SQUARED,
    State,
    WithoutStarts,
    columns_of,
    covariance_of,
    effects_of,
    fitted,
    gain_of,
    kicked,
    polished,
    restore,
    settled,
    state_of,
)
from gears3d.diagnosis.prediction import CHANNELS, GEARS, residuals, untruncated
from gears3d.diagnosis.preprocessing import ANGLE_STEP, delay_of, has_original_datum, preprocess, slopes_of_datums, turn
from gears3d.diagnosis.search import Rival, given, occam
from gears3d.diagnosis.shooting import KICKS, MOST, NOISE, Windows
from gears3d.diagnosis.shooting_kernels import impacts_of
from gears3d.effects import catalogue
from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.measured.checks import Admitted, examine
from gears3d.measured.readers import Channels
from gears3d.scenario.models import Sensor, Sensors
from gears3d.simulation import encode, simulate
from gears3d.units import parse

if TYPE_CHECKING:
    from gears3d.recording import Recording
    from gears3d.scenario import Scenario

Array = np.ndarray
# Number of stretches of a record for block estimates, each with as many points of every channel.
STRETCHES = (16, 4, 1)
# Minimum number of stretches for an estimate of their scatter.
FEWEST = 4
# Standard deviations at which chi-square is compared with its parabola, largest factor on them, and rounds of its fits.
SIGMAS, WIDEST, PROFILED = 2.0, 32.0, 3
# Parts of what a cause explains, and of chi-square beyond noise, by which another must be worse to be excluded.
SAME, LEFT = 0.01, 0.25
# Standard errors over windows by which the difference of two hypotheses must differ from 0.
APART = 3.0
# Information relative to the best combination of numbers below which another one is not identifiable.
KNOWN = 1e-12
# Least information on the restitution of an impact, 0 to 1, for tests of what it depends on.
DETERMINED = 0.5


class Deviations(NamedTuple):
    """Restitutions of single impacts less their mean, in sequence by record and window.

    Args:
        value: deviation, (n,).
        sigma: its standard deviation if restitution scatters, (n,).
        speed: of approach [m/s], (n,).
        flank: 0 active, 1 reverse, (n,).
        drive, loose: angles by record [rad].
        locked: orders of the drive's fluctuation by record, to the drive and to the loose gear, 0 without one, (r, 2).
    """

    value: Array
    sigma: Array
    speed: Array
    flank: Array
    drive: list[Array]
    loose: list[Array]
    locked: Array


class Path(NamedTuple):
    """Result of the path search: causes with covariance, residuals and competing hypotheses.

    Args:
        causes: with their numbers.
        covariance: of all numbers, in the order of the causes [SI], (p, p).
        widths: factors on their standard deviations, below and above, by the profile of chi-square, (p, 2).
        gains: fall of chi-square, over its level, by each cause in the drop-one test, (c,).
        before: median mean square of a window's residuals without causes.
        after: with them.
        parted: part of the windows whose motion diverges from the model's.
        missed: median root mean square of residuals [m].
        windows: number.
        others: competing hypotheses of each cause, by chi-square over the level, best first.
        seen: minimum detectable effect of causes of one number in addition to these, in units, by kind.
        scatter: of the restitution, in addition to the causes.
        unsure: fall of chi-square, over its level, that the uncertainty of the drive's motion explains.
        deviations: restitutions of single impacts, where it scatters.
        complete: whether the search ended before its budget.
    """

    causes: tuple[Cause, ...]
    covariance: Array
    widths: Array
    gains: Array
    before: float
    after: float
    parted: float
    missed: float
    windows: int
    others: tuple[tuple[Rival, ...], ...]
    seen: dict[str, float]
    scatter: Scatter | None = None
    unsure: float = 0.0
    deviations: Deviations | None = None
    complete: bool = True

    def widths_of(self, cause: Cause) -> Array | None:
        """Return the widths of one of the causes; ``None`` of another, or of one with other numbers."""
        at = np.cumsum([0, *(len(one.numbers) for one in self.causes)])
        k = next((k for k, one in enumerate(self.causes) if one is cause), None)
        return None if k is None else self.widths[at[k] : at[k + 1]]


class Information(NamedTuple):
    """Information of the readings of one record on the numbers of causes, in units; additive over records.

    Args:
        normal: products of the slopes, (p, p).
        scores: sums of slope times residual over stretches of the record, (s, p).
        chi2: of the residuals.
        count: of the residuals.
    """

    normal: Array
    scores: Array
    chi2: float
    count: float


def information(one: Evidence, causes: Sequence[Cause], others: Sequence[Cause] = ()) -> Information:
    """Return the information of a record's events on causes, unknown datums being free.

    Of causes that do not act in it the numbers follow those of the acting ones.
    """
    effects = [cause.effect for cause in causes if cause.effect is not None]
    slopes = np.column_stack([column for cause in (*causes, *others) for column in slopes_of([one], cause)])
    own, rests = contribution([one], effects), residuals(one)
    rest = np.concatenate([rests[name] for name in CHANNELS]) - own
    if len(across := _zeros(one, effects, own)):
        slopes = slopes - across.T @ (across @ slopes)
    where = np.concatenate([np.arange(len(rests[n])) * STRETCHES[0] // max(len(rests[n]), 1) for n in CHANNELS])
    voted = np.zeros((STRETCHES[0], slopes.shape[1]))
    np.add.at(voted, where, slopes * rest[:, None])
    return Information(slopes.T @ slopes, voted, float(rest @ rest), len(rest))


def combined(parts: Sequence[Information]) -> Array:
    """Return the covariance of the numbers of causes, in units, from the events of several records, (p, p)."""
    normal = sum((one.normal for one in parts), np.zeros_like(parts[0].normal))
    level = sum(one.chi2 for one in parts) / max(sum(one.count for one in parts), 1)
    return _wider(normal, np.array([one.scores for one in parts]), max(level, 1.0))


def covariance(records: Sequence[Evidence], causes: Sequence[Cause]) -> Array:
    """Return the covariance of the numbers of causes, unknown datums of records being free [SI], (p, p).

    No combination of numbers is more precise than with independent errors of the observed scatter, nor than with errors
    correlated over sixteenths, quarters or the whole of records.

    Source: Liang and Zeger 1986, theorem 1, for correlated errors.
    Theory: docs/theory/uncertainty.md, equation (1).
    """
    units = np.concatenate([cause.units for cause in causes])
    return combined([information(one, causes) for one in records]) * np.outer(units, units)


def widths_of(windows: Windows, now: State, covariance: Array) -> Array:
    """Return factors on the standard deviation of each number, below and above, by the profile of chi-square, (p, 2).

    Far from its minimum chi-square is not quadratic: torques that keep the gear on its flank all fit equally. The
    directions of an order are its amplitude and phase. The other numbers of the cause follow by their covariance.
    """
    made, at = [], 0
    for k, cause in enumerate(now.causes):
        own = covariance[at : at + len(cause.numbers), at : at + len(cause.numbers)]
        at += len(cause.numbers)
        ways = np.eye(len(cause.numbers))
        if cause.candidate.phased:
            cosine, sine = cause.numbers[:2] / max(float(np.hypot(*cause.numbers[:2])), 1e-300)
            ways[:2, :2] = [[cosine, sine], [-sine, cosine]]
        others = (*now.causes[:k], *now.causes[k + 1 :])
        sizes = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", ways, own, ways), 1e-300))
        for way in ways @ own / sizes[:, None]:
            kept = cause.candidate.kind == SCATTER  # its size maximises the evidence, not the likelihood
            made.append([1.0, 1.0] if kept else [_width(windows, now, cause, others, by) for by in (-way, way)])
    restore(windows, now)
    return np.array(made).reshape(-1, 2)


def _width(windows: Windows, now: State, cause: Cause, others: Sequence[Cause], by: Array) -> float:
    """Return the factor on a standard deviation of a cause in a direction, at least 1."""
    width, before = 1.0, (0.0, 0.0)
    while width < WIDEST:
        restore(windows, now)
        numbers = cause.numbers + SIGMAS * width * by
        if np.any(numbers != within_bounds(cause, numbers)):  # a rig cannot have it
            break
        trial = (*moved([cause], SIGMAS * width * by, windows.pivot), *others)
        try:
            effects_of([cause._replace(numbers=numbers)])
            fit = state_of(windows, trial, windows.residuals(effects_of(trial)))
        except InputError:  # a rig cannot have it
            break
        rise = np.sqrt(max(gain_of(windows, fitted(windows, fit, PROFILED, held=1), now)[0], 0.0))
        if rise >= SIGMAS:
            return max(before[0] + (width - before[0]) * (SIGMAS - before[1]) / (rise - before[1]), 1.0)
        width, before = 2.0 * width, (width, float(rise))
    return width


def scatter_separated(path: Path, mean: float) -> Path:
    """Return a path with the scatter of restitution, given its mean, as an attribute of its own, not as a cause."""
    kinds = [one.candidate.kind for one in path.causes]
    if SCATTER not in kinds:
        return path
    k = kinds.index(SCATTER)
    at = sum(len(one.numbers) for one in path.causes[:k])
    value, slope = untruncated(float(path.causes[k].numbers[0]), mean)
    sigma = slope * float(np.sqrt(path.covariance[at, at]))
    covariance = np.delete(np.delete(path.covariance, at, axis=0), at, axis=1)
    return path._replace(
        causes=path.causes[:k] + path.causes[k + 1 :], others=path.others[:k] + path.others[k + 1 :],
        covariance=covariance, widths=np.delete(path.widths, at, axis=0), gains=np.delete(path.gains, k),
        scatter=Scatter(value, sigma, float(path.gains[k]), 1.0, 0.0),
    )  # fmt: skip


def prior_covariance(covariance: Array, causes: Sequence[Cause], pivot: float) -> Array:
    """Return the covariance of numbers [SI] in their units, of torques of two numbers by the torque at a speed, (p, p).

    pivot: the speed [rad/s]; a coefficient depends on the exponent, which determines its unit, or the other speed.
    """
    to, at = np.diag(1.0 / np.concatenate([np.zeros(0), *(one.units for one in causes)])), 0
    for one in causes:
        if one.candidate.kind == "drag_power" and one.free:
            power = float(np.exp(one.numbers[1]))
            to[at, at] *= pivot ** (power - one.candidate.shape["exponent"])
            to[at, at + 1] = to[at, at] * one.numbers[0] * np.log(pivot) * power
        if one.candidate.kind == "drag_differential" and one.free:
            unit = one.candidate.unit * abs(pivot - one.candidate.shape["shaft_speed"])  # the drag torque
            to[at, at : at + 2] = (pivot - one.numbers[1]) / unit, -one.numbers[0] / unit
        at += len(one.numbers)
    return to @ covariance @ to.T


def price_of(windows: Windows, one: State, scale: float) -> float:
    """Return the Occam factor of a state's parameters, as chi-square; scale: of their covariance."""
    restore(windows, one)
    known = prior_covariance(scale * covariance_of(windows, one), one.causes, windows.pivot)
    return occam(known, np.ones(len(known)))


def least_excluding(windows: Windows, gain: float, rest: Array) -> float:
    """Return the chi-square over the level by which a hypothesis must be worse to be excluded.

    Where residuals of the better one are noise: that of channels. Else the largest of four standard deviations, a part
    of its gain (model error), and a part of its residuals beyond noise (an unknown cause may be confounded with both).
    """
    level = windows.usual(rest)
    if level < NOISE:
        return excluding(gain)
    return max(EXCLUDED, SAME * gain, LEFT * (level - 1.0) / level * len(windows.read) / windows.runs(rest))


def is_worse(windows: Windows, one: State, other: State, least: float) -> bool:
    """Return whether a state leaves more than another by the stated chi-square.

    Where the other leaves noise, and this one does not, four standard deviations are enough.
    """
    off, left = (windows.usual(each.rest) for each in (one, other))
    return gain_of(windows, one, other)[0] > (EXCLUDED if left < NOISE < ACCOUNTS < off else least)


def excludes(windows: Windows, one: State, other: State, least: float) -> bool:
    """Return whether a state is worse than another by the stated chi-square, significantly over windows."""
    return is_worse(windows, one, other, least) and gain_of(windows, one, other)[1] > APART


def rival_of(windows: Windows, one: State, best: State, least: float, cost: float = 0.0) -> Rival:
    """Return the last cause of a state as a competing hypothesis of one of the best.

    Its deviance is limited by the model error that counts for its exclusion, and by its scatter over windows.

    cost: chi-square that its parameters cost more than those of the best.
    """
    worse, sure = gain_of(windows, one, best)
    deviance = min(EXCLUDED * worse / least, sure * abs(sure)) + cost
    return Rival((one.causes[-1],), worse, excludes(windows, one, best, least), deviance)


def detectable(windows: Windows, known: Sequence[Candidate], found: State, covariance: Array) -> dict[str, float]:
    """Return the minimum detectable effect of causes of one number in addition to others, in units, by kind.

    Of a cause that is present it is the smallest detectable change; values above the largest size are omitted.
    """
    plain = [one for one in known if not one.phased and not one.shape and one.kind not in (*LAWS, SCATTER, SQUARED)]
    there, at = {}, 0
    for one in found.causes:
        there[one.candidate.kind] = float(np.sqrt(ACCEPT_PATH * covariance[at, at])) / one.candidate.unit
        at += len(one.numbers)
    scores, level = scores_of(windows, [one for one in plain if one.kind not in there], found, -np.inf)
    sizes = {one.candidate.kind: float(np.sqrt(ACCEPT_PATH * level / one.worth)) for one in scores if one.worth > 0.0}
    kinds = {one.kind for one in plain}
    return {kind: size for kind, size in {**sizes, **there}.items() if size < LARGEST and kind in kinds}


def deviations(windows: Windows, causes: Sequence[Cause]) -> Deviations | None:
    """Return the deviations of restitution that windows determine; ``None`` where it does not scatter."""
    if (known := kicked(windows, causes)) is None:
        return None
    along = windows.along(effects_of(causes))
    which, place, order = impacts_of(along.run.events)
    information = np.where(order < KICKS, known[1][which, np.minimum(order, KICKS - 1)], 0.0)
    sure = information > DETERMINED
    which, place, order, part = which[sure], place[sure], order[sure], information[sure]
    events = along.run.events[which, place]
    node, beyond, flank = events[:, 0].astype(int), events[:, 1], (events[:, 3] < 0.0).astype(int)
    (drive, loose), (_, reverse) = along.run.seen, along.run.flanks

    def at(nodes: Array) -> Array:
        return nodes[which, node] + beyond * (nodes[which, node + 1] - nodes[which, node])

    turned = at(loose) + np.where(flank, at(reverse), 0.0) / windows.radii[1]
    by, count = windows.record[which], range(len(windows.zeros))
    return Deviations(
        windows.starts.kicks[which, order] / part, along.spread / np.sqrt(part), np.abs(events[:, 4]), flank,
        [at(drive)[by == k] for k in count], [turned[by == k] for k in count],
        fluctuation_orders(windows),
    )  # fmt: skip


def averaged(one: Cause, mine: Array, other: Cause, its: Array, pivot: float) -> tuple[Cause, float]:
    """Return a cause with the average of its numbers and another's, and the factor on the covariance of the other.

    The average is along the steps of :func:`moved`, in which torques are straight: coefficient and speed of a torque
    over a difference of speeds may vary much while their product is known. Its variance is at least that of the other,
    and larger where they differ by more than their errors. Source: Particle Data Group, Review of Particle Physics,
    5.2.2 (scale factor).

    mine, its: covariance of both [SI], (p, p); pivot: mean speed [rad/s].
    """
    off, slopes = _steps_to(one, other, pivot)
    back = np.linalg.pinv(slopes)
    units = np.outer(one.units, one.units)
    first, second = mine / units, back @ (its / units) @ back.T
    share = first @ np.linalg.pinv(first + second, hermitian=True)  # of the other
    scale = max(float(off @ np.linalg.pinv(first + second, hermitian=True) @ off) / len(off), 1.0)
    narrower = float(np.max(np.diag(share @ second) / np.diag(second)))
    return moved([one], one.units * (share @ off), pivot)[0], max(scale * narrower, 1.0)


def _steps_to(one: Cause, other: Cause, pivot: float) -> tuple[Array, Array]:
    """Return the step of a cause to the numbers of another, (p,), and slopes of its numbers there, (p, p), in units."""
    step, slopes = (other.numbers - one.numbers) / one.units, np.eye(len(one.numbers))
    for _ in range(NEWTON):
        ends = [moved([one], one.units * (step + by), pivot)[0].numbers for by in NEWTON_STEP * np.eye(len(step))]
        made = moved([one], one.units * step, pivot)[0].numbers
        slopes = (np.array(ends) - made).T / (NEWTON_STEP * one.units[:, None])
        step = step + np.linalg.lstsq(slopes, (other.numbers - made) / one.units, rcond=1e-9)[0]
    return step, slopes


def _zeros(one: Evidence, effects: Sequence[object], own: Array) -> Array:
    """Return the response of a record to its angular datums, orthonormal, (0 to 2, n)."""
    moves = slopes_of_datums(one, effects, own, [gear for gear in one.unmarked if not has_original_datum(one, gear)])
    if not np.any(moves):
        return np.zeros((0, len(own)))
    left, size, _ = np.linalg.svd(np.column_stack(moves), full_matrices=False)
    return left[:, size > 1e-9 * size[0]].T


def _wider(normal: Array, scores: Array, level: float) -> Array:
    """Return the inverse of the normal matrix times the level, or the scatter of the scores if that is larger.

    normal: of all points, (p, p); scores: of the shortest stretches of each record, (r, s, p); level: mean square
    residual of a point.

    >>> alike = np.array([[[1.0], [-1.0]] * 8])
    >>> float(_wider(np.array([[16.0]]), 0.1 * alike, 1.0)[0, 0])
    0.0625
    >>> round(float(_wider(np.array([[16.0]]), 3.0 * alike, 1.0)[0, 0]), 9)
    0.6
    >>> float(_wider(np.zeros((1, 1)), 0.0 * alike, 1.0)[0, 0])
    inf
    """
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    known, turned = np.linalg.eigh(normal / np.outer(scale, scale))
    good = known > KNOWN * known[-1]
    if not np.any(good):  # records with other datums would show the same: the numbers are not identifiable
        return np.diag(np.full(len(scale), np.inf))
    root = np.sqrt(level / known[good]) * turned[:, good] / scale[:, None]
    moves = scores @ root / level  # numbers from each stretch alone
    for parts in STRETCHES:
        together = moves.reshape(-1, moves.shape[1] // parts, moves.shape[2]).sum(axis=1)
        if len(together) >= FEWEST:
            spread, toward = np.linalg.eigh(together.T @ together * (len(together) / (len(together) - 1)))
            wider = np.sqrt(np.maximum(spread, 1.0))
            root, moves = root @ toward * wider, moves @ toward / wider
    return root @ root.T


# Number of shapes at which effects with a free shape are computed, and of tried values between these: an exponent is
# wrong by 0.01 at most.
NODES, VALUES = 9, 241
# Kinds that cannot be planned for: each record has its own motion of the drive; friction of rigid flanks moves nothing;
# scatter depends on the number of impacts only.
UNPLANNED = ("drive_motion", "mesh_friction", "restitution_scatter")
# Default kinds: those that a data sheet of a rig states.
DRAG, IMPACT, GEOMETRY = "drag_coulomb", "restitution_offset", "backlash_offset"
# Newton steps from the numbers of a cause to those of another, and their step for slopes, in units.
NEWTON, NEWTON_STEP = 6, 1e-6


class Truth(NamedTuple):
    """Assumed causes, and the alternatives that are fitted to their readings.

    Args:
        causes: with their sizes; nuisances last.
        others: alternatives that do not act.
        pairs: names of pairs of sets, numbers of the true set in units, (p,), and the free directions of the other set,
            (p, k) each, of which it has one.
    """

    causes: tuple[Cause, ...]
    others: tuple[Cause, ...] = ()
    pairs: tuple[tuple[str, Array, tuple[Array, ...]], ...] = ()

    @property
    def effects(self) -> list[Any]:
        """Effects that act."""
        return effects_of(self.causes)

    @property
    def lawful(self) -> bool:
        """Whether a law of contact is among them, without segmentation into events."""
        return any(one.candidate.kind in LAWS for one in self.causes)


class Wanted:
    """The request: causes to be determined, and pairs of sets to be separated.

    Args:
        rig: scenario of the test rig.
        causes: as for :func:`plan`.
        separate: as for :func:`plan`.
        nuisances: as for :func:`plan`.
        size: as for :func:`plan`.
        at: assumed size of the causes, in units.
        longest: duration of a record [s].
    """

    def __init__(
        self, rig: Scenario, causes: Sequence[str], separate: Sequence[str], nuisances: Sequence[str], size: float,
        at: float, longest: float,
    ) -> None:  # fmt: skip
        self.size, self.at, self.longest = size, at, longest
        values = self._values = rig.rig()
        highest = max(12, values.teeth_drive, values.teeth_loose)
        self._known = candidates(values, longest, highest)
        if values.face_width > 0.0:
            self._known.append(Candidate(OIL, {}, "viscosity", catalogue()[OIL](viscosity=1e-3).unit_size(values),
                                         False, ()))  # fmt: skip
        unit, mass = catalogue()[SOFT](stiffness=1e6).unit_size(values), values.inertia / values.base_radius_loose**2
        damping = 0.2 * float(np.sqrt(unit / abs(at) * mass))
        self._known.append(Candidate(SOFT, {"damping": damping}, "stiffness", unit, False, ()))
        free = tuple(begin(one, np.zeros(1 + one.phased)) for one in (self._chosen(name)[0] for name in nuisances))
        sets = [one.split("+") for one in separate]
        if separate and len(sets) < 2:
            raise UsageError(f"--separate is {separate[0]!r}; give two sets or more, e.g. drag_viscous,drag_coulomb")
        if not causes and not sets:
            causes = (DRAG, IMPACT, GEOMETRY) if values.drag_torque > 0.0 else (IMPACT, GEOMETRY)
        wanted = [self._chosen(one)[0] for one in causes]
        self.wanted = len(wanted)
        self.truths = [Truth((*map(self._sized, wanted), *free))] if wanted else []
        self.truths += [self._against(sets, k, free) for k in range(len(sets))]

    def _chosen(self, text: str) -> list[Candidate]:
        """Return the candidates for a kind with shapes: all of them, the usual one first."""
        kind, *shapes = text.strip().split(":")
        kinds = list(dict.fromkeys(one.kind for one in self._known))
        if kind in UNPLANNED or kind not in kinds:
            if kind in catalogue():
                able = ", ".join(one for one in kinds if one not in UNPLANNED)
                raise UsageError(f"{kind!r} is not planned for; kinds that are: {able}")
            raise UsageError(f"{kind!r} is not an effect (gears3d list effects); {did_you_mean(kind, kinds)}")
        wanted = {name: value for name, _, value in (one.partition("=") for one in shapes)}
        able = [one for one in self._known if one.kind == kind]
        bends = {name: wanted.pop(name) for name in begin(able[0], np.zeros(1)).free if name in wanted}
        good = [one for one in able if all(str(one.shape.get(name)) == value for name, value in wanted.items())]
        if good and bends:
            families = {name: catalogue()[kind].params[name].family for name in bends}
            try:
                return [self._bent(good[0], {name: parse(text, families[name]) for name, text in bends.items()})]
            except InputError as error:
                raise UsageError(f"{text!r}: {error.faults[0].message}") from None
        if not good:
            own = {name: list(dict.fromkeys(str(one.shape[name]) for one in able)) for name in able[0].shape}
            each = (f"{name}={'|'.join(some[:4])}{'|...' if len(some) > 4 else ''}" for name, some in own.items())
            raise UsageError(f"{text!r} is not a shape of {kind}; it has {', '.join(each) or 'none'}")
        return good

    def _sized(self, one: Candidate) -> Cause:
        """Return a candidate with the assumed size."""
        if one.kind == SOFT:
            return begin(one, np.array([1.0 / abs(self.at)]))
        return begin(one, np.array([self.at, 0.0][: 2 if one.phased else 1]))

    def _against(self, sets: Sequence[Sequence[str]], k: int, free: Sequence[Cause]) -> Truth:
        """Return a set of causes as true, and all others as alternatives."""
        for kind in (name.split(":")[0] for one in sets for name in one):
            if kind in (*LAWS, SQUARED):
                raise UsageError(f"--separate: effects of {kind} are not linear in its size; use --causes {kind}")
        own = [self._chosen(one)[0] for one in sets[k]]
        causes = [*map(self._sized, own), *free]
        others = [[self._forms(name, own) for name in one] for j, one in enumerate(sets) if j != k]
        acting = [cause for one in others for forms in one for cause in forms]
        at = np.cumsum([0, *(len(one.numbers) for one in (*causes, *acting))])
        places = iter(range(len(causes), len(causes) + len(acting)))
        size = np.zeros(at[-1])
        for cause, first in zip(causes[: len(own)], at, strict=False):
            size[first] = cause.numbers[0] / cause.units[0]
        fixed = [np.eye(at[-1])[:, at[len(own)] : at[len(causes)]]]
        pairs = []
        for one, names in zip(others, (one for j, one in enumerate(sets) if j != k), strict=True):
            ways = [fixed]
            for name, forms in zip(names, one, strict=True):
                held = [j for j, each in enumerate(own) if not forms and each == self._chosen(name)[0]]
                spans = [slice(at[j], at[j + 1]) for j in held or [next(places) for _ in forms]]
                ways = [[*before, way] for before in ways for way in _ways(forms, spans, at[-1])]
            pairs.append((f"{'+'.join(sets[k])} (true) or {'+'.join(names)}", size, tuple(map(np.hstack, ways))))
        return Truth(tuple(causes), tuple(acting), tuple(pairs))

    def _forms(self, name: str, true: Sequence[Candidate]) -> list[Cause]:
        """Return forms of a cause as alternatives, several if its shape is free, without the true ones."""
        able = self._chosen(name)
        if able[0] in true:
            return []
        if len(able) < 2 or not (free := begin(able[0], np.zeros(1)).free):
            return [self._sized(able[0])]
        (shape,) = free
        log = FREE[able[0].kind][shape].log
        ends = [float((np.log if log else float)(one.shape[shape])) for one in able]
        nodes = 0.5 * (min(ends) + max(ends)) - 0.5 * np.ptp(ends) * np.cos(np.linspace(0.0, np.pi, NODES))
        each = (np.exp(nodes) if log else nodes).tolist()
        return [self._sized(self._bent(able[0], {shape: value})) for value in each]

    def _bent(self, one: Candidate, shape: dict[str, float]) -> Candidate:
        """Return a candidate with another shape, and its unit size."""
        trial = catalogue()[one.kind](**{**one.shape, **shape}, **{one.size: one.unit})
        return one._replace(shape={**one.shape, **shape}, unit=trial.unit_size(self._values))

    @property
    def in_time(self) -> bool:
        """Whether a cause changes with time."""
        return any("time_constant" in one.candidate.shape for own in self.truths for one in (*own.causes, *own.others))


def _ways(forms: Sequence[Cause], spans: Sequence[slice], size: int) -> list[Array]:
    """Return directions of a cause, (size, k) each: of a free shape, one for each of many values.

    Between the values of a few forms, effects of a unit size are polynomials of the shape's number (Lagrange).
    """
    every = np.eye(size)
    if len(forms) < 2:
        return [every[:, spans[0]]]
    nodes = np.array([one.numbers[1] for one in forms])
    made = []
    for value in np.linspace(nodes.min(), nodes.max(), VALUES):
        apart = np.where(np.eye(len(nodes), dtype=bool), 1.0, nodes[:, None] - nodes)
        parts = np.where(np.eye(len(nodes), dtype=bool), 1.0, value - nodes) / apart
        made.append(every[:, [span.start for span in spans]] @ np.prod(parts, axis=1)[:, None])
    return made


def name_of(cause: Cause) -> str:
    """Return the kind of a cause with the given parts of its shape."""
    free = (*cause.free, "damping")
    return ":".join([cause.candidate.kind, *(f"{k}={v}" for k, v in cause.candidate.shape.items() if k not in free)])


class Encoder(NamedTuple):
    """Properties of both encoders.

    Args:
        counts: per revolution; ``None`` for an exact encoder.
        noise: standard deviation of a reading of drive and loose gear [rad].
    """

    counts: tuple[int | None, int | None]
    noise: tuple[float, float]

    def __str__(self) -> str:
        counts = " and ".join(dict.fromkeys(f"{count} counts" if count else "no counts" for count in self.counts))
        noise = " and ".join(dict.fromkeys(f"{1e6 * one:.3g} µrad" for one in self.noise))
        return f"{counts}, noise {noise}" if any(self.noise) else counts


class Look(NamedTuple):
    """Information of a simulated run on all numbers, in units.

    Args:
        path: windows along the path, the information of one record; ``None`` where the path is not followed.
        events: the same of flights, contacts, impacts and losses of contact.
        windows: of the simulated record.
        dense: number of windows per second.
        runs: number of readings with the same residual.
        driven: as path, without the part that the uncertainty of the drive's motion may explain; it separates sets.
    """

    path: Information | None
    events: Information | None
    windows: int = 0
    dense: float = 0.0
    runs: float = 1.0
    driven: Information | None = None


class Setting(NamedTuple):
    """Mean speed and fluctuation of a run: name, keys of the scenario, and the scenario itself."""

    name: str
    keys: dict[str, Any]
    rig: Scenario


def simulated(setting: Setting, truth: Truth, lasts: float) -> Recording:
    """Return the motion of a run with the true causes, at the samples of the encoders."""
    rate = setting.rig.sensors.sample_rate
    rig = setting.rig.with_({"run.duration": f"{lasts!r} s", "run.output_rate": f"{rate!r} Hz"})
    tables = [("effect[+]", table(one)) for one in truth.effects]
    return simulate(rig.with_(tables) if tables else rig, "rigid")


def look_at(made: Recording, setting: Setting, encoder: Encoder, truth: Truth, free: bool, seed: int = 0) -> Look:
    """Return the information on the numbers of causes from the readings of a simulated run."""
    drive, loose = (Sensor(*own) for own in zip(encoder.counts, encoder.noise, strict=True))
    read = encode(made, Sensors(setting.rig.sensors.sample_rate, drive, loose), seed)
    meta = {"zero_arbitrary": ("drive", "loose")} if free else {}
    channels = Channels(dict(read.signals), setting.name, meta)
    sensed = setting.rig.with_(keys_of(encoder))
    findings = examine(channels, sensed)
    for one in findings:
        if one.fatal:
            raise InputError(Fault(one.channel, f"{one.evidence} [{one.kind}]", one.remedy))
    admitted, paths = Admitted(channels, sensed, findings, setting.name), Paths()
    known = paths.of(admitted)
    look = Look(None, None)
    if shootable(sensed):
        period = sensed.period if sensed.motion.harmonics else np.inf
        windows = Windows(sensed, [known], [period], [meta.get("zero_arbitrary", ())])
        look = _along_path(windows, truth, free) if len(windows) else look
        if len(windows) < MOST:
            dense = len(windows) / (known.time[-1] - known.time[0])
        else:  # the maximum number is reached
            dense = 0.96 / float(max(windows.step[0] * (windows.drive[0].shape[1] - 1), min(period, 1e9)))
        look = look._replace(windows=len(windows), dense=float(dense))
    if truth.lawful or has_compliance(sensed):
        return look
    try:
        seen = preprocess(admitted, delay_of([admitted]), paths=paths)
        seen = turn(seen, 2.0 * np.pi, 2.0 * np.pi) if free else seen  # not the reference record of the angular datums
        found = given([seen], truth.causes, ()).records[0]
        return look._replace(events=information(found, truth.causes, truth.others))
    except InputError:
        if look.path is None:
            raise
        return look


def _along_path(windows: Windows, truth: Truth, free: bool) -> Look:
    """Return the information of windows on the numbers of causes; none where they do not follow the readings."""
    effects = truth.effects
    windows.restart(effects, anew=True)
    now = polished(windows, fitted(windows, state_of(windows, truth.causes, windows.residuals(effects))))
    # a shape with little influence on a small cause may have drifted: all is computed at the causes as given
    now = state_of(windows, truth.causes, settled(windows, effects, windows.residuals(effects)))
    if windows.usual(now.rest) > ACCOUNTS:
        return Look(None, None)
    along = windows.along(effects_of(now.causes))
    weight = windows.weights(along.rest)
    away = WithoutStarts(windows, [one * weight for one in along.starts()])
    numbers = sum(len(one.numbers) for one in now.causes)
    made = columns_of(along, now.causes)
    own, local = made[:numbers], made[numbers:]
    for gear, by in zip(GEARS, ((ANGLE_STEP, 0.0), (0.0, ANGLE_STEP)), strict=True):
        turning = [one.effect for one in now.causes if free and goes_by(one.candidate) == gear and one.effect]
        local += [sum((along.column(one, one, by) for one in turning), np.zeros(len(along.rest)))]
    for cause in truth.others:
        for k, unit in enumerate(cause.units):
            moved = cause.numbers.copy()
            moved[k] += SLOPE_STEP * unit
            own.append(along.column(cause._replace(numbers=moved).effect, cause.effect) / SLOPE_STEP)
    slopes = np.column_stack([away(one * weight) for one in own])
    rest = away(now.rest * weight)
    zeros = np.column_stack([away(one * weight) for one in local])
    if np.any(zeros):
        size = np.sqrt(np.sum(zeros**2, axis=0))
        left, size, _ = np.linalg.svd(zeros / np.where(size > 0.0, size, 1.0), full_matrices=False)
        left = left[:, size > 1e-9 * size[0]]
        slopes, rest = slopes - left @ (left.T @ slopes), rest - left @ (left.T @ rest)
    every = windows.every[: len(rest)]
    scores = np.column_stack([np.bincount(every, one * rest, len(windows)) for one in slopes.T])
    count = max(len(rest) - slopes.shape[1] - 2 * len(windows), 1)
    made = Information(slopes.T @ slopes, scores, float(rest @ rest), count)
    record, driven = windows.record[every], along.driven()
    waves = np.concatenate([away(driven * (record == k) * weight) for k in range(len(windows.zeros))]).T
    across = waves.T @ slopes
    less = across.T @ np.linalg.solve(waves.T @ waves + np.eye(waves.shape[1]), across)
    return Look(made, None, runs=windows.runs(now.rest), driven=made._replace(normal=made.normal - less))


def keys_of(encoder: Encoder) -> dict[str, Any]:
    """Return encoders as keys of a scenario."""
    made: dict[str, Any] = {}
    for gear, count, noise in zip(("drive", "loose"), encoder.counts, encoder.noise, strict=True):
        made |= {f"sensors.{gear}.counts_per_revolution": count} if count else {}
        made |= {f"sensors.{gear}.noise": f"{noise!r} rad"} if noise else {}
    return made
