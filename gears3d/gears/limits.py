"""Limits of a pair: interference, mountings and deviations that its flanks can have, backlash that they leave."""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, degrees, pi, tan
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gears3d.errors import Fault, InputError
from gears3d.gears.deviation import (
    FLANKS,
    GEARS,
    Deviation,
    Eccentricity,
    HarmonicDeviation,
    HelixSlope,
    Misalignment,
    ProfileSlope,
    ProfileWave,
    ToothDeviation,
    Wobble,
)
from gears3d.gears.gear import fillet_points, form, inv

if TYPE_CHECKING:
    from collections.abc import Iterator

    from gears3d.gears.flank import Flanks
    from gears3d.gears.meshing import Meshing


_ROUNDING = 1e-9  # Slack of roll angles that should agree [rad], and of lengths in modules
_GRAZE = 1e-5  # Depth from which on a tip digs into a fillet, in modules
_POINTS = 129  # On a fillet
Array = NDArray[np.float64]
_ANGLES = 96  # In one revolution
_HEIGHTS = np.linspace(-0.5, 0.5, 9)
# Part of the perfect flank's radius of curvature at the lower end of its working part that must be left everywhere
CONVEX = 0.05
# Part of centre distance · sin(working pressure angle) up to which a flank touches its mate in one point only
PARALLEL = 0.8
SAMPLES = 40  # In a radian of the highest order, over which the bending of a flank is looked at


def interference_faults(pair: Meshing) -> Iterator[Fault]:
    """Yield what keeps the teeth of a pair from rolling on each other down to the mate's tips.

    Source: ISO 21771:2007, equations (60), (64) to (67), (128) and (135).
    """
    for which, other in (("drive", "loose"), ("loose", "drive")):
        gear, mate = pair.gear(which), pair.gear(other)
        where = f"at a centre distance of {pair.centre_distance * 1e3:.6g} mm"
        clearance = pair.centre_distance - mate.tip_radius - gear.root_radius
        if clearance < -_ROUNDING * gear.module:
            yield Fault(
                f"{other}.addendum",
                f"is {mate.addendum:g} modules: {where} its tip reaches {-clearance * 1e6:.4g} um below the root "
                f"circle of the {which} gear",
                f"shorten the tip by at least {-clearance / gear.module:.3g} modules, or give the {which} gear more "
                "dedendum",
            )
            continue
        lowest, fillet_angle = form(gear, pair.half_angle(which))
        start, depth = pair.start_roll(which), digging(pair, which)
        rolls = f"involute from roll angle {degrees(lowest):.4g} deg, needed from {degrees(start):.4g} deg"
        if depth > _GRAZE * gear.module:
            why = f"the tip of the mate digs {depth * 1e6:.4g} um into its root"
        elif start >= lowest - _ROUNDING:
            continue
        elif fillet_angle > gear.pressure_angle + _ROUNDING:
            why = f"the rack undercuts its teeth up into the flank that the mate needs ({rolls})"
        else:
            why = f"its root begins on the flank that the mate needs ({rolls})"
        yield Fault(
            f"{which}.teeth",
            f"is {gear.teeth}: {where} {why}",
            "give more teeth, more profile shift or less addendum of the mate",
        )


def digging(pair: Meshing, which: str) -> float:
    """Return how deep the mate's tip goes into the root fillet of a gear in contact [m]; negative: it clears."""
    gear, mate = pair.gear(which), pair.gear("loose" if which == "drive" else "drive")
    half, ratio = pair.half_angle(which), mate.teeth / gear.teeth
    working = inv(pair.working_pressure_angle)
    lead = inv(acos(mate.base_radius / mate.tip_radius)) - working
    distance, tip = pair.centre_distance, mate.tip_radius
    angles = np.linspace(form(gear, half)[1], 0.5 * pi, _POINTS)
    radius, polar = fillet_points(gear, half, angles).T
    cosine = (distance**2 + tip**2 - radius**2) / (2.0 * distance * tip)
    before = np.arccos(np.minimum(cosine, 1.0))  # angle of the tip's edge before the line of centres
    across, along = tip * np.sin(before), distance - tip * np.cos(before)
    edge = half - working + (before + lead) * ratio - np.arctan2(across, along)
    depth = (polar - edge) * radius * np.cos(angles)
    return float(np.max(depth, initial=-np.inf, where=cosine <= 1.0))


