"""A gear as a STEP file: B-spline surfaces through points of the flanks, made into a solid by Open CASCADE (OCP).

Root, fillets, flanks and tip of every tooth are a surface each, between edges that neighbours share. A surface
interpolates points of the gear in the parameter of its profile (roll angle, angle of the rack's normal, angle about the
axis) and in the height, by quintic splines with as many points as its deviation from the gear asks for.
"""

from __future__ import annotations

from io import BytesIO
from itertools import pairwise
from math import pi
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gears3d.errors import Fault, InputError
from gears3d.extras import require
from gears3d.gears.deviation import GEARS, HarmonicDeviation, index_of
from gears3d.gears.flank import ACTIVE, REVERSE, flank_points, relief_starts, roll_at_radius
from gears3d.gears.gear import fillet_points, form
from gears3d.gears.limits import refuse_crossed
from gears3d.gears.outline import LEAST_ROLL, fillet_measure, inner_radius
from gears3d.gears.pair import Pair
from gears3d.gears.solids import inside_contour
from gears3d.gears.surface import flank_leads, flanks_at, lead_turn
from gears3d.version import __version__

Array = NDArray[np.float64]

MM = 1e3  # mm per m; STEP files are in mm
# How near a surface comes to the gear [m], unless it takes more than :data:`MOST_POINTS` along its profile
CLOSE = 1e-9
MOST_POINTS = 161  # Of a profile, or of heights; the deviation that they leave is reported
_FIRST = 6  # Points of a profile to begin with
_DEGREE = 5
_SEWN = 1e-6  # Largest distance of edges that are made one [mm]
# Relative error to which the kernel integrates the volume; without one its fixed rule errs by up to 3e-6
_INTEGRATED = 1e-6


