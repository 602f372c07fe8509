"""The equations behind hidden effects: every kind of the catalogue, and causes that no catalogue has.

They are written from what the contract and the papers say, apart from the laws that the models use: the machine that
makes the data and the models that explain them share no equation.
"""

from __future__ import annotations

from math import atan2, copysign, cos, exp, floor, pi, sqrt

import numpy as np

from gears3d.kernels import njit

ACTIVE, REVERSE, FREE = 0, 1, 2
AMONG = 40  # Places to a pitch at which the movement of flanks by teeth is looked at
DRIVE, LOOSE = 0.0, 1.0

# What ``Machine.foreign`` rows begin with
BEARING, COGGING, STICK_SLIP, DRIVE_ANGLE, ADHESION, IMPACT_ANGLE, WARMING = range(7)


EDGE_POINTS = 400  # Rows of the gap outside the path of contact

# Everything that acts on the loose gear, SI; a table holds as many rows as its ``n_`` says
MACHINE = np.dtype(
    [
        ("rb1", "f8"),  # base radius of the drive, m
        ("rb2", "f8"),  # base radius of the loose gear, m
        ("inertia", "f8"),  # of the loose gear, kg·m²
        ("backlash", "f8"),  # m
        ("centre", "f8"),  # distance of the axes, m
        ("speed", "f8"),  # mean of the drive, rad/s
        ("drag", "f8"),  # base Coulomb torque, N·m
        ("coulomb", "f8"),  # further dry torque, N·m
        ("viscous", "f8"),  # N·m·s/rad
        ("mesh_drag", "f8"),  # N·m·s/rad in contact
        ("friction", "f8"),  # of the flanks, over base radius times force
        ("drift", "f8", (2,)),  # relative change of the base drag in the end; time constant, s
        ("power", "f8", (2,)),  # torque at 1 rad/s, N·m; exponent
        ("differential", "f8", (2,)),  # N·m·s/rad; speed of the shaft, rad/s
        ("impact", "f8", (5,)),  # restitution; slope, s/m; asymmetry; standard deviation; stick velocity, m/s
        ("spring", "f8", (2,)),  # stiffness, N/m, and damping, N·s/m, of the teeth; 0 for rigid ones
        ("film", "f8", (6,)),  # wedge, N·s; squeeze, N·s·m^0.5; rolling radii, m; cos βb; layer, m
        ("second", "f8", (4,)),  # body behind a coupling: kg·m²; N·m/rad; N·m·s/rad; half play, rad
        ("pitch", "f8", (2,)),  # of the drive's teeth, rad; where the reverse flank of tooth 1 is at the pitch point
        ("edge", "f8", (EDGE_POINTS, 3)),  # angle, rad; gap outside the path of contact, m; its slope
        ("n_sines", "i8"),
        ("sines", "f8", (16, 3)),  # of the drive's speed: amplitude, rad/s; circular frequency, rad/s; phase
        ("n_waves", "i8"),
        ("waves", "f8", (16, 5)),  # gear; order; phase; movement of s on the active and on the reverse flank, m
        ("n_axes", "i8"),
        ("axes", "f8", (8, 3)),  # gear; offset of its teeth, m; phase
        ("n_position", "i8"),
        ("position", "f8", (8, 3)),  # over the loose gear's angle: order; amplitude, N·m; phase
        ("n_teeth", "i8"),
        ("teeth", "f8", (8, 5)),  # gear; teeth; number from 0; material on the active and on the reverse flank, m
        ("n_foreign", "i8"),
        ("foreign", "f8", (8, 5)),  # code and four numbers
    ],
    align=True,
)


@njit(cache=True)
def drive(m, t):
    """Return angle, speed and acceleration of the drive at time ``t``; the angle is 0 at t = 0."""
    angle, speed, acceleration = m.speed * t, m.speed, 0.0
    for i in range(m.n_sines):
        size, w, phase = m.sines[i, 0], m.sines[i, 1], m.sines[i, 2]
        angle += size / w * (np.cos(phase) - np.cos(w * t + phase))
        speed += size * np.sin(w * t + phase)
        acceleration += size * w * np.cos(w * t + phase)
    return angle, speed, acceleration


