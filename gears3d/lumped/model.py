"""The rigid model's numbers for the compiled kernel: floats and small arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gears3d.effects import Code, Rig, Row
from gears3d.effects.support import takes
from gears3d.errors import Fault, InputError
from gears3d.lumped import layout, lower
from gears3d.lumped.tables import Table, pack

TOLERANCE = 1e-9  # default tolerance of the integrator's steps
FLANKS = (Code.FLANK_HARMONIC, Code.FLANK_TOOTH, Code.FLANK_ECCENTRIC)


class Teeth(NamedTuple):
    """Compliant teeth that vary along their mesh, with friction that follows the contact along them.

    Args:
        table: piecewise polynomials over one pitch of the drive from angle 0 on, of both flanks: stiffness [N/m], what
            friction adds to the force of the teeth, and the same of sheared oil [m]; (n, 6, 8), highest powers first.
        count: of the drive's teeth.
        critical: damping by the root of the stiffness [kg^0.5]; 0: the damping is that of the model.
        ramp: depth over which the damping increases to its value [m]; 0: it acts at once.
        layer: gap at which the teeth touch [m].
        published: whether they replace the oil there, and may pull.
        shearing: force of sheared oil by speed, length and thickness^(-1/2) [N·s·m^(-1/2)].
    """

    table: np.ndarray
    count: int
    critical: float
    ramp: float
    layer: float
    published: bool
    shearing: float


class Model(NamedTuple):
    """The kernel's parameters; J, Rb, b ... of Kadmiri et al. 2012 and Rigaud & Perret-Liaudet 2020.

    Args:
        radius_drive: base radius [m].
        radius_loose: base radius [m].
        inertia: of the loose gear [kg·m²].
        backlash: between flanks without deviations other than their waves [m].
        mean: drive speed [rad/s].
        harmonics: amplitude [rad/s], angular frequency [rad/s], phase [rad], its cosine; (n, 4).
        base: Coulomb torque [N·m], linear coefficient [N·m·s/rad], constant of the linear rows [N·m] by phase; (3, 3).
        torques: code, bit mask of phases, three numbers; the other torque rows; (n, 5).
        flanks: gear, order, phase [rad], amplitude on the active and on the reverse flank [m]; (n, 5).
        restitution: e0, slope [s/m], asymmetry, standard deviation; (4,).
        stick_velocity: rebound speed below which contact is permanent [m/s].
        stiffness: of the flanks [N/m], 0 when rigid.
        damping: of the flanks [N·s/m].
        film: of the oil, as :func:`gears3d.lumped.lower.film` gives it; (6,).
        carried: inertia of the carried body [kg·m²], stiffness [N·m/rad] and damping [N·m·s/rad] of its spring, and
            play [rad]; zeros without one, (4,).
        rate: of the fastest change along the motion, by phase [1/s]; (3,).
        friction: torque of the mesh's friction by flank force and base radius of the loose gear.
        rest: loose speed that counts as rest [rad/s].
        unfelt: acceleration of the gap that is rounding [m/s²].
        gated: whether torques differ between flight and contact on a flank, (2,).
        seed: of the scatter.
        tables: piecewise polynomials that torques, flanks and the drive's motion refer to.
        drive_table: place of the drive's angle [rad] over time among them, -1: none.
        flank_tables: place of the material on the active flanks [m] over the drive's angle, -1: none; that of the
            reverse flanks is the next.
        tolerance: of steps of the integrator, relative to gaps and their rates.
        settle: time from which on the rate of the mesh force counts [s], -1: never.
        works: whether works of all forces are summed.
        teeth: compliant ones that vary along their mesh, in place of ``stiffness`` and ``damping``.
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
    film: np.ndarray
    carried: np.ndarray
    rate: np.ndarray
    rest: float
    unfelt: float
    gated: np.ndarray
    seed: int
    tables: tuple[Table, ...] = ()
    drive_table: int = -1
    flank_tables: int = -1
    tolerance: float = TOLERANCE
    settle: float = -1.0
    works: bool = False
    teeth: Teeth | None = None

    def has_closed_form(self) -> bool:
        """Whether flanks are perfect, torques constant, and the drive has one harmonic at most."""
        plain = len(self.harmonics) <= 1 and not len(self.torques) and not len(self.flanks) and not self.tables
        rigid = self.stiffness == 0.0 and not self.base[:, 1:].any() and not self.film.any() and not self.carried.any()
        return plain and rigid and bool((self.harmonics[:, 0] >= 0.0).all() and (self.harmonics[:, 1] > 0.0).all())

    def flat(self) -> np.ndarray:
        """Return the numbers one after the other, as :mod:`gears3d.lumped.layout` has them.

        Compiled code passes one plain array at no cost; a structure of arrays costs ten times the computation.
        """
        harmonics = self.harmonics
        simple = self.has_closed_form()
        if simple and not len(harmonics):
            harmonics = np.array([[0.0, 1.0, 0.0, 1.0]])
        sizes = [len(harmonics), len(self.torques), len(self.flanks)]
        torques = layout.HARMONICS + layout.PER_HARMONIC * sizes[0]
        flanks = torques + layout.PER_TORQUE * sizes[1]
        tables = flanks + layout.PER_FLANK * sizes[2]
        packed = pack(self.tables, tables)
        own = self.teeth
        if own is None:
            teeth = [self.film[4], *[0.0] * 7]
        else:
            teeth = [own.layer, own.critical, own.ramp, own.published, own.shearing, tables + len(packed)]
            teeth += [len(own.table), own.count]
            packed = np.concatenate([packed, own.table.ravel()])
        scalars = [
            self.radius_drive, self.radius_loose, self.inertia, self.backlash, self.mean, self.stick_velocity,
            self.stiffness, self.damping, self.rest, self.unfelt, self.seed,
            self.friction, *self.film, *self.carried, self.tolerance, self.settle, self.works, *teeth,
        ]  # fmt: skip
        on_loose = bool(self.flanks[:, 0].any())
        deviates = sizes[2] > 0 or self.flank_tables >= 0
        reverse = self.flank_tables + 1 if self.flank_tables >= 0 else -1
        places = [
            torques, flanks, simple, on_loose, deviates, 12 if self.tables else 5, len(self.tables), tables,
            self.drive_table, self.flank_tables, reverse,
        ]  # fmt: skip
        arrays = [self.rate, self.gated, self.restitution, self.base, harmonics, self.torques, self.flanks]
        return np.concatenate([scalars, sizes, places, *(np.ravel(a) for a in arrays), packed]).astype(float)


