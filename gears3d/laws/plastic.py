"""The flight of the loose gear between the flanks of a harmonically driven gear, in closed form.

Source: Rigaud & Perret-Liaudet 2020, eqs (15) to (19). In print the labels of t3 and t4 are interchanged and both
losses are given in quadrants where the flank still pushes; here the active flank is left where the acceleration of the
drive falls below -F/m, the reverse flank where it rises above it again.
"""

from __future__ import annotations

import math


def loss_phases(excitation: float) -> tuple[float, float]:
    """Return the phases ωt at which the active and the reverse flank are left [rad].

    Source: Rigaud & Perret-Liaudet 2020, eq. (17), with ẏ = ΔV·sin ωt.

    Args:
        excitation: Λ = m·ω·ΔV/F, at least 1.

    Raises:
        ValueError: Λ < 1, so that contact is never lost.

    >>> [round(phase, 6) for phase in loss_phases(12.47159)]
    [1.651065, 4.632121]
    """
    if excitation < 1.0:
        raise ValueError(f"contact is never lost at an excitation of {excitation} < 1")
    active = math.acos(-1.0 / excitation)
    return active, 2.0 * math.pi - active


def crossing(speed: float, omega: float, pull: float, phase: float, gap: float) -> tuple[float, float]:
    """Return when a flight crosses a gap, and how fast it arrives.

    Source: Rigaud & Perret-Liaudet 2020, eqs (18) and (19).

    Args:
        speed: amplitude ΔV of the drive's speed along the line of action [m/s].
        omega: its circular frequency [rad/s].
        pull: deceleration F/m of the loose gear [m/s²].
        phase: ωt at which contact is lost [rad].
        gap: how far to go, positive from the active to the reverse flank, negative back [m].

    Returns:
        Time of arrival [s] and relative speed just before [m/s].

    Raises:
        ValueError: the gap is not crossed within half a period.

    >>> time, approach = crossing(0.148 * 20 * math.pi / 30, 6 * math.pi, 0.468489, 1.651065, 250e-6)
    >>> round(time, 6), round(approach, 5)
    (0.111654, 0.03086)
    """
    from scipy.optimize import root_scalar

    lost = phase / omega
    launch = speed * math.sin(phase)

    def left(time: float) -> float:
        flown = time - lost
        driven = speed / omega * (math.cos(phase) - math.cos(omega * time))
        return launch * flown - 0.5 * pull * flown**2 - driven - gap

    hit = root_scalar(left, bracket=(lost, lost + math.pi / omega), xtol=1e-16, rtol=1e-15).root
    return hit, launch - pull * (hit - lost) - speed * math.sin(omega * hit)