@njit(cache=True)
def _off_axis(m, side, x, offset, gear):
    """Movement of s with eccentric teeth and its derivative over their own angle x: two involutes on a moved centre.

    With centres a' apart and their line turned by γ (in the drive's sense) base circles that unwind on each other give
    s = -(Rb1 + Rb2)·(γ ± (inv α' - inv α)), + on the active flank; cos α' = (Rb1 + Rb2)/a'.
    """
    base, a = m.rb1 + m.rb2, m.centre
    turn = 1.0 if gear == LOOSE else -1.0
    sign = 1.0 if side == ACTIVE else -1.0
    across, along = offset * np.sin(x), a - offset * np.cos(x)
    apart2 = along * along + across * across
    root, root0 = sqrt(apart2 - base * base), sqrt(a * a - base * base)
    inv = root / base - np.arctan(root / base) - root0 / base + np.arctan(root0 / base)
    gamma = turn * atan2(across, along)
    slope = turn * (a * offset * np.cos(x) - offset * offset) / apart2
    return -base * (gamma + sign * inv), -base * slope - sign * root / apart2 * a * offset * np.sin(x)


@njit(cache=True)
def _edge(m, psi):
    """Gap of a pair of teeth, psi past the pitch point, where one's tip meets the other's flank outside the path."""
    low, high = 0, EDGE_POINTS - 1
    if psi <= m.edge[low, 0] or psi >= m.edge[high, 0]:
        return 1.0, 0.0, 0.0
    while high - low > 1:
        middle = (low + high) // 2
        if m.edge[middle, 0] <= psi:
            low = middle
        else:
            high = middle
    h = m.edge[high, 0] - m.edge[low, 0]
    u = (psi - m.edge[low, 0]) / h
    y0, y1, d0, d1 = m.edge[low, 1], m.edge[high, 1], m.edge[low, 2] * h, m.edge[high, 2] * h
    c2, c3 = 3.0 * (y1 - y0) - 2.0 * d0 - d1, 2.0 * (y0 - y1) + d0 + d1
    return y0 + u * (d0 + u * (c2 + u * c3)), (d0 + u * (2.0 * c2 + 3.0 * u * c3)) / h, (2.0 * c2 + 6.0 * u * c3) / h**2


@njit(cache=True)
def _material(m, side, k):
    """What the pair of teeth k has in the way on a flank, both gears' and the drive's alone.

    Pair 0 is that of both teeth 1 on the active flank; the reverse flank of a drive's tooth meets the next loose one.
    """
    both, of_drive = 0.0, 0.0
    for i in range(m.n_teeth):
        gear, teeth, number = m.teeth[i, 0], int(m.teeth[i, 1]), int(m.teeth[i, 2])
        shift = 1 if gear == LOOSE and side == REVERSE else 0
        if (k + shift - number) % teeth == 0:
            both += m.teeth[i, 3 + side]
            if gear == DRIVE:
                of_drive += m.teeth[i, 3 + side]
    return both, of_drive


@njit(cache=True)
def _tooth(m, side, th1):
    """Movement of s by pitch deviations, its first two derivatives over the drive's angle, and the pair that leads."""
    best, d, dd, which = -1e9, 0.0, 0.0, 0
    sign = 1.0 if side == ACTIVE else -1.0
    at = th1 - (0.0 if side == ACTIVE else m.pitch[1])
    here = floor(at / m.pitch[0] + 0.5)
    for k in range(here - 3, here + 4):
        both, of_drive = _material(m, side, k)
        gap, slope, bend = _edge(m, sign * (at - k * m.pitch[0]) + of_drive / m.rb1)
        if both - gap > best:
            best, d, dd, which = both - gap, -sign * slope, -bend, k
    return sign * best, sign * d, sign * dd, which


