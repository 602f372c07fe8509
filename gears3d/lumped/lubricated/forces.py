"""What acts on the loose gear at one instant: films, teeth, friction and drag, along the transverse line of action.

A flank at the gap h pushes with wedge·|u|/h − squeeze·ḣ/h^1.5 while it approaches and wedge·|u|/h while it recedes,
h at least the smallest thickness; below that the teeth add K·ε + C·ε̇, which never pulls. What changes its law at some
place (ḣ = 0, h at its smallest) goes by flags that a step holds fast, so that every step sees smooth functions.
"""

from __future__ import annotations

from math import cos, floor, pi, sin, sqrt

from gears3d.lumped.compile import inner
from gears3d.lumped.lubricated import layout as at


@inner
def drive(p, sines, t):
    """Return angle, speed and acceleration of the drive; ``sines``: amplitude [rad/s], omega, phase, its cosine."""
    angle, speed, change = p[at.MEAN] * t, p[at.MEAN], 0.0
    for i in range(len(sines)):
        amplitude, omega = sines[i, 0], sines[i, 1]
        s, c = sin(omega * t + sines[i, 2]), cos(omega * t + sines[i, 2])
        angle -= amplitude / omega * (c - sines[i, 3])
        speed += amplitude * s
        change += amplitude * omega * c
    return angle, speed, change


@inner
def gaps(p, waves, angle, speed, s, v):
    """Return gap and rate of active and reverse flank; ``waves``: gear, order, phase, size on either flank."""
    gap_active, rate_active, gap_reverse, rate_reverse = s, v, p[at.BACKLASH] - s, -v
    for i in range(len(waves)):
        turned, turning = angle, speed
        if waves[i, 0] == 1.0:
            turned = (s + p[at.RADIUS_DRIVE] * angle) / p[at.RADIUS_LOOSE]
            turning = (v + p[at.RADIUS_DRIVE] * speed) / p[at.RADIUS_LOOSE]
        phase = waves[i, 1] * turned + waves[i, 2]
        wave, rise = cos(phase), -waves[i, 1] * turning * sin(phase)
        gap_active -= waves[i, 3] * wave
        rate_active -= waves[i, 3] * rise
        gap_reverse -= waves[i, 4] * wave
        rate_reverse -= waves[i, 4] * rise
    return gap_active, rate_active, gap_reverse, rate_reverse


@inner
def lookup(p, table, angle, column):
    """Return a column of the table over one pitch, by the cubic through four points."""
    count = len(table)
    x = angle * p[at.TEETH] / (2.0 * pi)
    x = (x - floor(x)) * count
    i = min(int(x), count - 1)
    u = x - i
    before, here = table[i - 1, column], table[i, column]
    after, later = table[(i + 1) % count, column], table[(i + 2) % count, column]
    bend = 2.0 * before - 5.0 * here + 4.0 * after - later + u * (3.0 * (here - after) + later - before)
    return here + 0.5 * u * (after - before + u * bend)


@inner
def _flank(p, table, flags, flank, angle, rolling, gap, rate):
    """Return the forces of wedge, squeeze, spring and damper of one flank."""
    inside = flags[at.INSIDE + flank] == 1
    if inside and p[at.PUBLISHED] == 1.0:
        stiffness = lookup(p, table, angle, at.STIFFNESS + flank)
        damping = _damping(p, stiffness)
        return 0.0, 0.0, -stiffness * gap, -damping * rate
    h = p[at.FLOOR]
    if not inside or p[at.PUBLISHED] == 1.0:
        h = max(gap, (0.25 if p[at.PUBLISHED] == 0.0 else 1.0) * h)  # a step that is thrown away may look further
    wedge, squeeze = p[at.WEDGE] * rolling / h, 0.0
    if flags[at.APPROACHING + flank] == 1:
        squeeze = -p[at.SQUEEZE] * rate / (h * sqrt(h))
    if not inside:
        return wedge, squeeze, 0.0, 0.0
    deep = p[at.FLOOR] - gap
    stiffness = lookup(p, table, angle, at.STIFFNESS + flank)
    share = 1.0
    if deep < p[at.RAMP]:
        share = deep / p[at.RAMP] * (2.0 - deep / p[at.RAMP])
    spring, damper = stiffness * deep, -_damping(p, stiffness) * share * rate
    if deep > 0.0 and spring + damper < 0.0:
        damper = -spring
    return wedge, squeeze, spring, damper


