"""Where the kernel keeps its state, counters and power series.

A power series is a row of the work array: the coefficient of τ^k at index k, τ being the time since the start of the
step. Over a step every quantity of the motion is such a polynomial, exact to rounding.
"""

from __future__ import annotations

from math import factorial
from typing import NamedTuple

import numpy as np

ORDER = 20  # highest order of the series

# rows of the work array
# GAP, DEVIATION and TABLED take a row a flank (DEVIATION + 2*gear + flank); the effects' own begin at ROWS.
(
    OMEGA1, THETA1, OMEGA2, THETA2, S, GAP, TORQUE, DEVIATION, REACTION, DRY, SCRATCH, TABLED, ROWS,
) = 0, 1, 2, 3, 4, 5, 7, 8, 12, 13, 14, 15, 17  # fmt: skip

# the model's numbers, one after the other
(
    RADIUS_DRIVE, RADIUS_LOOSE, INERTIA, BACKLASH, MEAN, STICK_VELOCITY, STIFFNESS, DAMPING, REST, UNFELT, SEED,
    FRICTION,
    WEDGE, SQUEEZE, ROLL_DRIVE, ROLL_LOOSE, FLOOR, FELT,
    CARRIED, TORSION, TORSION_DAMPING, PLAY, TOLERANCE, SETTLE, SUMMED,
    LAYER, CRITICAL, RAMP, PUBLISHED, SHEARING, AT_TEETH, POINTS, TEETH,
    N_HARMONICS, N_TORQUES, N_FLANKS, AT_TORQUES, AT_FLANKS, SIMPLE,
    ON_LOOSE, DEVIATES, LEAST_ORDER, N_TABLES, AT_TABLES, DRIVE_TABLE, FLANK_TABLE, FLANK_TABLE_REVERSE,
    SCALARS,
) = range(48)  # fmt: skip
RATE, GATED, RESTITUTION, BASE, HARMONICS = SCALARS, SCALARS + 3, SCALARS + 5, SCALARS + 9, SCALARS + 18
PER_HARMONIC, PER_TORQUE, PER_FLANK = 4, 5, 5

# columns of the table of compliant teeth over a pitch of the drive, of both flanks: stiffness, lever of friction, lever
# of shearing oil
TOOTH_STIFFNESS, LEVER, SHEAR, TOOTH_COLUMNS = 0, 2, 4, 6
PER_POINT = 8  # coefficients of a polynomial, the highest first

# a table: row of its variable (TIME_TABLE: time), number and width of its pieces, period, where knots and pieces lie
VARIABLE, PIECES, WIDTH, PERIOD, AT_KNOTS, AT_PIECES, PER_TABLE = range(7)
TIME_TABLE = -1

# state
TIME, DISPLACEMENT, ANGLE, SPEED, DRIVE_SPEED, MODE, SIGN, SLIDE = range(8)
GAPS, RATES = 8, 10  # of both flanks
DEPARTED, HEIGHT, LIFT, GUESS, HOLD, CONTACT_SINCE = range(12, 18)
ENTRY, ENTRY_VELOCITY, IMPULSE, PASSED, LAST_IMPACT, ENTRY_HEIGHT, ENTRY_PLACE, MARK = range(18, 26)
IMPACT_ROW, CONTACT_ROW = 26, 33  # rows that a step writes
SENSE, SQUEEZED, WITHIN, TURNED = 36, 37, 39, 40  # of the oil films; SQUEEZED of both flanks
INSIDE, STEP = 41, 43  # of compliant teeth: of both flanks CLEAR, SUNK or PUSHES; next step of the integrator
TWIST, TWIST_RATE, TWISTED, TWISTING = 44, 45, 46, 47  # of the carried body: side of the play, whether it pushes there
TRIED, ERROR = 48, 49  # the last step of the integrator, and the eighth root of its error in parts of the tolerance
MESH_FORCE, JERK, RISING = 50, 51, 52  # the last force of the mesh, the integral of its rate squared, time over which
WORKS = (
    53  # of the mesh on the loose gear, drag, friction; spring, damping, squeeze, wedge on the gaps; drive on the mesh
)
N_WORKS = 8
STATE = 61  # after it the state holds two numbers a table: the piece it is in, and the turns before it [rad]

# modes; those of contact and spring hold for the active flank, one more is the reverse flank
BEFORE, FREE, STUCK, PRESSED = -1, 0, 1, 3

# whether the teeth of a flank are pressed in, and push
CLEAR, SUNK, PUSHES = range(3)

# counters
(
    N_IMPACTS,
    N_CONTACTS,
    N_SAMPLES,
    TOTAL,
    BOUNCES,
    CONTACTS,
    GRAZING,
    ZENO,
    STALL,
    STEPS,
    IDLE,
    HAS_IMPACT,
    HAS_CONTACT,
    TOUCHES,
) = range(14)
COUNTERS = 14

# how a stretch of the run ended
DONE, IMPACTS_FULL, CONTACTS_FULL, BROKEN, STANDSTILL = range(5)

IMPACT_COLUMNS = 7  # time, flank, velocity, rebound, impulse, displacement, flight height
# Time, both angles, both speeds, displacement, its rate, and from FORCES on the forces of both flanks.
FORCES, SAMPLE_COLUMNS = 7, 9

INVERSE = np.array([0.0, *[1.0 / k for k in range(1, ORDER + 2)]])  # 1/k

# Largest rate*step that a series of order n + 1 covers to rounding, at index n.
REACH = np.array([(factorial(n) * 1e-14) ** (1.0 / n) for n in range(1, ORDER + 1)])


class Buffers(NamedTuple):
    """Arrays that the kernel fills.

    Args:
        work: power series, (rows, ORDER + 2).
        impacts: one row an impact, (n, IMPACT_COLUMNS).
        contacts: flank, start [s], end [s], (n, 3).
        samples: the signals at multiples of ``spacing``, (n, SAMPLE_COLUMNS).
        spacing: time between samples [s].
    """

    work: np.ndarray
    impacts: np.ndarray
    contacts: np.ndarray
    samples: np.ndarray
    spacing: float


def buffers(effect_rows: int, impacts: int, contacts: int, samples: int, spacing: float) -> Buffers:
    """Return zeroed buffers for so many torque and flank rows, impacts, contacts and samples, ``spacing`` [s] apart.

    >>> buffers(0, 1, 1, 2, 0.5).samples.shape
    (2, 9)
    """
    return Buffers(
        np.zeros((ROWS + 2 * effect_rows, ORDER + 2)),
        np.zeros((impacts, IMPACT_COLUMNS)),
        np.zeros((contacts, 3)),
        np.zeros((samples, SAMPLE_COLUMNS)),
        float(spacing),
    )
