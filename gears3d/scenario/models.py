"""Format 1 as models: every section and key with its unit family, default and bounds; values are SI.

A key is written once, as a field: it reads what is in the file, it holds the SI value afterwards, and it makes the
JSON Schema and the key paths. In Python, fields take SI numbers as they are, and texts with a unit.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass as plain_dataclass
from dataclasses import field, fields, replace
from functools import cache, cached_property, lru_cache
from math import inf, pi
from pathlib import Path
from typing import Any

from pydantic import ConfigDict, ValidationInfo, field_validator
from pydantic.dataclasses import dataclass
from pydantic_core import PydanticCustomError

from gears3d.effects import Code, Flank, Rig, Row
from gears3d.effects import Gear as GearCode
from gears3d.errors import Fault, InputError, did_you_mean
from gears3d.gears import Eccentricity, Gear, HarmonicDeviation, Misalignment, Pair, Relief, ToothDeviation
from gears3d.gears.deviation import Deviation, Mounting
from gears3d.units import parse, parse_any, show

REQUIRED = object()  # default of a key that must be given
_TILT = 0.02  # rad; sections are taken across the ideal axes, which is wrong by half the square of a tilt
_SMALL = "sections are taken across the ideal axes"
REGIMES = ("contact", "single_sided", "double_sided")
# Tables that a gear holds, or both gears in common, by name
RELIEFS = {
    "tip_relief": "material taken off the flanks towards the tip",
    "root_relief": "material taken off the flanks towards the root form circle",
}


@plain_dataclass(frozen=True)
class Key:
    """One key of the format."""

    family: str  # unit family, "choice" or "text"
    doc: str  # for the JSON Schema
    default: Any = REQUIRED  # as it would be written; None: nothing
    low: float = -inf  # smallest value, SI
    high: float = inf  # largest value, SI
    above: bool = False  # whether ``low`` itself is refused
    choices: tuple[str, ...] = ()  # the words allowed when ``family`` is "choice"
    also: tuple[str, ...] = ()  # further families that are allowed
    why: str = ""  # why the bounds are there

    def value(self, written: Any) -> tuple[Any, str]:
        """Return the SI value of what is written, and its family; an ``InputError`` has one fault without key."""
        if self.family == "text":
            if isinstance(written, str):
                return str(written), "text"
            raise InputError(Fault("", f"{written!r} is not a text", "put it in quotes"))
        if self.family == "choice":
            if isinstance(written, str) and written in self.choices:
                return str(written), "choice"
            raise InputError(Fault("", f"{written!r} is not allowed", did_you_mean(str(written), self.choices)))
        if self.also:
            value, family = parse_any(written, (self.family, *self.also))
        else:
            value, family = parse(written, self.family), self.family
        (self if family == self.family else replace(self, family=family)).check_bounds(written, value)
        return (int(value) if family == "count" else value), family

    def check_bounds(self, written: Any, value: float) -> None:
        """Raise an ``InputError`` with one fault when an SI value is out of bounds; the message has it as written."""
        low = value <= self.low if self.above else value < self.low
        if not low and value <= self.high:
            return
        least = f"{'more than' if self.above else 'at least'} {show(self.low, self.family)}"
        if self.low == -inf:
            allowed = f"at most {show(self.high, self.family)}"
        else:
            allowed = least if self.high == inf else f"{least} and at most {show(self.high, self.family)}"
        shown = repr(str(written)) if isinstance(written, str) else f"{written}"
        raise InputError(Fault("", f"is {shown}; must be {allowed}", self.why))


def key(family: str, doc: str, default: Any = REQUIRED, low: float = -inf, high: float = inf, **more: Any) -> Any:
    """Return the field of one key of the format."""
    return field_of(Key(family, doc, default, low, high, **more))


def field_of(own: Key) -> Any:
    """Return the field of a key."""
    return field(metadata={"key": own}, **({} if own.default is REQUIRED else {"default": own.default}))


def _positive(family: str, doc: str, default: Any = REQUIRED, why: str = "") -> Any:
    return key(family, doc, default, low=0.0, above=True, why=why)


def _choice(doc: str, default: str | None, *choices: str) -> Any:
    return key("choice", doc, default, choices=choices)


CONFIG = ConfigDict(extra="forbid", validate_default=True, arbitrary_types_allowed=True)


@dataclass(frozen=True, config=CONFIG)
class Table:
    """A table of the format; its validator turns what is written into SI values."""

    @field_validator("*", mode="plain")
    @classmethod
    def _si(cls, value: Any, info: ValidationInfo) -> Any:
        own, name = keys_of(cls).get(info.field_name or ""), info.field_name or ""
        if own is None or value is None:
            return value
        try:
            if info.context is not None:
                return info.context.value(own, value, name)
            if isinstance(value, str) and own.family not in ("text", "choice"):
                return replace(own, also=()).value(value)[0]  # another family needs the rest of its table
            return value
        except InputError as error:
            fault = error.faults[0]
            told = {"message": fault.message, "remedy": fault.remedy, "key": fault.key}
            raise PydanticCustomError("fault", "{message} ({remedy})", told) from error


@cache
def keys_of(table: type) -> dict[str, Key]:
    """Return the keys of a table by name."""
    return {each.name: each.metadata["key"] for each in fields(table) if "key" in each.metadata}


@dataclass(frozen=True, kw_only=True, config=CONFIG)
class GearCommon(Table):
    """What both gears may have in common."""

    module: float = _positive("length", "normal module", None)
    pressure_angle: float = key("angle", "normal pressure angle", "20 deg", 5 * pi / 180, 45 * pi / 180)
    helix_angle: float = key("angle", "helix angle; the two gears have opposite hands", "0 deg", -pi / 3, pi / 3)
    face_width: float = _positive("length", "face width; 10 modules when not given", None)
    profile_shift: float = key("ratio", "profile shift coefficient", 0, -2.0, 2.0)
    addendum: float = key("ratio", "addendum, in modules", 1, 0.1, 2.0)
    dedendum: float = key("ratio", "dedendum, in modules", 1.25, 0.1, 3.0)
    fillet_radius: float = key("ratio", "tip radius of the basic rack, in modules", 0.25, 0.0, 1.0)
    tip_shortening: float = key(
        "ratio", "how much lower the tip lies than the addendum puts it, in modules", 0, -0.5, 1.0
    )
    tip_diameter: float | None = _positive(
        "length", "diameter of the tip circle, in place of addendum and tip_shortening", None
    )
    lead_crowning: float = key("length", "taken off both ends of the face, by a parabola", "0 um")
    helix_slope: float = key("length", "material added to the active flanks from the end at -z to that at +z", "0 um")
    thickness_allowance: float = key(
        "length", "added to the normal tooth thickness at the reference circle, negative for backlash (A_sn)", "0 um"
    )
    bore: float | None = _positive("length", "diameter of the hole along the axis", None)
    rim: float | None = _positive("length", "thickness of the rim below the root circle; needs web", None)
    web: float | None = _positive("length", "thickness of the web between rim and hub; needs rim", None)
    hub: float | None = _positive(
        "length", "diameter of the hub, as wide as the face; none: the web goes down to the bore", None
    )
    inertia: float | None = _positive(
        "inertia", "moment of inertia about the gear's axis; that of the solid when not given", None, "a body has mass"
    )
    density: float = _positive("density", "density of the solid", "7850 kg/m^3")


@dataclass(frozen=True, kw_only=True, config=CONFIG)
class GearSpec(GearCommon):
    """One gear; the loose gear's inertia is that of its solid when not given, the drive's ``None`` then."""

    teeth: int = key(
        "count",
        "number of teeth",
        low=5,
        high=1000,
        why="with fewer than 5 involute teeth a pair lets go before the next pair takes over",
    )
    tip_relief: Relief | None = None
    root_relief: Relief | None = None
    deviations: tuple[Deviation, ...] = ()
    mounting: tuple[Mounting, ...] = ()

    def gear(self) -> Gear:
        """Return its geometry."""
        return self._gear

    @cached_property
    def _gear(self) -> Gear:
        return Gear(**{part.name: getattr(self, part.name) for part in fields(Gear)})


@dataclass(frozen=True, config=CONFIG)
class ReliefTable(Table):
    """Relief of tip or root as written; one of three keys says where it starts."""

    amount: float = key("length", "taken off each flank at the end, along the involute's normal", low=0.0)
    start_roll: float | None = key("angle", "roll angle at which it starts", None, low=0.0)
    start_diameter: float | None = _positive("length", "diameter at which it starts, in place of start_roll", None)
    length: float | None = _positive("length", "length of roll from start to end, in place of start_roll", None)
    shape: str = _choice("over the roll angle", "linear", "linear", "parabolic")


@dataclass(frozen=True, config=CONFIG)
class ProfileSlopeTable(Table):
    """Profile slope of a gear's flanks as written."""

    amount: float = key("length", "profile slope deviation f_Hα: material at the tip less that at the root")
    flank: str = _choice("which flanks have it", "both", "both", "active", "reverse")