def mounted_band(pair: Meshing) -> tuple[float, float]:
    """Return the narrowest dead band and the largest distance of the teeth's axes over all positions of the gears.

    In every section the flanks are involutes about displaced axes, for which both are closed forms; the band ends where
    the first section touches. Crowning and the gears' helix slope count, deviations do not.

    Args:
        pair: the pair, with its mounting.

    Returns:
        Width of the dead band [m], negative where the gears jam, and distance [m].

    >>> from gears3d.gears import Eccentricity, Gear, Pair
    >>> gear = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
    >>> pair = Pair.from_backlash(gear, gear, 250e-6).with_mounting(Eccentricity("drive", 50e-6))
    >>> round(mounted_band(pair)[0] * 1e6, 1)
    215.5
    """
    total, width = pair.drive.base_radius + pair.loose.base_radius, min(pair.drive.face_width, pair.loose.face_width)
    drive, loose = _angles(pair)
    first, last = np.full(drive.shape, -np.inf), np.full(drive.shape, np.inf)
    farthest = 0.0
    for z in _HEIGHTS * width:
        x, y = _axes(pair, drive, loose, float(z))
        distance = np.hypot(x, y)
        angle = np.arccos(np.minimum(total / distance, 1.0))
        wider = total * (np.tan(angle) - angle - inv(pair.working_pressure_angle))
        aside = -total * np.arctan2(y, x)
        lean = sum(gear.helix_slope * z / gear.face_width for gear in (pair.drive, pair.loose))
        lean_off = sum(gear.lead_crowning * (2.0 * z / gear.face_width) ** 2 for gear in (pair.drive, pair.loose))
        first = np.maximum(first, aside - wider + lean - lean_off)
        last = np.minimum(last, aside + wider + lean + lean_off + pair.backlash)
        farthest = max(farthest, float(distance.max()))
    return float(np.min(last - first)), farthest


def _angles(pair: Meshing) -> tuple[Array, Array]:
    """Angles of both gears in all positions in which their teeth can meet; many ratios come near to every position."""
    turns = np.lcm(pair.drive.teeth, pair.loose.teeth) // pair.drive.teeth
    if turns > 12:
        once = np.linspace(0.0, 2.0 * pi, _ANGLES, endpoint=False)
        drive, loose = np.meshgrid(once, once)
        return drive.ravel(), loose.ravel()
    drive = np.linspace(0.0, 2.0 * pi * turns, turns * _ANGLES, endpoint=False)
    return drive, drive * pair.drive.teeth / pair.loose.teeth


def _axes(pair: Meshing, drive: Array, loose: Array, z: float) -> tuple[Array, Array]:
    """Position of the loose gear's teeth's axis from that of the drive's in a section [m]."""
    x, y = np.full(drive.shape, pair.centre_distance), np.zeros(drive.shape)
    for item in pair.mounting:
        if isinstance(item, Misalignment):
            x, y = x + tan(item.in_plane) * z, y + tan(item.out_of_plane) * z
            continue
        size = item.offset if isinstance(item, Eccentricity) else tan(item.angle) * z
        turn = (drive if item.gear == "drive" else loose) + item.phase
        x = x - size * np.cos(turn)
        y = y + (-size if item.gear == "drive" else size) * np.sin(turn)
    return x, y


