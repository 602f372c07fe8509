"""The rigid model's numbers as the compiled kernel takes them: bare floats and small arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.effects import Code, Flank, Gate, Gear, Rig, Row
from gears3d.effects.rows import flank_harmonic
from gears3d.errors import Fault, InputError
from gears3d.lumped import layout

FLIGHT, ACTIVE, REVERSE = 0, 1, 2
"""Phases of the motion; the flank of a contact phase is phase - 1."""

_ACTS = {
    Gate.ALWAYS: (FLIGHT, ACTIVE, REVERSE),
    Gate.FLIGHT: (FLIGHT,),
    Gate.CONTACT: (ACTIVE, REVERSE),
    Gate.ACTIVE: (ACTIVE,),
    Gate.REVERSE: (REVERSE,),
}

_KNOWN = (
    Code.TORQUE_CONSTANT, Code.TORQUE_LINEAR, Code.TORQUE_POWER, Code.TORQUE_HARMONIC, Code.TORQUE_RELAX,
    Code.TORQUE_FRICTION, Code.FLANK_HARMONIC, Code.FLANK_ECCENTRIC, Code.MOTION_HARMONIC, Code.IMPACT_OFFSET, 
    Code.IMPACT_SLOPE, Code.IMPACT_FLANK, Code.IMPACT_SCATTER, Code.GAP_SPRING,
)  # fmt: skip


class Model(NamedTuple):
    """What the kernel computes with; J, Rb, b ... of Kadmiri et al. 2012 and Rigaud & Perret-Liaudet 2020.

    Args:
        radius_drive: base radius [m].
        radius_loose: base radius [m].
        inertia: of the loose gear [kg·m²].
        backlash: between flanks that carry nothing but their waves [m].
        mean: drive speed [rad/s].
        harmonics: amplitude [rad/s], angular frequency [rad/s], phase [rad], its cosine; (n, 4).
        base: Coulomb torque [N·m], linear coefficient [N·m·s/rad], constant of the linear rows [N·m] by phase; (3, 3).
        torques: code, bit mask of phases, three numbers; the other torque rows; (n, 5).
        flanks: gear, order, phase [rad], amplitude on the active and on the reverse flank [m]; (n, 5).
        restitution: e0, slope [s/m], asymmetry, standard deviation; (4,).
        stick_velocity: rebound speed below which contact is permanent [m/s].
        stiffness: of the flanks [N/m], 0 when rigid.
        damping: of the flanks [N·s/m].
        rate: of the fastest change along the motion, by phase [1/s]; (3,).
        friction: torque of the mesh's friction by flank force and base radius of the loose gear.
        rest: loose speed that counts as rest [rad/s].
        unfelt: acceleration of the gap that is rounding [m/s²].
        gated: whether torques differ between flight and contact on a flank, (2,).
        seed: of the scatter.
    """

    radius_drive: float
    radius_loose: float
    inertia: float
    backlash: float
    mean: float
    harmonics: np.ndarray
    base: np.ndarray
    torques: np.ndarray
    flanks: np.ndarray
    restitution: np.ndarray
    stick_velocity: float
    stiffness: float
    damping: float
    friction: float
    rate: np.ndarray
    rest: float
    unfelt: float
    gated: np.ndarray
    seed: int

    def flat(self) -> np.ndarray:
        """Return the numbers one after the other, as :mod:`gears3d.lumped.layout` has them.

        One plain array costs the compiled code nothing to hand on; a structure of arrays costs it ten times its work.
        """
        sizes = [len(self.harmonics), len(self.torques), len(self.flanks)]
        torques = layout.HARMONICS + layout.PER_HARMONIC * sizes[0]
        scalars = [
            self.radius_drive, self.radius_loose, self.inertia, self.backlash, self.mean, self.stick_velocity,
            self.stiffness, self.damping, self.rest, self.unfelt, self.seed,
            self.friction,
        ]  # fmt: skip
        simple = sizes == [1, 0, 0] and self.stiffness == 0.0 and not self.base[:, 1].any()
        simple = simple and self.harmonics[0, 0] > 0.0
        on_loose = bool(self.flanks[:, 0].any())
        places = [torques, torques + layout.PER_TORQUE * sizes[1], simple, on_loose]
        arrays = [self.rate, self.gated, self.restitution, self.base, self.harmonics, self.torques, self.flanks]
        return np.concatenate([scalars, sizes, places, *(np.ravel(a) for a in arrays)]).astype(float)


def model(
    rig: Rig,
    harmonics: Sequence[tuple[float, float, float]],
    rows: Sequence[Row] = (),
    stick_velocity: float = 1e-4,
    seed: int = 0,
) -> Model:
    """Pack the base model, the drive's motion and the effects' rows for the kernel.

    Args:
        rig: constants of the base model.
        harmonics: amplitude [rad/s], frequency [Hz], phase [rad] of each.
        rows: normal forms of the effects.
        stick_velocity: rebound speed below which contact is permanent [m/s].
        seed: of the scatter.

    Returns:
        The packed model.

    Raises:
        InputError: a row's normal form is not one that the rigid model has.

    >>> rig = Rig(0.148, 0.148, 0.0695, 0.22, 250e-6, 0.0, 3.1, 90, 90)
    >>> model(rig, [(2.0, 3.0, 0.0)]).base[0].tolist()
    [0.22, 0.0, 0.0]
    """
    _refuse_unknown(rows)
    mean, spin = _motion(rig, [*harmonics, *(row.p for row in rows if row.code == Code.MOTION_HARMONIC)])
    base, torques = _torques(rig, rows)
    flanks, thinner = _flanks(rig, rows)
    springs = [row.p for row in rows if row.code == Code.GAP_SPRING]
    stiffness, damping = (float(sum(p[i] for p in springs)) for i in (0, 1))
    fastest = abs(mean) + np.abs(spin[:, 0]).sum()
    heaviest = np.abs(base[:, 0]).max() * rig.base_radius_loose / rig.inertia
    rate = _rates(rig, spin, base, torques, flanks, fastest, stiffness, damping)
    return Model(
        radius_drive=float(rig.base_radius_drive),
        radius_loose=float(rig.base_radius_loose),
        inertia=float(rig.inertia),
        backlash=float(rig.backlash - thinner),
        mean=float(mean),
        harmonics=spin,
        base=base,
        torques=torques,
        flanks=flanks,
        restitution=_restitution(rig, rows),
        stick_velocity=float(stick_velocity),
        stiffness=stiffness,
        damping=damping,
        friction=_friction(rows),
        rate=rate,
        rest=float(max(1e-13 * fastest, 1e-300)),
        unfelt=float(1e-12 * (rig.base_radius_drive * fastest * rate[0] + heaviest)),
        gated=_gated(base, torques),
        seed=int(seed),
    )


def _refuse_unknown(rows: Sequence[Row]) -> None:
    for row in rows:
        if row.code == Code.FLANK_TOOTH:
            raise InputError(
                Fault(
                    "effect",
                    "a deviation of a single tooth has no place in the rigid model, which knows no tooth pairs",
                    "run it with --model bullet --twin none",
                )
            )
        if row.code not in _KNOWN:
            raise InputError(Fault("effect", f"normal form {row.code!r} is unknown to the rigid model"))


def _torques(rig: Rig, rows: Sequence[Row]) -> tuple[np.ndarray, np.ndarray]:
    base = np.zeros((3, 3))
    base[:, 0] = rig.drag_torque
    others = []
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
    return base, np.array(others, dtype=float).reshape(-1, 5)


def _motion(rig: Rig, harmonics: Sequence[tuple[float, ...]]) -> tuple[float, np.ndarray]:
    """Mean speed, and the harmonics that move; one of no frequency is part of the mean."""
    mean = rig.mean_speed + sum(a * np.sin(p) for a, f, p in harmonics if f == 0.0)
    moving = [(a, 2 * np.pi * f, p, np.cos(p)) for a, f, p in harmonics if f != 0.0]
    return mean, np.array(moving, dtype=float).reshape(-1, 4)


def _flanks(rig: Rig, rows: Sequence[Row]) -> tuple[np.ndarray, float]:
    """Waves of the flanks, and what is constant on the reverse ones, which narrows the backlash.

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
    """Return what teeth off their axis add to both flanks of their gear, to first order in the offset.

    The offset projected on the lines of action: they are inclined by the working pressure angle to the motion at the
    pitch point, and every flank's normal leans towards the mate.

    Args:
        rig: constants of the base model.
        row: a FLANK_ECCENTRIC.

    Returns:
        A wave of order 1 for either flank.

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


def _friction(rows: Sequence[Row]) -> float:
    total = sum(row.p[0] for row in rows if row.code == Code.TORQUE_FRICTION)
    if not abs(total) < 1.0:
        raise InputError(
            Fault("effect", f"friction of {total:.4g} times the flank force blocks the mesh", "give less than 1")
        )
    return float(total)


def _gated(base: np.ndarray, torques: np.ndarray) -> np.ndarray:
    masks = torques[:, 1].astype(int)
    return np.array(
        [
            bool(np.any(base[phase] != base[FLIGHT]) or np.any((masks >> phase & 1) != (masks & 1)))
            for phase in (ACTIVE, REVERSE)
        ]
    )


def _restitution(rig: Rig, rows: Sequence[Row]) -> np.ndarray:
    def total(code: Code) -> float:
        return sum(row.p[0] for row in rows if row.code == code)

    spread = np.sqrt(sum(row.p[0] ** 2 for row in rows if row.code == Code.IMPACT_SCATTER))
    offset = rig.restitution + total(Code.IMPACT_OFFSET)
    return np.array([offset, total(Code.IMPACT_SLOPE), total(Code.IMPACT_FLANK), spread], dtype=float)


def _rates(rig, spin, base, torques, flanks, fastest, stiffness, damping) -> np.ndarray:
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
    mass = rig.inertia / rig.base_radius_loose**2
    flight = max(*slow, 1e-3)
    return np.array([flight, *[flight + np.sqrt(stiffness / mass) + damping / mass] * 2])
