"""A scenario's pair for other multibody engines: URDF and MJCF with inertias, joints and convex hulls of the teeth.

Bodies, hulls and joints are those of :mod:`gears3d.engine`; lengths are in m. Each gear turns on a joint of the world,
positive in its own sense; with both angles at 0 the active flanks of tooth 1 touch in the pitch point.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from math import atan2, atanh, cos, exp, log, pi, sin, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
from numpy.typing import NDArray

from gears3d.effects import Code
from gears3d.effects.rows import Gate
from gears3d.errors import Fault, InputError, UsageError, did_you_mean
from gears3d.files import write_bytes
from gears3d.version import __version__

if TYPE_CHECKING:
    from gears3d.engine import Body
    from gears3d.gears import Pair
    from gears3d.scenario import Scenario

Array = NDArray[np.float64]
FORMATS = ("urdf", "mjcf")
# Duration of contacts of the MJCF [s], or a period of the fastest harmonic of the drive over that, where this is
# less. Hulls that come into mesh push the gears by their chord error over this duration: short contacts separate
# them, long ones let the teeth penetrate.
CONTACT, PERIODS = 1e-3, 300.0
# Time steps of the MJCF in a contact.
STEPS = 40.0
# Of the MJCF: less needs more damping than the steps resolve.
LEAST_RESTITUTION = 0.02
# Rotor inertia of the drive's joints in the MJCF over the loose gear's inertia: impacts do not change the motion.
_IMPOSED = 1e6
# Mass of a body that carries the teeth in the MJCF over that of their gear. MuJoCo scales the softness of a contact
# by the mobility of its body's centre of mass, which is 0 on a joint's axis: contacts are then so stiff that two of
# opposite normals give forces without bound. The centre is therefore off the axis, so that this mobility is that
# along the line of action.
_LIGHT = 1e-9
# Of the solids that mass and inertia are taken from [m].
_CHORD = 2e-6
_MM = 1e3
# Forms of effects that are in hulls and motion.
_HELD = (Code.FLANK_HARMONIC, Code.FLANK_TOOTH, Code.FLANK_ECCENTRIC, Code.MOTION_HARMONIC)


def write_multibody(scenario: Scenario, folder: Path, formats: Sequence[str], command: str = "") -> dict[str, Any]:
    """Write the pair as files for other engines, each under a temporary name that is renamed, and a sidecar.

    Args:
        scenario: whose gears, inertias, drag, restitution and motion the files have.
        folder: made if it is not there; files of the same names are replaced.
        formats: of ``"urdf"`` (``pair.urdf`` and the hulls ``drive-teeth.obj``, ``loose-teeth.obj`` in mm) and
            ``"mjcf"`` (``pair.xml``).
        command: that made them, for the sidecar.

    Returns:
        The sidecar, as it stands in ``pair.json``.

    Raises:
        UsageError: an unknown format.
        InputError: gears that the engine refuses, a motion that MJCF cannot hold, a folder that cannot be written.
    """
    for word in formats:
        if word not in FORMATS:
            raise UsageError(f"there is no format {word!r}; {did_you_mean(word, FORMATS)}")
    model = _model(scenario)
    contents: dict[str, tuple[str, bytes]] = {}
    if "urdf" in formats:
        contents |= {f"{body.name}-teeth.obj": ("mm", _hulls(body.body.pieces)) for body in model.gears}
        contents["pair.urdf"] = ("m", _urdf(model))
    if "mjcf" in formats:
        contents["pair.xml"] = ("m", _mjcf(model, scenario))
    files = {}
    for name, (unit, data) in contents.items():
        write_bytes(folder / name, data)
        files[name] = {"unit": unit, "bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    card = _card(model, scenario) | {"files": files, "command": command}
    write_bytes(folder / "pair.json", (json.dumps(card, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode())
    return card


class _Gear(NamedTuple):
    """A gear as a body: hulls and axis of the engine; mass [kg], its centre [m] and inertia [kg m²] about it."""

    name: str
    body: Body
    mass: float
    centre: Array
    inertia: Array
    root: float
    width: float


class _Model(NamedTuple):
    """Both gears; Coulomb torque [N m] and viscous drag [N m s] on the loose one; effects that are in no file."""

    pair: Pair
    gears: tuple[_Gear, _Gear]
    friction: float
    damping: float
    restitution: float
    missing: list[str]


def _model(scenario: Scenario) -> _Model:
    from gears3d.engine import bodies, prepared
    from gears3d.gears.solids import mass_of
    from gears3d.scenario import solid_inertia

    rig, rows = scenario.rig(), scenario.rows()
    pair, _, _ = prepared(scenario, None, rows)
    gears = []
    for name, spec, body in zip(
        ("drive", "loose"), (scenario.gears.drive, scenario.gears.loose), bodies(scenario, pair), strict=True
    ):
        found = mass_of(scenario.pair(), name, spec.density, _CHORD)
        moment = spec.inertia or solid_inertia(scenario.pair(), name, spec.density)
        turn = np.diag([cos(pair.rotation(name, 0.0))] * 2 + [1.0])  # by 0 or half a revolution
        relative = np.round(turn @ found.inertia @ turn / found.inertia[2, 2], 12) + 0.0  # + 0.0: no -0
        centre, gear = np.round(turn @ found.centre, 12) + 0.0, pair.gear(name)
        gears.append(_Gear(name, body, found.mass, centre, relative * moment, gear.root_radius, gear.face_width))
    friction, damping, missing = rig.drag_torque, 0.0, []
    for effect in scenario.effects:
        for row in effect.rows(rig):
            if row.code == Code.TORQUE_CONSTANT and row.gate == Gate.ALWAYS:
                friction += row.p[0]
            elif row.code == Code.TORQUE_LINEAR and row.gate == Gate.ALWAYS and row.p[1] == 0.0:
                damping += row.p[0]
            elif row.code not in _HELD and effect.kind not in missing:
                missing.append(effect.kind)
    return _Model(pair, (gears[0], gears[1]), friction, damping, scenario.impact.restitution, missing)


def _card(model: _Model, scenario: Scenario) -> dict[str, Any]:
    from gears3d.gears import piece_budget

    pieces = {gear.name: len(gear.body.pieces) for gear in model.gears}
    slices = pieces["drive"] // model.pair.drive.teeth
    return {
        "gears3d": __version__,
        "title": scenario.title,
        "pair": {"centre_distance_m": model.pair.centre_distance, "backlash_m": model.pair.backlash},
        "bodies": {
            gear.name: {"mass_kg": gear.mass, "centre_m": gear.centre.tolist(), "inertia_kg_m2": gear.inertia.tolist()}
            for gear in model.gears
        },
        "hulls": {**pieces, "gap_error_m": piece_budget(model.pair, slices=slices)["gap_error_m"]},
        "drag": {"coulomb_N_m": model.friction, "viscous_N_m_s": model.damping},
        "restitution": model.restitution,
        "effects_left_out": model.missing,
    }


def _hulls(pieces: Array) -> bytes:
    """Return an OBJ with one object a piece, facets outwards [mm]."""
    from scipy.spatial import ConvexHull

    text, first = [], 1
    for number, piece in enumerate(pieces, 1):
        hull = ConvexHull(piece)
        a, b, c = (piece[hull.simplices[:, corner]] for corner in range(3))
        inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0.0
        faces = np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices) + first
        text.append(f"o piece{number}\n")
        text.append("v %.9f %.9f %.9f\n" * len(piece) % tuple((piece * _MM).ravel()))
        text.append("f %d %d %d\n" * len(faces) % tuple(faces.ravel()))
        first += len(piece)
    return "".join(text).encode()


def _urdf(model: _Model) -> bytes:
    from scipy.spatial.transform import Rotation

    robot = Element("robot", name="pair")
    SubElement(robot, "link", name="world")
    for gear in model.gears:
        link = SubElement(robot, "link", name=gear.name)
        inertial = SubElement(link, "inertial")
        SubElement(inertial, "origin", xyz=_words(gear.centre))
        SubElement(inertial, "mass", value=_words([gear.mass]))
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = gear.inertia.tolist()
        named = {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz}
        SubElement(inertial, "inertia", {name: _words([value]) for name, value in named.items()})
        for kind in ("visual", "collision"):
            shape = SubElement(SubElement(link, kind), "geometry")
            SubElement(shape, "mesh", filename=f"{gear.name}-teeth.obj", scale=_words([1.0 / _MM] * 3))
        body = SubElement(SubElement(link, "visual"), "geometry")
        SubElement(body, "cylinder", radius=_words([gear.root]), length=_words([gear.width]))
        contact = SubElement(link, "contact")  # of Bullet, which multiplies both restitutions
        SubElement(contact, "restitution", value=_words([1.0 if gear.name == "drive" else model.restitution]))
        for kind in ("lateral_friction", "rolling_friction", "spinning_friction"):
            SubElement(contact, kind, value="0")
        joint = SubElement(robot, "joint", name=f"{gear.name}_axis", type="continuous")
        SubElement(joint, "parent", link="world")
        SubElement(joint, "child", link=gear.name)
        leaning = Rotation.from_quat(gear.body.orientation).as_euler("xyz")
        SubElement(joint, "origin", xyz=_words(gear.body.centre), rpy=_words(leaning))
        SubElement(joint, "axis", xyz=f"0 0 {gear.body.sense}")
        if gear.name == "loose":
            SubElement(joint, "dynamics", friction=_words([model.friction]), damping=_words([model.damping]))
    return _text(robot)


def _mjcf(model: _Model, scenario: Scenario) -> bytes:
    waves, moment = _waves(scenario), float(model.gears[1].inertia[2, 2])
    lasting = min([CONTACT, *(2.0 * pi / turning / PERIODS for _, turning, _ in waves)])
    ratio, natural = _damping_ratio(max(model.restitution, LEAST_RESTITUTION)), pi / lasting
    root = Element("mujoco", model="pair")
    SubElement(root, "compiler", angle="radian")
    SubElement(
        root,
        "option",
        timestep=f"{lasting / STEPS:.2g}",
        gravity="0 0 0",
        tolerance="0",
        ccd_tolerance="1e-9",
        ccd_iterations="200",
    )
    default = SubElement(root, "default")
    stiff = {"solimp": "0.9999 0.9999 0.001", "solref": _words([-(natural**2), -2.0 * ratio * natural])}
    SubElement(default, "geom", {"type": "mesh", "condim": "1", "mass": "0", "margin": "0", **stiff})
    SubElement(default, "joint", solimpfriction=stiff["solimp"], solreffriction=f"{2.0 * lasting / STEPS:.2g} 1")
    asset, world = SubElement(root, "asset"), SubElement(root, "worldbody")
    meeting = _meeting(model)
    for gear, meets in zip(model.gears, meeting, strict=True):
        x, y, z, w = gear.body.orientation
        body = SubElement(world, "body", name=gear.name, pos=_words(gear.body.centre), quat=_words([w, x, y, z]))
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = gear.inertia.tolist()
        full = _words([xx, yy, zz, xy, xz, yz])
        SubElement(body, "inertial", pos=_words(gear.centre), mass=_words([gear.mass]), fullinertia=full)
        axis = {"axis": f"0 0 {gear.body.sense}"}
        if gear.name == "loose":
            drag = {"frictionloss": _words([model.friction]), "damping": _words([model.damping])}
            SubElement(body, "joint", {"name": "loose", **axis, **drag})
        else:
            heavy = {**axis, "armature": _words([_IMPOSED * moment])}
            SubElement(body, "joint", {"name": "drive", **heavy})
            for place, (_, turning, _) in enumerate(waves, 1):
                spring = _words([_IMPOSED * moment * turning**2])
                SubElement(body, "joint", {"name": f"wave{place}", **heavy, "stiffness": spring})
        seen = {"type": "cylinder", "size": _words([gear.root, 0.5 * gear.width]), "contype": "0", "conaffinity": "0"}
        SubElement(body, "geom", {"name": f"{gear.name}_body", **seen})
        teeth = SubElement(body, "body", name=f"{gear.name}_teeth")
        arm, light = sqrt(3.0) * model.pair.gear(gear.name).base_radius, _LIGHT * gear.mass
        SubElement(
            teeth,
            "inertial",
            pos=_words([arm, 0.0, 0.0]),
            mass=_words([light]),
            diaginertia=_words([light * arm**2] * 3),
        )
        for place, piece in enumerate(gear.body.pieces):
            name = f"{gear.name}{place + 1}"
            SubElement(asset, "mesh", name=name, vertex=_words(piece.ravel()))
            SubElement(teeth, "geom", {"mesh": name, **meets[place % len(meets)]})
    SubElement(SubElement(root, "keyframe"), "key", {"name": "start", **_start(model, scenario, waves)})
    return _text(root)


def _meeting(model: _Model) -> tuple[list[dict[str, str]], list[dict[str, str]]]:
    """Return collision masks for the slices of a drive tooth and of a loose one, a bit for each slice of the drive's.

    Slices meet where their heights overlap. Those that only share a plane are kept apart: the normal of their contact
    is along the axes, and no joint moves along it.
    """
    ends = []
    for gear in model.gears:
        slices = len(gear.body.pieces) // model.pair.gear(gear.name).teeth
        ends.append([(piece[:, 2].min(), piece[:, 2].max()) for piece in gear.body.pieces[:slices]])
    least = 1e-6 * model.pair.drive.face_width
    masks = [
        sum(1 << bit for bit, (low, high) in enumerate(ends[0]) if min(high, upper) - max(low, lower) > least)
        for lower, upper in ends[1]
    ]
    drive = [{"contype": str(1 << bit), "conaffinity": "0"} for bit in range(len(ends[0]))]
    return drive, [{"contype": "0", "conaffinity": str(mask)} for mask in masks]


def _waves(scenario: Scenario) -> list[tuple[float, float, float]]:
    """Amplitude [rad/s], circular frequency [rad/s] and phase [rad] of the drive's fluctuation."""
    motion = scenario.motion
    if motion.record is not None:
        words = "is a measured motion; MJCF holds a mean speed and harmonics"
        file = "" if scenario.path is None else str(scenario.path)
        raise InputError(Fault("motion.record", words, "give --format urdf, or motion.mean and motion.harmonics", file))
    waves = [(each.amplitude, each.frequency, each.phase) for each in motion.harmonics]
    waves += [row.p[:3] for row in scenario.rows() if row.code == Code.MOTION_HARMONIC]
    return [(size, 2.0 * pi * frequency, phase) for size, frequency, phase in waves]


