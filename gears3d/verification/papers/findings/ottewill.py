"""Ottewill et al. 2010: the contours of case iv lie half a turn beside those of the model."""

from __future__ import annotations

from math import pi
from typing import TYPE_CHECKING

import numpy as np

from gears3d.verification.papers.findings.question import Question, Suspect
from gears3d.verification.papers.findings.shown import shown
from gears3d.verification.papers.findings.suspicion import of
from gears3d.verification.papers.measures.errors import disconnections, shift

if TYPE_CHECKING:
    from gears3d.verification.papers.bench import Bench

CASE = "ottewill-2010/case-iv"
AMPLITUDES = (0.40, 0.44)
PHASES = tuple(2 * pi * i / 16 for i in range(16))
"""Points of the contours compared: amplitudes and phases of the drive [rad]."""
ALIKE = 0.5
"""Correlation of the shifted contour with the model's that counts as the same general shape."""
MESH = 0.019 * 2 * pi
"""Printed drag of the mesh at 1 Hz, with the inertia assumed [N·m]."""
QUANTUM = 8.5
"""One count of the encoders at the pitch circle [µm]."""


def drawn(bench: Bench, suspect: Suspect | None = None, size: float = 0.0, phase: float = 0.0) -> np.ndarray:
    """Return the disconnections of case iv with a suspect [rad], (2, 16).

    Args:
        bench: of the papers.
        suspect: one of :data:`QUESTION`'s; none for the model as it is.
        size: of it.
        phase: of it [rad].
    """
    points = [(amplitude, turn) for amplitude in AMPLITUDES for turn in PHASES]
    rig = bench.scenario(CASE).rig()
    more = suspect.make(rig, size, phase) if suspect is not None and size else ()
    found = disconnections(bench.case(CASE), points, more=more)
    return found.reshape(len(AMPLITUDES), len(PHASES))


def values(bench: Bench, suspect: Suspect, size: float, phase: float) -> np.ndarray:
    """Return the shift of the contours [rad] and how like the model's they are when shifted back, (2,).

    Args:
        bench: of the papers.
        suspect: one of :data:`QUESTION`'s.
        size: of it.
        phase: of it [rad].
    """
    plain = bench.once("ottewill-2010 findings", lambda: drawn(bench))
    other = drawn(bench, suspect, size, phase)
    if not (np.ptp(plain) > 0.0 and np.ptp(other) > 0.0):
        return np.zeros(2)
    steps = round(shift(plain, other) / (2 * pi) * len(PHASES))
    each = [np.corrcoef(np.roll(plain, way * steps, axis=1).ravel(), other.ravel())[0, 1] for way in (1, -1)]
    return np.array([shift(plain, other), max(each)])


def channel(bench: Bench, suspect: Suspect, size: float, phase: float) -> str:
    """Return what a record of case iv would show.

    Args:
        bench: of the papers.
        suspect: one of :data:`QUESTION`'s.
        size: of it.
        phase: of it [rad].
    """
    rig = bench.scenario(CASE).rig()
    return shown(rig, suspect.make(rig, size, phase))


