"""Format 1 as data: every section and key with its unit family, default and bounds."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, pi
from typing import Any

REQUIRED = object()
"""The default of a key that must be given."""


@dataclass(frozen=True)
class Key:
    """One key of the format.

    Args:
        family: its unit family, ``"choice"`` or ``"text"``.
        doc: what it is, for the JSON Schema.
        default: what it is when it is not given, as it would be written; ``None``: nothing.
        low: smallest value, SI.
        high: largest value, SI.
        above: whether ``low`` itself is refused.
        choices: the words allowed when ``family`` is ``"choice"``.
        also: further families that are allowed.
        why: why the bounds are there.
    """

    family: str
    doc: str
    default: Any = REQUIRED
    low: float = -inf
    high: float = inf
    above: bool = False
    choices: tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    why: str = ""


def _positive(family: str, doc: str, default: Any = REQUIRED, why: str = "") -> Key:
    return Key(family, doc, default, low=0.0, above=True, why=why)


REGIMES = ("contact", "single_sided", "double_sided")

COMMON = {
    "module": _positive("length", "normal module", None),
    "pressure_angle": Key("angle", "normal pressure angle", "20 deg", 5 * pi / 180, 45 * pi / 180),
    "helix_angle": Key("angle", "helix angle; the two gears have opposite hands", "0 deg", -pi / 3, pi / 3),
    "face_width": _positive("length", "face width; 10 modules when not given", None),
    "profile_shift": Key("ratio", "profile shift coefficient", 0, -2.0, 2.0),
    "addendum": Key("ratio", "addendum, in modules", 1, 0.1, 2.0),
    "dedendum": Key("ratio", "dedendum, in modules", 1.25, 0.1, 3.0),
    "fillet_radius": Key("ratio", "tip radius of the cutting rack, in modules", 0.25, 0.0, 1.0),
    "tip_shortening": Key("ratio", "how much lower the tip lies than the addendum puts it, in modules", 0, -0.5, 1.0),
    "tip_diameter": _positive("length", "diameter of the tip circle, in place of addendum and tip_shortening", None),
    "lead_crowning": Key("length", "taken off both ends of the face, by a parabola", "0 um"),
    "helix_slope": Key("length", "material added to the active flanks from the end at -z to that at +z", "0 um"),
    "bore": _positive("length", "diameter of the hole along the axis", None),
    "rim": _positive("length", "thickness of the rim below the root circle; needs web", None),
    "web": _positive("length", "thickness of the web between rim and hub; needs rim", None),
    "hub": _positive("length", "diameter of the hub, as wide as the face; none: the web goes down to the bore", None),
    "inertia": _positive(
        "inertia", "moment of inertia about the gear's axis; that of the solid when not given", None, "a body has mass"
    ),
    "density": _positive("density", "density of the solid", "7850 kg/m^3"),
}
TEETH = Key(
    "count",
    "number of teeth",
    low=5,
    high=1000,
    why="with fewer than 5 involute teeth a pair lets go before the next pair takes over",
)
GEAR = {"teeth": TEETH, **COMMON}
RELIEF = {
    "amount": Key("length", "taken off each flank at the end, along the involute's normal", low=0.0),
    "start_roll": Key("angle", "roll angle at which it starts", None, low=0.0),
    "start_diameter": _positive("length", "diameter at which it starts, in place of start_roll", None),
    "length": _positive("length", "length of roll from start to end, in place of start_roll", None),
    "shape": Key("choice", "over the roll angle", "linear", choices=("linear", "parabolic")),
}
RELIEFS = {
    "tip_relief": "material taken off the flanks towards the tip",
    "root_relief": "material taken off the flanks towards the root form circle",
}
"""Tables of RELIEF keys that a gear holds, or both gears in common."""
_FLANK = Key("choice", "which flanks have it", "both", choices=("both", "active", "reverse"))
_TILT = 0.02
_SMALL = "sections are taken across the ideal axes"
DEVIATIONS = {
    "profile_slope": {
        "amount": Key("length", "profile slope deviation f_Hα: material at the tip less that at the root"),
        "flank": _FLANK,
    },
    "profile_wave": {
        "amplitude": Key("length", "half the profile form deviation f_fα"),
        "waves": Key("ratio", "from the start of the active profile to the tip", low=0.0, high=100.0, above=True),
        "phase": Key("angle", "at the start of the active profile", "0 deg"),
        "flank": _FLANK,
    },
}
"""Tables of a gear, or of both in common, by name."""
MOUNTINGS = {
    "eccentricity": {
        "offset": Key("length", "of the teeth's axis from that of rotation", low=0.0),
        "phase": Key("angle", "direction of the offset when the gear's angle is 0, from the mate's axis", "0 deg"),
    },
    "wobble": {
        "angle": Key("angle", "between the teeth's axis and that of rotation", low=0.0, high=_TILT, why=_SMALL),
        "phase": Key("angle", "where the end at +z leans when the gear's angle is 0, from the mate's axis", "0 deg"),
    },
}
"""Tables of one gear, by name."""
MISALIGNMENT = {
    "in_plane": Key("angle", "the axes part towards +z, in their plane", "0 deg", -_TILT, _TILT, why=_SMALL),
    "out_of_plane": Key(
        "angle", "the loose axis leans along the drive's motion at the pitch point", "0 deg", -_TILT, _TILT, why=_SMALL
    ),
}
MOUNT = {
    "backlash": _positive(
        "length", "width of the dead band along the transverse line of action", None, "gears jammed: there is no gap"
    ),
    "centre_distance": _positive("length", "distance of the axes; with a backlash too, the teeth are thinned", None),
}
MOTION = {
    "mean": Key("speed", "mean rotational speed of the drive gear", None),
    "record": Key("text", "file with the measured motion of the drive, in place of mean and harmonics", None),
    "bandwidth": _positive("frequency", "up to where a recorded motion is smoothed", None),
}
HARMONIC = {
    "amplitude": Key("speed", "as a speed, an angle or an angular acceleration", also=("angle", "acceleration")),
    "frequency": _positive("frequency", "of the sine", None),
    "order": _positive("ratio", "cycles per mean revolution of the drive, in place of frequency", None),
    "phase": Key("angle", "of the sine at t = 0", "0 deg"),
}
DRAG = {"torque": Key("torque", "Coulomb torque on the loose gear", "0 N m", low=0.0, why="drag resists")}
IMPACT = {
    "restitution": Key("ratio", "Newton's coefficient", 0, 0.0, 1.0, why="an impact gives no energy"),
    "stick_velocity": Key("velocity", "below this rebound the contact is permanent", "0.1 mm/s", low=0.0),
}
START = {"state": Key("choice", "where the loose gear is at t = 0", "active", choices=("active", "reverse", "free"))}
RUN = {
    "duration": _positive("time", "simulated time, or 'N periods'", "20 periods"),
    "settle": Key("time", "left out of regime and comparison, or 'N periods'", "2 periods", low=0.0),
    "output_rate": _positive("frequency", "samples of the signals", "20 kHz"),
    "seed": Key("count", "of all random numbers", 0, low=0),
}
SENSOR = {
    "counts_per_revolution": Key("count", "edges, 4 x lines; none: exact", None, low=1),
    "noise": Key("angle", "standard deviation of the reading", "0 deg", low=0.0),
}
SENSORS = {"sample_rate": _positive("frequency", "of both encoders", "50 kHz"), **SENSOR}
LUBRICATED = {
    "damping_ratio": Key("ratio", "damping of the teeth, over the critical one", 0.1, 0.0, 2.0),
    "harmonics": Key("count", "of the mesh frequency that the stiffness of the teeth has", 8, low=0, high=100),
    "friction": Key(
        "choice", "mean over the lines of contact, of one place as published, or none", "lines",
        choices=("lines", "published", "none"),
    ),
    "average_friction": Key("ratio", "coefficient of friction far from the pitch point", 0.05, 0.0, 1.0),
    "regularisation": _positive("per_length", "how fast friction turns round at the pitch point", "50 1/mm"),
    "sheared_oil": Key("choice", "whether it rubs, where there is friction", "rubs", choices=("rubs", "slips")),
    "dead_zone": Key(
        "choice", "oil at every gap, or teeth in its place from published_gap on", "continuous",
        choices=("continuous", "published"),
    ),
    "published_gap": _positive("length", "where the published dead zone ends, along the normal", "5 um"),
    "ramp": Key("length", "depth over which damping comes in, along the normal; the smallest film when not given", None,
                low=0.0),
    "tolerance": Key("ratio", "relative, of a step", 1e-6, 1e-13, 1e-2),
}  # fmt: skip
EXPECT = {
    "regime": Key("choice", "regime after settling", None, choices=REGIMES),
    "impacts_per_period": Key("ratio", "mean number of impacts in a period of the excitation", None, low=0.0),
}
SECTIONS: dict[str, dict[str, Key]] = {
    "gears": COMMON,
    "mount": MOUNT,
    "motion": MOTION,
    "drag": DRAG,
    "impact": IMPACT,
    "start": START,
    "run": RUN,
    "lubricated": LUBRICATED,
    "sensors": SENSORS,
    "expect": EXPECT,
}
"""Sections that are tables of keys; gears, motion and sensors hold further tables of their own."""

TOP = {
    "title": Key("text", "one line for people", ""),
    "source": Key("text", "where the numbers are from", ""),
}
EXTRA = {
    "gears": ("drive", "loose", *RELIEFS, *DEVIATIONS),
    "mount": ("misalignment",),
    "motion": ("harmonics",),
    "sensors": ("drive", "loose"),
}
"""What the sections hold besides keys."""
