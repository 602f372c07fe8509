"""Both flanks of a record over angles and time: active flank and dead band, fitted to places on them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gears3d.measured.segmentation.terms import LOW_ORDERS, Terms
from gears3d.signals.orders import GEARS

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
        """Return columns of the terms with those of the gap beside them, which only the reverse flank has."""
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
    band: both flanks of a gear that runs out move alike, so that the dead band need not have what the flank has. The
    sizes with the greatest evidence are taken, for some hundred places: neighbours are not independent of what the
    terms leave out.
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