ROUND = tuple(pi / 4 + pi * i / 2 for i in range(4))
SUSPECTS = (
    *(
        Suspect(f"drag_position, order {n}", "of the mesh drag", 0.5, "half of it", steps=5, phases=ROUND,
                make=lambda rig, size, phase, n=n: of("drag_position", amplitude=size * MESH, order=n, phase=phase))
        for n in (1, 2)
    ),
    *(
        Suspect(f"drive_motion, order {n}", "mrad, fixed to the shaft", 20.0, "a twentieth of the swing", phases=ROUND,
                steps=4, make=lambda rig, size, phase, n=n: of(
                    "drive_motion", amplitude=1e-3 * size, amplitude_family="angle", order=n, phase=phase))
        for n in (1, 2, 3)
    ),
    *(
        Suspect(f"transmission_error, order {n}", "µm", bound, because, phases=ROUND, steps=3,
                make=lambda rig, size, phase, n=n: of(
                    "transmission_error", amplitude=1e-6 * size, order=n, phase=phase))
        for n, bound, because in (
            (1, 51.0, "the printed error"), (17, QUANTUM, "one count"), (18, QUANTUM, "one count"),
            (19, QUANTUM, "one count"), (36, QUANTUM / 2, "half a count"),
        )
    ),
    Suspect("eccentricity", "µm", 51.0, "the printed error", phases=ROUND, steps=2,
            make=lambda rig, size, phase: of("eccentricity", offset=1e-6 * size, phase=phase)),
    Suspect("mesh_friction", "coefficient", 0.3, "dry steel", steps=3,
            make=lambda rig, size, phase: of("mesh_friction", coefficient=size)),
    Suspect("mesh_drag, more", "of δ in contact", 1.9, "twice the printed", steps=3,
            make=lambda rig, size, phase: of("mesh_drag", coefficient=0.01 * size)),
    Suspect("mesh_drag, less", "of δ in contact", 1.9, "none", steps=3,
            make=lambda rig, size, phase: of("mesh_drag", coefficient=-0.01 * size)),
    Suspect("drag_viscous", "of δ", 2.3, "twice the printed", steps=3,
            make=lambda rig, size, phase: of("drag_viscous", coefficient=0.01 * size)),
    Suspect("drag_coulomb", "of the mesh drag", 1.0, "all of it", steps=3,
            make=lambda rig, size, phase: of("drag_coulomb", torque=size * MESH)),
    Suspect("backlash_offset", "µm", 500.0, "a third of the backlash", steps=3,
            make=lambda rig, size, phase: of("backlash_offset", offset=1e-6 * size)),
    Suspect("backlash_variation, order 1", "µm", 102.0, "twice the printed error", phases=ROUND, steps=2,
            make=lambda rig, size, phase: of("backlash_variation", amplitude=1e-6 * size, order=1, phase=phase)),
    Suspect("restitution_offset", "of e", 0.5, "the drive takes impacts up", steps=3,
            make=lambda rig, size, phase: of("restitution_offset", offset=size)),
)  # fmt: skip

QUESTION = Question(
    title="Ottewill et al. 2010: case iv is shifted by π",
    asks="Fig. 9: in case iv the rig's contours of disconnection over amplitude and phase of the drive lie about π"
    " beside the model's, alike in shape; the authors suspect friction that varies with load. A suspect must "
    "shift the model's contours by π ± 0.5 and leave their shape (correlation above 0.5). The orders of the "
    "error are not printed but assumed, and the scan is coarse, a few sizes and four phases: sizes hold for "
    "that error, and what cannot is what did not within it.",
    columns="shift [rad]; likeness when shifted back",
    suspects=SUSPECTS,
    values=values,
    scalar=lambda found: float(found[0]) if found[1] > ALIKE else 0.0,
    target=pi,
    tolerance=0.5,
    holds=lambda found: bool(pi - found[0] <= 0.5 and found[1] > ALIKE),
    told=lambda found: f"{found[0]:.1f}; {found[1]:.2f}",
    shown=channel,
    left_out=("pitch_error", "tooth_compliance", "oil_film", "drag_differential", "drag_power", "restitution_asymmetry",
              "restitution_speed", "restitution_scatter", "encoder_skew", "encoder_eccentricity",
              "carried_inertia"),
    decides="A run-down of the meshed pair, its deceleration taken over the angle of the shaft and not averaged over "
    "a turn: a drag that wanders once a turn stands there, and in `flight` of any record with rattle, folded "
    "over the loose gear's angle. It is the only cause found, and its phase was free. Friction in proportion "
    "to the load, which the authors suspect, is zero where contact is lost and moves nothing. A drive that "
    "distorts, transmission errors of every order tried and eccentricity move the contours by less than half "
    "of the way. No simulation can tell one more way: phases are counted from the eccentricity, so if the "
    "order 1 that the encoders read is partly their own eccentricity, and larger and opposed, and the axes of"
    " the two figures do not come from the same record, the axis itself is off by π though nothing moves. An "
    "index mark on the gear, or a second record with one encoder turned by half a turn, decides that; from "
    "print it cannot be decided.",
)  # fmt: skip