def check_mounting(pair: Meshing, taken: float) -> None:
    """Refuse a mounting that jams the gears or lets teeth lose contact."""
    left, farthest = mounted_band(pair)
    if left - taken < 0.0:
        raise InputError(
            Fault(
                "backlash",
                f"is {pair.backlash * 1e6:.6g} um, of which the mounting takes {(pair.backlash - left) * 1e6:.4g} um "
                + (f"and deviations of the flanks {taken * 1e6:.4g} um " if taken else "")
                + "where it is least: the gears would jam",
                "give more backlash, or smaller offsets and tilts",
            )
        )
    total = pair.drive.base_radius + pair.loose.base_radius
    reach = sum(gear.base_radius * gear.tip_roll for gear in (pair.drive, pair.loose))
    ratio = (reach - (farthest**2 - total**2) ** 0.5) / pair.drive.base_pitch
    if ratio + pair.overlap_ratio < 1.0:
        kinds = sorted({type(item).__name__ for item in pair.mounting if isinstance(item, Eccentricity | Wobble)})
        raise InputError(
            Fault(
                "centre_distance",
                f"is {pair.centre_distance * 1e3:.6g} mm and grows to {farthest * 1e3:.6g} mm by the mounting "
                f"({', '.join(kinds) or 'Misalignment'}): the contact ratio falls to {ratio:.3f} there",
                "give a smaller centre distance or backlash, smaller offsets and tilts, or longer teeth",
            )
        )


def steepest(pair: Meshing, which: str) -> float:
    """Return the largest sum of ``|amplitude|·order²`` that the flanks of a gear can carry [m].

    The flank must stay convex with a radius of curvature of at least 1/20 of the perfect one's at the lower
    end of its working part, and touch its mate in one point for every angle.

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.

    Returns:
        The bound [m]; with k = centre distance · sin(working pressure angle) and ρ the smallest radius of curvature
        of the perfect flank it is the smaller of 0.8·k and the A for which k·A/(k + A) = 0.95·ρ.
    """
    reach = pair.path_length
    radius = (1.0 - CONVEX) * max(pair.start_roll(which), 0.0) * pair.gear(which).base_radius
    return min(PARALLEL * reach, radius * reach / (reach - radius))


def clearance(pair: Meshing, more: Sequence[Deviation] = ()) -> float:
    """Return the least backlash that the deviations leave [m]."""
    deviations = (*pair.deviations, *more)
    orders = [d.order for d in deviations if isinstance(d, HarmonicDeviation)]
    theta = np.linspace(0.0, 2.0 * np.pi, 64 * (max(orders, default=0) + 1) + 1)
    material = {which: _material(pair, which, theta, deviations) for which in GEARS}
    if pair.drive.teeth == pair.loose.teeth:
        most = float(np.max(material["drive"] + material["loose"]))
    else:
        most = float(material["drive"].max() + material["loose"].max())
    return pair.backlash - most


def _material(
    pair: Meshing, which: str, theta: NDArray[np.float64], deviations: Sequence[Deviation]
) -> NDArray[np.float64]:
    """Material of both flanks together over the gear's angle, single teeth at their thickest."""
    total = np.zeros_like(theta)
    teeth = np.zeros((2, pair.gear(which).teeth))
    for deviation in deviations:
        if deviation.gear != which:
            continue
        if isinstance(deviation, HarmonicDeviation):
            total += deviation.amplitude * np.cos(deviation.order * theta + deviation.phase)
        else:
            tooth = slice(None) if deviation.tooth is None else deviation.tooth - 1
            teeth[FLANKS.index(deviation.flank), tooth] += _thickest(deviation)
    return total + float(teeth.max(axis=1).sum())


def _thickest(deviation: ToothDeviation | ProfileSlope | ProfileWave | HelixSlope) -> float:
    if isinstance(deviation, ToothDeviation):
        return deviation.offset
    return abs(deviation.amplitude) if isinstance(deviation, ProfileWave) else 0.5 * abs(deviation.amount)