@dataclass(frozen=True, config=CONFIG)
class ProfileWaveTable(Table):
    """Wave of a gear's profiles as written."""

    amplitude: float = key("length", "half the profile form deviation f_fα")
    waves: float = key("ratio", "from the start of the active profile to the tip", low=0.0, high=100.0, above=True)
    phase: float = key("angle", "at the start of the active profile", "0 deg")
    flank: str = _choice("which flanks have it", "both", "both", "active", "reverse")


@dataclass(frozen=True, config=CONFIG)
class EccentricityTable(Table):
    """Eccentric teeth of one gear as written."""

    offset: float = key("length", "of the teeth's axis from that of rotation", low=0.0)
    phase: float = key("angle", "direction of the offset when the gear's angle is 0, from the mate's axis", "0 deg")


@dataclass(frozen=True, config=CONFIG)
class WobbleTable(Table):
    """Wobbling teeth of one gear as written."""

    angle: float = key("angle", "between the teeth's axis and that of rotation", low=0.0, high=_TILT, why=_SMALL)
    phase: float = key("angle", "where the end at +z leans when the gear's angle is 0, from the mate's axis", "0 deg")


@dataclass(frozen=True, config=CONFIG)
class MisalignmentTable(Table):
    """Misaligned axes as written."""

    in_plane: float = key("angle", "the axes part towards +z, in their plane", "0 deg", -_TILT, _TILT, why=_SMALL)
    out_of_plane: float = key(
        "angle", "the loose axis leans along the drive's motion at the pitch point", "0 deg", -_TILT, _TILT, why=_SMALL
    )


