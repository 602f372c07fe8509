"""Flanks of a record: their terms, the columns of these over time, drive and loose gear, and the fit."""

from __future__ import annotations

from math import floor
from typing import NamedTuple

import numpy as np

from gears3d.kernels import njit
from gears3d.measured.segmentation.displacement import Blocks, Shape
from gears3d.signals.orders import GEARS

# What a term is: a constant, a power of time, orders of either gear.
OFFSET, DRIFT, DRIVE, LOOSE = range(4)
# Powers of two among orders: the highest is below 2**BITS.
BITS = 16
# Times processed together, for vectorisation.
TOGETHER = 64


# Parts of pi/4 short enough for their products with whole numbers to be exact.
EIGHTH = (7.85398125648498535156e-1, 3.77489470793079817668e-8, 2.69515142907905952645e-15)
SINE = (1.58962301576546568060e-10, -2.50507477628578072866e-8, 2.75573136213857245213e-6,
        -1.98412698295895385996e-4, 8.33333333332211858878e-3, -1.66666666666666307295e-1)  # fmt: skip
# Coefficients of both over an eighth of a turn to either side, highest power first (Moshier's Cephes library).
COSINE = (-1.13585365213876817300e-11, 2.08757008419747316778e-9, -2.75573141792967388112e-7,
          2.48015872888517045348e-5, -1.38888888888730564116e-3, 4.16666666666665929218e-2)  # fmt: skip
# Codes of the kinds of terms in the kernels, which do not handle shapes.
SORTS = {"offset": OFFSET, "drift": DRIFT, "drive": DRIVE, "loose": LOOSE,
         "shape": OFFSET}  # fmt: skip
# Columns before those of shapes.
SHAPED = 3

# Of either gear, once per revolution and its multiples, that flanks may have.
LOW_ORDERS = (1, 2, 3)
# Multiples of the tooth number.
MESH_ORDERS = (1, 2)
# Expected size of a term in gaps: terms that the record does not determine stay small.
PRIOR = {"offset": 1e3, "drift": 0.05, "low": 0.3, "mesh": 0.05, "shape": 0.3, "known": 0.005}
# Standard deviation, in gaps, of order 1 (order n: the n-th part) and of mesh orders of gears of quality 6 to 9 in
# usual backlash: runout and transmission error after ISO 1328, backlash after DIN 3967.
USUAL = {"low": 0.05, "mesh": 0.005}
# Least dead band over its mean: at angles without contact it is not determined.
NARROWEST = 0.4
# Parts of the expected sizes that are tried.
SIZES = (0.01, 0.03, 0.1, 0.3, 1.0)
# Sorts of terms that have a size each, and rounds in which these are found one after the other.
SORTED, SWEEPS = ("drift", "low", "mesh"), 2
# Part of its expected size that a shape may have on the other flank.
NONE = 1e-3
# Places that count as evidence for a size, at most.
EVIDENCE = 300


@njit(cache=True)
def turned(angle: np.ndarray, cosine: np.ndarray, sine: np.ndarray) -> None:
    """Write cosine and sine of angles, to rounding; without branches, so that several are computed at once.

    ``angle``: up to 1e8 [rad], (n,); ``cosine``: written, (n,) or longer; ``sine``: written, (n,) or longer.
    """
    for i in range(len(angle)):
        quarters = floor(angle[i] * 0.6366197723675814 + 0.5)
        y = 2.0 * quarters
        x = ((angle[i] - y * EIGHTH[0]) - y * EIGHTH[1]) - y * EIGHTH[2]
        z = x * x
        s = SINE[0] * z + SINE[1]
        s = (((s * z + SINE[2]) * z + SINE[3]) * z + SINE[4]) * z + SINE[5]
        s = x + x * z * s
        c = COSINE[0] * z + COSINE[1]
        c = (((c * z + COSINE[2]) * z + COSINE[3]) * z + COSINE[4]) * z + COSINE[5]
        c = 1.0 - 0.5 * z + z * z * c
        quarter = quarters - 4.0 * floor(0.25 * quarters)
        odd = quarter - 2.0 * floor(0.5 * quarter)
        half = 1.0 - 2.0 * floor(0.5 * quarter)  # -1 in the second half of a turn
        cosine[i] = half * (c if odd == 0.0 else -s)
        sine[i] = half * (s if odd == 0.0 else c)