def _start(model: _Model, scenario: Scenario, waves: list[tuple[float, float, float]]) -> dict[str, str]:
    """Positions and speeds at time 0: joints of the drive, whose angles add up to 0, then the loose gear."""
    away = {"active": 0.0, "free": 0.5, "reverse": 1.0}[scenario.start.state] * model.pair.backlash
    swings = [-size / turning * cos(phase) for size, turning, phase in waves]
    speeds = [scenario.motion.mean, *(size * sin(phase) for size, _, phase in waves)]
    loose = sum(speeds) * model.pair.drive.base_radius / model.pair.loose.base_radius
    return {
        "qpos": _words([-sum(swings), *swings, away / model.pair.loose.base_radius]),
        "qvel": _words([*speeds, loose]),
    }


def _damping_ratio(restitution: float) -> float:
    """Return the damping ratio of a spring with a dashpot, which do not pull, that rebounds with a restitution.

    Source: Schwager & Pöschel 2007, Coefficient of restitution and linear-dashpot model revisited, Granular Matter 9.
    """
    from scipy.optimize import brentq

    def rebound(ratio: float) -> float:
        root = sqrt(abs(1.0 - ratio**2))
        if root < 1e-9:
            return exp(-2.0)
        phase = atan2(2.0 * ratio * root, 2.0 * ratio**2 - 1.0) if ratio < 1.0 else 2.0 * atanh(root / ratio)
        return exp(-ratio * phase / root)

    if restitution >= 1.0:
        return 0.0
    return float(brentq(lambda ratio: log(rebound(ratio)) - log(restitution), 1e-12, 50.0))  # type: ignore[arg-type]


def _words(values: Sequence[float] | Array) -> str:
    return " ".join(f"{value:.9g}" for value in values)


def _text(root: Element) -> bytes:
    indent(root)
    return b'<?xml version="1.0"?>\n' + tostring(root) + b"\n"
