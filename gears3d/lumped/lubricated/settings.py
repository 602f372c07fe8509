"""What the lubricated model adds to a scenario: how its teeth close, and how they rub."""

from __future__ import annotations

from dataclasses import dataclass

from gears3d.errors import UsageError, did_you_mean

DEAD_ZONES = ("continuous", "published")
FRICTIONS = ("lines", "published", "none")


@dataclass(frozen=True)
class Settings:
    """Choices of the lubricated model that no scenario has.

    Args:
        damping_ratio: ξ of the teeth, of the critical damping of the loose gear on the mesh stiffness.
        harmonics: of the mesh frequency that the stiffness has.
        friction: ``"lines"``: mean over all lines of contact; ``"published"``: of one place, as printed; ``"none"``.
        average_friction: µ of Coulomb friction, far from the pitch point.
        regularisation: Φ, how fast friction turns at the pitch point [1/m].
        hydrodynamic: whether oil that is sheared rubs, too.
        dead_zone: ``"continuous"``: oil at every gap, teeth beyond the smallest film; ``"published"``: teeth in place
            of oil from ``published_gap`` on, where they first pull.
        published_gap: hmax of the published dead zone, along the normal [m].
        ramp: depth over which the damping of the teeth comes in, along the normal [m]; ``None``: the smallest
            thickness. Without it the force jumps where the teeth touch, and the rattle index has no limit.
        tolerance: relative, of a step.

    Raises:
        UsageError: an unknown choice.

    Source: the lubricated dual-clutch transmission, eqs (6) to (8) and (27) to (31): ξ = 0.1, Φ = 50 per mm.

    >>> Settings(friction="line")
    Traceback (most recent call last):
    gears3d.errors.UsageError: there is no friction 'line'; did you mean 'lines'?
    """

    damping_ratio: float = 0.1
    harmonics: int = 8
    friction: str = "lines"
    average_friction: float = 0.05
    regularisation: float = 50e3
    hydrodynamic: bool = True
    dead_zone: str = "continuous"
    published_gap: float = 5e-6
    ramp: float | None = None
    tolerance: float = 1e-7

    def __post_init__(self) -> None:
        for name, known in (("friction", FRICTIONS), ("dead_zone", DEAD_ZONES)):
            word = getattr(self, name)
            if word not in known:
                raise UsageError(f"there is no {name} {word!r}; {did_you_mean(word, known)}")