def check_deviations(pair: Meshing) -> None:
    """Refuse deviations that make no regular flank."""
    steep: dict[tuple[str, str], float] = {}
    for deviation in pair.deviations:
        if isinstance(deviation, HarmonicDeviation):
            key = (deviation.gear, deviation.flank)
            steep[key] = steep.get(key, 0.0) + abs(deviation.amplitude) * deviation.order**2
        elif deviation.tooth is not None and not 1 <= deviation.tooth <= pair.gear(deviation.gear).teeth:
            teeth = pair.gear(deviation.gear).teeth
            raise InputError(Fault("tooth", f"is {deviation.tooth}", f"the {deviation.gear} gear has 1 to {teeth}"))
    for (which, flank), size in steep.items():
        if size > steepest(pair, which) and not _stays_convex(pair, which, flank):
            _refuse_steepness(pair, which, flank, size)
    _check_profiles(pair, steep)
    left = clearance(pair)
    if left < 0.0:
        raise InputError(
            Fault(
                "backlash",
                f"is {pair.backlash * 1e6:g} um and the deviations take {(pair.backlash - left) * 1e6:.4g} um where "
                "they are thickest: the gears would jam",
                "give more backlash or smaller deviations",
            )
        )


def refuse_crossed(pair: Meshing) -> None:
    """Refuse teeth whose flanks cross below the tip circle, of which solids and hulls would be turned inside out."""
    for index, which in enumerate(GEARS):
        land, mine = tip_land(pair, which), [each for each in pair.deviations if each.gear == which]
        if land <= 0.0:
            raise InputError(
                Fault(
                    "backlash",
                    f"is {pair.backlash * 1e6:.6g} um at a centre distance of {pair.centre_distance * 1e3:.6g} mm: "
                    f"teeth of the {which} gear are thinned until their flanks cross below the tip, by "
                    f"{-land * 1e6:.4g} um",
                    "give less backlash, more centre distance or shorter teeth",
                )
            )
        # twice the sum: flanks that lean, as those of harmonics do, move their tips by more than the material there
        if 2.0 * sum(abs(_size(each)) for each in mine) < land:
            continue
        from gears3d.gears.flank import (  # most rigs are checked without kernels
            compile_pair,
            flank_point,
            roll_at_radius,
        )

        flanks, gear = compile_pair(pair), pair.gear(which)
        for tooth in range(1, gear.teeth + 1):
            at = []
            for side in range(2):
                x, y, *_ = flank_point(
                    flanks, index, side, tooth, roll_at_radius(flanks, index, side, tooth, gear.tip_radius)
                )
                at.append(np.arctan2(y, x))
            active, reverse = at
            left = gear.tip_radius * (np.mod(active - reverse + np.pi, 2.0 * np.pi) - np.pi)
            if not left > 0.0:
                raise InputError(
                    Fault(
                        f"{which}.deviations",
                        f"take more off tooth {tooth} than it has: a perfect tooth is {land * 1e6:.4g} um thick at its "
                        f"tip, with them the flanks overlap there by {-left * 1e6:.4g} um",
                        "give smaller deviations or backlash, or shorter teeth",
                    )
                )


def tip_land(pair: Meshing, which: str) -> float:
    """Return how thick a perfect tooth of a gear is along its tip circle, thinning included [m]."""
    gear = pair.gear(which)
    return 2.0 * gear.tip_radius * (pair.half_angle(which) - inv(acos(gear.base_radius / gear.tip_radius)))


def _size(deviation: Deviation) -> float:
    if isinstance(deviation, ToothDeviation):
        return deviation.offset
    return deviation.amount if isinstance(deviation, ProfileSlope | HelixSlope) else deviation.amplitude


def _stays_convex(pair: Meshing, which: str, flank: str) -> bool:
    """Return whether harmonics that add up to too much never do so where a tooth's working flank would be bent too far.

    The condition of :func:`steepest`, for these phases instead of any.
    """
    from gears3d.gears.flank import (
        ACTIVE_START,
        PITCH,
        compile_pair,  # compiled kernels: most rigs do without them
        full_support,
    )

    waves = [d for d in pair.deviations if isinstance(d, HarmonicDeviation) and (d.gear, d.flank) == (which, flank)]
    highest = max(wave.order for wave in waves)
    theta = np.linspace(0.0, 2.0 * np.pi, SAMPLES * highest + 1)
    bent = np.zeros_like(theta)
    for wave in waves:
        bent += wave.amplitude * wave.order**2 * np.cos(wave.order * theta + wave.phase)
    if np.abs(bent).max() > PARALLEL * pair.path_length:
        return False
    flanks, gear = compile_pair(pair), pair.gear(which)
    index, at = GEARS.index(which), FLANKS.index(flank)
    side, start = 1.0 - 2.0 * at, pair.start_roll(which)
    rolls = np.linspace(start, gear.tip_roll, max(int(SAMPLES * highest * (gear.tip_roll - start)), 2))
    least = CONVEX * start * gear.base_radius
    for tooth in range(1, gear.teeth + 1):
        for roll in rolls:
            u = flanks.gears[index, ACTIVE_START + at] - flanks.gears[index, PITCH] * (tooth - 1) - side * roll
            height, _, bend = full_support(flanks, index, at, tooth, u)
            if height + bend < least:
                return False
    return True


