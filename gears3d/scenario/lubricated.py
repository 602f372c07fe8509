"""The table of a scenario that the lubricated model alone reads."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Lubricated:
    """How the teeth of the lubricated model close and rub.

    Args:
        damping_ratio: ξ of the teeth, of the critical damping of the loose gear on the mesh stiffness.
        harmonics: of the mesh frequency that the stiffness has.
        friction: ``"lines"``: mean over all lines of contact; ``"published"``: of one place, as printed; ``"none"``.
        average_friction: µ of Coulomb friction, far from the pitch point.
        regularisation: Φ, how fast friction turns at the pitch point, 1/m.
        sheared_oil: ``"rubs"``, or ``"slips"``: it does not.
        dead_zone: ``"continuous"``: oil at every gap, teeth beyond the smallest film; ``"published"``: teeth in place
            of oil from ``published_gap`` on, where they first pull.
        published_gap: hmax of the published dead zone, along the normal, m.
        ramp: depth over which the damping of the teeth comes in, along the normal, m; ``None``: the smallest
            thickness. Without it the force jumps where the teeth touch, and the rattle index has no limit.
        tolerance: relative, of a step.

    Source: the lubricated dual-clutch transmission, eqs (6) to (8) and (27) to (31): ξ = 0.1, Φ = 50 per mm.
    """

    damping_ratio: float
    harmonics: int
    friction: str
    average_friction: float
    regularisation: float
    sheared_oil: str
    dead_zone: str
    published_gap: float
    ramp: float | None
    tolerance: float