class _Kernel:
    """Open CASCADE, loaded name by name: a name begins with its module."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):  # asked for by what inspects modules
            raise AttributeError(name)
        module = "collections" if name.startswith("Array") else name.partition("_")[0]
        found = getattr(require(f"OCP.{module}", "a STEP file", "cad"), name)
        setattr(self, name, found)
        return found


occ = _Kernel()


class StepFile(NamedTuple):
    """A gear as a STEP file, and what the kernel and a comparison say about it."""

    data: bytes  # the file (AP214, mm)
    # largest distance of the B-spline flanks from the flanks, between the points that they interpolate [m]
    flank_deviation: float
    volume: float  # of the solid, as Open CASCADE integrates it [m³]
    faces: int  # of the solid


def step_file(pair: Pair, which: str) -> StepFile:
    """Return a gear as a STEP file in its own frame."""
    require_kernel()
    refuse_crossed(pair)
    surfaces, deviation = _fitted(_Teeth(pair, which))
    solid = _solid(pair.gear(which), surfaces)
    return StepFile(_encoded(solid, which), deviation, _volume(solid), _faces(solid))


def require_kernel() -> None:
    """Load Open CASCADE."""
    require("OCP", "a STEP file", "cad")


class _Surface(NamedTuple):
    """A tensor product B-spline: knots along the profile and the height, degrees, poles (n, m, 3) [m]."""

    knots: tuple[Array, Array]
    degrees: tuple[int, int]
    poles: Array


class _Teeth:
    """Points of one gear's teeth, patch by patch counter-clockwise from the root before the tooth."""

    def __init__(self, pair: Pair, which: str) -> None:
        self.pair, self.gear, self.number = pair, pair.gear(which), index_of(which, GEARS, "which")
        self.sense = 1 - 2 * self.number
        self.half = pair.half_angle(which)
        self.turn = lead_turn(self.gear, self.sense)
        self.leads = flank_leads(pair)[self.number]
        mine = [each for each in pair.deviations if each.gear == which]
        self.deviating = bool(mine)
        self.changing = self.turn != 0.0 and any(isinstance(each, HarmonicDeviation) for each in mine)
        self.straight = not (self.turn or self.leads.any() or self.gear.lead_crowning)
        self.middle_section = flanks_at(pair, 0.0)
        self.reliefs = relief_starts(self.middle_section, self.number)
        self.lowest, self.first = form(self.gear, self.half)
        self.measure = fillet_measure(self.gear, self.half, self.first)
        self.bottom = float(fillet_points(self.gear, self.half, np.array([0.5 * pi]))[0, 1])
        self.pitch = 2.0 * pi / self.gear.teeth
        self.middle = 0.5 * (self.middle_section.gears[self.number, 2] + self.middle_section.gears[self.number, 3])
        rooted = self.pitch - 2.0 * self.bottom > 2e-9
        flanks = ["flank"] * (len(self.reliefs) + 1)
        self.roles = ["root"] * rooted + ["fillet", *flanks, "tip", *flanks, "fillet"]

    def points(self, place: int, shares: dict[str, Array], heights: Array) -> list[Array]:
        """Return points of a tooth's patches."""
        sections = [self._section(place, shares, height) for height in heights]
        return [np.stack(patch, axis=1) for patch in zip(*sections, strict=True)]

    def _section(self, place: int, shares: dict[str, Array], height: float) -> list[Array]:
        tooth = (-self.sense * place) % self.gear.teeth + 1
        flanks = flanks_at(self.pair, height) if self.changing else self.middle_section
        at = self.middle + place * self.pitch
        polar = [self._flank(flanks, side, tooth, at, shares["flank"]) for side in (REVERSE, ACTIVE)]
        (low, low_start, low_end), (high, high_start, high_end) = polar
        fillets = [
            self._fillet(start * [1.0, sign], shares["fillet"]) * [1.0, sign]
            for start, sign in ((low_start, -1.0), (high_start, 1.0))
        ]
        tip, root, near = shares["tip"], shares["root"], self._nearness(shares["fillet"])
        across = low_end[1] + tip * (high_end[1] - low_end[1])
        gap = self.pitch - 2.0 * self.bottom
        patches = [
            (np.stack([np.full_like(root, self.gear.root_radius), -self.bottom - (1.0 - root) * gap], 1), 0.0, 0.0),
            (fillets[0][::-1], near[::-1], 0.0),
            *((part, 1.0, 0.0) for part in low),
            (np.stack([np.full_like(tip, self.gear.tip_radius), across], 1), 1.0 - tip, tip),
            *((part[::-1], 0.0, 1.0) for part in high[::-1]),
            (fillets[1], 0.0, near),
        ]
        lean = self.gear.lead_crowning / self.gear.base_radius * (2.0 * height / self.gear.face_width) ** 2
        leads = self.leads[:, tooth - 1] if self.leads.size else np.zeros(2)
        placed = []
        for points, reverse, active in patches[-len(self.roles) :]:
            turn = lean * (reverse - active) + height * (leads[REVERSE] * reverse + leads[ACTIVE] * active)
            angle = points[:, 1] + at + self.turn * height + turn
            x, y = points[:, 0] * np.cos(angle), points[:, 0] * np.sin(angle)
            placed.append(np.stack([x, y, np.full_like(x, height)], axis=1))
        return placed

    def _flank(self, flanks: Any, side: int, tooth: int, at: float, shares: Array) -> tuple[list[Array], Array, Array]:
        """Points (radius, angle from the middle of the tooth) of a flank's parts, of its start and of its end."""
        last = roll_at_radius(flanks, self.number, side, tooth, self.gear.tip_radius)
        breaks = [max(self.lowest, LEAST_ROLL), *self.reliefs, last]
        rolls = [start + shares * (end - start) for start, end in pairwise(breaks)]
        points = flank_points(flanks, self.number, side, tooth, np.concatenate([*rolls, breaks[:1], breaks[-1:]]))[0]
        angle = np.arctan2(points[:, 1], points[:, 0]) - at
        polar = np.stack([np.hypot(*points.T), angle - 2.0 * pi * np.round(angle / (2.0 * pi))], axis=1)
        return np.split(polar[:-2], len(rolls)), polar[-2], polar[-1]

    def _fillet(self, start: Array, shares: Array) -> Array:
        """Points of a fillet (radius, angle from the middle of the tooth), from the flank's to the root circle."""
        angles = self.first + shares * (0.5 * pi - self.first)
        curve = fillet_points(self.gear, self.half, np.append(self.first, angles))
        return curve[1:] + self._nearness(shares)[:, None] * (start - curve[0])

    def _nearness(self, shares: Array) -> Array:
        """How far points of a fillet go with its flank: 1 at the flank, 0 at the root, as in the polygon's."""
        angles, measure = self.measure
        return 1.0 - np.interp(self.first + shares * (0.5 * pi - self.first), angles, measure) / measure[-1]


