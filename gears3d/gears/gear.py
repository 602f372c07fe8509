"""One external involute gear as data, in the terms of ISO 21771."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import atan, cos, degrees, inf, pi, radians, sin, sqrt, tan

from gears3d.errors import Fault, InputError
from gears3d.gears.involute import inv, inverse_inv
from gears3d.gears.relief import Relief, relief_faults

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
        tip_shortening: how much lower the tip lies than the rack's addendum puts it, in modules.
        tip_diameter: diameter of the tip cylinder [m], in place of addendum and tip shortening.
        tip_relief: taken off the flanks towards the tip.
        root_relief: taken off the flanks towards the root.
        rim: thickness of the rim below the root circle [m]; with ``web`` a pocket is left on both faces.
        web: thickness of the web between rim and hub, in the middle of the face [m].
        hub: diameter of the hub [m], which is as wide as the face; ``None`` for none: the web goes down to the bore.
        lead_crowning: taken off both flanks at both ends of the face, by a parabola over the face [m].
        helix_slope: by how much the helix advances too far in the gear's frame, from the end at -z to that at +z [m]:
            material added to the active and taken off the reverse flanks at +z, half of it, and the other way at -z.

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
    tip_shortening: float = 0.0
    tip_diameter: float | None = None
    tip_relief: Relief | None = None
    root_relief: Relief | None = None
    rim: float | None = None
    web: float | None = None
    hub: float | None = None
    lead_crowning: float = 0.0
    helix_slope: float = 0.0

    def __post_init__(self) -> None:
        faults = list(_simple_faults(self)) or list(_shape_faults(self)) or list(relief_faults(self))
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
        if self.tip_diameter is not None:
            return 0.5 * self.tip_diameter
        return self.reference_radius + (self.addendum + self.profile_shift - self.tip_shortening) * self.module

    @cached_property
    def root_radius(self) -> float:
        """Radius of the root cylinder [m]."""
        return self.reference_radius - (self.dedendum - self.profile_shift) * self.module

    @property
    def pocket(self) -> tuple[float, float] | None:
        """Radii of hub and rim between which the web stands back from the faces [m]; ``None`` for a full body."""
        if self.rim is None:
            return None
        inner = self.hub if self.hub is not None else self.bore
        return 0.5 * (inner or 0.0), self.root_radius - self.rim

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
        "tip_shortening": (gear.tip_shortening, -0.5, 1.0, "modules", 1.0),
    }
    for key, (value, low, high, unit, scale) in ranges.items():
        shown = value * scale
        above = shown > low if key in ("module", "face_width") else shown >= low - 1e-9
        if not (above and shown <= high + 1e-9):
            limits = f"> {low:g}" if high == inf else f"{low:g} to {high:g}"
            yield Fault(key, f"is {shown:g} {unit}".rstrip(), f"give {limits} {unit}".rstrip())
    for key in ("lead_crowning", "helix_slope"):
        value = getattr(gear, key)
        if gear.module > 0.0 and not abs(value) <= 0.05 * gear.module:
            most = 0.05e6 * gear.module
            yield Fault(key, f"is {value * 1e6:g} um", f"give -{most:g} to {most:g} um (a twentieth of the module)")
    if gear.teeth != int(gear.teeth):
        yield Fault("teeth", f"is {gear.teeth:g}", "give a whole number")


def _shape_faults(gear: Gear):
    yield from _tip_faults(gear)
    if gear.root_radius <= 0.2 * gear.module:
        most = 0.5 * gear.teeth / cos(gear.helix_angle) + gear.profile_shift - 0.2
        yield Fault(
            "dedendum",
            f"is {gear.dedendum:g} modules: the root radius is {gear.root_radius * 1e3:.4g} mm",
            f"give less than {most:.4g} modules",
        )
    slope = gear.pressure_angle
    depth = gear.dedendum * tan(slope)
    widest = (pi / 4.0 - depth) * cos(slope) / (1.0 - sin(slope))
    if gear.fillet_radius > min(widest, gear.dedendum / (1.0 - sin(slope))):
        yield Fault(
            "fillet_radius",
            f"is {gear.fillet_radius:g} modules, more than the tip of the rack has room for",
            f"give 0 to {max(widest, 0.0):.4g} modules",
        )
    yield from _body_faults(gear)


def _tip_faults(gear: Gear):
    if gear.tip_diameter is not None and gear.tip_shortening != 0.0:
        yield Fault("tip_diameter", f"is {gear.tip_diameter * 1e3:g} mm beside a tip_shortening", "keep one of the two")
        return
    key = "addendum" if gear.tip_diameter is None else "tip_diameter"
    lowest, highest = max(gear.base_radius, gear.root_radius), _pointed_radius(gear)
    if lowest < gear.tip_radius < highest:
        return
    if key == "tip_diameter":
        value, limits = f"is {2e3 * gear.tip_radius:.6g} mm", f"{2e3 * lowest:.6g} and less than {2e3 * highest:.6g} mm"
    else:
        value = f"of {gear.addendum:g} modules with profile shift {gear.profile_shift:g}"
        value += f" and tip shortening {gear.tip_shortening:g}" if gear.tip_shortening else ""
        other = gear.reference_radius + (gear.profile_shift - gear.tip_shortening) * gear.module
        low, high = ((radius - other) / gear.module for radius in (lowest, highest))
        limits = f"{max(low, 0.0):.4g} and less than {high:.4g} modules, or another profile shift"
    if gear.tip_radius >= highest:
        yield Fault(
            key,
            f"{value}: makes pointed teeth" if key != "addendum" else f"{value} makes pointed teeth",
            f"give more than {limits}",
        )
    else:
        where = "base" if lowest == gear.base_radius else "root"
        yield Fault(
            key,
            f"{value}{':' if key != 'addendum' else ''} puts the tip ({gear.tip_radius * 1e3:.4g} mm) inside the "
            f"{where} circle ({lowest * 1e3:.4g} mm)",
            f"give more than {limits}",
        )


def _pointed_radius(gear: Gear) -> float:
    """Return the radius at which both flanks of a tooth of full thickness meet [m]."""
    return gear.base_radius / cos(inverse_inv(max(gear.base_half_angle, 0.0)))


def _body_faults(gear: Gear):
    """Yield what is wrong with bore, rim, web and hub."""
    most = 1.6 * gear.root_radius * cos(pi / gear.teeth)
    if gear.bore is not None and not 0.0 < gear.bore <= most:
        yield Fault(
            "bore",
            f"is {gear.bore * 1e3:g} mm at module {gear.module * 1e3:g} mm",
            f"give more than 0 up to {most * 1e3:.4g} mm",
        )
        return
    for key, partner in (("rim", "web"), ("web", "rim"), ("hub", "rim")):
        if getattr(gear, key) is not None and getattr(gear, partner) is None:
            yield Fault(key, f"is {getattr(gear, key) * 1e3:g} mm without a {partner}", f"give {partner} too")
            return
    if gear.rim is None or gear.web is None:
        return
    least, room = 0.5 * (gear.bore or 0.0), gear.root_radius * cos(pi / gear.teeth)
    if gear.hub is not None and not 2.0 * least < gear.hub < most:
        yield Fault(
            "hub", f"is {gear.hub * 1e3:g} mm", f"give more than {2e3 * least:.4g} and less than {most * 1e3:.4g} mm"
        )
        return
    least = max(least, 0.5 * (gear.hub or 0.0))
    thin, thick = gear.root_radius - 0.98 * room, gear.root_radius - least
    if not thin <= gear.rim < thick:
        yield Fault(
            "rim", f"is {gear.rim * 1e3:g} mm", f"give at least {thin * 1e3:.4g} and less than {thick * 1e3:.4g} mm"
        )
    if not 0.0 < gear.web < gear.face_width:
        yield Fault(
            "web",
            f"is {gear.web * 1e3:g} mm",
            f"give more than 0 and less than face_width ({gear.face_width * 1e3:g} mm)",
        )