DEVIATIONS: dict[str, type] = {"profile_slope": ProfileSlopeTable, "profile_wave": ProfileWaveTable}
MOUNTINGS: dict[str, type] = {"eccentricity": EccentricityTable, "wobble": WobbleTable}  # of one gear


@plain_dataclass(frozen=True)
class Gears:
    """Both gears."""

    drive: GearSpec
    loose: GearSpec


@dataclass(frozen=True, config=CONFIG)
class Mount(Table):
    """How the gears are mounted; at least one of backlash and centre distance is given; ``None``: axes are parallel."""

    backlash: float | None = _positive(
        "length", "width of the dead band along the transverse line of action", None, "gears jammed: there is no gap"
    )
    centre_distance: float | None = _positive(
        "length", "distance of the axes; with a backlash too, the teeth are thinned", None
    )
    misalignment: Misalignment | None = None


@dataclass(frozen=True, config=CONFIG)
class Harmonic(Table):
    """One sine of the drive's speed: amplitude·sin(2π·frequency·t + phase), in rad/s, Hz and rad.

    ``order`` is in cycles per mean revolution of the drive where the frequency was given so.
    """

    amplitude: float = key("speed", "as a speed, an angle or an angular acceleration", also=("angle", "acceleration"))
    frequency: float = _positive("frequency", "of the sine", None)
    phase: float = key("angle", "of the sine at t = 0", "0 deg")
    order: float | None = _positive("ratio", "cycles per mean revolution of the drive, in place of frequency", None)