def moved(m) -> float:
    """Return by how much pitch deviations move either flank at most [m]."""
    turn = m["pitch"][0] * np.arange(0.0, float(np.max(m["teeth"][:, 1])), 1.0 / AMONG)
    return max((abs(_tooth(m, side, at)[0]) for side in (ACTIVE, REVERSE) for at in turn), default=0.0)


@njit(cache=True)
def flank(m, side, t, th1, th2):
    """Where a flank is touched: s, its derivatives over both angles, the second ones, and the pair of teeth."""
    s, d1, d2, d11, d22, which = 0.0, 0.0, 0.0, 0.0, 0.0, 0
    if side == REVERSE:
        s = m.backlash
    for i in range(m.n_waves):
        order, size = m.waves[i, 1], m.waves[i, 3 + side]
        x = order * (th1 if m.waves[i, 0] == DRIVE else th2) + m.waves[i, 2]
        s += size * np.cos(x)
        if m.waves[i, 0] == DRIVE:
            d1 -= size * order * np.sin(x)
            d11 -= size * order * order * np.cos(x)
        else:
            d2 -= size * order * np.sin(x)
            d22 -= size * order * order * np.cos(x)
    for i in range(m.n_axes):
        gear, offset = m.axes[i, 0], m.axes[i, 1]
        x = (th1 if gear == DRIVE else th2) + m.axes[i, 2]
        move, slope = _off_axis(m, side, x, offset, gear)
        bend = (_off_axis(m, side, x + 1e-4, offset, gear)[1] - _off_axis(m, side, x - 1e-4, offset, gear)[1]) / 2e-4
        s += move
        if gear == DRIVE:
            d1 += slope
            d11 += bend
        else:
            d2 += slope
            d22 += bend
    if m.n_teeth:
        move, slope, bend, which = _tooth(m, side, th1)
        s, d1, d11 = s + move, d1 + slope, d11 + bend
    if side == REVERSE:
        for i in range(m.n_foreign):
            if m.foreign[i, 0] == WARMING:
                s += m.foreign[i, 1] * (1.0 - exp(-t / m.foreign[i, 2]))
    return s, d1, d2, d11, d22, which


@njit(cache=True)
def gap(m, side, t, th2, w2):
    """Distance to a flank, its rate, the lever of a force there [m], and the pair of teeth; an oil layer counts."""
    th1, w1, _ = drive(m, t)
    s, d1, d2, _, _, which = flank(m, side, t, th1, th2)
    sign = 1.0 if side == ACTIVE else -1.0
    apart = sign * (m.rb2 * th2 - m.rb1 * th1 - s) - m.film[5]
    return apart, sign * ((m.rb2 - d2) * w2 - (m.rb1 + d1) * w1), sign * (m.rb2 - d2), which


@njit(cache=True)
def smooth_torque(m, t, th2, w2, touching):
    """Resisting torque that does not ask for the direction of motion."""
    torque = m.viscous * w2 + m.differential[0] * (w2 - m.differential[1])
    if touching:
        torque += m.mesh_drag * w2
    for i in range(m.n_position):
        torque += m.position[i, 1] * np.cos(m.position[i, 0] * th2 + m.position[i, 2])
    for i in range(m.n_foreign):
        code, a, b = m.foreign[i, 0], m.foreign[i, 1], m.foreign[i, 2]
        c, d = m.foreign[i, 3], m.foreign[i, 4]
        if code == BEARING:
            torque += a * np.cos(b * th2 + c)
        elif code == COGGING:
            torque += a * (w2 / d) * np.cos(b * th2 + c)
        elif code == STICK_SLIP:
            torque += a * _sawtooth(b * th2 / (2.0 * pi) + c, d)
        elif code == DRIVE_ANGLE:
            torque += a * np.cos(b * drive(m, t)[0] + c)
        elif code == ADHESION:
            torque += a * m.rb2 * exp(-max(gap(m, ACTIVE, t, th2, w2)[0], 0.0) / b)
    return torque