@njit(cache=True)
def _squared(angle: np.ndarray, sort: np.ndarray, order: np.ndarray, gear: int, re: np.ndarray, im: np.ndarray) -> None:
    """Write cosine and sine of angles times 1, 2, 4, ..., as far as a gear's orders need them, by squaring.

    ``angle``: of the gear [rad], (n,), n at most TOGETHER; ``sort``: of each term, (m,); ``order``: of each, (m,);
    ``re``: written, (BITS, TOGETHER); ``im``: written, (BITS, TOGETHER).
    """
    top, count = 0, len(angle)
    for j in range(len(sort)):
        if sort[j] == gear:
            top = max(top, order[j])
    if top == 0:
        return
    turned(angle, re[0], im[0])
    bit = 1
    while top >> bit:
        for i in range(count):
            a, b = re[bit - 1, i], im[bit - 1, i]
            re[bit, i], im[bit, i] = a * a - b * b, 2.0 * a * b
        bit += 1


@njit(cache=True)
def _power(order: int, re: np.ndarray, im: np.ndarray, count: int, cosine: np.ndarray, sine: np.ndarray) -> None:
    """Write cosine and sine of a multiple of angles, from those of powers of two, (count,)."""
    for i in range(count):
        cosine[i], sine[i] = 1.0, 0.0
    bit = 0
    while order >> bit:
        if (order >> bit) & 1:
            for i in range(count):
                a, b = cosine[i], sine[i]
                cosine[i], sine[i] = a * re[bit, i] - b * im[bit, i], a * im[bit, i] + b * re[bit, i]
        bit += 1


@njit(cache=True)
def _term(
    sort: int, order: int, x: np.ndarray, turns: tuple, cosine: np.ndarray, sine: np.ndarray
) -> int:  # fmt: skip
    """Write the columns of one term at some times, (n,) each, and return how many there are.

    ``x``: times from -1 to 1, (n,).
    """
    count = len(x)
    if sort == OFFSET:
        for i in range(count):
            cosine[i] = 1.0
        return 1
    if sort == DRIFT:
        for i in range(count):
            cosine[i] = x[i] if order == 1 else 1.5 * x[i] * x[i] - 0.5
        return 1
    if sort == DRIVE:
        _power(order, turns[0], turns[1], count, cosine, sine)
    else:
        _power(order, turns[2], turns[3], count, cosine, sine)
    return 2


@njit(cache=True)
def fill_columns(
    sort: np.ndarray, order: np.ndarray, x: np.ndarray, drive: np.ndarray, loose: np.ndarray, written: np.ndarray
) -> None:
    """Write the columns at times and angles: what each term is there.

    ``sort``: of each term, one of the four, (m,); ``order``: or degree of each, (m,); ``x``: times from -1 to 1, (n,);
    ``drive``: [rad], (n,); ``loose``: [rad], (n,); ``written``: one number for a constant or a power, two for an order,
    (n, p).
    """
    turns = (
        np.zeros((BITS, TOGETHER)), np.zeros((BITS, TOGETHER)), np.zeros((BITS, TOGETHER)), np.zeros((BITS, TOGETHER))
    )  # fmt: skip
    cosine, sine = np.zeros(TOGETHER), np.zeros(TOGETHER)
    for first in range(0, len(x), TOGETHER):
        last = min(first + TOGETHER, len(x))
        _squared(drive[first:last], sort, order, DRIVE, turns[0], turns[1])
        _squared(loose[first:last], sort, order, LOOSE, turns[2], turns[3])
        at = 0
        for j in range(len(sort)):
            width = _term(sort[j], order[j], x[first:last], turns, cosine, sine)
            for i in range(last - first):
                written[first + i, at] = cosine[i]
                if width == 2:
                    written[first + i, at + 1] = sine[i]
            at += width


