"""Laws of contact, which segmentation cannot resolve: oil between the flanks, compliant teeth, friction.

Contact episodes are compared with a law alone, and with a law in addition to other causes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gears3d.diagnosis.causes import ACCEPT, EXCLUDED, Candidate, Cause, begin, candidates
from gears3d.diagnosis.contact_episodes import (
    LAW_CHANNELS,
    ContactEpisodes,
    EpisodeFit,
    contact_episodes,
    fit_episodes,
    promised_gains,
    subset,
)
from gears3d.diagnosis.evidence import Paths
from gears3d.diagnosis.heldout import Split
from gears3d.diagnosis.search import PRICE
from gears3d.effects import Code, Rig, catalogue
from gears3d.errors import InputError

if TYPE_CHECKING:
    from gears3d.diagnosis.preprocessing import Note
    from gears3d.measured.checks import Admitted
    from gears3d.scenario import Scenario

Array = np.ndarray
# Chi-square per point at which the rig, or causes, explain the contact episodes.
EXPLAINED = 1.5
# The same of the median episode, up to which a rig with its own law of contact agrees; twice that of all.
AGREEMENT = 2.0
# Median chi-square per point up to which a law may be the cause: a wrong one leaves far more.
LAW_FITS = 4.0
# Largest ratio of the cost with a law to the cost without one.
COST_RATIO = 0.7
# Median chi-square per point of the first fits up to which a law is fitted to all contact episodes.
PROMISING = 30.0
# Median chi-square per point above which a law that fits worse than the rig is not fitted further.
HOPELESS = 1e4
# Contact episodes and rounds of the fits that select initial sizes.
START_EPISODES, START_ROUNDS = 20, 4
# Minimum number of contact episodes.
FEWEST_EPISODES = 12
# Minimum relative standard deviation of a number: the resolution of the grids.
GRID_RESOLUTION = 1.5e-3
# Initial viscosities of the fits, in units.
VISCOSITIES = (0.2, 0.05, 0.6)
STIFFNESSES = (3.0, 10.0, 40.0)
# Initial ratio to the critical damping.
DAMPING_RATIO = 0.08
FRICTIONS = (0.1,)
# Kinds that are tried in addition to a law of contact.
FURTHER_KINDS = ("backlash_offset", "backlash_variation", "eccentricity", "transmission_error", "drag_coulomb",
         "drag_viscous", "drag_position")  # fmt: skip
# Highest order that is tried.
HIGHEST_ORDER = 4
# Number of contact episodes that are used in the search for causes.
SEARCHED_EPISODES = 40
JOINT_ROUNDS, JOINT_TRIAL = 10, 3
# Maximum number of causes in addition to a law.
MOST_FURTHER = 2
# Number of candidates that are fitted in each round.
TRIED = 3
# Largest ratio of the cost with a further cause to the cost without it.
FURTHER_RATIO = 0.9
# Size in units below which a cause is ignored.
SMALLEST = 0.02
# Sizes in units: initial value of a fit, and the value that stands for zero.
START_SIZE, ZERO_SIZE = 1e-3, 1e-6


class ContactLawFit(NamedTuple):
    """A law of contact, inferred from contact episodes.

    Args:
        causes: the law, then its additional causes, with their numbers.
        covariance: of all numbers [SI], (p, p).
        base: contact episodes compared with the rig as it is.
        held: compared with the rig with the law.
        records: the contact episodes.
        splits: held-out error reduction by record.
        alternatives: ``kind`` and ``why`` of causes that the contact episodes do not exclude.
        worse: chi-square over its level by which these fit worse.
        gains: rise of chi-square without each of the causes.
    """

    causes: tuple[Cause, ...]
    covariance: Array
    base: EpisodeFit
    held: EpisodeFit
    records: list[ContactEpisodes]
    splits: tuple[Split, ...]
    alternatives: tuple[dict[str, str], ...]
    worse: float
    gains: tuple[float, ...]


class EpisodeAnalysis(NamedTuple):
    """Result of the analysis of contact episodes.

    Args:
        law: of contact, if they indicate one.
        plain: contact episodes compared with the rig as it is; ``None`` if there are too few of them.
        records: the contact episodes.
    """

    law: ContactLawFit | None
    plain: EpisodeFit | None
    records: tuple[ContactEpisodes, ...] = ()

    @property
    def agrees(self) -> bool:
        """Whether the rig as it is explains the contact episodes."""
        return (
            self.plain is not None
            and self.plain.level < AGREEMENT
            and self.plain.cost < 2.0 * AGREEMENT * self.plain.count
        )


def has_compliance(rig: Scenario) -> bool:
    """Whether a rig has a law of contact already, so that segmentation by rigid flanks is invalid."""
    return any(row.code in (Code.GAP_SPRING, Code.GAP_FILM) for row in rig.rows())


def contact_law_of(
    admitted: Sequence[Admitted], notes: Sequence[Note], tell: Callable[[str, float], None], paths: Paths
) -> EpisodeAnalysis:
    """Return the law of contact that records indicate, before any segmentation by rigid flanks.

    Notes of their motion that block prevent a law.
    """
    seen: list[ContactEpisodes | None] = []
    if any(note.blocks for note in notes):
        return EpisodeAnalysis(None, None)
    tell("visiting the flanks", 0.0)
    for one in admitted:
        assert one.rig is not None
        with suppress(InputError):
            seen.append(contact_episodes(paths.of(one), one.rig, one.file))
    return contact_law([one for one in seen if one is not None])


def contact_law(records: Sequence[ContactEpisodes]) -> EpisodeAnalysis:
    """Return the law of contact that explains contact episodes better than all other causes, if any."""
    if sum(len(one.sizes) for one in records) < FEWEST_EPISODES:
        return EpisodeAnalysis(None, None)
    plain = fit_episodes(records, [])
    if plain.level < EXPLAINED and plain.cost < EXPLAINED * plain.count:
        return EpisodeAnalysis(None, plain, tuple(records))
    tried = [found for started in _laws(records[0]) if (found := _best_law(records, started, plain)) is not None]
    best = min(tried, key=lambda one: one.cost, default=plain)
    if best is plain or not accepted(best, plain):
        return EpisodeAnalysis(None, plain, tuple(records))
    return EpisodeAnalysis(_law_fit(records, best, plain), plain, tuple(records))


def contact_law_with_others(seen: EpisodeAnalysis) -> ContactLawFit | None:
    """Return the law of contact that explains contact episodes with other causes, where no law does alone."""
    plain = seen.plain
    if (
        plain is None or plain.level < EXPLAINED
    ):  # a few divergent paths do not indicate a law, which acts in all of them
        return None
    best = joint_fit(seen.records, _laws(seen.records[0]))
    if best is None or len(best.causes) < 2 or not accepted(best, plain):
        return None
    return _law_fit(seen.records, best, plain)


def _law_fit(records: Sequence[ContactEpisodes], best: EpisodeFit, plain: EpisodeFit) -> ContactLawFit | None:
    """Return a law and its additional causes; ``None`` if other rebounds fit equally, or a cause is needless."""
    rival = fit_episodes(records, [], [*best.causes[1:], *_rebounds(records[0].rig)], best if best.causes[1:] else None)
    if rival.cost <= best.cost:
        return None
    noise = max(best.level, 1.0)
    gains = gains_of_causes(records, best) if best.causes[1:] else [plain.cost - best.cost]
    if min(gains) < ACCEPT * noise or min(map(size_of, best.causes)) < SMALLEST:
        return None
    worse = (rival.cost - best.cost) / noise
    others = () if worse > EXCLUDED else (_alternative(rival, worse),)
    splits, covariance = _held_out(records, best)
    return ContactLawFit(best.causes, covariance, plain, best, list(records), splits, others, worse, tuple(gains))


def _rebounds(rig: Rig) -> list[Cause]:
    """Return other rebounds of rigid flanks as the alternative to a law of contact, in proportion to speed."""
    made = {one.kind: one for one in candidates(rig, 1.0, 0)}
    return [begin(made[kind], np.array([0.01])) for kind in ("restitution_offset", "restitution_speed")]


def _alternative(rival: EpisodeFit, worse: float) -> dict[str, str]:
    numbers = ", ".join(f"{one.candidate.size} = {one.numbers[0]:.3g}" for one in rival.causes)
    why = f"fits worse by Δχ² = {worse:.4g}, which is not sufficient to exclude it ({numbers})"
    return {"kind": "restitution_speed", "why": why}


def accepted(law: EpisodeFit, plain: EpisodeFit) -> bool:
    """Whether a law is the cause: it reduces the cost considerably, of median contact episodes, too."""
    size = size_of(law.causes[0])
    gains = plain.cost - law.cost > ACCEPT * max(law.level, 1.0) and law.cost < COST_RATIO * plain.cost
    return bool(law.level < min(LAW_FITS, plain.level) and gains and size > SMALLEST)


def _laws(one: ContactEpisodes) -> Iterator[list[Cause]]:
    """Return each law at its initial sizes."""
    rig, rows = one.rig, one.scenario.rows()
    yields = any(row.code == Code.GAP_SPRING for row in rows)
    if yields and not any(row.code == Code.TORQUE_FRICTION for row in rows):
        friction = Candidate("mesh_friction", {}, "coefficient", 1.0, False, LAW_CHANNELS)
        yield [begin(friction, np.array([size])) for size in FRICTIONS]
    force = rig.drag_torque / rig.base_radius_loose
    if not yields and force > 0.0:
        unit, mass = force / rig.backlash, rig.inertia / rig.base_radius_loose**2
        made = []
        for size in STIFFNESSES:
            damping = 2.0 * DAMPING_RATIO * float(np.sqrt(size * unit * mass))
            teeth = Candidate("tooth_compliance", {"damping": damping}, "stiffness", unit, False, LAW_CHANNELS)
            made.append(begin(teeth, np.array([size])))
        yield made
    if rig.face_width > 0.0 and not any(row.code == Code.GAP_FILM for row in rows):
        unit = catalogue()["oil_film"](viscosity=1e-3).unit_size(rig)
        oil = Candidate("oil_film", {}, "viscosity", unit, False, LAW_CHANNELS)
        yield [begin(oil, np.array([size])) for size in VISCOSITIES]


def _best_law(records: Sequence[ContactEpisodes], started: list[Cause], plain: EpisodeFit) -> EpisodeFit | None:
    """Return the fit of a law to all contact episodes; ``None`` if a few of them exclude it."""
    few, found = subset(records, START_EPISODES), None
    for cause in started:
        try:
            held = fit_episodes(few, [], [cause], rounds=START_ROUNDS)
        except InputError:  # a size that the rig cannot have
            continue
        if found is None or held.cost < found.cost:
            found = held
        if found.level < LAW_FITS:
            break
    if found is None or (found.level > HOPELESS and found.level > plain.level):
        return None
    found = fit_episodes(few, [], found.causes, found)
    return fit_episodes(records, [], found.causes) if found.level < PROMISING else None


def _held_out(records: Sequence[ContactEpisodes], best: EpisodeFit) -> tuple[tuple[Split, ...], Array]:
    """Return the held-out error reduction of the law by record, and the covariance over these fits."""
    covariance = best.covariance * max(best.cost / best.count, 1.0)
    exact = GRID_RESOLUTION * np.concatenate([_error_scales(one) for one in best.causes])
    covariance = covariance + np.diag(exact**2)
    if len(records) < 2:
        return (), covariance
    splits, numbers = [], []
    for k, one in enumerate(records):
        others = [i for i in range(len(records)) if i != k]
        begun = best._replace(zeros=best.zeros[others], starts=[best.starts[i] for i in others])
        causes = fit_episodes([records[i] for i in others], [], best.causes, begun).causes
        numbers.append(np.concatenate([cause.numbers for cause in causes]))
        splits.append(_split(one, [cause.effect for cause in causes], best, k))
    apart = np.array(numbers) - np.mean(numbers, axis=0)
    jackknife = (len(records) - 1) / len(records) * apart.T @ apart
    wider = np.sqrt(np.maximum(np.diag(jackknife) / np.maximum(np.diag(covariance), 1e-300), 1.0))
    return tuple(splits), covariance * np.outer(wider, wider)


def _error_scales(cause: Cause) -> Array:
    """Return the scales of errors of a cause's numbers: its size, and 1 for logarithms of a shape."""
    sizes = 1 + cause.candidate.phased
    return np.concatenate([np.full(sizes, np.linalg.norm(cause.numbers[:sizes])), np.ones(len(cause.free))])