def _fitted(teeth: _Teeth) -> tuple[list[_Surface], float]:
    """Fit all patches; return them and the largest deviation of a flank [m]."""
    counts = dict.fromkeys(("root", "fillet", "flank", "tip"), _FIRST)
    levels = 2 if teeth.straight else _FIRST
    places = range(teeth.gear.teeth if teeth.deviating else 1)
    while True:
        shares = {role: _spread(count) for role, count in counts.items()}
        half = 0.5 * teeth.gear.face_width
        heights = half * (2.0 * _spread(levels) - 1.0)
        between = {role: _between(each) for role, each in shares.items()}
        checked = _between(heights)
        surfaces, along, upward = [], dict.fromkeys(counts, 0.0), dict.fromkeys(counts, 0.0)
        for place in places:
            grids = teeth.points(place, shares, heights)
            made = [_interpolated(shares[role], heights, grid) for role, grid in zip(teeth.roles, grids, strict=True)]
            surfaces += made
            for off, us, vs in ((along, between, heights), (upward, shares, checked)):
                true = teeth.points(place, us, vs)
                for role, surface, points in zip(teeth.roles, made, true, strict=True):
                    off[role] = max(
                        off[role], float(np.max(np.linalg.norm(_at(surface, us[role], vs) - points, axis=2)))
                    )
        more = {role: 2 * n - 1 for role, n in counts.items() if along[role] > CLOSE and 2 * n - 1 <= MOST_POINTS}
        higher = max(upward.values()) > CLOSE and 2 * levels - 1 <= MOST_POINTS
        if not more and not higher:
            break
        counts |= more
        levels = 2 * levels - 1 if higher else levels
    if not teeth.deviating:
        surfaces = [_turned(each, place * teeth.pitch) for place in range(teeth.gear.teeth) for each in surfaces]
    return surfaces, max(along["flank"], upward["flank"])


def _spread(count: int) -> Array:
    """Return shares from 0 to 1 that are closer to each other at the ends, where a spline is least held."""
    even = np.linspace(0.0, 1.0, count)
    return even if count < _FIRST else 0.5 * even + 0.25 * (1.0 - np.cos(pi * even))


def _between(values: Array) -> Array:
    return 0.5 * (values[1:] + values[:-1])


def _interpolated(shares: Array, heights: Array, points: Array) -> _Surface:
    from scipy.interpolate import make_interp_spline

    first = make_interp_spline(shares, points, k=min(_DEGREE, len(shares) - 1))
    second = make_interp_spline(heights, np.swapaxes(first.c, 0, 1), k=min(_DEGREE, len(heights) - 1))
    return _Surface((first.t, second.t), (first.k, second.k), np.swapaxes(second.c, 0, 1))


def _at(surface: _Surface, shares: Array, heights: Array) -> Array:
    from scipy.interpolate import BSpline

    (u, v), (ku, kv) = surface.knots, surface.degrees
    along = BSpline(u, surface.poles, ku)(shares)
    return np.swapaxes(BSpline(v, np.swapaxes(along, 0, 1), kv)(heights), 0, 1)


def _turned(surface: _Surface, angle: float) -> _Surface:
    c, s = np.cos(angle), np.sin(angle)
    return surface._replace(poles=surface.poles @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))


def _solid(gear: Any, surfaces: list[_Surface]) -> Any:
    """Sew the teeth, both end faces and what lies inside them together."""
    sewing = occ.BRepBuilderAPI_Sewing(_SEWN)
    for each in surfaces:
        sewing.Add(occ.BRepBuilderAPI_MakeFace(_surface(each), _SEWN).Face())
    for end, side in ((0, -0.5), (-1, 0.5)):
        sewing.Add(_cap(gear, surfaces, end, side * gear.face_width * MM))
    half = 0.5 * gear.face_width
    for (r1, z1, _), (r2, z2, _) in pairwise(inside_contour(gear, np.array([[-half, 0.0, 0.0], [half, 0.0, 0.0]]))):
        if max(r1, r2) > 0.0:
            sewing.Add(_revolved((r1 * MM, z1 * MM), (r2 * MM, z2 * MM)))
    sewing.Perform()
    shell = sewing.SewedShape()
    if sewing.NbFreeEdges() or shell.ShapeType() != occ.TopAbs_SHELL:
        raise InputError(Fault("--format", "step: Open CASCADE makes no closed surface of this gear", "give stl"))
    solid = occ.BRepBuilderAPI_MakeSolid(occ.TopoDS.Shell(shell)).Solid()
    occ.BRepLib.OrientClosedSolid_s(solid)
    return solid