@njit(cache=True)
def _sawtooth(wound, slip):
    """Sawtooth that rises by 2 in a cycle and falls at its end, over a part of the cycle where slips last."""
    part = wound - floor(wound)
    rise = 2.0 * part - 1.0
    if slip > 0.0:
        if part < 0.5 * slip:
            return rise + 1.0 - 2.0 * part / slip
        if part > 1.0 - 0.5 * slip:
            return rise - 1.0 + 2.0 * (1.0 - part) / slip
    return rise


@njit(cache=True)
def dry_torque(m, t, w2):
    """Size of the torque that goes against the direction of motion."""
    drag = m.drag * (1.0 + m.drift[0] * (1.0 - exp(-t / m.drift[1]))) + m.coulomb
    return drag + (m.power[0] * abs(w2) ** m.power[1] if m.power[0] != 0.0 else 0.0)


@njit(cache=True)
def push(m, side, t, th2, w2, pressed):
    """Force of a compliant flank, if it was touched, force of the oil before it, and their lever."""
    apart, rate, lever, _ = gap(m, side, t, th2, w2)
    force, film = 0.0, 0.0
    if pressed and apart < 0.0:
        force = max(0.0, -m.spring[0] * apart - m.spring[1] * rate)
    if m.film[0] > 0.0 or m.film[1] > 0.0:
        helix, layer = m.film[4], m.film[5]
        h = max(apart + layer, layer) * helix
        rolling = abs(drive(m, t)[1] * m.film[2] + w2 * m.film[3])
        film = m.film[0] * rolling / h
        if rate < 0.0:
            film -= m.film[1] * rate * helix / h**1.5
    return force, film * m.film[4], lever


@njit(cache=True)
def coupled(m, th2, w2, th3, w3):
    """Torque on the loose gear from the second body, once its coupling has taken up its play; it never pulls back."""
    if m.second[0] <= 0.0:
        return 0.0
    wound = th3 - th2
    beyond = wound - min(max(wound, -m.second[3]), m.second[3])
    torque = m.second[1] * beyond + m.second[2] * (w3 - w2)
    return torque if m.second[3] == 0.0 or torque * beyond > 0.0 else 0.0


@njit(cache=True)
def accelerate(m, t, th2, w2, th3, w3, direction, pressed):
    """Acceleration of the loose gear off rigid flanks and of the second body.

    ``direction`` is that of dry torque; ``pressed`` the flank that is pressed at present, FREE for neither.
    """
    dry, torque, touching = dry_torque(m, t, w2), 0.0, False
    if m.spring[0] > 0.0 or m.film[0] > 0.0 or m.film[1] > 0.0:
        for side in (ACTIVE, REVERSE):
            force, film, lever = push(m, side, t, th2, w2, side == pressed)
            torque += lever * (force + film)
            dry += m.friction * m.rb2 * force
            touching = touching or force > 0.0
    torque -= smooth_torque(m, t, th2, w2, touching)
    carried = coupled(m, th2, w2, th3, w3)
    torque += carried
    w3dot = -carried / m.second[0] if m.second[0] > 0.0 else 0.0
    if direction == 0.0:
        if abs(torque) <= dry:
            return 0.0, w3dot
        direction = copysign(1.0, torque)
    return (torque - direction * dry) / m.inertia, w3dot


@njit(cache=True)
def restitution(m, side, th2, v, z):
    """Restitution of one impact of approach speed ``v`` on a flank; ``z`` is a standard normal number."""
    e = m.impact[0] + m.impact[1] * abs(v) + (0.5 if side == ACTIVE else -0.5) * m.impact[2] + m.impact[3] * z
    for i in range(m.n_foreign):
        if m.foreign[i, 0] == IMPACT_ANGLE:
            e += m.foreign[i, 1] * cos(m.foreign[i, 2] * th2 + m.foreign[i, 3])
    return min(max(e, 0.0), 1.0)
