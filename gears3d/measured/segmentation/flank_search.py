"""Position of the flanks, from the path alone: through velocity jumps, then through all blocks at rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gears3d.measured.segmentation.displacement import Blocks, Kinks
from gears3d.measured.segmentation.flanks import NARROWEST, Flanks, Terms, make_terms, through, usual_covariance
from gears3d.measured.segmentation.orders import Contact, resolved, strongest
from gears3d.signals import robust_deviation
from gears3d.signals.orders import GEARS

# Velocity jumps on a flank below which it is not known to be smooth.
SEEN = 3
# Noises of a block by which half of the jumps may scatter about a smooth flank: rounding moves them, too.
SCATTER = 3.0
# Noises of a block from which on a jump is not on a smooth flank, and the part of its jumps behind its edge.
STRAY, EDGE = 12.0, 0.05
# Times its noise that contact scatters at most without bounces in it: the median's own error is 10 %.
CALM = 1.3
# Times the noise of a block up to which the crossing of two flights counts: others hardly cross, or far away.
CLOSE = 1.25
# Times the scatter of contact that its mean may lie inside of the flank.
CHATTER = 3.0
# Standard deviations by which touches must deviate from a flank for it to be moved to these.
SURE = 3.0
# Expected size, in noises of a block, of an order that is taken to be absent.
ABSENT = 1e-3
# Places on a flank for each column, below which they do not show it.
PLACES = 20
# Variance inflation factor from which on a column is not distinguishable: 5 to 10 are usual in regression.
INFLATED = 5.0
# Part of its expected size that an order has which contact does not tell from lower ones.
HIDDEN = 1e-3
# Part of the dead band that counts like noise of a jump's place: flights are curved within its reach.
CORNER = 0.003
# Misplacement of a jump between two blocks, over the way that the jump of speed makes in a block.
ROUNDED = 0.25
ROUNDS = 8
# Rounds before which significant orders are looked for.
GROWS = (0, 2, 4)
# Orders of a record at most.
MOST_ORDERS = 16
# Times its noise that contact may scatter without a search for orders: the tips of bounces lie in it.
QUIET = 1.5
# Times its noise that a path may deviate from its flank without a search for orders.
SMOOTH = 1.5
# Part of the dead band that blocks of contact may be off their flank at first.
WIDEST = 0.05
# Deviations from the flank that still make a dwelling block one of contact.
REACH = 4.0
# Deviations by which a dwelling block may move against the flank while its neighbours pass.
STILL = 6.0
# Multiple of the usual distance from the flank beyond which blocks have no weight in its fit.
ASTRAY = 10.0
# Bounces off a flank from which its error is estimated.
FEWEST = 10
# Blocks that are looked at at most for contact, and how many neighbours of these stay together.
LOOKED_AT, TOGETHER = 100_000, 50
# Blocks of contact that are fitted at most; every so manieth is taken.
MOST = 5_000


def find_flanks(
    path: Blocks,
    found: Kinks,
    teeth: tuple[int, int] | None = None,
    both: bool = True,
    grow: bool = True,
    mesh: bool = True,
    alike: bool = False,
) -> Flanks:
    """Return the flanks of a record.

    Velocity jumps show where the path bounced and on which side; the flanks through them are then fitted to all blocks
    that rest near them, round by round, closer each time. ``grow``: whether orders are looked for; ``mesh``: whether
    mesh orders are fitted; ``alike``: whether the dead band has only orders of which each flank tells both phases.
    """
    terms = make_terms(path, teeth)
    if not mesh:
        terms = terms.without_mesh(HIDDEN)
    looked = _looked_at(len(path.time))
    columns = _columns(path, terms, looked)
    up = found.jump > 0.0
    if len(found.at) < 2 or not (both or np.count_nonzero(up) >= 2):
        return one_flank(path, teeth)
    at, side = found.at, (~up).astype(int)
    place = found.place
    both = both and int(np.count_nonzero(side)) >= 2
    if not both:
        at, side, place = at[up], side[up], place[up]
    gap = _first_gap(place, side, path)
    flanks, scale = _through_seeds(path, terms, (at, side, place), gap, both)
    for turn in range(ROUNDS):
        if grow and turn in GROWS:
            near, sides, _ = dwelling(path, looked, columns, flanks, scale, gap)
            more = grown(path, flanks, near, sides)
            if more:
                size = 2.0 * scale / gap
                terms = terms.with_orders(more, size)
                flanks = flanks._replace(terms=terms)
                columns = _columns(path, terms, looked)
                flanks = _padded(flanks, 2 * len(more))
        before = scale
        flanks = _restricted(path, flanks, terms, dwelling(path, looked, columns, flanks, scale, gap), alike)
        flanks, scale = _closer(path, (looked, columns), flanks, (at, side, place), scale, gap)
        if turn >= GROWS[-1] and scale == before:  # the same blocks again
            break
    return flanks


def plain_flanks(path: Blocks, found: Kinks, teeth: tuple[int, int] | None = None, both: bool = True) -> Flanks | None:
    """Return flanks that velocity jumps alone show to be smooth; ``None`` where these scatter more than their noise.

    A flank with impacts only, without lasting contact, or touched at the same angles repeatedly does not show its
    orders. Where jumps lie on flanks without any, none are assumed until contact shows some (:func:`shown_orders`).
    """
    up = found.jump > 0.0
    sides = (up, ~up) if both else (up,)
    if min(int(np.count_nonzero(side)) for side in sides) < SEEN:
        return None
    # nothing lies behind a flank: jumps that are not impacts, such as curvature of flights, lie in the dead band
    edges = [float(np.quantile(found.place[side], part)) for side, part in zip(sides, (EDGE, 1.0 - EDGE), strict=False)]
    rounded = ROUNDED * path.width * float(np.median(np.abs(found.jump)))
    allowed = max(path.stray, CORNER * (edges[1] - edges[0]) if both else 0.0, rounded)
    used = [
        np.flatnonzero(side & (np.abs(found.place - at) < STRAY * allowed))
        for side, at in zip(sides, edges, strict=True)
    ]
    if min(len(one) for one in used) < SEEN:
        return None
    middle = [float(np.median(found.place[one])) for one in used]
    spread = [robust_deviation(found.place[one] - at) for one, at in zip(used, middle, strict=True)]
    if max(spread) > SCATTER * allowed:
        return None
    gap = middle[1] - middle[0] if both else max(float(np.ptp(path.place)), 10.0 * path.noise)
    if gap < 10.0 * path.noise:
        return None
    terms = make_terms(path, teeth)
    terms = terms._replace(prior=np.where(terms.fixed, terms.prior, ABSENT * path.stray / gap))
    side = np.repeat(np.arange(len(used)), [len(one) for one in used])
    used = np.concatenate(used)
    scale = max(*spread, path.stray)
    columns = _columns(path, terms, found.at[used])
    made = through(terms, columns, side, found.place[used], scale, gap, both, robust=False)
    return made._replace(rough=path.stray, contact=0.0)


def shown_orders(
    path: Blocks,
    flanks: Flanks,
    still: tuple[np.ndarray, np.ndarray],
    touches: tuple[np.ndarray, ...],
    teeth: tuple[int, int] | None,
) -> Flanks | None:
    """Return smooth flanks with the orders that their contact can show, ``None`` where it can show none.

    An order is shown where it is distinguishable from all others at the touched angles (variance inflation factor).
    """
    usual = make_terms(path, teeth).prior
    near, side = still
    time, drive, loose, struck = touches[:4]
    made = []
    for flank, factor in ((0, 1.0), (1, 0.5)):
        blocks = near[side == flank]
        blocks = blocks[:: max(len(blocks) // MOST, 1)]
        hits = struck == flank
        columns = flanks.terms.columns(
            *(np.append(ours[blocks], theirs[hits])
              for ours, theirs in ((path.time, time), (path.drive, drive), (path.loose, loose)))
        )  # fmt: skip
        made.append(np.where(_told_apart(columns, flanks.terms), factor * usual, factor * flanks.terms.prior))
    if np.array_equal(made[0], flanks.terms.prior):
        return None
    fixed = flanks.terms.fixed
    prior = np.where(fixed, flanks.terms.prior, made[0])
    gap = np.where(fixed, 0.5 * flanks.terms.prior, np.minimum(made[1], 0.5 * prior))
    return flanks._replace(terms=flanks.terms._replace(prior=prior, gap=gap))


def _told_apart(columns: np.ndarray, terms: Terms) -> np.ndarray:
    """Return whether places show each column, cosine and sine of an order together, (p,)."""
    shown = np.zeros(columns.shape[1], bool)
    if len(columns) < PLACES * columns.shape[1]:
        return shown
    normal = columns.T @ columns
    inverse = np.linalg.pinv(normal, rcond=1e-12, hermitian=True)
    first = 0
    for kind, _ in terms.kinds:
        own = slice(first, first + (2 if kind in GEARS else 1))
        inflated = np.linalg.eigvals(normal[own, own] @ inverse[own, own]).real.max()  # for any datum of the angle
        shown[own] = inflated < INFLATED
        first = own.stop
    return shown


def _restricted(
    path: Blocks, flanks: Flanks, terms: Terms, still: tuple[np.ndarray, np.ndarray, np.ndarray], alike: bool
) -> Flanks:
    """Return flanks without the orders that dwelling blocks cannot tell from lower terms.

    Residuals near a flank that are not contact, such as slow flights, would give these orders some size.
    """
    near, side = still[:2]
    if len(near) < 3 * len(terms.prior):
        return flanks._replace(terms=terms)
    least, most = [], []  # of both phases of an order
    for flank in (0, 1):
        mine = near[side == flank]
        worse, better = _told_in_turn(_columns(path, terms, mine[:: max(len(mine) // MOST, 1)]), terms)
        least.append(worse)
        most.append(better)
    scale = np.where(terms.fixed | (np.arange(len(terms.prior)) >= len(terms.prior) - 2 * terms.grown), 1.0, HIDDEN)
    prior = terms.prior * np.where(most[0] | most[1], 1.0, scale)
    told = least if alike else most
    gap = 0.5 * terms.prior * np.where(told[0] & told[1], 1.0, scale)
    return flanks._replace(terms=terms._replace(prior=prior, gap=gap))


def _told_in_turn(columns: np.ndarray, terms: Terms) -> tuple[np.ndarray, np.ndarray]:
    """Return whether places tell each column from those before it: both phases of an order, and one of them, each (p,).

    Two angles that are touched again and again tell one phase of an order.
    """
    both, one = np.zeros(columns.shape[1], bool), np.zeros(columns.shape[1], bool)
    if len(columns) < PLACES:
        return both, one
    basis, first = np.zeros((len(columns), 0)), 0
    for kind, _ in terms.kinds:
        own = slice(first, first + (2 if kind in GEARS else 1))
        rest = columns[:, own] - basis @ (basis.T @ columns[:, own])
        kept, size, _ = np.linalg.svd(rest, full_matrices=False)
        needed = np.mean(np.sum(columns[:, own] ** 2, axis=0)) / INFLATED
        both[own], one[own] = size[-1] ** 2 > needed, size[0] ** 2 > needed
        basis = np.hstack([basis, kept[:, size > 1e-6 * np.sqrt(len(columns))]])
        first = own.stop
    return both, one


def _looked_at(count: int) -> np.ndarray:
    """Return the examined blocks: all, or of many blocks runs of neighbours spread evenly."""
    if count <= LOOKED_AT:
        return np.arange(count)
    first = np.linspace(0, count - TOGETHER, LOOKED_AT // TOGETHER).astype(np.intp)
    return (first[:, None] + np.arange(TOGETHER)).ravel()


def _columns(path: Blocks, terms: Terms, at: np.ndarray) -> np.ndarray:
    """Return the columns of the terms at some blocks, (k, p)."""
    return terms.columns(path.time[at], path.drive[at], path.loose[at])


def _padded(flanks: Flanks, more: int) -> Flanks:
    """Return flanks with further columns, all zero."""
    active = np.append(flanks.active, np.zeros(more))
    gap = None if flanks.gap is None else np.append(flanks.gap, np.zeros(more))
    return flanks._replace(active=active, gap=gap)


def grown(path: Blocks, flanks: Flanks, near: np.ndarray, side: np.ndarray, goal: float = 0.0) -> list[tuple[str, int]]:
    """Return significant orders of the contact with both flanks.

    ``near``: blocks in contact, (k,); ``side``: flank of each, (k,); ``goal``: standard deviation of the
    residual [m]: orders that cannot reach it are not examined.
    """
    room = MOST_ORDERS - flanks.terms.grown
    touched = []
    for flank in (0, 1) if flanks.gap is not None else (0,):
        mine = near[side == flank]
        mine = mine[:: max(len(mine) // MOST, 1)]
        if len(mine) > 20 * len(flanks.active):
            columns = _columns(path, flanks.terms, mine)
            line = flanks.active if flank == 0 or flanks.gap is None else flanks.active + flanks.gap
            rest = path.place[mine] - columns @ line
            touched.append(Contact(columns, np.stack([path.drive[mine], path.loose[mine]]), rest, path.noise))
    if not touched or room < 1:
        return []
    highest = resolved(path.drive, path.loose)
    known = tuple((kind, order) for kind, order in flanks.terms.kinds if kind in ("drive", "loose"))
    return strongest(touched, highest, room, known, QUIET, goal)[0]


def _through_seeds(
    path: Blocks,
    terms: Terms,
    seeds: tuple[np.ndarray, np.ndarray, np.ndarray],
    gap: float,
    both: bool,
) -> tuple[Flanks, float]:
    """Return the flanks through the velocity jumps alone, and the median deviation of these."""
    at, side, place = seeds
    weight, scale, columns = np.ones(len(at)), 0.2 * gap, _columns(path, terms, at)
    flanks = through(terms, columns, side, place, scale, gap, both)
    for _ in range(4):
        low, high = flanks.places(path.time[at], path.drive[at], path.loose[at])
        off = np.abs(place - np.where(side == 1, high, low))
        scale = float(np.clip(1.4826 * np.median(off), max(0.01 * gap, path.noise), 0.2 * gap))
        weight = np.square(np.clip(1.0 - (off / (6.0 * scale)) ** 2, 0.0, None))
        flanks = through(terms, columns, side, place, scale, gap, both, robust=False, weight=weight)
    return flanks, max(min(scale, WIDEST * gap), path.noise)


def _first_gap(place: np.ndarray, side: np.ndarray, path: Blocks) -> float:
    """Return the size of the dead band, or the range of the path when there is one flank only."""
    if side.any() and not side.all():
        return max(float(np.median(place[side == 1]) - np.median(place[side == 0])), 10.0 * path.noise)
    return max(float(np.ptp(path.place)), 10.0 * path.noise)


def one_flank(path: Blocks, teeth: tuple[int, int] | None = None, grow: bool = False, goal: float = 0.0) -> Flanks:
    """Return the active flank of a record that never leaves it.

    ``goal``: residual of the path [m]: where no orders can reach it, none are searched.
    """
    terms = make_terms(path, teeth)
    size = max(float(np.ptp(path.place)), path.noise)
    some = np.arange(0, len(path.time), max(len(path.time) // MOST, 1))
    side = np.zeros(len(some), int)
    flanks = None
    for _ in range(2):
        columns = _columns(path, terms, some)
        flanks = through(terms, columns, side, path.place[some], path.noise, size, False, robust=False)
        rough = float(np.std(path.place - flanks.places(path.time, path.drive, path.loose)[0]))
        flanks = flanks._replace(rough=max(rough, path.noise), contact=1.0)
        more = grown(path, flanks, some, side, goal) if grow and rough > SMOOTH * path.noise else []
        if not more:
            break
        terms = terms.with_orders(more, 1.0)
    assert flanks is not None
    return flanks


def _closer(
    path: Blocks,
    looked: tuple[np.ndarray, np.ndarray],
    flanks: Flanks,
    seeds: tuple[np.ndarray, np.ndarray, np.ndarray],
    scale: float,
    gap: float,
) -> tuple[Flanks, float]:
    """Return the flanks through all blocks that rest near them, and the deviation of these."""
    near, side, off = dwelling(path, *looked, flanks, scale, gap)
    terms, columns = flanks.terms, looked[1]
    both = flanks.gap is not None
    rough = scale
    if len(near) >= 3 * columns.shape[1]:
        rough = robust_deviation(off - np.median(off))
    scale = max(min(rough, 0.7 * scale), path.noise)
    some = slice(None, None, max(len(near) // MOST, 1))
    at = np.concatenate([near[some], seeds[0]])
    sides = np.concatenate([side[some], seeds[1]])
    places = np.concatenate([path.place[near[some]], seeds[2]])
    weight = np.concatenate([np.ones(len(near[some])), np.full(len(seeds[0]), 0.01)])
    made = through(terms, _columns(path, terms, at), sides, places, scale, gap, both, weight=weight)
    return made._replace(rough=scale, contact=len(near) / len(columns)), scale


def moved(path: Blocks, like: Flanks, found: Kinks) -> Flanks | None:
    """Return the flanks of another record of the same gears, moved onto this one; ``None`` without velocity jumps."""
    if len(found.at) < 2:
        return None
    drifts = np.array([kind == "drift" for kind, _ in like.terms.kinds])  # one column each, before all orders
    still = np.append(np.where(drifts, 0.0, 1.0), np.ones(len(like.active) - len(drifts)))
    terms = like.terms._replace(begin=float(path.time[0]), span=float(path.time[-1] - path.time[0]))
    active, gap = like.active * still, None if like.gap is None else like.gap * still
    flanks = like._replace(terms=terms, active=active, gap=gap, rough=path.noise)
    low, high = flanks.places(path.time[found.at], path.drive[found.at], path.loose[found.at])
    side = found.jump < 0.0
    off = np.where(side, high, low) - found.place
    flanks.active[0] -= np.median(off[np.isfinite(off)])
    return flanks


def refined(
    path: Blocks, flanks: Flanks, still: tuple[np.ndarray, np.ndarray], touches: tuple[np.ndarray, ...]
) -> Flanks:
    """Return the flanks through known contact and through the moments at which bounces touch.

    Blocks that dwell include the rounded tips of bounces, which lie inside the dead band; these do not.

    ``still``: indices of blocks in contact, and their flanks, each (k,); ``touches``: time [s], angles of drive and
    loose gear [rad], flank, displacement and its deviation [m], and whether its duration is not resolved, each (i,).
    """
    near, side = still
    some = slice(None, None, max(len(near) // MOST, 1))
    near, side = near[some], side[some]
    time, drive, loose, struck, place, sigma, short = touches
    both = flanks.gap is not None
    columns = flanks.terms.columns(
        np.append(path.time[near], time), np.append(path.drive[near], drive), np.append(path.loose[near], loose)
    )
    sides = np.append(side, struck).astype(int)
    places = np.append(path.place[near], place)
    weight = np.append(np.ones(len(near)), (flanks.rough / np.maximum(sigma, 0.3 * flanks.rough)) ** 2)
    gap = float(np.ptp(path.place)) if flanks.gap is None else float(flanks.gap[0])
    shown = np.isfinite(places)
    usual = usual_covariance(flanks.terms, columns[shown], sides[shown], weight[shown], flanks.rough, gap, both)
    if len(near) + len(time) < 3 * len(flanks.active):
        return flanks._replace(usual=usual)
    off = places - columns @ flanks.active - (0.0 if flanks.gap is None else (columns @ flanks.gap) * sides)
    weight *= _beside(off, sides, len(near), flanks.rough)
    made = through(flanks.terms, columns, sides, places, flanks.rough, gap, both, weight=weight)
    made = made._replace(rough=flanks.rough, contact=flanks.contact, usual=usual)
    line = columns @ made.active + (0.0 if made.gap is None else (columns @ made.gap) * sides)
    rest = (places - line)[: len(near)]
    own = [rest[(side == k) & (np.abs(rest) < ASTRAY * path.stray)] for k in (0, 1)]
    scatter = [float(np.std(one)) if len(one) >= PLACES else np.inf for one in own]
    most = [0.0 if one < CALM * path.stray else CHATTER * one for one in scatter]
    good = short & (sigma < CLOSE * path.stray)  # flights about a touch that lasts cross beyond the flank
    return _set_on(made, columns[len(near) :][good], struck[good], place[good], sigma[good], most)


def _set_on(
    flanks: Flanks, columns: np.ndarray, side: np.ndarray, place: np.ndarray, sigma: np.ndarray, most: Sequence[float]
) -> Flanks:
    """Return flanks moved to the touches of bounces, where contact scatters and disagrees with these.

    Bounces that are too low to be seen count as contact, all on its inner side; crossings of flights are independent of
    flanks. Where contact does not scatter it is right: loaded compliant teeth deflect, and flights cross beyond.
    """
    moved, slack = [0.0, 0.0], [0.0, 0.0]
    for flank in (0, 1) if flanks.gap is not None else (0,):
        mine = np.flatnonzero((side == flank) & np.isfinite(place))
        if len(mine) < FEWEST or not most[flank]:
            continue
        line = flanks.active if flank == 0 or flanks.gap is None else flanks.active + flanks.gap
        off = place[mine] - columns[mine] @ line
        middle = float(np.median(off))
        scatter = max(robust_deviation(off - middle), float(np.median(sigma[mine])))
        known = 1.2533 * scatter / np.sqrt(len(mine))
        if SURE * known < abs(middle) < most[flank]:
            moved[flank], slack[flank] = middle, known
    if not any(moved):
        return flanks
    active, gap = flanks.active.copy(), flanks.gap
    covariance, usual = (
        np.zeros((0, 0)) if each is None else each.copy() for each in (flanks.covariance, flanks.usual)
    )
    active[0] += moved[0]
    for each in (covariance, usual):
        each[:1, :1] += slack[0] ** 2
    if gap is not None:
        gap = gap.copy()
        gap[0] += moved[1] - moved[0]
        own = slice(len(active), len(active) + 1)
        for each in (covariance, usual):
            each[own, own] += slack[0] ** 2 + slack[1] ** 2
    return flanks._replace(active=active, gap=gap, covariance=covariance, usual=usual if usual.size else None)


def _beside(off: np.ndarray, side: np.ndarray, still: int, rough: float) -> np.ndarray:
    """Return Tukey's weights of places by their distance from the flank, in the usual distance of touches.

    What lies between two flights counts as contact, also where a flight was overlooked; a bounce touches its flank.

    ``off``: distances from the flanks [m], (n,); ``side``: flank of each, (n,); ``rough``: least scatter
    of contact [m].
    """
    usual = np.full(len(off), np.inf)
    for flank in (0, 1):
        touched = np.abs(off[still:][side[still:] == flank])
        if len(touched) >= FEWEST:
            usual[side == flank] = max(1.4826 * float(np.median(touched)), rough)
    return np.square(np.clip(1.0 - (off / (ASTRAY * usual)) ** 2, 0.0, None))


def dwelling(
    path: Blocks, looked: np.ndarray, columns: np.ndarray, flanks: Flanks, scale: float, gap: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the blocks that rest near a flank: index, flank, and distance from it [m], each (k,).

    ``looked``: examined blocks, runs of neighbours, (l,); ``columns``: of the flanks' terms at these, (l, p);
    ``scale``: standard deviation of blocks about their flank [m]; ``gap``: width of the dead band by the velocity jumps
    [m].
    """
    above = path.place[looked] - columns @ flanks.active
    width = np.full(len(above), np.inf) if flanks.gap is None else columns @ flanks.gap
    moved = np.zeros(len(above))
    moved[1:-1] = np.where(looked[2:] - looked[:-2] == 2, above[2:] - above[:-2], np.inf)  # ends of runs do not tell
    moved = np.minimum(np.abs(moved), np.abs(moved - np.gradient(width) * 2.0) if flanks.gap is not None else np.inf)
    still = moved < STILL * path.noise
    low, high = np.abs(above) < REACH * scale, np.abs(above - width) < REACH * scale
    if flanks.gap is not None:
        high &= width > NARROWEST * gap
    low &= ~high | (np.abs(above) < np.abs(above - width))
    high &= ~low
    near = np.flatnonzero(still & (low | high))
    side = high[near].astype(int)
    return looked[near], side, np.where(side == 1, above[near] - width[near], above[near])