@inner
def _damping(p, stiffness):
    """Return the damping of the teeth [N·s/m]: given, or a ratio of the critical one."""
    return p[at.FIXED_DAMPING] if p[at.FIXED_DAMPING] >= 0.0 else p[at.DAMPING] * sqrt(stiffness)


@inner
def _resisting(p, powers, omega):
    """Return the torque of drag on the loose gear."""
    sense = 1.0 if omega > 0.0 else -1.0 if omega < 0.0 else 0.0
    torque = p[at.TORQUE] * sense + p[at.VISCOUS] * omega - p[at.CARRIED]
    for i in range(len(powers)):
        torque += powers[i, 0] * sense * abs(omega) ** powers[i, 1]
    return torque


@inner
def act(p, sines, waves, powers, table, flags, t, s, v, out):
    """Write the parts of the force at a point, and return the acceleration of the displacement."""
    angle, speed, change = drive(p, sines, t)
    gap_active, rate_active, gap_reverse, rate_reverse = gaps(p, waves, angle, speed, s, v)
    moving = v + p[at.RADIUS_DRIVE] * speed
    omega = moving / p[at.RADIUS_LOOSE]
    rolling = abs(p[at.ROLL_DRIVE] * speed + p[at.ROLL_LOOSE] * omega)
    w0, q0, k0, c0 = _flank(p, table, flags, 0, angle, rolling, gap_active, rate_active)
    w1, q1, k1, c1 = _flank(p, table, flags, 1, angle, rolling, gap_reverse, rate_reverse)
    active, reverse = w0 + q0 + k0 + c0, w1 + q1 + k1 + c1
    rubbing = 0.0
    if p[at.RUBBING] != 0.0 and omega != 0.0:
        rubbing = -p[at.RUBBING] * (abs(active) + abs(reverse)) * (1.0 if omega > 0.0 else -1.0)
    if flags[at.INSIDE] == 1:
        rubbing += lookup(p, table, angle, at.LEVER) * (k0 + c0)
    if flags[at.INSIDE + 1] == 1:
        rubbing += lookup(p, table, angle, at.LEVER + 1) * (k1 + c1)
    if p[at.SHEARING] != 0.0:
        sliding = p[at.SHEARING] * (speed + omega)
        rubbing += sliding * lookup(p, table, angle, at.SHEAR) / sqrt(max(gap_active, p[at.FLOOR]))
        rubbing += sliding * lookup(p, table, angle, at.SHEAR + 1) / sqrt(max(gap_reverse, p[at.FLOOR]))
    drag = _resisting(p, powers, omega) / p[at.RADIUS_LOOSE]
    total = (active - reverse + rubbing - drag) / p[at.MASS] - p[at.RADIUS_DRIVE] * change
    out[at.ACCELERATION], out[at.ACTIVE_FORCE], out[at.REVERSE_FORCE] = total, active, reverse
    out[at.OMEGA_DRIVE], out[at.OMEGA_LOOSE] = speed, omega
    out[at.GAP], out[at.GAP + 1], out[at.GAP_RATE], out[at.GAP_RATE + 1] = (
        gap_active,
        gap_reverse,
        rate_active,
        rate_reverse,
    )
    out[at.POWER + at.MESH_WORK] = (active - reverse) * moving
    out[at.POWER + at.DRAG_WORK] = drag * moving
    out[at.POWER + at.FRICTION_WORK] = rubbing * moving
    out[at.POWER + at.SPRING_WORK] = k0 * rate_active + k1 * rate_reverse
    out[at.POWER + at.DAMPING_WORK] = c0 * rate_active + c1 * rate_reverse
    out[at.POWER + at.SQUEEZE_WORK] = q0 * rate_active + q1 * rate_reverse
    out[at.POWER + at.WEDGE_WORK] = w0 * rate_active + w1 * rate_reverse
    out[at.POWER + at.DRIVE_WORK] = active * (moving - rate_active) - reverse * (
        moving + rate_reverse
    )  # what the flanks themselves move with: the drive's speed and that of its waves
    return total
