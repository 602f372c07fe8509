"""One involute gear: involute function, rack and fillet, tip and root relief, data and limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import acos, atan, atan2, cbrt, cos, degrees, hypot, inf, isfinite, pi, radians, sin, sqrt, tan
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gears3d.errors import Fault, InputError, did_you_mean

SHAPES = ("linear", "parabolic")
STARTS = ("start_roll", "start_diameter", "length")
# How much the normal of a relieved flank turns at least for one unit of roll: 1 on the involute, 0 where it folds
_LEAST_TURN = 0.2
TEETH = (5, 2000)


def inv(angle: float) -> float:
    """Return the involute function, tan(angle) − angle.

    Args:
        angle: pressure angle [rad].

    Returns:
        Polar angle between the start of the involute and the point [rad].

    Source: ISO 21771:2007, involute function.

    >>> round(inv(0.3490658503988659), 9)
    0.014904384
    """
    return tan(angle) - angle


def inverse_inv(value: float) -> float:
    """Return the pressure angle whose involute function is ``value``.

    Newton on the tangent t of the angle, t − atan(t) = value, which is convex and rises: it cannot miss.

    Args:
        value: inv(angle) [rad], not negative.

    Returns:
        The pressure angle [rad].

    Raises:
        InputError: the value is negative, no involute has such a point.

    >>> round(inverse_inv(inv(0.4)), 14)
    0.4
    """
    if value < 0.0:
        raise InputError(f"inv(angle) = {value:.6g} has no solution: the gears cannot mesh (give a value ≥ 0)")
    tangent = max(cbrt(3.0 * value), 2.0 * value)
    for _ in range(60):
        if tangent == 0.0:
            return 0.0
        step = (tangent - atan(tangent) - value) * (1.0 + tangent * tangent) / (tangent * tangent)
        tangent -= step
        if abs(step) <= 2e-16 * abs(tangent):
            break
    return atan(tangent)


def _tip_circle(gear: Gear, half_angle: float) -> tuple[float, float]:
    """Centre of the rack's tip rounding: distance from the middle of its tooth and depth below the pitch line [m]."""
    half_thickness = (half_angle - inv(gear.transverse_pressure_angle)) * gear.reference_radius
    half_tooth = 0.5 * pi * gear.transverse_module - half_thickness
    radius = gear.fillet_radius * gear.module
    depth = (gear.dedendum - gear.profile_shift) * gear.module - radius
    slope = tan(gear.transverse_pressure_angle)
    offset = half_tooth - depth * slope - radius / (cos(gear.pressure_angle) * cos(gear.helix_angle))
    return max(offset, 0.0), depth


def fillet(gear: Gear, half_angle: float, angle: float) -> tuple[float, float]:
    """Return a point of the root fillet that the rounded tip of the rack leaves, by the law of gearing.

    Source: Litvin & Fuentes 2004, Gear Geometry and Applied Theory, section 6.
    """
    across, up, shift = _cut(gear, half_angle, cos(angle), sin(angle))
    return hypot(across, up), pi / gear.teeth - (atan2(across, up) - shift / gear.reference_radius)


def _cut(gear: Gear, half_angle: float, cosine: Any, sine: Any) -> tuple[Any, Any, Any]:
    """Place of the fillet across and along the middle of its space, and how far the rack has moved there [m]."""
    offset, depth = _tip_circle(gear, half_angle)
    radius = gear.fillet_radius * gear.module
    along = offset + radius * cosine / cos(gear.helix_angle)
    deep = depth + radius * sine
    shift = deep * cosine * cos(gear.helix_angle) / sine - along
    return along + shift, gear.reference_radius - deep, shift


def form(gear: Gear, half_angle: float) -> tuple[float, float]:
    """Return where the involute begins above the root fillet.

    >>> from gears3d.gears import Gear
    >>> gear = Gear(3.5e-3, 90)
    >>> round(form(gear, gear.base_half_angle)[0], 4)
    0.2889
    """
    depth = (gear.dedendum - gear.profile_shift - gear.fillet_radius * (1.0 - sin(gear.pressure_angle))) * gear.module
    alpha = gear.transverse_pressure_angle
    roll = tan(alpha) - depth / (gear.base_radius * sin(alpha))
    return (roll, gear.pressure_angle) if roll >= 0.0 else _crossing(gear, half_angle)