def model(
    rig: Rig,
    harmonics: Sequence[tuple[float, float, float]],
    rows: Sequence[Row] = (),
    stick_velocity: float = 1e-4,
    seed: int = 0,
    flanks: tuple[Table, Table] | None = None,
    drive: Table | None = None,
    teeth: Teeth | None = None,
    tolerance: float = TOLERANCE,
) -> Model:
    """Pack the base model, the drive's motion and the effects' rows for the kernel.

    A harmonic is amplitude [rad/s], frequency [Hz] and phase [rad]; ``stick_velocity`` [m/s] is the rebound speed below
    which contact is permanent; ``seed`` is that of the scatter. ``flanks``, tables of the displacement of active and
    reverse flanks, replace all rows of flanks; ``drive``, angle [rad] over time, replaces the mean speed; ``teeth`` are
    compliant teeth that vary along their mesh; ``tolerance`` is that of the integrator's steps. A row of another normal
    form than the rigid model's is an InputError.

    >>> rig = Rig(0.148, 0.148, 0.0695, 0.22, 250e-6, 0.0, 3.1, 90, 90)
    >>> model(rig, [(2.0, 3.0, 0.0)]).base[0].tolist()
    [0.22, 0.0, 0.0]
    """
    if flanks is not None:
        rows = [row for row in rows if row.code not in FLANKS]
    _refuse_unknown(rows)
    springs = [row.p for row in rows if row.code == Code.GAP_SPRING]
    stiffness, damping = (float(sum(p[i] for p in springs)) for i in (0, 1))
    if teeth is not None:
        stiffness = float(teeth.table[:, layout.TOOTH_STIFFNESS : layout.LEVER, -1].mean())
        if teeth.critical > 0.0:
            damping = teeth.critical * stiffness**0.5
    mean, spin = lower.motion(rig, [*harmonics, *(row.p for row in rows if row.code == Code.MOTION_HARMONIC)])
    mean = 0.0 if drive is not None else mean
    base, torques, tables = lower.torques(rig, rows)
    waves, thinner = lower.flanks(rig, rows)
    body = lower.carried(rows)
    film = lower.film(rows, rig.backlash - thinner, waves)
    fastest = abs(mean) + np.abs(spin[:, 0]).sum() + (np.abs(drive.pieces[:, 2]).max() if drive is not None else 0.0)
    heaviest = np.abs(base[:, 0]).max() * rig.base_radius_loose / rig.inertia
    rate = lower.rates(rig, spin, base, torques, waves, fastest, (stiffness, damping), tables, drive, body)
    return Model(
        radius_drive=float(rig.base_radius_drive),
        radius_loose=float(rig.base_radius_loose),
        inertia=float(rig.inertia),
        backlash=float(rig.backlash - thinner - (film[4] if teeth is None else teeth.layer)),
        mean=float(mean),
        harmonics=spin,
        base=base,
        torques=torques,
        flanks=waves,
        restitution=lower.restitution(rig, rows),
        stick_velocity=float(stick_velocity),
        stiffness=stiffness,
        damping=damping,
        friction=lower.friction(rows),
        film=film,
        carried=body,
        rate=rate,
        rest=float(max(1e-13 * fastest, 1e-300)),
        unfelt=float(1e-12 * (rig.base_radius_drive * fastest * rate[0] + heaviest)),
        gated=lower.gated(base, torques),
        seed=int(seed),
        tables=(*tables, *(flanks or ()), *([drive] if drive is not None else [])),
        drive_table=len(tables) + len(flanks or ()) if drive is not None else -1,
        flank_tables=len(tables) if flanks else -1,
        tolerance=tolerance,
        teeth=teeth,
    )


def _refuse_unknown(rows: Sequence[Row]) -> None:
    for row in rows:
        if row.code == Code.FLANK_TOOTH:
            raise InputError(
                Fault(
                    "effect",
                    "a deviation of a single tooth has no place in a model that knows no tooth pairs",
                    "give the model tables of the flanks, gears3d.lumped.flanks",
                )
            )
        if not takes("rigid", row):
            raise InputError(Fault("effect", f"normal form {row.code!r} is unknown to the rigid model"))
