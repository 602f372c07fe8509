"""Oil between the flanks: it decelerates approaching flanks and carries rolling ones."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sqrt
from typing import ClassVar

from gears3d.effects.base import Param, Place, Rig, register
from gears3d.effects.rows import Row, gap_film
from gears3d.errors import Fault, InputError
from gears3d.laws import film


@register
@dataclass(frozen=True)
class OilFilm:
    """Film on both flanks that pushes by the wedge of the rolling flanks and, while they approach, by its squeeze.

    The flanks touch where the film is as thin as their roughness; there the restitution law, or ``tooth_compliance``,
    acts in addition to the oil. Source: the lubricated dual-clutch transmission, eqs (11)-(14), see
    ``gears3d.laws.film``.

    Args:
        viscosity: dynamic, Pa·s.
        minimum_thickness: that the roughness leaves, along the normal, m.
        wedge: factor on the wedge, 0: no wedge.
        squeeze: factor on the squeeze, 0: no squeeze; 2 is that of a gap full of oil.
        contact_length: of all lines of contact together, m; 0: the mean of the pair.
        radius: equivalent one of the flanks in the normal section, m; 0: that at the pair's pitch point.
        felt_height: gap along the transverse line of action below which the flanks count as in contact over oil, m;
            0: where the film carries the drag, see :meth:`felt`.

    >>> rig = Rig(24.476e-3, 61.909e-3, 3.71e-3, 0.1, 133.72e-6, 0.3, 157.08, 17, 43, 0.391006, 0.456892, 16e-3, 1.372)
    >>> [float(f"{x:.3g}") for x in OilFilm(viscosity=0.01).rows(rig)[0].p]
    [3.94e-06, 1.12e-06, 0.00993, 0.0251, 1.11e-06, 1.36e-05]
    """

    viscosity: float
    minimum_thickness: float = 1e-6
    wedge: float = 1.0
    squeeze: float = 1.0
    contact_length: float = 0.0
    radius: float = 0.0
    felt_height: float = 0.0

    kind: ClassVar[str] = "oil_film"
    place: ClassVar[Place] = "gap_force"
    params: ClassVar[dict[str, Param]] = {
        "viscosity": Param("viscosity", 0.0, 100.0),
        "minimum_thickness": Param("length", 1e-8, 1e-4, default=1e-6, linear=False),
        "wedge": Param("ratio", 0.0, 10.0, default=1.0),
        "squeeze": Param("ratio", 0.0, 10.0, default=1.0),
        "contact_length": Param("length", 0.0, 10.0, default=0.0),
        "radius": Param("length", 0.0, 10.0, default=0.0, linear=False),
        "felt_height": Param("length", 0.0, 1e-3, default=0.0, linear=False),
    }

    def rows(self, rig: Rig) -> list[Row]:
        """One film, projected from the normal to the transverse line of action: h = gap·cos βb, F·cos βb."""
        wedge, squeeze = self._coefficients(rig)
        drive, loose = _rolling(rig)
        minimum = self.minimum_thickness / cos(rig.base_helix_angle)
        felt = self.felt_height or self.felt(rig)
        return [gap_film(wedge * self.wedge, squeeze * self.squeeze, drive, loose, minimum, felt)]

    def felt(self, rig: Rig) -> float:
        """Return the gap below which the film carries the drag [m].

        At this height the wedge carries the base drag at the mean speed; as much again is what the squeeze needs to do
        so at the speed of a fall across the backlash. It is 1/4 of the backlash at most, and without drag.
        """
        force = rig.drag_torque / rig.base_radius_loose
        if force <= 0.0:
            return 0.25 * rig.backlash
        wedge, squeeze = self._coefficients(rig)
        drive, loose = _rolling(rig)
        u = abs(rig.mean_speed) * (drive + loose * rig.base_radius_drive / rig.base_radius_loose)
        carried = self.wedge * wedge * u / force + (self.squeeze * squeeze * _fall(rig) / force) ** (2.0 / 3.0)
        return min(carried, 0.25 * rig.backlash)

    def unit_size(self, rig: Rig) -> float:
        """The viscosity whose squeeze stops a fall across the backlash before the flanks touch."""
        of_one = self._coefficients(rig, 1.0)[1]
        mass = rig.inertia / rig.base_radius_loose**2
        minimum = self.minimum_thickness / cos(rig.base_helix_angle)
        return max(_fall(rig), 1e-6) * mass * sqrt(minimum) / (2.0 * of_one)

    def _coefficients(self, rig: Rig, viscosity: float | None = None) -> tuple[float, float]:
        """Wedge [N·s] and squeeze [N·s·m^0.5] along the transverse line of action, without their factors."""
        length = self.contact_length or film.contact_length(rig.face_width, rig.contact_ratio, rig.base_helix_angle)
        if length <= 0.0:
            raise InputError(
                Fault("effect", "oil_film: the pair has no face width", 'give gears.face_width, e.g. "16 mm"')
            )
        radius = self.radius or film.equivalent_radius(
            rig.base_radius_drive, rig.base_radius_loose, rig.working_pressure_angle, rig.base_helix_angle
        )
        eta = self.viscosity if viscosity is None else viscosity
        wedge = float(film.wedge(1.0, length, eta, radius))
        return wedge, float(film.squeeze(1.0, length, eta, radius)) * sqrt(cos(rig.base_helix_angle))


def _rolling(rig: Rig) -> tuple[float, float]:
    """Factors of both gears' speeds in the entraining speed [m]."""
    angles = (rig.working_pressure_angle, rig.base_helix_angle)
    return film.rolling_radius(rig.base_radius_drive, *angles), film.rolling_radius(rig.base_radius_loose, *angles)


def _fall(rig: Rig) -> float:
    """Speed of a fall across the backlash under the drag, a typical impact's [m/s]."""
    return sqrt(2.0 * rig.drag_torque * rig.base_radius_loose / rig.inertia * rig.backlash)
