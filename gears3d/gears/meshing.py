"""Two gears in mesh: centre distance, backlash, and where the teeth stand.

Placement: the drive gear turns about the origin, counter-clockwise seen from +z when its angle grows; the loose gear
turns about (centre_distance, 0, 0), clockwise when its angle grows. Each gear has a frame of its own in which the
active flank of tooth 1 crosses the +x axis at the working pitch radius. :meth:`Meshing.rotation` turns that frame into
the world's: by θ for the drive, by π − θ for the loose gear. So at θ_drive = θ_loose = 0 both teeth 1 touch on their
active flanks in the pitch point, and the reverse flanks stand ``backlash`` apart along the line of action.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import acos, cos, pi, sin, tan

from gears3d.errors import Fault, InputError
from gears3d.gears.deviation import GEARS, Deviation, Mounting, index_of
from gears3d.gears.gear import Gear, inv


@dataclass(frozen=True)
class Meshing:
    """Two external involute gears on parallel axes; :class:`~gears3d.gears.Pair` is one that passes the checks."""

    drive: Gear
    loose: Gear
    centre_distance: float
    thinning: float = 0.0
    deviations: tuple[Deviation, ...] = ()
    mounting: tuple[Mounting, ...] = ()

    def gear(self, which: str) -> Gear:
        """Return the gear named ``"drive"`` or ``"loose"``."""
        return (self.drive, self.loose)[index_of(which, GEARS, "which")]

    @cached_property
    def working_pressure_angle(self) -> float:
        """Transverse pressure angle at the working pitch circles [rad]."""
        return acos((self.drive.base_radius + self.loose.base_radius) / self.centre_distance)

    @cached_property
    def backlash(self) -> float:
        """Width of the dead band of perfect flanks along the transverse line of action [m]."""
        return backlash_of(self.drive, self.loose, self.centre_distance, self.thinning)

    @property
    def normal_backlash(self) -> float:
        """Normal backlash j_bn [m], between the flanks along their common normal in space (ISO 21771)."""
        return self.backlash * cos(self.drive.base_helix_angle)

    @property
    def circumferential_backlash(self) -> float:
        """Circumferential backlash j_wt [m], along the working pitch circle (ISO 21771)."""
        return self.backlash / cos(self.working_pressure_angle)

    @cached_property
    def path_length(self) -> float:
        """Distance of the points where the line of action touches the base circles [m]."""
        return self.centre_distance * sin(self.working_pressure_angle)

    @cached_property
    def contact_ratio(self) -> float:
        """Transverse contact ratio ε_α."""
        reach = sum(gear.base_radius * gear.tip_roll for gear in (self.drive, self.loose))
        return (reach - self.path_length) / self.drive.base_pitch

    @property
    def overlap_ratio(self) -> float:
        """Overlap ratio ε_β of helical teeth, 0 for spur gears."""
        width = min(self.drive.face_width, self.loose.face_width)
        return width * abs(tan(self.drive.base_helix_angle)) / self.drive.base_pitch

    def half_angle(self, which: str) -> float:
        """Half the angle that a perfect tooth spans at the base circle [rad], thinning included."""
        gear = self.gear(which)
        return gear.base_half_angle - 0.5 * self.thinning / gear.base_radius

    def start_roll(self, which: str) -> float:
        """Roll angle where the mate's tip meets the flank, the lower end of its working part [rad]."""
        gear, mate = (self.drive, self.loose) if which == "drive" else (self.loose, self.drive)
        return (self.path_length - mate.base_radius * mate.tip_roll) / gear.base_radius

    def rotation(self, which: str, theta: float) -> float:
        """Return the angle about +z that turns the gear's own frame into the world's."""
        return theta if index_of(which, GEARS, "which") == 0 else pi - theta

    def centre(self, which: str) -> tuple[float, float, float]:
        """Return the point of the gear's axis in its middle plane [m]."""
        return (0.0, 0.0, 0.0) if index_of(which, GEARS, "which") == 0 else (self.centre_distance, 0.0, 0.0)


def base_thickness(gear: Gear) -> float:
    """Return the transverse thickness of a perfect tooth along the base circle [m]."""
    return 2.0 * gear.base_radius * gear.base_half_angle


def backlash_of(drive: Gear, loose: Gear, centre_distance: float, thinning: float) -> float:
    """Return the dead band of perfect teeth, each thinned along the base circle, at a centre distance [m]."""
    base_sum = drive.base_radius + loose.base_radius
    if not centre_distance > base_sum:
        raise InputError(
            Fault(
                "centre_distance",
                f"is {centre_distance * 1e3:.6g} mm, less than the base radii together ({base_sum * 1e3:.6g} mm)",
                f"the reference radii together are {(drive.reference_radius + loose.reference_radius) * 1e3:.6g} mm",
            )
        )
    taken = base_thickness(drive) + base_thickness(loose) - 2.0 * thinning
    return drive.base_pitch - taken + 2.0 * base_sum * inv(acos(base_sum / centre_distance))
