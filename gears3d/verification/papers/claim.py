"""A claim: what a paper gives, how gears3d gets at the same quantity, and how near it must come."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from gears3d.verification.papers.bench import Bench

Verdict = Literal["agrees", "disagrees"]


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One row: a number or a trend that a paper measured, plotted or stated, and ours.

    Args:
        paper: name of the paper, ``"rigaud-2020"``.
        figure: where the paper gives it, ``"fig. 5"`` or ``"table 1"``.
        quantity: what it is.
        published: what the paper gives; a word for a regime or a trend.
        tolerance: how far ours may be from it, in the unit; 0 for words, which must be equal.
        unit: of both and of the tolerance; empty for ratios, counts and words.
        model: where ours comes from: ``"rigid"``, ``"bullet"``, ``"gears"`` or ``"law"``.
        compute: ours, from the bench's runs.
        recorded: the verdict on record; the command exits with 1 when the verdict differs.
        note: what explains a disagreement, or what has to be known of the number.
        basis: where the tolerance comes from.

    Raises:
        ValueError: a word with a tolerance, or a number without a positive one.
    """

    paper: str
    figure: str
    quantity: str
    published: float | str
    tolerance: float = 0.0
    unit: str = ""
    model: str = "rigid"
    compute: Callable[[Bench], float | str]
    recorded: Verdict = "agrees"
    note: str = ""
    basis: str = ""

    def __post_init__(self) -> None:
        if isinstance(self.published, str) != (self.tolerance == 0.0) or not self.tolerance >= 0.0:
            raise ValueError(f"{self.quantity}: words have tolerance 0, numbers a positive one, not {self.tolerance}")


@dataclass(frozen=True)
class Result:
    """A claim held against what came out.

    Args:
        claim: the claim.
        computed: ours.
    """

    claim: Claim
    computed: float | str

    @property
    def verdict(self) -> Verdict:
        """Whether ours agrees with the paper's."""
        return verdict(self.claim.published, self.computed, self.claim.tolerance)

    @property
    def changed(self) -> bool:
        """Whether the verdict is another than the one on record."""
        return self.verdict != self.claim.recorded

    def row(self) -> dict[str, Any]:
        """Return the row as JSON can hold it; a computed value that is not finite becomes its name."""
        claim, computed = self.claim, self.computed
        if not isinstance(computed, str):
            computed = float(computed) if isfinite(computed) else str(float(computed))
        told = {name: getattr(claim, name) for name in ("paper", "figure", "quantity", "published")}
        limits = {name: getattr(claim, name) for name in ("tolerance", "unit", "model")}
        return {
            **told,
            "computed": computed,
            **limits,
            "verdict": self.verdict,
            "note": claim.note,
            "recorded": claim.recorded,
            "basis": claim.basis,
        }


def verdict(published: float | str, computed: float | str, tolerance: float) -> Verdict:
    """Return whether a computed value agrees with a published one.

    Args:
        published: the paper's.
        computed: ours; what is not a number never agrees with a number.
        tolerance: how far the numbers may be apart; words must be equal.

    Raises:
        TypeError: one is a word, the other a number.

    >>> verdict(22.3, 22.9, 2.1), verdict("rises", "falls", 0.0)
    ('agrees', 'disagrees')
    """
    if isinstance(published, str) != isinstance(computed, str):
        raise TypeError(f"published is {published!r} but computed is {computed!r}: both words or both numbers")
    if isinstance(published, str) or isinstance(computed, str):
        return "agrees" if published == computed else "disagrees"
    return "agrees" if abs(computed - published) <= tolerance else "disagrees"


def hold(claim: Claim, bench: Bench) -> Result:
    """Compute a claim's value and hold it against the published one.

    Args:
        claim: the claim.
        bench: where its simulations run.
    """
    with bench.working_on(f"{claim.paper}, {claim.figure}: {claim.quantity}", f"{claim.paper} {claim.figure}"):
        return Result(claim, claim.compute(bench))
