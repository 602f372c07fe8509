"""Transverse outline of a gear: roots, fillets, flanks and tips as a polygon; chords, and the size of a solid."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from gears3d.errors import Fault, InputError
from gears3d.gears.deviation import GEARS, HarmonicDeviation, index_of
from gears3d.gears.flank import (
    ACTIVE,
    PROFILE_REACH,
    REVERSE,
    Flanks,
    flank_points,
    relief_starts,
    roll_at_radius,
    steepness,
)
from gears3d.gears.gear import Gear, fillet, fillet_points, form, relief_bend
from gears3d.gears.pair import Pair
from gears3d.gears.surface import flank_leads, flanks_at, lead_turn

Array = NDArray[np.float64]

# Roll angle at which drawing begins on an involute that starts at the base circle: 13 ppm of its radius higher
LEAST_ROLL = 5e-3
MOST_TRIANGLES = 2e7  # Of a solid: about 3 GB while it is made and written
# Default chord [m] of large gears, and of small ones in tip radii: what chords take off a gear's volume and inertia
# goes with their distance from the surface over its size
FINEST, SHARE = 0.2e-6, 1.6e-6


@dataclass(frozen=True)
class Outline:
    """A gear's transverse section as a polygon, counter-clockwise in the gear's own frame."""

    # for each tooth from the middle of the space before it, over reverse side, tip and active side, to the middle
    # of the next space, in m, (teeth, n, 2)
    points: Array
    root: int  # segments from the middle of a space to the fillet
    fillet: int  # segments of a fillet
    flank: int  # segments of a flank
    tip: int  # segments of the tip arc

    @property
    def area(self) -> float:
        """Area inside the polygon [m²]."""
        x, y = self.points.reshape(-1, 2).T
        return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def outline(
    pair: Pair, which: str, chord: float = 0.2e-6, root_chord: float | None = None, height: float = 0.0
) -> Outline:
    """Return the transverse section of a gear with its flanks, deviations included, in the frame of the section.

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.
        chord: largest distance of the polygon from the flanks [m].
        root_chord: the same for tip, fillet and root [m]; ``chord`` when not given.
        height: of the section above the middle of the face [m]; only helical deviating gears change with it.

    Returns:
        The polygon; its vertices on the flanks are points of the flanks.

    Raises:
        InputError: a chord that is not positive, or an unknown gear.
    """
    number = index_of(which, GEARS, "which")
    if not chord > 0.0 or not (root_chord is None or root_chord > 0.0):
        raise InputError(Fault("chord", f"is {chord:g} m", "give a positive length"))
    gear, half = pair.gear(which), pair.half_angle(which)
    root, around, segments, tip = segments_at(pair, which, chord, root_chord)
    curve, lowest = _fillet(gear, half, around), form(gear, half)[0]
    flanks = flanks_at(pair, height)

    deviating = any(deviation.gear == which for deviation in pair.deviations)
    sense = 1 - 2 * number
    middle = 0.5 * (flanks.gears[number, 2] + flanks.gears[number, 3])
    pitch = 2.0 * pi / gear.teeth
    teeth = []
    for place in range(gear.teeth if deviating else 1):
        tooth = (-sense * place) % gear.teeth + 1
        sides = [_flank(flanks, number, side, tooth, (lowest, gear.tip_radius, segments)) for side in (REVERSE, ACTIVE)]
        sides = [_turned(side, -(middle + place * pitch)) for side in sides]
        teeth.append(_tooth(gear, sides, curve, (root, tip)))
    count = np.arange(gear.teeth)
    if not deviating:
        teeth = teeth * gear.teeth
    points = np.stack(teeth)
    turn = middle + count * pitch
    c, s = np.cos(turn)[:, None], np.sin(turn)[:, None]
    x, y = points[..., 0], points[..., 1]
    return Outline(np.stack([c * x - s * y, s * x + c * y], axis=2), root, len(curve) - 1, segments, tip)


def segments_at(pair: Pair, which: str, chord: float, root_chord: float | None = None) -> tuple[int, int, int, int]:
    """Return how many segments a tooth's outline has, without making it."""
    gear, half, coarse = pair.gear(which), pair.half_angle(which), root_chord or chord
    lowest, first = form(gear, half)
    measure = fillet_measure(gear, half, first)[1]
    flank = _flank_segments(pair, which, max(lowest, LEAST_ROLL), chord)
    flank += len(relief_starts(flanks_at(pair, 0.0), GEARS.index(which)))
    tip_angle = 2.0 * (half - (gear.tip_roll - np.arctan(gear.tip_roll)))
    tip = max(1, _arc_segments(tip_angle, gear.tip_radius, coarse))
    gap = pi / gear.teeth - fillet(gear, half, 0.5 * pi)[1]
    root = max(1, _arc_segments(gap, gear.root_radius, coarse)) if gap > 1e-9 else 0
    return root, max(2, ceil(measure[-1] / sqrt(8.0 * coarse))), flank, tip


