"""Free motion between perfect flanks in closed form: dry friction alone, one harmonic of the drive's speed.

The gap between the loose gear and the flank it left is, with x = ω·τ the phase since then,

    g(τ) = g(0) + v·τ ∓ [a·τ²/2 + (Rb1·A/ω)·(cos ψ·(1 − cos x) − sin ψ·(x − sin x))]

with a = Rb2·T/J; Rigaud & Perret-Liaudet 2020, eqs (12)-(14). On a flank the loose gear follows the drive.
"""

from __future__ import annotations

from math import cos, sin

from gears3d.lumped import layout as at
from gears3d.lumped.compile import inner


@inner
def fly(v, pull, size, omega, c0, s0, tau):
    """Return the changes of the gap, its rate and acceleration in flight; ``pull``, ``size`` = ±Rb1·A: flank's sign."""
    x = omega * tau
    if x < 0.7:  # nine terms are exact to rounding, without cancellation
        z = x * x
        versine = z * (1 / 2 - z * (1 / 24 - z * (1 / 720 - z * (1 / 40320 - z * (1 / 3628800 - z / 479001600)))))
        lag = 1 / 6 - z * (1 / 120 - z * (1 / 5040 - z * (1 / 362880 - z * (1 / 39916800 - z / 6227020800))))
        lag *= x * z
        sine = x - lag
    else:
        half, sine = sin(0.5 * x), sin(x)
        versine, lag = 2.0 * half * half, x - sine
    gap = v * tau - (0.5 * pull * tau * tau + size / omega * (c0 * versine - s0 * lag))
    rate = v - (pull * tau + size * (c0 * sine - s0 * versine))
    return gap, rate, -(pull + size * omega * (c0 * (1.0 - versine) - s0 * sine))


@inner
def place(m, state, t, flank, gap, rate, speed, height):
    """Put the state at time t to a gap before a flank, whose bits are kept."""
    amplitude, omega = m[at.HARMONICS], m[at.HARMONICS + 1]
    psi = omega * t + m[at.HARMONICS + 2]
    theta = m[at.MEAN] * t - amplitude / omega * (cos(psi) - m[at.HARMONICS + 3])
    beyond = m[at.BACKLASH] - gap
    displacement = gap if flank == 0 else beyond
    state[at.TIME], state[at.DISPLACEMENT] = t, displacement
    state[at.ANGLE] = (displacement + m[at.RADIUS_DRIVE] * theta) / m[at.RADIUS_LOOSE]
    state[at.SPEED], state[at.DRIVE_SPEED] = speed, m[at.MEAN] + amplitude * sin(psi)
    state[at.GAPS + flank], state[at.RATES + flank] = gap, rate
    state[at.GAPS + 1 - flank], state[at.RATES + 1 - flank] = beyond, -rate
    state[at.HEIGHT], state[at.LIFT] = height, -1.0


@inner
def sample(m, state, count, samples, spacing, end):
    """Take the samples of the step that begins with the state and ends at a time."""
    i, last = count[at.N_SAMPLES], end * (1.0 + 1e-15)  # the last sample's time may be rounded up
    if i >= samples.shape[0] or i * spacing > last:
        return
    amplitude, omega, begin = m[at.HARMONICS], m[at.HARMONICS + 1], state[at.TIME]
    psi, brake, v, start = omega * begin + m[at.HARMONICS + 2], m[at.BASE] * state[at.SIGN] / m[at.INERTIA], 0.0, 0.0
    flies = state[at.MODE] < at.STUCK
    flank = int(state[at.DEPARTED] if flies else state[at.MODE] - at.STUCK)
    if flies:
        v, start = state[at.RATES + flank], state[at.GAPS + flank]
    side = 1.0 - 2.0 * flank
    pull, size = side * m[at.RADIUS_LOOSE] * brake, side * m[at.RADIUS_DRIVE] * amplitude
    c0, s0 = cos(psi), sin(psi)
    while i < samples.shape[0] and i * spacing <= last:
        time = i * spacing
        psi = omega * time + m[at.HARMONICS + 2]
        drive, since = m[at.MEAN] + amplitude * sin(psi), min(max(time - begin, 0.0), end - begin)
        theta = m[at.MEAN] * time - amplitude / omega * (cos(psi) - m[at.HARMONICS + 3])
        gap, rate, speed = start, 0.0, m[at.RADIUS_DRIVE] / m[at.RADIUS_LOOSE] * drive
        if flies:
            way, rate, _ = fly(v, pull, size, omega, c0, s0, since)
            gap, speed = start + way, state[at.SPEED] - brake * since
        displacement = gap if flank == 0 else m[at.BACKLASH] - gap
        row = samples[i]
        row[0], row[1] = time, theta
        row[2] = (displacement + m[at.RADIUS_DRIVE] * theta) / m[at.RADIUS_LOOSE]
        row[3], row[4] = drive, speed
        row[5], row[6] = displacement, side * rate
        i += 1
    count[at.N_SAMPLES] = i
