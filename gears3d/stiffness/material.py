"""What teeth are made of."""

from __future__ import annotations

from math import pi
from typing import NamedTuple


class Material(NamedTuple):
    """An isotropic elastic material.

    Args:
        young: modulus of elasticity E [Pa].
        poisson: ν.

    >>> round(STEEL.shear / 1e9, 2)
    79.23
    """

    young: float = 2.06e11
    poisson: float = 0.3

    @property
    def shear(self) -> float:
        """Shear modulus G [Pa]."""
        return self.young / (2.0 * (1.0 + self.poisson))

    @property
    def hertz(self) -> float:
        """Compliance of the contact of two such bodies for a unit length of line, 4·(1 − ν²)/(π·E) [m²/N].

        A line contact has no stiffness of its own, it depends on how deep in the bodies one measures and a little on
        the load; this is the constant that the potential energy method takes. Source: Yang & Sun 1985, as used by
        Yang & Lin 1987 and Wu, Zuo & Parey 2008.
        """
        return 4.0 * (1.0 - self.poisson**2) / (pi * self.young)


STEEL = Material()
"""Steel as ISO 6336-1 has it: 206 GPa, 0.3."""