def _surface(fitted: _Surface) -> Any:
    n, m = fitted.poles.shape[:2]
    poles = occ.Array2_gp_Pnt(1, n, 1, m)
    for i in range(n):
        for j in range(m):
            poles.SetValue(i + 1, j + 1, occ.gp_Pnt(*(fitted.poles[i, j] * MM).tolist()))
    (u, mu), (v, mv) = (_knots(each) for each in fitted.knots)
    return occ.Geom_BSplineSurface(poles, u, v, mu, mv, *fitted.degrees)


def _knots(knots: Array) -> tuple[Any, Any]:
    values, counts = np.unique(knots, return_counts=True)
    places, multiplicities = occ.Array1_double(1, len(values)), occ.Array1_int(1, len(values))
    for i, (value, count) in enumerate(zip(values.tolist(), counts.tolist(), strict=True)):
        places.SetValue(i + 1, value)
        multiplicities.SetValue(i + 1, count)
    return places, multiplicities


def _cap(gear: Any, surfaces: list[_Surface], end: int, height: float) -> Any:
    """Return the end face inside the profiles at one end of the surfaces, round a hole where there is one [mm]."""
    wire = occ.BRepBuilderAPI_MakeWire()
    for each in surfaces:
        row = each.poles[:, end] * MM
        poles = occ.Array1_gp_Pnt(1, len(row))
        for i, point in enumerate(row.tolist()):
            poles.SetValue(i + 1, occ.gp_Pnt(*point))
        curve = occ.Geom_BSplineCurve(poles, *_knots(each.knots[0]), each.degrees[0])
        wire.Add(occ.BRepBuilderAPI_MakeEdge(curve).Edge())
    origin, upright = occ.gp_Pnt(0.0, 0.0, height), occ.gp_Dir(0.0, 0.0, 1.0)
    face = occ.BRepBuilderAPI_MakeFace(occ.gp_Pln(origin, upright), wire.Wire())
    if hole := inner_radius(gear) * MM:
        edge = occ.BRepBuilderAPI_MakeEdge(occ.gp_Circ(occ.gp_Ax2(origin, upright), hole)).Edge()
        face.Add(occ.TopoDS.Wire(occ.BRepBuilderAPI_MakeWire(edge).Wire().Reversed()))
    return face.Face()


def _revolved(start: tuple[float, float], end: tuple[float, float]) -> Any:
    """Return the face that a line turned about the axis makes; both ends as radius and height [mm]."""
    line = occ.BRepBuilderAPI_MakeEdge(occ.gp_Pnt(start[0], 0.0, start[1]), occ.gp_Pnt(end[0], 0.0, end[1])).Edge()
    axis = occ.gp_Ax1(occ.gp_Pnt(0.0, 0.0, 0.0), occ.gp_Dir(0.0, 0.0, 1.0))
    return occ.BRepPrimAPI_MakeRevol(line, axis).Shape()


def _volume(solid: Any) -> float:
    found = occ.GProp_GProps()
    occ.BRepGProp.VolumeProperties_s(solid, found, _INTEGRATED)
    return found.Mass() / MM**3


def _faces(solid: Any) -> int:
    explorer, count = occ.TopExp_Explorer(solid, occ.TopAbs_FACE), 0
    while explorer.More():
        count += 1
        explorer.Next()
    return count


def _encoded(solid: Any, which: str) -> bytes:
    occ.Message.DefaultMessenger_s().RemovePrinters(occ.Message_PrinterOStream.get_type_descriptor_s())
    writer = occ.STEPControl_Writer()
    occ.Interface_Static.SetIVal_s("write.surfacecurve.mode", 0)  # a setting that is there after the first writer
    writer.Transfer(solid, occ.STEPControl_AsIs)
    for number in range(1, writer.Model().NbEntities() + 1):
        entity = writer.Model().Value(number)
        if isinstance(entity, occ.StepBasic_Product):
            entity.SetName(occ.TCollection_HAsciiString(which))
            entity.SetId(occ.TCollection_HAsciiString(which))
    header = occ.APIHeaderSection_MakeHeader(writer.Model())
    header.SetName(occ.TCollection_HAsciiString(which))
    header.SetTimeStamp(occ.TCollection_HAsciiString(""))
    header.SetOriginatingSystem(occ.TCollection_HAsciiString(f"gears3d {__version__}"))
    written = BytesIO()
    writer.WriteStream(written)
    return written.getvalue()
