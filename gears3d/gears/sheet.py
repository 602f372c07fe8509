"""Data sheet of a pair in the terms of ISO 21771."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import cos, hypot, pi, sin, sqrt, tan

import numpy as np

from gears3d.gears.deviation import FLANKS, GEARS, Eccentricity, HelixSlope, Misalignment, ProfileSlope, Wobble
from gears3d.gears.flank import compile_pair, relieved, steepness
from gears3d.gears.gear import Gear, form, inv, inverse_inv
from gears3d.gears.limits import clearance, mounted_band, tip_land
from gears3d.gears.pair import Pair

# Group, name, symbol, unit family, values and source of a line of a data sheet
Line = tuple[str, str, str, str, tuple[float | None, ...], str]
WITHIN = 1e-6  # How far apart flanks may stand without load to count as touching [m]


def flank_lines(pair: Pair) -> Iterator[Line]:
    """Yield what is taken off the flanks on purpose, how they deviate and how they are mounted.

    Source: ISO 21771:2007, flank modifications; ISO 1328-1:2013, flank deviations; ISO/TR 10064-3:1996, axes.
    """
    yield from _modifications(pair)
    yield from _deviations(pair)
    yield from _mounting(pair)


def touching_ratio(pair: Pair, within: float = WITHIN) -> float:
    """Return the transverse contact ratio of the stretch of the path where reliefs leave the flanks almost in contact.

    >>> from gears3d.gears import Gear, Pair, Relief
    >>> gear = Gear(3.5e-3, 90, tip_relief=Relief(20e-6, length=4e-3))
    >>> pair = Pair.from_backlash(gear, gear, 250e-6)
    >>> round(pair.contact_ratio, 3), round(touching_ratio(pair), 3)
    (1.738, 1.002)
    """
    flanks, drive, loose = compile_pair(pair), pair.drive, pair.loose
    start = pair.path_length - loose.base_radius * loose.tip_roll
    places = np.linspace(start, drive.base_radius * drive.tip_roll, 20001)
    apart = np.array(
        [
            relieved(flanks, 0, place / drive.base_radius)[0]
            + relieved(flanks, 1, (pair.path_length - place) / loose.base_radius)[0]
            for place in places
        ]
    )
    return float(np.mean(apart <= within)) * pair.contact_ratio


def _modifications(pair: Pair) -> Iterator[Line]:
    group, gears = "flank modifications", (pair.drive, pair.loose)

    def lines(name: str, symbol: str, value: Callable[[str, Gear], float | None], source: str) -> Iterator[Line]:
        values = tuple(value(which, gear) for which, gear in zip(GEARS, gears, strict=True))
        if any(values):
            yield group, name, symbol, "length", values, source

    yield from lines("tip relief", "C_αa", lambda _, gear: _amount(gear, "tip_relief"), "ISO 21771:2007")
    yield from lines(
        "diameter at the start of the tip relief", "d_Ca", lambda which, gear: _start(pair, which, "tip_relief"), ""
    )
    yield from lines("root relief", "C_αf", lambda _, gear: _amount(gear, "root_relief"), "ISO 21771:2007")
    yield from lines(
        "diameter at the start of the root relief", "d_Cf", lambda which, gear: _start(pair, which, "root_relief"), ""
    )
    if any(gear.tip_relief or gear.root_relief for gear in gears):
        name = "transverse contact ratio within 1 um without load"
        yield group, name, "ε_α,1", "ratio", (touching_ratio(pair),), "relief counted; (90) does not"
    yield from lines("lead crowning", "C_β", lambda _, gear: gear.lead_crowning or None, "ISO 21771:2007")


def _amount(gear: Gear, key: str) -> float | None:
    relief = getattr(gear, key)
    return relief.amount if relief is not None else None


def _start(pair: Pair, which: str, key: str) -> float | None:
    gear, relief = pair.gear(which), getattr(pair.gear(which), key)
    if relief is None:
        return None
    lowest = form(gear, pair.half_angle(which))[0]
    inwards = 1.0 if key == "tip_relief" else -1.0
    return 2.0 * gear.base_radius * hypot(1.0, relief.start(gear, gear.tip_roll if inwards > 0 else lowest, inwards))


def _deviations(pair: Pair) -> Iterator[Line]:
    """Largest of all teeth where single ones deviate."""
    group, flanks = "flank deviations", compile_pair(pair)
    helix = np.zeros((2, 2, max(pair.drive.teeth, pair.loose.teeth)))
    for gear, which in enumerate(GEARS):
        helix[gear] += pair.gear(which).helix_slope * np.array([[1.0], [-1.0]])
    slope = np.zeros_like(helix)
    for each in pair.deviations:
        if isinstance(each, HelixSlope | ProfileSlope):
            table = helix if isinstance(each, HelixSlope) else slope
            teeth = slice(None) if each.tooth is None else each.tooth - 1
            table[GEARS.index(each.gear), FLANKS.index(each.flank), teeth] += each.amount
    form_of = np.zeros((2, 2, 1))
    for gear in (0, 1):
        for side in (0, 1):
            form_of[gear, side] = 2.0 * steepness(np.zeros(1), flanks.waves[gear, side], 1.0)[2]
    tables = (("profile slope deviation", "f_Hα", slope), ("profile form deviation", "f_fα", form_of))
    for name, symbol, table in (*tables, ("helix slope deviation", "f_Hβ", helix)):
        for side, flank in enumerate(FLANKS):
            rows = table[:, side]
            values = tuple(float(row[np.argmax(np.abs(row))]) for row in rows)
            if any(values):
                yield group, f"{name}, {flank} flanks", f"{symbol},{flank}", "length", values, "ISO 1328-1:2013"


def _mounting(pair: Pair) -> Iterator[Line]:
    group = "mounting"
    for name, symbol, family, kind in (
        ("eccentricity of the teeth", "e", "length", Eccentricity),
        ("wobble of the teeth", "γ", "angle", Wobble),
    ):
        sums = [0j, 0j]
        for item in pair.mounting:
            if isinstance(item, kind):
                size = item.offset if isinstance(item, Eccentricity) else item.angle
                sums[GEARS.index(item.gear)] += size * np.exp(1j * item.phase)
        if any(sums):
            yield group, name, symbol, family, (float(abs(sums[0])), float(abs(sums[1]))), ""
    width = min(pair.drive.face_width, pair.loose.face_width)
    axes = [item for item in pair.mounting if isinstance(item, Misalignment)]
    for name, symbol, angles in (
        ("misalignment of the axes in their plane", "f_Σδ", [item.in_plane for item in axes]),
        ("misalignment of the axes across it", "f_Σβ", [item.out_of_plane for item in axes]),
    ):
        if any(angles):
            leaning = width * sum(tan(angle) for angle in angles)
            yield group, name, symbol, "length", (leaning,), "ISO/TR 10064-3:1996, over the face width"
    sloped = any(gear.helix_slope for gear in (pair.drive, pair.loose))
    if pair.mounting or pair.deviations or sloped:
        least = mounted_band(pair)[0] - (pair.backlash - clearance(pair))
        yield (
            group,
            "least backlash, with mounting and deviations",
            "j_bt,min",
            "length",
            (least,),
            "over all positions",
        )


@dataclass(frozen=True)
class Quantity:
    """One line of a data sheet."""

    group: str  # heading that it stands under
    name: str  # as ISO 21771 calls it
    symbol: str  # as ISO 21771 writes it, subscripts after ``_``
    family: str  # its unit family
    # in the family's SI unit; one of the pair, or those of drive and loose gear; ``None`` where it has no value
    values: tuple[float | None, ...]
    source: str = ""  # where it is defined; ``(n)`` counts the equations of ISO 21771:2007


def data_sheet(
    pair: Pair,
    speed: float = 0.0,
    densities: tuple[float, float] | None = None,
) -> tuple[Quantity, ...]:
    """Return the data sheet of a pair.

    Args:
        pair: the pair; deviations and mounting have lines of their own and do not enter the others.
        speed: mean speed of the drive gear [rad/s], for the sliding speeds.
        densities: of drive and loose gear [kg/m³], for masses and inertias of the solids; ``None`` leaves them out.

    Returns:
        The quantities, group by group.

    Source: ISO 21771:2007, sections 4 to 7; the radial backlash is the exact one, not its linear estimate.

    >>> gear = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
    >>> sheet = {q.symbol: q.values for q in data_sheet(Pair.from_backlash(gear, gear, 250e-6))}
    >>> round(sheet["j_wt"][0] * 1e6, 3), round(sheet["ε_γ"][0], 3)
    (266.352, 1.738)
    """
    sheet = (
        *_common(pair),
        *_single(pair),
        *_diameters(pair),
        *_mesh(pair),
        *_backlash(pair),
        *(Quantity(*line) for line in flank_lines(pair)),
        *_motion(pair, speed),
        *(_masses(pair, densities) if densities else ()),
    )
    return sheet


def path_points(pair: Pair) -> dict[str, float]:
    """Return the points of the path of contact as distances from the pitch point, along the motion of the contact.

    Args:
        pair: the pair.

    Returns:
        ``A`` start (tip of the loose gear), ``B`` and ``D`` ends of the stretch with a single pair of teeth, ``C``
        pitch point, ``E`` end (tip of the drive gear), ``T1`` and ``T2`` where the line of action touches the base
        circles [m]. B lies after D where the contact ratio exceeds 2.

    Source: ISO 21771:2007, equations (77) to (80).
    """
    tangent = tan(pair.working_pressure_angle)
    drive, loose = pair.drive, pair.loose
    start = loose.base_radius * (tangent - loose.tip_roll)
    end = drive.base_radius * (drive.tip_roll - tangent)
    pitch = drive.base_pitch
    return {
        "T1": -drive.base_radius * tangent,
        "A": start,
        "B": end - pitch,
        "C": 0.0,
        "D": start + pitch,
        "E": end,
        "T2": loose.base_radius * tangent,
    }


def radial_backlash(pair: Pair) -> float | None:
    """Return by how much the axes may approach until the backlash is gone [m], ``None`` if it never is.

    Args:
        pair: the pair.
    """
    base_sum = pair.drive.base_radius + pair.loose.base_radius
    left = inv(pair.working_pressure_angle) - 0.5 * pair.backlash / base_sum
    return None if left < 0.0 else pair.centre_distance - base_sum / cos(inverse_inv(left))


def _both(pair: Pair, value) -> tuple[float | None, ...]:
    return tuple(value(which, pair.gear(which)) for which in GEARS)


def _common(pair: Pair):
    gear, group = pair.drive, "basic rack"
    alpha_t, beta = gear.transverse_pressure_angle, gear.helix_angle
    yield Quantity(group, "normal module", "m_n", "length", (gear.module,))
    yield Quantity(group, "transverse module", "m_t", "length", (gear.transverse_module,), "(2)")
    yield Quantity(group, "normal pressure angle", "α_n", "angle", (gear.pressure_angle,))
    yield Quantity(group, "transverse pressure angle", "α_t", "angle", (alpha_t,), "(14)")
    yield Quantity(group, "helix angle, right hand positive", "β", "angle", (beta, -beta if beta else beta))
    yield Quantity(group, "base helix angle", "β_b", "angle", (abs(gear.base_helix_angle),), "(6)")
    yield Quantity(group, "transverse pitch", "p_t", "length", (pi * gear.transverse_module,), "(23)")
    yield Quantity(group, "transverse base pitch", "p_bt", "length", (gear.base_pitch,), "(28)")
    normal = gear.base_pitch * cos(gear.base_helix_angle)
    yield Quantity(group, "normal base pitch", "p_bn", "length", (normal,), "(28), cos β_b")
    if beta:
        yield Quantity(group, "axial pitch", "p_x", "length", (pi * gear.module / abs(sin(beta)),), "π·m_n/sin β")


def _single(pair: Pair):
    group = "gears"

    def of(name: str, symbol: str, family: str, value, source: str = ""):
        return Quantity(group, name, symbol, family, _both(pair, value), source)

    yield of("number of teeth", "z", "count", lambda _, gear: gear.teeth)
    yield of("face width", "b", "length", lambda _, gear: gear.face_width)
    yield of("profile shift coefficient", "x", "ratio", lambda _, gear: gear.profile_shift)
    yield of("addendum coefficient of the rack", "h_aP*", "ratio", lambda _, gear: gear.addendum)
    yield of("dedendum coefficient of the rack", "h_fP*", "ratio", lambda _, gear: gear.dedendum)
    yield of("root fillet coefficient of the rack", "ρ_fP*", "ratio", lambda _, gear: gear.fillet_radius)
    yield of("virtual number of teeth", "z_n", "ratio", _virtual_teeth, "z/(cos β·cos² β_b)")
    yield of("transverse tooth thickness", "s_t", "length", lambda which, _: _thickness(pair, which), "(39), thinned")
    yield of(
        "normal tooth thickness", "s_n", "length", lambda which, _: _normal_thickness(pair, which), "(49), thinned"
    )
    yield of("transverse tooth thickness at the tip", "s_at", "length", lambda which, _: tip_land(pair, which), "(38)")


def _virtual_teeth(_: str, gear: Gear) -> float:
    return gear.teeth / (cos(gear.helix_angle) * cos(gear.base_helix_angle) ** 2)


def _thickness(pair: Pair, which: str) -> float:
    gear = pair.gear(which)
    return 2.0 * gear.reference_radius * (pair.half_angle(which) - inv(gear.transverse_pressure_angle))


def _normal_thickness(pair: Pair, which: str) -> float:
    return _thickness(pair, which) * cos(pair.gear(which).helix_angle)


def _diameters(pair: Pair):
    group = "diameters"

    def of(name: str, symbol: str, value, source: str = ""):
        return Quantity(group, name, symbol, "length", _both(pair, value), source)

    cosine = cos(pair.working_pressure_angle)
    yield of("reference diameter", "d", lambda _, gear: 2.0 * gear.reference_radius, "(1)")
    yield of("base diameter", "d_b", lambda _, gear: 2.0 * gear.base_radius, "(19)")
    yield of("working pitch diameter", "d_w", lambda _, gear: 2.0 * gear.base_radius / cosine, "(56), (57)")
    yield of("tip diameter", "d_a", lambda _, gear: 2.0 * gear.tip_radius, "(33)")
    yield of("root diameter", "d_f", lambda _, gear: 2.0 * gear.root_radius, "(34)")
    yield of("end of active profile diameter", "d_Na", lambda _, gear: 2.0 * gear.tip_radius, "(68), (69)")
    yield of(
        "start of active profile diameter",
        "d_Nf",
        lambda which, gear: _diameter(gear, pair.start_roll(which)),
        "(64) to (67)",
    )
    yield of(
        "root form diameter",
        "d_Ff",
        lambda which, gear: _diameter(gear, form(gear, pair.half_angle(which))[0]),
        "(128)",
    )
    mates = {"drive": pair.loose, "loose": pair.drive}
    yield of(
        "tip clearance",
        "c",
        lambda which, gear: pair.centre_distance - gear.tip_radius - mates[which].root_radius,
        "(60)",
    )


def _diameter(gear: Gear, roll: float) -> float:
    return 2.0 * gear.base_radius * sqrt(1.0 + roll * roll)


def _mesh(pair: Pair):
    group, points = "mesh", path_points(pair)
    drive, loose = pair.drive, pair.loose
    gears = (drive, loose)
    overlap = pair.overlap_ratio
    reach = [gear.base_radius * tan(pair.working_pressure_angle) for gear in gears]
    curvature = reach[0] * reach[1] / sum(reach) / cos(drive.base_helix_angle)
    width = min(gear.face_width for gear in gears)
    lines = width * pair.contact_ratio / cos(drive.base_helix_angle)

    def of(name: str, symbol: str, family: str, value: float, source: str):
        return Quantity(group, name, symbol, family, (value,), source)

    yield of("transmission ratio", "i", "ratio", loose.teeth / drive.teeth, "(52)")
    yield of("centre distance", "a", "length", pair.centre_distance, "(54)")
    yield of("reference centre distance", "a_d", "length", drive.reference_radius + loose.reference_radius, "(53)")
    yield of("working transverse pressure angle", "α_wt", "angle", pair.working_pressure_angle, "(54), (55)")
    yield of("length of path of contact", "g_α", "length", points["E"] - points["A"], "(77)")
    yield of("length of approach path", "g_f", "length", -points["A"], "(79)")
    yield of("length of recess path", "g_a", "length", points["E"], "(80)")
    yield of("transverse contact ratio", "ε_α", "ratio", pair.contact_ratio, "(90)")
    yield of("overlap ratio", "ε_β", "ratio", overlap, "(93)")
    yield of("total contact ratio", "ε_γ", "ratio", pair.contact_ratio + overlap, "(97)")
    yield of(
        "equivalent radius of curvature at the pitch point", "ρ_red,C", "length", curvature, "(17), normal section"
    )
    yield of("mean total length of the contact lines", "l_m", "length", lines, "b·ε_α/cos β_b")


def _backlash(pair: Pair):
    group, b = "backlash", pair.backlash
    angles = tuple(b / gear.base_radius for gear in (pair.drive, pair.loose))
    at_reference = b / cos(pair.drive.transverse_pressure_angle)

    def of(name: str, symbol: str, value: float | None, source: str):
        return Quantity(group, name, symbol, "length", (value,), source)

    yield of("along the transverse line of action", "j_bt", b, "dead band b of the equations of motion")
    yield of("normal backlash", "j_bn", pair.normal_backlash, "(103): j_bt·cos β_b")
    yield of("circumferential backlash at the working pitch", "j_wt", pair.circumferential_backlash, "(102)")
    yield of("circumferential backlash at the reference", "j_t", at_reference, "j_bt/cos α_t")
    yield of("radial backlash", "j_r", radial_backlash(pair), "approach of the axes that closes it, exact")
    yield Quantity(group, "angular backlash, the mate held", "j_φ", "angle", angles, "j_bt/r_b")


def _motion(pair: Pair, speed: float):
    group, points = "motion at the mean speed of the drive", path_points(pair)
    drive, loose = pair.drive, pair.loose
    pitch_radius = drive.base_radius / cos(pair.working_pressure_angle)
    relative = abs(speed) * (1.0 + drive.teeth / loose.teeth)
    speeds = (speed, speed * drive.teeth / loose.teeth)
    yield Quantity(group, "speed", "n", "speed", speeds)
    yield Quantity(group, "mesh frequency", "f_z", "frequency", (abs(speed) * drive.teeth / (2.0 * pi),), "z·n")
    yield Quantity(group, "pitch line speed", "v_t", "velocity", (abs(speed) * pitch_radius,), "ω·d_w/2")
    yield Quantity(group, "sliding speed at the start A", "v_gf", "velocity", (relative * abs(points["A"]),), "(112)")
    yield Quantity(group, "sliding speed at the end E", "v_ga", "velocity", (relative * abs(points["E"]),), "(113)")


def _masses(pair: Pair, densities: tuple[float, float]):
    from gears3d.gears.solids import mass_of

    found = [mass_of(pair, which, density, 2e-6) for which, density in zip(GEARS, densities, strict=True)]
    group = "solids"
    yield Quantity(group, "density", "ρ", "density", tuple(densities))
    yield Quantity(group, "mass", "m", "mass", tuple(each.mass for each in found))
    yield Quantity(group, "moment of inertia", "J", "inertia", tuple(float(each.inertia[2, 2]) for each in found))
