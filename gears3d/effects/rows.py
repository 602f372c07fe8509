"""The normal forms of all effects, which twin and engine each evaluate in their own code.

A row is data: a code that names the form, a gate that defines when it acts, and numbers in SI units. Torques of
several rows add; so do flank deviations and contributions to the restitution coefficient.

Signs: a torque is *resisting* (it is subtracted from the loose gear's acceleration); a flank deviation is material
added along the outward normal of the flank, in m along the transverse line of action; ``dry(w)`` below is the sign
of the loose gear's speed, with stiction at rest.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

WIDTH = 6  # numbers in a row


class Code(IntEnum):
    """The normal forms; the hundreds digit is the place."""

    TORQUE_CONSTANT = 101  # p = torque                      -> torque * dry(w)
    TORQUE_LINEAR = 102  # p = coefficient, shaft_speed      -> coefficient * (w - shaft_speed)
    TORQUE_POWER = 103  # p = coefficient, exponent          -> coefficient * |w|**exponent * dry(w)
    TORQUE_HARMONIC = 104  # p = order, amplitude, phase     -> amplitude * cos(order*theta_loose + phase)
    TORQUE_RELAX = 105  # p = torque, time_constant          -> torque * (1 - exp(-t/time_constant)) * dry(w)
    TORQUE_FRICTION = 106  # p = coefficient                 -> coefficient * base radius * flank force * dry(w)
    TORQUE_TABLE = (
        107  # p = Variable; table                -> torque over speed, angle or time, straight between points
    )
    TORQUE_CARRIED = 108  # p = inertia, stiffness, damping, play -> spring to a body that the loose gear carries
    FLANK_HARMONIC = 201  # p = gear, flank, order, amplitude, phase -> amplitude * cos(order*theta_gear + phase)
    FLANK_TOOTH = 202  # p = gear, flank, tooth, offset      -> offset on that tooth (1 = first in order of meshing)
    FLANK_ECCENTRIC = 203  # p = gear, offset, phase         -> axis of the teeth away from the axis of rotation
    IMPACT_OFFSET = 301  # p = offset                        -> e + offset
    IMPACT_SLOPE = 302  # p = slope                          -> e + slope * |v|
    IMPACT_FLANK = 303  # p = asymmetry                      -> e + asymmetry/2 on active, - asymmetry/2 on reverse
    IMPACT_SCATTER = 304  # p = standard_deviation           -> e + standard_deviation * z, z standard normal
    GAP_SPRING = 401  # p = stiffness, damping               -> max(0, -stiffness*gap - damping*gap_rate) if gap < 0
    GAP_FILM = 402  # p = wedge, squeeze, rolling_drive, rolling_loose, minimum, felt -> oil, see gap_film
    MOTION_HARMONIC = 501  # p = amplitude, frequency, phase -> amplitude * sin(2*pi*frequency*t + phase) on the drive


class Variable(IntEnum):
    """The variable of a tabulated torque."""

    SPEED = 0
    ANGLE = 1
    TIME = 2


class Gate(IntEnum):
    """When a torque row acts."""

    ALWAYS = 0
    FLIGHT = 1
    CONTACT = 2
    ACTIVE = 3
    REVERSE = 4


class Gear(IntEnum):
    """The gear that a flank row belongs to."""

    DRIVE = 0
    LOOSE = 1


class Flank(IntEnum):
    """The flank that a row belongs to."""

    ACTIVE = 0
    REVERSE = 1


class Row(NamedTuple):
    """One normal form with its numbers.

    Args:
        code: which form.
        gate: when it acts (torques only).
        p: the numbers of the form in SI units, at most WIDTH of them.
        table: points (abscissa, value) of a tabulated form, rising.
    """

    code: Code
    gate: Gate
    p: tuple[float, ...]
    table: tuple[tuple[float, float], ...] = ()


def torque_constant(torque: float, gate: Gate = Gate.ALWAYS) -> Row:
    """Coulomb torque against the direction of motion; ``torque`` in N·m."""
    return Row(Code.TORQUE_CONSTANT, gate, (torque,))


def torque_linear(coefficient: float, shaft_speed: float = 0.0, gate: Gate = Gate.ALWAYS) -> Row:
    """Torque proportional to speed; ``coefficient`` in N·m·s/rad, ``shaft_speed`` in rad/s."""
    return Row(Code.TORQUE_LINEAR, gate, (coefficient, shaft_speed))


def torque_power(coefficient: float, exponent: float, gate: Gate = Gate.ALWAYS) -> Row:
    """Torque as a power of speed; ``coefficient`` in N·m/(rad/s)^exponent."""
    return Row(Code.TORQUE_POWER, gate, (coefficient, exponent))


def torque_harmonic(order: float, amplitude: float, phase: float, gate: Gate = Gate.ALWAYS) -> Row:
    """Torque over the loose gear's angle; ``amplitude`` in N·m, ``phase`` in rad."""
    return Row(Code.TORQUE_HARMONIC, gate, (order, amplitude, phase))