@njit(cache=True)
def fill_sums(
    sort: np.ndarray,
    order: np.ndarray,
    x: np.ndarray,
    drive: np.ndarray,
    loose: np.ndarray,
    numbers: np.ndarray,
    written: np.ndarray,
) -> None:
    """Write sums of the columns.

    ``sort``: of each term, (m,); ``order``: or degree of each, (m,); ``x``: times from -1 to 1, (n,); ``drive``: [rad],
    (n,); ``loose``: [rad], (n,); ``numbers``: of each sum, (s, p); ``written``: (s, n).
    """
    turns = (
        np.zeros((BITS, TOGETHER)), np.zeros((BITS, TOGETHER)), np.zeros((BITS, TOGETHER)), np.zeros((BITS, TOGETHER))
    )  # fmt: skip
    cosine, sine = np.zeros(TOGETHER), np.zeros(TOGETHER)
    for first in range(0, len(x), TOGETHER):
        last = min(first + TOGETHER, len(x))
        count = last - first
        _squared(drive[first:last], sort, order, DRIVE, turns[0], turns[1])
        _squared(loose[first:last], sort, order, LOOSE, turns[2], turns[3])
        for s in range(numbers.shape[0]):
            written[s, first:last] = 0.0
        at = 0
        for j in range(len(sort)):
            width = _term(sort[j], order[j], x[first:last], turns, cosine, sine)
            for s in range(numbers.shape[0]):
                one, other = numbers[s, at], numbers[s, at + width - 1]
                own = written[s, first:last]
                for i in range(count):
                    own[i] += one * cosine[i]
                if width == 2:
                    for i in range(count):
                        own[i] += other * sine[i]
            at += width


