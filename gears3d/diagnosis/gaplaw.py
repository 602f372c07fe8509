"""Laws of contact, which segmentation cannot resolve: oil between the flanks, compliant teeth, friction."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.alongside import SMALLEST, beside, needed, size_of
from gears3d.diagnosis.candidates import Candidate, candidates
from gears3d.diagnosis.cause import Cause, begin
from gears3d.diagnosis.contactlaw import OWN, Held, hold
from gears3d.diagnosis.evidence import Paths
from gears3d.diagnosis.heldout import Split
from gears3d.diagnosis.search import EXCLUDED
from gears3d.diagnosis.visits import Visits, some, visits
from gears3d.effects import Code, Rig, catalogue
from gears3d.errors import InputError

if TYPE_CHECKING:
    from gears3d.diagnosis.grounds import Note
    from gears3d.measured.checks import Admitted
    from gears3d.scenario import Scenario

Array = np.ndarray
# Chi-square per point at which the rig explains the contact episodes.
PLAIN = 1.5
# The same of the median episode, up to which a rig with its own law of contact agrees; twice that of all.
ALIKE = 2.0
# Median chi-square per point up to which a law may be the cause: a wrong one leaves far more.
GOOD = 4.0
# Largest ratio of the cost with a law to the cost without one.
BETTER = 0.7
# Median chi-square per point of the first fits up to which a law is fitted to all contact episodes.
HOPE = 30.0
# Median chi-square per point above which a law that fits worse than the rig is not fitted further.
LOST = 1e4
# Contact episodes and rounds of the fits that select initial sizes.
FEW, TRIAL = 20, 4
# Minimum number of contact episodes.
FEWEST = 12
# Minimum relative standard deviation of a number: the resolution of the grids.
EXACT = 1.5e-3
# Fall of the cost that a law must bring.
GAIN = 30.0
# Initial viscosities of the fits, in units.
VISCOSITIES = (0.2, 0.05, 0.6)
STIFFNESSES = (3.0, 10.0, 40.0)
# Initial ratio to the critical damping.
DAMPED = 0.08
FRICTIONS = (0.1,)


class GapLaw(NamedTuple):
    """A law of contact, inferred from contact episodes.

    Args:
        causes: the law, then its additional causes, with their numbers.
        covariance: of all numbers [SI], (p, p).
        base: contact episodes compared with the rig as it is.
        held: compared with the rig with the law.
        records: the contact episodes.
        splits: held-out error reduction by record.
        alternatives: ``kind`` and ``why`` of causes that the contact episodes do not exclude.
        gains: rise of chi-square without each of the causes.
    """

    causes: tuple[Cause, ...]
    covariance: Array
    base: Held
    held: Held
    records: list[Visits]
    splits: tuple[Split, ...]
    alternatives: tuple[dict[str, str], ...]
    gains: tuple[float, ...]


class Seen(NamedTuple):
    """Result of the analysis of contact episodes.

    Args:
        law: of contact, if they indicate one.
        plain: contact episodes compared with the rig as it is; ``None`` if there are too few of them.
        records: the contact episodes.
    """

    law: GapLaw | None
    plain: Held | None
    records: tuple[Visits, ...] = ()

    @property
    def agrees(self) -> bool:
        """Whether the rig as it is explains the contact episodes."""
        return self.plain is not None and self.plain.level < ALIKE and self.plain.cost < 2.0 * ALIKE * self.plain.count


def yields(rig: Scenario) -> bool:
    """Whether a rig has a law of contact already, so that segmentation by rigid flanks is invalid."""
    return any(row.code in (Code.GAP_SPRING, Code.GAP_FILM) for row in rig.rows())


def law_of(
    admitted: Sequence[Admitted], notes: Sequence[Note], tell: Callable[[str, float], None], paths: Paths
) -> Seen:
    """Return the law of contact that records indicate, before any segmentation by rigid flanks.

    Notes of their motion that block prevent a law.
    """
    seen: list[Visits | None] = []
    if any(note.blocks for note in notes):
        return Seen(None, None)
    tell("visiting the flanks", 0.0)
    for one in admitted:
        assert one.rig is not None
        with suppress(InputError):
            seen.append(visits(paths.of(one), one.rig, one.file))
    return gap_law([one for one in seen if one is not None])


def gap_law(records: Sequence[Visits]) -> Seen:
    """Return the law of contact that explains contact episodes better than all other causes, if any."""
    if sum(len(one.sizes) for one in records) < FEWEST:
        return Seen(None, None)
    plain = hold(records, [])
    if plain.level < PLAIN and plain.cost < PLAIN * plain.count:
        return Seen(None, plain, tuple(records))
    tried = [found for started in _laws(records[0]) if (found := _best(records, started, plain)) is not None]
    best = min(tried, key=lambda one: one.cost, default=plain)
    if best is plain or not accepted(best, plain):
        return Seen(None, plain, tuple(records))
    return Seen(_named(records, best, plain), plain, tuple(records))


def with_others(seen: Seen) -> GapLaw | None:
    """Return the law of contact that explains contact episodes with other causes, where no law does alone."""
    plain = seen.plain
    if plain is None or plain.level < PLAIN:  # a few divergent paths do not indicate a law, which acts in all of them
        return None
    best = beside(seen.records, _laws(seen.records[0]))
    if best is None or len(best.causes) < 2 or not accepted(best, plain):
        return None
    return _named(seen.records, best, plain)


def _named(records: Sequence[Visits], best: Held, plain: Held) -> GapLaw | None:
    """Return a law and its additional causes; ``None`` if other rebounds fit equally, or a cause is needless."""
    rival = hold(records, [], [*best.causes[1:], *_rebounds(records[0].rig)], best if best.causes[1:] else None)
    if rival.cost <= best.cost:
        return None
    noise = max(best.level, 1.0)
    gains = needed(records, best) if best.causes[1:] else [plain.cost - best.cost]
    if min(gains) < GAIN * noise or min(map(size_of, best.causes)) < SMALLEST:
        return None
    worse = (rival.cost - best.cost) / noise
    others = () if worse > EXCLUDED else (_alternative(rival, worse),)
    splits, covariance = _held_out(records, best)
    return GapLaw(best.causes, covariance, plain, best, list(records), splits, others, tuple(gains))


def _rebounds(rig: Rig) -> list[Cause]:
    """Return other rebounds of rigid flanks as the alternative to a law of contact, in proportion to speed."""
    made = {one.kind: one for one in candidates(rig, 1.0, 0)}
    return [begin(made[kind], np.array([0.01])) for kind in ("restitution_offset", "restitution_speed")]


def _alternative(rival: Held, worse: float) -> dict[str, str]:
    numbers = ", ".join(f"{one.candidate.size} = {one.numbers[0]:.3g}" for one in rival.causes)
    why = f"fits worse by Δχ² = {worse:.4g}, which is not sufficient to exclude it ({numbers})"
    return {"kind": "restitution_speed", "why": why}


def accepted(law: Held, plain: Held) -> bool:
    """Whether a law is the cause: it reduces the cost considerably, of median contact episodes, too."""
    size = size_of(law.causes[0])
    gains = plain.cost - law.cost > GAIN * max(law.level, 1.0) and law.cost < BETTER * plain.cost
    return bool(law.level < min(GOOD, plain.level) and gains and size > SMALLEST)


def _laws(one: Visits) -> Iterator[list[Cause]]:
    """Return each law at its initial sizes."""
    rig, rows = one.rig, one.scenario.rows()
    yields = any(row.code == Code.GAP_SPRING for row in rows)
    if yields and not any(row.code == Code.TORQUE_FRICTION for row in rows):
        friction = Candidate("mesh_friction", {}, "coefficient", 1.0, False, OWN)
        yield [begin(friction, np.array([size])) for size in FRICTIONS]
    force = rig.drag_torque / rig.base_radius_loose
    if not yields and force > 0.0:
        unit, mass = force / rig.backlash, rig.inertia / rig.base_radius_loose**2
        made = []
        for size in STIFFNESSES:
            damping = 2.0 * DAMPED * float(np.sqrt(size * unit * mass))
            teeth = Candidate("tooth_compliance", {"damping": damping}, "stiffness", unit, False, OWN)
            made.append(begin(teeth, np.array([size])))
        yield made
    if rig.face_width > 0.0 and not any(row.code == Code.GAP_FILM for row in rows):
        unit = catalogue()["oil_film"](viscosity=1e-3).unit_size(rig)
        oil = Candidate("oil_film", {}, "viscosity", unit, False, OWN)
        yield [begin(oil, np.array([size])) for size in VISCOSITIES]


def _best(records: Sequence[Visits], started: list[Cause], plain: Held) -> Held | None:
    """Return the fit of a law to all contact episodes; ``None`` if a few of them exclude it."""
    few, found = some(records, FEW), None
    for cause in started:
        try:
            held = hold(few, [], [cause], rounds=TRIAL)
        except InputError:  # a size that the rig cannot have
            continue
        if found is None or held.cost < found.cost:
            found = held
        if found.level < GOOD:
            break
    if found is None or (found.level > LOST and found.level > plain.level):
        return None
    found = hold(few, [], found.causes, found)
    return hold(records, [], found.causes) if found.level < HOPE else None


def _held_out(records: Sequence[Visits], best: Held) -> tuple[tuple[Split, ...], Array]:
    """Return the held-out error reduction of the law by record, and the covariance over these fits."""
    covariance = best.covariance * max(best.cost / best.count, 1.0)
    exact = EXACT * np.concatenate([_sizes(one) for one in best.causes])
    covariance = covariance + np.diag(exact**2)
    if len(records) < 2:
        return (), covariance
    splits, numbers = [], []
    for k, one in enumerate(records):
        others = [i for i in range(len(records)) if i != k]
        begun = best._replace(zeros=best.zeros[others], starts=[best.starts[i] for i in others])
        causes = hold([records[i] for i in others], [], best.causes, begun).causes
        numbers.append(np.concatenate([cause.numbers for cause in causes]))
        splits.append(_split(one, [cause.effect for cause in causes], best, k))
    apart = np.array(numbers) - np.mean(numbers, axis=0)
    jackknife = (len(records) - 1) / len(records) * apart.T @ apart
    wider = np.sqrt(np.maximum(np.diag(jackknife) / np.maximum(np.diag(covariance), 1e-300), 1.0))
    return tuple(splits), covariance * np.outer(wider, wider)


def _sizes(cause: Cause) -> Array:
    """Return the scales of errors of a cause's numbers: its size, and 1 for logarithms of a shape."""
    sizes = 1 + cause.candidate.phased
    return np.concatenate([np.full(sizes, np.linalg.norm(cause.numbers[:sizes])), np.ones(len(cause.free))])


def _split(one: Visits, effects: list[Any], best: Held, k: int) -> Split:
    begun = best._replace(zeros=best.zeros[k : k + 1], starts=[best.starts[k]])
    base, extended = hold([one], []), hold([one], effects, (), begun)
    sizes = {"visit": tuple(float(np.sqrt(np.mean(np.square(each.rest[0])))) for each in (base, extended))}
    noise = min(extended.level, extended.cost / extended.count)
    gain = 0.5 * (base.cost - extended.cost) / max(noise, 1.0)
    return Split((one.name,), base.cost / base.count, extended.cost / extended.count, noise, gain, sizes)  # type: ignore[arg-type]
