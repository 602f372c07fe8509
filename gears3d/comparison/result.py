"""What a comparison comes to."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gears3d.results import Result

if TYPE_CHECKING:
    from gears3d.recording import Recording

Mode = Literal["trajectory", "distribution"]

# The keys of the contract, in its order
KEYS = (
    "impacts_compared",
    "impacts_matched",
    "impacts_missed",
    "impacts_invented",
    "velocity_error_median",
    "velocity_error_p95",
    "velocity_bias",
    "phase_error_median_cycles",
    "flight_height_min_m",
    "regime_equal",
    "mode",
)


@dataclass(frozen=True)
class SampleTest:
    """Two samples compared with each other.

    Args:
        quantity: ``"active.speed"``, ``"active.phase"``, ``"reverse.speed"``, ``"reverse.phase"``.
        statistic: Kolmogorov-Smirnov distance of the speeds, Kuiper distance of the phases.
        p_value: of a distance as large when both come from one distribution, by permuting blocks of time.
        different: whether it is too large at the level of all tests together.
        detectable: relative change of the speeds that would have been found nine times in ten; ``None`` for phases,
            and where no change up to a factor of two would.
    """

    quantity: str
    statistic: float
    p_value: float
    different: bool
    detectable: float | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Result):
    """One recording compared with a reference.

    ``trajectory`` pairs impacts one to one. ``distribution`` is for a chaotic reference, whose impacts nobody can
    follow: nothing is paired (``None``), and errors are those of median, 95th percentile and mean of the speeds and
    of the mean phase, on the flank where they are largest.

    Args:
        impacts_compared: impacts of the reference that count.
        impacts_matched: those of them, or of the tested recording, that have a counterpart.
        impacts_missed: counting impacts of the reference without any counterpart.
        impacts_invented: counting impacts of the tested recording without any counterpart.
        velocity_error_median: median relative error of the impact speed; ``None`` without impacts.
        velocity_error_p95: its 95th percentile.
        velocity_bias: mean relative error with its sign, above 0 when the tested recording has faster impacts.
        phase_error_median_cycles: median distance in phase [cycles of the excitation].
        flight_height_min_m: impacts count after flights higher than this [m].
        regime_equal: whether both move in the same regime.
        mode: ``"trajectory"`` or ``"distribution"``.
        regimes: of the tested recording and the reference.
        window_s: what was looked at, begin and end [s].
        pairs: indices of the matched impacts, (p, 2): tested, reference.
        missed: indices into the reference's impacts.
        invented: indices into the tested recording's impacts.
        tests: of the distributions.
        rate_ratio: impacts per time against the reference's: value, and the ends of its 95 % interval.
        notes: what makes the comparison doubtful, a sentence each.
        tested: the tested recording.
        reference: the reference.
    """

    impacts_compared: int
    impacts_matched: int | None
    impacts_missed: int | None
    impacts_invented: int | None
    velocity_error_median: float | None
    velocity_error_p95: float | None
    velocity_bias: float | None
    phase_error_median_cycles: float | None
    flight_height_min_m: float
    regime_equal: bool
    mode: Mode
    regimes: tuple[str, str] = ("", "")
    window_s: tuple[float, float] = (0.0, 0.0)
    pairs: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), dtype=int), repr=False)
    missed: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int), repr=False)
    invented: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int), repr=False)
    tests: tuple[SampleTest, ...] = ()
    rate_ratio: tuple[float, float, float] | None = None
    notes: tuple[str, ...] = ()
    tested: Recording | None = field(default=None, repr=False)
    reference: Recording | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        found = f"{self.impacts_compared} impacts compared"
        if self.mode == "trajectory":
            found = f"{self.impacts_matched} of {self.impacts_compared} impacts matched, "
            found += f"{self.impacts_missed} missed, {self.impacts_invented} invented"
        median, p95 = self.velocity_error_median, self.velocity_error_p95
        speed = [] if median is None or p95 is None else [f"speed error {median:.2g} (median), {p95:.2g} (95 %)"]
        regimes = self.regimes[0] if self.regime_equal else f"{self.regimes[0]} against {self.regimes[1]}"
        return f"Comparison({', '.join([self.mode, found, *speed, regimes])})"

    def _repr_html_(self) -> str:
        from gears3d import notebook

        def percent(value: float | None) -> str:
            return "" if value is None else f"{100.0 * value:.2g} %"

        counts = {"matched": self.impacts_matched, "missed": self.impacts_missed, "invented": self.impacts_invented}
        rows = [
            ("compared by", self.mode),
            ("regime", self.regimes[0] if self.regime_equal else " against ".join(self.regimes)),
            ("impacts compared", f"{self.impacts_compared}"),
            *((name, "" if count is None else f"{count}") for name, count in counts.items()),
            ("speed error, median", percent(self.velocity_error_median)),
            ("speed error, 95th percentile", percent(self.velocity_error_p95)),
            ("bias of speeds", percent(self.velocity_bias)),
            *(("note", note) for note in self.notes),
        ]
        return notebook.table("Comparison", rows)

    def to_dict(self) -> dict[str, Any]:
        """Return what ``summary.json`` holds under ``comparison``: the contract's keys and no others."""
        return {key: getattr(self, key) for key in KEYS}

    def details(self) -> dict[str, Any]:
        """Return the contract's keys and, after them, ``regimes``, ``tests``, ``rate_ratio`` and ``notes``."""
        more = {"regimes": list(self.regimes), "tests": [asdict(test) for test in self.tests]}
        ratio = None if self.rate_ratio is None else dict(zip(("value", "low", "high"), self.rate_ratio, strict=True))
        return {**self.to_dict(), **more, "rate_ratio": ratio, "notes": list(self.notes)}
