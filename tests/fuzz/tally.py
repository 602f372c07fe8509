"""What a part of the fuzz suite counts and prints."""

from collections import Counter
from dataclasses import dataclass, field


@dataclass
class Tally:
    """What came of many tries: counts by outcome, and what broke a promise."""

    part: str
    counts: Counter = field(default_factory=Counter)
    faults: list[str] = field(default_factory=list)

    @property
    def tried(self) -> int:
        """How many tries there were."""
        return sum(self.counts.values())

    def fault(self, outcome: str, how: str) -> None:
        """Note a broken promise, with what repeats it."""
        self.counts[outcome] += 1
        self.faults.append(f"{outcome}: {how}")

    def __str__(self) -> str:
        counts = ", ".join(f"{count} {outcome}" for outcome, count in self.counts.most_common())
        lines = [f"{self.part}: {self.tried} tried: {counts}; {len(self.faults)} broken promises"]
        return "\n  ".join([*lines, *self.faults])
