"""Pairs of gears that mesh: made from backlash or centre distance, and checked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, degrees, hypot
from typing import TYPE_CHECKING

from gears3d.errors import Fault, InputError
from gears3d.gears.deviation import GEARS, Deviation, HelixSlope, Mounting
from gears3d.gears.gear import Gear, inverse_inv
from gears3d.gears.limits import check_deviations, check_mounting, clearance, interference_faults
from gears3d.gears.meshing import Meshing, backlash_of, base_thickness

if TYPE_CHECKING:
    from gears3d.gears.flank import Flanks

_ROUNDING = 1e-12  # Slack for lengths that should agree, m


@dataclass(frozen=True)
class Pair(Meshing):
    """A meshing pair of external involute gears.

    Make one with :meth:`from_backlash`, :meth:`from_centre_distance` or :meth:`from_both`.

    Args:
        drive: the gear whose motion is imposed.
        loose: the gear that rattles.
        centre_distance: distance of the parallel axes [m].
        thinning: taken off every tooth of both gears, measured along the base circle [m].
        deviations: of the flanks from the perfect involute.
        mounting: how the gears sit off their ideal axes.

    Raises:
        InputError: the gears do not mesh, jam, lose contact between teeth or dig into each other's roots.

    >>> gear = Gear(module=3.5e-3, teeth=90, face_width=7.5e-3)
    >>> pair = Pair.from_backlash(gear, gear, 250e-6)
    >>> round(pair.centre_distance * 1e3, 4), round(pair.contact_ratio, 3)
    (315.3639, 1.738)
    """

    def __post_init__(self) -> None:
        _check_same_rack(self.drive, self.loose)
        _check_mesh(self)
        if self.deviations:
            check_deviations(self)
        if self.mounting:
            check_mounting(self, self.backlash - clearance(self) if self.deviations else 0.0)

    @classmethod
    def from_backlash(cls, drive: Gear, loose: Gear, backlash: float) -> Pair:
        """Open the centre distance until the dead band along the transverse line of action is ``backlash``.

        Args:
            drive: the gear whose motion is imposed.
            loose: the gear that rattles.
            backlash: width of the dead band [m], not negative.

        Returns:
            The pair.

        Raises:
            InputError: the backlash is negative or the gears do not mesh.

        Source: ISO 21771:2007, cylindrical gear pairs: both tooth thicknesses and the backlash make up the pitch.
        Theory: docs/theory/geometry.md, equation (3).
        """
        _check_same_rack(drive, loose)
        if not backlash >= 0.0:
            raise InputError(Fault("backlash", f"is {backlash * 1e6:g} um: the gears would jam", "give 0 um or more"))
        base_sum = drive.base_radius + loose.base_radius
        taken = base_thickness(drive) + base_thickness(loose) + backlash - drive.base_pitch
        return cls(drive, loose, base_sum / cos(inverse_inv(taken / (2.0 * base_sum))))

    @classmethod
    def from_centre_distance(cls, drive: Gear, loose: Gear, centre_distance: float) -> Pair:
        """Put the axes at a distance and take the backlash that follows.

        Args:
            drive: the gear whose motion is imposed.
            loose: the gear that rattles.
            centre_distance: distance of the axes [m].

        Returns:
            The pair.

        Raises:
            InputError: the gears jam or do not mesh there.
        """
        return cls(drive, loose, centre_distance)

    @classmethod
    def from_both(cls, drive: Gear, loose: Gear, centre_distance: float, backlash: float) -> Pair:
        """Put the axes at a distance and thin all teeth equally until the backlash fits.

        Args:
            drive: the gear whose motion is imposed.
            loose: the gear that rattles.
            centre_distance: distance of the axes [m].
            backlash: width of the dead band along the transverse line of action [m].

        Returns:
            The pair.

        Raises:
            InputError: teeth of full thickness already leave more backlash, or the gears do not mesh there.
        """
        _check_same_rack(drive, loose)
        least = backlash_of(drive, loose, centre_distance, 0.0)
        if backlash < least - _ROUNDING:
            raise InputError(
                Fault(
                    "backlash",
                    f"is {backlash * 1e6:.6g} um, but full teeth leave {least * 1e6:.6g} um at a centre distance of "
                    f"{centre_distance * 1e3:.6g} mm",
                    "give at least that, or a smaller centre distance",
                )
            )
        return cls(drive, loose, centre_distance, thinning=max(0.0, 0.5 * (backlash - least)))

    def with_deviations(self, *deviations: Deviation) -> Pair:
        """Return the pair with these deviations added to its flanks.

        Args:
            deviations: of harmonics, single teeth, profiles or helices.

        Returns:
            A new pair.

        Raises:
            InputError: a tooth that is not there, a harmonic too steep for a regular flank, or
                material that uses up the backlash.
        """
        return replace(self, deviations=self.deviations + deviations)

    def with_mounting(self, *mounting: Mounting) -> Pair:
        """Return the pair with its gears off their ideal axes.

        Args:
            mounting: eccentricities, wobbles and misalignments, added to those there are.

        Returns:
            A new pair.

        Raises:
            InputError: the gears would jam somewhere, or lose contact between teeth.
        """
        return replace(self, mounting=self.mounting + mounting)

    def compiled(self) -> Flanks:
        """Return the flanks as arrays for the compiled functions of :mod:`gears3d.gears.flank`.

        Raises:
            InputError: gears whose contact needs more than one transverse section.
        """
        from gears3d.gears.flank import compile_pair

        _check_planar(self)
        return compile_pair(self)


def _check_planar(pair: Pair) -> None:
    """Refuse what shows beyond the transverse section of gears on their ideal axes."""
    reason = "contact is located on spur teeth only"
    if pair.drive.helix_angle != 0.0:
        raise InputError(Fault("helix_angle", f"is {degrees(pair.drive.helix_angle):g} deg: {reason}", "give 0 deg"))
    for which in GEARS:
        slope = pair.gear(which).helix_slope
        if slope != 0.0:
            raise InputError(Fault(f"{which}.helix_slope", f"is {slope * 1e6:g} um: {reason}", "give 0 um"))
    sloped = next((each for each in pair.deviations if isinstance(each, HelixSlope)), None)
    if sloped is not None:
        raise InputError(Fault(f"{sloped.gear}.helix_slope", f"is {sloped.amount * 1e6:g} um: {reason}", "give 0 um"))
    if pair.mounting:
        kind = type(pair.mounting[0]).__name__
        raise InputError(Fault("mounting", f"has {kind}: contact is located on ideal axes only", "leave it out"))


def _check_same_rack(drive: Gear, loose: Gear) -> None:
    faults = []
    for key, scale, unit in (
        ("module", 1e3, "mm"),
        ("pressure_angle", degrees(1), "deg"),
        ("helix_angle", degrees(1), "deg"),
    ):
        ours, theirs = getattr(drive, key), getattr(loose, key)
        if abs(ours - theirs) > 1e-9 * abs(ours):
            text = f"is {ours * scale:g} {unit} on the drive and {theirs * scale:g} {unit} on the loose gear"
            remedy = f"give the loose gear {ours * scale:g} {unit} too"
            if key == "helix_angle":
                remedy += ": its hand is the opposite of the drive's by itself"
            faults.append(Fault(key, f"{text}: they do not mesh", remedy))
    if faults:
        raise InputError(faults)


def _longest_reach(pair: Pair) -> str:
    """Return what to give for a contact ratio of at least 1."""
    needed = pair.drive.base_pitch * (1.0 - pair.overlap_ratio)
    reach = sum(gear.base_radius * gear.tip_roll for gear in (pair.drive, pair.loose)) - needed
    base_sum = pair.drive.base_radius + pair.loose.base_radius
    most = hypot(base_sum, reach) if reach > 0.0 else 0.0
    backlash = backlash_of(pair.drive, pair.loose, most, pair.thinning) if most > base_sum else -1.0
    if backlash < 0.0:
        return "give longer teeth: these lose contact at any backlash"
    return (
        f"give a smaller backlash or centre distance, at most {backlash * 1e6:.6g} um at {most * 1e3:.6g} mm, or "
        "longer teeth"
    )


def _check_mesh(pair: Pair) -> None:
    backlash = pair.backlash
    if backlash < -_ROUNDING:
        closest = Pair.from_backlash(pair.drive, pair.loose, 0.0).centre_distance
        raise InputError(
            Fault(
                "centre_distance",
                f"is {pair.centre_distance * 1e3:.6g} mm: the gears jam, the teeth overlap by {-backlash * 1e6:.4g} um",
                f"give at least {closest * 1e3:.6g} mm",
            )
        )
    if pair.contact_ratio < 1.0 and pair.contact_ratio + pair.overlap_ratio < 1.0 + 1e-9:
        raise InputError(
            Fault(
                "centre_distance",
                f"is {pair.centre_distance * 1e3:.6g} mm: the contact ratio is {pair.contact_ratio:.3f}, teeth lose "
                "contact before the next pair meets",
                _longest_reach(pair),
            )
        )
    if faults := list(interference_faults(pair)):
        raise InputError(faults)