@dataclass(frozen=True, config=CONFIG)
class Motion(Table):
    """The imposed motion of the drive gear: mean speed [rad/s] and harmonics, or a record that replaces both."""

    mean: float = key("speed", "mean rotational speed of the drive gear", None)
    harmonics: tuple[Harmonic, ...] = ()
    record: Path | None = key(
        "text", "file with the measured motion of the drive, in place of mean and harmonics", None
    )
    bandwidth: float | None = _positive("frequency", "up to where a recorded motion is smoothed", None)

    @property
    def period(self) -> float | None:
        """Period of the first harmonic, else of one drive revolution [s]; ``None`` when nothing turns."""
        if self.harmonics:
            return 1 / self.harmonics[0].frequency
        return 2 * pi / abs(self.mean) if self.mean else None


@dataclass(frozen=True, config=CONFIG)
class Drag(Table):
    """Base drag on the loose gear, N·m."""

    torque: float = key("torque", "Coulomb torque on the loose gear", "0 N m", low=0.0, why="drag resists")


@dataclass(frozen=True, config=CONFIG)
class Impact(Table):
    """Base impact law; below the stick velocity [m/s] of its rebound a contact lasts."""

    restitution: float = key("ratio", "Newton's coefficient", 0, 0.0, 1.0, why="an impact gives no energy")
    stick_velocity: float = key("velocity", "below this rebound the contact is permanent", "0.1 mm/s", low=0.0)


@dataclass(frozen=True, config=CONFIG)
class Start(Table):
    """Where the loose gear is at t = 0: on a flank, or free in the middle of the gap."""

    state: str = _choice("where the loose gear is at t = 0", "active", "active", "reverse", "free")


@dataclass(frozen=True, config=CONFIG)
class Run(Table):
    """What is simulated and recorded; times in s, rate in Hz."""

    duration: float = _positive("time", "simulated time, or 'N periods'", "20 periods")
    settle: float = key("time", "left out of regime and comparison, or 'N periods'", "2 periods", low=0.0)
    output_rate: float = _positive("frequency", "samples of the signals", "20 kHz")
    seed: int = key("count", "of all random numbers", 0, low=0)


@dataclass(frozen=True, config=CONFIG)
class Sensor(Table):
    """One encoder; ``None`` counts: it is exact. The noise is in rad."""

    counts_per_revolution: int | None = key("count", "edges, 4 x lines; none: exact", None, low=1)
    noise: float = key("angle", "standard deviation of the reading", "0 deg", low=0.0)


@dataclass(frozen=True, config=CONFIG)
class Sensors(Table):
    """Both encoders and their sample rate, Hz; ``stated``: whether it was given, and is not the default."""

    sample_rate: float = _positive("frequency", "of both encoders", "50 kHz")
    drive: Sensor = field(default_factory=Sensor)
    loose: Sensor = field(default_factory=Sensor)
    stated: bool = True


@dataclass(frozen=True, config=CONFIG)
class Lubricated(Table):
    """How the teeth of the lubricated model close and rub; other models do not read it.

    Source: the lubricated dual-clutch transmission, eqs (6) to (8) and (27) to (31): ξ = 0.1, Φ = 50 per mm.
    """

    damping_ratio: float = key("ratio", "damping of the teeth, over the critical one", 0.1, 0.0, 2.0)
    harmonics: int = key("count", "of the mesh frequency that the stiffness of the teeth has", 8, low=0, high=100)
    friction: str = _choice(
        "mean over the lines of contact, of one place as published, or none", "lines", "lines", "published", "none"
    )
    average_friction: float = key("ratio", "coefficient of friction far from the pitch point", 0.05, 0.0, 1.0)
    regularisation: float = _positive("per_length", "how fast friction turns round at the pitch point", "50 1/mm")
    sheared_oil: str = _choice("whether it rubs, where there is friction", "rubs", "rubs", "slips")
    dead_zone: str = _choice(
        "oil at every gap, or teeth in its place from published_gap on", "continuous", "continuous", "published"
    )
    published_gap: float = _positive("length", "where the published dead zone ends, along the normal", "5 um")
    ramp: float | None = key(  # without it the force jumps where the teeth touch, and the rattle index has no limit
        "length",
        "depth over which damping comes in, along the normal; the smallest film when not given",
        None,
        low=0.0,
    )
    tolerance: float = key("ratio", "relative, of a step", 1e-6, 1e-13, 1e-2)


