"""One external involute gear as data, in the terms of ISO 21771."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import acos, atan, cos, degrees, inf, pi, radians, sin, sqrt, tan

from gears3d.errors import Fault, InputError
from gears3d.gears.involute import inv

TEETH = (5, 2000)


@dataclass(frozen=True)
class Gear:
    """An external involute gear cut by a basic rack; lengths in m, angles in rad.

    Args:
        module: normal module [m].
        teeth: number of teeth, 5 to 2000.
        pressure_angle: normal pressure angle [rad].
        helix_angle: helix angle at the reference cylinder [rad], positive = right hand on the drive gear; the loose
            gear of a pair has the opposite hand and the same number.
        face_width: length of the teeth along the axis [m].
        profile_shift: profile shift coefficient, in modules.
        addendum: addendum of the basic rack, in modules.
        dedendum: dedendum of the basic rack, in modules.
        fillet_radius: tip radius of the cutting rack, in modules.
        bore: diameter of the hole along the axis [m], ``None`` for none.

    Raises:
        InputError: carries one fault for each value that makes no gear.

    Source: ISO 21771:2007, section 4; basic rack ISO 53.

    >>> gear = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
    >>> round(gear.base_radius * 1e3, 4), round(gear.tip_radius * 1e3, 4)
    (148.0016, 161.0)
    """

    module: float
    teeth: int
    pressure_angle: float = radians(20.0)
    helix_angle: float = 0.0
    face_width: float = 0.01
    profile_shift: float = 0.0
    addendum: float = 1.0
    dedendum: float = 1.25
    fillet_radius: float = 0.25
    bore: float | None = None

    def __post_init__(self) -> None:
        faults = list(_simple_faults(self)) or list(_shape_faults(self))
        if faults:
            raise InputError(faults)

    @cached_property
    def transverse_module(self) -> float:
        """Module in the transverse section [m]."""
        return self.module / cos(self.helix_angle)

    @cached_property
    def transverse_pressure_angle(self) -> float:
        """Pressure angle in the transverse section [rad]."""
        return atan(tan(self.pressure_angle) / cos(self.helix_angle))

    @cached_property
    def base_helix_angle(self) -> float:
        """Helix angle at the base cylinder [rad]."""
        return atan(tan(self.helix_angle) * cos(self.transverse_pressure_angle))

    @cached_property
    def reference_radius(self) -> float:
        """Radius of the reference cylinder [m]."""
        return 0.5 * self.transverse_module * self.teeth

    @cached_property
    def base_radius(self) -> float:
        """Radius of the base cylinder [m]."""
        return self.reference_radius * cos(self.transverse_pressure_angle)

    @cached_property
    def tip_radius(self) -> float:
        """Radius of the tip cylinder [m]."""
        return self.reference_radius + (self.addendum + self.profile_shift) * self.module

    @cached_property
    def root_radius(self) -> float:
        """Radius of the root cylinder [m]."""
        return self.reference_radius - (self.dedendum - self.profile_shift) * self.module

    @cached_property
    def base_pitch(self) -> float:
        """Transverse base pitch [m], the distance of neighbouring flanks along the line of action."""
        return 2.0 * pi * self.base_radius / self.teeth

    @cached_property
    def base_half_angle(self) -> float:
        """Half the angle that a tooth of full thickness spans at the base circle [rad]."""
        thickness = pi / 2.0 + 2.0 * self.profile_shift * tan(self.pressure_angle)
        return thickness / self.teeth + inv(self.transverse_pressure_angle)

    @cached_property
    def tip_roll(self) -> float:
        """Roll angle of the involute at the tip [rad]."""
        return sqrt((self.tip_radius / self.base_radius) ** 2 - 1.0)


def _simple_faults(gear: Gear):
    ranges = {
        "module": (gear.module, 0.0, 1.0, "m", 1.0),
        "teeth": (gear.teeth, TEETH[0], TEETH[1], "", 1.0),
        "pressure_angle": (gear.pressure_angle, 5.0, 45.0, "deg", degrees(1.0)),
        "helix_angle": (gear.helix_angle, -60.0, 60.0, "deg", degrees(1.0)),
        "face_width": (gear.face_width, 0.0, inf, "m", 1.0),
        "profile_shift": (gear.profile_shift, -2.0, 2.0, "modules", 1.0),
        "addendum": (gear.addendum, 0.05, 3.0, "modules", 1.0),
        "dedendum": (gear.dedendum, 0.05, 3.0, "modules", 1.0),
        "fillet_radius": (gear.fillet_radius, 0.0, 1.0, "modules", 1.0),
    }
    for key, (value, low, high, unit, scale) in ranges.items():
        shown = value * scale
        above = shown > low if key in ("module", "face_width") else shown >= low - 1e-9
        if not (above and shown <= high + 1e-9):
            limits = f"> {low:g}" if high == inf else f"{low:g} to {high:g}"
            yield Fault(key, f"is {shown:g} {unit}".rstrip(), f"give {limits} {unit}".rstrip())
    if gear.teeth != int(gear.teeth):
        yield Fault("teeth", f"is {gear.teeth:g}", "give a whole number")


def _shape_faults(gear: Gear):
    module_mm = gear.module * 1e3
    if gear.tip_radius <= gear.base_radius:
        yield Fault(
            "addendum",
            f"puts the tip ({gear.tip_radius * 1e3:.4g} mm) inside the base circle ({gear.base_radius * 1e3:.4g} mm)",
            "give more addendum or profile shift",
        )
    elif gear.base_half_angle <= inv(acos(gear.base_radius / gear.tip_radius)):
        yield Fault(
            "addendum",
            f"of {gear.addendum:g} modules with profile shift {gear.profile_shift:g} makes pointed teeth",
            "give less addendum or profile shift",
        )
    if gear.root_radius <= 0.2 * gear.module:
        yield Fault("dedendum", f"leaves a root radius of {gear.root_radius * 1e3:.4g} mm", "give less dedendum")
    slope = gear.pressure_angle
    depth = gear.dedendum * tan(slope)
    widest = (pi / 4.0 - depth) * cos(slope) / (1.0 - sin(slope))
    if gear.fillet_radius > min(widest, gear.dedendum / (1.0 - sin(slope))):
        yield Fault(
            "fillet_radius",
            f"is {gear.fillet_radius:g} modules, more than the tip of the rack has room for",
            f"give 0 to {max(widest, 0.0):.4g} modules",
        )
    if gear.bore is not None and not 0.0 < gear.bore <= 1.6 * gear.root_radius * cos(pi / gear.teeth):
        most = 1.6e3 * gear.root_radius * cos(pi / gear.teeth)
        yield Fault(
            "bore", f"is {gear.bore * 1e3:g} mm at module {module_mm:g} mm", f"give more than 0 up to {most:.4g} mm"
        )