def _split(one: ContactEpisodes, effects: list[Any], best: EpisodeFit, k: int) -> Split:
    begun = best._replace(zeros=best.zeros[k : k + 1], starts=[best.starts[k]])
    base, extended = fit_episodes([one], []), fit_episodes([one], effects, (), begun)
    sizes = {"visit": tuple(float(np.sqrt(np.mean(np.square(each.rest[0])))) for each in (base, extended))}
    noise = min(extended.level, extended.cost / extended.count)
    gain = 0.5 * (base.cost - extended.cost) / max(noise, 1.0)
    return Split((one.name,), base.cost / base.count, extended.cost / extended.count, noise, gain, sizes)  # type: ignore[arg-type]


def shortlist(rig: Rig) -> list[Candidate]:
    """Return the candidates that are tried in addition to a law of contact."""
    every = candidates(rig, 1.0, HIGHEST_ORDER)
    return [one for one in every if one.kind in FURTHER_KINDS and one.shape.get("flank", "both") == "both"]


def joint_fit(records: Sequence[ContactEpisodes], laws: Iterable[list[Cause]]) -> EpisodeFit | None:
    """Return the law of contact with further causes that has the smallest cost over the contact episodes."""
    few, known = subset(records, SEARCHED_EPISODES), shortlist(records[0].rig)
    found = None
    for started in laws:
        begun = _best_start(few, started)
        if begun is None:
            continue
        held = with_further_causes(few, begun, known)
        if found is None or held.cost < found.cost:
            found = held
    return None if found is None else fit_episodes(records, [], found.causes)


