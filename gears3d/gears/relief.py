"""Relief of tooth profiles towards tip and root, as data and as numbers for the compiled flanks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import acos, atan2, cos, degrees, hypot, inf, isfinite, sqrt
from typing import TYPE_CHECKING, Literal

from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.gears.involute import inv
from gears3d.gears.rack import form

if TYPE_CHECKING:
    from gears3d.gears.gear import Gear

SHAPES = ("linear", "parabolic")
STARTS = ("start_roll", "start_diameter", "length")
_LEAST_TURN = 0.2
"""How much the normal of a relieved flank turns at least for one unit of roll: 1 on the involute, 0 where it folds."""


@dataclass(frozen=True)
class Relief:
    """Material taken off both flanks of every tooth, from nothing at its start to ``amount`` at its end.

    The amount is measured in the transverse section along the normal of the involute, over the roll angle, as profile
    deviations are. Tip relief ends at the tip circle, root relief at the root form circle.

    Args:
        amount: taken off at the end [m].
        start_roll: where it starts, as a roll angle of the involute [rad].
        start_diameter: where it starts, as a diameter [m].
        length: where it starts, as a length of roll from its end [m]; one of the three is given.
        shape: ``"linear"`` or ``"parabolic"`` in the roll angle.

    Raises:
        InputError: not exactly one start, an amount that is negative, an unknown shape.

    Source: ISO 21771:2007, profile modifications; ISO 1328-1:2013, direction of measurement.

    >>> Relief(20e-6, length=3e-3).shape
    'linear'
    """

    amount: float
    start_roll: float | None = None
    start_diameter: float | None = None
    length: float | None = None
    shape: Literal["linear", "parabolic"] = "linear"

    def __post_init__(self) -> None:
        given = [name for name in STARTS if getattr(self, name) is not None]
        if len(given) != 1:
            held = " and ".join(given) or "no start"
            raise InputError(Fault(given[-1] if given else "length", f"has {held}", f"give one of {', '.join(STARTS)}"))
        if not 0.0 <= self.amount < inf:
            raise InputError(Fault("amount", f"is {self.amount * 1e6:g} um", "give 0 um or more"))
        if self.shape not in SHAPES:
            raise InputError(Fault("shape", f"is {self.shape!r}", did_you_mean(str(self.shape), SHAPES)))

    def start(self, gear: Gear, end: float, inwards: float) -> float:
        """Return the roll angle at which the relief starts [rad].

        Args:
            gear: the gear.
            end: roll angle at which it ends [rad].
            inwards: 1 for tip relief, whose start lies below its end, -1 for root relief.
        """
        if self.start_roll is not None:
            return self.start_roll
        if self.start_diameter is not None:
            return sqrt(max((0.5 * self.start_diameter / gear.base_radius) ** 2 - 1.0, 0.0))
        assert self.length is not None
        return end - inwards * self.length / gear.base_radius


def relief_rows(gear: Gear, lowest: float) -> list[float]:
    """Return root and tip relief of a gear as numbers.

    Args:
        gear: the gear.
        lowest: roll angle at the root form circle [rad].

    Returns:
        For root and tip: roll angle at the start and length in roll angle with its sign [rad], amount at the end [m],
        power of the law, (8,); an absent relief starts at infinity.
    """
    row: list[float] = []
    for relief, end, outwards in ((gear.root_relief, lowest, -1.0), (gear.tip_relief, gear.tip_roll, 1.0)):
        if relief is None or relief.amount == 0.0:
            row += [outwards * inf, outwards, 0.0, 1.0]
        else:
            start = relief.start(gear, end, outwards)
            row += [start, end - start, relief.amount, 1.0 + SHAPES.index(relief.shape)]
    return row


def relief_bend(gear: Gear, lowest: float) -> float:
    """Return by how much parabolic relief bends a flank more than the involute, in parts of the involute's curvature.

    Args:
        gear: the gear.
        lowest: roll angle at the root form circle [rad].
    """
    row, most = relief_rows(gear, lowest), 0.0
    for start, reach, amount, power in (row[:4], row[4:]):
        if power == 2.0:
            most = max(most, 2.0 * amount / reach**2 / (gear.base_radius * min(start, start + reach)))
    return most


def relief_faults(gear: Gear) -> Iterator[Fault]:
    """Yield what is wrong with the reliefs of an otherwise sound gear.

    Args:
        gear: the gear.

    Yields:
        A fault for each start off the flank, and for each amount that makes no regular flank or no tip.
    """
    lowest, highest = form(gear, gear.base_half_angle)[0], gear.tip_roll
    row = relief_rows(gear, lowest)
    rows = {"root_relief": row[:4], "tip_relief": row[4:]}
    for key, (start, reach, amount, power) in rows.items():
        if not isfinite(start):
            continue
        if not lowest < start < highest:
            given = next(name for name in STARTS if getattr(getattr(gear, key), name) is not None)
            yield Fault(
                f"{key}.{given}",
                f"puts the start at a roll angle of {degrees(start):.4g} deg, off the flank",
                _where(gear, given, (lowest, highest), reach),
            )
        elif _turn(gear, (start, reach, amount, power)) < _LEAST_TURN:
            most = _most(gear, (start, reach, power))
            yield Fault(
                f"{key}.amount", f"is {amount * 1e6:.4g} um: the flank would fold", f"give at most {most * 1e6:.4g} um"
            )
    if isfinite(rows["root_relief"][0]) and rows["root_relief"][0] > rows["tip_relief"][0]:
        yield Fault("root_relief", "starts above the start of the tip relief", "let it start lower, or that higher")
    yield from _tip_faults(gear)


def _where(gear: Gear, given: str, span: tuple[float, float], reach: float) -> str:
    """Return the admissible range of a start in the terms in which it was given."""
    low, high = span
    if given == "start_roll":
        return f"give more than {degrees(low):.4g} and less than {degrees(high):.4g} deg"
    if given == "length":
        return f"give more than 0 and less than {(high - low) * gear.base_radius * 1e3:.4g} mm"
    ends = [2e3 * gear.base_radius * hypot(1.0, roll) for roll in span]
    return f"give more than {ends[0]:.6g} and less than {ends[1]:.6g} mm"


def _turn(gear: Gear, law: tuple[float, float, float, float]) -> float:
    """Return the least turning of the relieved flank's normal by the roll angle, over the length of the relief."""
    start, reach, amount, power = law
    least = inf
    for step in range(65):
        x = step / 64
        taken = amount * x**power
        slope = amount * power * x ** (power - 1.0) / reach
        bend = amount * power * (power - 1.0) / reach**2
        radius = gear.base_radius * (start + reach * x) - taken
        if radius <= 0.0:
            return -inf
        turn = 1.0 + (bend * radius - slope * (gear.base_radius - slope)) / (radius**2 + slope**2)
        least = min(least, turn)
    return least


def _most(gear: Gear, law: tuple[float, float, float]) -> float:
    """Return the largest amount for which the flank does not fold [m]."""
    start, reach, power = law
    low, high = 0.0, gear.module
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _turn(gear, (start, reach, middle, power)) >= _LEAST_TURN else (low, middle)
    return low


def _tip_faults(gear: Gear) -> Iterator[Fault]:
    """Yield a fault when the tip relief leaves no tip."""
    if gear.tip_relief is None:
        return
    angle = acos(gear.base_radius / gear.tip_radius)
    most = gear.tip_radius * (gear.base_half_angle - inv(angle)) * cos(atan2(gear.tip_roll, 1.0))
    if gear.tip_relief.amount >= most:
        yield Fault(
            "tip_relief.amount",
            f"is {gear.tip_relief.amount * 1e6:.4g} um on each flank: no tip is left",
            f"give less than {most * 1e6:.4g} um",
        )