class Terms(NamedTuple):
    """Terms of a flank's position.

    Args:
        kinds: ``"offset"``, ``"drift"``, ``"shape"``, ``"drive"``, ``"loose"`` each with its number, degree or order,
            in columns.
        prior: expected size of each column in gaps, (p,).
        begin: of the record [s].
        span: of the record [s].
        grown: orders, the last ones, that the record itself asked for.
        shapes: that flanks may have besides orders.
        gap: expected size of each column of the dead band in gaps, (p,); half of ``prior`` without.
    """

    kinds: tuple[tuple[str, int], ...]
    prior: np.ndarray
    begin: float
    span: float
    grown: int = 0
    shapes: tuple[Shape, ...] = ()
    gap: np.ndarray | None = None

    @property
    def both(self) -> np.ndarray:
        """Expected sizes of the columns of the active flank and of the dead band in gaps, (2p,)."""
        return np.concatenate([self.prior, 0.5 * self.prior if self.gap is None else self.gap])

    def with_orders(self, taken: list[tuple[str, int]], size: float) -> Terms:
        """Return the terms with further orders.

        Args:
            taken: gear and order of each.
            size: expected of them, in gaps.
        """
        prior = np.append(self.prior, np.full(2 * len(taken), size))
        gap = None if self.gap is None else np.append(self.gap, np.full(2 * len(taken), 0.5 * size))
        return self._replace(kinds=(*self.kinds, *taken), prior=prior, gap=gap, grown=self.grown + len(taken))

    def without_mesh(self, size: float) -> Terms:
        """Return the terms with mesh orders that are expected to be as small as this part of what they were."""
        widths = [2 if kind in GEARS else 1 for kind, _ in self.kinds]
        mesh = np.repeat([kind in GEARS and order not in LOW_ORDERS for kind, order in self.kinds], widths)
        return self._replace(prior=np.where(mesh, size, 1.0) * self.prior)

    def columns(self, time: np.ndarray, drive: np.ndarray, loose: np.ndarray) -> np.ndarray:
        """Return the columns at times and angles, (n, p).

        Args:
            time: [s], (n,).
            drive: [rad], (n,).
            loose: [rad], (n,).
        """
        made = np.zeros((len(time), len(self.prior)))
        fill_columns(*self._coded(), *self._at(time, drive, loose), made)
        for number, shape in enumerate(self.shapes):
            made[:, SHAPED + number] = shape.over(drive, loose)
        return made

    def sums(self, numbers: np.ndarray, time: np.ndarray, drive: np.ndarray, loose: np.ndarray) -> np.ndarray:
        """Return sums of the columns, without making these, (s, n).

        Args:
            numbers: of each sum, (s, p).
            time: [s], (n,).
            drive: [rad], (n,).
            loose: [rad], (n,).
        """
        made = np.zeros((len(numbers), len(time)))
        known = numbers.copy()
        known[:, SHAPED : SHAPED + len(self.shapes)] = 0.0
        fill_sums(*self._coded(), *self._at(time, drive, loose), known, made)
        return made + self.shaped(numbers, drive, loose)

    @property
    def flank(self) -> np.ndarray:
        """Flank that each column belongs to, 0 active, 1 reverse, -1 both, (p,)."""
        owner = np.full(len(self.prior), -1)
        owner[SHAPED : SHAPED + len(self.shapes)] = [shape.flank for shape in self.shapes]
        return owner

    @property
    def fixed(self) -> np.ndarray:
        """Whether each column is the offset or a shape, which no order replaces, (p,)."""
        fixed = np.zeros(len(self.prior), bool)
        fixed[0] = True
        fixed[SHAPED : SHAPED + len(self.shapes)] = True
        return fixed

    @property
    def usual(self) -> np.ndarray:
        """Size of each column in usual gears in gaps, that of ``prior`` for terms other than orders, (p,)."""
        sizes = self.prior.copy()
        first = 0
        for place, (kind, order) in enumerate(self.kinds):
            wide = 2 if kind in GEARS else 1
            if wide == 2 and place < len(self.kinds) - self.grown:
                sizes[first : first + 2] = USUAL["low"] / order if order in LOW_ORDERS else USUAL["mesh"]
            first += wide
        return sizes

    @property
    def expected(self) -> np.ndarray:
        """Numbers that the columns are expected to have beforehand, each on its flank [m], (p,)."""
        numbers = np.zeros(len(self.prior))
        numbers[SHAPED : SHAPED + len(self.shapes)] = [shape.size for shape in self.shapes]
        return numbers

    def shaped(self, numbers: np.ndarray, drive: np.ndarray, loose: np.ndarray) -> np.ndarray:
        """Return the contribution of the shapes alone to sums of the columns, (s, n).

        Args:
            numbers: of each sum, (s, p).
            drive: [rad], (n,).
            loose: [rad], (n,).
        """
        made = np.zeros((len(numbers), len(drive)))
        for number, shape in enumerate(self.shapes):
            made += numbers[:, SHAPED + number, None] * shape.over(drive, loose)
        return made

    def _coded(self) -> tuple[np.ndarray, np.ndarray]:
        """Return sort and order of the terms as numbers."""
        return np.array([SORTS[kind] for kind, _ in self.kinds]), np.array([order for _, order in self.kinds])

    def _at(self, time: np.ndarray, drive: np.ndarray, loose: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return time from -1 to 1 over the record, and the angles, as the kernels take them."""
        x = 2.0 * (time - self.begin) / self.span - 1.0
        return x, np.ascontiguousarray(drive), np.ascontiguousarray(loose)


def make_terms(path: Blocks, teeth: tuple[int, int] | None) -> Terms:
    """Return the terms that a record can distinguish.

    Orders of both gears are one where the gears have turned by almost equal angles; mesh orders need blocks short
    enough and a record of some meshes.

    Args:
        path: displacement in blocks.
        teeth: of drive and loose gear where known.
    """
    span = float(path.time[-1] - path.time[0])
    turns = [abs(float(angle[-1] - angle[0])) / (2 * np.pi) for angle in (path.drive, path.loose)]
    kinds, prior = [("offset", 0)], [PRIOR["offset"]]
    for degree in (1, 2):
        kinds.append(("drift", degree))
        prior.append(PRIOR["drift"])
    for number, shape in enumerate(path.shapes):
        kinds.append(("shape", number))
        prior.append(PRIOR["known" if shape.known else "shape"])
    apart = abs(turns[0] - turns[1])
    for gear in ("drive", "loose") if apart > 0.5 else ("drive",):
        for order in LOW_ORDERS:
            kinds.append((gear, order))
            prior += 2 * [PRIOR["low"] / order]
    per_turn = len(path.time) / max(turns[0], 1e-9)
    for multiple in MESH_ORDERS if teeth else ():
        order = multiple * (teeth or (0, 0))[0]
        if order * turns[0] > 10.0 and per_turn > 8.0 * order:
            kinds.append(("drive", order))
            prior += 2 * [PRIOR["mesh"]]
    return Terms(tuple(kinds), np.array(prior), float(path.time[0]), span, shapes=path.shapes)


class Flanks(NamedTuple):
    """Both flanks of a record.

    Args:
        terms: of both.
        active: coefficients of the active flank's place [m], (p,).
        gap: coefficients of the dead band [m], (p,); ``None`` without an impact on the reverse flank.
        covariance: of (active, gap) [m²], (2p, 2p) or (p, p).
        rough: standard deviation of blocks in contact about their flank [m].
        contact: share of the blocks that were taken for contact.
        usual: covariance of (active, gap) where flanks may have the orders of usual gears and the places of contact are
            all that is known [m²]; ``None``: that is ``covariance``.
    """

    terms: Terms
    active: np.ndarray
    gap: np.ndarray | None
    covariance: np.ndarray
    rough: float
    contact: float
    usual: np.ndarray | None = None

    def places(self, time: np.ndarray, drive: np.ndarray, loose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the displacement of the active and the reverse flank [m], infinity without a reverse flank, each (n,).

        Args:
            time: [s], (n,).
            drive: [rad], (n,).
            loose: [rad], (n,).
        """
        if self.gap is None:
            low = self.terms.sums(self.active[None], time, drive, loose)[0]
            return low, np.full_like(low, np.inf)
        low, width = self.terms.sums(np.stack([self.active, self.gap]), time, drive, loose)
        return low, low + np.maximum(width, NARROWEST * self.gap[0])

    def lifted(self, drive: np.ndarray, loose: np.ndarray, flank: np.ndarray) -> np.ndarray:
        """Return the displacement of a flank by shapes other than orders [m], (n,).

        Args:
            drive: [rad], (n,).
            loose: [rad], (n,).
            flank: 0 active, 1 reverse, (n,).
        """
        gap = np.zeros_like(self.active) if self.gap is None else self.gap
        low, width = self.terms.shaped(np.stack([self.active, gap]), drive, loose)
        return low + width * (np.asarray(flank) == 1)

    def sigma(self, time: np.ndarray, drive: np.ndarray, loose: np.ndarray, flank: np.ndarray) -> np.ndarray:
        """Return the standard deviation of a flank's position [m], (n,).

        Args:
            time: [s], (n,).
            drive: [rad], (n,).
            loose: [rad], (n,).
            flank: 0 active, 1 reverse, (n,).
        """
        return self._slack(self.terms.columns(time, drive, loose), flank)

    def rate_sigma(self, times: np.ndarray, drive: np.ndarray, loose: np.ndarray, flank: np.ndarray) -> np.ndarray:
        """Return the standard deviation of a flank's speed [m/s], (n,), orders without contact included.

        Args:
            times: shortly before and shortly after [s], (2, n).
            drive: then [rad], (2, n).
            loose: then [rad], (2, n).
            flank: 0 active, 1 reverse, (n,).
        """
        return np.linalg.norm(self.rate_errors(times, drive, loose, flank), axis=1)

    def rate_errors(self, times: np.ndarray, drive: np.ndarray, loose: np.ndarray, flank: np.ndarray) -> np.ndarray:
        """Return a flank's speed by each independent standard error of the coefficients [m/s], (n, q).

        The speeds of a flank at many moments have these errors in common.

        Args:
            times: shortly before and shortly after [s], (2, n).
            drive: then [rad], (2, n).
            loose: then [rad], (2, n).
            flank: 0 active, 1 reverse, (n,).
        """
        before, after = (self.terms.columns(*at) for at in zip(times, drive, loose, strict=True))
        size, turned = np.linalg.eigh(self.covariance if self.usual is None else self.usual)
        return self._sides((after - before) / (times[1] - times[0])[:, None], flank) @ (
            turned * np.sqrt(np.maximum(size, 0.0))
        )

    def _slack(self, columns: np.ndarray, flank: np.ndarray) -> np.ndarray:
        """Return the standard deviation of sums of the terms' columns, with those of the gap on the reverse flank."""
        columns = self._sides(columns, flank)
        return np.sqrt(np.maximum(np.einsum("na,ab,nb->n", columns, self.covariance, columns), 0.0))

    def _sides(self, columns: np.ndarray, flank: np.ndarray) -> np.ndarray:
        """Return columns of the terms and those of the gap, which only the reverse flank has."""
        return columns if self.gap is None else np.hstack([columns, columns * (np.asarray(flank) == 1)[:, None]])

    @property
    def backlash(self) -> tuple[float, float] | None:
        """Mean dead band and its standard deviation [m]; ``None`` without an impact on the reverse flank."""
        if self.gap is None:
            return None
        at = len(self.gap)
        known = [each[at, at] for each in (self.covariance, self.usual) if each is not None]
        return float(self.gap[0]), float(np.sqrt(max(known)))


def through(
    terms: Terms,
    columns: np.ndarray,
    side: np.ndarray,
    place: np.ndarray,
    scale: float,
    gap: float,
    both: bool,
    robust: bool = True,
    weight: np.ndarray | None = None,
) -> Flanks:
    """Return the flanks through places on them: least squares with expected sizes, Tukey's weights against outliers.

    ``columns``: of the terms at the places, (n, p); ``side``: 0 active, 1 reverse, (n,); ``place``: displacement [m],
    (n,); ``scale``: standard deviation of a place [m]; ``gap``: about the width of the dead band [m]; ``weight``: of
    the places, (n,); equal if ``None``.
    """
    count = columns.shape[1]
    owner = terms.flank
    low, high = np.where(owner < 1, terms.expected, 0.0), np.where(owner == 1, terms.expected, 0.0)
    behind = side[:, None].astype(float)
    whole = columns * np.where(owner == 0, 1.0 - behind, owner < 1)  # a shape of one flank does not apply to the other
    whole = np.hstack([whole, columns * (owner != 0) * behind]) if both else whole
    idle = np.concatenate([owner == 1, owner == 0])
    prior = (terms.both * gap * np.where(idle, NONE, 1.0))[: whole.shape[1]]
    if both:
        prior[count] = 0.3 * gap
        place = place - gap * (side == 1)
    prior[0] = prior[0] if both or not len(place) else 1e3 * max(gap, float(np.abs(place).max()))
    expected = np.concatenate([low, high])[: whole.shape[1]]
    place = place - whole @ expected
    middle = float(np.median(place))
    weight = np.ones(len(place)) if weight is None else weight
    shares, numbers, strict = weight, np.zeros(whole.shape[1]), prior
    for _ in range(6 if robust else 1):
        strict = _sized(whole, place - middle, shares / scale**2, prior, terms)
        normal = (whole * shares[:, None]).T @ whole / scale**2 + np.diag(strict**-2)
        numbers = np.linalg.solve(normal, whole.T @ (shares * (place - middle)) / scale**2)
        if robust:
            off = (place - middle - whole @ numbers) / (6.0 * scale)
            shares = weight * np.square(np.clip(1.0 - off**2, 0.0, None))
    normal = (whole * shares[:, None]).T @ whole / scale**2 + np.diag(strict**-2)
    numbers += expected
    numbers[0] += middle
    if both:
        numbers[count] += gap
    covariance = np.linalg.inv(normal)
    if both:
        apart = np.eye(2 * count)
        apart[count:, :count] = -np.diag(1.0 * (owner == 0))  # where the flank is higher, the dead band is narrower
        numbers, covariance = apart @ numbers, apart @ covariance @ apart.T
    return Flanks(terms, numbers[:count], numbers[count:] if both else None, covariance, scale, 0.0)


def usual_covariance(
    terms: Terms, columns: np.ndarray, side: np.ndarray, weight: np.ndarray, scale: float, gap: float, both: bool
) -> np.ndarray:
    """Return the covariance of the numbers of flanks with orders such as usual gears have [m²], (2p, 2p) or (p, p).

    Orders that contact does not show are absent from the fitted flanks, as nothing else extrapolates well; the gears
    may have them all the same. The arguments are those of :func:`through`.
    """
    prior = terms.usual * (gap if both else max(gap, 1e-300))
    whole = columns
    if both:
        whole = np.hstack([columns, columns * (side[:, None] == 1)])
        prior = np.concatenate([prior, 0.5 * prior])
        prior[len(terms.prior)] = gap
    return np.linalg.inv((whole * weight[:, None]).T @ whole / scale**2 + np.diag(prior**-2.0))


def _sized(whole: np.ndarray, place: np.ndarray, weight: np.ndarray, prior: np.ndarray, terms: Terms) -> np.ndarray:
    """Return expected sizes, shrunk to the evidence of the places: it limits extrapolation to angles without contact.

    First one size for all terms, then one for drift, low and mesh orders each, of the active flank and of the dead
    band: both flanks of a gear with run-out move by the same amount, so that the dead band need not have the terms of
    the flank. The sizes with the greatest evidence are taken, for some hundred places: neighbours are not independent
    of what the terms leave out.
    """
    some = slice(None, None, max(len(place) // EVIDENCE, 1))
    rows, values, strength = whole[some], place[some], weight[some]
    square = (rows * strength[:, None]).T @ rows
    right = rows.T @ (strength * values)
    count = len(terms.prior)
    sorts = np.tile(_sorts(terms), -(-len(prior) // count))
    sorts[count:] += (sorts[count:] > 0) * len(SORTED)

    def best(tried: np.ndarray) -> np.ndarray:
        normal = square + (tried**-2)[:, :, None] * np.eye(len(prior))
        gains = np.linalg.solve(normal, np.broadcast_to(right[:, None], (len(tried), len(right), 1)))[..., 0] @ right
        return tried[np.argmin(np.linalg.slogdet(normal)[1] + 2.0 * np.log(tried).sum(axis=1) - gains)]

    sizes = np.array(SIZES)[:, None]
    found = best(np.where(sorts == 0, prior, sizes * prior))
    for _ in range(SWEEPS):
        before = found
        for sort in np.unique(sorts[sorts > 0]):
            found = best(np.where(sorts == sort, sizes * prior, found))
        if np.array_equal(found, before):
            break
    return found


def _sorts(terms: Terms) -> np.ndarray:
    """Return the sort of each column whose expected size is found from the places, 0 of one that is not, (p,)."""
    sorts = []
    for kind, number in terms.kinds:
        if kind in GEARS:
            sorts += 2 * [SORTED.index("low" if number in LOW_ORDERS else "mesh") + 1]
        else:
            sorts.append(SORTED.index("drift") + 1 if kind == "drift" else 0)
    sorts = np.array(sorts)
    sorts[len(sorts) - 2 * terms.grown :] = 0
    return sorts
