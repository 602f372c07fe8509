"""Forces and torques on the loose gear at one instant, for steps of the integrator and for events at the flanks.

Each flank pushes with f = wedge·|u|/h − squeeze·min(ḣ, 0)/h^1.5, h being the gap but at least the film's smallest
thickness, where the flanks touch, and u the speed that draws oil in (the lubricated dual-clutch transmission, eqs (11)
to (14)); behind that, with K·ε + C·ε̇ of compliant teeth. Gaps are counted from where the flanks touch. A carried body
acts on the loose gear through a torsional spring with damping and play. Laws that change at some place use the branch
of the state, so that every step has smooth functions.
"""

from __future__ import annotations

from math import cos, exp, floor, inf, pi, sin, sqrt
from typing import NamedTuple

from gears3d.lumped import layout as at
from gears3d.lumped.compile import tight
from gears3d.lumped.cursors import derivatives, page
from gears3d.lumped.law import thrust
from gears3d.lumped.torques import HARMONIC, POWER, RELAX, SLOW, TABLE

THINNEST = 0.25  # smallest thickness of a film in rejected steps, as a part of its smallest thickness


class Acting(NamedTuple):
    """Forces and torques, and the accelerations that follow.

    Args:
        rate: acceleration of the displacement [m/s²].
        omega_drive: speed of the drive [rad/s].
        omega: speed of the loose gear [rad/s].
        gap_active: [m].
        rate_active: [m/s].
        gap_reverse: [m].
        rate_reverse: [m/s].
        push_active: force of film and teeth on the active flank [N].
        push_reverse: the same on the reverse flank [N].
        teeth_active: force of the teeth that are pressed in on the active flank, negative where they would pull [N].
        teeth_reverse: the same on the reverse flank [N].
        pull: torque that resists independently of the direction of motion, less that of the flanks [N·m].
        dry: torque that resists motion in any direction [N·m].
        rolling: speed that draws oil in, positive in the sense in which it did so last [m/s].
        reaction: force of the bare flank on a gear in contact with it [N].
        twist: torque of the carried body's spring on the loose gear, negative where play would pull [N·m].
        gained: acceleration of the loose gear [rad/s²].
        twisting: acceleration of the carried body against the loose gear [rad/s²].
        by_mesh: power of the flanks on the loose gear [W].
        by_drag: power that drag takes [W].
        by_friction: power of friction in the mesh on the loose gear [W].
        by_springs: power of the teeth's springs on the gaps [W].
        by_dampers: of their dampers [W].
        by_squeeze: of the films' squeeze [W].
        by_wedge: of their wedge [W].
        by_drive: power of the flanks' own motion, that of the drive and its waves, on the mesh [W].
    """

    rate: float
    omega_drive: float
    omega: float
    gap_active: float
    rate_active: float
    gap_reverse: float
    rate_reverse: float
    push_active: float
    push_reverse: float
    teeth_active: float
    teeth_reverse: float
    pull: float
    dry: float
    rolling: float
    reaction: float
    twist: float
    gained: float
    twisting: float
    by_mesh: float
    by_drag: float
    by_friction: float
    by_springs: float
    by_dampers: float
    by_squeeze: float
    by_wedge: float
    by_drive: float


@tight
def imposed(m, state, t):
    """Return angle, speed and acceleration of the drive; Rigaud & Perret-Liaudet 2020, eq. (1)."""
    angle, speed, change = m[at.MEAN] * t, m[at.MEAN], 0.0
    for i in range(int(m[at.N_HARMONICS])):
        row = at.HARMONICS + at.PER_HARMONIC * i
        amplitude, omega = m[row], m[row + 1]
        s, c = sin(omega * t + m[row + 2]), cos(omega * t + m[row + 2])
        angle -= amplitude / omega * (c - m[row + 3])
        speed += amplitude * s
        change += amplitude * omega * c
    if m[at.DRIVE_TABLE] >= 0.0:
        value, slope, bend = derivatives(m, state, int(m[at.DRIVE_TABLE]), t)
        angle, speed, change = angle + value, speed + slope, change + bend
    return angle, speed, change


@tight
def material(m, state, gear, angle):
    """Return a gear's deviations with two derivatives over its angle, of the active and of the reverse flank."""
    active = slope = bend = reverse = incline = arch = 0.0
    if gear == 0 and m[at.FLANK_TABLE] >= 0.0:
        active, slope, bend = derivatives(m, state, int(m[at.FLANK_TABLE]), angle)
        reverse, incline, arch = derivatives(m, state, int(m[at.FLANK_TABLE + 1]), angle)
    for i in range(int(m[at.N_FLANKS])):
        row = int(m[at.AT_FLANKS]) + at.PER_FLANK * i
        if int(m[row]) == gear:
            order, turn = m[row + 1], m[row + 1] * angle + m[row + 2]
            c, s = cos(turn), -order * sin(turn)
            active, slope, bend = active + m[row + 3] * c, slope + m[row + 3] * s, bend - m[row + 3] * order * order * c
            reverse, incline = reverse + m[row + 4] * c, incline + m[row + 4] * s
            arch -= m[row + 4] * order * order * c
    if gear == 0:
        active += m[at.LAYER]  # on the reverse flanks it narrows the backlash
    return active, slope, bend, reverse, incline, arch