def _crossing(gear: Gear, half_angle: float) -> tuple[float, float]:
    """Find where the fillet of an undercut tooth cuts into the involute, or passes the base circle if it does not."""

    def outside(angle: float) -> bool:
        radius, polar = fillet(gear, half_angle, angle)
        return radius > gear.base_radius and polar > half_angle - inv(acos(gear.base_radius / radius))

    low, high = gear.pressure_angle, 0.5 * pi
    for angle in np.linspace(low, high, 400):
        if not outside(float(angle)):
            high = float(angle)
            break
        low = float(angle)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if outside(middle) else (low, middle)
    radius = max(fillet(gear, half_angle, low)[0], gear.base_radius)
    return sqrt((radius / gear.base_radius) ** 2 - 1.0), low


def fillet_points(gear: Gear, half_angle: float, angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return fillet points as (distance from the axis [m], angle from the middle of the tooth [rad]), (n, 2)."""
    across, up, shift = _cut(gear, half_angle, np.cos(angles), np.sin(angles))
    polar = pi / gear.teeth - (np.arctan2(across, up) - shift / gear.reference_radius)
    return np.column_stack((np.hypot(across, up), polar))


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
    """Return root and tip relief of a gear as numbers."""
    row: list[float] = []
    for relief, end, outwards in ((gear.root_relief, lowest, -1.0), (gear.tip_relief, gear.tip_roll, 1.0)):
        if relief is None or relief.amount == 0.0:
            row += [outwards * inf, outwards, 0.0, 1.0]
        else:
            start = relief.start(gear, end, outwards)
            row += [start, end - start, relief.amount, 1.0 + SHAPES.index(relief.shape)]
    return row


def relief_bend(gear: Gear, lowest: float) -> float:
    """Return the curvature that parabolic relief adds to a flank, in parts of the involute's curvature."""
    row, most = relief_rows(gear, lowest), 0.0
    for start, reach, amount, power in (row[:4], row[4:]):
        if power == 2.0:
            most = max(most, 2.0 * amount / reach**2 / (gear.base_radius * min(start, start + reach)))
    return most


def relief_faults(gear: Gear) -> Iterator[Fault]:
    """Yield what is wrong with the reliefs of an otherwise sound gear."""
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
    yield from _tip_relief_faults(gear)


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


def _tip_relief_faults(gear: Gear) -> Iterator[Fault]:
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
        fillet_radius: tip radius of the basic rack, in modules.
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
        thickness_allowance: added to the normal tooth thickness at the reference cylinder [m], negative for backlash.

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
    thickness_allowance: float = 0.0

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
        """Radii of hub and rim between which the web is narrower than the face [m]; ``None`` for a full body."""
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
        """Half the angle that a tooth spans at the base circle [rad], with its allowance."""
        thickness = (
            pi / 2.0 + 2.0 * self.profile_shift * tan(self.pressure_angle) + self.thickness_allowance / self.module
        )
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
    for key, part in (("lead_crowning", 20), ("helix_slope", 20), ("thickness_allowance", 5)):
        value = getattr(gear, key)
        if gear.module > 0.0 and not abs(value) <= gear.module / part:
            most = 1e6 * gear.module / part
            yield Fault(key, f"is {value * 1e6:g} um", f"give -{most:g} to {most:g} um (1/{part} of the module)")
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
            f"is {gear.fillet_radius:g} modules, more than fits into the tip of the rack",
            f"give 0 to {max(widest, 0.0):.4g} modules",
        )
    yield from _body_faults(gear)


def _tip_faults(gear: Gear):
    if gear.tip_diameter is not None and gear.tip_shortening != 0.0:
        yield Fault(
            "tip_diameter", f"is {gear.tip_diameter * 1e3:g} mm in addition to a tip_shortening", "keep one of the two"
        )
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