def torque_relax(torque: float, time_constant: float, gate: Gate = Gate.ALWAYS) -> Row:
    """Coulomb torque that grows towards ``torque`` in N·m with ``time_constant`` in s."""
    return Row(Code.TORQUE_RELAX, gate, (torque, time_constant))


def torque_friction(coefficient: float) -> Row:
    """Friction in the mesh, ``coefficient``·Rb2·N with the flank force N; acts in contact and during impacts."""
    return Row(Code.TORQUE_FRICTION, Gate.CONTACT, (coefficient,))


def torque_table(variable: Variable, table: tuple[tuple[float, float], ...], gate: Gate = Gate.ALWAYS) -> Row:
    """Torque of free form over one variable, constant beyond the ends of its table.

    A positive torque resists forward rotation at any speed: it is subtracted from the loose gear's acceleration. A drag
    therefore has the sign of the speed, also for negative speeds. A table is continuous and holds nothing at rest; what
    jumps where the speed changes sign is a row :func:`torque_constant` in addition.

    Args:
        variable: that the torque depends on: the loose gear's speed, its angle, or time.
        table: points (rad/s, rad or s; N·m), rising; :func:`gears3d.effects.tabulate.tabulate` makes them of a law.
        gate: when it acts.
    """
    return Row(Code.TORQUE_TABLE, gate, (float(variable),), table)


def torque_carried(inertia: float, stiffness: float, damping: float = 0.0, play: float = 0.0) -> Row:
    """Spring to a carried body; ``inertia`` in kg·m², ``stiffness`` in N·m/rad, ``damping`` in N·m·s/rad.

    ``play`` in rad is the width of a dead band about no twist, across which the torque never pulls.
    """
    return Row(Code.TORQUE_CARRIED, Gate.ALWAYS, (inertia, stiffness, damping, play))


def flank_harmonic(gear: Gear, flank: Flank, order: int, amplitude: float, phase: float) -> Row:
    """Flank deviation over its own gear's angle at the moment of touching; ``amplitude`` in m, ``phase`` in rad."""
    return Row(Code.FLANK_HARMONIC, Gate.ALWAYS, (float(gear), float(flank), float(order), amplitude, phase))


def flank_tooth(gear: Gear, flank: Flank, tooth: int, offset: float) -> Row:
    """Flank deviation of a single tooth; ``offset`` in m."""
    return Row(Code.FLANK_TOOTH, Gate.ALWAYS, (float(gear), float(flank), float(tooth), offset))


def flank_eccentric(gear: Gear, offset: float, phase: float) -> Row:
    """Teeth whose axis is ``offset`` away from the axis of rotation, in m.

    ``phase`` in rad is the offset's direction when the gear's angle is 0, from the mate's axis in the gear's own sense
    of rotation.
    """
    return Row(Code.FLANK_ECCENTRIC, Gate.ALWAYS, (float(gear), offset, phase))


def impact_offset(offset: float) -> Row:
    """Constant added to the restitution coefficient."""
    return Row(Code.IMPACT_OFFSET, Gate.ALWAYS, (offset,))


def impact_slope(slope: float) -> Row:
    """Restitution that changes with impact speed; ``slope`` in s/m."""
    return Row(Code.IMPACT_SLOPE, Gate.ALWAYS, (slope,))


def impact_flank(asymmetry: float) -> Row:
    """Restitution that differs between the flanks by ``asymmetry``."""
    return Row(Code.IMPACT_FLANK, Gate.ALWAYS, (asymmetry,))


def impact_scatter(standard_deviation: float) -> Row:
    """Restitution with Gaussian scatter."""
    return Row(Code.IMPACT_SCATTER, Gate.ALWAYS, (standard_deviation,))


def gap_spring(stiffness: float, damping: float) -> Row:
    """Compliant flank; ``stiffness`` in N/m, ``damping`` in N·s/m along the transverse line of action."""
    return Row(Code.GAP_SPRING, Gate.ALWAYS, (stiffness, damping))


def gap_film(
    wedge: float, squeeze: float, rolling_drive: float, rolling_loose: float, minimum: float, felt: float = 0.0
) -> Row:
    """Oil on both flanks pushes with ``wedge·|u|/h - squeeze·min(ḣ, 0)/h^1.5``, with the gap h, at least ``minimum``.

    ``wedge`` in N·s, ``squeeze`` in N·s·m^0.5; u = rolling_drive·ω_drive + rolling_loose·ω_loose, both in m. The flanks
    touch at ``minimum``; a gap of less than ``felt`` counts as an impact or as contact over oil. Gaps are those along
    the transverse line of action, in m.
    """
    return Row(Code.GAP_FILM, Gate.ALWAYS, (wedge, squeeze, rolling_drive, rolling_loose, minimum, felt))


def motion_harmonic(amplitude: float, frequency: float, phase: float) -> Row:
    """Sine of the drive's speed; ``amplitude`` in rad/s, ``frequency`` in Hz, ``phase`` in rad."""
    return Row(Code.MOTION_HARMONIC, Gate.ALWAYS, (amplitude, frequency, phase))