def _refuse_steepness(pair: Meshing, which: str, flank: str, steep: float) -> None:
    most, teeth = steepest(pair, which), pair.gear(which).teeth
    raise InputError(
        Fault(
            "amplitude",
            f"of the {which} gear's {flank} flanks is too large for its order: amplitude·order² adds up to "
            f"{steep * 1e3:.4g} mm, no regular flank beyond {most * 1e3:.4g} mm",
            f"at order {teeth} give at most {most / teeth**2 * 1e6:.3g} um",
        )
    )


def _check_profiles(pair: Meshing, steep: dict[tuple[str, str], float]) -> None:
    """Refuse deviations of profiles with which a flank would not be convex from the start of its active profile on."""
    if not any(isinstance(each, ProfileSlope | ProfileWave) for each in pair.deviations):
        return
    from gears3d.gears.flank import (
        LEAST_TURN,
        compile_pair,  # compiled kernels: most rigs are checked without them
    )

    flanks = compile_pair(pair)
    for gear, which in enumerate(GEARS):
        for side, flank in enumerate(FLANKS):
            bent = steep.get((which, flank), 0.0)
            bent *= pair.path_length / (pair.path_length + bent)
            if _least_turn(flanks, gear, side, (1.0, bent)) >= LEAST_TURN:
                continue
            low, high = 0.0, 1.0
            for _ in range(30):
                middle = 0.5 * (low + high)
                fits = _least_turn(flanks, gear, side, (middle, bent)) >= LEAST_TURN
                low, high = (middle, high) if fits else (low, middle)
            name = "profile_wave" if flanks.waves[gear, side].any() else "profile_slope"
            raise InputError(
                Fault(
                    f"{which}.{name}",
                    f"makes the {flank} flanks hollow, with what else deviates there: flanks must stay convex",
                    _less(name, low),
                )
            )


def _less(name: str, share: float) -> str:
    """Return the remedy for a deviation of profiles of which a share would leave the flank convex."""
    if not share:
        return "leave it out"
    fewer = f", or {share**0.5:.2g} of the waves" if name == "profile_wave" else ""
    return f"give at most {share:.2g} of these amounts{fewer}"


def _least_turn(flanks: Flanks, gear: int, flank: int, sizes: tuple[float, float]) -> float:
    """Return the least turning of a flank's normal by the roll angle at a share of its profile deviations, at worst."""
    from gears3d.gears.flank import ACTIVE_PROFILE, FLOOR, FORM_ROLL, PROFILE_REACH, relieved, steepness

    share, bent = sizes
    row, base = flanks.gears[gear], flanks.gears[gear, 0]
    rise, bend, most = (
        share * each for each in steepness(flanks.slopes[gear, flank], flanks.waves[gear, flank], row[PROFILE_REACH])
    )
    if row[FLOOR + flank] > max(row[ACTIVE_PROFILE], row[FORM_ROLL]) and share == 1.0:
        return 0.0
    least = 1.0
    for roll in np.linspace(row[ACTIVE_PROFILE], row[ACTIVE_PROFILE] + row[PROFILE_REACH], 129):
        taken, fall, curl = relieved(flanks, gear, float(roll))
        radius, slope = base * roll - taken - most - bent, fall + rise
        if radius <= 0.0:
            return 0.0
        least = min(least, 1.0 + ((curl - bend) * radius - abs(slope) * base) / (radius**2 + slope**2))
    return least