def profile(pair: Pair, which: str, chord: float = 0.2e-6, tooth: int = 1) -> Array:
    """Return the outline of one tooth between the middles of its spaces, in the gear's own frame.

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.
        chord: largest distance of the polygon from the flanks [m].
        tooth: number of the tooth in order of meshing.

    Returns:
        Points counter-clockwise [m], (n, 2).

    Raises:
        InputError: a tooth that is not there, a chord that is not positive, or an unknown gear.
    """
    gear = pair.gear(which)
    if not 1 <= tooth <= gear.teeth:
        raise InputError(Fault("tooth", f"is {tooth}", f"the {which} gear has 1 to {gear.teeth}"))
    sense = 1 if which == "drive" else -1
    return outline(pair, which, chord).points[(-sense * (tooth - 1)) % gear.teeth]


def _arc_segments(angle: float, radius: float, chord: float) -> int:
    return ceil(angle * sqrt(radius / (8.0 * chord)))


def _flank_segments(pair: Pair, which: str, lowest: float, chord: float) -> int:
    """Count segments so that radius of curvature × step² / 8 stays within the chord, deviations included."""
    gear = pair.gear(which)
    steep = sum(
        abs(deviation.amplitude) * deviation.order**2
        for deviation in pair.deviations
        if isinstance(deviation, HarmonicDeviation) and deviation.gear == which
    )
    reach = pair.path_length
    extra = steep * reach / (reach - min(steep, 0.9 * reach)) / (gear.base_radius * lowest)
    extra += relief_bend(gear, lowest)
    flanks, number = flanks_at(pair, 0.0), GEARS.index(which)
    bends = [steepness(flanks.slopes[number, side], flanks.waves[number, side], flanks.gears[number, PROFILE_REACH])
             for side in (ACTIVE, REVERSE)]  # fmt: skip
    extra += max(bend for _, bend, _ in bends) / (gear.base_radius * lowest)
    span = (gear.tip_roll**1.5 - lowest**1.5) / 1.5
    return max(2, ceil(span * sqrt(gear.base_radius * (1.0 + extra) / (8.0 * chord))))


def fillet_measure(gear: Gear, half_angle: float, first: float) -> tuple[Array, Array]:
    """Angles along a fillet, and the root of length × turning up to each: a chord is an eighth of its square."""
    angles = np.linspace(first, 0.5 * pi, 129)
    dense = fillet_points(gear, half_angle, angles)
    x, y = dense[:, 0] * np.cos(dense[:, 1]), dense[:, 0] * np.sin(dense[:, 1])
    dx, dy = np.diff(x), np.diff(y)
    length, direction = np.hypot(dx, dy), np.unwrap(np.arctan2(dy, dx))
    turning = np.abs(np.gradient(direction))
    return angles, np.concatenate([[0.0], np.cumsum(np.sqrt(length * turning))])


def _fillet(gear: Gear, half_angle: float, segments: int) -> Array:
    """Points (radius, angle from the middle of the tooth) from form point to root circle, even in chord error."""
    angles, measure = fillet_measure(gear, half_angle, form(gear, half_angle)[1])
    even = np.interp(np.linspace(0.0, measure[-1], segments + 1), measure, angles)
    return fillet_points(gear, half_angle, even)


def _flank(flanks: Flanks, gear: int, side: int, tooth: int, extent: tuple[float, float, int]) -> Array:
    """Points of a flank from form circle to tip, the edges where reliefs start among them, (segments + 1, 2)."""
    lowest, tip_radius, segments = extent
    last, starts = roll_at_radius(flanks, gear, side, tooth, tip_radius), relief_starts(flanks, gear)
    rolls = np.linspace(max(lowest, LEAST_ROLL) ** 1.5, last**1.5, segments + 1 - len(starts)) ** (2.0 / 3.0)
    return flank_points(flanks, gear, side, tooth, np.sort(np.append(rolls, starts)))[0]


def _turned(points: Array, angle: float) -> Array:
    c, s = cos(angle), sin(angle)
    return points @ np.array([[c, s], [-s, c]])


