"""A paper as claims and figures: what it gives, how gears3d computes the same, and the tolerance between both."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from math import isfinite
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from gears3d.verification.papers.bench import Bench

Verdict = Literal["agrees", "disagrees"]


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One row: a number or a trend that a paper measured, plotted or stated, and how it is computed.

    Args:
        paper: name of the paper, ``"rigaud-2020"``.
        figure: where the paper gives it, ``"fig. 5"`` or ``"table 1"``.
        quantity: what it is.
        published: what the paper gives; a word for a regime or a trend.
        tolerance: largest distance of the computed value, in the unit; 0 for words, which must be equal.
        unit: of both and of the tolerance; empty for ratios, counts and words.
        model: source of the computed value: ``"rigid"``, ``"bullet"``, ``"lubricated"``, ``"gears"`` or ``"law"``.
        compute: the value in the unit, from the runs of a bench.
        recorded: the verdict on record; the command exits with 1 when the verdict differs.
        note: reason of a disagreement, or a remark on the number.
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
    """A claim with its computed value.

    Args:
        claim: the claim.
        computed: the value in the unit of the claim, or a word.
    """

    claim: Claim
    computed: float | str

    @property
    def verdict(self) -> Verdict:
        """Whether the computed value agrees with the published one."""
        return verdict(self.claim.published, self.computed, self.claim.tolerance)

    @property
    def changed(self) -> bool:
        """Whether the verdict differs from the one on record."""
        return self.verdict != self.claim.recorded

    def row(self) -> dict[str, Any]:
        """Return the row as JSON can hold it; a computed value that is not finite becomes its name."""
        claim, computed = self.claim, self.computed
        if not isinstance(computed, str):
            computed = float(computed) if isfinite(computed) else str(float(computed))
        published = {name: getattr(claim, name) for name in ("paper", "figure", "quantity", "published")}
        limits = {name: getattr(claim, name) for name in ("tolerance", "unit", "model")}
        return {
            **published,
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
        published: value of the paper.
        computed: value of gears3d; NaN never agrees with a number.
        tolerance: largest distance of two numbers; words must be equal.

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
    """Compute the value of a claim and compare it with the published one.

    Args:
        claim: the claim.
        bench: where its simulations run.
    """
    with bench.working_on(f"{claim.paper}, {claim.figure}: {claim.quantity}", f"{claim.paper} {claim.figure}"):
        return Result(claim, claim.compute(bench))


@dataclass(frozen=True)
class Figure:
    """A figure of a paper, drawn from runs of the bench in the paper's own layout.

    Args:
        paper: name of the paper.
        name: ``"fig. 5"``; the page has it with the claims of the same figure.
        title: of the figure.
        draw: draws on an empty matplotlib figure from the bench's runs.
        size: width and height [in].
        caption: remarks, and differences from the paper's figure.
    """

    paper: str
    name: str
    title: str
    draw: Callable[[Bench, Any], None]
    size: tuple[float, float] = (9.0, 5.0)
    caption: str = ""

    def png(self, bench: Bench, dpi: int = 110) -> bytes:
        """Return the figure as a PNG picture.

        Args:
            bench: where its simulations run.
            dpi: dots per inch.
        """
        from matplotlib import rc_context
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure as Sheet

        look: dict[Any, Any] = {
            "font.size": 9,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "legend.frameon": False,
        }
        with rc_context(look), bench.working_on(f"{self.paper}, {self.name}: drawing", f"{self.paper} {self.name}"):
            sheet = Sheet(figsize=self.size, layout="constrained")
            FigureCanvasAgg(sheet)
            self.draw(bench, sheet)
            picture = BytesIO()
            sheet.savefig(picture, format="png", dpi=dpi)
        return picture.getvalue()


@dataclass(frozen=True)
class Paper:
    """A paper: its claims, its figures, and why other figures are excused.

    Args:
        name: short name, as in ``source`` of the scenarios.
        citation: authors, title, journal, year.
        contents: its figures and tables, in print order.
        claims: the rows, (n,).
        figures: that are reproduced.
        excused: figures and tables without a row, and why.
    """

    name: str
    citation: str
    contents: tuple[str, ...]
    claims: tuple[Claim, ...]
    figures: tuple[Figure, ...]
    excused: dict[str, str]

    @property
    def forgotten(self) -> list[str]:
        """Figures and tables that have neither a row nor an excuse."""
        known = {claim.figure for claim in self.claims} | set(self.excused)
        return [name for name in self.contents if name not in known]