@dataclass(frozen=True, config=CONFIG)
class Expect(Table):
    """What must come out of a run."""

    regime: str | None = _choice("regime after settling", None, *REGIMES)
    impacts_per_period: float | None = key(
        "ratio", "mean number of impacts in a period of the excitation", None, low=0.0
    )


@dataclass(frozen=True, config=CONFIG)
class Heading(Table):
    """Keys above all sections."""

    title: str = key("text", "one line for people", "")
    source: str = key("text", "where the numbers are from", "")


@dataclass(frozen=True, kw_only=True, config=CONFIG)
class SensorsTable(Sensor):
    """The section of the sensors as written: what is given once serves both."""

    sample_rate: float = _positive("frequency", "of both encoders", "50 kHz")


# Sections by name, and what they hold in addition to keys
SECTIONS: dict[str, type] = {
    "gears": GearCommon,
    "mount": Mount,
    "motion": Motion,
    "drag": Drag,
    "impact": Impact,
    "start": Start,
    "run": Run,
    "lubricated": Lubricated,
    "sensors": SensorsTable,
    "expect": Expect,
}
INNER = {
    "gears": ("drive", "loose", *RELIEFS, *DEVIATIONS),
    "mount": ("misalignment",),
    "motion": ("harmonics",),
    "sensors": ("drive", "loose"),
}


@plain_dataclass(frozen=True, repr=False)
class Setup:
    """Everything that is simulated, SI, with the effects that extend the base model, in order."""

    title: str
    source: str
    gears: Gears
    mount: Mount
    motion: Motion
    drag: Drag
    impact: Impact
    start: Start
    run: Run
    sensors: Sensors
    lubricated: Lubricated
    effects: tuple[Any, ...] = ()

    @property
    def period(self) -> float:
        """Period of the first harmonic, else of one drive revolution [s]; the duration when nothing turns."""
        return self.motion.period or self.run.duration

    def pair(self) -> Pair:
        """Return the meshing pair as it is mounted, with the deviations of its profiles; without those of effects."""
        return self._pair

    @cached_property
    def _pair(self) -> Pair:
        return mesh(self.gears, self.mount)

    def rig(self) -> Rig:
        """Return the base model's constants."""
        pair = self.pair()
        assert self.gears.loose.inertia is not None
        return Rig(
            base_radius_drive=pair.drive.base_radius,
            base_radius_loose=pair.loose.base_radius,
            inertia=self.gears.loose.inertia,
            drag_torque=self.drag.torque,
            backlash=pair.backlash,
            restitution=self.impact.restitution,
            mean_speed=self.motion.mean,
            teeth_drive=self.gears.drive.teeth,
            teeth_loose=self.gears.loose.teeth,
            working_pressure_angle=pair.working_pressure_angle,
            base_helix_angle=abs(pair.drive.base_helix_angle),
            face_width=min(self.gears.drive.face_width, self.gears.loose.face_width),
            contact_ratio=pair.contact_ratio,
        )

    def rows(self) -> tuple[Row, ...]:
        """Return the normal forms of all effects; base drag and restitution are not among them."""
        rig = self.rig()
        return tuple(row for effect in self.effects for row in effect.rows(rig))