def with_further_causes(records: Sequence[ContactEpisodes], now: EpisodeFit, known: Sequence[Candidate]) -> EpisodeFit:
    """Return the fit with further causes, added as long as each reduces the cost considerably."""
    for _ in range(MOST_FURTHER):
        if now.level < EXPLAINED and now.cost < EXPLAINED * now.count:
            break
        promised = promised_gains(records, now, [begin(one, np.full(1 + one.phased, ZERO_SIZE)) for one in known])
        best = now
        for k in np.argsort(promised)[::-1][:TRIED]:
            cause = begin(known[k], np.full(1 + known[k].phased, START_SIZE))
            held = fit_episodes(records, [], [*now.causes, cause], now, JOINT_ROUNDS)
            best = held if _worth(held) < _worth(best) and size_of(held.causes[-1]) > SMALLEST else best
        if best is now or best.cost > FURTHER_RATIO * now.cost:
            break
        now = best
    return now


def size_of(cause: Cause) -> float:
    """Return the size of a cause in units."""
    return float(np.linalg.norm(cause.numbers[: 1 + cause.candidate.phased])) / cause.candidate.unit


def gains_of_causes(records: Sequence[ContactEpisodes], held: EpisodeFit) -> list[float]:
    """Return the rise of chi-square without each of the causes, the others refitted."""
    found = []
    for k in range(len(held.causes)):
        others = held.causes[:k] + held.causes[k + 1 :]
        found.append(fit_episodes(records, [], others, held, JOINT_ROUNDS).cost - held.cost)
    return found


def _best_start(records: Sequence[ContactEpisodes], started: list[Cause]) -> EpisodeFit | None:
    """Return the best of the initial sizes of a law."""
    found = None
    for cause in started:
        try:
            held = fit_episodes(records, [], [cause], rounds=JOINT_TRIAL)
        except InputError:  # a size that the rig cannot have
            continue
        if found is None or held.cost < found.cost:
            found = held
    return found


def _worth(held: EpisodeFit) -> float:
    return held.cost + PRICE * sum(len(one.numbers) for one in held.causes)
