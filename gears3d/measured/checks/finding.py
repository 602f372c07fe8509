"""One thing that is wrong with a record, with its evidence and size."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Finding:
    """What the gate found in a record.

    Args:
        kind: one word with hyphens, the one to name where it is to be corrected: ``"skew"``, ``"time-not-rising"``.
        channel: the column it is in, or empty.
        size: how large, in ``unit``.
        unit: of the size, SI.
        evidence: one sentence with what was seen and where.
        remedy: what to do about it.
        fatal: whether the record cannot be used as it is.
        correctable: whether it can be corrected on demand.
        corrected: whether it was.
        rows: rows (from 0) it was seen in, the first few of many.
        parameters: further numbers that a correction needs, SI, by name.
    """

    kind: str
    channel: str
    size: float
    unit: str
    evidence: str
    remedy: str = ""
    fatal: bool = False
    correctable: bool = False
    corrected: bool = False
    rows: tuple[int, ...] = ()
    parameters: dict[str, float] = field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return what JSON can hold.

        >>> Finding("skew", "theta_loose_rad", 2e-5, "s", "the loose gear reads 20 us later").to_dict()["kind"]
        'skew'
        """
        return {**vars(self), "rows": list(self.rows)}