def mesh(gears: Gears, mount: Mount) -> Pair:
    """Return the pair of two gears, mounted, with deviations; both distance and backlash given, teeth are thinned."""
    drive, loose = gears.drive, gears.loose
    pair = _at_distance(drive.gear(), loose.gear(), mount.centre_distance, mount.backlash)
    if drive.deviations or loose.deviations:
        pair = pair.with_deviations(*drive.deviations, *loose.deviations)
    tilted = () if mount.misalignment is None else (mount.misalignment,)
    mounting = (*drive.mounting, *loose.mounting, *tilted)
    return pair.with_mounting(*mounting) if mounting else pair


@lru_cache(maxsize=64)
def _at_distance(drive: Gear, loose: Gear, centre_distance: float | None, backlash: float | None) -> Pair:
    """Return the pair at its centre distance; one that was asked for before has its checks behind it."""
    if centre_distance is None:
        assert backlash is not None
        return Pair.from_backlash(drive, loose, backlash)
    if backlash is None:
        return Pair.from_centre_distance(drive, loose, centre_distance)
    return Pair.from_both(drive, loose, centre_distance, backlash)


def solid_inertia(pair: Pair, which: str, density: float) -> float:
    """Return the moment of inertia of a gear's solid about its axis [kg·m²].

    It is the polar moment of the transverse section, bore and pockets of the web taken off, times density and face
    width; slices that are turned against each other, as by a helix, have the same.

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.
        density: kg/m³.
    """
    import numpy as np

    from gears3d.gears.outline import outline

    gear = pair.gear(which)
    x, y = outline(pair, which, chord=0.05e-6, root_chord=0.05e-6).points.reshape(-1, 2).T
    x_next, y_next = np.roll(x, -1), np.roll(y, -1)
    squares = x * x + x * x_next + x_next * x_next + y * y + y * y_next + y_next * y_next
    section = float(np.sum((x * y_next - x_next * y) * squares)) / 12
    hole = pi / 2 * (0.5 * (gear.bore or 0.0)) ** 4
    moment = gear.face_width * (section - hole)
    if gear.pocket and gear.web is not None:
        hub, rim = gear.pocket
        moment -= (gear.face_width - gear.web) * pi / 2 * (rim**4 - hub**4)
    return density * moment


def flank_deviations(rows: Iterable[Row]) -> list[HarmonicDeviation | ToothDeviation]:
    """Return the flank rows of a scenario as deviations of the gears' surfaces.

    Args:
        rows: of all effects; those of other forms are ignored.

    >>> from gears3d.effects.rows import flank_tooth
    >>> flank_deviations((flank_tooth(GearCode.LOOSE, Flank.ACTIVE, 3, 1e-5),))
    [ToothDeviation(gear='loose', flank='active', tooth=3, offset=1e-05)]
    """
    found: list[HarmonicDeviation | ToothDeviation] = []
    for row in rows:
        if row.code not in (Code.FLANK_HARMONIC, Code.FLANK_TOOTH):
            continue
        gear: Any = GearCode(int(row.p[0])).name.lower()
        flank: Any = Flank(int(row.p[1])).name.lower()
        if row.code == Code.FLANK_HARMONIC:
            found.append(HarmonicDeviation(gear, flank, int(row.p[2]), row.p[3], row.p[4]))
        else:
            found.append(ToothDeviation(gear, flank, int(row.p[2]), row.p[3]))
    return found


def eccentricities(rows: Iterable[Row]) -> list[Eccentricity]:
    """Return the eccentric teeth of a scenario as mountings of its gears.

    Args:
        rows: of all effects; those of other forms are ignored.

    >>> from gears3d.effects.rows import flank_eccentric
    >>> eccentricities((flank_eccentric(GearCode.LOOSE, 2e-5, 0.5),))
    [Eccentricity(gear='loose', offset=2e-05, phase=0.5)]
    """
    found = []
    for row in rows:
        if row.code == Code.FLANK_ECCENTRIC:
            gear: Any = GearCode(int(row.p[0])).name.lower()
            found.append(Eccentricity(gear, row.p[1], row.p[2]))
    return found