def _tooth(gear: Gear, sides: list[Array], curve: Array, counts: tuple[int, int]) -> Array:
    """Join root, fillet, flanks and tip of one tooth whose middle lies on +x."""
    root, tip = counts
    (low, high), blend = sides, np.linspace(1.0, 0.0, len(curve))[1:, None]
    fillets = []
    for side, sign in ((low, -1.0), (high, 1.0)):
        start = np.array([np.hypot(*side[0]), sign * np.arctan2(side[0, 1], side[0, 0])])
        polar = curve[1:] + blend * (start - curve[0])
        fillets.append(np.c_[polar[:, 0] * np.cos(polar[:, 1]), sign * polar[:, 0] * np.sin(polar[:, 1])])
    first, last = np.arctan2(low[-1, 1], low[-1, 0]), np.arctan2(high[-1, 1], high[-1, 0])
    tip_angles = np.linspace(first, last, tip + 1)[1:-1]
    edge, bottom = pi / gear.teeth, curve[-1, 1]
    root_angles = np.linspace(-edge, -bottom, root + 1)[:-1]
    arc = gear.root_radius * np.c_[np.cos(root_angles), np.sin(root_angles)]
    back = np.linspace(bottom, edge, root + 1)[1:-1]
    parts = [
        arc,
        fillets[0][::-1],
        low,
        gear.tip_radius * np.c_[np.cos(tip_angles), np.sin(tip_angles)],
        high[::-1],
        fillets[1] if root else fillets[1][:-1],
        gear.root_radius * np.c_[np.cos(back), np.sin(back)],
    ]
    return np.vstack(parts)


def inner_radius(gear: Gear) -> float:
    """Return where the toothed end face ends inwards [m]: at the rim, at the bore, or 0 for a full face."""
    return gear.pocket[1] if gear.pocket else 0.5 * (gear.bore or 0.0)


def default_chord(pair: Pair, which: str) -> float:
    """Return the chord with which volume and inertia of a solid are within 1e-5 of those of the exact gear [m].

    Args:
        pair: the pair.
        which: ``"drive"`` or ``"loose"``.

    >>> from gears3d.gears import Gear
    >>> gear = Gear(module=2e-3, teeth=20, face_width=5e-3)
    >>> round(default_chord(Pair.from_backlash(gear, gear, 1e-4), "drive") * 1e9)
    35
    """
    return min(FINEST, SHARE * pair.gear(which).tip_radius)


def triangles_at(pair: Pair, which: str, chord: float, root_chord: float | None = None) -> int:
    """Return about how many triangles a solid has, without making it.

    Args:
        pair: the pair, deviations included.
        which: ``"drive"`` or ``"loose"``.
        chord: largest distance of the facets from the flanks [m].
        root_chord: the same elsewhere [m]; ``chord`` when not given.
    """
    _check_chords(chord, root_chord)
    coarse, gear = root_chord or chord, pair.gear(which)
    root, fillet, flank, tip = segments_at(pair, which, chord, root_chord)
    ring = gear.teeth * (2 * (root + fillet + flank) + tip)
    inner = gear.teeth * 2 * root + 2.0 * pi * sqrt(inner_radius(gear) / (8.0 * coarse)) if inner_radius(gear) else 0.0
    return round(2.0 * (ring + inner) * (layers_at(pair, which, coarse) + 1))


def _check_chords(chord: float, root_chord: float | None) -> None:
    for each in (chord, root_chord):
        if each is not None and not each > 0.0:
            raise InputError(Fault("chord", f"is {each:g} m", "give a positive length"))


def check_size(pair: Pair, which: str, chord: float, root_chord: float | None = None) -> None:
    """Refuse a chord whose triangles fit into no memory."""
    count = triangles_at(pair, which, chord, root_chord)
    if count <= MOST_TRIANGLES:
        return
    ratio = (root_chord or chord) / chord
    low, high = chord, pair.gear(which).tip_radius
    for _ in range(50):
        middle = sqrt(low * high)
        fits = triangles_at(pair, which, middle, ratio * middle) <= MOST_TRIANGLES
        low, high = (low, middle) if fits else (middle, high)
    words = f"is {chord * 1e6:.3g} um: the {which} gear would have {count:.2g} triangles, {MOST_TRIANGLES:.0e} are "
    words += "the most that fit into memory"
    raise InputError(Fault("chord", words, f"give at least {high * 1.05e6:.2g} um"))


def layers_at(pair: Pair, which: str, chord: float) -> int:
    """Return how many slices keep edges of helical tips and crowned flanks within the chord between their ends."""
    gear = pair.gear(which)
    lead = lead_turn(gear, 1.0 if which == "drive" else -1.0)
    most = abs(lead) + float(np.max(np.abs(flank_leads(pair)[GEARS.index(which)]), initial=0.0))
    count = max(1, ceil(most * gear.face_width * sqrt(gear.tip_radius / (8.0 * chord))))
    if gear.lead_crowning != 0.0:
        count = 2 * ceil(0.5 * max(count, sqrt(abs(gear.lead_crowning) / chord)))
    return count
