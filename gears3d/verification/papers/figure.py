"""A figure of a paper, drawn again from our runs in the paper's own layout."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any

from gears3d import palette

if TYPE_CHECKING:
    from gears3d.verification.papers.bench import Bench

ACTIVE, REVERSE, LINE, PUBLISHED = palette.ACTIVE, palette.REVERSE, palette.INK, palette.EXTENDED
"""Colours of the active flank, the reverse flank, the loose gear, and of what the paper printed."""


@dataclass(frozen=True)
class Figure:
    """How one figure of a paper is drawn.

    Args:
        paper: name of the paper.
        name: ``"fig. 5"``; the claims of the same figure stand beside it.
        title: what it shows.
        draw: draws on an empty matplotlib figure from the bench's runs.
        size: width and height [in].
        caption: what to look at, and how it differs from the paper's.
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
