"""A check: a number that was measured, the bound it must keep, and where both come from."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module

# The modules of this package that hold checks, in the order of the table
CHAPTERS = (
    *("solids", "twin", "agreement", "native", "faults", "effects"),
    *("film", "eccentric", "helical", "published", "ste", "threshold", "convergence", "oracles"),
)


@dataclass(frozen=True)
class Check:
    """One line of the validation table.

    Args:
        name: what was measured.
        value: the measured number.
        bound: what it must not exceed.
        unit: of both; empty for ratios and counts.
        at_least: the bound is a lower one.
    """

    name: str
    value: float
    bound: float
    unit: str = ""
    at_least: bool = False

    @property
    def holds(self) -> bool:
        """Whether the value keeps its bound; a value that is not a number does not.

        >>> Check("gap", 2e-9, 1e-9, "m").holds
        False
        """
        return bool(self.value >= self.bound if self.at_least else self.value <= self.bound)


def chapters(quick: bool = False, only: str = "") -> Iterator[tuple[str, Callable[[], Iterator[Check]]]]:
    """Give each chapter's title and the function that measures its checks.

    Args:
        quick: a part of the cases, in about a minute.
        only: the name of one chapter; all when empty.

    Raises:
        UsageError: the name is unknown.
    """
    from gears3d.errors import UsageError, did_you_mean

    if only and only not in CHAPTERS:
        raise UsageError(f"there is no chapter {only!r}; {did_you_mean(only, CHAPTERS)}")
    for name in [only] if only else CHAPTERS:
        module = import_module(f"gears3d.verification.validation.{name}")
        title = (module.__doc__ or name).split("\n")[0].rstrip(".")
        yield title, lambda module=module: module.checks(quick)
