"""Lowering: from effects' rows and the drive's motion to the numbers of the packed model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gears3d.effects import Code, Flank, Gate, Gear, Rig, Row
from gears3d.effects.rows import flank_harmonic
from gears3d.errors import Fault, InputError
from gears3d.lumped import layout
from gears3d.lumped.tables import Table, torque_lines

FLIGHT, ACTIVE, REVERSE = 0, 1, 2  # phases of the motion; the flank of a contact phase is phase - 1

_ACTS = {
    Gate.ALWAYS: (FLIGHT, ACTIVE, REVERSE),
    Gate.FLIGHT: (FLIGHT,),
    Gate.CONTACT: (ACTIVE, REVERSE),
    Gate.ACTIVE: (ACTIVE,),
    Gate.REVERSE: (REVERSE,),
}


def torques(rig: Rig, rows: Sequence[Row]) -> tuple[np.ndarray, np.ndarray, list[Table]]:
    """Return the constant and linear torques by phase, all others, and the tables that these refer to."""
    base = np.zeros((3, 3))
    base[:, 0] = rig.drag_torque
    others, tables = [], []
    for row in rows:
        acts = _ACTS[Gate(row.gate)]
        if row.code == Code.TORQUE_CONSTANT:
            base[acts, 0] += row.p[0]
        elif row.code == Code.TORQUE_LINEAR:
            base[acts, 1] += row.p[0]
            base[acts, 2] += row.p[0] * row.p[1]
        elif row.code in (Code.TORQUE_POWER, Code.TORQUE_HARMONIC, Code.TORQUE_RELAX):
            mask = float(sum(1 << phase for phase in acts))
            others.append((float(row.code), mask, *row.p, *(0.0,) * (3 - len(row.p))))
        elif row.code == Code.TORQUE_TABLE:
            others.append((float(row.code), float(sum(1 << phase for phase in acts)), len(tables), 0.0, 0.0))
            tables.append(torque_lines(row))
    return base, np.array(others, dtype=float).reshape(-1, 5), tables


def motion(rig: Rig, harmonics: Sequence[tuple[float, ...]]) -> tuple[float, np.ndarray]:
    """Return the mean speed [rad/s] and the harmonics (n, 4); one of frequency 0 is part of the mean.

    A harmonic in is amplitude [rad/s], frequency [Hz], phase [rad]; out it is amplitude [rad/s], angular frequency
    [rad/s], phase [rad] and its cosine.
    """
    mean = rig.mean_speed + sum(a * np.sin(p) for a, f, p in harmonics if f == 0.0)
    moving = [(a, 2 * np.pi * f, p, np.cos(p)) for a, f, p in harmonics if f != 0.0]
    return mean, np.array(moving, dtype=float).reshape(-1, 4)


def flanks(rig: Rig, rows: Sequence[Row]) -> tuple[np.ndarray, float]:
    """Return the waves of the flanks, and the constant part on the reverse ones [m], which narrows the backlash.

    Both flanks of a gear share a wave where order and phase are the same.
    """
    waves: dict[tuple[float, ...], list[float]] = {}
    thicker = 0.0
    shifted = [wave for row in rows if row.code == Code.FLANK_ECCENTRIC for wave in eccentric(rig, row)]
    for row in (*rows, *shifted):
        if row.code == Code.FLANK_HARMONIC:
            gear, flank, order, amplitude, phase = row.p
            if order == 0.0 and flank == Flank.REVERSE:
                thicker += amplitude * np.cos(phase)
            else:
                waves.setdefault((gear, order, phase), [0.0, 0.0])[int(flank)] += amplitude
    return np.array([(*wave, *sizes) for wave, sizes in waves.items()], dtype=float).reshape(-1, 5), thicker


def eccentric(rig: Rig, row: Row) -> list[Row]:
    """Return the waves that eccentric teeth, a FLANK_ECCENTRIC, add to both flanks of their gear.

    To first order in the offset it is a wave of order 1 for either flank, the offset projected on the lines of action:
    they are inclined by the working pressure angle to the motion at the pitch point, and the normal of every flank is
    inclined towards the mate.

    >>> from gears3d.effects.rows import flank_eccentric
    >>> rig = Rig(0.1, 0.1, 0.1, 0.0, 1e-4, 0.0, 1.0, 20, 20, working_pressure_angle=0.0)
    >>> [wave.p for wave in eccentric(rig, flank_eccentric(Gear.DRIVE, 1e-5, np.pi / 2))]
    [(0.0, 0.0, 1.0, 1e-05, 0.0), (0.0, 1.0, 1.0, 1e-05, 3.141592653589793)]
    """
    gear, offset, phase = row.p
    forwards = Flank.ACTIVE if gear == Gear.DRIVE else Flank.REVERSE
    angle = rig.working_pressure_angle - 0.5 * np.pi
    return [
        flank_harmonic(Gear(gear), flank, 1, offset, phase + (angle if flank == forwards else -angle))
        for flank in Flank
    ]


def film(rows: Sequence[Row], backlash: float, waves: np.ndarray) -> np.ndarray:
    """Return wedge, squeeze, both rolling radii, smallest thickness and height over it at which the film acts, (6,).

    In N·s, N·s·√m, m, m, m, m; zeros without a film. ``backlash`` [m] is without the constant part on the reverse
    flanks; ``waves`` (n, 5) are those of :class:`gears3d.lumped.model.Model`. More than one film, or a film that fills
    the backlash, is an InputError.

    >>> from gears3d.effects.rows import gap_film
    >>> film([gap_film(1e-6, 1e-6, 0.01, 0.02, 2e-6, 12e-6)], 98e-6, np.zeros((0, 5)))[5]
    np.float64(1e-05)
    """
    films = [row.p for row in rows if row.code == Code.GAP_FILM]
    if not films:
        return np.zeros(6)
    if len(films) > 1:
        raise InputError(Fault("effect", f"there are {len(films)} oil films between the flanks", "give one oil_film"))
    wedge, squeeze, drive, loose, minimum, felt = films[0]
    backlash -= minimum  # on the reverse flanks
    if backlash <= minimum:
        raise InputError(
            Fault(
                "effect",
                f"the oil's smallest thickness of {minimum:.4g} m on both flanks fills the backlash",
                "give more backlash or a smaller minimum_thickness",
            )
        )
    smallest = backlash - minimum - np.abs(waves[:, 3] + waves[:, 4]).sum()
    return np.array([wedge, squeeze, drive, loose, minimum, max(min(felt - minimum, 0.25 * smallest), 1e-3 * minimum)])


def friction(rows: Sequence[Row]) -> float:
    """Return the mesh friction by flank force and base radius; friction that blocks the mesh is an InputError."""
    total = sum(row.p[0] for row in rows if row.code == Code.TORQUE_FRICTION)
    if not abs(total) < 1.0:
        raise InputError(
            Fault("effect", f"friction of {total:.4g} times the flank force blocks the mesh", "give less than 1")
        )
    return float(total)


def carried(rows: Sequence[Row]) -> np.ndarray:
    """Return inertia [kg·m²], stiffness [N·m/rad], damping [N·m·s/rad] and play [rad] of the carried body, (4,).

    More than one body is an InputError.
    """
    bodies = [row.p for row in rows if row.code == Code.TORQUE_CARRIED]
    if len(bodies) > 1:
        fault = Fault("effect", f"there are {len(bodies)} carried bodies", "give one carried_inertia")
        raise InputError(fault)
    return np.array(bodies[0] if bodies else (0.0,) * 4)


def gated(base: np.ndarray, torques: np.ndarray) -> np.ndarray:
    """Return whether torques differ between flight and contact on either flank, (2,).

    ``base`` (3, 3) holds constant and linear torques by phase, ``torques`` (n, 5) all others.
    """
    masks = torques[:, 1].astype(int)
    return np.array(
        [
            bool(np.any(base[phase] != base[FLIGHT]) or np.any((masks >> phase & 1) != (masks & 1)))
            for phase in (ACTIVE, REVERSE)
        ]
    )


def restitution(rig: Rig, rows: Sequence[Row]) -> np.ndarray:
    """Return e0, slope [s/m], asymmetry and standard deviation of the coefficient of restitution, (4,)."""

    def total(code: Code) -> float:
        return sum(row.p[0] for row in rows if row.code == code)

    spread = np.sqrt(sum(row.p[0] ** 2 for row in rows if row.code == Code.IMPACT_SCATTER))
    offset = rig.restitution + total(Code.IMPACT_OFFSET)
    return np.array([offset, total(Code.IMPACT_SLOPE), total(Code.IMPACT_FLANK), spread], dtype=float)


def rates(rig, spin, base, torques, flanks, fastest, springs, tables, drive, body) -> np.ndarray:
    """Return how fast the fastest part of the motion changes in flight and on either flank [1/s], (3,)."""
    ratio = rig.base_radius_drive / rig.base_radius_loose
    slow = [spin[:, 1].max(initial=0.0), float(np.abs(base[:, 1]).max()) / rig.inertia]
    for gear, order, *_ in flanks:
        slow.append(abs(order) * fastest * (ratio if gear else 1.0))
    for code, _, first, second, _ in torques:
        if code == Code.TORQUE_HARMONIC:
            slow.append(abs(first) * fastest * ratio)
        elif code == Code.TORQUE_RELAX:
            slow.append(1.0 / abs(second))
        elif code == Code.TORQUE_POWER:  # its series converges only as far as the speed keeps its sign
            speed = max(abs(rig.mean_speed) * ratio, 1e-3)
            slowing = np.abs(base[:, 0]).max() + abs(first) * speed**second
            slow.append(3.0 * max(1.0, abs(second)) * slowing / (rig.inertia * speed))
        elif code == Code.TORQUE_TABLE:
            table = tables[int(first)]
            steepest = np.abs(table.pieces[:, 2]).max() / rig.inertia
            slow.append({layout.OMEGA2: steepest, layout.THETA2: np.sqrt(steepest)}.get(table.variable, 0.0))
    if body[0] > 0.0:
        light = 1.0 / rig.inertia + 1.0 / body[0]
        slow.append(float(np.sqrt(body[1] * light) + body[2] * light))
    if drive is not None:
        slow.append(1.0 / float(np.median(np.diff(drive.knots[1:-1]))))
    stiffness, damping = springs
    mass = rig.inertia / rig.base_radius_loose**2
    flight = max(*slow, 1e-3)
    return np.array([flight, *[flight + np.sqrt(stiffness / mass) + damping / mass] * 2])