@tight
def resisting(m, state, phase, t, angle, speed, sign):
    """Return the resisting torques independent of the direction of motion, and against the motion [N·m]."""
    base = at.BASE + 3 * phase
    pull, dry = m[base + 1] * speed - m[base + 2], m[base]
    for i in range(int(m[at.N_TORQUES])):
        row = int(m[at.AT_TORQUES]) + at.PER_TORQUE * i
        if int(m[row + 1]) >> phase & 1:
            code, first, second = m[row], m[row + 2], m[row + 3]
            if code == POWER:
                if sign * speed >= SLOW:
                    pull += first * (sign * speed) ** second * sign
                elif sign != 0.0:
                    pull += first * SLOW ** (second - 1.0) * speed
            elif code == HARMONIC:
                pull += second * cos(first * angle + m[row + 4])
            elif code == RELAX:
                dry += first * (1.0 - exp(-t / second))
            elif code == TABLE:
                i = int(first)
                variable = int(m[int(m[at.AT_TABLES]) + at.PER_TABLE * i])
                place, _, start = page(m, state, i)
                x = t if variable == at.TIME_TABLE else speed if variable == at.OMEGA2 else angle
                pull += m[place] + m[place + 1] * (x - start)
    return pull, dry


@tight
def _film(m, state, flank, gap, rate, rolling):
    """Return the forces of wedge and squeeze of a flank."""
    h = m[at.FLOOR]
    if h == 0.0 or (m[at.PUBLISHED] > 0.0 and state[at.INSIDE + flank] != at.CLEAR):
        return 0.0, 0.0
    if state[at.INSIDE + flank] == at.CLEAR:
        h = max(gap + m[at.LAYER], (1.0 if m[at.PUBLISHED] > 0.0 else THINNEST) * h)
    thin = 1.0 / h
    squeeze = 0.0
    if state[at.SQUEEZED + flank] > 0.0:
        squeeze = -m[at.SQUEEZE] * rate * (thin * sqrt(thin))
    return m[at.WEDGE] * rolling * thin, squeeze


@tight
def _lookup(m, angle, column):
    """Return a column of the table of compliant teeth at an angle of the drive."""
    x = angle * m[at.TEETH] / (2.0 * pi)
    x = (x - floor(x)) * m[at.POINTS]
    i = min(int(x), int(m[at.POINTS]) - 1)
    x -= i
    first = int(m[at.AT_TEETH]) + at.PER_POINT * (at.TOOTH_COLUMNS * i + column)
    total = m[first]
    for k in range(1, at.PER_POINT):
        total = total * x + m[first + k]
    return total


@tight
def _teeth(m, state, flank, gap, rate, angle):
    """Return the forces of spring and damper of compliant teeth that are pressed in, as if they could pull."""
    if state[at.INSIDE + flank] == at.CLEAR:
        return 0.0, 0.0
    stiffness, damping = m[at.STIFFNESS], m[at.DAMPING]
    if m[at.AT_TEETH] > 0.0:
        stiffness = _lookup(m, angle, at.TOOTH_STIFFNESS + flank)
    if m[at.CRITICAL] > 0.0:
        damping = m[at.CRITICAL] * sqrt(stiffness)
    if m[at.PUBLISHED] > 0.0:
        return -stiffness * (gap + m[at.LAYER]), -damping * rate
    if m[at.RAMP] > 0.0 and -gap < m[at.RAMP]:
        damping *= -gap / m[at.RAMP] * (2.0 + gap / m[at.RAMP])
    return -stiffness * gap, -damping * rate


@tight
def _twisted(m, state, twist, rate):
    """Return the torque of the carried body's spring on the loose gear, as if its play could pull."""
    if m[at.PLAY] == 0.0:
        return m[at.TORSION] * twist + m[at.TORSION_DAMPING] * rate
    side = state[at.TWISTED]
    if side == 0.0:
        return 0.0
    return m[at.TORSION] * (twist - 0.5 * side * m[at.PLAY]) + m[at.TORSION_DAMPING] * rate


