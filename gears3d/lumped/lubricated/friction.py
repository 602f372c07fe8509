"""Friction of sliding teeth: Coulomb's, with its sign change at the pitch point, and that of sheared oil."""

from __future__ import annotations

from math import cos, pi, sin, tan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gears3d.stiffness.mesh import contact_path, pair_stiffness, reverse_lead

if TYPE_CHECKING:
    from gears3d.gears import Pair

Array = NDArray[np.float64]
SLICES = 64  # slices of the face over which lines of contact are averaged


def coefficient(place: ArrayLike, average: float, regularisation: float) -> Array:
    """Return µ at a distance from the pitch point, (2µ/π)·(atan x + x/(1 + x²)) with x = Φ·place.

    ``place`` [m] counts in the sense of the contact's motion, ``average`` is µ far from the pitch point,
    ``regularisation`` is Φ [1/m]. Printed is ε, the contact ratio, in place of the second Φ, with which both terms
    would change sign at different places.

    Source: the lubricated dual-clutch transmission, eq. (29), after Vaishya & Singh 2003.

    >>> coefficient([-1.0, 0.0, 1.0], 0.05, 50e3).round(6).tolist()
    [-0.05, 0.0, 0.05]
    """
    x = regularisation * np.asarray(place, float)
    return 2.0 * average / pi * (np.arctan(x) + x / (1.0 + x * x))


def hydrodynamic(thickness: ArrayLike, sliding: ArrayLike, length: float, viscosity: float, radius: float) -> Array:
    """Return the friction of sheared oil, Fhf = L·π·η0·|ut|·√(req/(2h)) [N].

    h is ``thickness`` [m], ut ``sliding`` [m/s], L the ``length`` of the lines of contact [m], η0 ``viscosity`` [Pa·s]
    and req the equivalent ``radius`` [m].

    Source: the lubricated dual-clutch transmission, eq. (30).

    >>> round(float(hydrodynamic(2e-6, 1.0, 0.02, 0.01, 8e-3)), 6)
    0.028099
    """
    h = np.asarray(thickness, float)
    return length * pi * viscosity * np.abs(sliding) * np.sqrt(radius / (2.0 * h))


def levers(pair: Pair, theta: Array, flank: int, average: float, regularisation: float, published: bool) -> Array:
    """Return the ratio (n,) of friction to flank force on the loose gear along the transverse line of action.

    ``theta`` are angles of the drive [rad], (n,); ``flank`` is 0 active, 1 reverse; ``published`` takes one place for
    all lines and the arm at the pitch point, r·sin αt, as printed. Friction on the loose gear acts along the rolling
    direction while the drive slides faster, behind the pitch point; its arm is the distance from the contact to the
    point where the line of action touches the loose gear's base circle.

    Source: the lubricated dual-clutch transmission, eqs (27) to (29).
    """
    tilt = cos(pair.drive.base_helix_angle)
    base, tangent = pair.loose.base_radius, tan(pair.working_pressure_angle)
    if published:
        place = _one_place(pair, theta, flank)
        return coefficient(place, average, regularisation) * tangent / tilt
    places = _places(pair, theta, flank)
    weights = pair_stiffness(pair, places)
    moments = coefficient(places, average, regularisation) * (base * tangent - places) * weights
    return moments.sum(axis=(1, 2)) / np.maximum(weights.sum(axis=(1, 2)), 1e-300) / (base * tilt)


def shearing(pair: Pair, theta: Array, flank: int, published: bool, length: float) -> Array:
    """Return the integral over all lines of contact of place times arm, in base radii of the loose gear [m²], (n,).

    Times π·η0·√(req/2h) and both speeds together it is the force of sheared oil along the line of action. ``theta``
    [rad], (n,), ``flank`` and ``published`` are as for :func:`levers`; ``length`` [m] of the lines of contact counts
    where printed.

    Source: the lubricated dual-clutch transmission, eqs (30), (31).
    """
    base, tangent = pair.loose.base_radius, tan(pair.working_pressure_angle)
    if published:
        return length * _one_place(pair, theta, flank) * tangent
    places = _places(pair, theta, flank)
    begin, end = contact_path(pair)
    inside = (places >= begin) & (places <= end)
    width = min(pair.drive.face_width, pair.loose.face_width) / SLICES / cos(pair.drive.base_helix_angle)
    return np.where(inside, places * (tangent - places / base), 0.0).sum(axis=(1, 2)) * width


def _one_place(pair: Pair, theta: Array, flank: int) -> Array:
    """The contact in the middle of the face that is next to the pitch point [m]."""
    pitch = pair.drive.base_pitch
    place = pair.drive.base_radius * theta if flank == 0 else reverse_lead(pair) - pair.drive.base_radius * theta
    return np.mod(place + 0.5 * pitch, pitch) - 0.5 * pitch


def _places(pair: Pair, theta: Array, flank: int) -> Array:
    """Contacts of all teeth in all slices, those beyond the path included, (n, teeth, slices) [m]."""
    width = min(pair.drive.face_width, pair.loose.face_width)
    heights = ((np.arange(SLICES) + 0.5) / SLICES - 0.5) * width * tan(pair.drive.base_helix_angle)
    begin, end = contact_path(pair)
    reach = float(np.max(np.abs(heights)))
    pitch = pair.drive.base_pitch
    count = int(np.ceil((max(end, -begin) + reach) / pitch)) + 1
    first = _one_place(pair, theta, flank)
    return first[:, None, None] + pitch * np.arange(-count, count + 1)[:, None] + heights


def arm(pair: Pair) -> float:
    """Return the arm of friction at the pitch point, r·sin αt of the loose gear [m]."""
    angle = pair.working_pressure_angle
    return pair.loose.base_radius / cos(angle) * sin(angle)
