"""What acts on the loose gear at one instant: films, teeth, friction and drag, along the transverse line of action.

A flank at the gap h pushes with wedge·|u|/h − squeeze·ḣ/h^1.5 while it approaches and wedge·|u|/h while it recedes,
h at least the smallest thickness; below that the teeth add K·ε + C·ε̇, which never pulls. What changes its law at some
place (ḣ = 0, h at its smallest) goes by flags that a step holds fast, so that every step sees smooth functions.
"""

from __future__ import annotations

from math import cos, floor, pi, sin, sqrt

from gears3d.lumped.compile import inner, tight
from gears3d.lumped.lubricated import layout as at


@tight
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


@tight
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


@tight
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


@tight
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
    thin = 1.0 / h
    wedge, squeeze = p[at.WEDGE] * rolling * thin, 0.0
    if flags[at.APPROACHING + flank] == 1:
        squeeze = -p[at.SQUEEZE] * rate * (thin * sqrt(thin))
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


@tight
def _damping(p, stiffness):
    """Return the damping of the teeth [N·s/m]: given, or a ratio of the critical one."""
    return p[at.FIXED_DAMPING] if p[at.FIXED_DAMPING] >= 0.0 else p[at.DAMPING] * sqrt(stiffness)


@tight
def _resisting(p, powers, omega):
    """Return the torque of drag on the loose gear."""
    sense = 1.0 if omega > 0.0 else -1.0 if omega < 0.0 else 0.0
    torque = p[at.TORQUE] * sense + p[at.VISCOUS] * omega - p[at.CARRIED]
    for i in range(len(powers)):
        torque += powers[i, 0] * sense * abs(omega) ** powers[i, 1]
    return torque


@tight
def parts(p, waves, powers, table, flags, driven, s, v):
    """Return what acts at a point.

    Args:
        p: numbers of the model.
        waves: of the flanks.
        powers: of the drag.
        table: over one pitch.
        flags: held fast.
        driven: angle, speed and acceleration of the drive.
        s: displacement [m].
        v: its rate [m/s].

    Returns:
        Acceleration of the displacement; speeds of drive and loose gear; gap and rate of the active and the reverse
        flank; wedge, squeeze, spring and damper of the active and of the reverse flank; friction and drag.
    """
    angle, speed, change = driven
    gap0, rate0, gap1, rate1 = gaps(p, waves, angle, speed, s, v)
    per_radius = 1.0 / p[at.RADIUS_LOOSE]
    omega = (v + p[at.RADIUS_DRIVE] * speed) * per_radius
    rolling = abs(p[at.ROLL_DRIVE] * speed + p[at.ROLL_LOOSE] * omega)
    w0, q0, k0, c0 = _flank(p, table, flags, 0, angle, rolling, gap0, rate0)
    w1, q1, k1, c1 = _flank(p, table, flags, 1, angle, rolling, gap1, rate1)
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
        rubbing += sliding * lookup(p, table, angle, at.SHEAR) / sqrt(max(gap0, p[at.FLOOR]))
        rubbing += sliding * lookup(p, table, angle, at.SHEAR + 1) / sqrt(max(gap1, p[at.FLOOR]))
    drag = _resisting(p, powers, omega) * per_radius
    total = (active - reverse + rubbing - drag) * (1.0 / p[at.MASS]) - p[at.RADIUS_DRIVE] * change
    return total, speed, omega, gap0, rate0, gap1, rate1, w0, q0, k0, c0, w1, q1, k1, c1, rubbing, drag


@inner
def act(p, sines, waves, powers, table, flags, t, s, v, out):
    """Write the parts of the force at a point and what they do, and return the acceleration of the displacement."""
    total, speed, omega, gap0, rate0, gap1, rate1, w0, q0, k0, c0, w1, q1, k1, c1, rubbing, drag = parts(
        p, waves, powers, table, flags, drive(p, sines, t), s, v
    )
    active, reverse = w0 + q0 + k0 + c0, w1 + q1 + k1 + c1
    moving = v + p[at.RADIUS_DRIVE] * speed
    out[at.ACCELERATION], out[at.ACTIVE_FORCE], out[at.REVERSE_FORCE] = total, active, reverse
    out[at.OMEGA_DRIVE], out[at.OMEGA_LOOSE] = speed, omega
    out[at.GAP], out[at.GAP + 1], out[at.GAP_RATE], out[at.GAP_RATE + 1] = gap0, gap1, rate0, rate1
    out[at.POWER + at.MESH_WORK] = (active - reverse) * moving
    out[at.POWER + at.DRAG_WORK] = drag * moving
    out[at.POWER + at.FRICTION_WORK] = rubbing * moving
    out[at.POWER + at.SPRING_WORK] = k0 * rate0 + k1 * rate1
    out[at.POWER + at.DAMPING_WORK] = c0 * rate0 + c1 * rate1
    out[at.POWER + at.SQUEEZE_WORK] = q0 * rate0 + q1 * rate1
    out[at.POWER + at.WEDGE_WORK] = w0 * rate0 + w1 * rate1
    # what the flanks themselves move with: the drive's speed and that of its waves
    out[at.POWER + at.DRIVE_WORK] = active * (moving - rate0) - reverse * (moving + rate1)
    return total