@tight
def acting(m, state, t, y):
    """Return forces and torques in a state: displacement, its rate, twist of the carried body, its rate."""
    angle, speed, change = imposed(m, state, t)
    s, v, sign, per = y[0], y[1], state[at.SIGN], 1.0 / m[at.RADIUS_LOOSE]
    omega, theta = (v + m[at.RADIUS_DRIVE] * speed) * per, (s + m[at.RADIUS_DRIVE] * angle) * per
    gap0, rate0, gap1, rate1 = s - m[at.LAYER], v, m[at.BACKLASH] - s, -v
    a0 = a1 = a2 = r0 = r1 = r2 = b0 = b1 = b2 = q0 = q1 = q2 = 0.0
    if m[at.DEVIATES] > 0.0:
        a0, a1, a2, r0, r1, r2 = material(m, state, 0, angle)
        if m[at.ON_LOOSE] > 0.0:
            b0, b1, b2, q0, q1, q2 = material(m, state, 1, theta)
        gap0, rate0 = s - a0 - b0, rate0 - a1 * speed - b1 * omega
        gap1, rate1 = gap1 - r0 - q0, rate1 - r1 * speed - q1 * omega
    rolling = state[at.SENSE] * (m[at.ROLL_DRIVE] * speed + m[at.ROLL_LOOSE] * omega)
    mode, phase = int(state[at.MODE]), 0
    riding = at.STUCK <= mode < at.PRESSED
    if riding and state[at.SLIDE] == 0.0:
        phase = 1 + mode - at.STUCK
    elif mode >= at.PRESSED:
        phase = 1 + mode - at.PRESSED
    pull, dry = resisting(m, state, phase, t, theta, omega, sign)
    drag, spring0, damper0 = pull + sign * dry, *_teeth(m, state, 0, gap0, rate0, angle)
    spring1, damper1 = _teeth(m, state, 1, gap1, rate1, angle)
    wedge0, squeeze0 = _film(m, state, 0, gap0, rate0, rolling)
    wedge1, squeeze1 = _film(m, state, 1, gap1, rate1, rolling)
    teeth0, teeth1, push0, push1 = spring0 + damper0, spring1 + damper1, wedge0 + squeeze0, wedge1 + squeeze1
    rubbing = 0.0
    if state[at.INSIDE] == at.PUSHES:
        push0, dry = push0 + teeth0, dry + m[at.FRICTION] * m[at.RADIUS_LOOSE] * teeth0
        if m[at.AT_TEETH] > 0.0:
            rubbing += _lookup(m, angle, at.LEVER) * teeth0
    else:
        spring0 = damper0 = 0.0
    if state[at.INSIDE + 1] == at.PUSHES:
        push1, dry = push1 + teeth1, dry + m[at.FRICTION] * m[at.RADIUS_LOOSE] * teeth1
        if m[at.AT_TEETH] > 0.0:
            rubbing += _lookup(m, angle, at.LEVER + 1) * teeth1
    else:
        spring1 = damper1 = 0.0
    if m[at.SHEARING] != 0.0:
        sliding = m[at.SHEARING] * (speed + omega)
        rubbing += sliding * _lookup(m, angle, at.SHEAR) / sqrt(max(gap0 + m[at.LAYER], m[at.FLOOR]))
        rubbing += sliding * _lookup(m, angle, at.SHEAR + 1) / sqrt(max(gap1 + m[at.LAYER], m[at.FLOOR]))
    rubbed = rubbing - (pull + sign * dry - drag) * per
    pull -= m[at.RADIUS_LOOSE] * (push0 - push1 + rubbing)
    twist = moved = 0.0
    if m[at.CARRIED] > 0.0:
        twist = _twisted(m, state, y[2], y[3])
        if m[at.PLAY] == 0.0 or state[at.TWISTING] > 0.0:
            pull -= twist
            moved = -twist / m[at.CARRIED]
    gained = 0.0 if sign == 0.0 else -(pull + sign * dry) / m[at.INERTIA]
    rate = m[at.RADIUS_LOOSE] * gained - m[at.RADIUS_DRIVE] * change
    reaction = inf
    if riding:
        flank, side = mode - at.STUCK, 1.0
        d1, d2, e1, e2 = a1, a2, b1, b2
        if flank == 1:
            side, d1, d2, e1, e2 = -1.0, r1, r2, q1, q2
        carried = d2 * speed * speed + d1 * change + e2 * omega * omega + e1 * m[at.RADIUS_DRIVE] * change * per
        rate = side * carried / (1.0 - side * e1 * per)
        gained = (rate + m[at.RADIUS_DRIVE] * change) * per
        reaction = (m[at.INERTIA] * gained + pull + sign * dry) * thrust(m, side, sign)
    moving = v + m[at.RADIUS_DRIVE] * speed
    return Acting(
        rate, speed, omega, gap0, rate0, gap1, rate1, push0, push1, teeth0, teeth1, pull, dry, rolling, reaction,
        twist, gained, moved - gained,
        (push0 - push1) * moving, drag * per * moving, rubbed * moving, spring0 * rate0 + spring1 * rate1,
        damper0 * rate0 + damper1 * rate1, squeeze0 * rate0 + squeeze1 * rate1, wedge0 * rate0 + wedge1 * rate1,
        push0 * (moving - rate0) - push1 * (moving + rate1),
    )  # fmt: skip
