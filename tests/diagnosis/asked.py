"""Fewer candidates than all, for tests of what comes before and after a search."""

from collections.abc import Callable

from gears3d.diagnosis.causes import Candidate, candidates


def only(patch, wanted: Callable[[Candidate], bool]) -> None:
    """Look for some candidates only, in channels and along the path.

    Args:
        patch: pytest's MonkeyPatch.
        wanted: says which.
    """

    def some(*about) -> list[Candidate]:
        return [one for one in candidates(*about) if wanted(one)]

    for module in ("search", "diagnosis"):
        patch.setattr(f"gears3d.diagnosis.{module}.candidates", some)
